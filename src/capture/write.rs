//! Writing a capture folder, whole or not at all.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::check::check_document;
use super::csv_text::{frames_csv, normals_csv, poses_csv, wrench_csv};
use super::images::{color_png, grey16_png};
use super::json::{
    BodyJson, CameraJson, CaptureJson, FramesJson, FrictionJson, InteractionJson, NoiseJson, ShapeJson, SupportJson,
    ToolJson, ViewJson,
};
use super::{
    BodyPrior, Camera, Capture, FORMAT, Frames, Interaction, MeshFile, Noise, PoseStream, Support, Tool, ToolShape,
    View, WrenchStream,
};
use crate::base::{Error, Result, StagedFolder, read_bytes};

/// Writes `capture` as a folder that [`super::read_capture`] reads back the same; an older capture there is replaced.
///
/// Numbers of `capture.json` and all times keep every digit, readings in CSV nine significant ones.
///
/// # Errors
/// As [`write_capture_with`].
pub fn write_capture(capture: &Capture, folder: &Path) -> Result<()> {
    write_capture_with(capture, folder, &[])
}

/// Writes `capture` with further files beside it, each under its path relative to the folder (a truth file, meshes).
///
/// # Errors
/// [`Error::Usage`] where `folder` holds something else than a capture, [`Error::Io`] where it cannot be written,
/// [`Error::Failed`] where the capture says what the format does not allow. Nothing is left behind, an older
/// capture in that place stays whole.
pub fn write_capture_with(capture: &Capture, folder: &Path, extra: &[(String, Vec<u8>)]) -> Result<()> {
    let staged = StagedFolder::create(folder, "capture.json")?;
    let mut writer = Writer {
        staged: &staged,
        capture,
        taken: BTreeSet::new(),
    };
    let document = writer.document()?;
    let text = checked_text(folder, &document)?;
    staged.write("capture.json", text.as_bytes())?;
    for (relative, bytes) in extra {
        writer.refuse_taken(relative)?;
        staged.write(relative, bytes)?;
    }
    staged.commit()
}

/// The document as text, once the reader's own checks have passed on it.
fn checked_text(folder: &Path, document: &CaptureJson) -> Result<String> {
    let failed = |error: &dyn std::fmt::Display| Error::Failed(format!("the capture cannot be written: {error}"));
    let value = serde_json::to_value(document).map_err(|error| failed(&error))?;
    let mut text = serde_json::to_string_pretty(&value).map_err(|error| failed(&error))?;
    check_document(&folder.join("capture.json"), value).map_err(|error| failed(&error))?;
    text.push('\n');
    Ok(text)
}

struct Writer<'a> {
    staged: &'a StagedFolder,
    capture: &'a Capture,
    taken: BTreeSet<String>,
}

