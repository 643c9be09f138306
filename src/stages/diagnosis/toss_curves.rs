//! A toss as it was tracked beside what is foretold of it: over the flight, over short windows about contacts, and in one go
//! after the first bounce.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};

use super::{Curve, Path, Quantity, Trace};
use crate::base::Pose;
use crate::physics::State;
use crate::stages::estimation::{Conditions, Simulated, Subject, Toss, TossScene, flight_of};

/// Step of the simulation, s.
const STEP: f64 = 1e-3;

/// The traces of all tosses under these conditions.
pub fn traces(subject: &Subject, at: &Conditions) -> Vec<Trace> {
    let study = &subject.study;
    let by = Simulated::new(&study.body, at, &study.level);
    let one = |(i, toss): (usize, &Toss)| {
        let mut trace = Trace {
            interaction: toss.name.clone(),
            held_out: toss.held_out,
            ..Trace::default()
        };
        let Some(((from, to), start)) = flight_of(toss, &by) else {
            trace.remark = Some("no free flight to start from".into());
            windows(&mut trace, subject, i, toss, &by);
            return trace;
        };
        let times = &toss.time[from..];
        let states = by.thrown.fly(&start, &by.land, times, STEP);
        let half = from + (to - from).div_ceil(2).max(5);
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            let curve = |label: &str, quantity, rows: std::ops::RangeInclusive<usize>| {
                let shown = |j: usize| {
                    if rows.contains(&j) {
                        states[j - from].place[k]
                    } else {
                        f64::NAN
                    }
                };
                Curve {
                    label: format!("{}: {axis} {label}", subject.root),
                    quantity,
                    time: times.to_vec(),
                    measured: (from..toss.time.len()).map(|j| toss.place[j][k]).collect(),
                    predicted: (from..toss.time.len()).map(shown).collect(),
                    noise: Some(by.level.place),
                }
            };
            if to > half {
                trace
                    .curves
                    .push(curve("over the rest of its flight", Quantity::Flight, half + 1..=to));
            }
            if to + 1 < toss.time.len() {
                let all = to + 1..=toss.time.len() - 1;
                trace
                    .curves
                    .push(curve("after the first bounce, in one go", Quantity::Bounced, all));
            }
        }
        windows(&mut trace, subject, i, toss, &by);
        let path = Path {
            time: times.to_vec(),
            poses: states.iter().map(|s| pose(subject, s)).collect(),
        };
        trace.paths = BTreeMap::from([(subject.root.clone(), path)]);
        trace.remark = Some("it starts as the first half of its flight has it".into());
        trace
    };
    study.tosses.iter().enumerate().map(one).collect()
}

/// World-from-link.
fn pose(subject: &Subject, s: &State) -> Pose {
    let place = s.place - s.turn * subject.origin.coords;
    Pose(Isometry3::from_parts(Translation3::from(place), s.turn))
}

/// What is foretold at the end of each short window about a contact.
fn windows(trace: &mut Trace, subject: &Subject, index: usize, toss: &Toss, by: &Simulated) {
    let all = subject.study.windows.iter();
    let mut doubt: f64 = 0.0;
    let ends: Vec<(usize, State)> = all
        .filter(|w| w.toss == index && w.scene == TossScene::Contact)
        .filter_map(|w| {
            let times = [toss.time[w.from], toss.time[w.to]];
            let span = times[1] - times[0];
            let own = (w.doubt[0] * span).hypot(w.doubt[1] * span * by.reach);
            doubt = doubt.max(own.hypot(by.level.place));
            let states = by.thrown.fly(&w.start, &w.land(by), &times, STEP);
            Some((w.to, *states.last()?))
        })
        .collect();
    if ends.is_empty() {
        return;
    }
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        trace.curves.push(Curve {
            label: format!("{}: {axis} 0.07 s ahead, about contacts", subject.root),
            quantity: Quantity::Position,
            time: ends.iter().map(|e| toss.time[e.0]).collect(),
            measured: ends.iter().map(|e| toss.place[e.0][k]).collect(),
            predicted: ends.iter().map(|e| e.1.place[k]).collect(),
            // What the track leaves open of where the window starts is noise too.
            noise: Some(doubt),
        });
    }
}
