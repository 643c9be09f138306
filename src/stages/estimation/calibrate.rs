//! An entry for the table of materials from a series of tilts.

use super::Config;
use super::facts::{ground_of, subject};
use super::pool::pooled;
use super::tilt::slide_of;
use crate::base::{Error, Estimate, Notices, Result};
use crate::capture::{Capture, Kind, Segmented};
use crate::twin::{FORMAT, Twin};

/// Friction of the pair of materials in `capture` from its tilts, as an entry for `calibration/materials.toml`.
/// The standard deviations are those of a further slide of such a pair: the scatter between slides and the doubt
/// of the mean together. Fails where no tilt slid.
pub fn calibrate_friction(
    capture: &Capture,
    segmented: &[Segmented],
    config: &Config,
    notices: &mut Notices,
) -> Result<String> {
    config.check()?;
    let empty = Twin {
        format: FORMAT.into(),
        name: capture.name.clone(),
        gravity: capture.gravity.into(),
        support: None,
        bodies: Vec::new(),
        relations: Vec::new(),
        provenance: Default::default(),
        effects: Vec::new(),
        notices: Vec::new(),
    };
    let ground = ground_of(capture, &empty);
    let mut slides = Vec::new();
    let mut body = None;
    for interaction in capture.fitted().filter(|i| i.kind == Kind::Tilt) {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name);
        let Some((cut, link)) = cut.and_then(|c| Some((c, subject(interaction, c)?))) else {
            continue;
        };
        match slide_of(interaction, cut, link, &ground.gravity, &ground.point, config) {
            Some(slide) => slides.push(slide),
            None => notices.warn("calibrate", &interaction.name, "the body did not slide"),
        }
        body.get_or_insert(link.to_string());
    }
    let from: Vec<String> = slides.iter().map(|s| s.interaction.clone()).collect();
    let of = |pick: fn(&super::tilt::Slide) -> (f64, f64)| {
        let trials: Vec<(f64, f64)> = slides.iter().map(pick).collect();
        pooled(&trials, config.friction_scatter, 0.0, "1", from.clone(), "tilt").map(|e| (next_slide(&trials, &e), e))
    };
    let (Some((static_sd, static_)), Some((kinetic_sd, kinetic))) = (of(|s| s.static_), of(|s| s.kinetic)) else {
        return Err(Error::Failed(format!(
            "{}: no tilt in which a body slid; friction is calibrated from interactions of the kind `tilt`",
            capture.name
        )));
    };
    let body = body.unwrap_or_default();
    let material = capture.prior(&body).and_then(|b| b.material.clone()).unwrap_or(body);
    let support = capture
        .support
        .as_ref()
        .and_then(|s| s.material.clone())
        .unwrap_or("support".into());
    Ok(format!(
        "[[friction]]\npair = [{material:?}, {support:?}]\nstatic = {:.4}\nstatic_sd = {static_sd:.4}\nkinetic = {:.4}\n\
         kinetic_sd = {kinetic_sd:.4}\nhow = \"{} slide(s) on an inclined plane, capture {}\"\n",
        static_.value,
        kinetic.value,
        slides.len(),
        capture.name
    ))
}

/// Standard deviation of what one further slide would show.
fn next_slide(trials: &[(f64, f64)], mean: &Estimate) -> f64 {
    let n = trials.len() as f64;
    let scatter = trials.iter().map(|(v, _)| (v - mean.value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let half = mean.ci95.map_or(0.0, |[low, high]| (high - low) / (2.0 * 1.96));
    (scatter + half * half).sqrt()
}
