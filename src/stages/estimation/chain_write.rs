//! What the replay of all touches of a jointed body says, written into its links and joints.

use nalgebra::{DMatrix, DVector};

use super::chain::{Chain, Creep, LEAST_CREEP, Way};
use super::chain_numbers::{CREEP, RADIUS, TOOL, TOOL_SPEED};
use super::chain_trial::Trial;
use super::pool::positive;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::math::Fit;
use crate::twin::{FrictionForce, JointKind, Model};

const METHOD: &str = "replay of all pushes of the body";
/// Log-sd by which Coulomb's law of the finger itself may be off.
const FINGER: f64 = 0.25;
/// Where along a link that bears its load lies nobody knows, for several bear at once: share by which the moment of what rubs below
/// it about its joint is in doubt (1 sd).
const LOADED: f64 = 0.2;
/// Log-sd by which links that give way before they slide may do so more or less than in proportion to what pulls at them: of MuJoCo's
/// worlds some go 3 times as far under 1.3 times the moment.
const CREEPS: f64 = 0.7;
/// Log-sd of a friction force up to which it is told.
const TOLD: f64 = 0.3;

/// Writes the way that fits best; what the rivals say otherwise is left open, within intervals that hold them all.
pub(super) fn write(
    chain: &Chain,
    way: &Way,
    rivals: &[&Way],
    trials: &[Trial],
    model: &mut Model,
    notices: &mut Notices,
) {
    let from: Vec<String> = trials.iter().map(|t| t.interaction.name.clone()).collect();
    let names: Vec<&String> = std::iter::once(&chain.root)
        .chain(chain.children.iter().map(|c| &c.0))
        .collect();
    let mut open = false;
    for (i, name) in names.iter().enumerate() {
        let found = force_of(chain, way, i, &from);
        let others: Vec<Option<Estimate>> = rivals.iter().map(|w| force_of(chain, w, i, &from)).collect();
        let Some(link) = model.twin.link_mut(name) else {
            continue;
        };
        let undecided = others.iter().any(|o| o.is_some() != found.is_some());
        open |= undecided;
        let before = link.friction_force.kinetic.take();
        let Some(mut force) = found else {
            link.friction_force = FrictionForce::default();
            (link.friction.static_, link.friction.kinetic) = (None, None);
            let words = if undecided {
                "whether it hangs on its joint, free of the support, or rubs on it, the pushes do not part: it is taken to hang"
            } else {
                "it hangs on its joint, free of the support: so the pushes have it"
            };
            notices.note(super::resolve::STAGE, name, words);
            continue;
        };
        let far = others.iter().any(|o| o.as_ref().is_none_or(|o| apart(o, &force)));
        for other in &others {
            force = holding(force, other.as_ref().and_then(|o| o.ci95).unwrap_or([0.0; 2]));
        }
        let doubt = force.sd.unwrap_or(0.0) / force.value;
        if doubt > TOLD || far {
            force.status = Status::Assumed;
            force.confounded = before.and_then(|f| f.confounded);
        }
        link.friction_force.kinetic = Some(force);
    }
    write_joints(chain, way, rivals, (&from, open), model);
    for name in names {
        write_contact(chain, way, &from, name, model);
    }
}

/// Friction force of link `i` (root and children), where it bears.
fn force_of(chain: &Chain, way: &Way, i: usize, from: &[String]) -> Option<Estimate> {
    let value = chain.forces(&way.fit.x, &way.bears)[i];
    let log = |x: &DVector<f64>| chain.forces(x, &way.bears)[i].max(1e-9).ln();
    let sd = log_sd(&log, &way.fit, way.scale.max(1.0));
    (value > 0.0).then(|| positive(value, sd.hypot(0.01), "N", from.to_vec(), METHOD))
}

/// True where an estimate lies outside the other's interval.
fn apart(a: &Estimate, b: &Estimate) -> bool {
    b.ci95.is_some_and(|[low, high]| !(low..=high).contains(&a.value))
}

/// The estimate with an interval that holds another one too.
fn holding(estimate: Estimate, other: [f64; 2]) -> Estimate {
    match estimate.ci95 {
        Some([low, high]) => estimate.with_interval([low.min(other[0]), high.max(other[1])]),
        None => estimate,
    }
}

