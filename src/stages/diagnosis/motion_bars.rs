//! What is known beforehand of the laws of a joint: how much evidence one has to have before it is named, how common it is beside
//! others that do as well, and what is too usual to be a finding.

use super::motion_free::Free;
use super::motion_laws::form;
use super::naming::NAMED;
use crate::twin::Evidence;

/// Log evidence over the plain model, nats, from which on a play is named, and one that frees the joint of nearly all friction.
const PLAY: [f64; 2] = [25.0, 15.0];
const WHOLE: f64 = 0.9;
/// Share of the friction below which more of it as the joint sets out is usual.
const USUAL: f64 = 0.1;
/// Seconds below which what is read late is as good as read at once.
const AT_ONCE: f64 = 0.02;

/// The bar of a law of this form with these values, nats.
pub(super) fn named_from(form: usize, values: &[f64]) -> f64 {
    match form {
        // What a play does is close to what friction does that sets in late, but for one that frees the joint of all of it.
        form::BACKLASH | form::BACKLASH_ANEW if values[0] < WHOLE => PLAY[0],
        form::BACKLASH | form::BACKLASH_ANEW => PLAY[1],
        _ => NAMED,
    }
}

/// How common a weight is where a joint stands level or upright beside what does as well, a bias of the force where a weight does,
/// and, where a free finger read none, a bias, or where it read one, a weight.
const SELDOM: f64 = 0.05;
const BESIDE_A_WEIGHT: f64 = 0.3;
const READ_NOWHERE: f64 = 0.02;
/// How common a law of this form is beside others that do as well: a joint is `weighed` where its own weight can load it; a
/// finger that touched nothing may have read a force, or none.
pub(super) fn commonness(form: usize, weighed: bool, free: &Free) -> f64 {
    let reads_nothing = free.reads_nothing();
    match form {
        form::GRAVITY | form::SLOPE if !weighed && free.bias().is_some() => READ_NOWHERE,
        form::GRAVITY | form::SLOPE if !weighed => SELDOM,
        form::BIAS if reads_nothing => READ_NOWHERE,
        form::BIAS if weighed => BESIDE_A_WEIGHT,
        _ => 1.0,
    }
}

/// What speaks against a law that fits: a force that is always read, and that none of many hands read before it moved. What is the same
/// both ways without it is friction of another size each way, or a load of one size that nothing here has a name for.
pub(super) fn refuted(form: usize, values: &[f64], free: &Free) -> Option<Evidence> {
    let against = form == form::BIAS && free.speaks_against(values[0]);
    against.then(|| Evidence {
        residual: "load of the joint, one way beside the other".into(),
        test: "what hands read before they set out".into(),
        statistic: values[0].abs(),
        p_value: 0.0,
        words: format!(
            "one way it takes {:.3} N more than the other, wherever it is, and no hand that holds still reads a part of it: friction that \
             differs with the direction, or a load that only motion brings",
            2.0 * values[0].abs()
        ),
    })
}

/// Whether a law of this form with these values, or its first one a standard deviation less, says no more than what is usual.
pub(super) fn usual(form: usize, values: &[f64]) -> bool {
    match form {
        form::STICTION | form::STRIBECK | form::BREAKAWAY => values[0] < USUAL,
        form::LAG | form::LATE => values[0].abs() < AT_ONCE,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_little_more_friction_at_the_start_is_usual() {
        assert!(usual(form::STICTION, &[0.06]) && !usual(form::STICTION, &[0.5]) && !usual(form::DAMPING, &[0.06]));
    }

    #[test]
    fn a_force_that_is_always_read_is_read_by_a_hand_that_holds_still() {
        let none = Free::quiet(0.02);
        assert!(refuted(form::BIAS, &[0.25], &none).is_some() && refuted(form::BIAS, &[0.05], &none).is_none());
        assert!(refuted(form::SPRING, &[0.25], &none).is_none());
        assert!(refuted(form::BIAS, &[0.25], &Free::default()).is_none());
    }

    #[test]
    fn a_play_of_all_the_friction_asks_for_less() {
        assert!(named_from(form::BACKLASH, &[0.5]) > named_from(form::BACKLASH, &[1.0]));
    }

    #[test]
    fn a_weight_loads_what_leans_and_a_bias_is_read_by_a_free_finger() {
        let untold = Free::default();
        let [none, some] = [0.0, 0.5].map(|f| Free::reading(Vector3::x() * f, 1.0));
        assert!(commonness(form::SLOPE, true, &untold) > commonness(form::BIAS, true, &untold));
        assert!(commonness(form::SLOPE, false, &untold) < commonness(form::BIAS, false, &untold));
        assert!(commonness(form::BIAS, false, &none) < commonness(form::SLOPE, false, &none));
        assert!(commonness(form::GRAVITY, false, &some) < commonness(form::BIAS_ROOM, false, &some));
    }
}
