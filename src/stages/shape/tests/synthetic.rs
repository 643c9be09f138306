//! Made-up things, ray-cast from their exact distance with sensor noise, and what becomes of them.

#[cfg(test)]
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use rand_distr::{Distribution, Normal};

use super::super::*;
use crate::base::{Notices, Pose, Seed, rng_for};
use crate::capture::*;
use crate::geometry::edge_defects;
use crate::twin::{SupportPlane, Symmetry, SymmetryPlane};

type Distance = fn(&Point3<f64>) -> f64;

fn cuboid(p: &Point3<f64>, middle: [f64; 3], half: [f64; 3]) -> f64 {
    let d: Vector3<f64> = (p - Point3::from(middle)).abs() - Vector3::from(half);
    d.sup(&Vector3::zeros()).norm() + d.max().min(0.0)
}

fn cylinder(p: &Point3<f64>, radius: f64, low: f64, high: f64) -> f64 {
    let r = p.x.hypot(p.y) - radius;
    let z = (low - p.z).max(p.z - high);
    r.max(0.0).hypot(z.max(0.0)) + r.max(z).min(0.0)
}

fn box_thing(p: &Point3<f64>) -> f64 {
    cuboid(p, [0.01, -0.02, 0.03], [0.05, 0.04, 0.03])
}

fn ball_thing(p: &Point3<f64>) -> f64 {
    (p - Point3::new(0.0, 0.0, 0.05)).norm() - 0.05
}

fn cup_thing(p: &Point3<f64>) -> f64 {
    cylinder(p, 0.04, 0.0, 0.08).max(-cylinder(p, 0.035, 0.006, 0.2))
}

fn two_things(p: &Point3<f64>) -> f64 {
    lower(p).min(upper(p))
}

fn lower(p: &Point3<f64>) -> f64 {
    cuboid(p, [0.0, 0.0, 0.03], [0.04, 0.04, 0.03])
}

fn upper(p: &Point3<f64>) -> f64 {
    cuboid(p, [0.0, 0.0, 0.08], [0.04, 0.04, 0.02])
}

fn camera(distortion: [f64; 5]) -> Camera {
    Camera {
        name: "made-up".into(),
        width: 320,
        height: 240,
        fx: 300.0,
        fy: 300.0,
        cx: 159.5,
        cy: 119.5,
        distortion,
        depth_unit: 0.0001,
        depth_min: 0.1,
        depth_max: 3.0,
        depth_sd: Some(0.001),
    }
}

/// Sphere tracing of a thing on the plane z = 0, with 1 mm of noise at 1 m.
fn look(camera: &Camera, thing: Distance, from: Point3<f64>, which: usize) -> View {
    let at = Point3::new(0.0, 0.0, 0.03);
    let up = if (at - from).xy().norm() < 0.05 {
        Vector3::y()
    } else {
        Vector3::z()
    };
    let forward = (at - from).normalize();
    let right = forward.cross(&up).normalize();
    let axes = nalgebra::Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    let pose = Isometry3::from_parts(
        from.coords.into(),
        nalgebra::UnitQuaternion::from_rotation_matrix(&axes),
    );
    let mut rng = rng_for(Seed(which as u64), "made-up depth");
    let noise = Normal::new(0.0, 0.001).unwrap();
    let pixels = (0..camera.width * camera.height).map(|i| (i % camera.width, i / camera.width));
    let counts = pixels
        .map(|(u, v)| {
            let (x, y) = super::super::lens::unproject(camera, f64::from(u), f64::from(v));
            let ray = pose.rotation * Vector3::new(x, y, 1.0);
            let length = ray.norm();
            let mut depth = 0.1;
            for _ in 0..120 {
                let p = from + ray * depth;
                let gap = thing(&p).min(p.z);
                depth += gap / length;
                if gap < 1e-5 || depth > 3.0 {
                    break;
                }
            }
            let z = depth + noise.sample(&mut rng) * depth * depth;
            if depth > 2.9 {
                0
            } else {
                (z / camera.depth_unit).round() as u16
            }
        })
        .collect();
    View {
        camera: 0,
        time: which as f64,
        world_from_camera: Pose(pose),
        depth: DepthImage {
            width: camera.width,
            height: camera.height,
            counts,
        },
        color: None,
        labels: None,
    }
}

