//! What a view from a candidate pose may be expected to show: rays cast through the belief.

use nalgebra::{Point3, Vector3};

use super::belief::{Belief, State, beside, quality, shows};
use super::lens::unproject;
use crate::base::Pose;
use crate::capture::Camera;

/// Probability that an unknown voxel beside a known surface is surface itself, and far from any.
const NEAR_CHANCE: f64 = 0.45;
const FAR_CHANCE: f64 = 0.03;
/// Voxels over which that chance falls by e.
const FALL: f64 = 2.5;
/// Cosine from which a known surface beside an unknown voxel hides it.
const HIDES: f64 = 0.1;
/// Least chance of a ray to be still under way.
const LEAST_LEFT: f64 = 0.05;

/// What a candidate pose is expected to show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gain {
    /// Surface that nobody saw yet, m².
    pub unseen: f64,
    /// Surface that is known, seen better than so far, m², weighed by incidence and range noise.
    pub better: f64,
    /// Rays that would end on what is known well already, of all that meet anything, 0 to 1.
    pub known: f64,
}

impl Gain {
    /// The sum by which candidates are compared, m².
    pub fn total(&self) -> f64 {
        self.unseen + self.better
    }
}

/// The gain of looking with `camera` from `pose`. A voxel counts once, by the best of the rays that reach it
/// (Delmerico et al. 2018: proximity count and rear side, here weighed by incidence).
pub(super) fn expected(belief: &Belief, camera: &Camera, pose: &Pose) -> Gain {
    let mut tally = Tally::new(belief);
    let eye = Point3::from(pose.translation.vector);
    let middle = belief.low + Vector3::from(belief.size.map(|n| 0.5 * n as f64 * belief.voxel));
    // One ray a voxel at the middle of the workspace.
    let step = (0.8 * belief.voxel * camera.fx / (middle - eye).norm().max(0.1))
        .floor()
        .max(1.0) as usize;
    for v in (step / 2..camera.height as usize).step_by(step) {
        for u in (step / 2..camera.width as usize).step_by(step) {
            let (x, y) = unproject(camera, u as f64, v as f64);
            let ray = Vector3::new(x, y, 1.0);
            let scale = 1.0 / ray.norm();
            tally.cast(&eye, &((pose.rotation * ray) * scale), camera, scale);
        }
    }
    tally.sum()
}

struct Tally<'a> {
    belief: &'a Belief,
    /// By voxel; what is known is kept negative, so that one array serves both.
    best: Vec<f32>,
    known: usize,
    met: usize,
}

impl<'a> Tally<'a> {
    fn new(belief: &'a Belief) -> Self {
        Self {
            belief,
            best: vec![0.0; (belief.size[0] * belief.size[1] * belief.size[2]) as usize],
            known: 0,
            met: 0,
        }
    }

    fn cast(&mut self, eye: &Point3<f64>, way: &Vector3<f64>, camera: &Camera, scale: f64) {
        let belief = self.belief;
        let Some((from, to)) = belief.clip(eye, way) else {
            return;
        };
        let (from, to) = (from.max(camera.depth_min / scale), to.min(camera.depth_max / scale));
        let step = 0.7 * belief.voxel;
        let (mut t, mut left, mut last) = (from, 1.0, usize::MAX);
        while t < to && left > LEAST_LEFT {
            let place = belief.place(&(eye + way * t));
            t += step;
            let Some(at) = belief.at(place).filter(|at| *at != last) else {
                continue;
            };
            last = at;
            match belief.state(place, at) {
                State::Free => {}
                State::Support => return,
                State::Surface => return self.surface(at, way, t, left),
                State::Unknown => match self.hidden_by(place, way) {
                    Some(surface) => return self.surface(surface, way, t, left),
                    None => left -= self.unknown(place, at, way, left),
                },
            }
        }
    }

    /// A known surface beside an unknown voxel that faces the ray: the ray only slips between samples of it.
    fn hidden_by(&self, place: [i64; 3], way: &Vector3<f64>) -> Option<usize> {
        let belief = self.belief;
        beside(place).into_iter().find_map(|next| {
            let at = belief.at(next)?;
            let faces = belief.to_surface(at) == 0 && -belief.normal(at).dot(way) > HIDES;
            faces.then_some(at)
        })
    }

    fn surface(&mut self, at: usize, way: &Vector3<f64>, range: f64, left: f64) {
        self.met += 1;
        let cosine = -self.belief.normal(at).dot(way);
        let more = left * (quality(cosine, range) - self.belief.seen_quality(at));
        if more <= 0.0 {
            self.known += 1;
        } else {
            self.best[at] = self.best[at].min(-more as f32);
        }
    }

    /// Notes an unknown voxel; returns the chance that the ray ends there.
    fn unknown(&mut self, place: [i64; 3], at: usize, way: &Vector3<f64>, left: f64) -> f64 {
        let belief = self.belief;
        let away = f64::from(belief.to_surface(at).saturating_sub(1));
        let chance = left * (FAR_CHANCE + (NEAR_CHANCE - FAR_CHANCE) * (-away / FALL).exp());
        self.met += 1;
        let shown = shows(self.facing(place, way)) * chance;
        self.best[at] = self.best[at].max(shown as f32);
        chance
    }

    /// Cosine between the ray and the way out into free space, at the least what a slanted look gives.
    fn facing(&self, place: [i64; 3], way: &Vector3<f64>) -> f64 {
        let belief = self.belief;
        let mut out = Vector3::zeros();
        for next in beside(place) {
            if belief.at(next).is_some_and(|at| belief.state(next, at) == State::Free) {
                out += Vector3::new(
                    (next[0] - place[0]) as f64,
                    (next[1] - place[1]) as f64,
                    (next[2] - place[2]) as f64,
                );
            }
        }
        out.try_normalize(1e-9).map_or(0.5, |n| (-n.dot(way)).max(0.3))
    }

    fn sum(self) -> Gain {
        let area = self.belief.voxel * self.belief.voxel;
        let (mut unseen, mut better) = (0.0, 0.0);
        for share in self.best {
            if share > 0.0 {
                unseen += f64::from(share);
            } else {
                better -= f64::from(share);
            }
        }
        Gain {
            unseen: unseen * area,
            better: better * area,
            known: self.known as f64 / self.met.max(1) as f64,
        }
    }
}
