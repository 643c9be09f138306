//! What lifts read of weights beside everything else: that a thing does not weigh the same each time, and that a sensor which cuts
//! off reads heavy things too light.

use std::collections::BTreeMap;

use crate::capture::{Capture, Kind, Segmented};
use crate::stages::estimation::{Hung, hung, hung_untared};
use crate::twin::{Evidence, Finding};

/// Fewest lifts, the least change as a share of the weight, standard deviations of it, and what a lift misses of a weight anyway.
const FEWEST: usize = 3;
const LEAST: f64 = 0.03;
const CLEAR: f64 = 8.0;
/// The same of so many lifts, each of which weighed less (or more) than the one before.
const ALL: (usize, f64) = (6, 5.0);
const MISSES: f64 = 0.003;
/// Weight over what the sensor cuts off at from which on that is what was read of it.
const NEAR: f64 = 0.8;

/// That a thing weighs less and less, or more and more, from lift to lift: nothing of the catalogue does that.
pub fn weights_differ(capture: &Capture, segmented: &[Segmented]) -> Option<Evidence> {
    let up = (-capture.gravity).try_normalize(1e-9)?;
    type Weights<'a> = Vec<(&'a str, f64, f64)>;
    let mut by_thing: BTreeMap<&str, [Weights; 2]> = BTreeMap::new();
    for lift in capture.interactions.iter().filter(|i| i.kind == Kind::Lift) {
        let target = lift.target.as_ref().or_else(|| lift.tracks.keys().next());
        let cut = segmented.iter().find(|s| s.interaction == lift.name);
        // What else came up with it may be another thing each time.
        let (Some(target), Some(cut), 1) = (target, cut, lift.tracks.len()) else {
            continue;
        };
        let reads = [hung, hung_untared].map(|of| of(lift, cut, &capture.gravity));
        for (all, read) in by_thing.entry(target).or_default().iter_mut().zip(reads) {
            let weighs = |read: Hung| {
                let weight = read.force.dot(&up);
                (lift.name.as_str(), weight, read.sd.hypot(MISSES * weight))
            };
            all.extend(read.map(weighs));
        }
    }
    // Where a sensor never read nothing, it reads too much by the same each time.
    let whole = |all: &[Weights; 2]| usize::from(all[0].len() < all[1].len());
    by_thing
        .iter()
        .find_map(|(thing, all)| one_way_only(thing, &all[whole(all)]))
}

/// Lifts in the order in which they were made: their names, what they weighed, N, and how well.
fn one_way_only(thing: &str, lifts: &[(&str, f64, f64)]) -> Option<Evidence> {
    if lifts.len() < FEWEST {
        return None;
    }
    let (first, last) = (lifts[0], lifts[lifts.len() - 1]);
    let change = last.1 - first.1;
    let sd = first.2.hypot(last.2);
    let onward = lifts
        .windows(2)
        .all(|w| (w[1].1 - w[0].1) * change.signum() > -2.0 * w[0].2.hypot(w[1].2));
    // Between its ends it goes some of the way: one lift that took hold of something else is no change.
    let between = lifts[1..lifts.len() - 1].iter();
    let passing = between.clone().any(|l| {
        let share = (l.1 - first.1) / change;
        (0.15..0.85).contains(&share)
    });
    let each = lifts.windows(2).all(|w| (w[1].1 - w[0].1) * change > 0.0);
    let least = if each && lifts.len() >= ALL.0 { ALL.1 } else { CLEAR };
    let clear = change.abs() > least * sd && change.abs() > LEAST * first.1.abs();
    (clear && onward && passing).then(|| Evidence {
        residual: format!("weight in {}", lifts.iter().map(|l| l.0).collect::<Vec<_>>().join(", ")),
        test: "change from the first lift to the last over its standard deviation".into(),
        statistic: change / sd,
        p_value: (-0.5 * (change / sd).powi(2)).exp(),
        words: format!(
            "{thing} weighs {:.2} N in the first lift and {:.2} N in the last: it loses or takes up matter, of which the catalogue knows nothing",
            first.1, last.1
        ),
    })
}

/// Weights near what a sensor cuts off at say nothing of its gain.
pub fn within_range(findings: &mut Vec<Finding>) {
    let cut = findings.iter().filter(|f| f.cause == "force-saturation");
    let Some(limit) = cut
        .filter_map(|f| f.parameters.get("Fs"))
        .map(|e| e.value)
        .reduce(f64::min)
    else {
        return;
    };
    findings.retain(|f| {
        let off = f.parameters.get("g").map_or(0.0, |g| g.value.abs());
        f.cause != "force-gain" || off <= 0.0 || f.gain.rmse_before / off < NEAR * limit
    });
}

#[cfg(test)]
mod tests {
    use super::super::told::one_named;
    use super::*;
    use crate::base::Estimate;
    use crate::twin::Gain;

    #[test]
    fn a_thing_that_leaks_is_told_and_one_odd_lift_is_none() {
        let of = |weights: [f64; 4]| weights.map(|w| ("lift", w, 0.01)).to_vec();
        assert!(one_way_only("can", &of([5.5, 5.2, 4.95, 4.9])).is_some());
        assert!(one_way_only("can", &of([5.5, 5.5, 5.5, 4.9])).is_none());
        assert!(one_way_only("can", &of([5.5, 4.9, 5.2, 4.9])).is_none());
        assert!(one_way_only("can", &of([5.5, 5.49, 5.5, 5.51])).is_none());
        // Eight of which each weighs less than the one before say so sooner than four do.
        let slowly: Vec<_> = (0..8).map(|k| ("lift", 5.5 - 0.03 * f64::from(k), 0.02)).collect();
        assert!(one_way_only("can", &slowly).is_some() && one_way_only("can", &slowly[..4]).is_none());
    }

    #[test]
    fn a_weight_at_the_end_of_the_range_is_no_gain() {
        let named = |cause: &str, parameter: (&str, f64), rmse_before: f64| {
            let mut finding = one_named(
                cause,
                Gain {
                    rmse_before,
                    ..Gain::default()
                },
            );
            let value = Estimate::measured(parameter.1, 0.01, "1", Vec::new(), "lifts");
            finding.parameters.insert(parameter.0.into(), value);
            finding
        };
        let causes = |weight: f64| {
            // A gain of -0.1 leaves a tenth of the weight.
            let gain = named("force-gain", ("g", -0.1), 0.1 * weight);
            let mut findings = vec![named("force-saturation", ("Fs", 5.0), 1.0), gain];
            within_range(&mut findings);
            findings.len()
        };
        assert_eq!((causes(4.8), causes(2.0)), (1, 2));
    }
}
