//! A part that swings inside a body that hangs on the tool and is moved to and fro: no friction of the ground is in it.
//!
//! The part of mass `m2` hangs on a spring and a damper inside, at `y` along each axis of the room:
//! `y'' = 2 ζ ω (c' − y') + ω² (c − y)`, and what the tool feels is `F = m c'' + m2 (y'' − c'') + const`. Both are read in the weak form of
//! [`super::twist`], in which nothing but the bumps has to be differentiated; a drag and a delay of the force stand beside them.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::facts::subject;
use super::lift::aloft;
use super::twist::{DENSE, STEP, noise_gain, weighed};
use crate::capture::{Capture, Interaction, Kind, Segmented, position_noise};
use crate::math::weighted_linear;
use crate::twin::{Link, Model};

/// Rates, rad/s, and damping ratios from which a search starts; how often it is made finer, and by what factor.
const RATES: [f64; 11] = [8.0, 10.0, 12.5, 15.5, 19.0, 23.5, 29.0, 36.0, 45.0, 56.0, 70.0];
const RATIOS: [f64; 4] = [0.03, 0.08, 0.2, 0.45];
const FINER: usize = 6;
const BY: f64 = 0.55;
/// Step of an integration over the period over 2π.
const RESOLVES: f64 = 0.2;
/// Half of the time over which the rate of the force is told, s.
const LATE: f64 = 0.02;
/// Bumps that overlap by so much say so many times what as many of their own would.
const OVERLAP: f64 = 2.0;
/// Fewest bumps, and by how much what is sped up is above what noise of the track makes of it.
const FEWEST: usize = 40;
const CLEAR: f64 = 10.0;

/// A part that swings in what hung on the tool.
#[derive(Clone, Debug)]
pub struct Sloshing {
    /// The link that hung on the tool.
    pub link: String,
    /// The lifts that were fitted, and those that were not.
    pub from: Vec<String>,
    /// See `from`.
    pub held_out: Vec<String>,
    /// Share of the mass that swings, its rate, rad/s, and its damping ratio, each with its standard deviation.
    pub share: (f64, f64),
    /// See `share`.
    pub rate: (f64, f64),
    /// See `share`.
    pub damping: (f64, f64),
    /// Log-likelihood over that of a body that is rigid, nats.
    pub gain: f64,
    /// The same of each lift, foretold with the part as the others say it.
    pub foretold: Vec<f64>,
    /// Root mean square of what a rigid body and this one leave of the force, N, where lifts were held out of those.
    pub left: [f64; 2],
}

/// One axis of the room of one lift.
struct Axis {
    place: Vec<f64>,
    /// When the bumps are highest, s.
    middles: Vec<f64>,
    /// What is sped up, the drag, the rate of the force, the force, and what a constant weighs.
    rows: Vec<[f64; 5]>,
}

impl Axis {
    fn new((time, place): (&[f64], Vec<f64>), (times, force): (&[f64], &[f64]), stretch: &Range<f64>) -> Self {
        let ones = vec![1.0; time.len()];
        let count = ((stretch.end - stretch.start) / STEP) as usize;
        let row = |k: usize| -> Option<(f64, [f64; 5])> {
            let middle = stretch.start + k as f64 * STEP;
            let own = |order: usize| weighed(time, &place, (middle, order), DENSE);
            let felt = |later: f64| weighed(times, force, (middle + later, 0), DENSE);
            let rate = (felt(LATE)? - felt(-LATE)?) / (2.0 * LATE);
            let level = weighed(time, &ones, (middle, 0), DENSE)?;
            let row = [own(2)?, -own(1)?, rate, felt(0.0)?, level];
            row.iter().all(|x| x.is_finite()).then_some((middle, row))
        };
        let (middles, rows) = (0..count).filter_map(row).unzip();
        Self { place, middles, rows }
    }
}

struct Lift {
    name: String,
    held_out: bool,
    time: Vec<f64>,
    axes: Vec<Axis>,
}

impl Lift {
    /// Balances with the constant of each axis taken out: what is sped up, what swings beyond that, drag, rate of the force; and the
    /// force.
    fn rows(&self, swing: Option<[f64; 2]>) -> Vec<[f64; 5]> {
        let of = |axis: &Axis| {
            let beyond: Vec<f64> = match swing {
                Some(swing) => {
                    let y = swung(&self.time, &axis.place, swing);
                    let apart: Vec<f64> = y.iter().zip(&axis.place).map(|(y, x)| y - x).collect();
                    let at = |middle: &f64| weighed(&self.time, &apart, (*middle, 2), DENSE).unwrap_or(0.0);
                    axis.middles.iter().map(at).collect()
                }
                None => vec![0.0; axis.middles.len()],
            };
            let rows = axis.rows.iter().zip(beyond);
            let all: Vec<[f64; 6]> = rows.map(|(r, b)| [r[0], b, r[1], r[2], r[3], r[4]]).collect();
            without_level(&all)
        };
        self.axes.iter().flat_map(of).collect()
    }
}

