//! From facts to matter: which of mass and friction the data fix, which only their product.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::Config;
use super::coast::Shape;
use super::combine::combine;
use super::facts::{Facts, Ground};
use super::friction_force::{Sliding, sliding_of};
use super::lean::on_slope;
use super::loaded::mass_by_loads;
use super::one_speed::confound_with_damping;
use super::pool::{pooled, positive, relative_sd};
use super::solid::Solid;
use super::sticking::{coefficient_of_peaks, force_of_coefficient, force_of_tilt};
use super::surface::SurfacePrior;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::{BodyPrior, SupportFriction};
use crate::physics::LimitSurface;
use crate::twin::Link;

pub(super) const STAGE: &str = "estimation";

/// What is known or assumed of a link before its interactions are read.
#[derive(Clone, Debug)]
pub(super) struct Before<'a> {
    pub given: Option<&'a BodyPrior>,
    pub solid: Option<Solid>,
    /// Height of the centroid above the underside as first seen, m.
    pub height: f64,
    /// Friction under an even pressure on that underside.
    pub surface: Option<Arc<LimitSurface>>,
    /// Friction given in the capture.
    pub support_friction: Option<SupportFriction>,
    /// Kinetic and static friction from the table of materials, with standard deviations.
    pub table: Option<((f64, f64), (f64, f64))>,
}

impl Before<'_> {
    /// Assumed mass, kg, and standard deviation of its logarithm.
    pub fn mass(&self, config: &Config) -> (f64, f64) {
        match (self.given.and_then(|g| g.mass), &self.solid) {
            (Some(m), _) => (
                m,
                self.given.and_then(|g| g.mass_sd).map_or(0.01, |sd| sd / m).max(1e-4),
            ),
            (None, Some(solid)) => (solid.volume * config.density.0, config.density.1),
            (None, None) => (0.4, 1.2),
        }
    }

    /// What the capture says that it weighs.
    pub fn given_mass(&self) -> Option<Estimate> {
        let given = self.given?;
        Some(Estimate::known(given.mass?, given.mass_sd, "kg"))
    }

    /// Assumed kinetic friction and its standard deviation.
    pub fn kinetic(&self, config: &Config) -> (f64, f64) {
        let known = |f: SupportFriction| Some((f.kinetic?, f.kinetic_sd.unwrap_or(0.05 * f.kinetic?)));
        let given = self.support_friction.and_then(known);
        given.or(self.table.map(|t| t.0)).unwrap_or(config.friction_prior)
    }

    /// Centroid and how far the centre of mass may be from it, m, link frame.
    pub fn centre(&self) -> (Point3<f64>, Vector3<f64>) {
        match &self.solid {
            Some(s) => (s.centroid, (0.12 * s.extent).map(|x| x.max(1e-3))),
            None => (Point3::origin(), Vector3::repeat(0.03)),
        }
    }

    /// How it coasts on a support whose normal in the link frame is given: uniform density, the radius of its extent.
    pub fn shape(&self, normal: &Vector3<f64>) -> Shape {
        let torsional_radius = self.radius(normal).0;
        let about = self
            .solid
            .as_ref()
            .map(|s| (normal.dot(&(s.inertia * normal)) / s.volume).sqrt());
        Shape {
            centre: self.centre().0,
            torsional_radius,
            gyration_radius: about.unwrap_or(torsional_radius).max(1e-3),
            spread: (self.centre().1.norm() / 3.0f64.sqrt()).max(1e-4),
            height: self.height,
            surface: self.surface.clone(),
        }
    }

    /// Torsional radius of a footprint of that extent: about 0.38 of the mean side for a square.
    fn radius(&self, normal: &Vector3<f64>) -> (f64, f64) {
        let Some(solid) = &self.solid else {
            return (0.03, 0.7);
        };
        let flat = solid.extent - normal.map(f64::abs).component_mul(&solid.extent);
        (0.27 * flat.norm().max(1e-3), 0.4)
    }
}

