//! What has to be sped up of a body that hangs on the tool and is moved to and fro: no friction is in it.
//!
//! The balance `F = m c'' + const` of the centre of mass `c`, with the weight and what the sensor is off by in the constant, is read in
//! the weak form of [`super::twist`]: each axis of the room is weighed with the same bumps, `∫ F φ dt = m ∫ c φ'' dt + const ∫ φ dt`.

use nalgebra::{Point3, Vector3};

use super::facts::subject;
use super::lift::aloft;
use super::twist::{DENSE, STEP, noise_gain, solved, weighed};
use crate::capture::{Capture, Interaction, Kind, Segmented, position_noise};
use crate::twin::Model;

/// Share of the strongest speeding up from which on a bump counts.
const STRONG: f64 = 0.15;
/// Doubt beyond which it says nothing, a share.
const WORTH: f64 = 0.05;

/// What one such lift says.
#[derive(Clone, Debug)]
pub struct Shaken {
    /// The link that hung on the tool.
    pub link: String,
    /// Which lift.
    pub interaction: String,
    /// It was not used to fit.
    pub held_out: bool,
    /// What has to be sped up, kg, with its standard deviation.
    pub mass: (f64, f64),
    /// Root mean square of the acceleration, m/s².
    pub acceleration: f64,
}

/// Every lift in which what hung on the tool was moved enough to tell.
pub fn shaken(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Shaken> {
    let up = -capture.gravity / capture.gravity.norm();
    let lifts = capture.interactions.iter().filter(|i| i.kind == Kind::Lift);
    let one = |interaction: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let link = model.twin.link(subject(interaction, cut)?)?;
        let alone = model
            .twin
            .bodies
            .iter()
            .any(|b| b.links.len() == 1 && b.links[0].name == link.name);
        let centre = Point3::from(link.com.as_ref()?.value);
        let (mass, acceleration) = shaken_in(interaction, cut, (&link.name, &centre), &up).filter(|_| alone)?;
        Some(Shaken {
            link: link.name.clone(),
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            mass,
            acceleration,
        })
    };
    lifts.filter_map(one).collect()
}

/// Mass with its standard deviation, kg, and the root mean square of the acceleration, m/s².
fn shaken_in(
    interaction: &Interaction,
    cut: &Segmented,
    (link, centre): (&str, &Point3<f64>),
    up: &Vector3<f64>,
) -> Option<((f64, f64), f64)> {
    let stream = interaction.force.as_ref()?;
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let stretch = aloft(interaction, cut, up, link)?;
    let poses: Vec<(f64, Point3<f64>)> = (0..track.len())
        .filter_map(|i| Some((track.time[i], track.pose(i)?.0 * centre)))
        .collect();
    let time: Vec<f64> = poses.iter().map(|p| p.0).collect();
    let ones = vec![1.0; time.len()];
    let count = ((stretch.end - stretch.start) / STEP) as usize;
    let of = |axis: usize| -> Vec<[f64; 4]> {
        let place: Vec<f64> = poses.iter().map(|p| p.1[axis]).collect();
        let force: Vec<f64> = stream.force.iter().map(|f| f[axis]).collect();
        let row = |k: usize| -> Option<[f64; 4]> {
            let middle = stretch.start + k as f64 * STEP;
            let own = |order: usize| weighed(&time, &place, (middle, order), DENSE);
            let level = weighed(&time, &ones, (middle, 0), DENSE)?;
            let felt = weighed(&stream.time, &force, (middle, 0), DENSE)?;
            let row = [own(2)?, -own(1)?, felt, level];
            row.iter().all(|x| x.is_finite()).then_some(row)
        };
        (0..count).filter_map(row).collect()
    };
    let mut axes = [0, 1, 2].map(of);
    // Bumps in which it hardly speeds up add the noise of the track alone.
    let most = axes.iter().flatten().map(|r| r[0].abs()).fold(0.0, f64::max);
    axes.iter_mut()
        .for_each(|rows| rows.retain(|r| r[0].abs() > STRONG * most));
    let rows: Vec<[f64; 3]> = axes.iter().flat_map(|rows| without_level(rows)).collect();
    let (mass, sd) = solved(&rows, position_noise(&[track]) * noise_gain(&time))?;
    let squares: f64 = axes.iter().flatten().map(|r| (r[0] / r[3]).powi(2)).sum();
    let acceleration = (squares / rows.len() as f64).sqrt();
    (mass > 0.0 && sd < WORTH * mass).then_some(((mass, sd), acceleration))
}

