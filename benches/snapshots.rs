//! Parameters from snapshots beside what others do: prints tables for docs/BENCHMARKS.md.
//!
//! `PALPATE_PYTHON` names a Python with `mujoco`, `numpy` and `scipy` (and `pybullet`, `scikit-optimize` for the peer).
//! `PALPATE_PEERS` names the folder of the peer's scripts (`push_lib.py`, `bench_rippe_gp.py`); without it the comparison is
//! left out. Arguments choose parts: `speed`, `loop`, `mujoco`, `things`, `learnt`, `peer-loop`.

#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::disallowed_macros,
    reason = "a bench that cannot run must stop"
)]

use std::path::{Path as File, PathBuf};
use std::process::Command;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector2, Vector3};
use palpate::base::{Notices, Progress, Seed};
use palpate::capture::read_capture;
use palpate::geometry::Mesh;
use palpate::physics::tabletop::{Coefficients, Path, Solid, Stage, Tool, Trial, simulate};
use palpate::pipeline::{Options, Pass, build};
use palpate::stages::snapshots::{
    Config, Effect, Gaussian, LearntPrior, Search, Seen, Space, ThingResult, gather, optimise,
};
use serde_json::Value;

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let runs = |part: &str| chosen.is_empty() || chosen.iter().any(|c| c == part);
    if runs("speed") || runs("loop") {
        beside_the_peer(runs("loop"));
    }
    if runs("mujoco") {
        beside_mujoco(20);
    }
    if runs("things") || runs("learnt") {
        lab_things(20, runs("learnt"));
    }
    if runs("peer-loop") {
        peer_loop();
    }
}

/// CPU seconds of this process and its threads.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").expect("a Linux");
    let fields: Vec<&str> = text
        .rsplit(')')
        .next()
        .expect("a stat line")
        .split_whitespace()
        .collect();
    let ticks: f64 = [11, 12]
        .iter()
        .map(|k| fields[*k].parse::<f64>().expect("a number"))
        .sum();
    ticks / 100.0
}

fn python(arguments: &[&str]) -> String {
    let python = std::env::var("PALPATE_PYTHON").unwrap_or_else(|_| "python3".into());
    let output = Command::new(python)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn json(text: &str) -> Value {
    let line = text.lines().rev().find(|l| l.starts_with('{')).expect("a line of JSON");
    serde_json::from_str(line).expect("parses")
}

/// The peer's scripts in a folder that can be written.
fn peers() -> Option<PathBuf> {
    let from = PathBuf::from(std::env::var("PALPATE_PEERS").ok()?);
    let to = std::env::temp_dir().join(format!("palpate-peers-{}", std::process::id()));
    std::fs::create_dir_all(&to).expect("a folder");
    for name in ["push_lib.py", "bench_rippe_gp.py"] {
        std::fs::write(
            to.join(name),
            std::fs::read(from.join(name)).expect("the peer's script"),
        )
        .expect("written");
    }
    Some(to)
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .expect("a list")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

fn points(v: &Value) -> Mesh {
    let vertices = v
        .as_array()
        .expect("points")
        .iter()
        .map(numbers)
        .map(|p| Point3::new(p[0], p[1], p[2]))
        .collect();
    Mesh {
        vertices,
        ..Mesh::default()
    }
}

/// One evaluation of 500 trials of 2 s, and the loop of 40, on the peer's own task.
fn beside_the_peer(whole: bool) {
    let Some(folder) = peers() else {
        println!("PALPATE_PEERS is not set: no comparison with the peer");
        return;
    };
    let said = json(&python(&[
        "benches/snapshots_tasks.py",
        "peer",
        &folder.display().to_string(),
    ]));
    let theirs = said["cpu"].as_f64().expect("cpu");
    let solid = Solid::of(&points(&said["points"])).expect("a solid");
    let tool = Tool::cuboid(&Vector3::new(0.01, 0.03, 0.02));
    let starts: Vec<Vec<f64>> = said["starts"].as_array().expect("starts").iter().map(numbers).collect();
    let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.04);
    let paths: Vec<Path> = starts
        .iter()
        .map(|s| Path::new(&[0.0, 0.5], &[at(-0.1, s[0]), at(-0.1 + 0.5 * s[1], s[0])]).expect("a path"))
        .collect();
    let stage = Stage {
        solid: &solid,
        tool: &tool,
        paths: &paths,
        gravity: Vector3::new(0.0, 0.0, -9.81),
    };
    let run = |c: &Coefficients| -> Vec<Effect> {
        let trials: Vec<Trial> = starts
            .iter()
            .enumerate()
            .map(|(path, s)| {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), s[2]);
                Trial {
                    start: Isometry3::from_parts(Vector3::new(0.0, 0.0, solid.standing_height(&turn)).into(), turn),
                    path,
                    shift: Vector3::zeros(),
                    seconds: 2.0,
                    coefficients: *c,
                }
            })
            .collect();
        simulate(&stage, &trials)
            .iter()
            .map(|o| o.end.translation.vector.xy())
            .collect()
    };
    // The peer's engine multiplies coefficients: plane 1, pusher 0.5.
    let truth = Coefficients {
        friction: 0.6,
        rolling: 2e-5,
        tool_friction: 0.3,
        restitution: 0.0,
        yielding: 4e-3,
    };
    let (rounds, begin) = (40, cpu());
    for _ in 0..rounds {
        run(&truth);
    }
    let ours = (cpu() - begin) / f64::from(rounds);
    println!(
        "one evaluation, 500 trials of 2 s: PyBullet {theirs:.2} CPU s, palpate {ours:.4} CPU s: {:.0} times fewer",
        theirs / ours
    );
    let real: Vec<Effect> = said["real"]
        .as_array()
        .expect("real")
        .iter()
        .map(numbers)
        .map(|r| Vector2::new(r[0], r[1]))
        .collect();
    let of = |e: &[Effect]| Gaussian::of(e, 1e-3).expect("samples");
    let (a, b) = (of(&real), of(&run(&truth)));
    println!(
        "  mean effect: PyBullet {:.4?} m, palpate {:.4?} m",
        a.mean.as_slice(),
        b.mean.as_slice()
    );
    if whole {
        the_loop(&run, &real, &truth);
    }
}

