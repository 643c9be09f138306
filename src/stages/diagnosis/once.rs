//! What one cause does is not named twice: second names that belong to the first.

use nalgebra::Vector2;

use super::family::Family;
use super::shows_in::TIME;
use crate::math::median;
use crate::twin::Finding;

/// The findings of a ladder without the names that go with another.
pub fn once(family: &dyn Family, findings: Vec<Finding>) -> Vec<Finding> {
    let findings = kept_down(stood_before(with_its_state(findings), usual_force(family)));
    let began = begun_before(of_its_course(findings), lasts(family));
    broken_off(began, &largest(family))
}

/// Standard deviations across a drift up to which a constant reading points along it.
const ALONG: f64 = 3.0;

/// A sensor that warms up creeps less and less: what a drift at a constant rate leaves of it looks like a constant reading along the drift.
fn of_its_course(mut findings: Vec<Finding>) -> Vec<Finding> {
    let of = |cause: &str, names: [&str; 2]| {
        let own = findings.iter().find(|f| f.cause == cause && f.place == "sensor")?;
        let [x, y] = names.map(|n| own.parameters.get(n));
        let sd = x?.sd?.max(y?.sd?);
        Some((Vector2::new(x?.value, y?.value), sd))
    };
    let (Some((drift, of_drift)), Some((bias, sd))) =
        (of("force-drift", ["dx", "dy"]), of("force-bias-world", ["bx", "by"]))
    else {
        return findings;
    };
    let across = drift.perp(&bias).abs() / drift.norm().max(1e-300);
    let doubt = sd.hypot(of_drift / drift.norm().max(1e-300) * bias.norm());
    if across < ALONG * doubt {
        findings.retain(|f| f.cause != "force-bias-world");
    }
    findings
}

/// A drift has gone on for a while before the first touch: a constant reading of its sign that it reaches within the time that the
/// touches take is what it came to until then.
fn begun_before(mut findings: Vec<Finding>, lasts: f64) -> Vec<Finding> {
    let value = |cause: &str, name: &str| {
        let own = findings.iter().find(|f| f.cause == cause && f.place == "sensor")?;
        own.parameters.get(name).map(|e| e.value)
    };
    if let (Some(rate), Some(bias)) = (value("force-drift", "d"), value("force-bias", "b"))
        && (0.0..lasts).contains(&(bias / rate))
    {
        findings.retain(|f| f.cause != "force-bias");
    }
    findings
}

/// Time from the beginning of the capture to its last touch, s.
fn lasts(family: &dyn Family) -> f64 {
    let groups = 0..family.groups().len();
    let times = groups.flat_map(|g| family.covariates(g).into_iter().filter(|c| c.0 == TIME));
    times.flat_map(|c| c.2).filter(|t| t.is_finite()).fold(0.0, f64::max)
}

/// How far above what any other touch reads the end of a range lies that only one shows.
const BEYOND: f64 = 1.05;

/// A bond that only the first touch meets may give otherwise than the law has it; that this one alone is cut off shows no end of a range.
fn broken_off(mut findings: Vec<Finding>, largest: &[f64]) -> Vec<Finding> {
    let bonded = findings.iter().any(|f| f.cause == "breakaway-bond");
    let others = largest.get(1).copied().unwrap_or(0.0);
    let beyond = |f: &Finding| f.parameters.get("Fs").is_some_and(|e| e.value > BEYOND * others);
    if bonded {
        findings.retain(|f| f.cause != "force-saturation" || !beyond(f));
    }
    findings
}

