//! How far a prediction may be off for what is not known of the numbers that it rests on.

use super::{Curve, Quantity};
use crate::base::{Estimate, Status};
use crate::twin::{Body, Joint, Model};

/// One number of a body of links, or one that its links share.
#[derive(Clone, Copy)]
enum Known {
    /// Friction force of a link.
    Force(usize),
    Radius,
    Creep,
    Tool,
    /// Friction of the tool of which only a bound is known, at that bound.
    Bound,
    /// Friction and damping of a joint.
    Friction(usize),
    Damping(usize),
    /// Friction of a joint for its damping, or damping for friction: what one speed tells in their sum only.
    Exchanged(usize, bool),
    /// Friction of a joint for that below the link which it holds: one lever tells their sum only.
    Borne(usize),
}

/// Standard deviations from the middle of an interval of 95 % to its end.
const TWO_SIDED: f64 = 1.96;

/// The model with each number of a body of links that is in doubt a standard deviation more, one after the other; of a body by
/// itself the friction of the tool, which decides whether it slides along. What is known in a sum with another only is not moved
/// alone: the sum is what foretells.
pub(super) fn in_doubt(model: &Model, target: &str) -> Vec<Model> {
    let Some(body) = model.twin.body_of(target) else {
        return Vec::new();
    };
    let shared = [Known::Tool, Known::Bound, Known::Radius, Known::Creep];
    let shared = &shared[..if body.joints.is_empty() { 2 } else { shared.len() }];
    let forces = (0..body.links.len()).map(Known::Force);
    let of_joint = |k| {
        [
            Known::Friction(k),
            Known::Damping(k),
            Known::Exchanged(k, true),
            Known::Exchanged(k, false),
            Known::Borne(k),
        ]
    };
    let joints = (0..body.joints.len()).flat_map(of_joint);
    let all = forces.chain(shared.iter().copied()).chain(joints);
    let meshes = body.links.iter().filter_map(|l| l.mesh.clone());
    let own = meshes.filter_map(|m| Some((m.clone(), model.meshes.get(&m)?.clone())));
    let bare = Model {
        twin: model.twin.clone(),
        meshes: own.collect(),
        textures: Default::default(),
    };
    all.filter_map(|which| moved(&bare, &body.name, which)).collect()
}

fn moved(given: &Model, name: &str, which: Known) -> Option<Model> {
    let mut out = given.clone();
    let body = out.twin.bodies.iter_mut().find(|b| b.name == name)?;
    match which {
        Known::Exchanged(k, damped) => return exchanged(body.joints.get_mut(k)?, damped).then_some(out),
        Known::Borne(k) => {
            let lever = given.lever(&body.joints.get(k)?.child)?;
            return borne(body, k, lever).then_some(out);
        }
        Known::Bound => return bounded(body).then_some(out),
        _ => {}
    }
    let mut any = false;
    for estimate in numbers(body, which) {
        let sum = estimate.confounded.is_some();
        if let Some(relative) = estimate
            .sd
            .map(|sd| sd / estimate.value)
            .filter(|r| r.is_finite() && *r > 0.0 && !sum)
        {
            estimate.value *= relative.exp();
            any = true;
        }
    }
    any.then_some(out)
}

/// Friction of the tool at the lower end of its interval, where it was not measured but for a bound; false where it was.
fn bounded(body: &mut Body) -> bool {
    let tools = body.links.iter_mut().filter_map(|l| l.friction.tool.as_mut());
    let mut any = false;
    for estimate in tools.filter(|t| t.status == Status::Assumed) {
        if let Some([low, _]) = estimate.ci95.filter(|[low, _]| *low > 0.0) {
            estimate.value = low;
            any = true;
        }
    }
    any
}

