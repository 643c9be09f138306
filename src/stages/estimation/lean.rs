//! Pushes along a support that is known not to be level: the weight pulls along it too.
//!
//! On a slope a tool gives `f h - m g`, with the friction force `f` along the motion `h` and the part `g` of gravity that
//! lies in the support. Pushes along several headings weigh the body: the force that they need falls by `m g . h`.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use super::Config;
use super::facts::{Facts, Ground};
use super::lift::Weighing;
use super::pool::positive;
use super::push::{Block, Push};
use super::resolve::Before;
use crate::math::weighted_linear;
use crate::twin::Link;

/// Share of gravity that lies in the support below which it is level.
const LEVEL: f64 = 1e-3;
/// How far friction repeats from push to push, as a share.
const REPEATS: f64 = 0.02;
/// Fewest pushes that weigh.
const FEWEST: usize = 4;
/// A body turns where a point this far from its middle, m, moves by this share of its speed.
const ABOUT: f64 = 0.05;
const STRAIGHT: f64 = 0.15;
/// Doubt of a weight, as a share, above which a slope does not tell it.
const TOLD: f64 = 0.25;

/// What was found of a link, its pushes without what its weight does along the support; weighs it by that where nothing
/// else has.
pub(super) fn on_slope<'a>(
    link: &mut Link,
    facts: &'a Facts,
    before: &Before,
    ground: &Ground,
    config: &Config,
) -> Cow<'a, Facts> {
    let lean = ground.plane.flat(&ground.gravity);
    if lean.norm() < LEVEL * ground.gravity.norm() || facts.pushes.is_empty() {
        return Cow::Borrowed(facts);
    }
    let told = weighed(&facts.pushes, &lean).filter(|_| link.mass.is_none());
    let mut facts = facts.clone();
    if let Some((mass, log_sd)) = told {
        link.mass = Some(positive(
            mass,
            log_sd,
            "kg",
            names(&facts.pushes),
            "pushes along a slope",
        ));
        // One word for all of them, under the name of the first.
        facts.weighings.extend(facts.pushes.first().map(|push| Weighing {
            interaction: push.interaction.clone(),
            mass,
            sd: mass * log_sd,
            along: Vec::new(),
            moments: Vec::new(),
        }));
    }
    let mass = link.mass.as_ref().map_or(before.mass(config).0, |m| m.value);
    for push in &mut facts.pushes {
        without_weight(push, mass * lean, &before.centre().0.coords, ground);
    }
    Cow::Owned(facts)
}

fn names(pushes: &[Push]) -> Vec<String> {
    pushes.iter().map(|p| p.interaction.clone()).collect()
}

/// Mass and the standard deviation of its logarithm by how the force goes with the heading; nothing where the headings
/// hardly differ.
fn weighed(pushes: &[Push], lean: &Vector2<f64>) -> Option<(f64, f64)> {
    let mean = |push: &Push| {
        // What turns asks less of a tool that pushes beside its middle.
        let straight = |b: &&Block| b.spin.abs() * ABOUT < STRAIGHT * b.velocity.norm();
        let heading = |b: &Block| b.velocity.try_normalize(1e-9);
        let rows: Vec<(f64, f64)> = push
            .blocks
            .iter()
            .filter(straight)
            .filter_map(|b| heading(b).map(|h| (-lean.dot(&h), b.force.dot(&h))))
            .collect();
        let n = rows.len() as f64;
        (!rows.is_empty()).then(|| {
            (
                rows.iter().map(|r| r.0).sum::<f64>() / n,
                rows.iter().map(|r| r.1).sum::<f64>() / n,
            )
        })
    };
    let means: Vec<(f64, f64)> = pushes.iter().filter_map(mean).collect();
    let usual = means.iter().map(|m| m.1).sum::<f64>() / means.len().max(1) as f64;
    let rows = DMatrix::from_fn(means.len(), 2, |i, k| if k == 0 { 1.0 } else { means[i].0 });
    let forces = DVector::from_iterator(means.len(), means.iter().map(|m| m.1));
    let weights = DVector::from_element(means.len(), (REPEATS * usual).powi(-2));
    let fit = weighted_linear(&rows, &forces, &weights).filter(|_| means.len() >= FEWEST)?;
    let left = (&rows * &fit.x - &forces).norm_squared() / (means.len() - 2) as f64;
    let worse = (left.sqrt() / (REPEATS * usual)).max(1.0);
    let (mass, sd) = (fit.x[1], worse * fit.covariance[(1, 1)].max(0.0).sqrt());
    (mass > 0.0 && sd < TOLD * mass).then(|| (mass, sd / mass))
}

/// Takes what the `weight` does along the support out of a push; it acts at `centre` (link frame).
fn without_weight(push: &mut Push, weight: Vector2<f64>, centre: &Vector3<f64>, ground: &Ground) {
    for block in &mut push.blocks {
        block.force += weight;
        block.moment = block.moment.map(|m| m + (block.axes * centre).perp(&weight));
    }
    let along = ground.plane.flat(&push.direction);
    if let Some(breakaway) = &mut push.breakaway {
        breakaway.peak.0 = (breakaway.peak.0 + along.dot(&weight)).max(0.0);
    }
}
