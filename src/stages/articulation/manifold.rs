//! The set of relative poses that a joint allows, and the allowed pose nearest to a measured one.

use nalgebra::{DMatrix, DVector, Isometry3, SMatrix, Unit, UnitQuaternion, Vector3};

use crate::capture::TrackNoise;
use crate::twin::JointKind;

/// A measured relative pose: child in parent, averaged over a few rows.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Which interaction it is from.
    pub run: usize,
    /// Seconds.
    pub time: f64,
    /// m, parent frame.
    pub position: Vector3<f64>,
    /// Absent where only positions are known.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// Standard deviations of this sample.
    pub noise: TrackNoise,
}

/// A joint's manifold in SE(3): `pose(z) = motion(z) * home`, everything in the parent frame.
#[derive(Clone, Debug)]
pub struct Manifold {
    /// The kind of joint.
    pub kind: JointKind,
    /// Child in parent where all joint positions are 0.
    pub home: Isometry3<f64>,
    /// Axis, or normal of the plane.
    pub axis: Unit<Vector3<f64>>,
    /// A point of the axis, or the centre of a ball joint.
    pub point: Vector3<f64>,
    /// m/rad, of a screw.
    pub pitch: f64,
}

/// Two unit vectors that complete `axis` to a right-handed frame.
pub fn across(axis: &Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let smallest = axis.iamin();
    let e1 = axis.cross(&Vector3::ith(smallest, 1.0)).normalize();
    (e1, axis.cross(&e1))
}

/// The angle of the part of `turn` that goes about `axis` (swing-twist decomposition).
pub fn twist_angle(turn: &UnitQuaternion<f64>, axis: &Unit<Vector3<f64>>) -> f64 {
    let angle = 2.0 * turn.imag().dot(axis).atan2(turn.w);
    if angle > std::f64::consts::PI {
        angle - std::f64::consts::TAU
    } else if angle < -std::f64::consts::PI {
        angle + std::f64::consts::TAU
    } else {
        angle
    }
}

impl Manifold {
    /// Number of joint positions.
    pub fn latents(&self) -> usize {
        match self.kind {
            JointKind::Fixed => 0,
            JointKind::Revolute | JointKind::Prismatic | JointKind::Screw => 1,
            JointKind::Cylindrical => 2,
            JointKind::Planar | JointKind::Spherical => 3,
        }
    }

    /// Number of parameters that the data can tell apart.
    pub fn parameters(&self, oriented: bool) -> usize {
        match (self.kind, oriented) {
            (JointKind::Fixed, true) | (JointKind::Spherical, true) => 6,
            (JointKind::Prismatic, true) => 7,
            (JointKind::Cylindrical, true) => 8,
            (JointKind::Revolute, true) => 9,
            (JointKind::Screw, true) => 10,
            (JointKind::Planar, true) => 5,
            (JointKind::Fixed | JointKind::Planar, false) => 3,
            (JointKind::Prismatic | JointKind::Spherical, false) => 4,
            (JointKind::Cylindrical, false) => 5,
            (JointKind::Revolute, false) => 6,
            (JointKind::Screw, false) => 7,
        }
    }

    /// The pose at joint positions `z`: rotations in rad, translations in m.
    pub fn pose(&self, z: &[f64; 3]) -> Isometry3<f64> {
        let about = |turn: UnitQuaternion<f64>| {
            let moved = self.point + turn * (self.home.translation.vector - self.point);
            Isometry3::from_parts(moved.into(), turn * self.home.rotation)
        };
        let (e1, e2) = across(&self.axis);
        match self.kind {
            JointKind::Fixed => self.home,
            JointKind::Prismatic => self.shifted(self.home, self.axis.into_inner() * z[0]),
            JointKind::Revolute => about(UnitQuaternion::from_axis_angle(&self.axis, z[0])),
            JointKind::Screw => self.shifted(
                about(UnitQuaternion::from_axis_angle(&self.axis, z[0])),
                self.axis.into_inner() * (self.pitch * z[0]),
            ),
            JointKind::Cylindrical => self.shifted(
                about(UnitQuaternion::from_axis_angle(&self.axis, z[0])),
                self.axis.into_inner() * z[1],
            ),
            JointKind::Planar => {
                let turn = UnitQuaternion::from_axis_angle(&self.axis, z[0]);
                let turned = Isometry3::from_parts(self.home.translation, turn * self.home.rotation);
                self.shifted(turned, e1 * z[1] + e2 * z[2])
            }
            JointKind::Spherical => about(UnitQuaternion::from_scaled_axis(Vector3::from(*z))),
        }
    }

