//! From a fitted manifold in the parent's frame to a joint in the world at the first view.

use nalgebra::{DMatrix, Isometry3, Matrix3, Vector3};

use super::coupling::Placement;
use super::limits::{Travel, ends, limits, travelled};
use super::manifold::Manifold;
use super::pair::Pair;
use super::select::{KINDS, Selection};
use crate::base::Estimate;
use crate::twin::{Joint, JointAlternative, JointKind};

/// The parent at the first view, and how well it is known.
pub struct Anchor {
    /// World-from-parent.
    pub world_from_parent: Isometry3<f64>,
    /// Parent-from-child at the first view.
    pub parent_from_child: Isometry3<f64>,
    /// Standard deviation of the parent's position, m per axis.
    pub position: f64,
    /// Standard deviation of the parent's orientation, rad per axis.
    pub rotation: f64,
}

/// Share of an axis or origin's standard deviation that the noise model leaves out: errors of a tracker that last
/// longer than one interaction do not average out over its rows.
const UNDERSTATED: f64 = 1.35;
/// Floor of an axis' standard deviation, rad: marker and link are aligned no better than that.
const ALIGNMENT: f64 = 7e-4;
/// Floor of an origin's standard deviation, m.
const PLACEMENT: f64 = 5e-5;

/// The joint that the best candidate describes. `held` is the probability that the two are held at all.
pub fn describe(pair: &Pair, selection: &Selection, anchor: &Anchor, placement: &Placement, held: f64) -> Joint {
    let best = &selection.candidates[0];
    let kind = best.fit.manifold.kind;
    let start = position_at(&best.fit.manifold, &anchor.parent_from_child);
    let mut travels = travels(pair, selection, start);
    let sign = direction(
        &travels,
        &(anchor.world_from_parent * best.fit.manifold.axis.into_inner()),
    );
    for travel in &mut travels {
        travel.position.iter_mut().for_each(|q| *q *= sign);
    }
    let from: Vec<String> = pair.runs.iter().map(|r| r.name.clone()).collect();
    let (axis, origin, lateral) = axis_and_origin(selection, anchor, placement, sign, &from);
    let unit = if kind == JointKind::Prismatic { "m" } else { "rad" };
    let sd = position_noise(selection);
    let single = matches!(kind, JointKind::Revolute | JointKind::Prismatic | JointKind::Screw);
    let bound = |p: f64| (held * p).clamp(0.0, 0.9999);
    Joint {
        name: format!("{}_{}", pair.parent, pair.child).replace('/', "-"),
        kind,
        parent: pair.parent.clone(),
        child: pair.child.clone(),
        probability: bound(best.probability),
        alternatives: KINDS
            .iter()
            .filter(|k| **k != kind)
            .map(|k| JointAlternative {
                kind: *k,
                probability: probability_of(selection, *k, held),
            })
            .collect(),
        axis,
        origin,
        pitch: (kind == JointKind::Screw).then(|| pitch(selection, &from)),
        limits: single.then(|| limits(pair, &travels, sd, unit)).flatten(),
        travelled: single.then(|| travelled(&travels)),
        position: single.then(|| Estimate::known(0.0, None, unit)),
        friction: None,
        damping: None,
        stiffness: None,
        rest: None,
        effort: None,
        effects: crate::twin::JointEffects::default(),
        lateral,
    }
}

/// Whether the lower and the upper end of the way of the best candidate were run into.
pub fn ends_reached(pair: &Pair, selection: &Selection) -> [bool; 2] {
    ends(pair, &travels(pair, selection, 0.0), position_noise(selection))
}

fn probability_of(selection: &Selection, kind: JointKind, held: f64) -> f64 {
    let found = selection.candidates.iter().find(|c| c.fit.manifold.kind == kind);
    held * found.map_or(0.0, |c| c.probability)
}

/// Joint position of a relative pose.
fn position_at(manifold: &Manifold, pose: &Isometry3<f64>) -> f64 {
    let sample = super::manifold::Sample {
        run: 0,
        time: 0.0,
        position: pose.translation.vector,
        rotation: Some(pose.rotation),
        noise: crate::capture::TrackNoise {
            position: 1e-3,
            rotation: 1e-2,
        },
    };
    manifold.project_all(&[sample])[0].z[0]
}

fn travels(pair: &Pair, selection: &Selection, start: f64) -> Vec<Travel> {
    let projections = &selection.candidates[0].fit.projections;
    let kind = selection.candidates[0].fit.manifold.kind;
    let turning = !matches!(kind, JointKind::Prismatic | JointKind::Screw);
    (0..pair.runs.len())
        .map(|run| {
            let mut travel = Travel {
                run,
                time: Vec::new(),
                position: Vec::new(),
            };
            for (sample, projection) in pair.samples.iter().zip(projections).filter(|(s, _)| s.run == run) {
                let last = travel.position.last().copied();
                travel.time.push(sample.time);
                travel.position.push(unwrapped(projection.z[0] - start, last, turning));
            }
            travel
        })
        .filter(|t| !t.time.is_empty())
        .collect()
}

