//! Friction of a link: force and coefficient, each from the other.

use super::pool::{positive, relative_sd};
use super::resolve::joined;
use crate::base::{Estimate, Status};
use crate::twin::Link;

/// The force of kinetic friction of what tilts or coasting alone told, where the weight is known: then a push of it can be foretold.
pub(super) fn force_of_coefficient(link: &mut Link, g: f64) {
    if let (Some(mass), Some(mu), None) = (&link.mass, &link.friction.kinetic, &link.friction_force.kinetic) {
        let relative = relative_sd(mass).hypot(relative_sd(mu));
        let mut force = positive(mu.value * mass.value * g, relative, "N", joined(mu, mass), &mu.method);
        if mass.status == Status::Assumed || mu.status == Status::Assumed {
            force.status = Status::Assumed;
        }
        link.friction_force.kinetic = Some(force);
    }
}

/// Static friction from tilts says more of the force than the peaks of pushes do.
pub(super) fn force_of_tilt(link: &mut Link, g: f64) {
    if let (Some(mass), Some(mu)) = (&link.mass, &link.friction.static_) {
        let relative = relative_sd(mass).hypot(relative_sd(mu));
        let force = positive(mu.value * mass.value * g, relative, "N", joined(mu, mass), &mu.method);
        link.friction_force.static_ = Some(force);
    }
}

/// The coefficient by the peaks of pushes, over the weight that was found in the end: it is known no better than that.
pub(super) fn coefficient_of_peaks(link: &mut Link, g: f64) {
    let given = link.friction.static_.is_some();
    let (Some(s), Some(mass), false) = (&link.friction_force.static_, &link.mass, given) else {
        return;
    };
    let per = (mass.value * g).recip();
    let sd = s.sd.unwrap_or(0.0).hypot(relative_sd(mass) * s.value);
    let mut found = Estimate::measured(s.value * per, sd * per, "1", joined(s, mass), "push-static");
    (found.status, found.confounded) = (s.status, s.confounded.clone());
    if mass.status == Status::Assumed {
        found.status = Status::Assumed;
        found.confounded = found.confounded.or_else(|| mass.confounded.clone());
    }
    // The ends of a weight that hardly anything tells are factors, not distances.
    let [light, heavy] = mass
        .ci95
        .unwrap_or([mass.value; 2])
        .map(|end| (end / mass.value).max(1e-6).ln());
    let [low, high] = s.ci95.unwrap_or([s.value; 2]).map(|end| (end / s.value).max(1e-6).ln());
    let ends = [-low.hypot(heavy), high.hypot(light)].map(|log| s.value * per * log.exp());
    link.friction.static_ = Some(found.with_interval(ends));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_of_what_only_coasted_is_that_of_its_weight() {
        let link = serde_json::json!({ "name": "slab", "pose": [0, 0, 0, 0, 0, 0, 1], "collision": [], "symmetry": [],
            "principal_views": [] });
        let mut link: Link = serde_json::from_value(link).expect("a link");
        force_of_coefficient(&mut link, 10.0);
        assert!(link.friction_force.kinetic.is_none());
        link.friction.kinetic = Some(Estimate::measured(0.4, 0.008, "1", vec!["push".into()], "coast"));
        link.mass = Some(Estimate::measured(0.5, 0.005, "kg", vec!["lift".into()], "lift"));
        force_of_coefficient(&mut link, 10.0);
        let force = link.friction_force.kinetic.clone().expect("a force");
        assert!((force.value - 2.0).abs() < 1e-3 && force.is_measured(), "{force:?}");
        assert!((relative_sd(&force) - 0.0224).abs() < 1e-3, "{force:?}");
        assert_eq!(force.from, ["push", "lift"]);
    }

    #[test]
    fn a_coefficient_is_known_no_better_than_the_weight() {
        let link = serde_json::json!({ "name": "slab", "pose": [0, 0, 0, 0, 0, 0, 1], "collision": [], "symmetry": [],
            "principal_views": [] });
        let mut link: Link = serde_json::from_value(link).expect("a link");
        link.friction_force.static_ = Some(Estimate::measured(2.0, 0.1, "N", vec!["push".into()], "push-static"));
        let mut mass = Estimate::measured(0.5, 0.5, "kg", vec!["push".into()], "prior").with_interval([0.05, 5.0]);
        mass.status = Status::Assumed;
        link.mass = Some(mass);
        coefficient_of_peaks(&mut link, 10.0);
        let found = link.friction.static_.expect("a coefficient");
        let [low, high] = found.ci95.expect("an interval");
        assert!((found.value - 0.4).abs() < 1e-12 && found.status == Status::Assumed);
        assert!(low < 0.0401 && high > 3.99, "[{low}, {high}]");
    }
}
