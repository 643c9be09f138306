//! What is wrong with readings of force by themselves, as findings.

use std::collections::BTreeMap;

use crate::base::Estimate;
use crate::capture::{SensorFaults, Strays};
use crate::twin::{Evidence, Finding, Gain};

/// Strays and rounding, where there are such.
pub fn sensor_findings(faults: &SensorFaults) -> Vec<Finding> {
    let strays = faults.strays.as_ref().map(strays);
    let strays = strays.or_else(|| faults.stray_positions.map(stray_positions));
    strays.into_iter().chain(faults.rounding.map(rounding)).collect()
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
    }
}

fn finding(cause: &str, (name, value): (&str, Estimate<f64>), evidence: Evidence, gain: Gain) -> Finding {
    Finding {
        leader: None,
        cause: cause.into(),
        place: "sensor".into(),
        probability: 0.99,
        alternatives: Vec::new(),
        parameters: BTreeMap::from([(name.to_owned(), value)]),
        evidence: vec![evidence],
        gain,
    }
}
