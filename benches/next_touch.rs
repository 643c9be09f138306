//! How soon chosen touches tell mass, friction and centre of mass, beside touches drawn at random from the same pool:
//! `cargo bench --bench next_touch -- [BODIES] [FIRST] [chosen]`. Random boxes of the lab with a hidden weight and known shape; the
//! rig can push, lift and tilt, or all but lift. Prints touches until every number is stated as well as wanted (5 % of mass
//! and friction, 1.5 mm of the centre, 1 sd), and how often all errors are then below twice that.
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
use palpate::base::{Estimate, Progress, Seed, rng_for};
use palpate::capture::{Answer, Capture, Kind, Rig};
use palpate::lab::{LabRig, Scene, synthesise};
use palpate::pipeline::{Options, Pass, build};
use palpate::stages::estimation::{NextTouch, NextTouchConfig, TouchDecision};
use palpate::twin::{Link, Model, TrueBody};
use rand::seq::IndexedRandom;
use random_box::RandomBox;

/// Most touches that are tried.
const MOST: usize = 25;

fn estimate(capture: &Capture) -> Model {
    let options = Options {
        passes: vec![Pass::Shape, Pass::Physics],
        ..Options::default()
    };
    build(capture, &options, &Progress::silent()).expect("a run").model
}

/// Touches until all is known as wanted, whether that was honest, and the kinds that were used.
struct Outcome {
    touches: usize,
    met: bool,
    honest: bool,
    used: Vec<String>,
}

fn run(scene: &Scene, seed: u64, kinds: &[Kind], chosen: bool, truth: &TrueBody, start: &Capture) -> Outcome {
    let mut rig = LabRig::new(scene, Path::new("."), Seed(seed)).expect("a rig");
    let said = rig.describe().expect("described");
    let mut planner = NextTouch::new(NextTouchConfig::default(), kinds, said.noise);
    let mut dice = rng_for(Seed(seed), "random touches");
    let (mut capture, now) = (start.clone(), BTreeMap::new());
    let mut used = Vec::new();
    let mut model = estimate(&capture);
    loop {
        let link = model.twin.link("box").expect("the box");
        let met = planner.is_met(link, &Vector3::z());
        if std::env::var("NEXT_TOUCH_VERBOSE").is_ok() {
            let of = |e: &Option<Estimate>| {
                e.as_ref()
                    .map(|e| (e.value, e.sd.unwrap_or(0.0) / e.value, e.status, e.method.clone()))
            };
            println!(
                "    {} {:?} {:?} {:?} {:?}",
                used.len(),
                used.last(),
                of(&link.mass),
                of(&link.friction.kinetic),
                link.com.as_ref().map(|c| (c.value, c.sd, c.status))
            );
        }
        if met || used.len() >= MOST {
            let honest = met
                && errors(link, truth)
                    .iter()
                    .zip([0.05, 0.05, 1.5e-3])
                    .all(|(e, w)| *e < 2.0 * w);
            return Outcome {
                touches: used.len(),
                met,
                honest,
                used,
            };
        }
        let choice = if chosen {
            match planner.decide(&model, &now) {
                TouchDecision::Touch(choice) => *choice,
                TouchDecision::Stop(why) => {
                    println!("  body {seed}: stops: {why}");
                    return Outcome {
                        touches: used.len(),
                        met: false,
                        honest: true,
                        used,
                    };
                }
            }
        } else {
            let pool = planner.every(&model, &now);
            pool.choose(&mut dice).expect("a touch").clone()
        };
        match rig.touch(&choice.touch).expect("an answer") {
            Answer::Done(interaction) => {
                planner.did(&choice, &interaction);
                used.push(choice.touch.name.split('-').next().unwrap_or_default().to_owned());
                capture.interactions.push(interaction);
                model = estimate(&capture);
            }
            Answer::Refused(why) => {
                println!("  body {seed}: {} refused: {why}", choice.touch.name);
                planner.refuse(&choice);
            }
        }
    }
}

/// Relative errors of mass and friction, and of the centre of mass in the plane, m.
fn errors(link: &Link, truth: &TrueBody) -> [f64; 3] {
    let off = |e: Option<f64>, t: Option<f64>| e.zip(t).map_or(f64::INFINITY, |(e, t)| (e / t - 1.0).abs());
    let centre = link.com.as_ref().zip(truth.com);
    [
        off(link.mass.as_ref().map(|m| m.value), truth.mass),
        off(link.friction.kinetic.as_ref().map(|f| f.value), truth.friction_kinetic),
        centre.map_or(f64::INFINITY, |(e, t)| {
            (0..2).map(|k| (e.value[k] - t[k]).abs()).fold(0.0, f64::max)
        }),
    ]
}

fn main() {
    let mut numbers = std::env::args().filter_map(|a| a.parse::<u64>().ok());
    let (bodies, first) = (numbers.next().unwrap_or(24), numbers.next().unwrap_or(0));
    let all = [Kind::Push, Kind::Lift, Kind::Tilt];
    for (label, kinds) in [
        ("push, lift, tilt", &all[..]),
        ("push, tilt", &[Kind::Push, Kind::Tilt][..]),
    ] {
        // `chosen` among the words leaves out the random touches, which take most of the time.
        let alone = std::env::args().any(|a| a == "chosen");
        for chosen in [true, false].into_iter().filter(|c| *c || !alone) {
            let (mut counts, mut met, mut honest) = (Vec::new(), 0, 0);
            for body in first..first + bodies {
                let text = RandomBox::draw(&mut rng_for(Seed(body), "next touch")).text;
                let with = |extra: &str| toml::from_str::<Scene>(&format!("{text}{extra}")).expect("a scene");
                let still = with("[[action]]\nkind = \"hold\"\nname = \"still\"\nseconds = 0.5\n");
                let made = synthesise(&still, Path::new("."), Seed(body), &Progress::silent()).expect("made");
                let truth = made.truth.bodies.get("box").expect("the box");
                let outcome = run(&with(""), body, kinds, chosen, truth, &made.capture);
                println!(
                    "  body {body} {label} chosen {chosen}: {} {:?} met {} honest {}",
                    outcome.touches, outcome.used, outcome.met, outcome.honest
                );
                counts.push(outcome.touches);
                met += usize::from(outcome.met);
                honest += usize::from(outcome.met && outcome.honest);
            }
            counts.sort_unstable();
            let at = |q: f64| counts[((counts.len() - 1) as f64 * q).round() as usize];
            println!(
                "{label:<18} {}: touches median {} (10th {}, 90th {}), known as wanted {met} of {bodies}, honest {honest} of {met}",
                if chosen { "chosen" } else { "random" },
                at(0.5),
                at(0.1),
                at(0.9)
            );
        }
    }
}
