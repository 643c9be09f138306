//! Occluding contours: where the outline of a body should be in an image, and where the image has it. They hold what
//! faces leave free: a box that shows two faces slides along both unseen, but its outline moves.

use nalgebra::{Isometry3, Point3, Vector3};

use super::picture::Picture;
use super::surfels::Surfels;

/// Cells of the drawn outline per pixel, each way.
const FINENESS: i64 = 3;
/// A step in depth that makes an outline, m.
const JUMP: f64 = 0.008;
/// How far a reading may be from the surface that it is taken for, m.
const TOLERANCE: f64 = 0.005;
/// Most places of the outline that are looked up.
const MOST_RIMS: usize = 240;
/// Standard deviation of an edge between two pixels (uniform between them, and stray rays), pixels.
const EDGE_SD: f64 = 0.32;
/// Widest band without clear readings between body and background, pixels.
const WIDEST_GAP: f64 = 2.5;
/// Step of the search across the outline, pixels.
const STEP: f64 = 0.25;
/// Cells around a place of the outline that tell its direction.
const AROUND: i64 = 4;

/// A place on the outline of a body that was found in an image.
#[derive(Clone, Copy, Debug)]
pub struct Rim {
    /// On the body, m, body frame.
    pub on_body: Point3<f64>,
    /// A point of the plane through the camera in which the image has the outline, m, world.
    pub target: Point3<f64>,
    /// Normal of that plane, unit, world.
    pub normal: Vector3<f64>,
    /// Standard deviation along the normal, m.
    pub sd: f64,
}

/// A body drawn into the image, finer than its pixels.
struct Drawing {
    low: [i64; 2],
    size: [i64; 2],
    depth: Vec<f32>,
    triangle: Vec<u32>,
}

impl Drawing {
    /// Draws what faces the camera, nearest surface first (Catmull's depth buffer, 1974).
    fn new(picture: &Picture, model: &Surfels, pose: &Isometry3<f64>) -> Option<Self> {
        let [x0, y0, x1, y1] = picture.window(model.corners(pose).into_iter())?;
        let size = [(x1 - x0 + 3) * FINENESS, (y1 - y0 + 3) * FINENESS];
        let cells = (size[0] * size[1]) as usize;
        let mut drawing = Self {
            low: [x0 - 1, y0 - 1],
            size,
            depth: vec![f32::INFINITY; cells],
            triangle: vec![u32::MAX; cells],
        };
        let fine = FINENESS as f64;
        let corner = |p: &Point3<f64>| {
            let (u, v, z) = picture.place(&(pose * p))?;
            let cell = |x: f64, low: i64| (x - low as f64 + 0.5) * fine - 0.5;
            Some(Vector3::new(cell(u, drawing.low[0]), cell(v, drawing.low[1]), z))
        };
        let corners: Vec<Option<Vector3<f64>>> = model.skin.vertices.iter().map(corner).collect();
        for (t, triangle) in model.skin.triangles.iter().enumerate() {
            if let [Some(a), Some(b), Some(c)] = triangle.map(|v| corners[v as usize]) {
                drawing.fill(t as u32, [a, b, c]);
            }
        }
        Some(drawing)
    }

    fn fill(&mut self, t: u32, [a, b, c]: [Vector3<f64>; 3]) {
        // Twice the area; the image's y points down, so that what faces the camera turns the other way.
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area >= -1e-9 {
            return;
        }
        let span = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            (low.ceil().max(0.0) as i64, (high.floor() as i64).min(self.size[k] - 1))
        };
        let ((x0, x1), (y0, y1)) = (span(0), span(1));
        let share = |p: &Vector3<f64>, q: &Vector3<f64>, x: f64, y: f64| {
            ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) / area
        };
        for y in y0..=y1 {
            for x in x0..=x1 {
                let (fx, fy) = (x as f64, y as f64);
                let (wa, wb) = (share(&b, &c, fx, fy), share(&c, &a, fx, fy));
                let wc = 1.0 - wa - wb;
                if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                    continue;
                }
                let z = (1.0 / (wa / a.z + wb / b.z + wc / c.z)) as f32;
                let at = (x + self.size[0] * y) as usize;
                if z < self.depth[at] {
                    (self.depth[at], self.triangle[at]) = (z, t);
                }
            }
        }
    }

    /// Depth at a cell; infinite beside the body.
    fn at(&self, x: i64, y: i64) -> f64 {
        if x < 0 || y < 0 || x >= self.size[0] || y >= self.size[1] {
            return f64::INFINITY;
        }
        f64::from(self.depth[(x + self.size[0] * y) as usize])
    }

    /// Pixel coordinates of a cell's middle.
    fn pixel(&self, x: i64, y: i64) -> (f64, f64) {
        let at = |i: i64, low: i64| low as f64 + (i as f64 + 0.5) / FINENESS as f64 - 0.5;
        (at(x, self.low[0]), at(y, self.low[1]))
    }

    /// Depth where a pixel coordinate lies.
    fn near(&self, u: f64, v: f64) -> f64 {
        let cell = |x: f64, low: i64| ((x - low as f64 + 0.5) * FINENESS as f64 - 0.5).round() as i64;
        self.at(cell(u, self.low[0]), cell(v, self.low[1]))
    }

    /// The cells behind one of whose neighbours it goes deep, or nothing is.
    fn outline(&self) -> Vec<(i64, i64)> {
        let mut cells = Vec::new();
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let limit = self.at(x, y) + JUMP;
                let deep = |(dx, dy): (i64, i64)| self.at(x + dx, y + dy) > limit;
                if limit.is_finite() && [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().any(deep) {
                    cells.push((x, y));
                }
            }
        }
        cells
    }

    /// Unit direction in the image out of the body at a cell of its outline.
    fn outward(&self, (x, y): (i64, i64)) -> Option<(f64, f64)> {
        let limit = self.at(x, y) + JUMP;
        let (mut sx, mut sy, mut n) = (0, 0, 0);
        for dy in -AROUND..=AROUND {
            for dx in -AROUND..=AROUND {
                if self.at(x + dx, y + dy) < limit {
                    (sx, sy, n) = (sx + dx, sy + dy, n + 1);
                }
            }
        }
        let (mx, my) = (-sx as f64 / f64::from(n.max(1)), -sy as f64 / f64::from(n.max(1)));
        let length = mx.hypot(my);
        (length > 0.8).then(|| (mx / length, my / length))
    }
}

