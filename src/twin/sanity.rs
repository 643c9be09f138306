//! What every twin must satisfy, whoever made it.

use nalgebra::{Matrix3, Vector3};

use super::{Body, Joint, Link, Model, Relation, SUPPORT, Twin};
use crate::base::{Error, Estimate, Result, Value};

/// How far a unit vector may be from unit length.
const UNIT_TOLERANCE: f64 = 1e-6;

impl Twin {
    /// Checks that the twin makes sense: unit normals and axes, finite numbers, positive masses, inertias that
    /// a body can have, intervals that hold their value, probabilities in [0, 1], joints and relations between
    /// things that exist.
    ///
    /// # Errors
    /// [`Error::Failed`] with the place and what is wrong there.
    pub fn sanity_check(&self) -> Result<()> {
        finite("gravity", &self.gravity)?;
        if let Some(support) = &self.support {
            finite("support.point", &support.point)?;
            unit("support.normal", &support.normal)?;
            if let Some(gravity) = &support.gravity {
                finite("support.gravity", &gravity.value)?;
            }
        }
        self.names()?;
        for body in &self.bodies {
            body.sanity_check()?;
        }
        for joint in self.joints() {
            if let Some(coupling) = &joint.effects.coupling {
                let leader = self.joints().any(|j| j.name == coupling.leader && j.name != joint.name);
                require(leader, &joint.name, || {
                    format!("it follows {}, which is no other joint", coupling.leader)
                })?;
                finite(&format!("{}.coupling", joint.name), &[coupling.ratio.value])?;
            }
        }
        for (i, relation) in self.relations.iter().enumerate() {
            self.relation(&format!("relations[{i}]"), relation)?;
        }
        Ok(())
    }

    fn names(&self) -> Result<()> {
        let mut seen = std::collections::BTreeSet::new();
        for (body, link) in self.links() {
            let fresh = seen.insert(link.name.as_str());
            require(fresh, &body.name, || format!("link {} is there twice", link.name))?;
            let free = link.name != SUPPORT;
            require(free, &body.name, || format!("a link may not be called {SUPPORT}"))?;
        }
        Ok(())
    }

    fn relation(&self, place: &str, relation: &Relation) -> Result<()> {
        for end in [&relation.a, &relation.b] {
            require(self.knows(end), place, || {
                format!("{end} is neither a body, nor a link, nor {SUPPORT}")
            })?;
        }
        require(relation.a != relation.b, place, || {
            format!("{} is related to itself", relation.a)
        })?;
        let dof = relation.rotation_dof.max(relation.translation_dof);
        require(dof <= 3, place, || format!("{dof} degrees of freedom of one kind"))?;
        probability(place, relation.probability)?;
        optional(&format!("{place}.breakaway"), &relation.breakaway)
    }

    fn knows(&self, name: &str) -> bool {
        let link_of = |body: &str, link: &str| {
            let found = self.bodies.iter().find(|b| b.name == body);
            found.is_some_and(|b| b.links.iter().any(|l| l.name == link))
        };
        name == SUPPORT
            || self.link(name).is_some()
            || self.bodies.iter().any(|b| b.name == name)
            || name.split_once('/').is_some_and(|(body, link)| link_of(body, link))
    }
}

/// Shares of a surface lie between 0 and 1 and sum to 1.
fn shares(place: &str, shares: &super::SurfaceShares) -> Result<()> {
    let all = [shares.seen, shares.mirrored, shares.closed];
    let sound = all.iter().all(|s| (0.0..=1.0).contains(s)) && (all.iter().sum::<f64>() - 1.0).abs() < 1e-6;
    require(sound, place, || format!("shares {all:?} of a surface"))
}

impl Model {
    /// Checks that every mesh that a link names is there and holds triangles over vertices that exist.
    ///
    /// # Errors
    /// [`Error::Failed`] with the path and what is wrong.
    pub fn sanity_check(&self) -> Result<()> {
        for (_, link) in self.twin.links() {
            for path in link.mesh.iter().chain(&link.collision) {
                let mesh = self.meshes.get(path);
                let mesh = mesh.ok_or_else(|| Error::Failed(format!("{}: no mesh {path}", link.name)))?;
                require(!mesh.triangles.is_empty(), path, || "a mesh without triangles".into())?;
                let count = mesh.vertices.len();
                let sound = mesh.triangles.iter().flatten().all(|v| (*v as usize) < count);
                require(sound, path, || "a triangle over a vertex that is not there".into())?;
                let finite = mesh.vertices.iter().all(|v| v.coords.iter().all(|c| c.is_finite()));
                require(finite, path, || "a vertex that is not finite".into())?;
            }
        }
        Ok(())
    }
}

