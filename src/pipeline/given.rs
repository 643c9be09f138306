//! What a given model says of friction on the table beside what its pushes took.

use crate::capture::{Capture, Kind};
use crate::stages::diagnosis::{Quantity, Trace};
use crate::twin::{Body, Compared, Link, Model};

/// How the force of friction is called where coefficient and weight are not told apart.
pub(super) const FORCE: &str = "friction force on the table";
/// What stands on the table moved where it went this far, m.
const MOVED: f64 = 0.01;
/// How well one push tells friction on the table, as a share: it strays from push to push.
const ONE_PUSH: f64 = 0.03;
/// By how much the friction of what carries joints may be off besides, as a share (1 sd): what the joints let move meanwhile takes its part
/// of the force.
const CARRIES: f64 = 0.05;
/// Fewest samples of a force.
const SAMPLES: usize = 10;

/// The friction on the table of bodies that have joints, by the forces that it took beside those that were foretold with
/// the model's.
pub(super) fn table_friction(capture: &Capture, given: &Model, traces: &[Trace]) -> Vec<Compared> {
    let jointed = given.twin.bodies.iter().filter(|b| b.links.len() > 1);
    jointed.filter_map(|body| friction_of(capture, body, traces)).collect()
}

/// Frictions on the table of what carries joints, with the doubt of what these let move meanwhile.
pub(super) fn doubt_carriers(numbers: &mut [Compared], given: &Model) {
    let carries = |name: &str| given.twin.body_of(name).is_some_and(|b| !b.joints.is_empty());
    for number in numbers.iter_mut().filter(|n| n.quantity == FORCE && carries(&n.about)) {
        let besides = 1.96 * CARRIES * number.measured;
        let [low, high] = number.ci95;
        let wide = |end: f64| (end - number.measured).hypot(besides);
        number.ci95 = [number.measured - wide(low), number.measured + wide(high)];
        number.outside &= number.model < number.ci95[0] || number.model > number.ci95[1];
    }
}

fn friction_of(capture: &Capture, body: &Body, traces: &[Trace]) -> Option<Compared> {
    let drags = |l: &&Link| l.friction_force.kinetic.is_some();
    let standing: Vec<&Link> = body.links.iter().filter(drags).collect();
    let [alone] = standing.as_slice() else { return None };
    let own = alone.friction_force.kinetic.as_ref()?.value;
    let pushed = |t: &&Trace| {
        let done = capture.interactions.iter().find(|i| i.name == t.interaction);
        done.is_some_and(|i| matches!(i.kind, Kind::Push | Kind::Pull) && i.target.as_deref() == Some(&alone.name))
    };
    let shares: Vec<f64> = traces.iter().filter(pushed).filter_map(|t| share(t, alone)).collect();
    let count = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / count;
    let scatter = (shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0)).sqrt();
    let measured = own * mean;
    let half = 1.96 * measured * ONE_PUSH.max(scatter) / count.sqrt();
    let ci95 = [measured - half, measured + half];
    (count > 0.0).then(|| Compared {
        about: alone.name.clone(),
        quantity: FORCE.into(),
        model: own,
        measured,
        ci95,
        outside: own < ci95[0] || own > ci95[1],
        unit: "N".into(),
        note: Some("by pushes; coefficient times weight: which of the two, this does not tell".into()),
    })
}

/// The mean force of one push over the mean of what was foretold, where it slides.
fn share(trace: &Trace, standing: &Link) -> Option<f64> {
    let path = &trace.paths.get(&standing.name)?.poses;
    let way = path.last()?.translation.vector - path.first()?.translation.vector;
    let curve = trace.curves.iter().find(|c| c.quantity == Quantity::Force)?;
    let both = curve.measured.iter().zip(&curve.predicted);
    let pairs: Vec<(f64, f64)> = both
        .filter(|(m, p)| m.is_finite() && **p > 0.0)
        .map(|(m, p)| (*m, *p))
        .collect();
    let (measured, foretold) = pairs.iter().fold((0.0, 0.0), |(a, b), (m, p)| (a + m, b + p));
    (pairs.len() >= SAMPLES && way.norm() > MOVED).then(|| measured / foretold)
}
