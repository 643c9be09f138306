//! The state of a jointed body that a filter can carry: shapes and graph, which stay, and a vector of what moves and
//! what is to be learnt.
//!
//! Poses and twists of the root, positions and rates of the joints, masses, centres of mass, frictions with the support,
//! the tool and the neighbour (the state of visuo-tactile filters of articulated objects, there in the plane, here in
//! SE(3)). The vector is a chart about a reference state: `retract` and `local` are its box-plus and box-minus (Hertzberg,
//! Wagner, Frese and Schröder 2013), so that the reference itself is the zero vector and rotations need no constraint.
//! Positive numbers are packed as logarithms of their ratio to the reference.

use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};

use super::{Body, JointKind, Superquadric};
use crate::base::Pose;

/// One link: what stays of it, and what is learnt of it. What the twin does not know is absent here too, and takes no
/// place in the vector.
#[derive(Clone, Debug)]
pub struct LinkState {
    /// Its name in the twin.
    pub name: String,
    /// Its shape, link frame.
    pub superquadric: Option<Superquadric>,
    /// kg.
    pub mass: Option<f64>,
    /// Centre of mass, m, link frame.
    pub com: Option<[f64; 3]>,
    /// Kinetic friction with the support, 1.
    pub support_friction: Option<f64>,
    /// Friction with the tool, 1.
    pub tool_friction: Option<f64>,
}

/// One arc of the graph: a joint with its positions and rates.
#[derive(Clone, Debug)]
pub struct ArcState {
    /// Index of the parent's link.
    pub parent: usize,
    /// Index of the child's link.
    pub child: usize,
    /// Its kind; how many coordinates it has follows from it.
    pub kind: JointKind,
    /// Unit axis, world at the first view.
    pub axis: [f64; 3],
    /// A point of the axis, m, world at the first view.
    pub origin: [f64; 3],
    /// Joint coordinates, rad or m, 0 at the first view.
    pub position: Vec<f64>,
    /// Their rates, rad/s or m/s.
    pub rate: Vec<f64>,
    /// Coulomb friction with the neighbour, N·m or N.
    pub friction: Option<f64>,
}

/// The state of a body of links.
#[derive(Clone, Debug)]
pub struct BodyState {
    /// World-from-root.
    pub root: Pose,
    /// Velocity of the root's origin, m/s, and angular velocity, rad/s, both in world axes.
    pub twist: [f64; 6],
    /// The links, the root first.
    pub links: Vec<LinkState>,
    /// The joints, in the order of the body's.
    pub arcs: Vec<ArcState>,
}

/// Coordinates that a kind of joint has.
fn coordinates(kind: JointKind) -> usize {
    match kind {
        JointKind::Fixed => 0,
        JointKind::Revolute | JointKind::Prismatic | JointKind::Screw => 1,
        JointKind::Cylindrical => 2,
        JointKind::Planar | JointKind::Spherical => 3,
    }
}

impl BodyState {
    /// The body at rest at the first view; `None` where a joint names a link that the body lacks.
    pub fn at_rest(body: &Body) -> Option<Self> {
        let index = |name: &str| body.links.iter().position(|l| l.name == name);
        let arcs: Option<Vec<ArcState>> = body
            .joints
            .iter()
            .map(|j| {
                let n = coordinates(j.kind);
                Some(ArcState {
                    parent: index(&j.parent)?,
                    child: index(&j.child)?,
                    kind: j.kind,
                    axis: j.axis.value,
                    origin: j.origin.value,
                    position: vec![0.0; n],
                    rate: vec![0.0; n],
                    friction: j.friction.as_ref().map(|e| e.value).filter(|v| *v > 0.0),
                })
            })
            .collect();
        let positive = |e: &Option<crate::base::Estimate>| e.as_ref().map(|e| e.value).filter(|v| *v > 0.0);
        let links = body.links.iter().map(|l| LinkState {
            name: l.name.clone(),
            superquadric: l.superquadric.clone(),
            mass: positive(&l.mass),
            com: l.com.as_ref().map(|c| c.value),
            support_friction: positive(&l.friction.kinetic),
            tool_friction: positive(&l.friction.tool),
        });
        Some(Self {
            root: body.links.first()?.pose,
            twist: [0.0; 6],
            links: links.collect(),
            arcs: arcs?,
        })
    }

