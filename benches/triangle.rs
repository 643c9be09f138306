//! Final poses of held-out pushes beside a plain limit surface: `cargo bench --bench triangle -- CAPTURE...`.
//!
//! For every capture the error of the final pose of each push that was not fitted (position of the body's frame, mm, and
//! heading, degrees; root mean square and median), foretold by the twin, and by the same model with even pressure under the
//! whole face, the centre of mass at the centroid and a nominal finger friction of 0.25, or the twin's. What the tool missed
//! of the surface is fitted anew for each push from the measured way along the push, for all of them alike.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "a program that measures stops at what it cannot read, and prints"
)]

use std::path::Path;

use palpate::base::{Estimate, Progress};
use palpate::capture::{Capture, Interaction, read_capture};
use palpate::geometry::mass_properties;
use palpate::physics::uniform_torsional_radius;
use palpate::pipeline::{Options, Run, build};
use palpate::stages::estimation::{action_of, replay_push};
use palpate::twin::Model;

/// Friction of a steel finger on aluminium as handbooks have it.
const NOMINAL: f64 = 0.25;

fn main() {
    println!(
        "capture: pushes, then rms (median) of position / heading: twin; even pressure, nominal finger; even pressure, the twin's finger"
    );
    for folder in std::env::args().skip(1).filter(|a| !a.starts_with('-')) {
        let capture = read_capture(Path::new(&folder)).expect("a capture");
        let run = build(&capture, &Options::default(), &Progress::silent()).expect("a twin");
        let even = even_pressure(&run.model, Some(NOMINAL));
        let own_finger = even_pressure(&run.model, None);
        let rows: Vec<[(f64, f64); 3]> = capture
            .interactions
            .iter()
            .filter(|i| i.held_out)
            .filter_map(|i| {
                let of = |model: &Model| error(&capture, i, &run, model);
                Some([of(&run.model)?, of(&even)?, of(&own_finger)?])
            })
            .collect();
        let said: Vec<String> = (0..3)
            .map(|k| {
                let (mm, degrees): (Vec<f64>, Vec<f64>) = rows.iter().map(|r| r[k]).unzip();
                format!("{} mm / {} degrees", summary(&mm), summary(&degrees))
            })
            .collect();
        println!("{}: {}, {}", capture.name, rows.len(), said.join("; "));
    }
}

fn summary(values: &[f64]) -> String {
    let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    format!("{rms:.2} ({:.2})", sorted[sorted.len() / 2])
}

/// The twin without what was learnt of its pressure and its centre of mass.
fn even_pressure(model: &Model, finger: Option<f64>) -> Model {
    let mut plain = model.clone();
    for link in plain.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let Some(mesh) = link.mesh.as_ref().and_then(|m| model.meshes.get(m)) else {
            continue;
        };
        let centroid = mass_properties(mesh).expect("closed").centroid;
        link.com = Some(Estimate::assumed(centroid.coords.into(), [0.0; 3], "m", "centroid"));
        let radius = uniform_torsional_radius(mesh, &link.pose.0).expect("stands on a face");
        link.friction.torsional_radius = Some(Estimate::assumed(radius, 0.0, "m", "even pressure"));
        if let Some(finger) = finger {
            link.friction.tool = Some(Estimate::assumed(finger, 0.0, "1", "nominal"));
        }
    }
    plain
}

/// Error of the final pose, mm and degrees.
fn error(capture: &Capture, interaction: &Interaction, run: &Run, model: &Model) -> Option<(f64, f64)> {
    let cut = run.segmented.iter().find(|s| s.interaction == interaction.name);
    let action = action_of(capture, interaction, cut, model)?;
    let (_, found) = replay_push(model, interaction, cut, &action, 0.0, 3)?;
    let predicted = found.prediction.poses.get(&action.target)?.last()?;
    let track = interaction.tracks.get(&action.target)?;
    let (position, rotation) = (track.position.last()?, (*track.rotation.last()?)?);
    let turn = (predicted.rotation * rotation.inverse()).angle();
    let away = predicted.translation.vector - position.coords;
    Some((1e3 * away.norm(), turn.to_degrees()))
}
