//! Joints and relations of random scenes of the lab: `cargo bench --bench joints -- [trees N] [arms N] [stacks N] [ajar N]
//! [decide N] [time] [scatter X] [only K …]`. After `only` come the numbers of the scenes that are made; `scatter` is how much friction
//! differs from touch to touch (a share, 0.01 where it is not given). Prints how often the kind is
//! right and how well its probability is calibrated, errors of axis, origin and dynamics, how often the intervals hold the
//! truth, and how soon chosen touches decide what is open.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::disallowed_macros,
    reason = "a program that prints its figures"
)]

mod ajar;
mod decide;
mod scenes;
mod stacks;
mod tally;

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Progress, Seed, Stopwatch};
use palpate::capture::{Capture, read_capture, write_capture_with};
use palpate::lab::{Scene, synthesise};
use palpate::pipeline::{Options, Pass, Run, build};
use palpate::twin::{Joint, JointKind, RelationKind};
use rayon::prelude::*;
use scenes::{Hung, Made};
use tally::{Odds, Tally};

const NOISE: [&str; 3] = ["fine", "middling", "coarse"];

/// What the lab records of a scene. In the folder that JOINTS_KEEP names recordings are kept, and those that are there
/// already are taken as they are.
pub fn recorded(scene: &Scene, label: &str, seed: u64) -> Capture {
    let made = || synthesise(scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture");
    let Ok(folder) = std::env::var("JOINTS_KEEP") else {
        return made().capture;
    };
    let place = Path::new(&folder).join(label);
    if !place.is_dir() {
        let made = made();
        write_capture_with(&made.capture, &place, &made.files).expect("written");
    }
    read_capture(&place).expect("a capture")
}

pub fn options() -> Options {
    Options {
        passes: vec![Pass::Shape, Pass::Articulation, Pass::Physics, Pass::Relations],
        ..Options::default()
    }
}

pub fn verbose() -> bool {
    std::env::var("JOINTS_VERBOSE").is_ok()
}

fn kind_of(word: &str) -> JointKind {
    match word {
        "revolute" => JointKind::Revolute,
        "prismatic" => JointKind::Prismatic,
        _ => JointKind::Screw,
    }
}

#[derive(Default)]
struct Results {
    kinds: BTreeMap<&'static str, (usize, usize)>,
    extra: usize,
    odds: Odds,
    tallies: BTreeMap<String, Tally>,
    freedoms: (usize, usize),
    fixed_without_proof: usize,
}

fn between<'a>(run: &'a Run, hung: &Hung) -> Option<&'a Joint> {
    run.model.twin.joints().find(|j| {
        (j.parent == hung.parent && j.child == hung.child) || (j.parent == hung.child && j.child == hung.parent)
    })
}

impl Results {
    fn of(&mut self, name: &str) -> &mut Tally {
        self.tallies.entry(name.into()).or_default()
    }

    fn judge(&mut self, made: &Made, run: &Run, label: &str) {
        for hung in &made.joints {
            let found = between(run, hung);
            let right = found.is_some_and(|j| j.kind == kind_of(hung.kind));
            let count = self.kinds.entry(hung.kind).or_default();
            count.0 += usize::from(right);
            count.1 += 1;
            let Some(joint) = found else {
                println!("  {label}: no joint {} {} {}", hung.kind, hung.parent, hung.child);
                let about = |n: &&palpate::base::Notice| n.stage == "articulation" && n.about.contains(&hung.child);
                for notice in run.model.twin.notices.iter().filter(about) {
                    println!("    {}: {}", notice.about, notice.message);
                }
                continue;
            };
            self.odds.add(joint.probability, right);
            if !right {
                println!(
                    "  {label}: {} {} {} is {:?} with {:.3}",
                    hung.kind, hung.parent, hung.child, joint.kind, joint.probability
                );
                continue;
            }
            self.place(made, hung, joint, label);
            self.dynamics(made, hung, joint, label);
        }
        let known = |j: &Joint| {
            made.joints
                .iter()
                .any(|h| between(run, h).is_some_and(|k| k.name == j.name))
        };
        self.extra += run.model.twin.joints().filter(|j| !known(j)).count();
        for relation in &run.model.twin.relations {
            self.fixed_without_proof += usize::from(relation.kind == RelationKind::Fixed);
        }
        for hung in &made.joints {
            let wanted = kind_of(hung.kind).freedom();
            let right = run.model.twin.relations.iter().any(|r| {
                (r.rotation_dof, r.translation_dof) == wanted
                    && ((r.a == hung.parent && r.b == hung.child) || (r.b == hung.parent && r.a == hung.child))
            });
            self.freedoms.0 += usize::from(right);
            self.freedoms.1 += 1;
        }
    }

