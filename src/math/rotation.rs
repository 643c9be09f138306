//! Averages of rotations and the centre about which points were turned.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Point3, UnitQuaternion, Vector3};

use super::bayesian_linear;

/// The mean rotation: the eigenvector of the largest eigenvalue of `Σ q qᵀ` (Markley et al. 2007).
pub fn mean_rotation<'a>(rotations: impl IntoIterator<Item = &'a UnitQuaternion<f64>>) -> Option<UnitQuaternion<f64>> {
    let mut sum = Matrix4::zeros();
    let mut any = false;
    for q in rotations {
        sum += q.coords * q.coords.transpose();
        any = true;
    }
    if !any {
        return None;
    }
    let eigen = sum.symmetric_eigen();
    let best = eigen.eigenvalues.imax();
    let v = eigen.eigenvectors.column(best);
    Some(UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
        v[3], v[0], v[1], v[2],
    )))
}

/// The point `h` about which `start` was turned to reach the measured points, `p = h + R (start - h)`, from
/// rotations and points, with a weak prior at `guess` (`guess_sd`, m) for what the rotations leave open.
/// `noise` is the standard deviation of a point per axis, m.
pub fn rotation_centre(
    turns: &[UnitQuaternion<f64>],
    points: &[Point3<f64>],
    start: &Point3<f64>,
    noise: f64,
    guess: &Point3<f64>,
    guess_sd: f64,
) -> Option<Point3<f64>> {
    let rows = 3 * turns.len();
    let mut a = DMatrix::zeros(rows, 3);
    let mut b = DVector::zeros(rows);
    for (i, (turn, p)) in turns.iter().zip(points).enumerate() {
        let block: Matrix3<f64> = Matrix3::identity() - turn.to_rotation_matrix().into_inner();
        a.view_mut((3 * i, 0), (3, 3)).copy_from(&block);
        let side: Vector3<f64> = p.coords - turn * start.coords;
        b.rows_mut(3 * i, 3).copy_from(&side);
    }
    let weights = DVector::from_element(rows, noise.max(1e-9).powi(-2));
    let prior = DVector::from_column_slice(guess.coords.as_slice());
    let fit = bayesian_linear(&a, &b, &weights, &prior, &DVector::from_element(3, guess_sd))?;
    Some(Point3::new(fit.x[0], fit.x[1], fit.x[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hinge_of_a_turned_board_is_found() {
        let hinge = Point3::new(-0.2, 0.0, 0.05);
        let start = Point3::new(0.1, 0.02, 0.03);
        let turns: Vec<_> = (1..60)
            .map(|i| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.005 * i as f64))
            .collect();
        let points: Vec<_> = turns.iter().map(|t| hinge + t * (start - hinge)).collect();
        let found = rotation_centre(&turns, &points, &start, 1e-4, &Point3::origin(), 0.3).expect("solvable");
        assert!((found.xz() - hinge.xz()).norm() < 1e-3, "{found}");
    }

    #[test]
    fn opposite_quaternions_are_one_rotation() {
        let q = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
        let minus = UnitQuaternion::new_unchecked(-q.into_inner());
        let mean = mean_rotation([&q, &minus]).expect("two");
        assert!(mean.angle_to(&q) < 1e-7);
    }
}
