//! Rigid parts of one thing told apart by how they move: motion segmentation of its surface.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};

use super::cut::Graph;
use super::follow::{Followed, Run, follow_through, stream};
use super::foreign::Foreign;
use super::parting::plane_between;
use super::picture::{Picture, Verdict};
use super::skin::Skin;
use super::surfels::Surfels;
use crate::base::Result;
use crate::capture::{Capture, Frames, Interaction, PoseStream, read_frame};
use crate::geometry::Mesh;
use crate::twin::SupportPlane;

/// A thing is taken apart where more of its surface than this share, and than so many points, is not where one rigid
/// body would have it.
const LEAST_SHARE: f64 = 0.03;
const LEAST_POINTS: usize = 60;
/// Parts must come apart by this, m.
const LEAST_MOTION: f64 = 0.005;
/// Images of one interaction that are asked.
const MOST_IMAGES: usize = 24;
/// What no image tells belongs to the part that moves less, by a cost so small that any image outvotes it.
const DOUBT: f64 = 3e-4;
/// Where a plane parts what is known it goes on through what is not, at this cost; and the lead in votes from which a
/// point is known.
const PLANE: f64 = 0.05;
const KNOWN: f64 = 0.3;
/// Rounds of labels and motions.
const ROUNDS: usize = 3;

/// An interaction that was filmed.
pub struct Filmed<'a> {
    /// What was done.
    pub interaction: &'a Interaction,
    /// Its images.
    pub frames: &'a Frames,
}

/// All that was filmed, and how the bodies were followed through it.
pub struct Filming<'a> {
    /// With its cameras.
    pub capture: &'a Capture,
    /// The interactions with images.
    pub films: &'a [Filmed<'a>],
    /// What was followed.
    pub bodies: &'a [Followed<'a>],
    /// Fits by film, body and image.
    pub runs: &'a [Vec<Run>],
    /// The table.
    pub support: Option<&'a SupportPlane>,
}

/// Tells the two parts of body `which` apart; nothing where one rigid body explains all. The labels are of the mesh's
/// vertices, `true` for the part that moves more.
///
/// # Errors
/// An image that cannot be read.
pub fn two_parts(scene: &Filming, which: usize, mesh: &Mesh) -> Result<Option<Vec<bool>>> {
    let surface = Skin::new(mesh);
    let mut seed: Option<Vec<bool>> = None;
    for (film, run) in scene.films.iter().zip(scene.runs) {
        let home = scene.bodies[which].home;
        let found = strays(scene, film, &surface, (&run[which], home))?;
        let larger = |a: &Vec<bool>, b: &Vec<bool>| count(a) > count(b);
        if let Some(found) = found
            && seed.as_ref().is_none_or(|s| larger(&found, s))
        {
            seed = Some(found);
        }
    }
    let Some(mut labels) = seed else { return Ok(None) };
    let mut motion = 0.0;
    for _ in 0..ROUNDS {
        let (Some(still), Some(moving)) = (surface.part(&labels, false), surface.part(&labels, true)) else {
            return Ok(None);
        };
        let parts = [Arc::new(still), Arc::new(moving)];
        let mut votes = vec![[0.0; 2]; surface.points.len()];
        motion = 0.0;
        let mut strayed = [0.0; 2];
        for (k, film) in scene.films.iter().enumerate() {
            let tracks = follow_parts(scene, k, which, &parts)?;
            motion = vote(scene, film, &surface, &tracks, &mut votes)?.max(motion);
            for (sum, run) in strayed.iter_mut().zip(&tracks) {
                *sum += way(run, &scene.bodies[which].home, &surface);
            }
        }
        let restless = usize::from(strayed[1] > strayed[0]);
        doubt(&surface, &mut votes, restless);
        for (vote, share) in votes.iter_mut().zip(&surface.shares) {
            vote.iter_mut().for_each(|v| *v *= share);
        }
        labels = Graph::divide(&votes, &surface.ties);
        if restless == 0 {
            labels.iter_mut().for_each(|l| *l = !*l);
        }
        if !enough(&labels, &surface) {
            return Ok(None);
        }
    }
    Ok((motion > LEAST_MOTION).then_some(labels))
}

