//! A capture that is damaged in one place is refused with the file and the place, and nothing else happens.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

mod common;

use std::fs;

use assert_cmd::Command;
use common::damaged::damaged_captures;
use palpate::capture::read_capture;

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

/// What one run of the program did with a damaged capture; empty where all is well.
fn fault_of_run(name: &str, command: &mut Command, old: &std::path::Path) -> Option<String> {
    let output = command.output().expect("the program runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let left = fs::read(old.join("twin.json")).expect("the older result is there");
    let fine = output.status.code() == Some(2) && said.lines().count() == 1 && left == b"{}";
    (!fine).then(|| format!("{name}: exit {:?}, said {said}", output.status.code()))
}

#[test]
#[ignore = "until the command line lands"]
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
