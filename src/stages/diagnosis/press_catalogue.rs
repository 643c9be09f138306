//! The laws that presses can show, with the priors of their parameters and where a fit of them may start.

use super::family::{Law, Parameter, Scatter};
use super::press_closer::closer_laws;
use super::press_laws::{TURNS, form};
use super::presses::Presses;

pub(super) fn law(
    cause: &'static str,
    form: usize,
    amplitudes: Vec<Parameter>,
    shapes: Vec<Parameter>,
    grid: Vec<Vec<f64>>,
    words: &'static str,
) -> Law {
    let count = amplitudes.len();
    let parameters = amplitudes.into_iter().chain(shapes).collect();
    let sensor = (form::BIAS..=form::LAG).contains(&form) || matches!(form, form::LAG_OF_TWO | form::SATURATION_ROUND);
    let place = if sensor { "sensor" } else { "body" }.into();
    Law {
        cause,
        place,
        form,
        parameters,
        amplitudes: count,
        grid,
        extends: &[],
        words,
    }
}

/// What is new in every press: where the surface begins for the force, the tare, the stiffness, and where the tool met it.
pub fn scatter() -> Vec<Scatter> {
    let rows = [
        (5e-5, 4.0, 5e-6, true, 1e-7),
        (0.003, 10.0, 0.003, true, 1e-4),
        (0.01, 10.0, 0.002, false, 1e-4),
        (1.5e-4, 3.0, 2e-5, true, 1e-7),
    ];
    let one = |(tau, counts, floor, nuisance, step)| Scatter {
        tau,
        counts,
        floor,
        nuisance,
        step,
    };
    rows.into_iter().map(one).collect()
}

/// Every law that presses can show.
pub fn press_laws(presses: &Presses) -> Vec<Law> {
    let mut laws = curve_laws(presses.deepest.max(1e-5));
    laws.extend(history_laws(presses.deepest.max(1e-5)));
    laws.extend(closer_laws(presses.deepest.max(1e-5)));
    laws.extend(guide_laws());
    laws.extend(memory_laws(presses.deepest.max(1e-5)));
    laws.extend(of_one(presses, &laws));
    laws.extend(sensor_laws(presses));
    laws
}

/// Fewest presses of one of several things that a law may be of alone.
const PRESSES: usize = 3;

/// Laws of one thing alone, where several were pressed: what one of them does a reference beside it does not.
fn of_one(presses: &Presses, laws: &[Law]) -> Vec<Law> {
    if presses.names.len() < 2 {
        return Vec::new();
    }
    let pressed = |body: usize| {
        let own = presses.bodies.iter().zip(&presses.sheet.groups);
        own.filter(|(b, g)| **b == body && !g.held_out).count()
    };
    let several = (0..presses.names.len()).filter(|body| pressed(*body) >= PRESSES);
    let of = |body: usize| {
        let place = &presses.names[body];
        laws.iter().cloned().map(move |law| Law {
            place: place.clone(),
            ..law
        })
    };
    several.flat_map(of).collect()
}

fn plain(cause: &'static str, form: usize, amplitude: Parameter, words: &'static str) -> Law {
    law(cause, form, vec![amplitude], Vec::new(), vec![Vec::new()], words)
}

fn logs(values: &[f64]) -> Vec<Vec<f64>> {
    values.iter().map(|v| vec![v.ln()]).collect()
}

/// A depth at which something begins or is.
pub(super) fn at(name: &'static str, deepest: f64) -> Parameter {
    Parameter {
        low: 0.0,
        high: deepest,
        ..Parameter::place(name, 0.5 * deepest, 1e-3f64.min(0.3 * deepest))
    }
}

