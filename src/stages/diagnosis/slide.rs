//! Pushes and pulls along the table, predicted and laid beside what was measured.

use nalgebra::{Point3, Vector3};

use super::doubt::{add_evenly, add_squares, in_doubt};
use super::predict::{Outcome, Scene};
use super::rubbing::shoved_along;
use super::slide_touches::{PULLED, SETTLE, Touches, flies};
use super::trace::Predicted;
use super::{Curve, Path, Quantity};
use crate::base::{Estimate, Pose};
use crate::capture::{PhaseKind, PoseStream};
use crate::math::interpolate;
use crate::physics::{Action, Hold, Prediction, PushPrediction, predict_push};
use crate::stages::estimation::{
    first_rest, replay_push, rest_pose, support_normal, travel_direction, travel_of_track, tumbles,
};

/// Force along the motion and the motion of every tracked link.
pub fn slide_curves(scene: &Scene, action: &Action) -> Outcome {
    let direction = travel_direction(action).ok_or("the tool does not move along the support")?;
    if let Some(other) = shoved_along(scene, &action.target) {
        return Err(format!(
            "{other} was shoved along: what that adds to the force is not foretold"
        ));
    }
    if action.tool.hold == Hold::Push && hangs_on_nothing_seen(scene, &action.target) {
        return Err("it hangs on a joint and swings on: the load along it is foretold".into());
    }
    let track = scene.interaction.tracks.get(&action.target);
    if action.tool.hold == Hold::Push && track.is_some_and(|t| tumbles(t, &action.normal)) {
        return Err("it rolls or tips over: how it goes is not foretold".into());
    }
    let (gap, mut found) = replay_push(scene.model, scene.interaction, scene.segmented, action, 0.0, 3)
        .ok_or("friction or shape of what is moved is not known, or its joint is out of the plane")?;
    let lagging = fall_behind(scene, &mut found, &direction);
    let curves = curves_of(scene, action, &found, &direction);
    let mut squares = Vec::new();
    for model in in_doubt(scene.model, &action.target) {
        if let Some(with) = predict_push(&model, action, gap) {
            add_squares(&mut squares, &curves, &curves_of(scene, action, &with, &direction));
        }
    }
    if action.tool.hold == Hold::Push {
        for (quantity, far) in thrown_ahead(scene, action, &found) {
            add_evenly(&mut squares, &curves, quantity, far);
        }
    } else {
        doubt_haste(
            &mut squares,
            &curves,
            &found,
            &inertial(scene, action, &found, &direction),
        );
    }
    let doubt = squares.iter().map(|c| c.iter().map(|x| x.sqrt()).collect()).collect();
    let met = (action.tool.hold == Hold::Push).then(|| {
        format!(
            "the tool met the surface {:.1} mm from where the mesh has it (fitted anew)",
            // No minus before nought.
            (gap * 1e4).round() / 10.0 + 0.0
        )
    });
    let remarks: Vec<String> = met.into_iter().chain(lagging).collect();
    let remark = (!remarks.is_empty()).then(|| remarks.join("; "));
    let path = |(name, poses): (String, Vec<Pose>)| {
        let time = found.prediction.time.clone();
        (name, Path { time, poses })
    };
    Ok(Predicted {
        curves,
        doubt,
        remark,
        paths: found.prediction.poses.into_iter().map(path).collect(),
    })
}

/// Share that is open of the force that speeds a held thing up: when exactly a hand does so is known less well than how far it went.
const HASTE: f64 = 0.5;

/// Adds what haste leaves open of the force of a hand, in squares.
fn doubt_haste(squares: &mut Vec<Vec<f64>>, curves: &[Curve], found: &PushPrediction, inertial: &[f64]) {
    squares.resize_with(curves.len(), Vec::new);
    for (own, curve) in squares
        .iter_mut()
        .zip(curves)
        .filter(|(_, c)| c.quantity == Quantity::Force)
    {
        own.resize(curve.time.len(), 0.0);
        for (square, t) in own.iter_mut().zip(&curve.time) {
            let more = interpolate(&found.prediction.time, inertial, *t).unwrap_or(0.0);
            *square += (HASTE * more).powi(2);
        }
    }
}

