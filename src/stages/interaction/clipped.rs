//! A force sensor at the end of its range: no reading is larger than some size, and many stand at it to the last digit.
//!
//! Only a noisy sensor tells it so: what clips after its noise repeats one value, and noise repeats none. One that clips
//! before its noise is told from how its readings come to a stop (`ceiling`).

use nalgebra::{UnitQuaternion, Vector3};

use crate::capture::{Capture, Clipped, Interaction};
use crate::math::mad_sd;

/// Readings that repeat a value, as a share of it.
const SAME: f64 = 1e-6;
/// Fewest readings at the limit, and how many times as many as at any other value in the upper part of the range.
const PROOF: (usize, usize) = (8, 5);
/// The upper part of the range, as a share of the limit.
const UPPER: f64 = 0.3;
/// Other values that readings take at least: fewer are steps.
const VALUES: usize = 20;
/// Readings by which a stream is noisy.
const IDLE: usize = 25;

/// What of a reading is cut off.
#[derive(Clone, Copy, Debug)]
pub(super) enum Along {
    /// A component in the room.
    Room(usize),
    /// A component in the frame of the tool.
    Tool(usize),
    /// Its size.
    Size,
}

impl Along {
    pub const ALL: [Self; 7] = [
        Self::Room(0),
        Self::Room(1),
        Self::Room(2),
        Self::Tool(0),
        Self::Tool(1),
        Self::Tool(2),
        Self::Size,
    ];

    fn of(self, force: &Vector3<f64>, tool: &UnitQuaternion<f64>) -> f64 {
        match self {
            Self::Room(k) => force[k].abs(),
            Self::Tool(k) => tool.inverse_transform_vector(force)[k].abs(),
            Self::Size => force.norm(),
        }
    }

    /// Whether two are axes of one frame, or the same.
    fn beside(self, other: Self) -> bool {
        std::mem::discriminant(&self) == std::mem::discriminant(&other)
    }

    /// Its size in each reading of an interaction, N.
    pub fn stream(self, interaction: &Interaction) -> Vec<f64> {
        let Some(stream) = &interaction.force else {
            return Vec::new();
        };
        let turned = |t: f64| interaction.tool_path.as_ref()?.sample(t)?.1;
        let each = stream.time.iter().zip(&stream.force);
        each.map(|(t, f)| self.of(f, &turned(*t).unwrap_or_default())).collect()
    }
}

/// The limit of the sensor, where the readings prove one.
pub(super) fn clipped_of(capture: &Capture) -> Option<Clipped> {
    if !capture.interactions.iter().any(noisy) {
        return None;
    }
    let found = Along::ALL.into_iter().filter_map(|along| {
        let streams: Vec<Vec<f64>> = capture.interactions.iter().map(|i| along.stream(i)).collect();
        limit_of(&streams).map(|(limit, count)| (count, limit, streams, along))
    });
    let found: Vec<_> = found.collect();
    // The direction that is cut off repeats the most: others do by its leave, but for the other axes of the same sensor.
    let (_, limit, streams, along) = found.iter().max_by_key(|(count, ..)| *count)?;
    let (limit, readings) = (*limit, streams.iter().flatten().filter(|x| x.is_finite()).count());
    let beside: Vec<_> = found
        .iter()
        .filter(|(_, l, _, own)| own.beside(*along) && (l / limit - 1.0).abs() < SAME)
        .collect();
    let at = |k: usize, i: usize| beside.iter().any(|(_, _, s, _)| s[k][i] >= limit * (1.0 - SAME));
    let rows: Vec<Vec<usize>> = (0..streams.len())
        .map(|k| (0..streams[k].len()).filter(|i| at(k, *i)).collect())
        .collect();
    Some(Clipped {
        limit,
        readings,
        sd: 0.0,
        rows,
    })
}

/// A limit that none exceeds and many repeat, with how many do.
fn limit_of(streams: &[Vec<f64>]) -> Option<(f64, usize)> {
    let mut all: Vec<f64> = streams.iter().flatten().copied().filter(|x| x.is_finite()).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    let limit = *all.first().filter(|l| **l > 0.0)?;
    let upper = all.partition_point(|x| *x > UPPER * limit);
    let mut groups = all[..upper].chunk_by(|a, b| a - b <= SAME * limit).map(<[f64]>::len);
    let at = groups.next()?;
    let other = groups.max().unwrap_or(1);
    let values = all.chunk_by(|a, b| a - b <= SAME * limit).count();
    (values > VALUES && at >= PROOF.0 && at >= PROOF.1 * other).then_some((limit, at))
}

/// Whether the readings scatter before anything is touched.
fn noisy(interaction: &Interaction) -> bool {
    let Some(stream) = &interaction.force else {
        return false;
    };
    let steps = |k: usize| -> Vec<f64> {
        let pairs = stream.force.windows(2).take(IDLE);
        pairs.map(|w| w[1][k] - w[0][k]).filter(|d| d.is_finite()).collect()
    };
    (0..3).any(|k| mad_sd(&steps(k)).is_some_and(|s| s > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of a tenth about a slow wave, cut off at `limit`, written to so many digits.
    fn wave(limit: f64, noise: f64, step: f64) -> Vec<f64> {
        let one = |i: i32| {
            let x = f64::from(i);
            let dice = (x * 12.9898).sin() * 43758.5453;
            let read = (0.02 * x).sin() + noise * (dice - dice.floor() - 0.5);
            ((read.clamp(-limit, limit) / step).round() * step).abs()
        };
        (0..900).map(one).collect()
    }

    #[test]
    fn a_range_that_ends_repeats_its_end() {
        let (limit, count) = limit_of(&[wave(0.8, 0.1, 1e-9)]).expect("a limit");
        assert!((limit - 0.8).abs() < 1e-6 && count > 50, "{limit} {count}");
        assert!(limit_of(&[wave(9.0, 0.1, 1e-9)]).is_none());
        // Coarse steps repeat every value.
        assert!(limit_of(&[wave(9.0, 0.1, 0.05)]).is_none());
        assert!(limit_of(&[wave(9.0, 0.1, 0.9)]).is_none());
    }

    #[test]
    fn axes_of_one_sensor_end_together() {
        assert!(Along::Tool(0).beside(Along::Tool(2)) && !Along::Tool(0).beside(Along::Room(0)));
        assert!(Along::Size.beside(Along::Size) && !Along::Size.beside(Along::Room(1)));
    }
}
