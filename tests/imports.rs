//! `palpate import mcap` and `import bop` on small files that are made here.
#![allow(clippy::expect_used, clippy::panic, reason = "a test says what it found and stops")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use byteorder::{BigEndian, LittleEndian};
use mcap::records::MessageHeader;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use palpate::capture::{Capture, read_capture, read_frame};
use serde::Serialize;

fn palpate(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// Imports, and reads what came out.
fn imported(words: &[&str], out: &Path) -> Capture {
    let done = palpate(&[&["import"], words, &["--out", text(out)]].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    read_capture(out).expect("a capture that reads back")
}

/// Is refused with exit code 2 and a message that holds `said`; nothing is written.
fn refused(words: &[&str], out: &Path, said: &str) {
    let done = palpate(&[&["import"], words, &["--out", text(out)]].concat());
    let error = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{error}");
    assert!(error.contains(said), "{error}");
    assert!(!out.exists(), "something was written");
}

// --- ROS 2 messages, as their .msg files have them

#[derive(Serialize)]
struct Header {
    stamp: (i32, u32),
    frame_id: String,
}

fn header(seconds: f64, frame: &str) -> Header {
    let whole = seconds.floor();
    Header {
        stamp: (whole as i32, ((seconds - whole) * 1e9).round() as u32),
        frame_id: frame.into(),
    }
}

#[derive(Serialize)]
struct Image {
    header: Header,
    height: u32,
    width: u32,
    encoding: String,
    is_bigendian: u8,
    step: u32,
    data: Vec<u8>,
}

#[derive(Serialize)]
struct Region(u32, u32, u32, u32, bool);

#[derive(Serialize)]
struct CameraInfo {
    header: Header,
    height: u32,
    width: u32,
    distortion_model: String,
    d: Vec<f64>,
    k: [f64; 9],
    r: [f64; 9],
    p: [f64; 12],
    binning: (u32, u32),
    roi: Region,
}

#[derive(Serialize)]
struct PoseStamped(Header, [f64; 3], [f64; 4]);

#[derive(Serialize)]
struct TransformStamped(Header, String, [f64; 3], [f64; 4]);

#[derive(Serialize)]
struct Transforms(Vec<TransformStamped>);

#[derive(Serialize)]
struct WrenchStamped(Header, [f64; 3], [f64; 3]);

fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 4]) {
    let q = pose.rotation;
    (pose.translation.vector.into(), [q.i, q.j, q.k, q.w])
}

fn little<T: Serialize>(message: &T) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(cdr_encoding::to_vec::<T, LittleEndian>(message).expect("encoded"));
    bytes
}

fn big<T: Serialize>(message: &T) -> Vec<u8> {
    let mut bytes = vec![0, 0, 0, 0];
    bytes.extend(cdr_encoding::to_vec::<T, BigEndian>(message).expect("encoded"));
    bytes
}

/// A file that takes messages by topic.
struct Bag {
    writer: mcap::Writer<std::io::BufWriter<fs::File>>,
    channels: BTreeMap<String, u16>,
}

impl Bag {
    fn create(path: &Path) -> Self {
        let file = std::io::BufWriter::new(fs::File::create(path).expect("created"));
        Self {
            writer: mcap::Writer::new(file).expect("a writer"),
            channels: BTreeMap::new(),
        }
    }

    fn add(&mut self, topic: &str, schema: &str, encoding: &str, bytes: &[u8]) {
        let writer = &mut self.writer;
        let channel = *self.channels.entry(topic.to_owned()).or_insert_with(|| {
            let schema = writer.add_schema(schema, "ros2msg", b"").expect("a schema");
            writer
                .add_channel(schema, topic, encoding, &BTreeMap::new())
                .expect("a channel")
        });
        let header = MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        self.writer.write_to_known_channel(&header, bytes).expect("written");
    }

    fn cdr<T: Serialize>(&mut self, topic: &str, schema: &str, message: &T) {
        self.add(topic, schema, "cdr", &little(message));
    }

    fn finish(mut self) {
        self.writer.finish().expect("finished");
    }
}

const POSE: &str = "geometry_msgs/msg/PoseStamped";
const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";
const TREE: &str = "tf2_msgs/msg/TFMessage";

/// Where the arm's tip is at a time.
fn tip(t: f64) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.1 * t, 0.0, 0.2), Vector3::z() * 0.5 * t)
}

