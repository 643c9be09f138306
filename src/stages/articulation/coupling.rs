//! Whether two things are held to each other at all: a low-dimensional relative motion alone proves nothing,
//! since a box that was pushed once along a line has it against everything that stood still.
//!
//! What counts as proof: the thing that was not touched came along although mere contact cannot have shoved it
//! (transmission); one and the same hinge axis under pushes in different directions or at different places
//! (persistence); a low-dimensional motion of a thing that stands on nothing (suspension); a way with a stop at either
//! end; a long turn about one axis that the tool did not make by itself.

use nalgebra::Vector3;

use super::describe::ends_reached;
use super::fit::Fit;
use super::pair::Pair;
use super::rail::on_a_rail;
use super::select::Selection;
use crate::capture::{Capture, Interaction, Kind, PoseStream};
use crate::geometry::Mesh;
use crate::math::quantile;
use crate::twin::JointKind;

/// Where the two stand at the first view.
pub struct Placement {
    /// Surfaces in the world, where they are known.
    pub parent_mesh: Option<Mesh>,
    /// Surfaces in the world, where they are known.
    pub child_mesh: Option<Mesh>,
    /// Middle of the parent, m, world.
    pub parent_centre: Vector3<f64>,
    /// Middle of the child, m, world.
    pub child_centre: Vector3<f64>,
    /// A typical size of the pair, m.
    pub size: f64,
    /// Away from the table, world.
    pub up: Vector3<f64>,
    /// Height of the table along `up`, where there is one.
    pub table: Option<f64>,
}

/// What proves that the two are held to each other.
#[derive(Clone, Debug, Default)]
pub struct Coupling {
    /// The interactions that prove it.
    pub by: Vec<String>,
    /// In words, for the notices.
    pub why: Vec<&'static str>,
}

impl Coupling {
    /// True where anything proves it.
    pub fn proven(&self) -> bool {
        !self.why.is_empty()
    }

    fn add(&mut self, by: &str, why: &'static str) {
        self.by.push(by.into());
        if !self.why.contains(&why) {
            self.why.push(why);
        }
    }
}

impl Placement {
    fn heights(&self, mesh: Option<&Mesh>) -> Option<(f64, f64)> {
        let heights = mesh?.vertices.iter().map(|v| self.up.dot(&v.coords));
        Some(heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x))))
    }

    /// True where one lies on top of the other, so that friction carries it along in a push.
    pub fn stacked(&self) -> bool {
        let apart = self.child_centre - self.parent_centre;
        let height = self.up.dot(&apart);
        let level = (apart - self.up * height).norm();
        match (
            self.heights(self.parent_mesh.as_ref()),
            self.heights(self.child_mesh.as_ref()),
        ) {
            (Some(p), Some(c)) => (c.0 - p.1).abs().min((p.0 - c.1).abs()) < 0.006,
            _ => height.abs() > 0.01 && level < 2.0 * height.abs(),
        }
    }

    /// True where the child does not stand on the table.
    fn off_table(&self) -> bool {
        match (self.table, self.heights(self.child_mesh.as_ref())) {
            (None, _) => true,
            (Some(table), Some((low, _))) => low > table + 0.008,
            (Some(_), None) => false,
        }
    }
}

/// Looks for proof that the two are held by the joint that `fit` describes.
pub fn coupling(capture: &Capture, pair: &Pair, selection: &Selection, placement: &Placement) -> Coupling {
    let mut found = Coupling::default();
    let fit = &selection.candidates[0].fit;
    if taken_off(pair, fit, placement) {
        return found;
    }
    let one_way = matches!(
        fit.manifold.kind,
        JointKind::Prismatic | JointKind::Revolute | JointKind::Screw
    );
    if one_way && ends_reached(pair, selection) == [true, true] {
        found.add(&pair.runs[0].name, "it ran into a stop at either end of its way");
    }
    for run in &pair.runs {
        if transmitted(capture, pair, run, fit, placement) {
            found.add(&run.name, "the one that was not touched came along");
        }
    }
    if fit.manifold.kind == JointKind::Revolute {
        persistent_axis(pair, &mut found);
    }
    if fit.manifold.kind == JointKind::Prismatic && selection.inflation < WITHIN_NOISE {
        for (run, words) in on_a_rail(pair, placement) {
            found.add(&run.name, words);
        }
    }
    if placement.off_table() && !placement.stacked() {
        found.add(&pair.runs[0].name, "it stands on nothing and keeps to its path");
    }
    for (k, run) in pair.runs.iter().enumerate() {
        if led_about(pair, k, selection) {
            found.add(&run.name, "it kept to one axis over a long turn that was led about it");
        }
        if run.kind == Kind::Pull && run.target.as_deref() == Some(&pair.child) && pair.moved(k) {
            if !glides(run, pair, fit, placement) {
                found.add(
                    &run.name,
                    "it was pulled along a path on which nothing beneath could have carried it",
                );
            } else if guided(pair, k, fit, placement) {
                found.add(
                    &run.name,
                    "it kept to its path to and fro although the tool let it swing",
                );
            } else if upheld(capture, pair, k, placement) {
                found.add(
                    &run.name,
                    "it stayed upright under a pull that would have tipped what merely stands",
                );
            }
        }
    }
    found
}

