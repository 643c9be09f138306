//! A capture as one of what moves as one: one track, one name and one stated weight for all members of a lump.

use std::collections::BTreeMap;

use crate::base::Pose;
use crate::capture::{BodyPrior, Capture, Interaction, PoseStream};
use crate::twin::{Lump, Lumped, Model, lumped};

/// The model with one link for all that is held to each other, by the names that the capture tracks.
pub(super) fn lumps_of(capture: &Capture, model: &Model) -> Lumped {
    lumped(model, |name| {
        let meant = |i: &&Interaction| i.target.as_deref() == Some(name);
        let tracked = capture
            .interactions
            .iter()
            .filter(|i| i.tracks.contains_key(name))
            .count();
        2 * tracked + capture.interactions.iter().filter(meant).count()
    })
}

/// The capture with one track for each lump, and lumps as what is touched.
pub(super) fn as_lumps(capture: &Capture, lumps: &[Lump]) -> Capture {
    let mut out = capture.clone();
    let several: Vec<&Lump> = lumps.iter().filter(|l| l.members.len() > 1).collect();
    for lump in &several {
        weigh(&mut out.bodies, lump);
    }
    for interaction in &mut out.interactions {
        for lump in &several {
            let member = |name: &str| lump.members.iter().find(|(n, _)| n == name);
            if let Some(target) = interaction.target.as_mut().filter(|t| member(t).is_some()) {
                target.clone_from(&lump.name);
            }
            let own = own_track(&interaction.tracks, lump);
            interaction.tracks.retain(|name, _| member(name).is_none());
            if let Some(track) = own {
                interaction.tracks.insert(lump.name.clone(), track);
            }
        }
    }
    out
}

/// What is stated of the members is stated of the lump: its mass where that of every member is.
pub(super) fn weigh(bodies: &mut Vec<BodyPrior>, lump: &Lump) {
    let member = |name: &str| lump.members.iter().any(|(n, _)| n == name);
    let stated: Vec<(f64, f64)> = bodies
        .iter()
        .filter(|b| member(&b.name))
        .filter_map(|b| Some((b.mass?, b.mass_sd.unwrap_or(0.0))))
        .collect();
    let whole = stated.len() == lump.members.len();
    bodies.retain(|b| b.name == lump.name || !member(&b.name));
    if let Some(own) = bodies.iter_mut().find(|b| b.name == lump.name) {
        own.mass = whole.then(|| stated.iter().map(|s| s.0).sum());
        own.mass_sd = whole.then(|| stated.iter().map(|s| s.1.powi(2)).sum::<f64>().sqrt());
        own.mesh = None;
    }
}

/// The track of the lump's own member, else that of another, carried over.
fn own_track(tracks: &BTreeMap<String, PoseStream>, lump: &Lump) -> Option<PoseStream> {
    if let Some(own) = tracks.get(&lump.name) {
        return Some(own.clone());
    }
    let (track, place) = lump
        .members
        .iter()
        .find_map(|(name, place)| Some((tracks.get(name)?, place)))?;
    let mut out = track.clone();
    for i in 0..track.len() {
        if let Some(pose) = track.pose(i) {
            let Pose(carried) = Pose(pose.0 * place.0.inverse());
            out.position[i] = carried.translation.vector.into();
            out.rotation[i] = Some(carried.rotation);
        }
    }
    Some(out)
}