/// Forty evaluations against what PyBullet did at its true parameters.
fn the_loop(run: &dyn Fn(&Coefficients) -> Vec<Effect>, real: &[Effect], truth: &Coefficients) {
    let space = Space::new(&Config::default(), None);
    let of = |e: &[Effect]| Gaussian::of(e, 1e-3).expect("samples");
    let divergence = |c: &Coefficients| of(real).divergence(&of(&run(c)));
    for seed in 0..3 {
        let begin = cpu();
        let mut search = Search::new(Seed(seed), 10);
        while search.evaluations.len() < 40 {
            let (at, by) = search.ask();
            let value = divergence(&space.coefficients(&at));
            search.tell(at, value, by);
        }
        let spent = cpu() - begin;
        let best = search.best().expect("some");
        println!(
            "the loop, 40 evaluations, seed {seed}: {spent:.2} CPU s; divergence {:.3} nats at {:.3?}, {:.3} at the peer's true parameters",
            best.divergence,
            space.coefficients(&best.at),
            divergence(truth)
        );
    }
}

fn peer_loop() {
    let Some(folder) = peers() else { return };
    let said = python(&[
        &folder.join("bench_rippe_gp.py").display().to_string(),
        "bullet",
        "--sims",
        "500",
        "--evals",
        "40",
    ]);
    let said = json(&said);
    println!(
        "the peer's loop: {} CPU s, of which simulation {}; divergence {}",
        said["total_cpu_s"], said["sim_cpu_s"], said["KL_gauss"]
    );
}

