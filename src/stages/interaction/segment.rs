//! The verb of the interaction pass.

use nalgebra::{Point3, Vector3};

use super::Config;
use super::contact::{Contact, find_contact};
use super::cut::{Instants, cut};
use super::doubtful::doubtful;
use super::motion::{Motion, measure_motion};
use super::preload::tell_preloads;
use crate::base::{Notices, Result};
use crate::capture::{Capture, Interaction, Kind, PoseStream, Segmented};
use crate::math::{median, turned_displacement};
use crate::twin::Model;

const STAGE: &str = "interaction";

/// Cuts every interaction (held-out ones too) into phases, in the order of the capture.
pub fn segment(capture: &Capture, _model: &Model, config: &Config, notices: &mut Notices) -> Result<Vec<Segmented>> {
    config.check()?;
    let mut all: Vec<Segmented> = capture
        .interactions
        .iter()
        .map(|i| segment_one(capture, i, config, notices))
        .collect();
    tell_preloads(capture, &mut all);
    Ok(all)
}

fn segment_one(capture: &Capture, interaction: &Interaction, config: &Config, notices: &mut Notices) -> Segmented {
    let touches = matches!(interaction.kind, Kind::Push | Kind::Press);
    let free = touches && interaction.tool.as_ref().is_some_and(|t| !t.grip && !t.pin);
    let contact = interaction.force.as_ref().and_then(|f| find_contact(f, free, config));
    let (start, end) = span(interaction);
    let approach = interaction.tool_path.as_ref().and_then(|p| starts_to_move(p, config));
    let turning = interaction.support_path.as_ref().and_then(|s| {
        let first = s.vector.first()?;
        let at = s.vector.iter().position(|n| n.angle(first) > 2e-3)?;
        Some(s.time[at])
    });
    let onset = contact.as_ref().and_then(|c| c.onset);
    let rest_until = [onset, turning]
        .into_iter()
        .flatten()
        .reduce(f64::min)
        .unwrap_or(start + 0.1);
    let carried: Vec<(String, PoseStream)> = interaction
        .tracks
        .iter()
        .map(|(name, track)| (name.clone(), relative_to_support(capture, interaction, track)))
        .collect();
    let motions: Vec<(String, Motion)> = carried
        .iter()
        .filter_map(|(name, track)| Some((name.clone(), measure_motion(track, rest_until, config)?)))
        .collect();
    let mut instants = Instants {
        start,
        end,
        contact: onset.or(turning),
        ..Instants::default()
    };
    place_slide(interaction, &motions, &contact, approach, &mut instants);
    if interaction.force.is_some() && onset.is_none() {
        notices.warn(
            STAGE,
            &interaction.name,
            "the force never leaves its noise: no contact was found",
        );
    }
    if let Some(words) = doubtful(interaction) {
        notices.warn(STAGE, &interaction.name, words);
    }
    let touched = touched_bodies(interaction, &motions, &instants);
    let noise = |of: fn(&Motion) -> Option<f64>| median(&motions.iter().filter_map(|(_, m)| of(m)).collect::<Vec<_>>());
    Segmented {
        interaction: interaction.name.clone(),
        phases: cut(instants, &motions, &touched, is_snapshot(interaction)),
        force_noise: contact.as_ref().map(|c| c.noise),
        force_tare: contact.as_ref().and_then(|c| c.tare),
        preload: None,
        tare_doubt: 0.0,
        position_noise: noise(|m| m.position_noise),
        rotation_noise: noise(|m| m.rotation_noise),
    }
}