impl Writer<'_> {
    fn document(&mut self) -> Result<CaptureJson> {
        let c = self.capture;
        let numbered = |(i, view)| self.view(i, view);
        let views = c.views.iter().enumerate().map(numbered).collect::<Result<_>>()?;
        let bodies = c.bodies.iter().map(|body| self.body(body)).collect::<Result<_>>()?;
        let interactions = c
            .interactions
            .iter()
            .map(|x| self.interaction(x))
            .collect::<Result<_>>()?;
        Ok(CaptureJson {
            format: FORMAT.into(),
            name: c.name.clone(),
            gravity: c.gravity.into(),
            support: c.support.as_ref().map(support_json),
            cameras: c.cameras.iter().map(camera_json).collect(),
            views,
            bodies,
            noise: noise_json(&c.noise),
            interactions,
            truth: c.truth.as_ref().map(|path| self.truth_name(path)).transpose()?,
        })
    }

    /// Writes one file under a name that no other file has; gives the name.
    fn put(&mut self, wanted: &str, bytes: &[u8]) -> Result<String> {
        let (stem, suffix) = match wanted.rsplit_once('.') {
            Some((stem, suffix)) => (stem.to_owned(), format!(".{suffix}")),
            None => (wanted.to_owned(), String::new()),
        };
        let mut name = wanted.to_owned();
        // Compared without case, for disks that do not tell cases apart.
        for k in 2.. {
            if self.taken.insert(name.to_lowercase()) {
                break;
            }
            name = format!("{stem}-{k}{suffix}");
        }
        self.staged.write(&name, bytes)?;
        Ok(name)
    }

    fn refuse_taken(&self, relative: &str) -> Result<()> {
        if relative == "capture.json" || self.taken.contains(&relative.to_lowercase()) {
            return Err(Error::Failed(format!(
                "{relative}: a file of that name is part of the capture already"
            )));
        }
        Ok(())
    }

    fn truth_name(&self, path: &Path) -> Result<String> {
        let inside = path.strip_prefix(&self.capture.root).unwrap_or(path);
        let name = if inside.is_absolute() {
            inside.file_name().map(PathBuf::from)
        } else {
            Some(inside.to_path_buf())
        };
        let text = name.as_deref().and_then(Path::to_str).map(str::to_owned);
        text.ok_or_else(|| Error::Failed(format!("{}: not a name for a truth file", path.display())))
    }

    fn camera_name(&self, index: usize) -> Result<String> {
        let camera = self.capture.cameras.get(index);
        camera
            .map(|c| c.name.clone())
            .ok_or_else(|| Error::Failed(format!("there is no camera {index}")))
    }

    fn view(&mut self, i: usize, view: &View) -> Result<ViewJson> {
        let depth = grey16_png(view.depth.width, view.depth.height, &view.depth.counts)?;
        let mut out = ViewJson {
            camera: self.camera_name(view.camera)?,
            time: view.time,
            pose: view.world_from_camera.to_seven(),
            depth: self.put(&format!("views/{i:06}.depth.png"), &depth)?,
            color: None,
            labels: None,
        };
        if let Some(color) = &view.color {
            out.color = Some(self.put(&format!("views/{i:06}.color.png"), &color_png(color)?)?);
        }
        if let Some(labels) = &view.labels {
            let png = grey16_png(labels.width, labels.height, &labels.ids)?;
            out.labels = Some(self.put(&format!("views/{i:06}.labels.png"), &png)?);
        }
        Ok(out)
    }

    fn mesh(&mut self, stem: &str, mesh: &MeshFile) -> Result<String> {
        let suffix = mesh
            .path
            .extension()
            .map(|s| s.to_string_lossy().to_ascii_lowercase())
            .unwrap_or_default();
        self.put(&format!("meshes/{}.{suffix}", file_name(stem)), &mesh.bytes)
    }

    fn body(&mut self, body: &BodyPrior) -> Result<BodyJson> {
        Ok(BodyJson {
            name: body.name.clone(),
            mesh: body.mesh.as_ref().map(|mesh| self.mesh(&body.name, mesh)).transpose()?,
            mass: body.mass,
            mass_sd: body.mass_sd,
            material: body.material.clone(),
            pose: body.world_from_body.map(|pose| pose.to_seven()),
        })
    }

    fn interaction(&mut self, x: &Interaction) -> Result<InteractionJson> {
        if !columns_match(x) {
            return Err(Error::Failed(format!(
                "{}: a stream has columns of different lengths",
                x.name
            )));
        }
        let folder = format!("interactions/{}", file_name(&x.name));
        let tool = x.tool.as_ref().map(|tool| self.tool(&x.name, tool)).transpose()?;
        let mut table = |name: &str, text: Option<String>| {
            text.map(|text| self.put(&format!("{folder}/{name}.csv"), text.as_bytes()))
                .transpose()
        };
        let force = table("force", x.force.as_ref().map(wrench_csv))?;
        let tool_path = table("tool", x.tool_path.as_ref().map(poses_csv))?;
        let support_path = table("support", x.support_path.as_ref().map(normals_csv))?;
        let mut tracks = BTreeMap::new();
        for (name, track) in &x.tracks {
            let written = table(&format!("track.{}", file_name(name)), Some(poses_csv(track)))?;
            tracks.extend(written.map(|path| (name.clone(), path)));
        }
        Ok(InteractionJson {
            name: x.name.clone(),
            kind: x.kind,
            action: x.action.clone(),
            tool_name: x.tool_name.clone(),
            tool,
            target: x.target.clone(),
            force,
            tool_path,
            support_path,
            tracks,
            frames: x
                .frames
                .as_ref()
                .map(|frames| self.frames(&folder, frames))
                .transpose()?,
            held_out: x.held_out,
        })
    }

    fn tool(&mut self, interaction: &str, tool: &Tool) -> Result<ToolJson> {
        let (shape, size) = match &tool.shape {
            ToolShape::Sphere { radius } => (ShapeJson::Sphere, Some(vec![*radius])),
            ToolShape::Box { half } => (ShapeJson::Box, Some(half.iter().copied().collect())),
            ToolShape::Cylinder { radius, half_height } => (ShapeJson::Cylinder, Some(vec![*radius, *half_height])),
            ToolShape::Mesh(_) => (ShapeJson::Mesh, None),
        };
        let mut mesh = None;
        if let ToolShape::Mesh(file) = &tool.shape {
            mesh = Some(self.mesh(&format!("tool-{interaction}"), file)?);
        }
        Ok(ToolJson {
            shape,
            size,
            mesh,
            grip: tool.grip,
            pin: tool.pin,
        })
    }

    /// Copies the images of `frames` from where they were read and writes their index.
    fn frames(&mut self, folder: &str, frames: &Frames) -> Result<FramesJson> {
        let mut depth = Vec::new();
        let mut color = Vec::new();
        for (i, (taken, seen)) in frames.taken.iter().enumerate() {
            let grey = grey16_png(taken.width, taken.height, &taken.counts)?;
            depth.push(self.put(&format!("{folder}/frames/{i:06}.depth.png"), &grey)?);
            let rgb = seen.as_ref().map(color_png).transpose()?;
            let put = |png: Vec<u8>| self.put(&format!("{folder}/frames/{i:06}.color.png"), &png);
            color.push(rgb.map(put).transpose()?);
        }
        for (i, path) in frames.depth.iter().enumerate() {
            depth.push(self.put(&format!("{folder}/frames/{i:06}.depth.png"), &read_bytes(path)?)?);
            let seen = frames.color.get(i).and_then(Option::as_ref);
            let copy = |path: &PathBuf| self.put(&format!("{folder}/frames/{i:06}.color.png"), &read_bytes(path)?);
            color.push(seen.map(copy).transpose()?);
        }
        let index = frames_csv(&frames.time, &depth, &color, frames.poses.as_ref());
        Ok(FramesJson {
            camera: self.camera_name(frames.camera)?,
            index: self.put(&format!("{folder}/frames.csv"), index.as_bytes())?,
            pose: frames.world_from_camera.map(|pose| pose.to_seven()),
        })
    }
}

