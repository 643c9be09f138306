//! Writing a capture folder, whole or not at all.

use std::path::Path;

use super::Capture;
use crate::base::{Error, Result};

/// Writes `capture` as a folder that [`super::read_capture`] reads back the same.
pub fn write_capture(_capture: &Capture, folder: &Path) -> Result<()> {
    Err(Error::Failed(format!("{}: writing is not built yet", folder.display())))
}
