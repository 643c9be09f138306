//! Lifts: what comes along, what that weighs, and where it goes.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};

use super::predict::{Outcome, Scene};
use super::trace::Predicted;
use super::{Curve, Path, Quantity};
use crate::base::Pose;
use crate::capture::PoseStream;
use crate::geometry::Mesh;
use crate::math::{interpolate, local_quadratic, median};
use crate::physics::{Action, predict_lift};
use crate::stages::estimation::{first_rest, rest_pose, support_normal};
use crate::twin::{Relation, RelationKind};

/// The links that the twin says come along when one is lifted: those of its body, and what rests on any of them where the lift begins.
fn comes_along(scene: &Scene, target: &str) -> Vec<String> {
    let twin = &scene.model.twin;
    let body = twin.body_of(target);
    let mut along: Vec<String> = body.map_or_else(
        || vec![target.to_owned()],
        |b| b.links.iter().map(|l| l.name.clone()).collect(),
    );
    let rests = |a: &str, b: &str| {
        let pair = |r: &&Relation| (r.a == a && r.b == b) || (r.a == b && r.b == a);
        twin.relations
            .iter()
            .any(|r| r.kind == RelationKind::Resting && pair(&r))
    };
    let mut next = 0;
    while next < along.len() {
        let below = along[next].clone();
        let above = twin.links().map(|(_, l)| &l.name);
        let above: Vec<String> = above
            .filter(|n| !along.contains(n) && rests(&below, n) && stands_on(scene, &below, n))
            .cloned()
            .collect();
        along.extend(above);
        next += 1;
    }
    along
}

/// Whether, where the interaction begins, the middle of one thing is above another's and within its outline's reach.
fn stands_on(scene: &Scene, below: &str, above: &str) -> bool {
    let up = support_normal(scene.capture, scene.model);
    let rest = first_rest(scene.interaction, scene.segmented);
    let surface = |name: &str| -> Option<Mesh> {
        let link = scene.model.twin.link(name)?;
        let track = scene.interaction.tracks.get(name);
        let pose = track.and_then(|t| rest_pose(t, rest)).unwrap_or(link.pose);
        Some(scene.model.meshes.get(link.mesh.as_ref()?)?.transformed(&pose.0))
    };
    let (Some(low), Some(high)) = (surface(below), surface(above)) else {
        return false;
    };
    let middle = |mesh: &Mesh| {
        let sum: Vector3<f64> = mesh.vertices.iter().map(|v| v.coords).sum();
        sum / mesh.vertices.len().max(1) as f64
    };
    let (under, over) = (middle(&low), middle(&high));
    let across = |v: Vector3<f64>| v - up.into_inner() * v.dot(&up);
    let reach = low
        .vertices
        .iter()
        .map(|v| across(v.coords - under).norm())
        .fold(0.0, f64::max);
    (over - under).dot(&up) > 0.0 && across(over - under).norm() < reach
}

