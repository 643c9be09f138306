//! The method itself, a verb a line.

use super::extend::extend;
use super::symmetries::Symmetries;
use super::welded::Welded;
use super::{Options, Pass, assemble};
use crate::base::{Notices, Progress, Result, Stopwatch};
use crate::capture::{Capture, Segmented, SensorFaults};
use crate::stages::diagnosis::Trace;
use crate::stages::{articulation, diagnosis, estimation, interaction, relations, shape, snapshots};
use crate::twin::{Diagnosis, Model, in_order};

/// A finished run, ready to be exported and shown.
#[derive(Clone, Debug)]
pub struct Run {
    /// The twin with its meshes.
    pub model: Model,
    /// What it still gets wrong.
    pub diagnosis: Diagnosis,
    /// Measured against predicted, one per interaction.
    pub traces: Vec<Trace>,
    /// The interactions cut into phases.
    pub segmented: Vec<Segmented>,
    /// What snapshot pairs told, where the capture holds nothing else.
    pub snapshots: Option<snapshots::Snapshots>,
    /// Silhouettes of the principal views, path in the twin's folder and PNG.
    pub pictures: Vec<(String, Vec<u8>)>,
    /// Wall seconds of each pass.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Joins what joints hold; what moved as if one did is handed back.
fn joined(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    options: &Options,
    notices: &mut Notices,
) -> Result<Vec<articulation::Unproven>> {
    if !options.runs(Pass::Articulation) {
        return Ok(Vec::new());
    }
    let mut found = articulation::infer(capture, segmented, model, &options.articulation, notices)?;
    let unproven = std::mem::take(&mut found.unproven);
    assemble::join(model, found);
    Ok(unproven)
}

/// What is wrong with it; what fixed joints hold together, or only ever went as one, is foretold and judged as the one thing that it is.
fn diagnosed(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    (faults, options): (&SensorFaults, &Options),
    notices: &mut Notices,
) -> Result<diagnosis::Diagnosed> {
    let Some(whole) = Welded::of(capture, segmented, model) else {
        return diagnosis::diagnose(capture, segmented, model, faults, &options.diagnosis, notices);
    };
    let whole = whole.identified(options)?;
    whole.hand_down(model);
    let (capture, segmented) = (&whole.capture, &whole.segmented);
    let mut found = diagnosis::diagnose(capture, segmented, &whole.model, faults, &options.diagnosis, notices)?;
    whole.unfold(&mut found);
    Ok(found)
}

/// From a capture to a twin: shape, symmetry, interaction, articulation, estimation, relations, diagnosis.
pub fn build(capture: &Capture, options: &Options, progress: &Progress) -> Result<Run> {
    let mut notices = Notices::default();
    let mut clock = PassClock::new(progress);
    let scaled = options.estimation.force_scale.as_ref().map(|s| s.applied(capture));
    let capture = scaled.as_ref().unwrap_or(capture);

    let (sifted, faults) = interaction::sift(capture);
    let capture = sifted.as_ref().unwrap_or(capture);

    let symmetries = Symmetries::new(capture, options);
    let mut shapes = shape::Shapes::default();
    let mut followed = None;
    if options.runs(Pass::Shape) {
        shapes = shape::reconstruct_with(capture, &options.shape, &symmetries.finder(), &mut notices)?;
        followed = Some(shape::follow(capture, &mut shapes, &options.shape, &mut notices)?);
        shape::furnish(&mut shapes, &options.shape, &mut notices);
        shape::bake(capture, &mut shapes, &options.shape);
    }
    let capture = followed.as_ref().map_or(capture, |f| f.capture.as_ref());
    let mut model = assemble::model(capture, shapes, options);
    assemble::tracks(&mut model, followed.as_ref().map_or(&[], |f| &f.tracks));
    clock.lap("shape");

    if options.runs(Pass::Symmetry) {
        symmetries.write(&mut model, &mut notices)?;
    }
    let pictures = assemble::draw_views(&mut model);
    clock.lap("symmetry");

    let segmented = interaction::segment(capture, &model, &options.interaction, &mut notices)?;
    let unproven = joined(capture, &segmented, &mut model, options, &mut notices)?;
    interaction::warn_of_strangers(capture, &model, &mut notices);
    clock.lap("articulation");

    let mut seen_before_and_after = None;
    if options.runs(Pass::Physics) {
        estimation::identify(capture, &segmented, &mut model, &options.estimation, &mut notices)?;
        seen_before_and_after = snapshots::infer(capture, &mut model, &options.snapshots, options.seed, &mut notices)?;
    }
    clock.lap("physics");

    if options.runs(Pass::Relations) {
        model.twin.relations = relations::relate(capture, &segmented, &model, &options.relations, &mut notices)?;
        assemble::weld(&mut model);
    }
    assemble::doubt(&mut model, &unproven);
    clock.lap("relations");

    let diagnosed = match &seen_before_and_after {
        _ if !options.runs(Pass::Diagnosis) => diagnosis::Diagnosed::skipped(),
        Some(snapshots) if !snapshots.things.is_empty() => diagnosis::Diagnosed {
            diagnosis: snapshots.diagnosis(),
            ..diagnosis::Diagnosed::skipped()
        },
        _ => diagnosed(capture, &segmented, &mut model, (&faults, options), &mut notices)?,
    };
    clock.lap("diagnosis");

    assemble::share_surfaces(&mut model);
    assemble::record(&mut model, capture, options, &clock.laps, notices);
    let diagnosis::Diagnosed {
        mut diagnosis,
        traces,
        levels,
        ..
    } = diagnosed;
    diagnosis.experiments.extend(assemble::open_arcs(capture, &model));
    in_order(&mut diagnosis.experiments);
    assemble::lean(&mut model, &diagnosis);
    extend(&mut model, &diagnosis, &levels);
    Ok(Run {
        model,
        diagnosis,
        traces,
        segmented,
        snapshots: seen_before_and_after,
        pictures,
        seconds: clock.laps,
    })
}

/// Wall seconds of each pass, shown as progress.
struct PassClock<'a> {
    progress: &'a Progress,
    watch: Stopwatch,
    laps: Vec<(&'static str, f64)>,
}

impl<'a> PassClock<'a> {
    fn new(progress: &'a Progress) -> Self {
        Self {
            progress,
            watch: Stopwatch::start(),
            laps: Vec::new(),
        }
    }

    fn lap(&mut self, pass: &'static str) {
        let before: f64 = self.laps.iter().map(|(_, s)| s).sum();
        self.laps.push((pass, self.watch.seconds() - before));
        self.progress.advance();
    }
}