    fn place(&mut self, made: &Made, hung: &Hung, joint: &Joint, label: &str) {
        let level = NOISE[made.level];
        let (axis, sd) = (Vector3::from(joint.axis.value), joint.axis.sd.expect("a spread"));
        let truth = hung.axis * axis.dot(&hung.axis).signum();
        let off = axis.dot(&truth).clamp(-1.0, 1.0).acos().to_degrees();
        self.of("axis, degrees").error(off);
        self.of(&format!("axis, degrees, {level}")).error(off);
        for i in 0..3 {
            let z = (axis[i] - truth[i]).abs() / sd[i];
            self.of("axis, degrees").held(z <= 1.96);
            self.of(&format!("axis, degrees, {level}")).scaled(z);
        }
        if hung.kind == "prismatic" {
            return;
        }
        let (origin, sd) = (Vector3::from(joint.origin.value), joint.origin.sd.expect("a spread"));
        let miss = origin - hung.origin;
        let miss = miss - hung.axis * hung.axis.dot(&miss);
        self.of("origin, m").error(miss.norm());
        self.of(&format!("origin, m, {level}")).error(miss.norm());
        for i in 0..3 {
            // Where along its axis a hinge sits is nobody's to say.
            if truth[i].abs() < 0.02 {
                let z = miss[i].abs() / sd[i];
                self.of("origin, m").held(z <= 1.96);
                self.of(&format!("origin, m, {level}")).scaled(z);
            }
        }
        if let (Some(pitch), "screw") = (&joint.pitch, hung.kind) {
            self.of("pitch").number(Some(pitch), hung.pitch);
        }
        if verbose() {
            println!(
                "  {label} {level} {}: axis {off:.3}, origin {:.2} mm",
                hung.child,
                1e3 * miss.norm()
            );
        }
    }

    fn dynamics(&mut self, made: &Made, hung: &Hung, joint: &Joint, label: &str) {
        let level = NOISE[made.level];
        let family = match hung.kind {
            "prismatic" => "slide",
            "screw" => "screw",
            _ if hung.axis.z.abs() > 0.999 => "upright hinge",
            _ => "tipped hinge",
        };
        let mut add = |what: &str, estimate: Option<&palpate::base::Estimate>, truth: f64| {
            self.of(&format!("{what}, {family}")).number(estimate, truth);
            if verbose() {
                let told = estimate.map(|e| (e.value, e.ci95, e.status));
                println!("  {label} {level} {} {family} {what} {truth:.4}: {told:?}", hung.child);
            }
        };
        add("friction", joint.friction.as_ref(), hung.friction);
        add("damping", joint.damping.as_ref(), hung.damping);
        if hung.stiffness > 0.0 {
            add("spring", joint.stiffness.as_ref(), hung.stiffness);
        } else if let Some(spring) = joint.stiffness.as_ref().filter(|s| s.is_measured()) {
            println!(
                "  {label} {level} {} {family}: a spring of {:.4} that is not there",
                hung.child, spring.value
            );
            self.of(&format!("no spring, {family}")).held(false);
        } else {
            self.of(&format!("no spring, {family}")).held(true);
        }
    }

