//! Joints against something that nobody tracked: a handle pulled along a path that its hinge or rail dictates.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector3};

use super::Config;
use super::coupling::Placement;
use super::describe::{Anchor, describe};
use super::infer::{Articulation, HELD, same_body, world_mesh};
use super::manifold::Sample;
use super::pair::{Pair, thinned};
use super::select::{KINDS, Selection, radius_of, select};
use crate::base::Notices;
use crate::capture::{
    Capture, Interaction, Kind, PoseStream, RelativePose, TrackNoise, path_of, position_noise, track_noise,
};
use crate::twin::{Joint, JointKind, Model, WORLD};

/// Shortest path that says anything, m.
const LEAST_PATH: f64 = 0.01;

/// Held points of things that stand on a table are hardly higher than this above it, m.
const TALLEST: f64 = 0.25;
/// What is clear of the support by more than this does not stand on it, m.
pub const HANGS: f64 = 0.01;
/// Sine of the angle to the support below which a path keeps level.
const LEVEL: f64 = 0.05;

/// Adds the joints of things that were led along while nothing else was tracked and nothing carries them.
pub fn infer_world(capture: &Capture, model: &Model, config: &Config, notices: &mut Notices, out: &mut Articulation) {
    let alone = capture.fitted().filter(|i| leads(i, true) && i.tracks.len() <= 1);
    let targets: BTreeSet<&str> = alone.filter_map(about).collect();
    for target in targets {
        let known = out.joints.iter().any(|j| j.child == target || j.parent == target);
        let own = || capture.fitted().filter(|i| about(i) == Some(target));
        let held = hangs(capture, model, target) || part_of_what_is_not_tracked(capture, target);
        let led = own().any(|i| leads(i, held));
        let stands = capture.support.is_some() && model.twin.link(target).is_some_and(|l| l.mesh.is_some());
        let joint = if known || !led || (stands && !held) {
            None
        } else {
            pulled(capture, model, config, notices, (target, held))
        };
        if let Some(joint) = joint {
            for name in [WORLD, target] {
                let there = model.twin.link(name).is_some() || out.world_links.iter().any(|l| l == name);
                if !there {
                    out.world_links.push(name.into());
                }
            }
            out.joints.push(joint);
        }
    }
}

/// Pulls lead a thing along, and pushes do what is held: it would fall, or be put aside, if nothing held it.
fn leads(run: &Interaction, held: bool) -> bool {
    run.kind == Kind::Pull || (held && run.kind == Kind::Push)
}

/// Whether its name says that it is one part of a thing (`body/link`) no other part of which was tracked.
fn part_of_what_is_not_tracked(capture: &Capture, target: &str) -> bool {
    let mut tracked = capture.interactions.iter().flat_map(|i| i.tracks.keys());
    target.contains('/') && !tracked.any(|other| other != target && same_body(other, target))
}

/// Whether a thing whose surface is known is clear of the support wherever an interaction begins, with nothing below it that is tracked.
fn hangs(capture: &Capture, model: &Model, target: &str) -> bool {
    let Some(support) = &capture.support else { return false };
    let tracked = |name: &str| capture.interactions.iter().any(|i| i.tracks.contains_key(name));
    let others = || model.twin.links().filter(|(_, l)| l.name != target && tracked(&l.name));
    let pose_in = |run: &Interaction| -> Option<Isometry3<f64>> {
        let track = run.tracks.get(target)?;
        let rotation = track.rotation.first().copied().flatten()?;
        let position = track.position.first().filter(|p| p.x.is_finite())?;
        Some(Isometry3::from_parts(position.coords.into(), rotation))
    };
    let clear = |pose: Isometry3<f64>| {
        let mesh = world_mesh(model, target, &pose)?;
        let height = |v: &nalgebra::Point3<f64>| support.normal.dot(&(v - support.point));
        Some(mesh.vertices.iter().map(height).fold(f64::INFINITY, f64::min))
    };
    let mut lowest = capture.fitted().filter_map(|i| clear(pose_in(i)?)).peekable();
    others().next().is_none() && lowest.peek().is_some() && lowest.all(|h| h > HANGS)
}

/// What a pull is of: its target, else the one thing that was tracked.
fn about(run: &Interaction) -> Option<&str> {
    let only = run.tracks.keys().next().filter(|_| run.tracks.len() == 1);
    run.target.as_deref().or(only.map(String::as_str))
}

/// One pull: the path of the thing, thinned, how far the point went that is held, m, and the kinds of joint that this suits.
struct Led<'a> {
    run: &'a Interaction,
    samples: Vec<Sample>,
    way: f64,
    selection: Selection,
}

