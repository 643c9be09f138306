//! Recover the truth on random bodies of the lab: `cargo bench --bench recover -- [BODIES [FIRST_SEED]] [WAY] [scattered] [instruments]`. Prints
//! errors and how often the stated intervals hold the truth, by what was done: weighed, coasted, tilted, or only pushed slowly.
//! `scattered` draws how well friction and springs repeat for each body (half to twice of what is usual); else all have that.
//! `instruments` gives each capture the faults that intervals allow for whatever is recorded (the scale of the force, its clock
//! against that of the tool, the tool's frame), drawn as they are believed; else the lab's instruments have none of them, and what
//! allows for them seems too wide.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::print_stdout,
    clippy::disallowed_macros,
    reason = "a program that prints its figures"
)]

#[path = "common/random_box.rs"]
mod random_box;

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Estimate, Progress, Seed, Status, rng_for};
use palpate::capture::Capture;
use palpate::lab::{Scene, synthesise};
use palpate::pipeline::{Options, Pass, build};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use random_box::{RandomBox, SCATTER};

const WAYS: [&str; 4] = ["lift", "coast", "tilt", "slow"];

#[derive(Default)]
struct Tally {
    /// Relative errors (m for the centre of mass).
    errors: Vec<f64>,
    inside: usize,
    widths: Vec<f64>,
}

impl Tally {
    fn add(&mut self, estimate: &Estimate, truth: f64, relative: bool) {
        let scale = if relative { truth } else { 1.0 };
        self.errors.push(((estimate.value - truth) / scale).abs());
        let [low, high] = estimate.ci95.unwrap_or([truth, truth]);
        self.inside += usize::from(low <= truth && truth <= high);
        self.widths.push((high - low) / scale);
    }

    fn print(&mut self, name: &str) {
        let n = self.errors.len();
        let at = |v: &mut Vec<f64>, q: f64| {
            v.sort_by(f64::total_cmp);
            v[((n - 1) as f64 * q).round() as usize]
        };
        println!(
            "{name:<28} n {n:>4}  error median {:.4}  95th {:.4}  interval holds {:.3}  median width {:.4}",
            at(&mut self.errors, 0.5),
            at(&mut self.errors, 0.95),
            self.inside as f64 / n as f64,
            at(&mut self.widths, 0.5)
        );
    }
}

/// What slow pushes alone leave open: neither mass nor friction may be told, or told narrowly.
#[derive(Default)]
struct Unknowable {
    bodies: usize,
    /// Of mass and kinetic friction: how many are called measured, and how many name what they are confounded with.
    measured: [usize; 2],
    confounded: [usize; 2],
    intervals: [Tally; 2],
}

impl Unknowable {
    fn add(&mut self, both: [(Option<&Estimate>, Option<f64>); 2]) {
        self.bodies += 1;
        for (k, (estimate, truth)) in both.into_iter().enumerate() {
            let Some(e) = estimate else { continue };
            self.measured[k] += usize::from(e.is_measured());
            self.confounded[k] += usize::from(e.confounded.is_some());
            if let Some(truth) = truth {
                self.intervals[k].add(e, truth, true);
            }
        }
    }

    fn print(&mut self) {
        for (k, name) in ["mass", "kinetic friction"].into_iter().enumerate() {
            let widths = self.intervals[k].widths.iter().copied();
            println!(
                "slow pushes only, {name}: called measured {}, confounded in words {} of {}, narrowest interval {:.3} of the truth",
                self.measured[k],
                self.confounded[k],
                self.bodies,
                widths.fold(f64::INFINITY, f64::min)
            );
            if !self.intervals[k].errors.is_empty() {
                self.intervals[k].print(&format!("{name}, told as open"));
            }
        }
    }
}

/// Component `k` of a list with its interval, as a number of its own.
fn component(value: &[f64], ci95: Option<&[[f64; 2]]>, status: Status, method: &str, k: usize) -> Estimate {
    let [low, high] = ci95.map_or([value[k]; 2], |c| c[k]);
    let sd = (high - low) / (2.0 * 1.96);
    Estimate {
        status,
        ..Estimate::measured(value[k], sd, "", Vec::new(), method).with_interval([low, high])
    }
}

