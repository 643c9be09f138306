//! Times into phases: a gapless list from the instants at which something began.

use super::motion::Motion;
use crate::capture::{Phase, PhaseKind};

/// The instants that separate the phases; what did not happen is `None`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Instants {
    pub start: f64,
    pub end: f64,
    /// The tool, or the support, starts to move.
    pub approach: Option<f64>,
    /// First touch (for a tilt: the support starts to turn).
    pub contact: Option<f64>,
    /// The body starts to slide, or is carried.
    pub slide: Option<f64>,
    /// Contact is over.
    pub release: Option<f64>,
}

/// Phases in time order without gaps; stretches of no length are left out.
pub(super) fn cut(instants: Instants, motions: &[(String, Motion)], touched: &[String]) -> Vec<Phase> {
    let mut marks = vec![(instants.start, PhaseKind::Rest)];
    let mut push = |at: Option<f64>, kind: PhaseKind| {
        if let Some(t) = at {
            let earliest = marks.last().map_or(instants.start, |m| m.0);
            marks.push((t.clamp(earliest, instants.end), kind));
        }
    };
    push(instants.approach, PhaseKind::Approach);
    push(instants.contact, PhaseKind::Stick);
    push(instants.slide, PhaseKind::Slide);
    push(instants.release, PhaseKind::Release);
    let ends = marks.iter().skip(1).map(|m| m.0).chain([instants.end]);
    marks
        .iter()
        .zip(ends)
        .filter(|((start, _), end)| end > start)
        .map(|(&(start, kind), end)| Phase {
            kind,
            start,
            end,
            moving: motions
                .iter()
                .filter(|(_, m)| m.moved_between(start, end))
                .map(|(name, _)| name.clone())
                .collect(),
            touched: match kind {
                PhaseKind::Stick | PhaseKind::Slide => touched.to_vec(),
                _ => Vec::new(),
            },
        })
        .collect()
}
