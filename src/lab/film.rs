//! Depth images of an action while it is performed, bodies and tool where they are at that moment.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::ray::Stage;
use super::surface::surface;
use super::{FilmSpec, Performance, Scene, ShapeSpec, Solid, range_camera, rig};
use crate::base::{Pose, Result, Seed, rng_for};
use crate::capture::{Camera, Frames, Kind, ToolShape};
use crate::geometry::Mesh;

/// The images of a performance that starts at `start` on the clock, by the last of `cameras`. Nothing of a tilt: there
/// the camera's table would have to turn along.
pub(super) fn film(
    scene: &Scene,
    solids: &BTreeMap<String, Solid>,
    (performance, start): (&Performance, f64),
    (spec, cameras): (&FilmSpec, &[Camera]),
    seed: Seed,
) -> Result<Option<Frames>> {
    let (Some(camera), Some(last)) = (cameras.last(), performance.track_time.last()) else {
        return Ok(None);
    };
    if performance.kind == Kind::Tilt {
        return Ok(None);
    }
    let pose = rig::film_pose(spec);
    let count = (last * spec.rate + 1e-9).floor() as usize + 1;
    let rows: Vec<usize> = (0..count).map(|i| row_at(performance, i as f64 / spec.rate)).collect();
    let images: Result<Vec<_>> = rows
        .par_iter()
        .enumerate()
        .map(|(i, row)| {
            let stage = Stage::posed(
                scene,
                solids,
                &poses(solids, performance, *row),
                tool(performance, *row),
            )?;
            let mut rng = rng_for(seed, &format!("interaction {}: frame {i}", performance.name));
            let shot = range_camera::shot(&stage, &spec.lens(), camera, &pose, &mut rng);
            Ok((shot.depth, shot.color.filter(|_| spec.color)))
        })
        .collect();
    let clock = |row: &usize| ((start + performance.track_time[*row]) * 1e6).round() / 1e6;
    Ok(Some(Frames {
        camera: cameras.len() - 1,
        world_from_camera: Some(pose),
        time: rows.iter().map(clock).collect(),
        depth: Vec::new(),
        color: Vec::new(),
        poses: None,
        taken: images?,
    }))
}

/// The last reading up to `time`.
fn row_at(performance: &Performance, time: f64) -> usize {
    performance
        .track_time
        .partition_point(|t| *t <= time + 1e-9)
        .saturating_sub(1)
}

fn poses(solids: &BTreeMap<String, Solid>, performance: &Performance, row: usize) -> BTreeMap<String, Pose> {
    let now = |solid: &Solid| {
        let track = performance.tracks.get(&solid.name);
        track.and_then(|t| t.get(row)).copied().unwrap_or(solid.world_from_body)
    };
    solids.values().map(|s| (s.name.clone(), now(s))).collect()
}

fn tool(performance: &Performance, row: usize) -> Option<Mesh> {
    let pose = performance.tool_pose.get(row)?;
    let shape = match performance.tool.as_ref()?.shape {
        ToolShape::Sphere { radius } => ShapeSpec::Sphere { radius },
        ToolShape::Box { half } => ShapeSpec::Box {
            size: (2.0 * half).into(),
        },
        ToolShape::Cylinder { radius, half_height } => ShapeSpec::Cylinder {
            radius,
            height: 2.0 * half_height,
        },
        ToolShape::Mesh(_) => return None,
    };
    Some(surface(&shape).transformed(&pose.0))
}
