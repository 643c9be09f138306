//! From a capture and the shapes of its things to benches: what can be simulated of what was measured.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::Config;
use super::bench::{Bench, Group, Measured};
use super::evidence::{impulse_of, support_from_world};
use crate::base::{Notices, Result};
use crate::capture::{Capture, Interaction, Kind, PoseStream, Tool as Given, ToolShape};
use crate::geometry::{DecompositionConfig, convex_parts, parse_mesh};
use crate::physics::tabletop::{Path, Solid, Tool};
use crate::twin::Model;

/// The stage's name in notices.
pub(super) const STAGE: &str = "snapshots";
/// Seconds that a thing has to come to rest where the second snapshot's time does not say.
const SETTLING: f64 = 3.0;
/// The second snapshot is read at most this long after the tool stopped, s: what still rolls by then leaves the table.
const LONGEST: f64 = 20.0;
/// A measured height may differ from that of a way of standing by this, m, before that way is ruled out.
const HEIGHT: f64 = 4e-3;

/// Speed of a tool below which a thing that it lets go coasts a millimetre at most, m/s.
const SLOW: f64 = 0.08;
/// Least span over which the tool's speed is taken, s.
const SPAN: f64 = 0.02;

/// Whether the tracks of a capture are snapshot pairs throughout, with at least one touch by a tool among them that is no
/// slow push with its force: those tell what they tell by their force, without any simulation of trials. A pair of which one half
/// is missing makes no track of the others.
pub fn holds_snapshots_only(capture: &Capture) -> bool {
    capture.interactions.iter().all(at_most_pairs) && capture.interactions.iter().any(struck)
}

/// Says where snapshot pairs lie among tracks, for then they are not studied.
pub(super) fn warn_of_tracks(capture: &Capture, notices: &mut Notices) {
    let pairs = |i: &&Interaction| struck(i) && at_most_pairs(i);
    let count = capture.interactions.iter().filter(pairs).count();
    let mut tracks = capture.interactions.iter().filter(|i| !at_most_pairs(i));
    if let (true, Some(track)) = (count > 0, tracks.next()) {
        let words = format!(
            "{count} touch(es) are snapshot pairs, and `{}` holds a track of more than two rows: what a simulation of the pairs would tell \
             is inferred only where a capture holds nothing else",
            track.name
        );
        // A few tracks among many pairs are most likely a mistake.
        if count > 1 + tracks.count() {
            notices.warn(STAGE, &capture.name, words);
        } else {
            notices.note(STAGE, &capture.name, words);
        }
    }
}

fn at_most_pairs(interaction: &Interaction) -> bool {
    interaction.tracks.values().all(|t| t.len() <= 2)
}

/// A touch by a tool, with a track, that is no slow push with its force.
fn struck(interaction: &Interaction) -> bool {
    pushes(interaction) && !interaction.tracks.is_empty() && !felt_slowly(interaction)
}

/// A push whose force was recorded and whose tool never moved fast.
fn felt_slowly(interaction: &Interaction) -> bool {
    let (Some(_), Some(path)) = (&interaction.force, &interaction.tool_path) else {
        return false;
    };
    let mut from = 0;
    for to in 0..path.len() {
        let span = path.time[to] - path.time[from];
        if span < SPAN {
            continue;
        }
        let way = (path.position[to] - path.position[from]).norm();
        // A place that is missing is no speed.
        if way > SLOW * span {
            return false;
        }
        from = to;
    }
    true
}

pub(super) fn pushes(interaction: &Interaction) -> bool {
    let held = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    matches!(interaction.kind, Kind::Push | Kind::Pull) && !held
}

/// The body that a trial is about.
pub(super) fn subject(interaction: &Interaction) -> Option<&str> {
    let target = interaction
        .target
        .as_deref()
        .filter(|t| interaction.tracks.contains_key(*t));
    let moved = || {
        let most = |track: &PoseStream| {
            (track.position.last().zip(track.position.first())).map_or(0.0, |(b, a)| (b - a).norm())
        };
        interaction
            .tracks
            .iter()
            .max_by(|a, b| most(a.1).total_cmp(&most(b.1)))
            .map(|(name, _)| name.as_str())
    };
    target.or_else(moved)
}

/// What can be simulated, by the name of the link; what cannot is said in the notices.
pub fn gather(
    capture: &Capture,
    model: &Model,
    config: &Config,
    notices: &mut Notices,
) -> Result<BTreeMap<String, Bench>> {
    let mut benches: BTreeMap<String, Bench> = BTreeMap::new();
    let mut tools: BTreeMap<String, Option<Tool>> = BTreeMap::new();
    let scene = Scene {
        capture,
        model,
        config,
        support_from_world: support_from_world(capture, model),
    };
    let mut refused: BTreeMap<(String, &str), Vec<String>> = BTreeMap::new();
    for interaction in capture.interactions.iter().filter(|i| pushes(i)) {
        let Some(name) = subject(interaction) else { continue };
        let outcome = one(&scene, interaction, name, &mut tools, &mut benches)?;
        if let Err(why) = outcome {
            refused
                .entry((name.to_owned(), why))
                .or_default()
                .push(interaction.name.clone());
        }
    }
    for ((name, why), trials) in refused {
        let first = trials.first().cloned().unwrap_or_default();
        notices.warn(
            STAGE,
            &name,
            format!("{} trial(s) left out ({first}, …): {why}", trials.len()),
        );
    }
    for bench in benches.values_mut() {
        choose_turns(bench, &scene, notices);
    }
    let unnamed = capture.interactions.iter().filter(|i| pushes(i) && i.action.is_none());
    let unnamed = unnamed.count();
    if unnamed > 0 {
        let words =
            format!("{unnamed} trial(s) name no `action`: they count as repetitions of one, whichever way they went");
        notices.note(STAGE, &capture.name, words);
    }
    Ok(benches)
}

