//! What acts at one place of a joint's way: notches, latches, ends that give.

use super::family::{Law, Parameter};
use super::motion_closes::{moved_past, soft_closes};
use super::motion_laws::{Maker, form, units};
use super::motions::Scale;

/// Widest notch, as a share of the way that is seen.
const WIDEST: f64 = 0.25;

/// Least power with which the pull of a notch fades.
const FADES: f64 = 1.2;
/// Makes a notch as deep as a detent of the same effort and width: `exp(-1/2)` over the largest of `s (1 - s²)²`.
const PEAK: f64 = 0.606_530_66 / 0.286_216_7;

/// What draws the joint to one place, of an effort (largest times `exp(1/2)`), the place, the logarithm of the distance at which it is
/// largest, and how it ends, at a position.
pub(super) fn notch(kind: usize, x: &[f64], q: f64) -> f64 {
    let s = (q - x[1]) / x[2].exp();
    let as_deep = |peak: f64, shape: &dyn Fn(f64) -> f64| x[0] * (-0.5_f64).exp() * shape(s * peak) / shape(peak);
    match kind {
        // With an edge: a ball drops into a notch and out of it.
        form::NOTCH => {
            let s = s / 5.0_f64.sqrt();
            x[0] * PEAK * s * (1.0 - s * s).max(0.0).powi(2)
        }
        // The sharper its edge the nearer to half a wave; without any it is a Gaussian's.
        form::NOTCH_EDGED => {
            let edge = x[3].exp();
            let peak = (2.0 * edge + 1.0).sqrt().recip();
            as_deep(peak, &|s| s * (1.0 - s * s).max(0.0).powf(edge))
        }
        // What reaches far, as a magnet does: with the power at infinity it is a Gaussian's again.
        form::NOTCH_TAILED => {
            let tail = x[3].exp();
            let peak = (2.0 * tail - 1.0).sqrt().recip();
            as_deep(peak, &|s| s * (1.0 + s * s).powf(-tail))
        }
        // A cam with a roof: it sets in at once and falls off to its edges.
        form::NOTCH_ROOFED => {
            let (s, over, falls) = (0.25 * s, x[3].exp(), x[4].exp());
            x[0] * (-0.5_f64).exp() * (s / over).tanh() * (1.0 - s.abs()).max(0.0).powf(falls)
        }
        // A catch that holds fastest where it is shut: what is farther from it than its gap is drawn by a power of that.
        form::NOTCH_CATCH => x[0] * (-0.5_f64).exp() * s.max(1.0).powf(-x[3].exp()),
        form::NOTCH_CATCH_END => -x[0] * (-0.5_f64).exp() * (-s).max(1.0).powf(-x[3].exp()),
        _ => x[0] * s * (-0.5 * s * s).exp(),
    }
}

/// Laws that act at one place.
pub fn local_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let effort = units(s.turns)[0];
    let [low, high] = s.range;
    let span = (high - low).max(1e-6);
    let unit = if s.turns { "rad" } else { "m" };
    let within = |name, from: f64, to: f64| within(unit, name, [from, to]);
    let notches = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85]
        .iter()
        .flat_map(|x| [0.06f64, 0.13].map(|w| vec![low + x * span, (w * span).ln()]));
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
    // Which end is the closed one depends on which way its axis points.
    let closed = [low - 0.05 * span, low + 0.08 * span];
    let end = [high - 0.08 * span, high + 0.05 * span];
    let stops = stops(make, s);
    let stiffening = stops.clone().map(|stop| closer_of(stop, stiffens(span, unit)));
    let mut laws = [form::DETENT, form::NOTCH].map(&detent).to_vec();
    let latches = [(closed, low, form::NOTCH_CATCH), (end, high, form::NOTCH_CATCH_END)];
    for (at, start, _) in latches {
        laws.extend([form::DETENT, form::NOTCH].map(|form| latch(form, at, start)));
    }
    laws.extend(stops);
    laws.extend(soft_closes(make, s));
    // Closed may be where the joint stood when the capture began, though it is moved past that.
    if moved_past(s.range) {
        let shut = [-0.05 * span, 0.05 * span];
        laws.extend([form::DETENT, form::NOTCH].map(|form| latch(form, shut, 0.0)));
        laws.push(closer_of(latch(form::NOTCH_EDGED, shut, 0.0), edge()));
        laws.push(closer_of(latch(form::NOTCH_TAILED, shut, 0.0), tail()));
    }
    laws.push(closer_of(detent(form::NOTCH_EDGED), edge()));
    laws.push(closer_of(detent(form::NOTCH_TAILED), tail()));
    laws.push(roofed(detent(form::NOTCH_ROOFED)));
    for (at, start, catch) in latches {
        let power = Parameter::scale("power", "1", 3.0, 0.35);
        let closer = [
            (form::NOTCH_EDGED, edge()),
            (form::NOTCH_TAILED, tail()),
            (catch, power),
        ];
        laws.extend(closer.map(|(form, more)| closer_of(latch(form, at, start), more)));
    }
    laws.extend(stiffening);
    laws
}