    /// Length of the vector.
    pub fn dimension(&self) -> usize {
        let links = self.links.iter().map(|l| {
            let single = [l.mass, l.support_friction, l.tool_friction].iter().flatten().count();
            single + if l.com.is_some() { 3 } else { 0 }
        });
        let arcs = self
            .arcs
            .iter()
            .map(|a| 2 * a.position.len() + usize::from(a.friction.is_some()));
        12 + links.sum::<usize>() + arcs.sum::<usize>()
    }

    /// What each component of the vector is, in its order.
    pub fn labels(&self) -> Vec<String> {
        let mut out: Vec<String> = ["x", "y", "z", "rx", "ry", "rz", "vx", "vy", "vz", "wx", "wy", "wz"]
            .map(|k| format!("root {k}"))
            .into();
        for arc in &self.arcs {
            let name = &self.links[arc.child].name;
            for k in 0..arc.position.len() {
                out.push(format!("{name} position {k}"));
                out.push(format!("{name} rate {k}"));
            }
            out.extend(arc.friction.map(|_| format!("{name} log joint friction")));
        }
        for link in &self.links {
            let name = &link.name;
            out.extend(link.mass.map(|_| format!("{name} log mass")));
            out.extend(
                link.com
                    .into_iter()
                    .flat_map(|_| ["x", "y", "z"].map(|k| format!("{name} com {k}"))),
            );
            out.extend(link.support_friction.map(|_| format!("{name} log support friction")));
            out.extend(link.tool_friction.map(|_| format!("{name} log tool friction")));
        }
        out
    }

