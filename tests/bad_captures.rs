//! A capture that is damaged in one place is refused with the file and the place, and nothing else happens.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use common::damaged::damaged_captures;
use palpate::capture::{inspect, read_capture};
use proptest::prelude::*;

#[test]
fn every_damage_is_refused_by_file_and_place() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let mut wrong = Vec::new();
    for (damage, folder) in damaged_captures(parent.path()) {
        match read_capture(&folder) {
            Ok(_) => wrong.push(format!("{}: accepted", damage.name)),
            Err(error) => {
                let said = error.to_string();
                let named = said.contains(damage.file) && said.contains(damage.place);
                if !named || error.exit_code() != 2 || said.lines().count() != 1 {
                    wrong.push(format!("{} (exit {}): {said}", damage.name, error.exit_code()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_same_fault_is_reported_however_many_threads_read() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let folder = parent.path().join("many");
    common::good::write_good(&folder);
    for file in [
        "views/000001.depth.png",
        "views/000000.color.png",
        "interactions/push-00/force.csv",
    ] {
        fs::write(folder.join(file), "").expect("written");
    }
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        let said = pool.install(|| read_capture(&folder)).expect_err("refused").to_string();
        assert!(said.contains("views/000000.color.png"), "{said}");
    }
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("listed") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files_below(&path, found)
        } else {
            found.push(path)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn any_damage_at_all_ends_in_an_answer(file in 0..1000_usize, place in 0.0..1.0_f64, new: u8, how in 0..3) {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let folder = parent.path().join("capture");
        common::good::write_good(&folder);
        let mut files = Vec::new();
        files_below(&folder, &mut files);
        files.sort();
        // Every other time the document itself.
        let path = if file % 2 == 0 { folder.join("capture.json") } else { files[file / 2 % files.len()].clone() };
        let mut bytes = fs::read(&path).expect("read");
        let at = (place * bytes.len() as f64) as usize;
        match how {
            0 => bytes[at] = new,
            1 => bytes.insert(at, new),
            _ => { bytes.remove(at); }
        }
        fs::write(&path, bytes).expect("written");
        match read_capture(&folder) {
            Ok(capture) => { inspect(&capture).to_text(); }
            Err(error) => prop_assert!(error.exit_code() == 2 && error.to_string().lines().count() == 1, "{error}"),
        }
    }
}

/// What one run of the program did with a damaged capture; empty where all is well.
fn fault_of_run(name: &str, command: &mut Command, old: &Path) -> Option<String> {
    let output = command.output().expect("the program runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let left = fs::read(old.join("twin.json")).expect("the older result is there");
    let fine = output.status.code() == Some(2) && said.lines().count() == 1 && left == b"{}";
    (!fine).then(|| format!("{name}: exit {:?}, said {said}", output.status.code()))
}

#[test]
fn the_program_refuses_every_damage_and_leaves_results_alone() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let old = parent.path().join("older-result");
    fs::create_dir(&old).expect("made");
    fs::write(old.join("twin.json"), "{}").expect("written");
    let mut wrong = Vec::new();
    for (damage, folder) in damaged_captures(&parent.path().join("captures")) {
        let new = parent.path().join("new-result");
        for out in [&new, &old] {
            let mut command = Command::new(assert_cmd::cargo::cargo_bin!("palpate"));
            command.arg("reconstruct").arg(&folder).arg("--out").arg(out);
            wrong.extend(fault_of_run(damage.name, &mut command, &old));
        }
        if new.exists() {
            wrong.push(format!("{}: wrote a result", damage.name));
        }
        if fs::read_dir(&old).expect("listed").count() != 1 {
            wrong.push(format!("{}: changed the older result", damage.name));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
