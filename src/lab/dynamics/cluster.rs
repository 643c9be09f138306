//! Who takes part in an action: what hangs together with the target, and what comes within reach.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::body::reach_of;
use super::distance::reach;
use super::footprint::{lowest_of, underside};
use super::prepared::rests_on;
use super::script::{Script, Wielding};
use crate::lab::Scene;
use crate::lab::Solid;

/// Room left around the tool, m.
const MARGIN: f64 = 0.005;
/// Places along the tool's way that are looked at.
const PLACES: usize = 32;

/// Bodies that touch, hang on or stick to each other at first.
pub(crate) struct Ties(Vec<(String, String)>);

impl Ties {
    /// Of the whole scene.
    pub fn new(scene: &Scene, solids: &BTreeMap<String, Solid>) -> Self {
        let joints = scene.joint.iter().map(|j| (j.a.clone(), j.b.clone()));
        let bonds = scene.bond.iter().map(|b| (b.a.clone(), b.b.clone()));
        let mut ties: Vec<(String, String)> = joints.chain(bonds).collect();
        for (name, upper) in solids {
            for (other, lower) in solids {
                if name != other && rests_on(scene, upper, lower) {
                    ties.push((name.clone(), other.clone()));
                }
            }
        }
        Self(ties)
    }

    fn close(&self, names: &mut BTreeSet<String>) {
        let mut before = 0;
        while before != names.len() {
            before = names.len();
            for (a, b) in &self.0 {
                if names.contains(a) || names.contains(b) {
                    names.extend([a.clone(), b.clone()]);
                }
            }
        }
    }
}

/// Names of those that take part, in order.
pub(crate) fn participants(solids: &BTreeMap<String, Solid>, ties: &Ties, script: &Script) -> Vec<String> {
    let Some(target) = &script.target else {
        return solids.keys().cloned().collect();
    };
    let mut names = BTreeSet::from([target.clone()]);
    if script.tilting.is_none() {
        ties.close(&mut names);
        if let (Some(wielding), Some(body)) = (&script.wielding, solids.get(target)) {
            let within = solids
                .iter()
                .filter(|(_, other)| is_within_reach(wielding, body, other));
            names.extend(within.map(|(name, _)| name.clone()));
            ties.close(&mut names);
        }
    }
    names.into_iter().filter(|name| solids.contains_key(name)).collect()
}

fn is_within_reach(wielding: &Wielding, target: &Solid, other: &Solid) -> bool {
    let centre = |solid: &Solid| (solid.world_from_body.0 * solid.com).coords;
    let (first, place, size) = (centre(target), centre(other), reach_of(other));
    let (low, high) = wielding.drive.moves.range();
    let start = wielding.drive.frame_at(0.0, 0.0).position;
    (0..=PLACES).any(|k| {
        let travel = low + (high - low) * k as f64 / PLACES as f64;
        let tool = wielding.drive.frame_at(travel, 0.0).position;
        let carried: Vector3<f64> = if travel > 0.0 { tool - start } else { Vector3::zeros() };
        (tool - place).norm() < size + reach(&wielding.shape) + MARGIN
            || (first + carried - place).norm() < size + reach_of(target)
    })
}

/// The solid moved straight down (or up) onto the table.
pub(crate) fn put_on_table(solid: &Solid) -> Solid {
    let mut moved = solid.clone();
    let place = solid.world_from_body.0 * nalgebra::Translation3::from(solid.com.coords);
    let lowest = lowest_of(&underside(solid), &place);
    if lowest.is_finite() && lowest.abs() > 3e-4 {
        moved.world_from_body.0.translation.vector.z -= lowest;
    }
    moved
}
