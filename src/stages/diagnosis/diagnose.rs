//! The verb of the diagnosis pass.

use std::collections::BTreeMap;

use super::aloft::told_aloft;
use super::axes::of_all_axes;
use super::blows::blow_findings;
use super::bristles::{Bristles, turning_back, way_of};
use super::bursts::bursts;
use super::clocks::Clocks;
use super::compare::base_fit;
use super::coupling::without_what_follows;
use super::delay::{delay_finding, held_in, take_up};
use super::family::Family;
use super::frames::{frame_finding, put_right, take_up_frame};
use super::hand_delay::{HandDelay, hand_delay};
use super::inertia::{self, findings_of_inertia};
use super::knocked::knocked;
use super::levels::Level;
use super::loads::{Load, Loads, or_load, or_toss};
use super::missed::where_left;
use super::motions::{Motions, of_all_joints};
use super::naming::{NAMED, climb};
use super::offset::centre_findings;
use super::one_way::one_way;
use super::onset::{Onset, onset_findings, onsets};
use super::play::play_findings;
use super::predict::trace_of;
use super::press_closer::stiffer_than_its_bond;
use super::presses::Presses;
use super::pushes::Pushes;
use super::ripples::swinging;
use super::rolls::rolls;
use super::sensor::{as_one, rounded_away, sensor_findings};
use super::sensor_lag::{SensorLag, lag_of_all};
use super::shown::pictured;
use super::sinking::without_what_sinks;
use super::slipped::slipped;
use super::swerves::swerves;
use super::tares::tare_finding;
use super::told::told_by_one_number;
use super::tosses::of_all_bodies;
use super::turns::Turns;
use super::uneven::{spun, twisted};
use super::verdict::concluded;
use super::wavering::wavering;
use super::weights::{weights_differ, within_range};
use super::white::whiteness;
use super::{Config, Trace, asking};
use crate::base::{Notices, Result};
use crate::capture::{Capture, Interaction, Segmented, SensorFaults};
use crate::stages::estimation::{Inertial, inertial, support_normal};
use crate::twin::{
    BaseFit, DIAGNOSIS_FORMAT, Diagnosis, Experiment, Finding, Model, Profile, Verdict, WORLD, in_order,
};

/// A diagnosis with the curves that it rests on.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The content of `diagnosis.json`.
    pub diagnosis: Diagnosis,
    /// Measured against predicted, one per interaction, in the order of the capture.
    pub traces: Vec<Trace>,
    /// Effect size of each cause of which a law was fitted beside the plain model: `sqrt(2 (ll − ll of the plain model))`.
    pub effect_sizes: BTreeMap<&'static str, f64>,
    /// Penalised marginal log-likelihood of all that was fitted with what was named, nats: for models of one capture.
    pub log_likelihood: f64,
    /// What numbers of the twin are beside the effects that were named.
    pub levels: Vec<Level>,
}

impl Diagnosed {
    /// Nothing was asked, nothing is claimed.
    pub fn skipped() -> Self {
        Self {
            diagnosis: nothing_named(BaseFit::default(), Verdict::Unknown),
            traces: Vec::new(),
            effect_sizes: BTreeMap::new(),
            log_likelihood: 0.0,
            levels: Vec::new(),
        }
    }
}

fn nothing_named(base: BaseFit, verdict: Verdict) -> Diagnosis {
    Diagnosis {
        format: DIAGNOSIS_FORMAT.into(),
        base,
        verdict,
        findings: Vec::new(),
        experiments: Vec::new(),
        profiles: Vec::new(),
        budgets: Vec::new(),
        missed: Vec::new(),
        left: Vec::new(),
    }
}

