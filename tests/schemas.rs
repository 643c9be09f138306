//! What palpate writes obeys the schemas that it prints.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Map, Value};

/// Keywords that carry no constraint of their own, or that the types already enforce (formats, defaults).
const SILENT: [&str; 7] = [
    "$schema",
    "$defs",
    "title",
    "description",
    "default",
    "format",
    "additionalProperties",
];

fn golden(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/golden/tiny")
        .join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).expect("JSON")
}

fn schema(format: &str) -> Value {
    let out = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["schema", format])
        .output()
        .expect("palpate runs");
    assert!(out.status.success(), "{format}");
    serde_json::from_slice(&out.stdout).expect("JSON")
}

fn is_type(kind: &str, value: &Value) -> bool {
    match kind {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("the schema names a type {other}"),
    }
}

/// Where `value` breaks `schema` (JSON Schema 2020-12, the keywords that ours use); a new keyword is an error.
fn faults(root: &Value, schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let Some(rules) = schema.as_object() else {
        return if schema == &Value::Bool(false) {
            vec![format!("{at}: not allowed")]
        } else {
            Vec::new()
        };
    };
    let mut found: Vec<String> = rules
        .iter()
        .flat_map(|(keyword, rule)| broken(root, keyword, rule, value, at))
        .collect();
    if let Some(object) = value.as_object() {
        found.extend(surplus(root, rules, object, at));
    }
    found
}

fn broken(root: &Value, keyword: &str, rule: &Value, value: &Value, at: &str) -> Vec<String> {
    let fine = |ok: bool| {
        if ok {
            Vec::new()
        } else {
            vec![format!("{at}: {value} against {keyword} {rule}")]
        }
    };
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let compare = |ok: fn(f64, f64) -> bool| match (value.as_f64(), rule.as_f64()) {
        (Some(v), Some(bound)) => ok(v, bound),
        _ => true,
    };
    let length = |text: bool| {
        if text {
            value.as_str().map(|s| s.chars().count())
        } else {
            value.as_array().map(Vec::len)
        }
    };
    let bound = rule.as_u64().unwrap_or(0) as usize;
    let passing = || {
        list(rule)
            .iter()
            .filter(|s| faults(root, s, value, at).is_empty())
            .count()
    };
    match keyword {
        "$ref" => {
            let pointer = rule.as_str().expect("a reference").trim_start_matches('#');
            let target = root
                .pointer(pointer)
                .unwrap_or_else(|| panic!("{pointer} is not in the schema"));
            faults(root, target, value, at)
        }
        "type" => fine(match rule {
            Value::String(kind) => is_type(kind, value),
            kinds => list(kinds).iter().filter_map(Value::as_str).any(|k| is_type(k, value)),
        }),
        "const" => fine(rule == value),
        "enum" => fine(list(rule).contains(value)),
        "anyOf" => fine(passing() >= 1),
        "oneOf" => fine(passing() == 1),
        "minimum" => fine(compare(|v, b| v >= b)),
        "maximum" => fine(compare(|v, b| v <= b)),
        "exclusiveMinimum" => fine(compare(|v, b| v > b)),
        "minItems" => fine(length(false).is_none_or(|n| n >= bound)),
        "maxItems" => fine(length(false).is_none_or(|n| n <= bound)),
        "minLength" => fine(length(true).is_none_or(|n| n >= bound)),
        "required" => fine(
            value
                .as_object()
                .is_none_or(|o| list(rule).iter().all(|k| k.as_str().is_some_and(|k| o.contains_key(k)))),
        ),
        "items" => list(value)
            .iter()
            .enumerate()
            .flat_map(|(i, v)| faults(root, rule, v, &format!("{at}[{i}]")))
            .collect(),
        "properties" => rule
            .as_object()
            .into_iter()
            .flatten()
            .filter_map(|(k, s)| value.get(k).map(|v| faults(root, s, v, &format!("{at}.{k}"))))
            .flatten()
            .collect(),
        silent if SILENT.contains(&silent) => Vec::new(),
        other => panic!("this test does not know the keyword {other}"),
    }
}

/// Members that `properties` does not name, against `additionalProperties`.
fn surplus(root: &Value, rules: &Map<String, Value>, object: &Map<String, Value>, at: &str) -> Vec<String> {
    let Some(rule) = rules.get("additionalProperties") else {
        return Vec::new();
    };
    let named = rules.get("properties").and_then(Value::as_object);
    object
        .iter()
        .filter(|(k, _)| named.is_none_or(|n| !n.contains_key(*k)))
        .flat_map(|(k, v)| faults(root, rule, v, &format!("{at}.{k}")))
        .collect()
}

#[test]
fn what_is_written_obeys_its_schema() {
    for (format, file) in [
        ("capture", "capture/capture.json"),
        ("truth", "capture/truth.json"),
        ("twin", "twin.json"),
        ("diagnosis", "diagnosis.json"),
    ] {
        let schema = schema(format);
        let found = faults(&schema, &schema, &golden(file), file);
        assert!(found.is_empty(), "\n{}", found.join("\n"));
    }
}

/// The checker itself notices what it must.
#[test]
fn a_broken_twin_does_not_obey() {
    let schema = schema("twin");
    let good = golden("twin.json");
    let mut no_format = good.clone();
    no_format.as_object_mut().expect("an object").remove("format");
    let mut word_for_list = good.clone();
    word_for_list["bodies"] = Value::from("none");
    let mut number_for_name = good;
    number_for_name["bodies"][0]["links"][0]["name"] = Value::from(7);
    for broken in [no_format, word_for_list, number_for_name] {
        assert!(!faults(&schema, &schema, &broken, "twin.json").is_empty());
    }
}
