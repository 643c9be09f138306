//! Whether a tracked thing stood still all through an interaction. What stands has no velocity: differences of its
//! track are noise alone, and would pass for motion of what hangs on it.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::capture::PoseStream;
use crate::math::median;

/// Stretches whose means are compared, and the least rows of one.
const STRETCHES: usize = 10;
const FEWEST: usize = 4;
/// A mean farther off than this many of its standard deviations, and than so many m and rad, is a motion.
const FAR: f64 = 4.5;
const SLACK: (f64, f64) = (5e-5, 2e-4);

/// The mean pose of a track that does not move beyond its noise; `None` where it moves, or too little of it was read.
pub(super) fn standing(track: &PoseStream) -> Option<Isometry3<f64>> {
    let first = track.rotation.iter().flatten().next().copied()?;
    let rows: Vec<[f64; 6]> = (0..track.len())
        .filter_map(|i| {
            let p = track.position[i];
            let r = (track.rotation[i]? * first.inverse()).scaled_axis();
            let row = [p.x, p.y, p.z, r.x, r.y, r.z];
            row.iter().all(|x| x.is_finite()).then_some(row)
        })
        .collect();
    let size = rows.len() / STRETCHES;
    if size < FEWEST {
        return None;
    }
    let mut middle = [0.0; 6];
    for (k, mean) in middle.iter_mut().enumerate() {
        let values: Vec<f64> = rows.iter().map(|r| r[k]).collect();
        *mean = values.iter().sum::<f64>() / values.len() as f64;
        let slack = if k < 3 { SLACK.0 } else { SLACK.1 };
        let off = FAR * noise(&values)? / (size as f64).sqrt() + slack;
        let still = |part: &[f64]| (part.iter().sum::<f64>() / part.len() as f64 - *mean).abs() < off;
        if !values.chunks_exact(size).all(still) {
            return None;
        }
    }
    let [x, y, z, a, b, c] = middle;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)) * first;
    Some(Isometry3::from_parts(Vector3::new(x, y, z).into(), turn))
}

/// White noise from second differences.
fn noise(values: &[f64]) -> Option<f64> {
    let second: Vec<f64> = values.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    Some(1.4826 * median(&second)? / 6f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};
    use nalgebra::Point3;
    use rand::Rng;

    fn track(moves: f64, turns: f64) -> PoseStream {
        let mut dice = rng_for(Seed(3), "standing");
        let mut shake = |size: f64| -> Vector3<f64> { Vector3::from_fn(|_, _| size * dice.random_range(-1.7..1.7)) };
        let share = |i: usize| i as f64 / 400.0;
        PoseStream {
            time: (0..400).map(|i| 0.01 * i as f64).collect(),
            position: (0..400)
                .map(|i| Point3::from(Vector3::new(0.3, 0.1 + moves * share(i), 0.2) + shake(1e-3)))
                .collect(),
            rotation: (0..400)
                .map(|i| {
                    Some(UnitQuaternion::from_scaled_axis(
                        Vector3::z() * (1.0 + turns * share(i)) + shake(8e-3),
                    ))
                })
                .collect(),
        }
    }

    #[test]
    fn noise_is_no_motion_and_a_slow_motion_is_one() {
        let stands = standing(&track(0.0, 0.0)).expect("it stands");
        assert!((stands.translation.vector - Vector3::new(0.3, 0.1, 0.2)).norm() < 3e-4);
        assert!((stands.rotation.angle() - 1.0).abs() < 3e-3);
        assert!(standing(&track(2.5e-3, 0.0)).is_none());
        assert!(standing(&track(0.0, 0.02)).is_none());
    }
}
