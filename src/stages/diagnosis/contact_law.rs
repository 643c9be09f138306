//! How the force of a finger grows with its squeeze, before the body moves: `F = k d^(1 + h)`, where the plain finger has
//! `h = 0`.
//!
//! While friction holds the body, all of the tool's way goes into the finger. A sensor that lags rounds the beginning of
//! a straight rise as a law with `h > 0` does, and a finger that creeps begins it with a step as one with `h < 0`; so does one that
//! damps, whose force is all there before it is squeezed in full. All are fitted beside the law, push by push, and it has to be better
//! than each.

use nalgebra::DVector;

use super::onset::Onset;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::math::{Settings, levenberg_marquardt, random_effects};
use crate::twin::Finding;

/// Share of the sliding force up to which the body is held.
const HELD: f64 = 0.85;
/// What of that force the model of a rise leaves, as a share.
const ROUGH: f64 = 0.01;
/// Fewest readings of a rise, and least squeeze, m, that tell its form.
const READINGS: usize = 8;
const SQUEEZED: f64 = 3e-4;
/// Fewest pushes, standard deviations, and the least exponent.
const FEWEST: usize = 3;
const CLEAR: f64 = 5.0;
const LEAST: f64 = 0.1;
/// Log evidence over each of the two that are like it.
const BETTER: f64 = 8.0;
/// Scatter of the exponent from push to push.
const SCATTER: f64 = 0.05;
/// What a finger that creeps a little takes from it.
const FORM: f64 = 0.05;
/// Half the seconds over which the speed of the tool is told.
const PACE: f64 = 0.015;
/// Bounds of exponents, and of the squeeze, m.
const EXPONENT: [f64; 2] = [-0.8, 3.0];
const SQUEEZE: [f64; 2] = [2e-5, 2e-2];

/// Where fits of a rise begin: squeeze over the one at which it was first seen, and sizes.
const BEGINS: [f64; 4] = [0.9, 1.0, 1.15, 1.4];
const SIZES: [f64; 3] = [0.05, 0.25, 0.5];

/// What bends a rise.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bend {
    /// An exponent.
    Law,
    /// A lag of the sensor, as a share of the time of the rise.
    Lag,
    /// A step at first touch, as a share of the whole.
    Step,
    /// What the finger damps at the speed at which the body slides, as a share of the whole.
    Damping,
    /// Nothing: a straight rise by another clock, early by a share of the time of the rise.
    Early,
}

/// Share of the full force at a share `s` of the way from first touch to where it is in full, with `rate` times the speed of the tool while
/// the body slides.
fn share(bend: Bend, size: f64, (s, rate): (f64, f64)) -> f64 {
    if bend == Bend::Early {
        return (s + size).max(0.0);
    }
    if s <= 0.0 {
        return 0.0;
    }
    match bend {
        Bend::Early => s,
        Bend::Law => s.powf(1.0 + size),
        Bend::Lag => s - size * (1.0 - (-s / size.max(1e-6)).exp()),
        Bend::Step => size + (1.0 - size) * s,
        Bend::Damping => s + size * rate,
    }
}

/// The rise of one push by one of them.
struct Rise<'a> {
    push: &'a Onset,
    /// Squeeze in full, m.
    squeeze: f64,
    size: (f64, f64),
    cost: f64,
}

/// Rises of pushes that were fitted, by one of them.
fn rises(all: &[Onset], bend: Bend) -> Vec<Rise<'_>> {
    let fitted = all.iter().filter(|o| !o.held_out);
    fitted.filter_map(|push| rise(push, bend)).collect()
}

/// Those in which the finger gave by so much that they tell its law.
fn squeezed(all: &[Onset]) -> Vec<Rise<'_>> {
    let mut law = rises(all, Bend::Law);
    law.retain(|r| r.squeeze > SQUEEZED);
    law
}

/// Whether a finger gives so much in these pushes that its law would show.
pub fn tells_its_law(all: &[Onset]) -> bool {
    squeezed(all).len() >= FEWEST
}

/// Whether a finger damps: the force steps up as it touches, and is all there before it is squeezed in full, as if what is tracked came late.
pub fn damps(all: &[Onset]) -> bool {
    let (damped, early) = (rises(all, Bend::Damping), rises(all, Bend::Early));
    let own = |r: &Rise| early.iter().find(|o| o.push.interaction == r.push.interaction);
    let better = damped.iter().filter_map(|r| Some(own(r)?.cost - r.cost)).sum::<f64>();
    damped.len() >= FEWEST && better > BETTER
}

