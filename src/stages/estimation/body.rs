//! Stiffness, centre of mass and inertia of one link.

use nalgebra::Vector3;

use super::facts::{Facts, Ground};
use super::lift::centre_of_mass;
use super::pool::{pooled, relative_sd};
use super::press::{Stiffer, stiffer_than_felt};
use super::resolve::Before;
use crate::base::{Estimate, Status};
use crate::twin::Link;

/// Stiffness and damping from the presses of a link.
pub(super) fn write_presses(link: &mut Link, facts: &Facts) {
    let from: Vec<String> = facts.presses.iter().map(|p| p.interaction.clone()).collect();
    let tracked = facts.presses.iter().any(|p| p.share.is_some());
    let method = if tracked {
        "press, frame tracked"
    } else {
        "press, tool travel"
    };
    let tip = stiffer_than_felt(&facts.presses);
    let felt: Vec<(f64, f64)> = facts.presses.iter().map(|p| p.seen).collect();
    link.stiffness = pooled(&felt, 0.01, 0.0, "N/m", from.clone(), method).map(|e| stiffer(e, &tip, 1));
    let damping: Vec<(f64, f64)> = facts.presses.iter().filter_map(|p| p.damping).collect();
    // A body with damper behind an elastic tip moves by the share r of the travel, and its force is felt r times: r².
    link.damping = pooled(&damping, 0.1, 0.0, "N·s/m", from, method).map(|e| stiffer(e, &tip, 2));
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

/// Fills in what a simulator needs of a link that has a mass: centroid and inertia of its shape at uniform density.
pub(super) fn fill_inertial(link: &mut Link, before: &Before) {
    let (Some(mass), Some(solid)) = (&link.mass, &before.solid) else {
        return;
    };
    let (centroid, spread) = before.centre();
    let shape = "shape-uniform-density";
    if link.com.is_none() {
        link.com = Some(Estimate::assumed(
            [centroid.x, centroid.y, centroid.z],
            spread.into(),
            "m",
            shape,
        ));
    }
    let scaled = solid.inertia * (mass.value / solid.volume);
    let i = |r: usize, c: usize| scaled[(r, c)];
    let value = [i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)];
    // Uniform density is a guess: hollow or bottom-heavy things differ by some 30 %.
    let relative = relative_sd(mass).hypot(0.3);
    let diagonal = scaled.trace() / 3.0;
    let sd = value.map(|v| relative * v.abs().max(0.1 * diagonal));
    let inertia = Estimate::assumed(value, sd, "kg·m²", shape);
    link.inertia = Some(Estimate {
        status: Status::Assumed,
        from: mass.from.clone(),
        ..inertia
    });
}
