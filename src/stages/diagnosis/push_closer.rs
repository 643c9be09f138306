//! Closer forms of what was found in pushes: what creases with the heading, and places that are not round.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::family::{Law, Parameter};
use super::push_catalogue::{law, share_by_heading};
use super::push_laws::form;
use super::push_places::{differs, loose, round, steepness, workspace};
use super::pushes::Pushes;

/// Forms with more numbers, which are tried where the one that they extend was taken up.
pub(super) fn closer_laws(pushes: &Pushes) -> Vec<Law> {
    let (middle, sd, _) = workspace(pushes);
    let creased = [
        creased("support", form::ANISOTROPY_CREASED, &[form::ANISOTROPY]),
        creased("body", form::ANISOTROPY_OF_BODY_CREASED, &[form::ANISOTROPY_OF_BODY]),
    ];
    let ovals = [
        Law {
            extends: &[form::PATCH, form::PATCH_SHARP],
            ..law(
                "friction-patch",
                "support",
                form::PATCH_OVAL,
                vec![differs()],
                [round(middle, sd), stretched(), vec![edge()]].concat(),
                [
                    [0.0, 0.0, 1.0],
                    [0.6, 0.0, 1.0],
                    [0.6, 0.25 * PI, 0.5],
                    [0.6, 0.5 * PI, 1.0],
                    [0.6, 0.75 * PI, 0.5],
                ]
                .map(Vec::from)
                .to_vec(),
                "friction differs at one place of the table",
            )
        },
        Law {
            extends: &[form::BUMP, form::BUMP_BOUNDED],
            ..law(
                "bump",
                "support",
                form::BUMP_OVAL,
                vec![steepness()],
                [round(middle, sd), stretched()].concat(),
                [0.0, 0.25, 0.5, 0.75].map(|turn| vec![0.8, turn * PI]).to_vec(),
                "the table rises at one place: up costs what down gives back",
            )
        },
    ];
    let weakening = Law {
        extends: &[form::WEAKENING, form::WEAKENING_SQUARE],
        ..law(
            "velocity-weakening-friction",
            "support",
            form::WEAKENING_SHAPED,
            vec![Parameter::positive("a", "1", 0.3)],
            vec![Parameter::scale("vs", "m/s", 0.02, 0.8), power(), slow_tail()],
            [[1.0, 0.3], [1.5, 0.8], [2.0, 0.1], [0.7, 0.1]]
                .map(|[n, tail]: [f64; 2]| vec![n.ln(), tail])
                .to_vec(),
            "friction is stronger at low speed",
        )
    };
    creased
        .into_iter()
        .chain(ovals)
        .chain([weakening, fastened(middle, sd), near(middle)])
        .chain(settling())
        .chain([warming()])
        .collect()
}

/// A sensor that warms up: it creeps in its own frame, and settles.
fn warming() -> Law {
    let d = |name| Parameter::amplitude(name, "N/s", 0.2 / 60.0);
    Law {
        extends: &[form::DRIFT_ALONG, form::DRIFT_WORLD],
        ..law(
            "force-drift",
            "sensor",
            form::DRIFT_SETTLING,
            vec![d("d_tool_x"), d("d_tool_y"), d("d_tool_z")],
            vec![Parameter::nought_before(), Parameter::scale("settles", "s", 60.0, 0.8)],
            [20.0, 60.0, 180.0].map(|most: f64| vec![0.0, most.ln()]).to_vec(),
            "the reading without touching creeps with time in the tool's own frame, and settles",
        )
    }
}

/// Wear and heat that come to an end.
fn settling() -> [Law; 2] {
    let one = |form, slope, most, starts: [f64; 3], words| Law {
        extends: &[form::WEAR, form::HEATING],
        ..law(
            "wear-or-heating",
            "support",
            form,
            vec![slope],
            vec![most],
            starts.map(|x| vec![x.ln()]).to_vec(),
            words,
        )
    };
    [
        one(
            form::WEAR_SETTLING,
            Parameter::amplitude("w", "1/m", 0.5),
            Parameter::scale("settles", "m", 0.6, 0.8),
            [0.2, 0.6, 1.8],
            "friction changes with the distance slid, and settles",
        ),
        one(
            form::HEATING_SETTLING,
            Parameter::amplitude("kappa", "1/s", 1e-3),
            Parameter::scale("settles", "s", 120.0, 0.8),
            [40.0, 120.0, 360.0],
            "friction changes with time, and settles",
        ),
    ]
}

