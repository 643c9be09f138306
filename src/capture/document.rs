//! A JSON document held against its schema: every fault is named by the full path of its key.

use std::path::Path;

use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use crate::base::{Error, Result, nearest_name};

/// Parses `bytes`; a syntax error or a key written twice names line and column.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<Value> {
    serde_json::from_slice::<Strict>(bytes)
        .map(|strict| strict.0)
        .map_err(|error| {
            let said = error.to_string();
            let what = said.split(" at line ").next().unwrap_or(&said);
            let place = format!("line {}, column {}", error.line(), error.column());
            Error::bad_input(file, place, what, "one well-formed JSON object")
        })
}

/// A JSON value whose objects name no key twice.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Strict)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a JSON value")
    }
    fn visit_unit<E>(self) -> std::result::Result<Value, E> {
        Ok(Value::Null)
    }
    fn visit_bool<E>(self, v: bool) -> std::result::Result<Value, E> {
        Ok(Value::Bool(v))
    }
    fn visit_u64<E>(self, v: u64) -> std::result::Result<Value, E> {
        Ok(Value::Number(v.into()))
    }
    fn visit_i64<E>(self, v: i64) -> std::result::Result<Value, E> {
        Ok(Value::Number(v.into()))
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> std::result::Result<Value, E> {
        Number::from_f64(v)
            .map(Value::Number)
            .ok_or_else(|| E::custom("a number that is not finite"))
    }
    fn visit_str<E>(self, v: &str) -> std::result::Result<Value, E> {
        Ok(Value::String(v.to_owned()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(Strict(item)) = seq.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> std::result::Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = access.next_key::<String>()? {
            if map.contains_key(&key) {
                return Err(de::Error::custom(format!("the key `{key}` a second time")));
            }
            let Strict(value) = access.next_value()?;
            map.insert(key, value);
        }
        Ok(Value::Object(map))
    }
}

/// Holds `value` against `schema` and reports the first fault in the order of the file.
///
/// It knows the words that schemars writes for plain types: `$ref`, `anyOf` with null, `oneOf` of constants, `enum`,
/// `type`, `properties`, `required`, `additionalProperties`, `items`, lengths and bounds.
pub(super) fn hold_against(file: &Path, schema: &Value, value: &Value) -> Result<()> {
    Checker { file, root: schema }.value("", schema, value)
}

/// Takes away the keys that are null: where a document has passed, each of them means the same as its absence.
pub(super) fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(map) => {
            let there = map.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(there.map(|(key, value)| (key, without_nulls(value))).collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(without_nulls).collect()),
        other => other,
    }
}

struct Checker<'a> {
    file: &'a Path,
    root: &'a Value,
}

