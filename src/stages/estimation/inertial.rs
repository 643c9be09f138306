//! What fast pushes say of the inertia of a body, beside what weighing it says of its mass.

use crate::base::Result;
use crate::capture::{Capture, Kind, Segmented};
use crate::twin::Model;

use super::Config;
use super::facts::{alone, ground_of, subject};
use super::identify::{befores, shapes};
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
}

/// Every push that was fast enough to tell of inertia, of links that moved alone.
pub fn inertial(capture: &Capture, segmented: &[Segmented], model: &Model) -> Result<Vec<Inertial>> {
    let ground = ground_of(capture, &model.twin);
    let config = Config::default();
    // Their shapes alone are asked, which no table of materials changes.
    let befores = befores(capture, model, &config.materials)?;
    let shapes = shapes(model, &befores, &ground);
    let pushes = capture.interactions.iter().filter(|i| i.kind == Kind::Push);
    let one = |interaction: &crate::capture::Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let link = subject(interaction, cut)?;
        if !alone(interaction, cut, link, &model.twin) {
            return None;
        }
        let (found, delay) = shoved_whole(interaction, cut, link, &ground, shapes.get(link)?, &config, LATE)?;
        Some(Inertial {
            link: link.to_owned(),
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            mass: found.mass,
            delay,
        })
    };
    Ok(pushes.filter_map(one).collect())
}
