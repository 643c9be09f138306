//! Just enough of a reader to look at recorded captures: views and tracks.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, UnitVector3, Vector3};
use serde_json::Value;

use crate::base::Pose;
use crate::capture::*;

fn numbers<const N: usize>(v: &Value) -> [f64; N] {
    std::array::from_fn(|i| v[i].as_f64().unwrap())
}

pub fn load(folder: &Path) -> Capture {
    let json: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("capture.json")).unwrap()).unwrap();
    let list = |key: &str| json[key].as_array().cloned().unwrap_or_default();
    let support = json.get("support").map(|s| Support {
        point: Point3::from(numbers::<3>(&s["point"])),
        normal: UnitVector3::new_normalize(Vector3::from(numbers::<3>(&s["normal"]))),
        material: None,
        friction: None,
    });
    Capture {
        root: folder.to_path_buf(),
        name: json["name"].as_str().unwrap().into(),
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        support,
        cameras: list("cameras").iter().map(camera).collect(),
        views: list("views").iter().map(|v| view(folder, v)).collect(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: list("interactions").iter().map(|i| interaction(folder, i)).collect(),
        truth: None,
        digest: String::new(),
    }
}

fn camera(c: &Value) -> Camera {
    let get = |k: &str, or: f64| c[k].as_f64().unwrap_or(or);
    Camera {
        name: c["name"].as_str().unwrap().into(),
        width: get("width", 0.0) as u32,
        height: get("height", 0.0) as u32,
        fx: get("fx", 0.0),
        fy: get("fy", 0.0),
        cx: get("cx", 0.0),
        cy: get("cy", 0.0),
        distortion: c.get("distortion").map_or([0.0; 5], numbers::<5>),
        depth_unit: get("depth_unit", 0.001),
        depth_min: get("depth_min", 0.0),
        depth_max: get("depth_max", 10.0),
        depth_sd: c["depth_sd"].as_f64(),
    }
}

fn view(folder: &Path, v: &Value) -> View {
    let open = |key: &str| image::open(folder.join(v[key].as_str().unwrap())).unwrap();
    let depth = open("depth").into_luma16();
    let color = open("color").into_rgb8();
    View {
        camera: 0,
        time: v["time"].as_f64().unwrap(),
        world_from_camera: Pose::from_seven(numbers::<7>(&v["pose"])),
        depth: DepthImage {
            width: depth.width(),
            height: depth.height(),
            counts: depth.into_raw(),
        },
        color: Some(ColorImage {
            width: color.width(),
            height: color.height(),
            rgb: color.pixels().map(|p| p.0).collect(),
        }),
        labels: None,
    }
}

fn interaction(folder: &Path, i: &Value) -> Interaction {
    let tracks = i["tracks"].as_object().cloned().unwrap_or_default();
    let tracks: BTreeMap<String, PoseStream> = tracks
        .iter()
        .map(|(name, path)| (name.clone(), track(&folder.join(path.as_str().unwrap()))))
        .collect();
    Interaction {
        name: i["name"].as_str().unwrap().into(),
        kind: Kind::Push,
        action: None,
        tool_name: None,
        tool: None,
        target: None,
        force: None,
        tool_path: None,
        support_path: None,
        tracks,
        frames: None,
        held_out: false,
    }
}

fn track(path: &Path) -> PoseStream {
    let mut stream = PoseStream::default();
    for line in std::fs::read_to_string(path).unwrap().lines().skip(1).take(400) {
        let x: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
        stream.time.push(x[0]);
        stream.position.push(Point3::new(x[1], x[2], x[3]));
        let q = UnitQuaternion::from_quaternion(Quaternion::new(x[7], x[4], x[5], x[6]));
        stream.rotation.push(x[7].is_finite().then_some(q));
    }
    let _ = Isometry3::<f64>::identity();
    stream
}
