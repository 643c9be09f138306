//! Models drawn from what a twin knows scatter as its intervals say, and somebody else's model comes in as a twin.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use nalgebra::Matrix3;
use palpate::base::{Estimate, Pose, Seed, StagedFolder};
use palpate::export::{Trust, adopt, export_all, variant};
use palpate::geometry::solids::cuboid;
use palpate::stages::diagnosis::Diagnosed;
use palpate::twin::{
    Body, FORMAT, Joint, JointKind, Link, Model, Provenance, SupportPlane, Twin, read_twin, write_twin,
};

#[allow(dead_code, reason = "not every test uses all of it")]
#[path = "common/python.rs"]
mod python;

const DRAWS: usize = 2000;

fn measured(value: f64, sd: f64, unit: &str) -> Option<Estimate> {
    Some(Estimate::measured(value, sd, unit, vec!["push".into()], "test"))
}

/// A box with a lid on a hinge; mass and friction are known less well than their product.
fn model() -> Model {
    let mut meshes = BTreeMap::new();
    let mut link = |name: &str, pose: [f64; 7], edges: [f64; 3]| {
        let mut link = Link::new(name, Pose::from_seven(pose));
        let path = format!("meshes/{name}.obj");
        meshes.insert(path.clone(), cuboid(edges));
        link.mesh = Some(path.clone());
        link.collision = vec![path];
        link
    };
    let mut chest = link("box", [0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 1.0], [0.2, 0.1, 0.1]);
    chest.mass = measured(0.5, 0.06, "kg").map(|e| e.with_interval([0.4, 0.65]));
    chest.com = Some(Estimate::measured(
        [0.01, 0.0, 0.0],
        [0.005; 3],
        "m",
        Vec::new(),
        "test",
    ));
    let inertia = [8.3e-4, 2.1e-3, 2.1e-3, 0.0, 0.0, 0.0];
    let sd = [2e-4, 5e-4, 5e-4, 1e-5, 1e-5, 1e-5];
    chest.inertia = Some(Estimate::measured(inertia, sd, "kg·m²", Vec::new(), "test"));
    chest.friction.kinetic = measured(0.3, 0.04, "1");
    chest.friction.static_ = measured(0.33, 0.04, "1");
    chest.friction_force.kinetic = measured(0.5 * 0.3 * 9.80665, 0.03, "N");
    let lid = link("lid", [0.0, 0.0, 0.105, 0.0, 0.0, 0.0, 1.0], [0.2, 0.1, 0.01]);
    let hinge = Joint {
        name: "hinge".into(),
        kind: JointKind::Revolute,
        parent: "box".into(),
        child: "lid".into(),
        probability: 0.99,
        alternatives: Vec::new(),
        axis: Estimate::measured([1.0, 0.0, 0.0], [0.02; 3], "1", Vec::new(), "test"),
        origin: Estimate::measured([0.0, 0.05, 0.1], [0.001; 3], "m", Vec::new(), "test"),
        pitch: None,
        limits: Some(Estimate::measured([-0.1, 0.1], [0.1; 2], "rad", Vec::new(), "test")),
        travelled: None,
        position: None,
        friction: measured(0.01, 0.02, "N·m"),
        damping: None,
        stiffness: None,
        rest: None,
        effort: None,
        effects: palpate::twin::JointEffects::default(),
        lateral: None,
    };
    let twin = Twin {
        format: FORMAT.into(),
        name: "chest".into(),
        gravity: [0.0, 0.0, -9.80665],
        support: Some(SupportPlane {
            point: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            material: None,
            gravity: None,
        }),
        bodies: vec![Body {
            name: "box".into(),
            links: vec![chest, lid],
            joints: vec![hinge],
        }],
        relations: Vec::new(),
        provenance: Provenance::default(),
        effects: Vec::new(),
        notices: Vec::new(),
    };
    Model {
        twin,
        meshes,
        textures: BTreeMap::new(),
    }
}

fn share(values: &[f64], holds: impl Fn(f64) -> bool) -> f64 {
    values.iter().filter(|v| holds(**v)).count() as f64 / values.len() as f64
}

fn log_spread(values: &[f64]) -> f64 {
    let logs: Vec<f64> = values.iter().map(|v| v.ln()).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt()
}

