//! What is known beforehand of the laws of a joint: how much evidence one has to have before it is named, how common it is beside
//! others that do as well, and what is too usual to be a finding.

use super::motion_laws::form;
use super::naming::NAMED;
use crate::capture::{Capture, Segmented};

/// Log evidence over the plain model, nats, from which on a play is named, and one that frees the joint of nearly all friction.
const PLAY: [f64; 2] = [25.0, 15.0];
const WHOLE: f64 = 0.9;
/// Share of the friction below which more of it as the joint sets out is usual.
const USUAL: f64 = 0.1;

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
/// and one where a free finger read none.
const SELDOM: f64 = 0.05;
const BESIDE_A_WEIGHT: f64 = 0.3;
const READ_NOWHERE: f64 = 0.02;
/// Share of the friction up to which what a free finger reads is none.
const NOTHING: f64 = 0.05;

/// How common a law of this form is beside others that do as well: a joint is `weighed` where its own weight can load it, and a
/// finger that touched nothing `reads_nothing`.
pub(super) fn commonness(form: usize, weighed: bool, reads_nothing: bool) -> f64 {
    match form {
        form::GRAVITY | form::SLOPE if !weighed => SELDOM,
        form::BIAS if reads_nothing => READ_NOWHERE,
        form::BIAS if weighed => BESIDE_A_WEIGHT,
        _ => 1.0,
    }
}

/// Whether fingers that held nothing read no force beside friction of this size, N, before they touched; false where none did so.
pub(super) fn reads_nothing(capture: &Capture, segmented: &[Segmented], friction: f64) -> bool {
    let free = capture
        .fitted()
        .filter(|i| i.tool.as_ref().is_some_and(|t| !t.grip && !t.pin));
    let tares: Vec<f64> = free
        .filter_map(|i| segmented.iter().find(|s| s.interaction == i.name)?.force_tare)
        .map(|tare| tare.norm())
        .collect();
    !tares.is_empty() && tares.iter().all(|t| *t < NOTHING * friction)
}

/// Whether a law of this form with these values says no more than what is usual.
pub(super) fn usual(form: usize, values: &[f64]) -> bool {
    matches!(form, form::STICTION | form::STRIBECK | form::BREAKAWAY) && values[0] < USUAL
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_more_friction_at_the_start_is_usual() {
        assert!(usual(form::STICTION, &[0.06]) && !usual(form::STICTION, &[0.5]) && !usual(form::DAMPING, &[0.06]));
    }

    #[test]
    fn a_play_of_all_the_friction_asks_for_less() {
        assert!(named_from(form::BACKLASH, &[0.5]) > named_from(form::BACKLASH, &[1.0]));
    }

    #[test]
    fn a_weight_loads_what_leans_and_a_bias_is_read_by_a_free_finger() {
        let of = |form, weighed, nothing| commonness(form, weighed, nothing);
        assert!(of(form::SLOPE, true, false) > of(form::BIAS, true, false));
        assert!(of(form::SLOPE, false, false) < of(form::BIAS, false, false));
        assert!(of(form::BIAS, false, true) < of(form::SLOPE, false, true));
    }
}
