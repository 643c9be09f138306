//! The side that nobody saw, by symmetry: what was not observed takes the place of what was, on the other side.

use nalgebra::{Matrix3, Point3, Rotation3, Unit, Vector3};
use std::f64::consts::TAU;

use super::discover::Thing;
use super::solid::Part;
use super::split::Split;
use super::support::Ground;
use super::vessel::continue_walls;
use super::volume::{FOREIGN, NEIGHBOUR, Volume};
use crate::base::{Notices, Pose, Result};
use crate::geometry::Mesh;
use crate::twin::{SupportPlane, Symmetry};

/// Finds what leaves a mesh as it is: the mesh, world-from-mesh, the support.
pub type FindSymmetry<'a> = dyn Fn(&Mesh, &Pose, Option<&SupportPlane>) -> Result<Symmetry> + 'a;

/// Share of the area of a thing, besides its foot, above which its symmetry is asked.
const MOST_HIDDEN: f64 = 0.04;
/// Symmetries of a lower score are not sure enough to build on.
const SURE: f64 = 0.985;
/// Turns that are tried about an axis of the lathe.
const TURNS: u32 = 24;
/// Share of the corners around an image, by weight, that must be known.
const LEAST_KNOWN: f64 = 0.6;
/// An image under the height that the support blurs counts only where it is this clear of the surface, voxels.
const CLEAR: f32 = 0.5;
/// A place is surely empty only where all is known so far around it, voxels: at the edge of what a grazing look clears away
/// its pixels, and the units of samples that share one, reach into what stands there.
const DOUBTFUL: usize = 2;

/// The thing that is completed, among the others.
pub struct Context<'a> {
    pub things: &'a [Thing],
    pub room: &'a Mesh,
    pub which: usize,
    pub parts: &'a Split,
    pub ground: &'a Ground,
}

/// Completes a thing of one body: by its symmetry, where much of it was hidden, then by the walls of a vessel.
pub fn complete(
    volume: &mut Volume,
    context: &Context,
    truncation: f64,
    find: &FindSymmetry,
    notices: &mut Notices,
) -> Result<()> {
    // Where a neighbour was cut off from it, what is hidden is hidden by that: nothing seen may be turned into there.
    if context.parts.planes.is_empty() {
        by_symmetry(volume, context, truncation, find, notices)?;
    }
    if context.ground.plane.is_some() {
        continue_walls(volume, context, notices);
    }
    Ok(())
}

fn by_symmetry(
    volume: &mut Volume,
    context: &Context,
    truncation: f64,
    find: &FindSymmetry,
    notices: &mut Notices,
) -> Result<()> {
    let mesh = |volume: &Volume| {
        let planes = &context.parts.planes;
        Part {
            volume,
            body: 0,
            planes,
        }
        .mesh(context.ground.plane.is_some())
    };
    let Some(before) = mesh(volume).filter(|m| hidden(m) > MOST_HIDDEN) else {
        return Ok(());
    };
    let symmetry = find(
        &before,
        &Pose(context.ground.world_from_field),
        context.ground.plane.as_ref(),
    )?;
    let truncation = truncation * volume.field.voxel;
    let count = volume.complete(&symmetry, truncation);
    if count == 0 {
        return Ok(());
    }
    claim(volume, context.things, context.room, context.which, context.parts);
    if mesh(volume).is_none() {
        // What comes out is no body: as it was.
        volume.decide_with(&[], truncation as f32);
        claim(volume, context.things, context.room, context.which, context.parts);
        return Ok(());
    }
    let about = context.things[context.which]
        .named
        .first()
        .map_or("views", |(n, _)| n.as_str());
    let words = format!(
        "{:.0} % of its surface was hidden: completed by its symmetry",
        100.0 * hidden(&before)
    );
    notices.note("shape", about, words);
    Ok(())
}

/// Share of the area that was not seen, but for the foot.
fn hidden(mesh: &Mesh) -> f64 {
    let unseen = |t: &usize| {
        mesh.triangles[*t]
            .iter()
            .any(|v| !mesh.seen.get(*v as usize).copied().unwrap_or(true))
    };
    let foot = |t: &usize| mesh.corners(*t).iter().all(|p| p.z.abs() < 1e-6);
    let area = |t: usize| 0.5 * mesh.scaled_normal(t).norm();
    let hidden: f64 = (0..mesh.triangles.len())
        .filter(unseen)
        .filter(|t| !foot(t))
        .map(area)
        .sum();
    hidden / mesh.area().max(1e-12)
}

/// Gives the inside of the volume to the bodies of one thing, to its neighbours and to the room.
pub fn claim(volume: &mut Volume, things: &[Thing], room: &Mesh, which: usize, parts: &Split) {
    let of = |j: usize| {
        if parts.touching.contains(&j) {
            NEIGHBOUR
        } else {
            FOREIGN
        }
    };
    let label = |(j, t): (usize, &Thing)| vec![of(j); t.surface.vertices.len()];
    let foreign: Vec<Vec<u32>> = things.iter().enumerate().map(label).collect();
    let walls = vec![FOREIGN; room.vertices.len()];
    let mut surfaces: Vec<(&Mesh, &[u32])> = things
        .iter()
        .enumerate()
        .map(|(j, t)| (&t.surface, if j == which { &parts.labels[..] } else { &foreign[j][..] }))
        .collect();
    surfaces.push((room, &walls[..]));
    volume.claim(&surfaces);
}