#[test]
fn draws_scatter_as_the_intervals_say() {
    let model = model();
    let drawn: Vec<_> = (0..DRAWS).map(|k| variant(&model, Seed(3), k).1).collect();
    let link = |k: usize| &drawn[k].links["box"];
    let mass: Vec<f64> = (0..DRAWS).map(|k| link(k).mass.expect("a mass")).collect();
    // Each tail holds 2.5 % by right; its standard error here is 0.35 %.
    for tail in [share(&mass, |m| m < 0.4), share(&mass, |m| m > 0.65)] {
        assert!((0.014..0.036).contains(&tail), "{tail}");
    }
    let half = share(&mass, |m| m < 0.5);
    assert!((0.46..0.54).contains(&half), "{half}");
    let force: Vec<f64> = (0..DRAWS)
        .map(|k| mass[k] * link(k).friction_kinetic.expect("friction"))
        .collect();
    let wanted = 0.03 / (0.5 * 0.3 * 9.80665);
    let found = log_spread(&force);
    assert!(
        log_spread(&mass) > 4.0 * wanted,
        "the mass is known less well than the product"
    );
    assert!((found / wanted - 1.0).abs() < 0.15, "{found} for {wanted}");
}

#[test]
fn draws_are_physical_and_seeded() {
    let model = model();
    for k in 0..300 {
        let (twin, drawn) = variant(&model, Seed(5), k);
        let link = &drawn.links["box"];
        assert!(link.mass.expect("a mass") > 0.0);
        assert!(link.friction_static >= link.friction_kinetic);
        let [xx, yy, zz, xy, xz, yz] = link.inertia.expect("an inertia");
        let moments = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).symmetric_eigenvalues();
        let largest = moments.max();
        assert!(
            moments.min() > 0.0 && 2.0 * largest <= moments.sum() * (1.0 + 1e-9),
            "{moments}"
        );
        let joint = &drawn.joints["hinge"];
        let [low, high] = joint.limits.expect("ends");
        assert!(low <= high && joint.friction.expect("friction") >= 0.0);
        let size: f64 = joint.axis.iter().map(|v| v * v).sum();
        assert!((size - 1.0).abs() < 1e-12);
        twin.twin.sanity_check().expect("it makes sense");
    }
    assert_eq!(variant(&model, Seed(5), 7).1, variant(&model, Seed(5), 7).1);
    assert_ne!(variant(&model, Seed(5), 7).1.links, variant(&model, Seed(5), 8).1.links);
    assert_ne!(variant(&model, Seed(5), 7).1.links, variant(&model, Seed(6), 7).1.links);
}

fn palpate(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path of text")
}

fn written(folder: &Path) -> std::path::PathBuf {
    let twin = folder.join("twin");
    let staged = StagedFolder::create(&twin, "twin.json").expect("staged");
    write_twin(&staged, &model(), &Diagnosed::skipped().diagnosis).expect("written");
    export_all(&model(), &staged).expect("exported");
    staged.commit().expect("committed");
    twin
}

#[test]
fn variants_are_files_that_a_simulator_takes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let twin = written(folder.path());
    let words = [
        "export",
        text(&twin),
        "--to",
        "mjcf,urdf",
        "--variants",
        "3",
        "--seed",
        "9",
        "-q",
    ];
    let bytes = || {
        assert!(palpate(&words).status.success());
        let read = |k: usize, name: &str| std::fs::read(twin.join(format!("variants/00{k}/{name}"))).expect("read");
        (0..3)
            .map(|k| (read(k, "scene.xml"), read(k, "draw.json")))
            .collect::<Vec<_>>()
    };
    let first = bytes();
    assert_eq!(first, bytes());
    assert_ne!(first[0], first[1]);
    if let Some(python) = python::python_with("mujoco") {
        let script = "import sys, json, mujoco\nfor k in range(3):\n    d = f'{sys.argv[1]}/variants/00{k}'\n    m = \
                      mujoco.MjModel.from_xml_path(d + '/scene.xml')\n    u = mujoco.MjModel.from_xml_path(d + \
                      '/urdf/box.urdf')\n    want = json.load(open(d + '/draw.json'))['links']['box']['mass']\n    \
                      assert abs(m.body('box').mass[0] - want) < 1e-9 and abs(u.body('box').mass[0] - want) < 1e-9";
        let said = Command::new(python)
            .args(["-c", script, text(&twin)])
            .output()
            .expect("runs");
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    }
}

#[test]
fn our_own_urdf_comes_back_as_a_twin() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let twin = written(folder.path());
    let out = folder.path().join("again");
    let file = twin.join("urdf/box.urdf");
    let done = palpate(&["import", "twin", text(&file), "--out", text(&out), "-q"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let (back, _) = read_twin(&out).expect("a twin");
    let (want, _) = read_twin(&twin).expect("a twin");
    let (a, b) = (
        back.twin.link("box").expect("a link"),
        want.twin.link("box").expect("a link"),
    );
    let value = |e: &Option<Estimate>| e.as_ref().expect("a number").value;
    assert!((value(&a.mass) - value(&b.mass)).abs() < 1e-9);
    assert!((value(&a.friction.kinetic) - value(&b.friction.kinetic)).abs() < 1e-9);
    assert!(!a.mass.as_ref().expect("a mass").is_measured());
    let (i, j) = (
        a.inertia.as_ref().expect("one").value,
        b.inertia.as_ref().expect("one").value,
    );
    assert!(i.iter().zip(&j).all(|(x, y)| (x - y).abs() < 1e-12), "{i:?} {j:?}");
    assert!((a.pose.translation.vector - b.pose.translation.vector).norm() < 1e-9);
    let joint = back.twin.joints().next().expect("a joint");
    let first = want.twin.joints().next().expect("a joint");
    assert_eq!(joint.kind, JointKind::Revolute);
    assert!((joint.origin.value[1] - first.origin.value[1]).abs() < 1e-9);
    assert!((joint.limits.as_ref().expect("ends").value[1] - 0.1).abs() < 1e-9);
    let checked = palpate(&["check", text(&out), "-q"]);
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stdout));
}

