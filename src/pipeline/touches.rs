//! Touches in the closed loop: estimate, choose the touch that should tell most, do it, and again.

use std::collections::BTreeMap;

use super::explore::{Gathered, Step};
use super::{ExploreOptions, Options, assemble};
use crate::base::{Notices, Pose, Progress, Result};
use crate::capture::{Answer, Capture, Interaction, Rig, RigDescription};
use crate::stages::estimation::{self, ArcTouch, NextTouch, TouchDecision, arc_touches};
use crate::stages::shape::{self, Shapes};
use crate::stages::{articulation, interaction, relations};
use crate::twin::Model;

/// Most touches that the rig may refuse before it is asked no more.
const REFUSALS: usize = 40;

/// Least worth of a touch that should decide an arc of the graph, bits.
const LEAST: f64 = 0.15;

/// Touches until mass, friction and centre of mass are known as wanted, or no touch tells more; returns why no more.
pub(super) fn touch_all(
    rig: &mut dyn Rig,
    said: &RigDescription,
    options: &ExploreOptions,
    (capture, steps): Gathered,
    progress: &Progress,
) -> Result<String> {
    if said.touches.is_empty() {
        return Ok("the rig cannot touch".into());
    }
    let mut shapes = named_by_tracks(capture, options)?;
    let mut planner = NextTouch::new(options.next_touch.clone(), &said.touches, said.noise);
    let mut now = BTreeMap::new();
    let mut model = estimate(capture, &shapes, &options.next_touch.estimation)?;
    let never = planner.out_of_reach(&model, &now);
    let never: Vec<String> = never
        .into_iter()
        .map(|(name, why)| format!("of {name}, {why}"))
        .collect();
    let mut refusals = 0;
    let full = |capture: &Capture| capture.views.len() + capture.interactions.len() >= options.budget;
    let reason = loop {
        if full(capture) {
            break format!("the budget of {} is used up", options.budget);
        }
        if refusals > REFUSALS {
            break format!("the rig refused {refusals} touches");
        }
        let choice = match planner.decide(&model, &now) {
            TouchDecision::Touch(choice) => choice,
            TouchDecision::Stop(why) => break why,
        };
        let mut step = Step::touch(&choice.touch, &choice.why, choice.bits);
        match rig.touch(&choice.touch)? {
            Answer::Done(interaction) => {
                planner.did(&choice, &interaction);
                if !said.restores {
                    moved(&interaction, &mut now);
                }
                capture.interactions.push(interaction.clone());
                // The track's frame tells which thing has its name.
                if followed_of(&interaction, &shapes).is_none() {
                    shapes = named_by_tracks(capture, options)?;
                }
                if followed_of(&interaction, &shapes).is_none() {
                    step.refused = Some(unnamed(&interaction, &shapes));
                    planner.refuse(&choice);
                    refusals += 1;
                }
                model = estimate(capture, &shapes, &options.next_touch.estimation)?;
                progress.advance();
            }
            Answer::Refused(why) => {
                planner.refuse(&choice);
                step.refused = Some(why);
                refusals += 1;
            }
        }
        steps.push(step);
    };
    decide_arcs(rig, said, options, (capture, steps), &shapes, &mut now, progress)?;
    for choice in planner.checks(&model, &now) {
        if full(capture) || refusals > REFUSALS {
            break;
        }
        let mut step = Step::touch(&choice.touch, &choice.why, choice.bits);
        match rig.touch(&choice.touch)? {
            Answer::Done(interaction) => {
                if !said.restores {
                    moved(&interaction, &mut now);
                }
                capture.interactions.push(interaction);
                progress.advance();
            }
            Answer::Refused(why) => step.refused = Some(why),
        }
        steps.push(step);
    }
    Ok(std::iter::once(reason).chain(never).collect::<Vec<_>>().join("; "))
}

