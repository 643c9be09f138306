//! The rig protocol `palpate-rig/1` (`docs/rig-protocol.md`): its JSON and what it means.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use schemars::{JsonSchema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::document::{hold_against, parse, without_nulls};
use super::images::{read_color, read_depth};
use super::json::{ShapeJson, SupportJson, ToolJson};
use super::read::{camera, noise_of};
use super::rig_json::{DescriptionJson, DoneJson, ReachJson, Rows, TouchedJson, ViewJson};
use super::streams::{pose_of, read_normals, read_tool_path, read_track, read_wrench, unit_vector};
use super::{BodyPrior, Camera, Interaction, Reach, RigDescription, Support, Tool, ToolShape, Touch, View};
use crate::base::{Error, Pose, Result, read_bytes};

/// The value of `protocol` that this version speaks.
pub const RIG_PROTOCOL: &str = "palpate-rig/1";

/// One line of a rig, with the name that errors give it.
pub(super) struct Line {
    pub name: PathBuf,
    pub text: String,
}

impl Line {
    fn bad(&self, place: &str, found: impl Into<String>, expected: &str) -> Error {
        Error::bad_input(&self.name, place, found, expected)
    }

    /// Why the rig refused, if it did.
    pub fn refusal(&self) -> Result<Option<String>> {
        let value = parse(&self.name, self.text.as_bytes())?;
        let Some(why) = value.get("refused") else {
            return Ok(None);
        };
        let text = why.as_str().map(str::to_owned);
        text.map(Some)
            .ok_or_else(|| self.bad("refused", why.to_string(), "the reason as a string"))
    }

    fn as_json<T: DeserializeOwned + JsonSchema>(&self) -> Result<T> {
        let value = parse(&self.name, self.text.as_bytes())?;
        hold_against(&self.name, schema_for!(T).as_value(), &value)?;
        serde_json::from_value(without_nulls(value))
            .map_err(|e| self.bad("the answer", e.to_string(), "an answer of the rig protocol"))
    }

    fn pose(&self, place: &str, seven: [f64; 7]) -> Result<Pose> {
        pose_of(&self.name, place, seven)
    }

    /// The answer to `describe`.
    pub fn description(&self) -> Result<RigDescription> {
        let d: DescriptionJson = self.as_json()?;
        if d.protocol != RIG_PROTOCOL {
            return Err(self.bad("protocol", format!("`{}`", d.protocol), RIG_PROTOCOL));
        }
        for (i, c) in d.cameras.iter().enumerate() {
            if d.cameras[..i].iter().any(|o| o.name == c.name) {
                return Err(self.bad(&format!("cameras[{i}].name"), &c.name, "a name of its own"));
            }
        }
        let mut bodies = Vec::with_capacity(d.bodies.len());
        for (i, body) in d.bodies.iter().enumerate() {
            let pose = body
                .pose
                .map(|p| self.pose(&format!("bodies[{i}].pose"), p))
                .transpose()?;
            bodies.push(BodyPrior {
                name: body.name.clone(),
                world_from_body: pose,
                ..BodyPrior::default()
            });
        }
        let support = d.support.map(|s| self.support(s)).transpose()?;
        self.ordered("workspace", &d.workspace.low, &d.workspace.high)?;
        Ok(RigDescription {
            name: d.name,
            gravity: Vector3::from(d.gravity),
            support,
            cameras: d.cameras.iter().map(camera).collect(),
            reach: self.reach(&d.reach)?,
            workspace: [Point3::from(d.workspace.low), Point3::from(d.workspace.high)],
            touches: d.touches,
            bodies,
            noise: d.noise.as_ref().map(noise_of).unwrap_or_default(),
            restores: d.restores,
        })
    }

    fn support(&self, s: SupportJson) -> Result<Support> {
        let normal = unit_vector(s.normal)
            .map_err(|length| self.bad("support.normal", format!("length {length}"), "a unit vector"))?;
        Ok(Support {
            point: Point3::from(s.point),
            normal,
            material: s.material,
            friction: None,
        })
    }

