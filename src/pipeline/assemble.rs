//! Puts what the stages found together into one twin: bodies of links, meshes by path, provenance.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};

use super::Options;
use crate::base::{Confounded, Estimate, Notices, Pose, Status};
use crate::capture::{Capture, Kind, PoseStream, Touch, first_rest, track_noise};
use crate::stages::articulation::{Articulation, Unproven};
use crate::stages::estimation::{ArcTouch, arc_touches};
use crate::stages::shape::{Shapes, Silhouette, VisualTrack, principal_views};
use crate::twin::{
    AskedTouch, Body, Diagnosis, Experiment, FORMAT, Joint, JointAlternative, JointKind, Link, Model, Provenance,
    Relation, RelationKind, SCENE_MESH, SupportPlane, SurfaceShares, TrackFromImages, Twin,
};

/// What would decide the arcs of the graph that are still open, as experiments.
pub fn open_arcs(capture: &Capture, model: &Model) -> Vec<Experiment> {
    let touches = arc_touches(model, &capture.noise, &[Kind::Lift, Kind::Push, Kind::Pull]);
    let place = |t: &ArcTouch| {
        let [p, d] = [t.touch.start.coords, t.touch.direction].map(|v| format!("[{:.3}, {:.3}, {:.3}]", v.x, v.y, v.z));
        format!("{} (at {p} m, towards {d})", t.why)
    };
    touches
        .into_iter()
        .map(|t| Experiment {
            words: place(&t),
            bits: Some(t.bits),
            parts: t.parts,
            touches: vec![asked(&t.touch)],
        })
        .collect()
}

/// A touch of a rig as the diagnosis asks for one.
fn asked(touch: &Touch) -> AskedTouch {
    AskedTouch {
        kind: touch.kind.name().into(),
        target: touch.target.clone().unwrap_or_default(),
        start: touch.start.into(),
        direction: touch.direction.into(),
        travel: touch.travel,
        speed: touch.speed,
        duration: touch.duration,
        ..AskedTouch::default()
    }
}

/// The name by which files of a link are called: letters, digits, `-`, `_`.
fn file_stem(name: &str) -> String {
    name.chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || c == '-' || c == '_' {
                c
            } else {
                '_'
            }
        })
        .collect()
}

/// One rigid body for every thing that was seen, tracked or known, with its meshes.
pub fn model(capture: &Capture, shapes: Shapes, options: &Options) -> Model {
    let (mut meshes, mut textures) = (BTreeMap::new(), BTreeMap::new());
    let mut bodies = Vec::new();
    for object in shapes.objects {
        let stem = file_stem(&object.name);
        let mut link = Link::new(object.name, object.world_from_link);
        link.seen = Some(object.seen);
        link.superquadric = object.superquadric;
        let path = format!("meshes/{stem}.obj");
        meshes.insert(path.clone(), object.mesh);
        if let Some(texture) = object.texture {
            textures.insert(path.clone(), texture);
        }
        link.mesh = Some(path);
        for (k, part) in object.collision.into_iter().enumerate() {
            let path = format!("meshes/{stem}.collision-{k}.obj");
            meshes.insert(path.clone(), part);
            link.collision.push(path);
        }
        bodies.push(Body::rigid(link));
    }
    for (name, pose) in unseen(capture, &bodies) {
        bodies.push(Body::rigid(Link::new(name, pose)));
    }
    if let Some(scene) = shapes.scene {
        meshes.insert(SCENE_MESH.into(), scene);
    }
    let twin = Twin {
        format: FORMAT.into(),
        name: capture.name.clone(),
        gravity: capture.gravity.into(),
        support: shapes.support.or_else(|| given_support(capture)),
        bodies,
        relations: Vec::new(),
        provenance: Provenance {
            seed: options.seed.0,
            options: options.record(),
            ..Provenance::default()
        },
        effects: Vec::new(),
        notices: Vec::new(),
    };
    Model { twin, meshes, textures }
}

/// Draws the principal views of every link, in the frame of its symmetry; path in the twin's folder and PNG.
pub fn draw_views(model: &mut Model) -> Vec<(String, Vec<u8>)> {
    let mut pictures = Vec::new();
    let against = -Vector3::from(model.twin.gravity);
    let up = model.twin.support.as_ref().map_or(against, |s| Vector3::from(s.normal));
    let up = up.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let ahead = (Vector3::y() - up * up.y)
        .try_normalize(1e-3)
        .unwrap_or_else(|| Vector3::z().cross(&up));
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let Some(mesh) = link.mesh.as_ref().and_then(|path| model.meshes.get(path)) else {
            continue;
        };
        let back = link.pose.rotation.inverse();
        for (view, picture) in principal_views(mesh, back * up, back * ahead, &link.symmetry) {
            if let Some(png) = png(&picture) {
                let path = format!("views/{}.{view}.png", file_stem(&link.name));
                link.principal_views.push(path.clone());
                pictures.push((path, png));
            }
        }
    }
    pictures
}

