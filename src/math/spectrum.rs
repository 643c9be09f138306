//! Spectra of short series, and the one frequency that many of them have in common.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{median, weighted_linear};

/// Share of the sampling rate up to which a frequency shows.
const SHOWS: f64 = 0.4;
/// Factor to either side that is a frequency's neighbourhood, and how near is the same top, in units of the inverse of the series.
const AROUND: f64 = 1.7;
const SAME: f64 = 2.5;

/// Frequencies that are tried, evenly, in the inverse of the unit in which the places of the readings are given.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// The first.
    pub lowest: f64,
    /// None is above it.
    pub highest: f64,
    /// From one to the next.
    pub step: f64,
}

impl Grid {
    /// The frequency of that place.
    pub fn at(&self, k: usize) -> f64 {
        self.lowest + self.step * k as f64
    }
}

/// The spectrum of one series over time or over a way.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Squared amplitude of all three axes by frequency, in the square of the unit of the readings.
    pub power: Vec<f64>,
    lasts: f64,
    grid: Grid,
}

impl Spectrum {
    /// Of readings at these places, without a cubic, under Hann's window (F. J. Harris, "On the use of windows for harmonic
    /// analysis", Proc. IEEE 66, 1978); nothing where they are too few for the cubic.
    pub fn of(places: &[f64], readings: &[Vector3<f64>], grid: Grid) -> Option<Self> {
        let (first, n) = (*places.first()?, places.len());
        let lasts = places.last()? - first;
        let a = DMatrix::from_fn(n, 4, |i, k| (2.0 * (places[i] - first) / lasts - 1.0).powi(k as i32));
        let even = DVector::from_element(n, 1.0);
        let left = |c: usize| {
            let y = DVector::from_fn(n, |i, _| readings[i][c]);
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
            for (i, t) in places.iter().enumerate() {
                let (sin, cos) = (turn * (t - first)).sin_cos();
                for (sum, left) in sums.iter_mut().zip(&left) {
                    sum[0] += window(i) * left[i] * cos;
                    sum[1] += window(i) * left[i] * sin;
                }
            }
            sums.iter().flatten().map(|s| (2.0 * s / whole).powi(2)).sum()
        };
        Some(Self {
            power: (0..count).map(at).collect(),
            lasts,
            grid,
        })
    }

    /// Power at the frequency over the middle one of its neighbourhood.
    pub fn stands_out(&self, at: usize) -> f64 {
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

/// How one frequency stands out of several series.
#[derive(Clone, Copy, Debug)]
pub struct CommonLine {
    /// In the unit of the grid.
    pub frequency: f64,
    /// Half of how far it swings, of the middle one, in the unit of the readings.
    pub amplitude: f64,
    /// Power over that of its neighbourhood, of the middle one.
    pub ratio: f64,
    /// In how many it stands out by the least ratio.
    pub series: usize,
}

impl CommonLine {
    /// One for each frequency that all of these have, which count where it stands out by `least`. Of a series there may be the
    /// spectra of several stretches: the one in which the frequency stands out most speaks for it.
    pub fn each(series: &[Vec<Spectrum>], least: f64) -> Vec<Self> {
        let count = series.iter().flatten().map(|s| s.power.len()).min().unwrap_or(0);
        let at = |k: usize| {
            let most = |stretches: &Vec<Spectrum>| {
                let each = stretches.iter().map(|s| (s.stands_out(k), s.power[k].sqrt()));
                each.max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let (ratios, amplitudes): (Vec<f64>, Vec<f64>) = series.iter().filter_map(most).unzip();
            Some(Self {
                frequency: series.iter().flatten().next()?.grid.at(k),
                amplitude: median(&amplitudes)?,
                ratio: median(&ratios)?,
                series: ratios.into_iter().filter(|r| *r > least).count(),
            })
        };
        (0..count).filter_map(at).collect()
    }
}