    fn shifted(&self, pose: Isometry3<f64>, by: Vector3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts((pose.translation.vector + by).into(), pose.rotation)
    }

    /// Joint positions near a measured pose, in closed form; without orientation from the position alone.
    fn guess(&self, sample: &Sample) -> [f64; 3] {
        let home = self.home.translation.vector;
        let turn = sample.rotation.map(|r| r * self.home.rotation.inverse());
        let along = self.axis.dot(&(sample.position - home));
        let angle = || match &turn {
            Some(turn) => twist_angle(turn, &self.axis),
            None => self.polar(&sample.position) - self.polar(&home),
        };
        let (e1, e2) = across(&self.axis);
        match self.kind {
            JointKind::Fixed => [0.0; 3],
            JointKind::Prismatic => [along, 0.0, 0.0],
            JointKind::Revolute | JointKind::Screw => [wrapped(angle()), 0.0, 0.0],
            JointKind::Cylindrical => [wrapped(angle()), along, 0.0],
            JointKind::Planar => {
                let shift = sample.position - home;
                [turn.map_or(0.0, |_| angle()), e1.dot(&shift), e2.dot(&shift)]
            }
            JointKind::Spherical => match &turn {
                Some(turn) => turn.scaled_axis().into(),
                None => UnitQuaternion::rotation_between(&(home - self.point), &(sample.position - self.point))
                    .map_or([0.0; 3], |q| q.scaled_axis().into()),
            },
        }
    }

    fn polar(&self, position: &Vector3<f64>) -> f64 {
        let (e1, e2) = across(&self.axis);
        let arm = position - self.point;
        e2.dot(&arm).atan2(e1.dot(&arm))
    }

    /// The residual of a sample against the pose at `z`, in standard deviations: position, then rotation.
    pub fn residual(&self, sample: &Sample, z: &[f64; 3]) -> SMatrix<f64, 6, 1> {
        let pose = self.pose(z);
        let mut out = SMatrix::<f64, 6, 1>::zeros();
        let shift = (sample.position - pose.translation.vector) / sample.noise.position;
        out.fixed_rows_mut::<3>(0).copy_from(&shift);
        if let Some(rotation) = sample.rotation {
            let turn = (rotation * pose.rotation.inverse()).scaled_axis() / sample.noise.rotation;
            out.fixed_rows_mut::<3>(3).copy_from(&turn);
        }
        out
    }

    /// Minus the derivative of the residual by the joint positions, one column each.
    fn columns(&self, sample: &Sample, z: &[f64; 3]) -> SMatrix<f64, 6, 3> {
        let mut out = SMatrix::<f64, 6, 3>::zeros();
        let reference = self.residual(sample, z);
        for k in 0..self.latents() {
            let mut moved = *z;
            moved[k] += 1e-6;
            out.set_column(k, &((reference - self.residual(sample, &moved)) / 1e-6));
        }
        out
    }

    /// The allowed pose nearest to a sample: joint positions, residual, and half the log determinant of the
    /// joint positions' information (their precision in this sample).
    pub fn project(&self, sample: &Sample) -> Projection {
        self.project_from(sample, self.guess(sample))
    }

    /// As [`Manifold::project`], with the angle of a screw within half a turn of `angle`: a screw's whole turns count.
    pub fn project_near(&self, sample: &Sample, angle: f64) -> Projection {
        let mut z = self.guess(sample);
        if self.kind == JointKind::Screw {
            z[0] = nearest_turn(z[0], angle);
        }
        self.project_from(sample, z)
    }

    /// The allowed poses nearest to samples in the order of time.
    pub fn project_all(&self, samples: &[Sample]) -> Vec<Projection> {
        if self.kind != JointKind::Screw {
            return samples.iter().map(|s| self.project(s)).collect();
        }
        let angles = self.screw_angles(samples);
        let pairs = samples.iter().zip(&angles);
        pairs.map(|(s, angle)| self.project_near(s, *angle)).collect()
    }