/// Concludes mass, friction force and friction of one link from its facts and writes them into it.
pub(super) fn conclude(
    link: &mut Link,
    facts: &Facts,
    before: &Before,
    ground: &Ground,
    config: &Config,
    notices: &mut Notices,
) {
    let g = ground.gravity.norm();
    if let Some(mass) = before.given_mass() {
        link.mass = Some(mass);
    }
    weigh_in(link, facts);
    slide_down(link, facts, config);
    let facts = &on_slope(link, facts, before, ground, config);
    let mu = link.friction.kinetic.as_ref().map(|f| f.value);
    let assumed = before.mass(config).0;
    let known = link.mass.as_ref().map(|m| m.value);
    let (centre, centre_sd) = before.centre();
    let local_normal = link.pose.rotation.inverse() * ground.plane.normal;
    let (radius, radius_log_sd) = before.radius(&local_normal);
    let mut prior = SurfacePrior {
        centre: centre.coords,
        centre_sd,
        radius,
        radius_log_sd,
        weight: g * known.unwrap_or(assumed),
        mass: known.unwrap_or(assumed),
    };
    if link.mass.is_none() {
        link.mass = mass_by_loads(&facts.pushes, &prior, g, config);
    }
    let mass = link.mass.as_ref().map(|m| m.value);
    prior.mass = mass.unwrap_or(assumed);
    prior.weight = g * prior.mass;
    let weight_for = |force: f64| g * mass.unwrap_or_else(|| force / (g * mu.unwrap_or(before.kinetic(config).0)));
    let mut sliding = None;
    // The load that the tool adds counts against the weight, which follows from the force: three rounds settle it.
    for round in 0..3 {
        sliding = sliding_of(facts, &prior, config, (round == 2).then_some(&mut *notices), &link.name);
        let Some(found) = &sliding else { break };
        prior.weight = weight_for(found.kinetic.value);
        prior.mass = prior.weight / g;
    }
    if let Some(sliding) = sliding {
        let guessed = mass.is_none() && mu.is_none();
        write_sliding(link, &sliding, guessed, prior.weight);
        write_friction_centre(link, &sliding, &(centre.coords, centre_sd), &local_normal);
        // Of a shape that stands on the support dry friction is known to be what resists.
        if before.solid.is_none() && mass.is_none() {
            confound_with_damping(link, facts, notices);
        }
        let tilted = link.friction.static_.is_some();
        part(link, before, g, config);
        if tilted {
            force_of_tilt(link, g);
        }
        combine(link, facts, &sliding, before, g, config, notices);
        if !tilted {
            coefficient_of_peaks(link, g);
        }
        leave_open(link);
    } else if link.friction.kinetic.is_none() {
        note_given_friction(link, before);
    } else {
        force_of_coefficient(link, g);
    }
}

/// Mass from weighings in which nothing else came along, else from pushes in which inertia showed.
fn weigh_in(link: &mut Link, facts: &Facts) {
    let alone: Vec<_> = facts.weighings.iter().filter(|w| w.along.is_empty()).collect();
    let trials: Vec<(f64, f64)> = alone.iter().map(|w| (w.mass, w.sd)).collect();
    let from = alone.iter().map(|w| w.interaction.clone()).collect();
    if let Some(mass) = pooled(&trials, 5e-4, 0.0, "kg", from, "lift") {
        link.mass = Some(mass);
        return;
    }
    // What was stated beforehand is better known than what pushes tell by the way.
    if link.mass.is_some() {
        return;
    }
    let trials: Vec<(f64, f64)> = facts.driven().iter().map(|a| a.mass).collect();
    let from = facts.driven().iter().map(|a| a.interaction.clone()).collect();
    if let Some(mass) = pooled(&trials, 5e-3, 0.0, "kg", from, "accelerated-push") {
        link.mass = Some(mass);
    }
}

/// Friction coefficients from tilts (eqs. 3 and 4) and from coasting.
fn slide_down(link: &mut Link, facts: &Facts, config: &Config) {
    let from: Vec<String> = facts.slides.iter().map(|s| s.interaction.clone()).collect();
    let of = |pick: fn(&super::tilt::Slide) -> (f64, f64)| facts.slides.iter().map(pick).collect::<Vec<_>>();
    link.friction.static_ = pooled(
        &of(|s| s.static_),
        config.friction_scatter,
        0.0,
        "1",
        from.clone(),
        "tilt-static",
    );
    let coasted: Vec<(f64, f64)> = facts.coasts.iter().map(|c| c.kinetic).collect();
    let method = match (facts.slides.is_empty(), coasted.is_empty()) {
        (_, true) => "tilt-slide",
        (true, false) => "coast",
        (false, false) => "tilt-slide, coast",
    };
    let trials = [of(|s| s.kinetic), coasted].concat();
    let from = [from, facts.coasts.iter().map(|c| c.interaction.clone()).collect()].concat();
    link.friction.kinetic = pooled(&trials, config.friction_scatter, 0.0, "1", from, method);
}