impl Body {
    fn sanity_check(&self) -> Result<()> {
        require(!self.links.is_empty(), &self.name, || "a body without links".into())?;
        for link in &self.links {
            link.sanity_check()?;
        }
        for joint in &self.joints {
            for end in [&joint.parent, &joint.child] {
                let there = self.links.iter().any(|l| &l.name == end);
                require(there, &joint.name, || format!("{end} is no link of body {}", self.name))?;
            }
            joint.sanity_check()?;
        }
        Ok(())
    }
}

impl Link {
    fn sanity_check(&self) -> Result<()> {
        let name = &self.name;
        finite(&format!("{name}.pose"), &self.pose.to_seven())?;
        let scalars = [
            ("mass", &self.mass),
            ("friction_force.static", &self.friction_force.static_),
            ("friction_force.kinetic", &self.friction_force.kinetic),
            ("friction.static", &self.friction.static_),
            ("friction.kinetic", &self.friction.kinetic),
            ("friction.rolling", &self.friction.rolling),
            ("friction.torsional_radius", &self.friction.torsional_radius),
            ("friction.creep_speed", &self.friction.creep_speed),
            ("friction.creep_ratio", &self.friction.creep_ratio),
            ("friction.tool", &self.friction.tool),
            ("restitution", &self.restitution),
            ("stiffness", &self.stiffness),
            ("damping", &self.damping),
        ];
        for (key, estimate) in scalars {
            let place = format!("{name}.{key}");
            optional(&place, estimate)?;
            let value = estimate.as_ref().map_or(0.0, |e| e.value);
            require(value >= 0.0, &place, || format!("{value} is negative"))?;
        }
        let mass = self.mass.as_ref().map_or(1.0, |m| m.value);
        require(mass > 0.0, &format!("{name}.mass"), || {
            format!("{mass} is not positive")
        })?;
        if let Some(surface) = &self.surface {
            shares(&format!("{name}.surface"), surface)?;
        }
        optional(&format!("{name}.com"), &self.com)?;
        optional(&format!("{name}.inertia"), &self.inertia)?;
        if let Some(inertia) = &self.inertia {
            physical(&format!("{name}.inertia"), &inertia.value)?;
        }
        for plane in &self.symmetry {
            unit(&format!("{name}.symmetry"), &plane.normal)?;
            probability(&format!("{name}.symmetry.score"), plane.score)?;
            finite(
                &format!("{name}.symmetry.normal_sd"),
                &plane.normal_sd.unwrap_or_default(),
            )?;
            finite(
                &format!("{name}.symmetry.offset_sd"),
                &[plane.offset_sd.unwrap_or_default()],
            )?;
        }
        for axis in &self.axes {
            unit(&format!("{name}.axes"), &axis.direction)?;
            probability(&format!("{name}.axes.score"), axis.score)?;
            finite(&format!("{name}.axes.point"), &axis.point)?;
        }
        if let Some(center) = &self.symmetry_center {
            finite(&format!("{name}.symmetry_center"), &center.point)?;
        }
        Ok(())
    }
}

impl Joint {
    fn sanity_check(&self) -> Result<()> {
        let name = &self.name;
        unit(&format!("{name}.axis"), &self.axis.value)?;
        optional(&format!("{name}.axis"), &Some(self.axis.clone()))?;
        optional(&format!("{name}.origin"), &Some(self.origin.clone()))?;
        optional(&format!("{name}.limits"), &self.limits)?;
        let range = self.limits.as_ref().map_or([0.0; 2], |l| l.value);
        require(range[0] <= range[1], &format!("{name}.limits"), || {
            format!("{range:?} run backwards")
        })?;
        let scalars = [
            ("pitch", &self.pitch),
            ("position", &self.position),
            ("friction", &self.friction),
            ("damping", &self.damping),
            ("stiffness", &self.stiffness),
            ("rest", &self.rest),
        ];
        for (key, estimate) in scalars {
            optional(&format!("{name}.{key}"), estimate)?;
        }
        probability(name, self.probability)?;
        self.alternatives
            .iter()
            .try_for_each(|a| probability(&format!("{name}.alternatives"), a.probability))
    }
}

/// A value whose components can be looked at one by one.
trait Components: Value {
    fn list(&self) -> Vec<f64>;
    fn pairs(interval: &Self::Interval) -> Vec<[f64; 2]>;
}

impl Components for f64 {
    fn list(&self) -> Vec<f64> {
        vec![*self]
    }
    fn pairs(interval: &[f64; 2]) -> Vec<[f64; 2]> {
        vec![*interval]
    }
}

