//! Recover the truth from recordings made here by formula, with the noise of a real rig.

#![allow(clippy::expect_used, reason = "a test fails aloud")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use rand_distr::{Distribution, StandardNormal};

use palpate::base::{Estimate, Notices, Pose, Seed, rng_for};
use palpate::capture::{
    BodyPrior, Capture, Interaction, Kind, Noise, PoseStream, Support, Tool, ToolShape, VectorStream, WrenchStream,
};
use palpate::geometry::Mesh;
use palpate::stages::estimation::{
    Config, ForceScale, calibrate_force, calibrate_friction, identify, materials_from_toml,
};
use palpate::stages::interaction;
use palpate::twin::{Body, FORMAT, Link, Model, Provenance, Twin};

const G: f64 = 9.80665;

/// Noise of a sensor, from the dice.
struct Rig(rand_chacha::ChaCha8Rng);

impl Rig {
    fn new(seed: u64) -> Self {
        Self(rng_for(Seed(seed), "synthetic"))
    }

    fn shake(&mut self, sd: f64) -> Vector3<f64> {
        let mut one = || -> f64 { StandardNormal.sample(&mut self.0) };
        sd * Vector3::new(one(), one(), one())
    }

    fn track(&mut self, seconds: f64, rate: f64, sd: f64, pose: impl Fn(f64) -> Isometry3<f64>) -> PoseStream {
        let time: Vec<f64> = (0..(seconds * rate) as usize).map(|i| i as f64 / rate).collect();
        let poses: Vec<Isometry3<f64>> = time.iter().map(|t| pose(*t)).collect();
        PoseStream {
            position: poses
                .iter()
                .map(|p| Point3::from(p.translation.vector + self.shake(sd)))
                .collect(),
            rotation: poses
                .iter()
                .map(|p| Some(UnitQuaternion::from_scaled_axis(self.shake(10.0 * sd)) * p.rotation))
                .collect(),
            time,
        }
    }

    fn force(&mut self, seconds: f64, force: impl Fn(f64) -> Vector3<f64>) -> WrenchStream {
        let time: Vec<f64> = (0..(seconds * 500.0) as usize).map(|i| i as f64 / 500.0).collect();
        let tare = Vector3::new(0.05, -0.02, 0.1);
        WrenchStream {
            force: time.iter().map(|t| force(*t) + tare + self.shake(0.03)).collect(),
            torque: None,
            time,
        }
    }
}

fn interaction(name: &str, kind: Kind, tool: Option<Tool>) -> Interaction {
    Interaction {
        name: name.into(),
        kind,
        action: None,
        tool_name: None,
        tool,
        target: Some("box".into()),
        force: None,
        tool_path: None,
        support_path: None,
        tracks: BTreeMap::new(),
        frames: None,
        held_out: false,
    }
}

fn finger(grip: bool) -> Option<Tool> {
    Some(Tool {
        shape: ToolShape::Sphere { radius: 0.008 },
        grip,
        pin: false,
    })
}

fn at(x: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, 0.0, z)
}

/// Stands for 0.5 s, is pushed along x at 30 mm/s for 1.5 s.
fn push(rig: &mut Rig, name: &str, friction: f64, way: f64) -> Interaction {
    let travel = |t: f64| 0.03 * (t - 0.5).clamp(0.0, 1.5);
    let mut out = interaction(name, Kind::Push, finger(false));
    out.tool_path = Some(rig.track(2.5, 500.0, 5e-5, |t| {
        at(way * (travel(t) - 0.058 - 0.03 * (0.5 - t).max(0.0)), 0.02)
    }));
    out.tracks
        .insert("box".into(), rig.track(2.5, 120.0, 4e-4, |t| at(way * travel(t), 0.02)));
    let pushed = |t: f64| (0.5..2.0).contains(&t);
    out.force = Some(rig.force(2.5, |t| {
        if pushed(t) {
            Vector3::x() * way * friction
        } else {
            Vector3::zeros()
        }
    }));
    out
}