/// `x -> linear x + shift`.
#[derive(Clone, Copy, Debug)]
struct Image {
    linear: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Image {
    fn about(linear: Matrix3<f64>, point: Vector3<f64>) -> Self {
        Self {
            linear,
            shift: point - linear * point,
        }
    }

    fn of(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.linear * p.coords + self.shift)
    }
}

/// What a sure symmetry makes of a point, besides itself.
fn images(symmetry: &Symmetry) -> Vec<Image> {
    let turns = |direction: [f64; 3], point: [f64; 3], fold: u32| {
        let axis = Unit::new_normalize(Vector3::from(direction));
        (1..fold).map(move |k| {
            let turn = Rotation3::from_axis_angle(&axis, TAU * f64::from(k) / f64::from(fold));
            Image::about(turn.into_inner(), point.into())
        })
    };
    let reflection = |normal: [f64; 3], offset: f64| {
        let n = Vector3::from(normal);
        Image {
            linear: Matrix3::identity() - 2.0 * n * n.transpose(),
            shift: 2.0 * offset * n,
        }
    };
    let planes = symmetry.planes.iter().filter(|p| p.score >= SURE);
    let axes = symmetry.axes.iter().filter(|a| a.score >= SURE);
    planes
        .map(|p| reflection(p.normal, p.offset))
        .chain(axes.flat_map(|a| turns(a.direction, a.point, if a.fold == 0 { TURNS } else { a.fold })))
        .collect()
}

/// What is known of a sample of space: nothing, that it is empty, or the distance to the surface, m.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    Nothing,
    Empty,
    Distance(f32),
}

impl Volume {
    /// Fills what was not observed by the images of what was, under the symmetries that are sure: in the field's
    /// frame. What was surely seen to be empty stays empty. Returns the number of samples that an image decided; the bodies
    /// must claim their insides anew.
    pub fn complete(&mut self, symmetry: &Symmetry, truncation: f64) -> usize {
        let images = images(symmetry);
        if images.is_empty() {
            return 0;
        }
        let known = self.surely_known();
        let filled: Vec<Option<f32>> = (0..known.len())
            .map(|at| self.between_images(&known, at, &images, truncation as f32))
            .collect();
        let count = filled.iter().flatten().count();
        if count > 0 {
            self.decide_with(&filled, truncation as f32);
        }
        count
    }

    /// Every sample as it was observed, none that is another thing's.
    fn known(&self) -> Vec<Known> {
        let [nx, ny, nz] = self.size;
        let mut known = Vec::with_capacity(nx * ny * nz);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let index = self.global(x, y, z);
                    let own = self.owner[self.at(x, y, z)] != FOREIGN;
                    known.push(match self.field.observed(index) {
                        Some(distance) if own => Known::Distance(distance),
                        None if self.field.is_free(index) => Known::Empty,
                        _ => Known::Nothing,
                    });
                }
            }
        }
        known
    }

    /// What is known, without what is said to be empty beside what is not known.
    fn surely_known(&self) -> Vec<Known> {
        let mut sure = self.known();
        for _ in 0..DOUBTFUL {
            let before = sure.clone();
            for (at, known) in sure.iter_mut().enumerate().filter(|(_, k)| **k == Known::Empty) {
                let mut around = self.neighbours(self.place(at));
                if around.any(|n| before[self.at(n[0], n[1], n[2])] == Known::Nothing) {
                    *known = Known::Nothing;
                }
            }
        }
        sure
    }

    /// The distance that the images of a sample have on the average; nothing where the sample itself is known.
    fn between_images(&self, known: &[Known], at: usize, images: &[Image], truncation: f32) -> Option<f32> {
        if known[at] != Known::Nothing || self.owner[at] == FOREIGN {
            return None;
        }
        let [x, y, z] = self.place(at);
        let here = self.point(self.global(x, y, z));
        let below = self.global(x, y, z)[2] < self.clear;
        let (mut sum, mut count) = (0.0, 0.0);
        for image in images {
            if let Some(distance) = self.sampled(known, &image.of(&here), truncation) {
                sum += distance;
                count += 1.0;
            }
        }
        let mean = sum / count;
        let voxel = self.field.voxel as f32;
        // Under the blur the layer above is continued; an image may only cut it off, as under a ball.
        (count > 0.0 && (!below || mean > CLEAR * voxel)).then_some(if mean == 0.0 { 1e-7 } else { mean })
    }

    /// The distance at a place between samples, from those that are known and above the blur.
    fn sampled(&self, known: &[Known], p: &Point3<f64>, truncation: f32) -> Option<f32> {
        let at = [p.x, p.y, p.z].map(|c| c / self.field.voxel - 0.5);
        let low = at.map(|c| c.floor() as i32);
        if low[2] < self.clear {
            return None;
        }
        let (mut sum, mut weight) = (0.0, 0.0);
        for m in 0..8 {
            let step = [m & 1, (m >> 1) & 1, m >> 2];
            let index: [i32; 3] = std::array::from_fn(|a| low[a] + step[a]);
            let share: f64 = (0..3).map(|a| 1.0 - (at[a] - f64::from(index[a])).abs()).product();
            let value = match known[self.at_global(index)?] {
                Known::Nothing => continue,
                Known::Empty => truncation,
                Known::Distance(d) => d,
            };
            sum += share * f64::from(value);
            weight += share;
        }
        (weight > LEAST_KNOWN).then_some((sum / weight) as f32)
    }
}
