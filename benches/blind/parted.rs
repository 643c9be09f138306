//! Whether the experiments that a diagnosis asks for part the causes that it could not tell apart: their touches are made in
//! the same scene after all that was done before, and all is diagnosed anew.

use std::path::Path;

use palpate::base::{Progress, Seed};
use palpate::lab::{ActionSpec, Scene, synthesise};
use palpate::pipeline::{Options, build};
use palpate::twin::{AskedTouch, Diagnosis, Finding};

/// A cause is told from its rivals with these odds.
const TOLD: f64 = 0.9;
/// So many experiments may be asked for, each of a few touches.
const EXPERIMENTS: usize = 3;

/// What came of a set of causes.
#[derive(Clone, Debug)]
pub struct Parted {
    /// The causes that could not be told apart, the likeliest first.
    pub set: Vec<String>,
    /// No touch was asked for: the program says that these data and such touches cannot tell.
    pub none: bool,
    /// After so many experiments one cause was told; nothing where none was.
    pub after: Option<usize>,
    /// The cause that is told in the end is the one that was hidden.
    pub right: bool,
    /// What was done, in short.
    pub done: Vec<String>,
}

/// What one object on one table can never tell apart, which is said of it: in the scenes gravity leans in the table's own frame either way.
const NEVER: [&str; 2] = ["support-tilt", "gravity-error"];

fn alike(a: &str, b: &str) -> bool {
    a == b || (NEVER.contains(&a) && NEVER.contains(&b))
}

/// Odds of a finding's cause among its rivals.
fn share(finding: &Finding) -> f64 {
    let rivals = finding.alternatives.iter().filter(|a| !alike(&a.cause, &finding.cause));
    let others: f64 = rivals.map(|a| a.probability).sum();
    finding.probability / (finding.probability + others).max(1e-9)
}

/// The finding that is, or may be, of this cause.
fn about<'a>(diagnosis: &'a Diagnosis, cause: &str) -> Option<&'a Finding> {
    let rival = |f: &&Finding| f.alternatives.iter().any(|a| a.cause == cause);
    let own = diagnosis.findings.iter().find(|f| f.cause == cause);
    own.or_else(|| diagnosis.findings.iter().find(rival))
}

/// Nothing where the hidden cause is in no set of causes that are not told apart.
pub fn parted(scene: &Scene, number: u64, diagnosis: &Diagnosis, cause: &str, options: &Options) -> Option<Parted> {
    let finding = about(diagnosis, cause).filter(|f| share(f) < TOLD)?;
    let mut out = Parted {
        set: std::iter::once(finding.cause.clone())
            .chain(finding.alternatives.iter().map(|a| a.cause.clone()))
            .collect(),
        none: false,
        after: None,
        right: false,
        done: Vec::new(),
    };
    let mut scene = scene.clone();
    let mut now = diagnosis.clone();
    for count in 1..=EXPERIMENTS {
        let of_set = |e: &&palpate::twin::Experiment| {
            !e.touches.is_empty() && e.parts.iter().filter(|p| out.set.contains(p)).count() > 1
        };
        let Some(experiment) = now.experiments.iter().find(of_set) else {
            out.none = count == 1;
            break;
        };
        for (k, touch) in experiment.touches.iter().enumerate() {
            let name = format!("asked-{count}-{k}");
            out.done.push(in_short(touch));
            scene.pause.insert(name.clone(), touch.wait);
            scene.action.push(action(touch, name));
        }
        let made = synthesise(&scene, Path::new("."), Seed(number), &Progress::silent()).ok()?;
        now = build(&made.capture, options, &Progress::silent()).ok()?.diagnosis;
        let told = out
            .set
            .iter()
            .filter_map(|c| now.findings.iter().find(|f| f.cause == *c && share(f) >= TOLD));
        if let Some(told) = told.max_by(|a, b| a.probability.total_cmp(&b.probability)) {
            (out.after, out.right) = (Some(count), alike(&told.cause, cause));
            break;
        }
    }
    Some(out)
}

fn in_short(t: &AskedTouch) -> String {
    format!(
        "{} {:.0} mm at {:.0} mm/s{}{}",
        t.kind,
        1e3 * t.travel,
        1e3 * t.speed,
        if t.down > 0.0 { " down" } else { "" },
        match (t.turned > 0.0, t.kind.as_str()) {
            (true, "lift") => " twisted",
            (true, _) => " turned",
            (false, _) => "",
        }
    )
}

/// The touch as the lab makes it.
fn action(touch: &AskedTouch, name: String) -> ActionSpec {
    let target = touch.target.clone();
    match touch.kind.as_str() {
        "press" => ActionSpec::Press {
            name,
            target,
            at: touch.start,
            depth: touch.travel,
            speed: touch.speed,
            hold: touch.duration,
            tool: palpate::lab::ToolSpec::default(),
            held_out: false,
        },
        "pull" => ActionSpec::Pull {
            name,
            target,
            at: touch.start,
            direction: touch.direction,
            travel: touch.travel,
            speed: touch.speed,
            pin: touch.back,
            down: touch.down,
            arc: touch.back,
            back: touch.back,
            held_out: false,
        },
        "lift" => ActionSpec::Lift {
            name,
            target,
            at: touch.start,
            height: touch.travel,
            speed: touch.speed,
            hold: touch.duration,
            twist: touch.turned,
            held_out: false,
        },
        _ => ActionSpec::Push {
            name,
            target,
            at: touch.start,
            direction: touch.direction,
            travel: touch.travel,
            speed: touch.speed,
            tool: palpate::lab::ToolSpec::default(),
            tool_friction: 0.4,
            turned: touch.turned,
            // The tool leaves at once.
            retreat: touch.duration == 0.0,
            held_out: false,
        },
    }
}
