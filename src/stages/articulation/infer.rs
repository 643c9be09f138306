//! The verb of the articulation pass.

use std::collections::BTreeSet;

use nalgebra::Isometry3;

use super::Config;
use super::coupling::{Placement, coupling};
use super::describe::{Anchor, describe};
use super::fit::Fit;
use super::pair::{Pair, travel};
use super::select::{KINDS, Selection, select};
use super::tree::{Arc, tree_of};
use super::world;
use crate::base::{Notices, Result};
use crate::capture::{Capture, Kind, Segmented, first_rest, track_noise};
use crate::geometry::{Mesh, gap};
use crate::twin::{Joint, JointKind, Model};

/// What the relative motion shows.
#[derive(Clone, Debug, Default)]
pub struct Articulation {
    /// Joints between tracked links, axis and origin in the world at the first view.
    pub joints: Vec<Joint>,
    /// Links that were never seen or tracked but that a joint needs: `world` as the parent of what hangs on
    /// something that nobody tracked, and a handle that only the tool followed.
    pub world_links: Vec<String>,
    /// Pairs that moved as if a joint held them, which nothing proves.
    pub unproven: Vec<Unproven>,
}

/// Two things whose relative motion is that of a joint, though nothing shows that they hold each other.
#[derive(Clone, Debug)]
pub struct Unproven {
    /// The one that moved less.
    pub parent: String,
    /// The one that moved more.
    pub child: String,
    /// Probability that a joint holds them after all.
    pub share: f64,
}

/// Pairs that are no joints, or may not be.
#[derive(Default)]
struct Open {
    /// Moved as a joint lets them, which nothing proves.
    unproven: Vec<(Unproven, JointKind)>,
    /// Never moved against each other, and tracked in the same touches.
    together: Vec<[String; 2]>,
}

/// Seconds at the start of a track over which its pose is averaged.
const REST: f64 = 0.25;
/// Probability that two things are held once that was shown; names that say so (`body/link`) leave no doubt.
pub const HELD: f64 = 0.98;

/// Finds the joints between things that were tracked one by one, and of things that were pulled along a path
/// while nothing else was tracked.
///
/// # Errors
/// Settings that cannot work.
pub fn infer(
    capture: &Capture,
    _segmented: &[Segmented],
    model: &Model,
    config: &Config,
    notices: &mut Notices,
) -> Result<Articulation> {
    config.check()?;
    let names: BTreeSet<&str> = capture
        .fitted()
        .flat_map(|i| i.tracks.keys().map(String::as_str))
        .collect();
    let names: Vec<&str> = names.into_iter().filter(|n| seen(capture, n, notices)).collect();
    let (mut arcs, mut open) = (Vec::new(), Open::default());
    for (k, a) in names.iter().enumerate() {
        for b in &names[k + 1..] {
            arcs.extend(judge(capture, model, config, (notices, &mut open), a, b));
        }
    }
    let stir = |name: &str| {
        let ways: Vec<f64> = capture
            .fitted()
            .filter_map(|i| i.tracks.get(name))
            .map(travel)
            .collect();
        ways.iter().sum::<f64>() / ways.len().max(1) as f64
    };
    let turned = |joint: &Joint| turned(capture, model, config, joint);
    let joints = tree_of(arcs, &open.together, notices, &stir, &turned);
    let held = |u: &Unproven| {
        let ends = |j: &&Joint| {
            (&j.parent, &j.child) == (&u.parent, &u.child) || (&j.child, &j.parent) == (&u.parent, &u.child)
        };
        joints.iter().any(|j| ends(&j))
    };
    open.unproven.retain(|(u, _)| !held(u));
    for (u, kind) in &open.unproven {
        let how = format!("their relative motion looks {kind:?}, but nothing shows that they hold each other");
        notices.note(
            "articulation",
            &format!("{}, {}", u.parent, u.child),
            how.to_lowercase(),
        );
    }
    let mut out = Articulation {
        joints,
        world_links: Vec::new(),
        unproven: open.unproven.into_iter().map(|(u, _)| u).collect(),
    };
    world::infer_world(capture, model, config, notices, &mut out);
    Ok(out)
}

