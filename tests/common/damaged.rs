//! Captures that are damaged in one place each, and what their refusal must name.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

/// One way to damage the good capture.
pub struct Damage {
    /// What was done, as the name of a folder.
    pub name: &'static str,
    /// Does it, in the folder of a good capture.
    pub damage: fn(&Path),
    /// A part of the name of the file that the message must name.
    pub file: &'static str,
    /// The place that the message must name, with the words around it that matter.
    pub place: &'static str,
}

const PUSH_FORCE: &str = "interactions/push-00/force.csv";
const PUSH_TOOL: &str = "interactions/push-00/tool.csv";
const PUSH_TRACK: &str = "interactions/push-00/track.box.csv";
const TILT: &str = "interactions/tilt-00/support.csv";
const LID: &str = "interactions/tilt-00/track.box-lid.csv";
const INDEX: &str = "interactions/watch-00/frames.csv";
const DEPTH: &str = "views/000000.depth.png";

fn json(folder: &Path, edit: impl Fn(&mut Value)) {
    let path = folder.join("capture.json");
    let mut value: Value = serde_json::from_slice(&fs::read(&path).expect("read")).expect("parsed");
    edit(&mut value);
    fs::write(path, serde_json::to_string_pretty(&value).expect("printed")).expect("written");
}

/// Sets (or with null and `remove`, takes away) the value at a JSON pointer.
fn set(folder: &Path, pointer: &str, new: Value) {
    json(folder, |value| {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        match value.pointer_mut(parent).expect("there is such a key") {
            Value::Array(list) => list[key.parse::<usize>().expect("an index")] = new.clone(),
            parent => parent[key] = new.clone(),
        }
    });
}

fn remove(folder: &Path, pointer: &str) {
    json(folder, |value| {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let map = value
            .pointer_mut(parent)
            .and_then(Value::as_object_mut)
            .expect("an object");
        map.shift_remove(key).expect("there was such a key");
    });
}

fn text(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(file);
    let before = fs::read_to_string(&path).expect("read");
    assert!(before.contains(from), "{file} has no {from}: {before}");
    fs::write(path, before.replacen(from, to, 1)).expect("written");
}

/// Replaces one field of row `row` (from 1, under the header).
fn field(folder: &Path, file: &str, row: usize, column: usize, new: &str) {
    let path = folder.join(file);
    let before = fs::read_to_string(&path).expect("read");
    let mut lines: Vec<String> = before.lines().map(str::to_owned).collect();
    let mut fields: Vec<&str> = lines[row].split(',').collect();
    fields[column] = new;
    let joined = fields.join(",");
    lines[row] = joined;
    fs::write(path, lines.join("\n") + "\n").expect("written");
}

fn cut(folder: &Path, file: &str, keep: usize) {
    let path = folder.join(file);
    let bytes = fs::read(&path).expect("read");
    fs::write(path, &bytes[..keep.min(bytes.len())]).expect("written");
}

fn copy(folder: &Path, from: &str, to: &str) {
    fs::copy(folder.join(from), folder.join(to)).expect("copied");
}

fn png(folder: &Path, file: &str, image: image::DynamicImage) {
    image.save(folder.join(file)).expect("painted");
}

macro_rules! damages {
    ($($name:literal: $damage:expr => $file:expr, $place:literal;)*) => {
        vec![$(Damage { name: $name, damage: $damage, file: $file, place: $place }),*]
    };
}

/// All of them.
pub fn damages() -> Vec<Damage> {
    let mut all = of_the_document();
    all.extend(of_the_scene());
    all.extend(of_interactions());
    all.extend(of_streams());
    all.extend(of_files());
    all
}

