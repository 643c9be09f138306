//! A force that swings at one frequency whatever is touched, and where: of a table that shakes, or a sensor that hums.
//!
//! No law of a touch is periodic in time, so that nothing of the catalogue explains it. Spectra of single touches have tops of many
//! kinds; what counts is one frequency that stands out of its neighbourhood in nearly all of them.

use nalgebra::{DMatrix, DVector, Vector3};

use super::sensor::taken_out;
use crate::capture::{Capture, Interaction, Segmented};
use crate::math::{median, quantile, weighted_linear};
use crate::twin::{BaseFit, Evidence, Finding};

/// Frequencies that are tried, Hz, and by how much they differ.
const LOWEST: f64 = 2.0;
const HIGHEST: f64 = 40.0;
const STEP: f64 = 0.1;
/// Seconds of one sample at least, and the share of the sampling rate up to which a frequency shows.
const SAMPLE: f64 = 0.01;
const SHOWS: f64 = 0.4;
/// Share of the usual force from which on something is touched, the time over which that is smoothed, s, and what of a touch its
/// beginning and its end are.
const TOUCHES: f64 = 0.35;
const SMOOTH: f64 = 0.05;
const ENDS: [f64; 2] = [0.2, 0.1];
/// Shortest stretch, s, and fewest samples of it.
const SHORTEST: f64 = 0.5;
const SAMPLES: usize = 40;
/// Factor to either side that is a frequency's neighbourhood, and how near is the same top, in units of the inverse of the time.
const AROUND: f64 = 1.7;
const SAME: f64 = 2.5;
/// Fewest touches, and by how much it stands out in those that count.
const FEWEST: usize = 5;
const STANDS_OUT: f64 = 4.0;
/// Power over that of the neighbourhood, of the middle touch, from which on it is one frequency, with the share of touches in which it
/// stands out: of 900 captures of five engines and of real scenes none in which nothing shakes came to it, but one that sticks and
/// slips.
const CLEAR: [(f64, f64); 2] = [(60.0, 0.75), (100.0, 0.6)];
/// What is left of the odds of a name beside it: a law that swings with it, by chance, is soon found.
const PART: f64 = 0.5;

/// The spectrum of one touch over time or over its way: power by frequency, N², and how much of either it spans, s or m.
pub(super) struct Spectrum {
    pub power: Vec<f64>,
    lasts: f64,
    grid: Grid,
}

/// Frequencies that are tried, evenly, 1/s or 1/m.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub lowest: f64,
    pub highest: f64,
    pub step: f64,
}

const IN_TIME: Grid = Grid {
    lowest: LOWEST,
    highest: HIGHEST,
    step: STEP,
};

impl Grid {
    pub fn at(&self, k: usize) -> f64 {
        self.lowest + self.step * k as f64
    }
}

/// One frequency in nearly all touches.
#[derive(Clone, Debug)]
struct Shaking {
    hertz: f64,
    /// Half of how far it swings, N.
    force: f64,
    /// Power over that of its neighbourhood.
    ratio: f64,
    /// In so many touches of so many.
    touches: [usize; 2],
}

impl Shaking {
    /// As `diagnosis.json` says it.
    fn evidence(&self) -> Evidence {
        let [shaken, all] = self.touches;
        Evidence {
            residual: "force over time".into(),
            test: "power at one frequency over that of its neighbourhood, in the middle touch".into(),
            statistic: self.ratio,
            p_value: (-(shaken as f64) * self.ratio.ln()).exp(),
            words: format!(
                "the force of {shaken} of {all} touches swings by {:.3} N at {:.1} Hz, whatever is touched: something shakes, or \
                 the sensor hums, of which the catalogue knows nothing",
                self.force, self.hertz
            ),
        }
    }
}

/// What shakes, if something does: it is told beside what the plain model leaves, and makes what was named less sure.
pub fn shaken(
    capture: &Capture,
    segmented: &[Segmented],
    (findings, base): (&mut [Finding], &mut BaseFit),
) -> Option<Evidence> {
    let found = shaking(capture, segmented);
    tell_beside(found.as_ref().map(Shaking::evidence), (findings, base))
}