/// Whether a joint holds it to something that nobody saw or tracked: it does not stand on the support.
fn hangs_on_nothing_seen(scene: &Scene, target: &str) -> bool {
    let twin = &scene.model.twin;
    let mut holding = twin.joints().filter(|j| j.child == target).map(|j| &j.parent);
    let seen = |name: &String| twin.link(name).is_some_and(|l| l.mesh.is_some());
    holding.any(|parent| !seen(parent) && !scene.interaction.tracks.contains_key(parent))
}

/// Share of the way by which a body comes to rest from the speed of the tool that it may be thrown ahead by the blow of it, and
/// what friction is taken where none is told, and reach of what turns, m.
const THROWN: f64 = 0.5;
const RUBS: f64 = 0.3;
const REACH: f64 = 0.03;
/// Samples of a steady touch at least.
const STEADILY: usize = 15;
/// The briefest touch of which a mean force is asked, s.
const BRIEFEST: f64 = 0.1;

/// How far a body by itself may be thrown ahead of what a slow push would do, m and rad: what meets it fast leaves it with its speed,
/// which the plain model does not have. By as much as it has of that momentum at the end of the touch, or lost of it, the mean force is
/// off, N.
fn thrown_ahead(scene: &Scene, action: &Action, found: &PushPrediction) -> [(Quantity, f64); 3] {
    let link = scene.model.twin.link(&action.target);
    let friction = link.map(|l| &l.friction);
    let told = |e: Option<&Estimate>, else_: f64| e.map_or(else_, |e| e.value);
    let rubs = told(friction.and_then(|f| f.kinetic.as_ref()), RUBS).max(0.05);
    let reach = told(friction.and_then(|f| f.torsional_radius.as_ref()), REACH).max(0.005);
    let fastest = Touches::of(action, found).fastest();
    let far = THROWN * fastest.powi(2) / (2.0 * rubs * action.gravity);
    let mass = link.and_then(|l| l.mass.as_ref()).filter(|m| m.is_told());
    let lasts = found.contact.iter().map(|(from, to)| to - from).sum::<f64>();
    let lost = THROWN * mass.map_or(0.0, |m| m.value) * fastest / lasts.max(BRIEFEST);
    [
        (Quantity::Position, far),
        (Quantity::Rotation, far / reach),
        (Quantity::Force, lost),
    ]
}

/// Share of the way by which what rides on a pushed thing may creep back on it: dry friction under a chattering tool lets
/// go a little at a time (MuJoCo's stacks lose 10 to 13 %). What falls behind by more slides, and no such thing is foretold.
const CREEPS: f64 = 0.2;

/// Lets what rides on the pushed thing fall behind as far as it did, and says by how much.
fn fall_behind(scene: &Scene, found: &mut PushPrediction, direction: &Vector3<f64>) -> Vec<String> {
    let mut words = Vec::new();
    for name in &found.carried {
        let way = travel_of_track(scene.interaction, scene.segmented, name, direction);
        let (Some(way), Some(poses)) = (way, found.prediction.poses.get_mut(name)) else {
            continue;
        };
        let (Some(first), Some(last)) = (poses.first().copied(), poses.last()) else {
            continue;
        };
        let far = (last.translation.vector - first.translation.vector).dot(direction);
        let lost = 1.0 - way / far.max(SHORT);
        if far > SHORT && lost > 0.0 && lost < CREEPS {
            for pose in poses.iter_mut() {
                let way = pose.translation.vector - first.translation.vector;
                pose.0.translation.vector -= way * lost;
            }
            words.push(format!(
                "{name} fell behind by {:.0} % of the way (fitted anew)",
                1e2 * lost
            ));
        }
    }
    words
}

/// Ways below which nothing falls behind, m.
const SHORT: f64 = 5e-3;

