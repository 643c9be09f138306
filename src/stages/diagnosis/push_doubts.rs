//! What the plain model leaves open in pushes that is known only beside the others: blows, what rings after them, and turning.

use super::push_ringing::Ringing;
use super::push_states::Observed;
use crate::math::median;

/// Pushes that tell what blow is usual.
const FEW: usize = 4;
/// A blow this many times the usual one of its speed may still be one.
const EXCUSED: f64 = 1.5;
/// Times by which a push is faster than most, and share of the usual time below which its ringing is taken to die too soon.
const FASTER: f64 = 2.0;
const TOO_SOON: f64 = 0.5;

/// A blow by the same tool is as its speed: a force that overshoots by more than others of its speed do is no ringing,
/// and it is not excused as one.
pub fn excuse_blows(seen: &mut [Observed]) {
    let per_speed: Vec<f64> = seen.iter().map(|o| o.blow.size / o.blow.speed).collect();
    let Some(usual) = median(&per_speed).filter(|_| seen.len() >= FEW) else {
        return;
    };
    for push in seen {
        let share = (EXCUSED * usual * push.blow.speed / push.blow.size.max(1e-9)).min(1.0);
        push.states.iter_mut().for_each(|s| s.ringing *= share);
    }
}

/// What turns is resisted less along its way, and how much less hangs on how its weight is spread: beyond what all pushes share the
/// plain model leaves open this share of it.
const TURNS: f64 = 0.1;

/// Doubts the forces of what turns.
pub fn doubt_turns(seen: &mut [Observed]) {
    let largest = |body: &str| {
        let own = seen.iter().filter(|o| o.body == body).flat_map(|o| &o.states);
        own.map(|s| s.force.norm()).fold(0.0, f64::max)
    };
    let even: Vec<f64> = seen.iter().map(|o| largest(&o.body)).collect();
    for (push, even) in seen.iter_mut().zip(even) {
        for (state, spread) in push.states.iter().zip(&mut push.spread).filter(|(s, _)| s.contact) {
            *spread = spread.hypot(TURNS * (even - state.force.norm()));
        }
    }
}

/// A body rings on the same tool alike. In a fast push the spike of a tip that resists by its rate can hide how it does, so that what
/// is found dies too soon: there it rings as in most pushes, as much more as it is faster.
pub fn ring_as_usual(seen: &mut [Observed]) {
    let bodies: Vec<String> = seen.iter().map(|o| o.body.clone()).collect();
    for body in bodies
        .iter()
        .enumerate()
        .filter(|(i, b)| !bodies[..*i].contains(b))
        .map(|(_, b)| b)
    {
        let own = || seen.iter().filter(|o| o.body == *body);
        let rung: Vec<(Ringing, f64)> = own().filter_map(|o| Some((o.blow.rings?, o.blow.pace()))).collect();
        let paces: Vec<f64> = own().map(|o| o.blow.pace()).collect();
        let Some((usual, pace)) = Ringing::usual(&rung).zip(median(&paces)).filter(|_| rung.len() >= FEW) else {
            continue;
        };
        for push in seen
            .iter_mut()
            .filter(|o| o.body == *body && o.blow.pace() > FASTER * pace)
        {
            let soon = |r: &Ringing| r.decay < TOO_SOON * usual.decay;
            if push.blow.rings.is_some_and(|r| soon(&r)) {
                let own = usual.times(push.blow.pace());
                for s in push.states.iter_mut().filter(|s| s.contact) {
                    s.ringing = s.ringing.max(own.envelope(s.since));
                    let phases = own.phases(s.since, s.span);
                    if phases[0].hypot(phases[1]) > s.phases[0].hypot(s.phases[1]) {
                        s.phases = phases;
                    }
                }
            }
        }
    }
}
