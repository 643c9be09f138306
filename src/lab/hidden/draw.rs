//! The numbers of a hidden effect, drawn from its seed: effects on what slides, and on what the scene is made of.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::catalogue::target;
use super::law::{Act, Effect};
use super::setting::{Pad, Setting};
use super::slide::{Make, SlideLaw};
use crate::base::{Seed, rng_for};
use crate::lab::{HideSpec, Scene};

/// An effect of this cause with its numbers.
pub(super) fn effect(scene: &Scene, cause: &'static str, spec: &HideSpec) -> Effect {
    let rng = rng_for(Seed(spec.seed), &format!("hidden {cause}"));
    let named = |b: &&crate::lab::BodySpec| Some(b.name.as_str()) == target(scene);
    let place = scene.body.iter().find(named).map_or([0.0; 3], |b| b.position);
    let mut d = Draw {
        rng,
        s: spec.strength,
        middle: Vector2::new(place[0], place[1]),
        said: BTreeMap::new(),
    };
    let act = d
        .slide(cause)
        .or_else(|| d.placed(cause))
        .or_else(|| d.make(cause))
        .or_else(|| d.elastic(cause))
        .or_else(|| d.joint(cause))
        .unwrap_or_else(|| d.fault(cause));
    d.said.insert("strength".into(), spec.strength);
    Effect {
        cause,
        act,
        parameters: d.said,
    }
}

/// The dice and the notes of one effect.
pub(super) struct Draw {
    pub(super) rng: ChaCha8Rng,
    pub(super) s: f64,
    middle: Vector2<f64>,
    said: BTreeMap<String, f64>,
}

impl Draw {
    pub(super) fn say(&mut self, name: &str, value: f64) -> f64 {
        self.said.insert(name.to_owned(), value);
        value
    }

    pub(super) fn uniform(&mut self, name: &str, low: f64, high: f64) -> f64 {
        let value = self.rng.random_range(low..high);
        self.say(name, value)
    }

    pub(super) fn sign(&mut self) -> f64 {
        if self.rng.random::<bool>() { 1.0 } else { -1.0 }
    }

    /// A direction, told as an angle.
    pub(super) fn heading(&mut self) -> Vector2<f64> {
        let angle = self.uniform("direction", -PI, PI);
        Vector2::new(angle.cos(), angle.sin())
    }

    /// A place that a body pushed in this direction for 20 to 35 mm comes to.
    fn spot(&mut self) -> Vector2<f64> {
        let axis = self.rng.random_range(0..4_u8);
        let angle = f64::from(axis) * PI / 2.0 + self.rng.random_range(-0.2..0.2);
        let far = self.rng.random_range(0.012..0.03);
        let at = self.middle + Vector2::new(angle.cos(), angle.sin()) * far;
        self.say("x", at.x);
        self.say("y", at.y);
        at
    }

    fn slide(&mut self, cause: &str) -> Option<Act> {
        let s = self.s;
        Some(Act::Slide(match cause {
            "velocity-weakening-friction" => SlideLaw::Weakening {
                amplitude: self.say("amplitude", 0.35 * s),
                speed: self.uniform("speed", 0.012, 0.05),
            },
            "viscous-friction" => SlideLaw::Viscous {
                damping: self.say("damping", 5.0 * s),
            },
            "static-ageing" => SlideLaw::Ageing {
                beta: self.say("beta", 0.15 * s),
                length: self.uniform("slip_length", 4e-4, 1.2e-3),
                theta: 0.0,
            },
            "rate-state-friction" => SlideLaw::RateState {
                direct: self.say("direct", 0.04 * s),
                evolution: self.say("evolution", 0.06 * s),
                length: self.uniform("slip_length", 3e-4, 1e-3),
                theta: 0.0,
            },
            "anisotropic-friction" => SlideLaw::Anisotropic {
                amplitude: self.say("amplitude", (0.2 * s).min(0.7)),
                direction: self.uniform("direction", 0.0, PI),
            },
            "wear-or-heating" => {
                let rate = 0.5 * s * self.sign();
                SlideLaw::Wear {
                    rate: self.say("per_metre", rate.max(-1.0)),
                    slid: 0.0,
                }
            }
            "breakaway-bond" => SlideLaw::Bond {
                force: self.say("force", 2.2 * s),
                length: self.uniform("length", 1.5e-3, 3e-3),
                start: None,
                drawn: 0.0,
                whole: false,
            },
            "loose-mass" => SlideLaw::LooseMass {
                mass: self.say("share", (0.3 * s).min(0.8)),
                rate: self.uniform("rate", 15.0, 40.0),
                damping: self.uniform("damping_ratio", 0.03, 0.3),
                state: None,
            },
            "load-dependent-friction" => SlideLaw::Load {
                amplitude: self.say("amplitude", (0.25 * s).min(0.8)),
                weight: 0.0,
                load: 0.0,
            },
            "rolling-resistance" => SlideLaw::Rolling {
                length: self.say("length", 2e-4 * s),
                rises: if self.rng.random::<bool>() {
                    self.say("rises", 0.3)
                } else {
                    0.0
                },
            },
            "added-inertia" => SlideLaw::AddedInertia {
                mass: self.say("share", 0.3 * s),
            },
            "outside-ratchet" => SlideLaw::Ratchet {
                amplitude: self.say("amplitude", (0.25 * s).min(0.9)),
                direction: self.uniform("direction", -PI, PI),
            },
            "outside-shaking-table" => SlideLaw::Shaking {
                acceleration: self.say("acceleration", 0.9 * s),
                frequency: self.uniform("frequency", 3.0, 8.0),
                way: self.heading(),
            },
            _ => return None,
        }))
    }