/// Tells of what swings beside what was named, which it makes less sure.
pub(super) fn tell_beside(
    swings: Option<Evidence>,
    (findings, base): (&mut [Finding], &mut BaseFit),
) -> Option<Evidence> {
    let told = findings.iter_mut().filter(|f| swings.is_some() && !taken_out(f));
    told.for_each(|f| f.less_likely(PART));
    base.tests.extend(swings.iter().cloned());
    swings
}

/// Means over `SAMPLE` s of the longest stretch in which something is touched, without these shares of it at its ends.
pub(super) fn stretch(interaction: &Interaction, ends: [f64; 2]) -> Option<(Vec<f64>, Vec<Vector3<f64>>)> {
    let stream = interaction.force.as_ref()?;
    let (mut times, mut forces) = (Vec::new(), Vec::<Vector3<f64>>::new());
    let (mut sum, mut count, mut begin) = (Vector3::zeros(), 0.0, *stream.time.first()?);
    let mut clock = 0.0;
    for (t, f) in stream.time.iter().zip(&stream.force) {
        if !f.iter().all(|x| x.is_finite()) {
            continue;
        }
        if t - begin >= SAMPLE && count > 0.0 {
            times.push(clock / count);
            forces.push(sum / count);
            (sum, count, clock, begin) = (Vector3::zeros(), 0.0, 0.0, *t);
        }
        (sum, count, clock) = (sum + f, count + 1.0, clock + t);
    }
    let lasts = times.last()? - times.first()?;
    if times.len() < SAMPLES || lasts <= 0.0 {
        return None;
    }
    let half = (0.5 * SMOOTH * times.len() as f64 / lasts).round() as usize;
    let smooth = |i: usize| {
        let near = &forces[i.saturating_sub(half)..(i + half + 1).min(forces.len())];
        near.iter().map(|f| f.norm()).sum::<f64>() / near.len() as f64
    };
    let sizes: Vec<f64> = (0..forces.len()).map(smooth).collect();
    let touches = TOUCHES * quantile(&sizes, 0.9)?;
    let (mut longest, mut from) = (0..0, 0);
    for i in 0..=sizes.len() {
        if i == sizes.len() || sizes[i] <= touches {
            if i - from > longest.len() {
                longest = from..i;
            }
            from = i + 1;
        }
    }
    let (first, last) = (*times.get(longest.start)?, *times.get(longest.end.checked_sub(1)?)?);
    let inside = |t: f64| t >= first + ends[0] * (last - first) && t <= last - ends[1] * (last - first);
    let (times, forces): (Vec<f64>, Vec<Vector3<f64>>) =
        times.into_iter().zip(forces).filter(|(t, _)| inside(*t)).unzip();
    let lasts = times.last()? - times.first()?;
    (times.len() >= SAMPLES && lasts >= SHORTEST).then_some((times, forces))
}

/// Without a cubic, under Hann's window.
pub(super) fn spectrum((times, forces): &(Vec<f64>, Vec<Vector3<f64>>), grid: Grid) -> Option<Spectrum> {
    let (first, n) = (*times.first()?, times.len());
    let lasts = times.last()? - first;
    let a = DMatrix::from_fn(n, 4, |i, k| (2.0 * (times[i] - first) / lasts - 1.0).powi(k as i32));
    let even = DVector::from_element(n, 1.0);
    let left = |c: usize| {
        let y = DVector::from_fn(n, |i, _| forces[i][c]);
        weighted_linear(&a, &y, &even).map(|f| f.residuals)
    };
    let left = [left(0)?, left(1)?, left(2)?];
    let window = |i: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (i as f64 + 0.5) / n as f64).cos();
    let whole: f64 = (0..n).map(window).sum();
    let highest = grid.highest.min(SHOWS * (n as f64 - 1.0) / lasts);
    let count = ((highest - grid.lowest) / grid.step).max(0.0) as usize;
    let at = |k: usize| {
        let turn = std::f64::consts::TAU * grid.at(k);
        let mut sums = [[0.0; 2]; 3];
        for (i, t) in times.iter().enumerate() {
            let (sin, cos) = (turn * (t - first)).sin_cos();
            for (sum, left) in sums.iter_mut().zip(&left) {
                sum[0] += window(i) * left[i] * cos;
                sum[1] += window(i) * left[i] * sin;
            }
        }
        sums.iter().flatten().map(|s| (2.0 * s / whole).powi(2)).sum()
    };
    Some(Spectrum {
        power: (0..count).map(at).collect(),
        lasts,
        grid,
    })
}