/// Where a finger's force does not grow in proportion to its squeeze.
pub fn contact_law_finding(all: &[Onset], name: &str) -> Option<Finding> {
    let fitted: Vec<&Onset> = all.iter().filter(|o| !o.held_out).collect();
    let law = squeezed(all);
    let (sizes, sds): (Vec<f64>, Vec<f64>) = law.iter().map(|r| r.size).unzip();
    let pooled = random_effects(&sizes, &sds, SCATTER).filter(|_| law.len() >= FEWEST)?;
    let statistic = pooled.mean.abs() / pooled.sd;
    let worse = |bend: Bend| {
        let other = rises(all, bend);
        let own = |r: &Rise| other.iter().find(|o| o.push.interaction == r.push.interaction);
        law.iter().filter_map(|r| Some(own(r)?.cost - r.cost)).sum::<f64>()
    };
    let better = [Bend::Lag, Bend::Step, Bend::Damping].map(worse);
    let better = better.into_iter().fold(f64::INFINITY, f64::min);
    if statistic < CLEAR || pooled.mean.abs() < LEAST || better < BETTER {
        return None;
    }
    let held: Vec<&Onset> = all.iter().filter(|o| o.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    // The geometric mean over pushes of the stiffness at one squeeze of them all.
    let typical = mean(law.iter().map(|r| r.squeeze.ln()))?.exp();
    let force_there = mean(
        law.iter()
            .map(|r| (r.push.level * (typical / r.squeeze).powf(1.0 + pooled.mean)).ln()),
    )?
    .exp();
    let straight = straight_stiffness(&fitted)?;
    let plain = |d: f64| straight * d;
    let extended = |d: f64| force_there * (d / typical).powf(1.0 + pooled.mean);
    let errors = [
        rms(judged, &plain, |level| level / straight),
        rms(judged, &extended, |level| {
            typical * (level / force_there).powf(1.0 / (1.0 + pooled.mean))
        }),
    ];
    if errors[1] >= errors[0] {
        return None;
    }
    let from: Vec<String> = law.iter().map(|r| r.push.interaction.clone()).collect();
    let method = "rise of the force of slow pushes while the body is held";
    let told = Told {
        cause: "contact-law",
        place: name,
        probability: 0.9,
        rivals: &[],
        parameter: (
            "h",
            Estimate::measured(pooled.mean, pooled.sd.hypot(FORM), "1", from.clone(), method),
        ),
        residual: "beginning",
        statistic,
        words: format!(
            "while {name} is held, the finger's force goes as its squeeze to the power of {:.2}, {:.2} mm for {:.1} N",
            1.0 + pooled.mean,
            1e3 * typical,
            force_there
        ),
        gain: gain(
            "force",
            "N",
            errors,
            held.iter().map(|o| o.interaction.clone()).collect(),
        ),
    };
    let mut finding = told.finding();
    let stiffness = force_there / typical;
    let doubt = stiffness * pooled.sd.hypot(SCATTER / (law.len() as f64).sqrt());
    let stiffness = Estimate::measured(stiffness, doubt, "N/m", from, method);
    finding.parameters.insert("k_c".into(), stiffness);
    Some(finding)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let all: Vec<f64> = values.collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

/// The rows of a rise while the body is held: the tool's place, m, before where the force is in full; N; its speed over that while the
/// body slides.
fn held_rows(push: &Onset) -> Vec<[f64; 3]> {
    let held = push.rise.iter().take_while(|r| r.force < HELD * push.level);
    let rate = |t: f64| {
        let from = push.rise.partition_point(|r| r.time < t - PACE);
        let to = push.rise.partition_point(|r| r.time <= t + PACE).max(from + 1) - 1;
        let (a, b) = (&push.rise[from], &push.rise[to]);
        (b.way - a.way) / ((b.time - a.time) * push.speed).max(1e-9)
    };
    held.map(|r| [r.way, r.force, rate(r.time)]).collect()
}

fn rise(push: &Onset, bend: Bend) -> Option<Rise<'_>> {
    let rows = held_rows(push);
    let (level, doubt) = (push.level, push.noise.hypot(ROUGH * push.level));
    let first = rows.iter().find(|r| r[1] > 0.1 * level)?[0];
    let rising = rows.iter().filter(|r| r[0] > first).count();
    if rising < READINGS {
        return None;
    }
    let begin = (-first).clamp(2.0 * SQUEEZE[0], 0.5 * SQUEEZE[1]);
    let bounded = |x: &DVector<f64>| {
        let size = match bend {
            Bend::Law => x[1].clamp(EXPONENT[0], EXPONENT[1]),
            Bend::Lag => x[1].abs(),
            Bend::Step => x[1].clamp(-0.5, 0.95),
            Bend::Damping | Bend::Early => x[1].clamp(0.0, 2.0),
        };
        (x[0].exp().clamp(SQUEEZE[0], SQUEEZE[1]), size, x[2] * push.way.1)
    };
    let residuals = |x: &DVector<f64>| {
        let (squeeze, size, shift) = bounded(x);
        let of = |r: &[f64; 3]| (r[1] - level * share(bend, size, ((r[0] - shift + squeeze) / squeeze, r[2]))) / doubt;
        DVector::from_iterator(rows.len() + 1, rows.iter().map(of).chain([x[2]]))
    };
    let steps = DVector::from_vec(vec![1e-4, 1e-4, 1e-3]);
    // Between which two readings it steps no slope tells.
    let starts = BEGINS
        .iter()
        .flat_map(|far| SIZES.map(|size| DVector::from_vec(vec![(far * begin).ln(), size, 0.0])));
    let fits = starts.filter_map(|start| levenberg_marquardt(&start, &steps, Settings::default(), residuals));
    let best = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let (squeeze, size, _) = bounded(&best.x);
    Some(Rise {
        push,
        squeeze,
        size: (size, best.sd(1)),
        cost: best.cost,
    })
}

/// What a straight finger would have, N/m, over all these pushes.
fn straight_stiffness(pushes: &[&Onset]) -> Option<f64> {
    let one = |push: &&Onset| {
        let rows = held_rows(push);
        let middle = rows.iter().filter(|r| r[1] > 0.1 * push.level);
        let ends: Vec<&[f64; 3]> = middle.collect();
        let (a, b) = (ends.first()?, ends.last()?);
        Some(((b[1] - a[1]) / (b[0] - a[0]).max(1e-6)).max(1.0).ln())
    };
    mean(pushes.iter().filter_map(one)).map(f64::exp)
}

/// The error of a law of the finger's over rises that it may not have seen, N.
fn rms(pushes: &[&Onset], law: &dyn Fn(f64) -> f64, squeeze: impl Fn(f64) -> f64) -> f64 {
    let each = |push: &&Onset| {
        let squeezed = squeeze(push.level);
        let left = |r: &[f64; 3]| (r[1] - law((r[0] + squeezed).max(0.0)).min(push.level)).powi(2);
        held_rows(push).iter().map(left).collect::<Vec<f64>>()
    };
    let squares: Vec<f64> = pushes.iter().flat_map(each).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::onset::Reading;
    use super::*;

    /// Pushes at 10 mm/s of a body that 2 N hold by a finger of 1 kN/m, whose force is `felt` of squeeze and way of the tool, m.
    fn pushes(felt: impl Fn(f64, f64) -> f64) -> Vec<Onset> {
        let one = |k: usize| {
            let mut push = Onset::told(&format!("push-{k}"), false, 0.01, (0.0, 1e-4));
            (push.level, push.noise) = (2.0, 0.01);
            push.rise = (0..200)
                .map(|i| {
                    let time = 0.002 * f64::from(i);
                    let way = 0.01 * time - 3e-3;
                    let wobble = 0.01 * (f64::from(i) * 12.9898 + k as f64).sin();
                    let force = felt(way + 2e-3, way).min(2.0) + wobble;
                    Reading { time, way, force }
                })
                .collect();
            push
        };
        (0..6).map(one).collect()
    }

    #[test]
    fn a_finger_that_damps_is_neither_another_law_nor_a_delay() {
        let touched = |squeeze: f64| f64::from(u8::from(squeeze > 0.0));
        // 60 N·s/m: the force is up 0.6 mm before the body slides.
        let damped = pushes(|squeeze, _| touched(squeeze) * (1000.0 * squeeze + 60.0 * 0.01));
        assert!(damps(&damped) && contact_law_finding(&damped, "tin").is_none());
        // The same seems so where the track is late, but nothing steps.
        let late = pushes(|squeeze, _| (1000.0 * (squeeze + 6e-4)).max(0.0));
        assert!(!damps(&late));
    }
}
