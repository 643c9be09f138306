//! What a hand drags to and fro it sets going anew each way: a stroke is a touch of its own, with its own level, its own start and its own
//! time at rest before.

use super::push_states::{Observed, State};

/// Fewest windows of a stroke.
const FEWEST: usize = 3;

impl Observed {
    /// The strokes of a hand that turned back, in turn; what was pushed, or dragged one way, as it is.
    pub fn strokes(self) -> Vec<Self> {
        let begins = begins(&self.states);
        let ends = begins[1..].iter().copied().chain([self.states.len()]);
        let each: Vec<(usize, usize)> = begins.iter().copied().zip(ends).collect();
        let touches = |(from, to): &(usize, usize)| self.states[*from..*to].iter().filter(|s| s.contact).count();
        let long: Vec<(usize, usize)> = each.into_iter().filter(|e| touches(e) >= FEWEST).collect();
        if long.len() < 2 {
            return vec![self];
        }
        long.into_iter()
            .filter_map(|(from, to)| self.stroke(from, to))
            .collect()
    }

    fn stroke(&self, from: usize, to: usize) -> Option<Self> {
        let mut states = self.states[from..to].to_vec();
        let sets_out = states.iter().find(|s| s.contact)?;
        if let Some(before) = self.states[..from].iter().rev().find(|s| s.contact) {
            let (slip, time) = (before.slip, sets_out.time - 0.5 * sets_out.span);
            let (since, wait) = (
                sets_out.since - 0.5 * sets_out.span,
                time - before.time - 0.5 * before.span,
            );
            for s in &mut states {
                s.slip = (s.slip - slip).max(0.0);
                s.since -= since;
                s.wait = wait.max(0.0);
                s.first = false;
            }
        }
        // The tool is held as it was: what it reads along the drag without touching is the same both ways.
        Some(Self {
            states,
            measured: self.measured[from..to].to_vec(),
            spread: self.spread[from..to].to_vec(),
            body: self.body.clone(),
            blow: self.blow.clone(),
            name: self.name.clone(),
            ..*self
        })
    }
}

/// Where strokes begin: at first, and wherever what is led goes back.
fn begins(states: &[State]) -> Vec<usize> {
    let mut out = vec![0];
    let mut heading = None;
    for (i, s) in states.iter().enumerate().filter(|(_, s)| s.contact && s.led) {
        if heading.is_some_and(|h| s.heading.dot(&h) < 0.0) {
            out.push(i);
        }
        heading = Some(s.heading);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests_of_forms::at;
    use super::*;

    #[test]
    fn only_what_is_led_back_is_another_stroke() {
        let state = |led: bool, back: bool, contact: bool| {
            let state = at(0.0, 0.0, 1.0);
            State {
                heading: if back { -state.heading } else { state.heading },
                contact,
                led,
                ..state
            }
        };
        let way = |led: bool| {
            let rests = [state(led, false, false)];
            let goes = [false, false, true, true, false].map(|back| state(led, back, true));
            rests
                .into_iter()
                .chain(goes)
                .chain([state(led, true, false)])
                .collect::<Vec<_>>()
        };
        assert_eq!(begins(&way(true)), [0, 3, 5]);
        assert_eq!(begins(&way(false)), [0]);
        assert_eq!(begins(&[]), [0]);
    }
}
