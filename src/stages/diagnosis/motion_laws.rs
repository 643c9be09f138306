//! What may be wrong with an ideal joint that has dry friction: laws of the joint and of what feels it.

use nalgebra::Vector3;

use super::family::{Active, Law, Parameter};
use super::motion_closes::soft;
use super::motion_history::{freed, history_laws};
use super::motion_places::{closer_of, hardens, local_laws, notch, yielding};
use super::motion_sensor::{read, sensor_laws};
use super::motion_speeds::speed_laws;
use super::motion_stops::Stop;
use super::motions::Scale;

pub(super) mod form {
    pub const STICTION: usize = 0;
    pub const STRIBECK: usize = 1;
    pub const DAMPING: usize = 2;
    pub const QUADRATIC: usize = 3;
    pub const SPRING: usize = 4;
    pub const GRAVITY: usize = 5;
    pub const DETENT: usize = 6;
    pub const LIMIT_HIGH: usize = 7;
    pub const LIMIT_LOW: usize = 8;
    pub const LEVER: usize = 9;
    pub const SOFT_CLOSE: usize = 10;
    pub const BREAKAWAY: usize = 11;
    pub const BIAS: usize = 12;
    pub const DRIFT: usize = 13;
    pub const WEAR: usize = 14;
    pub const SATURATION: usize = 15;
    pub const NOTCH: usize = 16;
    pub const BACKLASH: usize = 17;
    pub const LOOSE: usize = 18;
    pub const BACKLASH_ANEW: usize = 19;
    pub const SATURATION_ROOM: usize = 20;
    pub const SOFT_CLOSE_ONE_WAY: usize = 21;
    pub const SLOPE: usize = 22;
    pub const BIAS_ROOM: usize = 23;
    pub const BOND: usize = 24;
    pub const LAG: usize = 25;
    pub const LATE: usize = 26;
    pub const DAMPING_TURNING: usize = 27;
    pub const DAMPING_SLIDING: usize = 28;
    pub const NOTCH_EDGED: usize = 29;
    pub const LIMIT_HIGH_STIFFENING: usize = 30;
    pub const LIMIT_LOW_STIFFENING: usize = 31;
    pub const SPRING_HARDENING: usize = 32;
    pub const NOTCH_TAILED: usize = 33;
    pub const SPRING_YIELDING: usize = 34;
    pub const SOFT_CLOSE_EDGED: usize = 35;
    pub const BIAS_FACED: usize = 36;
    pub const DRIFT_FACED: usize = 37;
    pub const NOTCH_CATCH: usize = 38;
    pub const SOFT_END: usize = 39;
    pub const SOFT_END_ONE_WAY: usize = 40;
    pub const SOFT_END_EDGED: usize = 41;
    pub const NOTCH_CATCH_END: usize = 42;
    pub const QUADRATIC_TURNING: usize = 43;
    pub const QUADRATIC_SLIDING: usize = 44;
    pub const NOTCH_ROOFED: usize = 45;
    pub const DRIFT_SETTLING: usize = 46;
    pub const SOFT_CLOSE_ONE_WAY_EDGED: usize = 47;
    pub const SOFT_END_ONE_WAY_EDGED: usize = 48;
    pub const DAMPING_THINNING: usize = 49;
}

/// Laws that the estimation of a joint knows.
pub(super) const TOLD: [usize; 5] = {
    use form::{DAMPING, DAMPING_SLIDING, DAMPING_TURNING, GRAVITY, SPRING};
    [DAMPING, DAMPING_TURNING, DAMPING_SLIDING, SPRING, GRAVITY]
};

/// One moment of a joint at work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moved {
    /// Seconds since the capture began.
    pub time: f64,
    /// rad or m.
    pub position: f64,
    /// Lowest and highest position of all motions.
    pub ends: [f64; 2],
    /// Standard deviation of one reading of it.
    pub doubt: f64,
    /// rad/s or m/s.
    pub speed: f64,
    /// rad/s² or m/s².
    pub gain: f64,
    /// N·m or N, as it was measured.
    pub load: f64,
    /// N·m per N.
    pub lever: f64,
    /// Unit vector, in the room, of the force that moves it.
    pub way: Vector3<f64>,
    /// The same of where its motion leads from where that begins; zero where nowhere.
    pub faced: Vector3<f64>,
    /// Way since it last stood or turned back, rad or m.
    pub slip: f64,
    /// Way since it last turned back, or since it was first seen where it has not yet, rad or m.
    pub back: f64,
    pub turned_back: bool,
    /// Way since this motion began, before it first turns back in it, rad or m.
    pub began: Option<f64>,
    /// How far it has come so far from where it was first seen, rad or m.
    pub reached: f64,
    /// Too slow for the direction of friction to be sure.
    pub still: bool,
    /// It sets out or stops so soon that its smoothed speed does not tell whether it moves yet.
    pub unsure: bool,
    /// What a stop may do here.
    pub stop: Stop,
}

