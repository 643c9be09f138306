//! Errors of predictions by quantity, against what the sensors alone would leave.

use std::collections::BTreeMap;

use super::missed::Rated;
use super::{Config, Curve, Quantity, Trace};
use crate::twin::{BaseFit, Finding, Miss, Verdict};

/// Sums over all samples of one quantity.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: f64,
    squared_error: f64,
    squared_noise: f64,
    squared_signal: f64,
    squared_doubt: f64,
}

impl Sums {
    fn rmse(&self) -> f64 {
        (self.squared_error / self.count).sqrt()
    }
    fn floor(&self) -> f64 {
        (self.squared_noise / self.count).sqrt()
    }
    fn excess(&self) -> f64 {
        ((self.squared_error - self.squared_noise).max(0.0) / self.count).sqrt()
    }
    /// What is not known of the numbers that the prediction rests on leaves so much.
    fn doubt(&self) -> f64 {
        (self.squared_doubt / self.count).sqrt()
    }
    fn signal(&self) -> f64 {
        (self.squared_signal / self.count).sqrt()
    }
}

/// The pairs (measured, predicted) of a curve that can be compared.
pub fn pairs(curve: &Curve) -> impl Iterator<Item = (f64, f64)> + '_ {
    let both = curve.measured.iter().copied().zip(curve.predicted.iter().copied());
    both.filter(|(m, p)| m.is_finite() && p.is_finite())
}

/// Whether it has a curve of which anything can be compared.
fn compares(trace: &Trace) -> bool {
    trace.curves.iter().any(|c| pairs(c).next().is_some())
}

/// Means over blocks of time of which one curve has to have so many to judge a model by itself.
const JUDGES: usize = 3;

/// Whether it has a curve of which enough can be compared.
fn judges(trace: &Trace) -> bool {
    trace.curves.iter().any(|c| pairs(c).nth(JUDGES - 1).is_some())
}

/// Sum of the squares of a curve's doubts where it can be compared.
fn squared_doubt(curve: &Curve, doubt: Option<&Vec<f64>>) -> f64 {
    let rows = curve
        .measured
        .iter()
        .zip(&curve.predicted)
        .zip(doubt.into_iter().flatten());
    let known = rows.filter(|((m, p), _)| m.is_finite() && p.is_finite());
    known.map(|(_, d)| d * d).sum()
}

/// Seconds over which forces are averaged before they are judged: a stiff finger chatters on dry friction,
/// which a quasi-static prediction neither has nor needs.
const BLOCK: f64 = 0.25;
/// Seconds for which a soft finger swings against the mass that it has just met: over all of them its force is on the average
/// what the mass rubs with, over a block of them it is not.
const SWINGS: f64 = 0.75;

/// Curves of which forces are averaged over blocks.
fn smoothed(trace: &Trace) -> Trace {
    let mut out = trace.clone();
    for (i, curve) in out.curves.iter_mut().enumerate() {
        if !matches!(curve.quantity, Quantity::Force | Quantity::Torque) {
            continue;
        }
        let blocks = blocks(curve);
        let size = blocks.iter().map(|b| b.len()).max().unwrap_or(1) as f64;
        let mean = |values: &[f64], rows: &[usize]| rows.iter().map(|i| values[*i]).sum::<f64>() / rows.len() as f64;
        let measured = blocks.iter().map(|rows| mean(&curve.measured, rows)).collect();
        let predicted = blocks.iter().map(|rows| mean(&curve.predicted, rows)).collect();
        curve.time = blocks.iter().map(|rows| mean(&curve.time, rows)).collect();
        (curve.measured, curve.predicted) = (measured, predicted);
        curve.noise = curve.noise.map(|n| n / size.sqrt());
        if let Some(doubt) = out.doubt.get_mut(i) {
            *doubt = blocks.iter().map(|rows| mean(doubt, rows)).collect();
        }
    }
    out
}

/// Rows that can be compared, by blocks of time. All blocks in which the finger may still swing from its blow have the rows of
/// all of them.
fn blocks(curve: &Curve) -> Vec<Vec<usize>> {
    let mut blocks: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    let known = |i: &usize| curve.measured[*i].is_finite() && curve.predicted[*i].is_finite();
    let touches = |i: &usize| known(i) && curve.predicted[*i] != 0.0;
    let met = (0..curve.predicted.len()).find(touches).map(|i| curve.time[i]);
    let swings = |t: f64| met.is_some_and(|met| (met..met + SWINGS).contains(&t));
    for i in (0..curve.predicted.len()).filter(known) {
        let (block, swinging) = (
            (curve.time[i] / BLOCK).floor() as i64,
            swings(curve.time[i]) && touches(&i),
        );
        blocks.entry(2 * block + i64::from(swinging)).or_default().push(i);
    }
    let (swinging, others): (Vec<_>, Vec<_>) = blocks
        .into_iter()
        .filter(|(_, rows)| rows.len() > 3)
        .partition(|(key, _)| key % 2 == 1);
    let all: Vec<usize> = swinging.iter().flat_map(|(_, rows)| rows.iter().copied()).collect();
    let others = others.into_iter().map(|(_, rows)| rows);
    swinging.iter().map(|_| all.clone()).chain(others).collect()
}

