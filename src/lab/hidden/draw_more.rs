//! The numbers of a hidden effect, drawn from its seed: effects on what is pressed, along joints, and in sensors.

use std::f64::consts::FRAC_PI_2;

use rand::Rng;

use super::draw::Draw;
use super::elastic::ElasticLaw;
use super::fault::Fault;
use super::jointed::JointLaw;
use super::law::Act;

/// Load of a weight that the dry friction of every joint of these scenes holds, N·m.
const HOLDS: f64 = 0.007;

impl Draw {
    pub(super) fn elastic(&mut self, cause: &str) -> Option<Act> {
        let s = self.s;
        Some(Act::Elastic(match cause {
            "hardening-stiffness" => ElasticLaw::Hardening {
                share: self.say("amplitude", 0.4 * s),
            },
            "second-stage" => ElasticLaw::SecondStage {
                share: self.say("ratio", 0.6 * s),
                depth: self.uniform("depth", 0.002, 0.0035),
            },
            "power-law-stiffness" => ElasticLaw::PowerLaw {
                exponent: self.say("exponent", 0.35 * s),
            },
            "elastic-damping" => ElasticLaw::Damping {
                seconds: self.say("seconds", 0.025 * s),
            },
            "stress-relaxation" => {
                let seconds = self.uniform("seconds", 0.3, 0.8);
                ElasticLaw::Relaxation {
                    share: self.say("share", 0.25 * s),
                    seconds: [0.5 * seconds, 2.0 * seconds],
                    state: [0.0; 2],
                }
            }
            "plastic-set" => ElasticLaw::PlasticSet {
                share: self.say("share", (0.2 * s).min(0.8)),
                depth: self.uniform("depth", 0.0015, 0.003),
                deepest: 0.0,
            },
            "elastic-hysteresis" => ElasticLaw::Hysteresis {
                force: self.say("force", 0.8 * s),
                reach: self.uniform("reach", 8e-4, 2e-3),
                state: [0.0; 8],
            },
            "guide-friction" => ElasticLaw::Guide {
                force: self.say("force", 0.5 * s),
                state: 0.0,
            },
            "softening-by-use" => ElasticLaw::Softening {
                share: self.say("share", (0.3 * s).min(0.8)),
                deepest: 0.0,
            },
            "snap-through" => ElasticLaw::Snap {
                force: self.say("force", 1.2 * s),
                depth: self.uniform("depth", 0.002, 0.0035),
                width: self.uniform("width", 3e-4, 6e-4),
            },
            "preload" => ElasticLaw::Preload {
                force: self.say("force", 0.8 * s),
            },
            "stiffness-drift" => {
                let rate = 2e-3 * s * self.sign();
                ElasticLaw::Drift {
                    rate: self.say("per_second", rate.max(-0.005)),
                    clock: 0.0,
                }
            }
            "adhesion" => ElasticLaw::Adhesion {
                force: self.say("force", 0.8 * s),
                touched: false,
            },
            "outside-ribs" => ElasticLaw::Ribs {
                force: self.say("force", 0.4 * s),
                pitch: self.uniform("pitch", 8e-4, 1.6e-3),
            },
            _ => return None,
        }))
    }