fn of_the_document() -> Vec<Damage> {
    damages! {
        "no-capture-json": |f| fs::remove_file(f.join("capture.json")).expect("removed") => "capture.json", "found no such file";
        "a-file-for-a-folder": |f| { fs::remove_dir_all(f).expect("removed"); fs::write(f, "x").expect("written") }
            => "a-file-for-a-folder", "found a file";
        "no-folder": |f| fs::remove_dir_all(f).expect("removed") => "no-folder", "no such folder";
        "empty-document": |f| cut(f, "capture.json", 0) => "capture.json", "line 1, column 0";
        "cut-document": |f| cut(f, "capture.json", 300) => "capture.json", "line ";
        "syntax": |f| text(f, "capture.json", "\"name\": \"good\",", "\"name\": \"good\"") => "capture.json", "line 4, column 3";
        "not-a-number": |f| text(f, "capture.json", "-9.81", "NaN") => "capture.json", "line 7, column";
        "huge-number": |f| text(f, "capture.json", "-9.81", "-1e999") => "capture.json", "number out of range";
        "key-twice": |f| text(f, "capture.json", "\"name\": \"good\",", "\"name\": \"good\", \"name\": \"better\",")
            => "capture.json", "the key `name` a second time";
        "not-utf-8": |f| fs::write(f.join("capture.json"), b"{\"format\": \"\xff\"}").expect("written") => "capture.json", "line 1";
        "not-an-object": |f| fs::write(f.join("capture.json"), "[1, 2]").expect("written") => "capture.json", "the document: found a list of 2";
        "other-format": |f| set(f, "/format", json!("palpate-capture/2"))
            => "capture.json", "format: found `palpate-capture/2`, expected `palpate-capture/1`";
        "no-format": |f| remove(f, "/format") => "capture.json", "format: found nothing";
        "format-is-a-number": |f| set(f, "/format", json!(1)) => "capture.json", "format: found 1, expected a string";
        "no-name": |f| remove(f, "/name") => "capture.json", "name: found nothing";
        "name-with-a-slash": |f| set(f, "/name", json!("../good")) => "capture.json", "name: found `../good`";
        "unknown-key": |f| set(f, "/gravty", json!([0, 0, -9.8])) => "capture.json", "gravty: found an unknown key, expected";
        "unknown-key-within": |f| set(f, "/interactions/0/tool/sise", json!([0.1]))
            => "capture.json", "interactions[0].tool.sise: found an unknown key, expected one of shape, size, mesh, grip, pin (did you mean `size`?)";
        "nothing-measured": |f| { set(f, "/views", json!([])); set(f, "/interactions", json!([])) }
            => "capture.json", "views, interactions: found neither";
        "truth-outside": |f| set(f, "/truth", json!("../truth.json")) => "capture.json", "truth: found `../truth.json`, which leaves the folder";
    }
}

fn of_the_scene() -> Vec<Damage> {
    damages! {
        "no-gravity": |f| set(f, "/gravity", json!([0, 0, 0])) => "capture.json", "gravity: found a vector of length 0";
        "gravity-in-millimetres": |f| set(f, "/gravity", json!([0, 0, -9806.65])) => "capture.json", "gravity: found";
        "gravity-of-two": |f| set(f, "/gravity", json!([0, -9.81])) => "capture.json", "gravity: found a list of 2, expected a list of 3";
        "normal-not-unit": |f| set(f, "/support/normal", json!([0, 0, 1.01])) => "capture.json", "support.normal: found a vector of length 1.01";
        "normal-downwards": |f| set(f, "/support/normal", json!([0, 0, -1])) => "capture.json", "support.normal: found a normal that points along gravity";
        "support-without-point": |f| remove(f, "/support/point") => "capture.json", "support.point: found nothing";
        "negative-friction": |f| set(f, "/support/friction/static", json!(-0.1)) => "capture.json", "support.friction.static: found -0.1";
        "friction-spread-of-zero": |f| set(f, "/support/friction/static_sd", json!(0)) => "capture.json", "support.friction.static_sd: found 0";
        "friction-spread-alone": |f| remove(f, "/support/friction/static") => "capture.json", "support.friction.static_sd: found 0.02, expected the coefficient static";
        "camera-twice": |f| json(f, |v| { let c = v["cameras"][0].clone(); v["cameras"].as_array_mut().expect("a list").push(c) })
            => "capture.json", "cameras[1].name: found `wrist` a second time";
        "focal-length-of-zero": |f| set(f, "/cameras/0/fx", json!(0)) => "capture.json", "cameras[0].fx: found 0, expected a number above 0";
        "negative-width": |f| set(f, "/cameras/0/width", json!(-8)) => "capture.json", "cameras[0].width: found -8";
        "width-not-whole": |f| set(f, "/cameras/0/width", json!(8.5)) => "capture.json", "cameras[0].width: found 8.5, expected a whole number";
        "width-too-large": |f| set(f, "/cameras/0/width", json!(5_000_000_000_u64)) => "capture.json", "cameras[0].width: found 5000000000";
        "depth-unit-of-zero": |f| set(f, "/cameras/0/depth_unit", json!(0.0)) => "capture.json", "cameras[0].depth_unit: found 0.0";
        "depth-range-empty": |f| set(f, "/cameras/0/depth_max", json!(0.05)) => "capture.json", "cameras[0].depth_max: found 0.05";
        "distortion-of-four": |f| set(f, "/cameras/0/distortion", json!([0, 0, 0, 0])) => "capture.json", "cameras[0].distortion: found a list of 4";
        "unknown-camera": |f| set(f, "/views/1/camera", json!("wirst")) => "capture.json", "views[1].camera: found an unknown camera `wirst`, expected one of wrist (did you mean `wrist`?)";
        "view-pose-not-unit": |f| set(f, "/views/0/pose", json!([0, 0, 1, 0, 0, 0, 1.01])) => "capture.json", "views[0].pose: found a quaternion of length 1.01";
        "view-pose-of-six": |f| set(f, "/views/0/pose", json!([0, 0, 1, 0, 0, 0])) => "capture.json", "views[0].pose: found a list of 6, expected a list of 7";
        "view-without-time": |f| remove(f, "/views/0/time") => "capture.json", "views[0].time: found nothing";
        "negative-mass": |f| set(f, "/bodies/0/mass", json!(-0.4)) => "capture.json", "bodies[0].mass: found -0.4, expected a number above 0";
        "negative-spread": |f| set(f, "/bodies/0/mass_sd", json!(-0.1)) => "capture.json", "bodies[0].mass_sd: found -0.1";
        "spread-without-mass": |f| remove(f, "/bodies/0/mass") => "capture.json", "bodies[0].mass_sd: found a spread without a mass";
        "body-twice": |f| json(f, |v| { let b = v["bodies"][0].clone(); v["bodies"].as_array_mut().expect("a list").push(b) })
            => "capture.json", "bodies[1].name: found `box` a second time";
        "body-name-too-deep": |f| set(f, "/bodies/0/name", json!("a/b/c")) => "capture.json", "bodies[0].name: found `a/b/c`";
        "body-pose-not-unit": |f| set(f, "/bodies/0/pose", json!([0, 0, 0, 0, 0, 0, 0])) => "capture.json", "bodies[0].pose: found a quaternion of length 0";
        "mesh-of-unknown-kind": |f| set(f, "/bodies/0/mesh", json!("meshes/box.step")) => "capture.json", "bodies[0].mesh: found `meshes/box.step`";
        "negative-noise": |f| set(f, "/noise/force", json!(-0.02)) => "capture.json", "noise.force: found -0.02";
    }
}

