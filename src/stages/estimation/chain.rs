//! Jointed bodies on the support: which links bear on it, how hard each rubs, and what the joints resist.
//!
//! One push of one link feels the drag of all links and the friction of the joints only in sum; but which links
//! turn, slide or stay behind depends on each of them. So all pushes and pulls of a body are replayed with the
//! forward model of the physics room, once for every way in which the links can bear on the support or hang on
//! their parents, and the way that fits best is kept.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::chain_numbers::{RATIO, TOOL_SPEED, held_of};
use super::chain_trial::{Trial, misfit, trials_of};
use super::chain_write::write;
use crate::base::Notices;
use crate::capture::{Capture, Segmented};
use crate::geometry::mass_properties;
use crate::math::{Fit, Loss, Settings, levenberg_marquardt, levenberg_marquardt_exact};
use crate::physics::{outermost_torsional_radius, uniform_torsional_radius};
use crate::twin::{Body, JointKind, Link, Model};

/// Most links of a body that is fitted: the number of ways doubles with each.
const MOST_LINKS: usize = 4;
/// A way of bearing is believed where the next best costs this much more, nats: the law of friction below a link is not known so
/// well that less would do.
const CLEAR: f64 = 10.0;
/// The same against one in which a child weighs next to nothing.
const NEAR: f64 = 25.0;
/// The model of a thing that fits better than it claims to is held to what it shows, but no more than so far.
const FINEST: f64 = 0.4;
/// Creep below which nothing is to be told of it, m/s.
pub(super) const LEAST_CREEP: f64 = 5e-4;
/// Step of the logarithms by which slopes are taken.
const STEP: f64 = 0.05;
/// Misfit in units of what the model may miss, beyond which it is not the model of this body.
const FAR_OFF: f64 = 3.5;

/// A body with what is varied in it.
pub(super) struct Chain {
    /// Name of the body.
    pub body: String,
    pub root: String,
    /// Children in the order of the joints, with the log of mass over the root's mass by volume.
    pub children: Vec<(String, f64)>,
    /// Logs of the friction of each joint and of its damping as its own load has them, with their sds.
    pub joints: Vec<[(f64, f64); 2]>,
    /// Log of the friction force of all together, N.
    pub total: f64,
    /// Torsional radii of uniform pressure, m.
    pub radii: BTreeMap<String, f64>,
    /// The largest that a load below a link can have, m.
    pub outermost: BTreeMap<String, f64>,
}

/// What the friction below links that give way a little before they slide goes with.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Creep {
    /// Time, as of friction that is rounded off near rest: its parameter is a speed, m/s.
    Time,
    /// The way of the tool, as of links that rock on their corners while one of them slides: its parameter is a share.
    Way,
}

/// One way in which the children bear on the support, fitted.
#[derive(Clone)]
pub(super) struct Way {
    pub bears: Vec<bool>,
    pub creep: Creep,
    pub fit: Fit,
    /// Misfit in units of what the model may miss, 1 where it is as good as it claims.
    pub scale: f64,
}

/// Fits every jointed body that was pushed or pulled along the support; writes friction forces, the friction of the
/// joints and of the tool. Names the links that are found to hang free of the support.
pub(super) fn fit_chains(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    notices: &mut Notices,
) -> Vec<String> {
    let mut hang = Vec::new();
    let bodies: Vec<Body> = model.twin.bodies.clone();
    for body in bodies.iter().filter(|b| (2..=MOST_LINKS).contains(&b.links.len())) {
        let Some(chain) = Chain::of(body, model) else { continue };
        let trials = trials_of(capture, segmented, model, body);
        if trials.len() < 2 {
            continue;
        }
        let ways = chain.fitted(model, &trials);
        if let Some(best) = chain.chosen(&ways) {
            let rivals = chain.rivals(best, &ways);
            write(&chain, best, &rivals, &trials, model, notices);
            let decided = |k: &usize| !best.bears[*k] && !chain.light(best, *k) && rivals.iter().all(|w| !w.bears[*k]);
            let free = (0..chain.children.len()).filter(decided);
            hang.extend(free.map(|k| chain.children[k].0.clone()));
        }
    }
    hang
}

