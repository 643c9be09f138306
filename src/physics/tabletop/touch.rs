//! Where a convex thing meets a convex part of a tool: the direction in which they are farthest apart (or overlap
//! least), and up to four spots of the common face.
//!
//! The separation along a unit vector is a lower bound of the distance, so the best of several candidates is the
//! distance wherever the true direction is among them: the faces of both, and the nearest edge for round tools. A face that
//! cannot be the best in any trial is passed over.

use pulp::Simd;

use super::extent::{extents, face};
use super::floor::Spot;
use super::lanes::{F, V3, less, more, pick};
use super::solid::{Polytope, Shape, Solid};
use super::turns::M3;

/// How a thing and a part of a tool are to each other, in the frame of the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch<S: Simd> {
    /// From the tool to the thing.
    pub normal: V3<S>,
    /// Horizontal across the normal, and across both.
    pub tangents: [V3<S>; 2],
    /// Relative to the part's origin; gaps are distances.
    pub spots: [Spot<S>; 4],
    pub count: usize,
    /// Distance.
    pub gap: F<S>,
}

/// The best direction so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Apart<S: Simd> {
    pub gap: F<S>,
    pub normal: V3<S>,
}

impl<S: Simd> Apart<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self {
            gap: F::all(simd, -1e30),
            normal: V3::zero(simd),
        }
    }

    #[inline(always)]
    fn offer(&mut self, gap: F<S>, normal: V3<S>) {
        let better = more(gap, self.gap);
        self.gap = pick(better, gap, self.gap);
        self.normal = V3::pick(better, normal, self.normal);
    }
}

/// Room for the corners of both, in the frame of the part.
pub(super) struct Corners<S: Simd> {
    pub thing: Vec<V3<S>>,
    pub part: Vec<V3<S>>,
}

/// The touch of `solid` (part-from-solid `turn`, `at`) and `part`; `up` is the support's normal in the part's frame.
#[inline(always)]
pub(super) fn touch<S: Simd>(
    simd: S,
    part: &Shape,
    solid: &Solid,
    turn: &M3<S>,
    at: V3<S>,
    up: V3<S>,
    corners: &mut Corners<S>,
) -> Touch<S> {
    if let Some(radius) = solid.ball {
        let (gap, normal) = ball_apart(simd, part, at);
        let spot = Spot {
            r: at - normal * radius,
            gap: gap - radius,
        };
        return single(normal, spot, up);
    }
    if let Shape::Ball(radius) = part {
        // The other way round: the tool's middle in the frame of the solid.
        let middle = turn.apply_transposed(-at);
        let (gap, normal) = polytope_apart(simd, &solid.hull, middle);
        let normal = -turn.apply(normal);
        let spot = Spot {
            r: normal * *radius,
            gap: gap - *radius,
        };
        return single(normal, spot, up);
    }
    corners.thing.clear();
    for p in &solid.hull.points {
        corners.thing.push(turn.apply(V3::all(simd, *p)) + at);
    }
    let apart = separation(simd, part, solid, turn, at, &corners.thing);
    face_spots(simd, part, apart, up, corners)
}

#[inline(always)]
fn tangents<S: Simd>(normal: V3<S>, up: V3<S>) -> [V3<S>; 2] {
    let level = up.cross(normal);
    let zero = up.x.like(0.0);
    let side = V3::new(up.x.like(1.0), zero, zero).cross(normal);
    let t = V3::pick(more(level.norm2(), up.x.like(0.01)), level, side).unit();
    [t, normal.cross(t)]
}

#[inline(always)]
fn single<S: Simd>(normal: V3<S>, spot: Spot<S>, up: V3<S>) -> Touch<S> {
    Touch {
        normal,
        tangents: tangents(normal, up),
        spots: [spot; 4],
        count: 1,
        gap: spot.gap,
    }
}

/// Distance of a point from a part and the direction from the part to it.
#[inline(always)]
fn ball_apart<S: Simd>(simd: S, part: &Shape, at: V3<S>) -> (F<S>, V3<S>) {
    match part {
        Shape::Ball(radius) => ((at.norm2() + 1e-20).sqrt() - *radius, at.unit()),
        Shape::Box(h) => {
            let beyond = V3::new(at.x.abs() - h[0], at.y.abs() - h[1], at.z.abs() - h[2]);
            rounded(at, beyond)
        }
        Shape::Cylinder(radius, half) => {
            let out = (at.x * at.x + at.y * at.y + 1e-20).sqrt();
            // The plane through the axis and the point: radial, nothing, along.
            let flat = V3::new(out, F::all(simd, 0.0), at.z);
            let beyond = V3::new(out - *radius, F::all(simd, -1e9), at.z.abs() - *half);
            let (gap, n) = rounded(flat, beyond);
            (gap, V3::new((n.x * at.x).over(out), (n.x * at.y).over(out), n.z))
        }
        Shape::Hull(hull) => polytope_apart(simd, hull, at),
    }
}

