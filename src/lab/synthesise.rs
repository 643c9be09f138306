//! From a scene to a synthetic capture with the right answers beside it.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::obj::write_obj;
use super::range_camera;
use super::ray::Stage;
use super::truth::truth;
use super::{Performance, Scene, Solid, build_solids, perform, rig, sensors};
use crate::base::{Error, Progress, Result, Seed};
use crate::capture::{BodyPrior, Capture, Interaction, MeshFile, Support, View};
use crate::twin::Truth;

/// The name of the truth file in a synthetic capture.
const TRUTH: &str = "truth.json";
/// Seconds between interactions.
const PAUSE: f64 = 0.5;

/// A synthetic capture, the right answers, and the files that hold them.
#[derive(Clone, Debug)]
pub struct Synthetic {
    /// What the sensors saw.
    pub capture: Capture,
    /// What the scene really is.
    pub truth: Truth,
    /// The truth file and the true surfaces: path in the capture's folder, content.
    pub files: Vec<(String, Vec<u8>)>,
}

/// Steps of progress that [`synthesise`] makes for `scene`: one a view and one an action.
pub fn steps(scene: &Scene) -> u64 {
    (scene.camera.views + scene.action.len()) as u64
}

/// Performs the script of `scene` and records it with the scene's cameras and sensors. Mesh files are looked for in
/// `base`. Same scene and seed, same bytes, whatever the number of threads.
///
/// # Errors
/// Mesh files that are missing or not closed, and motions that cannot be integrated.
pub fn synthesise(scene: &Scene, base: &Path, seed: Seed, progress: &Progress) -> Result<Synthetic> {
    let solids = build_solids(scene, base)?;
    let views = take_views(scene, &solids, seed, progress)?;
    let performances = perform(scene, &solids, progress)?;
    let (truth, mut files) = truth(scene, &solids);
    let text = serde_json::to_string_pretty(&truth).map_err(|e| Error::Failed(format!("{TRUTH}: {e}")))?;
    files.insert(0, (TRUTH.into(), (text + "\n").into_bytes()));
    let capture = Capture {
        root: base.to_path_buf(),
        name: scene.name.clone(),
        gravity: Vector3::from(scene.gravity),
        support: (!scene.support.hidden).then(|| support(scene)),
        cameras: if views.is_empty() {
            Vec::new()
        } else {
            vec![rig::camera(&scene.camera, scene.noise.stated)]
        },
        interactions: record(scene, &performances, views.len(), seed),
        views,
        bodies: known_beforehand(scene, &solids),
        noise: sensors::stated(&scene.noise),
        truth: Some(TRUTH.into()),
        digest: String::new(),
    };
    Ok(Synthetic { capture, truth, files })
}

/// The table as the capture states it: level, whatever it really is.
fn support(scene: &Scene) -> Support {
    Support {
        point: Point3::origin(),
        normal: Vector3::z_axis(),
        material: scene.support.material.clone(),
        friction: None,
    }
}

fn take_views(scene: &Scene, solids: &BTreeMap<String, Solid>, seed: Seed, progress: &Progress) -> Result<Vec<View>> {
    if scene.camera.views == 0 {
        return Ok(Vec::new());
    }
    let stage = Stage::new(scene, solids)?;
    let camera = rig::camera(&scene.camera, true);
    let poses = rig::poses(&scene.camera, seed);
    let views = poses.par_iter().enumerate().map(|(i, pose)| {
        let view = range_camera::take(&stage, &scene.camera, &camera, pose, i, seed);
        progress.advance();
        view
    });
    Ok(views.collect())
}

/// The interactions on one clock: each starts after the one before.
fn record(scene: &Scene, performances: &[Performance], views: usize, seed: Seed) -> Vec<Interaction> {
    let mut start = (0.1 * views as f64).ceil() + 1.0;
    let mut interactions = Vec::with_capacity(performances.len());
    for performance in performances {
        let mut interaction = sensors::record(performance, &scene.noise, start, seed);
        interaction
            .tracks
            .retain(|name, _| scene.body.iter().any(|b| b.name == *name && b.tracked));
        interactions.push(interaction);
        let last = |times: &[f64]| times.last().copied().unwrap_or(0.0);
        start += last(&performance.force_time).max(last(&performance.track_time)) + PAUSE;
    }
    interactions
}

fn known_beforehand(scene: &Scene, solids: &BTreeMap<String, Solid>) -> Vec<BodyPrior> {
    scene
        .body
        .iter()
        .filter(|body| body.known_mesh)
        .filter_map(|body| solids.get(&body.name))
        .map(|solid| BodyPrior {
            name: solid.name.clone(),
            mesh: Some(MeshFile {
                path: format!("meshes/{}.obj", solid.name).into(),
                bytes: write_obj(&solid.mesh),
            }),
            world_from_body: Some(solid.world_from_body),
            ..BodyPrior::default()
        })
        .collect()
}
