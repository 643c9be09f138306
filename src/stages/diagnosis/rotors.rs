//! Whether something spins within what a hand turned aloft: a turn about one axis asks for a torque about another, in proportion to it.

use crate::capture::{Capture, Segmented};
use crate::stages::estimation::{Gyroscopic, gyroscopic};
use crate::twin::Evidence;

/// Log-likelihood over that of a rigid load, nats, from which on it counts, and the most that it may leave of what that leaves of the torque.
const TOLD: f64 = 15.0;
const LEAVES: f64 = 0.6;

/// The clearest rotor that a lift tells.
pub(super) fn spins_within(capture: &Capture, segmented: &[Segmented]) -> Option<Evidence> {
    let told = capture.interactions.iter().filter_map(|interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        gyroscopic(interaction, cut, &capture.gravity)
    });
    let clear = |g: &Gyroscopic| g.gain > TOLD && g.left[1] < LEAVES * g.left[0];
    let best = told.filter(clear).max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    Some(Evidence {
        residual: format!("torque in {}", best.interaction),
        test: "log-likelihood ratio of a rotor in what is held, nats".into(),
        statistic: best.gain,
        p_value: (-best.gain).exp(),
        words: format!(
            "what hangs on the hand asks for a torque across its turns, as if something spun within it: a rigid load leaves {:.1} mN·m of \
             it, one with a rotor {:.1}",
            1e3 * best.left[0],
            1e3 * best.left[1]
        ),
    })
}
