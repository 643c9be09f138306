//! What all pushes of a capture reach: places, speeds, loads.

use nalgebra::Vector2;

use super::push_states::State;
use super::pushes::Pushes;
use crate::math::median;

/// Largest load over the least from which on friction may be asked whether it depends on it.
const LOADS_VARY: f64 = 1.3;

impl Pushes {
    /// Where and which way each group's body went: its usual heading and the places of its states.
    pub fn ways(&self) -> impl Iterator<Item = (Vector2<f64>, Vec<Vector2<f64>>)> {
        let of = |(along, states): (&Vector2<f64>, &Vec<State>)| {
            let at = states.iter().filter(|s| s.contact).map(|s| s.at);
            (*along, at.collect())
        };
        self.along.iter().zip(&self.states).map(of)
    }

    /// All states in which a body is moved, of fitted and held-out interactions.
    pub fn moving(&self) -> impl Iterator<Item = &State> {
        self.states.iter().flatten().filter(|s| s.contact)
    }

    /// Whether the table bore much more in some of them than in others: what a finger's friction takes off or adds says little of that.
    pub fn loads_vary(&self) -> bool {
        let mean = |states: &Vec<State>| {
            let borne: Vec<f64> = states.iter().filter(|s| s.contact).map(|s| s.loaded).collect();
            median(&borne)
        };
        // What could be done next loads it on purpose.
        let pressed = |g: usize| g >= self.done || (self.held[g] && self.weighed[self.bodies[g]]);
        let load = |g: usize| if pressed(g) { mean(&self.states[g]) } else { Some(1.0) };
        let each: Vec<f64> = (0..self.states.len()).filter_map(load).collect();
        let most = each.iter().copied().fold(0.0, f64::max);
        most > LOADS_VARY * each.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Largest force that was read, N.
    pub fn largest(&self) -> f64 {
        self.largest
    }
}
