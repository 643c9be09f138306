//! Where a convex thing meets a convex part of a tool: the direction in which they are farthest apart (or overlap
//! least), and up to four spots of the common face.
//!
//! The separation along a unit vector is a lower bound of the distance, so the best of several candidates is the
//! distance wherever the true direction is among them: the faces of both, and the nearest edge for round tools.

use super::floor::Spot;
use super::lanes::{F, M3, V3, all, less, more, pick};
use super::solid::{Polytope, Shape, Solid};

/// Corners within this of the nearest one belong to the touching face, m.
const FACE: f32 = 1.5e-3;

/// How a thing and a part of a tool are to each other, in the frame of the part.
pub(super) struct Touch {
    /// From the tool to the thing.
    pub normal: V3,
    /// Horizontal across the normal, and across both.
    pub tangents: [V3; 2],
    /// Relative to the part's origin; gaps are distances.
    pub spots: [Spot; 4],
    pub count: usize,
    /// Distance.
    pub gap: F,
}

/// The best direction so far.
struct Apart {
    gap: F,
    normal: V3,
}

impl Apart {
    #[inline(always)]
    fn offer(&mut self, gap: F, normal: V3) {
        let better = more(gap, self.gap);
        self.gap = pick(better, gap, self.gap);
        self.normal = V3::pick(better, normal, self.normal);
    }
}

/// The touch of `solid` (part-from-solid `turn`, `at`) and `part`; `up` is the support's normal in the part's frame.
pub(super) fn touch(part: &Shape, solid: &Solid, turn: &M3, at: V3, up: V3, corners: &mut Vec<V3>) -> Touch {
    if let Some(radius) = solid.ball {
        let (gap, normal) = ball_apart(part, at);
        let spot = Spot {
            r: at - normal * all(radius),
            gap: gap - all(radius),
        };
        return single(normal, spot, up);
    }
    if let Shape::Ball(radius) = part {
        // The other way round: the tool's middle in the frame of the solid.
        let middle = turn.apply_transposed(-at);
        let (gap, normal) = polytope_apart(&solid.hull, middle);
        let normal = -turn.apply(normal);
        let spot = Spot {
            r: normal * all(*radius),
            gap: gap - all(*radius),
        };
        return single(normal, spot, up);
    }
    corners.clear();
    corners.extend(solid.hull.points.iter().map(|p| turn.apply(V3::all(*p)) + at));
    let apart = separation(part, solid, turn, at, corners);
    face_spots(part, apart, up, corners)
}

fn tangents(normal: V3, up: V3) -> [V3; 2] {
    let level = up.cross(normal);
    let side = V3::new(F::ONE, F::ZERO, F::ZERO).cross(normal);
    let t = V3::pick(more(level.norm2(), all(0.01)), level, side).unit();
    [t, normal.cross(t)]
}

fn single(normal: V3, spot: Spot, up: V3) -> Touch {
    Touch {
        normal,
        tangents: tangents(normal, up),
        spots: [spot; 4],
        count: 1,
        gap: spot.gap,
    }
}

/// Distance of a point from a part and the direction from the part to it.
fn ball_apart(part: &Shape, at: V3) -> (F, V3) {
    match part {
        Shape::Ball(radius) => ((at.norm2() + all(1e-20)).sqrt() - all(*radius), at.unit()),
        Shape::Box(half) => {
            let h = V3::all(*half);
            let beyond = V3::new(at.x.abs() - h.x, at.y.abs() - h.y, at.z.abs() - h.z);
            rounded(at, beyond)
        }
        Shape::Cylinder(radius, half) => {
            let out = (at.x * at.x + at.y * at.y + all(1e-20)).sqrt();
            // The plane through the axis and the point: radial, nothing, along.
            let flat = V3::new(out, F::ZERO, at.z);
            let beyond = V3::new(out - all(*radius), all(-1e9), at.z.abs() - all(*half));
            let (gap, n) = rounded(flat, beyond);
            (gap, V3::new(n.x * at.x / out, n.x * at.y / out, n.z))
        }
        Shape::Hull(hull) => polytope_apart(hull, at),
    }
}