impl Checker<'_> {
    fn fault(&self, path: &str, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = if path.is_empty() { "the document" } else { path };
        Error::bad_input(self.file, place, found, expected)
    }

    fn value(&self, path: &str, schema: &Value, value: &Value) -> Result<()> {
        let schema = self.resolve(schema, value);
        if let Some(names) = constants(schema) {
            return self.constant(path, &names, value);
        }
        self.kind(path, schema, value)?;
        match value {
            Value::Object(map) => self.object(path, schema, map),
            Value::Array(items) => self.array(path, schema, items),
            Value::Number(number) => self.number(path, schema, number),
            Value::String(text) if text.is_empty() && schema["minLength"].as_u64() > Some(0) => {
                Err(self.fault(path, "an empty string", "a name"))
            }
            _ => Ok(()),
        }
    }

    /// Follows `$ref`, and `anyOf` to the branch that is not null (or is, for a null).
    fn resolve<'s>(&'s self, schema: &'s Value, value: &Value) -> &'s Value {
        if let Some(name) = schema["$ref"].as_str().and_then(|r| r.rsplit('/').next()) {
            return self.resolve(&self.root["$defs"][name], value);
        }
        let Some(branches) = schema["anyOf"].as_array() else {
            return schema;
        };
        let is_null = |branch: &&Value| branch["type"] == "null";
        branches
            .iter()
            .find(|branch| is_null(branch) == value.is_null())
            .map_or(schema, |branch| self.resolve(branch, value))
    }

    fn constant(&self, path: &str, names: &[&str], value: &Value) -> Result<()> {
        match value.as_str() {
            Some(text) if names.contains(&text) => Ok(()),
            Some(text) => {
                let nearest = nearest_name(text, names.iter().copied()).unwrap_or_default();
                let expected = format!("one of {} (did you mean `{nearest}`?)", names.join(", "));
                Err(self.fault(path, format!("`{text}`"), expected))
            }
            None => Err(self.fault(path, describe(value), format!("one of {}", names.join(", ")))),
        }
    }

    fn kind(&self, path: &str, schema: &Value, value: &Value) -> Result<()> {
        let wanted: Vec<&str> = match &schema["type"] {
            Value::String(one) => vec![one],
            Value::Array(many) => many.iter().filter_map(Value::as_str).collect(),
            _ => return Ok(()),
        };
        if wanted.iter().any(|kind| is_of(kind, value)) {
            return Ok(());
        }
        let words: Vec<&str> = wanted.iter().filter(|k| **k != "null").map(|k| in_words(k)).collect();
        Err(self.fault(path, describe(value), words.join(" or ")))
    }

    fn object(&self, path: &str, schema: &Value, map: &Map<String, Value>) -> Result<()> {
        let nothing = Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&nothing);
        let rest = &schema["additionalProperties"];
        let known: Vec<&str> = properties.keys().map(String::as_str).collect();
        for key in map.keys() {
            if !properties.contains_key(key) && !rest.is_object() {
                let nearest = nearest_name(key, known.iter().copied()).unwrap_or_default();
                let expected = format!("one of {} (did you mean `{nearest}`?)", known.join(", "));
                return Err(self.fault(&join(path, key), "an unknown key", expected));
            }
        }
        let required: Vec<&str> = schema["required"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .collect();
        for key in &required {
            if !map.contains_key(*key) {
                let what = properties[*key]["description"].as_str().unwrap_or("a value");
                return Err(self.fault(&join(path, key), "nothing", format!("this key to be given: {what}")));
            }
        }
        for (key, value) in map {
            let optional = properties.contains_key(key) && !required.contains(&key.as_str());
            if !(optional && value.is_null()) {
                self.value(&join(path, key), properties.get(key).unwrap_or(rest), value)?;
            }
        }
        Ok(())
    }

    fn array(&self, path: &str, schema: &Value, items: &[Value]) -> Result<()> {
        let length = items.len() as u64;
        let (low, high) = (schema["minItems"].as_u64(), schema["maxItems"].as_u64());
        if low.is_some_and(|n| length < n) || high.is_some_and(|n| length > n) {
            let wanted = low.or(high).unwrap_or_default();
            return Err(self.fault(path, format!("a list of {length}"), format!("a list of {wanted}")));
        }
        for (i, item) in items.iter().enumerate() {
            self.value(&format!("{path}[{i}]"), &schema["items"], item)?;
        }
        Ok(())
    }

    fn number(&self, path: &str, schema: &Value, number: &Number) -> Result<()> {
        let x = number.as_f64().unwrap_or(f64::NAN);
        let fault = |bound: String| Err(self.fault(path, number.to_string(), bound));
        if let Some(low) = schema["exclusiveMinimum"].as_f64().filter(|low| x <= *low) {
            return fault(format!("a number above {low}"));
        }
        if let Some(low) = schema["minimum"].as_f64().filter(|low| x < *low) {
            return fault(format!("a number of at least {low}"));
        }
        if schema["format"] == "uint32" && x > f64::from(u32::MAX) {
            return fault(format!("a whole number of at most {}", u32::MAX));
        }
        Ok(())
    }
}