/// True where any reading of the track exists; a track without one says nothing of what holds the thing.
fn seen(capture: &Capture, name: &str, notices: &mut Notices) -> bool {
    let mut tracks = capture.fitted().filter_map(|i| i.tracks.get(name));
    let seen = tracks.any(|t| t.position.iter().any(|p| p.x.is_finite()));
    if !seen {
        let message = "its track holds no reading in any interaction: nothing can be said of what holds it";
        notices.warn("articulation", name, message);
    }
    seen
}

/// The joint between two tracked things, where there is one.
fn judge(
    capture: &Capture,
    model: &Model,
    config: &Config,
    (notices, open): (&mut Notices, &mut Open),
    a: &str,
    b: &str,
) -> Option<Arc> {
    let pair = Pair::gather(capture, a, b)?;
    let declared = same_body(a, b);
    if !declared && !(0..pair.runs.len()).any(|run| pair.moved(run)) {
        if always_beside(capture, a, b) {
            open.together.push([pair.parent, pair.child]);
        }
        return None;
    }
    let placement = placement(capture, model, &pair)?;
    let touches = declared || near(&placement, config.gap, config);
    let hangs = !touches && hangs_on(capture, model, config, &placement, &pair);
    let beside = touches || hangs;
    if !beside && !near(&placement, config.hinge_gap, config) {
        return None;
    }
    let reach = (config.reach * placement.size).max(0.05);
    let selection = select(&pair.samples, &KINDS, reach)?;
    let best = &selection.candidates[0];
    let kind = best.fit.manifold.kind;
    if selection.free > best.probability {
        let about = format!("{}, {}", pair.parent, pair.child);
        let how = format!(
            "no kind of joint explains how they moved against each other (free {:.3}, {kind:?} {:.3})",
            selection.free, best.probability
        );
        notices.note("articulation", &about, how.to_lowercase());
        return None;
    }
    if !declared && impossible(kind, &selection, &placement, config) {
        let second = selection.candidates.get(1).map_or_else(String::new, |c| {
            format!("; next {:?} ({:.3})", c.fit.manifold.kind, c.probability)
        });
        let about = format!("{}, {}", pair.parent, pair.child);
        let how = format!(
            "their relative motion is best {kind:?} ({:.3}), as of things that are not held{second}",
            best.probability
        );
        notices.note("articulation", &about, how.to_lowercase());
        return None;
    }
    if !declared && put_elsewhere(&pair, &best.fit) {
        let about = format!("{}, {}", pair.parent, pair.child);
        let how = "between touches one was put where no joint that explains their motion could have brought it";
        notices.note("articulation", &about, how);
        return None;
    }
    let proof = coupling(capture, &pair, &selection, &placement);
    let proven = declared || hangs || proof.proven();
    let hinged = proven && kind == JointKind::Revolute;
    if !beside && !hinged {
        return None;
    }
    if !proven {
        let pair = Unproven {
            share: best.probability * chance(&pair, kind),
            parent: pair.parent.clone(),
            child: pair.child.clone(),
        };
        open.unproven.push((pair, kind));
    }
    let held = if declared { 1.0 } else { HELD };
    if held * best.probability < config.least_probability {
        return None;
    }
    let anchor = anchor(capture, model, &pair);
    Some(Arc {
        proven,
        share: pair.share_moved(),
        centres: [placement.parent_centre, placement.child_centre],
        joint: describe(&pair, &selection, &anchor, &placement, held),
    })
}

/// How far off its way a joint that was moved by hand between touches is still found, m.
const OFF_ITS_WAY: f64 = 0.02;

/// True where the two rested against each other, in touches that moved neither, as the joint does not let them: somebody took them apart.
fn put_elsewhere(pair: &Pair, fit: &Fit) -> bool {
    let mut still = pair.still.iter();
    still.any(|sample| {
        let off = fit.manifold.project(sample).residual.fixed_rows::<3>(0).norm() * sample.noise.position;
        off > OFF_ITS_WAY.max(8.0 * sample.noise.position)
    })
}

