//! A scene of the BOP benchmark as a capture: views or frames, known shapes, known poses.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat};
use nalgebra::{Isometry3, Point3};

use super::bop_json::{SceneCamera, SceneObject, by_image, rigid};
use super::mcap::empty;
use super::tum::recording;
use crate::base::{Error, Pose, Result, read_bytes};
use crate::capture::{
    BodyPrior, Camera, Capture, ColorImage, DepthImage, Frames, Interaction, Kind, LabelImage, MeshFile, PoseStream,
    View,
};
use crate::geometry::{parse_mesh, write_obj};

/// Things that come this far between images have moved: m, rad.
const MOVED: f64 = 0.005;
const TURNED: f64 = 0.035;
const METRES: f64 = 1e-3;

/// How to read a scene.
#[derive(Clone, Debug)]
pub struct BopRequest {
    /// The folder with `obj_000001.ply`, …; `models` beside the split's folder where it is not given.
    pub models: Option<PathBuf>,
    /// The thing whose frame becomes the world, where the scene does not say where its cameras stood.
    pub world_object: Option<u32>,
    /// Things move between the images: one recording with a track of each.
    pub moving: bool,
    /// Images per second of a recording: the format has no times.
    pub rate: f64,
}

/// Reads the scene in `folder` into a capture at `out`, which is not written yet; beside it what had to be left out, in words.
///
/// World frame: that of `cam_R_w2c`, or of the thing named. The poses of things are told as known, and so are their shapes.
///
/// # Errors
/// [`Error::BadInput`] that names file and place where something cannot be read; [`Error::Usage`] where the scene does not say
/// where its cameras stood and no thing was named, or things move and [`BopRequest::moving`] is off.
pub fn import_bop(folder: &Path, request: &BopRequest, out: &Path) -> Result<(Capture, Vec<String>)> {
    let scene = Scene::read(folder, request)?;
    let mut left_out = Vec::new();
    let mut capture = empty(out);
    let mut seen = Vec::new();
    for (image, entry) in &scene.cameras {
        seen.push(scene.image(*image, entry, &mut capture.cameras, &mut left_out)?);
    }
    let moved = scene.poses.iter().find(|(_, poses)| moves(poses));
    if let Some((name, _)) = moved.filter(|_| !request.moving) {
        return Err(Error::Usage(format!(
            "{}: {name} moves between the images; --moving takes them as one recording",
            folder.display()
        )));
    }
    capture.bodies = scene.bodies(request, &mut left_out)?;
    if request.moving {
        if capture.cameras.len() > 1 {
            let found = format!("{} different cameras", capture.cameras.len());
            return Err(Error::bad_input(
                folder.join("scene_camera.json"),
                "cam_K",
                found,
                "one for a recording",
            ));
        }
        capture.interactions.push(scene.recorded(seen, request.rate));
    } else {
        capture.views = seen;
    }
    left_out.sort();
    left_out.dedup();
    Ok((capture, left_out))
}

/// Whether poses of one thing differ by more than a hand's unrest.
fn moves(poses: &BTreeMap<u32, Isometry3<f64>>) -> bool {
    let Some(first) = poses.values().next() else {
        return false;
    };
    let far = |p: &Isometry3<f64>| (p.translation.vector - first.translation.vector).norm() > MOVED;
    poses
        .values()
        .any(|p| far(p) || p.rotation.angle_to(&first.rotation) > TURNED)
}

/// A scene with everything in the world frame.
struct Scene {
    folder: PathBuf,
    cameras: BTreeMap<u32, SceneCamera>,
    world_from_camera: BTreeMap<u32, Isometry3<f64>>,
    /// Name of each thing → image → world-from-thing.
    poses: BTreeMap<String, BTreeMap<u32, Isometry3<f64>>>,
    /// Name of each thing → the number of its model.
    models: BTreeMap<String, u32>,
    /// Image → names of the things in the order of `scene_gt.json`.
    order: BTreeMap<u32, Vec<String>>,
}