/// Mean and spread of effects beside MuJoCo.
fn beside_mujoco(count: usize) {
    let said = json(&python(&["benches/snapshots_tasks.py", &count.to_string()]));
    println!("task | travel mm | mean off, % of travel | spread off, % of travel | trial by trial, median %");
    let mut within = 0;
    for task in said["tasks"].as_array().expect("tasks") {
        let solid = Solid::of(&points(&task["points"])).expect("a solid");
        let size = numbers(&task["size"]);
        let tool = match task["shape"].as_str() {
            Some("sphere") => Tool::ball(size[0]),
            Some("box") => Tool::cuboid(&Vector3::new(size[0], size[1], size[2])),
            _ => Tool::cylinder(size[0], size[1]),
        };
        let c = numbers(&task["coefficients"]);
        let coefficients = Coefficients {
            friction: c[0],
            rolling: c[1],
            tool_friction: c[2],
            // MuJoCo's critically damped contacts rebound by about this.
            restitution: 0.07,
            yielding: 4e-3,
        };
        let trials = task["trials"].as_array().expect("trials");
        let paths: Vec<Path> = trials
            .iter()
            .map(|t| {
                let poses: Vec<Isometry3<f64>> = t["path"]
                    .as_array()
                    .expect("path")
                    .iter()
                    .map(numbers)
                    .map(|p| Isometry3::translation(p[0], p[1], p[2]))
                    .collect();
                Path::new(&numbers(&t["times"]), &poses).expect("a path")
            })
            .collect();
        let stage = Stage {
            solid: &solid,
            tool: &tool,
            paths: &paths,
            gravity: Vector3::new(0.0, 0.0, -9.80665),
        };
        let each: Vec<Trial> = trials
            .iter()
            .enumerate()
            .map(|(path, t)| {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), t["yaw"].as_f64().expect("yaw"));
                Trial {
                    start: Isometry3::from_parts(
                        Vector3::new(0.0, 0.0, task["half"].as_f64().expect("half")).into(),
                        turn,
                    ),
                    path,
                    shift: Vector3::zeros(),
                    seconds: 2.0,
                    coefficients,
                }
            })
            .collect();
        let ours: Vec<Effect> = simulate(&stage, &each)
            .iter()
            .map(|o| o.end.translation.vector.xy())
            .collect();
        let theirs: Vec<Effect> = trials
            .iter()
            .map(|t| numbers(&t["end"]))
            .map(|e| Vector2::new(e[0], e[1]))
            .collect();
        let (a, b) = (
            Gaussian::of(&theirs, 0.0).expect("samples"),
            Gaussian::of(&ours, 0.0).expect("samples"),
        );
        let travel = theirs.iter().map(|e| e.norm()).sum::<f64>() / theirs.len() as f64;
        let spread = |g: &Gaussian| Vector2::new(g.covariance[(0, 0)].sqrt(), g.covariance[(1, 1)].sqrt());
        let mut apart: Vec<f64> = ours.iter().zip(&theirs).map(|(x, y)| (x - y).norm()).collect();
        apart.sort_by(f64::total_cmp);
        let share = |x: f64| 100.0 * x / travel;
        let (mean, wide) = (share((a.mean - b.mean).norm()), share((spread(&a) - spread(&b)).norm()));
        within += usize::from(mean < 10.0 && wide < 10.0);
        let name = |k: &str| task[k].as_str().unwrap_or("").to_owned();
        println!(
            "{} {} {} | {:.0} | {mean:.1} | {wide:.1} | {:.1}",
            name("thing"),
            name("tool"),
            name("action"),
            1e3 * travel,
            share(apart[apart.len() / 2])
        );
    }
    println!("within 10 % of the travel in mean and spread: {within} of {count}");
}

/// What the things are made of, in turn.
const MATERIALS: [&str; 4] = ["felt", "wood", "rubber", "card"];

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    for (rank, i) in order.into_iter().enumerate() {
        out[i] = rank as f64;
    }
    out
}

fn spearman(a: &[f64], b: &[f64]) -> f64 {
    let (x, y) = (ranks(a), ranks(b));
    let n = x.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let cross: f64 = x.iter().zip(&y).map(|(u, v)| (u - middle) * (v - middle)).sum();
    let square: f64 = x.iter().map(|u| (u - middle).powi(2)).sum();
    cross / square
}