impl Chain {
    fn of(body: &Body, model: &Model) -> Option<Self> {
        let root = body.links.first()?;
        let kinds = body
            .joints
            .iter()
            .all(|j| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic));
        if !kinds || body.joints.len() + 1 != body.links.len() {
            return None;
        }
        let forces = body.links.iter().filter_map(|l| l.friction_force.kinetic.as_ref());
        let total: f64 = forces.map(|f| f.value).sum();
        let volume = |l: &Link| Some(mass_properties(model.meshes.get(l.mesh.as_ref()?)?)?.volume);
        let of_root = volume(root)?;
        let mut children = Vec::new();
        let mut joints = Vec::new();
        for joint in &body.joints {
            let child = body.links.iter().find(|l| l.name == joint.child)?;
            children.push((child.name.clone(), (volume(child)? / of_root).max(1e-3).ln()));
            joints.push(held_of(joint));
        }
        let (mut radii, mut outermost) = (BTreeMap::new(), BTreeMap::new());
        for link in &body.links {
            let mesh = model.meshes.get(link.mesh.as_ref()?)?;
            radii.insert(link.name.clone(), uniform_torsional_radius(mesh, &link.pose.0)?);
            outermost.insert(link.name.clone(), outermost_torsional_radius(mesh, &link.pose.0)?);
        }
        (total > 0.0).then(|| Self {
            body: body.name.clone(),
            root: root.name.clone(),
            children,
            joints,
            total: total.ln(),
            radii,
            outermost,
        })
    }

    /// Every way in which the children may bear on the support.
    fn ways(&self) -> Vec<Vec<bool>> {
        let n = self.children.len();
        (0..1usize << n)
            .map(|w| (0..n).map(|k| w >> k & 1 == 1).collect())
            .collect()
    }

    /// Every way, fitted, best first: in coarse steps from afar, then in full from there. What fits better than the model claims
    /// to is fitted as finely as the best of all.
    fn fitted(&self, model: &Model, trials: &[Trial]) -> Vec<Way> {
        let ways = self.ways().into_iter();
        let rough: Vec<Way> = ways
            .filter_map(|bears| self.fit((bears, Creep::Time), model, trials, 1.0, None))
            .collect();
        let best = rough.iter().map(|w| w.scale).fold(f64::INFINITY, f64::min);
        let fine = best.clamp(FINEST, 1.0);
        let finer =
            |w: &Way, creep: Creep, x: &DVector<f64>| self.fit((w.bears.clone(), creep), model, trials, fine, Some(x));
        let mut ways: Vec<Way> = rough.iter().filter_map(|w| finer(w, Creep::Time, &w.fit.x)).collect();
        // What a child that bears with next to nothing came to is a start for one that hangs.
        for k in 0..ways.len() {
            let Some((bears, x)) = self.hung_instead(&ways[k]) else {
                continue;
            };
            let better = self.fit((bears, Creep::Time), model, trials, fine, Some(&x));
            for way in ways.iter_mut() {
                if let Some(found) = better
                    .as_ref()
                    .filter(|b| b.bears == way.bears && b.fit.cost < way.fit.cost)
                {
                    way.clone_from(found);
                }
            }
        }
        let creeps = |w: &&Way| w.fit.x[self.creep_at()].exp() > LEAST_CREEP;
        let mut other: Vec<Way> = ways
            .iter()
            .filter(creeps)
            .filter_map(|w| {
                let mut x = w.fit.x.clone();
                x[self.creep_at()] -= TOOL_SPEED.ln();
                finer(w, Creep::Way, &x)
            })
            .collect();
        ways.append(&mut other);
        ways.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        ways
    }

    /// The way that fits best, `ways` best first; nothing where none does. One in which a child weighs next to nothing only where
    /// no other comes near: what hangs pulls the load to its side, and what bears with nothing hangs.
    fn chosen<'a>(&self, ways: &'a [Way]) -> Option<&'a Way> {
        let first = ways.first()?;
        let near = |w: &&Way| within(w, first, NEAR) && !self.weightless(w);
        let plainer = |w: &&Way| within(w, first, CLEAR) && !self.mimics(w);
        let best = ways.iter().find(near).or_else(|| ways.iter().find(plainer));
        best.filter(|w| w.scale < FAR_OFF)
    }

    /// The other ways that fit nearly as well.
    fn rivals<'a>(&self, best: &Way, ways: &'a [Way]) -> Vec<&'a Way> {
        let other =
            |w: &&Way| (&w.bears, w.creep) != (&best.bears, best.creep) && within(w, best, CLEAR) && !self.mimics(w);
        ways.iter().filter(other).collect()
    }

    /// A child that bears with next to nothing hangs: the way that says so is the plainer one, and no rival of it.
    fn mimics(&self, way: &Way) -> bool {
        (0..self.children.len()).any(|k| self.hardly_bears(way, k))
    }

    fn weightless(&self, way: &Way) -> bool {
        (0..self.children.len()).any(|k| self.light(way, k))
    }

    fn light(&self, way: &Way, k: usize) -> bool {
        way.fit.x[1 + k] < self.children[k].1 - 1.5 * RATIO
    }

    fn hardly_bears(&self, way: &Way, k: usize) -> bool {
        way.bears[k] && self.light(way, k)
    }

    /// The same with all that hardly bears hung up, and where to start from then; nothing where there is no such child.
    fn hung_instead(&self, way: &Way) -> Option<(Vec<bool>, DVector<f64>)> {
        let (mut bears, mut x) = (way.bears.clone(), way.fit.x.clone());
        for k in (0..self.children.len()).filter(|k| self.hardly_bears(way, *k)) {
            bears[k] = false;
            x[1 + k] = self.children[k].1;
        }
        (bears != way.bears).then_some((bears, x))
    }

    /// One way; `fine` is the share of what the model may miss that it is held to, `from` where to start: from nowhere in coarse
    /// steps.
    fn fit(
        &self,
        (bears, creep): (Vec<bool>, Creep),
        model: &Model,
        trials: &[Trial],
        fine: f64,
        from: Option<&DVector<f64>>,
    ) -> Option<Way> {
        let small = self.alone(model)?;
        let (mean, sd) = self.prior(creep);
        let residuals = |x: &DVector<f64>| {
            let mut trial_model = small.clone();
            self.apply(x, (&bears, creep), &mut trial_model);
            let mut out: Vec<f64> = (x - &mean).component_div(&sd).iter().copied().collect();
            let each: Vec<Vec<f64>> = trials
                .par_iter()
                .map(|t| misfit(&trial_model, t, from.is_none()))
                .collect();
            out.extend(each.into_iter().flatten().map(|r| r / fine));
            DVector::from_vec(out)
        };
        let settings = Settings {
            loss: Loss::Huber(2.0),
            iterations: 12,
            tolerance: 1e-3,
        };
        let steps = DVector::from_element(mean.len(), STEP);
        if let Some(from) = from {
            let fit = levenberg_marquardt(from, &steps, settings, residuals)?;
            return Some(Way::of(bears, creep, fit));
        }
        let fits = self.starts(&mean).into_iter().filter_map(|of_kind| {
            let sizes = of_kind.into_iter().map(|x| (residuals(&x).norm(), x));
            let (_, start) = sizes.min_by(|a, b| a.0.total_cmp(&b.0))?;
            levenberg_marquardt_exact(&start, settings, residuals, |x| forward(x, &residuals))
        });
        let fit = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(Way::of(bears, creep, fit))
    }

    /// A model of this body alone, without its meshes: the trials know them.
    fn alone(&self, model: &Model) -> Option<Model> {
        let mut twin = model.twin.clone();
        twin.bodies.retain(|b| b.name == self.body);
        twin.bodies.first()?;
        Some(Model {
            twin,
            meshes: BTreeMap::new(),
            textures: BTreeMap::new(),
        })
    }
}

impl Way {
    fn of(bears: Vec<bool>, creep: Creep, fit: Fit) -> Self {
        let scale = (2.0 * fit.cost / fit.residuals.len().max(1) as f64).sqrt();
        Self {
            bears,
            creep,
            fit,
            scale,
        }
    }
}

/// Slopes of residuals by steps to one side.
fn forward(x: &DVector<f64>, residuals: &(impl Fn(&DVector<f64>) -> DVector<f64> + Sync)) -> DMatrix<f64> {
    let here = residuals(x);
    let column = |j: usize| {
        let mut there = x.clone();
        there[j] += STEP;
        (residuals(&there) - &here) / STEP
    };
    let columns: Vec<DVector<f64>> = (0..x.len()).into_par_iter().map(column).collect();
    DMatrix::from_columns(&columns)
}

/// Whether a way fits nearly as well as another, to so many nats.
fn within(way: &Way, best: &Way, nats: f64) -> bool {
    way.fit.cost < best.fit.cost + nats * best.scale.powi(2).max(1.0)
}