/// Faults of the instruments as they are believed beforehand: the scale of the force (1 sd), by how much of the time between
/// two readings force and tool may be out of step (either way, evenly), and where the tool is, m (1 sd per axis).
const SCALE: f64 = 1e-3;
const STEP_SHARE: f64 = 0.5;
const FRAME: f64 = 2e-4;

/// Draws these faults for one capture: the same in all that was done.
fn misread(capture: &mut Capture, dice: &mut ChaCha8Rng) {
    let mut normal = |sd: f64| -> f64 { sd * dice.sample::<f64, _>(StandardNormal) };
    let (gain, shift) = (1.0 + normal(SCALE), Vector3::from_fn(|_, _| normal(FRAME)));
    let late = dice.random_range(-STEP_SHARE..STEP_SHARE);
    for interaction in &mut capture.interactions {
        if let Some(stream) = &mut interaction.force {
            let count = stream.time.len().max(2) - 1;
            let step = (stream.time[count] - stream.time[0]) / count as f64;
            stream.time.iter_mut().for_each(|t| *t += late * step);
            let torques = stream.torque.iter_mut().flatten();
            stream.force.iter_mut().chain(torques).for_each(|f| *f *= gain);
        }
        if let Some(path) = &mut interaction.tool_path {
            path.position.iter_mut().for_each(|p| *p += shift);
        }
    }
}

/// A box with a hidden weight, and what is done to it.
fn scene(dice: &mut ChaCha8Rng, way: &str, scatter: f64) -> Scene {
    let RandomBox { size, mut text } = RandomBox::draw_with(dice, scatter);
    let mut between = |low: f64, high: f64| dice.random_range(low..high);
    let (stiffness, damping) = (between(800.0, 6000.0), between(2.0, 20.0));
    text += &format!(
        r#"
[[body]]
name = "pad"
shape = {{ kind = "box", size = [0.08, 0.08, 0.04] }}
density = 250.0
position = [0.6, 0.0, 0.02]
known_mesh = true
foam = {{ stiffness = {stiffness}, damping = {damping} }}
"#
    );
    for (k, speed) in [0.01, 0.03].iter().enumerate() {
        let depth = 0.003f64.max(12.0 / stiffness);
        text += &format!(
            "[[action]]\nkind = \"press\"\nname = \"press-{k}\"\ntarget = \"pad\"\nat = [{}, 0.0, 0.04]\ndepth = {depth}\nspeed = {speed}\nhold = 0.5\n",
            0.595 + 0.01 * k as f64
        );
    }
    let mut push = |name: &str, face: usize, offset: f64, travel: f64, speed: f64, retreat: bool| {
        let (axis, sign) = (face % 2, if face < 2 { -1.0 } else { 1.0 });
        let (mut at, mut direction) = ([0.0; 3], [0.0; 3]);
        at[axis] = sign * 0.5 * size[axis];
        at[1 - axis] = offset * size[1 - axis];
        at[2] = 0.4 * size[2];
        direction[axis] = -sign;
        text += &format!(
            "[[action]]\nkind = \"push\"\nname = \"{name}\"\ntarget = \"box\"\nat = {at:?}\ndirection = {direction:?}\ntravel = {travel}\nspeed = {speed}\nretreat = {retreat}\n"
        );
    };
    for face in 0..4 {
        push(
            &format!("push-{face}"),
            face,
            between(-0.25, 0.25),
            0.05,
            between(0.02, 0.05),
            false,
        );
    }
    if way == "coast" {
        for k in 0..3 {
            push(
                &format!("fast-{k}"),
                k,
                between(-0.08, 0.08),
                0.06,
                between(0.4, 0.7),
                true,
            );
        }
        // One that sends it spinning.
        let side = if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        push("spin-0", 3, side * between(0.15, 0.3), 0.05, between(0.4, 0.7), true);
    }
    if way == "lift" {
        let top = size[2];
        text += &format!(
            "[[action]]\nkind = \"lift\"\nname = \"lift-0\"\ntarget = \"box\"\nat = [0.0, 0.0, {top}]\nheight = 0.03\n"
        );
    }
    if way == "tilt" {
        text += "[[action]]\nkind = \"tilt\"\nname = \"tilt-0\"\ntarget = \"box\"\naxis = [0.0, 1.0, 0.0]\nrate = 0.1\nlimit = 0.7\n";
    }
    toml::from_str(&text).expect("a scene")
}