/// A joint that rubs less, by as much as its interval has it, and is `damped` more, or the other way; false where its own load tells
/// the two apart. At the speed that it was moved with the sum stays about as it is; at others that is what is not known.
fn exchanged(joint: &mut Joint, damped: bool) -> bool {
    let (Some(friction), Some(damping)) = (&mut joint.friction, &mut joint.damping) else {
        return false;
    };
    let (Some(rubs), Some(damps), Some(_)) = (friction.ci95, damping.ci95, &damping.confounded) else {
        return false;
    };
    // Both ways are one direction, and count as one.
    let share = std::f64::consts::FRAC_1_SQRT_2 / TWO_SIDED;
    let end = |[low, high]: [f64; 2], up: bool| if up { high } else { low };
    friction.value += share * (end(rubs, !damped) - friction.value);
    damping.value += share * (end(damps, damped) - damping.value);
    true
}

/// A joint that rubs a standard deviation less and holds a link, the lever of whose middle is known, that rubs more on the table; all
/// that stands there presses as before. False where the joint's own load tells its friction.
fn borne(body: &mut Body, k: usize, lever: f64) -> bool {
    let Some(joint) = body.joints.get_mut(k) else {
        return false;
    };
    let friction = joint
        .friction
        .as_mut()
        .filter(|f| f.confounded.is_some() && lever > 0.0);
    let Some((sd, friction)) = friction.and_then(|f| Some((f.sd?, f))) else {
        return false;
    };
    let less = sd.min(friction.value);
    friction.value -= less;
    for (name, more) in [(&joint.child, less / lever), (&joint.parent, -less / lever)] {
        let link = body.links.iter_mut().find(|l| l.name == *name);
        if let Some(force) = link.and_then(|l| l.friction_force.kinetic.as_mut()) {
            force.value = (force.value + more).max(0.0);
        }
    }
    true
}

fn numbers(body: &mut Body, which: Known) -> Vec<&mut Estimate> {
    let links = &mut body.links;
    match which {
        Known::Force(k) => links
            .get_mut(k)
            .and_then(|l| l.friction_force.kinetic.as_mut())
            .into_iter()
            .collect(),
        Known::Radius => links
            .iter_mut()
            .filter_map(|l| l.friction.torsional_radius.as_mut())
            .collect(),
        Known::Creep => links
            .iter_mut()
            .flat_map(|l| [&mut l.friction.creep_speed, &mut l.friction.creep_ratio])
            .flatten()
            .collect(),
        Known::Tool => links.iter_mut().filter_map(|l| l.friction.tool.as_mut()).collect(),
        Known::Friction(k) => body
            .joints
            .get_mut(k)
            .and_then(|j| j.friction.as_mut())
            .into_iter()
            .collect(),
        Known::Damping(k) => body
            .joints
            .get_mut(k)
            .and_then(|j| j.damping.as_mut())
            .into_iter()
            .collect(),
        Known::Bound | Known::Exchanged(..) | Known::Borne(_) => Vec::new(),
    }
}

/// Adds to the squares of the doubts of `curves` what the same curves `with` another number differ by.
pub(super) fn add_squares(squares: &mut Vec<Vec<f64>>, curves: &[Curve], with: &[Curve]) {
    squares.resize(curves.len(), Vec::new());
    for (curve, square) in curves.iter().zip(squares) {
        square.resize(curve.predicted.len(), 0.0);
        let same = with.iter().find(|c| c.label == curve.label);
        let pairs = same.map(|c| c.predicted.iter().zip(&curve.predicted));
        for (sum, (a, b)) in square.iter_mut().zip(pairs.into_iter().flatten()) {
            let by = a - b;
            *sum += if by.is_finite() { by * by } else { 0.0 };
        }
    }
}

