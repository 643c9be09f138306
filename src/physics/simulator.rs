//! One face for what moves in time: a state, a step of it under what drives it, and what sensors would see of it.
//!
//! A model says how one step goes; marching through the times that are asked for, the step that is used, and the error that the
//! step makes are the same for all.

/// A forward model that is stepped through time.
pub trait Simulator {
    /// What drives it: a commanded path or a measured load, as a function of time.
    type Drive: ?Sized;
    /// Where it is.
    type State: Clone;
    /// What sensors would see of a state.
    type Seen;

    /// The longest step, s.
    const STEP: f64;

    /// The state a step of `h` (s) after `t`.
    fn advance(&self, state: &Self::State, drive: &Self::Drive, t: f64, h: f64) -> Self::State;

    /// What is seen of a state.
    fn seen(&self, state: &Self::State) -> Self::Seen;

    /// What is seen at each of `times` (s, not decreasing), from `start` at `from` on; before that it is the start.
    fn simulate_with_step(
        &self,
        start: &Self::State,
        drive: &Self::Drive,
        from: f64,
        times: &[f64],
        step: f64,
    ) -> Vec<Self::Seen> {
        let (mut state, mut t) = (start.clone(), from);
        let mut out = Vec::with_capacity(times.len());
        for &goal in times {
            while goal - t > 1e-12 {
                let h = (goal - t).min(step);
                state = self.advance(&state, drive, t, h);
                t += h;
            }
            out.push(self.seen(&state));
        }
        out
    }

    /// The same at the model's own step.
    fn simulate(&self, start: &Self::State, drive: &Self::Drive, from: f64, times: &[f64]) -> Vec<Self::Seen> {
        self.simulate_with_step(start, drive, from, times, Self::STEP)
    }

    /// The solver's own error at a step: the root mean square, by `apart`, of what halving it changes.
    fn solver_error(
        &self,
        start: &Self::State,
        drive: &Self::Drive,
        times: &[f64],
        step: f64,
        apart: impl Fn(&Self::Seen, &Self::Seen) -> f64,
    ) -> f64 {
        let from = times.first().copied().unwrap_or(0.0);
        let [coarse, fine] = [step, 0.5 * step].map(|h| self.simulate_with_step(start, drive, from, times, h));
        let squares: f64 = coarse.iter().zip(&fine).map(|(a, b)| apart(a, b).powi(2)).sum();
        (squares / times.len().max(1) as f64).sqrt()
    }
}

/// A recorded load between its rows: the two about `t` and the share of the way; the last row beyond the end.
pub(super) fn rows_about<T>(rows: &[T], t: f64, time: impl Fn(&T) -> f64) -> Option<(&T, &T, f64)> {
    let after = rows.partition_point(|r| time(r) <= t);
    let before = rows.get(after.saturating_sub(1))?;
    let next = rows.get(after).unwrap_or(before);
    let span = time(next) - time(before);
    let share = if span > 0.0 {
        ((t - time(before)) / span).clamp(0.0, 1.0)
    } else {
        0.0
    };
    Some((before, next, share))
}
