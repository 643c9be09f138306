//! The centre of mass as a finding: a twin always carries what was measured of it; that it leaves the centroid of its
//! shape beyond doubt means that the body is not of one density.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::compare::errors;
use super::naming::climb;
use super::predict::trace_of;
use super::turns::Turns;
use super::{Config, Trace};
use crate::base::Estimate;
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::geometry::mass_properties;
use crate::stages::estimation::TOSS_METHOD;
use crate::twin::{Evidence, Finding, Gain, Link, Model};

/// Misfit of the centroid, chi squared of the axes that were measured, from which on it counts: p below 3e-7.
const CLEAR: f64 = 30.0;
/// What a reconstructed shape may miss of its centroid, and one that was given: m, and a share of its extent.
const SHAPE: (f64, f64) = (8e-4, 0.004);
const GIVEN: (f64, f64) = (2e-4, 0.001);
/// An axis with more doubt than this was not measured, m.
const VAGUE: f64 = 4e-3;

/// How a centre is called that pushes told with their friction, and the misfit from which on it is looked at by the moments of each.
const PUSHED: &str = "push-limit-surface";
const UNCLEAR: f64 = 7.0;
/// Doubt of an axis up to which turning tells it, m, and how many standard deviations from what pushes said it may be.
const SHARP: f64 = 6e-4;
const AGREES: f64 = 2.5;
/// Misfit from which on pushes tell it with their friction where the moments of each, read by themselves, do so too; and the doubt up
/// to which these tell an axis then, m.
const EACH: f64 = 12.0;
const TOLD: f64 = 2e-3;

/// Every link whose centre of mass is not that of its shape, with what knowing it gains on touches that did not
/// tell it; and the model without them.
pub fn centre_findings(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    config: &Config,
) -> (Model, Vec<Finding>) {
    let mut plain = model.clone();
    let mut findings = Vec::new();
    let names: Vec<String> = model.twin.links().map(|(_, l)| l.name.clone()).collect();
    for name in names {
        let known = capture.bodies.iter().any(|b| b.name == name && b.mesh.is_some());
        let shape = if known { GIVEN } else { SHAPE };
        let Some(told) = model.twin.link(&name).and_then(|l| Offset::of(l, model, shape)) else {
            continue;
        };
        let by_turning = || told.by_turning(&name, (capture, segmented, model), config);
        let Some(offset) = told.is_clear().then(|| told.clone()).or_else(by_turning) else {
            continue;
        };
        let mut without = model.clone();
        offset.take_away(&mut without, &name);
        let Some(gain) = gain(capture, segmented, (&without, model), &offset.from, &name) else {
            continue;
        };
        offset.take_away(&mut plain, &name);
        findings.push(offset.finding(&name, gain));
    }
    (plain, findings)
}

/// Whether touches measured a centre of mass, of a thing whose shape is known.
pub fn tells_centre(model: &Model) -> bool {
    let of = |link: &Link| {
        let measured = link.com.as_ref().filter(|c| c.is_measured() && c.method != TOSS_METHOD);
        let known = link.mesh.as_ref().is_some_and(|m| model.meshes.contains_key(m));
        known
            && measured
                .and_then(|c| c.sd)
                .is_some_and(|sd| sd.iter().any(|s| *s < VAGUE))
    };
    model.twin.links().any(|(_, l)| of(l))
}

/// How far a measured centre of mass lies from the centroid, link frame.
#[derive(Clone)]
struct Offset {
    centroid: Point3<f64>,
    away: Vector3<f64>,
    sd: Vector3<f64>,
    chi_squared: f64,
    from: Vec<String>,
    /// Pushes told it, as a part of the friction that they were fitted with.
    pushed: bool,
    /// What the shape leaves open of its centroid, m; and whether it was given.
    open: f64,
    given: bool,
}

impl Offset {
    fn of(link: &Link, model: &Model, shape: (f64, f64)) -> Option<Self> {
        let com = link
            .com
            .as_ref()
            .filter(|c| c.is_measured() && c.method != TOSS_METHOD)?;
        let mesh = model.meshes.get(link.mesh.as_ref()?)?;
        let centroid = mass_properties(mesh)?.centroid;
        let (low, high) = mesh.bounds()?;
        let away = Point3::from(com.value) - centroid;
        let read = Vector3::from(com.sd?);
        let open = shape.0 + shape.1 * (high - low).max();
        let sd = read.map(|s| s.hypot(open));
        let chi_squared = (0..3)
            .filter(|k| read[*k] < VAGUE)
            .map(|k| (away[k] / sd[k]).powi(2))
            .sum();
        Some(Self {
            centroid,
            away,
            sd,
            chi_squared,
            from: com.from.clone(),
            pushed: com.method.starts_with(PUSHED),
            open,
            given: shape == GIVEN,
        })
    }

    fn is_clear(&self) -> bool {
        self.chi_squared > CLEAR
    }

