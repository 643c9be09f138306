//! Bodies left to themselves, on a level and on a tilted table.

use super::*;

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
        assert!(drift < 5e-6 && first.rotation.angle_to(&last.rotation) < 1e-4 && given < 2e-5);
    }
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
fn nothing_moves_on_a_slope_below_the_angle_of_friction() {
    let seen = play(&format!(
        "support = {{ tilt = [0.05, 0.0] }}\n{BLOCK}[[action]]\nkind = 'hold'\nname = 'h'\nseconds = 2.0\n"
    ));
    let track = &seen.tracks["block"];
    let crept = (track[track.len() - 1].translation.vector - track[0].translation.vector).norm();
    assert!(crept < 1e-6);
}
