//! Writes what the snapshots told, and what they did not, into a link of the twin.

use super::Config;
use super::bench::Bench;
use super::gather::STAGE;
use super::posterior::{Marginal, Posterior};
use super::report::ThingResult;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::Capture;
use crate::twin::Model;

const METHOD: &str = "bayesian-optimisation";

/// Friction, rolling resistance and friction against the tool as far as the snapshots fix them; the mass from recorded
/// forces, else assumed and said to be out of reach.
pub(super) fn write_link(
    capture: &Capture,
    model: &mut Model,
    bench: &Bench,
    posterior: &Posterior,
    thing: &ThingResult,
    config: &Config,
    notices: &mut Notices,
) {
    let from: Vec<String> = bench.fitted().iter().map(|i| bench.trials[*i].name.clone()).collect();
    let volume = model
        .twin
        .link(&bench.name)
        .and_then(|l| l.mesh.as_ref())
        .and_then(|m| model.meshes.get(m))
        .map(|m| m.volume().abs());
    let gravity = capture.gravity.norm();
    let known_support = capture.support.as_ref().is_some_and(|s| s.friction.is_some());
    let mass = mass_of(bench, posterior, config);
    let Some(link) = model.twin.link_mut(&bench.name) else {
        return;
    };
    let estimate = |k: usize, unit: &str| of_marginal(&thing.marginals[k], thing.fixed[k], unit, &from);
    let kinetic = estimate(0, "1");
    if link
        .friction
        .kinetic
        .as_ref()
        .is_none_or(|e| e.status == Status::Assumed)
        && !known_support
    {
        if link
            .friction
            .static_
            .as_ref()
            .is_none_or(|e| e.status == Status::Assumed)
        {
            link.friction.static_ = Some(static_from(&kinetic));
        }
        link.friction.kinetic = Some(kinetic);
    }
    link.friction.rolling = Some(estimate(1, "m"));
    link.friction.tool = link
        .friction
        .tool
        .take()
        .filter(|e| e.is_measured())
        .or(Some(estimate(2, "1")));
    let prior = capture.prior(&bench.name).and_then(|b| b.mass.map(|m| (m, b.mass_sd)));
    let open = link.mass.as_ref().is_none_or(|e| e.status == Status::Assumed);
    match (prior, mass) {
        _ if !open => {}
        (Some((value, sd)), _) => link.mass = Some(Estimate::known(value, sd, "kg")),
        (None, Some(found)) => link.mass = Some(found),
        (None, None) => {
            link.mass = Some(assumed_mass(volume.unwrap_or(0.0), config));
            notices.note(
                STAGE,
                &bench.name,
                "its mass is assumed: a tool on its path moves a heavy thing and a light one alike",
            );
        }
    }
    if link.friction_force.kinetic.is_none()
        && let (Some(mass), Some(mu)) = (&link.mass, &link.friction.kinetic)
    {
        link.friction_force.kinetic = Some(product(mass, mu, gravity));
    }
    say(bench, posterior, thing, notices);
}

fn say(bench: &Bench, posterior: &Posterior, thing: &ThingResult, notices: &mut Notices) {
    if bench.tips() {
        let words = "it fell over in some trials: at the edge of tipping what a simulation makes of friction is assumed, not measured; \
                     lower or slower strokes that only slide it would tell";
        notices.warn(STAGE, &bench.name, words);
    }
    for (k, name) in super::space::NAMES.iter().enumerate() {
        let said = thing.fixed[k] || (k == 0 && bench.tips());
        if !said {
            notices.note(
                STAGE,
                &bench.name,
                format!("the snapshots do not fix its {name}: the interval is wide, or mostly the prior's"),
            );
        }
    }
    if posterior.power < 1.0 {
        let words = format!(
            "few parameter points explain the snapshots: the likelihood was raised to the power {:.2}, which widens the intervals",
            posterior.power
        );
        notices.warn(STAGE, &bench.name, words);
    }
    if thing.share > 0.4 {
        let words = format!(
            "the simulation misses the snapshots by some {:.0} % of the travel",
            100.0 * thing.share
        );
        notices.warn(STAGE, &bench.name, words);
    }
}

fn of_marginal(m: &Marginal, fixed: bool, unit: &str, from: &[String]) -> Estimate {
    let found = Estimate::measured(m.median, m.sd, unit, from.to_vec(), METHOD).with_interval(m.ci95);
    Estimate {
        status: if fixed { Status::Measured } else { Status::Assumed },
        ..found
    }
}

/// Snapshots tell how far a thing slid, not when it began to: static friction is at least kinetic friction.
fn static_from(kinetic: &Estimate) -> Estimate {
    let [low, high] = kinetic.ci95.unwrap_or([kinetic.value; 2]);
    let sd = kinetic.sd.unwrap_or(0.0).hypot(0.1 * kinetic.value);
    Estimate::assumed(1.05 * kinetic.value, sd, "1", METHOD).with_interval([low, 1.25 * high])
}

fn assumed_mass(volume: f64, config: &Config) -> Estimate {
    let (density, log_sd) = config.density;
    let value = if volume > 0.0 { density * volume } else { 0.1 };
    let factor = (1.96 * log_sd).exp();
    Estimate::assumed(value, value * log_sd, "kg", "density of a filled household object")
        .with_interval([value / factor, value * factor])
        .with_confounded(Confounded {
            with: vec!["mass".into(), "friction_force.kinetic".into()],
            known: "friction.kinetic".into(),
            experiment:
                "weigh it (lift it with a force sensor), or record the tool's force: on a prescribed path the mass \
                         scales every force and moves nothing"
                    .into(),
        })
}

/// `mu m g`, as sure as its factors.
fn product(mass: &Estimate, mu: &Estimate, gravity: f64) -> Estimate {
    let value = mass.value * mu.value * gravity;
    let log_sd = |e: &Estimate| e.ci95.map_or(0.0, |[l, h]| (h / l.max(1e-12)).ln() / (2.0 * 1.96));
    let spread = log_sd(mass).hypot(log_sd(mu));
    let factor = (1.96 * spread).exp();
    let measured = mass.status != Status::Assumed && mu.status != Status::Assumed;
    let found = Estimate::measured(value, value * spread, "N", mu.from.clone(), METHOD)
        .with_interval([value / factor, value * factor]);
    Estimate {
        status: if measured { Status::Measured } else { Status::Assumed },
        ..found
    }
}

/// The mass as the recorded forces tell it, over the posterior; nothing where they leave most of the prior's spread.
fn mass_of(bench: &Bench, posterior: &Posterior, config: &Config) -> Option<Estimate> {
    let (middle, variance) = posterior.log_mass()?;
    let log_sd = variance.sqrt();
    if log_sd > config.contraction * config.density.1 {
        return None;
    }
    let felt = bench
        .fitted()
        .into_iter()
        .filter(|i| bench.trials[*i].impulse.is_some());
    let from = felt.map(|i| bench.trials[i].name.clone()).collect();
    let (mass, factor) = (middle.exp(), (1.96 * log_sd).exp());
    let method = "impulse of the tool, bayesian-optimisation";
    Some(Estimate::measured(mass, mass * log_sd, "kg", from, method).with_interval([mass / factor, mass * factor]))
}
