//! The law of a pressed spot by output error: the force over the whole press, from before contact to after it, is
//! simulated and compared, so that the jump at first touch tells damping from a lag between force and position.

use nalgebra::{DMatrix, DVector};

use super::squeeze_profile::ends;
use crate::math::{Fit, Loss, Settings, effective_samples, levenberg_marquardt, median};
use crate::physics::ElasticLaw;

/// Lag between force and position over the time from reading to reading (1 sd): evenly within half of it either way.
const LAG: f64 = 0.2887;
/// Share by which the laws themselves may be off.
const FORM: f64 = 0.003;
/// Twice the gain in log likelihood that an extension must bring, per effective sample counted.
const WORTH: f64 = 20.0;

/// Recorded course of one press, m and N along it.
#[derive(Clone, Debug)]
pub(super) struct Course {
    pub time: Vec<f64>,
    pub force: Vec<f64>,
    pub travel: Vec<f64>,
    pub speed: Vec<f64>,
    /// Noise of the force, N.
    pub noise: f64,
}

impl Course {
    /// Lag between force and position, s (1 sd): all streams are on one clock, but whether a reading is that of its moment
    /// or the mean of the sample before it nobody says, of either; even between the two. A press cannot tell such a lag:
    /// with the contact free, `F = k (p - l v - p0) + c v` holds `c - k l` only but for the one reading about first touch.
    fn lag(&self) -> f64 {
        let steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        LAG * median(&steps).unwrap_or(2e-3)
    }

    /// Half of the typical difference of the force on the way in and on the way out at the same travel, N.
    fn loop_width(&self) -> f64 {
        let ways = self.ways();
        let deepest = self.travel.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let shallow = |i: &usize| self.force[*i] > 0.0 && self.travel[*i] < deepest;
        let on = |way: f64| -> Vec<usize> {
            (0..ways.len())
                .filter(|i| ways[*i] * way > 0.0)
                .filter(shallow)
                .collect()
        };
        let (ins, outs) = (on(1.0), on(-1.0));
        let near = |i: usize| {
            outs.iter().copied().min_by(|a, b| {
                let off = |j: usize| (self.travel[j] - self.travel[i]).abs();
                off(*a).total_cmp(&off(*b))
            })
        };
        let apart = ins
            .iter()
            .step_by(10)
            .filter_map(|i| Some(self.force[*i] - self.force[near(*i)?]));
        median(&apart.collect::<Vec<f64>>()).map_or(0.0, |d| 0.5 * d.max(0.0))
    }

    /// The way in which the tool went last: 1 in, -1 out; noise while it holds is no way.
    fn ways(&self) -> Vec<f64> {
        let [low, high] = self
            .travel
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(*x), h.max(*x)]);
        let (mut way, mut far) = (1.0, f64::NEG_INFINITY);
        let next = |x: &f64| {
            let along = way * x;
            far = f64::max(far, along);
            if far - along > BACK * (high - low) {
                (way, far) = (-way, -along);
            }
            way
        };
        self.travel.iter().map(next).collect()
    }
}

/// Unknowns of the law.
pub(super) const UNKNOWN: usize = 8;

/// A fit with all unknowns, and which of them were free.
pub(super) struct Found {
    pub fit: Fit,
    pub x: [f64; UNKNOWN],
    pub free: [bool; UNKNOWN],
}

/// What one press says: each value with its standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squeezed {
    pub stiffness: (f64, f64),
    pub damping: (f64, f64),
    /// Share of the variance of the damping that the lag makes: one sensor's lag is the same in all presses.
    pub lagging: f64,
    /// 1/m, where the curve is not straight.
    pub hardening: Option<(f64, f64)>,
    /// Share and time constant (s), where the force relaxes while it holds, each with its 95 % interval.
    pub relaxing: Option<[(f64, [f64; 2]); 2]>,
    /// N, by which the force is more on the way in and less on the way out, whatever the speed.
    pub dry: Option<(f64, f64)>,
}

