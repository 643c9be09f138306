//! The lab as a rig: one camera on a dome and one tool, before a scene that it knows and does not tell.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::ray::Stage;
use super::truth::truth;
use super::{ActionSpec, Scene, Solid, ToolSpec, build_solids, perform, range_camera, rig, sensors};
use crate::base::{Error, Pose, Progress, Result, Seed};
use crate::capture::{Answer, BodyPrior, Camera, Interaction, Kind, Reach, Rig, RigDescription, Support, Touch, View};

/// Elevations that the camera reaches, degrees.
const ELEVATION: [f64; 2] = [12.0, 82.0];
/// Shortest and longest distance from the target, over that of the scene's rig.
const NEARNESS: [f64; 2] = [0.75, 1.05];
/// Free space around the things that is worth looking at, m.
const MARGIN: f64 = 0.03;
/// Lowest that the camera may go, m.
const LOWEST: f64 = 0.03;
/// Seconds that a view takes, and a pause between touches.
const PAUSE: f64 = 0.5;

/// A scene of the lab that answers like a robot. Every touch starts from the scene as it is at first.
pub struct LabRig {
    scene: Scene,
    solids: BTreeMap<String, Solid>,
    stage: Stage,
    camera: Camera,
    seed: Seed,
    views: usize,
    clock: f64,
}

impl LabRig {
    /// A rig before `scene`; mesh files are looked for in `base`. The script of the scene is not used.
    ///
    /// # Errors
    /// Mesh files that are missing or not closed.
    pub fn new(scene: &Scene, base: &Path, seed: Seed) -> Result<Self> {
        let solids = build_solids(scene, base)?;
        Ok(Self {
            stage: Stage::new(scene, &solids)?,
            camera: rig::camera(&scene.camera, scene.noise.stated),
            scene: scene.clone(),
            solids,
            seed,
            views: 0,
            clock: 0.0,
        })
    }

    /// The truth file and the true surfaces: path in the capture's folder, content.
    ///
    /// # Errors
    /// [`Error::Failed`] where the truth cannot be written as JSON.
    pub fn truth_files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        let (truth, mut files) = truth(&self.scene, &self.solids);
        let text = serde_json::to_string_pretty(&truth).map_err(|e| Error::Failed(format!("truth.json: {e}")))?;
        files.insert(0, ("truth.json".into(), (text + "\n").into_bytes()));
        Ok(files)
    }

    /// The solids of the scene as they stand.
    pub fn solids(&self) -> &BTreeMap<String, Solid> {
        &self.solids
    }

    /// A box about all things, with some air, down to the table.
    fn workspace(&self) -> [Point3<f64>; 2] {
        let spots = self
            .solids
            .values()
            .flat_map(|s| s.mesh.vertices.iter().map(|v| s.world_from_body.0 * v));
        let target = Point3::from(self.scene.camera.target);
        let (low, high) = spots.fold((target, target), |(l, h), p| (l.inf(&p), h.sup(&p)));
        let margin = Vector3::repeat(MARGIN);
        let low = low - margin;
        [Point3::new(low.x, low.y, -0.01), high + margin]
    }

    fn action(&self, touch: &Touch) -> Option<ActionSpec> {
        let name = touch.name.clone();
        let target = touch.target.clone().unwrap_or_default();
        let (at, direction): ([f64; 3], [f64; 3]) = (touch.start.into(), touch.direction.into());
        let (travel, speed, held_out) = (touch.travel, touch.speed, touch.held_out);
        let tool = ToolSpec::default();
        Some(match touch.kind {
            Kind::Push => ActionSpec::Push {
                name,
                target,
                at,
                direction,
                travel,
                speed,
                tool,
                tool_friction: 0.4,
                turned: 0.0,
                retreat: true,
                held_out,
            },
            Kind::Pull => ActionSpec::Pull {
                name,
                target,
                at,
                direction,
                travel,
                speed,
                pin: true,
                down: 0.0,
                arc: false,
                back: false,
                held_out,
            },
            Kind::Press => ActionSpec::Press {
                name,
                target,
                at,
                depth: travel,
                speed,
                hold: touch.duration,
                tool,
                held_out,
            },
            Kind::Lift => ActionSpec::Lift {
                name,
                target,
                at,
                height: travel,
                speed,
                hold: touch.duration,
                twist: 0.0,
                held_out,
            },
            Kind::Tilt => ActionSpec::Tilt {
                name,
                target,
                axis: direction,
                rate: speed,
                limit: travel,
                slide: 0.05,
                held_out,
            },
            Kind::Hold => ActionSpec::Hold {
                name,
                seconds: touch.duration,
            },
            Kind::Toss => return None,
        })
    }
}

