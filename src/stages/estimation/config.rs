//! What can be set for the physics pass.

use super::{ForceScale, MaterialFriction};
use crate::base::{Error, Result};

/// Settings of the physics pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Span over which wrench and motion are averaged into one sample, s.
    pub block: f64,
    /// Half the span of the parabola from which velocities are taken, s.
    pub smoothing: f64,
    /// Left out after sliding starts and before contact ends, s.
    pub settling: f64,
    /// Scatter of friction from push to push that is expected before any is seen, as a share.
    pub friction_scatter: f64,
    /// Share by which the laws themselves (Coulomb, ellipsoidal limit surface) may be off.
    pub model_form: f64,
    /// Trust in the reported angle of the support, rad (1 sd).
    pub angle_sd: f64,
    /// Sliding distance over which a tilt is fitted, m.
    pub tilt_distance: f64,
    /// Density of an unknown body, kg/m³, and the standard deviation of its logarithm.
    pub density: (f64, f64),
    /// Friction of an unknown pair and its standard deviation.
    pub friction_prior: (f64, f64),
    /// The scale of the force sensor, where it was calibrated.
    pub force_scale: Option<ForceScale>,
    /// Friction by pair of materials that comes before the built-in table.
    pub materials: Vec<MaterialFriction>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            block: 0.1,
            smoothing: 0.12,
            settling: 0.12,
            friction_scatter: 0.015,
            model_form: 0.005,
            angle_sd: 1e-3,
            tilt_distance: 0.15,
            density: (700.0, 0.7),
            friction_prior: (0.35, 0.2),
            force_scale: None,
            materials: Vec::new(),
        }
    }
}

/// Doubt of the scale of a force sensor that was not calibrated, a share.
const FORCE_GAIN: f64 = 1e-3;

impl Config {
    /// Doubt of the scale of the force sensor, a share (1 sd).
    pub fn force_gain_sd(&self) -> f64 {
        self.force_scale.as_ref().map_or(FORCE_GAIN, |s| s.gain_sd)
    }

    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let positive = [
            self.block,
            self.smoothing,
            self.friction_scatter,
            self.tilt_distance,
            self.density.0,
            self.density.1,
            self.friction_prior.0,
            self.friction_prior.1,
        ]
        .iter()
        .all(|v| *v > 0.0 && v.is_finite());
        if positive && self.settling >= 0.0 && self.model_form >= 0.0 && self.angle_sd >= 0.0 {
            return Ok(());
        }
        Err(Error::Usage("estimation: every setting must be positive".into()))
    }
}
