//! Textures: the colour images, seen from the surface.
//!
//! A texel takes the colours of the views that show its spot: those in which its thing is the front-most, whose range
//! reading is at the spot's own depth, and whose pixels around are of the same surface. Views count by how squarely and
//! from how near they look, and what differs from the median of them, a highlight or a stray pixel, is left out. A spot
//! that every view shows beside an edge is not sure: it is filled from what is sure around it, like what no view shows.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use super::eye::Eye;
use super::fill::fill;
use crate::capture::Capture;
use crate::geometry::{Atlas, Mesh, Texel, Texture};
use crate::stages::shape::{Config, ShapedObject, Shapes};

/// Most pixels of a texture's side.
const MOST_PIXELS: u32 = 1024;
/// Edge of a texel, in pixels of the views that are nearest.
const FINENESS: f64 = 0.75;
/// Least edge of a texel, m.
const LEAST_PITCH: f64 = 0.000_25;
/// How far a colour may be from the median of all, of 255.
const OUTLYING: f64 = 24.0;

/// A spot of the surface with its normal, world frame.
pub struct Spot {
    pub at: Point3<f64>,
    pub normal: Vector3<f64>,
}

/// What the views make of a spot's colour.
#[derive(Clone, Copy, PartialEq)]
pub enum Shown {
    /// Some show it clear of edges.
    Clear([f64; 3]),
    /// It is beside an edge in all that show it.
    Edge([f64; 3]),
    /// None shows it.
    Unseen,
}

/// Gives every thing whose colour was seen a texture.
pub fn bake(capture: &Capture, shapes: &mut Shapes, config: &Config) {
    let eyes: Vec<Eye> = capture
        .views
        .par_iter()
        .filter_map(|view| Eye::new(&capture.cameras[view.camera], view, shapes))
        .collect();
    if eyes.is_empty() {
        return;
    }
    for which in 0..shapes.objects.len() {
        shapes.objects[which].texture = texture(&shapes.objects[which], which, &eyes, config);
    }
}

fn texture(object: &ShapedObject, which: usize, eyes: &[Eye], config: &Config) -> Option<Texture> {
    let mesh = &object.mesh;
    let world_from_link = object.world_from_link.0;
    let atlas = Atlas::new(mesh, pitch(mesh, &world_from_link, eyes)?, MOST_PIXELS)?;
    let painted: Vec<Option<(Spot, Shown)>> = atlas
        .texels()
        .par_iter()
        .map(|texel| {
            let spot = spot(mesh, texel.as_ref()?, &world_from_link);
            let shown = shown(&spot, which, eyes, config);
            Some((spot, shown))
        })
        .collect();
    let image = fill(&painted, atlas.pitch)?;
    let size = [f64::from(atlas.width), f64::from(atlas.height)];
    let place = |p: &[f64; 2]| [p[0] / size[0], 1.0 - p[1] / size[1]];
    Some(Texture {
        rgb: atlas.fill_gutters(&image),
        places: atlas.places.iter().map(place).collect(),
        corners: atlas.corners,
        width: atlas.width,
        height: atlas.height,
    })
}

/// The edge of a texel: what a pixel of the nearer views covers. Nothing where none looks that way.
fn pitch(mesh: &Mesh, world_from_link: &Isometry3<f64>, eyes: &[Eye]) -> Option<f64> {
    let (low, high) = mesh.bounds()?;
    let middle = world_from_link * nalgebra::center(&low, &high);
    let mut pixels: Vec<f64> = eyes.iter().filter_map(|eye| eye.pixel_at(&middle)).collect();
    pixels.sort_by(f64::total_cmp);
    Some((FINENESS * pixels.get(pixels.len() / 4)?).max(LEAST_PITCH))
}

fn spot(mesh: &Mesh, texel: &Texel, world_from_link: &Isometry3<f64>) -> Spot {
    let corners = mesh.corners(texel.triangle as usize);
    let at: Vector3<f64> = corners.iter().zip(texel.weights).map(|(p, w)| p.coords * w).sum();
    let normal = mesh.scaled_normal(texel.triangle as usize);
    Spot {
        at: world_from_link * Point3::from(at),
        normal: world_from_link * normal.try_normalize(1e-30).unwrap_or_else(Vector3::zeros),
    }
}

fn shown(spot: &Spot, which: usize, eyes: &[Eye], config: &Config) -> Shown {
    let looks: Vec<_> = eyes.iter().filter_map(|eye| eye.look(spot, which, config)).collect();
    let of = |clear: bool| -> Vec<([f64; 3], f64)> {
        let those = looks.iter().filter(|l| l.clear == clear);
        those.map(|l| (l.color, l.weight)).collect()
    };
    match (blend(&of(true)), blend(&of(false))) {
        (Some(color), _) => Shown::Clear(color),
        (None, Some(color)) => Shown::Edge(color),
        (None, None) => Shown::Unseen,
    }
}

/// The weighted mean of the colours that are near their median; nothing of nothing.
fn blend(colors: &[([f64; 3], f64)]) -> Option<[f64; 3]> {
    if colors.is_empty() {
        return None;
    }
    let middle: [f64; 3] = std::array::from_fn(|k| weighted_median(colors, k));
    let near = |c: &[f64; 3]| (0..3).all(|k| (c[k] - middle[k]).abs() <= OUTLYING);
    let (mut sum, mut all) = ([0.0; 3], 0.0);
    for (c, weight) in colors.iter().filter(|(c, _)| near(c)) {
        all += weight;
        for k in 0..3 {
            sum[k] += weight * c[k];
        }
    }
    Some(if all > 0.0 { sum.map(|s| s / all) } else { middle })
}

fn weighted_median(colors: &[([f64; 3], f64)], channel: usize) -> f64 {
    let mut sorted: Vec<(f64, f64)> = colors.iter().map(|(c, w)| (c[channel], *w)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = 0.5 * sorted.iter().map(|s| s.1).sum::<f64>();
    for (value, weight) in &sorted {
        left -= weight;
        if left <= 0.0 {
            return *value;
        }
    }
    sorted.last().map_or(0.0, |s| s.0)
}
