//! Reads the MJCF back, without MuJoCo, and works out where everything is.

use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::inertial::tensor;
use super::loaded::{Axis, Loaded, Skin, Solid};
use super::xml::{Element, parse};
use crate::base::{Error, Result};

/// The content of `text`.
pub(super) fn load(file: &Path, text: &str) -> Result<Loaded> {
    let root = parse(file, text)?;
    if root.tag != "mujoco" {
        return Err(Error::bad_input(file, "root", root.tag, "mujoco"));
    }
    let reader = Mjcf { file };
    let mut out = Loaded::default();
    for tag in ["mesh", "texture"] {
        for asset in root.children("asset").flat_map(|a| a.children(tag)) {
            out.files.push(reader.text(asset, "file")?.to_string());
        }
    }
    for body in root.children("worldbody").flat_map(|w| w.children("body")) {
        reader.body(body, &Isometry3::identity(), &mut out)?;
    }
    for pair in root.children("equality").flat_map(|e| e.children("joint")) {
        let (own, leader) = (reader.text(pair, "joint1")?, reader.text(pair, "joint2")?);
        let [_, ratio, ..] = reader.numbers::<5>(pair, "polycoef")?;
        if let Some(axis) = out.axes.get_mut(own) {
            axis.follows = Some((leader.to_string(), ratio));
        }
    }
    for number in root.children("custom").flat_map(|c| c.children("numeric")) {
        let part = reader.text(number, "name")?.strip_suffix("_friction_static");
        if let Some(skin) = part.and_then(|p| out.skins.get_mut(p)) {
            skin.static_friction = Some(reader.numbers::<1>(number, "data")?[0]);
        }
    }
    Ok(out)
}

struct Mjcf<'a> {
    file: &'a Path,
}

impl Mjcf<'_> {
    fn body(&self, body: &Element, parent: &Isometry3<f64>, out: &mut Loaded) -> Result<()> {
        let name = self.text(body, "name")?.to_string();
        let [x, y, z] = self.numbers(body, "pos")?;
        let [qw, qx, qy, qz] = self.numbers(body, "quat")?;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
        let world = parent * Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        let inertial = body
            .child("inertial")
            .ok_or_else(|| Error::bad_input(self.file, &name, "no inertial", "an inertial"))?;
        let [mass] = self.numbers(inertial, "mass")?;
        let com = Vector3::from(self.numbers::<3>(inertial, "pos")?);
        let six: [f64; 6] = self.numbers(inertial, "fullinertia")?;
        if let Some(geom) = body.children("geom").find(|g| g.get("friction").is_some()) {
            let [kinetic, _, rolling] = self.numbers(geom, "friction")?;
            let skin = Skin {
                kinetic_friction: Some(kinetic),
                rolling: (geom.get("condim") == Some("6")).then_some(rolling),
                ..Skin::default()
            };
            out.skins.insert(name.clone(), skin);
        }
        out.parts.insert(name, Solid::new(mass, com, &tensor(&six), &world));
        for joint in body.children("joint").filter(|j| j.get("type") != Some("ball")) {
            let axis = Axis {
                turns: joint.get("type") == Some("hinge"),
                direction: world * Vector3::from(self.numbers::<3>(joint, "axis")?),
                origin: world.translation.vector,
                range: joint.get("range").map(|_| self.numbers(joint, "range")).transpose()?,
                damping: Some(self.or_zero(joint, "damping")?),
                friction: Some(self.or_zero(joint, "frictionloss")?),
                stiffness: Some(self.or_zero(joint, "stiffness")?),
                follows: None,
            };
            out.axes.insert(self.text(joint, "name")?.to_string(), axis);
        }
        body.children("body")
            .try_for_each(|child| self.body(child, &world, out))
    }

    fn text<'e>(&self, element: &'e Element, key: &str) -> Result<&'e str> {
        let place = format!("{}.{key}", element.tag);
        element
            .get(key)
            .ok_or_else(|| Error::bad_input(self.file, place, "nothing", "a value"))
    }

    fn numbers<const N: usize>(&self, element: &Element, key: &str) -> Result<[f64; N]> {
        let text = self.text(element, key)?;
        let list: Option<Vec<f64>> = text.split_whitespace().map(|w| w.parse().ok()).collect();
        list.and_then(|l| <[f64; N]>::try_from(l).ok()).ok_or_else(|| {
            let place = format!("{}.{key}", element.tag);
            Error::bad_input(self.file, place, text, format!("{N} numbers"))
        })
    }

    fn or_zero(&self, element: &Element, key: &str) -> Result<f64> {
        match element.get(key) {
            None => Ok(0.0),
            Some(_) => self.numbers::<1>(element, key).map(|[v]| v),
        }
    }
}
