//! Follows bodies through the images of one interaction.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::align::{Fit, align, verdicts};
use super::foreign::Foreign;
use super::picture::{Picture, Pixel};
use super::surfels::Surfels;
use crate::base::Result;
use crate::capture::{Capture, Frames, Interaction, PoseStream, read_frame};
use crate::twin::SupportPlane;

/// Pixels of one body that are used.
const PIXELS: f64 = 2400.0;
/// Points of a surface that are judged.
const JUDGED: usize = 700;
/// Share of the expected surface that must be there, else the body is lost.
const LEAST_SUPPORT: f64 = 0.75;
/// Judged points that must be there, else the body is lost.
const LEAST_MATCHED: usize = 20;
/// As a share of what was there at first.
const LEAST_LEFT: f64 = 0.15;
/// Room around the last place in which a body is looked for, m.
const MARGIN: f64 = 0.02;

/// A body with its surface in its link frame.
pub struct Followed<'a> {
    /// Its name.
    pub name: String,
    /// Its surface.
    pub model: Arc<Surfels>,
    /// World-from-link at the first view.
    pub home: Isometry3<f64>,
    /// Its track, where it was measured: it is then only kept apart from the others.
    pub track: Option<&'a PoseStream>,
}

/// One body's fits, frame by frame; nothing where it was lost.
pub type Run = Vec<Option<Fit>>;

/// What is remembered of a body from frame to frame.
struct Memory {
    last: Isometry3<f64>,
    before: Option<Isometry3<f64>>,
    /// Where it stood at first. Friction holds what is not pushed, so that it is most often still there.
    rest: Isometry3<f64>,
    /// Judged points that were there when it was first found.
    usual: Option<usize>,
    lost: bool,
}

/// Follows every body that has no measured track through the images of `interaction`; `starts` holds where each
/// may be at first.
///
/// # Errors
/// An image that cannot be read.
pub fn follow_through(
    capture: &Capture,
    interaction: &Interaction,
    frames: &Frames,
    bodies: &[Followed],
    starts: &[Isometry3<f64>],
    support: Option<&SupportPlane>,
) -> Result<Vec<Run>> {
    let mut memories: Vec<Memory> = starts.iter().map(|s| Memory::new(*s)).collect();
    let mut runs: Vec<Run> = bodies.iter().map(|_| Vec::with_capacity(frames.time.len())).collect();
    for (i, time) in frames.time.iter().enumerate() {
        let (image, _) = read_frame(capture, frames, i)?;
        let Some(pose) = frames.pose(i) else {
            runs.iter_mut().for_each(|run| run.push(None));
            continue;
        };
        let picture = Picture::new(&capture.cameras[frames.camera], &image, pose.0);
        let foreign = Foreign::at(interaction, support, *time);
        let guesses = guesses(bodies, &memories, *time);
        for (k, run) in runs.iter_mut().enumerate() {
            run.push(find(&picture, &foreign, bodies, &guesses, k, &mut memories[k]));
        }
    }
    Ok(runs)
}

/// The fits as a track; rows in which the body was lost are missing.
pub fn stream(time: &[f64], run: &Run) -> PoseStream {
    let missing = Point3::new(f64::NAN, f64::NAN, f64::NAN);
    let place = |f: &Option<Fit>| f.as_ref().map_or(missing, |f| f.pose.translation.vector.into());
    PoseStream {
        time: time.to_vec(),
        position: run.iter().map(place).collect(),
        rotation: run.iter().map(|f| f.as_ref().map(|f| f.pose.rotation)).collect(),
    }
}

impl Memory {
    fn new(start: Isometry3<f64>) -> Self {
        Self {
            last: start,
            before: None,
            rest: start,
            usual: None,
            lost: false,
        }
    }

    /// Where it should be now if it goes on as it did.
    fn guess(&self) -> Isometry3<f64> {
        match self.before {
            Some(before) if !self.lost => unit(self.last * before.inverse() * self.last),
            _ => self.last,
        }
    }

    fn note(&mut self, fit: Option<&Fit>) {
        match fit {
            Some(fit) => {
                self.before = (!self.lost).then_some(self.last);
                self.last = fit.pose;
                self.usual.get_or_insert(fit.matched);
            }
            None => self.before = None,
        }
        self.lost = fit.is_none();
    }
}

/// With a quaternion of length one: products of products would double its error from image to image.
fn unit(mut pose: Isometry3<f64>) -> Isometry3<f64> {
    pose.rotation.renormalize();
    pose
}

/// Where every body is taken to be at `time`, measured tracks first.
fn guesses(bodies: &[Followed], memories: &[Memory], time: f64) -> Vec<Isometry3<f64>> {
    let measured = |body: &Followed| {
        let (p, q) = body.track?.sample(time)?;
        Some(Isometry3::from_parts(p.into(), q.unwrap_or_default()))
    };
    bodies
        .iter()
        .zip(memories)
        .map(|(body, memory)| measured(body).unwrap_or_else(|| memory.guess()))
        .collect()
}

