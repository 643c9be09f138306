//! Keeps the layout of the house: who may import whom, how long files and functions may be, who touches
//! files, clocks and dice. ARCHITECTURE.md says why.

#![allow(clippy::expect_used, reason = "a test that cannot read the sources must stop")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// For every room, the rooms that it may import.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("math", &[]),
    ("geometry", &["base", "math"]),
    ("capture", &["base"]),
    ("twin", &["base", "geometry"]),
    ("physics", &["base", "math", "geometry", "twin"]),
    ("stages", &["base", "math", "geometry", "capture", "twin", "physics"]),
    ("lab", &["base", "math", "geometry", "capture", "twin"]),
    ("learning", &["base", "math", "capture", "twin", "physics", "lab"]),
    ("pipeline", &["base", "capture", "twin", "stages"]),
    ("import", &["base", "geometry", "capture"]),
    ("export", &["base", "geometry", "twin"]),
    ("engines", &["base", "geometry", "capture", "twin", "export"]),
    (
        "report",
        &[
            "base", "math", "capture", "twin", "stages", "pipeline", "export", "engines",
        ],
    ),
    (
        "recording",
        &["base", "geometry", "capture", "twin", "stages", "pipeline"],
    ),
    (
        "cli",
        &[
            "base",
            "capture",
            "twin",
            "stages",
            "lab",
            "learning",
            "pipeline",
            "import",
            "export",
            "engines",
            "report",
            "recording",
        ],
    ),
];

/// Rooms and files that may touch files.
const MAY_TOUCH_FILES: &[&str] = &[
    "src/base/file.rs",
    "src/capture/",
    "src/twin/file.rs",
    "src/export/",
    "src/report/",
    "src/pipeline/",
    "src/cli/",
];

const MOST_LINES_IN_A_FILE: usize = 400;
const MOST_LINES_IN_A_FUNCTION: usize = 80;

fn sources() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("src is there") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("a text file");
                let relative = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).expect("below the crate");
                found.push((relative.to_path_buf(), text));
            }
        }
    }
    found.sort();
    found
}

fn room_of(path: &Path) -> Option<String> {
    let mut parts = path.components().skip(1);
    let room = parts.next()?.as_os_str().to_string_lossy().into_owned();
    parts.next().map(|_| room)
}

/// The text before the first `#[cfg(test)]`, without comments: what ships.
fn shipped(text: &str) -> String {
    let end = text.find("#[cfg(test)]").unwrap_or(text.len());
    let without_comments = |line: &str| line.split("//").next().unwrap_or("").to_owned();
    text[..end].lines().map(without_comments).collect::<Vec<_>>().join("\n")
}

/// Every `crate::ROOM` or `crate::{ROOM, …}` that a file names.
fn imported_rooms(text: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for piece in text.split("crate::").skip(1) {
        let names = piece
            .strip_prefix('{')
            .map_or(piece, |list| list.split(';').next().unwrap_or(""));
        let grouped = piece.starts_with('{');
        let heads: Vec<&str> = if grouped {
            names.split(',').collect()
        } else {
            vec![names]
        };
        for head in heads {
            let name: String = head
                .trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            rooms.push(name);
        }
    }
    rooms
}

#[test]
fn rooms_import_only_what_the_plan_allows() {
    let plan: BTreeMap<&str, &[&str]> = MAY_IMPORT.iter().copied().collect();
    let mut faults = Vec::new();
    for (path, text) in sources() {
        let Some(room) = room_of(&path) else { continue };
        let Some(allowed) = plan.get(room.as_str()) else {
            faults.push(format!("{}: no such room in the plan: {room}", path.display()));
            continue;
        };
        for other in imported_rooms(&shipped(&text)) {
            if plan.contains_key(other.as_str()) && other != room && !allowed.contains(&other.as_str()) {
                faults.push(format!("{}: {room} may not import {other}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn no_stage_imports_a_stage_but_diagnosis_estimation() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        let parts: Vec<_> = path
            .components()
            .map(|c| c.as_os_str().to_string_lossy().into_owned())
            .collect();
        if parts.get(1).map(String::as_str) != Some("stages") || parts.len() < 4 {
            continue;
        }
        let own = &parts[2];
        for piece in shipped(&text).split("stages::").skip(1) {
            let other: String = piece.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if &other != own && !(own == "diagnosis" && other == "estimation") {
                faults.push(format!("{}: stage {own} imports stage {other}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_file_says_what_it_owns_and_stays_short() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        if !text.starts_with("//!") {
            faults.push(format!("{}: does not open with //!", path.display()));
        }
        let lines = text.lines().count();
        if lines > MOST_LINES_IN_A_FILE {
            faults.push(format!(
                "{}: {lines} lines, at most {MOST_LINES_IN_A_FILE}",
                path.display()
            ));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn functions_stay_short() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        let mut start: Option<(usize, usize, String)> = None;
        for (number, line) in text.lines().enumerate() {
            let indent = line.len() - line.trim_start().len();
            let head = line
                .trim_start()
                .trim_start_matches("pub ")
                .trim_start_matches("pub(crate) ");
            let head = head.trim_start_matches("pub(super) ").trim_start_matches("const ");
            if start.is_none() && head.starts_with("fn ") {
                start = Some((number, indent, head.to_owned()));
            } else if let Some((from, depth, name)) = &start
                && line.starts_with(&format!("{}}}", " ".repeat(*depth)))
                && indent == *depth
            {
                let lines = number - from + 1;
                if lines > MOST_LINES_IN_A_FUNCTION {
                    faults.push(format!("{}:{}: {lines} lines: {name}", path.display(), from + 1));
                }
                start = None;
            } else if let Some((from, _, _)) = &start
                && line.trim_end().ends_with(';')
                && number - from < 8
                && !text
                    .lines()
                    .skip(*from)
                    .take(number - from + 1)
                    .any(|l| l.contains('{'))
            {
                start = None;
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn doors_hold_no_code() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        if path.file_name().is_some_and(|n| n == "mod.rs") && shipped(&text).contains("fn ") {
            faults.push(format!("{}: a door holds only //!, mod and pub use", path.display()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn only_the_named_rooms_touch_files() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        let name = path.to_string_lossy().into_owned();
        if MAY_TOUCH_FILES.iter().any(|allowed| name.starts_with(allowed)) {
            continue;
        }
        let text = shipped(&text);
        for token in ["std::fs", "fs::read", "fs::write", "File::open", "File::create"] {
            if text.contains(token) {
                faults.push(format!("{name}: touches files ({token})"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn clocks_and_dice_live_in_one_file() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        if path.ends_with("base/seed.rs") {
            continue;
        }
        for token in [
            "Instant::now",
            "SystemTime",
            "thread_rng",
            "from_entropy",
            "from_os_rng",
            "rand::rng(",
        ] {
            if shipped(&text).contains(token) {
                faults.push(format!("{}: {token}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