    /// Angle and shift along the axis of each sample. The angle goes on over whole turns within an interaction.
    pub fn turns_and_shifts(&self, samples: &[Sample]) -> Vec<[f64; 2]> {
        let cylinder = Self {
            kind: JointKind::Cylindrical,
            ..self.clone()
        };
        let mut out: Vec<[f64; 2]> = Vec::with_capacity(samples.len());
        for (i, sample) in samples.iter().enumerate() {
            let [angle, shift, _] = cylinder.guess(sample);
            let before = out.last().filter(|_| samples[i - 1].run == sample.run);
            out.push([before.map_or(angle, |b| nearest_turn(angle, b[0])), shift]);
        }
        out
    }

    /// The angles of a screw; between interactions it has made as many whole turns as its shift tells.
    fn screw_angles(&self, samples: &[Sample]) -> Vec<f64> {
        let mut turns = self.turns_and_shifts(samples);
        let lead = std::f64::consts::TAU * self.pitch;
        let mut from = 0;
        for rows in samples.chunk_by(|a, b| a.run == b.run) {
            let here = &mut turns[from..from + rows.len()];
            let mean = |of: &dyn Fn(usize) -> f64| (0..rows.len()).map(of).sum::<f64>() / rows.len() as f64;
            let ahead = mean(&|i| here[i][1] - self.pitch * here[i][0]);
            if lead.abs() > TOLD_BY_SHIFT * mean(&|i| rows[i].noise.position) {
                let whole = (ahead / lead).round() * std::f64::consts::TAU;
                here.iter_mut().for_each(|z| z[0] += whole);
            }
            from += rows.len();
        }
        turns.iter().map(|z| z[0]).collect()
    }

    fn project_from(&self, sample: &Sample, mut z: [f64; 3]) -> Projection {
        let n = self.latents();
        let mut log_precision = 0.0;
        for _ in 0..2 {
            if n == 0 {
                break;
            }
            let columns = self.columns(sample, &z);
            let j = columns.columns(0, n);
            let information = DMatrix::from_iterator(n, n, (j.transpose() * j).iter().copied());
            let gradient = DVector::from_iterator(n, (j.transpose() * self.residual(sample, &z)).iter().copied());
            let damped = &information + DMatrix::identity(n, n) * (1e-9 * information.trace() + 1e-12);
            log_precision = 0.5 * damped.determinant().max(1e-300).ln();
            let Some(step) = damped.lu().solve(&gradient) else {
                break;
            };
            (0..n).for_each(|k| z[k] += step[k]);
        }
        Projection {
            z,
            residual: self.residual(sample, &z),
            log_precision,
        }
    }

    /// The manifold moved by a small step of its parameters: home 6, axis 2, point 2 (a ball: 3), pitch 1.
    pub fn stepped(&self, step: &[f64]) -> Self {
        let mut out = self.clone();
        let turn = Vector3::new(step[0], step[1], step[2]);
        let shift = Vector3::new(step[3], step[4], step[5]);
        out.home = Isometry3::from_parts(
            (self.home.translation.vector + shift).into(),
            UnitQuaternion::from_scaled_axis(turn) * self.home.rotation,
        );
        let (e1, e2) = across(&self.axis);
        if self.kind == JointKind::Spherical {
            out.point += Vector3::new(step[6], step[7], step[8]);
        } else if step.len() >= 8 {
            out.axis = Unit::new_normalize(self.axis.into_inner() + e1 * step[6] + e2 * step[7]);
        }
        if step.len() >= 10 {
            out.point += e1 * step[8] + e2 * step[9];
        }
        if step.len() >= 11 {
            out.pitch += step[10];
        }
        out
    }

    /// Length of the step of [`Manifold::stepped`].
    pub fn chart(&self) -> usize {
        match self.kind {
            JointKind::Fixed => 6,
            JointKind::Prismatic | JointKind::Planar => 8,
            JointKind::Spherical => 9,
            JointKind::Revolute | JointKind::Cylindrical => 10,
            JointKind::Screw => 11,
        }
    }
}

/// The allowed pose nearest to a sample.
#[derive(Clone, Debug)]
pub struct Projection {
    /// Joint positions.
    pub z: [f64; 3],
    /// In standard deviations: position, then rotation.
    pub residual: SMatrix<f64, 6, 1>,
    /// Half the log determinant of the information on the joint positions.
    pub log_precision: f64,
}

/// A turn of a screw is told by its shift where its lead is so many times the noise of a position.
const TOLD_BY_SHIFT: f64 = 6.0;

/// The angle that differs from `angle` by whole turns and lies nearest to `near`.
fn nearest_turn(angle: f64, near: f64) -> f64 {
    angle + std::f64::consts::TAU * ((near - angle) / std::f64::consts::TAU).round()
}

fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}
