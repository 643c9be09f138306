//! Matrices and turns over SIMD lanes.

use nalgebra::UnitQuaternion;
use pulp::Simd;

use super::lanes::{F, V3};

/// Three rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct M3<S: Simd> {
    pub a: V3<S>,
    pub b: V3<S>,
    pub c: V3<S>,
}

impl<S: Simd> M3<S> {
    #[inline(always)]
    pub(super) fn apply(&self, v: V3<S>) -> V3<S> {
        V3::new(self.a.dot(v), self.b.dot(v), self.c.dot(v))
    }

    #[inline(always)]
    pub(super) fn apply_transposed(&self, v: V3<S>) -> V3<S> {
        self.a * v.x + self.b * v.y + self.c * v.z
    }

    /// `self^T * o`.
    #[inline(always)]
    pub(super) fn transposed_times(&self, o: &Self) -> Self {
        Self {
            a: o.a * self.a.x + o.b * self.b.x + o.c * self.c.x,
            b: o.a * self.a.y + o.b * self.b.y + o.c * self.c.y,
            c: o.a * self.a.z + o.b * self.b.z + o.c * self.c.z,
        }
    }

    /// `R diag(d) R^T` of a rotation `R`.
    #[inline(always)]
    pub(super) fn turned_diagonal(&self, d: [f32; 3]) -> Self {
        let scaled = |r: V3<S>| V3::new(r.x * d[0], r.y * d[1], r.z * d[2]);
        let (a, b, c) = (scaled(self.a), scaled(self.b), scaled(self.c));
        let (ab, ac, bc) = (a.dot(self.b), a.dot(self.c), b.dot(self.c));
        Self {
            a: V3::new(a.dot(self.a), ab, ac),
            b: V3::new(ab, b.dot(self.b), bc),
            c: V3::new(ac, bc, c.dot(self.c)),
        }
    }
}

/// A unit quaternion of each trial, scalar first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn<S: Simd> {
    pub w: F<S>,
    pub v: V3<S>,
}

impl<S: Simd> Turn<S> {
    #[inline(always)]
    pub(super) fn each(simd: S, turns: &[UnitQuaternion<f64>]) -> Self {
        Self {
            w: F::each(simd, |k| turns[k].w as f32),
            v: V3::each(simd, |k| [turns[k].i as f32, turns[k].j as f32, turns[k].k as f32]),
        }
    }

    #[inline(always)]
    pub(super) fn matrix(&self) -> M3<S> {
        let (w, V3 { x, y, z }) = (self.w, self.v);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, yy, zz) = (x * x2, y * y2, z * z2);
        let (xy, xz, yz) = (x * y2, x * z2, y * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let one = w.like(1.0);
        M3 {
            a: V3::new(one - yy - zz, xy - wz, xz + wy),
            b: V3::new(xy + wz, one - xx - zz, yz - wx),
            c: V3::new(xz - wy, yz + wx, one - xx - yy),
        }
    }

    /// After turning with the angular velocity `w` (world axes) for `h`.
    #[inline(always)]
    pub(super) fn advanced(&self, w: V3<S>, h: f32) -> Self {
        let d = w * (h * 0.5);
        let turned = Self {
            w: self.w - d.dot(self.v),
            v: self.v + d * self.w + d.cross(self.v),
        };
        let scale = (turned.w * turned.w + turned.v.norm2()).sqrt().inverse();
        Self {
            w: turned.w * scale,
            v: turned.v * scale,
        }
    }
}
