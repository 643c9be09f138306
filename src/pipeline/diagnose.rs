//! A diagnosis of a model that there is already: the capture is cut as in a reconstruction, nothing is estimated.

use super::Options;
use crate::base::{Notices, Result};
use crate::capture::Capture;
use crate::stages::{diagnosis, interaction};
use crate::twin::Model;

/// What `model` gets wrong of `capture`.
pub fn diagnose(
    capture: &Capture,
    model: &Model,
    options: &Options,
    notices: &mut Notices,
) -> Result<diagnosis::Diagnosed> {
    let (sifted, faults) = interaction::sift(capture);
    let capture = sifted.as_ref().unwrap_or(capture);
    let segmented = interaction::segment(capture, model, &options.interaction, notices)?;
    diagnosis::diagnose(capture, &segmented, model, &faults, &options.diagnosis, notices)
}