/// Signed distance from a box by how far each coordinate lies beyond its half extent.
#[inline(always)]
fn rounded<S: Simd>(at: V3<S>, beyond: V3<S>) -> (F<S>, V3<S>) {
    let (zero, one) = (at.x.like(0.0), at.x.like(1.0));
    let out = V3::new(beyond.x.positive(), beyond.y.positive(), beyond.z.positive());
    let distance = (out.norm2() + 1e-20).sqrt();
    let outside = more(out.norm2(), at.x.like(1e-14));
    let most = beyond.x.max(beyond.y).max(beyond.z);
    let inner = V3::new(
        pick(less(beyond.x, most), zero, one),
        pick(less(beyond.y, most), zero, one),
        pick(less(beyond.z, most), zero, one),
    );
    let n = V3::pick(outside, out * distance.inverse(), inner.unit());
    let n = V3::new(
        pick(less(at.x, zero), -n.x, n.x),
        pick(less(at.y, zero), -n.y, n.y),
        pick(less(at.z, zero), -n.z, n.z),
    );
    (pick(outside, distance, most), n)
}

/// Signed distance of a point from a hull, and the direction from the hull to the point.
#[inline(always)]
fn polytope_apart<S: Simd>(simd: S, hull: &Polytope, at: V3<S>) -> (F<S>, V3<S>) {
    let mut apart = Apart::none(simd);
    for (n, d) in &hull.planes {
        let n = V3::all(simd, *n);
        apart.offer(n.dot(at) - *d, n);
    }
    if more(apart.gap, F::all(simd, 0.0)).any() {
        let mut nearest = F::all(simd, 1e30);
        let mut away = V3::zero(simd);
        for (a, b) in &hull.edges {
            let d = at - nearest_on(simd, *a, *b, at);
            let closer = less(d.norm2(), nearest);
            nearest = pick(closer, d.norm2(), nearest);
            away = V3::pick(closer, d, away);
        }
        let n = away.unit();
        let mut support = F::all(simd, -1e30);
        for p in &hull.points {
            support = support.max(n.dot(V3::all(simd, *p)));
        }
        apart.offer(n.dot(at) - support, n);
    }
    (apart.gap, apart.normal)
}

/// The point of the edge from `a` to `b` that is nearest to `at`.
#[inline(always)]
fn nearest_on<S: Simd>(simd: S, a: [f32; 3], b: [f32; 3], at: V3<S>) -> V3<S> {
    let along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let scale = 1.0 / (along[0] * along[0] + along[1] * along[1] + along[2] * along[2] + 1e-20);
    let (a, along) = (V3::all(simd, a), V3::all(simd, along));
    let share = (at - a).dot(along) * scale;
    a + along * share.positive().min(share.like(1.0))
}

#[inline(always)]
fn axis<S: Simd>(simd: S, k: usize, sign: f32) -> V3<S> {
    let mut v = [0.0; 3];
    v[k] = sign;
    V3::all(simd, v)
}

/// The direction from the part to the thing in which they are farthest apart.
#[inline(always)]
fn separation<S: Simd>(simd: S, part: &Shape, solid: &Solid, turn: &M3<S>, at: V3<S>, corners: &[V3<S>]) -> Apart<S> {
    let mut best = Apart::none(simd);
    let mut low = V3::all(simd, [1e30; 3]);
    let mut high = V3::all(simd, [-1e30; 3]);
    for u in corners {
        low = V3::new(low.x.min(u.x), low.y.min(u.y), low.z.min(u.z));
        high = V3::new(high.x.max(u.x), high.y.max(u.y), high.z.max(u.z));
    }
    match part {
        Shape::Ball(_) => {}
        Shape::Box(h) => {
            best.offer(low.x - h[0], axis(simd, 0, 1.0));
            best.offer(-high.x - h[0], axis(simd, 0, -1.0));
            best.offer(low.y - h[1], axis(simd, 1, 1.0));
            best.offer(-high.y - h[1], axis(simd, 1, -1.0));
            best.offer(low.z - h[2], axis(simd, 2, 1.0));
            best.offer(-high.z - h[2], axis(simd, 2, -1.0));
        }
        Shape::Cylinder(radius, half) => {
            best.offer(low.z - *half, axis(simd, 2, 1.0));
            best.offer(-high.z - *half, axis(simd, 2, -1.0));
            let n = lateral(simd, solid, turn, at);
            best.offer(least_along(simd, corners, n) - *radius, n);
        }
        Shape::Hull(tool) => {
            for (n, d) in &tool.planes {
                let n = V3::all(simd, *n);
                best.offer(least_along(simd, corners, n) - *d, n);
            }
        }
    }
    // A part reaches at least as far as its narrowest half extent, whatever the direction.
    let narrow = part.narrowest();
    let middle = turn.apply_transposed(at);
    for (n, d) in &solid.hull.planes {
        let n = V3::all(simd, *n);
        if !more(-n.dot(middle) - (*d + narrow), best.gap).any() {
            continue;
        }
        let m = turn.apply(n);
        best.offer(-support(simd, part, -m) - *d - m.dot(at), -m);
    }
    best
}

