//! What was done to bodies before a push: how far they slid, and since when they rest.

use nalgebra::{Point3, Vector2, Vector3};

use crate::capture::Interaction;
use crate::math::turned_displacement;

/// Noise of a track whose own is not asked for, m; how far off the support what slid has left it; and the least way.
const NOISE: f64 = 5e-4;
const LEAVES: f64 = 0.02;
const SLIDES: f64 = 5e-3;

/// A body's pushes so far.
#[derive(Default)]
pub struct History {
    seen: Vec<(String, f64, f64)>,
    /// What it slid down a support that was tilted, m.
    slid: Vec<(String, f64)>,
    /// Way over which friction turns round where a hand turns back, m.
    pub bristles: f64,
}

impl History {
    /// Nothing was done so far.
    pub fn of_bristles(bristles: f64) -> Self {
        Self {
            bristles,
            ..Self::default()
        }
    }

    /// When the body last came to rest and how far it has slid.
    pub fn of(&self, body: &str) -> Option<(f64, f64)> {
        self.seen.iter().find(|s| s.0 == body).map(|s| (s.1, s.2))
    }
    /// Takes down how far bodies slid on a support that turned about a point near `guess`.
    pub fn tilted(&mut self, interaction: &Interaction, guess: &Point3<f64>) {
        let Some(path) = &interaction.support_path else {
            return;
        };
        let normals: Vec<Vector3<f64>> = path.vector.iter().map(|n| n.into_inner()).collect();
        for (name, track) in &interaction.tracks {
            let turned = turned_displacement(&path.time, &normals, &track.time, &track.position, NOISE, guess);
            let (Some(turned), Some(up)) = (turned, normals.first()) else {
                continue;
            };
            // What leaves the support slides no more.
            let on = |d: &&Vector3<f64>| d.dot(up).abs() < LEAVES || !d.x.is_finite();
            let ways = turned.displacement.iter().take_while(on).map(|d| d.norm());
            let far = ways.filter(|d| d.is_finite()).fold(0.0, f64::max);
            if far > SLIDES {
                self.slid.push((name.clone(), far));
            }
        }
    }

    /// How far it slid before any push, m.
    pub fn slid_before(&self, body: &str) -> f64 {
        self.slid.iter().filter(|s| s.0 == body).map(|s| s.1).sum()
    }

    /// Takes down a push: when the body came to rest, and how far it slid, m.
    pub fn note(&mut self, body: &str, rest: f64, slid: f64) {
        match self.seen.iter_mut().find(|s| s.0 == body) {
            Some(s) => (s.1, s.2) = (rest, s.2 + slid),
            None => self.seen.push((body.to_owned(), rest, slid)),
        }
    }
}

/// Where a hand turned back last.
#[derive(Default)]
pub struct TurnedBack {
    force: Vector2<f64>,
    /// Slip by then, m.
    at: Option<f64>,
}

impl TurnedBack {
    /// Takes down the force that the plain model has at a slip, m.
    pub fn note(&mut self, force: &Vector2<f64>, slip: f64) {
        if force.dot(&self.force) < 0.0 {
            self.at = Some(slip);
        }
        if force.norm() > 0.0 {
            self.force = *force;
        }
    }

    /// Whether it is farther than `way` from there, m.
    pub fn away(&self, slip: f64, way: f64) -> bool {
        self.at.is_none_or(|at| slip - at >= way)
    }
}
