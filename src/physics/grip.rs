//! A tool that holds a body rigidly: the body goes and turns as the tool does, and what rubs says what force that takes.

use nalgebra::{DVector, Point2, Vector2};

use super::Action;
use super::linkage::Linkage;
use crate::math::interpolate;

/// Speed of a point 1 m from the tool below which it rests, m/s.
const RESTS: f64 = 1e-7;

/// The force of the tool on the body.
#[derive(Clone, Copy)]
pub(super) struct Felt {
    pub(super) force: Vector2<f64>,
    /// Whether the tool goes on, and does not only rest against it.
    pub(super) moves: bool,
}

/// By how much the tool turns on a part of its way, rad; nothing where nobody tells.
pub(super) fn turned(action: &Action, [from, to]: [&(f64, Point2<f64>); 2]) -> Option<f64> {
    let tool = &action.tool;
    if tool.turned.len() != tool.time.len() {
        return None;
    }
    let at = |t: f64| interpolate(&tool.time, &tool.turned, t);
    Some(at(to.0)? - at(from.0)?)
}

/// Whether the body of link `target` has no other link, and stands on nothing but the table.
pub(super) fn alone(linkage: &Linkage, target: usize) -> bool {
    let (linear, angular) = linkage.jacobian(target, &Point2::origin());
    linear.ncols() == 3 && angular[2] != 0.0
}

/// Moves a body that stands alone with a tool that held it at `start` (plane frame at the start), from one point of its way to the
/// next and `turned` by so much, rad; the force on the body, or the one before where the tool rests.
pub(super) fn led(
    linkage: &mut Linkage,
    (target, start): (usize, &Point2<f64>),
    before: Option<Felt>,
    [from, to]: [&(f64, Point2<f64>); 2],
    turned: f64,
) -> Option<Felt> {
    let dt = to.0 - from.0;
    let held = linkage.moved(target).transform_point(start);
    let (velocity, spin) = ((to.1 - held) / dt, turned / dt);
    if velocity.norm() + spin.abs() < RESTS {
        return before.map(|felt| Felt { moves: false, ..felt });
    }
    linkage.loosen(((to.1 - from.1) / dt).norm());
    // The twist about the origin of the plane.
    let twist = DVector::from_vec(vec![velocity.x + spin * held.y, velocity.y - spin * held.x, spin]);
    let rubs = linkage.dissipators();
    let felt = rubs.iter().fold(DVector::zeros(3), |sum, d| sum + d.felt(&twist));
    linkage.advance(&twist, dt);
    Some(Felt {
        force: Vector2::new(felt[0], felt[1]),
        moves: true,
    })
}

#[cfg(test)]
mod tests {
    use super::super::push::tests::pushed;
    use super::super::{Hold, predict_push};

    #[test]
    fn what_is_held_turns_as_the_tool_does() {
        let (model, mut action) = pushed(0.3);
        action.tool.hold = Hold::Grip;
        let last = |action: &_| {
            let found = predict_push(&model, action, 0.0).expect("a prediction");
            let pose = *found.prediction.poses["box"].last().expect("a pose");
            let turn = pose.rotation.scaled_axis().z;
            (turn, found.prediction.force[found.prediction.force.len() / 2].norm())
        };
        // Nobody tells how the tool is turned: it trails behind the point that is held.
        assert!(last(&action).0.abs() > 0.1);
        let mut forces = Vec::new();
        let rate = |by: f64, n: usize| (0..n).map(move |k| by * k as f64 / n as f64).collect::<Vec<f64>>();
        for by in [0.0, 0.4, 3.0] {
            action.tool.turned = rate(by, action.tool.time.len());
            let (turned, force) = last(&action);
            assert!((turned - by).abs() < 0.02, "{turned} for {by}");
            forces.push(force);
        }
        // Friction in full where it does not turn, and the less the faster it does.
        assert!((forces[0] - 1.5).abs() < 1e-3, "{forces:?}");
        assert!(
            forces[1] < 0.995 * forces[0] && forces[2] < 0.9 * forces[1],
            "{forces:?}"
        );
    }
}
