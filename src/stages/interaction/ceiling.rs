//! A force sensor that ends before its noise: readings of pushes scatter about one level, which none exceeds.
//!
//! Dry friction makes a level too, the same in every direction and at every speed. What parts the two is how it is reached:
//! a body that is brought up to the speed of the tool takes momentum beyond what its friction takes, so a force that
//! rises into a friction level overshoots it, the more the faster the tool. One that is cut off stops at a corner.

use super::clipped::Along;
use crate::capture::{Capture, Clipped, Interaction, Kind};
use crate::math::{mad_sd, median};

/// How far the largest reading lies above the level, in standard deviations of the noise.
const ABOVE: [f64; 2] = [1.5, 5.5];
/// Where it is looked for below the largest reading, and from how far it is found, in the same.
const STARTS: [f64; 6] = [2.0, 2.5, 3.0, 3.5, 4.0, 4.5];
const NEAR: f64 = 1.5;
/// Readings that stand at it are not farther below it, in standard deviations.
const BELOW: f64 = 3.0;
/// Readings of a stop at least, and seconds; and its length over that of the rise before it.
const STOP: (usize, f64, f64) = (8, 0.02, 3.0);
/// Scatter of a stop over the noise, but for chance; and how far off its mean may be, as a share.
const SCATTER: f64 = 1.25;
const OFF: f64 = 0.003;
/// Seconds in which a body is brought up to the speed of the tool.
const BLOW: f64 = 0.15;
/// Share of the momentum that it must have got which may be seen above friction, and by how many standard deviations the rest
/// is missed.
const SEEN: f64 = 0.3;
const MISSED: f64 = 5.0;
/// Least mass per friction force: no dry friction is more than the weight, s²/m.
const LIGHTEST: f64 = 1.0 / 9.81;
/// Pushes that prove a level where their momentum is missed, and where only their tops are flat; and least share of all.
const PROOF: (usize, usize, f64) = (2, 3, 0.2);
/// Highest speed over the lowest of pushes whose tops prove a level by being flat: like blows peak alike.
const UNLIKE: f64 = 1.5;
/// Least range of a direction over the largest reading in any: those of a sensor's axes differ up to threefold, what leaks into one
/// from the others stands at a level where they do.
const RANGE: f64 = 0.3;
/// Readings whose mean does not exceed a level, and by how many of its standard deviations chance may lift it.
const RUN: (usize, f64) = (16, 5.0);
/// Readings on either side that tell whether one belongs to a stop, and share of them that do.
const BESIDE: usize = 4;
const MOST: f64 = 0.4;

/// The limit of the sensor, where pushes prove one that its noise blurs.
pub(super) fn ceiling_of(capture: &Capture) -> Option<Clipped> {
    let pushes: Vec<&Interaction> = capture.interactions.iter().filter(|i| pushed(i)).collect();
    let noise = noise_of(&pushes)?;
    let largest = pushes.iter().flat_map(|i| Along::Size.stream(i));
    let largest = largest.filter(|x| x.is_finite()).fold(0.0, f64::max);
    let found = Along::ALL.into_iter().filter_map(|along| {
        let streams: Vec<Vec<f64>> = pushes.iter().map(|i| along.stream(i)).collect();
        let (all, level) = level_of(&pushes, &streams, noise)?;
        (level > RANGE * largest).then_some((all, level, along))
    });
    // The direction that is cut off stops most often: others do by its leave.
    let (_, level, along) = found.max_by_key(|(all, ..)| *all)?;
    let rows: Vec<Vec<usize>> = capture
        .interactions
        .iter()
        .map(|i| rows_at(&along.stream(i), level, noise))
        .collect();
    let readings = capture.interactions.iter().filter_map(|i| i.force.as_ref());
    let count: usize = rows.iter().map(Vec::len).sum();
    Some(Clipped {
        limit: level,
        readings: readings.map(|f| f.force.len()).sum(),
        sd: noise / (count.max(1) as f64).sqrt(),
        rows,
    })
}

fn pushed(interaction: &Interaction) -> bool {
    interaction.kind == Kind::Push && interaction.tool_path.is_some() && interaction.force.is_some()
}

/// Scatter of the readings of force about their neighbours, N.
fn noise_of(pushes: &[&Interaction]) -> Option<f64> {
    let axis = |i: &Interaction, k: usize| {
        let pairs = i.force.iter().flat_map(|f| f.force.windows(2));
        let steps: Vec<f64> = pairs.map(|w| w[1][k] - w[0][k]).filter(|d| d.is_finite()).collect();
        mad_sd(&steps).map(|s| s / 2.0_f64.sqrt())
    };
    let each: Vec<f64> = pushes.iter().flat_map(|i| (0..3).filter_map(|k| axis(i, k))).collect();
    median(&each).filter(|n| *n > 0.0)
}