/// `open`: whether a child bears at all is not decided.
fn write_joints(chain: &Chain, way: &Way, rivals: &[&Way], (from, open): (&[String], bool), model: &mut Model) {
    let first = 1 + chain.children.len();
    let levers: Vec<f64> = chain
        .children
        .iter()
        .map(|c| model.lever(&c.0).unwrap_or(0.0))
        .collect();
    let ways = || std::iter::once(way).chain(rivals.iter().copied());
    let Some(body) = model.twin.bodies.iter_mut().find(|b| b.name == chain.body) else {
        return;
    };
    let body_joints = body.joints.len();
    for (k, joint) in body.joints.iter_mut().enumerate() {
        let [unit, per_speed] = match joint.kind {
            JointKind::Revolute => ["N·m", "N·m·s/rad"],
            _ => ["N", "N·s/m"],
        };
        let of_at = |w: &Way, at: usize, unit: &str| {
            let sd = w.fit.sd(at) * w.scale.max(1.0);
            positive(w.fit.x[at].exp(), sd, unit, from.to_vec(), METHOD)
        };
        let of = |w: &Way| of_at(w, first + k, unit);
        let before = joint.friction.as_ref();
        // The joint's own load, felt free of any support, is the better word.
        if [before, joint.damping.as_ref()]
            .into_iter()
            .flatten()
            .any(Estimate::is_measured)
        {
            continue;
        }
        let mut friction = of(way);
        for rival in rivals {
            friction = holding(friction, of(rival).ci95.unwrap_or([0.0; 2]));
        }
        let told = before.and_then(|f| f.confounded.clone());
        let at = first + body_joints + k;
        let mut damping = of_at(way, at, per_speed);
        let aliased = told.filter(|c| open || damping_only(c)).unwrap_or_else(|| Confounded {
            with: vec!["damping".into()],
            known: format!(
                "friction + damping at the speed of the pushes, which here are {:.4} {unit} and {:.4} {per_speed}",
                friction.value, damping.value
            ),
            experiment: "move the joint at half and at twice the speed".into(),
        });
        if let Some([low, high]) = friction.ci95 {
            // What rubs less than it seems to leaves more to the joint; a link that chatters bears up to twice its share.
            let rubs = ways().map(|w| chain.forces(&w.fit.x, &w.bears)[1 + k] * levers[k]);
            let rubs = rubs.fold(0.0, f64::max);
            let more = friction.value + 1.96 * LOADED * rubs;
            friction = friction
                .with_interval([0.3 * (low - rubs).max(0.0), high.max(more)])
                .with_confounded(aliased.clone());
        }
        friction.status = Status::Assumed;
        joint.friction = Some(friction);
        damping = damping.with_confounded(aliased);
        damping.status = Status::Assumed;
        joint.damping = Some(damping);
    }
}

fn write_contact(chain: &Chain, way: &Way, from: &[String], name: &str, model: &mut Model) {
    let n = way.fit.x.len();
    let scale = way.scale.max(1.0);
    let (tool_sd, radius_sd) = ((way.fit.sd(n - 2) * scale).hypot(FINGER), way.fit.sd(n - 1) * scale);
    let radius = chain.radii[name] * way.fit.x[n - 1].exp();
    // No load below a link acts farther out than all at its corners.
    let radius = radius.min(chain.outermost.get(name).copied().unwrap_or(f64::INFINITY));
    let stated = |value: f64, sd: f64, prior: f64, unit: &str| {
        let mut e = positive(value, sd.min(prior), unit, from.to_vec(), METHOD);
        if sd > 0.5 * prior {
            e.status = Status::Assumed;
        }
        Some(e)
    };
    let (unit, per) = match way.creep {
        Creep::Time => ("m/s", 1.0),
        Creep::Way => ("1", TOOL_SPEED),
    };
    let creep = stated(
        way.fit.x[n - 3].exp(),
        (way.fit.sd(n - 3) * scale).hypot(CREEPS),
        CREEP.1,
        unit,
    );
    let creep = creep.filter(|c| c.is_measured() && c.value * per > LEAST_CREEP);
    if let Some(link) = model.twin.link_mut(name) {
        (link.friction.creep_speed, link.friction.creep_ratio) = match way.creep {
            Creep::Time => (creep, None),
            Creep::Way => (None, creep),
        };
        link.friction.tool = stated(way.fit.x[n - 2].exp(), tool_sd, TOOL.1, "1");
        link.friction.torsional_radius = stated(radius, radius_sd, RADIUS, "m");
    }
}

fn damping_only(c: &Confounded) -> bool {
    c.with.iter().all(|w| w == "damping")
}

/// Standard deviation of a function of the parameters, by the delta method.
fn log_sd(value: &dyn Fn(&DVector<f64>) -> f64, fit: &Fit, scale: f64) -> f64 {
    let at = value(&fit.x);
    let slope = DMatrix::from_fn(1, fit.x.len(), |_, k| {
        let mut x = fit.x.clone();
        x[k] += 1e-4;
        (value(&x) - at) / 1e-4
    });
    let variance = &slope * &fit.covariance * slope.transpose();
    variance[(0, 0)].max(0.0).sqrt() * scale
}
