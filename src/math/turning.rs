//! Points carried by a plane that turns: what they do relative to it.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::{interpolate, median, rotation_centre};

/// The motion of points relative to a turning plane.
#[derive(Clone, Debug)]
pub struct Turned {
    /// Rotation of the plane since the start, one per point.
    pub turn: Vec<UnitQuaternion<f64>>,
    /// Displacement since the start, seen in the plane as it stood at the start, m; NaN where missing.
    pub displacement: Vec<Vector3<f64>>,
    /// A point of the axis about which the plane turns.
    pub hinge: Point3<f64>,
}

impl Turned {
    /// The steepest way down, a unit vector in the plane as it stood at the start, when it was turned farthest: it may have been turned
    /// back since. `normal` is that of the start.
    pub fn downhill(&self, normal: &Vector3<f64>, gravity: &Vector3<f64>) -> Option<Vector3<f64>> {
        let farthest = self.turn.iter().max_by(|a, b| a.angle().total_cmp(&b.angle()))?;
        let steep = farthest * normal;
        let down = (gravity - steep * gravity.dot(&steep)).try_normalize(1e-9)?;
        Some(farthest.inverse() * down)
    }
}

/// The shortest rotation that takes the first normal to each normal, at the times of the points.
fn turns(normal_times: &[f64], normals: &[Vector3<f64>], times: &[f64]) -> Option<Vec<UnitQuaternion<f64>>> {
    let axes: Vec<Vec<f64>> = (0..3).map(|k| normals.iter().map(|n| n[k]).collect()).collect();
    let first = *normals.first()?;
    let (start, end) = (*normal_times.first()?, *normal_times.last()?);
    times
        .iter()
        .map(|t| {
            let t = t.clamp(start, end);
            let n = Vector3::new(
                interpolate(normal_times, &axes[0], t)?,
                interpolate(normal_times, &axes[1], t)?,
                interpolate(normal_times, &axes[2], t)?,
            );
            UnitQuaternion::rotation_between(&first, &n)
        })
        .collect()
}

/// Motion of `points` relative to a plane whose normal is given over time. The axis of the turn is found from
/// the points themselves while they ride along without sliding; `guess` stands in for what they leave open.
/// `noise` is the standard deviation of a point per axis, m.
pub fn turned_displacement(
    normal_times: &[f64],
    normals: &[Vector3<f64>],
    times: &[f64],
    points: &[Point3<f64>],
    noise: f64,
    guess: &Point3<f64>,
) -> Option<Turned> {
    let turn = turns(normal_times, normals, times)?;
    let finite: Vec<usize> = (0..points.len())
        .filter(|&i| points[i].coords.iter().all(|x| x.is_finite()))
        .collect();
    // Before it turns: a support that is turned back is level again with all that slid somewhere else.
    let level = |i: &usize| turn[*i].angle() < 2e-3;
    let still: Vec<usize> = finite.iter().copied().take_while(level).collect();
    let start_rows = if still.len() >= 3 { &still[..] } else { finite.get(..3)? };
    let axis = |k: usize| median(&start_rows.iter().map(|&i| points[i][k]).collect::<Vec<_>>());
    let start = Point3::new(axis(0)?, axis(1)?, axis(2)?);
    let centre = |rows: &[usize]| {
        let (q, p): (Vec<_>, Vec<_>) = rows.iter().map(|&i| (turn[i], points[i])).unzip();
        rotation_centre(&q, &p, &start, noise, guess, 1.0)
    };
    // The longest leading stretch that a pure rotation explains: points that ride along without sliding.
    let mut rows = finite.clone();
    let mut hinge = centre(&rows)?;
    for _ in 0..12 {
        let misfit: Vec<f64> = rows
            .iter()
            .map(|&i| (points[i] - (hinge + turn[i] * (start - hinge))).norm())
            .collect();
        let tail = &misfit[misfit.len() - (misfit.len() / 8).max(3).min(misfit.len())..];
        if median(tail)? < 2.5 * noise.max(1e-6) {
            break;
        }
        rows.truncate((rows.len() * 7 / 8).max(3));
        hinge = centre(&rows)?;
    }
    let displacement = (0..points.len())
        .map(|i| turn[i].inverse() * (points[i] - hinge) - (start - hinge))
        .collect();
    Some(Turned {
        turn,
        displacement,
        hinge,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn downhill_is_where_the_plane_was_steepest_though_it_was_turned_back() {
        let time: Vec<f64> = (0..60).map(|i| 0.1 * f64::from(i)).collect();
        let tilt = |i: i32| 0.3 * (1.0 - (f64::from(i) - 35.0).abs() / 25.0).max(0.0);
        let normals: Vec<Vector3<f64>> = (0..60)
            .map(|i| Vector3::new(0.0, tilt(i).sin(), tilt(i).cos()))
            .collect();
        let hinge = Point3::new(0.0, 0.1, 0.0);
        let points: Vec<Point3<f64>> = (0..60)
            .map(|i| hinge + UnitQuaternion::from_scaled_axis(Vector3::x() * -tilt(i)) * Vector3::new(0.02, -0.1, 0.0))
            .collect();
        let turned =
            turned_displacement(&time, &normals, &time, &points, 1e-4, &Point3::origin()).expect("all is seen");
        let down = turned
            .downhill(&normals[0], &(-9.81 * Vector3::z()))
            .expect("it was tilted");
        assert!((down - Vector3::y()).norm() < 1e-9, "{down}");
        assert!(turned.displacement.iter().all(|d| d.norm() < 1e-4));
    }

    #[test]
    fn what_slid_before_the_plane_was_turned_back_did_not_begin_where_it_ended() {
        let time: Vec<f64> = (0..120).map(|i| 0.1 * f64::from(i)).collect();
        let tilt = |i: i32| 0.3 * (1.0 - (f64::from(i) - 35.0).abs() / 25.0).max(0.0);
        let slid = |i: i32| 0.3 * ((f64::from(i) - 30.0) / 15.0).clamp(0.0, 1.0);
        let turn = |i: i32| UnitQuaternion::from_scaled_axis(Vector3::x() * -tilt(i));
        let normals: Vec<Vector3<f64>> = (0..120).map(|i| turn(i) * Vector3::z()).collect();
        let hinge = Point3::new(0.4, -0.2, 0.7);
        let points: Vec<Point3<f64>> = (0..120)
            .map(|i| hinge + turn(i) * Vector3::new(0.02, slid(i), 0.02))
            .collect();
        let turned = turned_displacement(&time, &normals, &time, &points, 1e-4, &hinge).expect("all is seen");
        assert!(turned.displacement[0].norm() < 1e-3, "{}", turned.displacement[0]);
        assert!(
            (turned.displacement[119].y - 0.3).abs() < 2e-3,
            "{}",
            turned.displacement[119]
        );
    }
}