/// True where what stands on the support could have been drawn along this path: it keeps level, and no higher than things are.
fn could_glide(capture: &Capture, led: &Led) -> bool {
    let Some(support) = &capture.support else { return false };
    let samples = &led.samples;
    let height = |s: &Sample| support.normal.dot(&(s.position - support.point.coords));
    let heights = || samples.iter().map(height);
    let rises = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    let noise = samples.iter().map(|s| s.noise.position).sum::<f64>() / samples.len() as f64;
    rises < (LEVEL * led.way).max(8.0 * noise) && height(&samples[0]) < TALLEST
}

/// The path of one pull, thinned, with the world as the parent, and how far it led, m.
fn samples_of(capture: &Capture, run: &Interaction, target: &str) -> Option<(Vec<Sample>, f64)> {
    let path = path_of(run, target)?;
    let oriented = run.tracks.contains_key(target) || run.tool.as_ref().is_some_and(|t| t.grip);
    let noise = match run.tracks.contains_key(target) {
        true => track_noise(capture, target),
        false => TrackNoise {
            position: position_noise(&[path]).max(1e-4),
            rotation: 0.01,
        },
    };
    let samples = thinned(&[rows_of(path, oriented)], (STILL, noise));
    let way = way(run, &samples);
    (way > LEAST_PATH && samples.len() >= 8).then_some((samples, way))
}

/// How far the point went by which the thing is held, or the origin of its frame, whichever went further, m: a frame may lie
/// on the axis about which it turns.
fn way(run: &Interaction, samples: &[Sample]) -> f64 {
    let held = run.tool_path.as_ref().and_then(|path| path.position.first());
    let place = |s: &Sample, held: Vector3<f64>| s.position + s.rotation.map_or(Vector3::zeros(), |q| q * held);
    let held = samples.first().zip(held).map_or(Vector3::zeros(), |(first, at)| {
        let from_origin = at.coords - first.position;
        first.rotation.map_or(Vector3::zeros(), |q| q.inverse() * from_origin)
    });
    let farthest = |held: Vector3<f64>| {
        let places = || samples.iter().map(|s| place(s, held));
        let first = places().next().unwrap_or_default();
        places().map(|p| (p - first).norm()).fold(0.0, f64::max)
    };
    farthest(Vector3::zeros()).max(farthest(held))
}

/// The world does not move.
const STILL: TrackNoise = TrackNoise {
    position: 0.0,
    rotation: 0.0,
};

fn rows_of(path: &PoseStream, oriented: bool) -> Vec<RelativePose> {
    (0..path.len())
        .filter(|&i| path.position[i].coords.iter().all(|x| x.is_finite()))
        .map(|i| RelativePose {
            time: path.time[i],
            position: path.position[i].coords,
            rotation: path.rotation[i].filter(|_| oriented),
        })
        .collect()
}

/// Kinds that a path can show: a surface (plane, cylinder, ball) would hold any path.
const OF_A_PATH: [JointKind; 4] = [
    JointKind::Fixed,
    JointKind::Revolute,
    JointKind::Prismatic,
    JointKind::Screw,
];

/// The joint that what led one thing along shows.
fn pulled(
    capture: &Capture,
    model: &Model,
    config: &Config,
    notices: &mut Notices,
    (target, held): (&str, bool),
) -> Option<Joint> {
    let mut runs: Vec<Led> = Vec::new();
    let own = |i: &&Interaction| leads(i, held) && about(i) == Some(target);
    for run in capture.fitted().filter(own) {
        if let Some((samples, way)) = samples_of(capture, run, target) {
            let selection = select(&samples, &OF_A_PATH, config.world_reach)?;
            runs.push(Led {
                run,
                samples,
                way,
                selection,
            });
        }
    }
    let mut silent = |why: String| {
        let message = format!("no joint with the world is claimed: {why}");
        notices.note("articulation", target, message);
        None
    };
    if runs.is_empty() {
        return silent(format!("no pull led it along {:.0} mm or more", 1e3 * LEAST_PATH));
    }
    let weights = pooled(&runs.iter().map(|r| &r.selection).collect::<Vec<_>>());
    let (kind, probability) = weights
        .iter()
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map(|(k, p)| (*k, *p))?;
    if matches!(kind, JointKind::Fixed | JointKind::Planar) || probability < config.least_probability {
        return silent(format!("its path is best {kind:?} ({probability:.2})").to_lowercase());
    }
    if !held && !one_axis(kind, &runs) && runs.iter().all(|r| could_glide(capture, r)) {
        let way = if kind == JointKind::Prismatic {
            "a line"
        } else {
            "an arc"
        };
        return silent(format!(
            "it kept to {way} level above the support, as what stands on it does when it is drawn along: view it, or lift it"
        ));
    }
    let of_this = || {
        runs.iter()
            .filter(|r| r.selection.candidates[0].fit.manifold.kind == kind)
    };
    let best = of_this().max_by(|a, b| a.way.total_cmp(&b.way))?;
    if runs.len() > 1 {
        let agree = of_this().count();
        let name = &best.run.name;
        let message = format!(
            "{agree} of {} pulls show this kind of joint; axis and origin are those of {name}",
            runs.len()
        );
        notices.note("articulation", target, message);
    }
    let mut selection = best.selection.clone();
    for candidate in &mut selection.candidates {
        candidate.probability = weights.get(&candidate.fit.manifold.kind).copied().unwrap_or(0.0);
    }
    let pair = Pair {
        still: Vec::new(),
        parent: WORLD.into(),
        child: target.into(),
        runs: vec![best.run],
        samples: best.samples.clone(),
    };
    let (anchor, placement) = surroundings(model, target, best);
    // Beside a support something may carry it after all.
    let share = if capture.support.is_some() && !held { HELD } else { 1.0 };
    let mut joint = describe(&pair, &selection, &anchor, &placement, share);
    for from in [&mut joint.axis.from, &mut joint.origin.from] {
        *from = runs.iter().map(|r| r.run.name.clone()).collect();
    }
    Some(joint)
}

