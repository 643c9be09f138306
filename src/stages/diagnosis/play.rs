//! A hand that holds the child of a joint and does not move with it: play between the two, or a hand that gives.
//!
//! Where hand and child are both followed, the play itself is seen: the hand's way along the freedom and the child's differ
//! by another constant each way, and between the two the hand feels nothing. What gives under the load differs as much,
//! but the load grows with it.

use super::followed::{Followed, Reading, along, units, usual_speed};
use super::told::{Told, gain};
use crate::base::{Estimate, Notices};
use crate::capture::{Capture, Interaction, Segmented};
use crate::math::{median, random_effects};
use crate::twin::{Finding, Joint, JointKind, Model};

/// Shares of the usual speed from which on something sets out; share of the hand's up to which a child stands.
const SETS_OUT: f64 = 0.1;
const REMAINS: f64 = 0.4;
/// Readings each way that a motion has to hold, and readings between the two ways in all.
const FEWEST: usize = 5;
/// Share of half the difference within which the hand is between the two ways.
const WITHIN: f64 = 0.6;
/// Share of the load while it moves that is no load.
const NOTHING: f64 = 0.25;
/// Motions that have to tell; scatter that is expected between them, and the most there may be, as shares.
const MOTIONS: usize = 2;
const SCATTER: f64 = 0.05;
const ALIKE: f64 = 0.25;
/// Standard deviations from nothing; least play at the hand, m; play at the hand that is told whatever it is of, m.
const CLEAR: f64 = 5.0;
const LEAST: f64 = 5e-4;
const FAR: f64 = 4e-3;

/// What one motion to and fro says.
struct Led {
    interaction: String,
    held_out: bool,
    /// Half the difference between the two ways, with its standard deviation, and the middle, rad or m.
    half: (f64, f64),
    middle: f64,
    /// Metres at the hand for each unit of the joint.
    lever: f64,
    /// Load while it moves, N·m or N.
    load: f64,
    readings: Vec<Reading>,
}

/// Play between hand and child of every joint of which none is `named` yet.
pub fn play_findings(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    named: &[Finding],
    notices: &mut Notices,
) -> Vec<Finding> {
    let told = |j: &Joint| named.iter().any(|f| f.cause == "backlash" && f.place == j.name);
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let joints = model.twin.joints().filter(kinds).filter(|j| !told(j));
    joints
        .filter_map(|joint| play_of(capture, segmented, model, joint, notices))
        .collect()
}

fn play_of(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    joint: &Joint,
    notices: &mut Notices,
) -> Option<Finding> {
    let one = |interaction: &Interaction| Followed::of(interaction, segmented, model, joint);
    let followed: Vec<Followed> = capture.interactions.iter().filter_map(one).collect();
    let to_and_fro: Vec<Led> = followed.iter().filter_map(led).collect();
    let told = to_and_fro.iter().filter(|l| !l.held_out).count() >= MOTIONS;
    let all = if told {
        to_and_fro
    } else {
        there_or_back(&followed, joint)?
    };
    let fitted: Vec<&Led> = all.iter().filter(|l| !l.held_out).collect();
    if fitted.len() < MOTIONS {
        return None;
    }
    let (halves, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|l| l.half).unzip();
    let usual = median(&halves)?;
    let pooled = random_effects(&halves, &sds, SCATTER * usual.abs())?;
    let statistic = pooled.mean / pooled.sd;
    let at_hand = pooled.mean * median(&fitted.iter().map(|l| l.lever).collect::<Vec<f64>>())?;
    if statistic < CLEAR || at_hand < LEAST {
        return None;
    }
    if pooled.between > ALIKE * pooled.mean || !free(&fitted) {
        if at_hand > FAR {
            let message = format!(
                "the hand goes {:.0} mm to either side of where it held `{}`, and not without a load: it gives, or slips",
                1e3 * at_hand,
                joint.child
            );
            notices.note("diagnosis", &joint.name, message);
        }
        return None;
    }
    let (quantity, unit) = units(joint.kind == JointKind::Revolute);
    let from: Vec<String> = fitted.iter().map(|l| l.interaction.clone()).collect();
    let held: Vec<&Led> = all.iter().filter(|l| l.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    let words = format!(
        "whenever it turns back the hand goes on by {:.1} mm before the joint follows, and feels nothing meanwhile",
        2e3 * at_hand
    );
    let told = Told {
        cause: "backlash",
        place: &joint.name,
        probability: 0.95,
        rivals: &[],
        parameter: (
            "b",
            Estimate::measured(pooled.mean, pooled.sd, unit, from, "way of hand and joint"),
        ),
        residual: "way of the hand",
        statistic,
        words,
        gain: gain(
            quantity,
            unit,
            [0.0, pooled.mean].map(|half| rms(judged, half)),
            held.iter().map(|l| l.interaction.clone()).collect(),
        ),
    };
    Some(told.finding())
}

/// True where the hand feels nothing between the two ways: neither friction nor what grows with the way.
fn free(all: &[&Led]) -> bool {
    let (mut count, mut along, mut over, mut under) = (0, 0.0, 0.0, 0.0);
    for l in all {
        for r in between(l) {
            let at = (r.hand - r.child - l.middle) / l.half.0;
            along += r.hand_speed.signum() * r.load / l.load;
            over += at * r.load / l.load;
            under += at * at;
            count += 1;
        }
    }
    let loaded = along / count.max(1) as f64;
    count >= FEWEST && loaded.abs() < NOTHING && (over / f64::max(under, 1e-12)).abs() < NOTHING
}

/// Readings between the two ways: the hand moves, the child stands. Where a hand goes one way only it has hardly set out there.
fn between(led: &Led) -> impl Iterator<Item = &Reading> {
    let within = |r: &&Reading| (r.hand - r.child - led.middle).abs() < WITHIN * led.half.0;
    let usual = usual_speed(&led.readings);
    let free =
        move |r: &&Reading| r.hand_speed.abs() > SETS_OUT * usual && r.child_speed.abs() < REMAINS * r.hand_speed.abs();
    led.readings.iter().filter(within).filter(free)
}

/// Root mean square of what a play of `half` to either side leaves of the child's way, the hand's way given.
fn rms(all: &[&Led], half: f64) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for l in all {
        let mut foretold = l.readings[0].child;
        for r in &l.readings {
            let hand = r.hand - l.middle;
            foretold = foretold.clamp(hand - half, hand + half);
            square += (r.child - foretold).powi(2);
            count += 1.0;
        }
    }
    (square / f64::max(count, 1.0)).sqrt()
}

