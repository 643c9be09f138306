//! The verb: tracks, with covariances, of what the capture filmed and nobody tracked.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, Point3, Translation3};

use super::super::{Config, ShapedObject, Shapes};
use super::divide::divide;
use super::follow::{Followed, Run, follow_through, stream};
use super::parts::{Filmed, Filming, two_parts};
use super::surfels::Surfels;
use crate::base::{Notices, Pose, Result};
use crate::capture::{Capture, Kind, PoseStream};
use crate::geometry::Mesh;

/// Most times that things are taken apart.
const MOST_ROUNDS: usize = 4;
/// Share of the images in which a body must be found for a track.
const LEAST_FOUND: f64 = 0.1;

/// A track made from images.
#[derive(Clone, Debug)]
pub struct VisualTrack {
    /// Name of the interaction.
    pub interaction: String,
    /// Name of the body or link.
    pub body: String,
    /// World-from-link; rows in which the body was lost are missing.
    pub track: PoseStream,
    /// Covariance of each row as a small shift of the link's origin (m) and a small turn (rad), world axes; nothing
    /// where the body was lost.
    pub covariance: Vec<Option<Matrix6<f64>>>,
    /// Directions of motion that no image of the interaction constrained; their covariance is large and the track
    /// keeps them as they were.
    pub unseen: usize,
}

impl VisualTrack {
    /// Standard deviations along an axis of the place (m) and of the turn (rad), medians over the images.
    #[must_use]
    pub fn spread(&self) -> Option<[f64; 2]> {
        let middle = |first: usize| {
            let variance = |c: &Matrix6<f64>| c.fixed_view::<3, 3>(first, first).trace() / 3.0;
            let mut all: Vec<f64> = self.covariance.iter().flatten().map(variance).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).map(|v| v.sqrt())
        };
        Some([middle(0)?, middle(3)?])
    }
}

/// The capture with the tracks that its images give.
#[derive(Clone, Debug)]
pub struct Following<'a> {
    /// As measured, and followed.
    pub capture: Cow<'a, Capture>,
    /// What was followed.
    pub tracks: Vec<VisualTrack>,
}

/// Follows through `frames` what no instrument tracked, takes things apart that move as two, and adds the tracks to
/// the capture. Parts are named `body/part-0` (which moves least), `body/part-1`, ….
///
/// # Errors
/// An image that cannot be read.
pub fn follow<'a>(
    capture: &'a Capture,
    shapes: &mut Shapes,
    config: &Config,
    notices: &mut Notices,
) -> Result<Following<'a>> {
    let films = films(capture, notices);
    if films.is_empty() || shapes.objects.is_empty() {
        return Ok(Following {
            capture: Cow::Borrowed(capture),
            tracks: Vec::new(),
        });
    }
    for _ in 0..MOST_ROUNDS {
        let bodies = bodies(capture, shapes, &films);
        let runs = run_all(capture, &films, &bodies, shapes)?;
        let mut found: Vec<(String, [Mesh; 2])> = Vec::new();
        for (which, body) in bodies.iter().enumerate().filter(|(_, b)| b.track.is_none()) {
            let Some(object) = shapes.objects.iter().find(|o| o.name == body.name) else {
                continue;
            };
            if capture.prior(&object.name).is_some_and(|p| p.mesh.is_some()) {
                continue;
            }
            let scene = Filming {
                capture,
                films: &films,
                bodies: &bodies,
                runs: &runs,
                support: shapes.support.as_ref(),
            };
            let labels = two_parts(&scene, which, &object.mesh)?;
            let Some(labels) = labels else { continue };
            match divide(&object.mesh, &labels, config.voxel) {
                Some(parts) => found.push((object.name.clone(), parts)),
                None => notices.warn(
                    "shape",
                    &object.name,
                    "it moves as two parts, but no two closed bodies could be made of it",
                ),
            }
        }
        if found.is_empty() {
            let tracks = tracks(&films, &bodies, &runs, notices);
            return Ok(with_tracks(capture, shapes, &films, tracks));
        }
        for (name, parts) in found {
            notices.note(
                "shape",
                &name,
                "its parts move against each other: taken apart by their motion",
            );
            replace(shapes, &name, parts);
        }
    }
    let bodies = bodies(capture, shapes, &films);
    let runs = run_all(capture, &films, &bodies, shapes)?;
    let tracks = tracks(&films, &bodies, &runs, notices);
    Ok(with_tracks(capture, shapes, &films, tracks))
}