/// ln k, c/k (s), contact (m), lag (s), hardening (1/m), relaxing share, ln tau, dry force (N).
const STEPS: [f64; UNKNOWN] = [1e-5, 1e-6, 1e-7, 1e-6, 1e-3, 1e-4, 1e-3, 1e-4];
pub(super) fn loose(course: &Course) -> [f64; UNKNOWN] {
    let largest = course.force.iter().copied().fold(0.0, f64::max);
    [3.0, 0.03, 0.01, course.lag(), 100.0, 0.3, 0.8, 0.3 * largest.max(1e-3)]
}
const HARDENING: usize = 4;
const RELAXING: usize = 5;
const DRY: usize = 7;
/// Share of the travel by which the tool must have turned back for dry friction to have turned round.
const BACK: f64 = 0.03;
/// Standard deviations from which on dry friction is believed.
const CLEAR: f64 = 5.0;

/// Fits spring, damping, contact and lag, then hardening and relaxation where the data ask for them.
pub(super) fn squeeze(course: &Course, stiffness: f64, contact: f64) -> Option<Squeezed> {
    // Of the lag a press tells nothing but by the one reading about first touch, which is no slope to go by: it is held.
    let free = [true, true, true, false, false, false, false, false];
    let prior = [stiffness.ln(), 0.0, contact, 0.0, 0.0, 0.0, f64::ln(0.4), 0.0];
    let mut best = fit(course, &free, &prior, &prior)?;
    for extension in [&[RELAXING, RELAXING + 1][..], &[DRY][..], &[HARDENING][..]] {
        let mut wider = best.free;
        extension.iter().for_each(|k| wider[*k] = true);
        let mut start = best.x;
        match extension[0] {
            RELAXING => start[RELAXING] = 0.1,
            // Damping may have taken all of the loop.
            DRY => (start[1], start[DRY]) = (0.0, course.loop_width()),
            _ => {}
        }
        let Some(found) = fit(course, &wider, &prior, &start) else {
            continue;
        };
        // Residuals that remember their past count for fewer.
        let memory = inflation(&found.fit);
        let told = match extension[0] {
            RELAXING => relaxes(course, &found),
            DRY => found.x[DRY] > CLEAR * deviations(&found.fit, &wider, &loose(course))[DRY],
            _ => true,
        };
        if told && 2.0 * (best.fit.cost - found.fit.cost) > WORTH * memory {
            best = found;
        }
    }
    Some(read(course, &best, &prior))
}

/// Whether a relaxation can be told from a stiffer spring: it must be a share that stands out, over well before the press
/// is; one that is slower than the press is long only trades stiffness for its own share.
fn relaxes(course: &Course, found: &Found) -> bool {
    let (x, sds) = (&found.x, deviations(&found.fit, &found.free, &loose(course)));
    let lasts = course.time[course.time.len() - 1] - course.time[0];
    let slowest = (x[RELAXING + 1] + sds[RELAXING + 1]).exp();
    x[RELAXING] > 3.0 * sds[RELAXING] && slowest < 0.4 * lasts && sds[RELAXING + 1] < 0.5
}

/// Standard deviations of the free unknowns, zero for the others: `C (f H + P) C` with the information `H` of the data, that
/// of the priors `P`, `C = (H + P)^-1` and the factor `f` by which residuals that remember and miss make the data count for
/// less. A prior alone is not doubted by what the data leave over.
pub(super) fn deviations(fit: &Fit, free: &[bool; UNKNOWN], loose: &[f64; UNKNOWN]) -> [f64; UNKNOWN] {
    let used: Vec<usize> = (0..UNKNOWN).filter(|k| free[*k]).collect();
    let prior = DMatrix::from_diagonal(&DVector::from_iterator(
        used.len(),
        used.iter().map(|k| loose[*k].powi(-2)),
    ));
    let mut out = [0.0; UNKNOWN];
    let c = &fit.covariance;
    if let Some(whole) = c.clone().try_inverse() {
        let spread = c * ((whole - &prior) * inflation(fit) + &prior) * c;
        for (i, k) in used.iter().enumerate() {
            out[*k] = spread[(i, i)].max(c[(i, i)]).sqrt();
        }
    } else {
        used.iter()
            .enumerate()
            .for_each(|(i, k)| out[*k] = fit.sd(i) * inflation(fit).sqrt());
    }
    out
}

