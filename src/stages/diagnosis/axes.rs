//! Hinges as the ladder of laws sees their motion: where the point of the child that lies on the axis goes as the joint
//! turns. On an ideal hinge it stays.
//!
//! With the centre of turning at `c0 + c1 q` that point moves by `de/dq = a x (e - c0 - c1 q)`, solved by
//! `e = c1 q - (1 - R(q)) (c0' + a x c1)`: a share of it looks like an axis that is elsewhere, which the plain model has.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::Quantity;
use super::family::{Active, Channel, ChannelKind, Family, Group, Law, Parameter, Scatter, Sheet};
use super::joint_paths::{JointMoment, joint_path, travelled};
use crate::capture::{Capture, Interaction};
use crate::math::median;
use crate::twin::{Joint, JointKind, Model};

mod form {
    pub const EVEN: usize = 0;
    pub const CURVED: usize = 1;
    pub const BENT: usize = 2;
}

/// Angle of one sample, rad, and the most of them in an interaction.
const STEP: f64 = 0.04;
const MOST: usize = 80;
/// Angle that an interaction must turn through, rad, and fewest such interactions.
const TURNS: f64 = 0.25;
const FEWEST: usize = 3;
/// Noise that a mean over a sample keeps, m: markers and grips give.
const FLOOR: f64 = 3e-5;
/// A drift of less than this is what bearings and tracks have, m/rad.
const NEGLIGIBLE: f64 = 1.5e-3;

/// One stretch of a motion.
struct Place {
    /// s since the capture began.
    time: f64,
    /// rad.
    angle: f64,
}

/// The motions of one hinge.
pub struct Axes {
    sheet: Sheet,
    places: Vec<Vec<Place>>,
}

/// Hinges whose motion was tracked, one family each.
pub fn of_all_axes(capture: &Capture, model: &Model) -> Vec<Axes> {
    let hinges = model.twin.joints().filter(|j| j.kind == JointKind::Revolute);
    hinges.filter_map(|j| Axes::new(capture, model, j)).collect()
}

/// Time, angle and place of the point on the axis across it, sample by sample.
fn path(interaction: &Interaction, model: &Model, joint: &Joint) -> Option<Vec<(f64, f64, Vector2<f64>)>> {
    let moments = joint_path(interaction, model, joint)?;
    let axis = Vector3::from(joint.axis.value);
    // The world's x as far as it is across the axis, its y where the axis runs along x: what drifts is told by a direction
    // that a reader can find.
    let level = |e: Vector3<f64>| e - axis * axis.dot(&e);
    let x = level(Vector3::x());
    let first = if x.norm() > 0.3 { x } else { level(Vector3::y()) }.normalize();
    let second = axis.cross(&first);
    let across = |m: &JointMoment| {
        (
            m.time,
            m.position,
            Vector2::new(m.strays.dot(&first), m.strays.dot(&second)),
        )
    };
    (travelled(&moments) > TURNS).then(|| moments.iter().map(across).collect())
}

/// Means over stretches of one step of the angle, with the noise of a mean across the axis.
fn stretches(path: &[(f64, f64, Vector2<f64>)]) -> (Vec<Place>, Vec<Vector2<f64>>, f64) {
    let way: f64 = path.windows(2).map(|w| (w[1].1 - w[0].1).abs()).sum();
    let angles = path.iter().map(|p| p.1);
    let range = angles.clone().fold(f64::NEG_INFINITY, f64::max) - angles.fold(f64::INFINITY, f64::min);
    // To and fro counts twice; noise of a track is no way.
    let step = STEP.max(way.min(4.0 * range) / MOST as f64);
    let (mut places, mut means, mut spreads) = (Vec::new(), Vec::new(), Vec::new());
    let mut from = 0;
    while from < path.len() {
        let to = (from..path.len())
            .find(|i| (path[*i].1 - path[from].1).abs() > step)
            .unwrap_or(path.len());
        let own = &path[from..to];
        let n = own.len() as f64;
        let mean = own.iter().map(|p| p.2).sum::<Vector2<f64>>() / n;
        let spread = own.iter().map(|p| (p.2 - mean).norm_squared()).sum::<f64>() / (2.0 * n * n);
        places.push(Place {
            time: own.iter().map(|p| p.0).sum::<f64>() / n,
            angle: own.iter().map(|p| p.1).sum::<f64>() / n,
        });
        means.push(mean);
        spreads.push(spread.sqrt());
        from = to;
    }
    let noise = median(&spreads).unwrap_or(0.0).max(FLOOR);
    (places, means, noise)
}