/// What all trials share.
struct Scene<'a> {
    capture: &'a Capture,
    model: &'a Model,
    config: &'a Config,
    support_from_world: Isometry3<f64>,
}

/// Adds one trial, or says why it cannot be simulated.
fn one(
    scene: &Scene,
    interaction: &Interaction,
    name: &str,
    tools: &mut BTreeMap<String, Option<Tool>>,
    benches: &mut BTreeMap<String, Bench>,
) -> Result<std::result::Result<(), &'static str>> {
    let (Some(given), Some(path)) = (&interaction.tool, &interaction.tool_path) else {
        return Ok(Err("the tool's shape or its path is missing"));
    };
    let support_from_world = &scene.support_from_world;
    let Some((path, started)) = path_of(path, support_from_world) else {
        return Ok(Err("the tool's path has no pose"));
    };
    let Some((place, turn, moved, after)) = snapshots(interaction, name, support_from_world) else {
        return Ok(Err("a position before or after is missing"));
    };
    let key = tool_key(given);
    if !tools.contains_key(&key) {
        tools.insert(key.clone(), tool_of(given)?);
    }
    let Some(Some(tool)) = tools.get(&key) else {
        return Ok(Err("the tool's shape spans no volume"));
    };
    if !benches.contains_key(name) {
        let Some(bench) = bench_of(scene, name) else {
            return Ok(Err(
                "the thing's shape is not known: neither views nor a mesh show a closed volume",
            ));
        };
        benches.insert(name.to_owned(), bench);
    }
    let Some(bench) = benches.get_mut(name) else {
        return Ok(Ok(()));
    };
    let group = Group {
        tool: interaction
            .tool_name
            .clone()
            .unwrap_or_else(|| shape_name(given).into()),
        action: interaction
            .action
            .clone()
            .unwrap_or_else(|| interaction.kind.name().into()),
        held_out: interaction.held_out,
    };
    let group = index_of(&mut bench.groups, group);
    // Tools differ by shape, not by label.
    let number = bench
        .tools
        .iter()
        .position(|(t, _)| format!("{t:?}") == format!("{tool:?}"))
        .unwrap_or_else(|| {
            bench.tools.push((tool.clone(), Vec::new()));
            bench.tools.len() - 1
        });
    let stop = path.seconds();
    let seconds = match after - started {
        s if s >= stop => s.min(stop + LONGEST),
        _ => stop + SETTLING,
    };
    bench.tools[number].1.push(path);
    bench.trials.push(Measured {
        name: interaction.name.clone(),
        group,
        tool: (number, bench.tools[number].1.len() - 1),
        place,
        turn,
        seconds,
        effect: moved.xy(),
        fell: moved.z.abs() > bench.fall(),
        impulse: impulse_of(scene.capture, interaction),
    });
    Ok(Ok(()))
}

fn index_of(groups: &mut Vec<Group>, group: Group) -> usize {
    groups.iter().position(|g| *g == group).unwrap_or_else(|| {
        groups.push(group);
        groups.len() - 1
    })
}

/// The path of a tool in the support's frame, from time 0, and the capture's time at which it starts.
fn path_of(stream: &PoseStream, support_from_world: &Isometry3<f64>) -> Option<(Path, f64)> {
    let rows: Vec<usize> = (0..stream.len())
        .filter(|i| stream.time[*i].is_finite() && stream.position[*i].iter().all(|x| x.is_finite()))
        .collect();
    let started = stream.time[*rows.first()?];
    let times: Vec<f64> = rows.iter().map(|i| stream.time[*i] - started).collect();
    let mut turn = rows
        .iter()
        .find_map(|i| stream.rotation[*i])
        .unwrap_or_else(UnitQuaternion::identity);
    let poses: Vec<Isometry3<f64>> = rows
        .iter()
        .map(|i| {
            turn = stream.rotation[*i].unwrap_or(turn);
            support_from_world * Isometry3::from_parts(stream.position[*i].into(), turn)
        })
        .collect();
    Some((Path::new(&times, &poses)?, started))
}

type Before = (Vector3<f64>, Option<UnitQuaternion<f64>>, Vector3<f64>, f64);

