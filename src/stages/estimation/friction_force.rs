//! The force of friction of one link over all of its pushes, with the slope of the support taken out.

use nalgebra::{DMatrix, DVector, Vector3};

use super::Config;
use super::facts::Facts;
use super::pool::{pooled, relative_sd};
use super::push::Push;
use super::resolve::STAGE;
use super::surface::{Surface, SurfacePrior, fit_surface};
use crate::base::{Estimate, Notices};
use crate::math::bayesian_linear;

/// How much more the law is doubted where the path between a first and a last pose is guessed.
const BRIDGED: f64 = 4.2;
/// Share of the jerking of a force that is doubted of its mean.
const JERKING: f64 = 0.25;

/// What all pushes of a link say together.
#[derive(Clone, Debug)]
pub(super) struct Sliding {
    pub kinetic: Estimate,
    pub static_: Option<Estimate>,
    pub radius: Estimate,
    /// Mean force of the tool along the normal, N.
    pub lift: f64,
    /// Friction centre in the link frame with standard deviations, m.
    pub centre: ([f64; 3], [f64; 3]),
    /// No pose between before and after was seen in any of the pushes.
    pub bridged: bool,
    /// Friction force of each push, N, with its own standard deviation.
    pub trials: Vec<(String, (f64, f64))>,
    /// Standard deviation that all of them share, N.
    pub common: f64,
}

/// Friction force, torsional radius and friction centre from the pushes of a link that moved alone.
pub(super) fn sliding_of(
    facts: &Facts,
    prior: &SurfacePrior,
    config: &Config,
    notices: Option<&mut Notices>,
    link: &str,
) -> Option<Sliding> {
    sliding_from(&facts.pushes, prior, config, notices, link)
}

/// The same for any set of pushes.
pub(super) fn sliding_from(
    pushes: &[Push],
    prior: &SurfacePrior,
    config: &Config,
    notices: Option<&mut Notices>,
    link: &str,
) -> Option<Sliding> {
    if pushes.is_empty() {
        return None;
    }
    let surface = fit_surface(pushes, prior)?;
    let from: Vec<String> = pushes.iter().map(|p| p.interaction.clone()).collect();
    let (trials, slope) = without_slope(pushes, &surface, config);
    let middle = crate::math::median(&trials.iter().map(|t| t.0).collect::<Vec<_>>())?;
    let bridged = pushes.iter().all(|p| p.bridged);
    let form = if bridged {
        BRIDGED * config.model_form
    } else {
        config.model_form
    };
    // Jerking hides part of the friction in a way that the median mends only partly.
    let chatter = pushes.iter().map(|p| p.chatter).sum::<f64>() / pushes.len() as f64;
    let common = surface
        .radius_effect
        .hypot(form * middle)
        .hypot(JERKING * chatter * middle);
    let kinetic = pooled(
        &trials,
        config.friction_scatter,
        common,
        "N",
        from.clone(),
        "push-limit-surface",
    )?;
    if let (Some(notices), Some(slope)) = (notices, slope) {
        notices.warn(
            STAGE,
            link,
            format!(
                "friction depends on the direction of the push as if a constant force of {:.3} N pulled towards \
                 ({:.2}, {:.2}, {:.2}): a slope of the support, or a bias of the force sensor",
                slope.norm(),
                slope.x / slope.norm(),
                slope.y / slope.norm(),
                slope.z / slope.norm()
            ),
        );
    }
    let lifts: Vec<f64> = pushes.iter().flat_map(|p| p.blocks.iter().map(|b| b.lift)).collect();
    Some(Sliding {
        static_: breakaway(pushes, &kinetic, prior.mass),
        radius: Estimate::measured(surface.radius.0, surface.radius.1, "m", from, "push-limit-surface"),
        lift: crate::math::median(&lifts)?,
        centre: (surface.centre, surface.centre_sd),
        bridged,
        kinetic,
        trials: pushes.iter().map(|p| p.interaction.clone()).zip(trials).collect(),
        common,
    })
}

