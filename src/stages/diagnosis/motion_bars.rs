//! What the evidence of a law of a joint has to come to before it is named: more where something usual looks like it.

use super::motion_laws::form;
use super::naming::NAMED;

/// Log evidence over the plain model, nats, from which on a play is named, and one that frees the joint of nearly all friction.
const PLAY: [f64; 2] = [25.0, 15.0];
const WHOLE: f64 = 0.9;
/// Share of the friction below which more of it as the joint sets out is usual, and the same for one that is.
const USUAL: f64 = 0.1;
const SETS_OUT: f64 = 25.0;

/// The bar of a law of this form with these values, nats.
pub(super) fn named_from(form: usize, values: &[f64]) -> f64 {
    match form {
        // What a play does is close to what friction does that sets in late, but for one that frees the joint of all of it.
        form::BACKLASH | form::BACKLASH_ANEW if values[0] < WHOLE => PLAY[0],
        form::BACKLASH | form::BACKLASH_ANEW => PLAY[1],
        form::STICTION | form::STRIBECK if values[0] < USUAL => SETS_OUT,
        _ => NAMED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_more_friction_at_the_start_is_usual() {
        assert!(named_from(form::STICTION, &[0.06]) > named_from(form::STICTION, &[0.5]));
        assert!(named_from(form::BACKLASH, &[0.5]) > named_from(form::BACKLASH, &[1.0]));
    }
}
