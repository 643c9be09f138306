//! What tosses say, written into the twin, and read back from it.

use nalgebra::Vector3;

use super::conditions::Conditions;
use super::fit::{Fitted, Study};
use super::read::{Subject, start, subjects};
use super::sought::{Sought, flying, landing, rigid};
use super::windows::Scene;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::Capture;
use crate::math::t_quantile;
use crate::stages::estimation::resolve::STAGE;
use crate::twin::{Joint, Link, Model, Tossed, Twin};

/// What the estimates from tosses are marked with.
pub const METHOD: &str = "toss-windows";
/// A number is measured where its doubt is less than this share of the prior's.
const TOLD: f64 = 0.5;
/// What the law of impact (Newton's restitution, Coulomb's cone, all corners at once) leaves open: absolute, as a share
/// of the value, and absolute and as a share of the value for each unit by which the restitution exceeds [`LIVELY`]. Against a
/// simulator of compliant contacts (docs/BENCHMARKS.md).
const FORM: [(&str, f64, f64, f64, f64); 3] = [
    ("restitution", 0.02, 0.03, 0.0, 0.0),
    ("friction", 0.0, 0.03, 0.0, 0.6),
    ("inertia", 0.05, 0.0, 0.4, 0.0),
];
/// Restitution from which on an impact lasts long enough for what slides in it to matter: it may slip where the law has it
/// stick.
const LIVELY: f64 = 0.4;
/// How far a carved shape's centre may be from that of its mass, m; and one that was seen.
const CARVED: f64 = 0.03;
const SEEN: f64 = 0.01;
/// Doubt of the centre of mass up to which it is better than that of the shape, m.
const CENTRED: f64 = 4e-3;

/// A fit with what was sought in it.
struct Result<'a> {
    sought: Vec<Sought>,
    fitted: Fitted,
    study: &'a Study,
}

impl Result<'_> {
    fn at(&self, name: &str) -> Option<usize> {
        self.sought.iter().position(|s| s.name == name)
    }

    /// Value, standard deviation, and half the 95 % interval.
    fn value(&self, name: &str) -> Option<(f64, f64, f64)> {
        let k = self.at(name)?;
        let sd = self.fitted.covariance[(k, k)].max(0.0).sqrt();
        let t = t_quantile(0.975, (self.fitted.tosses as f64 - 1.0).max(1.0));
        let value = (self.sought[k].get)(&self.fitted.at);
        // The law of impact is a model: its own error does not fall with the number of tosses.
        let lively = (self.fitted.at.restitution - LIVELY).max(0.0);
        let form = FORM.iter().find(|f| f.0 == name).map_or(0.0, |f| {
            let absolute = f.1.hypot(f.3 * lively);
            absolute.hypot(f.2 * value).hypot(f.4 * lively * value)
        });
        Some((value, sd.hypot(form), (t * sd).hypot(1.96 * form)))
    }

    fn from(&self, scenes: &[Scene]) -> Vec<String> {
        let used = |i: &usize| {
            self.study
                .windows
                .iter()
                .any(|w| w.toss == *i && scenes.contains(&w.scene))
        };
        let each = (0..self.study.tosses.len()).filter(used);
        each.map(|i| self.study.tosses[i].name.clone()).collect()
    }

    /// An estimate within `range`, as `map` turns the number that was sought into it (and is rising); assumed where the
    /// prior says nearly as much.
    fn estimate(
        &self,
        name: &str,
        unit: &str,
        range: [f64; 2],
        scenes: &[Scene],
        map: impl Fn(f64) -> f64,
    ) -> Option<Estimate> {
        let (value, sd, half) = self.value(name)?;
        let prior = self.sought[self.at(name)?].prior.1;
        let ends = [value - half, value + half].map(|x| map(x).clamp(range[0], range[1]));
        let slope = (map(value + 1e-6) - map(value - 1e-6)) / 2e-6;
        let mut out =
            Estimate::measured(map(value), (slope * sd).abs(), unit, self.from(scenes), METHOD).with_interval(ends);
        if half > TOLD * 1.96 * prior {
            out.status = Status::Assumed;
        }
        Some(out)
    }
}

