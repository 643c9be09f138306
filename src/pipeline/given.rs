//! A capture and a model as one that has no fixed joints: what they hold to each other is one thing with one track.

use std::collections::BTreeMap;

use crate::base::Pose;
use crate::capture::{Capture, PoseStream};
use crate::twin::{Lump, Lumped, Model, lumped};

/// The model with one link for all that is held to each other, by the names that the capture tracks.
pub(super) fn lumps_of(capture: &Capture, model: &Model) -> Lumped {
    lumped(model, |name| {
        let meant = |i: &&crate::capture::Interaction| i.target.as_deref() == Some(name);
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
