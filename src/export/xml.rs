//! A small tree of XML elements: written with indentation, read back with quick-xml.

use std::fmt::Write as _;

use nalgebra::Vector3;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::base::{Error, Result};

/// An element with attributes in order, and what stands inside.
#[derive(Clone, Debug, Default)]
pub(super) struct Element {
    pub(super) tag: String,
    attributes: Vec<(String, String)>,
    content: Vec<Content>,
}

#[derive(Clone, Debug)]
enum Content {
    Element(Element),
    Comment(String),
    Text(String),
}

impl Element {
    pub(super) fn new(tag: &str) -> Self {
        Self {
            tag: tag.into(),
            ..Self::default()
        }
    }

    pub(super) fn with(mut self, key: &str, value: impl ToString) -> Self {
        self.attributes.push((key.into(), value.to_string()));
        self
    }

    pub(super) fn holding(mut self, child: Element) -> Self {
        self.push(child);
        self
    }

    pub(super) fn push(&mut self, child: Element) {
        self.content.push(Content::Element(child));
    }

    pub(super) fn comment(&mut self, text: impl Into<String>) {
        self.content.push(Content::Comment(text.into()));
    }

    /// The element with `text` as its only content.
    pub(super) fn saying(mut self, text: impl ToString) -> Self {
        self.content = vec![Content::Text(text.to_string())];
        self
    }

    /// The text inside, without the space around it.
    pub(super) fn text(&self) -> &str {
        let text = self.content.iter().find_map(|c| match c {
            Content::Text(t) => Some(t.trim()),
            _ => None,
        });
        text.unwrap_or_default()
    }

    pub(super) fn get(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    pub(super) fn children<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Element> {
        self.content.iter().filter_map(move |c| match c {
            Content::Element(e) if e.tag == tag => Some(e),
            _ => None,
        })
    }

    pub(super) fn child<'a>(&'a self, tag: &'a str) -> Option<&'a Element> {
        self.children(tag).next()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.content.is_empty()
    }

    /// The document, with its declaration.
    pub(super) fn document(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
        self.write(&mut text, 0);
        text
    }

    fn write(&self, out: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        let _ = write!(out, "{indent}<{}", self.tag);
        for (key, value) in &self.attributes {
            let _ = write!(out, " {key}=\"{}\"", escape(value));
        }
        if self.content.is_empty() {
            out.push_str("/>\n");
            return;
        }
        if let [Content::Text(text)] = self.content.as_slice() {
            let _ = writeln!(out, ">{}</{}>", escape(text), self.tag);
            return;
        }
        out.push_str(">\n");
        for item in &self.content {
            match item {
                Content::Element(e) => e.write(out, depth + 1),
                Content::Text(t) => {
                    let _ = writeln!(out, "{indent}  {}", escape(t));
                }
                Content::Comment(c) => {
                    let _ = writeln!(out, "{indent}  <!-- {} -->", harmless(c));
                }
            }
        }
        let _ = writeln!(out, "{indent}</{}>", self.tag);
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A comment may neither hold two hyphens in a row nor end in one.
fn harmless(text: &str) -> String {
    let mut clean = text.to_string();
    while clean.contains("--") {
        clean = clean.replace("--", "- -");
    }
    clean.trim_end_matches('-').to_string()
}

/// A number in the shortest form that reads back as the same double; no negative zero.
pub(super) fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 {
        format!("{value:e}")
    } else {
        format!("{}", value + 0.0)
    }
}

/// Numbers with a space between them.
pub(super) fn numbers(values: &[f64]) -> String {
    values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(" ")
}

/// Three numbers with a space between them.
pub(super) fn vector(v: &Vector3<f64>) -> String {
    numbers(v.as_slice())
}

/// The root element of a document; `file` is named in errors.
pub(super) fn parse(file: &std::path::Path, text: &str) -> Result<Element> {
    let mut reader = Reader::from_str(text);
    let mut open = vec![Element::new("")];
    loop {
        let place = reader.buffer_position();
        let event = reader
            .read_event()
            .map_err(|e| Error::bad_input(file, format!("byte {place}"), e.to_string(), "well-formed XML"))?;
        match event {
            Event::Start(start) => open.push(element(file, place, &start)?),
            Event::Empty(start) => {
                let child = element(file, place, &start)?;
                if let Some(parent) = open.last_mut() {
                    parent.push(child);
                }
            }
            Event::End(_) => {
                if let (Some(child), Some(parent)) = (open.pop(), open.last_mut()) {
                    parent.push(child);
                }
            }
            Event::Text(text) => {
                let text = text.xml_content(XmlVersion::Implicit1_0);
                if let Some(parent) = open.last_mut().filter(|_| !text.trim().is_empty()) {
                    parent.content.push(Content::Text(text.into_owned()));
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    let found = open.into_iter().next().and_then(|top| {
        top.content.into_iter().find_map(|c| match c {
            Content::Element(e) => Some(e),
            _ => None,
        })
    });
    found.ok_or_else(|| Error::bad_input(file, "document", "no element", "a root element"))
}

fn element(file: &std::path::Path, place: u64, start: &BytesStart) -> Result<Element> {
    let bad = |what: String| Error::bad_input(file, format!("byte {place}"), what, "an attribute in quotes");
    let mut out = Element::new(start.name().as_ref());
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| bad(e.to_string()))?;
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|e| bad(e.to_string()))?;
        let key = attribute.key.as_ref().to_string();
        out.attributes.push((key, value.into_owned()));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let mut root = Element::new("robot").with("name", "a<\"b\"&c");
        root.comment("never -- two hyphens --");
        root.push(Element::new("link").with("xyz", numbers(&[-0.0, 1e-9, 0.1])));
        let back = parse(std::path::Path::new("x.xml"), &root.document()).expect("parses");
        assert_eq!(back.get("name"), Some("a<\"b\"&c"));
        let link = back.child("link").expect("the child");
        assert_eq!(link.get("xyz"), Some("0 1e-9 0.1"));
    }
}
