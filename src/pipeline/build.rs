//! The method itself, a verb a line.

use crate::base::{Notices, Result, Seed};
use crate::capture::{Capture, Segmented};
use crate::stages::diagnosis::Trace;
use crate::twin::{Diagnosis, Model};

/// How to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seed of everything in which chance plays a part.
    pub seed: Seed,
}

/// A finished run, ready to be exported and shown.
#[derive(Clone, Debug)]
pub struct Run {
    /// The twin with its meshes.
    pub model: Model,
    /// What it still gets wrong.
    pub diagnosis: Diagnosis,
    /// Measured against predicted.
    pub traces: Vec<Trace>,
    /// The interactions cut into phases.
    pub segmented: Vec<Segmented>,
    /// Doubts that came up.
    pub notices: Notices,
}

/// From a capture to a twin.
pub fn build(_capture: &Capture, _options: &Options) -> Result<Run> {
    Err(crate::base::Error::Failed("the pipeline is not built yet".into()))
}
