//! Plays a capture's touches in each engine and sets the outcome beside what was measured.

use std::path::Path;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::outside::{EngineName, Silence, ask};
use super::recorded::{Recorded, recorded};
use super::table::{Doubt, EngineReport, EnginesReport, Outcome, RestRow, TouchRow};
use crate::base::{Pose, Result, Seed};
use crate::capture::Capture;
use crate::export::{Hold, Played, StagedScene, StagedTrial, Trial, play, rest_in_engine, stage, variant};
use crate::twin::Model;

/// Seconds of rest in every engine.
const REST_SECONDS: f64 = 5.0;
/// Seconds over which forces are averaged before they are compared: stiff contacts chatter.
const BLOCK: f64 = 0.25;

/// A tool that is slower than this stands, m/s.
const SLOW: f64 = 1e-3;
/// Models drawn from the twin by which the doubt of a touch is told.
const DRAWS: usize = 8;

/// Plays the touches of `capture` with the twin in `folder`, which holds `model` and its exports, in each of `engines`; `seed`
/// is that of the models by which the doubt of each held-out touch is told that an engine misses.
///
/// # Errors
/// Where the twin cannot be laid out. An engine that is not there, or fails, is told in the report.
pub fn compare(
    capture: &Capture,
    model: &Model,
    folder: &Path,
    engines: &[EngineName],
    seed: Seed,
) -> Result<EnginesReport> {
    let (touches, skipped) = recorded(capture, model)?;
    let trials: Vec<_> = touches.iter().map(|t| t.trial.clone()).collect();
    let (scene, staged) = stage(model, &trials)?;
    let reports: Vec<Result<EngineReport>> = engines
        .par_iter()
        .map(|engine| {
            let (mut report, played) = match engine {
                EngineName::Rapier => embedded(model, &trials)?,
                _ => outside(*engine, folder, &scene, &staged),
            };
            let rows = touches.iter().zip(played).map(|(t, p)| row(model, t, p));
            report.touches = rows.collect();
            Ok(report)
        })
        .collect();
    let reports = reports.into_iter().collect::<Result<Vec<_>>>()?;
    let held_out: Vec<&Recorded> = touches
        .iter()
        .filter(|t| t.held_out && t.trial.hold == Hold::Touch)
        .collect();
    let doubts: Vec<Option<Doubt>> = held_out.par_iter().map(|t| doubt(model, t, seed)).collect();
    Ok(EnginesReport {
        doubts: doubts.into_iter().flatten().collect(),
        capture: capture.name.clone(),
        rest_seconds: REST_SECONDS,
        engines: reports,
        skipped,
    })
}

/// What an engine said of each trial, or why it said nothing.
type PlayedOrNot = Vec<std::result::Result<Played, String>>;

fn silent(engine: EngineName) -> EngineReport {
    EngineReport {
        engine,
        version: String::new(),
        silent: None,
        rest: Vec::new(),
        touches: Vec::new(),
    }
}

fn embedded(model: &Model, trials: &[Trial]) -> Result<(EngineReport, PlayedOrNot)> {
    let report = EngineReport {
        rest: embedded_rest(model)?,
        ..silent(EngineName::Rapier)
    };
    let play_one = |t| play(model, t).map_err(|e| e.to_string());
    Ok((report, trials.par_iter().map(play_one).collect()))
}

fn outside(
    engine: EngineName,
    folder: &Path,
    scene: &StagedScene,
    trials: &[StagedTrial],
) -> (EngineReport, PlayedOrNot) {
    let mut report = silent(engine);
    match ask(engine, folder, scene, trials, REST_SECONDS) {
        Err(Silence::NotThere(why)) => {
            report.silent = Some(why);
            (report, Vec::new())
        }
        Err(Silence::Failed(why)) => {
            report.silent = Some(format!("failed: {why}"));
            (report, Vec::new())
        }
        Ok(answer) => {
            report.version = answer.version;
            report.rest = answer.rest.into_iter().map(|(p, r)| rest_row(p, r)).collect();
            (report, answer.trials)
        }
    }
}

/// How the touch comes out with models drawn from the twin; nothing where it cannot be played.
fn doubt(model: &Model, touch: &Recorded, seed: Seed) -> Option<Doubt> {
    let name = &touch.trial.target;
    let ended: Option<Vec<Pose>> = (0..DRAWS)
        .into_par_iter()
        .map(|k| {
            let (drawn, _) = variant(model, seed, k);
            let tool = drawn.twin.link(name)?.friction.tool.as_ref();
            let trial = Trial {
                friction: tool.map_or(touch.trial.friction, |e| e.value),
                ..touch.trial.clone()
            };
            play(&drawn, &trial).ok()?.ended.get(name).copied()
        })
        .collect();
    let ended = ended?;
    let com = model.twin.link(name)?.com.as_ref().map_or([0.0; 3], |c| c.value);
    let places: Vec<Vector3<f64>> = ended.iter().map(|p| (p.0 * Point3::from(com)).coords).collect();
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let rms = |of: &mut dyn Iterator<Item = f64>| (of.map(|v| v * v).sum::<f64>() / DRAWS as f64).sqrt();
    let first = ended.first()?.rotation;
    Some(Doubt {
        interaction: touch.trial.name.clone(),
        position: rms(&mut places.iter().map(|p| (p - mean).norm())),
        turn: rms(&mut ended.iter().map(|p| p.rotation.angle_to(&first))),
    })
}

