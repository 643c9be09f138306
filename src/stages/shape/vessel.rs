//! Vessels whose lower outside no view shows: the wall, where both of its sides were seen, is taken to go on as thick as it
//! is, behind the inside that was seen. Otherwise all that hides below it would be taken for solid.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point3;

use super::complete::Context;
use super::solid::Part;
use super::volume::{FOREIGN, NEIGHBOUR, Volume};
use crate::base::Notices;
use crate::geometry::{Mesh, Origin, SurfaceDistance, submesh};

/// Thickest wall that counts as thin, voxels.
const THICKEST: f64 = 5.0;
/// Least share of the seen surface behind which the other side of a thin wall was seen.
const LEAST_PAIRED: f64 = 0.3;
/// Most that the thicknesses may differ: half of them from their median, over it.
const EVEN: f64 = 0.25;
/// Least cosine between a wall's normal and that of its other side, turned.
const OPPOSITE: f64 = 0.7;
/// Least height of the normal of a surface whose other side may be hidden: views come from above.
const UPWARD: f64 = 0.15;
/// Least cosine between that normal and the way from a sample behind it.
const BEHIND: f64 = 0.5;
/// Thicknesses seen nearby, and the share of them that the wall is not taken to exceed: where a handle meets the wall it is
/// the handle's that counts.
const AROUND: usize = 40;
const MOST_OF: f64 = 0.8;
/// Samples that are looked at lie within this many thicknesses of the inside that was seen.
const REACH: f64 = 6.0;

/// A wall that was seen from both sides: where, and how thick, m.
struct Wall {
    at: [f64; 3],
    thickness: f64,
}

/// What is known of a thin-walled vessel, in the field's frame.
struct Vessel {
    walls: Vec<Wall>,
    tree: ImmutableKdTree<f64, 3>,
    inside: SurfaceDistance,
    median: f64,
}

/// Hollows out what was only concluded to be solid behind the inside of a thin-walled vessel, as far as its outside was
/// hidden there.
pub fn continue_walls(volume: &mut Volume, context: &Context, notices: &mut Notices) {
    let part = |volume: &Volume| {
        let planes = &context.parts.planes;
        Part {
            volume,
            body: 0,
            planes,
        }
        .mesh(context.ground.plane.is_some())
    };
    let Some(mesh) = part(volume) else { return };
    let Some(vessel) = Vessel::of(&mesh, volume.field.voxel) else {
        return;
    };
    let (distance, owner) = (volume.distance.clone(), volume.owner.clone());
    if volume.hollow(&vessel) == 0 {
        return;
    }
    if part(volume).is_none() {
        // What comes out is no body: as it was.
        (volume.distance, volume.owner) = (distance, owner);
        return;
    }
    let name = context.things[context.which].named.first();
    let words = format!(
        "its wall is {:.1} mm thick where both of its sides were seen, and is taken to be so where its outside was hidden",
        1e3 * vessel.median
    );
    notices.note("shape", name.map_or("views", |(n, _)| n.as_str()), words);
}

impl Vessel {
    /// Nothing where the walls are not thin, not even, or seen from one side only.
    fn of(mesh: &Mesh, voxel: f64) -> Option<Self> {
        let most = THICKEST * voxel;
        let seen = |t: usize| {
            mesh.triangles[t]
                .iter()
                .all(|v| mesh.origin(*v as usize) == Origin::Seen)
        };
        let whole = SurfaceDistance::new(mesh)?;
        let mut walls = Vec::new();
        let mut count = 0;
        for t in (0..mesh.triangles.len()).filter(|t| seen(*t)) {
            let Some(normal) = mesh.scaled_normal(t).try_normalize(0.0) else {
                continue;
            };
            count += 1;
            let [a, b, c] = mesh.corners(t);
            let from = Point3::from((a.coords + b.coords + c.coords) / 3.0) - normal * (0.1 * voxel);
            let Some(deep) = whole.first_hit(&from, &-normal, most) else {
                continue;
            };
            let there = from - normal * deep;
            let Some(other) = whole.nearest_within(&there, voxel) else {
                continue;
            };
            if seen(other.triangle) && whole.normal(other.triangle).dot(&normal) < -OPPOSITE {
                walls.push(Wall {
                    at: from.coords.into(),
                    thickness: deep + 0.1 * voxel,
                });
            }
        }
        let median = median(walls.iter().map(|w| w.thickness))?;
        let spread = self::median(walls.iter().map(|w| (w.thickness - median).abs()))?;
        if (walls.len() as f64) < LEAST_PAIRED * f64::from(count) || spread > EVEN * median {
            return None;
        }
        let upward = |t: usize| seen(t) && mesh.scaled_normal(t).normalize().z > UPWARD;
        let inside = SurfaceDistance::new(&submesh(mesh, upward).0)?;
        let places: Vec<[f64; 3]> = walls.iter().map(|w| w.at).collect();
        Some(Self {
            tree: ImmutableKdTree::new_from_slice(&places).ok()?,
            walls,
            inside,
            median,
        })
    }

    /// How far a sample is beyond the outside of the wall, m, negative within it; nothing where it is not behind the
    /// inside.
    fn beyond(&self, p: &Point3<f64>) -> Option<f64> {
        let near = self.inside.nearest_within(p, REACH * self.median)?;
        let out = near.point - p;
        let behind = self.inside.normal(near.triangle).dot(&out) > BEHIND * near.distance;
        behind.then(|| near.distance - self.thickness(&near.point))
    }

    /// The thickness of the walls that were seen nearest to a place, the thicker ones of them.
    fn thickness(&self, p: &Point3<f64>) -> f64 {
        let count = NonZero::new(AROUND.min(self.walls.len())).unwrap_or(NonZero::<usize>::MIN);
        let at: [f64; 3] = p.coords.into();
        let found = self.tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        let near = found.iter().map(|n| self.walls[n.item as usize].thickness);
        quantile(near, MOST_OF).unwrap_or(self.median)
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get((share * values.len() as f64) as usize).copied()
}

impl Volume {
    /// Takes what was concluded to be inside beyond the wall of a vessel for outside, where it is joined to space that
    /// nobody saw: what the outside that was seen shuts in, as in a thick foot, stays. Returns the number of samples.
    fn hollow(&mut self, vessel: &Vessel) -> usize {
        let concluded = |v: &Self, at: usize| !v.observed[at] && !v.mirrored[at];
        let [nx, ny, nz] = self.size;
        let mut beyond = vec![None; self.distance.len()];
        let mut front = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let at = self.at(x, y, z);
                    if !concluded(self, at) {
                        continue;
                    }
                    if self.distance[at] < 0.0 && !matches!(self.owner[at], FOREIGN | NEIGHBOUR) {
                        beyond[at] = vessel.beyond(&self.point(self.global(x, y, z)));
                    } else if self.distance[at] > 0.0 && self.global(x, y, z)[2] >= self.clear {
                        front.push([x, y, z]);
                    }
                }
            }
        }
        let mut hollowed = 0;
        while let Some(place) = front.pop() {
            for next in self.neighbours(place) {
                let at = self.at(next[0], next[1], next[2]);
                let Some(value) = beyond[at].take() else { continue };
                self.distance[at] = if value == 0.0 { 1e-7 } else { value as f32 };
                // Within the wall the front ends.
                if value > 0.0 {
                    hollowed += 1;
                    front.push(next);
                }
            }
        }
        hollowed
    }
}