/// A notch whose pull sets in within a share of its reach and falls off as a power of what is left of that.
fn roofed(detent: Law) -> Law {
    let more = [
        Parameter::scale("over", "1", 0.15, 0.6),
        Parameter::scale("falls", "1", 0.8, 0.5),
    ];
    Law {
        extends: &[form::DETENT, form::NOTCH],
        grid: [[0.1f64, 1.0], [0.25, 0.5]].map(|x| x.map(f64::ln).to_vec()).to_vec(),
        parameters: [detent.parameters.as_slice(), &more].concat(),
        ..detent
    }
}

/// How sharply a notch ends: from nearly a half wave to one that fades out.
fn edge() -> Parameter {
    Parameter::scale("edge", "1", 2.0, 0.7)
}

/// How soon the pull of a notch fades far from it: the power of one and the distance squared that it is divided by. What hardly
/// fades is at no one place.
fn tail() -> Parameter {
    Parameter {
        low: FADES.ln(),
        ..Parameter::scale("tail", "1", 2.2, 0.4)
    }
}

/// Way into a stop on which it becomes twice as stiff as at first.
fn stiffens(span: f64, unit: &'static str) -> Parameter {
    Parameter::scale("doubles", unit, 0.1 * span, 0.8)
}

/// By how much a spring becomes stiffer, over its stiffness at rest and the square of how far it is drawn.
pub(super) fn hardens(span: f64, turns: bool) -> Parameter {
    Parameter {
        unit: if turns { "1/rad²" } else { "1/m²" },
        low: -0.25 / (span * span),
        ..Parameter::place("hardens", 0.0, 2.0 / (span * span))
    }
}

/// The closer form of a law with one number more.
pub(super) fn closer_of(law: Law, more: Parameter) -> Law {
    let (form, extends): (usize, &'static [usize]) = match law.form {
        form::LIMIT_HIGH => (form::LIMIT_HIGH_STIFFENING, &[form::LIMIT_HIGH]),
        form::LIMIT_LOW => (form::LIMIT_LOW_STIFFENING, &[form::LIMIT_LOW]),
        form::SPRING => (form::SPRING_HARDENING, &[form::SPRING]),
        edged => (edged, &[form::DETENT, form::NOTCH]),
    };
    Law {
        form,
        extends,
        grid: [-0.7, 0.7].map(|off| vec![more.centre + off * more.sd]).to_vec(),
        parameters: [law.parameters, vec![more]].concat(),
        ..law
    }
}

/// A spring of which the pull comes to an end: `k (q - q0) / sqrt(1 + ((q - q0) / yields)²)`.
pub(super) fn yielding(spring: &Law, span: f64, turns: bool) -> Law {
    let yields = Parameter::scale("yields", if turns { "rad" } else { "m" }, 0.5 * span, 0.7);
    Law {
        form: form::SPRING_YIELDING,
        ..closer_of(spring.clone(), yields)
    }
}