impl Spectrum {
    /// Power at the frequency over the middle one of its neighbourhood.
    fn stands_out(&self, at: usize) -> f64 {
        let hertz = |k: usize| self.grid.at(k);
        let own = hertz(at);
        let around: Vec<f64> = (0..self.power.len())
            .filter(|k| (own / AROUND..=own * AROUND).contains(&hertz(*k)))
            .filter(|k| (hertz(*k) - own).abs() > SAME / self.lasts)
            .map(|k| self.power[k])
            .collect();
        let ground = median(&around).filter(|g| around.len() > 3 && *g > 0.0);
        ground.map_or(0.0, |g| self.power[at] / g)
    }
}

/// Whether the force swings at one frequency in nearly all touches, by more than the noise.
fn shaking(capture: &Capture, segmented: &[Segmented]) -> Option<Shaking> {
    let spectra: Vec<Spectrum> = capture
        .interactions
        .iter()
        .filter_map(|i| spectrum(&stretch(i, ENDS)?, IN_TIME))
        .collect();
    let noises: Vec<f64> = segmented.iter().filter_map(|s| s.force_noise).collect();
    let noise = capture.noise.force.or_else(|| median(&noises)).unwrap_or(0.0);
    told(&spectra).filter(|s| s.force > noise)
}

fn told(spectra: &[Spectrum]) -> Option<Shaking> {
    if spectra.len() < FEWEST {
        return None;
    }
    let count = spectra.iter().map(|s| s.power.len()).min()?;
    let ratios = |k: usize| spectra.iter().map(|s| s.stands_out(k)).collect::<Vec<f64>>();
    let middle = |k: usize| median(&ratios(k)).unwrap_or(0.0);
    let (best, ratio) = (0..count).map(|k| (k, middle(k))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let shaken = ratios(best).into_iter().filter(|r| *r > STANDS_OUT).count();
    let share = shaken as f64 / spectra.len() as f64;
    if !CLEAR.iter().any(|(clear, most)| ratio > *clear && share >= *most) {
        return None;
    }
    let forces: Vec<f64> = spectra.iter().map(|s| s.power[best].sqrt()).collect();
    Some(Shaking {
        hertz: IN_TIME.at(best),
        force: median(&forces)?,
        ratio,
        touches: [shaken, spectra.len()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Touches of two seconds that rise, fall and wobble, each in its own way, shaken by so many newtons at 7 Hz.
    fn spectra(force: f64) -> Vec<Spectrum> {
        let one = |touch: u32| {
            let times: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
            let own = f64::from(touch);
            let at = |t: &f64| {
                let wobble = 0.02 * (40.0 * (1.0 + 0.37 * own) * t + own).sin() + 0.02 * (211.0 * t * (1.0 + t)).sin();
                let shaken = force * (std::f64::consts::TAU * 7.0 * (t + 0.31 * own)).sin();
                Vector3::new(1.0 + 0.2 * own * t + wobble + shaken, wobble, 0.5 * wobble)
            };
            let forces = times.iter().map(at).collect();
            spectrum(&(times, forces), IN_TIME).expect("a spectrum")
        };
        (0..8).map(one).collect()
    }

    #[test]
    fn one_frequency_in_all_touches_is_told_with_its_size() {
        let found = told(&spectra(0.2)).expect("it shakes");
        assert!(
            (found.hertz - 7.0).abs() < 0.15 && (found.force - 0.2).abs() < 0.02,
            "{found:?}"
        );
        assert_eq!(found.touches, [8, 8]);
    }

    #[test]
    fn touches_that_wobble_each_in_its_own_way_are_not_shaken() {
        assert!(told(&spectra(0.0)).is_none());
    }
}
