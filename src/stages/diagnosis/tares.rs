//! What a sensor reads while its tool touches nothing, or a hand before it lifts: a bias, in its own frame or the room's, or a reading that creeps.
//!
//! Weighted least squares over the means of what free tools read before they touched; the causes are of one catalogue with those of
//! the ladders, which see less of it where forces along one freedom only are judged.

use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

use super::set_down::puts_down_as_it_was;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Interaction, PhaseKind, Segmented};
use crate::math::weighted_linear;
use crate::twin::{Finding, Gain};

/// Share of the time before the touch that is surely before it, and the fewest samples of it.
pub(super) const BEFORE: f64 = 0.7;
pub(super) const SAMPLES: usize = 10;
/// Fewest tools that tell.
const FEWEST: usize = 3;
/// Standard deviations from nought from which on it counts: of 395 captures of three engines, none without such a cause came to more
/// than 3.9.
pub(super) const CLEAR: f64 = 5.0;
/// Variance of what is left over that of the noise up to which it is nothing else.
const CLEAN: f64 = 4.0;
/// Share of the largest force below which it does not matter.
const SLIGHT: f64 = 0.002;
/// Log odds are divided by this, since no noise is quite free from sample to sample.
const TEMPERATURE: f64 = 1.5;
/// Largest probability that is stated.
const MOST: f64 = 0.95;
/// Odds below which a rival is not listed.
const NEGLIGIBLE: f64 = 0.005;

/// Where it shows.
const BEFORE_THE_TOUCH: &str = "force before the touch";

/// Whether a finding is of what free tools read: no prediction of a touch rests on it.
pub fn before_the_touch(finding: &Finding) -> bool {
    finding
        .evidence
        .iter()
        .any(|e| e.residual.starts_with(BEFORE_THE_TOUCH))
}

/// What one free tool read.
struct Reading {
    name: String,
    held_out: bool,
    /// A hand that holds what it lifts.
    holds: bool,
    /// Seconds since the capture began.
    time: f64,
    /// Mean, N, world axes, and the standard deviation of each of its components.
    force: Vector3<f64>,
    sd: f64,
    /// World-from-tool.
    rotation: UnitQuaternion<f64>,
}

impl Reading {
    fn of(interaction: &Interaction, segmented: &[Segmented], zero: f64) -> Option<Self> {
        let own = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let tool = interaction.tool.as_ref()?;
        let holds = tool.grip || tool.pin;
        if holds && !puts_down_as_it_was(interaction, own) {
            return None;
        }
        let (stream, noise) = (interaction.force.as_ref()?, own.force_noise?);
        let touch = [PhaseKind::Stick, PhaseKind::Slide]
            .into_iter()
            .filter_map(|kind| Some(own.of(kind).next()?.start))
            .reduce(f64::min)?;
        let begin = *stream.time.first()?;
        let until = begin + BEFORE * (touch - begin);
        let rest: Vec<&Vector3<f64>> = stream
            .time
            .iter()
            .zip(&stream.force)
            .filter(|(t, f)| **t <= until && f.iter().all(|x| x.is_finite()))
            .map(|(_, f)| f)
            .collect();
        let n = rest.len() as f64;
        let rotation = interaction
            .tool_path
            .as_ref()
            .and_then(|p| p.rotation.iter().flatten().next());
        (rest.len() >= SAMPLES && noise > 0.0 && own.preload.is_none()).then(|| Self {
            name: interaction.name.clone(),
            held_out: interaction.held_out,
            holds,
            time: 0.5 * (begin + until) - zero,
            force: rest.into_iter().sum::<Vector3<f64>>() / n,
            sd: noise / n.sqrt(),
            rotation: rotation.copied().unwrap_or_default(),
        })
    }
}

/// A way in which readings may be off: a vector of one frame, or one that grows with time there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Way {
    cause: &'static str,
    turns: bool,
    grows: bool,
    /// Whether what grows did not begin with the capture.
    began_before: bool,
    /// How common it is beside the others.
    common: f64,
}

