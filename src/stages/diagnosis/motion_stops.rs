//! The ends of a joint's way: what stands there may rest on a stop, which bears what the tool does not, and pushes back
//! inward only.

use nalgebra::Vector3;

use super::motion_laws::Moved;
use crate::twin::Joint;

/// Sine of a hinge's lean from the vertical, beside twice the doubt of its axis, up to which no weight loads it.
const UPRIGHT: f64 = 0.05;

/// True where a weight can load a hinge: its axis is not upright.
pub fn weighed(joint: &Joint, gravity: &Vector3<f64>) -> bool {
    let (axis, down) = (Vector3::from(joint.axis.value), gravity.try_normalize(1e-9));
    let doubt = joint.axis.sd.map_or(0.0, |sd| sd.iter().copied().fold(0.0, f64::max));
    down.is_some_and(|down| axis.cross(&down).norm() > UPRIGHT + 2.0 * doubt)
}

/// Share of the way, beside three times the noise of a position, within which a joint is at the end of it.
const NEAR: f64 = 0.004;

/// Marks what may rest on a stop: that tells only what it takes to move off it. Of each motion: how many moments its
/// smoothing reaches over, and the noise of its track.
pub fn mark_stops(motions: &mut [Vec<Moved>], spans: impl Iterator<Item = (usize, f64)>) {
    let places = || motions.iter().flatten().map(|m| m.position);
    let ends = [
        places().fold(f64::INFINITY, f64::min),
        places().fold(f64::NEG_INFINITY, f64::max),
    ];
    for (moments, (reach, jitter)) in motions.iter_mut().zip(spans) {
        let found = stops(moments, ends, jitter, reach);
        moments.iter_mut().zip(found).for_each(|(m, stop)| m.stop = stop);
    }
}

/// Which way a stop may push, moment by moment: 1 where the joint stands at the lowest place that it came to, -1 at the
/// highest, 0 elsewhere. Within `reach` moments of standing there the smoothed speed still holds the stop's blow.
fn stops(moments: &[Moved], [low, high]: [f64; 2], jitter: f64, reach: usize) -> Vec<f64> {
    let near = (NEAR * (high - low)).max(3.0 * jitter).min(0.05 * (high - low));
    let end = |m: &Moved| match (m.position < low + near, m.position > high - near) {
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ => 0.0,
    };
    let stands: Vec<f64> = moments.iter().map(|m| if m.still { end(m) } else { 0.0 }).collect();
    let one = |i: usize| {
        if stands[i] != 0.0 {
            return stands[i];
        }
        let about = &stands[i.saturating_sub(reach)..(i + reach + 1).min(stands.len())];
        about.iter().copied().find(|s| *s != 0.0).unwrap_or(0.0)
    };
    (0..moments.len()).map(one).collect()
}

/// The load that is foretold where a stop may bear a part of what was `left` of the measured one: no more than the joint
/// takes to be moved off a lower stop, no less than it takes off an upper one.
pub fn beside_a_stop(stop: f64, foretold: f64, left: f64) -> f64 {
    if stop > 0.0 {
        left.min(foretold)
    } else if stop < 0.0 {
        left.max(foretold)
    } else {
        foretold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(position: f64, still: bool) -> Moved {
        Moved {
            time: 0.0,
            position,
            speed: 0.0,
            gain: 0.0,
            load: 0.0,
            lever: 1.0,
            slip: 0.0,
            back: 0.0,
            turned_back: false,
            began: None,
            still,
            stop: 0.0,
        }
    }

    #[test]
    fn a_stop_is_where_it_stands_at_an_end_and_pushes_inward_only() {
        let way = [(0.0, true), (0.001, true), (0.3, false), (0.6, true), (0.999, true)];
        let moments: Vec<Moved> = way.iter().map(|(q, s)| at(*q, *s)).collect();
        assert_eq!(stops(&moments, [0.0, 1.0], 0.001, 0), [1.0, 1.0, 0.0, 0.0, -1.0]);
        assert_eq!(stops(&moments, [0.0, 1.0], 0.001, 1), [1.0, 1.0, 1.0, -1.0, -1.0]);
        // A lid of 1.2 N·m that the stop holds takes any load up to its own, and not more.
        assert_eq!([0.0, 1.5].map(|load| beside_a_stop(1.0, 1.2, load)), [0.0, 1.2]);
        assert_eq!([-3.0, 0.5].map(|load| beside_a_stop(-1.0, 0.2, load)), [0.2, 0.5]);
        assert_eq!(beside_a_stop(0.0, 0.2, 5.0), 0.2);
    }
}
