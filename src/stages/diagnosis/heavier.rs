//! What hangs on the tool gets lighter, or heavier, for as long as it is held: it leaks, or the sensor gives way under a load. Neither is a
//! cause of the catalogue.

use crate::capture::{Capture, Kind, Segmented};
use crate::stages::estimation::{Heavier, heavier};
use crate::twin::{Evidence, Finding};

/// Fewest lifts; the share of them that change one way; and standard deviations of the mean from none.
const FEWEST: usize = 3;
const ONE_WAY: f64 = 0.8;
const CLEAR: f64 = 8.0;
/// What changes in the usual lift, as a share of the weight.
const LEAST: f64 = 0.01;

/// That the weight of what is held changes with the time since it was raised, the same way in all lifts.
pub fn heavier_by_and_by(capture: &Capture, segmented: &[Segmented], findings: &[Finding]) -> Option<Evidence> {
    // A sensor that creeps does so in the air as well.
    if findings.iter().any(|f| f.cause == "force-drift") {
        return None;
    }
    let lifts = capture.interactions.iter().filter(|i| i.kind == Kind::Lift);
    let each = lifts.filter_map(|i| {
        let cut = segmented.iter().find(|s| s.interaction == i.name)?;
        heavier(i, cut, &capture.gravity)
    });
    told(&each.collect::<Vec<Heavier>>())
}

fn told(lifts: &[Heavier]) -> Option<Evidence> {
    let n = lifts.len() as f64;
    if lifts.len() < FEWEST {
        return None;
    }
    let mean = lifts.iter().map(|l| l.rate.0).sum::<f64>() / n;
    let scatter = lifts.iter().map(|l| (l.rate.0 - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let read = lifts.iter().map(|l| l.rate.1.powi(2)).sum::<f64>() / n;
    let statistic = mean.abs() / (scatter.max(read) / n).sqrt().max(1e-12);
    let one_way = lifts.iter().filter(|l| l.rate.0 * mean > 0.0).count() as f64 >= ONE_WAY * n;
    let share = lifts
        .iter()
        .map(|l| (l.rate.0 * l.lasted / l.weight).abs())
        .sum::<f64>()
        / n;
    let clear = statistic > CLEAR && one_way && share > LEAST;
    clear.then(|| Evidence {
        residual: "weight of what is held".into(),
        test: "mean rate over lifts, in standard deviations".into(),
        statistic,
        p_value: 0.0,
        words: format!(
            "what is held gets {} by {:.3} N a second, {:.1} % in a lift: it loses or takes up something, or the sensor creeps under a load",
            if mean < 0.0 { "lighter" } else { "heavier" },
            mean.abs(),
            100.0 * share
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lift(rate: f64) -> Heavier {
        Heavier {
            rate: (rate, 0.004),
            lasted: 2.0,
            weight: 4.0,
        }
    }

    #[test]
    fn what_leaks_in_all_lifts_is_told() {
        assert!(told(&[-0.1, -0.11, -0.095, -0.1].map(lift)).is_some());
        // Now one way and now the other, hardly anything, or once only.
        assert!(told(&[-0.1, 0.11, -0.095, 0.1].map(lift)).is_none());
        assert!(told(&[-0.01, -0.011, -0.0095, -0.01].map(lift)).is_none());
        assert!(told(&[-0.1, -0.1].map(lift)).is_none());
    }
}
