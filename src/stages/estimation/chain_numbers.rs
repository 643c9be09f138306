//! The numbers of a chain: what is held of them before its touches, where fits start, and how they are put into a model.

use nalgebra::DVector;

use super::chain::{Chain, Creep};
use super::pool::relative_sd;
use crate::base::Estimate;
use crate::twin::{FrictionForce, Joint, Model};

/// Log-sd of a link's mass over the root's about what the volumes say.
pub(super) const RATIO: f64 = 0.8;
/// Log-sd of a joint's friction about what its own load said, where that was not measured.
const JOINT: f64 = 1.2;
/// Prior of what resists a joint in proportion to its speed, beside its friction where it moves as fast as it did: median and log-sd.
const DAMPING: (f64, f64) = (0.1, 1.5);
/// Prior of the friction between finger and body: median and log-sd.
pub(super) const TOOL: (f64, f64) = (0.35, 0.6);
/// Prior of the speed below which friction lets the links creep: median, m/s, and log-sd.
pub(super) const CREEP: (f64, f64) = (1e-3, 2.0);
/// Speed of a tool at which the two laws of creep say the same before anything is seen, m/s.
pub(super) const TOOL_SPEED: f64 = 0.05;
/// Log-sd of the torsional radii about those of linear pressure.
pub(super) const RADIUS: f64 = 0.35;

impl Chain {
    /// Place of the creep among the parameters.
    pub fn creep_at(&self) -> usize {
        1 + self.children.len() + 2 * self.joints.len()
    }

    /// The parameters: logs of the total force, of the children's mass ratios, of the joints' frictions, of their damping, of the
    /// creep, of the tool's friction and of the scale of the radii. Means and standard deviations of what is held of them before.
    pub fn prior(&self, creep: Creep) -> (DVector<f64>, DVector<f64>) {
        let mut mean = vec![self.total];
        let mut sd = vec![0.7];
        mean.extend(self.children.iter().map(|c| c.1));
        sd.extend(self.children.iter().map(|_| RATIO));
        for k in 0..2 {
            mean.extend(self.joints.iter().map(|j| j[k].0));
            sd.extend(self.joints.iter().map(|j| j[k].1));
        }
        let speed = match creep {
            Creep::Time => 1.0,
            Creep::Way => TOOL_SPEED,
        };
        mean.extend([(CREEP.0 / speed).ln(), TOOL.0.ln(), 0.0]);
        sd.extend([CREEP.1, TOOL.1, RADIUS]);
        (DVector::from_vec(mean), DVector::from_vec(sd))
    }

    /// A finger that sticks has no slope towards one that slides, a joint that is stuck none towards one that turns; a plate on its
    /// corners goes another way than one that presses evenly.
    pub fn starts(&self, mean: &DVector<f64>) -> Vec<Vec<DVector<f64>>> {
        let tool = mean.len() - 2;
        let first = 1 + self.children.len();
        let of = |out: f64| {
            let mut starts = Vec::new();
            for slip in [0.15f64, 0.3, 0.6] {
                for joint in [0.0, -1.0, -2.0] {
                    let mut x = mean.clone();
                    x[tool] = slip.ln();
                    x[tool + 1] = out;
                    for k in 0..self.joints.len() {
                        x[first + k] += joint;
                    }
                    starts.push(x);
                }
            }
            starts
        };
        vec![of(0.0), of(0.3)]
    }

    /// Friction force of every link that bears, N, in the order of root and children.
    pub fn forces(&self, x: &DVector<f64>, bears: &[bool]) -> Vec<f64> {
        let ratios: Vec<f64> = (0..self.children.len()).map(|k| x[1 + k].exp()).collect();
        let all = 1.0 + ratios.iter().sum::<f64>();
        let borne = |k: usize| if bears[k] { ratios[k] } else { 0.0 };
        let own: Vec<f64> = (0..ratios.len()).map(|k| x[0].exp() * borne(k) / all).collect();
        std::iter::once(x[0].exp() - own.iter().sum::<f64>())
            .chain(own)
            .collect()
    }

    pub fn apply(&self, x: &DVector<f64>, (bears, law): (&[bool], Creep), model: &mut Model) {
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
            (link.friction.creep_speed, link.friction.creep_ratio) = match law {
                Creep::Time => (trial(creep, "m/s"), None),
                Creep::Way => (None, trial(creep, "1")),
            };
            link.friction.tool = trial(tool, "1");
            link.friction.torsional_radius = trial(self.radii[name] * scale, "m");
        }
        for body in &mut model.twin.bodies {
            for (k, joint) in body.joints.iter_mut().enumerate() {
                let first = 1 + self.children.len() + k;
                joint.friction = trial(x[first].exp(), "");
                joint.damping = trial(x[first + self.joints.len()].exp(), "");
            }
        }
    }
}

/// What is held of the friction and the damping of a joint before its body is replayed: means and sds of their logarithms.
pub(super) fn held_of(joint: &Joint) -> [(f64, f64); 2] {
    let measured = |e: &Option<Estimate>| {
        let e = e.as_ref().filter(|e| e.is_measured() && e.value > 0.0)?;
        Some((e.value.ln(), relative_sd(e).clamp(0.02, JOINT)))
    };
    let seen = joint.friction.as_ref().map_or(0.01, |f| f.value.max(1e-3));
    let friction = measured(&joint.friction).unwrap_or((seen.ln(), JOINT));
    // It goes there and back, about a second each.
    let speed = joint.travelled.map_or(0.3, |[a, b]| 0.5 * (b - a).abs()).max(1e-3);
    let damping = measured(&joint.damping).unwrap_or(((DAMPING.0 * seen / speed).ln(), DAMPING.1));
    [friction, damping]
}
