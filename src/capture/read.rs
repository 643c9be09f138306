//! Reading a capture folder and checking all of it before anything else happens.

use std::path::Path;

use rayon::prelude::*;

use super::check::check_document;
use super::document::{join, parse};
use super::folder::{Folder, Seen};
use super::frames::read_frames;
use super::images::{read_color, read_depth, read_labels};
use super::json::{
    BodyJson, CameraJson, CaptureJson, InteractionJson, NoiseJson, ShapeJson, SupportJson, ToolJson, ViewJson,
};
use super::streams::{pose_of, read_normals, read_tool_path, read_track, read_wrench, unit_vector};
use super::{
    BodyPrior, Camera, Capture, Interaction, MeshFile, Noise, Support, SupportFriction, Tool, ToolShape, View,
};
use crate::base::{Error, Result, read_bytes};

/// Reads and checks the capture in `folder`; the first fault is reported with file, place, found, expected.
///
/// Rows of streams are counted from 1, the first row under the header. The images of [`super::Frames`] stay on
/// disk; only their headers are looked at here ([`super::read_frame`] loads them).
///
/// # Errors
/// [`Error::BadInput`] for anything that the format (`docs/capture-format.md`) does not allow: the first fault in the
/// order of the file, the same one however many threads read.
pub fn read_capture(folder: &Path) -> Result<Capture> {
    let folder = Folder::open(folder)?;
    let bytes = read_bytes(&folder.json)?;
    let mut seen = Seen::default();
    seen.add("capture.json", &bytes);
    let document = check_document(&folder.json, parse(&folder.json, &bytes)?)?;
    let mut truth = None;
    if let Some(relative) = &document.truth {
        truth = Some(folder.path(&folder.key("truth", relative))?);
    }
    let cameras: Vec<Camera> = document.cameras.iter().map(camera).collect();
    let reader = Reader {
        folder: &folder,
        cameras: &cameras,
    };
    let views = ordered(&document.views, &mut seen, |i, view, seen| reader.view(i, view, seen))?;
    let bodies = ordered(&document.bodies, &mut seen, |i, body, seen| reader.body(i, body, seen))?;
    let interactions = ordered(&document.interactions, &mut seen, |i, x, seen| {
        reader.interaction(i, x, seen)
    })?;
    let support = document.support.as_ref().map(|s| support(&folder, s)).transpose()?;
    let CaptureJson {
        name, gravity, noise, ..
    } = document;
    Ok(Capture {
        root: folder.root().to_path_buf(),
        name,
        gravity: gravity.into(),
        support,
        views,
        bodies,
        noise: noise.as_ref().map(noise_of).unwrap_or_default(),
        interactions,
        truth,
        digest: seen.hex(),
        cameras,
    })
}

/// Reads all items at once, yet reports the first fault and digests in the order of the file.
fn ordered<J: Sync, T: Send>(
    items: &[J],
    seen: &mut Seen,
    read: impl Fn(usize, &J, &mut Seen) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let results: Vec<Result<(T, Seen)>> = items
        .par_iter()
        .enumerate()
        .map(|(i, item)| {
            let mut own = Seen::default();
            Ok((read(i, item, &mut own)?, own))
        })
        .collect();
    let mut out = Vec::with_capacity(items.len());
    for result in results {
        let (item, own) = result?;
        seen.append(own);
        out.push(item);
    }
    Ok(out)
}

struct Reader<'a> {
    folder: &'a Folder,
    cameras: &'a [Camera],
}

