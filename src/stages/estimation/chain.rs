//! Jointed bodies on the support: which links bear on it, how hard each rubs, and what the joints resist.
//!
//! One push of one link feels the drag of all links and the friction of the joints only in sum; but which links
//! turn, slide or stay behind depends on each of them. So all pushes and pulls of a body are replayed with the
//! forward model of the physics room, once for every way in which the links can bear on the support or hang on
//! their parents, and the way that fits best is kept.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::chain_trial::{Trial, misfit, trials_of};
use super::pool::positive;
use crate::base::{Confounded, Estimate, Notices};
use crate::capture::{Capture, Segmented};
use crate::geometry::mass_properties;
use crate::math::{Fit, Loss, Settings, levenberg_marquardt};
use crate::physics::uniform_torsional_radius;
use crate::twin::{Body, FrictionForce, JointKind, Link, Model};

/// Most links of a body that is fitted: the number of ways doubles with each.
const MOST_LINKS: usize = 4;
/// Log-sd of a link's mass over the root's about what the volumes say.
const RATIO: f64 = 0.8;
/// Log-sd of a joint's friction about what its own load said.
const JOINT: f64 = 1.2;
/// Prior of the friction between finger and body: median and log-sd.
const TOOL: (f64, f64) = (0.35, 0.6);
/// Prior of the speed below which friction lets the links creep: median, m/s, and log-sd.
const CREEP: (f64, f64) = (1e-3, 2.0);
/// Log-sd of the torsional radii about those of linear pressure.
const RADIUS: f64 = 0.35;
/// A way of bearing is believed where the next best costs this much more, nats.
const CLEAR: f64 = 4.0;
/// Misfit in units of what the model may miss, beyond which it is not the model of this body.
const FAR_OFF: f64 = 3.5;

/// A body with what is varied in it.
pub(super) struct Chain {
    /// Name of the body.
    body: String,
    root: String,
    /// Children in the order of the joints, with the log of mass over the root's mass by volume.
    children: Vec<(String, f64)>,
    /// Log of the friction of each joint as its own load has it.
    joints: Vec<f64>,
    /// Log of the friction force of all together, N.
    total: f64,
    /// Torsional radii of uniform pressure, m.
    radii: BTreeMap<String, f64>,
}

/// One way in which the children bear on the support, fitted.
struct Way {
    bears: Vec<bool>,
    fit: Fit,
    /// Misfit in units of what the model may miss, 1 where it is as good as it claims.
    scale: f64,
}