/// Predicts every interaction with the twin, compares with what was measured, and names what the plain model lacks.
///
/// The error that counts is that on interactions which were not used to fit. Causes are named by the ladder of laws
/// over pushes and presses and from what the twin itself carries beyond the plain model; what is left above the
/// noise and the scatter of dry friction without a name makes the verdict `unknown`.
pub fn diagnose(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    faults: &SensorFaults,
    config: &Config,
    notices: &mut Notices,
) -> Result<Diagnosed> {
    config.check()?;
    let predicted = |capture: &Capture, with: &Model, (loads, tosses): (&[Load], &[Trace])| -> Vec<Trace> {
        let of = |name: &str| segmented.iter().find(|s| s.interaction == name);
        let each = capture.interactions.iter();
        let hangs = |i: &Interaction| {
            let mut joints = with.twin.joints();
            joints.any(|j| j.parent == WORLD && i.target.as_ref() == Some(&j.child))
        };
        each.map(|i| or_load(trace_of(capture, i, of(&i.name), with), loads, hangs(i)))
            .map(|t| or_toss(t, tosses))
            .collect()
    };
    let plainly = predicted(capture, model, (&[], &[]));
    let frame = frame_finding(capture, model, &plainly).filter(|f| config.allows(&f.cause));
    // What rolls does not go where it is pushed.
    let slides = model.twin.links().all(|(_, l)| l.friction.rolling.is_none());
    let righted = frame.as_ref().filter(|_| slides).and_then(|f| put_right(capture, f));
    let (raw, capture) = (capture, righted.as_ref().unwrap_or(capture));
    let (plain, mut findings) = centre_findings(capture, segmented, model, config);
    let late = hand_delay(capture, segmented, model).filter(|late| config.allows(late.cause()));
    let on_time = late.as_ref().map(|late| late.undone(capture));
    let of_joints = on_time.as_ref().unwrap_or(capture);
    let (mut experiments, mut curves) = name_causes(of_joints, segmented, model, (config, faults), &mut findings);
    findings.extend(play_findings(of_joints, segmented, model, &findings, notices));
    let traces = predicted(capture, model, (&curves.full, &curves.full_tosses));
    let fast: &[Inertial] = if findings.iter().any(swings) { &[] } else { &curves.fast };
    let slides = |t: &&Trace| !curves.rolled.contains(&t.interaction);
    let slid: Vec<Trace> = traces.iter().filter(slides).cloned().collect();
    // A force that comes up late puts the first touch late, and what is tracked before it.
    findings.extend(late.as_ref().map(HandDelay::finding));
    if late.is_none() && findings.iter().all(|f| f.cause != "sensor-lag") {
        let delay = two_clocks((capture, &slid), (&curves, fast), model, &findings);
        take_up(&mut findings, delay);
    }
    let stands = frame.filter(|_| righted.is_some());
    take_up_frame(&mut findings, stands, || frame_finding(capture, model, &slid));
    findings.extend(sensor_findings(capture, faults, &traces));
    findings.extend(tare_finding(capture, segmented, &findings));
    keep_what_stands(&mut findings, config);
    curves.left_beside(swerves(capture, &slid, &findings));
    curves.left_beside(bursts(&slid, &findings).or_else(|| wavering((capture, model), &slid, &findings)));
    curves.left_beside(knocked(capture, &mut findings).or_else(|| slipped(capture)));
    curves.left_beside(super::heavier::while_it_hangs(capture, segmented, &findings));
    experiments.extend(curves.unseen((capture, segmented, model), (&traces, &findings), config));
    in_order(&mut experiments);
    say(capture, &traces, notices);
    let without = (!findings.is_empty()).then(|| predicted(raw, &plain, (&curves.plain, &curves.plain_tosses)));
    let without = without.as_deref().unwrap_or(&traces);
    let mut base = base_fit(without, config);
    base.tests = [whiteness(&traces), curves.tests].concat();
    let swings = swinging((raw, segmented, model), faults, (&mut findings, &mut base));
    let left = !swings.is_empty() || curves.left;
    let verdict = concluded(&traces, &mut findings, (left, curves.overruled), config);
    let depends = [swings, curves.left_against].concat();
    let (missed, left) = where_left(verdict, (curves.missed, depends), &traces, config);
    let diagnosis = Diagnosis {
        profiles: pictured(curves.profiles, &findings, [without, &traces]),
        budgets: curves.budgets.into_iter().map(|b| b.doubted(&findings)).collect(),
        missed,
        left,
        findings,
        experiments,
        ..nothing_named(base, verdict)
    };
    Ok(Diagnosed {
        diagnosis,
        traces,
        effect_sizes: curves.effect_sizes,
        log_likelihood: curves.log_likelihood,
        levels: curves.levels,
    })
}

/// Track and force by two clocks, as the ways, the beginnings and the blows of pushes tell it beside what was found.
fn two_clocks(
    (capture, slid): (&Capture, &[Trace]),
    (curves, fast): (&Loads, &[Inertial]),
    model: &Model,
    findings: &[Finding],
) -> Option<Finding> {
    let thick = findings.iter().any(|f| f.cause == "viscous-friction");
    let even = if thick || findings.iter().any(at_a_place) {
        &[]
    } else {
        fast
    };
    // Friction that grows with speed comes up as the body does, the later the faster the push.
    let begun = || curves.clocks.finding().filter(|_| !thick);
    let of_blows = || inertia::delay_finding(even, model).filter(|f| curves.clocks.agree(f));
    let turned = || curves.turned.as_ref().and_then(Bristles::delay);
    let found = delay_finding(slid, &held_in(capture))
        .or_else(begun)
        .or_else(of_blows)
        .or_else(turned);
    found.filter(|f| !curves.clocks.feigned(f))
}