/// A tether that is fastened beside the body's centre.
fn fastened(middle: Vector2<f64>, sd: f64) -> Law {
    let tether = loose(middle, sd, form::TETHER_OF_BODY);
    let on_body = ["ex", "ey"].map(|name| Parameter::place(name, 0.0, 0.02));
    let sides = [[0.0, 0.0], [0.015, 0.0], [-0.015, 0.0], [0.0, 0.015], [0.0, -0.015]];
    let starts = sides
        .iter()
        .flat_map(|on| tether.grid.iter().map(move |start| [start.as_slice(), on].concat()));
    Law {
        extends: &[
            form::TETHER,
            form::TETHER_SLACK,
            form::TETHER_ROUND,
            form::TETHER_CAUGHT,
        ],
        grid: starts.collect(),
        parameters: tether.parameters.iter().cloned().chain(on_body).collect(),
        ..tether.clone()
    }
}

/// A tether that is slack at first and whose far end is near, but outside of where the body goes: it pulls another way from place to
/// place.
fn near(middle: Vector2<f64>) -> Law {
    let far = |name, centre: f64| Parameter::place(name, centre, 0.15);
    let length = Parameter {
        low: 0.0,
        high: 0.6,
        ..Parameter::place("L", 0.15, 0.1)
    };
    let ends = (0..8).flat_map(|k| {
        let angle = 0.25 * PI * f64::from(k);
        [0.1, 0.25].map(|l| vec![middle.x + l * angle.cos(), middle.y + l * angle.sin(), l])
    });
    Law {
        extends: &[form::TETHER_SLACK],
        ..law(
            "tether",
            "support",
            form::TETHER_NEAR,
            vec![Parameter::positive("k", "N/m", 20.0)],
            vec![far("px", middle.x), far("py", middle.y), length],
            ends.collect(),
            "beyond some way from one place something pulls the body back",
        )
    }
}

/// Friction by the heading with a part that goes four times a turn.
fn creased(place: &str, form: usize, extends: &'static [usize]) -> Law {
    Law {
        extends,
        ..law(
            "anisotropic-friction",
            place,
            form,
            ["ac", "as"].map(share_by_heading).to_vec(),
            vec![fourth()],
            vec![vec![-0.15], vec![0.15]],
            "friction depends on the direction across what rubs",
        )
    }
}

/// Four times a turn over twice a turn, about the same axis.
fn fourth() -> Parameter {
    Parameter {
        unit: "1",
        low: -0.4,
        high: 0.4,
        ..Parameter::place("fourth", 0.0, 0.15)
    }
}

/// The logarithm of length over width of what lies at one place, and its angle.
fn stretched() -> Vec<Parameter> {
    let stretch = Parameter {
        unit: "1",
        low: -2.5,
        high: 2.5,
        ..Parameter::place("stretch", 0.0, 0.8)
    };
    let angle = Parameter {
        unit: "rad",
        ..Parameter::place("angle", 0.0, 2.0)
    };
    vec![stretch, angle]
}

/// The power of the speed with which friction falls.
fn power() -> Parameter {
    Parameter {
        low: 0.5_f64.ln(),
        high: 3.0_f64.ln(),
        ..Parameter::scale("n", "1", 1.2, 0.4)
    }
}

/// How slowly its fall ends: of nearly nought an exponential, of one as one over that power.
fn slow_tail() -> Parameter {
    Parameter {
        unit: "1",
        low: 0.02,
        high: 1.5,
        ..Parameter::place("tail", 0.3, 0.4)
    }
}

/// The logarithm of the power with which a place ends: of nought a Gaussian, of two a disc.
fn edge() -> Parameter {
    Parameter {
        unit: "1",
        low: -0.5,
        high: 2.2,
        ..Parameter::place("edge", 0.8, 0.7)
    }
}