#[inline(always)]
fn least_along<S: Simd>(simd: S, corners: &[V3<S>], n: V3<S>) -> F<S> {
    let mut least = F::all(simd, 1e30);
    for u in corners {
        least = least.min(u.dot(n));
    }
    least
}

/// From a cylinder's axis, across it, to the nearest edge of the thing as seen along the axis.
#[inline(always)]
fn lateral<S: Simd>(simd: S, solid: &Solid, turn: &M3<S>, at: V3<S>) -> V3<S> {
    let mut nearest = F::all(simd, 1e30);
    let zero = F::all(simd, 0.0);
    let mut towards = V3::zero(simd);
    for (a, b) in &solid.hull.edges {
        let (a, b) = (V3::all(simd, *a), V3::all(simd, *b));
        let (ax, ay) = (turn.a.dot(a) + at.x, turn.b.dot(a) + at.y);
        let (ex, ey) = (turn.a.dot(b) + at.x - ax, turn.b.dot(b) + at.y - ay);
        let share = (-(ax * ex + ay * ey)).over(ex * ex + ey * ey + 1e-20);
        let share = share.positive().min(share.like(1.0));
        let (qx, qy) = (ax + ex * share, ay + ey * share);
        let away = qx * qx + qy * qy;
        let closer = less(away, nearest);
        nearest = pick(closer, away, nearest);
        towards = V3::pick(closer, V3::new(qx, qy, zero), towards);
    }
    towards.unit()
}

/// How far a part reaches along `n`.
#[inline(always)]
fn support<S: Simd>(simd: S, part: &Shape, n: V3<S>) -> F<S> {
    match part {
        Shape::Ball(radius) => F::all(simd, *radius),
        Shape::Box(h) => n.x.abs() * h[0] + n.y.abs() * h[1] + n.z.abs() * h[2],
        Shape::Cylinder(radius, half) => (n.x * n.x + n.y * n.y).sqrt() * *radius + n.z.abs() * *half,
        Shape::Hull(hull) => {
            let mut most = F::all(simd, -1e30);
            for p in &hull.points {
                most = most.max(n.dot(V3::all(simd, *p)));
            }
            most
        }
    }
}

#[inline(always)]
fn face_spots<S: Simd>(simd: S, part: &Shape, apart: Apart<S>, up: V3<S>, corners: &mut Corners<S>) -> Touch<S> {
    let n = apart.normal;
    let t = tangents(n, up);
    let (_, body) = extents(simd, &corners.thing, -n, &t);
    part_corners(simd, part, n, &mut corners.part);
    let (level, tool) = extents(simd, &corners.part, n, &t);
    Touch {
        normal: n,
        tangents: t,
        spots: face(&body, &tool, apart.gap, level, n, &t),
        count: 4,
        gap: apart.gap,
    }
}

/// Corners of a part; of a cylinder those that lie towards `n`.
#[inline(always)]
fn part_corners<S: Simd>(simd: S, part: &Shape, n: V3<S>, out: &mut Vec<V3<S>>) {
    out.clear();
    match part {
        Shape::Ball(radius) => out.push(n * *radius),
        Shape::Box(h) => {
            for i in 0..8 {
                let s = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
                out.push(V3::all(simd, [s(1) * h[0], s(2) * h[1], s(4) * h[2]]));
            }
        }
        Shape::Cylinder(radius, half) => {
            let to = V3::new(n.x, n.y, F::all(simd, 0.0)).unit() * *radius;
            let across = V3::new(-to.y, to.x, to.z);
            for p in [to, across, -across, -to] {
                for z in [*half, -*half] {
                    out.push(V3::new(p.x, p.y, F::all(simd, z)));
                }
            }
        }
        Shape::Hull(hull) => {
            for p in &hull.points {
                out.push(V3::all(simd, *p));
            }
        }
    }
}
