//! Hidden effects in what the scene is made of: the capture still states the plain scene.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use super::law::{Act, Effect};
use crate::lab::{ActionSpec, Scene, Solid};

/// A soft tip of the finger, by how its force grows with its squeeze. Forces in N, lengths in m.
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) enum Pad {
    /// `force (d / depth)^(1 + exponent)`.
    Power { force: f64, depth: f64, exponent: f64 },
    /// `force (exp(d / depth) - 1)`.
    Exponential { force: f64, depth: f64 },
}

/// Seconds of creep of a tip: damping over stiffness.
const CREEPS: f64 = 1e-3;

impl Pad {
    /// Squeezed by `depth`, at the rate at which that shrinks; it can only push.
    pub fn pushes(&self, depth: f64, leaving: f64) -> f64 {
        let (force, slope) = match *self {
            Pad::Power {
                force,
                depth: d,
                exponent,
            } => {
                let steep = force / d * (depth / d).powf(exponent);
                (steep * depth, (1.0 + exponent) * steep)
            }
            Pad::Exponential { force, depth: d } => {
                let grown = force * (depth / d).exp();
                (grown - force, grown / d)
            }
        };
        (force - CREEPS * slope * leaving).max(0.0)
    }
}

/// A change of the scene.
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) enum Setting {
    /// Slopes of the table, rad.
    Tilt([f64; 2]),
    /// Gravity leans by these angles about x and y (rad), and is longer by this share.
    Gravity([f64; 2], f64),
    /// The centre of mass of the target, beside its place, body frame, m.
    Centre([f64; 2]),
    /// Factor on the inertia of the target about its vertical axis.
    YawInertia(f64),
    /// Both.
    Uneven([f64; 2], f64),
    /// Factor on the friction between tools and what they push.
    ToolFriction(f64),
    /// What the finger is tipped with.
    Tip(Pad),
}

fn settings(effects: &[Effect]) -> impl Iterator<Item = &Setting> {
    effects.iter().filter_map(|effect| match &effect.act {
        Act::Setting(setting) => Some(setting),
        _ => None,
    })
}

/// The scene as it really is.
pub(in crate::lab) fn altered(scene: &Scene, effects: &[Effect]) -> Scene {
    let mut real = scene.clone();
    for setting in settings(effects) {
        match *setting {
            Setting::Tilt([x, y]) => {
                real.support.tilt[0] += x;
                real.support.tilt[1] += y;
            }
            Setting::Gravity([x, y], longer) if x != 0.0 || y != 0.0 || longer != 0.0 => {
                let lean = Rotation3::from_scaled_axis(Vector3::new(x, y, 0.0));
                real.gravity = (lean * Vector3::from(scene.gravity) * (1.0 + longer)).into();
            }
            Setting::ToolFriction(factor) => {
                for action in &mut real.action {
                    if let ActionSpec::Push { tool_friction, .. } = action {
                        *tool_friction *= factor;
                    }
                }
            }
            _ => {}
        }
    }
    real
}

/// The solids as they really are; `target` is the body that effects are about.
pub(in crate::lab) fn alter_solids(effects: &[Effect], target: &str, solids: &mut BTreeMap<String, Solid>) {
    let Some(solid) = solids.get_mut(target) else { return };
    for setting in settings(effects) {
        match *setting {
            Setting::Centre([x, y]) => solid.com += Vector3::new(x, y, 0.0),
            Setting::Uneven([x, y], factor) => {
                solid.com += Vector3::new(x, y, 0.0);
                solid.inertia[(2, 2)] *= factor;
            }
            Setting::YawInertia(factor) => solid.inertia[(2, 2)] *= factor,
            _ => {}
        }
    }
}