/// A part that swings lags behind, as what is read by a late clock does.
fn swings(finding: &Finding) -> bool {
    matches!(finding.cause.as_str(), "loose-mass" | "added-inertia")
}

/// Share of the error below which one number of a joint that no law explains is not what is wrong with it.
const HALF: f64 = 0.5;

/// Causes that act on a body at one place of the support.
const AT_A_PLACE: [&str; 4] = ["magnet", "bump", "friction-patch", "hidden-body"];

/// What rubs more at one place moves the moment at which a body that was pushed fast comes to rest, as a delay does.
fn at_a_place(finding: &Finding) -> bool {
    AT_A_PLACE.contains(&finding.cause.as_str())
}

/// Of a push whose force is cut off only its beginning was felt, with all of the body's way after it.
fn keep_what_stands(findings: &mut Vec<Finding>, config: &Config) {
    if findings.iter().any(|f| f.cause == "force-saturation") {
        findings.retain(|f| f.cause != "presliding");
    }
    within_range(findings);
    findings.retain(|f| config.allows(&f.cause));
    as_one(findings);
    stiffer_than_its_bond(findings);
}

/// Causes that pushes, presses and motions of joints show, and what would tell apart those that these data cannot.
fn name_causes(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    (config, faults): (&Config, &SensorFaults),
    findings: &mut Vec<Finding>,
) -> (Vec<Experiment>, Loads) {
    let lost = rounded_away(faults);
    let begun = onsets(capture, segmented, model);
    let all: Vec<Onset> = begun.iter().flat_map(|(_, all)| all.iter().cloned()).collect();
    let turned = turning_back((capture, segmented, model), config);
    let lag = lag_of_all((capture, segmented, model), &all, &turned).filter(|_| config.allows("sensor-lag"));
    // Presses tell the lag beside what gives, as it was read.
    let presses = Presses::new(capture, segmented, model).map(|p| p.rounded(lost));
    let undone = lag.as_ref().map(|lag| lag.undone(capture));
    let capture = undone.as_ref().unwrap_or(capture);
    let turned = undone
        .as_ref()
        .map_or(turned, |c| turning_back((c, segmented, model), config));
    let pushes = Pushes::new((capture, segmented, model), way_of(&turned)).map(|p| p.rounded(lost));
    let mut loads = Loads::beside(turned);
    let wandering = moving_axes(capture, model, config, &mut loads);
    // The load along a joint is taken about the axis that the twin has.
    let holds = |m: &Motions| wandering.iter().all(|f| f.place != m.joint());
    findings.extend(wandering.iter().cloned());
    let joints = of_all_joints(capture, segmented, model).into_iter().filter(holds);
    let motions: Vec<Motions> = joints.map(|m| m.rounded(lost)).collect();
    let turns = Turns::new(capture, segmented, model);
    let first = [
        pushes.as_ref().map(|p| p as &dyn Family),
        turns.as_ref().map(|t| t as &dyn Family),
        presses.as_ref().map(|p| p as &dyn Family),
    ];
    let families = first.into_iter().flatten().map(|f| (f, None));
    let of_joints = motions.iter().map(|m| (m as &dyn Family, Some(m)));
    let mut asked = Vec::new();
    for (family, joint) in families.chain(of_joints) {
        let Some(ladder) = climb(family, config) else { continue };
        for (cause, place) in family.feigned(&ladder.full) {
            findings.retain(|f| f.cause != cause || f.place != place);
        }
        let found = beside(loads.named(family, &ladder), findings);
        let found = placed(found, &mut loads.profiles, thing_of(family, capture));
        asked.extend(found.iter().filter_map(|f| asking::asked(family, &ladder, f)));
        findings.extend(found);
        joint.iter().for_each(|j| loads.of_joint(j, &ladder));
    }
    let blows = pushes.as_ref().map(|p| blow_findings(p, findings));
    for (found, profile) in blows.into_iter().flatten() {
        findings.push(found);
        loads.profiles.extend(profile);
    }
    findings.extend(loads.of_rolls(rolls(capture, segmented, model)));
    let done = spinning(capture, model, findings);
    for tosses in of_all_bodies(capture, model) {
        let Some(ladder) = climb(&tosses, config) else { continue };
        findings.extend(loads.of_tosses(&tosses, &ladder));
    }
    loads.fast = inertial(capture, segmented, model).unwrap_or_default();
    findings_of_inertia((capture, segmented, model), pushes.is_some(), &loads, findings);
    let told = told_by_one_number(capture, segmented, model, findings);
    loads.left |= told
        .iter()
        .any(|f| loads.nameless.contains(&f.place) && f.gain.reduction < HALF);
    findings.extend(told);
    without_what_follows(findings);
    without_what_sinks(findings);
    told_aloft(capture, segmented, findings);
    loads.left_beside(pushes.as_ref().and_then(|p| one_way(p, (capture, model), findings)));
    loads.left_beside(weights_differ(capture, segmented));
    let slow = findings.iter().any(|f| f.cause == "sensor-lag");
    findings.extend(lag.iter().filter(|_| !slow).map(SensorLag::finding));
    if lag.is_none() {
        loads.clocks = Clocks::of(&begun);
        findings.extend(onset_findings(&begun, &loads.clocks));
    }
    findings.extend(loads.presliding(findings));
    findings.retain(|f| config.allows(&f.cause));
    (asking::experiments(findings, &asked, &done), loads)
}

