//! Which causes of the catalogue these data could show: those of which a ladder could try a law, and those of which a finder had all
//! that it needs. The rest is listed with what would show it.

use std::collections::BTreeSet;

use super::aloft::tells_across;
use super::asking::Has;
use super::contact_law::tells_its_law;
use super::coupling::tells_coupling;
use super::delay::tells_delay;
use super::family::Family;
use super::frames::tells_frame;
use super::given::{tells_finger, tells_gain};
use super::hand_delay::tells_hand_delay;
use super::inertia::tells_inertia;
use super::joint_lag::joints_tell_lag;
use super::naming::Ladder;
use super::offset::tells_centre;
use super::onset::{Onset, begin_slowly, onsets};
use super::reversals::tells_bristles;
use super::sensor_lag::tells_lag;
use super::sinking::tells_sinking;
use super::tares::tells_tare;
use super::uneven::tells_yaw;
use super::{Config, Trace};
use crate::capture::{Capture, Segmented};
use crate::stages::estimation::Inertial;
use crate::twin::{CAUSES, Finding, Model};

/// Laws that only one kind of touch has: by them it is known that it was tried.
const OF_PUSHES: &str = "anisotropic-friction";
const OF_PRESSES: &str = "plastic-set";
const OF_MOTIONS: &str = "joint-stiction";
/// Ways on which things rolled that tell what slows them.
const ROLLS: usize = 2;

/// What was tried, as far as it is known.
#[derive(Clone, Debug, Default)]
pub struct Scope {
    /// Causes of which a law was tried that the data could show.
    tested: BTreeSet<&'static str>,
    /// Causes of which there was a law, shown or not.
    laws: BTreeSet<&'static str>,
}

impl Scope {
    /// The laws of a kind of experiment. Where so few of them were made that nothing may be named none of them counts.
    pub fn climbed(&mut self, family: &dyn Family, ladder: &Ladder) {
        for (k, law) in family.laws().iter().enumerate() {
            let centre: Vec<f64> = law.parameters.iter().map(|p| p.centre).collect();
            if family.named_from(k, &centre).is_infinite() {
                continue;
            }
            self.laws.insert(law.cause);
            if !ladder.untestable.contains(&k) {
                self.tested.insert(law.cause);
            }
        }
    }

    /// What the finders beside the ladders could tell.
    pub fn looked_at(
        &mut self,
        (capture, segmented, model): (&Capture, &[Segmented], &Model),
        (fast, rolled): (&[Inertial], usize),
        (traces, findings): (&[Trace], &[Finding]),
    ) {
        let begun = onsets(capture, segmented, model);
        let all: Vec<Onset> = begun.iter().flat_map(|(_, all)| all.iter().cloned()).collect();
        let [late, drifts] = tells_hand_delay(capture, segmented, model).map(|told| told || tells_delay(traces));
        let lags = tells_lag(&all) || joints_tell_lag(capture, segmented, model);
        let yaw = tells_yaw(capture, model);
        let told: [(bool, &[&'static str]); 16] = [
            (reads_force(capture), &["force-saturation", "quantisation", "outliers"]),
            (late, &["time-delay"]),
            (drifts, &["clock-drift"]),
            (lags, &["sensor-lag"]),
            (
                tells_tare(capture, segmented),
                &["force-bias", "force-bias-world", "force-drift"],
            ),
            (tells_gain(capture, segmented), &["force-gain"]),
            (tells_across(capture, segmented), &["force-crosstalk"]),
            (tells_frame(capture, model, traces), &["length-scale", "tracking-error"]),
            (
                begin_slowly(&begun) || tells_bristles(capture, segmented, model),
                &["presliding"],
            ),
            (begun.iter().any(|(_, all)| tells_its_law(all)), &["contact-law"]),
            (tells_finger(model), &["tool-friction"]),
            (tells_centre(model), &["com-offset"]),
            (yaw, &["yaw-inertia", "nonuniform-density"]),
            (
                tells_inertia((capture, segmented, model), fast, findings),
                &["added-inertia"],
            ),
            (tells_sinking(capture, segmented, model), &["support-compliance"]),
            (tells_coupling(capture, segmented, model), &["joint-coupling"]),
        ];
        for (_, causes) in told.iter().filter(|(told, _)| *told) {
            self.tested.extend(causes.iter());
        }
        if capture.interactions.iter().any(|i| !i.tracks.is_empty()) {
            self.tested.insert("outliers");
        }
        if rolled >= ROLLS {
            self.tested.insert("rolling-resistance");
        }
    }

    /// Causes that may be named, were not, and could not have been.
    pub fn unseen(&self, findings: &[Finding], config: &Config) -> Vec<&'static str> {
        let told = |c: &str| {
            findings
                .iter()
                .any(|f| f.cause == c || f.alternatives.iter().any(|a| a.cause == c))
        };
        let open = CAUSES.into_iter().filter(|c| config.allows(c) && !told(c));
        open.filter(|c| !self.tested.contains(c)).collect()
    }

    /// What there was to be tried.
    pub fn has(&self, capture: &Capture, model: &Model) -> Has {
        Has {
            force: reads_force(capture),
            joint: model.twin.joints().next().is_some(),
            pushed: self.laws.contains(OF_PUSHES),
            pressed: self.laws.contains(OF_PRESSES),
            turned: self.laws.contains(OF_MOTIONS),
        }
    }
}

/// Whether any tool read a force.
fn reads_force(capture: &Capture) -> bool {
    let mut streams = capture.interactions.iter().filter_map(|i| i.force.as_ref());
    streams.any(|s| s.force.iter().any(|f| f.iter().all(|x| x.is_finite())))
}
