//! The peer's own task: one evaluation, and the loop.

use std::path::PathBuf;

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};
use palpate::base::Seed;
use palpate::physics::tabletop::{Coefficients, Path, Solid, Stage, Tool, Trial, simulate};
use palpate::stages::snapshots::{Config, Effect, Gaussian, Search, Space};

use super::{cpu, json, numbers, points, python};

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

/// One evaluation of 500 trials of 2 s, and the loop of 40, on the peer's own task.
pub fn beside_the_peer(whole: bool) {
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

pub fn peer_loop() {
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
