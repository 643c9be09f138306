//! Engines outside, run by a Python program that reads one JSON object and answers with one.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::str::FromStr;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::base::{Error, Pose, Result};
use crate::export::{Played, StagedScene, StagedTrial};

const COMMON: &str = include_str!("python/common.py");
const MUJOCO: &str = include_str!("python/mujoco.py");
const PYBULLET: &str = include_str!("python/pybullet.py");
const DRAKE: &str = include_str!("python/drake.py");
/// Names the interpreter that has the engines; `python3` where it is not set.
const INTERPRETER: &str = "PALPATE_PYTHON";
/// Step of every engine, s, and the time before the tool comes, s.
const STEP: f64 = 0.002;
const SETTLING: f64 = 0.5;

/// An engine that can play a capture's touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineName {
    /// The embedded one.
    Rapier,
    /// By `scene.xml`.
    Mujoco,
    /// By `urdf/NAME.urdf`.
    Pybullet,
    /// By `urdf/NAME.urdf`.
    Drake,
}

impl EngineName {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rapier => "rapier",
            Self::Mujoco => "mujoco",
            Self::Pybullet => "pybullet",
            Self::Drake => "drake",
        }
    }

    /// Whether its contacts yield as the twin says.
    pub fn yields(self) -> bool {
        self == Self::Mujoco
    }

    fn script(self) -> Option<&'static str> {
        match self {
            Self::Rapier => None,
            Self::Mujoco => Some(MUJOCO),
            Self::Pybullet => Some(PYBULLET),
            Self::Drake => Some(DRAKE),
        }
    }
}

impl FromStr for EngineName {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        let all = [Self::Rapier, Self::Mujoco, Self::Pybullet, Self::Drake];
        let found = all.into_iter().find(|e| e.name() == word);
        found.ok_or_else(|| Error::bad_input("--engines", "engine", word, "rapier, mujoco, pybullet or drake"))
    }
}

/// What came back from an engine.
pub struct Answer {
    /// Of the engine.
    pub version: String,
    /// By part: settling, m; drift, m, and turn, rad, after it.
    pub rest: BTreeMap<String, [f64; 3]>,
    /// One a trial, in their order; why not, where one could not be played.
    pub trials: Vec<std::result::Result<Played, String>>,
}

#[derive(Deserialize)]
struct Raw {
    version: String,
    rest: BTreeMap<String, [f64; 3]>,
    trials: Vec<RawTrial>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum RawTrial {
    Played {
        settled: BTreeMap<String, Pose>,
        ended: BTreeMap<String, Pose>,
        force: Vec<[f64; 4]>,
    },
    Failed {
        why: String,
    },
}

/// Why an engine gave no answer.
pub enum Silence {
    /// It is not installed; says how to get it.
    NotThere(String),
    /// It was there and failed.
    Failed(String),
}

/// Plays `trials` in an outside engine and lets the scene rest for `seconds` in it. As many programs run side by side as
/// there are threads, each with its share of the trials; a trial does not depend on the others.
pub fn ask(
    engine: EngineName,
    folder: &Path,
    scene: &StagedScene,
    trials: &[StagedTrial],
    seconds: f64,
) -> std::result::Result<Answer, Silence> {
    let share = trials.len().div_ceil(rayon::current_num_threads()).max(1);
    let (first, others) = trials.split_at(share.min(trials.len()));
    let mut shares = vec![(first, seconds)];
    shares.extend(others.chunks(share).map(|part| (part, 0.0)));
    let answers: Vec<_> = shares
        .into_par_iter()
        .map(|(part, seconds)| ask_one(engine, folder, scene, part, seconds))
        .collect();
    let mut answers = answers.into_iter();
    let nothing = || Err(Silence::Failed("nothing was asked".into()));
    let mut whole = answers.next().unwrap_or_else(nothing)?;
    for answer in answers {
        whole.trials.extend(answer?.trials);
    }
    Ok(whole)
}

/// Plays trials in one run of the engine's program.
fn ask_one(
    engine: EngineName,
    folder: &Path,
    scene: &StagedScene,
    trials: &[StagedTrial],
    seconds: f64,
) -> std::result::Result<Answer, Silence> {
    let failed = |what: String| Silence::Failed(what);
    let Some(script) = engine.script() else {
        return Err(failed("it is embedded".into()));
    };
    let folder = folder.canonicalize().map_err(|e| failed(e.to_string()))?;
    let job = json!({
        "folder": folder, "scene": scene, "trials": trials,
        "seconds": seconds, "settling": SETTLING, "step": STEP,
    });
    let said = run(engine, &format!("{COMMON}\n{script}\nmain()\n"), &job.to_string())?;
    let last = said.lines().last().unwrap_or_default();
    let raw: Raw = serde_json::from_str(last).map_err(|e| failed(format!("an answer that is none: {e}")))?;
    let trials = raw.trials.into_iter().map(|t| played(scene, t)).collect();
    Ok(Answer {
        version: raw.version,
        rest: raw.rest,
        trials,
    })
}

/// What the program writes on its standard output.
fn run(engine: EngineName, program: &str, job: &str) -> std::result::Result<String, Silence> {
    let interpreter = std::env::var(INTERPRETER).unwrap_or_else(|_| "python3".into());
    let not_there = |why: String| {
        let how = format!(
            "not there: pip install {} (for {interpreter}; {INTERPRETER} names another)",
            engine.name()
        );
        Silence::NotThere(if why.is_empty() { how } else { format!("{how}: {why}") })
    };
    let child = Command::new(&interpreter)
        .args(["-c", program])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.map_err(|e| not_there(e.to_string()))?;
    let input = child.stdin.take();
    let out = std::thread::scope(|scope| {
        scope.spawn(move || input.map(|mut i| i.write_all(job.as_bytes())));
        child.wait_with_output()
    });
    let out = out.map_err(|e| Silence::Failed(e.to_string()))?;
    if out.status.success() {
        return Ok(String::from_utf8_lossy(&out.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&out.stderr);
    let last = said.lines().last().unwrap_or("no word why").to_string();
    if last.starts_with("ModuleNotFoundError") {
        return Err(not_there(String::new()));
    }
    Err(Silence::Failed(format!("{last} ({})", out.status)))
}

fn played(scene: &StagedScene, raw: RawTrial) -> std::result::Result<Played, String> {
    let links = |poses: BTreeMap<String, Pose>| {
        let parts = scene.trees.iter().flat_map(|t| &t.parts);
        let linked = parts.filter_map(|p| Some((p.link.clone(), p.link_pose(poses.get(&p.name)?))));
        linked.collect()
    };
    match raw {
        RawTrial::Failed { why } => Err(why),
        RawTrial::Played { settled, ended, force } => Ok(Played {
            settled: links(settled),
            ended: links(ended),
            force: force.into_iter().map(|[t, x, y, z]| (t, [x, y, z])).collect(),
        }),
    }
}