impl Moved {
    /// The motion as it is when the force is read `delay` seconds late.
    pub fn later(&self, delay: f64) -> Self {
        Self {
            position: self.position - self.speed * delay,
            speed: self.speed - self.gain * delay,
            ..*self
        }
    }

    /// The measured load without what the sensor adds, N·m or N.
    pub fn unread(&self, active: &[Active]) -> f64 {
        self.load - read(self, 0.0, active)
    }
}

/// What the effort of all laws may be off by for what is not known of the place, N·m or N: what stands in a stiff place rests there.
pub fn open_at_rest(m: &Moved, active: &[Active]) -> f64 {
    let at = |position: f64| effort(&Moved { position, ..*m }, active);
    0.5 * (at(m.position + m.doubt) - at(m.position - m.doubt)).abs()
}

/// Way into a stop, rad or m, by which it presses back as one would that does not become stiffer.
fn stiffening(into: f64, doubles: f64) -> f64 {
    into * (1.0 + 0.5 * into / doubles)
}

/// Speed at which a power of that of a slide is told as a linear damper's or its square, m/s; of what turns it is 1 rad/s.
const SLIDES: f64 = 0.1;

/// What all laws but friction's add to the load that moves the joint.
pub fn effort(m: &Moved, active: &[Active]) -> f64 {
    let (q, v) = (m.position, m.speed);
    let one = |a: &Active| {
        let x = a.values;
        match a.law.form {
            form::DAMPING => x[0] * v,
            form::DAMPING_TURNING => x[0] * v.signum() * v.abs().powf(x[1]),
            form::DAMPING_SLIDING => x[0] * SLIDES * v.signum() * (v.abs() / SLIDES).powf(x[1]),
            form::DAMPING_THINNING => x[0] * v * (1.0 + (v / x[1].exp()).powi(2)).powf(-0.5 * x[2]),
            form::QUADRATIC => x[0] * v * v.abs(),
            form::QUADRATIC_TURNING => x[0] * v.signum() * v.abs().powf(x[1]),
            form::QUADRATIC_SLIDING => x[0] * SLIDES.powi(2) * v.signum() * (v.abs() / SLIDES).powf(x[1]),
            form::SPRING => x[0] * (q - x[1]),
            form::SPRING_HARDENING => x[0] * (q - x[1]) * (1.0 + x[2] * (q - x[1]).powi(2)),
            form::SPRING_YIELDING => x[0] * (q - x[1]) / ((q - x[1]) / x[2].exp()).hypot(1.0),
            form::SLOPE => -x[0],
            form::GRAVITY => -(x[0] * q.cos() + x[1] * q.sin()),
            form::DETENT | form::NOTCH | form::NOTCH_EDGED | form::NOTCH_TAILED => notch(a.law.form, x, q),
            form::NOTCH_ROOFED | form::NOTCH_CATCH | form::NOTCH_CATCH_END => notch(a.law.form, x, q),
            form::LIMIT_HIGH => x[0] * (q - x[1]).max(0.0),
            form::LIMIT_LOW => x[0] * (q - x[1]).min(0.0),
            form::LIMIT_HIGH_STIFFENING => x[0] * stiffening((q - x[1]).max(0.0), x[2].exp()),
            form::LIMIT_LOW_STIFFENING => -x[0] * stiffening((x[1] - q).max(0.0), x[2].exp()),
            closing => soft(closing, x, m),
        }
    };
    active.iter().map(one).sum()
}

/// What every joint has: the logarithm of its friction over what was read of it, its inertia, of which the width is set once what
/// moves it is known, the delay between force and track, and the speed below which dry friction is not full, far below the `fast`
/// ones or it could not be told from damping.
pub fn base_of(fast: f64, turns: bool) -> Vec<Parameter> {
    let creep = Parameter {
        high: (0.1 * fast).ln(),
        ..Parameter::scale("creep_speed", if turns { "rad/s" } else { "m/s" }, 0.02 * fast, 0.8)
    };
    vec![
        Parameter::amplitude("log_friction", "1", 1.0),
        Parameter::positive("inertia", if turns { "kg·m²" } else { "kg" }, 0.0),
        Parameter::amplitude("delay", "s", 0.012),
        creep,
    ]
}

/// How dry friction sets in with speed, in units of the creep speed: in proportion, then in full. A world that rounds
/// the corner off, as simulators do, is no damper.
pub fn set_in(speed: f64) -> f64 {
    speed / (1.0 + speed.powi(4)).powf(0.25)
}