impl Axes {
    fn new(capture: &Capture, model: &Model, joint: &Joint) -> Option<Self> {
        let mut out = Self {
            sheet: Sheet {
                scatter: scatter(),
                laws: laws(&joint.name),
                ..Sheet::default()
            },
            places: Vec::new(),
        };
        let mut noises = Vec::new();
        for interaction in &capture.interactions {
            let Some(path) = path(interaction, model, joint) else {
                continue;
            };
            let (places, means, noise) = stretches(&path);
            let n = means.len();
            let channel = |kind: usize| Channel {
                kind,
                measured: means.iter().map(|m| m[kind]).collect(),
                starts: (0..n).map(|i| i == 0).collect(),
                change: vec![0.0; n],
                aside: vec![0.0; n],
            };
            out.sheet.groups.push(Group {
                name: interaction.name.clone(),
                held_out: interaction.held_out,
                channels: vec![channel(0), channel(1)],
            });
            out.places.push(places);
            noises.push(noise);
        }
        if out.sheet.groups.len() < FEWEST {
            return None;
        }
        let kind = ChannelKind {
            quantity: Quantity::Position,
            sigma: median(&noises)?,
            jitter: 0.0,
        };
        out.sheet.kinds = vec![kind.clone(), kind];
        out.sheet.base = ["axis_1", "axis_2"]
            .map(|name| Parameter::amplitude(name, "m", 0.01))
            .to_vec();
        Some(out)
    }
}

/// What is new in every motion: where the axis lies, as a hand that pulls moves it and a marker sits.
fn scatter() -> Vec<Scatter> {
    let one = Scatter {
        tau: 2e-4,
        counts: 4.0,
        floor: 2e-5,
        nuisance: true,
        step: 1e-6,
    };
    vec![one.clone(), one]
}

fn laws(joint: &str) -> Vec<Law> {
    let of = |form, unit, sd| Law {
        cause: "moving-axis",
        place: joint.to_owned(),
        form,
        parameters: ["cx", "cy"].map(|name| Parameter::amplitude(name, unit, sd)).to_vec(),
        amplitudes: 2,
        grid: vec![Vec::new()],
        extends: &[],
        words: "the centre about which the joint turns moves as it turns",
    };
    // Where it rolls on a cam, or hangs on a linkage, it goes along a curve.
    let bends = ["bx", "by"].map(|name| Parameter::amplitude(name, "m/rad²", 5e-3));
    let even = of(form::EVEN, "m/rad", 5e-3);
    let bent = Law {
        form: form::BENT,
        parameters: even.parameters.iter().cloned().chain(bends).collect(),
        amplitudes: 4,
        extends: &[form::EVEN, form::CURVED],
        ..even.clone()
    };
    vec![even, of(form::CURVED, "m/rad²", 5e-3), bent]
}

impl Family for Axes {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let elsewhere = Vector2::new(base[0], base[1]);
        let one = |p: &Place| {
            let q = p.angle;
            let mut at = elsewhere - Rotation2::new(q) * elsewhere + Vector2::new(scatter[0], scatter[1]);
            for a in active {
                let drift = Vector2::new(a.values[0], a.values[1]);
                at += match a.law.form {
                    form::CURVED => drift * (q * q),
                    form::BENT => drift * q + Vector2::new(a.values[2], a.values[3]) * (q * q),
                    _ => drift * q,
                };
            }
            at
        };
        let all: Vec<Vector2<f64>> = self.places[group].iter().map(one).collect();
        all.iter().map(|a| a.x).chain(all.iter().map(|a| a.y)).collect()
    }

    fn negligible(&self, _law: usize, values: &[f64]) -> bool {
        let even = values[0].hypot(values[1]);
        let bent = values
            .get(2..4)
            .map_or(0.0, |b| (values[0] + b[0]).hypot(values[1] + b[1]));
        even.max(bent) < NEGLIGIBLE
    }

    fn covariates(&self, group: usize) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let of = |value: &dyn Fn(&Place) -> f64| {
            let own = self.places[group].iter().map(value);
            own.clone().chain(own).collect::<Vec<f64>>()
        };
        vec![
            ("joint position", "rad", of(&|p| p.angle)),
            ("time since the motion began", "s", of(&|p| p.time)),
        ]
    }
}
