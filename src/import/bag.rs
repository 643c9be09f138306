//! The named topics of an MCAP file, decoded and brought into one world frame.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Vector3};

use super::McapRequest;
use super::messages::{self, Kind as Encoded, Placed, Unread, Wrench};
use super::pictures;
use super::places::{FrameTree, between};
use crate::base::{Error, Pose, Result, read_bytes};
use crate::capture::{Camera, ColorImage, DepthImage, View, WrenchStream};

/// Before the name of a frame, where a place is not a topic.
const FRAME: &str = "tf:";
/// The topics on which ROS tells how frames stand.
const TREES: [&str; 2] = ["/tf", "/tf_static"];
/// A colour image farther than this from its depth image, s, is of another moment.
const TOGETHER: f64 = 0.02;

/// World-from-place at a time, s.
type PlacedAt<'s> = Box<dyn Fn(f64) -> Option<Isometry3<f64>> + 's>;

/// Poses over time.
pub(super) type Samples = Vec<(f64, Isometry3<f64>)>;

/// An image with what belongs to it.
pub(super) struct Seen {
    pub(super) time: f64,
    pub(super) pose: Isometry3<f64>,
    pub(super) depth: DepthImage,
    pub(super) color: Option<ColorImage>,
}

impl Seen {
    pub(super) fn view(self) -> View {
        View {
            camera: 0,
            time: self.time,
            world_from_camera: Pose(self.pose),
            depth: self.depth,
            color: self.color,
            labels: None,
        }
    }
}

/// The named topics of a file, decoded.
pub(super) struct Bag<'a> {
    file: PathBuf,
    request: &'a McapRequest,
    tree: FrameTree,
    places: BTreeMap<String, Vec<Placed>>,
    wrenches: Vec<Wrench>,
    depth: Vec<messages::ImageMessage>,
    color: Vec<messages::ImageMessage>,
    info: Option<messages::CameraInfo>,
}

impl<'a> Bag<'a> {
    pub(super) fn read(file: &Path, request: &'a McapRequest) -> Result<Self> {
        let mut bag = Self {
            file: file.to_path_buf(),
            request,
            tree: FrameTree::default(),
            places: BTreeMap::new(),
            wrenches: Vec::new(),
            depth: Vec::new(),
            color: Vec::new(),
            info: None,
        };
        let wanted = bag.wanted()?;
        let bytes = read_bytes(file)?;
        let bad = |e: ::mcap::McapError| Error::bad_input(file, "the file", e.to_string(), "an MCAP file");
        let mut there: BTreeMap<String, (String, String, usize)> = BTreeMap::new();
        for message in ::mcap::MessageStream::new(&bytes).map_err(bad)? {
            let message = message.map_err(bad)?;
            let topic = message.channel.topic.as_str();
            let schema = message.channel.schema.as_ref().map_or("", |s| s.name.as_str());
            let encoding = message.channel.message_encoding.as_str();
            let entry = there.entry(topic.to_owned());
            let (_, _, count) = entry.or_insert_with(|| (schema.to_owned(), encoding.to_owned(), 0));
            *count += 1;
            if wanted.contains(topic) || TREES.contains(&topic) {
                let place = format!("message {count} of {topic}");
                let taken = bag.take(topic, Encoded { encoding, schema }, &message.data, *count);
                taken.map_err(|(found, expected)| Error::bad_input(file, place, found, expected))?;
            }
        }
        let listed: Vec<String> = there
            .iter()
            .map(|(topic, (schema, encoding, count))| format!("{topic} ({count} of {schema} in {encoding})"))
            .collect();
        let listed = if listed.is_empty() {
            "no message".to_owned()
        } else {
            listed.join(", ")
        };
        if wanted.is_empty() && request.tracks.is_empty() && request.tool.is_none() {
            let shown = file.display();
            return Err(Error::Usage(format!(
                "{shown}: name the topics to take (--depth, --track, --force, …); there are {listed}"
            )));
        }
        if let Some(missing) = wanted.iter().find(|t| !there.contains_key(t.as_str())) {
            return Err(Error::bad_input(
                file,
                format!("topic {missing}"),
                "no message of it",
                listed,
            ));
        }
        bag.settle();
        Ok(bag)
    }

    /// The topics that were named.
    fn wanted(&self) -> Result<BTreeSet<String>> {
        let r = self.request;
        if r.depth.is_some() != r.camera_info.is_some() {
            return Err(Error::Usage("--depth and --camera-info go together".into()));
        }
        if r.depth.is_none() && (r.color.is_some() || r.camera.is_some() || r.still) {
            return Err(Error::Usage("--color, --camera and --still go with --depth".into()));
        }
        let topics = [&r.depth, &r.color, &r.camera_info, &r.force].into_iter().flatten();
        let places = r.tracks.iter().map(|(_, p)| p).chain(&r.tool).chain(&r.camera);
        Ok(topics
            .chain(places.filter(|p| !p.starts_with(FRAME)))
            .cloned()
            .collect())
    }

