//! A plane between what moves and what does not, for those sides of a thing that no image shows.

use nalgebra::{Matrix4, Point3, Vector4};

/// Newton steps.
const STEPS: usize = 30;
/// Pull of the weights to zero, which a separable sample would drive to infinity.
const RIDGE: f64 = 1e-3;
/// Unit of length in which the plane is sought, m.
const UNIT: f64 = 0.01;
/// Share of the points of either side that the plane must tell right.
const LEAST_RIGHT: f64 = 0.9;

/// On which side of the best plane each point lies, `true` where what moves is; `evidence` is positive where a point
/// was seen to move, negative where it was seen to stay, 0 where nothing is known. Logistic regression by Newton's
/// method, either side with the same weight. Nothing where no plane parts them.
pub fn plane_between(points: &[Point3<f64>], evidence: &[f64]) -> Option<Vec<bool>> {
    let known = || (0..points.len()).filter(|i| evidence[*i] != 0.0);
    let count = |side: bool| known().filter(|i| (evidence[*i] > 0.0) == side).count() as f64;
    let (still, moved) = (count(false), count(true));
    if still == 0.0 || moved == 0.0 {
        return None;
    }
    let middle = known().map(|i| points[i].coords).sum::<nalgebra::Vector3<f64>>() / (still + moved);
    let feature = |i: usize| ((points[i].coords - middle) / UNIT).push(1.0);
    let mut plane = Vector4::zeros();
    for _ in 0..STEPS {
        let (mut slope, mut bend): (Vector4<f64>, _) = (-RIDGE * plane, Matrix4::identity() * RIDGE);
        for i in known() {
            let (x, moves) = (feature(i), evidence[i] > 0.0);
            let weight = if moves { 1.0 / moved } else { 1.0 / still };
            let chance = 1.0 / (1.0 + (-plane.dot(&x)).exp());
            slope += x * (weight * (f64::from(u8::from(moves)) - chance));
            bend.ger(weight * chance * (1.0 - chance), &x, &x, 1.0);
        }
        plane += bend.cholesky()?.solve(&slope);
    }
    let sides: Vec<bool> = (0..points.len()).map(|i| plane.dot(&feature(i)) > 0.0).collect();
    let right = |side: bool| {
        known()
            .filter(|i| sides[*i] == side && (evidence[*i] > 0.0) == side)
            .count() as f64
    };
    (right(false) >= LEAST_RIGHT * still && right(true) >= LEAST_RIGHT * moved).then_some(sides)
}

#[cfg(test)]
mod tests {
    use super::plane_between;
    use nalgebra::Point3;

    #[test]
    fn a_slab_on_a_block_is_parted_by_a_plane_and_a_plate_in_a_frame_by_none() {
        let grid = |n: i32| (0..n * n).map(move |i| (f64::from(i % n) / 200.0, f64::from(i / n) / 200.0));
        let wall: Vec<Point3<f64>> = grid(12).map(|(x, z)| Point3::new(x, 0.0, z)).collect();
        // The last three columns were not seen.
        let seen = |p: &Point3<f64>| if p.x > 0.042 { 0.0 } else { p.z - 0.0426 };
        let evidence: Vec<f64> = wall.iter().map(seen).collect();
        let sides = plane_between(&wall, &evidence).expect("a plane");
        assert!(wall.iter().zip(&sides).all(|(p, side)| (p.z > 0.0426) == *side));
        let framed = |p: &Point3<f64>| {
            if (p.x - 0.03).abs().max((p.z - 0.03).abs()) < 0.02 {
                1.0
            } else {
                -1.0
            }
        };
        assert!(plane_between(&wall, &wall.iter().map(framed).collect::<Vec<_>>()).is_none());
    }
}