/// The wrist's sensor on the tip.
fn sensor_on_tip() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.0, 0.0, 0.05), Vector3::x() * std::f64::consts::FRAC_PI_2)
}

fn pushes(path: &Path) {
    let mut bag = Bag::create(path);
    let (at, turn) = parts(&sensor_on_tip());
    let fixed = TransformStamped(header(0.0, "tip"), "wrist".into(), at, turn);
    bag.cdr("/tf_static", TREE, &Transforms(vec![fixed]));
    for i in 0..11 {
        let t = 100.0 + 0.1 * f64::from(i);
        let (at, turn) = parts(&tip(t - 100.0));
        let moved = TransformStamped(header(t, "world"), "tip".into(), at, turn);
        bag.cdr("/tf", TREE, &Transforms(vec![moved]));
        let box_at = PoseStamped(header(t, "world"), [0.3, 0.1 * f64::from(i), 0.0], [0.0, 0.0, 0.0, 1.0]);
        bag.add("/mocap/box", POSE, "cdr", &big(&box_at));
        bag.cdr(
            "/wrist",
            WRENCH,
            &WrenchStamped(header(t, "wrist"), [0.0, 2.0, 0.0], [0.1, 0.0, 0.0]),
        );
    }
    bag.finish();
}

#[test]
fn a_push_with_tracks_tool_and_force() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (bag, out) = (dir.path().join("push.mcap"), dir.path().join("capture"));
    pushes(&bag);
    let words = [
        "mcap",
        text(&bag),
        "--kind",
        "push",
        "--track",
        "box=/mocap/box",
        "--tool",
        "tf:tip",
        "--tool-radius",
        "0.006",
        "--force",
        "/wrist",
        "--target",
        "box",
    ];
    let capture = imported(&words, &out);
    let push = &capture.interactions[0];
    assert_eq!(push.kind.name(), "push");
    assert_eq!(push.target.as_deref(), Some("box"));
    let track = &push.tracks["box"];
    assert_eq!(track.len(), 11);
    assert!((track.time[3] - 100.3).abs() < 1e-6 && (track.position[3].y - 0.3).abs() < 1e-8);
    let tool = push.tool_path.as_ref().expect("a way");
    let force = push.force.as_ref().expect("forces");
    let torque = force.torque.as_ref().expect("torques");
    assert_eq!(torque.len(), 11);
    for (i, felt) in torque.iter().enumerate() {
        let world_from_tip = tip(0.1 * i as f64);
        let found = tool.pose(i).expect("a pose");
        assert!((found.translation.vector - world_from_tip.translation.vector).norm() < 1e-8);
        assert!(found.rotation.angle_to(&world_from_tip.rotation) < 1e-6);
        // The sensor's y is the tip's z: the force is up; its arm about the tip is along it, and adds no torque.
        assert!(
            (force.force[i] - Vector3::new(0.0, 0.0, 2.0)).norm() < 1e-6,
            "{}",
            force.force[i]
        );
        let expected = world_from_tip.rotation * Vector3::new(0.1, 0.0, 0.0);
        assert!((felt - expected).norm() < 1e-6, "{felt}");
    }
    let turned = imported(&[&words[..], &["--reaction"]].concat(), &dir.path().join("reaction"));
    let force = turned.interactions[0].force.as_ref().expect("forces");
    assert!((force.force[0].z + 2.0).abs() < 1e-6);
}

#[test]
fn poses_and_transforms_in_json() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (bag, out) = (dir.path().join("a.mcap"), dir.path().join("capture"));
    let mut made = Bag::create(&bag);
    let moved = r#"{"timestamp":{"sec":1,"nsec":0},"parent_frame_id":"world","child_frame_id":"base","translation":{"x":1.0,"y":0.0,"z":0.0},"rotation":{"x":0.0,"y":0.0,"z":0.0,"w":1.0}}"#;
    made.add("/tf_static", "foxglove.FrameTransform", "json", moved.as_bytes());
    let pose = r#"{"timestamp":{"sec":1,"nsec":500000000},"frame_id":"base","pose":{"position":{"x":0.25,"y":0.0,"z":0.0},"orientation":{"x":0.0,"y":0.0,"z":0.0,"w":1.0}}}"#;
    made.add("/cup", "foxglove.PoseInFrame", "json", pose.as_bytes());
    made.add(
        "/cup",
        "foxglove.PoseInFrame",
        "json",
        pose.replace("500000000", "600000000").as_bytes(),
    );
    made.finish();
    let capture = imported(&["mcap", text(&bag), "--track", "cup=/cup"], &out);
    let track = &capture.interactions[0].tracks["cup"];
    assert_eq!(track.time, [1.5, 1.6]);
    assert!((track.position[0].x - 1.25).abs() < 1e-9);
}