/// A silhouette as an 8-bit grey PNG.
fn png(picture: &Silhouette) -> Option<Vec<u8>> {
    let (width, height) = (picture.width as u32, picture.height as u32);
    let image = image::GrayImage::from_raw(width, height, picture.mask.clone())?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).ok()?;
    Some(bytes.into_inner())
}

fn given_support(capture: &Capture) -> Option<SupportPlane> {
    let support = capture.support.as_ref()?;
    Some(SupportPlane {
        point: support.point.coords.into(),
        normal: support.normal.into_inner().into(),
        material: support.material.clone(),
        gravity: None,
    })
}

/// Tracked or known things that no view showed, with the first pose that is known of them.
fn unseen(capture: &Capture, seen: &[Body]) -> Vec<(String, Pose)> {
    let mut found: Vec<(String, Pose)> = Vec::new();
    let known = |found: &[(String, Pose)], name: &str| {
        seen.iter().any(|b| b.name == name) || found.iter().any(|(n, _)| n == name)
    };
    for interaction in &capture.interactions {
        for (name, track) in &interaction.tracks {
            if !known(&found, name) {
                found.push((name.clone(), rest_pose(capture, name, track)));
            }
        }
    }
    for prior in &capture.bodies {
        if !known(&found, &prior.name) {
            found.push((prior.name.clone(), prior.world_from_body.unwrap_or_else(Pose::identity)));
        }
    }
    found
}

/// Seconds at the start of a track over which its pose is averaged.
const REST: f64 = 0.25;

/// The mean of the first poses of a track; the first alone where it moves at once.
fn rest_pose(capture: &Capture, name: &str, track: &PoseStream) -> Pose {
    let first = first_pose(track);
    let noise = track_noise(capture, name);
    let rests = |mean: &nalgebra::Isometry3<f64>| {
        (mean.translation.vector - first.translation.vector).norm() < 3.0 * noise.position
            && mean.rotation.angle_to(&first.rotation) < 3.0 * noise.rotation
    };
    let oriented = track.rotation.first().is_some_and(Option::is_some);
    let mean = first_rest(track, REST).map(|(mean, _)| mean);
    mean.filter(|mean| oriented && rests(mean)).map_or(first, Pose)
}

/// The first pose of a track, upright where it lacks orientation.
fn first_pose(track: &PoseStream) -> Pose {
    (0..track.len()).find_map(|i| track.pose(i)).unwrap_or_else(|| {
        let position = track.position.iter().find(|p| p.coords.iter().all(|x| x.is_finite()));
        Pose(nalgebra::Isometry3::translation(
            position.map_or(0.0, |p| p.x),
            position.map_or(0.0, |p| p.y),
            position.map_or(0.0, |p| p.z),
        ))
    })
}

/// Writes how much of each mesh was seen, mirrored and closed; to be called once the meshes are final.
pub fn share_surfaces(model: &mut Model) {
    let meshes = &model.meshes;
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let Some(mesh) = link.mesh.as_ref().and_then(|path| meshes.get(path)) else {
            continue;
        };
        let [seen, mirrored, closed] = mesh.origin_shares();
        link.seen = Some(seen);
        link.surface = Some(SurfaceShares { seen, mirrored, closed });
    }
}

/// Makes one body of the links that joints hold together; it carries the name of its root.
pub fn join(model: &mut Model, found: Articulation) {
    for name in found.world_links {
        if model.twin.link(&name).is_none() {
            model.twin.bodies.push(Body::rigid(Link::new(name, Pose::identity())));
        }
    }
    for joint in found.joints {
        merge(&mut model.twin, joint);
    }
}

/// From this probability of a joint on the force that a push felt is not put down to the support.
const PERHAPS_HELD: f64 = 0.3;

/// Pairs that moved as if a joint held them: that they merely rest is the less likely, and what was felt may be the joint's.
pub fn doubt(model: &mut Model, unproven: &[Unproven]) {
    for pair in unproven {
        let of_it = |r: &&mut Relation| {
            let names = (r.a.as_str(), r.b.as_str());
            let (parent, child) = (pair.parent.as_str(), pair.child.as_str());
            let loose = matches!(r.kind, RelationKind::Resting | RelationKind::Separate);
            loose && (names == (parent, child) || names == (child, parent))
        };
        let relations = model.twin.relations.iter_mut();
        relations.filter(of_it).for_each(|r| r.probability *= 1.0 - pair.share);
        let Some(link) = model.twin.link_mut(&pair.child).filter(|_| pair.share > PERHAPS_HELD) else {
            continue;
        };
        let forces = [&mut link.friction_force.kinetic, &mut link.friction_force.static_];
        let coefficients = [&mut link.friction.kinetic, &mut link.friction.static_];
        for value in forces.into_iter().chain(coefficients).flatten() {
            value.status = Status::Assumed;
            value.confounded = Some(Confounded {
                with: vec![format!("joint({}, {})", pair.parent, pair.child)],
                known: "the force that moves it".into(),
                experiment: format!("pull {} off its path, or lift it off {}", pair.child, pair.parent),
            });
        }
    }
}