/// Signed distance from a box by how far each coordinate lies beyond its half extent.
fn rounded(at: V3, beyond: V3) -> (F, V3) {
    let sign = |x: F| pick(less(x, F::ZERO), all(-1.0), all(1.0));
    let signs = V3::new(sign(at.x), sign(at.y), sign(at.z));
    let out = V3::new(
        beyond.x.fast_max(F::ZERO),
        beyond.y.fast_max(F::ZERO),
        beyond.z.fast_max(F::ZERO),
    );
    let distance = (out.norm2() + all(1e-20)).sqrt();
    let outside = more(out.norm2(), all(1e-14));
    let most = beyond.x.fast_max(beyond.y).fast_max(beyond.z);
    let is = |b: F| pick(less(b, most), F::ZERO, F::ONE);
    let inner = V3::new(is(beyond.x), is(beyond.y), is(beyond.z)).unit();
    let n = V3::pick(outside, out * (all(1.0) / distance), inner);
    let n = V3::new(n.x * signs.x, n.y * signs.y, n.z * signs.z);
    (pick(outside, distance, most), n)
}

/// Signed distance of a point from a hull, and the direction from the hull to the point.
fn polytope_apart(hull: &Polytope, at: V3) -> (F, V3) {
    let mut apart = Apart {
        gap: all(-1e30),
        normal: V3::ZERO,
    };
    for (n, d) in &hull.planes {
        let n = V3::all(*n);
        apart.offer(n.dot(at) - all(*d), n);
    }
    if more(apart.gap, F::ZERO).any() {
        let mut nearest = all(1e30);
        let mut away = V3::ZERO;
        for (a, b) in &hull.edges {
            let d = at - nearest_on(V3::all(*a), V3::all(*b), at);
            let closer = less(d.norm2(), nearest);
            nearest = pick(closer, d.norm2(), nearest);
            away = V3::pick(closer, d, away);
        }
        let n = away.unit();
        let support = hull
            .points
            .iter()
            .fold(all(-1e30), |m, p| m.fast_max(n.dot(V3::all(*p))));
        apart.offer(n.dot(at) - support, n);
    }
    (apart.gap, apart.normal)
}

fn nearest_on(a: V3, b: V3, at: V3) -> V3 {
    let along = b - a;
    let share = (at - a).dot(along) / (along.norm2() + all(1e-20));
    a + along * share.fast_max(F::ZERO).fast_min(F::ONE)
}

/// The direction from the part to the thing in which they are farthest apart.
fn separation(part: &Shape, solid: &Solid, turn: &M3, at: V3, corners: &[V3]) -> Apart {
    let mut best = Apart {
        gap: all(-1e30),
        normal: V3::ZERO,
    };
    for (n, d) in &solid.hull.planes {
        let m = turn.apply(V3::all(*n));
        best.offer(-support(part, -m) - all(*d) - m.dot(at), -m);
    }
    let (mut low, mut high) = (V3::all([1e30; 3]), V3::all([-1e30; 3]));
    for u in corners {
        low = V3::new(low.x.fast_min(u.x), low.y.fast_min(u.y), low.z.fast_min(u.z));
        high = V3::new(high.x.fast_max(u.x), high.y.fast_max(u.y), high.z.fast_max(u.z));
    }
    let unit = |k: usize, s: f32| V3::all(std::array::from_fn(|j| if j == k { s } else { 0.0 }));
    match part {
        Shape::Ball(_) => {}
        Shape::Box(h) => {
            for (k, (lo, hi)) in [(low.x, high.x), (low.y, high.y), (low.z, high.z)]
                .into_iter()
                .enumerate()
            {
                best.offer(lo - all(h[k]), unit(k, 1.0));
                best.offer(-hi - all(h[k]), unit(k, -1.0));
            }
        }
        Shape::Cylinder(radius, half) => {
            best.offer(low.z - all(*half), unit(2, 1.0));
            best.offer(-high.z - all(*half), unit(2, -1.0));
            let n = lateral(solid, turn, at);
            let reach = corners.iter().fold(all(1e30), |m, u| m.fast_min(u.dot(n)));
            best.offer(reach - all(*radius), n);
        }
        Shape::Hull(tool) => {
            for (n, d) in &tool.planes {
                let n = V3::all(*n);
                let reach = corners.iter().fold(all(1e30), |m, u| m.fast_min(u.dot(n)));
                best.offer(reach - all(*d), n);
            }
        }
    }
    best
}

/// From a cylinder's axis, across it, to the nearest edge of the thing as seen along the axis.
fn lateral(solid: &Solid, turn: &M3, at: V3) -> V3 {
    let mut nearest = all(1e30);
    let mut towards = V3::ZERO;
    for (a, b) in &solid.hull.edges {
        let flat = |p: &[f32; 3]| {
            let u = turn.apply(V3::all(*p)) + at;
            V3::new(u.x, u.y, F::ZERO)
        };
        let q = nearest_on(flat(a), flat(b), V3::ZERO);
        let closer = less(q.norm2(), nearest);
        nearest = pick(closer, q.norm2(), nearest);
        towards = V3::pick(closer, q, towards);
    }
    towards.unit()
}

