//! Messages of robots as they are encoded: ROS 2 in CDR, poses, wrenches and cameras in JSON too.
//!
//! Field orders are those of the `.msg` files of ROS 2 (`common_interfaces`, `geometry2`): CDR carries no names. CDR: OMG,
//! DDS Interoperability Wire Protocol 2.5, 10.2. JSON also by the schemas of Foxglove.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// How far the length of a quaternion may be from one.
const UNIT: f64 = 1e-3;

/// Seconds and nanoseconds since the epoch of the recording's clock.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Stamp {
    pub(super) sec: i32,
    #[serde(alias = "nsec")]
    pub(super) nanosec: u32,
}

impl Stamp {
    pub(super) fn seconds(self) -> f64 {
        f64::from(self.sec) + 1e-9 * f64::from(self.nanosec)
    }
}

/// `std_msgs/Header`.
#[derive(Debug, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Stamp,
    pub(super) frame_id: String,
}

/// `sensor_msgs/Image`.
#[derive(Debug, Deserialize)]
pub(super) struct ImageMessage {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    /// Bytes per row.
    pub(super) step: u32,
    pub(super) data: Vec<u8>,
}

/// `sensor_msgs/CameraInfo`, as far as it is needed.
#[derive(Debug, Deserialize)]
pub(super) struct CameraInfo {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Triple {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Turn {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

impl Triple {
    pub(super) fn vector(self) -> Vector3<f64> {
        Vector3::new(self.x, self.y, self.z)
    }
}

/// A rigid transform, where all is finite and the quaternion is a unit one.
fn rigid(at: Triple, turn: Turn) -> Option<Isometry3<f64>> {
    let q = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
    let sound = at.vector().iter().all(|x| x.is_finite()) && (q.norm() - 1.0).abs() < UNIT;
    let turn = UnitQuaternion::from_quaternion(q);
    sound.then(|| Isometry3::from_parts(Translation3::from(at.vector()), turn))
}

/// `geometry_msgs/Pose`.
#[derive(Debug, Deserialize)]
struct PoseMessage {
    position: Triple,
    orientation: Turn,
}

#[derive(Debug, Deserialize)]
struct PoseStamped {
    header: Header,
    pose: PoseMessage,
}

#[derive(Debug, Deserialize)]
struct PoseInFrame {
    timestamp: Stamp,
    frame_id: String,
    pose: PoseMessage,
}

#[derive(Debug, Deserialize)]
struct TransformMessage {
    translation: Triple,
    rotation: Turn,
}

#[derive(Debug, Deserialize)]
struct TransformStamped {
    header: Header,
    child_frame_id: String,
    transform: TransformMessage,
}

#[derive(Debug, Deserialize)]
struct TransformList {
    transforms: Vec<TransformStamped>,
}

#[derive(Debug, Deserialize)]
struct FrameTransform {
    timestamp: Stamp,
    parent_frame_id: String,
    child_frame_id: String,
    translation: Triple,
    rotation: Turn,
}

#[derive(Debug, Deserialize)]
struct WrenchMessage {
    force: Triple,
    torque: Triple,
}

#[derive(Debug, Deserialize)]
struct WrenchStamped {
    header: Header,
    wrench: WrenchMessage,
}

/// A pose in a frame, at a time.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) time: f64,
    /// The frame in which it is told.
    pub(super) frame: String,
    /// The frame that is placed, where the message names one.
    pub(super) child: Option<String>,
    /// `frame` from the placed frame.
    pub(super) pose: Isometry3<f64>,
}

/// A force and a torque in the frame of a sensor, at a time.
#[derive(Clone, Debug)]
pub(super) struct Wrench {
    pub(super) time: f64,
    pub(super) frame: String,
    pub(super) force: Vector3<f64>,
    pub(super) torque: Vector3<f64>,
}

/// What a message is, beside its bytes.
#[derive(Clone, Copy)]
pub(super) struct Kind<'a> {
    /// `cdr` or `json`.
    pub(super) encoding: &'a str,
    /// The name of the schema.
    pub(super) schema: &'a str,
}

/// Found and expected, of a message that cannot be read.
pub(super) type Unread = (String, &'static str);

const SOUND: &str = "finite numbers and a unit quaternion";

/// The poses that a message tells: one, or a list of transforms.
pub(super) fn places(kind: Kind, bytes: &[u8]) -> Result<Vec<Placed>, Unread> {
    let stamped = |m: TransformStamped| {
        placed(
            m.header.stamp,
            m.header.frame_id,
            Some(m.child_frame_id),
            m.transform.translation,
            m.transform.rotation,
        )
    };
    match kind.schema {
        "geometry_msgs/msg/PoseStamped" => {
            let m: PoseStamped = decode(kind, bytes)?;
            Ok(vec![placed(
                m.header.stamp,
                m.header.frame_id,
                None,
                m.pose.position,
                m.pose.orientation,
            )?])
        }
        "foxglove.PoseInFrame" => {
            let m: PoseInFrame = decode(kind, bytes)?;
            Ok(vec![placed(
                m.timestamp,
                m.frame_id,
                None,
                m.pose.position,
                m.pose.orientation,
            )?])
        }
        "geometry_msgs/msg/TransformStamped" => Ok(vec![stamped(decode(kind, bytes)?)?]),
        "tf2_msgs/msg/TFMessage" => {
            let m: TransformList = decode(kind, bytes)?;
            m.transforms.into_iter().map(stamped).collect()
        }
        "foxglove.FrameTransform" => {
            let m: FrameTransform = decode(kind, bytes)?;
            Ok(vec![placed(
                m.timestamp,
                m.parent_frame_id,
                Some(m.child_frame_id),
                m.translation,
                m.rotation,
            )?])
        }
        other => Err((
            other.to_owned(),
            "geometry_msgs/msg/PoseStamped or TransformStamped, tf2_msgs/msg/TFMessage, foxglove.PoseInFrame or FrameTransform",
        )),
    }
}

fn placed(stamp: Stamp, frame: String, child: Option<String>, at: Triple, turn: Turn) -> Result<Placed, Unread> {
    let pose = rigid(at, turn).ok_or_else(|| (format!("{at:?}, {turn:?}"), SOUND))?;
    let bare = |f: String| f.trim_start_matches('/').to_owned();
    Ok(Placed {
        time: stamp.seconds(),
        frame: bare(frame),
        child: child.map(bare),
        pose,
    })
}

/// A wrench as the sensor tells it.
pub(super) fn wrench(kind: Kind, bytes: &[u8]) -> Result<Wrench, Unread> {
    if kind.schema != "geometry_msgs/msg/WrenchStamped" {
        return Err((kind.schema.to_owned(), "geometry_msgs/msg/WrenchStamped"));
    }
    let m: WrenchStamped = decode(kind, bytes)?;
    Ok(Wrench {
        time: m.header.stamp.seconds(),
        frame: m.header.frame_id.trim_start_matches('/').to_owned(),
        force: m.wrench.force.vector(),
        torque: m.wrench.torque.vector(),
    })
}

/// A range or colour image.
pub(super) fn image(kind: Kind, bytes: &[u8]) -> Result<ImageMessage, Unread> {
    if kind.schema != "sensor_msgs/msg/Image" || kind.encoding != "cdr" {
        let found = format!("{} in {}", kind.schema, kind.encoding);
        return Err((found, "sensor_msgs/msg/Image in cdr (compressed images are not read)"));
    }
    decode(kind, bytes)
}

/// The lens of a camera.
pub(super) fn camera_info(kind: Kind, bytes: &[u8]) -> Result<CameraInfo, Unread> {
    if kind.schema != "sensor_msgs/msg/CameraInfo" {
        return Err((kind.schema.to_owned(), "sensor_msgs/msg/CameraInfo"));
    }
    decode(kind, bytes)
}

fn decode<T: DeserializeOwned>(kind: Kind, bytes: &[u8]) -> Result<T, Unread> {
    match kind.encoding {
        "json" => serde_json::from_slice(bytes).map_err(|e| (e.to_string(), "the fields of its schema")),
        "cdr" => cdr(bytes),
        other => Err((format!("the encoding {other}"), "cdr (ROS 2) or json")),
    }
}

/// Four bytes tell the order of the others, which are aligned as if they began after them.
fn cdr<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Unread> {
    let whole = "a whole message in plain CDR";
    let (head, body) = bytes
        .split_at_checked(4)
        .ok_or_else(|| (format!("{} bytes", bytes.len()), whole))?;
    let read = match head[..2] {
        [0, 0] => cdr_encoding::from_bytes::<T, byteorder::BigEndian>(body),
        [0, 1] => cdr_encoding::from_bytes::<T, byteorder::LittleEndian>(body),
        _ => return Err((format!("the representation {:02x}{:02x}", head[0], head[1]), whole)),
    };
    read.map(|(message, _)| message).map_err(|e| (e.to_string(), whole))
}
