//! From a capture and a twin to tosses: what is thrown, where its point `O` went, how it and its hinge turned.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::conditions::{Body, Conditions};
use super::fit::Study;
use super::local::Toss;
use super::shape::{carved, of_mesh};
use crate::capture::{Capture, Interaction, Kind, PoseStream};
use crate::stages::estimation::facts::{Ground, ground_of};
use crate::stages::estimation::solid::solid_of;
use crate::twin::{JointKind, Model};

/// Fewest rows of a toss.
const ROWS: usize = 12;
/// Times of two tracks that are the same, s.
const SAME: f64 = 1e-4;

/// What is thrown in a capture.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The link that the orientation is of.
    pub root: String,
    /// The link that hangs on it, and the joint's name.
    pub second: Option<(String, String)>,
    /// `O` in the root's frame.
    pub origin: Point3<f64>,
    /// Its shape was carved from how it lay and fell.
    pub carved: bool,
    /// Its tosses and their windows.
    pub study: Study,
}

/// Where the fit starts.
pub fn start() -> Conditions {
    Conditions::plain(0.3, 0.4)
}

/// Every body of the twin of which tosses are recorded, that can be simulated; with windows in the tosses that were held
/// out, where those are asked for.
pub fn subjects(capture: &Capture, model: &Model, held_out: bool) -> Vec<Subject> {
    let ground = ground_of(capture, &model.twin);
    let of = |body: &crate::twin::Body| match (body.links.as_slice(), body.joints.as_slice()) {
        ([link], _) => rigid(capture, model, &link.name, &ground, held_out),
        ([_, _], [joint]) if joint.kind == JointKind::Revolute => hinged(capture, model, joint, &ground, held_out),
        _ => None,
    };
    model.twin.bodies.iter().filter_map(of).collect()
}

fn tosses<'a>(capture: &'a Capture, link: &'a str) -> impl Iterator<Item = (&'a Interaction, &'a PoseStream)> {
    let all = capture.interactions.iter().filter(|i| i.kind == Kind::Toss);
    all.filter_map(move |i| Some((i, i.tracks.get(link)?)))
}

/// Rows of a track that are whole.
fn rows(track: &PoseStream) -> impl Iterator<Item = (f64, Isometry3<f64>)> + '_ {
    let oriented = (0..track.len()).filter(|i| track.rotation[*i].is_some());
    oriented.filter_map(|i| Some((track.time[i], track.pose(i)?.0)))
}

fn study(body: Body, all: Vec<Toss>, capture: &Capture, held_out: bool) -> Option<Study> {
    let tosses: Vec<Toss> = all.into_iter().filter(|t| t.time.len() >= ROWS).collect();
    let noise = [capture.noise.position, capture.noise.rotation];
    let study = Study::new(body, tosses, &start(), noise, held_out);
    (!study.windows.is_empty()).then_some(study)
}

/// Poses of a link in all tosses that may be used to fit.
fn fitted_poses<'a>(capture: &'a Capture, link: &'a str) -> impl Iterator<Item = Isometry3<f64>> + 'a {
    let fitted = tosses(capture, link).filter(|(i, _)| !i.held_out);
    fitted.flat_map(|(_, track)| rows(track).map(|r| r.1))
}

fn body_of(root: super::conditions::Solid, ground: &Ground) -> Body {
    let normal = Unit::new_normalize(ground.plane.normal);
    Body {
        root,
        second: None,
        normal,
        height: normal.dot(&ground.point.coords),
        gravity: ground.gravity,
    }
}

