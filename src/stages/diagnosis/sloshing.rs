//! A part that swings inside what hung on the tool and was moved to and fro.

use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::stages::estimation::{Sloshing, sloshing};
use crate::twin::{Finding, Model};

/// Log-likelihood over that of a rigid body, nats, for its three numbers; of lifts that the others foretell the share that it makes
/// better, and their sum, nats.
const NAMED: f64 = 20.0;
const BETTER: f64 = 0.6;
const FORETELLS: f64 = 8.0;
/// Standard deviations of the share of the mass, and the least share, from which on it counts.
const CLEAR: f64 = 6.0;
const LEAST: f64 = 0.03;
/// What it leaves of the error of a rigid body at most; and where so many lifts all bear it out, by so many nats together.
const LEAVES: [f64; 2] = [0.85, 0.95];
const ALL: (usize, f64) = (4, 25.0);
/// Rates beyond which an arm that gives, or a slow creep of the reading, is as good a reason, rad/s; and the largest share.
const SWINGS: [f64; 2] = [7.0, 65.0];
const WHOLE: f64 = 0.9;
/// Damping ratio from which on nothing swings that could be told from a force that is read late.
const DIES: f64 = 0.45;

/// A loose mass of every link that hung on the tool and shows one.
pub fn sloshing_findings(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Finding> {
    let all = sloshing(capture, segmented, model);
    all.into_iter().filter(clear).map(finding).collect()
}

fn clear(s: &Sloshing) -> bool {
    let better = s.foretold.iter().filter(|g| **g > 0.0).count() as f64;
    // One lift alone bears nothing out.
    let several = s.foretold.len() > 1;
    let borne_out = several && better >= BETTER * s.foretold.len() as f64 && s.foretold.iter().sum::<f64>() > FORETELLS;
    let (share, sd) = s.share;
    let told = s.gain > NAMED && borne_out && share > (CLEAR * sd).max(LEAST) && share < WHOLE;
    let swings = s.damping.0 < DIES && (SWINGS[0]..SWINGS[1]).contains(&s.rate.0);
    let all =
        s.foretold.len() >= ALL.0 && s.foretold.iter().all(|g| *g > 0.0) && s.foretold.iter().sum::<f64>() > ALL.1;
    told && swings && s.left[1] < LEAVES[usize::from(all)] * s.left[0]
}

fn finding(s: Sloshing) -> Finding {
    let of = |(value, sd): (f64, f64), unit: &str| Estimate::measured(value, sd, unit, s.from.clone(), "lift-shake");
    let words = format!(
        "{:.0} % of what hung on the tool swings at {:.1} Hz by itself",
        100.0 * s.share.0,
        s.rate.0 / std::f64::consts::TAU
    );
    let told = Told {
        cause: "loose-mass",
        place: &s.link,
        probability: 0.95,
        rivals: &[],
        parameter: ("share", of(s.share, "1")),
        residual: "force in the air",
        statistic: s.share.0 / s.share.1.max(1e-9),
        words,
        gain: gain("force", "N", s.left, s.held_out.clone()),
    };
    let mut finding = told.finding();
    finding.parameters.insert("rate".into(), of(s.rate, "rad/s"));
    finding.parameters.insert("damping_ratio".into(), of(s.damping, "1"));
    finding
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen() -> Sloshing {
        Sloshing {
            link: "box".into(),
            from: vec!["shake-1".into(), "shake-2".into()],
            held_out: Vec::new(),
            share: (0.2, 0.01),
            rate: (25.0, 0.5),
            damping: (0.1, 0.02),
            gain: 60.0,
            foretold: vec![20.0, 30.0],
            left: [0.3, 0.05],
        }
    }

    #[test]
    fn what_other_lifts_bear_out_is_named_with_its_numbers() {
        assert!(clear(&seen()));
        let found = finding(seen());
        assert_eq!(found.cause, "loose-mass");
        assert!((found.parameters["rate"].value - 25.0).abs() < 1e-12 && found.gain.reduction > 0.8);
    }

    #[test]
    fn what_other_lifts_speak_against_or_hardly_swings_is_not() {
        let unlike = Sloshing {
            foretold: vec![20.0, -30.0],
            ..seen()
        };
        let faint = Sloshing {
            share: (0.02, 0.001),
            ..seen()
        };
        let stiff = Sloshing {
            rate: (80.0, 0.5),
            ..seen()
        };
        let alone = Sloshing {
            foretold: Vec::new(),
            ..seen()
        };
        let dead = Sloshing {
            damping: (0.6, 0.02),
            ..seen()
        };
        assert!(![unlike, faint, stiff, alone, dead].iter().any(clear));
        // Beside much noise only many lifts bear it out.
        let noisy = |foretold: &[f64]| Sloshing {
            left: [0.05, 0.046],
            foretold: foretold.to_vec(),
            ..seen()
        };
        assert!(clear(&noisy(&[2.0, 11.0, 15.0, 11.0])) && !clear(&noisy(&[20.0, 30.0])));
        assert!(!clear(&noisy(&[2.0, 30.0, -1.0, 11.0])));
    }
}