/// What is read along each touch at most, largest first, N.
fn largest(family: &dyn Family) -> Vec<f64> {
    let of = |g: &super::family::Group| {
        let read = g.channels.iter().filter(|c| c.kind == 0).flat_map(|c| &c.measured);
        read.map(|m| m.abs()).fold(0.0, f64::max)
    };
    let mut all: Vec<f64> = family.groups().iter().map(of).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

/// What rubs as it gives comes back only until its spring pulls no more than its friction holds: from the second press on it meets the
/// tool with that much force. A preload up to that is the friction's.
fn kept_down(mut findings: Vec<Finding>) -> Vec<Finding> {
    let value = |cause: &str, name: &str| {
        let own = findings.iter().find(|f| f.cause == cause);
        own.and_then(|f| f.parameters.get(name)).map(|e| e.value)
    };
    let rubs = value("guide-friction", "Fc").or_else(|| value("elastic-hysteresis", "A"));
    if let (Some(rubs), Some(step)) = (rubs, value("preload", "F0"))
        && step < rubs
    {
        findings.retain(|f| f.cause != "preload");
    }
    findings
}

/// Decades of seconds for which a body may have stood before its capture began.
const DECADES: f64 = 6.0;

/// How long a body had stood before it was first pushed nobody knows: where friction ages at rest, a first push that needs more than the
/// capture's own time explains had stood longer, and no bond is needed, unless it holds more than weeks of ageing would.
fn stood_before(mut findings: Vec<Finding>, usual: f64) -> Vec<Finding> {
    let value = |cause: &str, name: &str| {
        let own = findings.iter().find(|f| f.cause == cause && f.place == "support");
        own.and_then(|f| f.parameters.get(name)).map(|e| e.value)
    };
    if let (Some(decade), Some(bond)) = (value("static-ageing", "beta"), value("breakaway-bond", "Fg"))
        && bond < DECADES * decade * usual
    {
        findings.retain(|f| f.cause != "breakaway-bond");
    }
    findings
}

/// The median of what is read along the touches, N.
fn usual_force(family: &dyn Family) -> f64 {
    let channels = family.groups().iter().flat_map(|g| &g.channels);
    let read: Vec<f64> = channels
        .filter(|c| c.kind == 0)
        .flat_map(|c| &c.measured)
        .map(|m| m.abs())
        .collect();
    median(&read).unwrap_or(0.0)
}

/// Evidence of what ages at rest over that of what goes with speed, or the other way round, up to which they are one law.
const OF_ONE_LAW: f64 = 3.0;

/// Friction that goes with the logarithm of speed and ages at rest is one law of rate and state (Dieterich 1979; Ruina 1983).
fn with_its_state(mut findings: Vec<Finding>) -> Vec<Finding> {
    let of = |cause: &str| findings.iter().position(|f| f.cause == cause);
    let (Some(rate), Some(state)) = (of("rate-state-friction"), of("static-ageing")) else {
        return findings;
    };
    let worth = |k: usize| findings[k].evidence.first().map_or(0.0, |e| e.statistic);
    let ratio = worth(rate) / worth(state);
    if (1.0 / OF_ONE_LAW..OF_ONE_LAW).contains(&ratio) {
        let aged = findings[state].evidence.clone();
        findings[rate].evidence.extend(aged);
        findings.remove(state);
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Estimate;
    use crate::stages::diagnosis::told::{Told, gain};

    fn found(cause: &str, name: &str, value: f64) -> Finding {
        let told = Told {
            cause,
            place: "support",
            probability: 0.97,
            rivals: &[],
            parameter: (name, Estimate::measured(value, 0.1 * value, "N", Vec::new(), "test")),
            residual: "force",
            statistic: 9.0,
            words: String::new(),
            gain: gain("force", "N", [1.0, 0.1], Vec::new()),
        };
        told.finding()
    }

    #[test]
    fn what_ageing_or_a_guide_explains_is_not_named_twice() {
        // A tenth of 5 N for each of six decades: up to 3 N may be a long stand.
        let aged = |bond: f64| vec![found("static-ageing", "beta", 0.1), found("breakaway-bond", "Fg", bond)];
        assert_eq!([2.0, 6.0].map(|bond| stood_before(aged(bond), 5.0).len()), [1, 2]);
        let guided = |step: f64| vec![found("guide-friction", "Fc", 0.6), found("preload", "F0", step)];
        assert_eq!([0.3, 0.9].map(|step| kept_down(guided(step)).len()), [1, 2]);
        assert_eq!(kept_down(vec![found("preload", "F0", 0.3)]).len(), 1);
    }

    #[test]
    fn a_reading_along_a_drift_is_the_drifts() {
        let both = |bias: [f64; 2]| {
            let mut all = vec![
                found("force-drift", "dx", 1e-3),
                found("force-bias-world", "bx", bias[0]),
            ];
            for (f, own) in all.iter_mut().zip([("dy", -1e-3), ("by", bias[1])]) {
                f.place = "sensor".into();
                f.parameters.insert(
                    own.0.into(),
                    Estimate::measured(own.1, 0.1 * own.1.abs(), "N", Vec::new(), "test"),
                );
            }
            of_its_course(all).len()
        };
        assert_eq!(
            [both([0.02, -0.021]), both([-0.02, 0.02]), both([0.02, 0.02])],
            [1, 1, 2]
        );
    }

    #[test]
    fn what_a_drift_came_to_before_the_first_touch_is_no_bias() {
        let both = |bias: f64| {
            let mut all = vec![found("force-drift", "d", 2e-3), found("force-bias", "b", bias)];
            all.iter_mut().for_each(|f| f.place = "sensor".into());
            begun_before(all, 60.0).len()
        };
        assert_eq!([both(0.1), both(0.2), both(-0.1)], [1, 2, 2]);
    }

    #[test]
    fn an_end_of_the_range_that_only_a_bond_reaches_is_none() {
        let both = || vec![found("breakaway-bond", "Fg", 6.0), found("force-saturation", "Fs", 5.0)];
        assert_eq!(broken_off(both(), &[5.1, 2.5, 2.4]).len(), 1);
        assert_eq!(broken_off(both(), &[5.1, 5.0, 2.4]).len(), 2);
        assert_eq!(broken_off(both()[1..].to_vec(), &[5.1, 2.5]).len(), 1);
    }
}
