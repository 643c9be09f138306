//! What reads the load of a joint, and what is wrong with it.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::family::{Active, Law, Parameter};
use super::motion_faced::{faced_laws, warming};
use super::motion_laws::{Maker, Moved, form};
use super::motion_reads::BIN;
use super::motion_stops::Stop;
use super::motions::Scale;
use super::push_laws::settling;
use crate::capture::{Capture, PhaseKind, Segmented};

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
    /// What all hands read along a direction in which none of them strains, N, where no finger was free.
    held: Option<Vector3<f64>>,
    /// The most that any of them read before it set out, fingers or hands, with its noise, N; nothing of a few.
    quiet: Option<f64>,
    /// Tools are turned, within motions or from one to the next.
    pub tool_turns: bool,
}

/// Fewest hands that tell what they read without strain, how many times their noise it may scatter, and how many times that the strain
/// of any other direction does at least.
const HANDS: usize = 5;
const STILL: f64 = 4.0;
const STRAINS: f64 = 8.0;
/// Standard deviations from nought from which on it counts.
const CLEAR: f64 = 8.0;
/// How many times the most that any hand read a bias has to be, to be spoken against.
const READ: f64 = 4.0;

/// What hands that hold on read before they set out has in common along the direction in which it scatters least: they strain at what
/// sticks as chance will have it, where nothing moves they do not.
fn unstrained(read: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    let n = read.len() as f64;
    if read.len() < HANDS {
        return None;
    }
    let mean = read.iter().map(|r| r.0).sum::<Vector3<f64>>() / n;
    let off = |r: &(Vector3<f64>, f64)| (r.0 - mean) * (r.0 - mean).transpose();
    let spread = SymmetricEigen::new(read.iter().map(off).sum::<Matrix3<f64>>() / (n - 1.0));
    let least = spread.eigenvalues.imin();
    let scatter = spread.eigenvalues[least].max(0.0).sqrt();
    let others = (0..3)
        .filter(|k| *k != least)
        .map(|k| spread.eigenvalues[k].max(0.0).sqrt());
    let noise = crate::math::median(&read.iter().map(|r| r.1).collect::<Vec<f64>>())?;
    let common = spread.eigenvectors.column(least) * mean.dot(&spread.eigenvectors.column(least));
    let strained = others.fold(f64::INFINITY, f64::min) > STRAINS * scatter;
    let told = scatter < STILL * noise && strained && common.norm() > CLEAR * scatter.max(noise);
    told.then_some(common)
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
        let hands = held_reads(capture, segmented);
        let most = hands.iter().map(|(read, noise)| read.norm() + 2.0 * noise);
        Self {
            tare: (!tares.is_empty()).then_some((mean, largest)),
            held: unstrained(&hands).filter(|_| tares.is_empty()),
            quiet: (tares.is_empty() && hands.len() >= HANDS).then(|| most.fold(0.0, f64::max)),
            friction,
            tool_turns,
        }
    }

    /// All of them read this force, N.
    #[cfg(test)]
    pub fn reading(tare: Vector3<f64>, friction: f64) -> Self {
        Self {
            tare: Some((tare, tare.norm())),
            held: None,
            quiet: None,
            friction,
            tool_turns: false,
        }
    }

    /// They were there and read nothing.
    pub fn reads_nothing(&self) -> bool {
        self.tare.is_some_and(|(_, largest)| largest < NOTHING * self.friction)
    }

    /// Whether a force of so much, N, that the sensor reads always cannot be: none of many hands read a part of it before it set out, and
    /// what they hold strains against no two of them alike.
    pub fn speaks_against(&self, bias: f64) -> bool {
        self.quiet.is_some_and(|most| bias.abs() > READ * most)
    }

    /// The force that all of them read, N; of hands, that along which none strains.
    pub fn bias(&self) -> Option<Vector3<f64>> {
        let mean = self.tare.map(|t| t.0).or(self.held)?;
        (mean.norm() > NOTHING * self.friction).then_some(mean)
    }
}

/// What each hand read before it set out, with the noise of that mean, N.
fn held_reads(capture: &Capture, segmented: &[Segmented]) -> Vec<(Vector3<f64>, f64)> {
    let hands = capture
        .fitted()
        .filter(|i| i.tool.as_ref().is_some_and(|t| t.grip || t.pin));
    let read = |i: &crate::capture::Interaction| {
        let own = segmented.iter().find(|s| s.interaction == i.name)?;
        let sets_out = own.of(PhaseKind::Slide).map(|p| p.start).reduce(f64::min)?;
        let stream = i.force.as_ref()?;
        let begin = *stream.time.first()?;
        let rests = stream
            .time
            .partition_point(|t| *t < begin + BEFORE * (sets_out - begin));
        let rows: Vec<&Vector3<f64>> = stream.force[..rests]
            .iter()
            .filter(|f| f.iter().all(|x| x.is_finite()))
            .collect();
        if rows.len() < FEW_ROWS {
            return None;
        }
        let n = rows.len() as f64;
        let mean = rows.iter().copied().sum::<Vector3<f64>>() / n;
        Some((mean, own.force_noise? / n.sqrt().min(FEW_ROWS as f64)))
    };
    hands.filter_map(read).collect()
}

/// Share of the time before it sets out that is surely before it, and the fewest readings of it; noise that goes on from reading to
/// reading does not average out as more than the square of these do.
const BEFORE: f64 = 0.6;
const FEW_ROWS: usize = 7;

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
    let words = if s.free.tare.is_some() {
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

    #[test]
    fn hands_that_strain_along_two_ways_tell_what_is_read_along_the_third() {
        let one = |k: u32, z: f64| {
            let strain = Vector3::new(f64::from(k * k % 7) - 2.0, f64::from(k * 5 % 3) - 1.5, 0.0);
            (strain + Vector3::z() * (z + 0.002 * f64::from(k % 2)), 0.003)
        };
        let read = |z: f64| (0..8).map(|k| one(k, z)).collect::<Vec<_>>();
        let told = unstrained(&read(0.4)).expect("read by all");
        assert!((told.z - 0.4).abs() < 0.01 && told.xy().norm() < 0.01, "{told}");
        assert!(unstrained(&read(0.0)).is_none());
        // Hands that do not strain at all may have been told to pull so.
        let still: Vec<_> = (0..8).map(|_| (Vector3::z() * 0.4, 0.003)).collect();
        assert!(unstrained(&still).is_none());
    }

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