/// Adds to the squares of the doubts of all curves of a quantity the same doubt everywhere.
pub(super) fn add_evenly(squares: &mut Vec<Vec<f64>>, curves: &[Curve], quantity: Quantity, doubt: f64) {
    squares.resize(curves.len(), Vec::new());
    for (curve, square) in curves.iter().zip(squares) {
        square.resize(curve.predicted.len(), 0.0);
        if curve.quantity == quantity {
            square.iter_mut().for_each(|s| *s += doubt * doubt);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Confounded, Pose};
    use crate::twin::{JointKind, Link};

    fn in_sum(value: f64, ci95: [f64; 2]) -> Option<Estimate> {
        let confounded = Confounded {
            with: vec!["damping".into()],
            known: "their sum".into(),
            experiment: "another speed".into(),
        };
        let estimate = Estimate::assumed(value, 0.5 * value, "N·m", "test");
        Some(estimate.with_interval(ci95).with_confounded(confounded))
    }

    #[test]
    fn what_a_joint_rubs_less_it_is_damped_more_or_its_child_rubs_on_the_table() {
        let upright = Estimate::known([0.0, 0.0, 1.0], None, "1");
        let joint = Joint {
            name: "hinge".into(),
            kind: JointKind::Revolute,
            parent: "base".into(),
            child: "arm".into(),
            probability: 1.0,
            alternatives: Vec::new(),
            origin: upright.clone(),
            axis: upright,
            pitch: None,
            limits: None,
            travelled: None,
            position: None,
            friction: in_sum(0.02, [0.01, 0.04]),
            damping: in_sum(0.005, [0.0, 0.02]),
            stiffness: None,
            rest: None,
            effort: None,
            effects: Default::default(),
            lateral: None,
        };
        let mut damped = joint.clone();
        assert!(exchanged(&mut damped, true));
        let value = |e: &Option<Estimate>| e.as_ref().map_or(0.0, |e| e.value);
        assert!(value(&damped.friction) < 0.02 && value(&damped.damping) > 0.005);
        let links = ["base", "arm"].map(|name| {
            let mut link = Link::new(name, Pose::identity());
            link.friction_force.kinetic = Some(Estimate::assumed(2.0, 0.2, "N", "test"));
            link
        });
        let mut body = Body {
            name: "base".into(),
            links: links.to_vec(),
            joints: vec![joint],
        };
        assert!(borne(&mut body, 0, 0.05));
        let forces: Vec<f64> = body.links.iter().map(|l| value(&l.friction_force.kinetic)).collect();
        assert!(
            (forces[0] - 1.8).abs() < 1e-12 && (forces[1] - 2.2).abs() < 1e-12,
            "{forces:?}"
        );
        assert!((value(&body.joints[0].friction) - 0.01).abs() < 1e-12);
        // What the joint's own load told is not exchanged for anything.
        body.joints[0].friction = Some(Estimate::assumed(0.02, 0.01, "N·m", "test"));
        body.joints[0].damping = None;
        assert!(!borne(&mut body, 0, 0.05) && !exchanged(&mut body.joints[0], true));
    }

    #[test]
    fn a_finger_of_which_a_bound_is_known_is_tried_at_it() {
        let mut link = Link::new("box", Pose::identity());
        link.friction.tool = Some(Estimate::assumed(0.5, 0.35, "1", "test").with_interval([0.25, 3.0]));
        let mut body = Body {
            name: "box".into(),
            links: vec![link],
            joints: Vec::new(),
        };
        assert!(bounded(&mut body) && body.links[0].friction.tool.as_ref().is_some_and(|t| t.value == 0.25));
        let told = Estimate::measured(0.3, 0.01, "1", Vec::new(), "test");
        body.links[0].friction.tool = Some(told);
        assert!(!bounded(&mut body) && body.links[0].friction.tool.as_ref().is_some_and(|t| t.value == 0.3));
    }

    #[test]
    fn a_doubt_of_places_is_none_of_forces() {
        let curve = |quantity| Curve {
            label: String::new(),
            quantity,
            time: vec![0.0; 3],
            measured: vec![0.0; 3],
            predicted: vec![0.0; 3],
            noise: None,
        };
        let curves = [curve(Quantity::Force), curve(Quantity::Position)];
        let mut squares = vec![vec![4.0; 3]];
        add_evenly(&mut squares, &curves, Quantity::Position, 3.0);
        assert_eq!(squares, [vec![4.0; 3], vec![9.0; 3]]);
    }
}