/// Sets the instants of slide, approach and release.
fn place_slide(
    interaction: &Interaction,
    motions: &[(String, Motion)],
    contact: &Option<Contact>,
    approach: Option<f64>,
    instants: &mut Instants,
) {
    let after = instants.contact.unwrap_or(instants.start);
    let first_motion = motions.iter().filter_map(|(_, m)| m.onset(after)).reduce(f64::min);
    instants.slide = match interaction.kind {
        Kind::Press | Kind::Hold => None,
        _ if is_snapshot(interaction) => first_motion.and(contact.as_ref().and_then(|c| plateau(interaction, c))),
        _ => first_motion,
    };
    // Without a force, what moves is all that is known.
    let from = instants.contact.or(instants.slide);
    instants.approach = approach.filter(|t| from.is_none_or(|c| *t < c));
    let stops = || motions.iter().filter_map(|(_, m)| m.stops(after)).reduce(f64::max);
    instants.release = match contact {
        Some(c) => c.release.filter(|t| *t < instants.end - 1e-9),
        None => instants.slide.and_then(|_| stops()).filter(|t| *t < instants.end),
    };
}

/// Every body was seen before and after only.
fn is_snapshot(interaction: &Interaction) -> bool {
    interaction.tracks.values().all(PoseStream::is_snapshot_pair)
}

/// First and last time of any stream.
fn span(interaction: &Interaction) -> (f64, f64) {
    let force = interaction.force.iter().flat_map(|s| s.time.iter());
    let support = interaction.support_path.iter().flat_map(|s| s.time.iter());
    let poses = interaction.tracks.values().chain(&interaction.tool_path);
    let all = force.chain(support).chain(poses.flat_map(|s| s.time.iter()));
    let (lo, hi) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| {
        (lo.min(*t), hi.max(*t))
    });
    if lo <= hi { (lo, hi) } else { (0.0, 0.0) }
}

/// When the tool leaves the place where it stood.
fn starts_to_move(path: &PoseStream, config: &Config) -> Option<f64> {
    let motion = measure_motion(path, path.time.first()? + 0.1, config)?;
    motion.onset(path.time[0])
}

/// For a snapshot pair, the slide is taken to begin where the force first reaches 80 % of its plateau.
fn plateau(interaction: &Interaction, contact: &Contact) -> Option<f64> {
    let stream = interaction.force.as_ref()?;
    let tare = contact.tare.unwrap_or_default();
    let (from, to) = (contact.onset?, contact.release?);
    let rows: Vec<(f64, f64)> = stream
        .time
        .iter()
        .zip(&stream.force)
        .filter(|(t, _)| **t >= from && **t <= to)
        .map(|(t, f)| (*t, (f - tare).norm()))
        .collect();
    let middle = median(&rows.iter().map(|r| r.1).collect::<Vec<_>>())?;
    rows.iter().find(|r| r.1 > 0.8 * middle).map(|r| r.0)
}

/// The track as seen from the support where that turns, else as it is.
fn relative_to_support(capture: &Capture, interaction: &Interaction, track: &PoseStream) -> PoseStream {
    let Some(path) = &interaction.support_path else {
        return track.clone();
    };
    let guess = capture.support.as_ref().map_or(Point3::origin(), |s| s.point);
    let normals: Vec<Vector3<f64>> = path.vector.iter().map(|n| n.into_inner()).collect();
    let noise = capture.noise.position.unwrap_or(5e-4);
    match turned_displacement(&path.time, &normals, &track.time, &track.position, noise, &guess) {
        Some(turned) => PoseStream {
            time: track.time.clone(),
            position: turned.displacement.iter().map(|d| Point3::from(*d)).collect(),
            rotation: track
                .rotation
                .iter()
                .zip(&turned.turn)
                .map(|(q, r)| q.map(|q| r.inverse() * q))
                .collect(),
        },
        None => track.clone(),
    }
}

/// What the tool touched: the target where it was named, else the body that moved first.
fn touched_bodies(interaction: &Interaction, motions: &[(String, Motion)], instants: &Instants) -> Vec<String> {
    if interaction.tool_path.is_none() && interaction.force.is_none() {
        return Vec::new();
    }
    if let Some(target) = &interaction.target {
        return vec![target.clone()];
    }
    let after = instants.contact.unwrap_or(instants.start);
    motions
        .iter()
        .filter_map(|(name, m)| Some((m.onset(after)?, name)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| vec![name.clone()])
        .unwrap_or_default()
}
