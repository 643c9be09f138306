//! Surface that nobody saw yet, foreseen: what stands on a table mostly looks the same after half a turn about the plumb
//! line through its middle. It only guides the eye; no mesh is made of it.

use nalgebra::{Point3, Vector3};

use super::belief::{Belief, State, around};
use super::expect::Element;

/// Least voxels of a thing.
const LEAST: usize = 20;
/// Voxels to either side by which the middle may be off that of the box around what was seen.
const REACH: i64 = 4;
/// Spots by which a middle is judged.
const SAMPLE: usize = 400;
/// What a step from the middle of the box costs, squared, as a share of spots.
const ASIDE: f64 = 0.002;
/// Probability that a thing has the symmetry, where nothing speaks against it.
const SYMMETRIC: f64 = 0.8;
/// What a spot that comes to lie in free space weighs against one that agrees.
const AGAINST: f64 = 3.0;
/// Of a voxel and its neighbours, those that must be free that no surface is there, and unknown that one may be.
const ALL_FREE: usize = 20;
const SOME_UNKNOWN: usize = 3;

/// A spot of a surface that was seen, or its image.
struct Spot {
    point: Point3<f64>,
    normal: Vector3<f64>,
}

/// Whether the image of a spot lies where nobody looked, on surface that was seen, or in free space.
#[derive(Clone, Copy, PartialEq)]
enum Verdict {
    Open,
    Agrees,
    Refuted,
}

/// The images, where nobody looked, of what was seen of each thing.
pub(super) fn foresee(belief: &Belief) -> Vec<Element> {
    let mut out = Vec::new();
    for thing in things(belief) {
        let spots: Vec<Spot> = thing
            .iter()
            .flat_map(|at| belief.sides(*at))
            .map(|(point, side)| Spot {
                point,
                normal: side.normal(),
            })
            .collect();
        let Some((middle, sure)) = middle(belief, &spots) else {
            continue;
        };
        let images = spots.iter().map(|spot| spot.turned(middle));
        let open = images.filter(|image| image.verdict(belief) == Verdict::Open);
        out.extend(open.map(|image| Element {
            point: image.point,
            normal: image.normal,
            worth: sure * belief.area(&image.normal),
            known: false,
        }));
    }
    out
}

impl Spot {
    /// After half a turn about the plumb line through `middle`.
    fn turned(&self, middle: [f64; 2]) -> Self {
        let (p, n) = (&self.point, &self.normal);
        Self {
            point: Point3::new(2.0 * middle[0] - p.x, 2.0 * middle[1] - p.y, p.z),
            normal: Vector3::new(-n.x, -n.y, n.z),
        }
    }

    fn verdict(&self, belief: &Belief) -> Verdict {
        let place = belief.place(&self.point);
        let (mut unknown, mut free) = (0, 0);
        for n in 0..27 {
            let step = around(n);
            let Some(at) = belief.at(std::array::from_fn(|a| place[a] + step[a])) else {
                continue;
            };
            match belief.state(at) {
                State::Surface if belief.sides(at).any(|(_, s)| s.normal().dot(&self.normal) > 0.5) => {
                    return Verdict::Agrees;
                }
                State::Surface | State::Support => {}
                State::Unknown => unknown += 1,
                State::Free => free += 1,
            }
        }
        match belief.at(place).map(|at| belief.state(at)) {
            Some(State::Unknown) => Verdict::Open,
            Some(State::Free) if free > ALL_FREE => Verdict::Refuted,
            _ if unknown > SOME_UNKNOWN => Verdict::Open,
            _ => Verdict::Agrees,
        }
    }
}

/// The place about which half a turn contradicts least of what was seen, and the probability that its images are there.
fn middle(belief: &Belief, spots: &[Spot]) -> Option<([f64; 2], f64)> {
    let first = spots.first()?.point;
    let (low, high) = spots
        .iter()
        .fold((first, first), |(l, h), s| (l.inf(&s.point), h.sup(&s.point)));
    let guess = nalgebra::center(&low, &high);
    let step = (spots.len() / SAMPLE).max(1);
    let mut best: Option<(f64, [f64; 2], f64)> = None;
    for i in -REACH..=REACH {
        for j in -REACH..=REACH {
            let middle = [guess.x + i as f64 * belief.voxel, guess.y + j as f64 * belief.voxel];
            let (mut agrees, mut refuted, mut open) = (0.0, 0.0, 0.0);
            for spot in spots.iter().step_by(step) {
                match spot.turned(middle).verdict(belief) {
                    Verdict::Open => open += 1.0,
                    Verdict::Agrees => agrees += 1.0,
                    Verdict::Refuted => refuted += 1.0,
                }
            }
            let score = (agrees - 2.0 * refuted) / (agrees + refuted + open) - ASIDE * (i * i + j * j) as f64;
            if best.is_none_or(|(most, _, _)| score > most) {
                let speaks = agrees + 0.5 * open + 1.0;
                best = Some((score, middle, speaks / (speaks + AGAINST * refuted + 1.0)));
            }
        }
    }
    best.map(|(_, middle, sure)| (middle, SYMMETRIC * sure))
}

/// The surface voxels of things: those together that touch.
fn things(belief: &Belief) -> Vec<Vec<usize>> {
    let mut seen = vec![false; belief.count()];
    let mut out = Vec::new();
    for start in 0..seen.len() {
        if seen[start] || belief.state(start) != State::Surface {
            continue;
        }
        seen[start] = true;
        let mut thing = vec![start];
        let mut next = 0;
        while let Some(at) = thing.get(next).copied() {
            let place = belief.place_of(at);
            next += 1;
            for n in 0..27 {
                let step = around(n);
                let beside = belief.at(std::array::from_fn(|a| place[a] + step[a]));
                if let Some(at) = beside.filter(|at| !seen[*at] && belief.state(*at) == State::Surface) {
                    seen[at] = true;
                    thing.push(at);
                }
            }
        }
        if thing.len() >= LEAST {
            out.push(thing);
        }
    }
    out
}
