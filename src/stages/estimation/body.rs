//! Stiffness, centre of mass and inertia of one link.

use nalgebra::Vector3;

use super::coast::Shape;
use super::facts::{Facts, Ground};
use super::lift::centre_of_mass;
use super::pool::{pooled, relative_sd};
use super::press::{Press, Stiffer, stiffer_than_felt};
use super::resolve::Before;
use super::spin::write_inertia;
use crate::base::Estimate;
use crate::twin::{LedgerEntry, Link};

/// Scatter of stiffness from press to press that is expected before any is seen, a share.
const SCATTER: f64 = 0.015;

/// The bounds of what lies evenly within them, in its standard deviations: half of the root of 12. They count in full and
/// beside the rest, since a sensor does not lie anywhere between: readings of their moment are at one end, means of the sample
/// before at the other.
const BOUNDS: f64 = 1.732;
/// Standard deviations from which on damping is told.
const TOLD: f64 = 3.0;

/// Stiffness and damping from the presses of a link.
pub(super) fn write_presses(link: &mut Link, facts: &Facts) {
    // A press that took dry friction for stiffness and damping is overruled by those that told them apart, if they are not
    // the few: a spot has dry friction in every press.
    let dry = 2 * facts.presses.iter().filter(|p| p.dry).count() >= facts.presses.len().max(1);
    let presses: Vec<Press> = facts.presses.iter().filter(|p| p.dry == dry).cloned().collect();
    let from: Vec<String> = presses.iter().map(|p| p.interaction.clone()).collect();
    let tracked = presses.iter().any(|p| p.share.is_some());
    let method = if tracked {
        "press, frame tracked"
    } else {
        "press, tool travel"
    };
    let tip = stiffer_than_felt(&presses);
    let felt: Vec<(f64, f64)> = presses.iter().map(|p| p.seen).collect();
    link.stiffness = pooled(&felt, SCATTER, 0.0, "N/m", from.clone(), method).map(|e| stiffer(e, &tip, 1));
    if let Some(all) = &link.stiffness {
        let without = |k: usize| {
            let rest: Vec<(f64, f64)> = (0..felt.len()).filter(|i| *i != k).map(|i| felt[i]).collect();
            pooled(&rest, SCATTER, 0.0, "N/m", Vec::new(), method).map(|e| stiffer(e, &tip, 1))
        };
        let entries = (0..felt.len()).filter_map(|k| {
            let less = without(k)?;
            Some(LedgerEntry {
                interaction: from[k].clone(),
                quantity: "stiffness".into(),
                moved: (all.value / less.value).ln(),
                doubt_without: relative_sd(&less) / relative_sd(all).max(1e-12),
            })
        });
        link.ledger.extend(entries.collect::<Vec<_>>());
    }
    // A body with damper behind an elastic tip moves by the share r of the travel, and its force is felt r times: r².
    link.damping = damping_of(&presses, from, method).map(|e| stiffer(e, &tip, 2));
}

/// Damping as the tool feels it, where all presses together tell it: those that tell it alone are those that tell too much.
fn damping_of(presses: &[Press], from: Vec<String>, method: &str) -> Option<Estimate> {
    let told = presses.iter().filter_map(|p| Some((p.damping?, p.lagging)));
    let (trials, shared): (Vec<_>, Vec<f64>) = told
        .map(|((value, sd), share)| ((value, sd * (1.0 - share).sqrt()), sd * share.sqrt()))
        .unzip();
    let common = shared.iter().sum::<f64>() / shared.len().max(1) as f64;
    let found = pooled(&trials, 2.0 * SCATTER, 0.0, "N·s/m", from, method)?;
    let [low, high] = found.ci95?;
    let ci95 = [low - BOUNDS * common, high + BOUNDS * common];
    let sd = found.sd?.hypot(common);
    let told = found.value > TOLD * sd;
    told.then_some(Estimate {
        sd: Some(sd),
        ..found.with_interval(ci95)
    })
}

/// What the tool feels as what the body has, `power` times the factor of the tip.
fn stiffer(felt: Estimate, tip: &Stiffer, power: i32) -> Estimate {
    let factor = tip.value.powi(power);
    let [low, high] = felt.ci95.unwrap_or([felt.value; 2]);
    let side = |end: f64, of_tip: f64| ((end - felt.value) * factor).hypot((of_tip.powi(power) - factor) * felt.value);
    let value = felt.value * factor;
    let ci95 = [value - side(low, tip.ci95[0]), value + side(high, tip.ci95[1])];
    Estimate {
        value,
        sd: Some((ci95[1] - ci95[0]) / (2.0 * 1.96)),
        ..felt
    }
    .with_interval(ci95)
}

/// Centre of mass: from the moments of a lift, else the centroid of the shape.
pub(super) fn write_centre(link: &mut Link, facts: &Facts, before: &Before, _ground: &Ground) {
    if link.mass.is_none() {
        return;
    }
    let (centroid, spread) = before.centre();
    let alone = facts.weighings.iter().filter(|w| w.along.is_empty());
    let moments: Vec<(Vector3<f64>, f64)> = alone.clone().flat_map(|w| w.moments.iter().copied()).collect();
    if let Some((value, sd)) = (!moments.is_empty())
        .then(|| centre_of_mass(&moments, &centroid, &spread))
        .flatten()
    {
        let from = alone.map(|w| w.interaction.clone()).collect();
        let method = "lift-torque; the direction along gravity from the shape";
        link.com = Some(Estimate::measured(value, sd, "m", from, method));
    }
}

/// Fills in what a simulator needs of a link that has a mass: the centroid of its shape, and its inertia.
pub(super) fn fill_inertial(link: &mut Link, before: &Before, facts: Option<&Facts>, shape: Option<&Shape>) {
    if link.mass.is_none() || before.solid.is_none() {
        return;
    }
    let (centroid, spread) = before.centre();
    if link.com.is_none() {
        link.com = Some(Estimate::assumed(
            [centroid.x, centroid.y, centroid.z],
            spread.into(),
            "m",
            "shape-uniform-density",
        ));
    }
    let (spins, twists) = facts.map_or((&[][..], &[][..]), |f| (&f.spins, &f.twists));
    let Some(shape) = shape else { return };
    // Where pushes make no sense together, the shape still stands.
    if write_inertia(link, before, (spins, twists), shape).is_none() {
        write_inertia(link, before, (&[], twists), shape);
    }
}