/// True where every touch tracks both or neither. Only then do two that never parted go as one wherever a third is
/// looked at: what stood still beside the one in one touch and beside the other in another says nothing of the two.
fn always_beside(capture: &Capture, a: &str, b: &str) -> bool {
    let mut touches = capture.fitted();
    touches.all(|i| i.tracks.contains_key(a) == i.tracks.contains_key(b))
}

/// The same joint with parent and child exchanged.
fn turned(capture: &Capture, model: &Model, config: &Config, joint: &Joint) -> Option<Joint> {
    let pair = Pair::between(capture, &joint.child, &joint.parent)?;
    let placement = placement(capture, model, &pair)?;
    let selection = select(&pair.samples, &KINDS, (config.reach * placement.size).max(0.05))?;
    let held = if same_body(&pair.parent, &pair.child) {
        1.0
    } else {
        HELD
    };
    let anchor = anchor(capture, model, &pair);
    Some(describe(&pair, &selection, &anchor, &placement, held))
}

/// Probability that a joint holds what kept to one path when it was pulled, though nothing proves it: in one pull, in
/// several. What a lift took off is not held, and pushes lead nothing along a path.
const KEPT: (f64, f64) = (0.1, 0.4);

fn chance(pair: &Pair, kind: JointKind) -> f64 {
    let one_way = matches!(kind, JointKind::Prismatic | JointKind::Revolute | JointKind::Screw);
    let moved = |of: Kind| {
        let runs = pair.runs.iter().enumerate().filter(move |(_, run)| run.kind == of);
        runs.filter(|(k, _)| pair.moved(*k)).count()
    };
    match moved(Kind::Pull) {
        _ if !one_way || moved(Kind::Lift) > 0 => 0.0,
        0 => 0.0,
        1 => KEPT.0,
        _ => KEPT.1,
    }
}

/// True for two links of one body by their names, `body/link`.
pub(super) fn same_body(a: &str, b: &str) -> bool {
    match (a.split_once('/'), b.split_once('/')) {
        (Some((x, _)), Some((y, _))) => x == y,
        _ => false,
    }
}

/// True where no more than `most`, m, is between the two.
fn near(placement: &Placement, most: f64, config: &Config) -> bool {
    match (&placement.parent_mesh, &placement.child_mesh) {
        (Some(p), Some(c)) => gap(p, c).is_some_and(|g| g < most),
        _ => (placement.parent_centre - placement.child_centre).norm() < config.origin_distance,
    }
}

/// True where the child stands on nothing that was seen and no hand took it there, so that the parent, the one thing beside it, holds it up.
fn hangs_on(capture: &Capture, model: &Model, config: &Config, placement: &Placement, pair: &Pair) -> bool {
    let (Some(child), Some(table)) = (&placement.child_mesh, placement.table) else {
        return false;
    };
    if pair.runs.iter().any(|run| !matches!(run.kind, Kind::Push | Kind::Pull)) {
        return false;
    }
    let heights = child.vertices.iter().map(|v| v.coords.dot(&placement.up));
    if heights.fold(f64::INFINITY, f64::min) - table < world::HANGS {
        return false;
    }
    let others = model.twin.links().map(|(_, l)| l.name.as_str());
    let mut others = others.filter(|n| *n != pair.parent && *n != pair.child);
    let near = |name: &str| {
        let mesh = pose_of(capture, model, name).and_then(|pose| world_mesh(model, name, &pose));
        mesh.is_none_or(|m| gap(&m, child).is_none_or(|g| g < config.hinge_gap))
    };
    !others.any(near)
}

