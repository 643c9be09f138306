//! How soon chosen touches decide an arc that is open, beside touches drawn at random from the same pool: doors and drawers
//! that were opened by 2 degrees and of which only the hand's path is known, stacks of which only the lower one was pushed.

use palpate::base::{Progress, Seed, Stopwatch, rng_for};
use palpate::capture::{Capture, Kind, Touch};
use palpate::lab::{ActionSpec, Scene};
use palpate::pipeline::{Run, build};
use palpate::stages::estimation::arc_touches;
use palpate::twin::{JointKind, RelationKind};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::ajar::by_hand;
use crate::scenes::{ajar, stack};
use crate::{options, recorded};

/// Most touches after the first.
const MOST: usize = 8;
/// A kind with this probability is decided.
const DECIDED: f64 = 0.95;
/// Ways that a hand may go on, m: the pool that the choice is made from.
const TRAVELS: [f64; 8] = [0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4];

/// How it ended: touches after the first, whether the kind is decided, whether it is right.
#[derive(Clone, Copy, Debug)]
struct End {
    touches: usize,
    /// m that the hand went in them.
    way: f64,
    decided: bool,
    right: bool,
}

fn run_of(capture: &Capture) -> Run {
    build(capture, &options(), &Progress::silent()).expect("a run")
}

/// The first pull again, by another way; the hand holds where it held before.
fn pull_on(first: &ActionSpec, travel: f64, k: usize) -> ActionSpec {
    let mut action = first.clone();
    if let ActionSpec::Pull {
        name,
        travel: far,
        speed,
        ..
    } = &mut action
    {
        (*name, *far, *speed) = (format!("pull-{k}"), travel, (0.5 * travel).max(0.01));
    }
    action
}

fn door(seed: u64, hinge: bool, chosen: bool) -> End {
    let dice = &mut rng_for(Seed(seed), if hinge { "decide-hinge" } else { "decide-slide" });
    let mut scene = ajar(seed, 2.0, hinge).0;
    let truth = if hinge {
        JointKind::Revolute
    } else {
        JointKind::Prismatic
    };
    let (mut touches, mut way) = (0, 0.0);
    loop {
        let label = format!("decide-{seed}-{hinge}-{chosen}-{touches}");
        let capture = by_hand(&recorded(&scene, &label, seed), seed);
        let run = run_of(&capture);
        let joint = run.model.twin.joints().next();
        let decided = joint.is_some_and(|j| j.probability > DECIDED);
        let right = joint.is_some_and(|j| j.kind == truth);
        if decided || touches == MOST {
            return End {
                touches,
                way,
                decided,
                right,
            };
        }
        let best = arc_touches(&run.model, &capture.noise, &[Kind::Pull])
            .into_iter()
            .next();
        let random = *TRAVELS.choose(dice).expect("a pool");
        let travel = best.filter(|_| chosen).map_or(random, |b| b.touch.travel);
        touches += 1;
        way += travel;
        let next = pull_on(&scene.action[0], travel, touches);
        scene.action.push(next);
    }
}

/// The touch as the lab does it.
fn action_of(touch: &Touch, k: usize) -> ActionSpec {
    let at: [f64; 3] = touch.start.into();
    let target = touch.target.clone().unwrap_or_default();
    let text = match touch.kind {
        Kind::Lift => format!("kind = \"lift\"\nheight = {}\nhold = 0.5\n", touch.travel),
        _ => format!(
            "kind = \"push\"\ndirection = {:?}\ntravel = {}\nspeed = {}\n",
            [touch.direction.x, touch.direction.y, touch.direction.z],
            touch.travel,
            touch.speed
        ),
    };
    toml::from_str(&format!(
        "name = \"touch-{k}\"\ntarget = \"{target}\"\nat = {at:?}\n{text}"
    ))
    .expect("an action")
}

/// One of the touches that would tell anything of a stack, by chance.
fn any_of(scene: &Scene, run: &Run, capture: &Capture, dice: &mut ChaCha8Rng) -> Option<Touch> {
    let kinds = [Kind::Lift, Kind::Push];
    let mut touch = arc_touches(&run.model, &capture.noise, &[*kinds.choose(dice)?])
        .into_iter()
        .next()?
        .touch;
    if touch.kind == Kind::Push && dice.random_bool(0.5) {
        // The lower one instead of the upper one, at its own height.
        let low = scene.body.iter().find(|b| b.name == "low")?;
        touch.target = Some("low".into());
        touch.start.z = low.position[2];
        touch.start.x = -0.06;
        touch.start.y = 0.0;
        touch.direction = nalgebra::Vector3::x();
    }
    Some(touch)
}

fn pile(seed: u64, chosen: bool) -> End {
    let dice = &mut rng_for(Seed(seed), "decide-stack");
    // What breaks away is left out: a bond may be there or not.
    let made = stack(3 * seed + seed % 2 * 3 + u64::from(seed % 4 > 1));
    let truth = if made.glued {
        RelationKind::Fixed
    } else {
        RelationKind::Resting
    };
    let mut scene = made.scene;
    scene.action.truncate(1);
    let (mut touches, mut way) = (0, 0.0);
    loop {
        let capture = recorded(&scene, &format!("pile-{seed}-{chosen}-{touches}"), seed);
        let run = run_of(&capture);
        let mut arcs = run.model.twin.relations.iter();
        let arc = arcs.find(|r| r.a != "support" && r.b != "support").map(|r| r.kind);
        let decided = arc.is_some_and(|k| k != RelationKind::Unknown);
        let touch = if chosen {
            let open = arc_touches(&run.model, &capture.noise, &[Kind::Lift, Kind::Push]);
            open.into_iter().next().map(|t| t.touch)
        } else {
            any_of(&scene, &run, &capture, dice)
        };
        let (Some(touch), false) = (touch, decided || touches == MOST) else {
            return End {
                touches,
                way,
                decided,
                right: arc == Some(truth),
            };
        };
        touches += 1;
        way += touch.travel;
        scene.action.push(action_of(&touch, touches));
    }
}

fn print(what: &str, policy: &str, ends: &[End]) {
    let mut touches: Vec<usize> = ends.iter().map(|e| e.touches).collect();
    touches.sort_unstable();
    let at = |q: f64| touches[((touches.len() - 1) as f64 * q).round() as usize];
    let n = ends.len() as f64;
    println!(
        "{what} {policy}: touches until decided, median {} (10th {}, 90th {}), mean {:.2}; way {:.0} mm; decided {} of {}, of those right {}",
        at(0.5),
        at(0.1),
        at(0.9),
        touches.iter().sum::<usize>() as f64 / n,
        1e3 * ends.iter().map(|e| e.way).sum::<f64>() / n,
        ends.iter().filter(|e| e.decided).count(),
        ends.len(),
        ends.iter().filter(|e| e.decided && e.right).count(),
    );
}

pub fn run_all(count: u64) {
    let started = Stopwatch::start();
    for (policy, chosen) in [("chosen", true), ("random", false)] {
        for (what, hinge) in [("hinge", true), ("slide", false)] {
            let ends: Vec<End> = (0..count).into_par_iter().map(|s| door(s, hinge, chosen)).collect();
            print(what, policy, &ends);
        }
        let ends: Vec<End> = (0..count).into_par_iter().map(|s| pile(s, chosen)).collect();
        print("stack", policy, &ends);
    }
    println!("== decide: {count} of each, {:.1} s", started.seconds());
}