    fn placed(&mut self, cause: &str) -> Option<Act> {
        let s = self.s;
        Some(Act::Slide(match cause {
            "friction-patch" => {
                let amplitude = s * if self.sign() > 0.0 { 0.6 } else { -0.45 };
                SlideLaw::Patch {
                    amplitude: self.say("amplitude", amplitude.max(-0.9)),
                    at: self.spot(),
                    radius: self.uniform("radius", 0.018, 0.03),
                }
            }
            "bump" => {
                let (radius, sign) = (self.uniform("radius", 0.01, 0.016), self.sign());
                SlideLaw::Bump {
                    height: self.say("height", 0.2 * radius * s * sign),
                    at: self.spot(),
                    radius,
                }
            }
            "magnet" => SlideLaw::Magnet {
                force: self.say("force", 1.2 * s),
                at: self.spot(),
                depth: self.uniform("depth", 0.018, 0.03),
            },
            "tether" => {
                let length = self.uniform("length", 0.10, 0.15);
                let away = self.heading() * (length + 0.01);
                SlideLaw::Tether {
                    stiffness: self.say("stiffness", 20.0 * s),
                    at: self.middle + away,
                    length,
                }
            }
            "hidden-body" => {
                let quarter = f64::from(self.rng.random_range(0..4_u8)) * PI / 2.0;
                let way = Vector2::new(quarter.cos(), quarter.sin());
                self.say("direction", quarter);
                SlideLaw::Unseen {
                    mass: self.say("share", 0.5 * s),
                    friction: 0.35,
                    way,
                    at: way.dot(&self.middle) + self.uniform("distance", 0.008, 0.025),
                    state: [0.0; 2],
                }
            }
            "outside-texture" => {
                let wave = TAU / self.uniform("length", 0.01, 0.02);
                SlideLaw::Texture {
                    amplitude: self.say("amplitude", (0.3 * s).min(0.9)),
                    wave: self.heading() * wave,
                    at: Vector2::zeros(),
                }
            }
            _ => return None,
        }))
    }

    fn make(&mut self, cause: &str) -> Option<Act> {
        let s = self.s;
        let setting = match cause {
            "uneven-support-pressure" => {
                let share = s * if self.sign() > 0.0 { 1.5 } else { -0.9 };
                return Some(Act::Make(Make::Pressure(self.say("rim", share.clamp(-0.95, 6.0)))));
            }
            "support-compliance" => return Some(Act::Make(Make::Soft(self.say("compliance", 5e-5 * s)))),
            "presliding" => return Some(Act::Make(Make::Presliding(self.say("length", 3e-4 * s)))),
            "support-tilt" => {
                let slope = self.heading() * self.say("angle", 0.035 * s);
                Setting::Tilt([slope.x, slope.y])
            }
            "gravity-error" => {
                let (lean, longer) = (self.heading() * self.say("angle", 0.035 * s), 0.03 * s * self.sign());
                Setting::Gravity([lean.x, lean.y], self.say("longer", longer))
            }
            "com-offset" => {
                let offset = self.heading() * self.say("distance", 0.010 * s);
                Setting::Centre([offset.x, offset.y])
            }
            "nonuniform-density" => {
                let offset = self.heading() * self.say("distance", 0.008 * s);
                Setting::Uneven([offset.x, offset.y], self.say("factor", (0.4 * s).exp().min(1.9)))
            }
            "yaw-inertia" => {
                let sign = self.sign();
                Setting::YawInertia(self.say("factor", (0.5 * s * sign).exp().clamp(0.3, 1.9)))
            }
            "tool-friction" => {
                let sign = self.sign();
                Setting::ToolFriction(self.say("factor", (0.9 * s * sign).exp()))
            }
            "contact-law" if s > 0.0 => {
                let depth = 1e-3;
                Setting::Tip(if self.rng.random::<bool>() {
                    Pad::Power {
                        force: self.say("force", 1.5),
                        depth,
                        exponent: self.say("exponent", (0.4 * s).min(2.0)),
                    }
                } else {
                    // Twice as far it presses as much harder as that power would have it.
                    let depth = self.say("depth", 1e-3 / (0.6 * s).min(2.5));
                    Pad::Exponential {
                        force: self.say("force", 1.5 / ((1e-3 / depth).exp() - 1.0)),
                        depth,
                    }
                })
            }
            // Without strength the finger is as hard as in any other scene.
            "contact-law" => Setting::ToolFriction(1.0),
            _ => return None,
        };
        Some(Act::Setting(setting))
    }
}