/// What fast pushes have told, and could tell, of the body whose centre is not where its shape has it.
fn spinning(capture: &Capture, model: &Model, findings: &[Finding]) -> asking::Done {
    let (name, up) = (centre_of(findings), support_normal(capture, model));
    asking::Done {
        spins: name.map_or_else(Vec::new, |n| asking::spins(model, &up, n)),
        spun: name.is_some_and(|n| spun(capture, model, n)),
        twist: name.and_then(|n| asking::twist(capture, &up, n, twisted(model, n))),
    }
}

fn centre_of(findings: &[Finding]) -> Option<&str> {
    let own = findings
        .iter()
        .find(|f| f.cause == "com-offset" || f.cause == "nonuniform-density");
    own.map(|f| f.place.as_str())
}

/// Where a law of pushes or presses acts, before it is said on which thing.
const BODY: &str = "body";

/// Beside a centre of mass that turning and lifting found off, what forces name has to be worth as much as any second effect.
fn beside(mut found: Vec<Finding>, earlier: &[Finding]) -> Vec<Finding> {
    let weak = |f: &Finding| {
        f.evidence
            .iter()
            .any(|e| e.test.starts_with("log evidence") && e.statistic < NAMED)
    };
    if earlier.iter().any(|f| f.cause == "com-offset") {
        found.retain(|f| !weak(f));
    }
    found
}

fn placed(mut findings: Vec<Finding>, profiles: &mut [Profile], thing: Option<&str>) -> Vec<Finding> {
    let places = findings.iter_mut().map(|f| &mut f.place);
    let all = places.chain(profiles.iter_mut().map(|p| &mut p.place));
    for (place, thing) in all.filter(|p| *p == BODY).zip(thing.into_iter().cycle()) {
        thing.clone_into(place);
    }
    findings
}

/// The one thing to which all experiments of a family were done.
fn thing_of<'a>(family: &dyn Family, capture: &'a Capture) -> Option<&'a str> {
    let done = |i: &&Interaction| family.sheet().groups.iter().any(|g| g.name == i.name);
    let only = |i: &'a Interaction| i.tracks.keys().next().filter(|_| i.tracks.len() == 1);
    let mut things = capture
        .interactions
        .iter()
        .filter(done)
        .map(|i| i.target.as_ref().or_else(|| only(i)));
    let first = things.next()??;
    things.all(|t| t == Some(first)).then_some(first.as_str())
}

/// Hinges whose axis wanders.
fn moving_axes(capture: &Capture, model: &Model, config: &Config, loads: &mut Loads) -> Vec<Finding> {
    let mut findings = Vec::new();
    for axes in of_all_axes(capture, model) {
        if let Some(ladder) = climb(&axes, config) {
            findings.extend(loads.named(&axes, &ladder));
        }
    }
    findings
}

fn say(capture: &Capture, traces: &[Trace], notices: &mut Notices) {
    for trace in traces.iter().filter(|t| t.curves.is_empty()) {
        let why = trace.remark.as_deref().unwrap_or("nothing to compare");
        notices.note("diagnosis", &trace.interaction, format!("not predicted: {why}"));
    }
    if !traces.iter().any(|t| t.held_out) && !traces.is_empty() {
        notices.warn(
            "diagnosis",
            &capture.name,
            "no interaction was held out: the error is that on data the twin was fitted to",
        );
    }
}
