//! What lifts show of what stands on what, whatever is known of the shapes: the lower one takes the upper one up with it,
//! and the upper one leaves it behind.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::evidence::excursion;
use crate::capture::{Capture, Interaction, Kind, relative_motion, track_noise};

/// Least way up of what was lifted, m.
const RAISED: f64 = 5e-3;
/// Share of a lift by which what is carried may shift on what carries it.
const SHIFTS: f64 = 0.1;

/// Pairs of names, the lower first, of which lifts show that the second stands on the first.
pub struct Carried(BTreeSet<(String, String)>);

impl Carried {
    /// From every lift of the capture.
    pub fn of(capture: &Capture, up: &Vector3<f64>) -> Self {
        let lifts: Vec<&Interaction> = capture.fitted().filter(|i| i.kind == Kind::Lift).collect();
        let mut along = BTreeSet::new();
        let mut left = BTreeSet::new();
        for run in lifts {
            let Some(target) = run.target.as_deref() else { continue };
            let Some(height) = raised(capture, run, target, up) else {
                continue;
            };
            for other in run.tracks.keys().filter(|name| *name != target) {
                let shift = apart(run, target, other);
                if shift < SHIFTS * height && raised(capture, run, other, up).is_some() {
                    along.insert((target.to_owned(), other.clone()));
                } else if shift > (1.0 - SHIFTS) * height && still(capture, run, other) {
                    left.insert((other.clone(), target.to_owned()));
                }
            }
        }
        Self(along.intersection(&left).cloned().collect())
    }

    /// True where lifts show that `upper` stands on `lower`, itself or by way of others.
    pub fn bears(&self, lower: &str, upper: &str) -> bool {
        self.0.contains(&(lower.to_owned(), upper.to_owned()))
    }

    /// True where a third stands on the lower one and bears the upper one.
    pub fn by_another(&self, lower: &str, upper: &str) -> bool {
        let mut between = self.0.iter().filter(|(l, _)| l == lower).map(|(_, middle)| middle);
        between.any(|middle| self.bears(middle, upper))
    }

    /// True where it stands on anything that was lifted.
    pub fn is_borne(&self, name: &str) -> bool {
        self.0.iter().any(|(_, upper)| upper == name)
    }
}

/// How far up a thing went, where it did.
fn raised(capture: &Capture, run: &Interaction, name: &str, up: &Vector3<f64>) -> Option<f64> {
    let way = excursion(run.tracks.get(name)?, track_noise(capture, name))?;
    Some(up.dot(&way)).filter(|height| *height > RAISED)
}

fn still(capture: &Capture, run: &Interaction, name: &str) -> bool {
    excursion(&run.tracks[name], track_noise(capture, name)).is_none()
}

/// The largest change of the place of one in the frame of the other, m; the noise of its turn counts by their distance.
fn apart(run: &Interaction, one: &str, other: &str) -> f64 {
    let rows = relative_motion(&run.tracks[one], &run.tracks[other]);
    let Some(first) = rows.first() else { return 0.0 };
    let ways = rows.iter().map(|r| (r.position - first.position).norm());
    ways.fold(0.0, f64::max)
}