/// Balances of one axis with its constant, which the last column weighs, taken out.
fn without_level(rows: &[[f64; 4]]) -> Vec<[f64; 3]> {
    let squares: f64 = rows.iter().map(|r| r[3] * r[3]).sum();
    let level = [0, 1, 2].map(|k| rows.iter().map(|r| r[k] * r[3]).sum::<f64>() / squares.max(1e-300));
    rows.iter().map(|r| [0, 1, 2].map(|k| r[k] - level[k] * r[3])).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::capture::{Phase, PhaseKind, PoseStream, WrenchStream};

    /// A lift by 12 cm, in which 4 cm are gone to one side and back within 0.35 s each, of what weighs as 0.7 kg.
    fn lift(inert: f64) -> (Interaction, Segmented) {
        let smooth = |u: f64| {
            let u = u.clamp(0.0, 1.0);
            u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        };
        let place = |t: f64| {
            let up = 0.12 * (smooth((t - 1.0) / 1.2) - smooth((t - 6.0) / 1.2));
            Vector3::new(0.04 * (smooth((t - 4.0) / 0.35) - smooth((t - 4.8) / 0.35)), 0.0, up)
        };
        let wobble = |i: usize, k: usize| ((i * 37 + k * 11) % 13) as f64 / 6.0 - 1.0;
        let track: Vec<f64> = (0..800).map(|i| 0.01 * i as f64).collect();
        let stream = |noise: f64| PoseStream {
            position: (0..track.len())
                .map(|i| Point3::from(place(track[i]) + noise * Vector3::new(wobble(i, 0), wobble(i, 1), wobble(i, 2))))
                .collect(),
            rotation: vec![Some(UnitQuaternion::identity()); track.len()],
            time: track.clone(),
        };
        let time: Vec<f64> = (0..4000).map(|i| 0.002 * i as f64).collect();
        let force = |t: &f64| {
            let speeding = (place(t + 1e-3) - 2.0 * place(*t) + place(t - 1e-3)) / 1e-6;
            inert * speeding + Vector3::new(0.2, 0.0, 0.7 * 9.81)
        };
        let interaction = Interaction {
            name: "lift".into(),
            kind: Kind::Lift,
            action: None,
            tool_name: None,
            tool: None,
            target: Some("box".into()),
            force: Some(WrenchStream {
                force: time.iter().map(force).collect(),
                torque: None,
                time,
            }),
            tool_path: Some(stream(0.0)),
            support_path: None,
            tracks: BTreeMap::from([("box".to_owned(), stream(2e-4))]),
            frames: None,
            held_out: false,
        };
        let cut = Segmented {
            interaction: "lift".into(),
            phases: vec![Phase {
                kind: PhaseKind::Slide,
                start: 1.0,
                end: 7.2,
                moving: vec!["box".into()],
                touched: vec!["box".into()],
            }],
            force_noise: None,
            force_tare: None,
            preload: None,
            tare_doubt: 0.0,
            position_noise: None,
            rotation_noise: None,
        };
        (interaction, cut)
    }

    #[test]
    fn what_has_to_be_sped_up_is_told_to_a_few_hundredths() {
        for inert in [0.7, 1.05] {
            let (interaction, cut) = lift(inert);
            let read = shaken_in(&interaction, &cut, ("box", &Point3::origin()), &Vector3::z());
            let ((mass, sd), acceleration) = read.expect("a mass");
            assert!((mass / inert - 1.0).abs() < 0.03 && sd < 0.03 * inert, "{mass} {sd}");
            assert!(acceleration > 0.3, "{acceleration}");
        }
    }

    #[test]
    fn a_constant_says_nothing_of_the_mass() {
        // Bumps of a body of 0.7 kg under 4 N of weight and bias.
        let row = |k: usize| {
            let (speeding, level) = ((0.7 * k as f64).sin(), 0.1 + 0.01 * (k % 3) as f64);
            [
                speeding,
                0.1 * (0.7 * k as f64).cos(),
                0.7 * speeding + 4.0 * level,
                level,
            ]
        };
        let rows: Vec<[f64; 4]> = (0..30).map(row).collect();
        let (mass, _) = solved(&without_level(&rows), 1e-3).expect("a mass");
        assert!((mass - 0.7).abs() < 1e-9, "{mass}");
    }
}