fn merge(twin: &mut Twin, joint: Joint) {
    let find = |twin: &Twin, link: &str| twin.bodies.iter().position(|b| b.links.iter().any(|l| l.name == link));
    let (Some(parent), Some(child)) = (find(twin, &joint.parent), find(twin, &joint.child)) else {
        return;
    };
    if parent == child {
        return;
    }
    let moved = twin.bodies.remove(child);
    let parent = if child < parent { parent - 1 } else { parent };
    let body = &mut twin.bodies[parent];
    body.links.extend(moved.links);
    body.joints.push(joint);
    body.joints.extend(moved.joints);
}

/// Things that the relations pass found held fast to each other move as one tree: a fixed joint.
pub fn weld(model: &mut Model) {
    let fixed: Vec<Relation> = model
        .twin
        .relations
        .iter()
        .filter(|r| r.kind == RelationKind::Fixed && r.breakaway.is_none())
        .cloned()
        .collect();
    for relation in fixed {
        let Some(child) = model.twin.link(&relation.b) else {
            continue;
        };
        let origin = child.pose.translation.vector.into();
        merge(
            &mut model.twin,
            Joint {
                name: format!("{}_{}", relation.a, relation.b),
                kind: JointKind::Fixed,
                parent: relation.a.clone(),
                child: relation.b.clone(),
                probability: relation.probability,
                alternatives: Vec::<JointAlternative>::new(),
                axis: Estimate::known([0.0, 0.0, 1.0], None, "1"),
                origin: Estimate::known(origin, None, "m"),
                pitch: None,
                limits: None,
                travelled: None,
                position: None,
                friction: None,
                damping: None,
                stiffness: None,
                rest: None,
                effort: None,
                effects: crate::twin::JointEffects::default(),
                lateral: None,
            },
        );
    }
}

/// Where pushes showed that gravity pulls things along the table, the twin says so: whether the table leans or gravity
/// points elsewhere is the same to things on it, and it is what the exports carry.
pub fn lean(model: &mut Model, diagnosis: &Diagnosis) {
    let same = |cause: &str| ["support-tilt", "gravity-error"].contains(&cause);
    let shown = diagnosis.findings.iter().find_map(|f| {
        let own = if same(&f.cause) { f.probability } else { 0.0 };
        let others = f.alternatives.iter().filter(|a| same(&a.cause));
        let sure = own + others.map(|a| a.probability).sum::<f64>() > 0.5;
        sure.then(|| Some([f.parameters.get("tx")?, f.parameters.get("ty")?]))
            .flatten()
    });
    let gravity = Vector3::from(model.twin.gravity);
    let (Some([tx, ty]), Some(support)) = (shown, model.twin.support.as_mut()) else {
        return;
    };
    let normal = Vector3::from(support.normal);
    // The axes in which the slope is told: world x and y, turned as z is turned to the normal.
    let Some(world_from_plane) = UnitQuaternion::rotation_between(&Vector3::z(), &normal) else {
        return;
    };
    let load = -gravity.dot(&normal);
    // A tool has to bring up the load times the slope, so gravity pulls the other way.
    let felt = gravity - world_from_plane * Vector3::new(tx.value, ty.value, 0.0) * load;
    let felt = felt.normalize() * gravity.norm();
    let along = |e: &Estimate, axis: Vector3<f64>| (world_from_plane * axis).abs() * (load * e.sd.unwrap_or(0.0));
    let sd = (along(tx, Vector3::x()).map(|v| v * v) + along(ty, Vector3::y()).map(|v| v * v)).map(f64::sqrt);
    let from = tx.from.clone();
    support.gravity = Some(Estimate::measured(
        felt.into(),
        sd.into(),
        "m/s^2",
        from,
        "diagnosis: slope",
    ));
}

/// Writes down which tracks were made from images.
pub fn tracks(model: &mut Model, tracks: &[VisualTrack]) {
    let row = |track: &VisualTrack| TrackFromImages {
        interaction: track.interaction.clone(),
        link: track.body.clone(),
        images: track.covariance.len(),
        lost: track.covariance.iter().filter(|c| c.is_none()).count(),
        unseen: track.unseen,
        position_sd: track.spread().map(|s| s[0]),
        rotation_sd: track.spread().map(|s| s[1]),
    };
    model.twin.provenance.tracks_from_images = tracks.iter().map(row).collect();
}

/// Writes down how the twin was made and what was doubted on the way.
pub fn record(model: &mut Model, capture: &Capture, options: &Options, laps: &[(&'static str, f64)], notices: Notices) {
    let provenance = &mut model.twin.provenance;
    provenance.version = env!("CARGO_PKG_VERSION").into();
    provenance.capture_digest = capture.digest.clone();
    provenance.seconds = laps
        .iter()
        .map(|(pass, seconds)| ((*pass).into(), options.timings.then_some(*seconds)))
        .collect();
    model.twin.notices = notices.0;
}