/// Stands for 0.5 s, rises 80 mm in a second, is held.
fn lift(rig: &mut Rig, mass: f64) -> Interaction {
    let rise = |t: f64| 0.08 * (t - 0.5).clamp(0.0, 1.0);
    let mut out = interaction("lift-00", Kind::Lift, finger(true));
    out.tool_path = Some(rig.track(3.0, 500.0, 5e-5, |t| at(0.0, 0.04 + rise(t))));
    out.tracks
        .insert("box".into(), rig.track(3.0, 120.0, 4e-4, |t| at(0.0, 0.02 + rise(t))));
    out.force = Some(rig.force(3.0, |t| {
        if t > 0.48 {
            Vector3::z() * mass * G
        } else {
            Vector3::zeros()
        }
    }));
    out
}

/// The support turns about a hinge behind the body at 0.1 rad/s until it slides.
fn tilt(rig: &mut Rig, name: &str, mu_s: f64, mu_k: f64) -> Interaction {
    let hinge = Point3::new(-0.1, 0.0, 0.01);
    let angle = |t: f64| 0.1 * (t - 0.4_f64).max(0.0);
    let turn = |t: f64| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle(t));
    let start = 0.4 + mu_s.atan() / 0.1;
    let steps = 20_000;
    let (mut s, mut v, mut slid) = (0.0, 0.0, vec![0.0]);
    for i in 0..steps {
        let t = 1e-4 * i as f64 + start;
        v += 1e-4 * G * (angle(t).sin() - mu_k * angle(t).cos());
        s += 1e-4 * v;
        slid.push(s);
    }
    let distance = |t: f64| {
        if t < start {
            0.0
        } else {
            slid[(((t - start) * 1e4) as usize).min(steps)]
        }
    };
    let seconds = start + 0.9;
    let mut out = interaction(name, Kind::Tilt, None);
    let pose = |t: f64| {
        let p = hinge + turn(t) * (Point3::new(distance(t), 0.0, 0.02) - hinge);
        Isometry3::from_parts(p.into(), turn(t))
    };
    out.tracks.insert("box".into(), rig.track(seconds, 120.0, 4e-4, pose));
    let time: Vec<f64> = (0..(seconds * 120.0) as usize).map(|i| i as f64 / 120.0).collect();
    out.support_path = Some(VectorStream {
        vector: time
            .iter()
            .map(|t| UnitVector3::new_normalize(turn(*t) * Vector3::z()))
            .collect(),
        time,
    });
    out
}

/// Down at 10 mm/s onto a spring with a hard tip and a frame that gives way, held, up again.
fn press(rig: &mut Rig, stiffness: f64) -> Interaction {
    let depth = |t: f64| 0.01 * ((t - 0.5).clamp(0.0, 0.7) - (t - 2.0).clamp(0.0, 0.7)) - 0.003;
    let u = |t: f64| depth(t).max(0.0);
    let mut out = interaction("press-00", Kind::Press, finger(false));
    out.tool_path = Some(rig.track(3.2, 500.0, 2e-5, |t| at(0.0, 0.068 - depth(t))));
    out.tracks
        .insert("box".into(), rig.track(3.2, 120.0, 4e-4, |t| at(0.0, -u(t))));
    out.force = Some(rig.force(3.2, |t| -Vector3::z() * stiffness * u(t)));
    out
}

fn capture(interactions: Vec<Interaction>) -> Capture {
    Capture {
        root: PathBuf::new(),
        name: "synthetic".into(),
        gravity: Vector3::new(0.0, 0.0, -G),
        support: Some(Support {
            point: Point3::origin(),
            normal: Vector3::z_axis(),
            material: Some("wood".into()),
            friction: None,
        }),
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions,
        truth: None,
        digest: String::new(),
    }
}

fn box_mesh(half: [f64; 3]) -> Mesh {
    let corner = |i: u32| {
        let s = |bit: u32, h: f64| if i & bit == 0 { -h } else { h };
        Point3::new(s(1, half[0]), s(2, half[1]), s(4, half[2]))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .collect(),
        ..Mesh::default()
    }
}