    /// The state at `step` from this one, in the order of [`Self::labels`]; `None` where the length is another.
    pub fn retract(&self, step: &DVector<f64>) -> Option<Self> {
        if step.len() != self.dimension() {
            return None;
        }
        let mut left = step.iter().copied();
        let mut take = move || left.next().unwrap_or(0.0);
        let mut out = self.clone();
        let shift = Vector3::from_fn(|_, _| take());
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| take()));
        let moved = self.root.0.translation.vector + shift;
        out.root = Pose(Isometry3::from_parts(moved.into(), turn * self.root.0.rotation));
        out.twist.iter_mut().for_each(|v| *v += take());
        for arc in &mut out.arcs {
            for (position, rate) in arc.position.iter_mut().zip(&mut arc.rate) {
                *position += take();
                *rate += take();
            }
            arc.friction.iter_mut().for_each(|f| *f *= take().exp());
        }
        for link in &mut out.links {
            link.mass.iter_mut().for_each(|m| *m *= take().exp());
            link.com.iter_mut().flatten().for_each(|c| *c += take());
            link.support_friction.iter_mut().for_each(|f| *f *= take().exp());
            link.tool_friction.iter_mut().for_each(|f| *f *= take().exp());
        }
        Some(out)
    }

    /// The step from this state to another of the same body: `retract` undone. `None` where the two do not hold the same
    /// quantities.
    pub fn local(&self, other: &Self) -> Option<DVector<f64>> {
        if self.labels() != other.labels() {
            return None;
        }
        let mut out: Vec<f64> = Vec::with_capacity(self.dimension());
        out.extend((other.root.0.translation.vector - self.root.0.translation.vector).iter());
        out.extend(
            (other.root.0.rotation * self.root.0.rotation.inverse())
                .scaled_axis()
                .iter(),
        );
        out.extend(self.twist.iter().zip(&other.twist).map(|(a, b)| b - a));
        let log = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| (b / a).ln());
        for (a, b) in self.arcs.iter().zip(&other.arcs) {
            for k in 0..a.position.len() {
                out.extend([b.position[k] - a.position[k], b.rate[k] - a.rate[k]]);
            }
            out.extend(log(a.friction, b.friction));
        }
        for (a, b) in self.links.iter().zip(&other.links) {
            out.extend(log(a.mass, b.mass));
            if let (Some(from), Some(to)) = (a.com, b.com) {
                out.extend((0..3).map(|k| to[k] - from[k]));
            }
            out.extend(log(a.support_friction, b.support_friction));
            out.extend(log(a.tool_friction, b.tool_friction));
        }
        Some(DVector::from_vec(out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Estimate, Seed, rng_for};
    use crate::twin::{Joint, Link};
    use rand::Rng;

    fn joint(kind: JointKind, parent: &str, child: &str, friction: Option<f64>) -> Joint {
        let point = |v: [f64; 3], unit: &str| Estimate::known(v, None, unit);
        Joint {
            name: format!("{parent}_{child}"),
            kind,
            parent: parent.into(),
            child: child.into(),
            probability: 0.99,
            alternatives: Vec::new(),
            axis: point([0.0, 0.0, 1.0], "1"),
            origin: point([0.1, 0.0, 0.0], "m"),
            pitch: None,
            limits: None,
            travelled: None,
            position: None,
            friction: friction.map(|f| Estimate::known(f, None, "N·m")),
            damping: None,
            stiffness: None,
            rest: None,
            effort: None,
            effects: crate::twin::JointEffects::default(),
            lateral: None,
        }
    }

    fn body() -> Body {
        let mut links = ["post", "arm", "lid"].map(|n| Link::new(n, Pose::identity()));
        links[0].mass = Some(Estimate::known(0.4, None, "kg"));
        links[1].com = Some(Estimate::known([0.01, 0.0, -0.02], None, "m"));
        links[1].friction.kinetic = Some(Estimate::known(0.3, None, "1"));
        links[2].friction.tool = Some(Estimate::known(0.5, None, "1"));
        Body {
            name: "post".into(),
            links: links.into(),
            joints: vec![
                joint(JointKind::Revolute, "post", "arm", Some(0.02)),
                joint(JointKind::Spherical, "arm", "lid", None),
            ],
        }
    }

    #[test]
    fn what_is_packed_comes_back() {
        let reference = BodyState::at_rest(&body()).expect("a state");
        assert_eq!(reference.labels().len(), reference.dimension());
        assert_eq!(reference.dimension(), 12 + 2 + 1 + 6 + 1 + 3 + 1 + 1);
        let mut dice = rng_for(Seed(4), "state");
        for _ in 0..100 {
            let step = DVector::from_fn(reference.dimension(), |_, _| dice.random_range(-0.8..0.8));
            let moved = reference.retract(&step).expect("a state");
            let back = reference.local(&moved).expect("a step");
            assert!((&back - &step).amax() < 1e-12, "{back} {step}");
            let again = reference.retract(&back).expect("a state");
            assert!(moved.local(&again).expect("a step").amax() < 1e-12);
        }
        let still = reference.local(&reference).expect("a step");
        assert_eq!(still.amax(), 0.0);
    }

    #[test]
    fn what_is_not_known_takes_no_place() {
        let known = BodyState::at_rest(&body()).expect("a state");
        let mut bare = body();
        bare.links[0].mass = None;
        let bare = BodyState::at_rest(&bare).expect("a state");
        assert_eq!(bare.dimension() + 1, known.dimension());
        assert!(known.local(&bare).is_none());
        assert!(known.retract(&DVector::zeros(3)).is_none());
        let mut broken = body();
        broken.joints[0].child = "nobody".into();
        assert!(BodyState::at_rest(&broken).is_none());
    }
}