fn main() {
    let mut numbers = std::env::args().filter_map(|a| a.parse::<u64>().ok());
    let (bodies, first) = (numbers.next().unwrap_or(16), numbers.next().unwrap_or(0));
    let only = WAYS.into_iter().find(|way| std::env::args().any(|a| a == *way));
    let said = |word: &str| std::env::args().any(|a| a == word);
    let (scattered, instruments) = (said("scattered"), said("instruments"));
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut open = Unknowable::default();
    for i in first..first + bodies {
        let way = WAYS[i as usize % WAYS.len()];
        if only.is_some_and(|o| o != way) {
            continue;
        }
        let scatter = match scattered {
            true => SCATTER * rng_for(Seed(i), "scatter").random_range(-1.0f64..1.0).exp2(),
            false => SCATTER,
        };
        let scene = scene(&mut rng_for(Seed(i), "recover"), way, scatter);
        let mut made = match synthesise(&scene, Path::new("."), Seed(i), &Progress::silent()) {
            Ok(made) => made,
            Err(e) => {
                println!("body {i}: {e}");
                continue;
            }
        };
        if instruments {
            misread(&mut made.capture, &mut rng_for(Seed(i), "instruments"));
        }
        let options = Options {
            passes: vec![Pass::Shape, Pass::Physics],
            ..Options::default()
        };
        let run = build(&made.capture, &options, &Progress::silent()).expect("a run");
        let mut add = |what: &str, e: Option<&Estimate>, truth: Option<f64>, relative: bool| {
            if let (Some(e), Some(truth)) = (e.filter(|e| e.is_measured()), truth) {
                if std::env::var("RECOVER_VERBOSE").is_ok() {
                    println!(
                        "  {i} {way} {what} {truth:.6}: {:.6} {:?} {}",
                        e.value, e.ci95, e.method
                    );
                }
                tallies
                    .entry(format!("{what}, {way}"))
                    .or_default()
                    .add(e, truth, relative);
            }
        };
        if let (Some(link), Some(truth)) = (run.model.twin.link("box"), made.truth.bodies.get("box")) {
            add("mass", link.mass.as_ref(), truth.mass, true);
            add(
                "friction kinetic",
                link.friction.kinetic.as_ref(),
                truth.friction_kinetic,
                true,
            );
            add(
                "friction static",
                link.friction.static_.as_ref(),
                truth.friction_static,
                true,
            );
            if let (Some(com), Some(t)) = (&link.com, truth.com) {
                for (k, truth) in t.iter().enumerate().take(2) {
                    let part = component(
                        &com.value,
                        com.ci95.as_ref().map(|c| &c[..]),
                        com.status,
                        &com.method,
                        k,
                    );
                    add("centre of mass", Some(&part), Some(*truth), false);
                }
            }
            if let (Some(inertia), Some(t)) = (&link.inertia, truth.inertia) {
                let part = |k, status| {
                    component(
                        &inertia.value,
                        inertia.ci95.as_ref().map(|c| &c[..]),
                        status,
                        &inertia.method,
                        k,
                    )
                };
                add("yaw inertia", Some(&part(2, inertia.status)), Some(t[2]), true);
                add(
                    "inertia ixx, assumed",
                    Some(&part(0, Status::Measured)),
                    Some(t[0]),
                    true,
                );
            }
            if way == "slow" {
                open.add([
                    (link.mass.as_ref(), truth.mass),
                    (link.friction.kinetic.as_ref(), truth.friction_kinetic),
                ]);
            }
        }
        if let (Some(link), Some(truth)) = (run.model.twin.link("pad"), made.truth.bodies.get("pad")) {
            add("stiffness", link.stiffness.as_ref(), truth.stiffness, true);
            add("damping", link.damping.as_ref(), truth.damping, true);
        }
    }
    for (name, tally) in &mut tallies {
        tally.print(name);
    }
    if open.bodies > 0 {
        open.print();
    }
}
