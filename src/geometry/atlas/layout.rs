//! A surface laid out flat: charts that fold nowhere, packed into one image with a gutter around each.

use nalgebra::Vector3;

use super::charts::{Chart, charts};
use super::pack::pack;
use super::raster::cover_triangle;
use crate::geometry::Mesh;

/// Texels around a chart that belong to no other, so that what is interpolated at its rim is its own.
const GUTTER: u32 = 2;
/// How much coarser the texels become at a time until the image fits.
const COARSER: f64 = 1.15;
/// Directions in which a chart's box is tried, over a quarter turn.
const TURNS: usize = 18;

/// Where every triangle of a mesh lies in an image.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Edge of a texel on the surface, m, where it is not foreshortened.
    pub pitch: f64,
    /// Places in the image, pixels from its upper left corner.
    pub places: Vec<[f64; 2]>,
    /// The places of each triangle's corners. Each place belongs to one vertex.
    pub corners: Vec<[u32; 3]>,
}

/// A spot of the surface under a texel.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    /// The triangle that it lies in.
    pub triangle: u32,
    /// Barycentric weights of its corners.
    pub weights: [f64; 3],
}

/// A chart in its own plane: the corner of its box is the origin.
struct Sheet {
    places: Vec<[f64; 2]>,
    corners: Vec<[u32; 3]>,
    size: [f64; 2],
}

impl Atlas {
    /// Lays `mesh` out with texels of `pitch` metres, or coarser ones where the image would have more than `most`
    /// pixels a side. Nothing for an empty mesh, or one with so many charts that no pitch is coarse enough.
    pub fn new(mesh: &Mesh, pitch: f64, most: u32) -> Option<Self> {
        let charts = charts(mesh, pitch);
        let sheets: Vec<Sheet> = charts.iter().map(|c| Sheet::new(mesh, c)).collect();
        let mut pitch = pitch;
        loop {
            let sizes: Vec<[u32; 2]> = sheets.iter().map(|s| s.texels(pitch)).collect();
            let (width, height, spots) = pack(&sizes)?;
            if width <= most && height <= most {
                let mut atlas = Self {
                    width,
                    height,
                    pitch,
                    places: Vec::new(),
                    corners: vec![[0; 3]; mesh.triangles.len()],
                };
                for ((chart, sheet), spot) in charts.iter().zip(&sheets).zip(&spots) {
                    atlas.put(chart, sheet, *spot);
                }
                return Some(atlas);
            }
            if sizes.iter().all(|s| s[0].max(s[1]) <= 2 * GUTTER + 2) {
                return None;
            }
            pitch *= COARSER;
        }
    }

    fn put(&mut self, chart: &Chart, sheet: &Sheet, spot: [u32; 2]) {
        let first = self.places.len() as u32;
        let from = |k: usize| f64::from(spot[k] + GUTTER) + 0.5;
        let place = |p: &[f64; 2]| [from(0) + p[0] / self.pitch, from(1) + p[1] / self.pitch];
        self.places.extend(sheet.places.iter().map(place));
        for (t, corners) in chart.triangles.iter().zip(&sheet.corners) {
            self.corners[*t as usize] = corners.map(|c| c + first);
        }
    }

    /// The spot of the surface under every texel, row by row; nothing in the gutters.
    pub fn texels(&self) -> Vec<Option<Texel>> {
        let mut texels: Vec<Option<Texel>> = vec![None; self.width as usize * self.height as usize];
        let at = |x: i64, y: i64| (y * i64::from(self.width) + x) as usize;
        let places = |t: usize| self.corners[t].map(|c| self.places[c as usize]);
        for t in 0..self.corners.len() {
            let triangle = t as u32;
            cover_triangle(&places(t), [self.width, self.height].map(i64::from), |x, y, weights| {
                texels[at(x, y)] = Some(Texel { triangle, weights });
            });
        }
        // A triangle may lie between the centres of texels: those that its corners fall in are its own then.
        for t in 0..self.corners.len() {
            let corners = places(t);
            for (k, corner) in corners.iter().enumerate() {
                let spot = &mut texels[at(corner[0] as i64, corner[1] as i64)];
                let own = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
                spot.get_or_insert(Texel {
                    triangle: t as u32,
                    weights: own,
                });
            }
        }
        texels
    }

    /// Continues the colours of the charts into their gutters; the rest becomes their mean.
    pub fn fill_gutters(&self, image: &[Option<[u8; 3]>]) -> Vec<[u8; 3]> {
        let (width, height) = (self.width as i64, self.height as i64);
        let mut now = image.to_vec();
        for _ in 0..=GUTTER {
            let before = now.clone();
            for y in 0..height {
                for x in 0..width {
                    let at = (y * width + x) as usize;
                    if before[at].is_some() {
                        continue;
                    }
                    let beside = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
                    now[at] = beside.into_iter().find_map(|(dx, dy)| {
                        let (u, v) = (x + dx, y + dy);
                        let inside = u >= 0 && v >= 0 && u < width && v < height;
                        inside.then(|| before[(v * width + u) as usize]).flatten()
                    });
                }
            }
        }
        let known = image.iter().flatten();
        let (sum, count) = known.fold(([0u64; 3], 0u64), |(s, n), c| {
            (std::array::from_fn(|k| s[k] + u64::from(c[k])), n + 1)
        });
        let mean = sum.map(|s| (s / count.max(1)) as u8);
        now.into_iter().map(|c| c.unwrap_or(mean)).collect()
    }
}

