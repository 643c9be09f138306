//! Mass and friction from pushes and pulls that speed a body up and slow it down.
//!
//! Output error: the measured force drives a simulated body from an unknown state, and its way is compared with the track;
//! no acceleration is taken from differences. `F = m a + mu m g`: where `a` varies, both terms show.

use nalgebra::{DMatrix, DVector, Vector2};
use rayon::prelude::*;

use super::Config;
use super::basins::{FIRST, polished};
use super::evidence::{mean_wrench, tare_of};
use super::facts::Ground;
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::math::{Dual, Fit, Loss, Real, Settings, effective_samples, levenberg_marquardt_exact};
use crate::physics::{Driven, Simulator};

/// What one such push tells: mass, kg, and kinetic friction force, N, with standard deviations.
#[derive(Clone, Debug)]
pub(super) struct Accelerated {
    pub interaction: String,
    pub mass: (f64, f64),
    pub friction: (f64, f64),
    /// Covariance of the logarithms of the two.
    pub shared: f64,
}

/// Least share of friction that the inertial force must reach (root mean square) for the mass to be told from it.
const INERTIAL: f64 = 0.25;
/// Relative doubt beyond which the mass is not told.
const WORTH: f64 = 0.15;
/// Largest turn of the body, rad: more, and its centre and torsion take part.
const TURN: f64 = 0.12;
/// Largest misfit, in variances of the track, that still counts as explained.
const MISFIT: f64 = 12.0;
/// Coefficients of friction that are thought possible at all.
const RUBS: std::ops::RangeInclusive<f64> = 0.02..=3.0;
/// Relative doubt for every standard deviation of the track by which the law misses beyond noise.
const FORM: f64 = 0.03;
/// Delay between force and track that is allowed for (1 sd), s.
const LATE: f64 = 2e-3;
/// Share of its usual largest speed above which a body moves.
const MOVING: f64 = 0.3;
/// A force is uneven where it leaves the usual one by this share, in this share of the time.
const UNEVEN: (f64, f64) = (0.2, 0.03);
/// Rows of the track that are compared at most.
const MOST: usize = 400;

struct Run {
    force: Vec<(f64, Vector2<f64>)>,
    time: Vec<f64>,
    position: Vec<Vector2<f64>>,
    noise: f64,
    /// Delay between force and track that is allowed for (1 sd), s.
    late: f64,
}

impl Run {
    /// What is left over, in standard deviations: place at each time, then the delay.
    fn residuals<T: Real>(&self, x: &[T]) -> Vec<T> {
        let body = Driven {
            mass: x[0].exp(),
            friction: x[1].exp(),
            late: x[6],
        };
        let state = (Vector2::new(x[2], x[3]), Vector2::new(x[4], x[5]));
        let path = body.simulate(&state, &self.force, self.time[0], &self.time);
        let miss = |p: T, seen: f64| (T::of(seen) - p) * self.noise.recip();
        let misses = path
            .iter()
            .zip(&self.position)
            .map(|(p, seen)| [miss(p.x, seen.x), miss(p.y, seen.y)]);
        misses.flatten().chain([x[6] * self.late.recip()]).collect()
    }

    /// By differences over five rows, m/s.
    fn speeds(&self) -> Vec<f64> {
        let n = self.time.len();
        let speed = |i: usize| {
            let (a, b) = (i.saturating_sub(2), (i + 2).min(n - 1));
            (self.position[b] - self.position[a]).norm() / (self.time[b] - self.time[a]).max(1e-6)
        };
        (0..n).map(speed).collect()
    }

    fn top_speed(&self) -> f64 {
        crate::math::quantile(&self.speeds(), 0.9).unwrap_or(0.0)
    }

    /// Whether the force ever leaves what it usually is while the body moves: inertia cannot show otherwise.
    fn is_uneven(&self) -> bool {
        let speeds = self.speeds();
        let top = self.top_speed();
        let force = |t: f64| {
            let row = self
                .force
                .partition_point(|f| f.0 < t)
                .min(self.force.len().saturating_sub(1));
            self.force.get(row).map_or(0.0, |f| f.1.norm())
        };
        let moving = (0..speeds.len()).filter(|i| speeds[*i] > MOVING * top);
        let forces: Vec<f64> = moving.map(|i| force(self.time[i])).collect();
        let usual = crate::math::median(&forces).unwrap_or(0.0);
        let uneven = forces.iter().filter(|f| (**f - usual).abs() > UNEVEN.0 * usual).count();
        uneven as f64 >= UNEVEN.1 * forces.len() as f64
    }
}

