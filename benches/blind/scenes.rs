//! The scenes that hide effects: the lab's probes with everything about them drawn anew.

use palpate::base::{Seed, rng_for};
use palpate::lab::{ActionSpec, HideSpec, Scene, hidden_causes, scene_named};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// What a case is drawn to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    Clean,
    Single,
    Outside,
    Pair,
    Narrow,
}

pub struct Case {
    pub sort: Sort,
    pub scene: Scene,
    /// Hidden causes, in the order drawn.
    pub causes: Vec<String>,
    pub strength: f64,
}

/// The case of a number, of this scene or of one that is drawn: a quarter clean, strengths over a factor 16.
pub fn case(number: u64, only: Option<Sort>, scene: Option<&str>) -> Case {
    let mut dice = rng_for(Seed(number), "blind case");
    let sort = only.unwrap_or_else(|| match dice.random_range(0..20_u8) {
        0..5 => Sort::Clean,
        5..13 => Sort::Single,
        13..15 => Sort::Outside,
        15..18 => Sort::Pair,
        _ => Sort::Narrow,
    });
    let names = ["probe-pushes", "probe-pushes", "probe-presses", "probe-hinge"];
    let drawn = names.choose(&mut dice).expect("a name");
    let mut scene = scene_named(scene.unwrap_or(drawn)).expect("a built-in scene");
    vary(&mut scene, &mut dice, number);
    if sort == Sort::Narrow {
        narrow(&mut scene);
    }
    let able = hidden_causes(&scene);
    let outside = |c: &&&str| c.starts_with("outside");
    let (out, within): (Vec<&&str>, Vec<&&str>) = able.iter().partition(outside);
    let strength = 4.0_f64.powf(dice.random_range(-1.0..1.0));
    let mut causes: Vec<String> = Vec::new();
    let wanted = match sort {
        Sort::Clean => 0,
        Sort::Pair => 2,
        _ => 1,
    };
    while causes.len() < wanted {
        let from = if sort == Sort::Outside { &out } else { &within };
        let Some(cause) = from.choose(&mut dice) else { break };
        if !causes.iter().any(|c| c == **cause) {
            causes.push((**cause).to_owned());
        }
    }
    let hide = |(k, cause): (usize, &String)| HideSpec {
        cause: cause.clone(),
        strength,
        seed: number * 4 + k as u64,
    };
    scene.hide = causes.iter().enumerate().map(hide).collect();
    Case {
        sort,
        scene,
        causes,
        strength,
    }
}

/// Weight, friction, springs, joints, noise and scatter.
fn vary(scene: &mut Scene, dice: &mut ChaCha8Rng, number: u64) {
    let mut by = |spread: f64| dice.random_range(-spread..spread).exp();
    scene.noise.force *= by(0.7);
    let friction = by(0.4);
    for body in &mut scene.body {
        body.density *= by(0.5);
        body.friction.kinetic *= friction;
        body.friction.static_ = body.friction.kinetic * (1.0 + 0.05 * by(1.0));
        if let Some(foam) = &mut body.foam {
            foam.stiffness *= by(0.6);
        }
    }
    for joint in &mut scene.joint {
        joint.friction *= by(0.6);
    }
    scene.repeat.friction = 0.012 * by(0.4);
    scene.repeat.stiffness = 0.012 * by(0.4);
    scene.repeat.seed = number;
}

/// Only the pushes at one speed along one line, only the presses to and at one: what cannot tell causes apart.
fn narrow(scene: &mut Scene) {
    let mut kept = 0;
    scene.action.retain(|action| {
        let alike = match action {
            ActionSpec::Push { direction, speed, .. } => direction[0].abs() > 0.9 && *speed < 0.05,
            ActionSpec::Press { speed, .. } | ActionSpec::Pull { speed, .. } => *speed < 0.035,
            _ => true,
        };
        kept += usize::from(alike);
        alike || kept == 0
    });
    let names: Vec<String> = scene.action.iter().map(|a| a.name().to_owned()).collect();
    scene.pause.retain(|name, _| names.contains(name));
}
