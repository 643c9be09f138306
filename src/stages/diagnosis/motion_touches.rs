//! Motions of a joint that could be made next, as the family of its motions foretells them: by the same handle, there and back.

use nalgebra::{Point3, Vector3};

use super::asking::Imagined;
use super::family::{Channel, Group};
use super::motion_laws::Moved;
use super::motion_reads::{BIN, Read};
use super::motion_stops::Stop;
use super::motions::{EVEN, Motions};
use crate::capture::Capture;
use crate::math::median;
use crate::twin::{AskedTouch, Joint};

/// Where a joint was taken hold of, with all as it was at first. World frame.
#[derive(Clone, Debug)]
pub struct Handle {
    target: String,
    at: Point3<f64>,
    axis: Vector3<f64>,
    origin: Point3<f64>,
}

impl Handle {
    /// Of the first motion that was read.
    pub fn of(capture: &Capture, joint: &Joint, reads: &[Read]) -> Option<Self> {
        let name = &reads.first()?.interaction;
        let interaction = capture.interactions.iter().find(|i| i.name == *name)?;
        Some(Self {
            target: interaction.target.clone().unwrap_or_else(|| joint.child.clone()),
            at: *interaction.tool_path.as_ref()?.position.first()?,
            axis: Vector3::from(joint.axis.value),
            origin: Point3::from(joint.origin.value),
        })
    }

    /// The same at this share of the arm about the axis.
    fn nearer(&self, share: f64) -> Point3<f64> {
        let arm = self.at - self.origin;
        let across = arm - self.axis * arm.dot(&self.axis);
        self.at - across * (1.0 - share)
    }
}

/// Speeds of the hand, m/s, and its acceleration, m/s².
const SPEEDS: [f64; 7] = [0.006, 0.012, 0.03, 0.06, 0.12, 0.25, 0.4];
const HURRY: f64 = 0.5;
/// Ways over the usual one; beyond the ends that were seen where none of them stopped it.
const TRAVELS: [f64; 2] = [0.5, 1.0];
const BEYOND: f64 = 1.3;
/// Share of the usual way that is worth going the other way.
const OTHER: f64 = 0.2;
/// Shares of the arm at which a hinge may be taken hold of.
const ARMS: [f64; 2] = [1.0, 0.5];
/// Rest before, at the far end and after, s.
const RESTS: f64 = 0.4;
/// A pause before, s.
const WAIT: f64 = 2.0;
/// Samples after it set out or stopped in which it may as well stand.
const UNSURE: usize = 2;
/// Doubt of what is not foretold, in units of the noise.
const BLIND: f64 = 1e4;

/// One motion of the pool: a way from where motions begin, rad or m, its sign the direction.
struct Touch {
    way: f64,
    /// Of the hand, m/s.
    speed: f64,
    /// Arm over the usual one.
    arm: f64,
}

impl Motions {
    /// This family with the motions that could be made next.
    pub(super) fn with_touches(&self) -> Option<Imagined> {
        let handle = self.handle.as_ref()?;
        let mut family = self.clone();
        let mut touches = Vec::new();
        for touch in self.pool() {
            let moments = self.moments_of(&touch);
            family.sheet.groups.push(self.group_of(&moments));
            family.moments.push(moments);
            touches.push(self.asked(&touch, handle));
        }
        (!touches.is_empty()).then(|| Imagined {
            family: Box::new(family),
            touches,
        })
    }

    fn begins(&self) -> f64 {
        let firsts: Vec<f64> = self
            .moments
            .iter()
            .filter_map(|m| m.first())
            .map(|m| m.position)
            .collect();
        median(&firsts).unwrap_or(0.0)
    }

    fn pool(&self) -> Vec<Touch> {
        let begins = self.begins();
        let ways = |sign: f64| {
            let far = |m: &Vec<Moved>| m.iter().map(|m| sign * (m.position - begins)).fold(0.0, f64::max);
            self.moments.iter().map(far).fold(0.0, f64::max)
        };
        let [up, down] = [ways(1.0), ways(-1.0)];
        let usual = up.max(down);
        let mut out = Vec::new();
        for (sign, seen) in [(1.0, up), (-1.0, down)] {
            if seen < OTHER * usual {
                continue;
            }
            let open = if self.bounded { None } else { Some(BEYOND) };
            for share in TRAVELS.into_iter().chain(open) {
                for speed in SPEEDS {
                    let arms = if self.turns { &ARMS[..] } else { &ARMS[..1] };
                    out.extend(arms.iter().map(|arm| Touch {
                        way: sign * share * seen,
                        speed,
                        arm: *arm,
                    }));
                }
            }
        }
        out
    }

    /// How far the hand goes for one unit of the joint, m.
    fn reach(&self, arm: f64) -> f64 {
        if self.turns {
            self.lever.abs().max(1e-3) * arm
        } else {
            1.0
        }
    }