/// Unknowns: logarithms of mass and friction, position and velocity at the start, delay.
const UNKNOWN: usize = 7;

/// A push that might have told a mass: what it told, and how fast the body went, m/s.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    pub told: Option<Accelerated>,
    pub speed: f64,
}

/// Speeds over that of a push from which on another counts as no slower.
const NO_SLOWER: f64 = 0.9;

/// What pushes told, but for what one of many told by chance: inertia shows in whatever is as fast.
pub(super) fn borne_out(tried: &[Tried]) -> Vec<Accelerated> {
    let sure = |one: &&Tried| {
        let peers = || tried.iter().filter(|t| t.speed >= NO_SLOWER * one.speed);
        2 * peers().filter(|t| t.told.is_some()).count() >= peers().count()
    };
    tried.iter().filter(sure).filter_map(|t| t.told.clone()).collect()
}

/// Mass and friction of a link that was driven alone, where inertia shows; nothing where it turned, or its track says too little.
pub(super) fn accelerated(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    config: &Config,
) -> Option<Tried> {
    let run = run_of(interaction, segmented, link, ground, LATE)?;
    let told = Some(&run)
        .filter(|r| r.is_uneven())
        .and_then(|r| told_by(r, interaction, ground, config));
    Some(Tried {
        told: told.map(|t| t.0),
        speed: run.top_speed(),
    })
}

/// The same where force and track may be `late` (1 sd, s) to one another: what it told, how much later than the track the force is, s,
/// with its standard deviation, and by how much the logarithm of the mass goes with that, 1/s.
pub(super) fn accelerated_late(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    config: &Config,
    late: f64,
) -> Option<(Accelerated, (f64, f64), f64)> {
    let run = run_of(interaction, segmented, link, ground, late).filter(Run::is_uneven)?;
    let (told, fit) = told_by(&run, interaction, ground, config)?;
    let slope = fit.covariance[(0, 6)] / fit.covariance[(6, 6)].max(1e-30);
    Some((told, (fit.x[6], fit.sd(6)), slope))
}

fn told_by(run: &Run, interaction: &Interaction, ground: &Ground, config: &Config) -> Option<(Accelerated, Fit)> {
    let fit = fit(run)?;
    let (mass, friction) = (fit.x[0].exp(), fit.x[1].exp());
    let memory = run.position.len() as f64 * 2.0 / effective_samples(fit.residuals.as_slice()).max(1.0);
    let misfit = 2.0 * fit.cost / (fit.residuals.len() as f64 - 7.0).max(1.0);
    let wide = (misfit.max(1.0) * memory.clamp(1.0, 8.0)).sqrt();
    // What the law leaves unexplained may pull at both numbers in a way that no inflation of noise tells.
    let form = config.model_form.hypot(FORM * (misfit - 1.0).max(0.0).sqrt());
    let own = (fit.sd(0) * wide).hypot(form);
    let inertial = inertia(run, &fit, mass);
    let found = Accelerated {
        interaction: interaction.name.clone(),
        mass: (mass, mass * own),
        friction: (friction, friction * (fit.sd(1) * wide).hypot(form)),
        shared: fit.covariance[(0, 1)] * wide * wide,
    };
    let told = own < WORTH && misfit < MISFIT && inertial > INERTIAL * friction && found.rubs(ground);
    told.then_some((found, fit))
}

impl Accelerated {
    /// Whether mass and friction are such as dry things have, of any weight.
    pub(super) fn rubs(&self, ground: &Ground) -> bool {
        let coefficient = self.friction.0 / (self.mass.0 * ground.gravity.norm());
        RUBS.contains(&coefficient)
    }
}