impl Scene {
    fn read(folder: &Path, request: &BopRequest) -> Result<Self> {
        let (camera_file, truth_file) = (folder.join("scene_camera.json"), folder.join("scene_gt.json"));
        let cameras: BTreeMap<u32, SceneCamera> = by_image(&camera_file)?;
        let things: BTreeMap<u32, Vec<SceneObject>> = if truth_file.exists() {
            by_image(&truth_file)?
        } else {
            BTreeMap::new()
        };
        if cameras.is_empty() {
            return Err(Error::bad_input(&camera_file, "the file", "no image", "at least one"));
        }
        let mut scene = Self {
            folder: folder.to_path_buf(),
            world_from_camera: BTreeMap::new(),
            poses: BTreeMap::new(),
            models: BTreeMap::new(),
            order: BTreeMap::new(),
            cameras,
        };
        for (image, entry) in &scene.cameras {
            let seen = things.get(image).map_or(&[][..], Vec::as_slice);
            let placed = placed(image, entry, seen, request, (&camera_file, &truth_file))?;
            scene.world_from_camera.insert(*image, placed);
            let mut taken: BTreeMap<u32, usize> = BTreeMap::new();
            for (k, thing) in seen.iter().enumerate() {
                let count = taken.entry(thing.obj_id).or_default();
                *count += 1;
                let name = match *count {
                    1 => format!("obj_{:06}", thing.obj_id),
                    n => format!("obj_{:06}_{n}", thing.obj_id),
                };
                let pose = camera_from(thing, *image, k, &truth_file)?;
                scene
                    .poses
                    .entry(name.clone())
                    .or_default()
                    .insert(*image, placed * pose);
                scene.models.insert(name.clone(), thing.obj_id);
                scene.order.entry(*image).or_default().push(name);
            }
        }
        Ok(scene)
    }

    /// An image with its camera, which is added to `cameras` where no earlier image has the same.
    fn image(
        &self,
        image: u32,
        entry: &SceneCamera,
        cameras: &mut Vec<Camera>,
        left_out: &mut Vec<String>,
    ) -> Result<View> {
        let file = self.folder.join(format!("depth/{image:06}.png"));
        let depth = match decoded(&file)? {
            DynamicImage::ImageLuma16(grey) => DepthImage {
                width: grey.width(),
                height: grey.height(),
                counts: grey.into_raw(),
            },
            other => {
                return Err(Error::bad_input(
                    &file,
                    "the image",
                    format!("{:?}", other.color()),
                    "16-bit greyscale",
                ));
            }
        };
        let size = (depth.width, depth.height);
        let mut camera = lens(entry, size);
        let known = cameras.iter().position(|c| {
            let of = |c: &Camera| (c.width, c.height, [c.fx, c.fy, c.cx, c.cy, c.depth_unit]);
            of(c) == of(&camera)
        });
        let index = known.unwrap_or(cameras.len());
        if known.is_none() {
            camera.name = format!("camera-{index}");
            cameras.push(camera);
        }
        Ok(View {
            camera: index,
            time: f64::from(image),
            world_from_camera: Pose(self.world_from_camera[&image]),
            color: self.color(image, size, left_out)?,
            labels: self.labels(image, size)?,
            depth,
        })
    }

    fn color(&self, image: u32, size: (u32, u32), left_out: &mut Vec<String>) -> Result<Option<ColorImage>> {
        let file = self.folder.join(format!("rgb/{image:06}.png"));
        if !file.exists() {
            if self.folder.join("rgb").is_dir() {
                left_out.push("colour images that are no PNG".into());
            }
            return Ok(None);
        }
        let rgb = decoded(&file)?.into_rgb8();
        same_size(&file, (rgb.width(), rgb.height()), size)?;
        Ok(Some(ColorImage {
            width: size.0,
            height: size.1,
            rgb: rgb.pixels().map(|p| p.0).collect(),
        }))
    }

    /// The visible masks as ids, which are the places of the things in the order of their names, from 1 on.
    fn labels(&self, image: u32, size: (u32, u32)) -> Result<Option<LabelImage>> {
        let mut ids = vec![0_u16; (size.0 * size.1) as usize];
        let mut any = false;
        for (k, name) in self.order.get(&image).into_iter().flatten().enumerate() {
            let file = self.folder.join(format!("mask_visib/{image:06}_{k:06}.png"));
            if !file.exists() {
                continue;
            }
            let mask = decoded(&file)?.into_luma8();
            same_size(&file, (mask.width(), mask.height()), size)?;
            let id = 1 + self.poses.keys().position(|n| n == name).unwrap_or(0) as u16;
            ids.iter_mut()
                .zip(mask.pixels())
                .filter(|(_, p)| p.0[0] > 0)
                .for_each(|(i, _)| *i = id);
            any = true;
        }
        Ok(any.then_some(LabelImage {
            width: size.0,
            height: size.1,
            ids,
        }))
    }

    /// Each thing with its shape, in m, and its pose in the first image that shows it.
    fn bodies(&self, request: &BopRequest, left_out: &mut Vec<String>) -> Result<Vec<BodyPrior>> {
        let beside = self.folder.canonicalize().ok();
        let beside = beside.and_then(|f| Some(f.parent()?.parent()?.join("models")));
        let models = request.models.clone().or_else(|| beside.filter(|f| f.is_dir()));
        let mut bodies = Vec::new();
        for (name, poses) in &self.poses {
            let mesh = models
                .as_ref()
                .map(|folder| shape(folder, self.models[name]))
                .transpose()?;
            if mesh.is_none() {
                left_out.push("the shapes of the things: no folder of models (--models)".into());
            }
            bodies.push(BodyPrior {
                name: name.clone(),
                mesh,
                world_from_body: poses.values().next().copied().map(Pose),
                ..BodyPrior::default()
            });
        }
        Ok(bodies)
    }