fn model() -> Model {
    let mut link = Link::new("box", Pose(at(0.0, 0.02)));
    link.mesh = Some("box.obj".into());
    Model {
        twin: Twin {
            format: FORMAT.into(),
            name: "synthetic".into(),
            gravity: [0.0, 0.0, -G],
            support: None,
            bodies: vec![Body::rigid(link)],
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::from([("box.obj".into(), box_mesh([0.05, 0.04, 0.02]))]),
        textures: BTreeMap::new(),
    }
}

fn found(interactions: Vec<Interaction>) -> Link {
    found_in(&capture(interactions), &Config::default())
}

fn found_in(capture: &Capture, config: &Config) -> Link {
    let (mut model, mut notices) = (model(), Notices::default());
    let cut = interaction::segment(capture, &model, &interaction::Config::default(), &mut notices).expect("cuts");
    identify(capture, &cut, &mut model, config, &mut notices).expect("identifies");
    model.twin.bodies[0].links[0].clone()
}

/// The estimate is measured, its interval holds the truth and is no wider than `widest` of it.
fn holds(estimate: Option<&Estimate>, truth: f64, widest: f64) {
    let estimate = estimate.expect("found");
    let [low, high] = estimate.ci95.expect("interval");
    assert!(estimate.is_measured(), "{estimate:?}");
    assert!(low <= truth && truth <= high, "{truth} outside [{low}, {high}]");
    assert!(high - low < widest * truth, "[{low}, {high}] is too wide for {truth}");
}

#[test]
fn a_lift_and_pushes_give_mass_and_friction() {
    let mut rig = Rig::new(1);
    let (mass, mu) = (0.4, 0.3);
    let pushes = [1.0, -1.0].map(|way| {
        push(
            &mut rig,
            if way > 0.0 { "push-00" } else { "push-01" },
            mu * mass * G,
            way,
        )
    });
    let link = found([vec![lift(&mut rig, mass)], pushes.to_vec()].concat());
    holds(link.mass.as_ref(), mass, 0.03);
    holds(link.friction_force.kinetic.as_ref(), mu * mass * G, 0.1);
    holds(link.friction.kinetic.as_ref(), mu, 0.12);
    assert!(link.inertia.is_some() && link.com.is_some());
}

#[test]
fn pushes_alone_give_the_product_only() {
    let mut rig = Rig::new(2);
    let link = found(vec![push(&mut rig, "push-00", 1.2, 1.0)]);
    holds(link.friction_force.kinetic.as_ref(), 1.2, 0.15);
    for estimate in [&link.mass, &link.friction.kinetic] {
        let estimate = estimate.as_ref().expect("assumed");
        assert!(!estimate.is_measured());
        let confounded = estimate.confounded.as_ref().expect("says so");
        assert_eq!(confounded.known, "friction_force.kinetic");
    }
}

#[test]
fn a_tilt_gives_static_and_kinetic_friction_and_with_a_push_the_mass() {
    let mut rig = Rig::new(3);
    let (mass, mu_s, mu_k) = (0.35, 0.36, 0.3);
    let link = found(vec![
        tilt(&mut rig, "tilt-00", mu_s, mu_k),
        push(&mut rig, "push-00", mu_k * mass * G, 1.0),
    ]);
    holds(link.friction.static_.as_ref(), mu_s, 0.15);
    holds(link.friction.kinetic.as_ref(), mu_k, 0.15);
    holds(link.mass.as_ref(), mass, 0.25);
}

#[test]
fn a_press_gives_stiffness_and_no_mass() {
    let mut rig = Rig::new(4);
    let link = found(vec![press(&mut rig, 1500.0)]);
    holds(link.stiffness.as_ref(), 1500.0, 0.12);
    assert!(link.mass.is_none() && link.friction_force.is_empty());
}

#[test]
fn a_series_of_tilts_becomes_an_entry_of_the_table() {
    let mut rig = Rig::new(5);
    let tilts = ["tilt-00", "tilt-01", "tilt-02"]
        .map(|name| tilt(&mut rig, name, 0.4, 0.33))
        .to_vec();
    let (capture, mut notices) = (capture(tilts), Notices::default());
    let cut = interaction::segment(&capture, &model(), &interaction::Config::default(), &mut notices).expect("cuts");
    let entry = calibrate_friction(&capture, &cut, &Config::default(), &mut notices).expect("slides");
    let table: toml::Value = toml::from_str(&entry).expect("toml");
    let read = |key: &str| table["friction"][0][key].as_float().expect("number");
    assert!((read("static") - 0.4).abs() < 2.0 * read("static_sd"), "{entry}");
    assert!((read("kinetic") - 0.33).abs() < 2.0 * read("kinetic_sd"), "{entry}");
}

#[test]
fn friction_that_was_calibrated_is_what_a_push_of_that_pair_is_read_with() {
    let mut rig = Rig::new(7);
    let of_pair = |interactions: Vec<Interaction>| {
        let mut capture = capture(interactions);
        capture.bodies = vec![BodyPrior {
            name: "box".into(),
            material: Some("ceramic".into()),
            ..BodyPrior::default()
        }];
        capture
    };
    let tilts = ["tilt-00", "tilt-01", "tilt-02"]
        .map(|name| tilt(&mut rig, name, 0.45, 0.4))
        .to_vec();
    let (series, mut notices) = (of_pair(tilts), Notices::default());
    let cut = interaction::segment(&series, &model(), &interaction::Config::default(), &mut notices).expect("cuts");
    let entry = calibrate_friction(&series, &cut, &Config::default(), &mut notices).expect("slides");
    let config = Config {
        materials: materials_from_toml(&entry, std::path::Path::new("own.toml")).expect("an entry"),
        ..Config::default()
    };
    let mass = 0.4;
    let pushed = of_pair(vec![push(&mut rig, "push-00", 0.4 * mass * G, 1.0)]);
    // The built-in table has 0.2 for ceramic on wood: twice the mass.
    let [own, built_in] = [&config, &Config::default()].map(|c| found_in(&pushed, c).mass.expect("a mass"));
    assert!(
        !own.is_measured() && own.confounded.is_some() && own.method.contains("materials-table"),
        "{own:?}"
    );
    let [low, high] = own.ci95.expect("interval");
    assert!(low <= mass && mass <= high && high - low < 0.5 * mass, "{own:?}");
    assert!(built_in.value > 1.4 * own.value, "{built_in:?}");
}

/// A quarter of the readings lost at random, and a stretch of a quarter of a second lost as a whole.
fn spoilt(rig: &mut Rig, mut interaction: Interaction) -> Interaction {
    let mut lost = |time: f64, gap: f64| rig.shake(1.0).x > 0.67 || (gap..gap + 0.25).contains(&time);
    let nowhere = Vector3::repeat(f64::NAN);
    if let Some(stream) = &mut interaction.force {
        for (t, f) in stream.time.iter().zip(&mut stream.force) {
            if lost(*t, 1.1) {
                *f = nowhere;
            }
        }
    }
    for track in interaction.tracks.values_mut() {
        for i in 0..track.len() {
            if lost(track.time[i], 1.5) {
                (track.position[i], track.rotation[i]) = (nowhere.into(), None);
            }
        }
    }
    interaction
}

#[test]
fn lost_readings_leave_the_numbers_within_their_intervals() {
    for seed in 20..24 {
        let mut rig = Rig::new(seed);
        let (mass, mu) = (0.4, 0.3);
        let whole = vec![
            lift(&mut rig, mass),
            push(&mut rig, "push-00", mu * mass * G, 1.0),
            push(&mut rig, "push-01", mu * mass * G, -1.0),
        ];
        let worse = capture(whole.into_iter().map(|i| spoilt(&mut rig, i)).collect());
        let link = found_in(&worse, &Config::default());
        holds(link.mass.as_ref(), mass, 0.05);
        holds(link.friction_force.kinetic.as_ref(), mu * mass * G, 0.15);
        holds(link.friction.kinetic.as_ref(), mu, 0.16);
    }
}

#[test]
fn lifts_of_known_weights_give_the_scale_of_the_sensor_and_with_it_the_mass() {
    let gain = 1.04;
    let reads_too_much = ForceScale {
        gain: 1.0 / gain,
        gain_sd: 0.0,
        range: [1.0, 1.0],
        how: String::new(),
    };
    let mut rig = Rig::new(6);
    let weights = ["lift-00", "lift-01", "lift-02"].map(|name| Interaction {
        name: name.into(),
        ..lift(&mut rig, 0.5)
    });
    let mut known = reads_too_much.applied(&capture(weights.to_vec()));
    known.bodies = vec![BodyPrior {
        name: "box".into(),
        mass: Some(0.5),
        mass_sd: Some(0.0005),
        ..BodyPrior::default()
    }];
    let mut notices = Notices::default();
    let cut = interaction::segment(&known, &model(), &interaction::Config::default(), &mut notices).expect("cuts");
    let scale = calibrate_force(&known, &cut, &Config::default(), &mut notices).expect("a scale");
    assert!(
        (scale.gain - gain).abs() < 3.0 * scale.gain_sd && scale.gain_sd < 0.005,
        "{scale:?}"
    );

    let unknown = reads_too_much.applied(&capture(vec![lift(&mut rig, 0.32)]));
    let config = Config {
        force_scale: Some(scale.clone()),
        ..Config::default()
    };
    let link = found_in(&scale.applied(&unknown), &config);
    holds(link.mass.as_ref(), 0.32, 0.05);
}

/// Hangs level until 1.8 s, is turned by 0.6 rad about x through the grip within 0.4 s, and is held so; torque about the grip.
fn turned_lift(rig: &mut Rig, mass: f64, com: Vector3<f64>) -> Interaction {
    let grip = Vector3::new(0.0, 0.0, 0.02);
    let rise = |t: f64| 0.08 * (t - 0.5).clamp(0.0, 1.0);
    let eased = |s: f64| s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
    let turn = move |t: f64| {
        let angle = 0.6 * eased(((t - 1.8) / 0.4).clamp(0.0, 1.0));
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
    };
    let tool = move |t: f64| Vector3::new(0.0, 0.0, 0.04 + rise(t));
    let mut out = interaction("lift-01", Kind::Lift, finger(true));
    out.tool_path = Some(rig.track(3.4, 500.0, 5e-5, |t| at(0.0, tool(t).z)));
    let pose = |t: f64| Isometry3::from_parts((tool(t) - turn(t) * grip).into(), turn(t));
    out.tracks.insert("box".into(), rig.track(3.4, 120.0, 2e-4, pose));
    let arm = |t: f64| turn(t) * (com - grip);
    let swing = |t: f64| (arm(t + 1e-3) - 2.0 * arm(t) + arm(t - 1e-3)) / 1e-6;
    let spin = |t: f64| (turn(t + 1e-3) * turn(t).inverse()).scaled_axis() / 1e-3;
    let force = move |t: f64| {
        if t > 0.48 {
            mass * (Vector3::z() * G + swing(t))
        } else {
            Vector3::zeros()
        }
    };
    let mut stream = rig.force(3.4, force);
    let torque = |t: &f64| arm(*t).cross(&force(*t)) + 4e-4 * (spin(*t) - spin(*t - 1e-3)) / 1e-3 + rig.shake(1e-3);
    stream.torque = Some(stream.time.iter().map(torque).collect());
    out.force = Some(stream);
    out
}

#[test]
fn a_lift_that_turns_its_grip_tells_the_centre_of_mass_from_where_it_hangs_still() {
    let com = Vector3::new(0.006, 0.004, 0.009);
    for seed in 20..24 {
        let mut rig = Rig::new(seed);
        let link = found(vec![turned_lift(&mut rig, 0.4, com)]);
        let told = link.com.expect("a centre of mass");
        let within = told.ci95.expect("an interval");
        for k in 0..3 {
            assert!(within[k][0] < com[k] && com[k] < within[k][1], "{seed}: {told:?}");
        }
        assert!(within[2][1] - within[2][0] < 5e-3, "{seed}: {told:?}");
    }
}