/// By how much the hand is ahead of the child while both go one way, with its standard deviation.
fn apart(way: &[&Reading]) -> Option<(f64, f64)> {
    let each: Vec<f64> = way.iter().map(|r| r.hand - r.child).collect();
    let middle = median(&each).filter(|_| way.len() >= FEWEST)?;
    let off: Vec<f64> = each.iter().map(|d| (d - middle).abs()).collect();
    Some((middle, 1.5 * median(&off)? / (each.len() as f64 / 4.0).max(1.0).sqrt()))
}

/// A motion whose child a hand holds, both followed, to and fro.
fn led(followed: &Followed) -> Option<Led> {
    let (ahead, back) = (apart(&followed.goes(1.0))?, apart(&followed.goes(-1.0))?);
    Some(Led {
        interaction: followed.interaction.clone(),
        held_out: followed.held_out,
        half: (0.5 * (ahead.0 - back.0), 0.5 * ahead.1.hypot(back.1)),
        middle: 0.5 * (ahead.0 + back.0),
        lever: followed.lever,
        load: followed.load,
        readings: followed.readings.clone(),
    })
}

/// Motions that go one way each, some there and some back, of a hand that holds the same place of the child in all of them.
fn there_or_back(all: &[Followed], joint: &Joint) -> Option<Vec<Led>> {
    let home = all.first()?.first;
    let one = |i: usize| {
        let followed = &all[i];
        let from = along(joint, &home, &followed.first);
        let moved = |r: &Reading| Reading {
            hand: r.hand + from,
            ..*r
        };
        let readings: Vec<Reading> = followed.readings.iter().map(moved).collect();
        let [ahead, back] = [1.0, -1.0].map(|sign| apart(&followed.goes(sign)));
        let (sign, (gap, sd)) = match (ahead, back) {
            (Some(gap), None) => (1.0, gap),
            (None, Some(gap)) => (-1.0, gap),
            _ => return None,
        };
        Some((i, sign, (gap + from, sd), readings))
    };
    let each: Vec<_> = (0..all.len()).filter_map(one).collect();
    let side = |sign: f64| {
        let own = each.iter().filter(|e| e.1 == sign && !all[e.0].held_out).map(|e| e.2.0);
        let own: Vec<f64> = own.collect();
        median(&own).filter(|_| own.len() >= MOTIONS)
    };
    let middle = 0.5 * (side(1.0)? + side(-1.0)?);
    let of = |(i, sign, (gap, sd), readings): (usize, f64, (f64, f64), Vec<Reading>)| Led {
        interaction: all[i].interaction.clone(),
        held_out: all[i].held_out,
        half: (sign * (gap - middle), sd),
        middle,
        lever: all[i].lever,
        load: all[i].load,
        readings,
    };
    Some(each.into_iter().map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand to and fro with 1 N·m of friction, in a play, or in a grip that gives as far under that load.
    fn to_and_fro(half: f64, gives: bool) -> Led {
        let (mut child, mut readings, mut last) = (0.0f64, Vec::new(), 0.0);
        for i in 0..400 {
            let hand = 0.5 * (0.02 * f64::from(i)).sin();
            let before = child;
            child = child.clamp(hand - half, hand + half);
            let slides = (child - before).abs() > 0.0;
            let held = if gives { (hand - child) / half } else { 0.0 };
            readings.push(Reading {
                hand,
                child,
                hand_speed: (hand - last) / 0.04,
                child_speed: (child - before) / 0.04,
                load: if slides { (child - before).signum() } else { held },
            });
            last = hand;
        }
        Led {
            interaction: "pull".into(),
            held_out: false,
            half: (half, 1e-3 * half),
            middle: 0.0,
            lever: 0.4,
            load: 1.0,
            readings,
        }
    }

    #[test]
    fn play_is_told_from_a_hand_that_gives() {
        let (play, gives) = (to_and_fro(0.03, false), to_and_fro(0.03, true));
        assert!(free(&[&play]));
        assert!(!free(&[&gives]));
    }

    #[test]
    fn a_play_foretells_the_way_of_the_child() {
        let play = to_and_fro(0.03, false);
        assert!(rms(&[&play], 0.03) < 1e-9);
        assert!(rms(&[&play], 0.0) > 0.02);
    }
}
