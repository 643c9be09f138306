//! A model's numbers beside what was measured.

use std::fmt;

use nalgebra::Vector3;
use serde::Serialize;

use super::{Effect, Finding, Joint, Link, Twin};
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
    /// What has to be known to read it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
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
        let note = self.note.as_ref().map_or(String::new(), |n| format!(" ({n})"));
        write!(
            f,
            "{about}: {quantity} is {model} {unit} in the model; measured {measured} [{low}, {high}] {unit}{note}"
        )
    }
}

/// A number of the model beside the measured one.
type Beside<'a> = (&'static str, &'a Option<Estimate>, &'a Option<Estimate>);

/// The numbers of the links of `model` for which `measured` measured something of links of the same names.
pub fn compared(model: &Twin, measured: &Twin) -> Vec<Compared> {
    let both = model.links().filter_map(|(_, l)| Some((l, measured.link(&l.name)?)));
    both.flat_map(|(link, found)| of_link(link, found)).collect()
}

/// Axes, places and ends of the joints of `model` beside those of `measured` between links of the same names, both at the
/// first view.
pub fn joints_compared(model: &Twin, measured: &Twin) -> Vec<Compared> {
    let mut all = Vec::new();
    for joint in model.joints() {
        let same = |j: &&Joint| j.parent == joint.parent && j.child == joint.child && j.kind == joint.kind;
        let turned = |j: &&Joint| j.parent == joint.child && j.child == joint.parent && j.kind == joint.kind;
        let found = measured.joints().find(same);
        if let Some(found) = found.or_else(|| measured.joints().find(turned)) {
            all.extend(axes(joint, found));
        }
        let Some(found) = found else { continue };
        all.extend(ends(joint, found));
        all.extend(beside(&joint.name, ("pitch", &joint.pitch, &found.pitch)));
    }
    all
}

/// Friction, damping and spring of a joint.
pub fn efforts_compared(joint: &Joint, found: &Joint) -> Vec<Compared> {
    let rows: [Beside; 3] = [
        ("friction", &joint.friction, &found.friction),
        ("damping", &joint.damping, &found.damping),
        ("stiffness", &joint.stiffness, &found.stiffness),
    ];
    rows.into_iter().filter_map(|row| beside(&joint.name, row)).collect()
}

/// The numbers of effects of a model beside those of findings of the same cause and place.
pub fn effects_compared(effects: &[Effect], findings: &[Finding]) -> Vec<Compared> {
    let found = |e: &Effect| findings.iter().find(|f| f.cause == e.cause && f.place == e.place);
    let both = effects.iter().filter_map(|e| Some((e, found(e)?)));
    let rows = both.flat_map(|(effect, finding)| {
        let each = effect.parameters.iter();
        each.filter_map(move |(name, own)| {
            let measured = finding.parameters.get(name).filter(|m| m.is_measured())?;
            let row = number(&effect.place, name, own, measured)?;
            let quantity = format!("{} {name}", effect.cause);
            Some(Compared { quantity, ..row })
        })
    });
    rows.collect()
}

/// What the frames of a model and of tracks may be off against each other: rad, m.
const FRAMES: [f64; 2] = [5e-3, 5e-4];
/// 95 % quantile of the length of a vector of two normal components.
const TWO: f64 = 2.448;

/// The angle between two axes, and for what turns the distance between them, each from the measured one.
fn axes(joint: &Joint, found: &Joint) -> Vec<Compared> {
    let (own, axis) = (Vector3::from(joint.axis.value), Vector3::from(found.axis.value));
    let widest = |e: &Estimate<[f64; 3]>| e.sd.map(|sd| sd.into_iter().fold(0.0, f64::max));
    let of = |quantity: &str, value: f64, bound: f64, unit: &str| Compared {
        about: joint.name.clone(),
        quantity: quantity.into(),
        model: value,
        measured: 0.0,
        ci95: [0.0, bound],
        outside: value > bound,
        unit: unit.into(),
        note: None,
    };
    let mut all = Vec::new();
    if let Some(sd) = widest(&found.axis).filter(|_| found.axis.is_measured()) {
        let angle = own.cross(&axis).norm().atan2(own.dot(&axis).abs());
        all.push(of("angle to the measured axis", angle, TWO * sd + FRAMES[0], "rad"));
    }
    if let Some(sd) = widest(&found.origin).filter(|_| joint.axis_turns() && found.origin.is_measured()) {
        let apart = Vector3::from(joint.origin.value) - Vector3::from(found.origin.value);
        let away = (apart - axis * apart.dot(&axis)).norm();
        all.push(of("distance from the measured axis", away, TWO * sd + FRAMES[1], "m"));
    }
    all
}

/// Ends of the range that were reached.
fn ends(joint: &Joint, found: &Joint) -> Vec<Compared> {
    let both = joint
        .limits
        .as_ref()
        .zip(found.limits.as_ref().filter(|l| l.is_measured()));
    let Some((own, limits)) = both else { return Vec::new() };
    // Axes may point either way.
    let along = Vector3::from(joint.axis.value).dot(&Vector3::from(found.axis.value)) > 0.0;
    let width = limits.value[1] - limits.value[0];
    let end = |k: usize| {
        let ([low, high], sd) = (limits.ci95?[k], limits.sd?[k]);
        let frames = FRAMES[usize::from(!joint.axis_turns())];
        let ([low, high], at) = match along {
            true => ([low - frames, high + frames], limits.value[k]),
            false => ([-high - frames, -low + frames], -limits.value[k]),
        };
        let other = if along { k } else { 1 - k };
        (sd < REACHED * width).then(|| Compared {
            about: joint.name.clone(),
            quantity: ["lower end", "upper end"][other].into(),
            model: own.value[other],
            measured: at,
            ci95: [low, high],
            outside: outside(own.value[other], own.ci95.map(|c| c[other]), [low, high]),
            unit: limits.unit.clone(),
            note: Some("from the first view".into()),
        })
    };
    (0..2).filter_map(end).collect()
}

/// An end that is known worse than this share of the range was not reached.
const REACHED: f64 = 0.1;

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
    // Where weight and coefficient were not told apart their product was.
    let measured = |e: &Option<Estimate>| e.as_ref().is_some_and(Estimate::is_measured);
    if !(measured(&found.mass) && measured(&found.friction.kinetic)) {
        let (own, force) = (&link.friction_force.kinetic, &found.friction_force.kinetic);
        let row = beside(&link.name, ("friction force on the table", own, force));
        all.extend(row.map(|row| Compared {
            note: Some("coefficient times weight: which of the two, this does not tell".into()),
            ..row
        }));
    }
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
            note: None,
        }));
    }
    all
}

fn beside(about: &str, (quantity, model, measured): Beside) -> Option<Compared> {
    number(
        about,
        quantity,
        model.as_ref()?,
        measured.as_ref().filter(|e| e.is_measured())?,
    )
}

fn number(about: &str, quantity: &str, model: &Estimate, measured: &Estimate) -> Option<Compared> {
    let ci95 = measured.ci95?;
    Some(Compared {
        about: about.into(),
        quantity: quantity.into(),
        model: model.value,
        measured: measured.value,
        ci95,
        outside: outside(model.value, model.ci95, ci95),
        unit: measured.unit.clone(),
        note: None,
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