impl Reader<'_> {
    fn view(&self, i: usize, view: &ViewJson, seen: &mut Seen) -> Result<View> {
        let key = |name: &str| format!("views[{i}].{name}");
        let index = self.camera_index(&view.camera, &key("camera"))?;
        let (width, height) = (self.cameras[index].width, self.cameras[index].height);
        let (path, bytes) = self.folder.bytes(&self.folder.key(key("depth"), &view.depth), seen)?;
        let depth = read_depth(&path, &bytes, width, height)?;
        let mut color = None;
        if let Some(relative) = &view.color {
            let (path, bytes) = self.folder.bytes(&self.folder.key(key("color"), relative), seen)?;
            color = Some(read_color(&path, &bytes, width, height)?);
        }
        let mut labels = None;
        if let Some(relative) = &view.labels {
            let (path, bytes) = self.folder.bytes(&self.folder.key(key("labels"), relative), seen)?;
            labels = Some(read_labels(&path, &bytes, width, height)?);
        }
        let world_from_camera = pose_of(&self.folder.json, &key("pose"), view.pose)?;
        Ok(View {
            camera: index,
            time: view.time,
            world_from_camera,
            depth,
            color,
            labels,
        })
    }

    fn camera_index(&self, name: &str, place: &str) -> Result<usize> {
        let unknown = || Error::bad_input(&self.folder.json, place, format!("`{name}`"), "the name of a camera");
        self.cameras.iter().position(|c| c.name == name).ok_or_else(unknown)
    }

    fn mesh(&self, key: String, relative: &str, seen: &mut Seen) -> Result<MeshFile> {
        let (path, bytes) = self.folder.bytes(&self.folder.key(key, relative), seen)?;
        if bytes.is_empty() {
            return Err(Error::bad_input(&path, "the file", "an empty file", "a mesh"));
        }
        Ok(MeshFile { path, bytes })
    }

    fn body(&self, i: usize, body: &BodyJson, seen: &mut Seen) -> Result<BodyPrior> {
        let key = |name: &str| format!("bodies[{i}].{name}");
        let mesh = body
            .mesh
            .as_ref()
            .map(|relative| self.mesh(key("mesh"), relative, seen))
            .transpose()?;
        let pose = body
            .pose
            .map(|seven| pose_of(&self.folder.json, &key("pose"), seven))
            .transpose()?;
        Ok(BodyPrior {
            name: body.name.clone(),
            mesh,
            mass: body.mass,
            mass_sd: body.mass_sd,
            material: body.material.clone(),
            world_from_body: pose,
        })
    }

    fn interaction(&self, i: usize, x: &InteractionJson, seen: &mut Seen) -> Result<Interaction> {
        let place = format!("interactions[{i}]");
        let mut out = Interaction {
            name: x.name.clone(),
            kind: x.kind,
            action: x.action.clone(),
            tool_name: x.tool_name.clone(),
            tool: x
                .tool
                .as_ref()
                .map(|t| self.tool(&format!("{place}.tool"), t, seen))
                .transpose()?,
            target: x.target.clone(),
            force: self.stream(format!("{place}.force"), &x.force, read_wrench, seen)?,
            tool_path: self.stream(format!("{place}.tool_path"), &x.tool_path, read_tool_path, seen)?,
            support_path: self.stream(format!("{place}.support_path"), &x.support_path, read_normals, seen)?,
            tracks: Default::default(),
            frames: None,
            held_out: x.held_out,
        };
        for (name, relative) in &x.tracks {
            let key = join(&format!("{place}.tracks"), name);
            let (path, bytes) = self.folder.bytes(&self.folder.key(key, relative), seen)?;
            out.tracks.insert(name.clone(), read_track(&path, &bytes)?);
        }
        if let Some(frames) = &x.frames {
            let camera = self.camera_index(&frames.camera, &format!("{place}.frames.camera"))?;
            let size = (self.cameras[camera].width, self.cameras[camera].height);
            out.frames = Some(read_frames(
                self.folder,
                &format!("{place}.frames"),
                frames,
                camera,
                size,
                seen,
            )?);
        }
        Ok(out)
    }

    fn stream<T>(
        &self,
        key: String,
        relative: &Option<String>,
        read: impl Fn(&Path, &[u8]) -> Result<T>,
        seen: &mut Seen,
    ) -> Result<Option<T>> {
        let Some(relative) = relative else {
            return Ok(None);
        };
        let (path, bytes) = self.folder.bytes(&self.folder.key(key, relative), seen)?;
        read(&path, &bytes).map(Some)
    }

    fn tool(&self, place: &str, tool: &ToolJson, seen: &mut Seen) -> Result<Tool> {
        let size = tool.size.clone().unwrap_or_default();
        let shape = match (tool.shape, size.as_slice(), &tool.mesh) {
            (ShapeJson::Sphere, [radius], _) => ToolShape::Sphere { radius: *radius },
            (ShapeJson::Box, [x, y, z], _) => ToolShape::Box {
                half: [*x, *y, *z].into(),
            },
            (ShapeJson::Cylinder, [radius, half_height], _) => ToolShape::Cylinder {
                radius: *radius,
                half_height: *half_height,
            },
            (ShapeJson::Mesh, _, Some(mesh)) => ToolShape::Mesh(self.mesh(format!("{place}.mesh"), mesh, seen)?),
            _ => {
                return Err(Error::bad_input(
                    &self.folder.json,
                    place,
                    "a tool without a size",
                    "shape and size",
                ));
            }
        };
        Ok(Tool {
            shape,
            grip: tool.grip,
            pin: tool.pin,
        })
    }
}

pub(super) fn camera(c: &CameraJson) -> Camera {
    Camera {
        name: c.name.clone(),
        width: c.width,
        height: c.height,
        fx: c.fx,
        fy: c.fy,
        cx: c.cx,
        cy: c.cy,
        distortion: c.distortion,
        depth_unit: c.depth_unit,
        depth_min: c.depth_min.unwrap_or(0.0),
        depth_max: c.depth_max.unwrap_or(c.depth_unit * f64::from(u16::MAX)),
        depth_sd: c.depth_sd,
    }
}

fn support(folder: &Folder, s: &SupportJson) -> Result<Support> {
    let normal = unit_vector(s.normal).map_err(|norm| {
        Error::bad_input(
            &folder.json,
            "support.normal",
            format!("length {norm}"),
            "a unit vector",
        )
    })?;
    for (name, value, sd) in s
        .friction
        .iter()
        .flat_map(|f| [("static", f.static_, f.static_sd), ("kinetic", f.kinetic, f.kinetic_sd)])
    {
        if let (None, Some(sd)) = (value, sd) {
            let place = format!("support.friction.{name}_sd");
            let expected = format!("the coefficient {name} beside its standard deviation");
            return Err(Error::bad_input(&folder.json, place, sd.to_string(), expected));
        }
    }
    let friction = s.friction.as_ref().map(|f| SupportFriction {
        static_: f.static_,
        static_sd: f.static_sd,
        kinetic: f.kinetic,
        kinetic_sd: f.kinetic_sd,
    });
    Ok(Support {
        point: s.point.into(),
        normal,
        material: s.material.clone(),
        friction,
    })
}

pub(super) fn noise_of(n: &NoiseJson) -> Noise {
    Noise {
        force: n.force,
        torque: n.torque,
        position: n.position,
        rotation: n.rotation,
    }
}
