//! Doubts, gathered while a stage works, so that they are neither printed there nor swallowed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a notice matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Note,
    /// Something was left out or assumed.
    Warning,
}

/// One doubt, with the stage that had it and what it is about.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// How much it matters.
    pub severity: Severity,
    /// The stage that raised it, e.g. `shape`.
    pub stage: String,
    /// The body, interaction or file that it is about.
    pub about: String,
    /// The doubt, in words.
    pub message: String,
}

/// The doubts of one run, in the order in which they came up.
#[derive(Clone, Debug, Default)]
pub struct Notices(pub Vec<Notice>);

impl Notices {
    /// Records something that is good to know.
    pub fn note(&mut self, stage: &str, about: &str, message: impl Into<String>) {
        self.push(Severity::Note, stage, about, message.into());
    }

    /// Records that something was left out or assumed.
    pub fn warn(&mut self, stage: &str, about: &str, message: impl Into<String>) {
        self.push(Severity::Warning, stage, about, message.into());
    }

    fn push(&mut self, severity: Severity, stage: &str, about: &str, message: String) {
        self.0.push(Notice {
            severity,
            stage: stage.into(),
            about: about.into(),
            message,
        });
    }
}
