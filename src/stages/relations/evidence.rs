//! What one interaction says about two things: did they come apart, did they go along, and what else than a
//! bond could have carried them.

use nalgebra::{UnitQuaternion, Vector3};

use super::Config;
use super::breakaway::{Gave, lifted_off, pushed_off};
use super::placing::{Bearing, Placed, may_bear};
use crate::capture::{Capture, Interaction, Kind, PoseStream, RelativePose, TrackNoise, relative_motion, track_noise};

/// What one interaction showed.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The interaction.
    pub interaction: String,
    /// Natural log of the odds that it gives to `fixed` against `resting`; 0 says nothing.
    pub log_odds: f64,
    /// They came apart in it.
    pub parted: bool,
    /// A bond gave way in it, or may have.
    pub gave: Option<Gave>,
    /// Where one stood in the frame of the other when it began, m, and how finely that is known.
    pub start: (Vector3<f64>, f64),
}

impl Finding {
    /// True where it began with the two as they were when `other` began.
    pub fn begins_as(&self, other: &Finding, config: &Config) -> bool {
        let noise = self.start.1.hypot(other.start.1);
        (self.start.0 - other.start.0).norm() < config.parted.max(4.0 * noise)
    }
}

/// Rows that are averaged before they are compared.
const BLOCK: usize = 8;
/// Log odds of a bond when a lift of the upper one brings the lower one along: nothing else does that.
const LIFTED: f64 = 7.0;
/// Log odds of a bond when a push of the upper one takes both along: strong friction does that too.
const PUSHED_UPPER: f64 = 1.0;
/// Log odds of a bond when a push of the lower one takes both along: friction does that.
const PUSHED_LOWER: f64 = 0.2;
/// Log odds against a bond when the two came apart.
const PARTED: f64 = -7.0;

/// What an interaction says about `a` and `b`, where both were tracked and one was meant to be touched.
pub fn finding(
    capture: &Capture,
    run: &Interaction,
    (first, second): (&Placed, &Placed),
    bearing: Bearing,
    up: &Vector3<f64>,
    config: &Config,
) -> Option<Finding> {
    let (a, b) = (first.name.as_str(), second.name.as_str());
    let (track_a, track_b) = (run.tracks.get(a)?, run.tracks.get(b)?);
    let noise = (track_noise(capture, a), track_noise(capture, b));
    let relative = relative_motion(track_a, track_b);
    if relative.is_empty() {
        return None;
    }
    let parting = parting(&relative, noise, config);
    let moved = (moved(track_a, noise.0), moved(track_b, noise.1));
    let upper = match bearing {
        Bearing::SecondOnTop => Some(second),
        Bearing::FirstOnTop => Some(first),
        Bearing::Beside | Bearing::Perhaps => None,
    };
    let gave = parting.and_then(|t| {
        let lifted = lifted_off(run, t, upper).map(|pull| Gave {
            log_odds: LIFTED,
            force: pull,
        });
        lifted.or_else(|| pushed_off(run, t, upper?))
    });
    let log_odds = match (parting, &gave) {
        (Some(_), Some(gave)) => gave.log_odds,
        (Some(_), None) => PARTED,
        (None, _) if moved.0 && moved.1 => match run.kind {
            Kind::Lift if borne(run, (first, second), bearing, up) => 0.0,
            _ => together(run, upper),
        },
        (None, _) => 0.0,
    };
    let rows = &relative[..relative.len().min(BLOCK)];
    let lever = noise.0.rotation * mean(rows).1.norm();
    let spread = noise.0.position.hypot(noise.1.position).hypot(lever) / (rows.len() as f64).sqrt();
    (log_odds != 0.0).then(|| Finding {
        interaction: run.name.clone(),
        log_odds,
        parted: parting.is_some(),
        gave,
        start: (mean(rows).1, spread),
    })
}

/// True where a lift takes the two along without a bond: a third was lifted, which may bear both, or the one that was
/// lifted may bear the other from beneath.
fn borne(run: &Interaction, (a, b): (&Placed, &Placed), bearing: Bearing, up: &Vector3<f64>) -> bool {
    let Some(target) = run.target.as_deref().filter(|t| run.tracks.contains_key(*t)) else {
        return false;
    };
    let (lifted, other) = match target {
        t if t == a.name => (a, b),
        t if t == b.name => (b, a),
        _ => return true,
    };
    matches!(bearing, Bearing::Beside | Bearing::Perhaps) && may_bear(lifted, other, up)
}