/// Ends of an interval that are this many times apart: such a number is guessed, whatever it was read from.
const OPEN: f64 = 4.0;

/// What the data hardly fix is no measurement.
fn leave_open(link: &mut Link) {
    let numbers = [
        link.mass.as_mut(),
        link.friction.kinetic.as_mut(),
        link.friction.static_.as_mut(),
    ];
    for number in numbers.into_iter().flatten().filter(|e| e.is_measured()) {
        if number.ci95.is_some_and(|[low, high]| high > OPEN * low) {
            number.status = Status::Assumed;
        }
    }
}

fn write_sliding(link: &mut Link, sliding: &Sliding, guessed_weight: bool, weight: f64) {
    let mut kinetic = sliding.kinetic.clone();
    // A guessed weight enters through the load that the tool adds; its doubt is that of the guess.
    let extra = if guessed_weight {
        0.7 * sliding.lift.abs() / weight * kinetic.value
    } else {
        0.0
    };
    widen(&mut kinetic, extra);
    link.friction_force.kinetic = Some(kinetic);
    link.friction_force.static_ = sliding.static_.clone();
    link.friction.torsional_radius = Some(sliding.radius.clone());
}

/// Distance from where the shape has it, in standard deviations, beyond which the friction centre is none: what turns about a
/// hinge, or is held, seems to rub far beside itself.
const ASTRAY: f64 = 4.0;
/// Doubt of the friction centre from uneven pressure, as a share of what the shape leaves open.
const UNEVEN: f64 = 0.03;

/// The friction centre stands for the centre of mass where pushes pin it well below what the shape leaves open;
/// along the support's normal it says nothing. The pressure balances the weight below the centre of mass however uneven it
/// is; how it turns the body does depend on it, hence the floor.
fn write_friction_centre(
    link: &mut Link,
    sliding: &Sliding,
    (shape, spread): &(Vector3<f64>, Vector3<f64>),
    normal: &Vector3<f64>,
) {
    let (value, sd) = sliding.centre;
    if (0..3).any(|k| (value[k] - shape[k]).abs() > ASTRAY * spread[k]) {
        return;
    }
    let pinned = (0..3)
        .filter(|&k| normal[k].abs() < 0.5)
        .all(|k| sd[k] < 0.5 * spread[k]);
    // From poses before and after alone the centre comes out some millimetres off: too little to call it measured.
    if pinned && !sliding.bridged {
        let sd = [0, 1, 2].map(|k| sd[k].hypot(if normal[k].abs() < 0.5 { UNEVEN } else { 0.1 } * spread[k]));
        let from = sliding.kinetic.from.clone();
        let method = "push-limit-surface; the direction along gravity from the shape";
        link.com = Some(Estimate::measured(value, sd, "m", from, method));
    }
}

fn widen(estimate: &mut Estimate, extra: f64) {
    estimate.sd = estimate.sd.map(|sd| sd.hypot(extra));
    estimate.ci95 = estimate.ci95.map(|[low, high]| {
        let v = estimate.value;
        [v - (v - low).hypot(1.96 * extra), v + (high - v).hypot(1.96 * extra)]
    });
}

pub(super) fn joined(a: &Estimate, b: &Estimate) -> Vec<String> {
    let mut from = a.from.clone();
    from.extend(b.from.iter().filter(|n| !a.from.contains(n)).cloned());
    from
}