    fn ordered(&self, place: &str, low: &[f64], high: &[f64]) -> Result<()> {
        if low.iter().zip(high).all(|(a, b)| a < b) {
            return Ok(());
        }
        let found = format!("{low:?} to {high:?}");
        Err(self.bad(place, found, "the lower end below the upper one in every number"))
    }

    fn reach(&self, reach: &ReachJson) -> Result<Reach> {
        match (&reach.poses, &reach.dome, &reach.room) {
            (Some(poses), None, None) if !poses.is_empty() => {
                let of = |(i, p): (usize, &[f64; 7])| self.pose(&format!("reach.poses[{i}]"), *p);
                Ok(Reach::Poses(poses.iter().enumerate().map(of).collect::<Result<_>>()?))
            }
            (None, Some(dome), None) => {
                let sound = |r: &[f64; 2], most: f64| r[0] > 0.0 && r[0] <= r[1] && r[1] <= most;
                if !sound(&dome.radius, f64::MAX) || !sound(&dome.elevation, 90.0) {
                    let found = format!("radius {:?}, elevation {:?}", dome.radius, dome.elevation);
                    return Err(self.bad(
                        "reach.dome",
                        found,
                        "two rising positive numbers each, elevation in degrees up to 90",
                    ));
                }
                Ok(Reach::Dome {
                    target: Point3::from(dome.target),
                    radius: dome.radius,
                    elevation: dome.elevation.map(f64::to_radians),
                })
            }
            (None, None, Some(room)) => {
                self.ordered("reach.box", &room.low, &room.high)?;
                Ok(Reach::Box {
                    low: Point3::from(room.low),
                    high: Point3::from(room.high),
                    target: Point3::from(room.target),
                })
            }
            _ => Err(self.bad("reach", "none or several", "one of poses (not empty), dome, box")),
        }
    }

    /// The answer to `look`.
    pub fn view(&self, cameras: &[Camera]) -> Result<View> {
        let v: ViewJson = self.as_json()?;
        let wanted = v.camera.as_deref().unwrap_or(&cameras[0].name);
        let index = cameras.iter().position(|c| c.name == wanted);
        let index = index.ok_or_else(|| self.bad("camera", wanted, "the name of a camera that was described"))?;
        let (width, height) = (cameras[index].width, cameras[index].height);
        let (file, bytes) = self
            .image("depth", v.depth.as_deref(), v.depth_png.as_deref())?
            .ok_or_else(|| self.bad("depth", "nothing", "depth (a path) or depth_png (base64)"))?;
        let color = self.image("color", v.color.as_deref(), v.color_png.as_deref())?;
        Ok(View {
            camera: index,
            time: v.time,
            world_from_camera: self.pose("pose", v.pose)?,
            depth: read_depth(&file, &bytes, width, height)?,
            color: color
                .map(|(file, bytes)| read_color(&file, &bytes, width, height))
                .transpose()?,
            labels: None,
        })
    }

    /// An image by its path, or written in place; with the name that errors give it.
    fn image(&self, key: &str, path: Option<&str>, coded: Option<&str>) -> Result<Option<(PathBuf, Vec<u8>)>> {
        match (path, coded) {
            (Some(path), None) => {
                let bytes = read_bytes(Path::new(path)).map_err(|e| match e {
                    Error::BadInput { .. } => self.bad(key, format!("`{path}`"), "the path of a PNG that can be read"),
                    other => other,
                })?;
                Ok(Some((PathBuf::from(format!("{}: {key}", self.name.display())), bytes)))
            }
            (None, Some(coded)) => {
                let place = format!("{key}_png");
                let bytes = from_base64(coded).ok_or_else(|| self.bad(&place, "other characters", "base64"))?;
                Ok(Some((
                    PathBuf::from(format!("{}: {place}", self.name.display())),
                    bytes,
                )))
            }
            (None, None) => Ok(None),
            _ => Err(self.bad(key, "a path and base64", "one of the two")),
        }
    }

