//! From a scene to a synthetic capture with the right answers beside it.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::film::film;
use super::hidden::{alter_solids, effects, faults, target, told};
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
    let effects = effects(scene)?;
    let mut solids = build_solids(scene, base)?;
    if let Some(target) = target(scene) {
        alter_solids(&effects, target, &mut solids);
    }
    let views = take_views(scene, &solids, seed, progress)?;
    let performances = perform(scene, &solids, progress)?;
    let (mut truth, mut files) = truth(scene, &solids);
    told(&effects, &mut truth);
    let mut interactions = record(scene, &performances, views.len(), seed);
    faults(&effects).spoil(&mut interactions, seed);
    let text = serde_json::to_string_pretty(&truth).map_err(|e| Error::Failed(format!("{TRUTH}: {e}")))?;
    files.insert(0, (TRUTH.into(), (text + "\n").into_bytes()));
    let mut cameras = Vec::new();
    if !views.is_empty() {
        cameras.push(rig::camera(&scene.camera, scene.noise.stated));
    }
    if let Some(spec) = &scene.film {
        let mut camera = rig::camera(&spec.lens(), scene.noise.stated);
        camera.name = "film".into();
        cameras.push(camera);
        for (interaction, (performance, start)) in
            interactions.iter_mut().zip(&starts(scene, &performances, views.len()))
        {
            interaction.frames = film(scene, &solids, (performance, *start), (spec, &cameras), seed)?;
        }
    }
    let capture = Capture {
        root: base.to_path_buf(),
        name: scene.name.clone(),
        gravity: Vector3::from(scene.gravity),
        support: (!scene.support.hidden).then(|| support(scene)),
        cameras,
        interactions,
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

/// When each performance starts on the one clock: after the one before.
fn starts<'a>(scene: &Scene, performances: &'a [Performance], views: usize) -> Vec<(&'a Performance, f64)> {
    let mut start = (0.1 * views as f64).ceil() + 1.0;
    let mut out = Vec::with_capacity(performances.len());
    for (performance, pause) in performances.iter().zip(scene.pauses()) {
        start += pause;
        out.push((performance, start));
        let last = |times: &[f64]| times.last().copied().unwrap_or(0.0);
        start += last(&performance.force_time).max(last(&performance.track_time)) + PAUSE;
    }
    out
}