impl Sheet {
    /// The chart seen along its direction, turned so that its box is small and lies.
    fn new(mesh: &Mesh, chart: &Chart) -> Self {
        let [u, v] = chart.axes;
        let mut own: Vec<u32> = chart
            .triangles
            .iter()
            .flat_map(|t| mesh.triangles[*t as usize])
            .collect();
        own.sort_unstable();
        own.dedup();
        let flat = |vertex: &u32| {
            let p = mesh.vertices[*vertex as usize].coords;
            [p.dot(&u), p.dot(&v)]
        };
        let places: Vec<[f64; 2]> = own.iter().map(flat).collect();
        let boxed = |turn: f64| {
            let (s, c) = turn.sin_cos();
            let turned: Vec<[f64; 2]> = places
                .iter()
                .map(|p| [c * p[0] - s * p[1], s * p[0] + c * p[1]])
                .collect();
            let bound = |k: usize, pick: fn(f64, f64) -> f64, from: f64| turned.iter().map(|p| p[k]).fold(from, pick);
            let low = [0, 1].map(|k| bound(k, f64::min, f64::INFINITY));
            let high = [0, 1].map(|k| bound(k, f64::max, f64::NEG_INFINITY));
            (turned, low, [high[0] - low[0], high[1] - low[1]])
        };
        let step = std::f64::consts::FRAC_PI_2 / TURNS as f64;
        let mut best = (0.0, f64::INFINITY);
        for k in 0..TURNS {
            let (_, _, size) = boxed(step * k as f64);
            if size[0] * size[1] < best.1 * (1.0 - 1e-9) {
                best = (step * k as f64, size[0] * size[1]);
            }
        }
        let (_, _, size) = boxed(best.0);
        let lying = if size[0] < size[1] {
            std::f64::consts::FRAC_PI_2
        } else {
            0.0
        };
        let (turned, low, size) = boxed(best.0 + lying);
        let place = |vertex: u32| own.binary_search(&vertex).unwrap_or_default() as u32;
        Self {
            places: turned.iter().map(|p| [p[0] - low[0], p[1] - low[1]]).collect(),
            corners: chart
                .triangles
                .iter()
                .map(|t| mesh.triangles[*t as usize].map(place))
                .collect(),
            size,
        }
    }

    /// Size with its gutters; a chart begins and ends in the middle of a texel.
    fn texels(&self, pitch: f64) -> [u32; 2] {
        self.size.map(|s| (s / pitch).ceil() as u32 + 2 * GUTTER + 1)
    }
}

/// Two unit vectors that span the plane across `direction`, right-handed with it.
pub(super) fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = direction.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    let u = other.cross(direction).normalize();
    [u, direction.cross(&u)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids;

    /// The texel under a spot of a triangle is of that triangle, or of one that touches it there: no two parts of the
    /// surface share a texel.
    #[test]
    fn every_spot_has_a_texel_of_its_own() {
        let shapes = [
            ("box", solids::cuboid([0.1, 0.06, 0.04])),
            ("ball", solids::sphere(0.04, 3)),
        ];
        for (name, mesh) in shapes {
            let atlas = Atlas::new(&mesh, 0.001, 1024).expect("a layout");
            let texels = atlas.texels();
            for t in 0..mesh.triangles.len() {
                let corners = mesh.corners(t);
                let spots = atlas.corners[t].map(|c| atlas.places[c as usize]);
                for w in [[1.0 / 3.0; 3], [0.6, 0.2, 0.2], [0.1, 0.1, 0.8]] {
                    let p = (0..3).map(|k| corners[k].coords * w[k]).sum::<Vector3<f64>>();
                    let [x, y] = [0, 1].map(|a| (0..3).map(|k| spots[k][a] * w[k]).sum::<f64>() as usize);
                    // At the rim of a chart the spot may lie in a texel of the gutter, beside one of its own.
                    let mut beside =
                        (0..9).filter_map(|n| texels[(y + n / 3 - 1) * atlas.width as usize + x + n % 3 - 1]);
                    let texel = texels[y * atlas.width as usize + x]
                        .or_else(|| beside.next())
                        .expect("a texel");
                    let there = mesh.corners(texel.triangle as usize);
                    let q = (0..3).map(|k| there[k].coords * texel.weights[k]).sum::<Vector3<f64>>();
                    assert!((p - q).norm() < 0.003, "{name}: {:?} for {:?}", q, p);
                }
            }
        }
    }

    #[test]
    fn an_image_stays_within_its_bound() {
        let mesh = solids::cuboid([1.0, 1.0, 1.0]);
        let atlas = Atlas::new(&mesh, 0.0005, 512).expect("a layout");
        assert!(
            atlas.width <= 512 && atlas.height <= 512 && atlas.pitch > 0.003,
            "{atlas:?}"
        );
        assert!(Atlas::new(&Mesh::default(), 0.001, 512).is_none());
    }
}
