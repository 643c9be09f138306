//! What is wrong with readings of force by themselves, as findings.

use std::collections::BTreeMap;

use super::{Curve, Quantity, Trace};
use crate::base::Estimate;
use crate::capture::{Capture, Clipped, Interaction, SensorFaults, Strays};
use crate::math::interpolate;
use crate::twin::{Evidence, Finding, Gain};

/// How the end of a range is told.
const AT_THE_END: &str = "readings equal to the largest, to the last digit";
/// The same where noise comes after it.
const AT_ONE_LEVEL: &str = "rises that stop at one level, with the noise alone";

/// Strays, rounding and the end of the range, where there are such.
pub fn sensor_findings(capture: &Capture, faults: &SensorFaults, traces: &[Trace]) -> Vec<Finding> {
    let strays = faults.strays.as_ref().map(strays);
    let strays = strays.or_else(|| faults.stray_positions.map(stray_positions));
    let clipped = faults.clipped.as_ref().map(|c| clipped(capture, c, traces));
    let rounding = faults.rounding.map(rounding);
    strays.into_iter().chain(rounding).chain(clipped).collect()
}

/// Readings at the end of the range, which nothing was fitted to.
fn clipped(capture: &Capture, found: &Clipped, traces: &[Trace]) -> Finding {
    let count: usize = found.rows.iter().map(Vec::len).sum();
    let with: Vec<&Interaction> = capture
        .interactions
        .iter()
        .zip(&found.rows)
        .filter_map(|(i, rows)| (!rows.is_empty()).then_some(i))
        .collect();
    let names = |all: &[&Interaction]| all.iter().map(|i| i.name.clone()).collect::<Vec<String>>();
    let held: Vec<&Interaction> = with.iter().copied().filter(|i| i.held_out).collect();
    let judged = if held.is_empty() { with.clone() } else { held.clone() };
    // Predicted sizes where the reading is the limit.
    let of = |i: &&Interaction| -> Vec<f64> {
        let at = capture.interactions.iter().position(|own| own.name == i.name);
        let curve = traces.iter().find(|t| t.interaction == i.name).and_then(|t| {
            let own = |c: &&Curve| c.quantity == Quantity::Force && !c.predicted.is_empty();
            t.curves.iter().find(own)
        });
        let (Some(at), Some(curve), Some(stream)) = (at, curve, &i.force) else {
            return Vec::new();
        };
        let predicted = |row: &usize| interpolate(&curve.time, &curve.predicted, stream.time[*row]);
        found.rows[at].iter().filter_map(predicted).map(f64::abs).collect()
    };
    let sizes: Vec<f64> = judged.iter().flat_map(of).collect();
    let rms = |limit: f64| {
        let squares = sizes.iter().map(|p| (p.min(limit) - found.limit).powi(2));
        // Of none at all the sum is a negative nought.
        ((squares.sum::<f64>() + 0.0) / sizes.len().max(1) as f64).sqrt()
    };
    let (before, after) = (rms(f64::INFINITY), rms(found.limit));
    let limit = Estimate::measured(
        found.limit,
        found.sd.hypot(1e-3 * found.limit),
        "N",
        names(&with),
        if found.sd > 0.0 {
            "readings that scatter about the largest"
        } else {
            "readings that repeat the largest"
        },
    );
    let (test, stand) = if found.sd > 0.0 {
        (
            AT_ONE_LEVEL,
            "stand at one level but for their noise, which rises of the force run into without the blow that speeds the body up",
        )
    } else {
        (AT_THE_END, "stand at one value and none is larger")
    };
    let evidence = Evidence {
        residual: "values of the force".into(),
        test: test.into(),
        statistic: count as f64,
        p_value: 0.0,
        words: format!(
            "{count} of {} readings {stand}: the range of the sensor ends at {:.3} N, and these were left out",
            found.readings, found.limit
        ),
    };
    let gain = Gain {
        rmse_before: before,
        rmse_after: after,
        held_out: names(&held),
        reduction: if before > 0.0 { 1.0 - after / before } else { 0.0 },
        ..force_gain()
    };
    finding("force-saturation", ("Fs", limit), evidence, gain)
}

/// Whether it is of readings that were left out.
pub fn taken_out(finding: &Finding) -> bool {
    let end = |e: &Evidence| e.test.starts_with(AT_THE_END) || e.test.starts_with(AT_ONE_LEVEL);
    finding.cause == "outliers" || finding.evidence.first().is_some_and(end)
}

/// What readings say of the end of the range and what a law of it says are one finding: the readings tell where it is, the law what
/// it explains.
pub fn as_one(findings: &mut Vec<Finding>) {
    let read = |f: &Finding| f.cause == "force-saturation" && taken_out(f);
    let Some(at) = findings.iter().position(read) else {
        return;
    };
    let fitted = |f: &Finding| f.cause == "force-saturation" && f.place == "sensor" && !taken_out(f);
    let Some(of_law) = findings.iter().position(fitted) else {
        return;
    };
    let law = findings[of_law].clone();
    let both = &mut findings[at];
    both.gain = law.gain;
    both.evidence = law.evidence.into_iter().chain(both.evidence.drain(..)).collect();
    findings.remove(of_law);
}

