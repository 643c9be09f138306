//! What a diagnosis comes to, and how sure its names are beside all that has none.

use super::compare::{forces_fit, hardly_felt, moves_nothing, verdict, ways_fit};
use super::sensor::taken_out;
use super::tares::before_the_touch;
use super::{Config, Trace};
use crate::twin::{Finding, Verdict};

/// Below this probability a finding's name is one of several.
const SURE: f64 = 0.9;
/// How often a catalogue holds what was named for sure: of 482 such names in blind scenes of two engines 470 were right.
const HELD: f64 = 0.975;
/// What is left of their odds where none of them bears on what is foretold wrongly.
const WANTING: f64 = 0.5;

/// What is said of all: named causes leave something (`left`), or what is foretold with them is off; or nothing is named, though
/// something is wrong (`overruled`). The odds of findings are among what has a name: room is left beside them.
pub fn concluded(
    traces: &[Trace],
    findings: &mut [Finding],
    (left, overruled): (bool, bool),
    config: &Config,
) -> Verdict {
    let as_foretold = verdict(traces, config);
    let wanting = as_foretold == Verdict::Unknown && beside_the_point(traces, findings, config);
    let verdict = match as_foretold {
        _ if left || wanting || (overruled && findings.iter().all(of_the_beginning)) => Verdict::Unknown,
        _ if findings.iter().any(|f| f.probability < SURE) => Verdict::Ambiguous,
        // What was taken out, or read, before anything was foretold does not explain what is left.
        Verdict::Unknown if findings.iter().all(|f| taken_out(f) || before_the_touch(f)) => Verdict::Unknown,
        _ if findings.is_empty() => Verdict::Adequate,
        _ => Verdict::Explained,
    };
    let share = if wanting { WANTING * HELD } else { HELD };
    findings.iter_mut().for_each(|f| f.less_likely(share));
    verdict
}

/// Whether a finding is of how a touch begins or of readings that were left out, which is no reason for what a touch leaves as a whole.
fn of_the_beginning(finding: &Finding) -> bool {
    let such = ["presliding", "contact-law"].contains(&finding.cause.as_str());
    such || taken_out(finding) || before_the_touch(finding)
}

/// Whether none of the findings bears on what is foretold wrongly.
fn beside_the_point(traces: &[Trace], findings: &[Finding], config: &Config) -> bool {
    // What bears on inertia alone is no reason for a force that is off while it slides, nor what bears on the reading of forces
    // alone for a thing that goes another way.
    findings.iter().all(hardly_felt) && !forces_fit(traces, config)
        || findings.iter().all(moves_nothing) && !ways_fit(traces, config)
}

#[cfg(test)]
mod tests {
    use super::super::told::{gain, one_named};
    use super::*;

    fn named(cause: &str) -> Finding {
        one_named(cause, gain("force", "N", [1.0, 0.1], Vec::new()))
    }

    #[test]
    fn what_begins_a_touch_is_no_reason_for_what_it_leaves_as_a_whole() {
        let said =
            |cause: &str, overruled: bool| concluded(&[], &mut [named(cause)], (false, overruled), &Config::default());
        assert_eq!(said("presliding", true), Verdict::Unknown);
        assert_eq!(said("presliding", false), Verdict::Explained);
        assert_eq!(said("bump", true), Verdict::Explained);
    }
}
