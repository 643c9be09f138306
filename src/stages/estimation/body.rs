//! Stiffness, centre of mass and inertia of one link.

use nalgebra::Vector3;

use super::facts::{Facts, Ground};
use super::lift::centre_of_mass;
use super::pool::{pooled, relative_sd};
use super::press::body_share;
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
    let (share, share_sd) = body_share(&facts.presses);
    let divided = |trials: Vec<(f64, f64)>| trials.iter().map(|(k, sd)| (k / share, sd / share)).collect::<Vec<_>>();
    let stiffness = divided(facts.presses.iter().map(|p| p.seen).collect());
    let middle = crate::math::median(&stiffness.iter().map(|k| k.0).collect::<Vec<_>>()).unwrap_or(0.0);
    link.stiffness = pooled(&stiffness, 0.01, middle * share_sd / share, "N/m", from.clone(), method);
    let damping = divided(facts.presses.iter().filter_map(|p| p.damping).collect());
    link.damping = pooled(&damping, 0.1, 0.0, "N·s/m", from, method);
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
