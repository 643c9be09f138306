//! Which kind of joint a relative motion shows: evidence of each kind by Laplace's method.
//!
//! For kind K with parameters θ and joint positions z_i, `ln p(D|K) ≈ -χ²/2 - Σ_i ln(range / (σ_z √(2π))) - k`:
//! a freedom that the motion does not need costs its prior range against its precision in each sample
//! (Occam's factor), a parameter costs one unit (Akaike). χ² and the counts are scaled by the share of
//! independent samples, from the lag-one correlation of the residuals, so that slow systematic errors of the
//! tracks do not pass for proof.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::fit::{Fit, fit};
use super::manifold::{Manifold, Sample};
use crate::twin::JointKind;

/// Every kind that is tried.
pub const KINDS: [JointKind; 7] = [
    JointKind::Fixed,
    JointKind::Revolute,
    JointKind::Prismatic,
    JointKind::Screw,
    JointKind::Cylindrical,
    JointKind::Planar,
    JointKind::Spherical,
];

/// Prior range of a freedom: m, rad.
const RANGE: (f64, f64) = (0.2, 2.0);

/// Prior range of a screw's pitch, m/rad.
const PITCH_RANGE: f64 = 0.04;
/// Log odds of a hinge against a screw before any data.
const SCREW_ODDS: f64 = 2.0;

/// How well a kind is supported.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The fit.
    pub fit: Fit,
    /// Log evidence.
    pub evidence: f64,
    /// Among the kinds and `free`.
    pub probability: f64,
}

/// The kinds, most probable first, and what is left over.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Most probable first.
    pub candidates: Vec<Candidate>,
    /// Probability that no joint of these kinds holds the two.
    pub free: f64,
    /// By how much the samples' noise is understated (1 = not at all).
    pub inflation: f64,
    /// Number of samples over the number of independent ones.
    pub correlation: f64,
}

/// Fits the kinds and weighs them. `reach` is the largest radius that a hinge may have, m.
pub fn select(samples: &[Sample], kinds: &[JointKind], reach: f64) -> Option<Selection> {
    let fitted: Vec<Option<Fit>> = kinds.par_iter().map(|&kind| fit(kind, samples)).collect();
    let fits: Vec<Fit> = fitted.into_iter().flatten().collect();
    let dims = dimensions(samples);
    let spread = |f: &Fit| (f.chi2 / degrees(&f.manifold, samples, dims)).sqrt();
    let yardstick = yardstick(&fits, &spread, cap(samples))?;
    let inflation = spread(yardstick).clamp(1.0, cap(samples));
    let correlation = correlation_time(yardstick, samples);
    let effective = 1.0 / correlation;
    let mut candidates: Vec<Candidate> = fits
        .into_iter()
        .map(|fit| Candidate {
            evidence: evidence(&fit, samples, inflation, effective, reach),
            fit,
            probability: 0.0,
        })
        .collect();
    let free = free_evidence(samples, inflation, effective);
    let free = normalise(&mut candidates, free);
    candidates.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    Some(Selection {
        candidates,
        free,
        inflation,
        correlation,
    })
}

/// The fit whose residuals stand for the noise: the best among those with the fewest freedoms that are good
/// enough to be believed, so that small systematic errors do not call for another freedom.
fn yardstick<'a>(fits: &'a [Fit], spread: &dyn Fn(&Fit) -> f64, cap: f64) -> Option<&'a Fit> {
    let rank = |f: &&Fit| (spread(f) > cap, if spread(f) > cap { 0 } else { f.manifold.latents() });
    fits.iter()
        .min_by(|a, b| rank(a).cmp(&rank(b)).then(spread(a).total_cmp(&spread(b))))
}

fn normalise(candidates: &mut [Candidate], free: f64) -> f64 {
    let top = candidates.iter().map(|c| c.evidence).fold(free, f64::max);
    let total: f64 = candidates.iter().map(|c| (c.evidence - top).exp()).sum::<f64>() + (free - top).exp();
    for candidate in candidates.iter_mut() {
        candidate.probability = (candidate.evidence - top).exp() / total;
    }
    (free - top).exp() / total
}

fn dimensions(samples: &[Sample]) -> f64 {
    let oriented = samples.iter().filter(|s| s.rotation.is_some()).count();
    3.0 + 3.0 * oriented as f64 / samples.len().max(1) as f64
}

fn degrees(manifold: &Manifold, samples: &[Sample], dims: f64) -> f64 {
    let per_sample = (dims - manifold.latents() as f64).max(0.0);
    (samples.len() as f64 * per_sample - manifold.parameters(dims > 3.5) as f64).max(1.0)
}

/// How far residuals may exceed the noise before a kind is not believed at all: three times, and one part in
/// a hundred of the travel (compliance, calibration of the tracker).
fn cap(samples: &[Sample]) -> f64 {
    let mean = samples.iter().map(|s| s.position).sum::<nalgebra::Vector3<f64>>() / samples.len() as f64;
    let travel = samples.iter().map(|s| (s.position - mean).norm()).fold(0.0, f64::max);
    let noise = samples.iter().map(|s| s.noise.position).sum::<f64>() / samples.len() as f64;
    3.0 + 0.01 * 2.0 * travel / noise
}

