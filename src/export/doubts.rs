//! The numbers of links and joints with their intervals, as every format carries them: in `<custom>`, custom data or comments.

use crate::base::Estimate;
use crate::twin::{Joint, Link};

/// A number of the twin.
pub(super) struct Doubt {
    pub(super) name: String,
    pub(super) value: f64,
    /// 95 %; none where the number is exact, or an end is open.
    pub(super) interval: Option<[f64; 2]>,
    unit: String,
}

impl Doubt {
    /// In words, where there is an interval.
    pub(super) fn comment(&self) -> Option<String> {
        let [low, high] = self.interval?;
        let (name, value) = (&self.name, self.value);
        let unit = if self.unit == "1" {
            String::new()
        } else {
            format!(" {}", self.unit)
        };
        Some(format!("{name}: {value}{unit}, 95 % within [{low}, {high}]"))
    }
}

fn closed(interval: [f64; 2]) -> Option<[f64; 2]> {
    interval.iter().all(|v| v.is_finite()).then_some(interval)
}

fn scalars<const N: usize>(all: [(&str, &Option<Estimate>); N]) -> Vec<Doubt> {
    let one = |(name, e): (&str, &Option<Estimate>)| Some(doubt(name.into(), e.as_ref()?));
    all.into_iter().filter_map(one).collect()
}

fn doubt(name: String, e: &Estimate) -> Doubt {
    Doubt {
        name,
        value: e.value,
        interval: e.ci95.and_then(closed),
        unit: e.unit.clone(),
    }
}

fn components<const N: usize>(
    stem: &str,
    names: [&str; N],
    value: [f64; N],
    intervals: Option<[[f64; 2]; N]>,
    unit: &str,
) -> Vec<Doubt> {
    let one = |i: usize| Doubt {
        name: format!("{stem}_{}", names[i]),
        value: value[i],
        interval: intervals.and_then(|all| closed(all[i])),
        unit: unit.into(),
    };
    (0..N).map(one).collect()
}

/// What is known of a link; places and moments are along the axes of the twin's link frame, places from its origin.
pub(super) fn of_link(link: &Link) -> Vec<Doubt> {
    let mut all = scalars([
        ("mass", &link.mass),
        ("friction_static", &link.friction.static_),
        ("friction_kinetic", &link.friction.kinetic),
        ("friction_rolling", &link.friction.rolling),
        ("friction_torsional_radius", &link.friction.torsional_radius),
        ("friction_force_static", &link.friction_force.static_),
        ("friction_force_kinetic", &link.friction_force.kinetic),
        ("stiffness", &link.stiffness),
        ("damping", &link.damping),
        ("restitution", &link.restitution),
    ]);
    if let Some(e) = &link.com {
        all.extend(components("com", ["x", "y", "z"], e.value, e.ci95, &e.unit));
    }
    if let Some(e) = &link.inertia {
        let names = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
        all.extend(components("inertia", names, e.value, e.ci95, &e.unit));
    }
    all
}

/// What is known of a joint.
pub(super) fn of_joint(joint: &Joint) -> Vec<Doubt> {
    let effects = &joint.effects;
    let ratio = effects.coupling.as_ref().map(|c| c.ratio.clone());
    let mut all = scalars([
        ("friction", &joint.friction),
        ("damping", &joint.damping),
        ("stiffness", &joint.stiffness),
        ("rest", &joint.rest),
        ("pitch", &joint.pitch),
        ("static_excess", &effects.static_excess),
        ("backlash", &effects.backlash),
        ("coupling_ratio", &ratio),
    ]);
    for (k, detent) in effects.detents.iter().enumerate() {
        for (name, estimate) in [
            ("position", &detent.position),
            ("load", &detent.load),
            ("reach", &detent.reach),
        ] {
            all.push(doubt(format!("detent_{k}_{name}"), estimate));
        }
    }
    if let Some(e) = &joint.limits {
        all.extend(components("limit", ["lower", "upper"], e.value, e.ci95, &e.unit));
    }
    all
}
