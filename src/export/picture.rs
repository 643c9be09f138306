//! Pictures of posed meshes: perspective, a depth buffer (Catmull 1974), one lamp and its shadow on the table.

use std::io::Cursor;

use image::{ImageFormat, RgbImage};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::scene::Floor;
use crate::geometry::{Mesh, Texture};

/// Pixels of a picture; each is the mean of `FINE` by `FINE` samples.
const SIZE: [usize; 2] = [640, 480];
const FINE: usize = 2;
/// Half of the angle of view across the picture, as a tangent.
const TANGENT: f64 = 0.4;
/// From the scene to the lamp.
const LAMP: [f64; 3] = [-0.35, -0.25, 0.9];
/// Spacing of the lines on the table, m.
const GRID: f64 = 0.05;
const SKY: [f64; 3] = [238.0, 240.0, 243.0];
const TABLE: [f64; 3] = [205.0, 200.0, 190.0];

/// A mesh with its colours, to be drawn wherever it is.
pub(super) struct Drawn<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) texture: Option<&'a Texture>,
    /// sRGB, 0 to 1, where no colour was seen.
    pub(super) plain: [f64; 3],
}

impl Drawn<'_> {
    /// sRGB, 0 to 255, of triangle `t` at barycentric `weights`.
    fn color(&self, t: usize, weights: [f64; 3]) -> [f64; 3] {
        let mix = |corners: [[f64; 3]; 3]| [0, 1, 2].map(|c| (0..3).map(|k| weights[k] * corners[k][c]).sum::<f64>());
        if let Some((texture, corners)) = self.texture.and_then(|x| Some((x, x.corners.get(t)?))) {
            let at = |axis: usize| {
                (0..3)
                    .map(|k| weights[k] * texture.places[corners[k] as usize][axis])
                    .sum::<f64>()
            };
            let pixel = |share: f64, n: u32| ((share * f64::from(n)).max(0.0) as u32).min(n.saturating_sub(1));
            let (column, row) = (pixel(at(0), texture.width), pixel(1.0 - at(1), texture.height));
            if let Some(rgb) = texture.rgb.get((row * texture.width + column) as usize) {
                return rgb.map(f64::from);
            }
        }
        let corners = self.mesh.triangles[t];
        match corners.map(|v| self.mesh.colors.get(v as usize)) {
            [Some(a), Some(b), Some(c)] => mix([a, b, c].map(|rgb| rgb.map(f64::from))),
            _ => self.plain.map(|share| share * 255.0),
        }
    }
}

/// Where the pictures are taken from.
pub(super) struct Eye {
    place: Point3<f64>,
    right: Vector3<f64>,
    down: Vector3<f64>,
    forward: Vector3<f64>,
}