fn image(t: f64, encoding: &str, step: u32, data: Vec<u8>) -> Image {
    Image {
        header: header(t, "optical"),
        height: 2,
        width: 3,
        encoding: encoding.into(),
        is_bigendian: 0,
        step,
        data,
    }
}

fn filmed(path: &Path, encoding: &str) {
    let mut bag = Bag::create(path);
    for i in 0..4 {
        let t = 5.0 + f64::from(i);
        let seen = Isometry3::new(
            Vector3::new(f64::from(i), 0.0, 1.0),
            Vector3::x() * std::f64::consts::PI,
        );
        let (at, turn) = parts(&seen);
        let moved = TransformStamped(header(t, "world"), "optical".into(), at, turn);
        bag.cdr("/tf", TREE, &Transforms(vec![moved]));
        let info = CameraInfo {
            header: header(t, "optical"),
            height: 2,
            width: 3,
            distortion_model: "plumb_bob".into(),
            d: vec![0.1, 0.0, 0.0, 0.0, 0.0],
            k: [300.0, 0.0, 1.0, 0.0, 310.0, 0.5, 0.0, 0.0, 1.0],
            r: [0.0; 9],
            p: [0.0; 12],
            binning: (0, 0),
            roi: Region(0, 0, 0, 0, false),
        };
        bag.cdr("/info", "sensor_msgs/msg/CameraInfo", &info);
        // Rows are padded by two bytes.
        let depth = match encoding {
            "16UC1" => {
                let row = |v: u16| [v.to_le_bytes(), 0_u16.to_le_bytes(), 500_u16.to_le_bytes(), [9, 9]].concat();
                image(t, encoding, 8, [row(1000), row(2000)].concat())
            }
            _ => {
                let pixels = [1.0_f32, f32::NAN, 0.5, 2.0, f32::INFINITY, 0.5];
                image(t, encoding, 12, pixels.iter().flat_map(|p| p.to_le_bytes()).collect())
            }
        };
        bag.cdr("/depth", "sensor_msgs/msg/Image", &depth);
        bag.cdr(
            "/color",
            "sensor_msgs/msg/Image",
            &image(t + 0.005, "bgr8", 9, (0..18).collect()),
        );
    }
    bag.finish();
}

#[test]
fn images_become_frames_or_views() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for (encoding, unit, counts) in [
        ("16UC1", 1e-3, [1000, 0, 500, 2000, 0, 500]),
        ("32FC1", 1e-4, [10000, 0, 5000, 20000, 0, 5000]),
    ] {
        let bag = dir.path().join(format!("{encoding}.mcap"));
        filmed(&bag, encoding);
        let words = [
            "mcap",
            text(&bag),
            "--depth",
            "/depth",
            "--color",
            "/color",
            "--camera-info",
            "/info",
        ];
        let capture = imported(&words, &dir.path().join(format!("frames-{encoding}")));
        let camera = &capture.cameras[0];
        assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [300.0, 310.0, 1.0, 0.5]);
        assert_eq!((camera.distortion[0], camera.depth_unit), (0.1, unit));
        let frames = capture.interactions[0].frames.as_ref().expect("frames");
        assert_eq!(frames.time, [5.0, 6.0, 7.0, 8.0]);
        assert!((frames.pose(2).expect("a pose").translation.x - 2.0).abs() < 1e-8);
        let (depth, color) = read_frame(&capture, frames, 1).expect("an image");
        assert_eq!(depth.counts, counts);
        assert_eq!(color.expect("colour").rgb[0], [2, 1, 0]);
        let still = [&words[..], &["--still", "--every", "2"]].concat();
        let capture = imported(&still, &dir.path().join(format!("views-{encoding}")));
        assert_eq!(capture.views.len(), 2);
        assert_eq!(capture.views[1].depth.counts, counts);
        assert!((capture.views[1].world_from_camera.translation.x - 2.0).abs() < 1e-8);
    }
}

