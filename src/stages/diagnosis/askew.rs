//! A force that is askew of the way on which it draws a thing: dry friction is against the motion alone (Coulomb), so what leads a
//! thing steadily pulls along its way, and to the side of it only what has a law.

use super::fit::Fit;
use super::push_states::State;
use crate::math::median;
use crate::twin::Evidence;

/// Angle between force and way from which on it has a reason, rad, fewest leads that show it, and their scatter about its middle as a
/// share of it.
const ASKEW: f64 = 0.1;
const FEWEST: usize = 3;
const ALIKE: f64 = 0.5;
/// Which of the random effects turns a force.
const TURNS: usize = 3;

/// What the plain model of pushes and drags takes up as a turn of the force, the same one in all that a hand led.
pub(super) fn askew(states: &[Vec<State>], plain: &Fit) -> Option<Evidence> {
    let led = plain.groups.iter().zip(&plain.states).filter_map(|(group, state)| {
        let led = states[*group].iter().find(|s| s.led && s.contact)?;
        Some(state.effects[TURNS] * led.astray())
    });
    turned(&led.collect::<Vec<f64>>())
}

fn turned(angles: &[f64]) -> Option<Evidence> {
    let middle = median(angles).filter(|m| angles.len() >= FEWEST && m.abs() > ASKEW)?;
    let apart: Vec<f64> = angles.iter().map(|a| (a - middle).abs()).collect();
    let spread = median(&apart).filter(|s| *s < ALIKE * middle.abs())?;
    let statistic = middle.abs() / spread.max(0.1 * ASKEW);
    let side = if middle > 0.0 { "left" } else { "right" };
    Some(Evidence {
        residual: "force across the motion".into(),
        test: "median turn of the force over its scatter".into(),
        statistic,
        p_value: 0.5f64.powi(angles.len() as i32 - 1),
        words: format!(
            "whichever way it is led, what draws it pulls {:.0} degrees to the {side} of its way: dry friction does not, and no \
             cause that was tried does that",
            middle.abs().to_degrees()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::turned;

    #[test]
    fn a_turn_that_all_leads_share_has_a_reason() {
        let told = turned(&[0.33, 0.35, 0.34, 0.31]).expect("a turn");
        assert!(told.words.contains("19 degrees to the left"), "{}", told.words);
        // Small, or another in each.
        assert!(turned(&[0.03, 0.04, 0.02, 0.03]).is_none() && turned(&[0.3, -0.2, 0.02, -0.4]).is_none());
    }
}
