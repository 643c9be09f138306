//! A small capture that is sound in every part: two views, a body with a mesh, five interactions.

use std::path::Path;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use palpate::base::Pose;
use palpate::capture::{
    BodyPrior, Camera, Capture, ColorImage, DepthImage, Frames, Interaction, Kind, LabelImage, MeshFile, Noise,
    PoseStream, Support, SupportFriction, Tool, ToolShape, VectorStream, View, WrenchStream, write_capture,
};

const OBJ: &str = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn camera() -> Camera {
    Camera {
        name: "wrist".into(),
        width: 8,
        height: 6,
        fx: 7.5,
        fy: 7.25,
        cx: 3.5,
        cy: 2.5,
        distortion: [0.01, -0.02, 0.001, 0.002, 0.0],
        depth_unit: 0.001,
        depth_min: 0.1,
        depth_max: 3.0,
        depth_sd: Some(0.002),
    }
}

fn pose(x: f64, angle: f64) -> Pose {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    Pose(Isometry3::from_parts(Vector3::new(x, 0.2, 0.05).into(), rotation))
}

fn view(i: u16) -> View {
    View {
        camera: 0,
        time: f64::from(i),
        world_from_camera: pose(0.3, f64::from(i)),
        depth: DepthImage {
            width: 8,
            height: 6,
            counts: (0..48).map(|k| 500 + 3 * k + i).collect(),
        },
        color: Some(ColorImage {
            width: 8,
            height: 6,
            rgb: (0..48).map(|k| [k, 2 * k, 200]).collect(),
        }),
        labels: Some(LabelImage {
            width: 8,
            height: 6,
            ids: (0..48).map(|k| k % 3).collect(),
        }),
    }
}

fn poses(count: usize, dt: f64) -> PoseStream {
    let all: Vec<Pose> = (0..count).map(|i| pose(0.01 * i as f64, 0.05 * i as f64)).collect();
    PoseStream {
        time: (0..count).map(|i| i as f64 * dt).collect(),
        position: all.iter().map(|p| p.translation.vector.into()).collect(),
        rotation: all.iter().map(|p| Some(p.rotation)).collect(),
    }
}

fn wrench(count: usize, torque: bool) -> WrenchStream {
    let vector = |i: usize| Vector3::new(0.1 * i as f64, -0.3, (i as f64).sin());
    WrenchStream {
        time: (0..count).map(|i| i as f64 * 0.002).collect(),
        force: (0..count).map(vector).collect(),
        torque: torque.then(|| (0..count).map(|i| 0.01 * vector(i)).collect()),
    }
}

fn interaction(name: &str, kind: Kind, shape: Option<ToolShape>) -> Interaction {
    Interaction {
        name: name.into(),
        kind,
        action: Some("shove".into()),
        tool_name: None,
        tool: shape.map(|shape| Tool {
            shape,
            grip: kind == Kind::Lift,
            pin: false,
        }),
        target: Some("box".into()),
        force: None,
        tool_path: None,
        support_path: None,
        tracks: Default::default(),
        frames: None,
        held_out: false,
    }
}

fn interactions() -> Vec<Interaction> {
    let mut push = interaction("push-00", Kind::Push, Some(ToolShape::Sphere { radius: 0.01 }));
    push.force = Some(wrench(20, true));
    push.tool_path = Some(poses(20, 0.002));
    push.tracks.insert("box".into(), poses(8, 0.01));
    let mut lift = interaction(
        "lift-00",
        Kind::Lift,
        Some(ToolShape::Box {
            half: Vector3::new(0.01, 0.02, 0.03),
        }),
    );
    lift.force = Some(wrench(12, false));
    lift.tracks.insert("box".into(), poses(2, 0.5));
    let mut tilt = interaction("tilt-00", Kind::Tilt, None);
    let normal = |i: usize| UnitVector3::new_normalize(Vector3::new(0.02 * i as f64, 0.0, 1.0));
    let time = (0..6).map(|i| 0.1 * i as f64).collect();
    tilt.support_path = Some(VectorStream {
        time,
        vector: (0..6).map(normal).collect(),
    });
    let mut only_positions = poses(6, 0.1);
    only_positions.rotation = vec![None; 6];
    only_positions.position[2] = Point3::new(f64::NAN, f64::NAN, f64::NAN);
    tilt.tracks.insert("box/lid".into(), only_positions);
    tilt.held_out = true;
    vec![push, lift, tilt]
}

/// The capture as a value. Its last interaction has frames whose images stand in `images`, see [`write_images`].
pub fn good(images: &Path) -> Capture {
    let mut watch = interaction("watch-00", Kind::Hold, None);
    watch.frames = Some(Frames {
        camera: 0,
        world_from_camera: Some(pose(0.4, 0.3)),
        time: vec![0.0, 0.1],
        depth: vec![images.join("a.png"), images.join("b.png")],
        color: vec![None, Some(images.join("c.png"))],
        taken: Vec::new(),
        poses: None,
    });
    let friction = SupportFriction {
        static_: Some(0.4),
        static_sd: Some(0.02),
        kinetic: Some(0.35),
        kinetic_sd: None,
    };
    let body = BodyPrior {
        name: "box".into(),
        mesh: Some(MeshFile {
            path: "box.obj".into(),
            bytes: OBJ.into(),
        }),
        mass: Some(0.43),
        mass_sd: Some(0.01),
        material: Some("wood".into()),
        world_from_body: Some(pose(0.0, 0.0)),
    };
    Capture {
        root: images.to_path_buf(),
        name: "good".into(),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        support: Some(Support {
            point: Point3::origin(),
            normal: Vector3::z_axis(),
            material: Some("wood".into()),
            friction: Some(friction),
        }),
        cameras: vec![camera()],
        views: vec![view(0), view(1)],
        bodies: vec![body],
        noise: Noise {
            force: Some(0.02),
            ..Noise::default()
        },
        interactions: [interactions(), vec![watch]].concat(),
        truth: Some("truth.json".into()),
        digest: String::new(),
    }
}

/// Writes the images that the frames of [`good`] name: a capture of its own serves as the painter.
pub fn write_images(images: &Path) {
    let mut painter = good(images);
    painter.interactions.truncate(1);
    let folder = images.join("painted");
    write_capture(&painter, &folder).expect("painted");
    for (from, to) in [("000000.depth", "a"), ("000001.depth", "b"), ("000001.color", "c")] {
        std::fs::copy(
            folder.join(format!("views/{from}.png")),
            images.join(format!("{to}.png")),
        )
        .expect("copied");
    }
}

/// Writes the good capture into `folder`.
pub fn write_good(folder: &Path) {
    let images = tempfile::tempdir().expect("a temporary folder");
    write_images(images.path());
    write_capture(&good(images.path()), folder).expect("written");
}