/// Gives what no image tells to a side: that of the plane which parts what is known, else that of what moves less.
fn doubt(surface: &Skin, votes: &mut [[f64; 2]], restless: usize) {
    let lead = |v: &[f64; 2]| v[1 - restless] - v[restless];
    let known = |i: usize| surface.seen[i] && lead(&votes[i]).abs() > KNOWN;
    let evidence: Vec<f64> = (0..votes.len())
        .map(|i| if known(i) { lead(&votes[i]) } else { 0.0 })
        .collect();
    let sides = plane_between(&surface.points, &evidence);
    for (i, vote) in votes.iter_mut().enumerate() {
        vote[restless] += DOUBT;
        if let Some(moves) = sides.as_ref().map(|s| s[i])
            && evidence[i] == 0.0
        {
            vote[if moves { 1 - restless } else { restless }] += PLANE;
        }
    }
}

/// How far a part goes from where it was, summed over the images, m.
fn way(run: &Run, home: &Isometry3<f64>, surface: &Skin) -> f64 {
    let off = |pose: &Isometry3<f64>| {
        let points = surface.points.iter().step_by(64);
        points.map(|p| (pose * p - home * p).norm()).fold(0.0, f64::max)
    };
    run.iter().flatten().map(|fit| off(&fit.pose)).sum()
}

fn count(marked: &[bool]) -> usize {
    marked.iter().filter(|m| **m).count()
}

fn enough(labels: &[bool], surface: &Skin) -> bool {
    let seen = count(&surface.seen);
    let of = |which: bool| {
        (0..labels.len())
            .filter(|i| surface.seen[*i] && labels[*i] == which)
            .count()
    };
    let least = LEAST_POINTS.max((LEAST_SHARE * seen as f64) as usize);
    of(true) >= least && of(false) >= least
}

/// The largest piece of the surface that was where it should be in the first image and is not any more in most of the
/// images in which the disagreement is large.
fn strays(
    scene: &Filming,
    film: &Filmed,
    surface: &Skin,
    (run, home): (&Run, Isometry3<f64>),
) -> Result<Option<Vec<bool>>> {
    let mut at_first: Option<Vec<bool>> = None;
    let mut later: Vec<Vec<Verdict>> = Vec::new();
    let mut last = home;
    for (i, fit) in run.iter().enumerate() {
        if let Some(fit) = fit {
            last = fit.pose;
        }
        if i > 0 && i % run.len().div_ceil(MOST_IMAGES) != 0 {
            continue;
        }
        let judged = judged_in(scene, film, i, surface, &last)?;
        match &at_first {
            None => at_first = Some(judged.iter().map(|v| *v == Verdict::There).collect()),
            Some(_) => later.push(judged),
        }
    }
    let first = at_first.unwrap_or_default();
    let gone = |judged: &[Verdict], i: usize| first[i] && matches!(judged[i], Verdict::Through | Verdict::Hidden);
    let wrong: Vec<usize> = later
        .iter()
        .map(|judged| (0..judged.len()).filter(|i| gone(judged, *i)).count())
        .collect();
    let most = wrong.iter().copied().max().unwrap_or(0);
    if most < LEAST_POINTS.max((LEAST_SHARE * count(&first) as f64) as usize) {
        return Ok(None);
    }
    let late: Vec<&Vec<Verdict>> = later
        .iter()
        .zip(&wrong)
        .filter(|(_, w)| 2 * **w >= most)
        .map(|(judged, _)| judged)
        .collect();
    // What is only hidden by the part that moves is still there before that comes in its way.
    let persistent = |i: usize| {
        let left = late.iter().filter(|judged| gone(judged, i)).count();
        let stayed = late.iter().filter(|judged| judged[i] == Verdict::There).count();
        2 * left >= late.len() && 10 * stayed <= late.len()
    };
    let marked: Vec<bool> = (0..surface.points.len()).map(persistent).collect();
    let largest = surface.largest(&marked);
    Ok((count(&largest) >= LEAST_POINTS / 2).then_some(largest))
}

