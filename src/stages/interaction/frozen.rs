//! Trackers that hold their last pose for a while: rows that repeat the one before to the last digit, where noise lets no two be alike.

use nalgebra::Point3;

use crate::capture::{Capture, PoseStream, position_noise};

/// Fewest rows of a stretch that repeat, and fewest such stretches.
const ROWS: usize = 3;
const STRETCHES: usize = 3;
/// Largest share of the rows: what repeats more often is written down faster than it is read.
const MOST: f64 = 0.4;
/// Noise over the last digit, below which neighbours may be alike by chance.
const FINE: f64 = 5.0;

/// Rows that repeat the one before, in stretches of a few.
fn repeats(track: &PoseStream) -> Vec<Vec<usize>> {
    let same = |i: usize| track.position[i] == track.position[i - 1] && track.rotation[i] == track.rotation[i - 1];
    let mut out: Vec<Vec<usize>> = Vec::new();
    for i in (1..track.len()).filter(|i| same(*i)) {
        match out.last_mut() {
            Some(own) if own.last() == Some(&(i - 1)) => own.push(i),
            _ => out.push(vec![i]),
        }
    }
    out.retain(|own| own.len() >= ROWS);
    out
}

/// The least difference between two neighbours, m.
fn digit(track: &PoseStream) -> f64 {
    let pairs = track.position.windows(2);
    let each = pairs.flat_map(|w| (0..3).map(|k| (w[1][k] - w[0][k]).abs()).collect::<Vec<f64>>());
    each.filter(|d| *d > 1e-12).fold(f64::INFINITY, f64::min)
}

/// How many rows of all tracks repeat the one before for a while, and how many there are.
pub(super) fn frozen_of(capture: &Capture) -> Option<(usize, usize)> {
    let tracks: Vec<&PoseStream> = capture.interactions.iter().flat_map(|i| i.tracks.values()).collect();
    let stretches: Vec<usize> = tracks.iter().flat_map(|t| repeats(t)).map(|own| own.len()).collect();
    let (count, of) = (
        stretches.iter().sum::<usize>(),
        tracks.iter().map(|t| t.len()).sum::<usize>(),
    );
    let noisy = |t: &&&PoseStream| position_noise(&[**t]) > FINE * digit(t);
    // What rests without noise repeats itself from its beginning on.
    let begins = |t: &&&PoseStream| repeats(t).first().is_some_and(|own| own[0] == 1);
    let all_noisy = 2 * tracks.iter().filter(noisy).count() > tracks.len();
    let few = stretches.len() >= STRETCHES && (count as f64) < MOST * of as f64;
    (few && all_noisy && 4 * tracks.iter().filter(begins).count() < tracks.len()).then_some((count, of))
}

/// Leaves out what only repeats.
pub(super) fn thaw(track: &mut PoseStream) {
    for i in repeats(track).into_iter().flatten() {
        track.position[i] = Point3::new(f64::NAN, f64::NAN, f64::NAN);
        track.rotation[i] = None;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    /// A thing that moves at 20 mm/s, read with some noise; every two hundred rows the tracker stands still for twelve.
    fn track(noise: f64, stands: bool) -> PoseStream {
        let mut out = PoseStream::default();
        for i in 0..1000_u32 {
            let t = 0.01 * f64::from(i);
            let x = 0.02 * (t - 2.0).clamp(0.0, 4.0) + noise * (f64::from(i) * 12.9898).sin();
            let held = stands && i % 200 > 180 && i % 200 < 193;
            let last = out.position.last().copied().filter(|_| held);
            out.time.push(t);
            out.position
                .push(last.unwrap_or_else(|| Point3::new((x * 1e7).round() * 1e-7, 0.0, 0.0)));
            out.rotation.push(Some(UnitQuaternion::identity()));
        }
        out
    }

    #[test]
    fn a_tracker_that_stands_still_is_told_from_a_thing_that_rests() {
        let told = |noise: f64, stands: bool| repeats(&track(noise, stands)).iter().map(Vec::len).sum::<usize>();
        assert_eq!(told(2e-4, true), 5 * 12);
        assert_eq!(told(2e-4, false), 0);
        let mut thawed = track(2e-4, true);
        thaw(&mut thawed);
        assert_eq!(thawed.position.iter().filter(|p| p.x.is_nan()).count(), 60);
        // Without noise all that rests repeats, from its beginning on.
        assert_eq!(repeats(&track(0.0, false))[0][0], 1);
    }
}