/// What a pixel across the outline shows.
enum Across {
    Body,
    Background,
    Nearer,
    Nothing,
}

/// The places of the outline of a body, thought to be at `pose`, that the image has within `reach` pixels; `mine` says
/// whether a reading can belong to the body.
pub fn rims(
    picture: &Picture,
    model: &Surfels,
    pose: &Isometry3<f64>,
    reach: f64,
    mine: &impl Fn(&Point3<f64>) -> bool,
) -> Vec<Rim> {
    let Some(drawing) = Drawing::new(picture, model, pose) else {
        return Vec::new();
    };
    let cells = drawing.outline();
    let stride = cells.len().div_ceil(MOST_RIMS).max(FINENESS as usize);
    let found = |cell: &(i64, i64)| rim(picture, model, pose, reach, mine, &drawing, *cell);
    cells.iter().step_by(stride).filter_map(found).collect()
}

fn rim(
    picture: &Picture,
    model: &Surfels,
    pose: &Isometry3<f64>,
    reach: f64,
    mine: &impl Fn(&Point3<f64>) -> bool,
    drawing: &Drawing,
    cell: (i64, i64),
) -> Option<Rim> {
    let skin = &model.skin;
    let triangle = drawing.triangle[(cell.0 + drawing.size[0] * cell.1) as usize] as usize;
    if !skin.seen.is_empty() && !skin.triangles[triangle].iter().all(|v| skin.seen[*v as usize]) {
        return None;
    }
    let (mx, my) = drawing.outward(cell)?;
    let z = drawing.at(cell.0, cell.1);
    let (u, v) = drawing.pixel(cell.0, cell.1);
    // The outline runs on average half a cell beyond the middle of the outermost one.
    let beyond = 0.5 / FINENESS as f64 * mx.abs().max(my.abs());
    let (u, v) = (u + mx * beyond, v + my * beyond);
    let (offset, gap) = transition(picture, drawing, (u, v), (mx, my), z, reach, mine)?;
    let (place, gradient) = picture.moves_by((u, v), z, (mx, my));
    let per_metre = gradient.norm();
    let normal = gradient / per_metre;
    Some(Rim {
        on_body: pose.inverse_transform_point(&place),
        target: place + normal * (offset / per_metre),
        normal,
        sd: EDGE_SD.hypot((gap - 1.0).max(0.0) / 12_f64.sqrt()) / per_metre,
    })
}

/// Where, across the outline, the image goes from body to background, and how wide it is unclear; pixels.
fn transition(
    picture: &Picture,
    drawing: &Drawing,
    (u, v): (f64, f64),
    (mx, my): (f64, f64),
    z: f64,
    reach: f64,
    mine: &impl Fn(&Point3<f64>) -> bool,
) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    let mut body: Option<f64> = None;
    let steps = (reach / STEP).round() as i64;
    for k in -steps..=steps {
        let t = k as f64 * STEP;
        let (x, y) = (u + mx * t, v + my * t);
        let expected = if t < 0.0 { drawing.near(x, y).min(z + 0.05) } else { z };
        match across(picture, (x, y), expected, picture.pixel_size(z) * t.abs()) {
            Across::Body => body = Some(t),
            Across::Nearer => body = None,
            Across::Nothing => {}
            Across::Background => {
                if let Some(last) = body.take() {
                    let (middle, gap) = (0.5 * (last + t), t - last);
                    let nearer = best.is_none_or(|b| middle.abs() < b.0.abs());
                    let inside = picture.read(u + mx * last, v + my * last);
                    if gap <= WIDEST_GAP && nearer && inside.is_some_and(|p| mine(&p)) {
                        best = Some((middle, gap));
                    }
                }
            }
        }
    }
    best
}

fn across(picture: &Picture, (x, y): (f64, f64), expected: f64, aside: f64) -> Across {
    let Some(seen) = picture.depth(x.round() as i64, y.round() as i64) else {
        return Across::Nothing;
    };
    let (behind, tolerance) = (seen - expected, TOLERANCE + 1.5 * aside);
    if behind.abs() < tolerance {
        Across::Body
    } else if behind > JUMP.max(tolerance) {
        Across::Background
    } else if behind < -tolerance {
        Across::Nearer
    } else {
        Across::Nothing
    }
}