/// Fewest pulls, their least turn, rad, the least radius, m, and how far apart their axes may be, m and as a share of it, where all turn about
/// one upright axis.
const ROUND: (usize, f64, f64) = (3, 0.3, 0.1);
const ONE_AXIS: (f64, f64) = (3e-3, 0.03);

/// Whether most pulls led round the same axis far from the thing, which turned as a door does, and none led off that circle: nobody draws
/// things along so.
fn one_axis(kind: JointKind, runs: &[Led]) -> bool {
    let round = |led: &Led| {
        let fit = &led.selection.candidates[0].fit;
        let turns: Vec<f64> = led
            .samples
            .iter()
            .filter_map(|s| Some(s.rotation?.angle_to(&led.samples[0].rotation?)))
            .collect();
        let (radius, turn) = (radius_of(fit).0, turns.iter().copied().fold(0.0, f64::max));
        let alike = fit.manifold.kind == JointKind::Revolute && turn > ROUND.1 && radius > ROUND.2;
        alike.then_some((fit.manifold.point, fit.manifold.axis, radius))
    };
    let all: Vec<_> = runs.iter().filter_map(round).collect();
    let Some((point, axis, radius)) = all.first() else {
        return false;
    };
    let off = |other: &Vector3<f64>| {
        let apart = other - point;
        (apart - axis.into_inner() * axis.dot(&apart)).norm()
    };
    let most = ONE_AXIS.0.max(ONE_AXIS.1 * radius);
    // Short ways tell no axis of their own, but stay on the circle.
    let on_circle = |led: &Led| {
        led.samples
            .iter()
            .all(|s| (off(&s.position) - radius).abs() < most.max(4.0 * s.noise.position))
    };
    let others = runs.iter().filter(|led| round(led).is_none());
    let of_doors = kind == JointKind::Revolute && all.len() >= ROUND.0 && 2 * all.len() > runs.len();
    of_doors && all.iter().all(|a| off(&a.0) < most) && others.into_iter().all(on_circle)
}

/// The most that one pull may say against a kind: it may be of another part than its name says.
const MOST_AGAINST: f64 = 12.0;

/// Probability of each kind over all pulls: evidence adds up. Frames may differ between recordings, so that
/// each has its own axis.
fn pooled(selections: &[&Selection]) -> BTreeMap<JointKind, f64> {
    let mut sums: BTreeMap<JointKind, f64> = BTreeMap::new();
    for kind in KINDS {
        for selection in selections {
            let best = selection.candidates[0].evidence;
            let found = selection.candidates.iter().find(|c| c.fit.manifold.kind == kind);
            *sums.entry(kind).or_default() += found.map_or(-MOST_AGAINST, |c| (c.evidence - best).max(-MOST_AGAINST));
        }
    }
    let top = sums.values().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = sums.values().map(|s| (s - top).exp()).sum();
    sums.into_iter().map(|(k, s)| (k, (s - top).exp() / total)).collect()
}

fn surroundings(model: &Model, target: &str, led: &Led) -> (Anchor, Placement) {
    let first = &led.samples[0];
    let start = Isometry3::from_parts(first.position.into(), first.rotation.unwrap_or_default());
    let placement = Placement {
        parent_mesh: None,
        child_mesh: world_mesh(model, target, &start),
        parent_centre: Vector3::zeros(),
        child_centre: first.position,
        size: led.way,
        up: Vector3::z(),
        table: None,
    };
    let anchor = Anchor {
        world_from_parent: Isometry3::identity(),
        parent_from_child: start,
        position: 0.0,
        rotation: 0.0,
    };
    (anchor, placement)
}