/// Every column of every stream has as many rows as its times.
fn columns_match(x: &Interaction) -> bool {
    let poses = |s: &PoseStream| s.position.len() == s.len() && s.rotation.len() == s.len();
    let wrench =
        |s: &WrenchStream| s.force.len() == s.time.len() && s.torque.as_ref().is_none_or(|t| t.len() == s.time.len());
    let frames = |f: &Frames| {
        let rows = f.time.len();
        (f.taken.len() == rows || f.depth.len() == rows && f.color.len() == rows)
            && f.poses.as_ref().is_none_or(|p| p.len() == rows && poses(p))
    };
    x.force.as_ref().is_none_or(wrench)
        && x.tool_path.iter().chain(x.tracks.values()).all(poses)
        && x.support_path.as_ref().is_none_or(|s| s.vector.len() == s.time.len())
        && x.frames.as_ref().is_none_or(frames)
}

/// `name` as the name of a file: what is neither letter nor digit nor `-_.` becomes `-`.
fn file_name(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    let name: String = name.chars().map(plain).collect();
    if name.starts_with('.') {
        format!("-{name}")
    } else {
        name
    }
}

fn support_json(support: &Support) -> SupportJson {
    let friction = support.friction.map(|f| FrictionJson {
        static_: f.static_,
        static_sd: f.static_sd,
        kinetic: f.kinetic,
        kinetic_sd: f.kinetic_sd,
    });
    let normal = support.normal.into_inner().into();
    SupportJson {
        point: support.point.into(),
        normal,
        material: support.material.clone(),
        friction,
    }
}

fn camera_json(c: &Camera) -> CameraJson {
    CameraJson {
        name: c.name.clone(),
        width: c.width,
        height: c.height,
        fx: c.fx,
        fy: c.fy,
        cx: c.cx,
        cy: c.cy,
        distortion: c.distortion,
        depth_unit: c.depth_unit,
        depth_min: Some(c.depth_min),
        depth_max: Some(c.depth_max),
        depth_sd: c.depth_sd,
    }
}

fn noise_json(n: &Noise) -> Option<NoiseJson> {
    let some = n.force.or(n.torque).or(n.position).or(n.rotation).is_some();
    some.then_some(NoiseJson {
        force: n.force,
        torque: n.torque,
        position: n.position,
        rotation: n.rotation,
    })
}