fn embedded_rest(model: &Model) -> Result<Vec<RestRow>> {
    let results = rest_in_engine(model, REST_SECONDS)?;
    let row = |r: crate::export::RestResult| rest_row(r.part, [r.settling, r.late_drift, r.late_turn]);
    Ok(results.into_iter().map(row).collect())
}

fn rest_row(part: String, [settling, drift, turn]: [f64; 3]) -> RestRow {
    RestRow {
        part,
        settling,
        drift,
        turn,
    }
}

fn row(model: &Model, touch: &Recorded, played: std::result::Result<Played, String>) -> TouchRow {
    let link = &touch.trial.target;
    let com = model.twin.link(link).and_then(|l| l.com.as_ref());
    let com = Point3::from(com.map_or([0.0; 3], |c| c.value));
    let measured = touch.after.0 * com - touch.before.0 * com;
    let turn = touch.after.rotation * touch.before.rotation.inverse();
    let ends = |p: &Played| p.settled.get(link).copied().zip(p.ended.get(link).copied());
    let outcome = match played.and_then(|p| ends(&p).ok_or_else(|| "the engine lost it".into()).map(|e| (p, e))) {
        Err(why) => Outcome::NotPlayed(why),
        Ok((played, (settled, ended))) => {
            let went = ended.0 * com - settled.0 * com;
            let error = (went - measured).norm();
            let turned = ended.rotation * settled.rotation.inverse();
            let force = force_errors(touch, &played.force);
            Outcome::Played {
                missed_by: (went - measured).into(),
                position_error: error,
                relative_error: error / measured.norm().max(1e-6),
                turn_error: touch.oriented.then(|| turned.angle_to(&turn)),
                force_rms: force.map(|f| f[0]),
                force_measured: force.map(|f| f[1]),
            }
        }
    };
    TouchRow {
        interaction: touch.trial.name.clone(),
        link: link.clone(),
        held_out: touch.held_out,
        travel: measured.norm(),
        turned: touch.oriented.then(|| turn.angle()),
        tool_friction_assumed: touch.friction_assumed,
        tool_shifted: touch.shifted,
        outcome,
    }
}

/// Root mean squares of the difference and of the measured force, N, over the blocks in which the tool moves: a finger that
/// stands still keeps pressing by its own softness, which engines do not have.
fn force_errors(touch: &Recorded, played: &[(f64, [f64; 3])]) -> Option<[f64; 2]> {
    let measured = touch.force.as_slice();
    if touch.trial.hold != Hold::Touch {
        return None;
    }
    let end = played.last()?.0.min(measured.last()?.0);
    let mean = |of: &mut dyn Iterator<Item = Vector3<f64>>| {
        let (sum, count) = of.fold((Vector3::zeros(), 0.0), |(s, n), f| (s + f, n + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let (mut squares, mut count) = ([0.0; 2], 0.0);
    for block in (0..(end / BLOCK) as usize).filter(|b| moves(&touch.trial, *b)) {
        let within = |t: f64| (t / BLOCK) as usize == block && t >= 0.0;
        let a = mean(&mut measured.iter().filter(|r| within(r.0)).map(|r| r.1));
        let b = mean(&mut played.iter().filter(|r| within(r.0)).map(|r| Vector3::from(r.1)));
        if let (Some(a), Some(b)) = (a, b) {
            squares[0] += (a - b).norm_squared();
            squares[1] += a.norm_squared();
            count += 1.0;
        }
    }
    (count > 0.0).then(|| squares.map(|s| (s / count).sqrt()))
}

/// Whether the tool goes on in a block.
fn moves(trial: &Trial, block: usize) -> bool {
    let row = |t: f64| {
        trial
            .time
            .partition_point(|x| *x < t)
            .min(trial.path.len().saturating_sub(1))
    };
    let at = |t: f64| trial.path.get(row(t)).map(|p| p.translation.vector);
    let ends = at(BLOCK * block as f64).zip(at(BLOCK * (block + 1) as f64));
    ends.is_some_and(|(a, b)| (a - b).norm() > SLOW * BLOCK)
}