/// What it says that the two moved as one.
fn together(run: &Interaction, upper: Option<&Placed>) -> f64 {
    let touches_upper = upper.is_some_and(|u| run.target.as_deref() == Some(&u.name));
    match run.kind {
        Kind::Toss => LIFTED,
        Kind::Lift if upper.is_none() || touches_upper => LIFTED,
        Kind::Push | Kind::Pull if touches_upper => PUSHED_UPPER,
        Kind::Push | Kind::Pull if upper.is_some() => PUSHED_LOWER,
        Kind::Pull => 0.5,
        _ => 0.0,
    }
}

/// The time at which the relative pose left its first value beyond noise and stayed away, if it did.
fn parting(relative: &[RelativePose], noise: (TrackNoise, TrackNoise), config: &Config) -> Option<f64> {
    let blocks: Vec<(f64, Vector3<f64>, Option<UnitQuaternion<f64>>)> = relative.chunks(BLOCK).map(mean).collect();
    let first = blocks.first()?;
    let lever = noise.0.rotation * first.1.norm();
    let count = (BLOCK.min(relative.len()) as f64).sqrt();
    let position = (noise.0.position.hypot(noise.1.position).hypot(lever)) / count;
    let rotation = noise.0.rotation.hypot(noise.1.rotation) / count;
    let away = |block: &(f64, Vector3<f64>, Option<UnitQuaternion<f64>>)| {
        let turn = match (block.2, first.2) {
            (Some(q), Some(p)) => q.angle_to(&p),
            _ => 0.0,
        };
        (block.1 - first.1).norm() > (6.0 * position).max(config.parted) || turn > (7.0 * rotation).max(0.02)
    };
    if blocks.len() < 4 {
        return blocks.last().filter(|b| away(b)).map(|b| b.0);
    }
    blocks.windows(2).find(|w| away(&w[0]) && away(&w[1])).map(|w| w[0].0)
}

fn mean(rows: &[RelativePose]) -> (f64, Vector3<f64>, Option<UnitQuaternion<f64>>) {
    let count = rows.len() as f64;
    let position = rows.iter().map(|r| r.position).sum::<Vector3<f64>>() / count;
    let rotation = rows[0].rotation.map(|first| {
        let turn = rows
            .iter()
            .filter_map(|r| r.rotation)
            .map(|q| (q * first.inverse()).scaled_axis())
            .sum::<Vector3<f64>>()
            / count;
        UnitQuaternion::from_scaled_axis(turn) * first
    });
    (rows[0].time, position, rotation)
}

/// True where a track left its first place beyond noise, by at least 1.5 mm or 0.02 rad.
pub fn moved(stream: &PoseStream, noise: TrackNoise) -> bool {
    excursion(stream, noise).is_some()
}

/// The farthest displacement of a track from its first rows, where it is beyond noise.
pub fn excursion(stream: &PoseStream, noise: TrackNoise) -> Option<Vector3<f64>> {
    let world = PoseStream {
        time: vec![stream.time.first().copied()?, stream.time.last().copied()?],
        position: vec![nalgebra::Point3::origin(); 2],
        rotation: vec![Some(UnitQuaternion::identity()); 2],
    };
    let rows = relative_motion(&world, stream);
    let blocks: Vec<_> = rows.chunks(BLOCK).map(mean).collect();
    let first = blocks.first()?;
    let count = (BLOCK.min(rows.len()) as f64).sqrt();
    let farthest = blocks
        .iter()
        .map(|b| b.1 - first.1)
        .max_by(|x, y| x.norm().total_cmp(&y.norm()))?;
    let turned = blocks.iter().any(|b| match (b.2, first.2) {
        (Some(q), Some(p)) => q.angle_to(&p) > (8.0 * noise.rotation / count).max(0.02),
        _ => false,
    });
    (turned || farthest.norm() > (8.0 * noise.position / count).max(1.5e-3)).then_some(farthest)
}
