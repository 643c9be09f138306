//! Groups that were lifted as one: what of them is known with their weight.

use std::collections::BTreeSet;

use super::lift::Weighing;
use super::pool::{positive, relative_sd};
use super::share::WEIGHED;
use crate::base::Estimate;
use crate::twin::Twin;

/// A group that was weighed as one.
pub(super) struct Whole {
    /// The links.
    pub(super) parts: BTreeSet<String>,
    /// Their mass, and its standard deviation, kg.
    pub(super) mass: f64,
    pub(super) sd: f64,
    interaction: String,
}

impl Whole {
    pub(super) fn of(name: &str, weighing: &Weighing) -> Self {
        let mut parts: BTreeSet<String> = weighing.along.iter().cloned().collect();
        parts.insert(name.to_owned());
        Self {
            parts,
            mass: weighing.mass,
            sd: weighing.sd,
            interaction: weighing.interaction.clone(),
        }
    }

    /// The friction of what was pushed, on which all of the weight bears.
    pub(super) fn tells_friction(&self, twin: &mut Twin, pushed: &str, force: &Estimate, gravity: f64) {
        let Some(link) = twin.link_mut(pushed) else { return };
        let told = link.friction.kinetic.as_ref().is_some_and(|f| f.confounded.is_none());
        let log_sd = (self.sd / self.mass).hypot(relative_sd(force));
        if told || log_sd > WEIGHED {
            return;
        }
        let from = force.from.iter().chain([&self.interaction]).cloned().collect();
        let value = force.value / (self.mass * gravity);
        let friction = positive(value, log_sd, "1", from, "push and lift of the group");
        link.friction.kinetic = Some(friction);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;
    use crate::twin::{Body, FORMAT, Link, Provenance};

    #[test]
    fn what_is_pushed_and_was_lifted_as_one_tells_the_friction_under_it() {
        let mut twin = Twin {
            format: FORMAT.into(),
            name: "stack".into(),
            gravity: [0.0, 0.0, -9.81],
            support: None,
            bodies: vec![Body::rigid(Link::new("low", Pose::identity()))],
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        };
        let whole = Whole {
            parts: BTreeSet::from(["low".to_owned(), "top".to_owned()]),
            mass: 0.8,
            sd: 0.008,
            interaction: "lift-00".into(),
        };
        let force = positive(2.4, 0.02, "N", vec!["push-00".into()], "push");
        whole.tells_friction(&mut twin, "low", &force, 9.81);
        let found = twin
            .link("low")
            .and_then(|l| l.friction.kinetic.clone())
            .expect("a friction");
        assert!((found.value - 2.4 / (0.8 * 9.81)).abs() < 1e-12);
        assert_eq!(found.from, ["push-00", "lift-00"]);
        let log_sd = relative_sd(&found);
        assert!((log_sd - 0.01_f64.hypot(0.02)).abs() < 1e-3, "{log_sd}");
    }
}