/// The names of an enumeration, if that is what the schema is.
fn constants(schema: &Value) -> Option<Vec<&str>> {
    if let Some(list) = schema["enum"].as_array() {
        return Some(list.iter().filter_map(Value::as_str).collect());
    }
    let branches = schema["oneOf"].as_array()?;
    let names = branches.iter().flat_map(|branch| match branch["enum"].as_array() {
        Some(list) => list.iter().filter_map(Value::as_str).collect(),
        None => branch["const"].as_str().into_iter().collect::<Vec<_>>(),
    });
    Some(names.collect())
}

fn is_of(kind: &str, value: &Value) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        _ => false,
    }
}

fn in_words(kind: &str) -> &'static str {
    match kind {
        "object" => "an object",
        "array" => "a list",
        "string" => "a string",
        "number" => "a number",
        "integer" => "a whole number",
        "boolean" => "true or false",
        _ => "null",
    }
}

fn describe(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(b) => b.to_string(),
        Value::Number(n) => n.to_string(),
        Value::String(s) => format!("the string `{}`", s.escape_debug()),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(_) => "an object".into(),
    }
}

/// `path.key`, or `path["key"]` where the key is not a plain word.
pub(super) fn join(path: &str, key: &str) -> String {
    let plain = !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "_-/".contains(c));
    match (path.is_empty(), plain) {
        (true, true) => key.to_owned(),
        (false, true) => format!("{path}.{key}"),
        (_, false) => format!("{path}[\"{}\"]", key.escape_debug()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        let file = Path::new("capture.json");
        let value = match parse(file, text.as_bytes()) {
            Ok(value) => value,
            Err(error) => return error.to_string(),
        };
        let schema = super::super::json::capture_schema();
        hold_against(file, &schema, &value).map_or_else(|e| e.to_string(), |()| "fine".into())
    }

    #[test]
    fn every_fault_names_its_full_path() {
        let table = [
            (r#"{"format":"f","name":"n"}"#, "fine"),
            (
                r#"{"format":"f","name":"n","support":null,"gravity":null,"views":null}"#,
                "fine",
            ),
            (r#"{"format":"f","name":null}"#, "name: found null, expected a string"),
            (
                r#"{"format":"f","name":"n","interactions":[{"name":"a","kind":"hold","tracks":{"b":null}}]}"#,
                "interactions[0].tracks.b: found null",
            ),
            (
                r#"{"format":"f","nane":"n"}"#,
                "capture.json: nane: found an unknown key",
            ),
            (r#"{"format":"f"}"#, "capture.json: name: found nothing"),
            (
                r#"{"format":"f","name":"n","name":"m"}"#,
                "line 1, column 31: found the key `name` a second time",
            ),
            (
                r#"{"format":"f","name":"n","gravity":[0,0]}"#,
                "gravity: found a list of 2, expected a list of 3",
            ),
            (
                r#"{"format":"f","name":"n","gravity":[0,"a",0]}"#,
                "gravity[1]: found the string `a`",
            ),
            (r#"{"format":"f","name":"n","gravity":[0,NaN,0]}"#, "line 1, column"),
            (
                r#"{"format":"f","name":"n","interactions":[{"name":"a","kind":"shove"}]}"#,
                "interactions[0].kind: found `shove`, expected one of push, pull",
            ),
            (
                r#"{"format":"f","name":"n","interactions":[{"name":"a","kind":"push","tool":{"shape":"box","sise":[1]}}]}"#,
                "interactions[0].tool.sise: found an unknown key, expected one of shape, size, mesh, grip, pin (did you mean `size`?)",
            ),
            (
                r#"{"format":"f","name":"n","noise":{"force":-1.5}}"#,
                "noise.force: found -1.5, expected a number above 0",
            ),
            (r#"[]"#, "the document: found a list of 0, expected an object"),
        ];
        for (text, wanted) in table {
            assert!(
                said(text).contains(wanted),
                "{text}\n said {}\n not {wanted}",
                said(text)
            );
        }
    }
}