fn of_interactions() -> Vec<Damage> {
    damages! {
        "interaction-twice": |f| set(f, "/interactions/1/name", json!("push-00")) => "capture.json", "interactions[1].name: found `push-00` a second time";
        "unknown-kind": |f| set(f, "/interactions/0/kind", json!("shove")) => "capture.json", "interactions[0].kind: found `shove`, expected one of push, pull";
        "no-kind": |f| remove(f, "/interactions/0/kind") => "capture.json", "interactions[0].kind: found nothing";
        "push-of-nothing": |f| { for key in ["force", "tool_path", "tracks"] { remove(f, &format!("/interactions/0/{key}")) } }
            => "capture.json", "interactions[0]: found a push without force, tool_path or tracks";
        "hold-of-nothing": |f| remove(f, "/interactions/3/frames") => "capture.json", "interactions[3]: found an interaction of which nothing was recorded";
        "tool-without-size": |f| remove(f, "/interactions/0/tool/size") => "capture.json", "interactions[0].tool.size: found nothing, expected [radius]";
        "tool-of-negative-size": |f| set(f, "/interactions/1/tool/size", json!([0.1, -0.1, 0.1])) => "capture.json", "interactions[1].tool.size[1]: found -0.1";
        "tool-of-wrong-size": |f| set(f, "/interactions/0/tool/size", json!([0.1, 0.1])) => "capture.json", "interactions[0].tool.size: found a list of 2, expected [radius]";
        "tool-of-unknown-shape": |f| set(f, "/interactions/0/tool/shape", json!("sphre")) => "capture.json", "interactions[0].tool.shape: found `sphre`";
        "mesh-tool-without-mesh": |f| { set(f, "/interactions/0/tool/shape", json!("mesh")); remove(f, "/interactions/0/tool/size") }
            => "capture.json", "interactions[0].tool.mesh: found nothing";
        "grip-and-pin": |f| set(f, "/interactions/1/tool/pin", json!(true)) => "capture.json", "interactions[1].tool: found both grip and pin";
        "held-out-in-words": |f| set(f, "/interactions/0/held_out", json!("yes")) => "capture.json", "interactions[0].held_out: found the string `yes`, expected true or false";
        "tracks-as-a-list": |f| set(f, "/interactions/0/tracks", json!([PUSH_TRACK])) => "capture.json", "interactions[0].tracks: found a list of 1, expected an object";
        "empty-track-name": |f| set(f, "/interactions/0/tracks", json!({"": PUSH_TRACK})) => "capture.json", "interactions[0].tracks[\"\"]";
        "frames-without-pose": |f| remove(f, "/interactions/3/frames/pose") => "capture.json", "interactions[3].frames.pose: found neither";
        "frames-of-unknown-camera": |f| set(f, "/interactions/3/frames/camera", json!("wall")) => "capture.json", "interactions[3].frames.camera: found an unknown camera";
    }
}