/// `(1 + ρ) / (1 - ρ)` with ρ the lag-one correlation of the residuals within interactions.
fn correlation_time(fit: &Fit, samples: &[Sample]) -> f64 {
    let (mut over, mut under) = (0.0, 1e-12);
    for i in 1..samples.len() {
        if samples[i].run == samples[i - 1].run {
            over += fit.projections[i].residual.dot(&fit.projections[i - 1].residual);
            under += fit.projections[i].residual.norm_squared();
        }
    }
    let rho = (over / under).clamp(0.0, 0.98);
    if rho < 0.1 { 1.0 } else { (1.0 + rho) / (1.0 - rho) }
}

/// Log of the prior range of the freedoms. One freedom alone has the range that it was seen to have, so that a
/// line and an arc of the same length are on a par whatever their units.
fn log_ranges(fit: &Fit) -> f64 {
    let (shift, turn) = (RANGE.0.ln(), RANGE.1.ln());
    match fit.manifold.kind {
        JointKind::Fixed => 0.0,
        JointKind::Revolute | JointKind::Screw | JointKind::Prismatic => seen_range(fit).ln(),
        JointKind::Cylindrical => turn + shift,
        JointKind::Planar => turn + 2.0 * shift,
        JointKind::Spherical => 3.0 * turn,
    }
}

fn seen_range(fit: &Fit) -> f64 {
    let positions = fit.projections.iter().map(|p| (p.z[0], (-p.log_precision).exp()));
    let [low, high] = positions.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], (z, sd)| {
        [l.min(z - 3.0 * sd), h.max(z + 3.0 * sd)]
    });
    let range = high - low;
    let range = match fit.manifold.kind {
        // A hinge's angle ends at half a turn and begins again at minus that.
        JointKind::Revolute if range > PI => range.min(arc(fit.projections.iter().map(|p| p.z[0]))),
        _ => range,
    };
    range.max(1e-12)
}

/// The shortest arc that holds all of these angles, rad.
fn arc(angles: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = angles.map(|z| z.rem_euclid(TAU)).collect();
    all.sort_by(f64::total_cmp);
    let round = all
        .first()
        .zip(all.last())
        .map_or(TAU, |(first, last)| first + TAU - last);
    let widest = all.windows(2).map(|w| w[1] - w[0]).fold(round, f64::max);
    TAU - widest
}

const HALF_LOG_TAU: f64 = 0.918_938_533_204_672_7;

fn evidence(fit: &Fit, samples: &[Sample], inflation: f64, effective: f64, reach: f64) -> f64 {
    let manifold = &fit.manifold;
    let latents = manifold.latents() as f64;
    let range = log_ranges(fit);
    let occam: f64 = fit
        .projections
        .iter()
        .map(|p| range + p.log_precision - latents * (inflation.ln() + HALF_LOG_TAU))
        .map(|cost| cost.max(0.0))
        .sum();
    let mut chi2 = fit.chi2 / inflation.powi(2);
    if matches!(
        manifold.kind,
        JointKind::Revolute | JointKind::Cylindrical | JointKind::Screw
    ) {
        chi2 += beyond_reach(fit, inflation, reach) / effective;
    }
    let oriented = dimensions(samples) > 3.5;
    let screw = if manifold.kind == JointKind::Screw {
        pitch_cost(fit, inflation, effective)
    } else {
        0.0
    };
    -effective * (0.5 * chi2 + occam) - manifold.parameters(oriented) as f64 - screw
}

/// Occam's factor of a pitch: no pitch at all is the rule, so that a pitch must show against its prior range.
fn pitch_cost(fit: &Fit, inflation: f64, effective: f64) -> f64 {
    let sd = fit.covariance[(10, 10)].max(1e-18).sqrt() * inflation / effective.sqrt();
    (PITCH_RANGE / sd).ln().max(0.0) - HALF_LOG_TAU + SCREW_ODDS
}

/// What it costs a hinge to be bent to the largest allowed radius, if its own is larger: the squared distance
/// of the curvatures in standard deviations.
fn beyond_reach(fit: &Fit, inflation: f64, reach: f64) -> f64 {
    let (radius, variance) = radius_of(fit);
    if radius <= reach {
        return 0.0;
    }
    let sd = (variance.sqrt() * inflation / radius.powi(2)).max(1e-12);
    ((1.0 / reach - 1.0 / radius) / sd).powi(2)
}

/// Distance of the child's origin from the axis, and its variance for unit residual variance.
pub fn radius_of(fit: &Fit) -> (f64, f64) {
    let m = &fit.manifold;
    let arm = m.home.translation.vector - m.point;
    let arm = arm - m.axis.into_inner() * m.axis.dot(&arm);
    let radius = arm.norm();
    if radius < 1e-9 {
        return (radius, 0.0);
    }
    let direction = arm / radius;
    let map = fit.point_map(0.0).transpose() * direction;
    let variance = (map.transpose() * &fit.covariance * &map)[(0, 0)];
    (radius, variance.max(0.0))
}

/// Evidence of no joint at all: six freedoms, no residual.
fn free_evidence(samples: &[Sample], inflation: f64, effective: f64) -> f64 {
    let cost: f64 = samples
        .iter()
        .map(|s| {
            let shift = (RANGE.0 / (s.noise.position * inflation)).ln() - HALF_LOG_TAU;
            let turn = (RANGE.1 / (s.noise.rotation * inflation)).ln() - HALF_LOG_TAU;
            3.0 * shift.max(0.0) + if s.rotation.is_some() { 3.0 * turn.max(0.0) } else { 0.0 }
        })
        .sum();
    -effective * cost
}
