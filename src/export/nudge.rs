//! The numbers of a twin on which the outcome of a touch may depend, each moved by itself within its doubt.

use nalgebra::Vector3;

use super::draw::{Sign, at, settle};
use super::inertial::inertial_of;
use crate::base::{Estimate, Status};
use crate::twin::{Joint, Link, Model};

/// Doubt of a mass that nobody measured and no interval bounds: standard deviation of its logarithm.
const UNWEIGHED: f64 = 0.7;
/// What moves less than this, m, is not asked about.
const SMALL: f64 = 1e-4;

/// A number of a twin.
#[derive(Clone, Debug, PartialEq)]
pub enum Knob {
    /// Of a link; its friction force stays where only their product is known.
    Mass(String),
    /// Force of friction of a link on the table.
    Friction(String),
    /// Of a link.
    TorsionalRadius(String),
    /// Of a link, along an axis of its frame.
    Com(String, usize),
    /// Dry friction of a joint.
    JointFriction(String),
    /// Damping of a joint.
    JointDamping(String),
    /// Gravity as the pushes showed it, along an axis of the world.
    Gravity(usize),
}

impl Knob {
    /// In words.
    pub fn words(&self) -> String {
        let axis = |k: &usize| ["x", "y", "z"][*k];
        match self {
            Self::Mass(link) => format!("mass of {link}"),
            Self::Friction(link) => format!("friction of {link} on the table"),
            Self::TorsionalRadius(link) => format!("torsional radius of {link}"),
            Self::Com(link, k) => format!("centre of mass of {link} along {}", axis(k)),
            Self::JointFriction(joint) => format!("friction of {joint}"),
            Self::JointDamping(joint) => format!("damping of {joint}"),
            Self::Gravity(k) => format!("lean of gravity along {}", axis(k)),
        }
    }

    /// Whether these data fixed it; a default counts as assumed.
    pub fn status(&self, model: &Model) -> Status {
        let of = |e: Option<&Estimate>| e.map_or(Status::Assumed, |e| e.status);
        let link = |name: &String| model.twin.link(name);
        let joint = |name: &String| model.twin.joints().find(|j| &j.name == name);
        match self {
            Self::Mass(l) => of(link(l).and_then(|l| l.mass.as_ref())),
            Self::Friction(l) => of(link(l).and_then(force)),
            Self::TorsionalRadius(l) => of(link(l).and_then(|l| l.friction.torsional_radius.as_ref())),
            Self::Com(l, _) => link(l)
                .and_then(|l| l.com.as_ref())
                .map_or(Status::Assumed, |c| c.status),
            Self::JointFriction(j) => of(joint(j).and_then(|j| j.friction.as_ref())),
            Self::JointDamping(j) => of(joint(j).and_then(|j| j.damping.as_ref())),
            Self::Gravity(_) => Status::Measured,
        }
    }
}

/// What of the body that holds `target` may be otherwise than the twin says.
pub fn knobs(model: &Model, target: &str) -> Vec<Knob> {
    let holds = |b: &&crate::twin::Body| b.links.iter().any(|l| l.name == target);
    let Some(body) = model.twin.bodies.iter().find(holds) else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for link in &body.links {
        let name = || link.name.clone();
        all.push(Knob::Mass(name()));
        all.extend(force(link).filter(|e| e.ci95.is_some()).map(|_| Knob::Friction(name())));
        let radius = link.friction.torsional_radius.as_ref();
        all.extend(
            radius
                .filter(|e| e.ci95.is_some())
                .map(|_| Knob::TorsionalRadius(name())),
        );
        if let Some(ci95) = link.com.as_ref().and_then(|c| c.ci95) {
            let wide = (0..3).filter(|k| ci95[*k][1] - ci95[*k][0] > SMALL);
            all.extend(wide.map(|k| Knob::Com(name(), k)));
        }
    }
    for joint in &body.joints {
        let told = |e: &Option<Estimate>| e.as_ref().is_some_and(|e| e.ci95.is_some());
        all.extend(told(&joint.friction).then(|| Knob::JointFriction(joint.name.clone())));
        all.extend(told(&joint.damping).then(|| Knob::JointDamping(joint.name.clone())));
    }
    let felt = model.twin.support.as_ref().and_then(|s| s.gravity.as_ref());
    if let Some(ci95) = felt.and_then(|g| g.ci95) {
        let leans = (0..3).filter(|k| ci95[*k][1] - ci95[*k][0] > 1e-3);
        all.extend(leans.map(Knob::Gravity));
    }
    all
}