const CENTRE: [&str; 3] = ["centre-x", "centre-y", "centre-z"];
const SECOND: [&str; 3] = ["second-x", "second-y", "second-z"];
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
const CONTACTS: [Scene; 1] = [Scene::Contact];
const FLIGHTS: [Scene; 1] = [Scene::Flight];

/// Reads every body of which tosses are recorded and writes what they say into the twin.
pub(crate) fn identify_tosses(capture: &Capture, model: &mut Model, notices: &mut Notices) {
    for subject in subjects(capture, model, false) {
        let mut study = subject.study.clone();
        let fitted = match &subject.second {
            None => study.fit_twice(&start(), &rigid()).map(|f| vec![(rigid(), f)]),
            Some(_) => fit_hinged(&mut study, subject.carved),
        };
        let Some(all) = fitted else { continue };
        let results: Vec<Result> = all
            .into_iter()
            .map(|(sought, fitted)| Result {
                sought,
                fitted,
                study: &study,
            })
            .collect();
        for result in &results {
            write(&mut model.twin, &subject, result, capture);
        }
        say(&model.twin, &subject, &results, notices);
    }
}

/// Flights tell where the mass is and what the hinge does, contacts then what the support does.
fn fit_hinged(study: &mut Study, carved: bool) -> Option<Vec<(Vec<Sought>, Fitted)>> {
    let mut flights = study.clone();
    flights.windows.retain(|w| w.scene == Scene::Flight);
    let sought = flying(if carved { CARVED } else { SEEN });
    let flown = flights.fit(&start(), &sought)?;
    let mut out = vec![(sought, flown)];
    if let Some(landed) = study.fit(&out[0].1.at, &landing()) {
        out.push((landing(), landed));
    }
    Some(out)
}

fn write(twin: &mut Twin, subject: &Subject, result: &Result, capture: &Capture) {
    if let Some(link) = twin.link_mut(&subject.root) {
        write_link(link, subject, result, capture);
    }
    if let Some((second, joint)) = &subject.second {
        if let Some(link) = twin.link_mut(second) {
            let mut tossed = link.tossed.take().unwrap_or_default();
            let spread = [
                "second-spread-xx",
                "second-spread-yy",
                "second-spread-zz",
                "second-spread-xy",
            ];
            write_spread(&mut tossed, result, SECOND, spread);
            link.tossed = Some(tossed);
        }
        let mass = subject_mass(twin, subject);
        let joints = twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
        if let Some(joint) = joints.into_iter().find(|j| j.name == *joint) {
            write_joint(joint, result, mass);
        }
    }
}

fn write_link(link: &mut Link, subject: &Subject, result: &Result, capture: &Capture) {
    let measured = |e: Option<Estimate>| e.filter(Estimate::is_measured);
    if let Some(e) = measured(result.estimate("restitution", "1", [0.0, 1.0], &CONTACTS, |x| x)) {
        link.restitution = Some(e);
    }
    // What a slope or a coasting slide said of friction is closer to the definition.
    let kinetic = measured(result.estimate("friction", "1", POSITIVE, &CONTACTS, |x| x));
    if let Some(e) = kinetic.filter(|_| link.friction.kinetic.as_ref().is_none_or(|k| !k.is_measured())) {
        link.friction.kinetic = Some(e);
    }
    let g = capture.gravity.norm();
    let mut tossed = link.tossed.take().unwrap_or_default();
    let set = |slot: &mut Option<Estimate>, found: Option<Estimate>| {
        if found.is_some() {
            *slot = found;
        }
    };
    let gravity = result.estimate("gravity", "m/s²", POSITIVE, &FLIGHTS, |x| g * (1.0 + x));
    let shared = Confounded {
        with: vec!["length scale of the track".into(), "rate of the clock".into()],
        known: "gravity × length scale / (rate of the clock)²".into(),
        experiment: "move the body along a ruler, and film a clock".into(),
    };
    set(&mut tossed.gravity, gravity.map(|e| e.with_confounded(shared)));
    set(
        &mut tossed.inertia_ratio,
        result.estimate("inertia", "1", POSITIVE, &CONTACTS, f64::exp),
    );
    set(
        &mut tossed.edge_radius,
        result.estimate("rounding", "m", POSITIVE, &CONTACTS, |x| x),
    );
    set(
        &mut tossed.resting_height,
        result.estimate("lying", "m", ANY, &[Scene::Rest], |x| x),
    );
    set(
        &mut tossed.support_rise,
        result.estimate("rise", "m", ANY, &CONTACTS, |x| x),
    );
    set(
        &mut tossed.air_drag,
        result.estimate("drag", "1/m", POSITIVE, &FLIGHTS, |x| x),
    );
    set(
        &mut tossed.hinge_friction,
        result.estimate("hinge-friction", "N·m/kg", POSITIVE, &FLIGHTS, |x| x),
    );
    set(
        &mut tossed.hinge_damping,
        result.estimate("hinge-damping", "N·m·s/(rad·kg)", POSITIVE, &FLIGHTS, |x| x),
    );
    write_spread(
        &mut tossed,
        result,
        CENTRE,
        ["spread-xx", "spread-yy", "spread-zz", "spread-xy"],
    );
    if subject.second.is_none() {
        write_mass(link, subject, result, &tossed);
    }
    link.tossed = Some(tossed);
}