    fn moments_of(&self, touch: &Touch) -> Vec<Moved> {
        let reach = self.reach(touch.arm);
        let begin = self
            .moments
            .iter()
            .filter_map(|m| m.last())
            .map(|m| m.time)
            .fold(0.0, f64::max)
            + WAIT;
        let leg = Leg::new(touch.way.abs() * reach, touch.speed);
        let whole = 2.0 * leg.lasts() + 3.0 * RESTS;
        let place = |t: f64| {
            let out = leg.at(t - RESTS) - leg.at(t - 2.0 * RESTS - leg.lasts());
            self.begins() + touch.way.signum() * out / reach
        };
        let speed = |t: f64| (place(t + 0.5 * BIN) - place(t - 0.5 * BIN)) / BIN;
        let mut turning = self.turning.clone();
        turning.begin();
        let (mut slip, mut rests, mut last) = (0.0, 0.0, None::<(f64, f64)>);
        let mut out = Vec::new();
        for k in 0..(whole / BIN).ceil() as usize {
            let t = (k as f64 + 0.5) * BIN;
            let (q, v) = (place(t), speed(t));
            let still = v.abs() < self.slow;
            rests = if still { rests + BIN } else { 0.0 };
            let turned = last.is_some_and(|(_, before)| before * v < 0.0);
            slip = if turned || rests > 2.0 * BIN { 0.0 } else { slip };
            slip += last.map_or(0.0, |(before, _)| (q - before).abs());
            let (back, turned_back) = turning.back(q, v, still);
            out.push(Moved {
                time: begin + t,
                position: q,
                ends: self.ends,
                doubt: 0.0,
                speed: v,
                gain: (speed(t + BIN) - speed(t - BIN)) / (2.0 * BIN),
                load: 0.0,
                lever: self.lever * touch.arm,
                way: Vector3::zeros(),
                faced: Vector3::zeros(),
                slip,
                back,
                turned_back,
                began: turning.began(q),
                // What held it at first is broken.
                reached: f64::INFINITY,
                still,
                unsure: false,
                stop: Stop::None,
            });
            last = Some((q, v));
        }
        for k in 0..out.len() {
            let near = k.saturating_sub(UNSURE)..(k + UNSURE + 1).min(out.len());
            let stands = out[near].iter().any(|m| m.still);
            out[k].unsure = stands && !out[k].still;
        }
        out
    }

    /// Nothing was read of it; where it stands or sets out nothing is foretold.
    fn group_of(&self, moments: &[Moved]) -> Group {
        let n = moments.len();
        let sigma = self.sheet.kinds[0].sigma;
        let aside = |m: &Moved| {
            if m.still || m.unsure {
                BLIND * sigma
            } else {
                EVEN * self.friction
            }
        };
        Group {
            name: format!("touch of {}", self.joint),
            held_out: false,
            channels: vec![Channel {
                kind: 0,
                measured: vec![0.0; n],
                starts: (0..n).map(|i| i == 0).collect(),
                change: vec![0.0; n],
                aside: moments.iter().map(aside).collect(),
            }],
        }
    }

    fn asked(&self, touch: &Touch, handle: &Handle) -> AskedTouch {
        let start = if self.turns {
            handle.nearer(touch.arm)
        } else {
            handle.at
        };
        let forward = if self.turns {
            handle.axis.cross(&(start - handle.origin))
        } else {
            handle.axis
        };
        let direction = (forward * touch.way.signum())
            .try_normalize(1e-9)
            .unwrap_or_else(Vector3::x);
        AskedTouch {
            kind: "pull".into(),
            target: handle.target.clone(),
            start: start.into(),
            direction: direction.into(),
            travel: touch.way.abs() * self.reach(touch.arm),
            speed: touch.speed,
            duration: RESTS,
            wait: WAIT,
            back: true,
            ..AskedTouch::default()
        }
    }
}

/// A way that is sped up and slowed down evenly.
struct Leg {
    way: f64,
    top: f64,
}

impl Leg {
    fn new(way: f64, speed: f64) -> Self {
        Self {
            way,
            top: speed.min((HURRY * way).sqrt()).max(1e-6),
        }
    }

    fn lasts(&self) -> f64 {
        self.way / self.top + self.top / HURRY
    }

    /// How far it has come after a time, m.
    fn at(&self, t: f64) -> f64 {
        let (t, ramp) = (t.clamp(0.0, self.lasts()), self.top / HURRY);
        let left = self.lasts() - t;
        if t < ramp {
            0.5 * HURRY * t * t
        } else if left < ramp {
            self.way - 0.5 * HURRY * left * left
        } else {
            self.top * (t - 0.5 * ramp)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_goes_its_way_at_its_speed() {
        let leg = Leg::new(0.1, 0.1);
        assert!((leg.at(leg.lasts()) - 0.1).abs() < 1e-12);
        let speed = (leg.at(0.6) - leg.at(0.59)) / 0.01;
        assert!((speed - 0.1).abs() < 1e-9);
        // Too short to come to its speed.
        let short = Leg::new(0.01, 1.0);
        assert!((short.at(0.5 * short.lasts()) - 0.005).abs() < 1e-12);
    }
}