    /// The same as the balance of moments tells it beside where the finger touched, where pushes leave it unclear: each of them is read
    /// at its measured motion, and what differs from push to push is known to.
    fn by_turning(
        &self,
        name: &str,
        (capture, segmented, model): (&Capture, &[Segmented], &Model),
        config: &Config,
    ) -> Option<Self> {
        if !self.pushed || self.chi_squared < UNCLEAR {
            return None;
        }
        let turns = Turns::new(capture, segmented, model)?;
        let (away, read, from) = turns.centre(&climb(&turns, config)?.full, name)?;
        let agrees = |k: usize| (away[k] - self.away[k]).abs() < AGREES * self.sd[k].hypot(read[k]);
        let sd = read.map(|s| s.hypot(self.open));
        let within = |doubt: f64| (0..3).filter(move |k| read[*k] < doubt);
        let misfit = |doubt: f64| -> f64 { within(doubt).map(|k| (away[k] / sd[k]).powi(2)).sum() };
        // A reconstructed shape may itself be off by what both tell.
        let both = || {
            let told = self.given && within(TOLD).count() >= 2 && within(TOLD).all(agrees);
            (told && self.chi_squared > EACH && misfit(TOLD) > EACH).then(|| self.clone())
        };
        if within(SHARP).count() < 2 {
            return both();
        }
        let chi_squared = misfit(SHARP);
        let out = Self {
            away,
            sd,
            chi_squared,
            from,
            ..self.clone()
        };
        (out.is_clear() && within(SHARP).all(agrees))
            .then_some(out)
            .or_else(both)
    }

    fn take_away(&self, model: &mut Model, name: &str) {
        if let Some(link) = model.twin.link_mut(name) {
            let centroid: [f64; 3] = self.centroid.coords.into();
            link.com = Some(Estimate::assumed(
                centroid,
                self.sd.into(),
                "m",
                "shape-uniform-density",
            ));
        }
    }

    fn finding(&self, name: &str, gain: Gain) -> Finding {
        let mut parameters = BTreeMap::new();
        for (k, axis) in ["cx", "cy", "cz"].iter().enumerate() {
            if self.sd[k] < VAGUE {
                let away = Estimate::measured(self.away[k], self.sd[k], "m", self.from.clone(), "com less centroid");
                parameters.insert((*axis).to_owned(), away);
            }
        }
        let p_value = (-0.5 * self.chi_squared).exp();
        let words = format!(
            "the centre of mass of {name} lies {:.1} mm from the centroid of its shape",
            (0..3)
                .filter(|k| self.sd[*k] < VAGUE)
                .map(|k| self.away[k].powi(2))
                .sum::<f64>()
                .sqrt()
                * 1e3
        );
        let evidence = Evidence {
            residual: format!("moment of {}", self.from.join(", ")),
            test: "chi squared of the centroid".into(),
            statistic: self.chi_squared,
            p_value,
            words,
        };
        Finding {
            leader: None,
            priors: BTreeMap::new(),
            cause: "com-offset".into(),
            place: name.to_owned(),
            probability: if self.is_clear() { 0.98 } else { 0.9 },
            alternatives: Vec::new(),
            parameters,
            evidence: vec![evidence],
            gain,
        }
    }
}

/// The quantity that gains most on touches of the link which did not tell what is new: sealed ones, else such as
/// were not used for it (`from`). Nothing where they get worse.
pub fn gain(
    capture: &Capture,
    segmented: &[Segmented],
    (without, with): (&Model, &Model),
    from: &[String],
    name: &str,
) -> Option<Gain> {
    // A support that leans hardly shows where the weight acts.
    let shows = |i: &Interaction| !matches!(i.kind, Kind::Tilt | Kind::Hold) && i.tracks.contains_key(name);
    let touches = |i: &&Interaction| shows(i) && !from.contains(&i.name);
    let sealed: Vec<&Interaction> = capture
        .interactions
        .iter()
        .filter(touches)
        .filter(|i| i.held_out)
        .collect();
    let others: Vec<&Interaction> = if sealed.is_empty() {
        capture.interactions.iter().filter(touches).collect()
    } else {
        sealed
    };
    let traces = |model: &Model| -> Vec<Trace> {
        let cut = |i: &Interaction| segmented.iter().find(|s| s.interaction == i.name);
        let all = others.iter().map(|i| trace_of(capture, i, cut(i), model));
        all.filter(|t| !t.curves.is_empty()).collect()
    };
    let (before, after) = (traces(without), traces(with));
    let names: Vec<String> = after.iter().map(|t| t.interaction.clone()).collect();
    let (before, after) = (errors(&before), errors(&after));
    let mut best: Option<Gain> = None;
    for (quantity, (rmse_after, floor)) in &after {
        let (rmse_before, _) = before.get(quantity).copied()?;
        let above = |r: f64| (r * r - floor * floor).max(0.0);
        let reduction = 1.0 - (above(*rmse_after) / above(rmse_before).max(1e-30)).min(2.0);
        if best.as_ref().is_none_or(|b| reduction > b.reduction) {
            best = Some(Gain {
                quantity: quantity.name().to_owned(),
                rmse_before,
                rmse_after: *rmse_after,
                unit: quantity.unit().to_owned(),
                held_out: names.clone(),
                reduction,
                ..Gain::default()
            });
        }
    }
    best.filter(|g| g.reduction > 0.0)
        .or_else(|| names.is_empty().then(nothing_to_gain_on))
}

fn nothing_to_gain_on() -> Gain {
    Gain {
        quantity: "force".into(),
        rmse_before: 0.0,
        rmse_after: 0.0,
        unit: "N".into(),
        held_out: Vec::new(),
        reduction: 0.0,
        ..Gain::default()
    }
}