/// How far a part reaches along `n`.
fn support(part: &Shape, n: V3) -> F {
    match part {
        Shape::Ball(radius) => all(*radius),
        Shape::Box(h) => n.x.abs() * all(h[0]) + n.y.abs() * all(h[1]) + n.z.abs() * all(h[2]),
        Shape::Cylinder(radius, half) => (n.x * n.x + n.y * n.y).sqrt() * all(*radius) + n.z.abs() * all(*half),
        Shape::Hull(hull) => hull
            .points
            .iter()
            .fold(all(-1e30), |m, p| m.fast_max(n.dot(V3::all(*p)))),
    }
}

/// The extent of a face across the normal, and how far its ends lie behind the nearest corner.
struct Extent {
    low: F,
    high: F,
    behind_low: F,
    behind_high: F,
}

impl Extent {
    fn none() -> Self {
        Self {
            low: all(1e30),
            high: all(-1e30),
            behind_low: F::ZERO,
            behind_high: F::ZERO,
        }
    }

    #[inline(always)]
    fn take(&mut self, there: F, value: F, behind: F) {
        let lower = there & less(value, self.low);
        self.low = pick(lower, value, self.low);
        self.behind_low = pick(lower, behind, self.behind_low);
        let higher = there & more(value, self.high);
        self.high = pick(higher, value, self.high);
        self.behind_high = pick(higher, behind, self.behind_high);
    }

    /// The ends that both have; one point where they do not overlap.
    fn common(&self, o: &Self) -> [(F, F); 2] {
        let mine = more(self.low, o.low);
        let low = (pick(mine, self.low, o.low), pick(mine, self.behind_low, o.behind_low));
        let mine = less(self.high, o.high);
        let high = (
            pick(mine, self.high, o.high),
            pick(mine, self.behind_high, o.behind_high),
        );
        let crossed = more(low.0, high.0);
        let middle = (low.0 + high.0) * all(0.5);
        [
            (pick(crossed, middle, low.0), pick(crossed, F::ZERO, low.1)),
            (pick(crossed, middle, high.0), pick(crossed, F::ZERO, high.1)),
        ]
    }
}

/// Corners of a face: extents along both tangents of the corners within [`FACE`] of the foremost along `n`.
#[inline(always)]
fn extents(corners: &[V3], n: V3, t: &[V3; 2]) -> (F, [Extent; 2]) {
    let foremost = corners.iter().fold(all(-1e30), |m, u| m.fast_max(u.dot(n)));
    let mut out = [Extent::none(), Extent::none()];
    for u in corners {
        let behind = foremost - u.dot(n);
        let there = less(behind, all(FACE));
        out[0].take(there, u.dot(t[0]), behind);
        out[1].take(there, u.dot(t[1]), behind);
    }
    (foremost, out)
}

fn face_spots(part: &Shape, apart: Apart, up: V3, corners: &[V3]) -> Touch {
    let n = apart.normal;
    let t = tangents(n, up);
    let (_, body) = extents(corners, -n, &t);
    let own = part_corners(part, n);
    let (level, tool) = extents(&own, n, &t);
    let [a, b] = [body[0].common(&tool[0]), body[1].common(&tool[1])];
    let spot = |i: usize, j: usize| {
        let gap = apart.gap + a[i].1.fast_max(b[j].1);
        Spot {
            r: n * (level + gap) + t[0] * a[i].0 + t[1] * b[j].0,
            gap,
        }
    };
    Touch {
        normal: n,
        tangents: t,
        spots: [spot(0, 0), spot(0, 1), spot(1, 0), spot(1, 1)],
        count: 4,
        gap: apart.gap,
    }
}

/// Corners of a part; of a cylinder those that lie towards `n`.
fn part_corners(part: &Shape, n: V3) -> Vec<V3> {
    match part {
        Shape::Ball(radius) => vec![n * all(*radius)],
        Shape::Box(h) => (0..8)
            .map(|i| {
                let s = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
                V3::all([s(1) * h[0], s(2) * h[1], s(4) * h[2]])
            })
            .collect(),
        Shape::Cylinder(radius, half) => {
            let out = V3::new(n.x, n.y, F::ZERO).unit() * all(*radius);
            let across = V3::new(-out.y, out.x, F::ZERO);
            [out, across, -across, -out]
                .into_iter()
                .flat_map(|p| [*half, -half].map(|z| V3::new(p.x, p.y, all(z))))
                .collect()
        }
        Shape::Hull(hull) => hull.points.iter().map(|p| V3::all(*p)).collect(),
    }
}