#[test]
fn a_mesh_and_primitives_come_in_and_nonsense_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let urdf = folder.path().join("two.urdf");
    let body = "<robot name='two'><link name='base'><visual><geometry><box size='0.1 0.2 0.04'/></geometry></visual>\
                <inertial><mass value='0.3'/><origin rpy='0 0 1.5707963267948966'/><inertia ixx='1e-3' iyy='2e-3' izz='2e-3' \
                ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
    std::fs::write(&urdf, body).expect("written");
    let model = adopt(&urdf, Trust::Known).expect("a model");
    let link = model.twin.link("base").expect("a link");
    assert!(
        (link.pose.translation.vector.z - 0.02).abs() < 1e-12,
        "it stands on the table"
    );
    // The inertial's own axes are turned by a quarter.
    let inertia = link.inertia.as_ref().expect("one").value;
    assert!((inertia[0] - 2e-3).abs() < 1e-12 && (inertia[1] - 1e-3).abs() < 1e-12);
    assert_eq!(link.collision.len(), 1);

    std::fs::write(
        &urdf,
        body.replace("0.3", "-1")
            .replace("<box size='0.1 0.2 0.04'/>", "<mesh filename='no.obj'/>"),
    )
    .expect("written");
    let out = folder.path().join("out");
    let refused = palpate(&["import", "twin", text(&urdf), "--out", text(&out)]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no.obj") && !out.exists());
}

#[test]
fn trajectories_come_in_as_tracks() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (file, out) = (folder.path().join("door.txt"), folder.path().join("capture"));
    std::fs::write(&file, "# time x y z\n1.0 0 0 0.5 0 0 0 1\n1.5 0.1 0 0.5 0 0 0 1\n").expect("written");
    let done = palpate(&["import", "tum", text(&file), "--out", text(&out), "-q"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let capture = palpate::capture::read_capture(&out).expect("a capture");
    assert_eq!(capture.interactions[0].tracks["door"].time, [1.0, 1.5]);
    std::fs::write(&file, "1.0 0 0 0.5 0 0 0 2\n").expect("written");
    let refused = palpate(&["import", "tum", text(&file), "--out", text(&out)]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("row 1"));
}

/// A user's own URDF beside measured pushes: which of its numbers are wrong, and by how much its predictions are off.
#[test]
fn a_wrong_number_of_a_users_own_urdf_is_told_beside_measured_pushes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let capture = folder.path().join("capture");
    let made = palpate(&["synth", "lab:tiny", "--out", text(&capture), "-q"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let told = |mass: f64| {
        let (urdf, out) = (
            folder.path().join("mine.urdf"),
            folder.path().join(format!("mine-{mass}")),
        );
        let solid = "<geometry><box size='0.08 0.06 0.05'/></geometry>";
        let body = format!(
            "<robot name='mine'><link name='box'><visual>{solid}</visual><collision>{solid}</collision>\
             <contact><lateral_friction value='0.3'/></contact><inertial><mass value='{mass}'/>\
             <inertia ixx='1e-4' iyy='1e-4' izz='1e-4' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>"
        );
        std::fs::write(&urdf, body).expect("written");
        let done = palpate(&["import", "twin", text(&urdf), "--out", text(&out), "-q"]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let words = ["diagnose", text(&capture), "--model", text(&out), "--json"];
        let said: serde_json::Value = serde_json::from_slice(&palpate(&words).stdout).expect("one JSON object");
        assert!(
            said["base"]["rmse"]["force"].is_number(),
            "its pushes are predicted: {said}"
        );
        let numbers = said["numbers"].as_array().expect("a list").clone();
        let mass = numbers
            .iter()
            .find(|n| n["quantity"] == "mass")
            .expect("the lift weighs it")
            .clone();
        (
            mass["outside"].as_bool().expect("yes or no"),
            mass["measured"].as_f64().expect("kg"),
        )
    };
    let (wrong, measured) = told(0.4);
    assert!(wrong, "measured {measured}");
    assert_eq!(told(measured), (false, measured));
}