    /// All images as frames of one recording, with the track of each thing.
    fn recorded(&self, seen: Vec<View>, rate: f64) -> Interaction {
        let time = |image: u32| f64::from(image) / rate;
        let stream = |poses: &BTreeMap<u32, Isometry3<f64>>| PoseStream {
            time: poses.keys().map(|i| time(*i)).collect(),
            position: poses.values().map(|p| Point3::from(p.translation.vector)).collect(),
            rotation: poses.values().map(|p| Some(p.rotation)).collect(),
        };
        let frames = Frames {
            camera: 0,
            world_from_camera: None,
            time: self.cameras.keys().map(|i| time(*i)).collect(),
            depth: Vec::new(),
            color: Vec::new(),
            poses: Some(stream(&self.world_from_camera)),
            taken: seen.into_iter().map(|v| (v.depth, v.color)).collect(),
        };
        Interaction {
            frames: Some(frames),
            tracks: self
                .poses
                .iter()
                .map(|(name, poses)| (name.clone(), stream(poses)))
                .collect(),
            ..recording(Kind::Hold)
        }
    }
}

fn camera_from(thing: &SceneObject, image: u32, k: usize, file: &Path) -> Result<Isometry3<f64>> {
    rigid(&thing.cam_R_m2c, &thing.cam_t_m2c).ok_or_else(|| {
        Error::bad_input(
            file,
            format!("{image}[{k}].cam_R_m2c"),
            "no rotation",
            "a rotation matrix",
        )
    })
}

/// World-from-camera of an image.
fn placed(
    image: &u32,
    entry: &SceneCamera,
    things: &[SceneObject],
    request: &BopRequest,
    (camera_file, truth_file): (&Path, &Path),
) -> Result<Isometry3<f64>> {
    if let (Some(rotation), Some(translation)) = (&entry.cam_R_w2c, &entry.cam_t_w2c) {
        let camera_from_world = rigid(rotation, translation);
        let bad = || {
            Error::bad_input(
                camera_file,
                format!("{image}.cam_R_w2c"),
                "no rotation",
                "a rotation matrix",
            )
        };
        return camera_from_world.map(|c| c.inverse()).ok_or_else(bad);
    }
    let Some(id) = request.world_object else {
        return Err(Error::Usage(format!(
            "{}: image {image} does not say where its camera stood (cam_R_w2c); name a thing that stands still with --world-object",
            camera_file.display()
        )));
    };
    let k = things.iter().position(|t| t.obj_id == id);
    let missing = || {
        Error::bad_input(
            truth_file,
            format!("{image}"),
            format!("no thing {id}"),
            "the one of --world-object",
        )
    };
    let k = k.ok_or_else(missing)?;
    Ok(camera_from(&things[k], *image, k, truth_file)?.inverse())
}

fn lens(entry: &SceneCamera, (width, height): (u32, u32)) -> Camera {
    let [fx, _, cx, _, fy, cy, ..] = entry.cam_K;
    let depth_unit = entry.depth_scale * METRES;
    Camera {
        name: String::new(),
        width,
        height,
        fx,
        fy,
        cx,
        cy,
        distortion: [0.0; 5],
        depth_unit,
        depth_min: 0.0,
        depth_max: depth_unit * f64::from(u16::MAX),
        depth_sd: None,
    }
}

/// A model in m, as an OBJ.
fn shape(folder: &Path, id: u32) -> Result<MeshFile> {
    let path = folder.join(format!("obj_{id:06}.ply"));
    let mut mesh = parse_mesh(&path, &read_bytes(&path)?)?;
    mesh.vertices.iter_mut().for_each(|v| *v *= METRES);
    Ok(MeshFile {
        path: path.with_extension("obj"),
        bytes: write_obj(&mesh).into_bytes(),
    })
}

fn decoded(file: &Path) -> Result<DynamicImage> {
    let bytes = read_bytes(file)?;
    image::load_from_memory_with_format(&bytes, ImageFormat::Png)
        .map_err(|e| Error::bad_input(file, "the image", e.to_string(), "a PNG"))
}

fn same_size(file: &Path, found: (u32, u32), expected: (u32, u32)) -> Result<()> {
    let said = |(w, h): (u32, u32)| format!("{w} x {h} pixels");
    if found == expected {
        return Ok(());
    }
    Err(Error::bad_input(file, "the image", said(found), said(expected)))
}
