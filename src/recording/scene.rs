//! What stands still: the table, the shapes of the links, the axes of the joints.

use nalgebra::{UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{Arrows3D, Boxes3D, Mesh3D, Transform3D, ViewCoordinates};
use re_sdk_types::datatypes::Quaternion;

use super::clock::view_moment;
use super::stream::Stream;
use crate::base::{Pose, Result};
use crate::geometry::Mesh;
use crate::pipeline::Run;
use crate::twin::{Joint, Link, Model, SupportPlane, Twin};

/// Where what was measured is shown, and what was predicted.
pub(super) const MEASURED: &str = "measured";
pub(super) const PREDICTED: &str = "predicted";

/// Orange stands for predictions, on the report's page too.
pub(super) const ORANGE: [u8; 3] = [230, 120, 20];
/// The size of what is not to be seen: the viewer takes a size of zero for an error.
pub(super) const HIDDEN: f32 = 1e-6;
/// Half the edge of the table as drawn, m.
const TABLE: f64 = 0.5;
/// The length of a joint's axis as drawn, m.
const AXIS: f64 = 0.15;

/// The table, each link twice (as measured, as predicted), each joint.
pub(super) fn log(stream: &mut Stream, run: &Run) -> Result<()> {
    let twin = &run.model.twin;
    stream.still(&["world"], &up(twin))?;
    if let Some(support) = &twin.support {
        stream.still(&["world", "support"], &table(twin, support))?;
    }
    for (_, link) in twin.links() {
        shape(stream, &run.model, link)?;
    }
    for joint in twin.joints() {
        stream.still(&["world", "joints", &joint.name], &axis(joint))?;
    }
    Ok(())
}

/// Up is the axis that gravity leans against most; the viewer knows cardinal directions only.
fn up(twin: &Twin) -> ViewCoordinates {
    let against = Vector3::from(twin.gravity).map(|g| -g);
    match (against.iamax(), against[against.iamax()] < 0.0) {
        (0, false) => ViewCoordinates::RIGHT_HAND_X_UP(),
        (0, true) => ViewCoordinates::RIGHT_HAND_X_DOWN(),
        (1, false) => ViewCoordinates::RIGHT_HAND_Y_UP(),
        (1, true) => ViewCoordinates::RIGHT_HAND_Y_DOWN(),
        (_, false) => ViewCoordinates::RIGHT_HAND_Z_UP(),
        (_, true) => ViewCoordinates::RIGHT_HAND_Z_DOWN(),
    }
}

/// A square of the table's plane, below the middle of the things.
fn table(twin: &Twin, support: &SupportPlane) -> Boxes3D {
    let (normal, point) = (Vector3::from(support.normal), Vector3::from(support.point));
    let count = twin.links().count().max(1) as f64;
    let middle: Vector3<f64> = twin.links().map(|(_, l)| l.pose.0.translation.vector / count).sum();
    let middle = middle - normal * (middle - point).dot(&normal);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal);
    let turn = turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Boxes3D::from_centers_and_half_sizes([place(&middle)], [[TABLE as f32, TABLE as f32, 0.0]])
        .with_quaternions([quaternion(&turn)])
        .with_labels(["support"])
        .with_show_labels(false)
}

fn shape(stream: &mut Stream, model: &Model, link: &Link) -> Result<()> {
    let start = view_moment(0, 0.0);
    if let Some(mesh) = link.mesh.as_ref().and_then(|path| model.meshes.get(path)) {
        stream.still(&["world", MEASURED, &link.name], &surface(mesh))?;
        let [r, g, b] = ORANGE;
        let predicted = surface(mesh).with_albedo_factor([r, g, b, 140]);
        stream.still(&["world", PREDICTED, &link.name], &predicted)?;
    }
    // Nothing is predicted before the first touch: the shape is shrunk away.
    stream.at(
        &["world", PREDICTED, &link.name],
        start,
        &pose(&link.pose).with_scale(HIDDEN),
    )?;
    stream.at(&["world", MEASURED, &link.name], start, &pose(&link.pose))
}

/// The mesh in the link's frame, m, with the colours that were seen.
fn surface(mesh: &Mesh) -> Mesh3D {
    let vertices = mesh.vertices.iter().map(|v| place(&v.coords));
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for (i, corners) in mesh.triangles.iter().enumerate() {
        for corner in corners {
            normals[*corner as usize] += mesh.scaled_normal(i);
        }
    }
    let unit = |n: &Vector3<f64>| place(&n.try_normalize(0.0).unwrap_or_else(Vector3::z));
    let drawn = Mesh3D::new(vertices)
        .with_triangle_indices(mesh.triangles.iter().copied())
        .with_vertex_normals(normals.iter().map(unit));
    if mesh.colors.len() == mesh.vertices.len() {
        drawn.with_vertex_colors(mesh.colors.iter().copied())
    } else {
        drawn
    }
}

fn axis(joint: &Joint) -> Arrows3D {
    let kind = format!("{:?}", joint.kind).to_lowercase();
    let (origin, along) = (Vector3::from(joint.origin.value), Vector3::from(joint.axis.value));
    Arrows3D::from_vectors([place(&(along * AXIS))])
        .with_origins([place(&(origin - along * (0.5 * AXIS)))])
        .with_radii([0.002_f32])
        .with_labels([format!("{}: {kind}, p = {:.2}", joint.name, joint.probability)])
}

/// World-from-child as a transform; what it does not name stays as it was.
pub(super) fn pose(world_from_child: &Pose) -> Transform3D {
    Transform3D::update_fields()
        .with_translation(place(&world_from_child.0.translation.vector))
        .with_quaternion(quaternion(&world_from_child.0.rotation))
}

pub(super) fn place(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

pub(super) fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}