    /// Decodes a message into what it was named for.
    fn take(&mut self, topic: &str, kind: Encoded, bytes: &[u8], count: usize) -> std::result::Result<(), Unread> {
        let r = self.request;
        let is = |named: &Option<String>| named.as_deref() == Some(topic);
        if TREES.contains(&topic) {
            self.tree.add(messages::places(kind, bytes)?, topic == "/tf_static");
        } else if is(&r.depth) {
            if (count - 1).is_multiple_of(r.every.max(1)) {
                self.depth.push(messages::image(kind, bytes)?);
            }
        } else if is(&r.color) {
            self.color.push(messages::image(kind, bytes)?);
        } else if is(&r.camera_info) {
            self.info = Some(messages::camera_info(kind, bytes)?);
        } else if is(&r.force) {
            self.wrenches.push(messages::wrench(kind, bytes)?);
        } else {
            let told = messages::places(kind, bytes)?;
            self.places.entry(topic.to_owned()).or_default().extend(told);
        }
        Ok(())
    }

    fn settle(&mut self) {
        self.tree.settle();
        for all in self.places.values_mut() {
            all.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        self.wrenches.sort_by(|a, b| a.time.total_cmp(&b.time));
        let by_time = |a: &messages::ImageMessage, b: &messages::ImageMessage| {
            a.header.stamp.seconds().total_cmp(&b.header.stamp.seconds())
        };
        self.depth.sort_by(by_time);
        self.color.sort_by(by_time);
    }

    /// World-from-frame at a time: exactly where the frame is the world, else through the tree.
    fn world_from(&self, frame: &str, time: f64) -> Option<Isometry3<f64>> {
        self.tree.at(&self.request.world, frame, time)
    }

    /// The refusal of a frame that no transform leads to.
    fn unreachable(&self, place: &str, frame: &str) -> Error {
        let expected = format!(
            "transforms on /tf or /tf_static that lead to {} (see --world)",
            self.request.world
        );
        Error::bad_input(&self.file, place, format!("the frame {frame:?}"), expected)
    }

    /// World-from-place over time.
    pub(super) fn samples(&self, place: &str) -> Result<Samples> {
        let world = &self.request.world;
        if let Some(frame) = place.strip_prefix(FRAME) {
            if !self.tree.reaches(world, frame) {
                return Err(self.unreachable(place, frame));
            }
            let track = self.tree.track(world, frame);
            let none = || Error::bad_input(&self.file, place, "a frame that never moves", "poses over time");
            return if track.is_empty() { Err(none()) } else { Ok(track) };
        }
        let mut samples = Vec::new();
        for one in self.places.get(place).into_iter().flatten() {
            if !self.tree.reaches(world, &one.frame) {
                return Err(self.unreachable(place, &one.frame));
            }
            // Before the tree's first transform and after its last nothing is known.
            samples.extend(self.world_from(&one.frame, one.time).map(|w| (one.time, w * one.pose)));
        }
        let none = || Error::bad_input(&self.file, place, "no pose in the world", "at least one");
        if samples.is_empty() { Err(none()) } else { Ok(samples) }
    }

    /// World-from-place at a time.
    fn placed_at<'s>(&'s self, place: &str) -> Result<PlacedAt<'s>> {
        if let Some(frame) = place.strip_prefix(FRAME) {
            if !self.tree.reaches(&self.request.world, frame) {
                return Err(self.unreachable(place, frame));
            }
            let frame = frame.to_owned();
            return Ok(Box::new(move |time| self.world_from(&frame, time)));
        }
        let samples = self.samples(place)?;
        // A camera that was placed once stands there.
        let only = (samples.len() == 1).then(|| samples[0].1);
        Ok(Box::new(move |time| only.or_else(|| between(&samples, time))))
    }

    /// What the tool exerts, in world axes; torques about the tool's origin, or the sensor's where no tool was named.
    pub(super) fn forces(
        &self,
        topic: &str,
        tool: Option<&[(f64, Isometry3<f64>)]>,
        reaction: bool,
        left_out: &mut Vec<String>,
    ) -> Result<WrenchStream> {
        let sign = if reaction { -1.0 } else { 1.0 };
        let (mut out, mut torques, mut unplaced) = (WrenchStream::default(), Vec::new(), 0);
        for one in &self.wrenches {
            if !self.tree.reaches(&self.request.world, &one.frame) {
                return Err(self.unreachable(topic, &one.frame));
            }
            let sensor = self.world_from(&one.frame, one.time);
            let Some(sensor) = sensor else {
                unplaced += 1;
                continue;
            };
            let force = sensor.rotation * one.force * sign;
            let about = tool.map_or(Some(sensor), |t| between(t, one.time));
            let arm = about.map(|a| sensor.translation.vector - a.translation.vector);
            let unknown = Vector3::from_element(f64::NAN);
            torques.push(arm.map_or(unknown, |arm| sensor.rotation * one.torque * sign + arm.cross(&force)));
            out.time.push(one.time);
            out.force.push(force);
        }
        if unplaced > 0 {
            left_out.push(format!("{unplaced} wrenches at times at which their frame has no pose"));
        }
        out.torque = torques.iter().any(|t| t.x.is_finite()).then_some(torques);
        Ok(out)
    }

    /// The camera, and each range image with its pose and the colour image of the same moment.
    pub(super) fn pictures(&self, topic: &str, left_out: &mut Vec<String>) -> Result<(Camera, Vec<Seen>)> {
        let bad = |place: String, (found, expected): Unread| Error::bad_input(&self.file, place, found, expected);
        let Some(info) = &self.info else {
            return Err(Error::Usage("--depth and --camera-info go together".into()));
        };
        let camera = lens(info, &self.depth).map_err(|e| bad("the camera".into(), e))?;
        let place = self.request.camera.clone();
        let place = place.unwrap_or_else(|| format!("{FRAME}{}", info.header.frame_id.trim_start_matches('/')));
        let placed = self.placed_at(&place)?;
        let (mut all, mut unplaced, mut colorless) = (Vec::new(), 0, 0);
        for (i, image) in self.depth.iter().enumerate() {
            let time = image.header.stamp.seconds();
            let Some(pose) = placed(time) else {
                unplaced += 1;
                continue;
            };
            let beside = nearest(&self.color, time);
            colorless += usize::from(self.request.color.is_some() && beside.is_none());
            let of = |e| bad(format!("image {} of {topic}", i + 1), e);
            all.push(Seen {
                time,
                pose,
                depth: pictures::depth(image).map_err(of)?,
                color: beside.map(pictures::color).transpose().map_err(of)?,
            });
        }
        if all.is_empty() {
            return Err(Error::bad_input(
                &self.file,
                topic,
                format!("{unplaced} images without a pose of {place}"),
                "one with",
            ));
        }
        if unplaced > 0 {
            left_out.push(format!("{unplaced} images at times at which {place} has no pose"));
        }
        if colorless > 0 {
            left_out.push(format!(
                "the colour of {colorless} images: no colour image within {TOGETHER} s"
            ));
        }
        Ok((camera, all))
    }
}

