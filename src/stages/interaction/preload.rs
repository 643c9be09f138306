//! Hands that hold already when a recording begins: what they read at rest is a load, and no tare.

use nalgebra::{UnitQuaternion, Vector3};

use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::median;

/// Turn of the tool, rad, up to which a sensor that turns with it reads a bias the same.
const KEEPS: f64 = 0.3;
/// A reading is a load from so many standard deviations of a single reading on, and of how free readings differ from one to the next.
const FELT: f64 = 1.0;
const DIFFERS: f64 = 5.0;

/// The same where no free tool was read, and a bias may be as large.
const PLAIN: f64 = 5.0;

/// What a sensor read while its tool was free, N, and when, s.
struct Free {
    time: f64,
    tare: Vector3<f64>,
    rotation: Option<UnitQuaternion<f64>>,
}

/// Gives lifts and pulls that begin with a load the tare that free tools of the same capture have shown at that time.
pub fn tell_preloads(capture: &Capture, all: &mut [Segmented]) {
    let free: Vec<Free> = capture
        .interactions
        .iter()
        .zip(all.iter())
        .filter_map(|(i, s)| free_reading(i, s))
        .collect();
    for (interaction, own) in capture.interactions.iter().zip(all) {
        let holds = matches!(interaction.kind, Kind::Lift | Kind::Pull)
            && interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
        let (Some(tare), Some(noise), Some(time)) = (own.force_tare, own.force_noise, begin(interaction)) else {
            continue;
        };
        if !holds {
            continue;
        }
        let Some((unloaded, scatter)) = at(&free, time, rotation(interaction), noise) else {
            // It is the one or the other.
            if interaction.kind == Kind::Lift && tare.norm() > PLAIN * noise {
                own.force_tare = Some(0.5 * tare);
                own.tare_doubt = 0.5 * tare.norm();
            }
            continue;
        };
        if (tare - unloaded).norm() > (FELT * noise).max(DIFFERS * scatter) {
            own.preload = Some(tare - unloaded);
            own.force_tare = Some(unloaded);
        }
    }
}

fn begin(interaction: &Interaction) -> Option<f64> {
    interaction.force.as_ref()?.time.first().copied()
}

fn rotation(interaction: &Interaction) -> Option<UnitQuaternion<f64>> {
    interaction
        .tool_path
        .as_ref()?
        .rotation
        .iter()
        .flatten()
        .next()
        .copied()
}

fn free_reading(interaction: &Interaction, own: &Segmented) -> Option<Free> {
    interaction.tool.as_ref().filter(|t| !t.grip && !t.pin)?;
    Some(Free {
        time: begin(interaction)?,
        tare: own.force_tare?,
        rotation: rotation(interaction),
    })
}

/// The tare at `time`, N, and how much it changes from one free tool to the next, N: where there is but one, as much as the noise of a
/// single reading. Nothing where there is none.
fn at(free: &[Free], time: f64, rotation: Option<UnitQuaternion<f64>>, noise: f64) -> Option<(Vector3<f64>, f64)> {
    let alike = |f: &&Free| match (f.rotation, rotation) {
        (Some(a), Some(b)) => a.angle_to(&b) < KEEPS,
        _ => true,
    };
    let mut alike: Vec<&Free> = free.iter().filter(alike).collect();
    // How readings differ between tools that are held in other ways tells how much of them turns with the tool.
    if alike.len() < 2 {
        alike = free.iter().collect();
    }
    alike.sort_by(|a, b| a.time.total_cmp(&b.time));
    let steps: Vec<f64> = alike.windows(2).map(|w| (w[1].tare - w[0].tare).norm()).collect();
    let scatter = median(&steps).unwrap_or(noise);
    let next = alike.partition_point(|f| f.time < time);
    let tare = match (next.checked_sub(1).map(|k| alike[k]), alike.get(next)) {
        (Some(a), Some(b)) => a.tare.lerp(&b.tare, (time - a.time) / (b.time - a.time).max(1e-9)),
        (Some(one), None) => one.tare,
        (None, one) => one?.tare,
    };
    Some((tare, scatter))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free(time: f64, z: f64) -> Free {
        Free {
            time,
            tare: Vector3::z() * z,
            rotation: None,
        }
    }

    #[test]
    fn a_tare_that_drifts_is_read_between_its_neighbours() {
        let free = [free(0.0, 0.0), free(10.0, 0.1), free(20.0, 0.2)];
        let (tare, scatter) = at(&free, 15.0, None, 0.01).expect("three");
        assert!((tare.z - 0.15).abs() < 1e-12 && (scatter - 0.1).abs() < 1e-12);
        assert!((at(&free, 30.0, None, 0.01).expect("three").0.z - 0.2).abs() < 1e-12);
    }

    #[test]
    fn one_free_reading_is_known_as_well_as_its_noise() {
        let (tare, scatter) = at(&[free(0.0, 0.3)], 1.0, None, 0.02).expect("one");
        assert!((tare.z - 0.3).abs() < 1e-12 && (scatter - 0.02).abs() < 1e-12);
        assert!(at(&[], 1.0, None, 0.02).is_none());
    }
}