/// Where the mass of a link is: names of the three numbers of its centre and of those of its spread that are sought.
fn write_spread(tossed: &mut Tossed, result: &Result, centre: [&str; 3], spread: [&str; 4]) {
    let values = |names: &[&str]| {
        names
            .iter()
            .map(|n| result.value(n))
            .collect::<Option<Vec<(f64, f64, f64)>>>()
    };
    if let Some(v) = values(&centre) {
        let (value, sd) = (std::array::from_fn(|k| v[k].0), std::array::from_fn(|k| v[k].1));
        let ends = std::array::from_fn(|k| [v[k].0 - v[k].2, v[k].0 + v[k].2]);
        let from = result.from(&FLIGHTS);
        tossed.centre_offset = Some(Estimate::measured(value, sd, "m", from, METHOD).with_interval(ends));
    }
    if let Some(v) = values(&spread) {
        let pick = |f: fn(&(f64, f64, f64)) -> f64, open: f64| [f(&v[0]), f(&v[1]), f(&v[2]), f(&v[3]), open, open];
        // The prior says as much as the flights.
        let mut out = Estimate::assumed(pick(|x| x.0, 0.0), pick(|x| x.1, 0.5), "1", METHOD);
        out.from = result.from(&FLIGHTS);
        tossed.spread = Some(out);
    }
}

/// Centre of mass and inertia, where the tosses know them better than the shape.
fn write_mass(link: &mut Link, subject: &Subject, result: &Result, tossed: &Tossed) {
    let all: Option<Vec<(f64, f64, f64)>> = CENTRE.iter().map(|n| result.value(n)).collect();
    let open = link.com.as_ref().is_none_or(|c| !c.is_measured());
    if let Some(all) = all.filter(|a| open && a.iter().all(|v| v.1 < CENTRED)) {
        let value: [f64; 3] = std::array::from_fn(|k| subject.origin[k] + all[k].0);
        let ends = std::array::from_fn(|k| [value[k] - all[k].2, value[k] + all[k].2]);
        let sd = std::array::from_fn(|k| all[k].1);
        link.com = Some(Estimate::measured(value, sd, "m", result.from(&FLIGHTS), METHOD).with_interval(ends));
    }
    let ratio = tossed.inertia_ratio.as_ref().filter(|r| r.is_measured());
    if let (Some(ratio), Some(mass)) = (ratio, &link.mass) {
        let i = subject.study.body.root.inertia * (ratio.value * mass.value);
        let value = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]];
        let share = (ratio.sd.unwrap_or(0.0) / ratio.value).hypot(mass.sd.unwrap_or(0.0) / mass.value);
        let sd = value.map(|v: f64| share * v.abs().max(0.02 * i.trace()));
        link.inertia = Some(Estimate::measured(value, sd, "kg·m²", result.from(&CONTACTS), METHOD));
    }
}

/// Mass of all links, where it is known.
fn subject_mass(twin: &Twin, subject: &Subject) -> Option<f64> {
    let second = subject.second.as_ref().map(|s| s.0.as_str());
    let links = std::iter::once(subject.root.as_str()).chain(second);
    links.map(|l| Some(twin.link(l)?.mass.as_ref()?.value)).sum()
}