/// Where a part comes to that hangs on what goes through `place`, m.
fn swung(time: &[f64], place: &[f64], [rate, damping]: [f64; 2]) -> Vec<f64> {
    let (mut y, mut v) = (place.first().copied().unwrap_or(0.0), 0.0);
    let mut out = vec![y];
    for k in 1..time.len() {
        let step = time[k] - time[k - 1];
        let slope = (place[k] - place[k - 1]) / step.max(1e-9);
        let parts = (step * rate / RESOLVES).ceil().max(1.0);
        let h = step / parts;
        for part in 0..parts as usize {
            let at = |s: f64| place[k - 1] + slope * (part as f64 * h + s);
            let pull = |s: f64, y: f64, v: f64| 2.0 * damping * rate * (slope - v) + rate * rate * (at(s) - y);
            // Runge and Kutta's fourth order.
            let (a1, v1) = (pull(0.0, y, v), v);
            let (a2, v2) = (pull(0.5 * h, y + 0.5 * h * v1, v + 0.5 * h * a1), v + 0.5 * h * a1);
            let (a3, v3) = (pull(0.5 * h, y + 0.5 * h * v2, v + 0.5 * h * a2), v + 0.5 * h * a2);
            let (a4, v4) = (pull(h, y + h * v3, v + h * a3), v + h * a3);
            y += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
        out.push(y);
    }
    out
}

fn without_level(rows: &[[f64; 6]]) -> Vec<[f64; 5]> {
    let squares: f64 = rows.iter().map(|r| r[5] * r[5]).sum();
    let level = |k: usize| rows.iter().map(|r| r[k] * r[5]).sum::<f64>() / squares.max(1e-300);
    let levels = [0, 1, 2, 3, 4].map(level);
    let one = |r: &[f64; 6]| [0, 1, 2, 3, 4].map(|k| r[k] - levels[k] * r[5]);
    rows.iter().map(one).collect()
}

/// Mass and mass of the part, kg, what else was fitted, and the standard deviation of the share.
#[derive(Clone, Debug)]
struct Solved {
    all: [f64; 4],
    share_sd: f64,
    square: f64,
}

/// Least squares of balances, with a part that swings or without.
fn solved(rows: &[[f64; 5]], swings: bool) -> Option<Solved> {
    let used: &[usize] = if swings { &[0, 1, 2, 3] } else { &[0, 2, 3] };
    let a = DMatrix::from_fn(rows.len(), used.len(), |i, j| rows[i][used[j]]);
    let b = DVector::from_fn(rows.len(), |i, _| rows[i][4]);
    let fit = weighted_linear(&a, &b, &DVector::from_element(rows.len(), 1.0))?;
    let mut all = [0.0; 4];
    for (k, x) in used.iter().zip(fit.x.iter()) {
        all[*k] = *x;
    }
    let square = fit.residuals.norm_squared();
    let variance = OVERLAP * square / (rows.len() as f64 - used.len() as f64).max(1.0);
    let share_sd = if swings {
        (variance * fit.covariance[(1, 1)]).sqrt() / all[0].abs().max(1e-9)
    } else {
        0.0
    };
    Some(Solved { all, share_sd, square })
}

/// Square of what is left of balances by numbers that others told.
fn left(rows: &[[f64; 5]], all: &[f64; 4]) -> f64 {
    let off = |r: &[f64; 5]| r[4] - (0..4).map(|k| r[k] * all[k]).sum::<f64>();
    rows.iter().map(|r| off(r).powi(2)).sum()
}

fn rows_of(lifts: &[&Lift], swing: Option<[f64; 2]>) -> Vec<[f64; 5]> {
    lifts.iter().flat_map(|l| l.rows(swing)).collect()
}

/// The rate and damping ratio by which least is left.
fn best(lifts: &[&Lift]) -> Option<([f64; 2], Solved)> {
    let at = |swing: [f64; 2]| solved(&rows_of(lifts, Some(swing)), true).map(|s| (swing, s));
    let less = |a: &([f64; 2], Solved), b: &([f64; 2], Solved)| a.1.square.total_cmp(&b.1.square);
    let grid = RATES.iter().flat_map(|r| RATIOS.map(|z| [*r, z]));
    let mut found = grid.filter_map(at).min_by(less)?;
    let mut step = [1.12f64.ln(), 1.6f64.ln()];
    for _ in 0..FINER {
        let [rate, damping] = found.0;
        let near = [-1.0, 0.0, 1.0].map(|i| [-1.0, 0.0, 1.0].map(|j| [i, j]));
        let tries = near.iter().flatten().map(|[i, j]| {
            let ratio = (damping * (j * step[1]).exp()).clamp(0.01, 0.7);
            [rate * (i * step[0]).exp(), ratio]
        });
        found = tries.filter_map(at).min_by(less)?;
        step = step.map(|s| s * BY);
    }
    Some(found)
}

/// Standard deviations of the logarithms of the rate and the damping ratio, by how what is left grows beside them.
fn doubt(lifts: &[&Lift], swing: [f64; 2], least: f64, count: f64) -> [f64; 2] {
    let half = [0.03, 0.2];
    let of = |k: usize| {
        let beside = |sign: f64| {
            let mut there = swing;
            there[k] *= (sign * half[k]).exp();
            solved(&rows_of(lifts, Some(there)), true).map(|s| 0.5 * count * (s.square / least).ln())
        };
        let rise = beside(1.0).zip(beside(-1.0)).map_or(0.0, |(a, b)| 0.5 * (a + b));
        half[k] / (2.0 * rise.max(1e-9)).sqrt()
    };
    [of(0), of(1)]
}

/// Every link that hung on the tool in lifts that tell, with the part that explains most of what a rigid body leaves.
pub fn sloshing(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Sloshing> {
    let up = -capture.gravity / capture.gravity.norm();
    let lifts = capture.interactions.iter().filter(|i| i.kind == Kind::Lift);
    let one = |interaction: &'_ Interaction| -> Option<(String, usize)> {
        let cut = segmented.iter().position(|s| s.interaction == interaction.name)?;
        Some((subject(interaction, &segmented[cut])?.to_owned(), cut))
    };
    let of: Vec<(&Interaction, String, usize)> = lifts.filter_map(|i| one(i).map(|(l, c)| (i, l, c))).collect();
    let alone = model
        .twin
        .bodies
        .iter()
        .filter(|b| b.links.len() == 1)
        .map(|b| &b.links[0]);
    let told = |link: &Link| {
        let centre = Point3::from(link.com.as_ref()?.value);
        let own = of.iter().filter(|(_, name, _)| *name == link.name);
        let lifts: Vec<Lift> = own
            .filter_map(|(i, _, cut)| lift_of(i, &segmented[*cut], (&link.name, &centre), &up))
            .collect();
        sloshing_of(&link.name, &lifts)
    };
    alone.filter_map(told).collect()
}

fn lift_of(
    interaction: &Interaction,
    cut: &Segmented,
    (link, centre): (&str, &Point3<f64>),
    up: &Vector3<f64>,
) -> Option<Lift> {
    let stream = interaction.force.as_ref()?;
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let stretch = aloft(interaction, cut, up, link)?;
    let poses = (0..track.len()).filter_map(|i| Some((track.time[i], track.pose(i)?.0 * centre)));
    let (time, places): (Vec<f64>, Vec<Point3<f64>>) = poses.unzip();
    let noise = position_noise(&[track]) * noise_gain(&time);
    let of = |axis: usize| {
        let force: Vec<f64> = stream.force.iter().map(|f| f[axis]).collect();
        let place = places.iter().map(|p| p[axis]).collect();
        Axis::new((&time, place), (&stream.time, &force), &(stretch.start..stretch.end))
    };
    let axes = [of(0), of(1), of(2)];
    let strong = |axis: &Axis| {
        let squares: f64 = axis.rows.iter().map(|r| r[0] * r[0]).sum();
        (squares / axis.rows.len().max(1) as f64).sqrt()
    };
    // What is sped up by hardly more than the noise of its track says is told too small, and a part that swings makes up for it.
    let told: Vec<Axis> = axes.into_iter().filter(|a| strong(a) > CLEAR * noise).collect();
    (!told.is_empty()).then(|| Lift {
        axes: told,
        time,
        name: interaction.name.clone(),
        held_out: interaction.held_out,
    })
}

fn sloshing_of(link: &str, lifts: &[Lift]) -> Option<Sloshing> {
    let fitted: Vec<&Lift> = lifts.iter().filter(|l| !l.held_out).collect();
    let held: Vec<&Lift> = lifts.iter().filter(|l| l.held_out).collect();
    let plain = rows_of(&fitted, None);
    if plain.len() < FEWEST {
        return None;
    }
    let count = plain.len() as f64 / OVERLAP;
    let rigid = solved(&plain, false)?;
    let (swing, with) = best(&fitted)?;
    // Each lift as the others foretell it, at the same rate and damping.
    let foretold = |k: usize| {
        let others: Vec<&Lift> = fitted
            .iter()
            .enumerate()
            .filter(|(j, _)| *j != k)
            .map(|(_, l)| *l)
            .collect();
        let [a, b] = [(None, false), (Some(swing), true)].map(|(swing, swings)| {
            let told = solved(&rows_of(&others, swing), swings)?;
            let own = fitted[k].rows(swing);
            Some((left(&own, &told.all), own.len() as f64))
        });
        let ((a, n), (b, _)) = (a?, b?);
        Some(0.5 * n / OVERLAP * (a / b.max(1e-300)).ln())
    };
    let judged = if held.is_empty() { &fitted } else { &held };
    let error = |swing: Option<[f64; 2]>, all: &[f64; 4]| {
        let rows = rows_of(judged, swing);
        let weight = judged.iter().flat_map(|l| &l.axes).flat_map(|a| &a.rows).map(|r| r[4]);
        let (sum, n) = weight.fold((0.0, 0.0), |(s, n), w| (s + w, n + 1.0));
        // A bump weighs a force with what it weighs a constant with.
        (left(&rows, all) / rows.len().max(1) as f64).sqrt() / (sum / f64::max(n, 1.0))
    };
    let [rate_sd, damping_sd] = doubt(&fitted, swing, with.square, count);
    let share = with.all[1] / with.all[0];
    Some(Sloshing {
        link: link.to_owned(),
        from: fitted.iter().map(|l| l.name.clone()).collect(),
        held_out: held.iter().map(|l| l.name.clone()).collect(),
        share: (share, with.share_sd),
        rate: (swing[0], swing[0] * rate_sd),
        damping: (swing[1], swing[1] * damping_sd),
        gain: 0.5 * count * (rigid.square / with.square.max(1e-300)).ln(),
        foretold: if fitted.len() > 1 {
            (0..fitted.len()).filter_map(foretold).collect()
        } else {
            Vec::new()
        },
        left: [error(None, &rigid.all), error(Some(swing), &with.all)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of 0.6 kg that is moved to and fro within 12 s, of which this share swings at 22 rad/s.
    fn lift(share: f64, hertz: f64) -> Lift {
        let time: Vec<f64> = (0..1300).map(|i| 0.01 * f64::from(i)).collect();
        let ease = |t: f64| ((t - 1.0) / 0.8).clamp(0.0, 1.0) * ((9.0 - t) / 0.3).clamp(0.0, 1.0);
        let place = |t: f64| 0.02 * ease(t) * (std::f64::consts::TAU * hertz * (t - 1.0)).sin();
        let fine: Vec<f64> = (0..13_000).map(|i| 1e-3 * f64::from(i)).collect();
        let x: Vec<f64> = fine.iter().map(|t| place(*t)).collect();
        let y = swung(&fine, &x, [22.0, 0.08]);
        let second = |v: &[f64], i: usize| (v[i + 1] - 2.0 * v[i] + v[i - 1]) / 1e-6;
        let wobble = |i: usize| 0.02 * (((i * 37) % 13) as f64 / 6.0 - 1.0);
        let at = |i: usize| 0.6 * ((1.0 - share) * second(&x, i) + share * second(&y, i)) + 0.3 + wobble(i);
        let inside: Vec<usize> = (1..fine.len() - 1).collect();
        let (times, force): (Vec<f64>, Vec<f64>) = inside.iter().map(|i| (fine[*i], at(*i))).unzip();
        let places = time.iter().map(|t| place(*t)).collect();
        Lift {
            name: format!("shake at {hertz} Hz"),
            held_out: false,
            axes: vec![Axis::new((&time, places), (&times, &force), &(0.3..12.5))],
            time,
        }
    }

    #[test]
    fn a_part_that_swings_is_told_with_its_numbers() {
        let lifts = [lift(0.25, 2.0), lift(0.25, 3.1)];
        let found = sloshing_of("box", &lifts).expect("a part");
        assert!((found.share.0 - 0.25).abs() < 0.02, "{found:?}");
        assert!(
            (found.rate.0 / 22.0 - 1.0).abs() < 0.03 && (found.damping.0 - 0.08).abs() < 0.03,
            "{found:?}"
        );
        assert!(
            found.gain > 100.0 && found.foretold.iter().all(|g| *g > 20.0),
            "{found:?}"
        );
    }

    #[test]
    fn of_a_rigid_body_nothing_swings() {
        let found = sloshing_of("box", &[lift(0.0, 2.0), lift(0.0, 3.1)]).expect("a fit");
        assert!(found.share.0.abs() < 0.01, "{found:?}");
    }
}
