//! Which touch would decide an arc of the graph that is still open: a stack that may be glued, a door that may be a drawer.
//!
//! A touch is worth the expected fall of the entropy of the arc's kind (mutual information of kind and outcome; Lindley
//! 1956). Of a stack the outcome is whether the two part; of a joint it is how far the path bends and the child turns,
//! averaged over the radii that are still possible.

use nalgebra::{Point3, Vector3};

use crate::capture::{Kind, Noise, Touch};
use crate::geometry::Mesh;
use crate::twin::{Joint, JointKind, Link, Model, Relation, RelationKind, SUPPORT};

/// A touch and the arc that it should decide.
#[derive(Clone, Debug)]
pub struct ArcTouch {
    /// What to ask of a rig.
    pub touch: Touch,
    /// The two things.
    pub arc: (String, String),
    /// The kinds that it tells apart, most probable first.
    pub parts: Vec<String>,
    /// Expected fall of the entropy of the kind, bits.
    pub bits: f64,
    /// In words: what it is and what would be seen.
    pub why: String,
}

/// A kind with less than this left for the others is decided.
const DECIDED: f64 = 0.95;
/// Probability that two things which merely rest on each other stay together in a lift of the upper one, in a push of
/// it, in a push of the lower one: friction carries them.
const CARRIED: [(Kind, bool, f64); 3] = [
    (Kind::Lift, true, 0.01),
    (Kind::Push, true, 0.25),
    (Kind::Push, false, 0.8),
];
/// How high a lift goes, how far a push, m, and how fast, m/s.
const LIFT: f64 = 0.02;
const PUSH: f64 = 0.03;
const SPEED: f64 = 0.05;
/// Radii that a hinge may have, m: smallest and largest, and how many are averaged over.
const RADII: (f64, f64, usize) = (0.08, 1.2, 7);
/// Ways that a hand may go on, m.
const TRAVELS: [f64; 8] = [0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4];
/// Noise of a tracked position, m, and orientation, rad, where nobody states it, and rows of one touch.
const TRACK: (f64, f64, f64) = (4e-4, 4e-3, 100.0);
/// A hinge turns no farther than this, rad.
const TURN: f64 = 1.5;

/// The touches that would decide what is open, the most telling for each arc, most bits first; `kinds` are what the rig
/// can do.
pub fn arc_touches(model: &Model, noise: &Noise, kinds: &[Kind]) -> Vec<ArcTouch> {
    let stacks = model.twin.relations.iter().filter_map(|r| of_stack(model, r, kinds));
    let joints = model.twin.joints().filter_map(|j| of_joint(model, j, noise, kinds));
    let mut out: Vec<ArcTouch> = stacks.chain(joints).collect();
    out.sort_by(|a, b| b.bits.total_cmp(&a.bits).then_with(|| a.arc.cmp(&b.arc)));
    out
}

/// Entropy of two outcomes, bits.
fn entropy(p: f64) -> f64 {
    let part = |p: f64| if p > 0.0 { -p * p.log2() } else { 0.0 };
    part(p) + part(1.0 - p)
}

/// Bits from a touch under which a bond never parts and mere rest stays together with probability `carried`.
fn bits_of_parting(bond: f64, carried: f64) -> f64 {
    let together = bond + (1.0 - bond) * carried;
    entropy(bond) - together * entropy(bond / together.max(1e-12))
}

/// Bits from one normal reading whose means under the two kinds lie `apart` standard deviations from each other.
fn bits_of_reading(p: f64, apart: f64) -> f64 {
    let (steps, reach) = (400, 6.0);
    let width = (apart + 2.0 * reach) / f64::from(steps);
    let normal = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let left: f64 = (0..steps)
        .map(|k| {
            let x = -reach + width * (f64::from(k) + 0.5);
            let (a, b) = (p * normal(x), (1.0 - p) * normal(x - apart));
            let sum = a + b;
            if sum > 0.0 { width * sum * entropy(a / sum) } else { 0.0 }
        })
        .sum();
    (entropy(p) - left).max(0.0)
}

fn mesh_in_world(model: &Model, link: &Link) -> Option<Mesh> {
    let mesh = model.meshes.get(link.mesh.as_ref()?)?;
    Some(mesh.transformed(&link.pose))
}

fn up(model: &Model) -> Vector3<f64> {
    let support = model.twin.support.as_ref().map(|s| Vector3::from(s.normal));
    let against = -Vector3::from(model.twin.gravity);
    support
        .unwrap_or(against)
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::z)
}