fn curve_laws(deepest: f64) -> Vec<Law> {
    let depths = |shares: &[f64]| shares.iter().map(|s| vec![s * deepest]).collect::<Vec<_>>();
    let notches = [0.25, 0.5, 0.75, 1.1]
        .iter()
        .flat_map(|d| [1.5e-4f64, 4e-4].map(|w| vec![d * deepest, w.ln()]))
        .collect();
    let bent = |form| {
        plain(
            "hardening-stiffness",
            form,
            Parameter {
                low: -0.9,
                ..Parameter::amplitude("a", "1", 0.3)
            },
            "the force bends away from a straight line with depth, the same in and out",
        )
    };
    vec![
        bent(form::CURVED),
        bent(form::CUBIC),
        bent(form::EXPONENTIAL),
        law(
            "second-stage",
            form::STAGE,
            vec![Parameter::positive("k2_over_k", "1", 0.4)],
            vec![at("d", deepest)],
            depths(&[0.2, 0.35, 0.5, 0.65, 0.8]),
            "from some depth on a second spring bears",
        ),
        plain(
            "power-law-stiffness",
            form::POWER,
            Parameter {
                low: -0.8,
                ..Parameter::amplitude("h", "1", 0.3)
            },
            "the force grows as a power of the depth",
        ),
        law(
            "snap-through",
            form::SNAP,
            vec![Parameter::positive("A", "N", 1.0)],
            vec![
                // Of one that lies a little deeper the flank is felt.
                Parameter {
                    high: 1.3 * deepest,
                    ..at("us", deepest)
                },
                Parameter::scale("w", "m", 3e-4, 0.6),
            ],
            notches,
            "the force drops at one depth",
        ),
        law(
            "preload",
            form::PRELOAD,
            vec![Parameter::positive("F0", "N", 0.5)],
            // The tip of the finger and what holds the thing back give a little.
            vec![Parameter::scale("over", "m", 5e-5, 0.8)],
            logs(&[2e-5, 1e-4]),
            "the force steps up at first contact",
        ),
    ]
}

/// What a deep press leaves behind, at its spot or, under a stiff skin, all over.
fn memory_laws(deepest: f64) -> Vec<Law> {
    let yields = || Parameter {
        low: 0.0,
        ..Parameter::place("uy", 0.3 * deepest, 0.3 * deepest)
    };
    let share = || Parameter {
        high: 0.95,
        ..Parameter::positive("a", "1", 0.2)
    };
    let set = |form| {
        law(
            "plastic-set",
            form,
            vec![share()],
            vec![yields()],
            vec![vec![0.0], vec![0.3 * deepest], vec![0.6 * deepest]],
            "the surface stays lower after a deep press",
        )
    };
    let used = |form| {
        law(
            "softening-by-use",
            form,
            vec![share()],
            vec![Parameter::scale("reach", "m", deepest, 0.7)],
            logs(&[0.4 * deepest, deepest]),
            "where it was pressed before it is softer",
        )
    };
    vec![
        set(form::SET),
        set(form::SET_ALL_OVER),
        used(form::MULLINS),
        used(form::MULLINS_ALL_OVER),
    ]
}

/// Dry friction of what guides the press.
fn guide_laws() -> Vec<Law> {
    vec![
        plain(
            "guide-friction",
            form::GUIDE,
            Parameter::positive("Fc", "N", 0.4),
            "a constant friction opposes going in and coming out",
        ),
        law(
            "guide-friction",
            form::GUIDE_SOFT,
            vec![Parameter::positive("Fc", "N", 0.4)],
            // What sets in over larger speeds is a damper.
            vec![Parameter {
                high: TURNS.ln(),
                ..Parameter::scale("vs", "m/s", 5e-4, 0.8)
            }],
            logs(&[5e-4]),
            "a constant friction opposes going in and coming out",
        ),
        // Dry friction holds while the tool stands still; it turns as soon as what gives in the guide is used up.
        law(
            "guide-friction",
            form::GUIDE_HELD,
            vec![Parameter::positive("Fc", "N", 0.4)],
            // What turns over a longer way is no dry friction.
            vec![Parameter {
                high: 2.5e-4_f64.ln(),
                ..Parameter::scale("over", "m", 5e-5, 0.8)
            }],
            logs(&[5e-5]),
            "a constant friction opposes going in and coming out",
        ),
    ]
}

