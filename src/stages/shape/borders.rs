//! The planes on which a thing meets those that were cut from one surface with it: how far it reaches where nothing was
//! seen, as the foot of what stands on a tray.

use std::collections::BTreeSet;

use nalgebra::Point3;

use super::discover::Thing;
use super::split::{Split, split};
use super::volume::NEIGHBOUR;
use crate::base::Notices;
use crate::geometry::{Mesh, Plane};

/// Most vertices on the wrong side of a plane that still parts two things.
const PLANE_ERROR: f64 = 0.04;
/// Fewest vertices of another within a voxel, for the two to touch.
const FEWEST: usize = 10;

/// The parts of a thing by the frames in it, with the planes on which a thing of one body meets its neighbours.
pub fn split_among(things: &[Thing], which: usize, voxel: f64, notices: &mut Notices) -> Split {
    let mut parts = split(&things[which], voxel, notices);
    if things[which].named.len() < 2 {
        (parts.touching, parts.planes) = border_planes(things, which, voxel).into_iter().unzip();
    }
    parts
}

/// Planes between `which`, below them, and the things that touch it, above.
fn border_planes(things: &[Thing], which: usize, voxel: f64) -> Vec<(usize, (u32, u32, Plane))> {
    let own = &things[which].surface;
    let cells: BTreeSet<[i32; 3]> = own.vertices.iter().map(|p| cell(p, voxel)).collect();
    let others = things.iter().enumerate().filter(|(j, _)| *j != which);
    let touching = others.filter(|(_, t)| touches(&cells, &t.surface, voxel));
    touching
        .filter_map(|(j, t)| Some((j, Plane::separating(&own.vertices, &t.surface.vertices)?)))
        .filter(|(_, (_, wrong))| *wrong < PLANE_ERROR)
        .map(|(j, (plane, _))| (j, (0, NEIGHBOUR, plane)))
        .collect()
}

fn cell(p: &Point3<f64>, edge: f64) -> [i32; 3] {
    [p.x, p.y, p.z].map(|x| (x / edge).floor() as i32)
}

/// True where enough of a surface lies in the cells.
fn touches(cells: &BTreeSet<[i32; 3]>, other: &Mesh, edge: f64) -> bool {
    let near = other.vertices.iter().filter(|p| cells.contains(&cell(p, edge)));
    near.take(FEWEST).count() == FEWEST
}
