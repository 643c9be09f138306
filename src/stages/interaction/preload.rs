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
    let common = Common::of(capture, all).filter(|_| free.is_empty());
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
            if let Some(common) = common.as_ref().filter(|_| interaction.kind == Kind::Pull) {
                let unloaded = common.at(time);
                own.preload = Some(tare - unloaded);
                own.force_tare = Some(unloaded);
                own.tare_doubt = common.doubt;
            } else if interaction.kind == Kind::Lift && tare.norm() > PLAIN * noise {
                own.force_tare = Some(0.5 * tare);
                own.tare_doubt = 0.5 * tare.norm();
            }
            continue;
        };
        // What turns with the tool differs level with the table and is the same along the vertical.
        let felt = |k: usize| (tare[k] - unloaded[k]).abs() > (FELT * noise).max(DIFFERS * scatter[k]);
        let unloaded = Vector3::from_fn(|k, _| if felt(k) { unloaded[k] } else { tare[k] });
        if unloaded != tare {
            own.preload = Some(tare - unloaded);
            own.force_tare = Some(unloaded);
        }
    }
}

/// Fewest pulls that tell what hands read without a load, where no tool was free.
const PULLS: usize = 4;

/// What a sensor reads without a load, of hands that hold whenever a recording begins: their readings there differ as what they strain at
/// does, and what they have in common is the sensor's, a line of time.
struct Common {
    middle: f64,
    level: Vector3<f64>,
    slope: Vector3<f64>,
    /// Standard deviation, N.
    doubt: f64,
}

impl Common {
    /// Nothing where they do not differ: then they may well be the sensor's.
    fn of(capture: &Capture, all: &[Segmented]) -> Option<Self> {
        let held = capture
            .interactions
            .iter()
            .zip(all)
            .filter_map(|(i, own)| pulls(i).then_some((begin(i)?, own.force_tare?, own.force_noise?)));
        // A bias of a sensor that is turned differs, too.
        let turns: Vec<UnitQuaternion<f64>> = capture.interactions.iter().filter_map(rotation).collect();
        let turned = turns.iter().any(|t| t.angle_to(&turns[0]) > KEEPS);
        Self::told_by(&held.collect::<Vec<_>>()).filter(|_| !turned)
    }

    /// By what each read, with its noise, N, and when, s.
    fn told_by(held: &[(f64, Vector3<f64>, f64)]) -> Option<Self> {
        let noise = median(&held.iter().map(|h| h.2).collect::<Vec<f64>>())?;
        let n = held.len() as f64;
        let middle = held.iter().map(|h| h.0).sum::<f64>() / n;
        // Loads that differ do not come to nothing twice by chance, and a drift does not come back to it.
        let nothing = |h: &&(f64, Vector3<f64>, f64)| h.1.norm() < noise;
        let unloaded: Vec<_> = held.iter().filter(nothing).collect();
        let [first, last] = [unloaded.first(), unloaded.last()].map(|u| u.map_or(0.0, |u| u.0));
        let between = held
            .iter()
            .any(|h| h.1.norm() > PLAIN * noise && (first..last).contains(&h.0));
        if held.len() >= PULLS && between {
            return Some(Self {
                middle,
                level: unloaded.iter().map(|u| u.1).sum::<Vector3<f64>>() / unloaded.len() as f64,
                slope: Vector3::zeros(),
                doubt: noise,
            });
        }
        let level = held.iter().map(|h| h.1).sum::<Vector3<f64>>() / n;
        let spread = held.iter().map(|h| (h.0 - middle).powi(2)).sum::<f64>();
        let slope = held.iter().map(|h| h.1 * (h.0 - middle)).sum::<Vector3<f64>>() / spread.max(1e-12);
        let off = held.iter().map(|h| (h.1 - level - slope * (h.0 - middle)).norm());
        let scatter = (off.map(|o| o * o).sum::<f64>() / (n - 2.0).max(1.0)).sqrt();
        (held.len() >= PULLS && scatter > PLAIN * noise).then_some(Self {
            middle,
            level,
            slope,
            doubt: scatter / n.sqrt(),
        })
    }

    fn at(&self, time: f64) -> Vector3<f64> {
        self.level + self.slope * (time - self.middle)
    }
}

fn pulls(interaction: &Interaction) -> bool {
    interaction.kind == Kind::Pull && interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin)
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

/// The tare at `time`, N, and how much each of its components changes from one free tool to the next, N: where there is but one, as much as the noise of a
/// single reading. Nothing where there is none.
fn at(
    free: &[Free],
    time: f64,
    rotation: Option<UnitQuaternion<f64>>,
    noise: f64,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
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
    let steps = |k: usize| -> Vec<f64> { alike.windows(2).map(|w| (w[1].tare[k] - w[0].tare[k]).abs()).collect() };
    let scatter = Vector3::from_fn(|k, _| median(&steps(k)).unwrap_or(noise));
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
        assert!((tare.z - 0.15).abs() < 1e-12 && (scatter.z - 0.1).abs() < 1e-12);
        assert!((at(&free, 30.0, None, 0.01).expect("three").0.z - 0.2).abs() < 1e-12);
    }

    #[test]
    fn one_free_reading_is_known_as_well_as_its_noise() {
        let (tare, scatter) = at(&[free(0.0, 0.3)], 1.0, None, 0.02).expect("one");
        assert!((tare.z - 0.3).abs() < 1e-12 && (scatter.z - 0.02).abs() < 1e-12);
        assert!(at(&[], 1.0, None, 0.02).is_none());
    }

    #[test]
    fn hands_that_strain_differently_have_one_tare_and_a_drift_is_none() {
        let held = |z: fn(f64) -> f64| {
            let one = |k: u32| (f64::from(k), Vector3::z() * z(f64::from(k)), 0.01);
            (0..8).map(one).collect::<Vec<_>>()
        };
        let common = Common::told_by(&held(|t| 0.1 + 0.3 * (-1f64).powi(t as i32))).expect("they differ");
        assert!((common.at(3.5).z - 0.1).abs() < common.doubt && common.doubt < 0.2);
        assert!(Common::told_by(&held(|t| 0.1 * t)).is_none());
        // Pressed down by 2 N every other time: without a load the sensor reads nothing.
        let pressed = Common::told_by(&held(|t| if t as i32 % 2 == 0 { 0.0 } else { -2.0 })).expect("they differ");
        assert!(pressed.at(3.0).norm() < 1e-12 && pressed.doubt < 0.02);
        assert!(Common::told_by(&held(|t| 0.1 * t)[..3]).is_none());
    }
}
