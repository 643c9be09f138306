//! What acts at one place of a joint's way: notches, latches, ends that give.

use super::family::{Law, Parameter};
use super::motion_laws::{Maker, form, units};
use super::motions::Scale;

/// Widest notch, as a share of the way that is seen.
const WIDEST: f64 = 0.25;

/// Laws that act at one place.
pub fn local_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let [effort, _, _, per_place] = units(s.turns);
    let [low, high] = s.range;
    let span = (high - low).max(1e-6);
    let unit = if s.turns { "rad" } else { "m" };
    let within = |name, from: f64, to: f64| Parameter {
        unit,
        low: from,
        high: to,
        ..Parameter::place(name, 0.5 * (from + to), (0.4 * (to - from)).max(1e-6))
    };
    let notches = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85]
        .iter()
        .flat_map(|x| [0.06f64, 0.13].map(|w| vec![low + x * span, (w * span).ln()]));
    let stop = |name| Parameter::positive(name, per_place, 4.0 * s.load / span);
    // What is wider is at no one place.
    let width = Parameter {
        high: (WIDEST * span).ln(),
        ..Parameter::scale("w", unit, 0.1 * span, 0.5)
    };
    let latch = |form: usize, at: [f64; 2], start: f64| {
        make.law(
            "latch",
            form,
            (
                vec![Parameter::positive("A", effort, 0.7 * s.load)],
                vec![
                    within("qd", at[0], at[1]),
                    Parameter::scale("w", unit, 0.08 * span, 0.5),
                ],
            ),
            [0.05f64, 0.1].iter().map(|w| vec![start, (w * span).ln()]).collect(),
            "the joint is held at its closed end",
        )
    };
    let detent = |form: usize| {
        make.law(
            "detent",
            form,
            (
                vec![Parameter::amplitude("A", effort, 0.5 * s.load)],
                vec![within("qd", low + 0.08 * span, high - 0.08 * span), width.clone()],
            ),
            notches.clone().collect(),
            "at one place the joint is held and drawn in from either side",
        )
    };
    let closed = [low - 0.05 * span, low + 0.08 * span];
    let mut laws = vec![
        detent(form::DETENT),
        detent(form::NOTCH),
        latch(form::DETENT, closed, low),
        latch(form::NOTCH, closed, low),
        make.law(
            "limit-compliance",
            form::LIMIT_HIGH,
            (vec![stop("k")], vec![within("q_limit", low + 0.4 * span, high)]),
            [0.6, 0.75, 0.85, 0.93].iter().map(|x| vec![low + x * span]).collect(),
            "past some place the joint runs into something that gives",
        ),
        make.law(
            "limit-compliance",
            form::LIMIT_LOW,
            (
                vec![stop("k")],
                // Nearer to where motions set out it could not be told from their start.
                vec![within("q_limit", low + 0.12 * span, low + 0.5 * span)],
            ),
            [0.15, 0.25, 0.4].iter().map(|x| vec![low + x * span]).collect(),
            "before some place the joint runs into something that gives",
        ),
    ];
    laws.extend([form::SOFT_CLOSE, form::SOFT_CLOSE_ONE_WAY].map(|form| soft_close(make, s, form)));
    // Closed may be where the joint stood when the capture began, though it is moved past that.
    if low + 0.13 * span < 0.0 && 0.0 < high - 0.1 * span {
        let shut = [-0.05 * span, 0.05 * span];
        laws.extend([form::DETENT, form::NOTCH].map(|form| latch(form, shut, 0.0)));
    }
    laws
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
        "near its closed end the joint resists in proportion to its speed",
    )
}
