//! What is written is read back the same, and real recordings with all their quirks are accepted.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

mod common;

use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use palpate::capture::{
    Capture, Interaction, PoseStream, WrenchStream, inspect, read_capture, read_frame, write_capture,
    write_capture_with,
};
use proptest::prelude::*;

fn captures_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .collect();
    entries.sort();
    if folder.join("capture.json").is_file() {
        found.push(folder.to_path_buf());
    }
    for entry in entries.into_iter().filter(|e| e.is_dir()) {
        captures_below(&entry, found);
    }
}

#[test]
fn every_real_recording_is_accepted() {
    let Some(data) = std::env::var_os("PALPATE_DATA") else {
        println!("skipped: PALPATE_DATA is not set");
        return;
    };
    let mut found = Vec::new();
    captures_below(Path::new(&data), &mut found);
    assert!(!found.is_empty());
    for folder in found {
        let capture = read_capture(&folder).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(capture.digest.len(), 64);
        let inspection = inspect(&capture);
        assert_eq!(inspection.interactions.len(), capture.interactions.len());
        serde_json::to_string(&inspection).expect("printed");
        println!("{inspection}");
    }
}

fn near(what: &str, a: f64, b: f64) {
    let fine = (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-8 * a.abs().max(1e-3);
    assert!(fine, "{what}: {a} against {b}");
}

fn near_all<'a>(what: &str, a: impl IntoIterator<Item = &'a f64>, b: impl IntoIterator<Item = &'a f64>) {
    let (a, b): (Vec<_>, Vec<_>) = (a.into_iter().collect(), b.into_iter().collect());
    assert_eq!(a.len(), b.len(), "{what}");
    a.iter().zip(&b).for_each(|(x, y)| near(what, **x, **y));
}

fn same_poses(what: &str, a: &PoseStream, b: &PoseStream) {
    assert_eq!(a.time, b.time, "{what}");
    a.position
        .iter()
        .zip(&b.position)
        .for_each(|(p, q)| near_all(what, p.iter(), q.iter()));
    for (p, q) in a.rotation.iter().zip(&b.rotation) {
        assert_eq!(p.is_some(), q.is_some(), "{what}");
        if let (Some(p), Some(q)) = (p, q) {
            assert!(p.angle_to(q) < 1e-7, "{what}");
        }
    }
}

fn same_wrench(a: &WrenchStream, b: &WrenchStream) {
    assert_eq!(a.time, b.time);
    near_all("force", a.force.iter().flatten(), b.force.iter().flatten());
    assert_eq!(a.torque.is_some(), b.torque.is_some());
    let flat = |s: &WrenchStream| s.torque.iter().flatten().flatten().copied().collect::<Vec<f64>>();
    near_all("torque", &flat(a), &flat(b));
}

fn same_interaction(a: &Interaction, b: &Interaction) {
    assert_eq!(
        (&a.name, a.kind, &a.action, &a.tool_name),
        (&b.name, b.kind, &b.action, &b.tool_name)
    );
    assert_eq!((&a.target, a.held_out), (&b.target, b.held_out));
    assert_eq!(format!("{:?}", a.tool), format!("{:?}", b.tool));
    assert_eq!(a.force.is_some(), b.force.is_some());
    a.force.iter().zip(&b.force).for_each(|(a, b)| same_wrench(a, b));
    a.tool_path
        .iter()
        .zip(&b.tool_path)
        .for_each(|(a, b)| same_poses("tool_path", a, b));
    for (a, b) in a.support_path.iter().zip(&b.support_path) {
        assert_eq!(a.time, b.time);
        near_all(
            "normal",
            a.vector.iter().flat_map(|v| v.iter()),
            b.vector.iter().flat_map(|v| v.iter()),
        );
    }
    assert_eq!(a.tracks.keys().collect::<Vec<_>>(), b.tracks.keys().collect::<Vec<_>>());
    a.tracks
        .iter()
        .zip(b.tracks.values())
        .for_each(|((name, a), b)| same_poses(name, a, b));
    assert_eq!(a.frames.is_some(), b.frames.is_some());
}

fn same(a: &Capture, b: &Capture) {
    assert_eq!((&a.name, a.gravity), (&b.name, b.gravity));
    assert_eq!(format!("{:?}", a.support), format!("{:?}", b.support));
    assert_eq!(format!("{:?}", a.cameras), format!("{:?}", b.cameras));
    assert_eq!(format!("{:?}", a.noise), format!("{:?}", b.noise));
    assert_eq!(a.views.len(), b.views.len());
    for (a, b) in a.views.iter().zip(&b.views) {
        assert_eq!((a.camera, a.time), (b.camera, b.time));
        near_all(
            "view pose",
            &a.world_from_camera.to_seven(),
            &b.world_from_camera.to_seven(),
        );
        assert_eq!(a.depth.counts, b.depth.counts);
        assert_eq!(a.color.as_ref().map(|c| &c.rgb), b.color.as_ref().map(|c| &c.rgb));
        assert_eq!(a.labels.as_ref().map(|l| &l.ids), b.labels.as_ref().map(|l| &l.ids));
    }
    for (a, b) in a.bodies.iter().zip(&b.bodies) {
        assert_eq!(
            (&a.name, a.mass, a.mass_sd, &a.material),
            (&b.name, b.mass, b.mass_sd, &b.material)
        );
        assert_eq!(a.mesh.as_ref().map(|m| &m.bytes), b.mesh.as_ref().map(|m| &m.bytes));
        assert_eq!(
            a.world_from_body.map(|p| p.to_seven()),
            b.world_from_body.map(|p| p.to_seven())
        );
    }
    assert_eq!(a.interactions.len(), b.interactions.len());
    a.interactions
        .iter()
        .zip(&b.interactions)
        .for_each(|(a, b)| same_interaction(a, b));
}

