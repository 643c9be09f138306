//! Ends of the range that are damped: soft closes, and what opens softly.

use super::family::{Law, Parameter};
use super::motion_laws::{Maker, Moved, form, units};
use super::motion_places::closer_of;
use super::motions::Scale;

/// Shares of the range by which the joint is moved past where it stood when the capture began, and is there short of its far end.
pub(super) const PAST: [f64; 2] = [0.13, 0.1];

/// Whether the joint is moved past where it stood when the capture began, which may be where it is closed.
pub(super) fn moved_past([low, high]: [f64; 2]) -> bool {
    let span = high - low;
    low + PAST[0] * span < 0.0 && 0.0 < high - PAST[1] * span
}

/// Where the near end of a range is closed, rad or m.
fn shut(ends: [f64; 2]) -> f64 {
    if moved_past(ends) { 0.0 } else { ends[0] }
}

/// What damps the way into an end of the range, of a damping and the logarithm of the distance from that end at which it begins.
pub(super) fn soft(kind: usize, x: &[f64], m: &Moved) -> f64 {
    let [low, high] = [shut(m.ends), m.ends[1]];
    let far = |from: f64| (1.0 - from / x[1].exp()).clamp(0.0, 1.0);
    // All of it up to half of where that ends, but for an edge.
    let edged = |from: f64| 1.0 / (1.0 + ((from - 0.5 * x[1].exp()) / x[2].exp()).exp());
    // A piston is pushed in, and not drawn out again.
    let v = match kind {
        form::SOFT_CLOSE_ONE_WAY | form::SOFT_CLOSE_ONE_WAY_EDGED => m.speed.min(0.0),
        form::SOFT_END_ONE_WAY | form::SOFT_END_ONE_WAY_EDGED => m.speed.max(0.0),
        _ => m.speed,
    };
    match kind {
        form::SOFT_CLOSE | form::SOFT_CLOSE_ONE_WAY => x[0] * v * far(m.position - low),
        form::SOFT_CLOSE_EDGED | form::SOFT_CLOSE_ONE_WAY_EDGED => x[0] * v * edged(m.position - low),
        form::SOFT_END | form::SOFT_END_ONE_WAY => x[0] * v * far(high - m.position),
        form::SOFT_END_EDGED | form::SOFT_END_ONE_WAY_EDGED => x[0] * v * edged(high - m.position),
        _ => 0.0,
    }
}

/// Laws of either end: which of them is the closed one depends on which way its axis points.
pub fn soft_closes(make: &Maker, s: &Scale) -> Vec<Law> {
    use form::{SOFT_CLOSE, SOFT_CLOSE_ONE_WAY, SOFT_END, SOFT_END_ONE_WAY};
    let plain = [SOFT_CLOSE, SOFT_CLOSE_ONE_WAY, SOFT_END, SOFT_END_ONE_WAY].map(|form| soft_close(make, s, form));
    plain.into_iter().chain(edged_closes(make, s)).collect()
}

/// A closed end that resists in proportion to the speed, both ways or only on the way in.
fn soft_close(make: &Maker, s: &Scale, form: usize) -> Law {
    let [_, per_speed, _, _] = units(s.turns);
    let span = (s.range[1] - s.range[0]).max(1e-6);
    let unit = if s.turns { "rad" } else { "m" };
    make.law(
        "soft-close",
        form,
        (
            vec![Parameter::positive("b", per_speed, 0.7 * s.load / s.speed)],
            // Free of it at the far end, or it would be plain damping.
            vec![Parameter {
                high: (0.7 * span).ln(),
                ..Parameter::scale("q_closed", unit, 0.4 * span, 0.5)
            }],
        ),
        [0.25, 0.5].iter().map(|x: &f64| vec![(x * span).ln()]).collect(),
        "near an end of its range the joint resists in proportion to its speed",
    )
}

/// Soft closes that are as strong up to some place, and end there within an edge.
fn edged_closes(make: &Maker, s: &Scale) -> [Law; 4] {
    use form::{SOFT_CLOSE, SOFT_CLOSE_EDGED, SOFT_CLOSE_ONE_WAY, SOFT_CLOSE_ONE_WAY_EDGED};
    use form::{SOFT_END, SOFT_END_EDGED, SOFT_END_ONE_WAY, SOFT_END_ONE_WAY_EDGED};
    let span = (s.range[1] - s.range[0]).max(1e-6);
    let edge = Parameter::scale("edge", if s.turns { "rad" } else { "m" }, 0.1 * span, 0.8);
    let closer = |form: usize, extends: &'static [usize]| Law {
        form,
        extends,
        ..closer_of(soft_close(make, s, extends[0]), edge.clone())
    };
    [
        closer(SOFT_CLOSE_EDGED, &[SOFT_CLOSE]),
        closer(SOFT_END_EDGED, &[SOFT_END]),
        closer(SOFT_CLOSE_ONE_WAY_EDGED, &[SOFT_CLOSE_ONE_WAY]),
        closer(SOFT_END_ONE_WAY_EDGED, &[SOFT_END_ONE_WAY]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(kind: usize, position: f64, speed: f64) -> f64 {
        let m = Moved {
            position,
            speed,
            ends: [0.2, 1.4],
            ..Moved::default()
        };
        soft(kind, &[0.5, 0.4_f64.ln(), 0.01_f64.ln()], &m)
    }

    #[test]
    fn what_is_moved_past_where_it_stood_is_closed_there() {
        assert!(shut([-0.02, 1.0]) == -0.02 && shut([-0.9, 0.01]) == -0.9);
        assert!(shut([-0.5, 0.8]) == 0.0);
    }

    #[test]
    fn either_end_may_be_damped_as_far_from_it_as_the_other() {
        use form::{SOFT_CLOSE, SOFT_CLOSE_EDGED, SOFT_CLOSE_ONE_WAY, SOFT_END, SOFT_END_EDGED, SOFT_END_ONE_WAY};
        let ends = [
            (SOFT_CLOSE, SOFT_END),
            (SOFT_CLOSE_EDGED, SOFT_END_EDGED),
            (SOFT_CLOSE_ONE_WAY, SOFT_END_ONE_WAY),
        ];
        for (low, high) in ends {
            for (from, v) in [(0.0, -2.0), (0.1, -2.0), (0.3, 1.0), (0.5, -1.0)] {
                assert!((at(low, from + 0.2, v) + at(high, 1.4 - from, -v)).abs() < 1e-12);
            }
        }
        assert!((at(SOFT_CLOSE, 0.4, -2.0) + 0.5).abs() < 1e-12 && at(SOFT_CLOSE, 0.7, -2.0) == 0.0);
        assert!(at(SOFT_END_ONE_WAY, 1.3, -1.0) == 0.0 && at(SOFT_END_ONE_WAY, 1.3, 1.0) > 0.0);
    }
}