/// The interactions on one clock.
fn record(scene: &Scene, performances: &[Performance], views: usize, seed: Seed) -> Vec<Interaction> {
    let mut interactions = Vec::with_capacity(performances.len());
    for (performance, start) in starts(scene, performances, views) {
        let mut interaction = sensors::record(performance, &scene.noise, start, seed);
        interaction
            .tracks
            .retain(|name, _| scene.body.iter().any(|b| b.name == *name && b.tracked));
        interactions.push(interaction);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::{parse_scene, scene_named};
    use crate::twin::TrueRelation;

    fn stills(name: &str, seed: u64) -> Synthetic {
        let mut scene = scene_named(name).expect("a scene");
        scene.action.clear();
        synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture")
    }

    /// A camera straight above a box: where its top is, and where the table is.
    #[test]
    fn the_depth_of_a_face_is_right_within_its_noise() {
        let text = r#"
            name = "still"
            camera = { views = 3, elevations = [89.0], distance = 0.5, target = [0.0, 0.0, 0.0], labels = true }
            [[body]]
            name = "box"
            shape = { kind = "box", size = [0.1, 0.1, 0.05] }
            position = [0.0, 0.0, 0.025]
        "#;
        let scene = parse_scene(text, Path::new("still.toml")).expect("a scene");
        let made = synthesise(&scene, Path::new("."), Seed(1), &Progress::silent()).expect("a capture");
        let camera = &made.capture.cameras[0];
        for view in &made.capture.views {
            let labels = view.labels.as_ref().expect("labels");
            for (label, height) in [(1, 0.05), (0, 0.0)] {
                let errors: Vec<f64> = (0..labels.ids.len())
                    .filter(|i| labels.ids[*i] == label && view.depth.counts[*i] > 0)
                    .map(|i| {
                        let (u, v) = ((i % 320) as f64, (i / 320) as f64);
                        let z = f64::from(view.depth.counts[i]) * camera.depth_unit;
                        let ray = Point3::new((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z);
                        (view.world_from_camera.0 * ray).z - height
                    })
                    // What flies between the top and the table at the edge is not noise.
                    .filter(|e| e.abs() < 0.004)
                    .collect();
                assert!(errors.len() > 1000, "label {label}: {} readings", errors.len());
                let n = errors.len() as f64;
                let mean = errors.iter().sum::<f64>() / n;
                let sd = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
                assert!(mean.abs() < 5e-5, "label {label}: off by {mean}");
                assert!((2e-4..5e-4).contains(&sd), "label {label}: noise {sd}");
            }
        }
    }

    fn whole(name: &str, seed: u64) -> Synthetic {
        let scene = scene_named(name).expect("a scene");
        synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture")
    }

    #[test]
    fn a_recorded_lift_and_push_weigh_and_rub_as_the_truth_says() {
        let made = whole("tiny", 3);
        assert_eq!(made.capture.interactions.len(), 2);
        let (lift, push) = (&made.capture.interactions[0], &made.capture.interactions[1]);
        let last = |i: &Interaction| i.tracks["box"].time.last().copied().expect("a time");
        assert!(lift.tracks["box"].time[0] > made.capture.views[5].time);
        assert!(push.tracks["box"].time[0] > last(lift));
        let truth = &made.truth.bodies["box"];
        let weight = truth.mass.expect("mass") * 9.80665;
        // Means of the upper half of the lift (held at the top) and of the middle of the push (sliding).
        let mean = |i: &Interaction, from: f64, to: f64, axis: usize| {
            let force = &i.force.as_ref().expect("a force").force;
            let n = force.len() as f64;
            let part = &force[(from * n) as usize..(to * n) as usize];
            part.iter().map(|f| f[axis]).sum::<f64>() / part.len() as f64
        };
        assert!((mean(lift, 0.5, 0.6, 2) / weight - 1.0).abs() < 0.01);
        let kinetic = truth.friction_kinetic.expect("friction") * weight;
        assert!(
            (mean(push, 0.58, 0.68, 0) / kinetic - 1.0).abs() < 0.02,
            "{}",
            mean(push, 0.58, 0.68, 0)
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_on_one_thread_and_on_four() {
        let run = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            pool.install(|| format!("{:?}", whole("tiny", seed)))
        };
        let one = run(1, 7);
        assert!(one == run(4, 7), "threads matter");
        assert!(one != run(1, 8), "the seed does not matter");
    }

    #[test]
    fn every_scene_of_the_lab_is_seen_and_has_its_truth() {
        for (name, _) in crate::lab::scenes() {
            let mut scene = scene_named(name).expect("a scene");
            scene.action.clear();
            scene.camera.views = 1;
            let made = synthesise(&scene, Path::new("."), Seed(1), &Progress::silent()).expect(name);
            assert_eq!(made.truth.bodies.len(), scene.body.len());
            assert_eq!(made.files.len(), scene.body.len() + 1);
            let back: Truth = serde_json::from_slice(&made.files[0].1).expect("the truth file");
            assert_eq!(back, made.truth);
            let read = made.capture.views[0].depth.counts.iter().filter(|c| **c > 0).count();
            assert!(
                read > made.capture.views[0].depth.counts.len() / 2,
                "{name}: {read} readings"
            );
        }
    }

    #[test]
    fn the_truth_of_the_demo_is_what_its_scene_says() {
        let truth = stills("demo", 1).truth;
        let word = |w: &str| TrueRelation::Word(w.into());
        let expected = [
            ("carcass|drawer", TrueRelation::Freedom([0, 1])),
            ("glued-lower|glued-upper", TrueRelation::Freedom([0, 0])),
            ("loose-lower|loose-upper", word("resting")),
            ("post|flap", TrueRelation::Freedom([1, 0])),
        ];
        assert_eq!(truth.relations, expected.map(|(k, v)| (k.to_owned(), v)).into());
        assert_eq!(truth.causes, ["com-offset"]);
        let boxed = &truth.bodies["box"];
        assert!((boxed.mass.expect("mass") - 0.352).abs() < 1e-12);
        assert!((boxed.com.expect("com")[0] - 0.1 * 0.028 / 0.352).abs() < 1e-12);
        let standing = ["box", "carcass", "foam", "glued-lower", "loose-lower", "mug", "post"];
        let told = truth.bodies.iter().filter(|(_, b)| b.friction_static.is_some());
        assert_eq!(told.map(|(name, _)| name.as_str()).collect::<Vec<_>>(), standing);
        assert_eq!(truth.bodies["mug"].symmetry.len(), 1);
        assert_eq!(truth.bodies["foam"].stiffness, Some(2500.0));
    }
}