const WAYS: [Way; 6] = [
    Way::new("force-bias", [true, false, false], 1.0),
    Way::new("force-bias-world", [false, false, false], 0.4),
    Way::new("force-drift", [true, true, false], 0.5),
    Way::new("force-drift", [false, true, false], 0.5),
    Way::new("force-drift", [true, true, true], 0.25),
    Way::new("force-drift", [false, true, true], 0.25),
];

impl Way {
    const fn new(cause: &'static str, [turns, grows, began_before]: [bool; 3], common: f64) -> Self {
        Self {
            cause,
            turns,
            grows,
            began_before,
            common,
        }
    }

    /// What each unknown does to a reading: the vector, then where it stood when the capture began.
    fn columns(&self, reading: &Reading) -> Vec<Matrix3<f64>> {
        let turned = if self.turns {
            reading.rotation.to_rotation_matrix().into_inner()
        } else {
            Matrix3::identity()
        };
        let mut out = vec![turned * if self.grows { reading.time } else { 1.0 }];
        if self.began_before {
            out.push(turned);
        }
        out
    }

    fn unknowns(&self) -> usize {
        if self.began_before { 6 } else { 3 }
    }
}

/// One way, fitted.
struct Fitted {
    way: Way,
    /// N, or N/s where it grows, and its covariance for noise alone.
    vector: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// Reading when the capture began, N.
    start: Vector3<f64>,
    /// Weighted squares of what it leaves.
    left: f64,
}

impl Fitted {
    fn of(way: Way, readings: &[&Reading]) -> Option<Self> {
        let (rows, unknowns) = (3 * readings.len(), way.unknowns());
        if rows <= unknowns {
            return None;
        }
        let columns: Vec<Vec<Matrix3<f64>>> = readings.iter().map(|r| way.columns(r)).collect();
        let a = DMatrix::from_fn(rows, unknowns, |i, j| columns[i / 3][j / 3][(i % 3, j % 3)]);
        let y = DVector::from_fn(rows, |i, _| readings[i / 3].force[i % 3]);
        let weights = DVector::from_fn(rows, |i, _| readings[i / 3].sd.powi(-2));
        let fit = weighted_linear(&a, &y, &weights)?;
        Some(Self {
            way,
            vector: Vector3::new(fit.x[0], fit.x[1], fit.x[2]),
            covariance: fit.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            start: if way.began_before {
                Vector3::new(fit.x[3], fit.x[4], fit.x[5])
            } else {
                Vector3::zeros()
            },
            left: fit.residuals.component_mul(&fit.residuals).dot(&weights),
        })
    }

    fn foretold(&self, reading: &Reading) -> Vector3<f64> {
        let columns = self.way.columns(reading);
        let start = columns.get(1).map_or_else(Vector3::zeros, |c| c * self.start);
        columns[0] * self.vector + start
    }

    /// What is against it: what it leaves, and what each of its unknowns is expected to take up (Schwarz 1978).
    fn against(&self, readings: usize) -> f64 {
        self.left + self.way.unknowns() as f64 * (3.0 * readings as f64).ln()
    }

    /// Standard deviation of its size, where what is left scatters `spread` times as the noise does.
    fn sd(&self, spread: f64) -> f64 {
        let along = self.vector / self.vector.norm().max(1e-12);
        spread * along.dot(&(self.covariance * along)).max(0.0).sqrt()
    }
}

/// What free tools tell of the sensor, where nothing that was `named` says it already.
pub fn tare_finding(capture: &Capture, segmented: &[Segmented], named: &[Finding]) -> Option<Finding> {
    if named.iter().any(|f| WAYS.iter().any(|w| w.cause == f.cause)) {
        return None;
    }
    let streams = capture.interactions.iter().filter_map(|i| i.force.as_ref());
    let largest = streams
        .flat_map(|s| &s.force)
        .map(|f| f.norm())
        .filter(|f| f.is_finite());
    let largest = largest.fold(0.0, f64::max);
    told(&readings(capture, segmented), largest)
}

