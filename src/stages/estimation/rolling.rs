//! Round bodies that roll on once nothing touches them, and what slows them.
//!
//! Rolling without resistance on a level support keeps its speed. Where the support's push acts a length `k` ahead of the middle
//! (Johnson, *Contact Mechanics*, 1985, section 9.1), the body loses `g k R / (R² + ρ²)` of speed a second, with its radius `R`
//! and its radius of gyration `ρ` about the axis that it turns on.

use nalgebra::{DMatrix, DVector, Point3, UnitQuaternion, Vector3};

use super::company::alone;
use super::facts::{Ground, ground_of, subject};
use super::pool::pooled;
use super::solid::solid_of;
use crate::capture::{Capture, Interaction, Kind, PhaseKind, PoseStream, Segmented};
use crate::math::{effective_samples, median, weighted_linear};
use crate::twin::Model;

/// Time after the tool is gone from which on it rolls freely, s.
const SETTLED: f64 = 0.06;
/// Stretches over which a speed is taken, s; the share of the first speed below which it has come to rest, and the least speed, m/s.
const PACE: f64 = 0.1;
const STOPS: f64 = 0.25;
const ROLLS: f64 = 0.015;
/// How far the turn may be from that of rolling, as a share.
const SLIPS: f64 = 0.12;
/// How far from its last height a body is that still bounces, m, and standard deviations of its place.
const LEVEL: (f64, f64) = (5e-4, 5.0);
/// Squares of what is left of the way of a thrown thing that runs on, over those of the noise.
const RUNS_ON: f64 = 10.0;
/// Fewest poses of a way.
const FEWEST: usize = 15;
/// Poses that lean before it counts.
const FEW: usize = 3;
/// Scatter of rolling resistance from push to push, as a share; standard deviations from none from which on the twin has it.
const SCATTER: f64 = 0.1;
const CLEAR: f64 = 3.0;
/// Share of its way after which it is foretold.
const BEGINS: f64 = 1.0 / 3.0;

/// Leaning of a body beyond which it rolls or tips rather than slides, rad.
const LEANS: f64 = 0.35;

/// Whether a thing rolls or tips over in an interaction: its friction on the support does not show then.
pub fn tumbles(track: &PoseStream, normal: &Vector3<f64>) -> bool {
    let mut turns = track.rotation.iter().flatten();
    let Some(first) = turns.next() else { return false };
    let leaning = turns.filter(|q| (*q * first.inverse() * normal).angle(normal) > LEANS);
    // One stray pose is none.
    leaning.take(FEW).count() == FEW
}

/// A body that rolled on freely after a push.
#[derive(Clone, Debug)]
pub struct Rolled {
    /// The link.
    pub link: String,
    /// Which push.
    pub interaction: String,
    /// It was not used to fit.
    pub held_out: bool,
    /// Seconds, as in the recording, and the way since the first of them, m.
    pub time: Vec<f64>,
    /// m.
    pub way: Vec<f64>,
    /// Noise of the way, m.
    pub noise: f64,
    /// Unit direction in which it rolled, world.
    pub heading: Vector3<f64>,
    /// Mean speed, m/s.
    pub speed: f64,
    /// Speed lost a second, m/s², with its standard deviation.
    pub slowing: (f64, f64),
    /// Length of rolling resistance for each m/s² of slowing, s².
    pub length: f64,
    /// `(R² + ρ²)/R²`.
    pub inert: f64,
}

impl Rolled {
    /// What of `R² + ρ²` the inside of a body leaves open, as a share: a hollow ball has 1.19 times that of a full one.
    pub const OPEN: f64 = 0.08;

    /// The way that it should go if it lost `slowing` (m/s²) of speed a second, m: from the first third of its way, which
    /// is no prediction and `NaN` here.
    pub fn foretold(&self, slowing: f64) -> Vec<f64> {
        let n = self.time.len();
        let first = ((n as f64 * BEGINS) as usize).clamp(5, n);
        let t: Vec<f64> = self.time.iter().map(|t| t - self.time[0]).collect();
        let fallen = |t: f64| -0.5 * slowing * t * t;
        let matrix = DMatrix::from_fn(first, 2, |i, j| if j == 0 { 1.0 } else { t[i] });
        let right = DVector::from_fn(first, |i, _| self.way[i] - fallen(t[i]));
        let Some(fit) = weighted_linear(&matrix, &right, &DVector::from_element(first, 1.0)) else {
            return vec![f64::NAN; n];
        };
        let one = |i: usize| {
            if i < first {
                f64::NAN
            } else {
                fit.x[0] + fit.x[1] * t[i] + fallen(t[i])
            }
        };
        (0..n).map(one).collect()
    }
}