/// The twin with a number `z` standard deviations from its value.
pub fn nudged(model: &Model, knob: &Knob, z: f64) -> Model {
    let mut out = model.clone();
    let level = Vector3::from(model.twin.gravity).norm();
    match knob {
        Knob::Mass(name) => {
            let mesh = model.twin.link(name).and_then(|l| l.mesh.as_ref());
            let mesh = mesh.and_then(|p| model.meshes.get(p));
            with_link(&mut out, name, |l| {
                let default = inertial_of(l, mesh).mass;
                weigh(l, default, z);
            });
        }
        Knob::Friction(name) => with_link(&mut out, name, |l| slide(l, z)),
        Knob::TorsionalRadius(name) => with_link(&mut out, name, |l| {
            moved(&mut l.friction.torsional_radius, z, Sign::Positive);
        }),
        Knob::Com(name, k) => with_link(&mut out, name, |l| {
            if let Some(com) = &mut l.com {
                com.value[*k] = at(com.value[*k], com.ci95.map(|c| c[*k]), z, Sign::Any);
            }
        }),
        Knob::JointFriction(name) => with_joint(&mut out, name, |j| moved(&mut j.friction, z, Sign::Nonnegative)),
        Knob::JointDamping(name) => with_joint(&mut out, name, |j| moved(&mut j.damping, z, Sign::Nonnegative)),
        Knob::Gravity(k) => {
            if let Some(felt) = out.twin.support.as_mut().and_then(|s| s.gravity.as_mut()) {
                felt.value[*k] = at(felt.value[*k], felt.ci95.map(|c| c[*k]), z, Sign::Any);
                felt.value = (Vector3::from(felt.value).normalize() * level).into();
            }
        }
    }
    out
}

fn with_link(model: &mut Model, name: &str, change: impl FnOnce(&mut Link)) {
    let mut links = model.twin.bodies.iter_mut().flat_map(|b| &mut b.links);
    if let Some(link) = links.find(|l| l.name == name) {
        change(link);
    }
}

fn with_joint(model: &mut Model, name: &str, change: impl FnOnce(&mut Joint)) {
    let mut joints = model.twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
    if let Some(joint) = joints.find(|j| j.name == name) {
        change(joint);
    }
}

fn moved(estimate: &mut Option<Estimate>, z: f64, sign: Sign) {
    if let Some(e) = estimate {
        let drawn = at(e.value, e.ci95, z, sign);
        settle(e, drawn);
    }
}

/// The force of friction, or the coefficient where only that is known.
fn force(link: &Link) -> Option<&Estimate> {
    link.friction_force.kinetic.as_ref().or(link.friction.kinetic.as_ref())
}

/// Another mass with an inertia that goes with it; a coefficient of which only the product with the mass is known gives way.
fn weigh(link: &mut Link, default: f64, z: f64) {
    let drawn = match &link.mass {
        Some(m) if m.ci95.is_some() => at(m.value, m.ci95, z, Sign::Positive),
        Some(m) if m.status == Status::Known => m.value,
        _ => default * (UNWEIGHED * z).exp(),
    };
    let ratio = drawn / default;
    match &mut link.mass {
        Some(m) => settle(m, drawn),
        None => link.mass = Some(Estimate::assumed(drawn, 0.0, "kg", "nudged")),
    }
    if let Some(inertia) = &mut link.inertia {
        inertia.value = inertia.value.map(|v| v * ratio);
    }
    for mu in [&mut link.friction.static_, &mut link.friction.kinetic] {
        if let Some(mu) = mu.as_mut().filter(|m| m.confounded.is_some()) {
            mu.value /= ratio;
        }
    }
}

/// More or less friction, at rest and in motion alike.
fn slide(link: &mut Link, z: f64) {
    let Some(now) = force(link) else { return };
    let ratio = at(now.value, now.ci95, z, Sign::Positive) / now.value;
    let all = [
        &mut link.friction.static_,
        &mut link.friction.kinetic,
        &mut link.friction_force.static_,
        &mut link.friction_force.kinetic,
    ];
    for e in all.into_iter().flatten() {
        e.value *= ratio;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Confounded, Pose};

    fn tin() -> Link {
        let mut link = Link::new("tin", Pose::identity());
        link.mass = Some(Estimate::measured(0.3, 0.01, "kg", Vec::new(), "lift"));
        link.friction_force.kinetic = Some(Estimate::measured(0.9, 0.03, "N", Vec::new(), "push"));
        let only_a_product = Confounded {
            with: vec!["mass".into()],
            known: "friction_force.kinetic".into(),
            experiment: "lift it".into(),
        };
        let mu = Estimate::assumed(0.3, 0.1, "1", "push").with_confounded(only_a_product);
        link.friction.kinetic = Some(mu);
        link
    }

    fn value(e: &Option<Estimate>) -> f64 {
        e.as_ref().expect("there").value
    }

    #[test]
    fn a_product_that_is_known_stays_when_a_factor_moves() {
        let mut heavier = tin();
        weigh(&mut heavier, 0.3, 1.0);
        assert!(value(&heavier.mass) > 0.305);
        assert!((value(&heavier.mass) * value(&heavier.friction.kinetic) - 0.09).abs() < 1e-9);
        let mut rougher = tin();
        slide(&mut rougher, 1.0);
        let force = value(&rougher.friction_force.kinetic);
        assert!((force - 0.93).abs() < 2e-3, "{force}");
        assert!(value(&rougher.friction.kinetic) > 0.305);
    }
}