/// Parts mass and friction where the data allow it, and says so where they do not.
fn part(link: &mut Link, before: &Before, g: f64, config: &Config) {
    let Some(force) = link.friction_force.kinetic.clone() else {
        return;
    };
    match (link.mass.clone(), link.friction.kinetic.clone()) {
        (Some(mass), tilt) => {
            let relative = relative_sd(&force).hypot(relative_sd(&mass));
            let pushed = positive(
                force.value / (mass.value * g),
                relative,
                "1",
                joined(&force, &mass),
                "push-kinetic",
            );
            link.friction.kinetic = Some(match tilt {
                Some(tilt) => agree(&tilt, &pushed),
                None => pushed,
            });
        }
        (None, Some(mu)) => {
            let relative = relative_sd(&force).hypot(relative_sd(&mu));
            link.mass = Some(positive(
                force.value / (mu.value * g),
                relative,
                "kg",
                joined(&force, &mu),
                "push-kinetic",
            ));
        }
        (None, None) => unparted(link, &force, before, g, config),
    }
}

/// Two estimates of one coefficient, weighted by their intervals; the interval widens where they disagree.
fn agree(a: &Estimate, b: &Estimate) -> Estimate {
    let sds = [relative_sd(a) * a.value, relative_sd(b) * b.value];
    let weights = sds.map(|s| s.max(1e-12).powi(-2));
    let total = weights[0] + weights[1];
    let value = (weights[0] * a.value + weights[1] * b.value) / total;
    let excess = ((a.value - b.value).powi(2) / (sds[0].powi(2) + sds[1].powi(2))).max(1.0);
    let sd = (excess / total).sqrt();
    Estimate::measured(value, sd, "1", joined(a, b), &format!("{}, {}", a.method, b.method))
}

/// Only the product `mu m g` is measured: both factors stay assumed, and say so.
fn unparted(link: &mut Link, force: &Estimate, before: &Before, g: f64, config: &Config) {
    let (mu, mu_sd) = before.kinetic(config);
    let (mass, mass_log_sd) = before.mass(config);
    let mu_log_sd = (mu_sd / mu).max(1e-3);
    // Two opinions on log m: the shape's, and the force divided by the assumed friction.
    let weights = [mass_log_sd.powi(-2), mu_log_sd.powi(-2) + 0.0];
    let log = (weights[0] * mass.ln() + weights[1] * (force.value / (mu * g)).ln()) / (weights[0] + weights[1]);
    let relative = (weights[0] + weights[1]).recip().sqrt().hypot(relative_sd(force));
    let confounded = |other: &str| Confounded {
        with: vec![other.into()],
        known: "friction_force.kinetic".into(),
        experiment: "lift it once (weigh it), or tilt the support until it slides".into(),
    };
    let given = before.support_friction.is_some_and(|f| f.kinetic.is_some());
    let given_static = before.support_friction.and_then(|f| Some((f.static_?, f.static_sd)));
    let mut found = positive(log.exp(), relative, "kg", force.from.clone(), "push-kinetic");
    let value = force.value / (log.exp() * g);
    let mut friction = positive(value, relative, "1", force.from.clone(), "push-kinetic");
    if given {
        friction = Estimate::known(mu, Some(mu_sd), "1");
        let relative = relative_sd(force).hypot(mu_log_sd);
        found = positive(
            force.value / (mu * g),
            relative,
            "kg",
            force.from.clone(),
            "push-kinetic",
        );
    } else {
        found.status = Status::Assumed;
        friction.status = Status::Assumed;
        found.confounded = Some(confounded("friction.kinetic"));
        friction.confounded = Some(confounded("mass"));
        let source = if before.table.is_some() {
            "materials-table"
        } else {
            "prior"
        };
        found.method = format!("push-kinetic, {source}");
        friction.method.clone_from(&found.method);
    }
    link.mass = Some(found);
    link.friction.kinetic = Some(friction);
    if let (Some((value, sd)), None) = (given_static, &link.friction.static_) {
        link.friction.static_ = Some(Estimate::known(value, sd, "1"));
    } else if let (Some((_, s)), None) = (before.table, &link.friction.static_) {
        link.friction.static_ = Some(Estimate::assumed(s.0, s.1, "1", "materials-table"));
    }
}

/// Friction given in the capture is passed on for a body that was touched.
fn note_given_friction(link: &mut Link, before: &Before) {
    if let (Some(f), true) = (before.support_friction, link.mass.is_some()) {
        if let Some(kinetic) = f.kinetic {
            link.friction.kinetic = Some(Estimate::known(kinetic, f.kinetic_sd, "1"));
        }
        if let (Some(value), None) = (f.static_, &link.friction.static_) {
            link.friction.static_ = Some(Estimate::known(value, f.static_sd, "1"));
        }
    }
}