/// Every push after which a body rolled on alone, and every toss of one that came to roll.
pub fn rolled(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Rolled> {
    let ground = ground_of(capture, &model.twin);
    let moved = |i: &&Interaction| matches!(i.kind, Kind::Push | Kind::Toss);
    let pushes = capture.interactions.iter().filter(moved);
    let one = |interaction: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let link = subject(interaction, cut)?;
        let thrown = interaction.kind == Kind::Toss;
        let by_itself = || alone(interaction, cut, link, &model.twin);
        (if thrown {
            interaction.tracks.len() == 1
        } else {
            by_itself()
        })
        .then_some(())?;
        rolled_on(interaction, cut, link, &ground, model)
    };
    pushes.filter_map(one).collect()
}

fn rolled_on(interaction: &Interaction, cut: &Segmented, name: &str, ground: &Ground, model: &Model) -> Option<Rolled> {
    let link = model.twin.link(name)?;
    let solid = solid_of(model.meshes.get(link.mesh.as_ref()?)?)?;
    let track = interaction.tracks.get(name).filter(|t| !t.is_snapshot_pair())?;
    let place = |i: usize| Some((track.pose(i)?.0 * solid.centroid, track.rotation[i]?));
    let rows: Vec<Row> = (0..track.len())
        .filter_map(|i| place(i).map(|(p, q)| (track.time[i], p, q)))
        .collect();
    let normal = ground.plane.normal;
    let noise = cut.position_noise.unwrap_or(3e-4).max(2e-5);
    let free = match interaction.kind {
        Kind::Toss => comes_to_roll(&rows, ground, noise)?,
        _ => cut.of(PhaseKind::Release).map(|p| p.start).reduce(f64::max)? + SETTLED,
    };
    let rows = while_it_moves(&rows[rows.partition_point(|r| r.0 < free)..])?;
    let (first, last) = (rows.first()?, rows.last()?);
    let along = last.1 - first.1;
    let heading = (along - normal * along.dot(&normal)).try_normalize(1e-3)?;
    let radius = median(
        &rows
            .iter()
            .map(|r| (r.1 - ground.point).dot(&normal))
            .collect::<Vec<_>>(),
    )?;
    let axis = normal.cross(&heading);
    let turned = turned_about(rows, &axis);
    if radius <= 0.0 || (turned * radius / along.dot(&heading) - 1.0).abs() > SLIPS {
        return None;
    }
    let own = first.2.inverse() * axis;
    let gyration = own.dot(&(solid.inertia * own)) / solid.volume;
    let inert = 1.0 + gyration / (radius * radius);
    let time: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let way: Vec<f64> = rows.iter().map(|r| (r.1 - first.1).dot(&heading)).collect();
    let matrix = DMatrix::from_fn(rows.len(), 3, |i, j| {
        let t = time[i] - time[0];
        [1.0, t, -0.5 * t * t][j]
    });
    let weights = DVector::from_element(rows.len(), noise.powi(-2));
    let fit = weighted_linear(&matrix, &DVector::from_vec(way.clone()), &weights)?;
    let left = fit.residuals.as_slice();
    let memory = (left.len() as f64 / effective_samples(left).max(1.0)).clamp(1.0, 10.0);
    let misfit = fit.residuals.norm_squared() / (noise * noise * (rows.len() as f64 - 3.0));
    // What runs into a thing is not slowed by rolling.
    if interaction.kind == Kind::Toss && misfit > RUNS_ON {
        return None;
    }
    Some(Rolled {
        link: name.to_owned(),
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        speed: along.dot(&heading) / (last.0 - first.0),
        time,
        way,
        noise,
        heading,
        slowing: (fit.x[2], fit.sd(2) * (memory * misfit.max(1.0)).sqrt()),
        length: radius * inert / ground.gravity.norm(),
        inert,
    })
}

/// One pose: time, centroid, turn.
type Row = (f64, Point3<f64>, UnitQuaternion<f64>);

/// How far a body turned about an axis from the first of these rows to the last, rad.
fn turned_about(rows: &[Row], axis: &Vector3<f64>) -> f64 {
    let steps = rows.windows(2);
    steps.map(|w| (w[1].2 * w[0].2.inverse()).scaled_axis().dot(axis)).sum()
}

