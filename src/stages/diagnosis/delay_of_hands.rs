//! A delay of the tracking as hands tell it: what a hand holds goes where the hand goes, and neither slips nor gives as a finger does.

use std::collections::BTreeSet;

use super::Trace;
use super::delay::{CLEAR, LEAST, Late, START, Told, behind, gain, is_a_way, paced};
use crate::capture::{Capture, Interaction};
use crate::twin::Finding;

/// Fewest touches of hands that tell it by themselves, and the most by which any of them may be off their mean, as a share.
const HANDS: (usize, f64) = (3, 0.25);

/// The touches in which a tool holds what it moves.
pub fn held_in(capture: &Capture) -> BTreeSet<String> {
    let holds = |i: &&Interaction| i.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    capture
        .interactions
        .iter()
        .filter(holds)
        .map(|i| i.name.clone())
        .collect()
}

/// One delay of what hands hold, at several speeds.
pub fn of_hands(each: Vec<&Late>, judged: &[&Trace], sealed: bool) -> Option<Finding> {
    let n = each.len() as f64;
    let mean = each.iter().map(|e| e.tau).sum::<f64>() / n.max(1.0);
    let alike = |e: &&Late| (e.tau - mean).abs() < HANDS.1 * mean.abs();
    if each.len() < HANDS.0 || mean.abs() < LEAST || !each.iter().all(alike) || !paced(&each) || is_a_way(&each) {
        return None;
    }
    let squares = each.iter().map(|e| (e.tau - mean).powi(2)).sum::<f64>();
    let sd = (squares / (n - 1.0) / n).sqrt().max(1e-4);
    if mean.abs() < CLEAR * sd {
        return None;
    }
    let told = Told {
        cause: "time-delay",
        name: "tau",
        unit: "s",
        value: (mean, sd.hypot(START)),
        statistic: mean / sd,
        words: behind(mean),
    };
    told.finding(&each, gain(judged, sealed, &|_| mean)?)
}

#[cfg(test)]
mod tests {
    use super::super::delay::delay_finding;
    use super::super::delay::tests::push;
    use super::*;

    /// Fingers that give and slip tell times from 8 to 38 ms, hands the same.
    #[test]
    fn what_hands_hold_tells_a_delay_that_fingers_blur() {
        let fingers = [
            (0.02, 8e-3),
            (0.053, 22e-3),
            (0.067, 25e-3),
            (0.02, 24e-3),
            (0.12, 38e-3),
        ];
        let hands = [(0.04, 45e-3), (0.1, 42e-3), (0.04, 44e-3), (0.1, 42e-3)];
        let all = fingers.into_iter().chain(hands).enumerate();
        let traces: Vec<Trace> = all.map(|(i, (v, tau))| push(&format!("p{i}"), v, tau, false)).collect();
        let by_hand: BTreeSet<String> = (5..9).map(|i| format!("p{i}")).collect();
        let found = delay_finding(&traces, &by_hand).expect("a delay");
        assert!((found.parameters["tau"].value - 0.043).abs() < 3e-3, "{found:?}");
        // One way at all speeds is that of a grip that gives.
        let gives = |(i, v): (usize, f64)| push(&format!("p{i}"), v, 1.8e-3 / v, false);
        let traces: Vec<Trace> = [0.04, 0.1, 0.05, 0.08].into_iter().enumerate().map(gives).collect();
        let by_hand = (0..4).map(|i| format!("p{i}")).collect();
        assert!(delay_finding(&traces, &by_hand).is_none());
    }
}