    fn print(&mut self) {
        let right: usize = self.kinds.values().map(|k| k.0).sum();
        let all: usize = self.kinds.values().map(|k| k.1).sum();
        println!(
            "kind right {right} of {all} ({:.3}); by kind {:?}",
            right as f64 / all.max(1) as f64,
            self.kinds
        );
        println!(
            "joints that are not there {}; freedoms right {} of {}; fixed without a touch that could part {}",
            self.extra, self.freedoms.0, self.freedoms.1, self.fixed_without_proof
        );
        self.odds.print("probability of the kind");
        for (name, tally) in &mut self.tallies {
            tally.print(name);
        }
    }
}

fn run_all(name: &str, seeds: &[u64], make: fn(u64) -> Made, scatter: Option<f64>) {
    let started = Stopwatch::start();
    let runs: Vec<(u64, Made, Run)> = seeds
        .par_iter()
        .map(|&seed| {
            let mut made = make(seed);
            made.scene.repeat.friction = scatter.unwrap_or(made.scene.repeat.friction);
            let capture = recorded(&made.scene, &format!("{name}-{seed}"), seed);
            let run = build(&capture, &options(), &Progress::silent()).expect("a run");
            (seed, made, run)
        })
        .collect();
    let mut results = Results::default();
    for (seed, made, run) in &runs {
        results.judge(made, run, &format!("{name} {seed}"));
    }
    println!("== {name}: {} scenes, {:.1} s", runs.len(), started.seconds());
    results.print();
}

/// Ten recordings of a body of two links, through articulation, physics and relations.
fn time_of_ten() {
    let mut made = scenes::tree(0);
    let first = made.scene.action.clone();
    made.scene.action = (0..10)
        .map(|k| {
            let mut action = first[k % first.len()].clone();
            if let palpate::lab::ActionSpec::Pull { name, .. } = &mut action {
                *name = format!("pull-{k}");
            }
            action
        })
        .collect();
    let capture = recorded(&made.scene, "time", 1);
    let started = Stopwatch::start();
    let run = build(&capture, &options(), &Progress::silent()).expect("a run");
    println!(
        "== time: {} recordings of {} links in {:.3} s; passes {:?}",
        capture.interactions.len(),
        run.model.twin.links().count(),
        started.seconds(),
        run.seconds
    );
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let count = |word: &str, usual: u64| -> u64 {
        let at = words.iter().position(|w| w == word);
        let given = at.and_then(|i| words.get(i + 1)).and_then(|n| n.parse().ok());
        match at {
            None if words.is_empty() => usual,
            None => 0,
            Some(_) => given.unwrap_or(usual),
        }
    };
    let seeds = |word: &str, usual: u64| -> Vec<u64> {
        let only = words.iter().position(|w| w == "only");
        let those = only.map_or(0, |i| i + 1);
        let those: Vec<u64> = words[those..].iter().filter_map(|n| n.parse().ok()).collect();
        if only.is_some() && count(word, usual) > 0 {
            those
        } else {
            (0..count(word, usual)).collect()
        }
    };
    let after = words.iter().position(|w| w == "scatter").and_then(|i| words.get(i + 1));
    let scatter: Option<f64> = after.and_then(|x| x.parse().ok());
    for (name, usual, make) in [
        ("trees", 96, scenes::tree as fn(u64) -> Made),
        ("arms", 12, scenes::arm),
    ] {
        let seeds = seeds(name, usual);
        if !seeds.is_empty() {
            run_all(name, &seeds, make, scatter);
        }
    }
    if count("stacks", 48) > 0 {
        stacks::run_all(count("stacks", 48));
    }
    if count("ajar", 24) > 0 {
        ajar::run_all(count("ajar", 24));
    }
    if count("decide", 12) > 0 {
        decide::run_all(count("decide", 12));
    }
    if count("time", 1) > 0 {
        time_of_ten();
    }
}
