//! What a view from a candidate pose may be expected to show of the surface that is known, foreseen, or may be there.

use nalgebra::{Point3, Vector3};

use super::belief::{Belief, State, beside, shows};
use super::foresee::foresee;
use crate::base::Pose;
use crate::capture::Camera;
use crate::stages::shape::lens::project;

/// Probability that a frontier beside a known surface is surface itself, and far from any.
const NEAR_CHANCE: f64 = 0.45;
const FAR_CHANCE: f64 = 0.05;
/// Voxels over which that chance falls by e.
const FALL: f64 = 2.5;
/// Voxels to which distances are kept.
const FAR: u8 = 10;
/// Probability that a ray goes through an unknown voxel in which nothing is foreseen.
const VEIL: f64 = 0.97;
/// Least chance of a ray to be still under way.
const LEAST_LEFT: f64 = 0.05;
/// Least worth of an element that is looked at, faces of a voxel.
const LEAST_WORTH: f64 = 0.02;
/// Voxels along its normal within which a surface does not hide itself.
const OWN: f64 = 1.3;
/// Least cosine that is reckoned with there.
const LEAST_COSINE: f64 = 0.3;
/// How far it is believed that a view that shows nothing in a voxel would have shown what is there.
const TRUST: f64 = 0.8;

/// What a candidate pose is expected to show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gain {
    /// Surface that nobody saw yet, m².
    pub unseen: f64,
    /// Surface that is known, of which the views so far missed a share, m².
    pub better: f64,
}

impl Gain {
    /// The sum by which candidates are compared, m².
    pub fn total(&self) -> f64 {
        self.unseen + self.better
    }
}

/// A piece of surface that is known or may be there, about as large as a voxel.
#[derive(Clone, Copy)]
pub(super) struct Element {
    /// World.
    pub point: Point3<f64>,
    /// World, out of the thing.
    pub normal: Vector3<f64>,
    /// Area that may still be won: times the chance that it is there, and that no view showed it, m².
    pub worth: f64,
    pub known: bool,
}

/// All surface of which more could be seen, and what may stand before it.
pub(super) struct Prospect<'a> {
    belief: &'a Belief,
    elements: Vec<Element>,
    /// Voxels to the nearest that is not free.
    clear: Vec<u8>,
    /// Probability that a ray goes through a voxel.
    through: Vec<f32>,
}

impl<'a> Prospect<'a> {
    pub fn new(belief: &'a Belief) -> Self {
        let through = |at: usize| match belief.state(at) {
            State::Free => 1.0,
            State::Unknown => VEIL as f32,
            State::Surface | State::Support => 0.0,
        };
        let mut prospect = Self {
            belief,
            elements: known(belief),
            clear: belief.distances(FAR, |state| state != State::Free),
            through: (0..belief.count()).map(through).collect(),
        };
        let foretold = prospect.foretell();
        prospect.frontiers(&foretold);
        let least = LEAST_WORTH * belief.voxel * belief.voxel;
        prospect.elements.retain(|e| e.worth > least);
        prospect
    }

    /// Adds what symmetry foresees; returns the voxels for which it speaks.
    fn foretell(&mut self) -> Vec<bool> {
        let belief = self.belief;
        let mut spoken = vec![false; belief.count()];
        for mut element in foresee(belief) {
            let place = belief.place(&element.point);
            let Some(at) = belief.at(place) else { continue };
            let chance = (element.worth / belief.area(&element.normal)).min(1.0);
            self.through[at] = self.through[at].min((1.0 - chance) as f32);
            spoken[at] = true;
            for next in beside(place).into_iter().filter_map(|n| belief.at(n)) {
                spoken[next] = true;
            }
            element.worth *= belief.missed(at);
            self.elements.push(element);
        }
        spoken
    }

