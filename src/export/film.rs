//! What the embedded engine does, as a glTF animation or picture by picture: the twin's own meshes on the way they went.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::engine::STEP;
use super::glb::{Document, link_pose};
use super::picture::{Drawn, Eye, picture};
use super::scene::{PartId, Scene};
use crate::base::{Error, Result};
use crate::twin::Model;

/// Steps between two pictures: 32 ms.
const EVERY: usize = 16;

/// World-from-part of every part that takes part, picture by picture.
#[derive(Default)]
pub(super) struct Film {
    steps: usize,
    /// s.
    time: Vec<f64>,
    pictures: Vec<Vec<(PartId, Isometry3<f64>)>>,
}

impl Film {
    /// Counts a step; takes a picture where it is time for one.
    pub(super) fn step(&mut self, poses: impl FnOnce() -> Vec<(PartId, Isometry3<f64>)>) {
        if self.steps.is_multiple_of(EVERY) {
            self.time.push(self.steps as f64 * STEP);
            self.pictures.push(poses());
        }
        self.steps += 1;
    }

    /// The animation as a binary glTF, without physics: it is to be looked at.
    ///
    /// # Errors
    /// Where a body has no link.
    pub(super) fn glb(&self, scene: &Scene, model: &Model) -> Result<Vec<u8>> {
        let (mut document, root) = Document::of(scene, model)?;
        for node in &mut document.nodes {
            node.as_object_mut().map(|n| n.shift_remove("extensions"));
        }
        let times: Vec<[f32; 1]> = self.time.iter().map(|t| [*t as f32]).collect();
        let input = document.buffer.keys(&times, "SCALAR");
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        let filmed: Vec<PartId> = self
            .pictures
            .first()
            .map_or_else(Vec::new, |p| p.iter().map(|x| x.0).collect());
        for (k, id) in filmed.iter().enumerate() {
            let part = scene.part(*id);
            let Some(node) = document.nodes.iter().position(|n| n["name"] == part.name.as_str()) else {
                continue;
            };
            let above = part.hold().map(|h| PartId { part: h.parent, ..*id });
            let above = above.and_then(|a| filmed.iter().position(|f| *f == a));
            let poses: Vec<Isometry3<f64>> = self.pictures.iter().map(|p| local(scene, p, k, above)).collect();
            let places: Vec<[f32; 3]> = poses
                .iter()
                .map(|p| p.translation.vector.map(|v| v as f32).into())
                .collect();
            let turns = continuous(&poses);
            for (path, output) in [
                ("translation", document.buffer.keys(&places, "VEC3")),
                ("rotation", document.buffer.keys(&turns, "VEC4")),
            ] {
                channels.push(json!({ "sampler": samplers.len(), "target": { "node": node, "path": path } }));
                samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            }
        }
        let animation = json!([{ "name": scene.name, "samplers": samplers, "channels": channels }]);
        Ok(document.finish_as(scene, root, |file: &mut Value| {
            for key in ["extensions", "extensionsUsed"] {
                file.as_object_mut().map(|f| f.shift_remove(key));
            }
            file["animations"] = animation;
        }))
    }

    /// Every picture as a PNG, all from one place that has the whole way in view.
    ///
    /// # Errors
    /// Where there is nothing to be seen.
    pub(super) fn pngs(&self, scene: &Scene, model: &Model) -> Result<Vec<Vec<u8>>> {
        let shown = |id: PartId| {
            let part = scene.part(id);
            let path = part.visual.as_ref()?;
            Some(Drawn {
                mesh: model.meshes.get(path)?,
                texture: model.textures.get(path),
                plain: part.color,
            })
        };
        let of = |pictured: &[(PartId, Isometry3<f64>)]| -> Vec<(Drawn<'_>, Isometry3<f64>)> {
            let drawn = |&(id, pose): &(PartId, _)| Some((shown(id)?, world_from_link(scene, id, pose)));
            pictured.iter().filter_map(drawn).collect()
        };
        let nothing = || Error::Failed("nothing of the twin has a shape: there is nothing to film".to_string());
        let up = scene.floor.as_ref().map_or(Vector3::z_axis(), |f| f.normal);
        let whole: Vec<_> = self.pictures.iter().flat_map(|p| of(p)).collect();
        let points = whole
            .iter()
            .flat_map(|(thing, pose)| thing.mesh.vertices.iter().map(move |v| pose * v));
        let eye = Eye::on(points, &up).ok_or_else(nothing)?;
        let draw = |p: &Vec<(PartId, Isometry3<f64>)>| picture(&of(p), scene.floor.as_ref(), &eye).ok_or_else(nothing);
        self.pictures.par_iter().map(draw).collect()
    }
}

/// World-from-link of a part that is filmed at `pose`.
fn world_from_link(scene: &Scene, id: PartId, pose: Isometry3<f64>) -> Isometry3<f64> {
    let part = scene.part(id);
    pose * part.world_from_part.inverse() * link_pose(part)
}

/// Of part `k` of a picture: parent-link-from-link, or world-from-link for a root.
fn local(scene: &Scene, picture: &[(PartId, Isometry3<f64>)], k: usize, above: Option<usize>) -> Isometry3<f64> {
    let of = |(id, pose): (PartId, Isometry3<f64>)| world_from_link(scene, id, pose);
    let mine = of(picture[k]);
    above.map_or(mine, |a| of(picture[a]).inverse() * mine)
}

/// Quaternions x y z w without jumps of sign, so that what lies between two is the short way.
fn continuous(poses: &[Isometry3<f64>]) -> Vec<[f32; 4]> {
    let mut last = UnitQuaternion::<f64>::identity().into_inner();
    let next = |p: &Isometry3<f64>| {
        let q = p.rotation.into_inner();
        last = if q.dot(&last) < 0.0 { -q } else { q };
        [last.i as f32, last.j as f32, last.k as f32, last.w as f32]
    };
    poses.iter().map(next).collect()
}
