//! The page on the format names every key, and the examples in the guide are captures.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

use palpate::capture::{capture_schema, read_capture};
use serde_json::Value;

const FORMAT: &str = include_str!("../docs/capture-format.md");
const GUIDE: &str = include_str!("../docs/capture-guide.md");

fn keys(schema: &Value, found: &mut Vec<String>) {
    if let Some(properties) = schema["properties"].as_object() {
        found.extend(properties.keys().cloned());
    }
    for inner in schema.as_object().into_iter().flat_map(|map| map.values()) {
        keys(inner, found);
    }
}

#[test]
fn the_page_names_every_key_and_every_key_is_described() {
    let schema = capture_schema();
    assert_eq!(schema["title"], "palpate-capture/1");
    let mut found = Vec::new();
    keys(&schema, &mut found);
    assert!(found.len() > 50, "{found:?}");
    let missing: Vec<&String> = found
        .iter()
        .filter(|key| !FORMAT.contains(&format!("`{key}`")))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
    let nameless = |object: &Value| {
        object["properties"]
            .as_object()
            .is_some_and(|p| p.values().any(|v| v["description"].is_null()))
    };
    assert!(!nameless(&schema) && !schema["$defs"].as_object().expect("definitions").values().any(nameless));
}

#[test]
fn the_example_of_the_guide_lacks_nothing_but_its_files() {
    let text = GUIDE
        .split("```json")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("an example");
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("capture.json"), text).expect("written");
    let said = read_capture(folder.path())
        .expect_err("its images are not there")
        .to_string();
    assert!(
        said.contains("views[0].depth: found `views/000000.depth.png`, but there is no such file"),
        "{said}"
    );
}