fn gather<'a>(traces: impl Iterator<Item = &'a Trace>) -> BTreeMap<Quantity, Sums> {
    let mut all: BTreeMap<Quantity, Sums> = BTreeMap::new();
    let each = traces.flat_map(|t| t.curves.iter().enumerate().map(|(i, c)| (c, t.doubt.get(i))));
    for (curve, doubt) in each.filter(|(c, _)| pairs(c).next().is_some()) {
        all.entry(curve.quantity).or_default().squared_doubt += squared_doubt(curve, doubt);
        // Forces count from nought, their tare is taken out; places from where they began.
        let reference = match curve.quantity {
            Quantity::Force | Quantity::Torque => 0.0,
            _ => curve.measured.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0),
        };
        for (measured, predicted) in pairs(curve) {
            let sums = all.entry(curve.quantity).or_default();
            sums.count += 1.0;
            sums.squared_error += (measured - predicted).powi(2);
            sums.squared_noise += curve.noise.unwrap_or(0.0).powi(2);
            sums.squared_signal += (measured - reference).powi(2);
        }
    }
    all
}

/// Root mean square error and noise floor by quantity.
pub fn errors(traces: &[Trace]) -> BTreeMap<Quantity, (f64, f64)> {
    gather(traces.iter())
        .into_iter()
        .map(|(q, s)| (q, (s.rmse(), s.floor())))
        .collect()
}

/// Error, noise floor and unexplained share of held-out interactions; of all where none was held out.
pub fn base_fit(traces: &[Trace], config: &Config) -> BaseFit {
    let held_out: Vec<&Trace> = traces.iter().filter(|t| t.held_out && compares(t)).collect();
    let sums = if held_out.is_empty() {
        gather(traces.iter())
    } else {
        gather(held_out.iter().copied())
    };
    // Each quantity counts by its own signal: newtons and metres cannot be added. Of what hardly moved a miss within the
    // tolerance is no large share.
    let scale = |q: &Quantity, s: &Sums| match q {
        Quantity::Rotation => s.signal().hypot(config.rotation_tolerance),
        Quantity::Position | Quantity::Flight => s.signal().hypot(config.position_tolerance),
        Quantity::Force | Quantity::Torque | Quantity::Bounced => s.signal(),
    };
    let unexplained = sums
        .iter()
        .filter(|(q, s)| s.signal() > 0.0 && **q != Quantity::Bounced)
        .map(|(q, s)| (s.excess() / scale(q, s)).powi(2))
        .fold(0.0, f64::max)
        .min(1.0);
    BaseFit {
        rmse: sums.iter().map(|(q, s)| (q.name().to_owned(), s.rmse())).collect(),
        noise_floor: sums.iter().map(|(q, s)| (q.name().to_owned(), s.floor())).collect(),
        unexplained,
        held_out: held_out.iter().map(|t| t.interaction.clone()).collect(),
        tests: Vec::new(),
    }
}

/// Standard deviations of what is not known of the twin's numbers that a prediction may be off by.
const DOUBT: f64 = 2.0;

/// `adequate` where no quantity is missed by more than the noise, the tolerance and what the twin's own numbers leave in doubt, else `unknown`:
/// something is left, and this version gives it no name. Nothing to compare is also `unknown`.
pub fn verdict(traces: &[Trace], config: &Config) -> Verdict {
    let means: Vec<Trace> = traces.iter().map(smoothed).collect();
    let any_held_out = means.iter().any(|t| t.held_out && judges(t));
    let judged = means.iter().filter(|t| t.held_out || !any_held_out);
    let sums = gather(judged);
    let reading = |quantity: Quantity| {
        let curves = traces.iter().flat_map(|t| &t.curves).filter(|c| c.quantity == quantity);
        curves.filter_map(|c| c.noise).fold(0.0, f64::max)
    };
    // Impacts are chaotic: short windows judge them.
    let fits = |quantity: &Quantity, s: &Sums| {
        *quantity == Quantity::Bounced || s.excess() <= allowed(*quantity, s, reading(*quantity), config)
    };
    let adequate = !sums.is_empty() && sums.iter().all(|(q, s)| fits(q, s));
    if adequate { Verdict::Adequate } else { Verdict::Unknown }
}

/// By how much a quantity may be missed beyond the noise; `reading` is the noise of one.
fn allowed(quantity: Quantity, s: &Sums, reading: f64, config: &Config) -> f64 {
    let least = match quantity {
        // A tare may be off by as much as one averaged reading scatters.
        Quantity::Force | Quantity::Torque => reading,
        // The reconstructed surface itself may be off by a millimetre.
        Quantity::Position | Quantity::Flight | Quantity::Bounced => config.position_tolerance,
        Quantity::Rotation => config.rotation_tolerance,
    };
    let tolerated = (config.tolerance * s.signal()).max(least);
    tolerated.hypot(DOUBT * s.doubt()).max(2.0 * s.floor() / s.count.sqrt())
}