/// Force and motion of every tracked link, beside what is foretold.
fn curves_of(scene: &Scene, action: &Action, found: &PushPrediction, direction: &Vector3<f64>) -> Vec<Curve> {
    let mut curves = Vec::new();
    curves.extend(force_curve(scene, action, found, direction));
    for (name, track) in &scene.interaction.tracks {
        curves.extend(motion_curves(scene, name, track, &found.prediction, direction));
    }
    curves
}

/// What the table bears over the weight: a hand that holds what is weighed may press down, or take weight off, and the friction of a
/// finger's tip does so, too.
fn borne(scene: &Scene, action: &Action, found: &PushPrediction, force: &[Vector3<f64>]) -> Vec<f64> {
    let twin = &scene.model.twin;
    let mass = |name: &str| twin.link(name).and_then(|l| l.mass.as_ref());
    let own = mass(&action.target).filter(|m| m.is_told() || action.tool.hold == Hold::Push);
    let carried = found.carried.iter().filter_map(|name| mass(name));
    let all = own.map(|m| m.value + carried.map(|m| m.value).sum::<f64>());
    let jointed = twin.body_of(&action.target).is_some_and(|b| b.links.len() > 1);
    let weight = all.filter(|_| !jointed).map(|m| m * action.gravity);
    let share = |f: &Vector3<f64>| weight.map_or(1.0, |w| (1.0 - f.dot(&action.normal) / w).max(0.0));
    force.iter().map(share).collect()
}

/// What the weight of a body on a support that is known not to be level does along its motion, N.
fn pulled_along(scene: &Scene, action: &Action, direction: &Vector3<f64>) -> f64 {
    let mass = scene.model.twin.link(&action.target).and_then(|l| l.mass.as_ref());
    let flat = direction - action.normal.into_inner() * action.normal.dot(direction);
    mass.map_or(0.0, |m| m.value * scene.capture.gravity.dot(&flat))
}

fn force_curve(scene: &Scene, action: &Action, found: &PushPrediction, direction: &Vector3<f64>) -> Option<Curve> {
    let (time, force, noise) = scene.binned_force(0.01)?;
    let rubbed: Vec<f64> = found.prediction.force.iter().map(|f| f.dot(direction)).collect();
    let touches = Touches::of(action, found);
    let borne = borne(scene, action, found, &force);
    let weighed = pulled_along(scene, action, direction);
    let inertial = inertial(scene, action, found, direction);
    // What takes hold of a body does so while all rests.
    let held = action.tool.hold != Hold::Push;
    let rest = scene
        .segmented
        .and_then(|s| s.phases.first())
        .filter(|p| held && p.kind == PhaseKind::Rest);
    let before = rest.map_or(f64::NEG_INFINITY, |p| p.end).max(touches.first()) - 0.5 * SETTLE;
    // A hand that holds already may strain at what rests as it likes.
    let strained = scene.segmented.is_some_and(|s| s.preload.is_some());
    let at = |(t, borne): (&f64, &f64)| {
        if *t < before {
            let idle = held || touches.none() || touches.apart(*t);
            return (idle && !strained).then_some(0.0);
        }
        let along = interpolate(&found.prediction.time, &rubbed, *t)?;
        let more = interpolate(&found.prediction.time, &inertial, *t)?;
        // What no finger touches any more is not felt, whatever pulls it.
        let felt = if touches.touching(*t) {
            borne * along - weighed + more
        } else {
            0.0
        };
        touches.steady(*t).then_some(felt)
    };
    let mut predicted: Vec<f64> = time.iter().zip(&borne).map(|row| at(row).unwrap_or(f64::NAN)).collect();
    // A touch of one or two samples is a blow, and none of them is steady.
    let moved = |(t, p): (&f64, &f64)| *t >= before && p.is_finite() && touches.touching(*t);
    if time.iter().zip(&predicted).filter(|row| moved(*row)).count() < STEADILY {
        let blow = |t: &f64| *t >= before && touches.touching(*t);
        let struck = time.iter().zip(&mut predicted).filter(|(t, _)| blow(t));
        struck.for_each(|(_, p)| *p = f64::NAN);
    }
    let measured: Vec<f64> = force.iter().map(|f| f.dot(direction)).collect();
    // What a blow sends ahead of its tool is not touched, whatever a slow push would do.
    let apart = |(m, p): &(&f64, &mut f64)| !held && flies(m.abs(), p.abs(), touches.fastest());
    let alone = measured.iter().zip(&mut predicted).filter(apart);
    alone.for_each(|(_, p)| *p = f64::NAN);
    Some(Curve {
        label: "force along the motion".into(),
        quantity: Quantity::Force,
        measured,
        predicted,
        time,
        noise,
    })
}

