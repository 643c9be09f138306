//! What fast pushes say of the inertia of a body, beside what weighing it says of its mass.

use crate::base::Result;
use crate::capture::{Capture, Kind, Segmented};
use crate::twin::Model;

use super::Config;
use super::accelerate::accelerated_late;
use super::company::alone;
use super::facts::{ground_of, subject};
use super::identify::{befores, shapes};
use super::rolling::tumbles;
use super::shoved::shoved_whole;

/// Delay between force and track that is thought possible where something may be wrong (1 sd), s.
const LATE: f64 = 0.03;

/// What one fast push says.
#[derive(Clone, Debug)]
pub struct Inertial {
    /// The link that was pushed.
    pub link: String,
    /// Which push.
    pub interaction: String,
    /// It was not used to fit.
    pub held_out: bool,
    /// What has to be sped up, kg, with its standard deviation.
    pub mass: (f64, f64),
    /// How much later than the track the force is read, s, with its standard deviation.
    pub delay: (f64, f64),
    /// By how much the logarithm of the mass goes with the delay, 1/s.
    pub mass_by_delay: f64,
    /// It was followed from rest on, before the finger touched.
    pub from_rest: bool,
}

impl Inertial {
    /// Logarithm of the mass, kg, with its standard deviation, where the delay is known from elsewhere to be `delay` (s) with its
    /// standard deviation: what of the doubt was that of the delay is taken out.
    pub fn log_mass_at(&self, delay: (f64, f64)) -> (f64, f64) {
        let (mean, sd) = (self.mass.0.ln(), self.mass.1 / self.mass.0);
        let by = self.mass_by_delay;
        let own = (sd * sd - (by * self.delay.1).powi(2)).max((0.1 * sd).powi(2));
        (mean - by * (self.delay.0 - delay.0), own.sqrt().hypot(by * delay.1))
    }

    /// The delay, s, with its standard deviation, where the logarithm of the mass, kg, is known from elsewhere to be `log_mass` with
    /// its standard deviation.
    pub fn delay_at(&self, log_mass: (f64, f64)) -> (f64, f64) {
        let (mean, sd) = (self.mass.0.ln(), self.mass.1 / self.mass.0);
        let variance = self.delay.1 * self.delay.1;
        let slope = self.mass_by_delay * variance / (sd * sd);
        let own = (variance - (slope * sd).powi(2)).max(0.01 * variance);
        (
            self.delay.0 + slope * (log_mass.0 - mean),
            own.sqrt().hypot(slope * log_mass.1),
        )
    }
}

/// Every push that was fast enough to tell of inertia, and every drag by a hand that was, of links that moved alone.
pub fn inertial(capture: &Capture, segmented: &[Segmented], model: &Model) -> Result<Vec<Inertial>> {
    let ground = ground_of(capture, &model.twin);
    let config = Config::default();
    // Their shapes alone are asked, which no table of materials changes.
    let befores = befores(capture, model, &config.materials)?;
    let shapes = shapes(model, &befores, &ground);
    let drags = |i: &crate::capture::Interaction| i.kind == Kind::Pull && i.tool.as_ref().is_some_and(|t| t.grip);
    let moved = capture.interactions.iter().filter(|i| i.kind == Kind::Push || drags(i));
    let one = |interaction: &crate::capture::Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let link = subject(interaction, cut)?;
        let track = interaction.tracks.get(link)?;
        if !alone(interaction, cut, link, &model.twin) || tumbles(track, &ground.plane.normal) {
            return None;
        }
        let (found, delay, mass_by_delay, from_rest) = if drags(interaction) {
            let (found, delay, slope) = accelerated_late(interaction, cut, link, &ground, &config, LATE)?;
            (found, delay, slope, false)
        } else {
            shoved_whole(interaction, cut, link, &ground, shapes.get(link)?, &config, LATE)?
        };
        Some(Inertial {
            link: link.to_owned(),
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            mass: found.mass,
            delay,
            mass_by_delay,
            from_rest,
        })
    };
    Ok(moved.filter_map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_known_delay_takes_off_the_doubt_of_a_mass() {
        let push = Inertial {
            link: "box".into(),
            interaction: "push".into(),
            held_out: false,
            mass: (2.0, 0.4),
            delay: (0.01, 0.004),
            mass_by_delay: 45.0,
            from_rest: false,
        };
        let (mean, sd) = push.log_mass_at((0.002, 0.0));
        assert!((mean - (2.0f64.ln() - 45.0 * 0.008)).abs() < 1e-12);
        assert!((sd - (0.2f64 * 0.2 - 0.18 * 0.18).sqrt()).abs() < 1e-12, "{sd}");
        let (mean, sd) = push.log_mass_at(push.delay);
        assert!((mean - 2.0f64.ln()).abs() < 1e-12 && (sd - 0.2).abs() < 1e-12, "{sd}");
        let (delay, sd) = push.delay_at((2.0f64.ln() - 0.2, 0.0));
        assert!((delay - (0.01 - 0.9 * 0.004)).abs() < 1e-12, "{delay}");
        assert!((sd - 0.004 * 0.19f64.sqrt()).abs() < 1e-12, "{sd}");
    }
}
