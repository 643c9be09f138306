//! Presses that could be made next, as the family of presses foretells them: where it was pressed before.

use nalgebra::Point3;

use super::asking::Imagined;
use super::family::{Channel, Group};
use super::press_laws::Met;
use super::press_moment::Moment;
use super::presses::{BIN, EVEN, Presses};
use crate::math::median;
use crate::twin::AskedTouch;

/// Depths over the deepest so far, speeds, m/s, times for which the tool stays, s.
const DEPTHS: [f64; 4] = [0.3, 0.6, 1.0, 1.3];
const SPEEDS: [f64; 4] = [0.003, 0.006, 0.02, 0.05];
const STAYS: [f64; 2] = [0.6, 3.0];
/// A pause, and a long one, s.
const WAITS: [f64; 2] = [2.0, 60.0];
/// Spots that are tried.
const SPOTS: usize = 2;
/// How far above the surface a press is followed, m.
const ABOVE: f64 = 2e-3;

/// One press of the pool.
struct Touch {
    /// A press that was made at the same place.
    like: usize,
    depth: f64,
    speed: f64,
    stays: f64,
    wait: f64,
}

impl Presses {
    /// This family with the presses that could be made next.
    pub(super) fn with_touches(&self) -> Option<Imagined> {
        let mut family = self.clone();
        let mut touches = Vec::new();
        for touch in self.pool() {
            let moments = self.moments_of(&touch);
            family.sheet.groups.push(self.group_of(&touch, &moments));
            family.moments.push(moments);
            family.spots.push(self.spots[touch.like]);
            family.bodies.push(self.bodies[touch.like]);
            family.places.push(self.places[touch.like]);
            family.past.push(self.past_of(&touch));
            family.reached.push(touch.depth);
            family.met.push(Met {
                speed: touch.speed,
                force: self.usual_start(),
            });
            touches.push(self.asked(&touch));
        }
        (!touches.is_empty()).then(|| Imagined {
            family: Box::new(family),
            touches,
        })
    }

    fn pool(&self) -> Vec<Touch> {
        let mut out = Vec::new();
        for spot in 0..self.all_spots.min(SPOTS) {
            let Some(like) = self.spots.iter().position(|s| *s == spot) else {
                continue;
            };
            let plain = |depth: f64, speed: f64, stays: f64, wait: f64| Touch {
                like,
                depth: depth * self.deepest,
                speed,
                stays,
                wait,
            };
            for depth in DEPTHS {
                for speed in SPEEDS {
                    out.extend(STAYS.map(|stays| plain(depth, speed, stays, WAITS[0])));
                }
            }
            out.push(plain(1.0, SPEEDS[1], STAYS[0], WAITS[1]));
        }
        out
    }

    /// Deepest earlier press at the same spot, and anywhere on the body, m.
    fn past_of(&self, touch: &Touch) -> [f64; 2] {
        let reached = |g: usize| self.moments[g].iter().map(|m| m.depth).fold(0.0, f64::max);
        let deepest = |same: &dyn Fn(usize) -> bool| {
            let own = (0..self.moments.len()).filter(|g| same(*g));
            own.map(reached).fold(0.0, f64::max)
        };
        [
            deepest(&|g| self.spots[g] == self.spots[touch.like]),
            deepest(&|g| self.bodies[g] == self.bodies[touch.like]),
        ]
    }

    /// The force by which a surface is usually found, N.
    fn usual_start(&self) -> f64 {
        let forces: Vec<f64> = self.met.iter().map(|m| m.force).collect();
        median(&forces).unwrap_or(0.0)
    }

    fn moments_of(&self, touch: &Touch) -> Vec<Moment> {
        let last = self.moments.iter().filter_map(|m| m.last()).map(|m| m.time);
        let begin = last.fold(0.0, f64::max) + touch.wait;
        let goes = (touch.depth + ABOVE) / touch.speed;
        let whole = 2.0 * goes + touch.stays;
        let depth = |t: f64| {
            let way = if t < goes + touch.stays {
                t.min(goes)
            } else {
                (whole - t).max(0.0)
            };
            way * touch.speed - ABOVE
        };
        let rate = |t: f64| (depth(t + 0.5 * BIN) - depth(t - 0.5 * BIN)) / BIN;
        let count = (whole / BIN).ceil() as usize;
        let moment = |k: usize| {
            let t = (k as f64 + 0.5) * BIN;
            Moment {
                time: begin + t,
                step: if k > 0 { BIN } else { 0.0 },
                depth: depth(t),
                rate: rate(t),
                parts: None,
            }
        };
        (0..count).map(moment).collect()
    }

    /// Nothing was read of it: what a sample may be off by goes with the plain spring.
    fn group_of(&self, touch: &Touch, moments: &[Moment]) -> Group {
        let stiffness = self.stiffness[self.bodies[touch.like]];
        let plain: Vec<f64> = moments.iter().map(|m| stiffness * m.depth.max(0.0)).collect();
        let steps = plain.windows(2).map(|w| w[1] - w[0]);
        let loads = Channel {
            kind: 0,
            measured: vec![0.0; plain.len()],
            starts: (0..plain.len()).map(|i| i == 0).collect(),
            change: std::iter::once(0.0).chain(steps).collect(),
            aside: plain.iter().map(|f| EVEN * f).collect(),
        };
        let surface = Channel {
            kind: 1,
            measured: vec![0.0],
            starts: vec![true],
            change: vec![0.0],
            aside: vec![0.0],
        };
        Group {
            name: format!("touch of {}", self.names[self.bodies[touch.like]]),
            held_out: false,
            channels: vec![loads, surface],
        }
    }

    fn asked(&self, touch: &Touch) -> AskedTouch {
        let start: Point3<f64> = self.spots_at[touch.like];
        AskedTouch {
            kind: "press".into(),
            target: self.names[self.bodies[touch.like]].clone(),
            start: start.into(),
            direction: (-self.up).into(),
            travel: touch.depth,
            speed: touch.speed,
            duration: touch.stays,
            wait: touch.wait,
            ..AskedTouch::default()
        }
    }
}