/// Friction and damping of the hinge: the tosses know them over the mass alone.
fn write_joint(joint: &mut Joint, result: &Result, mass: Option<f64>) {
    let told = |name: &str, units: [&str; 2]| {
        let over = result.estimate(name, units[0], POSITIVE, &FLIGHTS, |x| x)?;
        let scale = mass.unwrap_or(1.0);
        let mut out = result.estimate(name, units[1], POSITIVE, &FLIGHTS, |x| x * scale)?;
        if mass.is_none() {
            out.status = Status::Assumed;
            out = out.with_confounded(Confounded {
                with: vec!["mass".into()],
                known: format!(
                    "over the mass of both links: {:.5} ± {:.5} {}; a mass of 1 kg stands in",
                    over.value,
                    over.sd.unwrap_or(0.0),
                    units[0]
                ),
                experiment: "weigh it".into(),
            });
        }
        Some(out)
    };
    if let Some(e) = told("hinge-friction", ["N·m/kg", "N·m"]) {
        joint.friction = Some(e);
    }
    if let Some(e) = told("hinge-damping", ["N·m·s/(rad·kg)", "N·m·s/rad"]) {
        joint.damping = Some(e);
    }
}

fn say(twin: &Twin, subject: &Subject, results: &[Result], notices: &mut Notices) {
    let link = twin.link(&subject.root);
    if link.is_none_or(|l| l.mass.is_none()) {
        let words = "tosses show no mass: every motion in them is the same whatever it is; weigh it, or push it with a force sensor";
        notices.note(STAGE, &subject.root, words);
    }
    if subject.carved {
        let words = "its shape was carved from how it flew, lay and rolled over the support: the largest convex one that never goes through it";
        notices.note(STAGE, &subject.root, words);
    }
    let Some(last) = results.last() else { return };
    let misfit = last.fitted.misfit;
    let words = format!(
        "{} tosses in {} windows; typical misfit, in standard deviations of what a window can tell: flights {:.1}, contacts {:.1}, rests {:.1}",
        last.fitted.tosses,
        last.study.windows.len(),
        misfit[0],
        misfit[1],
        misfit[2],
    );
    notices.note(STAGE, &subject.root, words);
}

/// The conditions under which the twin has a body fly and land.
pub fn conditions_of(twin: &Twin, subject: &Subject) -> Conditions {
    let mut at = start();
    let Some(link) = twin.link(&subject.root) else {
        return at;
    };
    let read = |slot: &mut f64, e: Option<&Estimate>| {
        if let Some(e) = e {
            *slot = e.value;
        }
    };
    read(&mut at.restitution, link.restitution.as_ref());
    read(&mut at.friction, link.friction.kinetic.as_ref());
    if let Some(t) = &link.tossed {
        let g = Vector3::from(twin.gravity).norm();
        at.gravity = t.gravity.as_ref().map_or(0.0, |e| e.value / g - 1.0);
        at.log_inertia = t.inertia_ratio.as_ref().map_or(0.0, |e| e.value.ln());
        read(&mut at.rounding, t.edge_radius.as_ref());
        read(&mut at.lying, t.resting_height.as_ref());
        read(&mut at.rise, t.support_rise.as_ref());
        read(&mut at.drag, t.air_drag.as_ref());
        read(&mut at.hinge_friction, t.hinge_friction.as_ref());
        read(&mut at.hinge_damping, t.hinge_damping.as_ref());
    }
    let own = |name: &str| twin.link(name).and_then(|l| l.tossed.as_ref());
    if let Some(tossed) = own(&subject.root) {
        at.centre = tossed
            .centre_offset
            .as_ref()
            .map_or_else(Vector3::zeros, |e| e.value.into());
        at.spread[0] = tossed.spread.as_ref().map_or([0.0; 6], |e| e.value);
    }
    if let Some(tossed) = subject.second.as_ref().and_then(|(name, _)| own(name)) {
        at.second_centre = tossed
            .centre_offset
            .as_ref()
            .map_or_else(Vector3::zeros, |e| e.value.into());
        at.spread[1] = tossed.spread.as_ref().map_or([0.0; 6], |e| e.value);
    }
    at
}