/// A place that lies there for sure.
fn within(unit: &'static str, name: &'static str, [from, to]: [f64; 2]) -> Parameter {
    Parameter {
        unit,
        low: from,
        high: to,
        ..Parameter::place(name, 0.5 * (from + to), (0.4 * (to - from)).max(1e-6))
    }
}

/// Ends that give, at the far end of the way and at the near one.
fn stops(make: &Maker, s: &Scale) -> [Law; 2] {
    let per_place = units(s.turns)[3];
    let [low, high] = s.range;
    let span = (high - low).max(1e-6);
    let unit = if s.turns { "rad" } else { "m" };
    let within = |name, from: f64, to: f64| within(unit, name, [from, to]);
    let stop = |name| Parameter::positive(name, per_place, 4.0 * s.load / span);
    [
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
    ]
}

#[cfg(test)]
mod tests {
    use super::super::family::Active;
    use super::super::motion_laws::{Moved, effort, open_at_rest};
    use super::*;

    fn law(form: usize) -> Law {
        Maker { joint: "door" }.law("detent", form, (Vec::new(), Vec::new()), Vec::new(), "")
    }

    fn at(position: f64, form: usize, values: &[f64]) -> f64 {
        let (moved, law) = (
            Moved {
                position,
                ..Moved::default()
            },
            law(form),
        );
        effort(&moved, &[Active { law: &law, values }])
    }

