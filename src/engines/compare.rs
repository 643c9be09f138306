//! Plays a capture's touches in each engine and sets the outcome beside what was measured.

use std::path::Path;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::outside::{EngineName, Silence, ask};
use super::probe::Probe;
use super::reason::Reason;
use super::recorded::{Recorded, recorded};
use super::table::{EngineReport, EnginesReport, Outcome, RestRow, TouchRow};
use crate::base::Result;
use crate::capture::Capture;
use crate::export::{Hold, Played, StagedScene, StagedTrial, Trial, play, rest_in_engine, stage};
use crate::twin::{Diagnosis, Model};

/// Seconds of rest in every engine.
const REST_SECONDS: f64 = 5.0;
/// Seconds over which forces are averaged before they are compared: stiff contacts chatter.
const BLOCK: f64 = 0.25;

/// The same for a press, s, and the share of its peak below which its force says little.
const SHORT: f64 = 0.05;
const LIGHT: f64 = 0.1;
/// A tool that is slower than this stands, m/s.
const SLOW: f64 = 1e-3;

/// Plays the touches of `capture` with the twin in `folder`, which holds `model`, its `diagnosis` and its exports, in each of
/// `engines`, and looks for the reason of each held-out touch that an engine misses.
///
/// # Errors
/// Where the twin cannot be laid out. An engine that is not there, or fails, is told in the report.
pub fn compare(
    capture: &Capture,
    model: &Model,
    folder: &Path,
    diagnosis: &Diagnosis,
    engines: &[EngineName],
) -> Result<EnginesReport> {
    let (touches, skipped) = recorded(capture, model)?;
    let reports: Vec<Result<EngineReport>> = engines
        .par_iter()
        .map(|engine| {
            let mine: Vec<&Recorded> = touches.iter().filter(|t| !t.press || engine.yields()).collect();
            let trials: Vec<Trial> = mine.iter().map(|t| t.trial.clone()).collect();
            let (mut report, played) = match engine {
                EngineName::Rapier => embedded(model, &trials)?,
                _ => {
                    let (scene, staged) = stage(model, &trials)?;
                    outside(*engine, folder, &scene, &staged)
                }
            };
            let mut played = played.into_iter();
            let rows = touches.iter().filter_map(|t| {
                let rigid = t.press && !engine.yields();
                let outcome = if rigid {
                    Err("the contacts of this engine do not yield as measured".to_owned())
                } else {
                    played.next()?
                };
                Some(row(model, t, outcome, rigid))
            });
            if report.silent.is_none() {
                report.touches = rows.collect();
            }
            Ok(report)
        })
        .collect();
    let reports = reports.into_iter().collect::<Result<Vec<_>>>()?;
    let probe = Probe::new(model, diagnosis, &touches);
    let held_out: Vec<&Recorded> = touches.iter().filter(|t| t.held_out).collect();
    let reasons = held_out.par_iter().map(|t| probe.reason(t, &reports));
    let reasons: Vec<Option<Reason>> = reasons.collect();
    Ok(EnginesReport {
        reasons: reasons.into_iter().flatten().collect(),
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

fn row(model: &Model, touch: &Recorded, played: std::result::Result<Played, String>, rigid: bool) -> TouchRow {
    let link = &touch.trial.target;
    let com = model.twin.link(link).and_then(|l| l.com.as_ref());
    let com = Point3::from(com.map_or([0.0; 3], |c| c.value));
    let measured = touch.after.0 * com - touch.before.0 * com;
    let turn = touch.after.rotation * touch.before.rotation.inverse();
    let ends = |p: &Played| p.settled.get(link).copied().zip(p.ended.get(link).copied());
    let outcome = match played.and_then(|p| ends(&p).ok_or_else(|| "the engine lost it".into()).map(|e| (p, e))) {
        Err(why) => Outcome::NotPlayed(why),
        Ok((played, _)) if touch.press => pressed(touch, &played.force),
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
                turned_by: touch.oriented.then(|| (turned * turn.inverse()).scaled_axis().into()),
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
        rigid,
        outcome,
    }
}

/// A press beside what was measured: forces along the way of the tool at its deepest, over short blocks.
fn pressed(touch: &Recorded, played: &[(f64, [f64; 3])]) -> Outcome {
    let none = || Outcome::NotPlayed("no force was measured".into());
    let trial = &touch.trial;
    let Some(start) = trial.path.first().map(|p| p.translation.vector) else {
        return none();
    };
    let deep = |p: &&crate::base::Pose| (p.translation.vector - start).norm();
    let deepest = trial.path.iter().max_by(|a, b| deep(a).total_cmp(&deep(b)));
    let Some(into) = deepest.and_then(|p| (p.translation.vector - start).try_normalize(1e-6)) else {
        return none();
    };
    let mean = |rows: &mut dyn Iterator<Item = f64>| {
        let (sum, n) = rows.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        (n > 0.0).then(|| sum / n)
    };
    let depth = |t: f64| {
        let row = trial.time.partition_point(|x| *x < t).min(trial.path.len() - 1);
        (trial.path[row].translation.vector - start).dot(&into)
    };
    let end = trial.time.last().copied().unwrap_or(0.0);
    let blocks = (0..(end / SHORT) as usize).filter_map(|block| {
        let within = |t: f64| t >= 0.0 && (t / SHORT) as usize == block;
        let measured = touch.force.iter().filter(|r| within(r.0)).map(|r| r.1.dot(&into));
        let engine = played.iter().filter(|r| within(r.0));
        let engine = engine.map(|r| Vector3::from(r.1).dot(&into));
        let at = depth(SHORT * (block as f64 + 0.5));
        Some([at, mean(&mut { measured })?, mean(&mut { engine })?])
    });
    let blocks: Vec<[f64; 3]> = blocks.collect();
    let peak = blocks.iter().map(|b| b[1]).fold(0.0, f64::max);
    let felt: Vec<[f64; 3]> = blocks
        .iter()
        .filter(|b| b[1].max(b[2]) > LIGHT * peak)
        .copied()
        .collect();
    let square = mean(&mut felt.iter().map(|b| (b[1] - b[2]).powi(2)));
    let Some(square) = square.filter(|_| peak > 0.0) else {
        return none();
    };
    Outcome::Pressed {
        force_rms: square.sqrt(),
        force_peak: peak,
        stiffness: slope(&felt, 2).zip(slope(&felt, 1)).map(|(a, b)| [a, b]),
    }
}

/// Force over depth, N/m, by least squares.
fn slope(rows: &[[f64; 3]], column: usize) -> Option<f64> {
    let n = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(column));
    let square: f64 = rows.iter().map(|r| (r[0] - x).powi(2)).sum();
    let cross: f64 = rows.iter().map(|r| (r[0] - x) * (r[column] - y)).sum();
    (rows.len() > 3 && square > 0.0).then(|| cross / square)
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