#[test]
fn what_cannot_be_read_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (bag, out) = (dir.path().join("push.mcap"), dir.path().join("capture"));
    pushes(&bag);
    let file = text(&bag);
    refused(
        &["mcap", file],
        &out,
        "/mocap/box (11 of geometry_msgs/msg/PoseStamped in cdr)",
    );
    refused(
        &["mcap", file, "--track", "box=/nothing"],
        &out,
        "topic /nothing: found no message of it",
    );
    refused(
        &["mcap", file, "--track", "box=/wrist"],
        &out,
        "message 1 of /wrist: found geometry_msgs/msg/WrenchStamped",
    );
    refused(&["mcap", file, "--track", "box=tf:elbow"], &out, "the frame \"elbow\"");
    refused(&["mcap", file, "--track", "box"], &out, "expected NAME=PLACE");
    refused(
        &["mcap", file, "--track", "box=/mocap/box", "--world", "map"],
        &out,
        "lead to map",
    );
    refused(
        &["mcap", file, "--depth", "/mocap/box"],
        &out,
        "--depth and --camera-info go together",
    );
    refused(
        &["mcap", file, "--track", "box=/mocap/box", "--kind", "nudge"],
        &out,
        "--kind nudge",
    );
    fs::write(&bag, b"not a bag").expect("written");
    refused(
        &["mcap", file, "--track", "box=/mocap/box"],
        &out,
        "expected an MCAP file",
    );

    let mut made = Bag::create(&bag);
    made.add("/ros1", "geometry_msgs/PoseStamped", "ros1", &[0; 8]);
    made.add("/proto", POSE, "protobuf", &[0; 8]);
    made.add("/short", POSE, "cdr", &[0, 1, 0, 0, 7]);
    made.cdr(
        "/turned",
        POSE,
        &PoseStamped(header(0.0, "world"), [0.0; 3], [0.0, 0.0, 0.0, 2.0]),
    );
    made.finish();
    refused(
        &["mcap", file, "--track", "a=/ros1"],
        &out,
        "found geometry_msgs/PoseStamped",
    );
    refused(
        &["mcap", file, "--track", "a=/proto"],
        &out,
        "the encoding protobuf, expected cdr (ROS 2) or json",
    );
    refused(
        &["mcap", file, "--track", "a=/short"],
        &out,
        "expected a whole message in plain CDR",
    );
    refused(&["mcap", file, "--track", "a=/turned"], &out, "a unit quaternion");
}

// --- BOP

fn png16(path: &Path, counts: &[u16]) {
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, counts.to_vec()).expect("an image");
    image.save(path).expect("saved");
}

fn row_major(r: &UnitQuaternion<f64>) -> Vec<f64> {
    r.to_rotation_matrix().matrix().transpose().iter().copied().collect()
}

/// A scene of two images of two things that stand still, one of them twice; poses in the world.
fn bop_scene(root: &Path, told: bool, creep: f64) -> (PathBuf, [Isometry3<f64>; 2], Isometry3<f64>) {
    let scene = root.join("test/000001");
    fs::create_dir_all(scene.join("depth")).expect("a folder");
    fs::create_dir_all(scene.join("mask_visib")).expect("a folder");
    fs::create_dir_all(root.join("models")).expect("a folder");
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n100 0 0\n0 50 0\n3 0 1 2\n";
    fs::write(root.join("models/obj_000005.ply"), ply).expect("written");
    let things = [
        Isometry3::new(Vector3::new(0.1, 0.0, 0.0), Vector3::z() * 0.3),
        Isometry3::new(Vector3::new(-0.1, 0.2, 0.0), Vector3::z() * -0.7),
    ];
    let camera = Isometry3::new(Vector3::new(0.0, 0.0, 1.0), Vector3::x() * 3.0);
    let (mut cameras, mut truth) = (serde_json::Map::new(), serde_json::Map::new());
    for i in 0..2_u32 {
        let world_from_camera = Isometry3::translation(0.05 * f64::from(i), 0.0, 0.0) * camera;
        let camera_from_world = world_from_camera.inverse();
        let mm = |v: &Vector3<f64>| (v * 1e3).iter().copied().collect::<Vec<f64>>();
        let mut entry =
            serde_json::json!({"cam_K": [300.0, 0.0, 1.0, 0.0, 310.0, 0.5, 0.0, 0.0, 1.0], "depth_scale": 0.1});
        if told {
            entry["cam_R_w2c"] = row_major(&camera_from_world.rotation).into();
            entry["cam_t_w2c"] = mm(&camera_from_world.translation.vector).into();
        }
        cameras.insert(i.to_string(), entry);
        let of = |thing: &Isometry3<f64>| {
            let m2c = camera_from_world * Isometry3::translation(creep * f64::from(i), 0.0, 0.0) * thing;
            serde_json::json!({"obj_id": 5, "cam_R_m2c": row_major(&m2c.rotation), "cam_t_m2c": mm(&m2c.translation.vector)})
        };
        truth.insert(i.to_string(), things.iter().map(of).collect::<Vec<_>>().into());
        png16(&scene.join(format!("depth/{i:06}.png")), &[10000, 0, 5000, 1, 2, 3]);
        let mask = image::GrayImage::from_raw(3, 2, vec![0, 255, 0, 0, 0, 0]).expect("a mask");
        mask.save(scene.join(format!("mask_visib/{i:06}_000001.png")))
            .expect("saved");
    }
    let write =
        |name: &str, map| fs::write(scene.join(name), serde_json::Value::Object(map).to_string()).expect("written");
    write("scene_camera.json", cameras);
    write("scene_gt.json", truth);
    (scene, things, camera)
}

