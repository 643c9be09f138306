//! Where a joint was, moment by moment, by the tracks of its links alone.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::capture::Interaction;
use crate::twin::{Joint, JointKind, Model};

/// A joint at one moment.
#[derive(Clone, Copy, Debug)]
pub struct JointMoment {
    /// s, of the capture's clock.
    pub time: f64,
    /// rad or m since the first view.
    pub position: f64,
    /// How far the point of the child that lay on the axis at first is from there, axes of the parent at first, m.
    pub strays: Vector3<f64>,
}

/// The path of a joint whose child was tracked; the parent stands where nobody tracked it.
pub fn joint_path(interaction: &Interaction, model: &Model, joint: &Joint) -> Option<Vec<JointMoment>> {
    let home = |name: &str| model.twin.link(name).map(|l| l.pose.0);
    let (child, parent) = (home(&joint.child)?, home(&joint.parent)?);
    let track = interaction.tracks.get(&joint.child)?;
    let carrier = interaction.tracks.get(&joint.parent);
    let (axis, origin) = (Vector3::from(joint.axis.value), Point3::from(joint.origin.value));
    let carried = |t: f64| -> Option<Isometry3<f64>> {
        let Some(c) = carrier else { return Some(parent) };
        let row = c.time.partition_point(|x| *x < t).min(c.len().saturating_sub(1));
        c.pose(row).map(|p| p.0)
    };
    let one = |i: usize| {
        let (pose, time) = (track.pose(i)?.0, track.time[i]);
        let moved = parent * carried(time)?.inverse() * pose * child.inverse();
        let strays = moved * origin - origin;
        let position = match joint.kind {
            JointKind::Prismatic => (moved * (child * Point3::origin()) - child * Point3::origin()).dot(&axis),
            _ => moved.rotation.scaled_axis().dot(&axis),
        };
        Some(JointMoment { time, position, strays })
    };
    let mut all: Vec<JointMoment> = (0..track.len()).filter_map(one).collect();
    if joint.kind != JointKind::Prismatic {
        for i in 1..all.len() {
            let turns = ((all[i - 1].position - all[i].position) / std::f64::consts::TAU).round();
            all[i].position += turns * std::f64::consts::TAU;
        }
    }
    (!all.is_empty()).then_some(all)
}

/// From the lowest to the highest position, rad or m.
pub fn travelled(moments: &[JointMoment]) -> f64 {
    let places = || moments.iter().map(|m| m.position);
    places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min)
}