/// Whether enough free tools were read for a bias or a drift to show.
pub fn tells_tare(capture: &Capture, segmented: &[Segmented]) -> bool {
    let all = readings(capture, segmented);
    all.iter().filter(|r| !r.held_out).count() >= FEWEST
}

fn readings(capture: &Capture, segmented: &[Segmented]) -> Vec<Reading> {
    let streams = capture.interactions.iter().filter_map(|i| i.force.as_ref());
    let zero = streams
        .filter_map(|s| s.time.first().copied())
        .fold(f64::INFINITY, f64::min);
    let each = capture.interactions.iter();
    let mut all: Vec<Reading> = each.filter_map(|i| Reading::of(i, segmented, zero)).collect();
    // Hands may strain at what they hold, and are asked only where free tools do not tell.
    if all.iter().filter(|r| !r.held_out && !r.holds).count() >= FEWEST {
        all.retain(|r| !r.holds);
    }
    all
}

fn told(all: &[Reading], largest: f64) -> Option<Finding> {
    let fitted: Vec<&Reading> = all.iter().filter(|r| !r.held_out).collect();
    if fitted.len() < FEWEST {
        return None;
    }
    // What stood off from the first is a bias unless it clearly grows.
    let grew = |f: &Fitted| !f.way.began_before || f.vector.norm() > CLEAR * f.sd(1.0);
    let ways: Vec<Fitted> = WAYS
        .into_iter()
        .filter_map(|w| Fitted::of(w, &fitted).filter(grew))
        .collect();
    let against = |f: &Fitted| f.against(fitted.len());
    let best = ways.iter().min_by(|a, b| against(a).total_cmp(&against(b)))?;
    let free = (3 * fitted.len()).saturating_sub(best.way.unknowns()).max(1);
    let variance = (best.left / free as f64).max(1.0);
    let plain: f64 = fitted.iter().map(|r| (r.force / r.sd).norm_squared()).sum();
    let clear = ((plain - best.left).max(0.0) / variance).sqrt();
    let size = fitted.iter().map(|r| best.foretold(r).norm()).fold(0.0, f64::max);
    if variance > CLEAN || clear < CLEAR || size < SLIGHT * largest {
        return None;
    }
    let weight = |f: &Fitted| f.way.common * (-0.5 * (against(f) - against(best)) / variance / TEMPERATURE).exp();
    let whole: f64 = ways.iter().map(weight).sum();
    let odds = |cause: &str| -> f64 {
        let own = ways.iter().filter(|f| f.way.cause == cause);
        MOST * own.map(weight).sum::<f64>() / whole
    };
    let mut causes = ["force-bias", "force-bias-world", "force-drift"].map(|cause| (cause, odds(cause)));
    causes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let named = ways
        .iter()
        .filter(|f| f.way.cause == causes[0].0)
        .min_by(|a, b| against(a).total_cmp(&against(b)))?;
    let rivals: Vec<(&str, f64)> = causes[1..].iter().copied().filter(|c| c.1 > NEGLIGIBLE).collect();
    let from: Vec<String> = fitted.iter().map(|r| r.name.clone()).collect();
    let (symbol, unit, does) = if named.way.grows {
        ("d", "N/s", "creeps with time")
    } else {
        ("b", "N", "is off")
    };
    let value = named.vector.norm();
    let v = named.vector;
    let frame = if named.way.turns { "tool" } else { "world" };
    Some(
        Told {
            cause: causes[0].0,
            place: "sensor",
            probability: causes[0].1,
            rivals: &rivals,
            parameter: (
                symbol,
                Estimate::measured(value, named.sd(variance.sqrt()), unit, from, "readings of free tools"),
            ),
            residual: BEFORE_THE_TOUCH,
            statistic: clear,
            words: format!(
                "what is read while nothing is touched {does}: {value:.3} {unit}, ({:.3}, {:.3}, {:.3}) in the frame of the {frame}",
                v.x, v.y, v.z
            ),
            gain: judged(all, named.way),
        }
        .finding(),
    )
}

