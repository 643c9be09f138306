//! Whether a motion leaves the shape as it is: the votes of the seen surface.

use nalgebra::{Matrix3, Vector3};

use super::Config;
use super::motion::Motion;
use super::surface::{Surface, Trust};
use crate::geometry::{SurfaceSample, UnionFind};

/// A moved point this many tolerances from the surface is off it.
const OFF: f64 = 2.0;
/// How deep inside a body, m, the views still tell that there is no surface: truncation of the distance field.
const KNOWN_DEPTH: f64 = 0.008;
/// Samples without an image this many spacings apart belong to one patch.
const TOGETHER: f64 = 1.8;
/// How far the mean of a patch may be off the surface on the average (root mean square), tolerances.
const MOST_BIAS: f64 = 0.125;
/// Share of the patches, the worst, that is left out of it.
const TRIMMED: f64 = 0.15;

/// What became of one moved point.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    /// On the surface, this far along its normal, m.
    Matched(f64),
    /// In space that is known to be empty or solid.
    Contradicted,
    /// Where nobody looked.
    Unknown,
}

/// The votes for a motion.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verdict {
    /// Share with an image, of what could have one.
    pub score: f64,
    /// Share of the seen surface with an image.
    pub support: f64,
    /// Share of the seen surface in the largest patch without one.
    pub flaw: f64,
    /// Root mean square of the mean misses of patches, m.
    pub bias: f64,
}

impl Verdict {
    /// Whether the motion is claimed.
    pub fn holds(&self, surface: &Surface, config: &Config) -> bool {
        self.score >= config.min_score
            && self.support >= config.min_support
            && self.flaw <= config.max_flaw
            && self.bias <= MOST_BIAS * surface.tolerance
    }
}