/// Forces of the pushes with a constant horizontal force taken out where they demand one, and that force (what
/// the body itself feels). Pushes against it need more, pushes along it less.
fn without_slope(pushes: &[Push], surface: &Surface, config: &Config) -> (Vec<(f64, f64)>, Option<Vector3<f64>>) {
    let trials = surface.forces.clone();
    let used: Vec<usize> = (0..trials.len()).filter(|&i| trials[i].0.is_finite()).collect();
    if used.len() < 4 || pushes.iter().any(|p| p.bridged) {
        return (trials, None);
    }
    let middle = crate::math::median(&trials.iter().map(|t| t.0).collect::<Vec<_>>()).unwrap_or(1.0);
    let weights = DVector::from_iterator(
        used.len(),
        used.iter()
            .map(|&i| 1.0 / (trials[i].1.powi(2) + (config.friction_scatter * middle).powi(2))),
    );
    let b = DVector::from_iterator(used.len(), used.iter().map(|&i| trials[i].0));
    let fit = |share: f64| {
        let a = DMatrix::from_fn(used.len(), 4, |i, j| {
            if j == 0 { 1.0 } else { pushes[used[i]].direction[j - 1] }
        });
        let mean = DVector::from_vec(vec![middle, 0.0, 0.0, 0.0]);
        let sd = DVector::from_vec(vec![10.0 * middle, share * middle, share * middle, share * middle]);
        bayesian_linear(&a, &b, &weights, &mean, &sd)
    };
    let (Some(with), Some(without)) = (fit(0.15), fit(1e-6)) else {
        return (trials, None);
    };
    let misfit = |r: &DVector<f64>| r.iter().zip(weights.iter()).map(|(r, w)| r * r * w).sum::<f64>();
    let gained = misfit(&without.residuals) - misfit(&with.residuals);
    let left = misfit(&with.residuals) / (used.len() as f64 - 3.0).max(1.0);
    // Two degrees of freedom at 0.1 %, in units of what is left.
    if gained < 13.8 * left.max(1.0) {
        return (trials, None);
    }
    let pull = Vector3::new(with.x[1], with.x[2], with.x[3]);
    let own = with.sd(0) * left.max(1.0).sqrt() * (used.len() as f64).sqrt();
    let corrected = (0..trials.len())
        .map(|i| (trials[i].0 - pull.dot(&pushes[i].direction), trials[i].1.hypot(own)))
        .collect();
    (corrected, Some(-pull))
}

/// By how much the excess of static over kinetic friction that shows falls short: likely and most factor. Where a
/// push also turns the body, its points let go one after another, and their peaks do not add up.
const HIDDEN: [f64; 2] = [1.8, 2.3];
/// Largest swing of the force, as a share of its peak, at which a push tells of static friction at all.
const BLOW: f64 = 0.5;

/// One push's word on static friction, as shares of its steady force.
struct Excess {
    shown: f64,
    /// What is left of it if the tool's catching up made as much of the peak as it can.
    sure: f64,
    sd: f64,
    interaction: String,
}

fn excess_of(push: &Push, mass: f64) -> Option<Excess> {
    let forces: Vec<f64> = push.blocks.iter().map(|b| b.force.norm()).collect();
    let steady = crate::math::median(&forces)?;
    let let_go = push.breakaway?;
    let (peak, noise) = let_go.peak;
    let swing = let_go.swing(mass);
    let shown = (peak / steady - 1.0).max(0.0);
    (swing < BLOW * peak && shown.is_finite()).then(|| Excess {
        shown,
        sure: (shown - swing / steady).max(0.0),
        sd: noise / steady + 0.01,
        interaction: push.interaction.clone(),
    })
}

/// Static force: the peaks of the pushes against their own steady forces, which the scatter between pushes does not touch.
/// The pushes with the largest peaks count, those whose points let go most nearly together.
fn breakaway(pushes: &[Push], kinetic: &Estimate, mass: f64) -> Option<Estimate> {
    let mut peaks: Vec<Excess> = pushes.iter().filter_map(|push| excess_of(push, mass)).collect();
    peaks.sort_by(|a, b| b.shown.total_cmp(&a.shown));
    peaks.truncate(peaks.len().div_ceil(2));
    if peaks.is_empty() {
        return None;
    }
    let mean = |of: fn(&Excess) -> f64| peaks.iter().map(of).sum::<f64>() / peaks.len() as f64;
    let (shown, sure, own) = (mean(|p| p.shown), mean(|p| p.sure), mean(|p| p.sd));
    let spread = mean(|p| p.shown * p.shown) - shown * shown;
    let scatter = (spread.max(0.0) / peaks.len() as f64).sqrt();
    let half = 1.96 * own.hypot(scatter).hypot(relative_sd(kinetic)) * kinetic.value;
    // Static friction is not below kinetic; what a swing of the force can explain is no more than likely.
    let low = kinetic.value * (1.0 + sure) - half;
    let high = kinetic.value * (1.0 + HIDDEN[1] * shown) + half;
    let value = kinetic.value * (1.0 + 0.5 * (sure + (2.0 * HIDDEN[0] - 1.0) * shown));
    let from = peaks.into_iter().map(|p| p.interaction).collect();
    let found = Estimate::measured(value, (high - low) / (2.0 * 1.96), "N", from, "push-static");
    Some(found.with_interval([low, high]))
}