/// Share of the way of a lift by which what stands may shift otherwise.
const SHIFTS: f64 = 0.1;

/// True where all that was seen of it is that a hand took one straight up off the other: so it goes with whatever stands there.
fn taken_off(pair: &Pair, fit: &Fit, placement: &Placement) -> bool {
    let turn = pair
        .runs
        .first()
        .and_then(|r| r.tracks[pair.parent.as_str()].rotation.iter().flatten().next());
    let axis = fit.manifold.axis.into_inner();
    let upright = turn.map_or(axis, |q| q * axis).dot(&placement.up).abs() > 0.95;
    // How far in lifts, and how far otherwise: what stands in a tray shifts a little when that is pushed.
    let farthest = |lifts: bool| {
        let own = (0..pair.runs.len()).filter(|k| (pair.runs[*k].kind == Kind::Lift) == lifts);
        own.map(|k| pair.excursion(k).0).fold(0.0, f64::max)
    };
    let straight = fit.manifold.kind == JointKind::Prismatic && upright;
    straight && (0..pair.runs.len()).any(|k| pair.moved(k)) && farthest(false) < SHIFTS * farthest(true)
}

/// True where the motion could be gliding on what lies beneath: a turn about the vertical, a shift along the level.
fn glides(run: &Interaction, pair: &Pair, fit: &Fit, placement: &Placement) -> bool {
    let turn = run.tracks[pair.parent.as_str()].rotation.iter().flatten().next();
    let axis = fit.manifold.axis.into_inner();
    let lean = turn.map_or(axis, |q| q * axis).dot(&placement.up).abs();
    match fit.manifold.kind {
        JointKind::Revolute => lean > 0.98,
        JointKind::Prismatic => lean < 0.17,
        JointKind::Screw => fit.manifold.pitch.abs() < 5e-4 && lean > 0.98,
        _ => true,
    }
}

/// A turn about one axis this long is no chance, rad.
const LONG_TURN: f64 = 1.0;
/// How far from the axis a tool is led about it at least: nearer it may turn what it holds on the spot, m.
const LED: f64 = 0.02;
/// By how much the noise may be understated for an axis to be one.
const WITHIN_NOISE: f64 = 2.0;

/// True where a tool led the child over a long turn about an axis that stayed where it is, and was itself led about that
/// axis; or where the child rose as a screw does. What is free is drawn along, or turned where it stands.
fn led_about(pair: &Pair, k: usize, selection: &Selection) -> bool {
    let (run, manifold) = (pair.runs[k], &selection.candidates[0].fit.manifold);
    let held = run.kind == Kind::Pull && run.target.as_deref() == Some(&pair.child);
    let long = pair.excursion(k).1 > LONG_TURN && selection.inflation < WITHIN_NOISE;
    let parent = &run.tracks[pair.parent.as_str()];
    let first = (0..parent.len()).find_map(|i| parent.pose(i));
    let (true, true, Some(pose), Some(path)) = (held, long, first, &run.tool_path) else {
        return false;
    };
    match manifold.kind {
        JointKind::Screw => (LONG_TURN * manifold.pitch).abs() > 6.0 * pair.samples[0].noise.position,
        JointKind::Revolute => path.position.iter().filter(|p| p.x.is_finite()).all(|p| {
            let arm = pose.0.inverse_transform_point(p).coords - manifold.point;
            arm.cross(&manifold.axis).norm() > LED
        }),
        _ => false,
    }
}