    /// The answer to `touch`.
    pub fn interaction(&self, touch: &Touch) -> Result<Interaction> {
        let t: TouchedJson = self.as_json()?;
        const POSE: &str = "time,x,y,z,qx,qy,qz,qw";
        let mut tracks = BTreeMap::new();
        for (name, rows) in &t.tracks {
            tracks.insert(
                name.clone(),
                self.table(&format!("tracks.{name}"), POSE, rows, read_track)?,
            );
        }
        let wide = t.force.iter().flatten().all(|row| row.len() == 7);
        let header = if wide {
            "time,fx,fy,fz,tx,ty,tz"
        } else {
            "time,fx,fy,fz"
        };
        let stream = |r: &Option<Rows>| r.clone().filter(|r| !r.is_empty());
        Ok(Interaction {
            name: touch.name.clone(),
            kind: touch.kind,
            action: None,
            tool_name: None,
            tool: t.tool.as_ref().map(|tool| self.tool(tool)).transpose()?,
            target: t.target.clone().or_else(|| touch.target.clone()),
            force: stream(&t.force)
                .map(|r| self.table("force", header, &r, read_wrench))
                .transpose()?,
            tool_path: stream(&t.tool_path)
                .map(|r| self.table("tool_path", POSE, &r, read_tool_path))
                .transpose()?,
            support_path: stream(&t.support_path)
                .map(|r| self.table("support_path", "time,nx,ny,nz", &r, read_normals))
                .transpose()?,
            tracks,
            frames: None,
            held_out: touch.held_out,
        })
    }

    fn tool(&self, tool: &ToolJson) -> Result<Tool> {
        let size = tool.size.as_deref().unwrap_or_default();
        let shape = match (&tool.shape, size) {
            (ShapeJson::Sphere, [radius]) => ToolShape::Sphere { radius: *radius },
            (ShapeJson::Box, [x, y, z]) => ToolShape::Box {
                half: Vector3::new(*x, *y, *z),
            },
            (ShapeJson::Cylinder, [radius, half_height]) => ToolShape::Cylinder {
                radius: *radius,
                half_height: *half_height,
            },
            _ => {
                let expected = "sphere [radius], box [half x, y, z] or cylinder [radius, half height]";
                return Err(self.bad("tool.size", format!("{size:?}"), expected));
            }
        };
        if size.iter().any(|s| *s <= 0.0) {
            return Err(self.bad("tool.size", format!("{size:?}"), "positive numbers"));
        }
        Ok(Tool {
            shape,
            grip: tool.grip,
            pin: tool.pin,
        })
    }

    /// Rows through the reader of the same table on disk, so that one set of rules holds for both.
    fn table<T>(&self, key: &str, header: &str, rows: &Rows, read: impl Fn(&Path, &[u8]) -> Result<T>) -> Result<T> {
        let mut text = String::from(header);
        for row in rows {
            let cells: Vec<String> = row
                .iter()
                .map(|x| x.map_or(String::new(), |x| format!("{x}")))
                .collect();
            text.push('\n');
            text.push_str(&cells.join(","));
        }
        text.push('\n');
        read(Path::new(&format!("{}: {key}", self.name.display())), text.as_bytes())
    }

    /// The answer to `done`.
    pub fn farewell(&self) -> Result<()> {
        let said: DoneJson = self.as_json()?;
        if said.done {
            return Ok(());
        }
        Err(self.bad("done", "false", "true"))
    }
}

/// The line that asks for a look.
pub(super) fn ask_look(camera: &str, world_from_camera: &Pose) -> Value {
    json!({ "ask": "look", "camera": camera, "pose": world_from_camera.to_seven() })
}

/// The line that asks for a touch.
pub(super) fn ask_touch(touch: &Touch) -> Value {
    json!({
        "ask": "touch", "name": touch.name, "kind": touch.kind, "target": touch.target,
        "start": [touch.start.x, touch.start.y, touch.start.z],
        "direction": [touch.direction.x, touch.direction.y, touch.direction.z],
        "travel": touch.travel, "speed": touch.speed, "duration": touch.duration,
    })
}

/// RFC 4648, section 4; white space is passed over.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() * 3 / 4);
    let (mut word, mut bits) = (0u32, 0);
    for c in text.bytes().filter(|c| !c.is_ascii_whitespace()) {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => continue,
            _ => return None,
        };
        word = (word << 6 | u32::from(value)) & 0xff_ffff;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            out.push((word >> bits) as u8);
        }
    }
    Some(out)
}
