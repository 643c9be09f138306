//! The closed loop: look where most is to be learnt, until it is enough, then touch.

use serde::Serialize;

use super::touches::touch_all;
use crate::base::{Error, Notices, Pose, Progress, Result};
use crate::capture::{Answer, Capture, Rig, RigDescription, Touch};
use crate::stages::estimation::NextTouchConfig;
use crate::stages::shape::{self, Decision, NextView, NextViewConfig, ViewChoice};

/// The name under which the loop leaves its notices.
const STAGE: &str = "explore";

/// How to explore.
#[derive(Clone, Debug)]
pub struct ExploreOptions {
    /// Most views and touches together; a third is kept for touches where the rig can touch.
    pub budget: usize,
    /// How views are chosen.
    pub next_view: NextViewConfig,
    /// How touches are chosen.
    pub next_touch: NextTouchConfig,
    /// How shapes are made before the touches.
    pub shape: shape::Config,
}

impl Default for ExploreOptions {
    fn default() -> Self {
        Self {
            budget: 40,
            next_view: NextViewConfig::default(),
            next_touch: NextTouchConfig::default(),
            shape: shape::Config::default(),
        }
    }
}

/// One thing that was asked of the rig, with its reason.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// `look`, or the kind of touch.
    pub action: &'static str,
    /// Its number in the capture's views, or the interaction's name.
    pub what: String,
    /// Why.
    pub why: String,
    /// World-from-camera of a look.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    /// Surface that a look was expected to add, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected: Option<f64>,
    /// What a touch was expected to tell, bits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<f64>,
    /// Surface seen after it, weighed by how well, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seen: Option<f64>,
    /// Why the rig did not do it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

impl Step {
    /// A touch that is about to be asked for.
    pub(super) fn touch(touch: &Touch, why: &str, bits: f64) -> Self {
        Self {
            action: touch.kind.name(),
            what: touch.name.clone(),
            why: why.to_owned(),
            pose: None,
            expected: None,
            bits: Some(bits),
            seen: None,
            refused: None,
        }
    }
}

/// What an exploration gathered.
#[derive(Clone, Debug)]
pub struct Exploration {
    /// All that was seen and felt; its root is empty until it is written.
    pub capture: Capture,
    /// What was asked for, in order.
    pub steps: Vec<Step>,
    /// Why it looked no more.
    pub looked_enough: String,
    /// Why it touched no more.
    pub touched_enough: String,
}

/// Looks and touches with `rig`: views first, touches second.
///
/// # Errors
/// Answers of the rig that cannot be accepted, a rig that ends early, and a rig that sees nothing.
pub fn explore(rig: &mut dyn Rig, options: &ExploreOptions, progress: &Progress) -> Result<Exploration> {
    if options.budget == 0 {
        return Err(Error::Usage("explore: the budget must allow one view at least".into()));
    }
    let said = rig.describe()?;
    let mut capture = empty(&said);
    let mut steps = Vec::new();
    let looked_enough = look_around(rig, &said, options, (&mut capture, &mut steps), progress)?;
    if capture.views.is_empty() {
        return Err(Error::Failed(format!("the rig took no view: {looked_enough}")));
    }
    let touched_enough = touch_all(rig, &said, options, (&mut capture, &mut steps), progress)?;
    rig.done()?;
    Ok(Exploration {
        capture,
        steps,
        looked_enough,
        touched_enough,
    })
}

impl Exploration {
    /// Adds what was asked for, and why, to the notices of a twin.
    pub fn notices(&self) -> Notices {
        let mut notices = Notices::default();
        for step in &self.steps {
            let about = format!("{} {}", step.action, step.what);
            match &step.refused {
                None => notices.note(STAGE, &about, &step.why),
                Some(why) => notices.warn(STAGE, &about, format!("the rig refused: {why}")),
            }
        }
        notices.note(STAGE, "views", format!("no further view: {}", self.looked_enough));
        notices.note(STAGE, "touches", format!("no further touch: {}", self.touched_enough));
        notices
    }
}

fn empty(said: &RigDescription) -> Capture {
    Capture {
        root: std::path::PathBuf::new(),
        name: said.name.clone(),
        gravity: said.gravity,
        support: said.support.clone(),
        cameras: said.cameras.clone(),
        views: Vec::new(),
        bodies: said.bodies.clone(),
        noise: said.noise,
        interactions: Vec::new(),
        truth: None,
        digest: String::new(),
    }
}

/// What an exploration adds to: the capture, and the steps that led to it.
pub(super) type Gathered<'a> = (&'a mut Capture, &'a mut Vec<Step>);

/// Looks until no view is worth its while; returns the reason.
fn look_around(
    rig: &mut dyn Rig,
    said: &RigDescription,
    options: &ExploreOptions,
    (capture, steps): Gathered,
    progress: &Progress,
) -> Result<String> {
    let mut planner = planner(said, options)?;
    // A third is left for the touches, where there are any.
    let most = match said.touches.is_empty() {
        true => options.budget,
        false => (2 * options.budget).div_ceil(3),
    };
    while capture.views.len() < most {
        let choice = match planner.decide() {
            Decision::Look(choice) => choice,
            Decision::Stop(why) => return Ok(why),
        };
        let mut step = step_of(&choice, capture.views.len());
        match rig.look(&choice.world_from_camera)? {
            Answer::Refused(why) => {
                planner.refuse(&choice.world_from_camera);
                step.refused = Some(why);
            }
            Answer::Done(view) => {
                planner.add(&said.cameras[view.camera], &view);
                step.seen = Some(planner.seen_area());
                capture.views.push(view);
            }
        }
        steps.push(step);
        progress.advance();
    }
    Ok(format!(
        "the {most} views of the budget of {} are used up",
        options.budget
    ))
}

fn planner(said: &RigDescription, options: &ExploreOptions) -> Result<NextView> {
    let camera = said
        .cameras
        .first()
        .ok_or_else(|| Error::Failed("the rig has no camera".into()))?;
    NextView::new(
        options.next_view.clone(),
        camera,
        &said.reach,
        said.workspace,
        said.support.as_ref(),
    )
}

fn step_of(choice: &ViewChoice, number: usize) -> Step {
    Step {
        action: "look",
        what: number.to_string(),
        why: choice.why.clone(),
        pose: Some(choice.world_from_camera),
        expected: choice.expected.is_finite().then_some(choice.expected),
        bits: None,
        seen: None,
        refused: None,
    }
}
