//! The world against textbook answers.

mod free;
mod holding;
mod pushing;

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use super::World;
use crate::base::{Pose, Progress};
use crate::lab::perform::{Performance, perform_in_steps};
use crate::lab::{ConvexPart, PartShape, Solid};
use crate::lab::{Scene, ShapeSpec};

const G: f64 = 9.80665;
const STEP: f64 = 5e-5;

/// Boxes, cylinders and balls of the scene, uniformly filled.
fn solids_of(scene: &Scene) -> BTreeMap<String, Solid> {
    let solid = |b: &crate::lab::BodySpec| {
        let (shape, volume, square) = match b.shape {
            ShapeSpec::Box { size: [x, y, z] } => (
                PartShape::Box {
                    half: Vector3::new(x, y, z) / 2.0,
                },
                x * y * z,
                Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y) / 12.0,
            ),
            ShapeSpec::Cylinder { radius: r, height: h } => (
                PartShape::Cylinder {
                    radius: r,
                    half_height: h / 2.0,
                },
                std::f64::consts::PI * r * r * h,
                Vector3::new(r * r / 4.0 + h * h / 12.0, r * r / 4.0 + h * h / 12.0, r * r / 2.0),
            ),
            ShapeSpec::Sphere { radius: r } => (
                PartShape::Sphere { radius: r },
                4.0 / 3.0 * std::f64::consts::PI * r.powi(3),
                Vector3::repeat(0.4 * r * r),
            ),
            _ => unreachable!("a plain shape"),
        };
        let mass = b.density * volume;
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), b.yaw);
        Solid {
            name: b.name.clone(),
            mesh: Default::default(),
            mass,
            com: Point3::origin(),
            inertia: Matrix3::from_diagonal(&(square * mass)),
            world_from_body: Pose(Isometry3::from_parts(Vector3::from(b.position).into(), rotation)),
            parts: vec![ConvexPart {
                shape,
                body_from_part: Pose::identity(),
            }],
        }
    };
    scene.body.iter().map(|b| (b.name.clone(), solid(b))).collect()
}

fn scene(text: &str) -> Scene {
    toml::from_str(&format!("name = 'test'\n{text}")).unwrap()
}

fn play_with(scene: &Scene, solids: &BTreeMap<String, Solid>, dt: f64) -> Performance {
    perform_in_steps(scene, solids, &Progress::silent(), dt)
        .unwrap()
        .remove(0)
}

fn play(text: &str) -> Performance {
    let scene = scene(text);
    play_with(&scene, &solids_of(&scene), STEP)
}

/// Mean of a component between two times.
fn mean(time: &[f64], values: &[Vector3<f64>], from: f64, to: f64) -> Vector3<f64> {
    let chosen: Vec<_> = time
        .iter()
        .zip(values)
        .filter(|(t, _)| **t >= from && **t <= to)
        .map(|(_, v)| *v)
        .collect();
    chosen.iter().sum::<Vector3<f64>>() / chosen.len() as f64
}

/// Mean force while the block's travel along x is between two values.
fn while_moving(seen: &Performance, from: f64, to: f64) -> Vector3<f64> {
    let track = &seen.tracks["block"];
    let travel = |i: usize| track[i].translation.vector.x - track[0].translation.vector.x;
    let within: Vec<usize> = (0..track.len())
        .filter(|i| travel(*i) > from && travel(*i) < to)
        .collect();
    mean(
        &seen.force_time,
        &seen.force,
        seen.force_time[within[0]],
        seen.force_time[within[within.len() - 1]],
    )
}

fn near(name: &str, found: f64, expected: f64, fraction: f64) {
    let off = (found - expected) / expected;
    assert!(off.abs() <= fraction, "{name}: {found} for {expected}");
}

const BLOCK: &str = "
[[body]]
name = 'block'
shape = { kind = 'box', size = [0.08, 0.06, 0.05] }
density = 1250.0
position = [0.0, 0.0, 0.025]
friction = { static = 0.36, kinetic = 0.30 }
";
const BLOCK_MASS: f64 = 0.3;

fn push_of(at: &str, speed: f64, travel: f64, rest: &str) -> String {
    format!(
        "[[action]]\nkind = 'push'\nname = 'p'\ntarget = 'block'\nat = {at}\ndirection = [1.0, 0.0, 0.0]\n\
         speed = {speed}\ntravel = {travel}\n{rest}\n"
    )
}

const STACK: &str = "
[[body]]
name = 'top'
shape = { kind = 'box', size = [0.04, 0.04, 0.03] }
position = [0.005, 0.0, 0.065]
";

fn run(world: &mut World, steps: usize) {
    for _ in 0..steps {
        world.step(None, STEP);
    }
}