/// Place and turn before, displacement, and the time of the second snapshot.
fn snapshots(interaction: &Interaction, name: &str, support_from_world: &Isometry3<f64>) -> Option<Before> {
    let track = interaction.tracks.get(name)?;
    let rows: Vec<usize> = (0..track.len())
        .filter(|i| track.position[*i].iter().all(|x| x.is_finite()))
        .collect();
    let (first, last) = (*rows.first()?, *rows.last()?);
    if rows.len() < 2 {
        return None;
    }
    let before = support_from_world * track.position[first];
    let after = support_from_world * track.position[last];
    let turn = track.rotation[first].map(|q| support_from_world.rotation * q);
    Some((before.coords, turn, after - before, track.time[last]))
}

fn shape_name(tool: &Given) -> &'static str {
    match tool.shape {
        ToolShape::Sphere { .. } => "sphere",
        ToolShape::Box { .. } => "box",
        ToolShape::Cylinder { .. } => "cylinder",
        ToolShape::Mesh(_) => "mesh",
    }
}

fn tool_key(tool: &Given) -> String {
    match &tool.shape {
        ToolShape::Mesh(file) => file.path.display().to_string(),
        other => format!("{other:?}"),
    }
}

fn tool_of(tool: &Given) -> Result<Option<Tool>> {
    Ok(match &tool.shape {
        ToolShape::Sphere { radius } => Some(Tool::ball(*radius)),
        ToolShape::Box { half } => Some(Tool::cuboid(half)),
        ToolShape::Cylinder { radius, half_height } => Some(Tool::cylinder(*radius, *half_height)),
        ToolShape::Mesh(file) => {
            let mesh = parse_mesh(&file.path, &file.bytes)?;
            let parts = convex_parts(&mesh, &DecompositionConfig::default());
            Tool::of_parts(if parts.is_empty() {
                std::slice::from_ref(&mesh)
            } else {
                &parts
            })
        }
    })
}

fn bench_of(scene: &Scene, name: &str) -> Option<Bench> {
    let Scene { capture, model, .. } = scene;
    let link = model.twin.link(name)?;
    let mesh = model.meshes.get(link.mesh.as_ref()?)?;
    let known = capture.prior(name).and_then(|b| b.mass.map(|m| (m, b.mass_sd)));
    let (density, log_sd) = scene.config.density;
    Some(Bench {
        name: name.to_owned(),
        mass: match known {
            Some((mass, sd)) => (mass, (sd.unwrap_or(0.0) / mass).max(0.01)),
            None => ((density * mesh.volume().abs()).max(1e-4), log_sd),
        },
        solid: Solid::of(mesh)?,
        tools: Vec::new(),
        groups: Vec::new(),
        trials: Vec::new(),
        turns: Vec::new(),
        place_sd: capture.noise.position.unwrap_or(scene.config.place_sd),
        gravity: scene.support_from_world.rotation * capture.gravity,
    })
}

/// The ways in which a thing may have stood where its turn was not measured: as the views or the capture show it, as
/// its mesh stands, or on a face, by the height at which it was seen.
fn choose_turns(bench: &mut Bench, scene: &Scene, notices: &mut Notices) {
    let unknown: Vec<f64> = bench
        .trials
        .iter()
        .filter(|t| t.turn.is_none())
        .map(|t| t.place.z)
        .collect();
    let Some(height) = crate::math::median(&unknown) else {
        return;
    };
    let support = scene.support_from_world.rotation;
    let mut upright = vec![UnitQuaternion::identity()];
    if let Some(link) = scene.model.twin.link(&bench.name) {
        upright.insert(0, support * link.pose.rotation);
    }
    let fits = |turn: &UnitQuaternion<f64>| {
        (bench.solid.standing_height(turn) - height).abs() < HEIGHT.max(3.0 * bench.place_sd)
    };
    let resting = bench.solid.resting_turns();
    let stable = |turn: &UnitQuaternion<f64>| {
        let down = turn.inverse() * Vector3::z();
        bench.solid.is_ball()
            || resting
                .iter()
                .any(|(r, _)| (r.inverse() * Vector3::z()).dot(&down) > 0.995)
    };
    let lying = || resting.iter().any(|(t, _)| fits(t));
    let standing = upright.iter().find(|t| fits(t) && (stable(t) || !lying()));
    bench.turns = match standing {
        Some(turn) => vec![(*turn, 1.0)],
        None => {
            let lying: Vec<_> = resting.iter().filter(|(t, _)| fits(t)).cloned().collect();
            let chosen = match (lying.is_empty(), upright.iter().find(|t| stable(t))) {
                (false, _) => lying,
                (true, Some(turn)) => vec![(*turn, 1.0)],
                (true, None) => resting.clone(),
            };
            if chosen.len() > 1 {
                notices.note(
                    STAGE,
                    &bench.name,
                    format!(
                        "how it stood was not measured: {} ways of resting are drawn",
                        chosen.len()
                    ),
                );
            }
            let total: f64 = chosen.iter().map(|c| c.1).sum();
            chosen
                .into_iter()
                .map(|(t, odds)| (t, odds / total.max(1e-12)))
                .collect()
        }
    };
}
