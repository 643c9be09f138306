//! The force of friction of one link over all of its pushes, with the slope of the support taken out.

use nalgebra::{DMatrix, DVector, Vector3};

use super::Config;
use super::facts::Facts;
use super::pool::{pooled, positive, relative_sd};
use super::push::Push;
use super::resolve::STAGE;
use super::surface::{Surface, SurfacePrior, fit_surface};
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::math::bayesian_linear;

/// How much more the law is doubted where the path between a first and a last pose is guessed.
const BRIDGED: f64 = 5.0;
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
        .shape_effect
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
        radius: radius_of(&surface, prior, from),
        lift: crate::math::median(&lifts)?,
        centre: (surface.centre, surface.centre_sd),
        bridged,
        kinetic,
        trials: pushes.iter().map(|p| p.interaction.clone()).zip(trials).collect(),
        common,
    })
}

/// Share of the prior's doubt that may be left of a torsional radius that is called measured.
const TURNED: f64 = 0.6;

/// The torsional radius, which is never negative: where the pushes hardly turned the body, it is what was assumed of it.
fn radius_of(surface: &Surface, prior: &SurfacePrior, from: Vec<String>) -> Estimate {
    let (radius, sd) = surface.radius;
    let mut found = positive(radius, sd / radius, "m", from, "push-limit-surface");
    if sd / radius > TURNED * prior.radius_log_sd {
        found.status = Status::Assumed;
        found.method = "push-limit-surface, prior: the pushes hardly turned it".into();
    }
    found
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
/// Largest swing of the force, as a share of its peak, up to which the peaks of pushes are read together.
const BLOW: f64 = 0.5;
/// A peak bounds static friction from above, kinetic friction from below; a share of the value by which the bounds may lie
/// apart for them to measure it.
const CLOSE: f64 = 0.45;
/// Share by which static friction lies above kinetic friction at most pairs, beyond which a peak that a blow explains is not
/// followed.
const USUAL: f64 = 0.15;

/// One push's word on static friction, as shares of its steady force.
struct Excess {
    shown: f64,
    /// What is left of it if the tool's catching up made as much of the peak as it can.
    sure: f64,
    sd: f64,
    /// That could have made most of the peak.
    blow: bool,
    interaction: String,
}

fn excess_of(push: &Push, mass: f64) -> Option<Excess> {
    let forces: Vec<f64> = push.blocks.iter().map(|b| b.force.norm()).collect();
    let steady = crate::math::median(&forces)?;
    let let_go = push.breakaway?;
    let (peak, noise) = let_go.peak;
    let swing = let_go.swing(mass);
    let shown = (peak / steady - 1.0).max(0.0);
    shown.is_finite().then(|| Excess {
        shown,
        sure: (shown - swing / steady).max(0.0),
        sd: noise / steady + 0.01,
        blow: swing >= BLOW * peak || swing.is_nan(),
        interaction: push.interaction.clone(),
    })
}

/// Static force: the peaks of the pushes against their own steady forces, which the scatter between pushes does not touch.
/// The pushes with the largest peaks count, those whose points let go most nearly together; where all may be blows, the
/// smallest.
fn breakaway(pushes: &[Push], kinetic: &Estimate, mass: f64) -> Option<Estimate> {
    let all: Vec<Excess> = pushes.iter().filter_map(|push| excess_of(push, mass)).collect();
    let (mut blows, mut peaks): (Vec<Excess>, Vec<Excess>) = all.into_iter().partition(|e| e.blow);
    if peaks.is_empty() {
        blows.sort_by(|a, b| a.shown.total_cmp(&b.shown));
        blows.truncate(1);
        peaks = blows;
    }
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
    let least = kinetic.ci95.map_or(0.0, |ci| ci[0].max(0.0));
    let low = (kinetic.value * (1.0 + sure) - half).max(least);
    let high = kinetic.value * (1.0 + HIDDEN[1] * shown) + half;
    let likely = 0.5 * (sure + (2.0 * HIDDEN[0] - 1.0) * shown);
    let value = kinetic.value * (1.0 + likely.min(USUAL.max(sure)));
    let from: Vec<String> = peaks.into_iter().map(|p| p.interaction).collect();
    let found = Estimate::measured(value, (high - low) / (2.0 * 1.96), "N", from, "push-static");
    let mut found = found.with_interval([low, high]);
    if high - low > CLOSE * value {
        found.status = Status::Assumed;
        found.confounded = Some(Confounded {
            with: vec!["blow of the tool".into()],
            known: "friction_force.static lies between kinetic friction and the peak of the force".into(),
            experiment: "tilt the support until it slides, or push it from rest slowly with a soft finger".into(),
        });
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::estimation::push::Breakaway;
    use nalgebra::Vector2;

    /// A push at 50 mm/s against 2 N whose force rises by `rise` N/s to `peak` N.
    fn push(peak: f64, rise: f64) -> Push {
        Push {
            breakaway: Some(Breakaway {
                peak: (peak, 0.01),
                rise,
                speed: 0.05,
            }),
            ..Push::steady(Vector2::new(2.0, 0.0), Vector2::new(0.05, 0.0), 8)
        }
    }

    fn told(pushes: &[Push]) -> Estimate {
        let kinetic = Estimate::measured(2.0, 0.02, "N", Vec::new(), "push");
        breakaway(pushes, &kinetic, 0.5).expect("a word on static friction")
    }

    #[test]
    fn the_blow_of_a_stiff_finger_is_no_static_friction() {
        // v sqrt(k m) = 0.05 sqrt(40000 · 0.5) = 7 N on 2 N that hold it and drag it alike.
        for rise in [2000.0, f64::INFINITY] {
            let found = told(&[push(9.0, rise), push(7.0, rise), push(8.0, rise)]);
            let [low, high] = found.ci95.expect("an interval");
            assert_eq!(found.status, Status::Assumed);
            assert!(low <= 2.0 && high >= 7.0 && found.value < 2.4, "{found:?}");
            assert!(found.confounded.is_some());
        }
    }

    #[test]
    fn a_radius_that_no_push_turned_about_is_assumed_and_positive() {
        let prior = |radius_log_sd: f64| SurfacePrior {
            centre: Vector3::zeros(),
            centre_sd: Vector3::repeat(0.01),
            radius: 0.03,
            radius_log_sd,
            weight: 5.0,
            mass: 0.5,
        };
        for log_sd in [0.4, 0.7] {
            let surface = fit_surface(&[push(2.1, 40.0), push(2.1, 40.0)], &prior(log_sd)).expect("a surface");
            let found = radius_of(&surface, &prior(log_sd), Vec::new());
            assert_eq!(found.status, Status::Assumed, "{found:?}");
            assert!(found.ci95.is_some_and(|ci| ci[0] > 0.0), "{found:?}");
        }
    }

    #[test]
    fn a_peak_close_to_the_steady_force_bounds_static_friction() {
        let found = told(&[push(2.1, 40.0), push(2.14, 40.0), push(2.08, 40.0)]);
        let [low, high] = found.ci95.expect("an interval");
        assert_eq!(found.status, Status::Measured);
        assert!(low < 2.05 && high > 2.2 && high < 2.6, "{found:?}");
    }
}
