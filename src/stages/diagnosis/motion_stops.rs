//! The ends of a joint's way: what stands there may rest on a stop, which bears what the tool does not, and pushes back
//! inward only.

use nalgebra::Vector3;

use super::motion_laws::Moved;
use super::motion_reads::BIN;
use crate::math::median;
use crate::twin::{Joint, JointKind};

/// Sine of a hinge's lean from the vertical, beside twice the doubt of its axis, up to which no weight loads it.
const UPRIGHT: f64 = 0.05;

/// Sine of a rail's slope beyond which its own weight draws what slides on it.
const LEVEL: f64 = 0.02;

/// True where a weight can load a joint: the axis of a hinge is not upright, a rail is not level.
pub fn weighed(joint: &Joint, gravity: &Vector3<f64>) -> bool {
    let (axis, down) = (Vector3::from(joint.axis.value), gravity.try_normalize(1e-9));
    let doubt = joint.axis.sd.map_or(0.0, |sd| sd.iter().copied().fold(0.0, f64::max));
    down.is_some_and(|down| match joint.kind {
        JointKind::Prismatic => axis.dot(&down).abs() > LEVEL + 2.0 * doubt,
        _ => axis.cross(&down).norm() > UPRIGHT + 2.0 * doubt,
    })
}

/// Share of the way, beside three times the noise of a position, within which a joint is at the end of it: a stop gives by
/// a millimetre or two under what presses on it.
const NEAR: f64 = 0.02;

/// Marks what may rest on a stop: that tells only what it takes to move off it. Of each motion: how many moments its
/// smoothing reaches over, and the noise of its track.
pub fn mark_stops(motions: &mut [Vec<Moved>], spans: impl Iterator<Item = (usize, f64)>) {
    let places = || motions.iter().flatten().map(|m| m.position);
    let ends = [
        places().fold(f64::INFINITY, f64::min),
        places().fold(f64::NEG_INFINITY, f64::max),
    ];
    let spans: Vec<(usize, f64)> = spans.collect();
    // An end that gives strikes no blow: what is felt on the way there goes with the place.
    let given = [1.0, -1.0].map(|way| {
        let each = motions.iter().zip(&spans);
        let pressed: Vec<bool> = each.filter_map(|(m, s)| gives(m, ends, s.1, s.0, way)).collect();
        let votes = pressed.iter().filter(|gave| **gave).count();
        votes > 0 && 2 * votes >= pressed.len()
    });
    for (moments, (reach, jitter)) in motions.iter_mut().zip(spans) {
        let found = stops(moments, ends, jitter, reach, given);
        moments.iter_mut().zip(found).for_each(|(m, stop)| m.stop = stop);
    }
}

/// What a stop may do to the load at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stop {
    /// There is none.
    #[default]
    None,
    /// It may bear a part of it, and push this way: 1 at the lower end, -1 at the upper one.
    Bears(f64),
    /// The joint ran into it, or was snatched off it: speed and force are smoothed over the blow.
    Hit,
}

impl Stop {
    /// The load that is foretold where this is `left` of the measured one and `rubs` is what the joint takes: no more than
    /// it takes to be moved off a lower stop, no less than it takes off an upper one.
    pub fn lets(self, rubs: f64, left: f64) -> f64 {
        match self {
            Self::None => rubs,
            Self::Bears(way) if way > 0.0 => left.min(rubs),
            Self::Bears(_) => left.max(rubs),
            Self::Hit => left,
        }
    }
}

/// Times the usual load from which on it is an end that is felt; share of what presses there that has to be felt before it.
const RISES: f64 = 1.5;
const BEFORE: f64 = 0.35;
/// Share of the way within half the span of its smoothing by which a position may be off.
const SMOOTHED: f64 = 0.2;

/// How near to an end a joint is at it.
fn nearness([low, high]: [f64; 2], jitter: f64) -> f64 {
    (NEAR * (high - low)).max(3.0 * jitter).min(0.05 * (high - low))
}

/// Whether the end gave way under what pressed on it, where one motion pressed on the lower (1) or the upper one (-1): the load
/// rose on the way, over more of it than smoothing may feign of a blow.
fn gives(moments: &[Moved], [low, high]: [f64; 2], jitter: f64, reach: usize, way: f64) -> Option<bool> {
    let near = nearness([low, high], jitter);
    let apart = |m: &Moved| if way > 0.0 { m.position - low } else { high - m.position };
    let moving: Vec<f64> = moments.iter().filter(|m| !m.still).map(|m| m.load.abs()).collect();
    let usual = median(&moving)?;
    let outward = |m: &Moved| -way * m.load;
    let stood = (1..moments.len()).find(|i| {
        let m = &moments[*i];
        m.still && apart(m) < near && outward(m) > PRESSED * usual
    })?;
    let most = moments[stood..]
        .iter()
        .take_while(|m| apart(m) < near)
        .map(outward)
        .fold(0.0, f64::max);
    let rising = moments[..stood].iter().rev().take_while(|m| outward(m) > RISES * usual);
    let rising: Vec<&Moved> = rising.collect();
    let fastest = rising.iter().map(|m| m.speed.abs()).fold(0.0, f64::max);
    let blurred = near + fastest * BIN * (1.0 + SMOOTHED * reach as f64);
    let farthest = rising.iter().map(|m| apart(m)).fold(0.0, f64::max);
    let before = rising
        .iter()
        .filter(|m| apart(m) > near)
        .map(|m| outward(m))
        .fold(0.0, f64::max);
    Some(farthest > blurred && before > BEFORE * most)
}

