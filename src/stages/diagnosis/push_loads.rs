//! What the table bears while something is pushed, and what it takes to bring that to its speed.

use nalgebra::Vector3;

use super::predict::Scene;
use super::push_states::State;
use crate::twin::Link;

/// Loads over the weight that are believed.
const LOADS: [f64; 2] = [0.2, 20.0];

/// Makes of the force along the normal what the table bears over the `weight`, N, of what is moved.
pub fn borne(states: &mut [State], scene: &Scene, normal: &Vector3<f64>, weight: f64) {
    let tare = scene
        .segmented
        .and_then(|s| s.force_tare)
        .map_or(0.0, |t| t.dot(normal));
    for s in states {
        s.loaded = (1.0 - (s.loaded - tare) / weight).clamp(LOADS[0], LOADS[1]);
    }
}

/// What the plain model takes the table to bear over the weight of `link`, with what it lets ride on it.
pub fn foretold_load(scene: &Scene, link: &Link, carried: &[String]) -> f64 {
    let mass = |link: &Link| link.mass.as_ref().map(|m| m.value);
    let more = carried.iter().filter_map(|name| mass(scene.model.twin.link(name)?));
    mass(link).map_or(1.0, |own| 1.0 + more.sum::<f64>() / own)
}

/// Makes the states of a body of `mass` (kg) with something known lying on it those of one that is pressed down so much, of which the
/// plain model foretold the force at a load of `foretold`.
pub fn lade(states: &mut [State], mass: f64, laden: f64, foretold: f64) {
    if laden > 1.0 {
        set_out(states, mass * laden);
        for s in states {
            s.loaded += laden - 1.0;
            s.force /= foretold;
        }
    }
}

/// Seconds in which what carries a load is brought to its speed, and in which what that leaves dies down to a third.
const SPED_UP: f64 = 0.04;
const DIES: f64 = 0.08;

/// Doubts the first moments of what carries a load (`mass`, kg, of both): a tool that gives overshoots as it sets them going, more
/// than it does with the body alone, and no number that all touches share can stand for that.
fn set_out(states: &mut [State], mass: f64) {
    let Some(first) = states.iter().find(|s| s.contact).map(|s| s.time) else {
        return;
    };
    let top = states.iter().filter(|s| s.contact).map(|s| s.speed).fold(0.0, f64::max);
    for s in states.iter_mut().filter(|s| s.contact) {
        let haste = mass * top / SPED_UP * (-(s.time - first) / DIES).exp();
        s.ringing = s.ringing.max(haste);
    }
}