fn inflation(fit: &Fit) -> f64 {
    let n = fit.residuals.len() as f64;
    let misfit = (2.0 * fit.cost / n).max(1.0);
    misfit * (n / effective_samples(fit.residuals.as_slice())).clamp(1.0, 50.0)
}

fn read(course: &Course, found: &Found, prior: &[f64; UNKNOWN]) -> Squeezed {
    let Found { fit, x, free } = found;
    let sds = deviations(fit, free, &loose(course));
    let sd = |k: usize| sds[k];
    let k = x[0].exp();
    let own = sd(0).hypot(FORM);
    let damping = x[1] * k;
    let lag = course.lag();
    let told = sd(1).hypot(lag).hypot(x[1] * own);
    Squeezed {
        stiffness: (k, k * own),
        damping: (damping, k * told),
        lagging: (lag / told.max(1e-300)).powi(2),
        hardening: free[HARDENING].then(|| (x[HARDENING], sd(HARDENING))),
        relaxing: free[RELAXING].then(|| {
            let slow = ends(course, found, prior, RELAXING + 1).map(f64::exp);
            let share = ends(course, found, prior, RELAXING);
            [(x[RELAXING], share), (x[RELAXING + 1].exp(), slow)]
        }),
        dry: free[DRY].then(|| (x[DRY], sd(DRY))),
    }
}

fn law(x: &[f64; UNKNOWN]) -> ElasticLaw {
    ElasticLaw {
        stiffness: x[0].exp(),
        damping: x[1] * x[0].exp(),
        hardening: x[HARDENING],
        relaxing: x[RELAXING],
        relaxation_time: x[RELAXING + 1].clamp(-4.0, 3.0).exp(),
    }
}

/// Force at the recorded times: position is read `lag` earlier.
fn predict(course: &Course, x: &[f64; UNKNOWN]) -> Vec<f64> {
    let depth: Vec<f64> = course
        .travel
        .iter()
        .zip(&course.speed)
        .map(|(p, v)| p - x[3] * v - x[2])
        .collect();
    let mut force = law(x).force(&course.time, &depth, &course.speed);
    if x[DRY] != 0.0 {
        for ((f, u), way) in force.iter_mut().zip(&depth).zip(course.ways()) {
            *f = if *u > 0.0 { (*f + x[DRY] * way).max(0.0) } else { 0.0 };
        }
    }
    force
}

/// Fits what is free, the rest held where it starts.
pub(super) fn fit(
    course: &Course,
    free: &[bool; UNKNOWN],
    prior: &[f64; UNKNOWN],
    start: &[f64; UNKNOWN],
) -> Option<Found> {
    let used: Vec<usize> = (0..UNKNOWN).filter(|k| free[*k]).collect();
    let loose = loose(course);
    let whole = |v: &DVector<f64>| {
        let mut x = *start;
        used.iter().enumerate().for_each(|(i, k)| x[*k] = v[i]);
        x
    };
    let residuals = |v: &DVector<f64>| {
        let x = whole(v);
        let mut out: Vec<f64> = predict(course, &x)
            .iter()
            .zip(&course.force)
            .zip(&course.speed)
            .map(|((p, f), v)| {
                // Timing jitter shows where the force is steep.
                let jitter = 5e-4 * x[0].exp() * v.abs();
                (f - p) / course.noise.hypot(jitter)
            })
            .filter(|r| r.is_finite())
            .collect();
        out.extend(used.iter().map(|k| (x[*k] - prior[*k]) / loose[*k]));
        DVector::from_vec(out)
    };
    let settings = Settings {
        loss: Loss::Huber(3.0),
        iterations: 40,
        tolerance: 1e-7,
    };
    let pick = |v: &[f64; UNKNOWN]| DVector::from_iterator(used.len(), used.iter().map(|k| v[*k]));
    let found = levenberg_marquardt(&pick(start), &pick(&STEPS), settings, residuals)?;
    let x = whole(&found.x);
    let found = Found {
        fit: found,
        x,
        free: *free,
    };
    x.iter().all(|v| v.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests;
