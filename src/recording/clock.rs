//! When what is shown: the views first, then the touches one after another.

use crate::capture::{Capture, Interaction};

/// A moment on both timelines, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// On the timeline on which nothing overlaps: views first, then touches in the order of the capture.
    pub(super) played: f64,
    /// On the capture's own clock.
    pub(super) recorded: f64,
}

/// For how long a view is shown, s.
const VIEW: f64 = 0.25;
/// The pause between touches, s.
const PAUSE: f64 = 1.0;

/// When a touch is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// First and last reading, s, as recorded.
    pub(super) start: f64,
    pub(super) end: f64,
    /// What `played` is ahead of `recorded`, s.
    ahead: f64,
}

impl Span {
    /// A time of the recording on both timelines.
    pub(super) fn at(&self, recorded: f64) -> Moment {
        Moment {
            played: recorded + self.ahead,
            recorded,
        }
    }

    /// True within the touch: a reading beyond it would be shown with another touch.
    pub(super) fn holds(&self, recorded: f64) -> bool {
        recorded >= self.start && recorded <= self.end
    }
}

/// The moment at which view `i` is shown; it stands still, so its time is that of the shutter.
pub(super) fn view_moment(i: usize, time: f64) -> Moment {
    Moment {
        played: VIEW * i as f64,
        recorded: time,
    }
}

/// The spans of the touches, in the order of the capture; none for a touch without a reading.
pub(super) fn spans(capture: &Capture) -> Vec<Option<Span>> {
    let mut next = VIEW * capture.views.len() as f64 + PAUSE;
    let place = |interaction: &Interaction| {
        let (start, end) = extent(interaction)?;
        let span = Span {
            start,
            end,
            ahead: next - start,
        };
        next += end - start + PAUSE;
        Some(span)
    };
    capture.interactions.iter().map(place).collect()
}

/// The first and the last finite time of any stream.
fn extent(interaction: &Interaction) -> Option<(f64, f64)> {
    let poses = interaction
        .tracks
        .values()
        .chain(&interaction.tool_path)
        .map(|s| &s.time);
    let others = [
        interaction.force.as_ref().map(|s| &s.time),
        interaction.support_path.as_ref().map(|s| &s.time),
        interaction.frames.as_ref().map(|s| &s.time),
    ];
    let all = poses.chain(others.into_iter().flatten()).flatten();
    let read = all.copied().filter(|t| t.is_finite());
    read.fold(None, |found, t| {
        let (low, high) = found.unwrap_or((t, t));
        Some((f64::min(low, t), f64::max(high, t)))
    })
}
