//! A model's numbers beside what was measured.

use std::fmt;

use serde::Serialize;

use super::{Link, Twin};
use crate::base::Estimate;

/// A number of a model beside a measured one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Link or joint.
    pub about: String,
    /// `mass`, `com x`, `friction.kinetic`, …
    pub quantity: String,
    /// In the model.
    pub model: f64,
    /// As measured.
    pub measured: f64,
    /// 95 % of the measurement.
    pub ci95: [f64; 2],
    /// The model's number lies outside of that; where the model states an interval of its own, the two do not meet.
    pub outside: bool,
    /// Of all four.
    pub unit: String,
}

impl fmt::Display for Compared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = if self.unit == "1" { "" } else { &self.unit };
        let said = |v: f64| match v == 0.0 || v.abs() >= 0.01 {
            true => format!("{v:.4}"),
            false => format!("{v:.2e}"),
        };
        let [low, high] = self.ci95.map(said);
        let (about, quantity) = (&self.about, &self.quantity);
        let (model, measured) = (said(self.model), said(self.measured));
        write!(
            f,
            "{about}: {quantity} is {model} {unit} in the model; measured {measured} [{low}, {high}] {unit}"
        )
    }
}

/// A number of the model beside the measured one.
type Beside<'a> = (&'static str, &'a Option<Estimate>, &'a Option<Estimate>);

/// The numbers of `model` for which `measured` measured something of links of the same names, or of joints between them.
pub fn compared(model: &Twin, measured: &Twin) -> Vec<Compared> {
    let mut all = Vec::new();
    for (_, link) in model.links() {
        if let Some(found) = measured.link(&link.name) {
            all.extend(of_link(link, found));
        }
    }
    for joint in model.joints() {
        let same = |j: &&super::Joint| j.parent == joint.parent && j.child == joint.child && j.kind == joint.kind;
        let Some(found) = measured.joints().find(same) else {
            continue;
        };
        let rows: [Beside; 4] = [
            ("friction", &joint.friction, &found.friction),
            ("damping", &joint.damping, &found.damping),
            ("stiffness", &joint.stiffness, &found.stiffness),
            ("pitch", &joint.pitch, &found.pitch),
        ];
        all.extend(rows.into_iter().filter_map(|row| beside(&joint.name, row)));
    }
    all
}

fn of_link(link: &Link, found: &Link) -> Vec<Compared> {
    let rows: [Beside; 6] = [
        ("mass", &link.mass, &found.mass),
        ("friction.static", &link.friction.static_, &found.friction.static_),
        ("friction.kinetic", &link.friction.kinetic, &found.friction.kinetic),
        (
            "friction.torsional_radius",
            &link.friction.torsional_radius,
            &found.friction.torsional_radius,
        ),
        ("stiffness", &link.stiffness, &found.stiffness),
        ("restitution", &link.restitution, &found.restitution),
    ];
    let mut all: Vec<Compared> = rows.into_iter().filter_map(|row| beside(&link.name, row)).collect();
    let com = link.com.as_ref().zip(found.com.as_ref().filter(|e| e.is_measured()));
    for k in 0..3 {
        let own = com.and_then(|(e, _)| e.ci95).map(|c| c[k]);
        let there = com.and_then(|(e, f)| Some((e.value[k], f.value[k], f.ci95?[k])));
        all.extend(there.map(|(value, measured, ci95)| Compared {
            about: link.name.clone(),
            quantity: ["com x", "com y", "com z"][k].into(),
            model: value,
            measured,
            ci95,
            outside: outside(value, own, ci95),
            unit: "m".into(),
        }));
    }
    all
}

fn beside(about: &str, (quantity, model, measured): Beside) -> Option<Compared> {
    let (model, measured) = (model.as_ref()?, measured.as_ref().filter(|e| e.is_measured())?);
    let ci95 = measured.ci95?;
    Some(Compared {
        about: about.into(),
        quantity: quantity.into(),
        model: model.value,
        measured: measured.value,
        ci95,
        outside: outside(model.value, model.ci95, ci95),
        unit: measured.unit.clone(),
    })
}

/// Whether a number, with its interval where it has one, does not meet a measured interval.
fn outside(value: f64, own: Option<[f64; 2]>, [low, high]: [f64; 2]) -> bool {
    let [from, to] = own.unwrap_or([value; 2]);
    to < low || from > high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;

    #[test]
    fn a_number_outside_of_what_was_measured_is_told_and_one_within_is_not() {
        let mut model = Link::new("box", Pose::identity());
        model.mass = Some(Estimate::known(0.9, None, "kg"));
        model.com = Some(Estimate::known([0.0; 3], None, "m"));
        let mut found = Link::new("box", Pose::identity());
        found.mass = Some(Estimate::measured(0.44, 0.01, "kg", Vec::new(), "lift"));
        found.com = Some(Estimate::measured(
            [0.012, 0.001, 0.0],
            [0.001; 3],
            "m",
            Vec::new(),
            "push",
        ));
        found.friction.kinetic = Some(Estimate::measured(0.3, 0.01, "1", Vec::new(), "push"));
        let told = |link: &Link, found: &Link| {
            let all = of_link(link, found);
            let outside = all.iter().filter(|c| c.outside);
            (outside.map(|c| c.quantity.clone()).collect::<Vec<_>>(), all.len())
        };
        let words = ["mass", "com x"].map(str::to_owned).to_vec();
        assert_eq!(told(&model, &found), (words, 4));
        let words = of_link(&model, &found)[0].to_string();
        assert!(
            words.starts_with("box: mass is 0.9000 kg in the model; measured 0.4400 ["),
            "{words}"
        );
        // A model that is in doubt itself, and what was only assumed, say nothing.
        model.mass = Some(Estimate::measured(0.9, 0.3, "kg", Vec::new(), "guess"));
        found.com = Some(Estimate::assumed([0.012, 0.001, 0.0], [0.001; 3], "m", "prior"));
        assert_eq!(told(&model, &found), (Vec::new(), 1));
    }
}
