//! Where a round finger meets the face that it pushes: a force without torque acts there, not at the finger's centre.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::evidence::tool_at;
use super::facts::Ground;
use super::slip::PlaneFrame;
use crate::capture::{Interaction, PhaseKind, Segmented, ToolShape};
use crate::geometry::Mesh;
use crate::physics::Footprint;

use super::action::{first_rest, rest_pose};

/// How far the finger may seem from the face, m: farther, and something else is touched.
const NEAR: f64 = 0.008;

/// The outline of a link at the height of a finger, and the finger.
#[derive(Clone, Debug)]
pub(super) struct Face {
    frame: PlaneFrame,
    outline: Footprint,
    radius: f64,
}

impl Face {
    /// Of a link with this mesh; nothing where the finger is not round, or the mesh does not reach up to it.
    pub fn of(
        interaction: &Interaction,
        segmented: &Segmented,
        link: &str,
        mesh: &Mesh,
        ground: &Ground,
    ) -> Option<Self> {
        let tool = interaction.tool.as_ref().filter(|t| !t.grip && !t.pin)?;
        let radius = match &tool.shape {
            ToolShape::Sphere { radius } | ToolShape::Cylinder { radius, .. } => *radius,
            ToolShape::Box { .. } | ToolShape::Mesh(_) => return None,
        };
        let track = interaction.tracks.get(link)?;
        let start = rest_pose(track, first_rest(interaction, Some(segmented)))?;
        let turn = UnitQuaternion::rotation_between(&ground.plane.normal, &Vector3::z())?;
        let slide = segmented.of(PhaseKind::Slide).next()?;
        let finger = tool_at(interaction.tool_path.as_ref()?, 0.5 * (slide.start + slide.end))?;
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| turn * (start.0 * v)).collect();
        Some(Self {
            outline: Footprint::section(&points, &mesh.triangles, (turn * finger).z)?,
            frame: PlaneFrame { turn, start },
            radius,
        })
    }

    /// From the finger's centre to where it touches the link at `pose`, m, world; none where it is not at the face.
    pub fn touch(&self, pose: &Isometry3<f64>, finger: &Point3<f64>) -> Option<Vector3<f64>> {
        let at = self.frame.flat(&finger.coords);
        let near = self.outline.nearest(&self.frame.moved(pose), &at.into());
        let outward = self.frame.turn.inverse() * Vector3::new(near.outward.x, near.outward.y, 0.0);
        ((near.distance - self.radius).abs() < NEAR).then(|| -self.radius * outward)
    }
}

#[cfg(test)]
mod tests {
    use super::super::solid::box_mesh;
    use super::*;
    use crate::base::Pose;

    #[test]
    fn the_finger_touches_the_face_and_not_its_own_centre() {
        let mesh = box_mesh(Vector3::new(0.05, 0.03, 0.02), Vector3::new(0.0, 0.0, 0.02));
        let face = Face {
            outline: Footprint::section(&mesh.vertices, &mesh.triangles, 0.01).expect("a cut"),
            frame: PlaneFrame {
                turn: UnitQuaternion::identity(),
                start: Pose::identity(),
            },
            radius: 0.008,
        };
        let turned = Isometry3::rotation(Vector3::new(0.0, 0.0, 0.1));
        let finger = turned * Point3::new(-0.058, 0.012, 0.01);
        let touch = face.touch(&turned, &finger).expect("at the face");
        assert!(
            (touch - turned * Vector3::new(0.008, 0.0, 0.0)).norm() < 1e-9,
            "{touch}"
        );
        assert!(face.touch(&turned, &(turned * Point3::new(-0.08, 0.0, 0.01))).is_none());
    }
}