/// What it takes along the motion to accelerate a body of one link as it is foretold to go, N; a chain's is not.
fn inertial(scene: &Scene, action: &Action, found: &PushPrediction, direction: &Vector3<f64>) -> Vec<f64> {
    let (time, poses) = (&found.prediction.time, found.prediction.poses.get(&action.target));
    let alone = scene
        .model
        .twin
        .body_of(&action.target)
        .is_some_and(|b| b.links.len() == 1);
    let link = scene.model.twin.link(&action.target).filter(|_| alone);
    let mass = link.and_then(|l| l.mass.as_ref()).filter(|m| m.is_told());
    let (Some(mass), Some(poses)) = (mass, poses) else {
        return vec![0.0; time.len()];
    };
    let centre = link.and_then(|l| l.com.as_ref()).map_or([0.0; 3], |c| c.value);
    let centre = Point3::from(centre);
    let way: Vec<f64> = poses.iter().map(|p| (p.0 * centre).coords.dot(direction)).collect();
    let at = |t: f64| interpolate(time, &way, t);
    let accelerated = |t: &f64| {
        let (before, now, after) = (at(t - PULLED)?, at(*t)?, at(t + PULLED)?);
        Some((before - 2.0 * now + after) / (PULLED * PULLED))
    };
    time.iter()
        .map(|t| mass.value * accelerated(t).unwrap_or(0.0))
        .collect()
}

/// Position along and across the motion, and heading, of one tracked link.
fn motion_curves(
    scene: &Scene,
    name: &str,
    track: &PoseStream,
    prediction: &Prediction,
    direction: &Vector3<f64>,
) -> Vec<Curve> {
    let Some(start) = rest_pose(track, first_rest(scene.interaction, scene.segmented)) else {
        return Vec::new();
    };
    let Some(poses) = prediction.poses.get(name) else {
        return Vec::new();
    };
    let up = support_normal(scene.capture, scene.model);
    let across = up.cross(direction);
    let (Some(from), Some(to)) = (prediction.time.first().copied(), prediction.time.last().copied()) else {
        return Vec::new();
    };
    let curve = |label: String, quantity, noise, measured: Vec<f64>, predicted: Vec<f64>| {
        // What was seen before and after the tool moved is held against the first and the last of the prediction.
        let at = |t: &f64| interpolate(&prediction.time, &predicted, t.clamp(from, to)).unwrap_or(f64::NAN);
        let predicted = track.time.iter().map(at).collect();
        Curve {
            label,
            quantity,
            time: track.time.clone(),
            measured,
            predicted,
            noise,
        }
    };
    let mut curves = Vec::new();
    for (word, axis) in [("along", direction), ("across", &across)] {
        let moved = |p: &Pose| (p.translation.vector - start.translation.vector).dot(axis);
        let measured = track
            .position
            .iter()
            .map(|p| (p.coords - start.translation.vector).dot(axis))
            .collect();
        let predicted = poses.iter().map(moved).collect();
        curves.push(curve(
            format!("{name}: {word} the motion"),
            Quantity::Position,
            scene.position_noise(),
            measured,
            predicted,
        ));
    }
    let heading = |q: &nalgebra::UnitQuaternion<f64>| (q * start.rotation.inverse()).scaled_axis().dot(&up);
    let measured = track
        .rotation
        .iter()
        .map(|q| q.as_ref().map_or(f64::NAN, heading))
        .collect();
    let predicted = poses.iter().map(|p| heading(&p.rotation)).collect();
    curves.push(curve(
        format!("{name}: heading"),
        Quantity::Rotation,
        scene.rotation_noise(),
        measured,
        predicted,
    ));
    curves
}