impl Rig for LabRig {
    fn describe(&mut self) -> Result<RigDescription> {
        let spec = &self.scene.camera;
        let tracked = self.scene.body.iter().filter(|b| b.tracked);
        Ok(RigDescription {
            name: self.scene.name.clone(),
            gravity: Vector3::from(self.scene.gravity),
            support: (!self.scene.support.hidden).then(|| Support {
                point: Point3::origin(),
                normal: Vector3::z_axis(),
                material: self.scene.support.material.clone(),
                friction: None,
            }),
            cameras: vec![self.camera.clone()],
            reach: Reach::Dome {
                target: Point3::from(spec.target),
                radius: NEARNESS.map(|n| n * spec.distance),
                elevation: ELEVATION.map(f64::to_radians),
            },
            workspace: self.workspace(),
            touches: vec![Kind::Push, Kind::Pull, Kind::Press, Kind::Lift, Kind::Tilt, Kind::Hold],
            bodies: tracked
                .filter_map(|b| self.solids.get(&b.name))
                .map(|s| BodyPrior {
                    name: s.name.clone(),
                    world_from_body: Some(s.world_from_body),
                    ..BodyPrior::default()
                })
                .collect(),
            noise: sensors::stated(&self.scene.noise),
            restores: true,
        })
    }

    fn look(&mut self, world_from_camera: &Pose) -> Result<Answer<View>> {
        let height = world_from_camera.translation.vector.z;
        if height < LOWEST {
            return Ok(Answer::Refused(format!(
                "the camera would be {height:.3} m above the table"
            )));
        }
        let spec = &self.scene.camera;
        let mut view = range_camera::take(
            &self.stage,
            spec,
            &self.camera,
            world_from_camera,
            self.views,
            self.seed,
        );
        view.time = PAUSE * self.views as f64;
        self.views += 1;
        self.clock = view.time + PAUSE;
        Ok(Answer::Done(view))
    }

    fn touch(&mut self, touch: &Touch) -> Result<Answer<Interaction>> {
        let Some(action) = self.action(touch) else {
            return Ok(Answer::Refused("nothing can be tossed here".into()));
        };
        let mut scene = self.scene.clone();
        scene.action = vec![action];
        let performed = match perform(&scene, &self.solids, &Progress::silent()) {
            Ok(performed) => performed,
            Err(error @ (Error::BadInput { .. } | Error::Usage(_))) => return Ok(Answer::Refused(error.to_string())),
            Err(error) => return Err(error),
        };
        let Some(performance) = performed.first() else {
            return Ok(Answer::Refused("nothing was done".into()));
        };
        let mut interaction = sensors::record(performance, &self.scene.noise, self.clock, self.seed);
        let tracked = |name: &str| self.scene.body.iter().any(|b| b.name == name && b.tracked);
        interaction.tracks.retain(|name, _| tracked(name));
        let ends = interaction.tracks.values().filter_map(|t| t.time.last().copied());
        self.clock = ends.fold(self.clock, f64::max) + PAUSE;
        Ok(Answer::Done(interaction))
    }

    fn done(&mut self) -> Result<()> {
        Ok(())
    }
}