fn rigid(capture: &Capture, model: &Model, link: &str, ground: &Ground, held_out: bool) -> Option<Subject> {
    tosses(capture, link).next()?;
    let path = model.twin.link(link)?.mesh.as_ref();
    let mesh = path.and_then(|p| model.meshes.get(p));
    let height = ground.plane.normal.dot(&ground.point.coords);
    let (solid, origin) = match mesh {
        Some(mesh) => {
            let origin = solid_of(mesh)?.centroid;
            (of_mesh(mesh, &origin)?, origin)
        }
        None => {
            let poses = fitted_poses(capture, link);
            let mut solid = carved(poses, &ground.plane.normal, height, &Point3::origin())?;
            let origin = Point3::from(solid.centre);
            solid.corners.iter_mut().for_each(|c| *c -= origin.coords);
            solid.centre = Vector3::zeros();
            (solid, origin)
        }
    };
    let one = |(i, track): (&Interaction, &PoseStream)| {
        let (time, poses): (Vec<f64>, Vec<Isometry3<f64>>) = rows(track).unzip();
        Toss {
            name: i.name.clone(),
            held_out: i.held_out,
            place: poses.iter().map(|p| (p * origin).coords).collect(),
            turn: poses.iter().map(|p| p.rotation).collect(),
            angle: vec![0.0; time.len()],
            time,
        }
    };
    let all = tosses(capture, link).map(one).collect();
    Some(Subject {
        root: link.into(),
        second: None,
        origin,
        carved: mesh.is_none(),
        study: study(body_of(solid, ground), all, capture, held_out)?,
    })
}

fn hinged(
    capture: &Capture,
    model: &Model,
    joint: &crate::twin::Joint,
    ground: &Ground,
    held_out: bool,
) -> Option<Subject> {
    let (root, second) = (joint.parent.as_str(), joint.child.as_str());
    let stands = model.twin.link(root)?.pose.0;
    let origin = stands.inverse() * Point3::from(joint.origin.value);
    let axis = Unit::new_normalize(stands.rotation.inverse() * Vector3::from(joint.axis.value));
    let (_, first) = tosses(capture, root).find(|(i, _)| i.tracks.contains_key(second))?;
    let start = rows(first).next()?.1;
    let other = tosses(capture, second).find_map(|(_, t)| rows(t).next())?.1;
    let zero = start.rotation.inverse() * other.rotation;
    let own = other.inverse() * (start * origin);
    let solid = |name: &str, at: &Point3<f64>| {
        let path = model.twin.link(name)?.mesh.as_ref();
        match path.and_then(|p| model.meshes.get(p)) {
            Some(mesh) => of_mesh(mesh, at),
            None => {
                let height = ground.plane.normal.dot(&ground.point.coords);
                carved(fitted_poses(capture, name), &ground.plane.normal, height, at)
            }
        }
    };
    let mut body = body_of(solid(root, &origin)?, ground);
    body.second = Some((solid(second, &own)?, axis, zero));
    let all = tosses(capture, root).filter_map(|(i, track)| {
        let second: Vec<(f64, Isometry3<f64>)> = rows(i.tracks.get(second)?).collect();
        let pairs = rows(track).filter_map(|(t, pose)| {
            let k = second.partition_point(|r| r.0 < t - SAME);
            let (_, other) = second.get(k).filter(|r| (r.0 - t).abs() < SAME)?;
            Some((t, pose, pose.rotation.inverse() * other.rotation * zero.inverse()))
        });
        Some(toss_of(i, pairs.collect(), &origin, &axis))
    });
    let all = all.collect();
    let shapeless = |name: &str| model.twin.link(name).is_none_or(|l| l.mesh.is_none());
    Some(Subject {
        root: root.into(),
        second: Some((second.into(), joint.name.clone())),
        origin,
        carved: shapeless(root) || shapeless(second),
        study: study(body, all, capture, held_out)?,
    })
}

/// Time, pose of the root and turn of the second link against it, row by row.
type Row = (f64, Isometry3<f64>, UnitQuaternion<f64>);

fn toss_of(interaction: &Interaction, pairs: Vec<Row>, origin: &Point3<f64>, axis: &Unit<Vector3<f64>>) -> Toss {
    let mut angle: Vec<f64> = Vec::with_capacity(pairs.len());
    for (_, _, turn) in &pairs {
        let raw = turn.scaled_axis().dot(axis);
        let turns = angle
            .last()
            .map_or(0.0, |last| ((last - raw) / std::f64::consts::TAU).round());
        angle.push(raw + turns * std::f64::consts::TAU);
    }
    Toss {
        name: interaction.name.clone(),
        held_out: interaction.held_out,
        time: pairs.iter().map(|p| p.0).collect(),
        place: pairs.iter().map(|p| (p.1 * origin).coords).collect(),
        turn: pairs.iter().map(|p| p.1.rotation).collect(),
        angle,
    }
}