fn judged_in(scene: &Filming, film: &Filmed, i: usize, surface: &Skin, pose: &Isometry3<f64>) -> Result<Vec<Verdict>> {
    let (image, _) = read_frame(scene.capture, film.frames, i)?;
    let Some(camera) = film.frames.pose(i) else {
        return Ok(vec![Verdict::Unknown; surface.points.len()]);
    };
    let picture = Picture::new(&scene.capture.cameras[film.frames.camera], &image, camera.0);
    let foreign = Foreign::at(film.interaction, scene.support, film.frames.time[i]);
    Ok(surface.judged(&picture, &foreign, pose))
}

/// Follows the two parts through film `k` from where they were one, beside the other bodies where those were found.
fn follow_parts(scene: &Filming, k: usize, which: usize, parts: &[Arc<Surfels>; 2]) -> Result<[Run; 2]> {
    let film = &scene.films[k];
    let others: Vec<usize> = (0..scene.bodies.len()).filter(|j| *j != which).collect();
    let streams: Vec<PoseStream> = others
        .iter()
        .map(|j| stream(&film.frames.time, &scene.runs[k][*j]))
        .collect();
    let home = scene.bodies[which].home;
    let part = |model: &Arc<Surfels>| Followed {
        name: scene.bodies[which].name.clone(),
        model: model.clone(),
        home,
        track: None,
    };
    let beside = others.iter().zip(&streams).map(|(j, stream)| Followed {
        name: scene.bodies[*j].name.clone(),
        model: scene.bodies[*j].model.clone(),
        home: scene.bodies[*j].home,
        track: scene.bodies[*j].track.or(Some(stream)),
    });
    let all: Vec<Followed> = parts.iter().map(part).chain(beside).collect();
    let starts: Vec<Isometry3<f64>> = all.iter().map(|b| b.home).collect();
    let runs = follow_through(
        scene.capture,
        film.interaction,
        film.frames,
        &all,
        &starts,
        scene.support,
    )?;
    let mut runs = runs.into_iter();
    Ok([runs.next().unwrap_or_default(), runs.next().unwrap_or_default()])
}

/// Adds what the images of one interaction say for either motion of each vertex; gives how far the motions part, m.
fn vote(scene: &Filming, film: &Filmed, surface: &Skin, tracks: &[Run; 2], votes: &mut [[f64; 2]]) -> Result<f64> {
    let both: Vec<(usize, [Isometry3<f64>; 2])> = (0..tracks[0].len())
        .filter_map(|i| Some((i, [tracks[0][i].as_ref()?.pose, tracks[1][i].as_ref()?.pose])))
        .collect();
    let apart = |poses: &[Isometry3<f64>; 2], p: &Point3<f64>| (poses[0] * p - poses[1] * p).norm();
    let extent = |poses: &[Isometry3<f64>; 2]| {
        surface
            .points
            .iter()
            .step_by(16)
            .map(|p| apart(poses, p))
            .fold(0.0, f64::max)
    };
    let moved: Vec<_> = both.iter().filter(|(_, poses)| extent(poses) > 0.003).collect();
    let farthest = moved.iter().map(|(_, poses)| extent(poses)).fold(0.0, f64::max);
    for (i, poses) in moved.iter().step_by(moved.len().div_ceil(MOST_IMAGES).max(1)) {
        let judged = [
            judged_in(scene, film, *i, surface, &poses[0])?,
            judged_in(scene, film, *i, surface, &poses[1])?,
        ];
        for (v, vote) in votes.iter_mut().enumerate() {
            if apart(poses, &surface.points[v]) > 0.002 {
                let [still, moved] = costs(judged[0][v], judged[1][v]);
                vote[0] += still;
                vote[1] += moved;
            }
        }
    }
    Ok(farthest)
}

/// What it costs to believe in either motion of a point where an image judges it so under the first and the second. A
/// point that cannot be seen is no evidence against a motion, whatever hides it.
fn costs(first: Verdict, second: Verdict) -> [f64; 2] {
    let cost = |verdict: Verdict, other: Verdict| match verdict {
        Verdict::There => 0.0,
        Verdict::Through => 0.15,
        // That something is where the point would be if it moved otherwise may be another part's doing.
        Verdict::Hidden | Verdict::Unknown if other == Verdict::There => 0.02,
        Verdict::Hidden | Verdict::Unknown => 0.0375,
    };
    [cost(first, second), cost(second, first)]
}