/// The level at which most pushes stop, below the largest reading by what noise adds to it, and how many do.
fn level_of(pushes: &[&Interaction], streams: &[Vec<f64>], noise: f64) -> Option<(usize, f64)> {
    let finite = streams.iter().flatten().copied().filter(|x| x.is_finite());
    let most = finite.fold(0.0, f64::max);
    let stops = |level: f64, loose: f64| -> Vec<Stop> {
        let each = pushes.iter().zip(streams);
        each.filter_map(|(i, s)| stop_of(i, s, (level, loose), noise)).collect()
    };
    let tried = STARTS.iter().filter_map(|k| {
        let start = most - k * noise;
        let means: Vec<f64> = stops(start, NEAR * noise).iter().map(|s| s.mean).collect();
        let level = median(&means).filter(|l| *l > 10.0 * noise)?;
        let above = (most - level) / noise;
        let found = stops(level, 0.0);
        let missed = found.iter().filter(|s| s.missed).count();
        let many = found.len() as f64 >= PROOF.2 * pushes.len() as f64;
        let held = streams.iter().all(|s| stays_below(s, level, noise));
        let flat = found.len() >= PROOF.1 && unlike(&found);
        let proven = held && many && (missed >= PROOF.0 || flat) && above > ABOVE[0] && above < ABOVE[1];
        proven.then_some((found.len(), level))
    });
    tried.max_by_key(|(all, _)| *all)
}

/// Whether pushes that stop at one level began at unlike speeds: a static peak is as high after every like blow, and as flat as
/// the noise is large.
fn unlike(stops: &[Stop]) -> bool {
    let fast = stops.iter().map(|s| s.speed).fold(0.0, f64::max);
    let slow = stops.iter().map(|s| s.speed).fold(f64::INFINITY, f64::min);
    fast > UNLIKE * slow
}

/// Whether no run of readings lies above a level but by chance: what is cut off before its noise exceeds it by noise alone.
fn stays_below(sizes: &[f64], level: f64, noise: f64) -> bool {
    let most = level * (1.0 + OFF) + RUN.1 * noise / (RUN.0 as f64).sqrt();
    sizes.windows(RUN.0).all(|run| mean(run) <= most)
}

/// How a push's force comes to a stop: the mean of its readings, N, whether the momentum of the body is missed in them, and the
/// speed of the tool, m/s.
struct Stop {
    mean: f64,
    missed: bool,
    speed: f64,
}

