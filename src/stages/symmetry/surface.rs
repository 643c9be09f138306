//! The surface that votes, and the surface that it is compared with.

use nalgebra::{Matrix3, Point3, Vector3};

use super::lookup::Lookup;
use super::{Config, Evidence};
use crate::base::rng_for;
use crate::geometry::{Mesh, Nearest, SurfaceDistance, SurfaceSample, sample_triangles};

/// Points of the seen surface that are moved, and points of the whole one in the coarse table.
const SAMPLES: usize = 1400;
const TABLE: usize = 6000;
/// Weight of a foot closed at the support, and of other surface that nobody saw, while a motion is fitted.
const FOOT_WEIGHT: f64 = 0.5;
const UNSEEN_WEIGHT: f64 = 0.05;
/// A foot is this near to the plane that it stands on, m.
const FOOT_HEIGHT: f64 = 5e-4;
/// Patches of which the errors are taken to be independent of each other.
const PATCHES: usize = 48;

/// How much a triangle can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    Seen,
    /// Closed in the plane that it stands on.
    Foot,
    Unseen,
}

impl Trust {
    pub fn weight(self) -> f64 {
        match self {
            Self::Seen => 1.0,
            Self::Foot => FOOT_WEIGHT,
            Self::Unseen => UNSEEN_WEIGHT,
        }
    }
}

/// A mesh made ready; coordinates without a frame are from its middle.
pub(super) struct Surface<'a> {
    exact: SurfaceDistance,
    trust: Vec<Trust>,
    pub evidence: Evidence<'a>,
    /// Evenly spread over the seen surface, any number of the first ones too.
    pub samples: Vec<SurfaceSample>,
    /// Seeds of the patches.
    patches: Vec<Vector3<f64>>,
    pub table: Lookup,
    /// Centroid of the whole surface, m, frame of the mesh.
    pub middle: Point3<f64>,
    /// Diagonal of the box, m.
    pub diagonal: f64,
    /// Within this a moved point lies on the surface, m.
    pub tolerance: f64,
    /// Mean distance between samples, m.
    pub spacing: f64,
    /// Whether (nearly) all of it was seen.
    pub whole: bool,
    /// Share of the area that is neither seen nor a closed foot.
    pub hidden: f64,
}

impl<'a> Surface<'a> {
    /// Nothing for a mesh without area.
    pub fn new(mesh: &Mesh, evidence: &Evidence<'a>, config: &Config) -> Option<Self> {
        let exact = SurfaceDistance::new(mesh)?;
        let mut trust = trusts(mesh, evidence);
        if !trust.contains(&Trust::Seen) {
            trust = vec![Trust::Seen; trust.len()];
        }
        let mut rng = rng_for(config.seed, "symmetry");
        let mut all = sample_triangles(mesh, TABLE, &mut rng, |_| true);
        let mut samples = sample_triangles(mesh, SAMPLES, &mut rng, |t| trust[t] == Trust::Seen);
        if samples.is_empty() {
            return None;
        }
        let middle = all.iter().map(|s| s.point.coords).sum::<Vector3<f64>>() / all.len() as f64;
        let (low, high) = mesh.bounds()?;
        let diagonal = (high - low).norm();
        all.iter_mut().chain(&mut samples).for_each(|s| s.point -= middle);
        let area = mesh.area();
        let of = |kind: Trust| {
            let own = (0..trust.len()).filter(|t| trust[*t] == kind);
            own.map(|t| 0.5 * mesh.scaled_normal(t).norm()).sum::<f64>()
        };
        let (seen, hidden) = (of(Trust::Seen), of(Trust::Unseen) / area);
        shuffle(&mut samples);
        let weighted = all.into_iter().map(|s| (s, trust[s.triangle].weight())).collect();
        Some(Self {
            patches: spread_seeds(&samples),
            table: Lookup::new(weighted, diagonal, area),
            spacing: (seen / samples.len() as f64).sqrt(),
            whole: seen > 0.999 * area,
            hidden,
            tolerance: config.tolerance + config.relative_tolerance * diagonal + 2.0 * evidence.noise,
            middle: middle.into(),
            exact,
            trust,
            evidence: *evidence,
            samples,
            diagonal,
        })
    }