/// The image next in time, where it is of the same moment.
fn nearest(all: &[messages::ImageMessage], time: f64) -> Option<&messages::ImageMessage> {
    let off = |m: &messages::ImageMessage| (m.header.stamp.seconds() - time).abs();
    let best = all.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    (off(best) <= TOGETHER).then_some(best)
}

/// The camera that the depth images are of.
fn lens(info: &messages::CameraInfo, images: &[messages::ImageMessage]) -> std::result::Result<Camera, Unread> {
    let Some(first) = images.first() else {
        return Err(("no image".into(), "at least one"));
    };
    let size = |w: u32, h: u32| format!("{w} x {h} pixels");
    if (first.width, first.height) != (info.width, info.height) {
        let found = format!(
            "a lens for {}, images of {}",
            size(info.width, info.height),
            size(first.width, first.height)
        );
        return Err((found, "the lens of the depth images"));
    }
    let plumb = ["plumb_bob", "", "none"].contains(&info.distortion_model.as_str());
    if !plumb && info.d.iter().any(|d| *d != 0.0) || info.d.iter().skip(5).any(|d| *d != 0.0) {
        return Err((
            format!("{} {:?}", info.distortion_model, info.d),
            "plumb_bob with five coefficients",
        ));
    }
    let unit = pictures::depth_unit(&first.encoding).ok_or((first.encoding.clone(), "16UC1 or 32FC1"))?;
    let [fx, _, cx, _, fy, cy, ..] = info.k;
    Ok(Camera {
        name: "camera".into(),
        width: info.width,
        height: info.height,
        fx,
        fy,
        cx,
        cy,
        distortion: std::array::from_fn(|i| info.d.get(i).copied().unwrap_or(0.0)),
        depth_unit: unit,
        depth_min: 0.0,
        depth_max: unit * f64::from(u16::MAX),
        depth_sd: None,
    })
}