/// Kinds that the table explains, or that no real joint has: gliding in the plane of the table, a hinge far
/// from both.
fn impossible(kind: JointKind, selection: &Selection, placement: &Placement, config: &Config) -> bool {
    let fit = &selection.candidates[0].fit;
    let radius = super::select::radius_of(fit).0;
    let far = |r: f64| r > config.reach * placement.size;
    match kind {
        JointKind::Fixed | JointKind::Planar => true,
        JointKind::Revolute | JointKind::Screw | JointKind::Cylindrical => {
            let to_parent =
                fit.manifold.point - fit.manifold.axis.into_inner() * fit.manifold.axis.dot(&fit.manifold.point);
            far(radius) || far(to_parent.norm())
        }
        JointKind::Spherical => far((fit.manifold.point - fit.manifold.home.translation.vector).norm()),
        JointKind::Prismatic => false,
    }
}

/// Where the two stand at the first view; from the first rows of their tracks where the model does not know.
fn placement(capture: &Capture, model: &Model, pair: &Pair) -> Option<Placement> {
    let (parent_pose, child_pose) = (
        pose_of(capture, model, &pair.parent)?,
        pose_of(capture, model, &pair.child)?,
    );
    let (parent_mesh, child_mesh) = (
        world_mesh(model, &pair.parent, &parent_pose),
        world_mesh(model, &pair.child, &child_pose),
    );
    let centre = |mesh: &Option<Mesh>, pose: &Isometry3<f64>| {
        mesh.as_ref()
            .and_then(Mesh::bounds)
            .map_or(pose.translation.vector, |(l, h)| 0.5 * (l.coords + h.coords))
    };
    let (parent_centre, child_centre) = (centre(&parent_mesh, &parent_pose), centre(&child_mesh, &child_pose));
    let extent = |mesh: &Option<Mesh>| {
        mesh.as_ref()
            .and_then(Mesh::bounds)
            .map_or(0.0, |(l, h)| (h - l).norm())
    };
    let size = extent(&parent_mesh)
        .max(extent(&child_mesh))
        .max((parent_centre - child_centre).norm())
        .max(0.05);
    let support = capture.support.as_ref();
    let up = support.map_or_else(|| -capture.gravity.normalize(), |s| s.normal.into_inner());
    Some(Placement {
        parent_mesh,
        child_mesh,
        parent_centre,
        child_centre,
        size,
        up,
        table: support.map(|s| up.dot(&s.point.coords)),
    })
}

/// World-from-link at the first view: the model's, else the first rows of the first track.
pub fn pose_of(capture: &Capture, model: &Model, name: &str) -> Option<Isometry3<f64>> {
    let stream = capture.fitted().find_map(|i| i.tracks.get(name));
    let tracked = stream.and_then(|s| first_rest(s, REST)).map(|(p, _)| p);
    let known = model.twin.link(name).map(|l| l.pose.0);
    match (known, tracked) {
        (Some(k), Some(t)) => {
            let noise = track_noise(capture, name);
            let near = (k.translation.vector - t.translation.vector).norm() < (8.0 * noise.position).max(2e-3)
                && k.rotation.angle_to(&t.rotation) < (8.0 * noise.rotation).max(0.02);
            Some(if near { t } else { k })
        }
        (k, t) => k.or(t),
    }
}

/// The surface of a link in the world at the first view.
pub fn world_mesh(model: &Model, name: &str, pose: &Isometry3<f64>) -> Option<Mesh> {
    let path = model.twin.link(name)?.mesh.as_ref()?;
    Some(model.meshes.get(path)?.transformed(pose))
}

fn anchor(capture: &Capture, model: &Model, pair: &Pair) -> Anchor {
    let world_from_parent = pose_of(capture, model, &pair.parent).unwrap_or_else(Isometry3::identity);
    let world_from_child = pose_of(capture, model, &pair.child).unwrap_or_else(Isometry3::identity);
    let noise = track_noise(capture, &pair.parent);
    let rows = pair.runs.first().map_or(1, |r| {
        let stream = &r.tracks[pair.parent.as_str()];
        first_rest(stream, REST).map_or(1, |(_, n)| n)
    }) as f64;
    Anchor {
        world_from_parent,
        parent_from_child: world_from_parent.inverse() * world_from_child,
        position: noise.position / rows.sqrt(),
        rotation: noise.rotation / rows.sqrt(),
    }
}
