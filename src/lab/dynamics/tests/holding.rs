//! Lifts, pulls and presses; joints and glue.

use super::*;

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
fn the_slope_of_a_table_pulls_along_what_stands_on_it_and_not_what_is_raised() {
    let across = |slope: &str| {
        let seen = play(&format!(
            "{slope}{BLOCK}[[action]]\nkind = 'lift'\nname = 'l'\ntarget = 'block'\nat = [0.0, 0.0, 0.045]\nheight = 0.05\n"
        ));
        let force = mean(&seen.force_time, &seen.force, 2.0, 2.4);
        force.xy().norm() / force.z
    };
    let level = across("");
    assert!((across("support = { tilt = [0.1, 0.0] }\n") - level).abs() < 1e-3);
    // Gravity that points elsewhere is read wherever a thing is.
    assert!((across("gravity = [0.98, 0.0, -9.76]\n") - 0.1).abs() < 5e-3);
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
        assert!(moved < 2e-5);
    }
}

#[test]
fn a_pulled_hinge_needs_its_friction_torque_over_the_arm() {
    for pin in [false, true] {
        let seen = play(&format!(
            "{HINGE}[[action]]\nkind = 'pull'\nname = 'p'\ntarget = 'block'\nat = [0.18, 0.0, 0.10]\ndirection = [0.0, 1.0, 0.0]\n\
             travel = 0.15\nspeed = 0.06\narc = true\npin = {pin}\n"
        ));
        let middle = 0.5 + 1.3;
        let i = (middle * 1000.0) as usize;
        let torque: f64 = (i - 100..i + 100)
            .map(|k| {
                let arm = seen.tool_pose[k].translation.vector - Vector3::new(0.0, 0.0, 0.1);
                (arm.cross(&seen.force[k]) + seen.torque[k]).z
            })
            .sum::<f64>()
            / 200.0;
        near("friction torque", torque, 0.06, 0.005);
        let pose = seen.tracks["block"].last().unwrap();
        near("angle", pose.rotation.angle(), 0.15 / 0.18, 0.01);
        let hinge = pose.0 * Point3::new(-0.1, 0.0, 0.0) - Point3::new(0.0, 0.0, 0.1);
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
    assert!(last > 0.0499 && last < 0.0506);
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
        assert!((raised - height).abs() < 5e-4);
        near(
            "weight",
            mean(&seen.force_time, &seen.force, 1.8, 2.2).z,
            mass * G,
            0.002,
        );
    }
}

/// A trunk of 16 g that three joints hold: their dampings together are more than one step of time bears.
const BRANCHING: &str = "
[[body]]
name = 'base'
shape = { kind = 'box', size = [0.12, 0.12, 0.12] }
position = [0.0, 0.0, 0.4]
fixed = true
[[body]]
name = 'trunk'
shape = { kind = 'box', size = [0.022, 0.022, 0.105] }
position = [0.0, 0.0, 0.5144]
density = 328.0
[[body]]
name = 'top'
shape = { kind = 'box', size = [0.034, 0.034, 0.154] }
position = [0.0, 0.0, 0.646]
density = 266.0
[[body]]
name = 'side'
shape = { kind = 'box', size = [0.158, 0.039, 0.039] }
position = [0.092, 0.0, 0.5144]
density = 509.0
[[joint]]
a = 'base'
b = 'trunk'
kind = 'revolute'
axis = [0.913, 0.403, 0.058]
origin = [0.004, 0.007, 0.463]
friction = 0.25
damping = 0.115
[[joint]]
a = 'trunk'
b = 'top'
kind = 'revolute'
axis = [-0.966, 0.186, -0.179]
origin = [0.007, 0.004, 0.572]
friction = 0.1
damping = 0.075
[[joint]]
a = 'trunk'
b = 'side'
kind = 'revolute'
axis = [0.375, -0.098, -0.922]
origin = [0.003, 0.006, 0.51]
friction = 0.07
damping = 0.02
";

#[test]
fn a_light_trunk_of_three_joints_does_not_fly_apart() {
    let seen = play(&format!(
        "{BRANCHING}[[action]]\nkind = 'pull'\nname = 'p'\ntarget = 'top'\nat = [0.0, 0.0, 0.70]\n\
         direction = [0.02, 0.09, -0.01]\ntravel = 0.05\nspeed = 0.1\narc = true\npin = true\n"
    ));
    let turned = |name: &str| seen.tracks[name].last().unwrap().rotation.angle();
    assert!(turned("top") > 0.2, "{}", turned("top"));
    assert!(turned("trunk") < 0.02 && turned("side") < 0.02);
}