    /// The nearest point of the surface within a limit, in the frame of the mesh.
    pub fn nearest(&self, p: &Vector3<f64>, limit: f64) -> Option<Nearest> {
        self.exact.nearest_within(&(self.middle + p), limit)
    }

    /// Height of a point above the nearest surface, negative inside.
    pub fn signed(&self, p: &Vector3<f64>) -> f64 {
        self.exact.signed_or_guessed(&(self.middle + p))
    }

    pub fn trust(&self, triangle: usize) -> Trust {
        self.trust[triangle]
    }

    pub fn normal(&self, triangle: usize) -> Vector3<f64> {
        self.exact.normal(triangle)
    }

    /// The patch that a place belongs to.
    pub fn patch(&self, p: &Vector3<f64>) -> usize {
        let far = |i: &usize| (self.patches[*i] - p).norm_squared();
        (0..self.patches.len())
            .min_by(|a, b| far(a).total_cmp(&far(b)))
            .unwrap_or(0)
    }

    pub fn patches(&self) -> usize {
        self.patches.len()
    }

    /// Whether a place was seen to be empty, or is under what the thing stands on by more than `margin`.
    pub fn is_empty_at(&self, p: &Vector3<f64>, margin: f64) -> bool {
        let p = self.middle + p;
        self.evidence.floor.is_some_and(|f| f.height(&p) < -margin) || self.evidence.free.is_some_and(|f| f(&p))
    }

    /// Second moments of the table about the middle.
    pub fn moments(&self) -> Matrix3<f64> {
        let all = self.samples.iter().map(|s| s.point.coords);
        all.map(|p| p * p.transpose()).sum()
    }
}

fn trusts(mesh: &Mesh, evidence: &Evidence) -> Vec<Trust> {
    let height = |v: &u32| {
        let floor = evidence.floor?;
        Some(floor.height(&mesh.vertices[*v as usize]))
    };
    let seen = |v: &u32| {
        let clear = height(v).is_none_or(|h| h > evidence.blur);
        clear && mesh.seen.get(*v as usize).copied().unwrap_or(true)
    };
    let foot = |v: &u32| height(v).is_some_and(|h| h.abs() < FOOT_HEIGHT);
    let of = |t: &[u32; 3]| match () {
        () if t.iter().all(seen) => Trust::Seen,
        () if t.iter().all(foot) => Trust::Foot,
        () => Trust::Unseen,
    };
    mesh.triangles.iter().map(of).collect()
}

/// Samples far from each other, each the farthest from those before it.
fn spread_seeds(samples: &[SurfaceSample]) -> Vec<Vector3<f64>> {
    let mut far = vec![f64::INFINITY; samples.len()];
    let mut seeds = Vec::with_capacity(PATCHES);
    let mut next = 0;
    while seeds.len() < PATCHES.min(samples.len()) {
        let seed = samples[next].point.coords;
        seeds.push(seed);
        for (d, s) in far.iter_mut().zip(samples) {
            *d = d.min((s.point.coords - seed).norm_squared());
        }
        next = far
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map_or(0, |(i, _)| i);
    }
    seeds
}

/// Reorders points that follow the triangles, so that the first few are spread over the whole surface: index times a
/// number that shares no factor with the count runs through all of them in even strides.
fn shuffle(samples: &mut Vec<SurfaceSample>) {
    let count = samples.len();
    let stride = (count as f64 * 0.618_033_988_7) as usize;
    let coprime = (stride.max(1)..).find(|s| gcd(*s, count) == 1).unwrap_or(1);
    *samples = (0..count).map(|i| samples[i * coprime % count]).collect();
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
