//! What is written is read back the same, and real recordings with all their quirks are accepted.

use std::path::{Path, PathBuf};

use palpate::capture::read_capture;

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
    }
}
