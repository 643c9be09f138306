//! Reads the GLB back, by a reader that is not ours, and works out where everything is.

use std::path::Path;

use gltf::scene::Transform;
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use super::glb::PHYSICS;
use super::loaded::{Axis, Loaded, Skin, Solid};
use crate::base::{Error, Result};

/// The content of `bytes`. Static bodies have no matter in glTF and are left out.
pub(super) fn load(file: &Path, bytes: &[u8]) -> Result<Loaded> {
    let bad = |found: String| Error::bad_input(file, "document", found, "a binary glTF 2.0");
    let gltf = gltf::Gltf::from_slice(bytes).map_err(|e| bad(e.to_string()))?;
    let extensions = gltf.document.extensions().cloned().unwrap_or_default();
    let described = extensions[PHYSICS]["physicsJoints"]
        .as_array()
        .cloned()
        .unwrap_or_default();
    let scene = gltf.default_scene().ok_or_else(|| bad("no scene".into()))?;
    // The root's turn from z-up to y-up is undone, so that the world is the twin's.
    let mut out = Loaded::default();
    for root in scene.nodes() {
        for child in root.children() {
            visit(&child, &Isometry3::identity(), &described, &mut out);
            skins(&child, &extensions[PHYSICS]["physicsMaterials"], &mut out);
        }
    }
    Ok(out)
}

fn visit(node: &gltf::Node, parent: &Isometry3<f64>, described: &[Value], out: &mut Loaded) {
    let world = parent * pose(node);
    let physics = node.extensions().and_then(|e| e.get(PHYSICS));
    let name = node.name().unwrap_or_default();
    let motion = physics.and_then(|p| p.get("motion"));
    if let Some(solid) = motion.and_then(|m| solid(m, &world)) {
        out.parts.insert(name.to_string(), solid);
    }
    if let Some(joint) = physics.and_then(|p| p.get("joint")) {
        let index = joint["joint"].as_u64().and_then(|i| usize::try_from(i).ok());
        if let Some(description) = index.and_then(|i| described.get(i)) {
            let name = name.strip_suffix("_child").unwrap_or(name);
            out.axes
                .extend(axis(description, &world).map(|a| (name.to_string(), a)));
        }
    }
    for child in node.children() {
        visit(&child, &world, described, out);
    }
}

/// The material of a part is that of the colliders right below it.
fn skins(node: &gltf::Node, materials: &Value, out: &mut Loaded) {
    for child in node.children() {
        let collider = child.extensions().and_then(|e| e.get(PHYSICS)?.get("collider"));
        let index = collider.and_then(|c| c["physicsMaterial"].as_u64());
        if let Some(material) = index.and_then(|i| materials.get(usize::try_from(i).ok()?)) {
            let skin = Skin {
                static_friction: material["staticFriction"].as_f64(),
                kinetic_friction: material["dynamicFriction"].as_f64(),
                restitution: material["restitution"].as_f64(),
                rolling: None,
            };
            out.skins.insert(node.name().unwrap_or_default().to_string(), skin);
        }
        skins(&child, materials, out);
    }
}

fn pose(node: &gltf::Node) -> Isometry3<f64> {
    // The crate hands transforms over as f32.
    let (t, q) = match node.transform() {
        Transform::Decomposed {
            translation, rotation, ..
        } => (translation, rotation),
        Transform::Matrix { .. } => ([0.0; 3], [0.0, 0.0, 0.0, 1.0]),
    };
    let [x, y, z] = t.map(f64::from);
    let [i, j, k, w] = q.map(f64::from);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

fn solid(motion: &Value, world: &Isometry3<f64>) -> Option<Solid> {
    let com = Vector3::from(list::<3>(&motion["centerOfMass"])?);
    let moments = Vector3::from(list::<3>(&motion["inertiaDiagonal"])?);
    let [i, j, k, w] = list::<4>(&motion["inertiaOrientation"])?;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)).to_rotation_matrix();
    let inertia = turn * Matrix3::from_diagonal(&moments) * turn.transpose();
    Some(Solid::new(motion["mass"].as_f64()?, com, &inertia, world))
}

/// The one freedom of a hinge or a slide; joints with more have none that could be compared.
fn axis(description: &Value, world: &Isometry3<f64>) -> Option<Axis> {
    let limits = description["limits"].as_array()?;
    let held = |key: &str| -> Vec<u64> {
        let exact = limits.iter().filter(|l| l["min"] == 0.0 && l["max"] == 0.0);
        exact
            .filter_map(|l| l[key].as_array())
            .flatten()
            .filter_map(Value::as_u64)
            .collect()
    };
    let turns = match (held("linearAxes").len(), held("angularAxes").len()) {
        (3, 2) => true,
        (2, 3) => false,
        _ => return None,
    };
    let key = if turns { "angularAxes" } else { "linearAxes" };
    let ends = limits.iter().find(|l| l[key] == serde_json::json!([0]));
    let drive = &description["drives"][0];
    Some(Axis {
        turns,
        direction: world * Vector3::x(),
        origin: world.translation.vector,
        range: ends.and_then(|l| Some([l["min"].as_f64()?, l["max"].as_f64()?])),
        damping: Some(drive["damping"].as_f64().unwrap_or(0.0)),
        friction: None,
        stiffness: Some(drive["stiffness"].as_f64().unwrap_or(0.0)),
        follows: None,
    })
}

fn list<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    numbers?.try_into().ok()
}