/// Names as a touch and its file carry them.
fn name_of(kind: Kind, target: &str) -> String {
    format!("{}-{}-arc", kind.name(), target.replace('/', "-"))
}

/// For a pair of which nobody knows whether it is held: lift or push one of them.
fn of_stack(model: &Model, relation: &Relation, kinds: &[Kind]) -> Option<ArcTouch> {
    if relation.kind != RelationKind::Unknown || relation.a == SUPPORT {
        return None;
    }
    let bond = 1.0 - relation.probability;
    let (kind, upper, bits) = CARRIED
        .iter()
        .filter(|(kind, _, _)| kinds.contains(kind))
        .map(|(kind, upper, carried)| (*kind, *upper, bits_of_parting(bond, *carried)))
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let target = if upper { &relation.b } else { &relation.a };
    let other = if upper { &relation.a } else { &relation.b };
    let link = model.twin.link(target)?;
    let (low, high) = mesh_in_world(model, link)?.bounds()?;
    let middle = nalgebra::center(&low, &high);
    let up = up(model);
    let half = 0.5 * (high - low).dot(&up.abs());
    let level = up.cross(&Vector3::ith(up.iamin(), 1.0)).normalize();
    let (start, direction, travel) = match kind {
        Kind::Lift => (middle + up * half, up, LIFT),
        _ => (middle - level * (0.5 * (high - low).dot(&level.abs())), level, PUSH),
    };
    let does = if kind == Kind::Lift { "lift" } else { "push" };
    Some(ArcTouch {
        why: format!(
            "{does} {target}: if it comes away from {other} it merely rests there, if it takes it along they are held \
             ({:.0} % so far); worth {bits:.2} bits",
            100.0 * bond
        ),
        touch: Touch {
            name: name_of(kind, target),
            kind,
            target: Some(target.clone()),
            start,
            direction,
            travel,
            speed: SPEED,
            duration: 0.5,
            held_out: false,
        },
        arc: (relation.a.clone(), relation.b.clone()),
        parts: vec!["resting".into(), "fixed".into()],
        bits,
    })
}

/// How far the readings of a hinge and of a slide lie apart after the hand went `travel`, in standard deviations: by the
/// bend of the path (a sagitta is known to `3.4 s / sqrt(N)`) and, where the child's orientation is tracked, its turn.
fn apart(travel: f64, radius: f64, noise: &Noise, oriented: bool) -> f64 {
    let (position, rotation) = (noise.position.unwrap_or(TRACK.0), noise.rotation.unwrap_or(TRACK.1));
    let bend = travel * travel / (8.0 * radius) * TRACK.2.sqrt() / (3.4 * position);
    let turn = if oriented {
        travel / radius * (TRACK.2 / 12.0).sqrt() / rotation
    } else {
        0.0
    };
    bend.hypot(turn)
}

/// The two kinds that are left of a joint, most probable first; `None` where it is decided or they are others.
fn open(joint: &Joint) -> Option<((JointKind, f64), (JointKind, f64))> {
    let rival = joint
        .alternatives
        .iter()
        .max_by(|a, b| a.probability.total_cmp(&b.probability))?;
    let both = [joint.kind, rival.kind];
    let bends = both.contains(&JointKind::Prismatic)
        && both.iter().any(|k| matches!(k, JointKind::Revolute | JointKind::Screw));
    let decided = joint.probability > DECIDED || rival.probability < 1e-3;
    (bends && !decided).then_some(((joint.kind, joint.probability), (rival.kind, rival.probability)))
}