/// What the views show, under the names of the frames that were tracked so far.
fn named_by_tracks(capture: &Capture, options: &ExploreOptions) -> Result<Shapes> {
    let mut shapes = shape::reconstruct(capture, &options.shape, &mut Notices::default())?;
    shapes.scene = None;
    Ok(shapes)
}

/// A thing that was seen and that the answer tracks.
fn followed_of<'a>(interaction: &Interaction, shapes: &'a Shapes) -> Option<&'a str> {
    let mut things = shapes.objects.iter().map(|o| o.name.as_str());
    things.find(|name| interaction.tracks.contains_key(*name))
}

/// Why an answer tells nothing of any thing.
fn unnamed(interaction: &Interaction, shapes: &Shapes) -> String {
    let list = |names: Vec<&str>| names.join(", ");
    let things = list(shapes.objects.iter().map(|o| o.name.as_str()).collect());
    match interaction.tracks.is_empty() {
        true => format!("its answer tracks nothing: of {things} nothing can be told"),
        false => {
            let tracks = list(interaction.tracks.keys().map(String::as_str).collect());
            format!("its answer tracks {tracks}, whose frame lies in nothing that was seen: {things}")
        }
    }
}

/// Touches that decide what bears on what, where the touches for matter did not by the way. What has been moved and not
/// put back is left alone: the arcs are those of the first view.
fn decide_arcs(
    rig: &mut dyn Rig,
    said: &RigDescription,
    options: &ExploreOptions,
    (capture, steps): Gathered,
    shapes: &Shapes,
    now: &mut BTreeMap<String, Pose>,
    progress: &Progress,
) -> Result<()> {
    let mut tried: Vec<String> = Vec::new();
    while capture.views.len() + capture.interactions.len() < options.budget {
        let stays = |t: &ArcTouch| !now.contains_key(&t.arc.0) && !now.contains_key(&t.arc.1);
        let fresh = |t: &ArcTouch| t.bits >= LEAST && !tried.contains(&t.touch.name) && stays(t);
        let open = arc_touches(&graph(capture, shapes)?, &said.noise, &said.touches);
        let Some(choice) = open.into_iter().find(fresh) else {
            break;
        };
        tried.push(choice.touch.name.clone());
        let mut step = Step::touch(&choice.touch, &choice.why, choice.bits);
        match rig.touch(&choice.touch)? {
            Answer::Done(interaction) => {
                if !said.restores {
                    moved(&interaction, now);
                }
                capture.interactions.push(interaction);
                progress.advance();
            }
            Answer::Refused(why) => step.refused = Some(why),
        }
        steps.push(step);
    }
    Ok(())
}

/// The twin as far as joints and relations go, from what was gathered so far.
fn graph(capture: &Capture, shapes: &Shapes) -> Result<Model> {
    let quiet = &mut Notices::default();
    let options = Options::default();
    let mut model = assemble::model(capture, shapes.clone(), &options);
    let segmented = interaction::segment(capture, &model, &options.interaction, quiet)?;
    let found = articulation::infer(capture, &segmented, &model, &options.articulation, quiet)?;
    assemble::join(&mut model, found);
    model.twin.relations = relations::relate(capture, &segmented, &model, &options.relations, quiet)?;
    Ok(model)
}

/// The twin as far as matter goes, from what was gathered so far.
fn estimate(capture: &Capture, shapes: &Shapes, config: &estimation::Config) -> Result<Model> {
    let quiet = &mut Notices::default();
    let mut model = assemble::model(capture, shapes.clone(), &Options::default());
    let segmented = interaction::segment(capture, &model, &interaction::Config::default(), quiet)?;
    estimation::identify(capture, &segmented, &mut model, config, quiet)?;
    Ok(model)
}

/// Where the tracks end is where things are by now; what the last pose lacks is taken from before.
fn moved(interaction: &Interaction, now: &mut BTreeMap<String, Pose>) {
    for (name, track) in &interaction.tracks {
        if let Some(pose) = (0..track.len()).rev().find_map(|i| track.pose(i)) {
            now.insert(name.clone(), pose);
        }
    }
}