/// The force upwards of what is lifted, with all that comes along, and where everything goes.
pub fn lift(scene: &Scene, action: &Action) -> Outcome {
    let along = comes_along(scene, &action.target);
    let mass = |name: &String| Some(scene.model.twin.link(name)?.mass.as_ref()?.value);
    let masses: Option<Vec<f64>> = along.iter().map(mass).collect();
    let total: f64 = masses.ok_or("the mass of what is lifted is not known")?.iter().sum();
    let gravity = scene.capture.gravity;
    let up = support_normal(scene.capture, scene.model);
    let (time, force, noise) = scene.binned_force(0.01).ok_or("there is no force")?;
    let height: Vec<f64> = action.tool.position.iter().map(|p| p.coords.dot(&up)).collect();
    let ground = ground_of(&height);
    let raised: Vec<f64> = time
        .iter()
        .map(|t| interpolate(&action.tool.time, &height, *t).unwrap_or(f64::NAN) - ground)
        .collect();
    let link = scene
        .model
        .twin
        .link(&action.target)
        .ok_or("the lifted link is not in the twin")?;
    // The weight, and what speeds it up.
    let speeding = |t: f64| Some(local_quadratic(&action.tool.time, &height, t, SPEEDING)?.acceleration);
    let weight = predict_lift(link, &action.start[&action.target], &action.tool.position[0], &gravity)
        .map_or(-gravity * total, |(f, _)| {
            f * (total / mass(&action.target).unwrap_or(total))
        });
    // Where the tool starts or stops the force is a blow; on its way down it may set what it holds on something else.
    let highest = |k: &usize| raised[*k];
    let top = (0..raised.len()).filter(|k| raised[*k].is_finite());
    let top = top.max_by(|a, b| highest(a).total_cmp(&highest(b)));
    let held = top.map_or(f64::INFINITY, |k| HELD * raised[k]);
    let down = top.and_then(|top| (top..raised.len()).find(|k| raised[*k] < held));
    let down = down.map_or(f64::INFINITY, |k| time[k]);
    let predicted = raised.iter().zip(&time).map(|(h, t)| {
        let acceleration = speeding(*t).filter(|a| *h > 0.004 && a.abs() < BLOW && *t < down);
        acceleration.map_or(f64::NAN, |a| weight.dot(&up) + total * a)
    });
    let predicted: Vec<f64> = predicted.collect();
    // What is not known of the masses.
    let unsure = |name: &String| scene.model.twin.link(name)?.mass.as_ref()?.sd;
    let share = along.iter().filter_map(unsure).map(|sd| sd * sd).sum::<f64>().sqrt() / total.max(1e-9);
    let doubt = predicted.iter().map(|p| share * p.abs()).collect();
    let mut curves = vec![Curve {
        label: "force upwards".into(),
        quantity: Quantity::Force,
        time,
        measured: force.iter().map(|f| f.dot(&up)).collect(),
        predicted,
        noise,
    }];
    curves.extend(raised_curves(scene, action, (&height, ground), &along));
    Ok(Predicted {
        curves,
        doubt: vec![doubt],
        paths: raised_paths(scene, action, (&height, ground), &along),
        ..Predicted::default()
    })
}

/// Heights above the lowest that are those of the tool before it rises, m.
const NEAR: f64 = 1e-3;

/// The height from which a tool raises what it holds: its lowest before it is highest, however soon that is.
fn ground_of(height: &[f64]) -> f64 {
    let seen = |of: &[f64]| -> Vec<f64> { of.iter().copied().filter(|h| h.is_finite()).collect() };
    let top = (0..height.len()).filter(|k| height[*k].is_finite());
    let top = top.max_by(|a, b| height[*a].total_cmp(&height[*b]));
    let before = seen(&height[..top.map_or(0, |top| top + 1)]);
    let lowest = before.iter().copied().fold(f64::INFINITY, f64::min);
    let near: Vec<f64> = before.into_iter().filter(|h| *h < lowest + NEAR).collect();
    median(&near).unwrap_or(0.0)
}

/// Half the span over which a tool's acceleration is taken, s, and the acceleration from which it starts or stops, m/s².
const SPEEDING: f64 = 0.08;
const BLOW: f64 = 0.3;
/// Share of its rise below which what is let down may have met something.
const HELD: f64 = 0.5;

/// A grip that turns what it holds.
struct Grip<'a> {
    path: &'a PoseStream,
    /// Orientation and place of the tool as it began.
    first: UnitQuaternion<f64>,
    from: Vector3<f64>,
}

impl<'a> Grip<'a> {
    /// Nothing where the tool does not grip, or its orientation is not known.
    fn of(scene: &Scene<'a>) -> Option<Self> {
        scene.interaction.tool.as_ref().filter(|t| t.grip)?;
        Self::along(scene.interaction.tool_path.as_ref()?)
    }

    fn along(path: &'a PoseStream) -> Option<Self> {
        let (from, first) = path.sample(*path.time.first()?)?;
        let first = first?;
        Some(Self { path, first, from })
    }

    /// Turn of the tool since it began; none where its orientation is not known, and past the ends of its path as at them.
    fn turned(&self, t: f64) -> UnitQuaternion<f64> {
        let ends = self.path.time.first().zip(self.path.time.last());
        let at = ends.and_then(|(start, end)| self.path.sample(t.clamp(*start, *end))?.1);
        at.map_or_else(UnitQuaternion::identity, |q| q * self.first.inverse())
    }

    /// How far what began at `at` is moved by turning alone, m.
    fn swung(&self, t: f64, at: &Vector3<f64>) -> Vector3<f64> {
        let arm = at - self.from;
        self.turned(t) * arm - arm
    }
}

