//! The world against textbook answers.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use super::World;
use crate::base::{Pose, Progress};
use crate::lab::perform::{Performance, perform_in_steps};
use crate::lab::{ConvexPart, PartShape, Solid};
use crate::lab::{Scene, ShapeSpec};

const G: f64 = 9.80665;
const STEP: f64 = 5e-5;

/// Boxes, cylinders and balls of the scene, uniformly filled.
fn solids_of(scene: &Scene) -> BTreeMap<String, Solid> {
    let solid = |b: &crate::lab::BodySpec| {
        let (shape, volume, square) = match b.shape {
            ShapeSpec::Box { size: [x, y, z] } => (
                PartShape::Box {
                    half: Vector3::new(x, y, z) / 2.0,
                },
                x * y * z,
                Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y) / 12.0,
            ),
            ShapeSpec::Cylinder { radius: r, height: h } => (
                PartShape::Cylinder {
                    radius: r,
                    half_height: h / 2.0,
                },
                std::f64::consts::PI * r * r * h,
                Vector3::new(r * r / 4.0 + h * h / 12.0, r * r / 4.0 + h * h / 12.0, r * r / 2.0),
            ),
            ShapeSpec::Sphere { radius: r } => (
                PartShape::Sphere { radius: r },
                4.0 / 3.0 * std::f64::consts::PI * r.powi(3),
                Vector3::repeat(0.4 * r * r),
            ),
            _ => panic!("a plain shape"),
        };
        let mass = b.density * volume;
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), b.yaw);
        Solid {
            name: b.name.clone(),
            mesh: Default::default(),
            mass,
            com: Point3::origin(),
            inertia: Matrix3::from_diagonal(&(square * mass)),
            world_from_body: Pose(Isometry3::from_parts(Vector3::from(b.position).into(), rotation)),
            parts: vec![ConvexPart {
                shape,
                body_from_part: Pose::identity(),
            }],
        }
    };
    scene.body.iter().map(|b| (b.name.clone(), solid(b))).collect()
}

fn scene(text: &str) -> Scene {
    toml::from_str(&format!("name = 'test'\n{text}")).unwrap()
}

fn play_with(scene: &Scene, solids: &BTreeMap<String, Solid>, dt: f64) -> Performance {
    perform_in_steps(scene, solids, &Progress::silent(), dt)
        .unwrap()
        .remove(0)
}

fn play(text: &str) -> Performance {
    let scene = scene(text);
    play_with(&scene, &solids_of(&scene), STEP)
}

/// Mean of a component between two times.
fn mean(time: &[f64], values: &[Vector3<f64>], from: f64, to: f64) -> Vector3<f64> {
    let chosen: Vec<_> = time
        .iter()
        .zip(values)
        .filter(|(t, _)| **t >= from && **t <= to)
        .map(|(_, v)| *v)
        .collect();
    chosen.iter().sum::<Vector3<f64>>() / chosen.len() as f64
}

/// Mean force while the block's travel along x is between two values.
fn while_moving(seen: &Performance, from: f64, to: f64) -> Vector3<f64> {
    let track = &seen.tracks["block"];
    let travel = |i: usize| track[i].translation.vector.x - track[0].translation.vector.x;
    let within: Vec<usize> = (0..track.len())
        .filter(|i| travel(*i) > from && travel(*i) < to)
        .collect();
    mean(
        &seen.force_time,
        &seen.force,
        seen.force_time[within[0]],
        seen.force_time[within[within.len() - 1]],
    )
}

fn near(name: &str, found: f64, expected: f64, fraction: f64) {
    let off = (found - expected) / expected;
    println!("{name}: {found:.6} for {expected:.6}, {:.3} % off", 100.0 * off);
    assert!(off.abs() <= fraction, "{name}: {found} for {expected}");
}

const BLOCK: &str = "
[[body]]
name = 'block'
shape = { kind = 'box', size = [0.08, 0.06, 0.05] }
density = 1250.0
position = [0.0, 0.0, 0.025]
friction = { static = 0.36, kinetic = 0.30 }
";
const BLOCK_MASS: f64 = 0.3;