/// Standard deviation of what rounding takes from a force, N.
pub fn rounded_away(faults: &SensorFaults) -> f64 {
    faults.rounding.map_or(0.0, |(step, _)| step / 12.0_f64.sqrt())
}

fn strays(found: &Strays) -> Finding {
    let share = found.count as f64 / found.of as f64;
    let sd = (found.count as f64).sqrt() / found.of as f64;
    let share_of = Estimate::measured(share, sd, "1", found.from.clone(), "readings beside their neighbours");
    let (before, after) = found.scatter;
    let evidence = Evidence {
        residual: "force at rest".into(),
        test: "Hampel identifier, seven standard deviations".into(),
        statistic: found.count as f64,
        p_value: 0.0,
        words: format!(
            "{:.2} % of the readings of force are far from their neighbours",
            100.0 * share
        ),
    };
    let gain = Gain {
        rmse_before: before,
        rmse_after: after,
        held_out: found.held_out.clone(),
        reduction: 1.0 - after / before.max(1e-30),
        ..force_gain()
    };
    finding("outliers", ("share", share_of), evidence, gain)
}

/// Strays of the tracks alone: what is taken out does not count as foretold.
fn stray_positions((count, of): (usize, usize)) -> Finding {
    let share = count as f64 / of as f64;
    let sd = (count as f64).sqrt() / of as f64;
    let share_of = Estimate::measured(share, sd, "1", Vec::new(), "positions beside their neighbours");
    let evidence = Evidence {
        residual: "tracks at rest".into(),
        test: "Hampel identifier, seven standard deviations".into(),
        statistic: count as f64,
        p_value: 0.0,
        words: format!(
            "{:.2} % of the tracked positions are far from their neighbours and were left out",
            100.0 * share
        ),
    };
    let gain = Gain {
        quantity: "position".into(),
        unit: "m".into(),
        ..force_gain()
    };
    finding("outliers", ("share", share_of), evidence, gain)
}

fn rounding((step, values): (f64, usize)) -> Finding {
    let of = Estimate::measured(step, 0.01 * step, "N", Vec::new(), "comb of all readings");
    let evidence = Evidence {
        residual: "values of the force".into(),
        test: "every reading is a multiple of one step".into(),
        statistic: values as f64,
        p_value: 0.0,
        words: format!("forces come in {values} values, {step:.3} N apart: finer ones are rounded away"),
    };
    // What is rounded away cannot be foretold.
    let lost = step / 12.0_f64.sqrt();
    let gain = Gain {
        rmse_before: lost,
        rmse_after: lost,
        ..force_gain()
    };
    finding("quantisation", ("step", of), evidence, gain)
}

fn force_gain() -> Gain {
    Gain {
        quantity: "force".into(),
        rmse_before: 0.0,
        rmse_after: 0.0,
        unit: "N".into(),
        held_out: Vec::new(),
        reduction: 0.0,
        ..Gain::default()
    }
}

fn finding(cause: &str, (name, value): (&str, Estimate<f64>), evidence: Evidence, gain: Gain) -> Finding {
    Finding {
        leader: None,
        priors: BTreeMap::new(),
        cause: cause.into(),
        place: "sensor".into(),
        probability: 0.99,
        alternatives: Vec::new(),
        parameters: BTreeMap::from([(name.to_owned(), value)]),
        evidence: vec![evidence],
        gain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saturation(test: &str, limit: f64, reduction: f64) -> Finding {
        let value = Estimate::measured(limit, 0.01, "N", vec!["pull-00".into()], test);
        let evidence = Evidence {
            residual: "force".into(),
            test: test.into(),
            statistic: 20.0,
            p_value: 0.0,
            words: String::new(),
        };
        let gain = Gain {
            reduction,
            ..force_gain()
        };
        finding("force-saturation", ("Fs", value), evidence, gain)
    }

    #[test]
    fn the_end_of_a_range_is_named_once() {
        let of_law = saturation("log evidence over the model without it", 0.6, 0.4);
        let read = saturation(AT_THE_END, 0.65, 0.0);
        let mut both = vec![of_law.clone(), read];
        as_one(&mut both);
        assert_eq!(both.len(), 1);
        assert!((both[0].parameters["Fs"].value - 0.65).abs() < 1e-9);
        assert!((both[0].gain.reduction - 0.4).abs() < 1e-9 && both[0].evidence.len() == 2);
        // What a law explains does not count as left out.
        assert!(!taken_out(&both[0]));
        let mut alone = vec![of_law];
        as_one(&mut alone);
        assert_eq!(alone.len(), 1);
    }
}
