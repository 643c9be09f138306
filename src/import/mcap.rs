//! An MCAP file of a robot as a capture: images, poses and forces by the topics that are named.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};

use super::bag::{Bag, Samples, Seen};
use super::tum::recording;
use crate::base::Result;
use crate::capture::{Capture, Frames, Kind, PoseStream, Tool, ToolShape};

/// What to take from a file. A place is a topic of poses, or `tf:FRAME`.
#[derive(Clone, Debug, Default)]
pub struct McapRequest {
    /// Topic of range images.
    pub depth: Option<String>,
    /// Topic of colour images in register with them.
    pub color: Option<String>,
    /// Topic of the camera's lens.
    pub camera_info: Option<String>,
    /// Place of the camera's optical frame.
    pub camera: Option<String>,
    /// Name of each tracked thing and its place.
    pub tracks: Vec<(String, String)>,
    /// Place of the tool.
    pub tool: Option<String>,
    /// Radius of its ball, m.
    pub tool_radius: Option<f64>,
    /// Topic of wrenches.
    pub force: Option<String>,
    /// The sensor tells what acts on the tool, not what the tool exerts.
    pub reaction: bool,
    /// The frame that becomes the world.
    pub world: String,
    /// What was done.
    pub kind: Option<Kind>,
    /// What the tool means to touch.
    pub target: Option<String>,
    /// The images show a scene that stands still: they become views.
    pub still: bool,
    /// Of the images, every how manieth is kept; 0 counts as 1.
    pub every: usize,
}

/// Reads `file` into a capture at `out`, which is not written yet; beside it what had to be left out, in words.
///
/// World frame: `request.world`; times: the stamps of the messages, s. Topics of one kind are sorted by time.
///
/// # Errors
/// [`crate::base::Error::BadInput`] that names topic and message where the file, an encoding or a frame cannot be read;
/// [`crate::base::Error::Usage`] where nothing was asked for (the channels of the file are listed) or options do not go together.
pub fn import_mcap(file: &Path, request: &McapRequest, out: &Path) -> Result<(Capture, Vec<String>)> {
    let bag = Bag::read(file, request)?;
    let mut left_out = Vec::new();
    let mut interaction = recording(request.kind.unwrap_or(Kind::Hold));
    interaction.target.clone_from(&request.target);
    for (name, place) in &request.tracks {
        interaction.tracks.insert(name.clone(), stream(&bag.samples(place)?));
    }
    let tool = request.tool.as_ref().map(|place| bag.samples(place)).transpose()?;
    interaction.tool_path = tool.as_ref().map(|samples| stream(samples));
    interaction.tool = request.tool_radius.map(|radius| Tool {
        shape: ToolShape::Sphere { radius },
        grip: false,
        pin: false,
    });
    if let Some(topic) = &request.force {
        interaction.force = Some(bag.forces(topic, tool.as_deref(), request.reaction, &mut left_out)?);
    }
    let mut capture = empty(out);
    if let Some(depth) = &request.depth {
        let (camera, seen) = bag.pictures(depth, &mut left_out)?;
        capture.cameras.push(camera);
        if request.still {
            capture.views = seen.into_iter().map(Seen::view).collect();
        } else {
            interaction.frames = Some(frames(seen));
        }
    }
    let told = interaction.frames.is_some() || interaction.force.is_some() || interaction.tool_path.is_some();
    if told || !interaction.tracks.is_empty() {
        capture.interactions.push(interaction);
    }
    Ok((capture, left_out))
}

/// A capture with nothing in it, called as its folder.
pub(super) fn empty(out: &Path) -> Capture {
    let name = out.file_name().map(|n| n.to_string_lossy().into_owned());
    Capture {
        root: out.to_path_buf(),
        name: name.unwrap_or_else(|| "recording".into()),
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        support: None,
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: crate::capture::Noise::default(),
        interactions: Vec::new(),
        truth: None,
        digest: String::new(),
    }
}

/// The images as frames of an interaction.
fn frames(seen: Vec<Seen>) -> Frames {
    let poses: Samples = seen.iter().map(|s| (s.time, s.pose)).collect();
    Frames {
        camera: 0,
        world_from_camera: None,
        time: seen.iter().map(|s| s.time).collect(),
        depth: Vec::new(),
        color: Vec::new(),
        poses: Some(stream(&poses)),
        taken: seen.into_iter().map(|s| (s.depth, s.color)).collect(),
    }
}

fn stream(samples: &[(f64, Isometry3<f64>)]) -> PoseStream {
    PoseStream {
        time: samples.iter().map(|(t, _)| *t).collect(),
        position: samples
            .iter()
            .map(|(_, p)| Point3::from(p.translation.vector))
            .collect(),
        rotation: samples.iter().map(|(_, p)| Some(p.rotation)).collect(),
    }
}