/// True where a tool that lets the child swing took it out and back, held off its middle, and it kept to the path: what
/// is merely dragged trails behind the pivot and folds on the way back (Mason 1986).
fn guided(pair: &Pair, k: usize, fit: &Fit, placement: &Placement) -> bool {
    let run = pair.runs[k];
    let (Some(tool), Some(path)) = (&run.tool, &run.tool_path) else {
        return false;
    };
    let Some(first) = path.position.first() else {
        return false;
    };
    let off = first.coords - placement.child_centre;
    let level = off - placement.up * placement.up.dot(&off);
    let positions: Vec<f64> = pair
        .samples
        .iter()
        .zip(&fit.projections)
        .filter(|(s, _)| s.run == k)
        .map(|(_, p)| p.z[0])
        .collect();
    let (Some(start), Some(end)) = (positions.first(), positions.last()) else {
        return false;
    };
    let far = positions.iter().map(|q| (q - start).abs()).fold(0.0, f64::max);
    let back = (end - start).abs() < 0.5 * far;
    tool.pin && level.norm() > 0.1 * placement.size && (back || thrust(pair, placement) >= THRUSTS)
}

/// Fewest motions in which a pivot behind the middle drove the child ahead of it, and the least way of each, m.
const THRUSTS: usize = 2;
const AHEAD: f64 = 0.02;

/// In how many motions a tool that lets the child swing drove it ahead of itself: what is free folds about such a pivot.
fn thrust(pair: &Pair, placement: &Placement) -> usize {
    let tracks: Vec<_> = pair.runs.iter().map(|r| &r.tracks[pair.child.as_str()]).collect();
    let ahead = |k: &usize| {
        let (track, run) = (tracks[*k], pair.runs[*k]);
        let (first, last) = (track.position.first()?, track.position.last()?);
        let pivot = run.tool_path.as_ref()?.position.first()?;
        // Its middle as this motion begins.
        let middle = placement.child_centre + (first - tracks[0].position.first()?);
        let (way, off) = (last - first, pivot.coords - middle);
        let off = off - placement.up * placement.up.dot(&off);
        let pinned = run.tool.as_ref().is_some_and(|t| t.pin) && run.target.as_deref() == Some(&pair.child);
        (pinned && way.norm() > AHEAD && off.norm() > 0.1 * placement.size)
            .then_some(off.dot(&way) < -0.9 * off.norm() * way.norm())
    };
    (0..pair.runs.len()).filter(|k| ahead(k) == Some(true)).count()
}

/// A thing that is denser than this would be metal through and through, kg/m³.
const DENSEST: f64 = 4000.0;
/// Seconds over which force is averaged before its moment is taken.
const MOMENT: f64 = 0.1;
/// Vertices this near to the lowest one bear on what is beneath, m.
const FOOT: f64 = 2.5e-3;

/// True where a free pivot pulled at the child, which stands on the parent, with a moment about the edge of its foot that
/// no weight of a likely density balances: `m g (x_edge - x_centre) >= h F_level + (x_edge - x_pivot) F_up` for what
/// stands (the centre of pressure stays within the foot). A pivot passes on no torque.
fn upheld(capture: &Capture, pair: &Pair, k: usize, placement: &Placement) -> bool {
    let run = pair.runs[k];
    let on_top = placement.up.dot(&(placement.child_centre - placement.parent_centre)) > 0.0;
    let pivot = run.tool.as_ref().is_some_and(|t| t.pin);
    let (Some(mesh), Some(force), Some(path)) = (&placement.child_mesh, &run.force, &run.tool_path) else {
        return false;
    };
    let (Some((low, _)), Some(at)) = (placement.heights(Some(mesh)), path.position.first()) else {
        return false;
    };
    if !on_top || !pivot || !placement.stacked() {
        return false;
    }
    let height = placement.up.dot(&at.coords) - low;
    let foot = || {
        mesh.vertices
            .iter()
            .filter(|v| placement.up.dot(&v.coords) < low + FOOT)
    };
    let rows = force
        .time
        .iter()
        .filter(|t| **t < force.time[0] + MOMENT)
        .count()
        .max(1);
    let needed = |chunk: &[Vector3<f64>]| -> Option<f64> {
        let pull = chunk.iter().sum::<Vector3<f64>>() / chunk.len() as f64;
        let rise = placement.up.dot(&pull);
        let level = pull - placement.up * rise;
        let ahead = level.try_normalize(1e-9)?;
        let edge = foot().map(|v| ahead.dot(&v.coords)).fold(f64::NEG_INFINITY, f64::max);
        let arm = (edge - ahead.dot(&placement.child_centre)).max(1e-4);
        let moment = height * level.norm() + (edge - ahead.dot(&at.coords)) * rise;
        Some(moment / (arm * capture.gravity.norm()))
    };
    let masses: Vec<f64> = force
        .force
        .chunks(rows)
        .filter_map(needed)
        .filter(|m| m.is_finite())
        .collect();
    quantile(&masses, 0.9).is_some_and(|mass| mass > DENSEST * mesh.volume())
}