impl Surface<'_> {
    /// A quick look at the coarse table, 0 to 1: exp(-mean squared miss), less where little of it falls on surface
    /// that was seen.
    pub fn rough_score(&self, motion: &Motion, count: usize, width: f64) -> f64 {
        let score = |linear: &Matrix3<f64>| {
            let (mut cost, mut weight) = (0.0, 0.0);
            let samples = &self.samples[..count.min(self.samples.len())];
            for sample in samples {
                let place = motion.moved(linear, &sample.point.coords);
                let (miss, w) = match self.table.nearest(&place) {
                    Some((under, w)) => {
                        let miss = (self.table.distance(&place, under) / width).min(2.0);
                        match under.normal.dot(&(linear * sample.normal)) > 0.3 {
                            true => (miss, *w),
                            // The table may tell the other side of a thin wall.
                            false if miss < 1.0 => continue,
                            false => (2.0, *w),
                        }
                    }
                    None => (2.0, 1.0),
                };
                cost += w * miss * miss;
                weight += w;
            }
            (-cost / weight.max(1e-9)).exp() * (weight / samples.len() as f64 / 0.4).min(1.0)
        };
        let linears = motion.linears();
        linears.iter().map(score).sum::<f64>() / linears.len() as f64
    }

    /// All votes; of the turns of a group the worst decides.
    pub fn judged(&self, motion: &Motion) -> Verdict {
        let linears = motion.linears();
        let verdicts: Vec<Verdict> = linears.iter().map(|l| self.votes(motion, l)).collect();
        let said = |v: &&Verdict| v.support > 0.05;
        Verdict {
            score: verdicts.iter().filter(said).map(|v| v.score).fold(1.0, f64::min),
            support: verdicts.iter().map(|v| v.support).sum::<f64>() / verdicts.len() as f64,
            flaw: verdicts.iter().map(|v| v.flaw).fold(0.0, f64::max),
            bias: verdicts.iter().filter(said).map(|v| v.bias).fold(0.0, f64::max),
        }
    }

    fn votes(&self, motion: &Motion, linear: &Matrix3<f64>) -> Verdict {
        let mut sums = vec![(0.0, 0.0); self.patches()];
        let mut against = Vec::new();
        let (mut matched, mut contradicted) = (0.0, 0.0);
        for sample in &self.samples {
            match self.fate(motion, linear, sample) {
                Fate::Matched(residual) => {
                    matched += 1.0;
                    let sum = &mut sums[self.patch(&sample.point.coords)];
                    *sum = (sum.0 + residual, sum.1 + 1.0);
                }
                Fate::Contradicted => {
                    contradicted += 1.0;
                    against.push(sample.point.coords);
                }
                Fate::Unknown => {}
            }
        }
        let total = self.samples.len() as f64;
        Verdict {
            score: matched / f64::max(matched + contradicted, 1.0),
            support: matched / total,
            flaw: largest_patch(&against, TOGETHER * self.spacing) as f64 / total,
            bias: trimmed_rms(&sums),
        }
    }

    fn fate(&self, motion: &Motion, linear: &Matrix3<f64>, sample: &SurfaceSample) -> Fate {
        let place = motion.moved(linear, &sample.point.coords);
        let limit = OFF * self.tolerance;
        match self.nearest(&place, limit) {
            Some(near) => {
                let normal = self.normal(near.triangle);
                let alike = normal.dot(&(linear * sample.normal)) > 0.3 || near.distance < 0.5 * limit;
                match self.trust(near.triangle) {
                    Trust::Unseen if !self.whole => Fate::Unknown,
                    _ if alike => Fate::Matched(normal.dot(&(self.middle + place - near.point))),
                    _ => Fate::Contradicted,
                }
            }
            None => self.fate_off_surface(&place, limit),
        }
    }

    /// Off the surface: against the motion where the place is known to be empty, or known to be solid.
    fn fate_off_surface(&self, place: &Vector3<f64>, limit: f64) -> Fate {
        if self.whole || self.is_empty_at(place, limit) {
            return Fate::Contradicted;
        }
        let Some(near) = self.nearest(place, f64::MAX) else {
            return Fate::Unknown;
        };
        let over_seen = self.trust(near.triangle) == Trust::Seen;
        let outside = self.signed(place) > 0.0;
        let views_tell = self.evidence.free.is_some();
        match (over_seen, outside) {
            (false, _) => Fate::Unknown,
            // What the views did not call empty is hidden, unless there were none to ask.
            (true, true) if views_tell => Fate::Unknown,
            (true, true) => Fate::Contradicted,
            (true, false) if near.distance < KNOWN_DEPTH.max(limit) => Fate::Contradicted,
            (true, false) => Fate::Unknown,
        }
    }
}

/// Root mean square of the means of (sum, count) pairs, weighted by count, without the worst that hold `TRIMMED` of
/// the whole: at the rim of what was seen a fused surface errs more than elsewhere.
fn trimmed_rms(sums: &[(f64, f64)]) -> f64 {
    let mut means: Vec<(f64, f64)> = sums.iter().filter(|s| s.1 > 0.0).map(|s| (s.0 / s.1, s.1)).collect();
    means.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let kept = (1.0 - TRIMMED) * means.iter().map(|m| m.1).sum::<f64>();
    let (mut squares, mut count) = (0.0, 0.0);
    for (mean, n) in means {
        if count + 0.5 * n > kept {
            break;
        }
        squares += n * mean * mean;
        count += n;
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// Size of the largest set of points that hang together within `reach`.
fn largest_patch(points: &[Vector3<f64>], reach: f64) -> usize {
    let mut sets = UnionFind::new(points.len());
    for i in 0..points.len() {
        for j in 0..i {
            if (points[i] - points[j]).norm_squared() < reach * reach {
                sets.union(i as u32, j as u32);
            }
        }
    }
    let mut sizes = vec![0; points.len()];
    for i in 0..points.len() {
        sizes[sets.find(i as u32) as usize] += 1;
    }
    sizes.into_iter().max().unwrap_or(0)
}