/// Things in MuJoCo with three tools and four actions: claim of the paper, errors, intervals.
fn lab_things(count: usize, learnt: bool) {
    let folder = std::env::temp_dir().join(format!("palpate-things-{}", std::process::id()));
    let (mut inside, mut known, mut errors, mut correlations) = (0, 0, Vec::new(), Vec::new());
    let mut seen: Vec<Seen> = Vec::new();
    for k in 0..count {
        let out = folder.join(k.to_string());
        let kind = ["box", "tall", "can", "puck", "ball"][k % 5];
        let seed = (500 + k).to_string();
        python(&[
            "tests/worlds/snapshot_world.py",
            &out.display().to_string(),
            "--seed",
            &seed,
            "--trials",
            "5",
            "--thing",
            kind,
            "--material",
            MATERIALS[k % 4],
        ]);
        let truth: Value =
            serde_json::from_str(&std::fs::read_to_string(out.join("truth.json")).expect("truth")).expect("parses");
        let truth = truth["bodies"]["thing"]["friction_kinetic"].as_f64().expect("friction");
        let thing = study_of(&out);
        let m = &thing.marginals[0];
        let steps: Vec<(f64, f64)> = thing.search.iter().filter_map(|s| Some((s.train, s.test?))).collect();
        let (train, test): (Vec<f64>, Vec<f64>) = steps.into_iter().unzip();
        let rho = if train.len() > 2 {
            spearman(&train, &test)
        } else {
            f64::NAN
        };
        inside += usize::from((m.ci95[0]..=m.ci95[1]).contains(&truth));
        if thing.fixed[0] {
            known += 1;
            errors.push((m.median / truth - 1.0).abs());
        }
        correlations.extend(Some(rho).filter(|r| r.is_finite()));
        println!(
            "{kind} {k}: friction {truth:.3}, told {:.3} [{:.3} {:.3}] {}; rank correlation of train and test {rho:.2} over {} steps",
            m.median,
            m.ci95[0],
            m.ci95[1],
            if thing.fixed[0] { "measured" } else { "assumed" },
            train.len()
        );
        seen.push(thing.seen);
    }
    errors.sort_by(f64::total_cmp);
    correlations.sort_by(f64::total_cmp);
    let median = |v: &[f64]| v.get(v.len() / 2).copied().unwrap_or(f64::NAN);
    println!(
        "friction called measured in {known} of {count}; median error {:.1} %, at most 10 % in {}",
        100.0 * median(&errors),
        errors.iter().filter(|e| **e < 0.1).count()
    );
    println!("95 % intervals hold the truth in {inside} of {count}");
    println!(
        "rank correlation of training and test divergence: median {:.2}, lowest {:.2}",
        median(&correlations),
        correlations.first().copied().unwrap_or(f64::NAN)
    );
    if learnt {
        with_learnt_prior(&folder, &seen);
    }
    let _ = std::fs::remove_dir_all(&folder);
}

fn study_of(folder: &File) -> ThingResult {
    let capture = read_capture(folder).expect("a capture");
    let options = Options {
        passes: vec![Pass::Shape, Pass::Physics],
        ..Options::default()
    };
    let run = build(&capture, &options, &Progress::silent()).expect("builds");
    run.snapshots.expect("snapshots").things.remove(0)
}

/// Evaluations to the same divergence, from nothing and from what was learnt of other things (this one left out).
fn with_learnt_prior(folder: &File, seen: &[Seen]) {
    let (mut plain, mut started) = (Vec::new(), Vec::new());
    for k in 0..seen.len() {
        let others: Vec<Seen> = seen
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != k)
            .map(|(_, s)| s.clone())
            .collect();
        let capture = read_capture(&folder.join(k.to_string())).expect("a capture");
        let options = Options {
            passes: vec![Pass::Shape],
            ..Options::default()
        };
        let model = build(&capture, &options, &Progress::silent()).expect("builds").model;
        let config = Config::default();
        let benches = gather(&capture, &model, &config, &mut Notices::default()).expect("gathers");
        let bench = benches.values().next().expect("a thing");
        let from_nothing = Space::new(&config, None);
        let learnt = LearntPrior::from_seen(&others).apply(from_nothing, seen[k].shape, seen[k].material.as_deref());
        let course = |space: &Space| optimise(bench, space, &config, Seed(7), Search::new(Seed(7), 10));
        let (a, b) = (course(&from_nothing), course(&learnt));
        // The divergence that the search from nothing has reached after its whole budget, with a margin for its noise.
        let target = 1.1 * a.best().expect("some").divergence + 0.02;
        let first = |s: &Search| {
            s.evaluations
                .iter()
                .position(|e| e.divergence <= target)
                .map_or(41, |i| i + 1)
        };
        plain.push(first(&a) as f64);
        started.push(first(&b) as f64);
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    println!(
        "evaluations to the same divergence: {:.1} from nothing, {:.1} with what the others told (means of {} things)",
        mean(&plain),
        mean(&started),
        plain.len()
    );
    println!("  each: {plain:?} | {started:?}");
}