/// The same as poses.
fn raised_paths(
    scene: &Scene,
    action: &Action,
    (height, ground): (&[f64], f64),
    along: &[String],
) -> BTreeMap<String, Path> {
    let up = support_normal(scene.capture, scene.model);
    let rest = first_rest(scene.interaction, scene.segmented);
    let grip = Grip::of(scene);
    let of = |(name, track): (&String, &PoseStream)| {
        let start = rest_pose(track, rest)?;
        let raised = |(h, t): (&f64, &f64)| {
            let mut pose = start;
            if along.contains(name) {
                let swung = grip
                    .as_ref()
                    .map(|g| (g.swung(*t, &start.translation.vector), g.turned(*t)));
                let (aside, turned) = swung.unwrap_or_default();
                pose.0.translation.vector += aside + up.into_inner() * (h - ground).max(0.0);
                pose.0.rotation = turned * start.rotation;
            }
            pose
        };
        let path = Path {
            time: action.tool.time.clone(),
            poses: height.iter().zip(&action.tool.time).map(raised).collect(),
        };
        Some((name.clone(), path))
    };
    scene.interaction.tracks.iter().filter_map(of).collect()
}

/// What comes along rises with the tool, everything else stays.
fn raised_curves(scene: &Scene, action: &Action, (height, ground): (&[f64], f64), along: &[String]) -> Vec<Curve> {
    let up = support_normal(scene.capture, scene.model);
    let rest = first_rest(scene.interaction, scene.segmented);
    let grip = Grip::of(scene);
    let of = |(name, track): (&String, &PoseStream)| {
        let start: Pose = rest_pose(track, rest)?;
        let from = start.translation.vector.dot(&up);
        let swung = |t: f64| {
            grip.as_ref()
                .map_or(0.0, |g| g.swung(t, &start.translation.vector).dot(&up))
        };
        let rise = |t: &f64| {
            interpolate(&action.tool.time, height, *t).map_or(f64::NAN, |h| (h - ground).max(0.0) + swung(*t))
        };
        Some(Curve {
            label: format!("{name}: upwards"),
            quantity: Quantity::Position,
            time: track.time.clone(),
            measured: track.position.iter().map(|p| p.coords.dot(&up) - from).collect(),
            predicted: track
                .time
                .iter()
                .map(|t| if along.contains(name) { rise(t) } else { 0.0 })
                .collect(),
            noise: scene.position_noise(),
        })
    };
    scene.interaction.tracks.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_lift_begins_where_the_tool_is_lowest_however_soon_it_is_raised() {
        let soon: Vec<f64> = (0..1000)
            .map(|i| 0.7 + 0.08 * (f64::from(i - 20) / 60.0).clamp(0.0, 1.0))
            .collect();
        assert!((ground_of(&soon) - 0.7).abs() < 1e-6, "{}", ground_of(&soon));
        // It comes down first, to grip.
        let comes: Vec<f64> = (0..1000)
            .map(|i| {
                0.7 + 0.05 * (1.0 - f64::from(i) / 100.0).max(0.0) + 0.08 * (f64::from(i - 300) / 60.0).clamp(0.0, 1.0)
            })
            .collect();
        assert!((ground_of(&comes) - 0.7).abs() < 2e-4, "{}", ground_of(&comes));
        assert!(ground_of(&[f64::NAN]) == 0.0);
    }

    #[test]
    fn what_hangs_beside_the_wrist_is_swung_by_its_turn() {
        let turn = UnitQuaternion::from_scaled_axis(FRAC_PI_2 * Vector3::y());
        let path = PoseStream {
            time: vec![0.0, 1.0],
            position: vec![Point3::new(0.1, 0.0, 0.2); 2],
            rotation: vec![Some(UnitQuaternion::identity()), Some(turn)],
        };
        let grip = Grip::along(&path).expect("its orientation is known");
        let at = Vector3::new(0.2, 0.0, 0.2);
        assert!(grip.swung(0.0, &at).norm() < 1e-12);
        assert!((grip.swung(1.0, &at) - Vector3::new(-0.1, 0.0, -0.1)).norm() < 1e-12);
        // Half of the way, half of the turn; past its end it stays.
        let half = Vector3::new(0.1 * (0.5 * FRAC_PI_2).cos() - 0.1, 0.0, -0.1 * (0.5 * FRAC_PI_2).sin());
        assert!((grip.swung(0.5, &at) - half).norm() < 1e-9);
        assert!((grip.swung(2.0, &at) - grip.swung(1.0, &at)).norm() < 1e-12);
        assert!(grip.swung(1.0, &grip.from).norm() < 1e-12);
    }
}
