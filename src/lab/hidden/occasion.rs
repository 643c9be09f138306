//! When an action is done, and what was done before it: effects that remember need this.

use crate::lab::ActionSpec;

/// Seconds between interactions, at least.
const PAUSE: f64 = 0.5;

/// The place of an action in the course of a capture, as planned.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::lab) struct Occasion {
    /// s since the first action began.
    pub start: f64,
    /// s of stillness before it.
    pub wait: f64,
    /// m that the body was pushed before.
    pub slid: f64,
    /// m: deepest press before.
    pub deepest: f64,
    /// Whether it is the first push or pull.
    pub first: bool,
}

/// The occasion of each action, from their durations and the pauses before them, s.
pub(in crate::lab) fn occasions(actions: &[ActionSpec], durations: &[f64], pauses: &[f64]) -> Vec<Occasion> {
    let mut next = Occasion {
        first: true,
        ..Occasion::default()
    };
    let mut all = Vec::with_capacity(actions.len());
    for (i, action) in actions.iter().enumerate() {
        let pause = pauses.get(i).copied().unwrap_or(0.0);
        next.wait = PAUSE + pause;
        next.start += pause;
        all.push(next);
        next.start += durations.get(i).copied().unwrap_or(0.0) + PAUSE;
        match action {
            ActionSpec::Push { travel, .. } | ActionSpec::Pull { travel, .. } => {
                next.first = false;
                next.slid += travel;
            }
            ActionSpec::Press { depth, .. } => next.deepest = next.deepest.max(*depth),
            _ => {}
        }
    }
    all
}
