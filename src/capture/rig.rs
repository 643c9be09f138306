//! A rig that can be asked: where its camera can go, what it sees from there, what it feels when it touches.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::{BodyPrior, Camera, Interaction, Kind, Noise, Support, View};
use crate::base::{Pose, Result};

/// Golden angle, rad: neighbours on a spiral never line up (Vogel 1979).
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// What a rig says of itself before anything is asked of it. SI units, world frame.
#[derive(Clone, Debug)]
pub struct RigDescription {
    /// What the capture is called.
    pub name: String,
    /// Gravity, m/s², world.
    pub gravity: Vector3<f64>,
    /// The table, where the rig knows it.
    pub support: Option<Support>,
    /// The cameras; views are taken with the first.
    pub cameras: Vec<Camera>,
    /// Where that camera can go.
    pub reach: Reach,
    /// Lowest and highest corner of the space that is to be looked at, world.
    pub workspace: [Point3<f64>; 2],
    /// The kinds of touch that it can do.
    pub touches: Vec<Kind>,
    /// What it tracks by name, and where that is at first.
    pub bodies: Vec<BodyPrior>,
    /// Known sensor noise.
    pub noise: Noise,
    /// Everything is put back to where it was at first after each touch.
    pub restores: bool,
}

/// The camera poses that a rig can reach.
#[derive(Clone, Debug)]
pub enum Reach {
    /// These alone, world-from-camera.
    Poses(Vec<Pose>),
    /// A part of a ball's shell, looking at its middle.
    Dome {
        /// The middle, world.
        target: Point3<f64>,
        /// Smallest and largest distance from it, m.
        radius: [f64; 2],
        /// Lowest and highest elevation, rad.
        elevation: [f64; 2],
    },
    /// Anywhere in a box, looking at one spot.
    Box {
        /// Lowest corner, world.
        low: Point3<f64>,
        /// Highest corner, world.
        high: Point3<f64>,
        /// What is looked at, world.
        target: Point3<f64>,
    },
}

impl Reach {
    /// About `count` poses spread evenly over what can be reached; all of them where they are listed.
    pub fn poses(&self, count: usize) -> Vec<Pose> {
        let spread = |i: usize| (i as f64 + 0.5) / count.max(1) as f64;
        match self {
            Self::Poses(poses) => poses.clone(),
            Self::Dome {
                target,
                radius,
                elevation,
            } => (0..count)
                .map(|i| {
                    // Equal steps of the sine of the elevation are equal areas of the shell.
                    let [low, high] = elevation.map(f64::sin);
                    let up = low + (high - low) * spread(i);
                    let out = (1.0 - up * up).max(0.0).sqrt();
                    let (s, c) = (GOLDEN_ANGLE * i as f64).rem_euclid(TAU).sin_cos();
                    let distance = radius[0] + (radius[1] - radius[0]) * halton(i + 1, 2);
                    looking_at(*target + Vector3::new(out * c, out * s, up) * distance, *target)
                })
                .collect(),
            Self::Box { low, high, target } => (0..count)
                .map(|i| {
                    let share = Vector3::new(halton(i + 1, 2), halton(i + 1, 3), halton(i + 1, 5));
                    looking_at(low + (high - low).component_mul(&share), *target)
                })
                .filter(|pose| pose.translation.vector.z > target.z)
                .collect(),
        }
    }
}

/// The `i`-th number of the sequence of van der Corput in `base` (Halton 1960), 0 to 1.
fn halton(mut i: usize, base: usize) -> f64 {
    let (mut sum, mut step) = (0.0, 1.0);
    while i > 0 {
        step /= base as f64;
        sum += step * (i % base) as f64;
        i /= base;
    }
    sum
}

/// World-from-camera of a camera at `eye` with z towards `target`, x level and y as far down as can be.
pub fn looking_at(eye: Point3<f64>, target: Point3<f64>) -> Pose {
    let z = (target - eye).try_normalize(1e-12).unwrap_or_else(|| -Vector3::z());
    let x = z.cross(&Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Pose(Isometry3::from_parts(
        eye.into(),
        UnitQuaternion::from_rotation_matrix(&axes),
    ))
}

/// A touch that is asked for. World frame, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// Unique in the capture.
    pub name: String,
    /// What is to be done.
    pub kind: Kind,
    /// The body, or `body/link`, that is meant.
    pub target: Option<String>,
    /// Where the tool meets or holds the body; for a tilt a point of the axis.
    pub start: Point3<f64>,
    /// Where it goes from there, a unit vector; for a tilt the axis.
    pub direction: Vector3<f64>,
    /// How far it goes, m (for a tilt rad).
    pub travel: f64,
    /// m/s (for a tilt rad/s).
    pub speed: f64,
    /// How long it stays at the end, s.
    pub duration: f64,
    /// To be kept for checking, never for fitting.
    pub held_out: bool,
}

/// What a rig answers to a request.
#[derive(Clone, Debug)]
pub enum Answer<T> {
    /// It did.
    Done(T),
    /// It cannot, and says why; that is no error.
    Refused(String),
}

/// A robot, or a simulated one.
pub trait Rig {
    /// What it is and what it can do. Asked once, first.
    ///
    /// # Errors
    /// An answer that cannot be accepted, or none.
    fn describe(&mut self) -> Result<RigDescription>;

    /// Goes to a camera pose and looks.
    ///
    /// # Errors
    /// An answer that cannot be accepted, or none.
    fn look(&mut self, world_from_camera: &Pose) -> Result<Answer<View>>;

    /// Touches. The scene need not be put back afterwards, but tracks must tell where things are.
    ///
    /// # Errors
    /// An answer that cannot be accepted, or none.
    fn touch(&mut self, touch: &Touch) -> Result<Answer<Interaction>>;

    /// There is nothing more to do.
    ///
    /// # Errors
    /// Where it does not end well.
    fn done(&mut self) -> Result<()>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dome_is_filled_evenly_and_every_pose_looks_at_its_middle() {
        let target = Point3::new(0.1, -0.2, 0.04);
        let reach = Reach::Dome {
            target,
            radius: [0.4, 0.7],
            elevation: [0.3, 1.4],
        };
        let poses = reach.poses(60);
        assert_eq!(poses.len(), 60);
        for pose in &poses {
            let seen = pose.inverse_transform_point(&target);
            assert!(seen.x.hypot(seen.y) < 1e-9 && (0.4..0.7001).contains(&seen.z), "{seen}");
            assert!((pose.rotation * Vector3::y()).z < 1e-9);
        }
        let east = poses.iter().filter(|p| p.translation.vector.x > target.x).count();
        assert!((25..=35).contains(&east), "{east}");
    }
}
