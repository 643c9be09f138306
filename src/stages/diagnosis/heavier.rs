//! What hangs on the tool gets lighter, or heavier, for as long as it is held: it leaks, or the sensor gives way under a load. Neither is a
//! cause of the catalogue.

use std::collections::BTreeMap;

use super::rotors::spins_within;
use crate::capture::{Capture, Kind, Segmented};
use crate::math::t_tail;
use crate::stages::estimation::{Heavier, heavier};
use crate::twin::{Evidence, Finding};

/// Fewest lifts of one thing; the share of them that change one way; and standard deviations of the mean from none, with the chance of it.
const FEWEST: usize = 3;
const ONE_WAY: f64 = 0.8;
const CLEAR: (f64, f64) = (6.0, 2e-3);
/// What goes with the height, or comes up late, does so in every lift.
const FEIGNS: [&str; 6] = [
    "force-drift",
    "tether",
    "magnet",
    "sensor-lag",
    "time-delay",
    "loose-mass",
];
/// What changes in the usual lift, as a share of the weight.
const LEAST: f64 = 0.01;

/// What shows of a thing while it hangs on the tool that no cause of the catalogue does: something spins in it, or it changes its weight.
pub fn while_it_hangs(capture: &Capture, segmented: &[Segmented], findings: &[Finding]) -> Option<Evidence> {
    spins_within(capture, segmented).or_else(|| heavier_by_and_by(capture, segmented, findings))
}

/// That the weight of what is held changes with the time since it was raised, the same way in all lifts.
fn heavier_by_and_by(capture: &Capture, segmented: &[Segmented], findings: &[Finding]) -> Option<Evidence> {
    if findings.iter().any(|f| FEIGNS.contains(&f.cause.as_str())) {
        return None;
    }
    let mut by_link: BTreeMap<String, Vec<Heavier>> = BTreeMap::new();
    for lift in capture.fitted().filter(|i| i.kind == Kind::Lift) {
        let cut = segmented.iter().find(|s| s.interaction == lift.name);
        if let Some(own) = cut.and_then(|cut| heavier(lift, cut, &capture.gravity)) {
            by_link.entry(own.link.clone()).or_default().push(own);
        }
    }
    let each = by_link.iter().filter_map(|(link, lifts)| told(link, lifts));
    each.max_by(|a, b| a.statistic.total_cmp(&b.statistic))
}

fn told(link: &str, lifts: &[Heavier]) -> Option<Evidence> {
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
    let p_value = t_tail(statistic, n - 1.0);
    let clear = statistic > CLEAR.0 && p_value < CLEAR.1 && one_way && share > LEAST;
    let sd = mean.abs() / statistic;
    clear.then(|| Evidence {
        residual: format!("weight of {link} while it is held"),
        test: "mean rate over lifts, in standard deviations".into(),
        statistic,
        p_value,
        words: format!(
            "while it is held {link} gets {} by {:.3} ± {sd:.3} N a second, {:.1} % in a lift: it loses or takes up something, or the sensor \
             creeps under a load",
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
            link: "bag".into(),
            rate: (rate, 0.004),
            lasted: 2.0,
            weight: 4.0,
        }
    }

    #[test]
    fn what_leaks_in_all_lifts_is_told() {
        assert!(told("bag", &[-0.1, -0.11, -0.095, -0.1].map(lift)).is_some());
        // Now one way and now the other, hardly anything, or once only.
        assert!(told("bag", &[-0.1, 0.11, -0.095, 0.1].map(lift)).is_none());
        assert!(told("bag", &[-0.01, -0.011, -0.0095, -0.01].map(lift)).is_none());
        assert!(told("bag", &[-0.1, -0.1].map(lift)).is_none());
    }
}
