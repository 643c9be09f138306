//! Pushes from outside, of one body and of several.

use super::*;

#[test]
fn a_straight_push_reads_the_kinetic_friction_and_peaks_at_the_static_one() {
    for (speed, at) in [
        (0.005, "[-0.04, 0.0, 0.01]"),
        (0.03, "[-0.04, 0.0, 0.035]"),
        (0.1, "[-0.04, 0.0, 0.02]"),
    ] {
        let seen = play(&format!("{BLOCK}{}", push_of(at, speed, 0.06, "")));
        let steady = while_moving(&seen, 0.03, 0.045);
        near("kinetic", steady.x, 0.30 * (BLOCK_MASS * G - steady.z), 0.003);
        near("kinetic of the weight", steady.x, 0.30 * BLOCK_MASS * G, 0.005);
        let peak = seen.force.iter().map(|f| f.x).fold(0.0, f64::max);
        if speed < 0.1 {
            near("static", peak, 0.36 * BLOCK_MASS * G, 0.03);
        }
    }
}

#[test]
fn half_the_step_changes_nothing_that_matters() {
    let scene = scene(&format!("{BLOCK}{}", push_of("[-0.04, 0.008, 0.02]", 0.03, 0.03, "")));
    let solids = solids_of(&scene);
    let (coarse, fine) = (play_with(&scene, &solids, STEP), play_with(&scene, &solids, 0.5 * STEP));
    for (from, to) in [(0.004, 0.01), (0.01, 0.02)] {
        let (a, b) = (while_moving(&coarse, from, to), while_moving(&fine, from, to));
        near("force", a.norm(), b.norm(), 0.002);
    }
    let (a, b) = (
        coarse.tracks["block"].last().unwrap(),
        fine.tracks["block"].last().unwrap(),
    );
    assert!((a.translation.vector - b.translation.vector).norm() < 1e-4);
}

#[test]
fn a_retreating_tool_lets_the_block_coast() {
    let seen = play(&format!(
        "{BLOCK}{}",
        push_of("[-0.04, 0.0, 0.01]", 0.15, 0.05, "retreat = true")
    ));
    let last = seen.tracks["block"].last().unwrap().translation.vector.x;
    assert!(last > 0.05 + 0.8 * 0.15 * 0.15 / (0.6 * G));
}

#[test]
fn a_light_body_carries_a_heavy_one() {
    let seen = play(
        "[[body]]\nname = 'light'\nshape = { kind = 'box', size = [0.06, 0.06, 0.02] }\nposition = [0.0, 0.0, 0.01]\ndensity = 400.0\n\
         [[body]]\nname = 'heavy'\nshape = { kind = 'cylinder', radius = 0.025, height = 0.08 }\nposition = [0.004, 0.0, 0.06]\ndensity = 4000.0\n\
         [[action]]\nkind = 'push'\nname = 'p'\ntarget = 'light'\nat = [-0.03, 0.0, 0.01]\ndirection = [1.0, 0.0, 0.0]\nspeed = 0.03\ntravel = 0.03\n",
    );
    let mass = 0.06 * 0.06 * 0.02 * 400.0 + std::f64::consts::PI * 0.025 * 0.025 * 0.08 * 4000.0;
    let track = &seen.tracks["light"];
    let moving = |t: &f64| track[(t * 1000.0).round() as usize].translation.vector.x;
    let sliding: Vec<f64> = seen
        .force_time
        .iter()
        .copied()
        .filter(|t| moving(t) > 0.01 && moving(t) < 0.02)
        .collect();
    let force = mean(&seen.force_time, &seen.force, sliding[0], sliding[sliding.len() - 1]);
    near("kinetic", force.x, 0.30 * (mass * G - force.z), 0.003);
    let given = Vector3::new(0.004, 0.0, 0.06) - seen.tracks["heavy"][0].translation.vector;
    assert!(given.norm() < 2e-5);
}

#[test]
fn a_pushed_stack_goes_along_and_weighs_on_the_table() {
    let seen = play(&format!(
        "{BLOCK}{STACK}{}",
        push_of("[-0.04, 0.0, 0.02]", 0.03, 0.04, "")
    ));
    let mass = BLOCK_MASS + 0.04 * 0.04 * 0.03 * 600.0;
    let steady = while_moving(&seen, 0.01, 0.03);
    near("kinetic", steady.x, 0.30 * (mass * G - steady.z), 0.003);
    let moved =
        |name: &str| seen.tracks[name].last().unwrap().translation.vector.x - seen.tracks[name][0].translation.vector.x;
    assert!((moved("block") - moved("top")).abs() < 2e-4 && moved("block") > 0.039);
}

#[test]
fn a_pushed_block_shoves_its_neighbour() {
    let seen = play(&format!(
        "{BLOCK}[[body]]\nname = 'other'\nshape = {{ kind = 'box', size = [0.05, 0.05, 0.05] }}\nposition = [0.075, 0.0, 0.025]\nfriction = {{ static = 0.4, kinetic = 0.4 }}\n{}",
        push_of("[-0.04, 0.0, 0.02]", 0.03, 0.04, "")
    ));
    let steady = while_moving(&seen, 0.02, 0.03);
    near(
        "both",
        steady.x,
        (0.3 * BLOCK_MASS + 0.4 * 0.05f64.powi(3) * 600.0) * G,
        0.02,
    );
    let moved = seen.tracks["other"].last().unwrap().translation.vector;
    assert!((moved.x - 0.105).abs() < 1e-3 && moved.z < 0.0252);
}

#[test]
fn round_things_roll() {
    let seen = play(&format!(
        "[[body]]\nname = 'block'\nshape = {{ kind = 'sphere', radius = 0.03 }}\nposition = [0.0, 0.0, 0.03]\n{}",
        push_of("[-0.03, 0.0, 0.03]", 0.05, 0.03, "tool_friction = 0.0")
    ));
    let i = (0..)
        .find(|i| seen.tracks["block"][*i].translation.vector.x > 0.015)
        .unwrap();
    let (a, b) = (seen.tracks["block"][i], seen.tracks["block"][i + 100]);
    let way = b.translation.vector.x - a.translation.vector.x;
    near("turn", a.rotation.angle_to(&b.rotation), way / 0.03, 0.01);
}

#[test]
fn a_block_pushed_near_its_top_tips_about_its_edge() {
    let tall = "
[[body]]
name = 'block'
shape = { kind = 'box', size = [0.04, 0.06, 0.12] }
position = [0.0, 0.0, 0.06]
friction = { static = 0.8, kinetic = 0.8 }
";
    let seen = play(&format!(
        "{tall}{}",
        push_of("[-0.02, 0.0, 0.11]", 0.005, 0.004, "tool_friction = 0.0")
    ));
    let touch = seen.force.iter().position(|f| f.x > 0.0).unwrap();
    let force = mean(
        &seen.force_time,
        &seen.force,
        seen.force_time[touch] + 0.04,
        seen.force_time[touch] + 0.08,
    );
    near(
        "tipping force",
        force.x,
        0.04 * 0.06 * 0.12 * 600.0 * G * 0.02 / 0.11,
        0.03,
    );
}