fn of_streams() -> Vec<Damage> {
    damages! {
        "track-not-unit": |f| field(f, PUSH_TRACK, 3, 7, "1.1") => PUSH_TRACK, "row 3, column qx,qy,qz,qw: found a quaternion of length 1.1";
        "track-backwards": |f| field(f, PUSH_TRACK, 5, 0, "0.001") => PUSH_TRACK, "row 5, column time: found 0.001 after 0.03";
        "force-backwards": |f| field(f, PUSH_FORCE, 17, 0, "0") => PUSH_FORCE, "row 17, column time";
        "tilt-backwards": |f| field(f, TILT, 4, 0, "0.05") => TILT, "row 4, column time";
        "pose-in-part": |f| field(f, PUSH_TRACK, 2, 5, "nan") => PUSH_TRACK, "row 2, column qy: found a missing reading";
        "position-in-part": |f| field(f, PUSH_TOOL, 7, 1, "") => PUSH_TOOL, "row 7, column x: found a missing reading";
        "orientation-now-and-then": |f| field(f, LID, 4, 4, "0") => LID, "row 4, column qy: found a missing reading";
        "infinite-force": |f| field(f, PUSH_FORCE, 3, 2, "inf") => PUSH_FORCE, "row 3, column fy: found `inf`";
        "force-in-words": |f| field(f, PUSH_FORCE, 20, 6, "1.2.3") => PUSH_FORCE, "row 20, column tz: found `1.2.3`";
        "row-without-time": |f| field(f, PUSH_FORCE, 1, 0, "") => PUSH_FORCE, "row 1, column time: found no time";
        "time-not-a-number": |f| field(f, PUSH_FORCE, 2, 0, "nan") => PUSH_FORCE, "row 2, column time";
        "log-without-rows": |f| fs::write(f.join(PUSH_FORCE), "time,fx,fy,fz\n").expect("written") => PUSH_FORCE, "row 1: found the end of the file";
        "empty-log": |f| cut(f, PUSH_FORCE, 0) => PUSH_FORCE, "header: found an empty file";
        "ragged-row": |f| field(f, PUSH_FORCE, 4, 6, "1,2") => PUSH_FORCE, "row 4: found 8 fields, expected 7 fields";
        "cut-row": |f| { let n = fs::read(f.join(PUSH_TRACK)).expect("read").len(); cut(f, PUSH_TRACK, n - 40) } => PUSH_TRACK, "row 8: found";
        "wrong-header": |f| text(f, PUSH_FORCE, "time,fx,fy", "t,fx,fy") => PUSH_FORCE, "header: found `t,fx,fy";
        "scalar-first": |f| text(f, PUSH_TRACK, "qx,qy,qz,qw", "qw,qx,qy,qz") => PUSH_TRACK, "header: found `time,x,y,z,qw,qx,qy,qz`";
        "no-header": |f| text(f, PUSH_TRACK, "time,x,y,z,qx,qy,qz,qw\n", "") => PUSH_TRACK, "header: found";
        "semicolons": |f| text(f, PUSH_FORCE, "time,fx,fy,fz,tx,ty,tz", "time;fx;fy;fz;tx;ty;tz") => PUSH_FORCE, "header: found `time;fx";
        "bytes-for-numbers": |f| fs::write(f.join(PUSH_FORCE), b"time,fx,fy,fz\n0,1,2,\xff\n").expect("written") => PUSH_FORCE, "row 1: found bytes";
        "all-readings-missing": |f| fs::write(f.join(PUSH_FORCE), "time,fx,fy,fz\n0,,,\n1,nan,nan,nan\n").expect("written")
            => PUSH_FORCE, "rows 1 to 2: found no reading at all";
        "normal-of-tilt-not-unit": |f| field(f, TILT, 2, 3, "0.9") => TILT, "row 2, column nx,ny,nz: found a normal of length";
        "normal-of-tilt-in-part": |f| field(f, TILT, 2, 2, "") => TILT, "row 2, column ny";
        "frames-backwards": |f| field(f, INDEX, 2, 0, "-1") => INDEX, "row 2, column time";
        "frame-missing": |f| fs::remove_file(f.join("interactions/watch-00/frames/000001.depth.png")).expect("removed")
            => INDEX, "row 2, column depth: found";
        "frame-outside": |f| field(f, INDEX, 1, 1, "../a.png") => INDEX, "row 1, column depth: found `../a.png`, which leaves the folder";
        "frame-of-colour": |f| copy(f, "views/000000.color.png", "interactions/watch-00/frames/000000.depth.png")
            => "frames/000000.depth.png", "image header: found 8-bit RGB";
    }
}

