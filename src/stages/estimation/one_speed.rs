//! What was moved at one speed only, and of which nothing says that it rubs on the support: friction and damping in one.

use super::facts::Facts;
use super::push::Push;
use super::resolve::STAGE;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::math::{median, quantile};
use crate::twin::Link;

/// Ratio of the fast to the slow motions from which on speeds differ.
const VARIED: f64 = 1.6;
/// Least share of what was felt that is thought to be friction.
const LEAST: f64 = 0.3;

/// The speed of all pushes, m/s, where it was but one.
fn one_speed(pushes: &[Push]) -> Option<f64> {
    let of = |p: &Push| median(&p.blocks.iter().map(|b| b.velocity.norm()).collect::<Vec<f64>>());
    let speeds: Vec<f64> = pushes.iter().filter_map(of).collect();
    let (slow, fast) = (quantile(&speeds, 0.0)?, quantile(&speeds, 1.0)?);
    (fast <= VARIED * slow).then_some(0.5 * (slow + fast))
}

/// Takes back what pushes at one speed seem to say of the friction of a link whose shape nobody knows: it may hang on something
/// that dampens it, as a drawer does, for all that is seen.
pub(super) fn confound_with_damping(link: &mut Link, facts: &Facts, notices: &mut Notices) {
    let Some(speed) = one_speed(&facts.pushes) else {
        return;
    };
    let Some(felt) = link.friction_force.kinetic.as_ref().map(|f| f.value) else {
        return;
    };
    let known = format!("friction + {speed:.3} damping = {felt:.3} N");
    notices.note(
        STAGE,
        &link.name,
        format!("it was moved at {speed:.3} m/s only: friction and damping are one, only {known} is known"),
    );
    let confounded = Confounded {
        with: vec!["damping".into()],
        known,
        experiment: "move it at half and at twice the speed".into(),
    };
    let open = |e: Estimate| {
        let high = e.ci95.map_or(e.value, |ci| ci[1]);
        let mut out = e.with_interval([LEAST * felt, high]);
        out.status = Status::Assumed;
        out.confounded = Some(confounded.clone());
        out
    };
    let force = &mut link.friction_force;
    (force.kinetic, force.static_) = (force.kinetic.take().map(open), force.static_.take().map(open));
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    fn push(speed: f64) -> Push {
        Push::steady(Vector2::new(5.5, 0.0), Vector2::new(speed, 0.0), 4)
    }

    #[test]
    fn one_speed_leaves_friction_and_damping_in_one() {
        assert!(one_speed(&[push(0.03), push(0.1)]).is_none());
        let mut link = Link::new("drawer", crate::base::Pose::identity());
        link.friction_force.kinetic = Some(Estimate::measured(5.5, 0.1, "N", Vec::new(), "push-limit-surface"));
        let facts = Facts {
            pushes: vec![push(0.1), push(0.11)],
            ..Facts::default()
        };
        confound_with_damping(&mut link, &facts, &mut Notices::default());
        let found = link.friction_force.kinetic.expect("a force");
        assert_eq!(found.status, Status::Assumed);
        // 2.5 N of friction and 30 N s/m.
        assert!(
            found.ci95.is_some_and(|[low, high]| low < 2.5 && high > 5.5),
            "{found:?}"
        );
        assert!(found.confounded.is_some_and(|c| c.known.contains("damping")));
    }
}
