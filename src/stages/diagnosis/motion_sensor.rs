//! What reads the load of a joint, and what is wrong with it.

use nalgebra::Vector3;

use super::family::{Active, Law, Parameter};
use super::motion_laws::{Maker, Moved, form};
use super::motions::Scale;
use crate::capture::{Capture, Segmented};

/// Share of the friction of a joint up to which what a free finger reads is none.
const NOTHING: f64 = 0.05;
/// Angle by which a tool that keeps its orientation may turn, rad.
const KEEPS: f64 = 0.3;

/// What fingers that held nothing read before they touched.
#[derive(Clone, Copy, Debug, Default)]
pub struct Free {
    /// Mean and the largest size of what was read, N; nothing where none of them did so.
    tare: Option<(Vector3<f64>, f64)>,
    /// Friction of the joint at the tool, N.
    friction: f64,
    /// Tools are turned, within motions or from one to the next.
    pub tool_turns: bool,
}

impl Free {
    /// Beside a joint that `friction` holds, N at the tool.
    pub fn of(capture: &Capture, segmented: &[Segmented], friction: f64) -> Self {
        let free = capture
            .fitted()
            .filter(|i| i.tool.as_ref().is_some_and(|t| !t.grip && !t.pin));
        let tares: Vec<Vector3<f64>> = free
            .filter_map(|i| segmented.iter().find(|s| s.interaction == i.name)?.force_tare)
            .collect();
        let tools = capture.interactions.iter().filter_map(|i| i.tool_path.as_ref());
        let mut turned = tools.flat_map(|p| p.rotation.iter().flatten());
        let first = turned.next().copied();
        let tool_turns = first.is_some_and(|f| turned.any(|r| f.angle_to(r) > KEEPS));
        let mean = tares.iter().sum::<Vector3<f64>>() / tares.len().max(1) as f64;
        let largest = tares.iter().map(|t| t.norm()).fold(0.0, f64::max);
        Self {
            tare: (!tares.is_empty()).then_some((mean, largest)),
            friction,
            tool_turns,
        }
    }

    /// All of them read this force, N.
    #[cfg(test)]
    pub fn reading(tare: Vector3<f64>, friction: f64) -> Self {
        Self {
            tare: Some((tare, tare.norm())),
            friction,
            tool_turns: false,
        }
    }

    /// They were there and read nothing.
    pub fn reads_nothing(&self) -> bool {
        self.tare.is_some_and(|(_, largest)| largest < NOTHING * self.friction)
    }

    /// The force that all of them read, N.
    pub fn bias(&self) -> Option<Vector3<f64>> {
        let (mean, _) = self.tare?;
        (mean.norm() > NOTHING * self.friction).then_some(mean)
    }
}

/// The load as a sensor with its faults, at an arm that may be wrong, reads it.
pub fn read(m: &Moved, load: f64, active: &[Active]) -> f64 {
    active.iter().fold(load, |load, a| {
        let x = a.values;
        match a.law.form {
            form::LEVER => load * (1.0 + x[0] * m.position.cos() + x[1] * m.position.sin()),
            form::BIAS => load + x[0] * m.lever,
            form::BIAS_ROOM => load + m.lever * m.way.dot(&Vector3::from_column_slice(&x[..3])),
            form::DRIFT => load + x[0] * m.time * m.lever,
            form::SATURATION => load.clamp(-x[0].exp() * m.lever, x[0].exp() * m.lever),
            // What turns takes the force through the sensor's axes: each of them ends for itself.
            form::SATURATION_ROOM => {
                let felt = m.way * (load / m.lever.max(1e-9));
                m.lever * m.way.dot(&felt.map(|f| f.clamp(-x[0].exp(), x[0].exp())))
            }
            _ => load,
        }
    })
}

/// Least end of the range over the largest component of the force along the freedom.
const ENDS: f64 = 0.6;

pub(super) fn sensor_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let (largest, component) = (s.force.max(1e-3), s.component.max(1e-3));
    let force = |name, unit, sd| Parameter::amplitude(name, unit, sd);
    let mut laws = vec![
        make.plain(
            "force-bias",
            form::BIAS,
            force("b", "N", 0.3),
            "a constant force is read that is not there",
        ),
        make.plain(
            "force-drift",
            form::DRIFT,
            force("d", "N/s", 0.002),
            "what is read drifts with time",
        ),
        make.law(
            "force-saturation",
            form::SATURATION,
            (
                Vec::new(),
                // Nothing larger than the limit can have been read.
                vec![Parameter {
                    low: (0.97 * largest).ln(),
                    ..Parameter::scale("Fs", "N", largest, 0.3)
                }],
            ),
            vec![vec![(0.98 * largest).ln()]],
            "the sensor cuts off large forces",
        ),
        make.law(
            "force-saturation",
            form::SATURATION_ROOM,
            (
                Vec::new(),
                vec![Parameter {
                    low: (ENDS * component).ln(),
                    ..Parameter::scale("Fs", "N", component, 0.3)
                }],
            ),
            vec![vec![(0.95 * component).ln()]],
            "the sensor cuts off large forces along its axes",
        ),
        make.plain(
            "wear-or-heating",
            form::WEAR,
            Parameter::amplitude("kappa", "1/s", 2e-3),
            "dry friction changes steadily over the capture",
        ),
    ];
    laws.extend(room_laws(make, s));
    laws
}

/// A force of fixed direction in the room that what touched nothing has read. Where the tool keeps its orientation, its frame and the
/// room's are one.
fn room_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let Some(bias) = s.free.bias().filter(|_| s.turns) else {
        return Vec::new();
    };
    let amplitudes = || ["bx", "by", "bz"].map(|name| Parameter::amplitude(name, "N", bias.norm()));
    let causes = ["force-bias", "force-bias-world"];
    let own = &causes[if s.free.tool_turns { 1 } else { 0 }..];
    let of = |cause: &&'static str| {
        make.law(
            cause,
            form::BIAS_ROOM,
            (amplitudes().into(), Vec::new()),
            vec![Vec::new()],
            "a force of fixed direction is read, by a finger that touches nothing, too",
        )
    };
    own.iter().map(of).collect()
}
