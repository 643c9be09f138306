//! Parses the command line, calls the command, maps errors to exit codes.

use std::process::ExitCode;

use clap::Parser;

use super::arguments::{Arguments, Command};
use super::{
    batch, calibrate, check, demo, diagnose, explore, export, import, inspect, output, reconstruct, schema, score,
    simulate, synth, view,
};
use crate::base::{Error, Result};

/// Runs the process's command line: 0 done, 1 it could not be done, 2 bad usage or bad input.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    match threads(&arguments).and_then(|()| call(&arguments)) {
        Ok(code) => code,
        Err(error) => {
            output::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

fn threads(arguments: &Arguments) -> Result<()> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.common.threads)
        .build_global()
        .map_err(|e| Error::Failed(format!("--threads: {e}")))
}

fn call(arguments: &Arguments) -> Result<ExitCode> {
    let common = &arguments.common;
    match &arguments.command {
        Command::Demo { out } => demo::demo(common, out),
        Command::Synth { scene, out, hide, list } => {
            synth::synth(common, scene.as_deref(), out.as_deref(), hide.as_deref(), *list)
        }
        Command::Reconstruct {
            capture,
            out,
            passes,
            resume,
            voxel,
            timings,
            snapshot_prior,
            snapshot_search,
            snapshot_evaluations,
            force_scale,
            materials,
            rerun,
        } => {
            let request = reconstruct::Request {
                passes,
                resume: *resume,
                voxel: *voxel,
                timings: *timings,
                snapshot_prior: snapshot_prior.as_deref(),
                snapshot_search: snapshot_search.as_deref(),
                snapshot_evaluations: *snapshot_evaluations,
                force_scale: force_scale.as_deref(),
                materials,
                rerun: *rerun,
            };
            reconstruct::reconstruct(common, capture, out, &request)
        }
        Command::Diagnose { capture, model, causes } => diagnose::diagnose(common, capture, model.as_deref(), causes),
        Command::Batch { captures, out, voxel } => batch::batch(common, captures, out, *voxel),
        Command::Explore { rig, out, budget } => explore::explore(common, rig, out, *budget),
        Command::Inspect { capture } => inspect::inspect(common, capture),
        Command::Schema { format } => schema::schema(format),
        Command::Score { twin, truth } => score::score(common, twin, truth),
        Command::Check { twin, engines, capture } => check::check(common, twin, engines, capture.as_deref()),
        Command::Export { twin, to, variants } => export::export(common, twin, to, *variants),
        Command::Import { what } => import::import(common, what),
        Command::Simulate { twin, deed, film } => simulate::simulate(common, twin, deed, film.as_deref()),
        Command::View { twin, port, no_open } => view::view(common, twin, *port, !no_open),
        Command::Calibrate { what } => calibrate::calibrate(common, what),
    }
}
