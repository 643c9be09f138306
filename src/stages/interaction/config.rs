//! What can be set for the interaction pass.

use crate::base::{Error, Result};

/// Settings of the interaction pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// A force this many standard deviations of the smoothed noise off the tare is contact.
    pub contact_sigmas: f64,
    /// A force below this share of the interaction's largest is not contact.
    pub contact_share: f64,
    /// A body displaced by this many standard deviations of its smoothed position has moved.
    pub motion_sigmas: f64,
    /// Smallest displacement that counts as motion, m.
    pub motion_floor: f64,
    /// Smallest rotation that counts as motion, rad.
    pub turn_floor: f64,
    /// Span over which force is smoothed to find contact, s.
    pub force_window: f64,
    /// Span over which tracks are smoothed to find motion, s.
    pub track_window: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            contact_sigmas: 6.0,
            contact_share: 0.03,
            motion_sigmas: 5.0,
            motion_floor: 3e-4,
            turn_floor: 3e-3,
            force_window: 0.01,
            track_window: 0.06,
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let positive = [
            self.contact_sigmas,
            self.contact_share,
            self.motion_sigmas,
            self.motion_floor,
            self.turn_floor,
            self.force_window,
            self.track_window,
        ]
        .iter()
        .all(|v| *v > 0.0 && v.is_finite());
        if positive {
            return Ok(());
        }
        Err(Error::Usage("interaction: every setting must be positive".into()))
    }
}