/// For a joint that may be a hinge or a slide: go on, as far as it takes, where the hand is or at the other end of the
/// child.
fn of_joint(model: &Model, joint: &Joint, noise: &Noise, kinds: &[Kind]) -> Option<ArcTouch> {
    let ((first, p), (second, q)) = open(joint)?;
    let kind = [Kind::Pull, Kind::Push].into_iter().find(|k| kinds.contains(k))?;
    let child = model.twin.link(&joint.child)?;
    let oriented = child.mesh.is_some();
    let axis = Vector3::from(joint.axis.value);
    let turning = first != JointKind::Prismatic;
    let at = spots(model, child);
    let share = p / (p + q);
    let mut best: Option<(f64, f64, Point3<f64>)> = None;
    for spot in &at {
        for travel in TRAVELS {
            let radii = radii(joint, spot, turning);
            let each = radii.iter().filter(|r| travel < TURN * **r);
            let bits = each
                .map(|r| bits_of_reading(share, apart(travel, *r, noise, oriented)))
                .sum::<f64>();
            let bits = (p + q) * bits / radii.len() as f64;
            // Of what tells as much the shorter way is taken.
            if best.as_ref().is_none_or(|(most, _, _)| bits > 1.02 * most) {
                best = Some((bits, travel, *spot));
            }
        }
    }
    let (bits, travel, start) = best?;
    let direction = if turning {
        axis.cross(&(start - Point3::from(joint.origin.value)))
            .try_normalize(1e-9)?
    } else {
        axis
    };
    let word = |k: JointKind| format!("{k:?}").to_lowercase();
    let does = if kind == Kind::Pull { "pull" } else { "push" };
    Some(ArcTouch {
        why: format!(
            "{does} {} on by {:.0} mm where it is now: a slide keeps straight, a hinge of up to {:.2} m bends its path beyond \
             the noise ({} {:.0} %, {} {:.0} % so far); worth {bits:.2} bits",
            joint.child,
            1e3 * travel,
            shown(travel, noise, oriented),
            word(first),
            100.0 * p,
            word(second),
            100.0 * q
        ),
        touch: Touch {
            name: name_of(kind, &joint.child),
            kind,
            target: Some(joint.child.clone()),
            start,
            direction,
            travel,
            speed: SPEED,
            duration: 0.3,
            held_out: false,
        },
        arc: (joint.parent.clone(), joint.child.clone()),
        parts: vec![word(first), word(second)],
        bits,
    })
}

/// The largest radius of a hinge that `travel` would show at three standard deviations, m.
fn shown(travel: f64, noise: &Noise, oriented: bool) -> f64 {
    let mut radius = RADII.0;
    while radius < 50.0 && apart(travel, 1.1 * radius, noise, oriented) > 3.0 {
        radius *= 1.1;
    }
    radius
}

/// Where the child could be held: its far ends, or its origin where nobody saw its shape.
fn spots(model: &Model, child: &Link) -> Vec<Point3<f64>> {
    let Some(mesh) = mesh_in_world(model, child) else {
        return vec![Point3::from(child.pose.translation.vector)];
    };
    let Some((low, high)) = mesh.bounds() else {
        return Vec::new();
    };
    let middle = nalgebra::center(&low, &high);
    let size = high - low;
    let half = Vector3::ith(size.imax(), 0.45 * size.max());
    vec![middle + half, middle, middle - half]
}

/// Radii of the hinge that it would be: about the fitted one, or anything where it would rather be a slide.
fn radii(joint: &Joint, spot: &Point3<f64>, turning: bool) -> Vec<f64> {
    let (low, high) = if turning {
        let axis = Vector3::from(joint.axis.value);
        let arm = spot - Point3::from(joint.origin.value);
        let own = (arm - axis * axis.dot(&arm)).norm();
        (0.7 * own, (1.5 * own).min(RADII.1))
    } else {
        (RADII.0, RADII.1)
    };
    let low = low.max(RADII.0);
    let step = (high.max(low) / low).ln() / (RADII.2 as f64 - 1.0);
    (0..RADII.2).map(|k| low * (step * k as f64).exp()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_tells_no_more_than_was_open_and_nothing_where_kinds_agree() {
        for p in [0.1, 0.5, 0.8] {
            assert!(bits_of_reading(p, 0.0) < 1e-6);
            assert!((bits_of_reading(p, 12.0) - entropy(p)).abs() < 1e-3);
            let between = bits_of_reading(p, 2.0);
            assert!(between > 0.05 && between < entropy(p));
        }
    }

    #[test]
    fn a_lift_tells_more_of_a_stack_than_a_push_of_the_lower_one() {
        let told: Vec<f64> = CARRIED.iter().map(|(_, _, c)| bits_of_parting(0.3, *c)).collect();
        assert!(told[0] > told[1] && told[1] > told[2] && told[2] > 0.0);
        assert!(told[0] < entropy(0.3));
    }

    #[test]
    fn a_longer_way_shows_a_larger_hinge() {
        let noise = Noise::default();
        assert!(shown(0.2, &noise, false) > 3.0 * shown(0.1, &noise, false));
        assert!(shown(0.1, &noise, true) > shown(0.1, &noise, false));
    }
}