fn history_laws(deepest: f64) -> Vec<Law> {
    let looped = |form| {
        law(
            "elastic-hysteresis",
            form,
            vec![Parameter::positive("A", "N", 0.5)],
            vec![Parameter::scale("d", "m", 1e-3, 0.6)],
            logs(&[3e-4, 1e-3, 2e-3]),
            "going in costs more than coming out gives back, at any speed",
        )
    };
    vec![
        plain(
            "elastic-damping",
            form::DAMPING,
            Parameter::positive("c_over_k", "s", 0.03),
            "the force depends on how fast the tool goes in",
        ),
        law(
            "elastic-damping",
            form::DAMPING_POWER,
            vec![Parameter::positive("c_over_k", "s", 0.03)],
            vec![Parameter::less_than_linear()],
            vec![vec![0.7]],
            "the force depends on how fast the tool goes in",
        ),
        law(
            "elastic-damping",
            form::DAMPING_GROWN,
            vec![Parameter::positive("c_over_k", "s", 0.03)],
            vec![Parameter::scale("over", "m", 0.1 * deepest, 1.0)],
            logs(&[0.04 * deepest, 0.3 * deepest]),
            "the force depends on how fast the tool goes in",
        ),
        law(
            "stress-relaxation",
            form::RELAXATION,
            vec![Parameter::positive("s", "1", 0.2)],
            vec![Parameter::scale("tau", "s", 0.5, 0.8)],
            logs(&[0.1, 0.3, 1.0, 3.0]),
            "the force sinks while the tool stands still",
        ),
        looped(form::HYSTERESIS),
        looped(form::STOPS),
        plain(
            "stiffness-drift",
            form::DRIFT,
            Parameter::amplitude("kappa", "1/s", 1e-3),
            "the stiffness changes with time",
        ),
        law(
            "adhesion",
            form::ADHESION,
            vec![Parameter::positive("Fa", "N", 0.5)],
            vec![Parameter::scale("reach", "m", 3e-4, 0.6)],
            logs(&[2e-4, 5e-4]),
            "it clings to the tool on the way out",
        ),
        law(
            "adhesion",
            form::BOND,
            vec![Parameter::positive("Fa", "N", 0.5)],
            vec![Parameter::scale("reach", "m", 5e-5, 0.8)],
            logs(&[2e-5, 1e-4]),
            "it clings to the tool on the way out",
        ),
    ]
}

fn sensor_laws(presses: &Presses) -> Vec<Law> {
    let largest = presses.largest.max(1e-2);
    let slow = |form| {
        plain(
            "sensor-lag",
            form,
            Parameter::positive("Tf", "s", 0.05),
            "the force sensor follows slowly",
        )
    };
    vec![
        plain(
            "force-bias",
            form::BIAS,
            Parameter::amplitude("b", "N", 0.3),
            "the sensor reads a force without touching",
        ),
        law(
            "force-drift",
            form::SENSOR_DRIFT,
            vec![Parameter::amplitude("d", "N/s", 0.1 / 60.0)],
            vec![Parameter::nought_before()],
            vec![vec![0.0]],
            "the reading without touching creeps with time",
        ),
        law(
            "force-saturation",
            form::SATURATION,
            Vec::new(),
            // Nothing larger than the limit can have been read.
            vec![Parameter {
                low: (0.97 * largest).ln(),
                ..Parameter::scale("Fs", "N", largest, 0.3)
            }],
            vec![vec![(0.985 * largest).ln()]],
            "the sensor cuts off large forces",
        ),
        law(
            "force-saturation",
            form::SATURATION_ROUND,
            Vec::new(),
            vec![
                Parameter {
                    low: (0.97 * largest).ln(),
                    ..Parameter::scale("Fs", "N", 1.03 * largest, 0.15)
                },
                // What bends sooner is a spring that softens.
                Parameter {
                    low: 6f64.ln(),
                    ..Parameter::scale("hardness", "1", 12.0, 0.4)
                },
            ],
            vec![vec![(1.03 * largest).ln(), 12f64.ln()]],
            "the sensor cuts off large forces",
        ),
        plain(
            "time-delay",
            form::DELAY,
            Parameter::amplitude("tau", "s", 0.03),
            "the motion is recorded later than the force",
        ),
        slow(form::LAG),
        slow(form::LAG_OF_TWO),
    ]
}
