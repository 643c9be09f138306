//! Doors and drawers that were opened a little: what is said of their kind, from full poses and from the path of the
//! hand alone.

use nalgebra::Vector3;
use palpate::base::{Progress, Seed, Stopwatch, rng_for};
use palpate::capture::Capture;
use palpate::pipeline::build;
use palpate::twin::{Joint, JointKind};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::scenes::{LEVELS, ajar};
use crate::tally::Odds;
use crate::{options, recorded, verbose};

const OPENED: [f64; 6] = [2.0, 5.0, 10.0, 20.0, 40.0, 70.0];

/// The recording with the path of the hand alone, with the noise of the tracks on it: nothing was tracked, nothing seen.
pub fn by_hand(capture: &Capture, seed: u64) -> Capture {
    let mut out = capture.clone();
    out.support = None;
    out.bodies.clear();
    let mut dice = rng_for(Seed(seed), "hand");
    let noise = LEVELS[(seed % 3) as usize][0];
    for interaction in &mut out.interactions {
        interaction.tracks.clear();
        if let Some(path) = interaction.tool_path.as_mut() {
            let rows: Vec<usize> = (0..path.len()).step_by(5).collect();
            path.time = rows.iter().map(|i| path.time[*i]).collect();
            path.position = rows
                .iter()
                .map(|i| {
                    let draw = Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut dice) });
                    path.position[*i] + draw * noise
                })
                .collect();
            path.rotation = vec![None; rows.len()];
        }
    }
    out
}

#[derive(Default)]
struct Row {
    right: usize,
    wrong: usize,
    undecided: usize,
    silent: usize,
    decides: usize,
}

struct Case {
    degrees: f64,
    hinge: bool,
    by_hand: bool,
    found: Option<Joint>,
    told: bool,
}

pub fn run_all(count: u64) {
    let started = Stopwatch::start();
    let jobs: Vec<(u64, f64, bool)> = (0..count)
        .flat_map(|seed| OPENED.iter().flat_map(move |d| [(seed, *d, true), (seed, *d, false)]))
        .collect();
    let cases: Vec<Case> = jobs
        .into_par_iter()
        .flat_map_iter(|(seed, degrees, hinge)| {
            let (scene, _) = ajar(seed, degrees, hinge);
            let way = if hinge { "hinge" } else { "slide" };
            let capture = recorded(&scene, &format!("ajar-{seed}-{degrees}-{way}"), seed);
            [false, true].map(|alone| {
                let capture = if alone {
                    by_hand(&capture, seed)
                } else {
                    capture.clone()
                };
                let run = build(&capture, &options(), &Progress::silent()).expect("a run");
                Case {
                    degrees,
                    hinge,
                    by_hand: alone,
                    found: run.model.twin.joints().next().cloned(),
                    told: run
                        .diagnosis
                        .experiments
                        .iter()
                        .any(|e| e.parts.iter().any(|p| p == "prismatic")),
                }
            })
        })
        .collect();
    println!("== ajar: {} recordings, {:.1} s", cases.len(), started.seconds());
    for by_hand in [false, true] {
        let mut odds = Odds::default();
        for degrees in OPENED {
            for hinge in [true, false] {
                let mut row = Row::default();
                for case in cases
                    .iter()
                    .filter(|c| c.by_hand == by_hand && c.degrees == degrees && c.hinge == hinge)
                {
                    row.add(case, &mut odds);
                }
                println!(
                    "{} {degrees:>4} degrees of a {}: right {} wrong {} undecided {} silent {}; says what would decide {}",
                    if by_hand { "hand  " } else { "poses " },
                    if hinge { "hinge" } else { "slide" },
                    row.right,
                    row.wrong,
                    row.undecided,
                    row.silent,
                    row.decides
                );
            }
        }
        odds.print(if by_hand { "kind, by hand" } else { "kind, by poses" });
    }
}

impl Row {
    fn add(&mut self, case: &Case, odds: &mut Odds) {
        let Some(joint) = &case.found else {
            self.silent += 1;
            return;
        };
        let truth = if case.hinge {
            JointKind::Revolute
        } else {
            JointKind::Prismatic
        };
        let right = joint.kind == truth;
        odds.add(joint.probability, right);
        self.decides += usize::from(case.told);
        if joint.probability < 0.9 {
            self.undecided += 1;
        } else if right {
            self.right += 1;
        } else {
            self.wrong += 1;
        }
        if verbose() {
            println!(
                "  {} {} {:?} {:.3}",
                case.degrees, case.hinge, joint.kind, joint.probability
            );
        }
    }
}