fn push_of(at: &str, speed: f64, travel: f64, rest: &str) -> String {
    format!(
        "[[action]]\nkind = 'push'\nname = 'p'\ntarget = 'block'\nat = {at}\ndirection = [1.0, 0.0, 0.0]\n\
         speed = {speed}\ntravel = {travel}\n{rest}\n"
    )
}

#[test]
fn a_straight_push_reads_the_kinetic_friction_and_peaks_at_the_static_one() {
    for (speed, at) in [
        (0.005, "[-0.04, 0.0, 0.01]"),
        (0.03, "[-0.04, 0.0, 0.035]"),
        (0.1, "[-0.04, 0.0, 0.02]"),
    ] {
        let seen = play(&format!("{BLOCK}{}", push_of(at, speed, 0.06, "")));
        let steady = while_moving(&seen, 0.03, 0.045);
        println!("steady {steady:?}");
        near("kinetic", steady.x, 0.30 * (BLOCK_MASS * G - steady.z), 0.003);
        near("kinetic of the weight", steady.x, 0.30 * BLOCK_MASS * G, 0.005);
        let peak = seen.force.iter().map(|f| f.x).fold(0.0, f64::max);
        println!("peak {peak} of {}", 0.36 * BLOCK_MASS * G);
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
    println!(
        "apart {} m {} rad",
        (a.translation.vector - b.translation.vector).norm(),
        a.rotation.angle_to(&b.rotation)
    );
    assert!((a.translation.vector - b.translation.vector).norm() < 1e-4);
}

#[test]
fn a_tilted_block_slides_at_the_angle_of_friction() {
    let seen = play(&format!(
        "{BLOCK}[[action]]\nkind = 'tilt'\nname = 't'\ntarget = 'block'\naxis = [0.0, 1.0, 0.0]\nrate = 0.12\nlimit = 0.8\nslide = 0.15\n"
    ));
    let along = |i: usize| {
        let n = seen.support_normal[i];
        let down = Vector3::new(n.z, 0.0, -n.x);
        seen.tracks["block"][i].translation.vector.dot(&down)
    };
    let first = (0..seen.track_time.len())
        .find(|i| along(*i) - along(0) > 5e-5)
        .unwrap();
    let angle = |i: usize| seen.support_normal[i].x.asin();
    near("angle", angle(first), 0.36f64.atan(), 0.01);
    let (a, b) = (first + 50, first + 150);
    let speed = |i: usize| (along(i + 5) - along(i - 5)) / 0.01;
    let tilt = angle((a + b) / 2);
    near(
        "acceleration",
        (speed(b) - speed(a)) / 0.1,
        G * (tilt.sin() - 0.30 * tilt.cos()),
        0.02,
    );
}

#[test]
fn a_lift_reads_weight_and_the_moment_of_a_centre_of_mass_off_the_grip() {
    let scene = scene(&format!(
        "{BLOCK}[[action]]\nkind = 'lift'\nname = 'l'\ntarget = 'block'\nat = [0.0, 0.0, 0.045]\nheight = 0.05\n"
    ));
    let mut solids = solids_of(&scene);
    solids.get_mut("block").unwrap().com = Point3::new(0.012, -0.007, 0.004);
    let seen = play_with(&scene, &solids, STEP);
    let (force, torque) = (
        mean(&seen.force_time, &seen.force, 2.0, 2.4),
        mean(&seen.force_time, &seen.torque, 2.0, 2.4),
    );
    near("weight", force.z, BLOCK_MASS * G, 0.001);
    near("moment x", torque.x, -0.007 * BLOCK_MASS * G, 0.01);
    near("moment y", torque.y, -0.012 * BLOCK_MASS * G, 0.01);
    assert!(seen.tracks["block"].last().unwrap().translation.vector.z - 0.025 < 2e-5);
}

#[test]
fn a_launched_block_coasts_v_squared_over_two_mu_g() {
    let scene = scene(BLOCK);
    let mut world = World::new(&scene, &solids_of(&scene), &["block".to_owned()]);
    let speed: f64 = 0.4;
    for _ in 0..2000 {
        world.step(None, STEP);
    }
    let start = world.bodies[0].frame.position.x;
    world.bodies[0].launch(Vector3::new(speed, 0.0, 0.0), Vector3::zeros());
    for _ in 0..10_000 {
        world.step(None, STEP);
    }
    near(
        "distance",
        world.bodies[0].frame.position.x - start,
        speed * speed / (2.0 * 0.3 * G),
        0.03,
    );
}

#[test]
fn a_retreating_tool_lets_the_block_coast() {
    let seen = play(&format!(
        "{BLOCK}{}",
        push_of("[-0.04, 0.0, 0.01]", 0.15, 0.05, "retreat = true")
    ));
    let last = seen.tracks["block"].last().unwrap().translation.vector.x;
    println!(
        "coasted {} mm, free {} mm",
        (last - 0.05) * 1e3,
        0.15 * 0.15 / (0.6 * G) * 1e3
    );
    assert!(last > 0.05 + 0.8 * 0.15 * 0.15 / (0.6 * G));
}

#[test]
fn a_press_reads_stiffness_times_depth_and_the_body_stays() {
    let light = BLOCK.replace("1250.0", "90.0");
    let foam = "foam = { stiffness = 1500.0, damping = 3.0 }\n";
    for tool in ["", "tool = { shape = 'cylinder', radius = 0.01, half_height = 0.02 }\n"] {
        let seen = play(&format!(
            "{light}{foam}[[action]]\nkind = 'press'\nname = 'p'\ntarget = 'block'\nat = [0.01, 0.0, 0.05]\ndepth = 0.008\nspeed = 0.02\n{tool}"
        ));
        let force = mean(&seen.force_time, &seen.force, 2.0, 2.5);
        near("force", -force.z, 1500.0 * 0.008, 0.005);
        let track = &seen.tracks["block"];
        let moved = track
            .iter()
            .map(|p| (p.translation.vector - track[0].translation.vector).norm())
            .fold(0.0, f64::max);
        println!("moved {moved}");
        assert!(moved < 2e-5);
    }
}

const HINGE: &str = "
[[body]]
name = 'post'
shape = { kind = 'box', size = [0.04, 0.04, 0.06] }
position = [-0.03, 0.0, 0.10]
fixed = true
[[body]]
name = 'block'
shape = { kind = 'box', size = [0.2, 0.02, 0.05] }
position = [0.1, 0.0, 0.10]
[[joint]]
a = 'post'
b = 'block'
kind = 'revolute'
axis = [0.0, 0.0, 1.0]
origin = [0.0, 0.0, 0.10]
friction = 0.06
";

#[test]
fn a_pulled_hinge_needs_its_friction_torque_over_the_arm() {
    for pin in [false, true] {
        let seen = play(&format!(
            "{HINGE}[[action]]\nkind = 'pull'\nname = 'p'\ntarget = 'block'\nat = [0.18, 0.0, 0.10]\ndirection = [0.0, 1.0, 0.0]\n\
             travel = 0.15\nspeed = 0.06\narc = true\npin = {pin}\n"
        ));
        let middle = 0.5 + 1.3;
        let i = (middle * 1000.0) as usize;
        let force = mean(&seen.force_time, &seen.force, middle - 0.2, middle + 0.2);
        let tool = seen.tool_pose[i].translation.vector - Vector3::new(0.0, 0.0, 0.1);
        let torque: f64 = (i - 100..i + 100)
            .map(|k| {
                let arm = seen.tool_pose[k].translation.vector - Vector3::new(0.0, 0.0, 0.1);
                (arm.cross(&seen.force[k]) + seen.torque[k]).z
            })
            .sum::<f64>()
            / 200.0;
        println!("force {force:?} at {tool:?}");
        near("friction torque", torque, 0.06, 0.005);
        let pose = seen.tracks["block"].last().unwrap();
        near("angle", pose.rotation.angle(), 0.15 / 0.18, 0.01);
        let hinge = pose.0 * Point3::new(-0.1, 0.0, 0.0) - Point3::new(0.0, 0.0, 0.1);
        println!(
            "hinge gave {} m, sag {} rad",
            hinge.norm(),
            (pose.rotation * Vector3::x()).z
        );
        assert!(hinge.norm() < 1e-5 && (pose.rotation * Vector3::x()).z.abs() < 2e-4);
    }
}

#[test]
fn a_drawer_needs_its_friction_and_stops_at_its_limit() {
    let seen = play(
        "[[body]]\nname = 'case'\nshape = { kind = 'box', size = [0.1, 0.1, 0.1] }\nposition = [0.0, 0.0, 0.05]\nfixed = true\n\
         [[body]]\nname = 'drawer'\nshape = { kind = 'box', size = [0.1, 0.08, 0.04] }\nposition = [0.1, 0.0, 0.05]\n\
         [[joint]]\na = 'case'\nb = 'drawer'\nkind = 'prismatic'\naxis = [1.0, 0.0, 0.0]\nlimits = [0.0, 0.05]\nfriction = 1.5\ndamping = 4.0\n\
         [[action]]\nkind = 'pull'\nname = 'p'\ntarget = 'drawer'\nat = [0.15, 0.01, 0.05]\ndirection = [1.0, 0.0, 0.0]\ntravel = 0.051\nspeed = 0.03\narc = true\npin = true\n",
    );
    let force = mean(&seen.force_time, &seen.force, 1.0, 1.6);
    near("friction and damping", force.x, 1.5 + 4.0 * 0.03, 0.005);
    let last = seen.tracks["drawer"].last().unwrap().translation.vector.x - 0.1;
    println!("stopped at {last}");
    assert!(last > 0.0499 && last < 0.0506);
}

const STACK: &str = "
[[body]]
name = 'top'
shape = { kind = 'box', size = [0.04, 0.04, 0.03] }
position = [0.005, 0.0, 0.065]
";

#[test]
fn what_rests_stays_where_it_is() {
    let seen = play(&format!(
        "{BLOCK}{STACK}[[action]]\nkind = 'hold'\nname = 'h'\nseconds = 1.0\n"
    ));
    for (name, at) in [
        ("block", Vector3::new(0.0, 0.0, 0.025)),
        ("top", Vector3::new(0.005, 0.0, 0.065)),
    ] {
        let track = &seen.tracks[name];
        let (first, last) = (track[0], track[track.len() - 1]);
        let drift = (first.translation.vector - last.translation.vector).norm();
        let given = (first.translation.vector - at).norm();
        println!(
            "{name}: drift {drift} m, {} rad, given {given} m",
            first.rotation.angle_to(&last.rotation)
        );
        assert!(drift < 5e-6 && first.rotation.angle_to(&last.rotation) < 1e-4 && given < 2e-5);
    }
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
    println!(
        "settled by {} {given:?} {:?}",
        given.norm(),
        seen.tracks["light"][0].translation.vector - Vector3::z() * 0.01
    );
    assert!(given.norm() < 2e-5);
}

#[test]
fn glue_lifts_what_is_below_and_rest_does_not() {
    let lift = "[[action]]\nkind = 'lift'\nname = 'l'\ntarget = 'top'\nat = [0.005, 0.0, 0.08]\nheight = 0.04\n";
    let top = 0.04 * 0.04 * 0.03 * 600.0;
    for (glue, height, mass) in [
        ("", 0.0, top),
        ("[[bond]]\na = 'block'\nb = 'top'\n", 0.04, top + BLOCK_MASS),
        ("[[bond]]\na = 'block'\nb = 'top'\nbreakaway = 1.0\n", 0.0, top),
    ] {
        let seen = play(&format!("{BLOCK}{STACK}{glue}{lift}"));
        let raised = seen.tracks["block"][2000].translation.vector.z - 0.025;
        println!("raised {raised}");
        assert!((raised - height).abs() < 5e-4);
        near(
            "weight",
            mean(&seen.force_time, &seen.force, 1.8, 2.2).z,
            mass * G,
            0.002,
        );
    }
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
    println!("moved {} and {}", moved("block"), moved("top"));
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
    println!("other at {moved:?}");
    assert!((moved.x - 0.105).abs() < 1e-3 && moved.z < 0.0252);
}

#[test]
fn a_spinning_disc_slows_by_two_thirds_mu_n_r() {
    let scene = scene(
        "[[body]]\nname = 'disc'\nshape = { kind = 'cylinder', radius = 0.04, height = 0.03 }\nposition = [0.0, 0.0, 0.015]\nfriction = { static = 0.3, kinetic = 0.3 }\n",
    );
    let mut world = World::new(&scene, &solids_of(&scene), &["disc".to_owned()]);
    run(&mut world, 2000);
    world.bodies[0].launch(Vector3::zeros(), Vector3::z() * 12.0);
    run(&mut world, 1000);
    let before = world.bodies[0].frame.angular_velocity.z;
    run(&mut world, 800);
    let after = world.bodies[0].frame.angular_velocity.z;
    let rate = (before - after) / (800.0 * STEP);
    near("spin-down", 0.5 * 0.04 * rate / G, 2.0 / 3.0 * 0.3, 0.02);
}

#[test]
fn round_things_roll() {
    for shape in ["{ kind = 'sphere', radius = 0.03 }"] {
        let seen = play(&format!(
            "[[body]]\nname = 'block'\nshape = {shape}\nposition = [0.0, 0.0, 0.03]\n{}",
            push_of("[-0.03, 0.0, 0.03]", 0.05, 0.03, "tool_friction = 0.0")
        ));
        let i = (0..)
            .find(|i| seen.tracks["block"][*i].translation.vector.x > 0.015)
            .unwrap();
        let (a, b) = (seen.tracks["block"][i], seen.tracks["block"][i + 100]);
        let way = b.translation.vector.x - a.translation.vector.x;
        println!("way {way}");
        near("turn", a.rotation.angle_to(&b.rotation), way / 0.03, 0.01);
    }
}

#[test]
fn a_lying_cylinder_rolls_down_a_tilted_table() {
    let scene = scene(
        "support = { tilt = [-0.02, 0.0] }\n[[body]]\nname = 'roll'\nshape = { kind = 'cylinder', radius = 0.02, height = 0.08 }\nposition = [0.0, 0.0, 0.02]\n",
    );
    let mut solids = solids_of(&scene);
    let roll = solids.get_mut("roll").unwrap();
    roll.world_from_body.0.rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let mut world = World::new(&scene, &solids, &["roll".to_owned()]);
    run(&mut world, 10_000);
    let frame = &world.bodies[0].frame;
    near(
        "acceleration",
        frame.velocity.x / 0.5,
        2.0 / 3.0 * G * 0.02f64.sin(),
        0.01,
    );
    near("turning", frame.angular_velocity.y, frame.velocity.x / 0.02, 0.01);
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

#[test]
fn nothing_moves_on_a_slope_below_the_angle_of_friction() {
    let seen = play(&format!(
        "support = {{ tilt = [0.05, 0.0] }}\n{BLOCK}[[action]]\nkind = 'hold'\nname = 'h'\nseconds = 2.0\n"
    ));
    let track = &seen.tracks["block"];
    let crept = (track[track.len() - 1].translation.vector - track[0].translation.vector).norm();
    println!("crept {crept}");
    assert!(crept < 1e-6);
}

fn run(world: &mut World, steps: usize) {
    for _ in 0..steps {
        world.step(None, STEP);
    }
}