#[test]
fn what_is_written_is_read_back_the_same() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    common::good::write_images(parent.path());
    let capture = common::good::good(parent.path());
    let (first, second) = (parent.path().join("first"), parent.path().join("second"));
    let truth = [("truth.json".to_owned(), b"{}".to_vec())];
    write_capture_with(&capture, &first, &truth).expect("written");
    let back = read_capture(&first).expect("read");
    same(&capture, &back);
    assert_eq!(back.truth, Some(first.join("truth.json")));
    assert_eq!(std::fs::read(first.join("truth.json")).expect("there"), b"{}");
    write_capture_with(&back, &second, &truth).expect("written again");
    assert_eq!(
        read_capture(&second).expect("read again").digest,
        back.digest,
        "a second time, byte for byte"
    );
}

#[test]
fn frames_are_read_one_by_one() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let folder = parent.path().join("good");
    common::good::write_good(&folder);
    let capture = read_capture(&folder).expect("read");
    let frames = capture.interactions[3].frames.as_ref().expect("frames");
    let (depth, color) = read_frame(&capture, frames, 1).expect("loaded");
    assert_eq!(depth.counts, capture.views[1].depth.counts);
    assert_eq!(
        color.expect("colour").rgb,
        capture.views[1].color.as_ref().expect("colour").rgb
    );
    assert!(read_frame(&capture, frames, 0).expect("loaded").1.is_none());
    assert_eq!(
        read_frame(&capture, frames, 2).expect_err("no such frame").exit_code(),
        2
    );
}

#[test]
fn a_capture_that_could_not_be_read_is_not_written() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let folder = parent.path().join("capture");
    common::good::write_good(&folder);
    let mut capture = read_capture(&folder).expect("read");
    let before = capture.digest.clone();
    capture.cameras[0].fx = -1.0;
    let said = write_capture(&capture, &folder).expect_err("refused").to_string();
    assert!(said.contains("cameras[0].fx: found -1"), "{said}");
    assert_eq!(read_capture(&folder).expect("the older one is whole").digest, before);
    assert_eq!(
        std::fs::read_dir(parent.path()).expect("listed").count(),
        1,
        "nothing is left beside it"
    );
}

#[test]
fn names_that_disks_do_not_like_are_told_apart() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    common::good::write_images(parent.path());
    let mut capture = common::good::good(parent.path());
    let names = ["a b", "a:b", "A B", ".hidden", "Tür"];
    let push = capture.interactions[0].clone();
    let named = |name: &&str| Interaction {
        name: (*name).into(),
        ..push.clone()
    };
    capture.interactions = names.iter().map(named).collect();
    let folder = parent.path().join("names");
    write_capture(&capture, &folder).expect("written");
    let back = read_capture(&folder).expect("read");
    assert_eq!(
        back.interactions.iter().map(|x| x.name.as_str()).collect::<Vec<_>>(),
        names
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_stream_comes_back(
        rows in prop::collection::vec((0.0..0.1, prop::array::uniform3(-50.0..50.0_f64), 0.0..3.1_f64, prop::bool::weighted(0.2)), 1..40),
        start in 0.0..2e9_f64,
    ) {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let folder = parent.path().join("stream");
        common::good::write_images(parent.path());
        let mut capture = common::good::good(parent.path());
        capture.interactions.truncate(1);
        let (mut poses, mut wrench) = (PoseStream::default(), WrenchStream::default());
        let mut time = start;
        for (i, (dt, v, angle, missing)) in rows.into_iter().enumerate() {
            time += dt;
            let gone = missing && i > 0;
            let v = if gone { Vector3::repeat(f64::NAN) } else { v.into() };
            poses.time.push(time);
            poses.position.push((v * 0.01).into());
            poses.rotation.push((!gone).then(|| UnitQuaternion::from_scaled_axis(Vector3::new(angle, 0.1, -0.2))));
            wrench.time.push(time);
            wrench.force.push(v);
        }
        capture.interactions[0].tracks.insert("box".into(), poses);
        capture.interactions[0].force = Some(wrench);
        write_capture(&capture, &folder).expect("written");
        same(&capture, &read_capture(&folder).expect("read"));
    }
}