/// Error of the readings without it and with it: of those that were held out, or else each foretold from the others.
fn judged(all: &[Reading], way: Way) -> Gain {
    let held: Vec<&Reading> = all.iter().filter(|r| r.held_out).collect();
    let judges: Vec<&Reading> = if held.is_empty() {
        all.iter().collect()
    } else {
        held.clone()
    };
    let after = |one: &&Reading| {
        let others: Vec<&Reading> = all.iter().filter(|r| !r.held_out && r.name != one.name).collect();
        Fitted::of(way, &others).map_or(one.force, |f| one.force - f.foretold(one))
    };
    let rms = |of: &dyn Fn(&&Reading) -> Vector3<f64>| {
        let squares = judges.iter().map(|r| of(r).norm_squared());
        (squares.sum::<f64>() / judges.len().max(1) as f64).sqrt()
    };
    let names = held.iter().map(|r| r.name.clone()).collect();
    gain("force", "N", [rms(&|r| r.force), rms(&after)], names)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of 0.01 N that differ by a hundredth of what is off, the tool turned by `turn` more each time.
    fn readings(off: impl Fn(f64, &UnitQuaternion<f64>) -> Vector3<f64>, turn: f64) -> Vec<Reading> {
        let one = |k: u32| {
            let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, turn * f64::from(k));
            let wobble = Vector3::new(1.0, -1.0, 0.5) * if k.is_multiple_of(2) { 0.004 } else { -0.004 };
            Reading {
                name: format!("push-{k}"),
                held_out: k == 5,
                holds: false,
                time: 12.0 * f64::from(k),
                force: off(12.0 * f64::from(k), &rotation) + wobble,
                sd: 0.005,
                rotation,
            }
        };
        (0..6).map(one).collect()
    }

    #[test]
    fn what_free_tools_read_tells_a_bias_from_a_drift_and_its_frame() {
        let b = Vector3::new(0.2, 0.0, 0.05);
        let cases: [(&str, Vec<Reading>); 4] = [
            ("force-bias", readings(|_, r| r * b, 1.1)),
            ("force-bias-world", readings(|_, _| b, 1.1)),
            ("force-drift", readings(|t, _| b * (t / 60.0), 0.0)),
            // It was set to nought two minutes before the first touch.
            ("force-drift", readings(|t, _| b * (2.0 + t / 60.0), 0.0)),
        ];
        for (cause, all) in cases {
            let found = told(&all, 5.0).expect("clear");
            assert_eq!((found.cause.as_str(), found.probability > 0.9), (cause, true));
            assert!(before_the_touch(&found));
            assert!(found.gain.reduction > 0.9 && found.gain.held_out == ["push-5"]);
        }
    }

    #[test]
    fn a_bias_of_a_tool_that_never_turned_may_be_of_either_frame() {
        let found = told(&readings(|_, _| Vector3::x() * 0.2, 0.0), 5.0).expect("clear");
        assert_eq!((found.cause.as_str(), found.alternatives.len()), ("force-bias", 1));
        assert!((0.6..0.8).contains(&found.probability));
    }

    #[test]
    fn noise_a_little_and_loads_tell_nothing() {
        let quiet = readings(|_, _| Vector3::zeros(), 1.1);
        let little = readings(|_, _| Vector3::x() * 0.02, 1.1);
        // A hand that leans on things reads another load each time.
        let loads = readings(|t, _| Vector3::z() * (0.1 * t).sin(), 0.0);
        for (all, largest) in [(quiet, 1.0), (little, 50.0), (loads, 5.0)] {
            assert!(told(&all, largest).is_none());
        }
    }
}