/// How far each quantity of each interaction is missed, and how many times what is allowed that is; forces in means, as the
/// verdict has them.
pub fn misses(traces: &[Trace], config: &Config) -> Vec<Rated> {
    let of = |trace: &Trace| {
        let means = smoothed(trace);
        let reading = |q: Quantity| {
            let own = trace.curves.iter().filter(|c| c.quantity == q);
            own.filter_map(|c| c.noise).fold(0.0, f64::max)
        };
        let sums = gather(std::iter::once(&means));
        let each = sums.into_iter().filter(|(q, _)| *q != Quantity::Bounced);
        let one = |(quantity, s): (Quantity, Sums)| {
            let noise = reading(quantity);
            let felt = matches!(quantity, Quantity::Force | Quantity::Torque);
            let miss = Miss {
                interaction: trace.interaction.clone(),
                held_out: trace.held_out,
                quantity: quantity.name().into(),
                unit: quantity.unit().into(),
                rmse: s.rmse(),
                noise: Some(s.floor()).filter(|n| *n > 0.0),
                of: if felt {
                    format!("means over {BLOCK} s")
                } else {
                    String::new()
                },
            };
            (s.excess() / allowed(quantity, &s, noise, config), miss)
        };
        each.map(one).collect::<Vec<_>>()
    };
    traces.iter().flat_map(of).collect()
}

/// Whether a cause leaves the force of steady sliding as it is.
pub fn hardly_felt(finding: &Finding) -> bool {
    let such = ["added-inertia", "yaw-inertia"];
    such.contains(&finding.cause.as_str())
}

/// Whether a cause is one of how a force is read, which moves nothing.
pub fn moves_nothing(finding: &Finding) -> bool {
    let such = [
        "force-bias",
        "force-bias-world",
        "force-gain",
        "force-crosstalk",
        "force-drift",
        "force-saturation",
        "sensor-lag",
        "quantisation",
    ];
    such.contains(&finding.cause.as_str())
}

/// Whether the plain model foretells the forces.
pub fn forces_fit(traces: &[Trace], config: &Config) -> bool {
    fits(traces, config, |q| matches!(q, Quantity::Force | Quantity::Torque))
}

/// Whether it foretells where things go, as far as anything was foretold of it.
pub fn ways_fit(traces: &[Trace], config: &Config) -> bool {
    let way = |q: Quantity| matches!(q, Quantity::Position | Quantity::Rotation);
    let any = traces
        .iter()
        .flat_map(|t| &t.curves)
        .any(|c| way(c.quantity) && pairs(c).next().is_some());
    !any || fits(traces, config, way)
}

/// Whether the plain model foretells these quantities.
fn fits(traces: &[Trace], config: &Config, of: impl Fn(Quantity) -> bool) -> bool {
    let mut own = traces.to_vec();
    for trace in &mut own {
        let doubts = trace.curves.iter().zip(&trace.doubt).filter(|(c, _)| of(c.quantity));
        trace.doubt = doubts.map(|(_, d)| d.clone()).collect();
        trace.curves.retain(|c| of(c.quantity));
    }
    verdict(&own, config) == Verdict::Adequate
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace(scale: f64) -> Trace {
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        let predicted: Vec<f64> = time.iter().map(|t| if *t > 0.5 { 2.0 } else { 0.0 }).collect();
        let wiggle = |i: usize| if i.is_multiple_of(2) { 0.02 } else { -0.02 };
        let measured = predicted
            .iter()
            .enumerate()
            .map(|(i, p)| scale * p + wiggle(i))
            .collect();
        let label = "force".into();
        let curve = Curve {
            label,
            quantity: Quantity::Force,
            time,
            measured,
            predicted,
            noise: Some(0.02),
        };
        Trace {
            interaction: "push".into(),
            held_out: true,
            curves: vec![curve],
            ..Trace::default()
        }
    }

    #[test]
    fn what_was_held_out_but_tells_nothing_is_no_judge() {
        let mut brief = trace(1.0);
        let curve = &mut brief.curves[0];
        curve.time.truncate(2);
        curve.measured = vec![2.0, f64::NAN];
        curve.predicted = vec![1.0, 2.0];
        let fitted = |scale: f64| Trace {
            held_out: false,
            ..trace(scale)
        };
        let judged = |scale: f64| verdict(&[brief.clone(), fitted(scale)], &Config::default());
        assert_eq!((judged(1.0), judged(1.1)), (Verdict::Adequate, Verdict::Unknown));
        brief.curves[0].measured[0] = f64::NAN;
        let base = base_fit(&[brief, fitted(1.1)], &Config::default());
        assert!(base.held_out.is_empty() && base.rmse["force"] > 0.01, "{base:?}");
    }

    #[test]
    fn noise_alone_is_adequate_and_a_tenth_too_much_is_not() {
        assert_eq!(verdict(&[trace(1.0)], &Config::default()), Verdict::Adequate);
        assert_eq!(verdict(&[trace(1.1)], &Config::default()), Verdict::Unknown);
        assert!(base_fit(&[trace(1.0)], &Config::default()).unexplained < 1e-6);
        assert!((base_fit(&[trace(1.1)], &Config::default()).unexplained - 0.0082).abs() < 1e-3);
    }
}
