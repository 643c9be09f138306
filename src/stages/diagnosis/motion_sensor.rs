//! What reads the load of a joint, and what is wrong with it.

use nalgebra::Vector3;

use super::family::{Active, Law, Parameter};
use super::motion_faced::{faced_laws, warming};
use super::motion_laws::{Maker, Moved, form};
use super::motion_reads::BIN;
use super::motion_stops::Stop;
use super::motions::Scale;
use super::push_laws::settling;

/// The load as a sensor with its faults, at an arm that may be wrong, reads it.
pub fn read(m: &Moved, load: f64, active: &[Active]) -> f64 {
    active.iter().fold(load, |load, a| {
        let x = a.values;
        match a.law.form {
            form::LEVER => load * (1.0 + x[0] * m.position.cos() + x[1] * m.position.sin()),
            form::BIAS => load + x[0] * m.lever,
            form::BIAS_ROOM => load + m.lever * m.way.dot(&Vector3::from_column_slice(&x[..3])),
            form::BIAS_FACED => load + x[0] * m.lever * m.way.dot(&m.faced),
            form::DRIFT_FACED => load + x[0] * (m.time + x[1]) * m.lever * m.way.dot(&m.faced),
            form::DRIFT => load + x[0] * (m.time + x[1]) * m.lever,
            // A sensor warms up, and that is over by and by.
            form::DRIFT_SETTLING => load + x[0] * settling(m.time + x[1], x[2].exp()) * m.lever,
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

/// Seconds by which the force is read later than the track, of all laws: a delay is one of the track where it is positive.
pub fn late(active: &[Active]) -> f64 {
    let own = active.iter().filter(|a| a.law.form == form::LATE);
    -own.map(|a| a.values[0]).sum::<f64>()
}

/// Loads, N·m or N, as a sensor with a lag reads them, in means of the time between two moments: through a pole that begins at what
/// was read wherever what was exerted is not foretold.
pub fn lagging(moments: &[Moved], mut loads: Vec<f64>, active: &[Active]) -> Vec<f64> {
    let lag: f64 = active
        .iter()
        .filter(|a| a.law.form == form::LAG)
        .map(|a| a.values[0])
        .sum();
    if lag <= 0.0 {
        return loads;
    }
    let mut end = f64::NAN;
    for (i, m) in moments.iter().enumerate() {
        let earlier = i.checked_sub(1).map(|k| &moments[k]);
        let since = earlier.map_or(f64::INFINITY, |e| m.time - e.time);
        let foretold = !m.still && !m.unsure && m.stop != Stop::Hit;
        if foretold && end.is_finite() && since < 1.5 * BIN {
            let keeps = (-since / lag).exp();
            let behind = end - loads[i];
            end = loads[i] + keeps * behind;
            loads[i] += behind * lag * (1.0 - keeps) / since;
        } else {
            // What is read goes on as it went between the middles of the last two moments.
            let grew = earlier.filter(|_| since < 1.5 * BIN).map_or(0.0, |e| m.load - e.load);
            end = m.load + 0.5 * grew;
        }
    }
    loads
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
        make.law(
            "force-drift",
            form::DRIFT,
            (vec![force("d", "N/s", 0.002)], vec![Parameter::nought_before()]),
            vec![vec![0.0]],
            "what is read drifts with time",
        ),
        warming(make, force("d", "N/s", 0.005)),
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
            "sensor-lag",
            form::LAG,
            Parameter::positive("Tf", "s", 0.05),
            "what is read follows what is exerted late, by a lag",
        ),
        make.plain(
            "time-delay",
            form::LATE,
            force("tau", "s", 0.03),
            "force and track go by clocks that are apart",
        ),
        make.plain(
            "wear-or-heating",
            form::WEAR,
            Parameter::amplitude("kappa", "1/s", 2e-3),
            "dry friction changes steadily over the capture",
        ),
    ];
    laws.extend(room_laws(make, s));
    if s.faces {
        laws.extend(faced_laws(make));
    }
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
    let words = if s.free.of_fingers() {
        "a force of fixed direction is read, by a finger that touches nothing, too"
    } else {
        "a force of fixed direction is read; all hands read it before they set out, too, where none of them strains"
    };
    let of = |cause: &&'static str| {
        make.law(
            cause,
            form::BIAS_ROOM,
            (amplitudes().into(), Vec::new()),
            vec![Vec::new()],
            words,
        )
    };
    own.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(form: usize) -> Law {
        let make = Maker { joint: "hinge" };
        make.plain("sensor-lag", form, Parameter::positive("Tf", "s", 0.05), "")
    }

    /// A joint that sets out at 0.4 s against 2 N·m and is told of from 0.52 s on, read through a pole of so many seconds.
    fn read_through(lag: f64) -> Vec<Moved> {
        let one = |k: u32| {
            let (from, to) = (f64::from(k) * BIN - 0.4, f64::from(k + 1) * BIN - 0.4);
            let fallen = |t: f64| lag * (1.0 - (-t.max(0.0) / lag).exp());
            let mean = 2.0 * (to.max(0.0) - from.max(0.0) - fallen(to) + fallen(from)) / BIN;
            Moved {
                time: from + 0.4 + 0.5 * BIN,
                load: mean,
                still: k < 10,
                unsure: (10..13).contains(&k),
                ..Moved::default()
            }
        };
        (0..30).map(one).collect()
    }

    #[test]
    fn a_lag_goes_on_from_what_was_read() {
        let (moments, own) = (read_through(0.08), law(form::LAG));
        let told = |lag: f64| {
            let active = [Active {
                law: &own,
                values: &[lag],
            }];
            let told = lagging(&moments, vec![2.0; moments.len()], &active);
            let off = moments.iter().zip(told).skip(13).map(|(m, t)| (m.load - t).powi(2));
            (off.sum::<f64>() / 17.0).sqrt()
        };
        // What was read before bends more than it is taken to: 13 mN·m.
        assert!(told(0.08) < 0.02 && told(0.04) > 0.04 && told(0.16) > 0.04 && told(0.0) > 0.1);
    }

    #[test]
    fn a_track_that_is_late_has_the_force_early() {
        let own = law(form::LATE);
        let active = [Active {
            law: &own,
            values: &[0.05],
        }];
        let delay = late(&active);
        assert!((delay + 0.05).abs() < 1e-12);
        // The thing is farther by then than what is tracked of it says.
        let moved = Moved {
            position: 1.0,
            speed: 2.0,
            ..Moved::default()
        };
        assert!((moved.later(delay).position - 1.1).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_foretold_is_not_read_late() {
        let mut moments = read_through(0.08);
        moments.iter_mut().for_each(|m| m.unsure = true);
        let own = law(form::LAG);
        let active = [Active {
            law: &own,
            values: &[0.1],
        }];
        assert_eq!(lagging(&moments, vec![1.0; 30], &active), vec![1.0; 30]);
    }
}