fn of_files() -> Vec<Damage> {
    let mut all = damages! {
        "depth-missing": |f| fs::remove_file(f.join(DEPTH)).expect("removed") => "capture.json", "views[0].depth: found `views/000000.depth.png`, but there is no such file";
        "force-missing": |f| fs::remove_file(f.join(PUSH_FORCE)).expect("removed") => "capture.json", "interactions[0].force: found";
        "track-missing": |f| fs::remove_file(f.join(PUSH_TRACK)).expect("removed") => "capture.json", "interactions[0].tracks.box: found";
        "mesh-missing": |f| fs::remove_file(f.join("meshes/box.obj")).expect("removed") => "capture.json", "bodies[0].mesh: found";
        "mesh-empty": |f| cut(f, "meshes/box.obj", 0) => "meshes/box.obj", "found an empty file";
        "a-folder-for-a-file": |f| set(f, "/views/0/depth", json!("views")) => "capture.json", "views[0].depth: found `views`, which is a folder";
        "path-upwards": |f| set(f, "/views/0/depth", json!("views/../../depth.png")) => "capture.json", "views[0].depth: found `views/../../depth.png`, which leaves";
        "path-absolute": |f| set(f, "/interactions/0/force", json!("/etc/hostname")) => "capture.json", "interactions[0].force: found `/etc/hostname`, which leaves";
        "path-empty": |f| set(f, "/interactions/0/force", json!("")) => "capture.json", "interactions[0].force: found ``";
        "depth-cut": |f| cut(f, DEPTH, 60) => DEPTH, "image data: found";
        "depth-cut-at-header": |f| cut(f, DEPTH, 20) => DEPTH, "image header: found a PNG that ends inside";
        "depth-empty": |f| cut(f, DEPTH, 0) => DEPTH, "image header: found no PNG signature";
        "depth-not-a-png": |f| fs::write(f.join(DEPTH), "P5 8 6 255 ........").expect("written") => DEPTH, "image header: found no PNG signature";
        "depth-of-eight-bits": |f| png(f, DEPTH, image::GrayImage::new(8, 6).into()) => DEPTH, "found 8-bit greyscale, expected a 16-bit greyscale PNG";
        "depth-in-colour": |f| copy(f, "views/000000.color.png", DEPTH) => DEPTH, "found 8-bit RGB, expected a 16-bit greyscale PNG";
        "depth-of-other-size": |f| set(f, "/cameras/0/height", json!(7)) => DEPTH, "found 8 x 6 pixels, expected 8 x 7 pixels";
        "colour-with-alpha": |f| png(f, "views/000001.color.png", image::RgbaImage::new(8, 6).into()) => "views/000001.color.png", "found 8-bit RGB with alpha";
        "colour-of-other-size": |f| png(f, "views/000001.color.png", image::RgbImage::new(6, 8).into()) => "views/000001.color.png", "found 6 x 8 pixels";
        "labels-of-eight-bits": |f| png(f, "views/000000.labels.png", image::GrayImage::new(8, 6).into()) => "views/000000.labels.png", "found 8-bit greyscale";
        "checksum-wrong": |f| { let p = f.join(DEPTH); let mut b = fs::read(&p).expect("read"); let n = b.len(); b[n - 20] ^= 0x55; fs::write(p, b).expect("written") }
            => DEPTH, "image data: found a PNG that cannot be decoded";
    };
    if cfg!(unix) {
        all.extend(damages! {
            "link-out": link_out => "capture.json", "interactions[0].force: found `interactions/push-00/force.csv`, a link out of the folder";
        });
    }
    all
}

#[cfg(unix)]
fn link_out(folder: &Path) {
    let outside = folder.with_extension("outside");
    fs::rename(folder.join(PUSH_FORCE), &outside).expect("moved");
    std::os::unix::fs::symlink(&outside, folder.join(PUSH_FORCE)).expect("linked");
}

#[cfg(not(unix))]
fn link_out(_: &Path) {}

/// Every damaged capture, written below `parent`: the damage and its folder.
pub fn damaged_captures(parent: &Path) -> Vec<(Damage, std::path::PathBuf)> {
    let write = |damage: Damage| {
        let folder = parent.join(damage.name);
        super::good::write_good(&folder);
        (damage.damage)(&folder);
        (damage, folder)
    };
    damages().into_iter().map(write).collect()
}
