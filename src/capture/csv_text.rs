//! Streams as CSV text, the way `streams` reads them.

use std::fmt::Write;

use super::{PoseStream, VectorStream, WrenchStream};

/// A reading with nine significant digits, nothing where it is missing.
fn reading(text: &mut String, x: f64) {
    text.push(',');
    if !x.is_finite() {
        return;
    }
    let rounded: f64 = format!("{x:.8e}").parse().unwrap_or(x);
    // Adding zero turns -0 into 0.
    let _ = write!(text, "{}", rounded + 0.0);
}

/// Forces, and torques where there are any.
pub(super) fn wrench_csv(stream: &WrenchStream) -> String {
    let mut text = String::from("time,fx,fy,fz");
    if stream.torque.is_some() {
        text.push_str(",tx,ty,tz");
    }
    text.push('\n');
    for (i, time) in stream.time.iter().enumerate() {
        let _ = write!(text, "{time}");
        let torque = stream.torque.as_ref().map(|t| t[i]);
        for vector in std::iter::once(stream.force[i]).chain(torque) {
            vector.iter().for_each(|x| reading(&mut text, *x));
        }
        text.push('\n');
    }
    text
}

fn pose_fields(text: &mut String, stream: &PoseStream, i: usize) {
    stream.position[i].iter().for_each(|x| reading(text, *x));
    match stream.rotation[i] {
        Some(q) => [q.i, q.j, q.k, q.w].iter().for_each(|x| reading(text, *x)),
        None => text.push_str(",,,,"),
    }
}

/// Poses; a missing row or orientation is written as empty fields.
pub(super) fn poses_csv(stream: &PoseStream) -> String {
    let mut text = String::from("time,x,y,z,qx,qy,qz,qw\n");
    for (i, time) in stream.time.iter().enumerate() {
        let _ = write!(text, "{time}");
        pose_fields(&mut text, stream, i);
        text.push('\n');
    }
    text
}

/// Normals of the support.
pub(super) fn normals_csv(stream: &VectorStream) -> String {
    let mut text = String::from("time,nx,ny,nz\n");
    for (time, vector) in stream.time.iter().zip(&stream.vector) {
        let _ = write!(text, "{time}");
        vector.iter().for_each(|x| reading(&mut text, *x));
        text.push('\n');
    }
    text
}

/// The index of the images of an interaction.
pub(super) fn frames_csv(
    time: &[f64],
    depth: &[String],
    color: &[Option<String>],
    poses: Option<&PoseStream>,
) -> String {
    let colored = color.iter().any(Option::is_some);
    let mut text = String::from(if colored { "time,depth,color" } else { "time,depth" });
    text.push_str(if poses.is_some() { ",x,y,z,qx,qy,qz,qw\n" } else { "\n" });
    for (i, path) in depth.iter().enumerate() {
        let _ = write!(text, "{},{path}", time[i]);
        if colored {
            let _ = write!(text, ",{}", color[i].as_deref().unwrap_or_default());
        }
        if let Some(poses) = poses {
            pose_fields(&mut text, poses, i);
        }
        text.push('\n');
    }
    text
}