impl Eye {
    /// Looks at a box that holds all of `points`, from aside and above, so that all are in the picture.
    /// `None` where there is no point.
    pub(super) fn on(points: impl Iterator<Item = Point3<f64>>, up: &Unit<Vector3<f64>>) -> Option<Self> {
        let (low, high) = points.fold(None, |ends: Option<(Point3<f64>, Point3<f64>)>, p| {
            Some(ends.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
        })?;
        let middle = nalgebra::center(&low, &high);
        let side = [Vector3::x(), Vector3::y()].map(|e| e - up.into_inner() * e.dot(up));
        let across = side.iter().max_by(|a, b| a.norm().total_cmp(&b.norm()))?.normalize();
        let along = up.cross(&across);
        let forward = (across * -0.45 + along * 0.9 - up.into_inner() * 0.6).normalize();
        let right = forward.cross(up).normalize();
        // A sphere about the box fills the lesser angle of view.
        let radius = (0.5 * (high - low).norm()).max(0.02);
        let tangent = TANGENT * SIZE[1] as f64 / SIZE[0] as f64;
        let far = radius * (1.0 + 1.0 / (tangent * tangent)).sqrt();
        Some(Self {
            place: middle - forward * far,
            right,
            down: forward.cross(&right),
            forward,
        })
    }

    /// Pixels across and down, and the depth; `None` behind the eye.
    fn see(&self, p: &Point3<f64>) -> Option<[f64; 3]> {
        let ray = p - self.place;
        let depth = ray.dot(&self.forward);
        let scale = Self::scale();
        let [width, height] = SIZE.map(|n| (n * FINE) as f64);
        (depth > 1e-4).then(|| {
            let at = |side: &Vector3<f64>, middle: f64| middle + scale * ray.dot(side) / depth;
            [at(&self.right, 0.5 * width), at(&self.down, 0.5 * height), depth]
        })
    }

    /// Direction of the ray through the middle of a sample, with a depth of 1.
    fn ray(&self, column: usize, row: usize) -> Vector3<f64> {
        let off = |n: usize, size: usize| (n as f64 + 0.5 - 0.5 * (size * FINE) as f64) / Self::scale();
        self.forward + self.right * off(column, SIZE[0]) + self.down * off(row, SIZE[1])
    }

    fn scale() -> f64 {
        0.5 * (SIZE[0] * FINE) as f64 / TANGENT
    }
}

/// One picture in the making.
struct Canvas {
    /// Depth of what is nearest, m.
    depth: Vec<f64>,
    rgb: Vec<[f64; 3]>,
}

/// The picture as PNG.
pub(super) fn picture(things: &[(Drawn<'_>, Isometry3<f64>)], floor: Option<&Floor>, eye: &Eye) -> Option<Vec<u8>> {
    let samples = SIZE[0] * SIZE[1] * FINE * FINE;
    let mut canvas = Canvas {
        depth: vec![f64::INFINITY; samples],
        rgb: vec![SKY; samples],
    };
    if let Some(floor) = floor {
        canvas.table(things, floor, eye);
    }
    let lamp = Vector3::from(LAMP).normalize();
    for (thing, pose) in things {
        for (t, corners) in posed(thing.mesh, pose).enumerate() {
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let Some(normal) = normal.try_normalize(0.0) else {
                continue;
            };
            let light = 0.5 + 0.5 * normal.dot(&lamp).max(0.0);
            canvas.fill(corners, eye, |weights| thing.color(t, weights).map(|c| c * light));
        }
    }
    canvas.png()
}

fn posed<'a>(mesh: &'a Mesh, pose: &'a Isometry3<f64>) -> impl Iterator<Item = [Point3<f64>; 3]> + 'a {
    (0..mesh.triangles.len()).map(move |t| mesh.corners(t).map(|p| pose * p))
}

impl Canvas {
    /// The table with lines on it, and what the things keep from the lamp.
    fn table(&mut self, things: &[(Drawn<'_>, Isometry3<f64>)], floor: &Floor, eye: &Eye) {
        let normal = floor.normal.into_inner();
        let across = normal.cross(&eye.forward).normalize();
        let along = normal.cross(&across);
        let width = SIZE[0] * FINE;
        for at in 0..self.rgb.len() {
            let ray = eye.ray(at % width, at / width);
            let depth = (Point3::from(floor.point) - eye.place).dot(&normal) / ray.dot(&normal);
            if depth > 0.0 && depth.is_finite() {
                let spot = eye.place.coords + ray * depth - floor.point;
                let off = [across, along].map(|side| (spot.dot(&side) / GRID).rem_euclid(1.0));
                // A line is a sample and a half wide, and fades where they run together.
                let thick = 1.5 * depth / (Eye::scale() * GRID);
                let line = off.iter().any(|x| *x < thick) && thick < 0.25;
                self.rgb[at] = TABLE.map(|c| if line { 0.88 * c } else { c });
            }
        }
        let lamp = Vector3::from(LAMP).normalize();
        let fall = lamp.dot(&normal);
        if fall < 0.1 {
            return;
        }
        let mut shade = Self {
            depth: vec![f64::INFINITY; self.depth.len()],
            rgb: vec![[1.0; 3]; self.rgb.len()],
        };
        for (thing, pose) in things {
            for corners in posed(thing.mesh, pose) {
                let cast = corners.map(|p| p - lamp * ((p.coords - floor.point).dot(&normal) / fall));
                shade.fill(cast, eye, |_| [0.72; 3]);
            }
        }
        for (rgb, dark) in self.rgb.iter_mut().zip(&shade.rgb) {
            *rgb = [0, 1, 2].map(|c| rgb[c] * dark[c]);
        }
    }

    /// A triangle, where nothing nearer is; edge functions (Pineda 1988), weights corrected for perspective.
    fn fill(&mut self, corners: [Point3<f64>; 3], eye: &Eye, color: impl Fn([f64; 3]) -> [f64; 3]) {
        let [Some(a), Some(b), Some(c)] = corners.map(|p| eye.see(&p)) else {
            return;
        };
        let edge = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let area = edge(a, b, c[0], c[1]);
        if area == 0.0 {
            return;
        }
        let range = |axis: usize| {
            let limit = (SIZE[axis] * FINE) as f64;
            let low = a[axis].min(b[axis]).min(c[axis]).floor().clamp(0.0, limit);
            let high = a[axis].max(b[axis]).max(c[axis]).ceil().clamp(0.0, limit);
            low as usize..high as usize
        };
        for row in range(1) {
            for column in range(0) {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let flat = [edge(b, c, x, y), edge(c, a, x, y), edge(a, b, x, y)].map(|e| e / area);
                if flat.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let shares = [flat[0] / a[2], flat[1] / b[2], flat[2] / c[2]];
                let depth = 1.0 / shares.iter().sum::<f64>();
                let at = row * SIZE[0] * FINE + column;
                if depth < self.depth[at] {
                    self.depth[at] = depth;
                    self.rgb[at] = color(shares.map(|s| s * depth));
                }
            }
        }
    }

    fn png(&self) -> Option<Vec<u8>> {
        let mean = |column: u32, row: u32| {
            let of = |c: usize| {
                let one = |k: usize| {
                    let (x, y) = (column as usize * FINE + k % FINE, row as usize * FINE + k / FINE);
                    self.rgb[y * SIZE[0] * FINE + x][c]
                };
                ((0..FINE * FINE).map(one).sum::<f64>() / (FINE * FINE) as f64).round() as u8
            };
            image::Rgb([of(0), of(1), of(2)])
        };
        let image = RgbImage::from_fn(SIZE[0] as u32, SIZE[1] as u32, mean);
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, ImageFormat::Png).ok()?;
        Some(bytes.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::cuboid;

    #[test]
    fn what_is_nearer_hides_what_is_farther() {
        let cube = cuboid([0.1; 3]);
        let place = |x: f64, y: f64| Isometry3::translation(x, y, 0.05);
        let thing = |plain| Drawn {
            mesh: &cube,
            texture: None,
            plain,
        };
        let points = cube.vertices.iter().copied();
        let eye = Eye::on(points, &Vector3::z_axis()).expect("there are points");
        let toward = -eye.forward;
        let red = (thing([1.0, 0.0, 0.0]), place(0.0, 0.0));
        let behind = (thing([0.0, 0.0, 1.0]), place(-0.3 * toward.x, -0.3 * toward.y));
        let middle = |things: &[(Drawn<'_>, Isometry3<f64>)]| {
            let png = picture(things, None, &eye).expect("a picture");
            let image = image::load_from_memory(&png).expect("a PNG").into_rgb8();
            image.get_pixel(SIZE[0] as u32 / 2, SIZE[1] as u32 / 2).0
        };
        let seen = middle(&[behind, red]);
        assert!(seen[0] > 100 && seen[2] == 0, "{seen:?}");
    }
}