    /// Adds the unknown voxels beside free ones, of which symmetry does not speak.
    fn frontiers(&mut self, spoken: &[bool]) {
        let belief = self.belief;
        let near = belief.distances(FAR, |state| state == State::Surface);
        for at in (0..belief.count()).filter(|at| belief.state(*at) == State::Unknown && !spoken[*at]) {
            let Some(normal) = outward(belief, at) else { continue };
            let away = f64::from(near[at].saturating_sub(1));
            let chance = FAR_CHANCE + (NEAR_CHANCE - FAR_CHANCE) * (-away / FALL).exp();
            self.elements.push(Element {
                point: belief.centre(belief.place_of(at)),
                normal,
                worth: chance * belief.area(&normal) * belief.missed(at),
                known: false,
            });
        }
    }

    /// The gain of looking with `camera` from `pose`.
    pub fn gain(&self, camera: &Camera, pose: &Pose) -> Gain {
        let mut gain = Gain::default();
        for element in &self.elements {
            let area = self.shown(camera, pose, element) * element.worth;
            if element.known {
                gain.better += area;
            } else {
                gain.unseen += area;
            }
        }
        gain
    }

    /// The unknown voxels that a view which was taken from `pose` should have shown, had there been surface, and with
    /// what probability.
    pub fn missed(&self, camera: &Camera, pose: &Pose) -> Vec<(usize, f64)> {
        let unknown = self.elements.iter().filter(|element| !element.known);
        unknown
            .filter_map(|element| {
                let at = self.belief.at(self.belief.place(&element.point))?;
                let shown = self.shown(camera, pose, element);
                (shown > LEAST_LEFT).then_some((at, TRUST * shown))
            })
            .collect()
    }

    /// Probability that a view from `pose` shows an element that is there.
    fn shown(&self, camera: &Camera, pose: &Pose, element: &Element) -> f64 {
        let eye = Point3::from(pose.translation.vector);
        let way = element.point - eye;
        let length = way.norm();
        let way = way / length;
        let cosine = -element.normal.dot(&way);
        let seen = pose.inverse_transform_point(&element.point);
        if cosine <= 0.0 || seen.z < camera.depth_min || seen.z > camera.depth_max {
            return 0.0;
        }
        let shows = shows(cosine, seen.z / camera.fx, self.belief.tolerance);
        let (u, v) = project(camera, seen.x / seen.z, seen.y / seen.z);
        let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
        if shows == 0.0 || u < 0.0 || v < 0.0 || u > right || v > bottom {
            return 0.0;
        }
        shows * self.left(&eye, &way, length - OWN * self.belief.voxel / cosine.max(LEAST_COSINE))
    }

    /// Probability that a ray goes as far as `length`.
    fn left(&self, eye: &Point3<f64>, way: &Vector3<f64>, length: f64) -> f64 {
        let belief = self.belief;
        let Some((from, to)) = belief.clip(eye, way) else {
            return 1.0;
        };
        let (end, step) = (to.min(length), 0.7 * belief.voxel);
        let (mut t, mut left, mut last) = (from, 1.0, usize::MAX);
        while t < end {
            let Some(at) = belief.at(belief.place(&(eye + way * t))) else {
                t += step;
                continue;
            };
            if self.clear[at] > 1 {
                // All voxels nearer than that are free.
                t += f64::from(self.clear[at] - 1) * belief.voxel;
                continue;
            }
            t += step;
            if at != last {
                last = at;
                left *= f64::from(self.through[at]);
            }
            if left < LEAST_LEFT {
                return 0.0;
            }
        }
        left
    }
}

/// The surface that was seen, both sides of it.
fn known(belief: &Belief) -> Vec<Element> {
    let surface = (0..belief.count()).filter(|at| belief.state(*at) == State::Surface);
    surface
        .flat_map(|at| belief.sides(at))
        .map(|(point, side)| Element {
            point,
            normal: side.normal(),
            worth: belief.area(&side.normal()) * (1.0 - side.shown()),
            known: true,
        })
        .collect()
}

/// The way out of a voxel into free space; none where there is none beside it.
fn outward(belief: &Belief, at: usize) -> Option<Vector3<f64>> {
    let place = belief.place_of(at);
    let mut out = Vector3::zeros();
    for next in beside(place) {
        if belief.at(next).is_some_and(|at| belief.state(at) == State::Free) {
            out += Vector3::from(std::array::from_fn::<f64, 3, _>(|a| (next[a] - place[a]) as f64));
        }
    }
    out.try_normalize(1e-9)
}