    #[test]
    fn the_edged_notch_is_the_others_at_their_edges_and_as_deep_at_any() {
        let [a, qd, w] = [0.3, 0.1, 0.05];
        let shape = [a, qd, f64::ln(w)];
        for k in -30..30 {
            let q = qd + 0.005 * f64::from(k);
            let edged = |edge: f64| at(q, form::NOTCH_EDGED, &[a, qd, w.ln(), edge.ln()]);
            assert!((edged(2.0) - at(q, form::NOTCH, &shape)).abs() < 1e-9);
            assert!((edged(1e4) - at(q, form::DETENT, &shape)).abs() < 1e-4);
        }
        for edge in [0.5, 1.5, 8.0] {
            let peak = at(qd + w, form::NOTCH_EDGED, &[a, qd, w.ln(), f64::ln(edge)]);
            assert!((peak - a * (-0.5_f64).exp()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_catch_at_the_far_end_is_the_one_at_the_near_end_seen_from_there() {
        let values = [0.3, 0.1, 0.01_f64.ln(), 3.0_f64.ln()];
        for off in [0.0, 0.004, 0.012, 0.05] {
            let [near, far] = [(off, form::NOTCH_CATCH), (-off, form::NOTCH_CATCH_END)]
                .map(|(off, form)| at(0.1 + off, form, &values));
            assert!((near + far).abs() < 1e-12 && near > 0.0);
        }
    }

    #[test]
    fn a_roofed_notch_pulls_at_once_and_ends_at_its_edge() {
        let values = [0.3, 0.1, 0.01_f64.ln(), 0.05_f64.ln(), 0.0];
        let pull = |off: f64| at(0.1 + off, form::NOTCH_ROOFED, &values);
        assert!((pull(0.01) + pull(-0.01)).abs() < 1e-12 && pull(0.05) == 0.0);
        // Half way out half of it is left.
        assert!((pull(0.02) / (0.3 * (-0.5_f64).exp()) - 0.5).abs() < 1e-6);
        assert!(pull(0.004) > pull(0.02));
    }

    #[test]
    fn the_tailed_notch_is_a_detent_without_its_tail_and_as_deep_with_any() {
        let [a, qd, w] = [0.3, 0.1, 0.05];
        let tailed = |q: f64, tail: f64| at(q, form::NOTCH_TAILED, &[a, qd, w.ln(), tail.ln()]);
        for k in -30..30 {
            let q = qd + 0.005 * f64::from(k);
            assert!((tailed(q, 1e4) - at(q, form::DETENT, &[a, qd, w.ln()])).abs() < 1e-4);
        }
        for tail in [1.0, 2.0, 8.0] {
            assert!((tailed(qd + w, tail) - a * (-0.5_f64).exp()).abs() < 1e-9);
            assert!(
                tailed(qd + 0.9 * w, tail) < tailed(qd + w, tail) && tailed(qd + 1.1 * w, tail) < tailed(qd + w, tail)
            );
        }
        // Of the power two it falls as the cube of the distance.
        assert!((tailed(qd + 40.0 * w, 2.0) / tailed(qd + 80.0 * w, 2.0) - 8.0).abs() < 0.05);
    }

    #[test]
    fn a_catch_falls_as_a_power_of_the_distance_from_where_it_is_shut() {
        let [a, gap] = [0.3, 0.035_f64];
        let pull = |q: f64| at(q, form::NOTCH_CATCH, &[a, -gap, gap.ln(), 3.0_f64.ln()]);
        let most = a * (-0.5_f64).exp();
        for q in [0.0, 0.01, 0.05, 0.3] {
            assert!((pull(q) - most * (1.0 + q / gap).powi(-3)).abs() < 1e-12);
        }
        assert!((pull(-0.02) - most).abs() < 1e-12);
    }

    #[test]
    fn an_edged_close_damps_before_its_edge_and_not_beyond_it() {
        let force = |q: f64| {
            let law = law(form::SOFT_CLOSE_EDGED);
            let values = [0.2, 0.6_f64.ln(), 0.02_f64.ln()];
            let moved = Moved {
                position: q,
                speed: 0.5,
                ..Moved::default()
            };
            effort(
                &moved,
                &[Active {
                    law: &law,
                    values: &values,
                }],
            )
        };
        assert!((force(0.1) - 0.1).abs() < 1e-4 && force(0.5).abs() < 1e-4 && (force(0.3) - 0.05).abs() < 1e-9);
    }

    #[test]
    fn a_spring_that_yields_is_a_plain_one_near_its_rest_and_pulls_no_more_far_from_it() {
        let force = |q: f64| at(q, form::SPRING_YIELDING, &[2.0, 0.3, 0.5_f64.ln()]);
        assert!((force(0.31) - 2.0 * 0.01).abs() < 1e-5);
        assert!((force(50.3) - 1.0).abs() < 1e-3 && (force(0.8) - 1.0 / 2.0_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_spring_that_hardens_is_a_plain_one_near_its_rest() {
        let force = |q: f64, hardens: f64| at(q, form::SPRING_HARDENING, &[2.0, 0.3, hardens]);
        assert!((force(0.8, 0.0) - at(0.8, form::SPRING, &[2.0, 0.3])).abs() < 1e-12);
        assert!((force(0.8, 4.0) - 2.0).abs() < 1e-12 && (force(-0.2, 4.0) + 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_stop_that_stiffens_is_a_plain_one_at_first_and_twice_as_stiff_where_it_is_said() {
        let stiff = |q: f64| {
            let at = |q: f64| at(q, form::LIMIT_HIGH_STIFFENING, &[5.0, 0.4, f64::ln(0.1)]);
            (at(q + 1e-6) - at(q - 1e-6)) / 2e-6
        };
        assert!((stiff(0.3999)).abs() < 1e-9 && (stiff(0.401) - 5.05).abs() < 1e-3);
        assert!((stiff(0.5) - 10.0).abs() < 1e-3);
        let low = |q: f64| at(q, form::LIMIT_LOW_STIFFENING, &[5.0, 0.4, f64::ln(0.1)]);
        assert!((low(0.3) + 0.75).abs() < 1e-9 && low(0.5).abs() < 1e-12);
    }

    /// What stands in a stiff place is at rest there, wherever that is said to be.
    #[test]
    fn rest_in_a_stiff_place_is_judged_by_what_is_known_of_the_place() {
        let (law, values) = (law(form::LIMIT_HIGH), [20.0, 0.0]);
        let moved = |doubt: f64| Moved {
            position: 0.1,
            doubt,
            ..Moved::default()
        };
        let open = |doubt: f64| {
            let active = [Active {
                law: &law,
                values: &values,
            }];
            open_at_rest(&moved(doubt), &active)
        };
        assert!(open(0.0).abs() < 1e-12 && (open(2e-3) - 0.04).abs() < 1e-9);
    }
}
