//! Groups whose weight is known, lifted as one or part by part: what of them is known with it.

use std::collections::BTreeSet;

use super::lift::Weighing;
use super::pool::{positive, relative_sd};
use super::share::WEIGHED;
use crate::base::Estimate;
use crate::twin::{Link, Twin};

/// A group that was weighed.
pub(super) struct Whole {
    /// The links.
    pub(super) parts: BTreeSet<String>,
    /// Their mass, and its standard deviation, kg.
    pub(super) mass: f64,
    pub(super) sd: f64,
    from: Vec<String>,
}

impl Whole {
    pub(super) fn of(name: &str, weighing: &Weighing) -> Self {
        let mut parts: BTreeSet<String> = weighing.along.iter().cloned().collect();
        parts.insert(name.to_owned());
        Self {
            parts,
            mass: weighing.mass,
            sd: weighing.sd,
            from: vec![weighing.interaction.clone()],
        }
    }

    /// Of links each of which was weighed; nothing where one of them was not.
    pub(super) fn of_parts(links: &[Link]) -> Option<Self> {
        let masses: Option<Vec<&Estimate>> = links.iter().map(|l| l.mass.as_ref()).collect();
        let masses = masses.filter(|m| !m.is_empty() && m.iter().all(|m| relative_sd(m) < WEIGHED))?;
        let variance: f64 = masses.iter().map(|m| (m.value * relative_sd(m)).powi(2)).sum();
        let from: BTreeSet<String> = masses.iter().flat_map(|m| m.from.iter().cloned()).collect();
        Some(Self {
            parts: links.iter().map(|l| l.name.clone()).collect(),
            mass: masses.iter().map(|m| m.value).sum(),
            sd: variance.sqrt(),
            from: from.into_iter().collect(),
        })
    }

    /// The friction of what was pushed, on which all of the weight bears.
    pub(super) fn tells_friction(&self, twin: &mut Twin, pushed: &str, force: &Estimate, gravity: f64) {
        let Some(link) = twin.link_mut(pushed) else { return };
        let told = link.friction.kinetic.as_ref().is_some_and(|f| f.confounded.is_none());
        let log_sd = (self.sd / self.mass).hypot(relative_sd(force));
        if told || log_sd > WEIGHED {
            return;
        }
        let from = force.from.iter().chain(&self.from).cloned().collect();
        let value = force.value / (self.mass * gravity);
        let friction = positive(value, log_sd, "1", from, "push of the group, which was weighed");
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
            from: vec!["lift-00".into()],
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

    #[test]
    fn parts_that_were_weighed_one_by_one_weigh_as_much_together() {
        let of = |name: &str, mass: Option<Estimate>| Link {
            mass,
            ..Link::new(name, Pose::identity())
        };
        let weighed = |mass: f64| Some(positive(mass, 0.01, "kg", vec!["lift".into()], "lift"));
        let both = [of("low", weighed(0.4)), of("top", weighed(0.3))];
        let whole = Whole::of_parts(&both).expect("a whole");
        assert!(
            (whole.mass - 0.7).abs() < 1e-12 && (whole.sd - 0.005).abs() < 1e-5,
            "{}",
            whole.sd
        );
        assert!(Whole::of_parts(&[of("low", None), of("top", weighed(0.3))]).is_none());
    }
}
