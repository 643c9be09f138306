//! Closer forms of what was found in pushes: what creases with the heading, and places that are not round.

use std::f64::consts::PI;

use super::family::{Law, Parameter};
use super::push_catalogue::{law, share_by_heading};
use super::push_laws::form;
use super::push_places::{differs, round, steepness, workspace};
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
    creased.into_iter().chain(ovals).collect()
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

/// The logarithm of the power with which a place ends: of nought a Gaussian, of two a disc.
fn edge() -> Parameter {
    Parameter {
        unit: "1",
        low: -0.5,
        high: 2.2,
        ..Parameter::place("edge", 0.8, 0.7)
    }
}
