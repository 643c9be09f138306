//! What a tool does to a body that it shoves: the rows of a recorded load, and the load between them.

use nalgebra::{Point2, Vector2};

use super::simulator::rows_about;
use crate::math::Real;

/// What the tool does at one time, in the plane.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shove {
    /// s.
    pub time: f64,
    /// N, on the body.
    pub force: Vector2<f64>,
    /// A point on the force's line, m.
    pub at: Point2<f64>,
    /// Moment beside that of the force, N·m.
    pub moment: f64,
    /// Height above the support at which it acts, m.
    pub height: f64,
    /// Force on the body away from the support, N: what the tool carries does not rub.
    pub lift: f64,
}

/// The load at one time.
#[derive(Clone, Copy)]
pub(super) struct Load<T> {
    pub force: Vector2<T>,
    pub at: Vector2<T>,
    pub moment: T,
    pub height: T,
    pub lift: T,
}

/// The load at `t`, between the rows about it; the last row beyond the end.
pub(super) fn load_at<T: Real>(shoves: &[Shove], t: T) -> Load<T> {
    let Some((a, b, share)) = rows_about(shoves, t.value(), |s| s.time) else {
        let none = Vector2::new(T::of(0.0), T::of(0.0));
        return Load {
            force: none,
            at: none,
            moment: T::of(0.0),
            height: T::of(0.0),
            lift: T::of(0.0),
        };
    };
    let span = b.time - a.time;
    let share = if span > 0.0 && (0.0..1.0).contains(&share) {
        (t - a.time) * span.recip()
    } else {
        T::of(share)
    };
    let between = |x: f64, y: f64| share * (y - x) + x;
    Load {
        force: Vector2::new(between(a.force.x, b.force.x), between(a.force.y, b.force.y)),
        at: Vector2::new(between(a.at.x, b.at.x), between(a.at.y, b.at.y)),
        moment: between(a.moment, b.moment),
        height: between(a.height, b.height),
        lift: between(a.lift, b.lift),
    }
}