fn run_of(interaction: &Interaction, segmented: &Segmented, link: &str, ground: &Ground, late: f64) -> Option<Run> {
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let stream = interaction.force.as_ref()?;
    let start = segmented.of(PhaseKind::Slide).map(|p| p.start).reduce(f64::min)?;
    // To the end of the track: coasting and standing still under no force obey the same law.
    let end = *track.time.last()?;
    let tare = tare_of(interaction, segmented);
    let plane = &ground.plane;
    let slope = plane.flat(&ground.gravity).norm() / ground.gravity.norm();
    let rows: Vec<usize> = (0..track.len())
        .filter(|&i| {
            track.time[i] >= start && track.time[i] <= end && track.position[i].coords.iter().all(|x| x.is_finite())
        })
        .collect();
    if rows.len() < 12 || slope > 0.02 || stream.misses(start - 0.05, end) {
        return None;
    }
    let turns = rows.iter().filter_map(|&i| track.rotation[i]);
    let first = turns.clone().next();
    let turned = first.map_or(0.0, |q| turns.map(|r| (r * q.inverse()).angle()).fold(0.0, f64::max));
    if turned > TURN {
        return None;
    }
    let step = rows.len().div_ceil(MOST);
    let rows: Vec<usize> = rows.into_iter().step_by(step).collect();
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let half = 0.5 / rate.min(500.0);
    let force = stream
        .time
        .iter()
        .filter(|t| **t >= start - 0.05 && **t <= end + 0.05)
        .filter_map(|&t| Some((t, plane.flat(&mean_wrench(stream, t - half, t + half, &tare)?.force))))
        .collect();
    Some(Run {
        force,
        time: rows.iter().map(|&i| track.time[i]).collect(),
        position: rows.iter().map(|&i| plane.flat(&track.position[i].coords)).collect(),
        noise: segmented.position_noise.unwrap_or(3e-4).max(2e-5),
        late,
    })
}

/// Logarithms of mass and friction, position and velocity at the start, and how much later than the track the force is, s.
fn fit(run: &Run) -> Option<Fit> {
    let (first, last) = (run.time[0], run.time[run.time.len() - 1]);
    let sizes: Vec<f64> = run
        .force
        .iter()
        .filter(|(t, _)| *t >= first && *t <= last)
        .map(|(_, f)| f.norm())
        .collect();
    let typical = crate::math::median(&sizes).filter(|f| *f > 0.0)?;
    let early = (run.position[3] - run.position[0]) / (run.time[3] - run.time[0]).max(1e-6);
    let residuals = |x: &DVector<f64>| DVector::from_vec(run.residuals(x.as_slice()));
    let slopes = |x: &DVector<f64>| {
        let numbers: Vec<Dual<UNKNOWN>> = x.iter().enumerate().map(|(k, v)| Dual::variable(*v, k)).collect();
        let rows = run.residuals(&numbers);
        DMatrix::from_fn(rows.len(), UNKNOWN, |i, j| rows[i].slopes[j])
    };
    let settings = |iterations: usize| Settings {
        loss: Loss::Huber(2.5),
        iterations,
        tolerance: 1e-7,
    };
    // Several starts: what is driven hard and what barely moves lie in different basins.
    let starts = [(0.03, 0.8), (0.1, 0.6), (0.3, 0.4), (0.1, 0.2)];
    let fits = starts.par_iter().filter_map(|(per_newton, share)| {
        let start = DVector::from_vec(vec![
            (per_newton * typical).ln(),
            (share * typical).ln(),
            run.position[0].x,
            run.position[0].y,
            early.x,
            early.y,
            0.0,
        ]);
        levenberg_marquardt_exact(&start, settings(FIRST), residuals, slopes)
    });
    let again =
        |from: &Fit, iterations: usize| levenberg_marquardt_exact(&from.x, settings(iterations), residuals, slopes);
    Some(polished(fits.collect(), again)?.0)
}

/// Root mean square of the inertial force over the run, N, from the fitted motion.
fn inertia(run: &Run, fit: &Fit, mass: f64) -> f64 {
    let body = Driven {
        mass,
        friction: fit.x[1].exp(),
        late: 0.0,
    };
    let state = (Vector2::new(fit.x[2], fit.x[3]), Vector2::new(fit.x[4], fit.x[5]));
    let path = body.simulate(&state, &run.force, run.time[0], &run.time);
    let mut squares = Vec::new();
    for k in 1..path.len().saturating_sub(1) {
        let (a, b) = (run.time[k] - run.time[k - 1], run.time[k + 1] - run.time[k]);
        if a > 0.0 && b > 0.0 {
            let change = (path[k + 1] - path[k]) / b - (path[k] - path[k - 1]) / a;
            squares.push((mass * 2.0 * change / (a + b)).norm_squared());
        }
    }
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}
