//! The same trials in MuJoCo, in rapier and in the batched simulator, beside each other trial by trial.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector2, Vector3};
use palpate::physics::tabletop::{Coefficients, Path, Solid, Stage, Tool, Trial, simulate};
use palpate::stages::snapshots::{Effect, Gaussian};
use serde_json::Value;

use super::rapier::{Body, Hand, World};
use super::{json, numbers, points, python};

/// Seconds of a trial.
const SECONDS: f64 = 2.0;
const GRAVITY: f64 = 9.80665;
/// MuJoCo's critically damped contacts rebound by about this; rapier's do not.
const REBOUND: f64 = 0.07;

/// Times and poses of the tool, yaw of the thing, where MuJoCo has it end.
type Played = (Vec<f64>, Vec<Isometry3<f64>>, f64, Effect);

/// A thing, a tool, and trials: times and places of the tool, yaw of the thing, where MuJoCo has it end.
struct Task {
    name: String,
    corners: Vec<Point3<f64>>,
    hand: Hand,
    /// Friction, rolling resistance, friction against the tool.
    coefficients: [f64; 3],
    half: f64,
    trials: Vec<Played>,
}

impl Task {
    fn read(task: &Value) -> Self {
        let word = |k: &str| task[k].as_str().unwrap_or("").to_owned();
        let size = numbers(&task["size"]);
        let hand = match task["shape"].as_str() {
            Some("sphere") => Hand::Ball(size[0]),
            Some("box") => Hand::Box([size[0], size[1], size[2]]),
            _ => Hand::Cylinder(size[0], size[1]),
        };
        let c = numbers(&task["coefficients"]);
        let trial = |t: &Value| {
            let poses = t["path"].as_array().expect("path").iter().map(numbers);
            let poses = poses.map(|p| Isometry3::translation(p[0], p[1], p[2])).collect();
            let end = numbers(&t["end"]);
            let yaw = t["yaw"].as_f64().expect("yaw");
            (numbers(&t["times"]), poses, yaw, Vector2::new(end[0], end[1]))
        };
        Self {
            name: format!("{} {} {}", word("thing"), word("tool"), word("action")),
            corners: points(&task["points"]).vertices,
            hand,
            coefficients: [c[0], c[1], c[2]],
            half: task["half"].as_f64().expect("half"),
            trials: task["trials"].as_array().expect("trials").iter().map(trial).collect(),
        }
    }

    fn start(&self, yaw: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        Isometry3::from_parts(Vector3::new(0.0, 0.0, self.half).into(), turn)
    }

    /// In the batched simulator.
    fn ours(&self, restitution: f64) -> Vec<Effect> {
        let mesh = palpate::geometry::Mesh {
            vertices: self.corners.clone(),
            ..Default::default()
        };
        let solid = Solid::of(&mesh).expect("a solid");
        let tool = match self.hand {
            Hand::Ball(radius) => Tool::ball(radius),
            Hand::Box(h) => Tool::cuboid(&Vector3::from(h)),
            Hand::Cylinder(radius, half) => Tool::cylinder(radius, half),
        };
        let [friction, rolling, tool_friction] = self.coefficients;
        let paths: Vec<Path> = self
            .trials
            .iter()
            .map(|(times, poses, _, _)| Path::new(times, poses).expect("a path"))
            .collect();
        let stage = Stage {
            solid: &solid,
            tool: &tool,
            paths: &paths,
            gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        };
        let trial = |(path, (_, _, yaw, _)): (usize, &Played)| Trial {
            start: self.start(*yaw),
            path,
            shift: Vector3::zeros(),
            seconds: SECONDS,
            coefficients: Coefficients {
                friction,
                rolling,
                tool_friction,
                restitution,
                yielding: 4e-3,
            },
        };
        let each: Vec<Trial> = self.trials.iter().enumerate().map(trial).collect();
        let ends = simulate(&stage, &each);
        ends.iter().map(|o| o.end.translation.vector.xy()).collect()
    }

    /// In rapier.
    fn rapier(&self) -> Vec<Effect> {
        let world = World {
            body: match self.name.starts_with("ball") {
                true => Body::Ball(self.corners[0].coords.norm()),
                false => Body::Hull(&self.corners),
            },
            hand: self.hand,
            coefficients: self.coefficients,
            gravity: GRAVITY,
        };
        let of = |(times, poses, yaw, _): &Played| world.play(&self.start(*yaw), times, poses, SECONDS);
        self.trials.iter().map(of).collect()
    }
}

/// How far two samples of effects are apart, in % of the travel: of means, of spreads, trial by trial (median, and the
/// share of trials within 10 %).
fn apart(theirs: &[Effect], ours: &[Effect]) -> [f64; 4] {
    let of = |e: &[Effect]| Gaussian::of(e, 0.0).expect("samples");
    let (a, b) = (of(theirs), of(ours));
    let travel = theirs.iter().map(|e| e.norm()).sum::<f64>() / theirs.len() as f64;
    let spread = |g: &Gaussian| Vector2::new(g.covariance[(0, 0)].sqrt(), g.covariance[(1, 1)].sqrt());
    let share = |x: f64| 100.0 * x / travel;
    let mut each: Vec<f64> = ours.iter().zip(theirs).map(|(x, y)| share((x - y).norm())).collect();
    each.sort_by(f64::total_cmp);
    let near = each.iter().filter(|e| **e < 10.0).count();
    [
        share((a.mean - b.mean).norm()),
        share((spread(&a) - spread(&b)).norm()),
        each[each.len() / 2],
        100.0 * near as f64 / each.len() as f64,
    ]
}

/// The seed of the first task; `PALPATE_FROM` names another.
fn first() -> String {
    std::env::var("PALPATE_FROM").unwrap_or_else(|_| "1000".into())
}

/// Effects beside those of MuJoCo and of rapier, and those of the two beside each other.
pub fn beside_engines(count: usize) {
    let said = json(&python(&["benches/snapshots_tasks.py", &count.to_string(), &first()]));
    let tasks: Vec<Task> = said["tasks"]
        .as_array()
        .expect("tasks")
        .iter()
        .map(Task::read)
        .collect();
    println!("each: mean off, spread off, trial by trial (median), % of the travel; trials within 10 %, %");
    println!("task | travel mm | palpate beside MuJoCo | palpate beside rapier | rapier beside MuJoCo");
    let mut within = [0; 3];
    let mut near = [0.0; 3];
    for task in &tasks {
        let mujoco: Vec<Effect> = task.trials.iter().map(|t| t.3).collect();
        let rapier = task.rapier();
        let all = [
            apart(&mujoco, &task.ours(REBOUND)),
            apart(&rapier, &task.ours(0.0)),
            apart(&mujoco, &rapier),
        ];
        let words = all.map(|a| format!("{:.1} {:.1} {:.1} {:.0}", a[0], a[1], a[2], a[3]));
        let travel = mujoco.iter().map(|e| e.norm()).sum::<f64>() / mujoco.len() as f64;
        println!("{} | {:.0} | {}", task.name, 1e3 * travel, words.join(" | "));
        for ((within, near), apart) in within.iter_mut().zip(&mut near).zip(all) {
            *within += usize::from(apart[0] < 10.0 && apart[1] < 10.0);
            *near += apart[3] / tasks.len() as f64;
        }
    }
    for (k, pair) in ["palpate beside MuJoCo", "palpate beside rapier", "rapier beside MuJoCo"]
        .iter()
        .enumerate()
    {
        println!(
            "{pair}: mean and spread within 10 % of the travel in {} of {count} tasks; {:.0} % of the trials within 10 %",
            within[k], near[k]
        );
    }
}