#[test]
fn a_bop_scene_becomes_views_with_known_things() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (scene, things, camera) = bop_scene(dir.path(), true, 0.0);
    let capture = imported(&["bop", text(&scene)], &dir.path().join("capture"));
    assert_eq!(capture.views.len(), 2);
    assert_eq!(capture.cameras.len(), 1);
    assert!((capture.cameras[0].depth_unit - 1e-4).abs() < 1e-12);
    let seen = &capture.views[1];
    assert_eq!(seen.depth.counts, [10000, 0, 5000, 1, 2, 3]);
    assert_eq!(seen.labels.as_ref().expect("labels").ids, [0, 2, 0, 0, 0, 0]);
    assert!((seen.world_from_camera.translation.vector - Vector3::new(0.05, 0.0, 1.0)).norm() < 1e-9);
    assert!(seen.world_from_camera.rotation.angle_to(&camera.rotation) < 1e-7);
    for (name, pose) in [("obj_000005", things[0]), ("obj_000005_2", things[1])] {
        let body = capture.prior(name).expect("a known thing");
        let found = body.world_from_body.expect("a pose");
        assert!((found.translation.vector - pose.translation.vector).norm() < 1e-9);
        assert!(found.rotation.angle_to(&pose.rotation) < 1e-7);
        let mesh = String::from_utf8(body.mesh.as_ref().expect("a shape").bytes.clone()).expect("an OBJ");
        assert!(
            mesh.lines().any(|l| l.starts_with("v 0.1000000 ")),
            "not in metres: {mesh}"
        );
    }
}

#[test]
fn a_bop_scene_without_camera_poses_takes_a_thing_for_its_world() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (scene, things, _) = bop_scene(dir.path(), false, 0.0);
    let out = dir.path().join("capture");
    refused(&["bop", text(&scene)], &out, "--world-object");
    refused(&["bop", text(&scene), "--world-object", "7"], &out, "no thing 7");
    let capture = imported(&["bop", text(&scene), "--world-object", "5"], &out);
    let other = capture
        .prior("obj_000005_2")
        .expect("known")
        .world_from_body
        .expect("a pose");
    let expected = things[0].inverse() * things[1];
    assert!((other.translation.vector - expected.translation.vector).norm() < 1e-9);
}

#[test]
fn things_that_move_in_a_bop_scene_are_tracked() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (scene, things, _) = bop_scene(dir.path(), true, 0.02);
    let out = dir.path().join("capture");
    refused(&["bop", text(&scene)], &out, "moves between the images");
    let capture = imported(&["bop", text(&scene), "--moving", "--rate", "10"], &out);
    let track = &capture.interactions[0].tracks["obj_000005"];
    assert_eq!(track.time, [0.0, 0.1]);
    assert!((track.position[1].x - things[0].translation.x - 0.02).abs() < 1e-8);
    fs::remove_file(scene.join("depth/000001.png")).expect("removed");
    refused(
        &["bop", text(&scene), "--moving"],
        &dir.path().join("other"),
        "000001.png: the file: found nothing",
    );
}