impl<const N: usize> Components for [f64; N]
where
    [[f64; 2]; N]: serde::Serialize,
{
    fn list(&self) -> Vec<f64> {
        self.to_vec()
    }
    fn pairs(interval: &[[f64; 2]; N]) -> Vec<[f64; 2]> {
        interval.to_vec()
    }
}

fn optional<T: Components>(place: &str, estimate: &Option<Estimate<T>>) -> Result<()> {
    let Some(estimate) = estimate else { return Ok(()) };
    let value = estimate.value.list();
    finite(place, &value)?;
    if let Some(sd) = &estimate.sd {
        let sound = sd.list().iter().all(|s| *s >= 0.0 && s.is_finite());
        require(sound, place, || {
            "a standard deviation that is negative or not finite".into()
        })?;
    }
    for (v, [low, high]) in value.iter().zip(estimate.ci95.iter().flat_map(T::pairs)) {
        let slack = 1e-9 * v.abs().max(1e-9);
        let holds = low <= v + slack && v - slack <= high;
        require(holds, place, || {
            format!("the interval [{low}, {high}] does not hold the value {v}")
        })?;
    }
    Ok(())
}

fn require(holds: bool, place: &str, words: impl FnOnce() -> String) -> Result<()> {
    if holds {
        Ok(())
    } else {
        Err(Error::Failed(format!("{place}: {}", words())))
    }
}

fn finite(place: &str, values: &[f64]) -> Result<()> {
    require(values.iter().all(|v| v.is_finite()), place, || {
        format!("{values:?} is not finite")
    })
}

fn unit(place: &str, vector: &[f64; 3]) -> Result<()> {
    let length = Vector3::from(*vector).norm();
    require((length - 1.0).abs() < UNIT_TOLERANCE, place, || {
        format!("length {length}, not a unit vector")
    })
}

fn probability(place: &str, value: f64) -> Result<()> {
    require((0.0..=1.0).contains(&value), place, || {
        format!("{value} is no probability")
    })
}

/// Positive definite, and no principal moment greater than the other two together: the second moments of mass
/// are then positive too (Traversaro et al. 2016, eq. 9).
fn physical(place: &str, six: &[f64; 6]) -> Result<()> {
    let [xx, yy, zz, xy, xz, yz] = *six;
    let e = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).symmetric_eigenvalues();
    require(e.min() > 0.0, place, || {
        format!("principal moments {:?} are not all positive", e.as_slice())
    })?;
    let sound = 2.0 * e.max() <= e.sum() * (1.0 + 1e-6);
    require(sound, place, || {
        format!("principal moments {:?} break the triangle inequality", e.as_slice())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;
    use crate::twin::{Provenance, RelationKind};

    fn twin() -> Twin {
        let mut link = Link::new("tin", Pose::identity());
        link.mass = Some(Estimate::measured(0.3, 0.01, "kg", Vec::new(), "lift"));
        link.inertia = Some(Estimate::assumed(
            [1e-4; 6].map(|v: f64| v),
            [1e-5; 6],
            "kg·m²",
            "uniform",
        ));
        if let Some(e) = link.inertia.as_mut() {
            e.value = [1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0];
            e.ci95 = None;
        }
        Twin {
            format: super::super::FORMAT.into(),
            name: "t".into(),
            gravity: [0.0, 0.0, -9.80665],
            support: None,
            bodies: vec![Body::rigid(link)],
            relations: vec![Relation {
                a: SUPPORT.into(),
                b: "tin".into(),
                kind: RelationKind::Resting,
                rotation_dof: 3,
                translation_dof: 3,
                probability: 1.0,
                from: Vec::new(),
                breakaway: None,
            }],
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        }
    }

    #[test]
    fn a_sound_twin_passes_and_each_fault_is_named() {
        twin().sanity_check().expect("sound");
        type Damage = fn(&mut Twin);
        let faults: [(&str, Damage); 6] = [
            ("tin.mass", |t| {
                t.bodies[0].links[0].mass.as_mut().expect("mass").value = -1.0
            }),
            ("does not hold", |t| {
                t.bodies[0].links[0].mass.as_mut().expect("mass").ci95 = Some([0.5, 0.6])
            }),
            ("triangle", |t| {
                t.bodies[0].links[0].inertia.as_mut().expect("inertia").value[2] = 1.0
            }),
            ("neither a body", |t| t.relations[0].b = "ghost".into()),
            ("no probability", |t| t.relations[0].probability = 1.5),
            ("not finite", |t| t.gravity[0] = f64::NAN),
        ];
        for (words, damage) in faults {
            let mut bad = twin();
            damage(&mut bad);
            let error = bad.sanity_check().expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
