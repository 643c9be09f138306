//! The verb of the symmetry pass.

use nalgebra::{DMatrix, Vector3};

use super::judge::Verdict;
use super::motion::{Kind, Motion};
use super::surface::Surface;
use super::{Config, Evidence, candidates, family, state};
use crate::base::{Notices, Result};
use crate::geometry::{Mesh, simplify};
use crate::twin::Symmetry;

/// Triangles above which a mesh is simplified first: more say nothing more about symmetry.
const MOST_TRIANGLES: usize = 20_000;
/// Two motions of one kind within this sine and this share of the diagonal are one.
const SAME: (f64, f64) = (0.06, 0.05);
/// A rough motion within these of one that was refined ends there too.
const AGAIN: (f64, f64) = (0.035, 0.02);
/// More planes and axes than a cube has are of no use to anyone.
const MOST: usize = 13;

/// A motion that holds.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub motion: Motion,
    pub verdict: Verdict,
    /// Of its tilts and shifts.
    pub covariance: Option<DMatrix<f64>>,
}

/// What leaves the shape of `mesh` as it is: planes of reflection, axes of rotation, the centre of a ball, each best
/// first and with intervals; nothing for a shape that has none. `about` is what notices call it.
///
/// Only surface that was seen votes, and only where it falls on surface that was seen, on a closed foot, or where
/// `evidence` knows that there is none: the half that nobody saw neither helps nor hurts (Thrun & Wegbreit 2005).
/// Candidates (principal axes, even directions, voting pairs, slippage) are rated on a coarse table, refined by
/// iterated closest points, and judged by the share of votes and by the largest patch without an image.
///
/// # Errors
/// `Usage` for settings that cannot work.
pub fn detect(
    about: &str,
    mesh: &Mesh,
    evidence: &Evidence,
    config: &Config,
    notices: &mut Notices,
) -> Result<Symmetry> {
    config.check()?;
    let slim = (mesh.triangles.len() > MOST_TRIANGLES).then(|| simplify(mesh, 1e-4));
    let Some(surface) = Surface::new(slim.as_ref().unwrap_or(mesh), evidence, config) else {
        return Ok(Symmetry::default());
    };
    let lathes = lathes(&surface, config);
    if let Some(ball) = ball(&surface, &lathes, config) {
        notices.note(
            "symmetry",
            about,
            "it looks like a ball: three planes and axes stand for all through its centre",
        );
        return Ok(state::ball(&surface, &ball));
    }
    if let Some(axis) = lathes.into_iter().next() {
        notices.note(
            "symmetry",
            about,
            "it looks like turned on a lathe: two planes through its axis stand for all of them",
        );
        let across = across(&surface, &axis, config);
        return Ok(state::lathe(&surface, &axis, across.as_ref()));
    }
    let planes = planes(&surface, config);
    let axes = axes(&surface, &planes, config);
    Ok(state::plain(&surface, &planes, &axes, MOST))
}

impl Found {
    /// Refines in ever narrower widths; nothing where the votes are against it in the end.
    /// Motions that come out near one of `known` are left, since it has been found.
    fn from(surface: &Surface, rough: &Motion, known: &[Self], config: &Config) -> Option<Self> {
        let t = surface.tolerance;
        let wide = 0.05 * surface.diagonal;
        let motion = surface.roughly_refined(rough, 350, &[2.0 * wide, 1.5 * wide, wide, wide, 0.7 * wide]);
        let again = known
            .iter()
            .any(|k| k.motion.is_near(&motion, AGAIN.0, AGAIN.1 * surface.diagonal));
        if again || surface.rough_score(&motion, 250, 0.6 * wide) < 0.45 {
            return None;
        }
        let motion = surface.refined(&motion, 350, &[wide.max(4.0 * t), wide.max(4.0 * t), 4.0 * t, 3.0 * t]);
        let motion = surface.refined(&motion, usize::MAX, &[2.5 * t, 2.0 * t, 2.0 * t, 2.0 * t]);
        let verdict = surface.judged(&motion);
        verdict.holds(surface, config).then_some(Self {
            motion,
            verdict,
            covariance: None,
        })
    }

    /// With the covariance, which only those need that are told.
    fn measured(mut self, surface: &Surface) -> Self {
        self.covariance = surface.covariance(&self.motion);
        self
    }

    fn is_near(&self, other: &Motion, surface: &Surface) -> bool {
        self.motion.is_near(other, SAME.0, SAME.1 * surface.diagonal)
    }
}

fn lathes(surface: &Surface, config: &Config) -> Vec<Found> {
    let mut found: Vec<Found> = Vec::new();
    for rough in candidates::lathe_axes(surface) {
        let Some(new) = Found::from(surface, &rough, &found, config) else {
            continue;
        };
        if !found.iter().any(|f| f.is_near(&new.motion, surface)) {
            found.push(new);
        }
        if found.len() == 2 {
            break;
        }
    }
    let measured = found.into_iter().map(|f| f.measured(surface));
    let mut measured: Vec<Found> = measured.collect();
    measured.sort_by(|a, b| b.verdict.score.total_cmp(&a.verdict.score));
    measured
}

/// Two axes of the lathe make a ball.
fn ball(surface: &Surface, lathes: &[Found], config: &Config) -> Option<Found> {
    let [a, b] = lathes else { return None };
    let center = family::nearest_point(&a.motion, &b.motion);
    let rough = Motion::new(Kind::Ball, Vector3::z(), center);
    Found::from(surface, &rough, &[], config).map(|f| f.measured(surface))
}

/// The plane square to an axis, where there is one.
fn across(surface: &Surface, axis: &Found, config: &Config) -> Option<Found> {
    let direction = axis.motion.direction.into_inner();
    let mut tried = family::heights(surface, &direction);
    tried.insert(0, 0.0);
    let planes = tried
        .into_iter()
        .map(|h| Motion::new(Kind::Mirror, direction, direction * h));
    planes
        .filter_map(|rough| Found::from(surface, &rough, &[], config))
        .find(|f| f.motion.direction.cross(&direction).norm() < SAME.0)
        .map(|f| f.measured(surface))
}

fn planes(surface: &Surface, config: &Config) -> Vec<Found> {
    let mut found: Vec<Found> = Vec::new();
    for rough in candidates::planes(surface, config) {
        found.extend(Found::from(surface, &rough, &found, config));
    }
    family::one_per_direction(found, SAME.0)
        .into_iter()
        .map(|f| f.measured(surface))
        .collect()
}

fn axes(surface: &Surface, planes: &[Found], config: &Config) -> Vec<Found> {
    let mirrors: Vec<Motion> = planes.iter().map(|p| p.motion).collect();
    let mut found: Vec<Found> = Vec::new();
    for rough in candidates::fold_axes(surface, &mirrors, config) {
        if let Some(new) = Found::from(surface, &rough, &found, config) {
            found.push(new);
        }
    }
    family::highest_folds(found, surface, SAME)
        .into_iter()
        .map(|f| f.measured(surface))
        .collect()
}