/// When what was thrown has bounced and slid enough, s: from then on it keeps the height at which it ends, and turns as it goes.
fn comes_to_roll(rows: &[Row], ground: &Ground, noise: f64) -> Option<f64> {
    let normal = &ground.plane.normal;
    let heights: Vec<f64> = rows.iter().map(|r| (r.1 - ground.point).dot(normal)).collect();
    let rest = median(&heights[2 * heights.len() / 3..])?;
    let near = LEVEL.0.max(LEVEL.1 * noise);
    let from = heights
        .iter()
        .rposition(|h| (h - rest).abs() > near)
        .map_or(0, |i| i + 1);
    let rolls = |i: &usize| {
        let until = rows.partition_point(|r| r.0 <= rows[*i].0 + PACE).min(rows.len());
        let part = &rows[*i..until];
        let gone = part.last().map_or_else(Vector3::zeros, |r| r.1 - part[0].1);
        let Some(heading) = gone.try_normalize(1e-4) else {
            return false;
        };
        let turned = turned_about(part, &normal.cross(&heading)) * rest;
        gone.norm() > (ROLLS * PACE).max(5.0 * noise) && (turned / gone.norm() - 1.0).abs() < SLIPS
    };
    (from..rows.len()).find(rolls).map(|i| rows[i].0 + SETTLED)
}

/// The rows until it has all but stopped, or the recording ends; `None` where it never rolled on.
fn while_it_moves(rows: &[Row]) -> Option<&[Row]> {
    let speed_at = |i: usize| {
        let later = rows.get(rows.partition_point(|r| r.0 <= rows[i].0 + PACE))?;
        Some((later.1 - rows[i].1).norm() / (later.0 - rows[i].0))
    };
    let at_first = if rows.is_empty() { None } else { speed_at(0) }.filter(|v| *v > ROLLS)?;
    let stopped = (0..rows.len()).find(|i| speed_at(*i).is_some_and(|v| v < STOPS * at_first));
    let moving = &rows[..stopped.map_or(rows.len(), |i| i + 1)];
    (moving.len() >= FEWEST).then_some(moving)
}

/// Writes the length of rolling resistance of links that rolled, where it stands out.
pub(super) fn write_rolling(capture: &Capture, segmented: &[Segmented], model: &mut Model) {
    let all = rolled(capture, segmented, model);
    let mut names: Vec<&str> = all.iter().map(|r| r.link.as_str()).collect();
    names.dedup();
    for name in names {
        let own: Vec<&Rolled> = all.iter().filter(|r| r.link == name && !r.held_out).collect();
        let trials: Vec<(f64, f64)> = own
            .iter()
            .map(|r| (r.slowing.0 * r.length, r.slowing.1 * r.length))
            .collect();
        let from: Vec<String> = own.iter().map(|r| r.interaction.clone()).collect();
        let middle = median(&trials.iter().map(|t| t.0).collect::<Vec<_>>()).unwrap_or(0.0);
        let found = pooled(&trials, SCATTER, Rolled::OPEN * middle.abs(), "m", from, "rolling-on");
        let clear = found.filter(|e| e.sd.is_some_and(|sd| e.value > CLEAR * sd));
        if let (Some(found), Some(link)) = (clear, model.twin.link_mut(name)) {
            link.friction.rolling = Some(found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::estimation::push::Plane;

    /// A ball of 20 mm that falls 20 mm, hops once, slides without turning until 0.5 s and rolls from then on.
    #[test]
    fn a_ball_rolls_once_it_has_hopped_and_slid() {
        let height = |t: f64| match t {
            t if t < 0.06 => 0.04 - 4.9 * t * t,
            t if t < 0.2 => 0.02 + 4.9 * (t - 0.06) * (0.2 - t),
            _ => 0.02,
        };
        let rows: Vec<Row> = (0..100)
            .map(|i| {
                let t = 0.01 * f64::from(i);
                let turned = 0.3 * (t - 0.5).max(0.0) / 0.02;
                let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * turned);
                (t, Point3::new(0.3 * t, 0.0, 0.75 + height(t)), turn)
            })
            .collect();
        let ground = Ground {
            gravity: -9.81 * Vector3::z(),
            plane: Plane::of(Vector3::z()),
            point: Point3::new(0.0, 0.0, 0.75),
        };
        let from = comes_to_roll(&rows, &ground, 1e-4).expect("it rolls");
        assert!((0.45..0.65).contains(&from), "{from}");
        assert!(comes_to_roll(&rows[..50], &ground, 1e-4).is_none());
    }
}