fn scene(thing: Distance, given: bool, distortion: [f64; 5]) -> Capture {
    let camera = camera(distortion);
    let place = |i: usize| {
        let (elevation, azimuth) = ([0.5_f64, 0.85, 1.2][i % 3], i as f64 * 0.9);
        let flat = 0.6 * elevation.cos();
        Point3::new(flat * azimuth.cos(), flat * azimuth.sin(), 0.03 + 0.6 * elevation.sin())
    };
    let views = (0..15).map(|i| look(&camera, thing, place(i), i)).collect();
    Capture {
        root: "made-up".into(),
        name: "made-up".into(),
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        support: given.then(|| Support {
            point: Point3::origin(),
            normal: UnitVector3::new_normalize(Vector3::z()),
            material: None,
            friction: None,
        }),
        cameras: vec![camera],
        views,
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: Vec::new(),
        truth: None,
        digest: String::new(),
    }
}

/// Closed, one body, mean error of the seen surface within 1 mm; returns the volume.
fn check(capture: &Capture, thing: Distance) -> f64 {
    let mut notices = Notices::default();
    let shapes = reconstruct(capture, &Config::default(), &mut notices).unwrap();
    assert_eq!(shapes.objects.len(), 1, "{:?}", notices.0);
    let object = &shapes.objects[0];
    assert_eq!(object.name, "object-0");
    assert_eq!(edge_defects(&object.mesh), 0);
    let vertices = object
        .mesh
        .vertices
        .iter()
        .zip(&object.mesh.seen)
        .filter(|(_, seen)| **seen);
    let errors: Vec<f64> = vertices
        .map(|(p, _)| thing(&(object.world_from_link.0 * *p)).abs())
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    eprintln!(
        "OUT mean error {:.3} mm, volume {:.2} cm3, seen {:.2}",
        mean * 1e3,
        object.mesh.volume() * 1e6,
        object.seen
    );
    assert!(mean < 0.001, "mean error {mean}");
    object.mesh.volume()
}

#[test]
fn a_box_comes_out_within_two_percent_of_its_volume() {
    let volume = check(&scene(box_thing, true, [0.0; 5]), box_thing);
    assert!((volume / 480e-6 - 1.0).abs() < 0.02, "{volume}");
}

#[test]
fn a_distorting_lens_and_a_hidden_support_change_little() {
    let volume = check(&scene(box_thing, false, [0.08, -0.1, 0.001, -0.001, 0.02]), box_thing);
    assert!((volume / 480e-6 - 1.0).abs() < 0.04, "{volume}");
}

#[test]
fn a_ball_stands_on_what_could_not_be_seen_of_it() {
    let volume = check(&scene(ball_thing, true, [0.0; 5]), ball_thing);
    assert!((0.98..1.15).contains(&(volume / 523.6e-6)), "{volume}");
}

#[test]
fn a_cup_stays_open() {
    let volume = check(&scene(cup_thing, true, [0.0; 5]), cup_thing);
    // The wall and the floor of the cup are 117 cm3, the filled cup is 402 cm3.
    assert!((volume / 117.3e-6 - 1.0).abs() < 0.02, "{volume}");
}

#[test]
fn a_stack_of_one_colour_is_parted_where_the_frames_say() {
    let mut capture = scene(two_things, true, [0.0; 5]);
    capture.bodies = [("a", 0.03), ("b", 0.08)]
        .into_iter()
        .map(|(name, z)| BodyPrior {
            name: name.into(),
            world_from_body: Some(Pose::from_seven([0.0, 0.0, z, 0.0, 0.0, 0.0, 1.0])),
            ..BodyPrior::default()
        })
        .collect();
    let mut notices = Notices::default();
    let shapes = reconstruct(&capture, &Config::default(), &mut notices).unwrap();
    let volumes: Vec<(&str, f64)> = shapes
        .objects
        .iter()
        .map(|o| (o.name.as_str(), o.mesh.volume() * 1e6))
        .collect();
    eprintln!("OUT {volumes:?}");
    assert_eq!(volumes.len(), 2);
    assert!((volumes[0].1 / 384.0 - 1.0).abs() < 0.03 && (volumes[1].1 / 256.0 - 1.0).abs() < 0.03);
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let mut capture = scene(box_thing, false, [0.0; 5]);
    capture.views.truncate(5);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| reconstruct(&capture, &Config::default(), &mut Notices::default()).unwrap())
    };
    let (one, four) = (with(1), with(4));
    assert_eq!(one.objects.len(), four.objects.len());
    for (a, b) in one.objects.iter().zip(&four.objects) {
        assert!(a.mesh == b.mesh && a.world_from_link == b.world_from_link);
    }
}

