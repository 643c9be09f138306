//! What a format cannot say, or what an export had to assume.

use std::fmt;

use serde::Serialize;

/// One thing that an exported file does not say as the twin does.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct ExportNote {
    /// `urdf`, `mjcf`, `gltf`, or `all`.
    pub format: String,
    /// The body, link, joint or relation that it is about.
    pub about: String,
    /// In words.
    pub message: String,
}

impl ExportNote {
    /// A note on one format.
    pub(super) fn new(format: &str, about: &str, message: impl Into<String>) -> Self {
        Self {
            format: format.into(),
            about: about.into(),
            message: message.into(),
        }
    }

    /// Whether the note belongs into a file of that format.
    pub(super) fn concerns(&self, format: &str) -> bool {
        self.format == format || self.format == "all"
    }
}

impl fmt::Display for ExportNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.format, self.about, self.message)
    }
}