    pub(super) fn joint(&mut self, cause: &str) -> Option<Act> {
        let s = self.s;
        Some(Act::Joint(match cause {
            "joint-damping" => JointLaw::Damping {
                damping: self.say("damping", 0.06 * s),
            },
            "joint-quadratic-damping" => JointLaw::Quadratic {
                damping: self.say("damping", 0.05 * s),
            },
            "joint-spring" => JointLaw::Spring {
                stiffness: self.say("stiffness", 0.15 * s),
                rest: self.uniform("rest", -0.2, 0.2),
            },
            "joint-stiction" => JointLaw::Stiction {
                share: self.say("ratio", 1.2 * s),
                speed: self.say("speed", 0.03),
            },
            "detent" => JointLaw::Detent {
                effort: self.say("effort", 0.1 * s),
                at: self.uniform("position", 0.2, 0.45),
                width: self.uniform("width", 0.06, 0.12),
            },
            "latch" => JointLaw::Detent {
                effort: self.say("effort", 0.15 * s),
                at: 0.0,
                width: self.uniform("width", 0.05, 0.1),
            },
            "joint-gravity" => {
                // What swings freely is found hanging at rest, to a side as far as friction holds it.
                let load = 0.15 * s;
                let lean = (HOLDS / load.max(HOLDS)).asin() * self.rng.random_range(-1.0..1.0);
                self.say("direction", lean - FRAC_PI_2);
                JointLaw::Gravity {
                    cos: self.say("cos", load * lean.sin()),
                    sin: self.say("sin", -load * lean.cos()),
                }
            }
            "soft-close" => JointLaw::SoftClose {
                damping: self.say("damping", 0.25 * s),
                at: self.uniform("position", 0.3, 0.5),
            },
            "limit-compliance" => JointLaw::Stop {
                stiffness: self.say("stiffness", s),
                at: self.uniform("position", 0.35, 0.45),
            },
            "backlash" => JointLaw::Backlash {
                half: self.say("half", 0.03 * s),
            },
            "joint-loose-mass" => JointLaw::LooseMass {
                inertia: self.say("inertia", 1e-3 * s),
                rate: self.uniform("rate", 12.0, 30.0),
                damping: self.uniform("damping_ratio", 0.05, 0.3),
                state: None,
            },
            "joint-coupling" => {
                let ratio = self.uniform("ratio", 0.4, 1.2) * self.sign();
                JointLaw::Coupling {
                    ratio: self.say("ratio", ratio),
                    stiffness: self.say("stiffness", 5.0 * s),
                }
            }
            "moving-axis" => {
                let drift = self.heading() * self.say("drift", 0.006 * s);
                JointLaw::MovingAxis {
                    drift: [drift.x, drift.y],
                }
            }
            "outside-joint-texture" => JointLaw::Texture {
                amplitude: self.say("amplitude", 0.6 * s),
                waves: self.uniform("waves", 25.0, 45.0),
            },
            _ => return None,
        }))
    }

    pub(super) fn fault(&mut self, cause: &str) -> Act {
        let s = self.s
            * if matches!(cause, "sensor-lag" | "quantisation" | "outliers") {
                1.0
            } else {
                self.sign()
            };
        Act::Fault(match cause {
            "force-bias" => Fault::Bias(self.say("force", 0.3 * s)),
            "force-bias-world" => {
                let bias = self.heading() * self.say("force", 0.3 * s);
                Fault::BiasWorld([bias.x, bias.y])
            }
            "force-gain" => Fault::Gain(self.say("gain", (0.15 * s).max(-0.8))),
            "force-drift" => Fault::Drift(self.say("per_second", 0.0025 * s)),
            "force-crosstalk" => Fault::Crosstalk(self.say("share", 0.1 * s)),
            "force-saturation" => Fault::Saturation(self.say(
                "share_of_largest",
                if s == 0.0 {
                    f64::INFINITY
                } else {
                    (1.0 - 0.25 * s.abs()).max(0.2)
                },
            )),
            "time-delay" => Fault::Delay(self.say("seconds", 0.03 * s)),
            "sensor-lag" => {
                let poles = self.rng.random_range(1..3_u8);
                Fault::Lag(self.say("seconds", 0.05 * s), poles)
            }
            "clock-drift" => Fault::ClockDrift(self.say("share", 4e-4 * s)),
            "length-scale" => Fault::Tracking(self.say("scale", 0.04 * s), 0.0),
            "tracking-error" => {
                let turn = 0.035 * self.s * self.sign();
                Fault::Tracking(self.say("scale", 0.03 * s), self.say("angle", turn))
            }
            "contact-point-offset" => {
                let offset = self.heading() * self.say("distance", 0.003 * s);
                Fault::ToolOffset([offset.x, offset.y])
            }
            "lever-arm" if self.rng.random::<bool>() => {
                let way = self.heading() * (0.2 * self.s).min(0.8);
                Fault::Lever([self.say("ec", way.x), self.say("es", way.y)])
            }
            // The tool is not where it is told: the arm that it is thought to have is wrong by so much along its world axes.
            "lever-arm" => {
                let offset = self.heading() * self.say("distance", (0.012 * self.s).min(0.04));
                Fault::ToolOffset([offset.x, offset.y])
            }
            "outside-reflex" => Fault::Reflex(self.uniform("after", 0.25, 0.7), self.say("force", 0.3 * s)),
            "outside-snagging-cable" => Fault::Snags(self.uniform("per_second", 0.8, 2.0), self.say("force", 0.5 * s)),
            "quantisation" => Fault::Quantisation(self.say("step", 0.25 * s)),
            _ => Fault::Outliers(self.say("share", (0.02 * s).min(0.3))),
        })
    }
}
