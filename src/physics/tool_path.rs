//! The way of a tool in the plane of the support, in even steps.

use nalgebra::{Point2, Vector2};

use super::{Action, Stance};
use crate::math::median;

/// Seconds of one step of the simulation; the tool's path is fitted over four.
pub(super) const STEP: f64 = 0.01;

/// Readings to either side over which it is fitted at least.
const ROWS: f64 = 1.05;

/// The tool's way in the plane, one point a step, on a line through four steps against encoder noise.
pub(super) fn smooth_path(action: &Action, stance: &Stance) -> Vec<(f64, Point2<f64>)> {
    let time = &action.tool.time;
    let flat: Vec<Point2<f64>> = action.tool.position.iter().map(|p| stance.flatten(p)).collect();
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Vec::new();
    };
    let steps = ((last - first) / STEP) as usize;
    // One reading alone tells no way: a path that is read more coarsely than that would go in jumps.
    let apart = median(&time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>()).unwrap_or(0.0);
    let reach = (2.0 * STEP).max(ROWS * apart);
    let mut path = Vec::with_capacity(steps + 1);
    for k in 0..=steps {
        let t = first + k as f64 * STEP;
        let from = time.partition_point(|x| *x < t - reach);
        let to = time.partition_point(|x| *x <= t + reach).max(from + 1).min(time.len());
        let from = from.min(to - 1);
        path.extend(on_line(&time[from..to], &flat[from..to], t).map(|p| (t, p)));
    }
    path
}

/// The point at `t` of the line that fits the finite ones best: a window of readings reaches further on one side than on the other.
fn on_line(time: &[f64], points: &[Point2<f64>], t: f64) -> Option<Point2<f64>> {
    let finite = || {
        let all = time.iter().zip(points);
        all.filter(|(_, p)| p.x.is_finite() && p.y.is_finite())
    };
    let count = finite().count() as f64;
    if count == 0.0 {
        return None;
    }
    let middle = finite().map(|(x, _)| x).sum::<f64>() / count;
    let mean = finite().map(|(_, p)| p.coords).sum::<Vector2<f64>>() / count;
    let spread: f64 = finite().map(|(x, _)| (x - middle).powi(2)).sum();
    let slope = finite()
        .map(|(x, p)| (p.coords - mean) * (x - middle))
        .sum::<Vector2<f64>>();
    let slope = if spread > 0.0 { slope / spread } else { Vector2::zeros() };
    Some(Point2::from(mean + slope * (t - middle)))
}

/// The path with each of its steps in so many equal parts.
pub(super) fn divided(path: Vec<(f64, Point2<f64>)>, parts: usize) -> Vec<(f64, Point2<f64>)> {
    let mut out: Vec<(f64, Point2<f64>)> = path.first().copied().into_iter().collect();
    for pair in path.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let at = |k: usize| {
            let share = k as f64 / parts as f64;
            (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share)
        };
        out.extend((1..parts).map(at).chain([to]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_that_reaches_further_on_one_side_moves_nothing() {
        let time = [0.0, 0.01, 0.02, 0.03];
        let mut points = time.map(|t| Point2::new(0.1 + 0.5 * t, -0.2 * t));
        let at = on_line(&time, &points, 0.01).expect("a point");
        assert!((at - Point2::new(0.105, -0.002)).norm() < 1e-12);
        // What was not read is left out; one point alone stands for itself.
        points[3].x = f64::NAN;
        assert!((on_line(&time, &points, 0.02).expect("a point") - points[2]).norm() < 1e-12);
        assert_eq!(on_line(&time[..1], &points[..1], 0.3), Some(points[0]));
        assert!(on_line(&time[3..], &points[3..], 0.0).is_none());
    }

    #[test]
    fn a_path_read_at_thirty_hertz_goes_on_evenly() {
        let (model, mut action) = super::super::push::tests::pushed(0.3);
        action.tool.time = (0..60).map(|k| f64::from(k) / 30.0).collect();
        let place = |t: &f64| nalgebra::Point3::new(-0.06 + 0.03 * t, 0.015, 0.03);
        action.tool.position = action.tool.time.iter().map(place).collect();
        let body = &model.twin.bodies[0];
        let stance = Stance::of(&model, body, &action.start, &action.normal.into_inner(), 0.03).expect("a stance");
        let path = smooth_path(&action, &stance);
        let steps: Vec<f64> = path.windows(2).map(|w| (w[1].1 - w[0].1).norm()).collect();
        assert!(
            path.len() > 190 && steps.iter().all(|s| (s - 0.03 * STEP).abs() < 1e-9),
            "{steps:?}"
        );
    }
}