/// The position that goes on from the last one. A screw's whole turns are told already: they shift it.
fn unwrapped(q: f64, last: Option<f64>, turning: bool) -> f64 {
    use std::f64::consts::TAU;
    let near = last.unwrap_or(0.0);
    if turning {
        q - TAU * ((q - near) / TAU).round()
    } else {
        q
    }
}

/// The axis points where the joint mostly went; where it went both ways, its largest component is positive.
fn direction(travels: &[Travel], axis: &Vector3<f64>) -> f64 {
    let [low, high] = travelled(travels);
    if (low + high).abs() > 0.5 * (high - low) {
        return (low + high).signum();
    }
    if axis[axis.iamax()] < 0.0 { -1.0 } else { 1.0 }
}

/// Noise of one joint position.
fn position_noise(selection: &Selection) -> f64 {
    let projections = &selection.candidates[0].fit.projections;
    let mean = projections.iter().map(|p| (-p.log_precision).exp()).sum::<f64>() / projections.len().max(1) as f64;
    mean * selection.inflation
}

fn axis_and_origin(
    selection: &Selection,
    anchor: &Anchor,
    placement: &Placement,
    sign: f64,
    from: &[String],
) -> (Estimate<[f64; 3]>, Estimate<[f64; 3]>, Option<f64>) {
    let fit = &selection.candidates[0].fit;
    let turn = anchor.world_from_parent.rotation.to_rotation_matrix().into_inner();
    let scale = selection.inflation.powi(2) * selection.correlation;
    let axis = turn * fit.manifold.axis.into_inner() * sign;
    let spread = |map: DMatrix<f64>| -> Matrix3<f64> {
        let in_parent = &map * &fit.covariance * map.transpose() * scale;
        turn * Matrix3::from_iterator(in_parent.iter().copied()) * turn.transpose()
    };
    let across = Matrix3::identity() - axis * axis.transpose();
    let widened =
        (spread(fit.axis_map()) + across * anchor.rotation.powi(2)) * UNDERSTATED.powi(2) + across * ALIGNMENT.powi(2);
    // Along itself a unit vector errs in second order only: 1 - cos(error).
    let axis_spread = widened + axis * axis.transpose() * widened.trace().powi(2);
    let translational = matches!(
        fit.manifold.kind,
        JointKind::Prismatic | JointKind::Fixed | JointKind::Planar
    );
    let (origin, origin_spread, lateral) = if translational {
        let noise = Matrix3::identity() * anchor.position.powi(2).max(1e-8);
        (placement.child_centre, noise, None)
    } else {
        let point = anchor.world_from_parent * nalgebra::Point3::from(fit.manifold.point);
        let along = axis.dot(&(placement.child_centre - point.coords));
        let along = if fit.manifold.kind == JointKind::Spherical {
            0.0
        } else {
            along
        };
        let origin = point.coords + axis * along;
        let lever = (origin - anchor.world_from_parent.translation.vector).norm() * anchor.rotation;
        let placed = Matrix3::identity() * (anchor.position.powi(2) + lever.powi(2));
        let open = if fit.manifold.kind == JointKind::Spherical {
            0.0
        } else {
            free_along(placement, &axis)
        };
        let slide = axis * axis.transpose() * open.powi(2);
        let fitted = (spread(fit.point_map(along * sign)) + placed) * UNDERSTATED.powi(2);
        let placed = fitted + Matrix3::identity() * PLACEMENT.powi(2);
        let lateral = (0.5 * (across * placed * across).trace()).sqrt();
        (origin, placed + slide, Some(lateral))
    };
    let sd = |m: &Matrix3<f64>| std::array::from_fn(|i| m[(i, i)].max(0.0).sqrt());
    let method = "relative-motion";
    (
        Estimate::measured(axis.into(), sd(&axis_spread), "1", from.to_vec(), method),
        Estimate::measured(origin.into(), sd(&origin_spread), "m", from.to_vec(), method),
        lateral,
    )
}

/// Where along its axis a joint sits cannot be known: half the child's extent along it.
fn free_along(placement: &Placement, axis: &Vector3<f64>) -> f64 {
    let Some(mesh) = &placement.child_mesh else { return 0.01 };
    let heights = mesh.vertices.iter().map(|v| axis.dot(&v.coords));
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if high > low { 0.5 * (high - low) } else { 0.01 }
}

fn pitch(selection: &Selection, from: &[String]) -> Estimate {
    let fit = &selection.candidates[0].fit;
    let variance = fit.covariance[(10, 10)] * selection.inflation.powi(2) * selection.correlation;
    Estimate::measured(
        fit.manifold.pitch,
        variance.sqrt(),
        "m/rad",
        from.to_vec(),
        "relative-motion",
    )
}
