//! Reads the SDFormat back and works out where everything is.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Rotation3, Translation3, Vector3};

use super::inertial::tensor;
use super::loaded::{Axis, Loaded, Skin, Solid};
use super::xml::{Element, parse};
use crate::base::{Error, Result};

/// The content of `text`, as [`super::sdf`] writes it: every pose is in the world, but for the table's.
pub(super) fn load(file: &Path, text: &str) -> Result<Loaded> {
    let root = parse(file, text)?;
    let reader = Sdf { file };
    let mut out = Loaded::default();
    let world = reader.child(&root, "world")?;
    for model in world.children("model").filter(|m| m.child("static").is_none()) {
        reader.model(model, &mut out)?;
    }
    Ok(out)
}

struct Sdf<'a> {
    file: &'a Path,
}

impl Sdf<'_> {
    fn model(&self, model: &Element, out: &mut Loaded) -> Result<()> {
        let mut places = BTreeMap::new();
        for link in model.children("link") {
            let name = self.name(link)?;
            let world = self.pose(link)?;
            let inertial = self.child(link, "inertial")?;
            let frame = world * self.pose(inertial)?;
            let inertia = self.child(inertial, "inertia")?;
            let mut six = [0.0; 6];
            for (slot, key) in six.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
                [*slot] = self.numbers(self.child(inertia, key)?)?;
            }
            let [mass] = self.numbers(self.child(inertial, "mass")?)?;
            let mut solid = Solid::new(mass, Vector3::zeros(), &tensor(&six), &frame);
            solid.rotation = world.rotation;
            out.parts.insert(name.clone(), solid);
            let surface = link.child("collision").and_then(|c| c.child("surface"));
            let mu = surface.and_then(|s| s.child("friction")?.child("ode")?.child("mu"));
            if let Some(mu) = mu {
                let bounce = surface.and_then(|s| s.child("bounce")?.child("restitution_coefficient"));
                let skin = Skin {
                    kinetic_friction: Some(self.numbers::<1>(mu)?[0]),
                    restitution: bounce.map(|b| self.numbers(b).map(|[r]| r)).transpose()?,
                    ..Skin::default()
                };
                out.skins.insert(name.clone(), skin);
            }
            places.insert(name, world);
            let shapes = link.children("visual").chain(link.children("collision"));
            for mesh in shapes.filter_map(|s| s.child("geometry")?.child("mesh")) {
                out.files.push(self.child(mesh, "uri")?.text().to_string());
            }
            let materials = link.children("visual").filter_map(|v| v.child("material"));
            let images = materials.filter_map(|m| m.child("pbr")?.child("metal")?.child("albedo_map"));
            out.files.extend(images.map(|i| i.text().to_string()));
        }
        for joint in model.children("joint").filter(|j| j.child("axis").is_some()) {
            let axis = self.axis(joint, &places)?;
            out.axes.insert(self.name(joint)?, axis);
        }
        Ok(())
    }

    fn axis(&self, joint: &Element, places: &BTreeMap<String, Isometry3<f64>>) -> Result<Axis> {
        let child = self.child(joint, "child")?.text();
        let world = places
            .get(child)
            .ok_or_else(|| Error::bad_input(self.file, "joint.child", child, "a link of the model"))?;
        let axis = self.child(joint, "axis")?;
        let dynamics = self.child(axis, "dynamics")?;
        let limit = self.child(axis, "limit")?;
        let one = |of: &Element, key: &str| -> Result<Option<f64>> {
            of.child(key).map(|e| self.numbers(e).map(|[v]| v)).transpose()
        };
        let ends = [
            one(limit, "lower")?.unwrap_or(-1e16),
            one(limit, "upper")?.unwrap_or(1e16),
        ];
        Ok(Axis {
            turns: joint.get("type") != Some("prismatic"),
            direction: world * Vector3::from(self.numbers::<3>(self.child(axis, "xyz")?)?),
            origin: world.translation.vector,
            range: (ends[0] > -1e15 && ends[1] < 1e15).then_some(ends),
            damping: one(dynamics, "damping")?,
            friction: one(dynamics, "friction")?,
            stiffness: Some(one(dynamics, "spring_stiffness")?.unwrap_or(0.0)),
            follows: joint.child("drake:mimic").and_then(follows),
        })
    }

    fn pose(&self, of: &Element) -> Result<Isometry3<f64>> {
        let [x, y, z, r, p, w] = self.numbers(self.child(of, "pose")?)?;
        let turn = Rotation3::from_euler_angles(r, p, w).into();
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
    }

    fn name(&self, of: &Element) -> Result<String> {
        let missing = || Error::bad_input(self.file, format!("{}.name", of.tag), "nothing", "a name");
        of.get("name").map(str::to_string).ok_or_else(missing)
    }

    fn child<'e>(&self, of: &'e Element, tag: &'e str) -> Result<&'e Element> {
        let missing = || Error::bad_input(self.file, format!("{}.{tag}", of.tag), "nothing", "an element");
        of.child(tag).ok_or_else(missing)
    }

    fn numbers<const N: usize>(&self, of: &Element) -> Result<[f64; N]> {
        let list: Option<Vec<f64>> = of.text().split_whitespace().map(|w| w.parse().ok()).collect();
        let wrong = || Error::bad_input(self.file, &of.tag, of.text(), format!("{N} numbers"));
        list.and_then(|l| l.try_into().ok()).ok_or_else(wrong)
    }
}

fn follows(mimic: &Element) -> Option<(String, f64)> {
    let ratio = mimic.get("multiplier")?.parse().ok()?;
    Some((mimic.get("joint")?.to_string(), ratio))
}