/// Factor on dry friction while it slides.
pub fn sliding(m: &Moved, active: &[Active]) -> f64 {
    let one = |a: &Active| {
        let x = a.values;
        match a.law.form {
            form::STICTION | form::STRIBECK => x[0] * (-m.speed.abs() / x[1].exp()).exp(),
            form::BREAKAWAY => x[0] * (-m.slip / x[1].exp()).exp(),
            form::WEAR => x[0] * m.time,
            form::BACKLASH => -x[0] * freed(m, x[1].exp(), false),
            form::BACKLASH_ANEW => -x[0] * freed(m, x[1].exp(), true),
            _ => 0.0,
        }
    };
    (1.0 + active.iter().map(one).sum::<f64>()).max(0.0)
}

/// Factor on dry friction while it stands.
pub fn held(m: &Moved, active: &[Active]) -> f64 {
    let one = |a: &Active| match a.law.form {
        form::STICTION | form::STRIBECK | form::BREAKAWAY => a.values[0],
        form::BACKLASH => -a.values[0] * freed(m, a.values[1].exp(), false),
        form::BACKLASH_ANEW => -a.values[0] * freed(m, a.values[1].exp(), true),
        _ => 0.0,
    };
    (1.0 + active.iter().map(one).sum::<f64>()).max(0.0)
}

pub(super) struct Maker<'a> {
    pub(super) joint: &'a str,
}

impl Maker<'_> {
    pub(super) fn law(
        &self,
        cause: &'static str,
        form: usize,
        (amplitudes, shapes): (Vec<Parameter>, Vec<Parameter>),
        grid: Vec<Vec<f64>>,
        words: &'static str,
    ) -> Law {
        let place = if matches!(
            form,
            form::BIAS
                | form::BIAS_ROOM
                | form::BIAS_FACED
                | form::DRIFT
                | form::DRIFT_FACED
                | form::SATURATION
                | form::SATURATION_ROOM
                | form::LAG
                | form::LATE
        ) {
            "sensor".into()
        } else {
            self.joint.to_owned()
        };
        Law {
            cause,
            place,
            form,
            amplitudes: amplitudes.len(),
            parameters: amplitudes.into_iter().chain(shapes).collect(),
            grid,
            extends: &[],
            words,
        }
    }

    pub(super) fn plain(&self, cause: &'static str, form: usize, amplitude: Parameter, words: &'static str) -> Law {
        self.law(cause, form, (vec![amplitude], Vec::new()), vec![Vec::new()], words)
    }
}

/// Units of effort, effort per speed, per squared speed and per position.
pub(super) fn units(turns: bool) -> [&'static str; 4] {
    if turns {
        ["N·m", "N·m·s/rad", "N·m·s²/rad²", "N·m/rad"]
    } else {
        ["N", "N·s/m", "N·s²/m²", "N/m"]
    }
}

/// Every law that the motions of a joint can show.
pub fn motion_laws(joint: &str, scale: &Scale) -> Vec<Law> {
    let make = Maker { joint };
    let mut laws = speed_laws(&make, scale);
    laws.extend(history_laws(&make, scale));
    laws.extend(place_laws(&make, scale));
    laws.extend(local_laws(&make, scale));
    laws.extend(sensor_laws(&make, scale));
    laws
}

pub(super) fn logs(values: &[f64]) -> Vec<Vec<f64>> {
    values.iter().map(|v| vec![v.ln()]).collect()
}

fn place_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let [effort, _, _, per_place] = units(s.turns);
    let [low, high] = s.range;
    let span = (high - low).max(1e-6);
    let unit = if s.turns { "rad" } else { "m" };
    let rest = Parameter {
        unit,
        ..Parameter::place("q0", 0.5 * (low + high), span)
    };
    let spring = make.law(
        "joint-spring",
        form::SPRING,
        (
            vec![Parameter::positive("k", per_place, 0.7 * s.load / span)],
            vec![rest],
        ),
        vec![vec![low], vec![0.5 * (low + high)], vec![high]],
        "the joint is drawn back the farther it is moved",
    );
    let mut laws = vec![
        closer_of(spring.clone(), hardens(span, s.turns)),
        yielding(&spring, span, s.turns),
        spring,
    ];
    if s.turns {
        let amplitude = |name| Parameter::amplitude(name, effort, 0.5 * s.load);
        laws.push(make.law(
            "joint-gravity",
            form::GRAVITY,
            (vec![amplitude("gc"), amplitude("gs")], Vec::new()),
            vec![Vec::new()],
            "the load goes as sine and cosine of the angle, as a weight's does",
        ));
        let share = |name| Parameter::amplitude(name, "1", 0.15);
        laws.push(make.law(
            "lever-arm",
            form::LEVER,
            (vec![share("ec"), share("es")], Vec::new()),
            vec![Vec::new()],
            "all loads are wrong by a factor that depends on the angle: the arm of the force is",
        ));
    } else {
        laws.push(make.plain(
            "joint-gravity",
            form::SLOPE,
            Parameter::amplitude("gc", effort, 0.5 * s.load),
            "the same force draws it along its rail wherever it is",
        ));
    }
    laws
}