/// Displacement from the first rows of a track to its farthest, averaged over blocks, where it is beyond noise.
fn displacement(capture: &Capture, name: &str, stream: &PoseStream) -> Option<Vector3<f64>> {
    let block = (stream.len() / 40).clamp(1, 12);
    let means: Vec<Vector3<f64>> = stream
        .position
        .chunks(block)
        .map(|rows| rows.iter().map(|p| p.coords).sum::<Vector3<f64>>() / rows.len() as f64)
        .filter(|p| p.x.is_finite())
        .collect();
    let first = means.first()?;
    let farthest = means
        .iter()
        .map(|p| p - first)
        .max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let noise = crate::capture::track_noise(capture, name).position / (block as f64).sqrt();
    (farthest.norm() > (8.0 * noise).max(1.5e-3)).then_some(farthest)
}

fn transmitted(capture: &Capture, pair: &Pair, run: &Interaction, fit: &Fit, placement: &Placement) -> bool {
    let Some(target) = run.target.as_deref() else {
        return false;
    };
    let (other, from, to) = if target == pair.child {
        (&pair.parent, placement.child_centre, placement.parent_centre)
    } else if target == pair.parent {
        (&pair.child, placement.parent_centre, placement.child_centre)
    } else {
        return false;
    };
    let Some(moved) = displacement(capture, other, &run.tracks[other.as_str()]) else {
        return false;
    };
    if placement.stacked() {
        let beneath = placement.up.dot(&(to - from)) < 0.0;
        return run.kind == Kind::Lift && beneath;
    }
    let apart = to - from;
    let level = apart - placement.up * placement.up.dot(&apart);
    let contained = level.norm() < 0.3 * placement.size;
    let cosine = if contained {
        0.0
    } else {
        moved.normalize().dot(&level.normalize())
    };
    if fit.manifold.kind != JointKind::Prismatic || run.kind == Kind::Lift {
        return cosine < 0.7;
    }
    let parent = &run.tracks[pair.parent.as_str()];
    let turn = parent.rotation.iter().flatten().next();
    let axis = turn.map_or(fit.manifold.axis.into_inner(), |q| q * fit.manifold.axis.into_inner());
    let along = moved.normalize().dot(&axis).abs();
    (along < 0.87 && cosine < 0.7) || cosine < -0.5
}

/// One axis through everything although the pushes came from different directions or places.
fn persistent_axis(pair: &Pair, found: &mut Coupling) {
    let pushes: Vec<(usize, Vector3<f64>, Vector3<f64>)> = (0..pair.runs.len())
        .filter(|&i| pair.excursion(i).1 > 0.06)
        .filter_map(|i| {
            let path = pair.runs[i].tool_path.as_ref()?;
            let (first, last) = (path.position.first()?, path.position.last()?);
            let way = path
                .position
                .iter()
                .map(|p| p - first)
                .max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            (way.norm() > 1e-3).then_some((i, way.normalize(), last.coords))
        })
        .collect();
    for (k, a) in pushes.iter().enumerate() {
        for b in &pushes[k + 1..] {
            if a.1.dot(&b.1) < 0.5 {
                found.add(&pair.runs[a.0].name, "one axis under pushes in different directions");
                found.add(&pair.runs[b.0].name, "one axis under pushes in different directions");
            }
        }
    }
}