/// Views from one side only: the far side of a box comes out where the planes say, and is told to be an image.
#[test]
fn a_half_seen_box_is_completed_by_its_symmetry_and_says_so() {
    let mut capture = scene(box_thing, true, [0.0; 5]);
    capture.views.retain(|v| v.world_from_camera.translation.x > 0.05);
    let plane = |normal: [f64; 3], offset: f64| SymmetryPlane {
        normal,
        offset,
        score: 1.0,
        ..SymmetryPlane::default()
    };
    let truth = Symmetry {
        planes: vec![plane([1.0, 0.0, 0.0], 0.01), plane([0.0, 1.0, 0.0], -0.02)],
        ..Symmetry::default()
    };
    let mut notices = Notices::default();
    let plain = reconstruct(&capture, &Config::default(), &mut notices).unwrap().objects;
    let find = |_: &Mesh, _: &Pose, _: Option<&SupportPlane>| Ok(truth.clone());
    let shapes = reconstruct_with(&capture, &Config::default(), &find, &mut notices).unwrap();
    // The hidden face, x = -0.04, but for its rim and for what the support blurs.
    let off = |o: &ShapedObject| {
        let placed = o.mesh.vertices.iter().map(|v| o.world_from_link.0 * v);
        let far: Vec<f64> = placed
            .filter(|p| p.x < -0.03 && (p.y + 0.02).abs() < 0.035 && (0.008..0.055).contains(&p.z))
            .map(|p| box_thing(&p).abs())
            .collect();
        far.iter().sum::<f64>() / far.len() as f64
    };
    let [before, after] = [off(&plain[0]), off(&shapes.objects[0])];
    let [seen, mirrored, closed] = shapes.objects[0].mesh.origin_shares();
    assert_eq!(edge_defects(&shapes.objects[0].mesh), 0);
    assert!(after < 0.7 * before, "{before} {after}");
    // Only that face was hidden: its area, less the rim that the seen faces show and the foot that the layer above it
    // continues, is all that an image may claim.
    let hidden = 0.08 * 0.06 / (2.0 * (0.1 * 0.08 + 0.1 * 0.06 + 0.08 * 0.06));
    eprintln!(
        "OUT hidden {hidden:.3} mirrored {mirrored:.3} seen {seen:.3} closed {closed:.3}; off {before:.5} {after:.5}"
    );
    assert!(mirrored > 0.6 * hidden && mirrored < hidden, "{mirrored} of {hidden}");
    assert!(seen > 0.4 && closed > 0.1, "{seen} {closed}");
    assert!(
        notices
            .0
            .iter()
            .any(|n| n.message.contains("completed by its symmetry"))
    );
}

/// What is fused with noise from views that never showed the foot still comes out as the box and the ball that it is.
#[test]
fn fused_things_have_the_superquadrics_that_they_are() {
    for (thing, half, center, exponents) in [
        (
            box_thing as Distance,
            [0.03, 0.04, 0.05],
            [0.01, -0.02, 0.03],
            [0.1..0.35, 0.1..0.35],
        ),
        (ball_thing, [0.05; 3], [0.0, 0.0, 0.05], [0.85..1.15, 0.85..1.15]),
    ] {
        let mut notices = Notices::default();
        let mut shapes = reconstruct(&scene(thing, true, [0.0; 5]), &Config::default(), &mut notices).unwrap();
        furnish(&mut shapes, &Config::default(), &mut notices);
        let object = &shapes.objects[0];
        let fit = object.superquadric.as_ref().unwrap();
        let at = object.world_from_link.0 * fit.pose.0;
        assert!((at.translation.vector - Vector3::from(center)).norm() < 2e-3, "{fit:?}");
        let mut size = fit.size;
        size.sort_by(f64::total_cmp);
        assert!(size.iter().zip(half).all(|(a, b)| (a - b).abs() < 2e-3), "{fit:?}");
        assert!(
            fit.exponents.iter().zip(exponents).all(|(e, range)| range.contains(e)),
            "{fit:?}"
        );
        assert!(fit.residual.unwrap() < 1e-3, "{fit:?}");
    }
}

fn thin_cup(p: &Point3<f64>) -> f64 {
    cylinder(p, 0.04, 0.0, 0.09).max(-cylinder(p, 0.036, 0.005, 0.2))
}

/// The views of the outside must not push the inside away, nor the other way round.
#[test]
fn a_wall_of_two_voxels_keeps_its_thickness() {
    let mut notices = Notices::default();
    let shapes = reconstruct(&scene(thin_cup, true, [0.0; 5]), &Config::default(), &mut notices).unwrap();
    let volume = 1e6 * shapes.objects[0].mesh.volume();
    let truth = 1e6 * std::f64::consts::PI * (0.04 * 0.04 * 0.09 - 0.036 * 0.036 * 0.085);
    eprintln!("OUT thin cup {volume:.2} of {truth:.2} cm³");
    assert!((volume / truth - 1.0).abs() < 0.03, "{volume} of {truth} cm³");
}