fn find(
    picture: &Picture,
    foreign: &Foreign,
    bodies: &[Followed],
    guesses: &[Isometry3<f64>],
    k: usize,
    memory: &mut Memory,
) -> Option<Fit> {
    if bodies[k].track.is_some() {
        return None;
    }
    let mut best: Option<Fit> = None;
    for start in starts(&guesses[k], memory) {
        let mine = |point: &Point3<f64>| belongs(foreign, bodies, guesses, k, &start, point);
        let pixels = pixels_of(picture, foreign, &bodies[k].model, &start, &mine);
        let Some(fit) = attempt(picture, &pixels, &mine, &bodies[k].model, &start) else {
            continue;
        };
        let enough = fit.matched >= LEAST_MATCHED.max((LEAST_LEFT * memory.usual.unwrap_or(0) as f64) as usize);
        let better = best
            .as_ref()
            .is_none_or(|b| fit.score() > b.score() + 0.02 * b.matched as f64);
        if enough && fit.support >= LEAST_SUPPORT && better {
            best = Some(fit);
        }
        let usual = memory.usual.unwrap_or(0) as f64;
        if best
            .as_ref()
            .is_some_and(|b| b.support > 0.98 && b.matched as f64 > 0.95 * usual)
        {
            break;
        }
    }
    memory.note(best.as_ref());
    best
}

/// Places to start from: the guess, the last place, the first, and around the last once the body was lost.
fn starts(guess: &Isometry3<f64>, memory: &Memory) -> Vec<Isometry3<f64>> {
    let mut out = vec![*guess];
    if memory.before.is_some() {
        out.push(memory.last);
    }
    if memory.last != memory.rest {
        out.push(memory.rest);
    }
    if memory.lost {
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            out.push(Translation3::new(0.02 * x, 0.02 * y, 0.0) * memory.last);
        }
        for angle in [-0.25, 0.25] {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            let mut turned = memory.last;
            turned.rotation = turn * turned.rotation;
            out.push(turned);
        }
    }
    out
}

fn attempt(
    picture: &Picture,
    pixels: &[Pixel],
    mine: &impl Fn(&Point3<f64>) -> bool,
    model: &Surfels,
    start: &Isometry3<f64>,
) -> Option<Fit> {
    let mut fit = align(picture, pixels, mine, model, start)?;
    let [there, through, ..] = verdicts(picture, model, &fit.pose, model.points.len() / JUDGED);
    fit.matched = there;
    fit.support = there as f64 / (there + through).max(1) as f64;
    Some(fit)
}

/// Whether a reading can be of body `k`, thought to be at `start`: not of the tool, nor of a body that is nearer.
fn belongs(
    foreign: &Foreign,
    bodies: &[Followed],
    guesses: &[Isometry3<f64>],
    k: usize,
    start: &Isometry3<f64>,
    point: &Point3<f64>,
) -> bool {
    let own = distance(&bodies[k].model, start, point);
    let nearer = |j: usize| j == k || distance(&bodies[j].model, &guesses[j], point) > own;
    own.is_finite() && !foreign.on_tool(point) && (0..bodies.len()).all(nearer)
}

/// The pixels around a body that are `mine` and not of the table.
fn pixels_of(
    picture: &Picture,
    foreign: &Foreign,
    model: &Surfels,
    start: &Isometry3<f64>,
    mine: &impl Fn(&Point3<f64>) -> bool,
) -> Vec<Pixel> {
    let grown = model.corners(start).map(|p| {
        let out = p - start * model.center;
        p + out.normalize() * MARGIN
    });
    let Some([x0, y0, x1, y1]) = picture.window(grown.into_iter()) else {
        return Vec::new();
    };
    let area = ((x1 - x0 + 1) * (y1 - y0 + 1)) as f64;
    let stride = (area / PIXELS).sqrt().ceil().max(1.0) as usize;
    (y0..=y1)
        .step_by(stride)
        .flat_map(|y| (x0..=x1).step_by(stride).map(move |x| (x, y)))
        .filter_map(|(x, y)| picture.pixel(x, y))
        .filter(|pixel| !foreign.on_table(pixel) && mine(&pixel.point))
        .collect()
}

/// Distance of a point of the world to the nearest point of a surface; infinite where that is far.
fn distance(model: &Surfels, pose: &Isometry3<f64>, point: &Point3<f64>) -> f64 {
    let q = pose.inverse_transform_point(point);
    model
        .nearest(&q)
        .map_or(f64::INFINITY, |i| (model.points[i] - q).norm())
}