/// What stops may do, moment by moment, of ends of which those `given` strike no blow. Within `reach` moments of standing at an end the smoothed speed still holds how it
/// set off, and within twice that how it ran into it.
fn stops(moments: &[Moved], [low, high]: [f64; 2], jitter: f64, reach: usize, given: [bool; 2]) -> Vec<Stop> {
    let near = nearness([low, high], jitter);
    let stands = |m: &Moved| match (m.position < low + near, m.position > high - near) {
        _ if !m.still => 0.0,
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ => 0.0,
    };
    let ways: Vec<f64> = moments.iter().map(stands).collect();
    let moving: Vec<f64> = moments.iter().filter(|m| !m.still).map(|m| m.load.abs()).collect();
    let usual = median(&moving).unwrap_or(0.0);
    let mut out = vec![Stop::None; moments.len()];
    let mut hits = Vec::new();
    let mut from = 0;
    for run in ways.chunk_by(|a, b| a == b) {
        let (way, until) = (run[0], from + run.len());
        if way != 0.0 {
            out[from..(until + reach).min(moments.len())].fill(Stop::Bears(way));
            let outward = moments[from..until].iter().map(|m| -way * m.load);
            let gave = given[usize::from(way < 0.0)];
            if from > 0 && !gave && outward.fold(0.0, f64::max) > PRESSED * usual {
                // What pulled on past the stop is already fast when it takes the joint back.
                hits.push(from.saturating_sub(2 * reach + 1)..(from + reach).min(until));
                hits.push(until..(until + 4 * reach + 3).min(moments.len()));
            }
        }
        from = until;
    }
    hits.into_iter().for_each(|hit| out[hit].fill(Stop::Hit));
    out
}

/// What presses on a stop does so with this many times the load that usually moves the joint.
const PRESSED: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn at(position: f64, still: bool) -> Moved {
        Moved {
            position,
            load: 1.0,
            lever: 1.0,
            way: nalgebra::Vector3::y(),
            still,
            ..Moved::default()
        }
    }

    #[test]
    fn a_stop_is_where_it_stands_at_an_end_and_pushes_inward_only() {
        let way = [
            (0.0, true),
            (0.001, true),
            (0.3, false),
            (0.6, true),
            (0.8, false),
            (0.999, true),
        ];
        let mut moments: Vec<Moved> = way.iter().map(|(q, s)| at(*q, *s)).collect();
        let (low, high) = (Stop::Bears(1.0), Stop::Bears(-1.0));
        let found = stops(&moments, [0.0, 1.0], 0.001, 1, [false; 2]);
        assert_eq!(found, [low, low, low, Stop::None, Stop::None, high]);
        // It pulls on past the upper end.
        moments[5].load = 10.0;
        let found = stops(&moments, [0.0, 1.0], 0.001, 0, [false; 2]);
        assert_eq!(found, [low, low, Stop::None, Stop::None, Stop::Hit, high]);
        // A lid of 1.2 N·m that the stop holds takes any load up to its own, and not more.
        assert_eq!([0.0, 1.5].map(|load| low.lets(1.2, load)), [0.0, 1.2]);
        assert_eq!([-3.0, 0.5].map(|load| high.lets(0.2, load)), [0.2, 0.5]);
        assert_eq!((Stop::None.lets(0.2, 5.0), Stop::Hit.lets(0.2, 5.0)), (0.2, 5.0));
    }

    #[test]
    fn an_end_that_gives_is_told_from_a_stop() {
        // To 1.3 rad and standing there, on friction of 0.6 N·m; a spring of 40 N·m/rad from 1.2 rad on, or a stop that is pressed.
        let motion = |gives: bool| {
            let one = |i: u32| {
                let position = (0.02 * f64::from(i)).min(1.3);
                let still = i > 65;
                let spring = 40.0 * (position - 1.2f64).max(0.0);
                let load = match (gives, still) {
                    (true, _) => 0.6 + spring,
                    (false, still) => {
                        if still {
                            4.6
                        } else {
                            0.6
                        }
                    }
                };
                let speed = if still { 0.0 } else { 0.5 };
                Moved {
                    load,
                    speed,
                    ..at(position, still)
                }
            };
            (0..90).map(one).collect::<Vec<Moved>>()
        };
        for (gave, soft) in [(true, true), (false, false)] {
            assert_eq!(gives(&motion(soft), [0.0, 1.3], 1e-3, 2, -1.0), Some(gave));
        }
        assert_eq!(gives(&motion(true), [0.0, 1.3], 1e-3, 2, 1.0), None);
    }
}