/// Fits every jointed body that was pushed or pulled along the support; writes friction forces, the friction of the
/// joints and of the tool.
pub(super) fn fit_chains(capture: &Capture, segmented: &[Segmented], model: &mut Model, notices: &mut Notices) {
    let bodies: Vec<Body> = model.twin.bodies.clone();
    for body in bodies.iter().filter(|b| (2..=MOST_LINKS).contains(&b.links.len())) {
        let Some(chain) = Chain::of(body, model) else { continue };
        let trials = trials_of(capture, segmented, model, body);
        if trials.len() < 2 {
            continue;
        }
        let mut ways: Vec<Way> = chain
            .ways()
            .into_iter()
            .filter_map(|bears| chain.fit(bears, model, &trials))
            .collect();
        ways.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        if let Some(best) = chain.chosen(&ways) {
            chain.write(best, &trials, model, notices);
        }
    }
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
            joints.push(joint.friction.as_ref().map_or(0.01, |f| f.value.max(1e-3)).ln());
        }
        let mut radii = BTreeMap::new();
        for link in &body.links {
            let mesh = model.meshes.get(link.mesh.as_ref()?)?;
            radii.insert(link.name.clone(), uniform_torsional_radius(mesh, &link.pose.0)?);
        }
        (total > 0.0).then(|| Self {
            body: body.name.clone(),
            root: root.name.clone(),
            children,
            joints,
            total: total.ln(),
            radii,
        })
    }

    /// Every way in which the children may bear on the support.
    fn ways(&self) -> Vec<Vec<bool>> {
        let n = self.children.len();
        (0..1usize << n)
            .map(|w| (0..n).map(|k| w >> k & 1 == 1).collect())
            .collect()
    }

    /// The way that is believed, `ways` best first. A child that bears with next to nothing hangs: the way that says
    /// so is the plainer one, and no rival of it.
    fn chosen<'a>(&self, ways: &'a [Way]) -> Option<&'a Way> {
        let mimics = |w: &Way| {
            let light = |k: usize| w.fit.x[1 + k] < self.children[k].1 - 1.5 * RATIO;
            (0..self.children.len()).any(|k| w.bears[k] && light(k))
        };
        let first = ways.first()?;
        let allowance = CLEAR * first.scale.powi(2).max(1.0);
        let within = |w: &&Way| w.fit.cost < first.fit.cost + allowance;
        let mut rivals = ways.iter().filter(within).filter(|w| !mimics(w));
        let best = rivals.next()?;
        (rivals.next().is_none() && best.scale < FAR_OFF).then_some(best)
    }

    /// The parameters: logs of the total force, of the children's mass ratios, of the joints' frictions, of the
    /// creep, of the tool's friction and of the scale of the radii. Means and standard deviations of what is held of them before.
    fn prior(&self) -> (DVector<f64>, DVector<f64>) {
        let mut mean = vec![self.total];
        let mut sd = vec![0.7];
        mean.extend(self.children.iter().map(|c| c.1));
        sd.extend(self.children.iter().map(|_| RATIO));
        mean.extend(&self.joints);
        sd.extend(self.joints.iter().map(|_| JOINT));
        mean.extend([CREEP.0.ln(), TOOL.0.ln(), 0.0]);
        sd.extend([CREEP.1, TOOL.1, RADIUS]);
        (DVector::from_vec(mean), DVector::from_vec(sd))
    }

    fn fit(&self, bears: Vec<bool>, model: &Model, trials: &[Trial]) -> Option<Way> {
        let small = self.alone(model)?;
        let (mean, sd) = self.prior();
        let residuals = |x: &DVector<f64>| {
            let mut trial_model = small.clone();
            self.apply(x, &bears, &mut trial_model);
            let mut out: Vec<f64> = (x - &mean).component_div(&sd).iter().copied().collect();
            for trial in trials {
                out.extend(misfit(&trial_model, trial));
            }
            DVector::from_vec(out)
        };
        let settings = Settings {
            loss: Loss::Huber(2.0),
            iterations: 12,
            tolerance: 1e-3,
        };
        let starts = self.starts(&mean);
        let start = starts
            .into_iter()
            .min_by(|a, b| residuals(a).norm().total_cmp(&residuals(b).norm()))?;
        let fit = levenberg_marquardt(&start, &DVector::from_element(mean.len(), 0.05), settings, residuals)?;
        let scale = (2.0 * fit.cost / fit.residuals.len().max(1) as f64).sqrt();
        Some(Way { bears, fit, scale })
    }

    /// A finger that sticks has no slope towards one that slides, a joint that is stuck none towards one that turns.
    fn starts(&self, mean: &DVector<f64>) -> Vec<DVector<f64>> {
        let tool = mean.len() - 2;
        let first = 1 + self.children.len();
        let mut starts = Vec::new();
        for slip in [0.15f64, 0.3, 0.6] {
            for joint in [0.0, -1.0, -2.0] {
                let mut x = mean.clone();
                x[tool] = slip.ln();
                for k in 0..self.joints.len() {
                    x[first + k] += joint;
                }
                starts.push(x);
            }
        }
        starts
    }

    /// A model of this body alone.
    fn alone(&self, model: &Model) -> Option<Model> {
        let mut twin = model.twin.clone();
        twin.bodies.retain(|b| b.name == self.body);
        let links = &twin.bodies.first()?.links;
        let paths = links.iter().filter_map(|l| l.mesh.clone());
        let meshes = paths
            .filter_map(|p| Some((p.clone(), model.meshes.get(&p)?.clone())))
            .collect();
        Some(Model {
            twin,
            meshes,
            textures: BTreeMap::new(),
        })
    }

    /// Friction force of every link that bears, N, in the order of root and children.
    fn forces(&self, x: &DVector<f64>, bears: &[bool]) -> Vec<f64> {
        let ratios: Vec<f64> = (0..self.children.len()).map(|k| x[1 + k].exp()).collect();
        let all = 1.0 + ratios.iter().sum::<f64>();
        let borne = |k: usize| if bears[k] { ratios[k] } else { 0.0 };
        let own: Vec<f64> = (0..ratios.len()).map(|k| x[0].exp() * borne(k) / all).collect();
        std::iter::once(x[0].exp() - own.iter().sum::<f64>())
            .chain(own)
            .collect()
    }

    fn apply(&self, x: &DVector<f64>, bears: &[bool], model: &mut Model) {
        let forces = self.forces(x, bears);
        let root_mass = 1.0;
        let (creep, tool, scale) = (x[x.len() - 3].exp(), x[x.len() - 2].exp(), x[x.len() - 1].exp());
        let trial = |value: f64, unit: &str| Some(Estimate::assumed(value, 0.0, unit, "trial"));
        let names = std::iter::once(&self.root).chain(self.children.iter().map(|c| &c.0));
        for (i, name) in names.enumerate() {
            let Some(link) = model.twin.link_mut(name) else {
                continue;
            };
            let ratio = if i == 0 { 1.0 } else { x[i].exp() };
            link.mass = trial(root_mass * ratio, "kg");
            link.friction_force = FrictionForce {
                static_: None,
                kinetic: (forces[i] > 0.0).then(|| trial(forces[i], "N")).flatten(),
            };
            link.friction.creep_speed = trial(creep, "m/s");
            link.friction.tool = trial(tool, "1");
            link.friction.torsional_radius = trial(self.radii[name] * scale, "m");
        }
        for body in &mut model.twin.bodies {
            for (k, joint) in body.joints.iter_mut().enumerate() {
                joint.friction = trial(x[1 + self.children.len() + k].exp(), "");
            }
        }
    }

    fn write(&self, way: &Way, trials: &[Trial], model: &mut Model, notices: &mut Notices) {
        let from: Vec<String> = trials.iter().map(|t| t.interaction.name.clone()).collect();
        let forces = self.forces(&way.fit.x, &way.bears);
        let spread = |value: &dyn Fn(&DVector<f64>) -> f64| log_sd(value, &way.fit, way.scale.max(1.0));
        let names: Vec<String> = std::iter::once(self.root.clone())
            .chain(self.children.iter().map(|c| c.0.clone()))
            .collect();
        for (i, name) in names.iter().enumerate() {
            let sd = spread(&|x: &DVector<f64>| self.forces(x, &way.bears)[i].max(1e-9).ln());
            let Some(link) = model.twin.link_mut(name) else {
                continue;
            };
            if forces[i] <= 0.0 {
                link.friction_force = FrictionForce::default();
                (link.friction.static_, link.friction.kinetic) = (None, None);
                notices.note(
                    super::resolve::STAGE,
                    name,
                    "it hangs on its joint, free of the support: so the pushes have it",
                );
                continue;
            }
            let mut force = positive(
                forces[i],
                sd.hypot(0.01),
                "N",
                from.clone(),
                "replay of all pushes of the body",
            );
            if sd > 0.3 {
                force.status = crate::base::Status::Assumed;
                force.confounded = link.friction_force.kinetic.as_ref().and_then(|f| f.confounded.clone());
            }
            link.friction_force.kinetic = Some(force);
        }
        self.write_joints(way, &from, model);
        self.write_contact(way, &from, &names, model);
    }

    fn write_joints(&self, way: &Way, from: &[String], model: &mut Model) {
        let first = 1 + self.children.len();
        let Some(body) = model.twin.bodies.iter_mut().find(|b| b.name == self.body) else {
            return;
        };
        for (k, joint) in body.joints.iter_mut().enumerate() {
            let sd = way.fit.sd(first + k) * way.scale.max(1.0);
            let value = way.fit.x[first + k].exp();
            let unit = if joint.kind == JointKind::Revolute { "N·m" } else { "N" };
            let before = joint.friction.as_ref();
            // The joint's own load, felt free of any support, is the better word.
            if before.is_some_and(Estimate::is_measured) || joint.damping.is_some() {
                continue;
            }
            let mut friction = positive(value, sd, unit, from.to_vec(), "replay of all pushes of the body");
            // The replay knows no damping of joints: what there is of it is in the friction.
            let told = before.and_then(|f| f.confounded.clone()).filter(damping_only);
            let aliased = told.unwrap_or_else(|| Confounded {
                with: vec!["damping".into()],
                known: format!("friction + damping at the speed of the pushes = {value:.4} {unit}"),
                experiment: "move the joint at half and at twice the speed".into(),
            });
            if let Some([low, high]) = friction.ci95 {
                friction = friction.with_interval([0.3 * low, high]).with_confounded(aliased);
            }
            friction.status = crate::base::Status::Assumed;
            joint.friction = Some(friction);
        }
    }

    fn write_contact(&self, way: &Way, from: &[String], names: &[String], model: &mut Model) {
        let n = way.fit.x.len();
        let scale = way.scale.max(1.0);
        for name in names {
            let (tool_sd, radius_sd) = (way.fit.sd(n - 2) * scale, way.fit.sd(n - 1) * scale);
            let radius = self.radii[name] * way.fit.x[n - 1].exp();
            let stated = |value: f64, sd: f64, prior: f64, unit: &str| {
                let mut e = positive(
                    value,
                    sd.min(prior),
                    unit,
                    from.to_vec(),
                    "replay of all pushes of the body",
                );
                if sd > 0.5 * prior {
                    e.status = crate::base::Status::Assumed;
                }
                Some(e)
            };
            let creep = stated(way.fit.x[n - 3].exp(), way.fit.sd(n - 3) * scale, CREEP.1, "m/s");
            if let Some(link) = model.twin.link_mut(name) {
                link.friction.creep_speed = creep.filter(|c| c.is_measured() && c.value > 5e-4);
                link.friction.tool = stated(way.fit.x[n - 2].exp(), tool_sd, TOOL.1, "1");
                link.friction.torsional_radius = stated(radius, radius_sd, RADIUS, "m");
            }
        }
    }
}

fn damping_only(c: &Confounded) -> bool {
    c.with.iter().all(|w| w == "damping")
}

/// Standard deviation of a function of the parameters, by the delta method.
fn log_sd(value: &dyn Fn(&DVector<f64>) -> f64, fit: &Fit, scale: f64) -> f64 {
    let at = value(&fit.x);
    let slope = DMatrix::from_fn(1, fit.x.len(), |_, k| {
        let mut x = fit.x.clone();
        x[k] += 1e-4;
        (value(&x) - at) / 1e-4
    });
    let variance = &slope * &fit.covariance * slope.transpose();
    variance[(0, 0)].max(0.0).sqrt() * scale
}