/// Where a push's force comes to a stop at a level, to within chance and `loose`; nothing where it comes to none.
fn stop_of(interaction: &Interaction, sizes: &[f64], (level, loose): (f64, f64), noise: f64) -> Option<Stop> {
    let time = &interaction.force.as_ref()?.time;
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let step = median(&steps).filter(|s| *s > 0.0)?;
    let arrives = |i: &usize| {
        let next = sizes.get(*i..*i + 5).map(mean);
        sizes[*i] > level - 2.5 * noise && next.is_some_and(|m| m > level - 1.5 * noise)
    };
    let at = (5..sizes.len()).find(arrives)?;
    let half = (0..at).rfind(|i| sizes[*i] < 0.5 * level)?;
    let length = ((STOP.2 * (at - half) as f64) as usize)
        .max(STOP.0)
        .max((STOP.1 / step) as usize);
    let stop = sizes.get(at + 1..at + 1 + length)?;
    let n = length as f64;
    let middle = mean(stop);
    let scatter = (stop.iter().map(|x| (x - middle).powi(2)).sum::<f64>() / n).sqrt();
    let flat = (middle - level).abs() < (3.0 * noise / n.sqrt() + OFF * level).max(loose)
        && scatter < SCATTER * noise * (1.0 + 2.0 / (2.0 * n).sqrt());
    if !flat {
        return None;
    }
    let until = sizes.len().min(at + (BLOW / step) as usize);
    let later: Vec<f64> = sizes[at..].iter().copied().filter(|x| *x > 0.5 * level).collect();
    let friction = median(&later)?.min(level);
    // What is above friction speeds the body up, above the level or not.
    let over: f64 = sizes[at..until].iter().map(|x| (x - friction) * step).sum();
    let speed = speed_after(interaction, time[at])?;
    let momentum = LIGHTEST * friction * speed;
    let doubt = noise * step * ((until - at) as f64).sqrt();
    let missed = over < SEEN * momentum && (1.0 - SEEN) * momentum > MISSED * doubt;
    // A level that stays is one of friction, unless momentum is missed; a flat top above it is none.
    (missed || friction < level - noise).then_some(Stop {
        mean: middle,
        missed,
        speed,
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Speed of the tool in the tenth of a second after `t`, m/s.
fn speed_after(interaction: &Interaction, t: f64) -> Option<f64> {
    const SPAN: f64 = 0.1;
    let path = interaction.tool_path.as_ref()?;
    let place = |t: f64| path.sample(t).map(|p| p.0);
    let end = (t + SPAN).min(*path.time.last()?);
    Some((place(end)? - place(t)?).norm() / SPAN)
}

/// Rows that stand at the level; none where readings exceed it.
fn rows_at(sizes: &[f64], level: f64, noise: f64) -> Vec<usize> {
    if sizes.iter().any(|x| *x > level + ABOVE[1] * noise) {
        return Vec::new();
    }
    let at: Vec<bool> = sizes.iter().map(|x| *x > level - BELOW * noise).collect();
    let within = |i: usize| {
        let near = &at[i.saturating_sub(BESIDE)..(i + BESIDE + 1).min(at.len())];
        near.iter().filter(|a| **a).count() as f64 > MOST * near.len() as f64
    };
    (0..at.len()).filter(|i| at[*i] || within(*i)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion, Vector3};

    use super::*;
    use crate::capture::{Noise, PoseStream, WrenchStream};

    const SPEEDS: [f64; 4] = [0.02, 0.035, 0.08, 0.16];

    /// A body of half a kilogram on dry friction of 1.5 N, pushed by a springy tip at a steady speed; forces above `limit` (N)
    /// are cut off before the noise.
    fn push(k: usize, limit: f64) -> Interaction {
        const STEP: f64 = 1e-4;
        let (mass, friction, stiffness, damping) = (0.5, 1.5, 3000.0, 20.0);
        let (mut place, mut speed) = (0.0, 0.0_f64);
        let (mut wrench, mut path) = (WrenchStream::default(), PoseStream::default());
        for i in 0..12_000 {
            let t = f64::from(i) * STEP;
            let tip = SPEEDS[k] * (t - 0.2);
            let deep = tip - place;
            let force = if deep > 0.0 {
                (stiffness * deep + damping * (SPEEDS[k] - speed)).max(0.0)
            } else {
                0.0
            };
            let pulled = if speed > 0.0 {
                force - friction
            } else {
                (force - friction).max(0.0)
            };
            speed = (speed + pulled / mass * STEP).max(0.0);
            place += speed * STEP;
            if i % 20 == 0 {
                let dice = |seed: f64| {
                    let x = ((f64::from(i) + 7919.0 * k as f64) * seed).sin() * 43_758.545_3;
                    x - x.floor()
                };
                // The sum of four even dice is nearly normal.
                let noise = 0.03 * 3.0_f64.sqrt() * (dice(12.9898) + dice(78.233) + dice(37.719) + dice(4.581) - 2.0);
                wrench.time.push(t);
                wrench
                    .force
                    .push(Vector3::new(force.min(limit) + noise, noise * 0.7, noise * 0.4));
                path.time.push(t);
                path.position.push(Point3::new(tip, 0.0, 0.0));
                path.rotation.push(Some(UnitQuaternion::identity()));
            }
        }
        Interaction {
            name: format!("push-{k}"),
            kind: Kind::Push,
            action: None,
            tool_name: None,
            tool: None,
            target: None,
            force: Some(wrench),
            tool_path: Some(path),
            support_path: None,
            tracks: Default::default(),
            frames: None,
            held_out: false,
        }
    }

    fn capture(limit: f64) -> Capture {
        Capture {
            root: Default::default(),
            name: "made-up".into(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            support: None,
            cameras: Vec::new(),
            views: Vec::new(),
            bodies: Vec::new(),
            noise: Noise::default(),
            interactions: (0..SPEEDS.len()).map(|k| push(k, limit)).collect(),
            truth: None,
            digest: String::new(),
        }
    }

    #[test]
    fn a_range_that_ends_below_friction_is_no_friction() {
        let found = ceiling_of(&capture(1.2)).expect("a limit");
        assert!((found.limit - 1.2).abs() < 0.01, "{}", found.limit);
        assert!(found.rows.iter().all(|r| r.len() > 100));
    }

    #[test]
    fn tops_prove_a_level_after_unlike_blows_only() {
        let stop = |speed: f64| Stop {
            mean: 1.0,
            missed: false,
            speed,
        };
        assert!(!unlike(&[stop(0.004), stop(0.0045), stop(0.0037)]));
        assert!(unlike(&[stop(0.004), stop(0.0045), stop(0.02)]));
    }

    #[test]
    fn dry_friction_is_no_end_of_a_range() {
        assert!(ceiling_of(&capture(f64::INFINITY)).is_none());
    }
}