/// The interactions whose images can be used.
fn films<'a>(capture: &'a Capture, notices: &mut Notices) -> Vec<Filmed<'a>> {
    let mut films = Vec::new();
    for interaction in &capture.interactions {
        let Some(frames) = interaction.frames.as_ref().filter(|f| f.time.len() > 1) else {
            continue;
        };
        if interaction.kind == Kind::Tilt {
            notices.note(
                "shape",
                &interaction.name,
                "bodies are not followed by vision while the support tilts",
            );
            continue;
        }
        films.push(Filmed { interaction, frames });
    }
    films
}

/// Everything with a surface; it has a measured track where any filmed interaction tracks it.
fn bodies<'a>(_capture: &'a Capture, shapes: &Shapes, films: &[Filmed<'a>]) -> Vec<Followed<'a>> {
    let track = |name: &str| films.iter().find_map(|f| f.interaction.tracks.get(name));
    shapes
        .objects
        .iter()
        .filter_map(|object| {
            Some(Followed {
                name: object.name.clone(),
                model: Arc::new(Surfels::of_mesh(&object.mesh)?),
                home: object.world_from_link.0,
                track: track(&object.name),
            })
        })
        .collect()
}

/// Every filmed interaction in turn; each begins where the one before ended, or where all stood at the first view,
/// whichever the first image bears out.
fn run_all(capture: &Capture, films: &[Filmed], bodies: &[Followed], shapes: &Shapes) -> Result<Vec<Vec<Run>>> {
    let mut ends: Vec<Isometry3<f64>> = bodies.iter().map(|b| b.home).collect();
    let homes = ends.clone();
    let mut out = Vec::new();
    for film in films {
        let support = shapes.support.as_ref();
        let follow =
            |starts: &[Isometry3<f64>]| follow_through(capture, film.interaction, film.frames, bodies, starts, support);
        let mut runs = follow(&ends)?;
        let found = |runs: &[Run]| runs.iter().flatten().flatten().map(|f| f.support).sum::<f64>();
        if ends != homes {
            let other = follow(&homes)?;
            if found(&other) > found(&runs) {
                runs = other;
            }
        }
        for (end, run) in ends.iter_mut().zip(&runs) {
            if let Some(fit) = run.iter().rev().flatten().next() {
                *end = fit.pose;
            }
        }
        out.push(runs);
    }
    Ok(out)
}

fn tracks(films: &[Filmed], bodies: &[Followed], runs: &[Vec<Run>], notices: &mut Notices) -> Vec<VisualTrack> {
    let mut out = Vec::new();
    for (film, runs) in films.iter().zip(runs) {
        for (body, run) in bodies.iter().zip(runs).filter(|(b, _)| b.track.is_none()) {
            let name = &film.interaction.name;
            let lost = run.iter().filter(|f| f.is_none()).count();
            if lost > 0 {
                let words = format!(
                    "lost in {lost} of {} images of {name}: those rows of its track are missing",
                    run.len()
                );
                notices.warn("shape", &body.name, words);
            }
            if (run.len() - lost) as f64 <= LEAST_FOUND * run.len() as f64 {
                continue;
            }
            let track = track_of(name, &body.name, &film.frames.time, run);
            if track.unseen > 0 {
                let words = format!(
                    "in {name} the images do not show {} of its 6 directions of motion: kept still there, with a wide covariance",
                    track.unseen
                );
                notices.note("shape", &body.name, words);
            }
            if let Some([place, turn]) = track.spread() {
                let words = format!(
                    "its track in {name} was made from {} images, not measured: to {:.2} mm and {:.2} degrees (1 sd)",
                    run.len() - lost,
                    1e3 * place,
                    turn.to_degrees()
                );
                notices.note("shape", &body.name, words);
            }
            out.push(track);
        }
    }
    out
}

fn track_of(interaction: &str, body: &str, time: &[f64], run: &Run) -> VisualTrack {
    let mut unseen: Vec<usize> = run.iter().flatten().map(|f| f.unseen).collect();
    unseen.sort_unstable();
    VisualTrack {
        interaction: interaction.into(),
        body: body.into(),
        track: stream(time, run),
        covariance: run.iter().map(|f| f.as_ref().map(|f| f.covariance)).collect(),
        unseen: unseen.get(unseen.len() / 2).copied().unwrap_or(0),
    }
}

/// Puts the two parts in the place of the thing.
fn replace(shapes: &mut Shapes, name: &str, parts: [Mesh; 2]) {
    let Some(at) = shapes.objects.iter().position(|o| o.name == name) else {
        return;
    };
    let old = shapes.objects.remove(at);
    let stem = name.split_once('/').map_or(name, |(stem, _)| stem);
    let taken = shapes.objects.iter().map(|o| o.name.clone()).collect::<Vec<_>>();
    let mut free = (0..).map(|i| format!("{stem}/part-{i}")).filter(|n| !taken.contains(n));
    for (k, mesh) in parts.into_iter().enumerate() {
        let center = mesh
            .bounds()
            .map_or(Point3::origin(), |(l, h)| nalgebra::center(&l, &h));
        let link_from_old = Translation3::from(-center.coords);
        let area = |t: usize| 0.5 * mesh.scaled_normal(t).norm();
        let seen = |t: &usize| mesh.triangles[*t].iter().all(|v| mesh.seen[*v as usize]);
        let shown: f64 = (0..mesh.triangles.len()).filter(seen).map(area).sum();
        let object = ShapedObject {
            name: free.next().unwrap_or_default(),
            world_from_link: Pose(old.world_from_link.0 * Translation3::from(center.coords)),
            seen: shown / mesh.area().max(1e-12),
            mesh: mesh.transformed(&Isometry3::from_parts(
                link_from_old,
                nalgebra::UnitQuaternion::identity(),
            )),
            collision: Vec::new(),
            superquadric: None,
            texture: None,
        };
        shapes.objects.insert(at + k, object);
    }
}

/// The capture with the tracks in it. Where noise of tracks was stated it is raised to what the images give; a target
/// that names nothing becomes the body that the tool touches first.
fn with_tracks<'a>(capture: &'a Capture, shapes: &Shapes, films: &[Filmed], tracks: Vec<VisualTrack>) -> Following<'a> {
    let mut out = capture.clone();
    let mut sd: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for track in &tracks {
        if let Some(i) = out.interactions.iter_mut().find(|i| i.name == track.interaction) {
            i.tracks.insert(track.body.clone(), track.track.clone());
        }
        for c in track.covariance.iter().flatten().filter(|_| track.unseen == 0) {
            sd.entry(0)
                .or_default()
                .push((c.fixed_view::<3, 3>(0, 0).trace() / 3.0).sqrt());
            sd.entry(1)
                .or_default()
                .push((c.fixed_view::<3, 3>(3, 3).trace() / 3.0).sqrt());
        }
    }
    let middle = |k: usize| {
        let mut all = sd.get(&k).cloned().unwrap_or_default();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    };
    out.noise.position = out.noise.position.map(|x| x.max(middle(0)));
    out.noise.rotation = out.noise.rotation.map(|x| x.max(middle(1)));
    for film in films {
        let name = &film.interaction.name;
        let known = |t: &String| shapes.objects.iter().any(|o| o.name == *t);
        if film.interaction.target.as_ref().is_some_and(known) {
            continue;
        }
        if let (Some(target), Some(i)) = (
            touched(shapes, film),
            out.interactions.iter_mut().find(|i| i.name == *name),
        ) {
            i.target = Some(target);
        }
    }
    Following {
        capture: Cow::Owned(out),
        tracks,
    }
}

/// The body nearest to where the tool begins.
fn touched(shapes: &Shapes, film: &Filmed) -> Option<String> {
    let start = film
        .interaction
        .tool_path
        .as_ref()?
        .position
        .iter()
        .find(|p| p.x.is_finite())?;
    let distance = |o: &ShapedObject| {
        let p = o.world_from_link.0.inverse_transform_point(start);
        let to = |v: &Point3<f64>| (v - p).norm_squared();
        o.mesh.vertices.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    let nearest = shapes
        .objects
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    Some(nearest.name.clone())
}
