//! What may be wrong with a linear spring: laws of the material and of the force sensor.

use super::family::{Active, Law, Parameter};
use super::presses::{Moment, Presses};

mod form {
    pub const CURVED: usize = 0;
    pub const STAGE: usize = 1;
    pub const POWER: usize = 2;
    pub const DAMPING: usize = 3;
    pub const RELAXATION: usize = 4;
    pub const SET: usize = 5;
    pub const HYSTERESIS: usize = 6;
    pub const GUIDE: usize = 7;
    pub const MULLINS: usize = 8;
    pub const SNAP: usize = 9;
    pub const PRELOAD: usize = 10;
    pub const DRIFT: usize = 11;
    pub const ADHESION: usize = 12;
    pub const BIAS: usize = 13;
    pub const SENSOR_DRIFT: usize = 14;
    pub const SATURATION: usize = 15;
    pub const DELAY: usize = 16;
    pub const LAG: usize = 17;
    pub const SET_ALL_OVER: usize = 18;
    pub const MULLINS_ALL_OVER: usize = 19;
    pub const STOPS: usize = 20;
}

/// Ways after which the stops of a Prandtl-Ishlinskii model give way, over their middle (Visintin 1994).
const STOPS: [f64; 4] = [0.35, 0.7, 1.4, 2.8];

/// How much lower presses as deep as these (m; here, and anywhere on the body) have left the surface, m.
fn lower(a: &Active, deepest: [f64; 2]) -> f64 {
    let of = |deepest: f64| a.values[0] * (deepest - a.values[1]).max(0.0);
    match a.law.form {
        form::SET => of(deepest[0]),
        form::SET_ALL_OVER => of(deepest[1]),
        _ => 0.0,
    }
}

/// How much lower than at first the tool meets the surface after presses `past` deep (m; here, and anywhere on the body), m.
pub fn sunk(past: [f64; 2], active: &[Active]) -> f64 {
    active.iter().map(|a| lower(a, past)).sum()
}

/// What a pressed thing and a sensor remember from sample to sample.
pub struct Memory {
    stiffness: f64,
    scale: f64,
    /// Deepest so far at this spot, and anywhere on the body, m.
    deepest: [f64; 2],
    /// The same before this press.
    past: [f64; 2],
    /// Force of the relaxing arm, N.
    arm: f64,
    /// State of the hysteretic element, −1 to 1.
    loop_state: f64,
    /// Stretch of the stops, m.
    stops: [f64; STOPS.len()],
    /// Depth before, m.
    before: f64,
    /// Reading of a slow sensor, N.
    slow: f64,
    first: bool,
}

impl Memory {
    /// A spring of `stiffness` (N/m) that was pressed `past` (m; here, and anywhere) deep before; `scale` (m) is the deepest of all presses.
    pub fn new(stiffness: f64, scale: f64, past: [f64; 2]) -> Self {
        let scale = scale.max(1e-5);
        Self {
            stiffness,
            scale,
            deepest: past,
            past,
            arm: 0.0,
            loop_state: 0.0,
            stops: [0.0; STOPS.len()],
            before: 0.0,
            slow: 0.0,
            first: true,
        }
    }

    /// The reading at one moment, N; `shift` (m) is how much later than thought the surface was met.
    pub fn force(&mut self, m: &Moment, shift: f64, active: &[Active]) -> f64 {
        let mut depth = m.depth - shift;
        for a in active {
            match a.law.form {
                form::DELAY => depth -= m.rate * a.values[0],
                // Depth counts from where this press met the surface.
                form::SET | form::SET_ALL_OVER => depth -= lower(a, self.deepest) - lower(a, self.past),
                _ => {}
            }
        }
        let inside = depth.max(0.0);
        let moved = inside - self.before;
        let mut force = self.stiffness * inside;
        for a in active {
            force += self.material(a, m, depth, inside, moved);
        }
        if inside > 0.0 || !active.iter().any(|a| a.law.form == form::ADHESION) {
            force = force.max(0.0);
        }
        self.before = inside;
        self.deepest = self.deepest.map(|d| d.max(inside));
        for a in active {
            force = self.read(a, m, force);
        }
        self.first = false;
        force
    }

    /// What a law adds to the spring, N.
    fn material(&mut self, a: &Active, m: &Moment, depth: f64, inside: f64, moved: f64) -> f64 {
        let (v, k, s) = (a.values, self.stiffness, self.scale);
        let touching = inside > 0.0;
        let used = |deepest: f64| -k * inside * v[0] * ((deepest - inside) / s).clamp(0.0, 1.0);
        match a.law.form {
            form::CURVED => k * inside * v[0] * inside / s,
            form::STAGE => k * v[0] * (inside - v[1]).max(0.0),
            form::POWER if touching => k * inside * ((inside / s).powf(v[0]) - 1.0),
            form::DAMPING if touching => k * v[0] * m.rate,
            form::RELAXATION => {
                let decay = (-m.step / v[1].exp()).exp();
                self.arm = self.arm * decay + v[0] * k * moved * (1.0 + decay) / 2.0;
                if touching { self.arm } else { 0.0 }
            }
            form::HYSTERESIS => {
                let turn = moved / v[1].exp();
                self.loop_state = (self.loop_state + turn - turn.abs() * self.loop_state).clamp(-1.0, 1.0);
                if touching { v[0] * self.loop_state } else { 0.0 }
            }
            form::STOPS => {
                let middle = v[1].exp();
                let mut sum = 0.0;
                for (stretch, reach) in self.stops.iter_mut().zip(STOPS) {
                    let limit = reach * middle;
                    *stretch = (*stretch + moved).clamp(-limit, limit);
                    sum += *stretch / limit;
                }
                if touching { v[0] * sum / STOPS.len() as f64 } else { 0.0 }
            }
            form::GUIDE if touching => v[0] * (m.rate / 1e-4).tanh(),
            form::MULLINS => used(self.deepest[0]),
            form::MULLINS_ALL_OVER => used(self.deepest[1]),
            form::SNAP if touching => -v[0] * (-((inside - v[1]) / v[2].exp()).powi(2) / 2.0).exp(),
            form::PRELOAD if touching => v[0] * (1.0 - (-inside / v[1].exp()).exp()),
            form::DRIFT => k * inside * v[0] * m.time,
            form::ADHESION if m.rate < 0.0 && self.deepest[0] > 0.0 => -v[0] * (-depth.abs() / 3e-4).exp(),
            _ => 0.0,
        }
    }

    fn read(&mut self, a: &Active, m: &Moment, force: f64) -> f64 {
        let v = a.values;
        match a.law.form {
            form::BIAS => force + v[0],
            form::SENSOR_DRIFT => force + v[0] * m.time,
            form::SATURATION => force.min(v[0].exp()),
            form::LAG => {
                let share = if v[0] < 1e-6 { 1.0 } else { 1.0 - (-m.step / v[0]).exp() };
                self.slow = if self.first {
                    force
                } else {
                    self.slow + share * (force - self.slow)
                };
                self.slow
            }
            _ => force,
        }
    }
}

fn law(
    cause: &'static str,
    form: usize,
    amplitudes: Vec<Parameter>,
    shapes: Vec<Parameter>,
    grid: Vec<Vec<f64>>,
    words: &'static str,
) -> Law {
    let count = amplitudes.len();
    let parameters = amplitudes.into_iter().chain(shapes).collect();
    let sensor = (form::BIAS..=form::LAG).contains(&form);
    let place = if sensor { "sensor" } else { "body" }.into();
    Law {
        cause,
        place,
        form,
        parameters,
        amplitudes: count,
        grid,
        words,
    }
}

/// Every law that presses can show.
pub fn press_laws(presses: &Presses) -> Vec<Law> {
    let mut laws = curve_laws(presses.deepest.max(1e-5));
    laws.extend(history_laws());
    laws.extend(memory_laws(presses.deepest.max(1e-5)));
    laws.extend(sensor_laws(presses));
    laws
}

fn plain(cause: &'static str, form: usize, amplitude: Parameter, words: &'static str) -> Law {
    law(cause, form, vec![amplitude], Vec::new(), vec![Vec::new()], words)
}

fn logs(values: &[f64]) -> Vec<Vec<f64>> {
    values.iter().map(|v| vec![v.ln()]).collect()
}

fn curve_laws(deepest: f64) -> Vec<Law> {
    let depths = |shares: &[f64]| shares.iter().map(|s| vec![s * deepest]).collect::<Vec<_>>();
    let at = |name| Parameter {
        low: 0.0,
        high: deepest,
        ..Parameter::place(name, 0.5 * deepest, 1e-3f64.min(0.3 * deepest))
    };
    let notches = [0.25, 0.5, 0.75, 1.1]
        .iter()
        .flat_map(|d| [1.5e-4f64, 4e-4].map(|w| vec![d * deepest, w.ln()]))
        .collect();
    vec![
        plain(
            "hardening-stiffness",
            form::CURVED,
            Parameter {
                low: -0.9,
                ..Parameter::amplitude("a", "1", 0.3)
            },
            "the force bends away from a straight line with depth, the same in and out",
        ),
        law(
            "second-stage",
            form::STAGE,
            vec![Parameter::positive("k2_over_k", "1", 0.4)],
            vec![at("d")],
            depths(&[0.2, 0.35, 0.5, 0.65, 0.8]),
            "from some depth on a second spring bears",
        ),
        plain(
            "power-law-stiffness",
            form::POWER,
            Parameter {
                low: -0.8,
                ..Parameter::amplitude("h", "1", 0.3)
            },
            "the force grows as a power of the depth",
        ),
        law(
            "snap-through",
            form::SNAP,
            vec![Parameter::positive("A", "N", 1.0)],
            vec![
                // Of one that lies a little deeper the flank is felt.
                Parameter {
                    high: 1.3 * deepest,
                    ..at("us")
                },
                Parameter::scale("w", "m", 3e-4, 0.6),
            ],
            notches,
            "the force drops at one depth",
        ),
        law(
            "preload",
            form::PRELOAD,
            vec![Parameter::positive("F0", "N", 0.5)],
            // The tip of the finger and what holds the thing back give a little.
            vec![Parameter::scale("over", "m", 5e-5, 0.8)],
            logs(&[2e-5, 1e-4]),
            "the force steps up at first contact",
        ),
    ]
}

/// What a deep press leaves behind, at its spot or, under a stiff skin, all over.
fn memory_laws(deepest: f64) -> Vec<Law> {
    let yields = || Parameter {
        low: 0.0,
        ..Parameter::place("uy", 0.3 * deepest, 0.3 * deepest)
    };
    let share = || Parameter {
        high: 0.95,
        ..Parameter::positive("a", "1", 0.2)
    };
    let set = |form| {
        law(
            "plastic-set",
            form,
            vec![share()],
            vec![yields()],
            vec![vec![0.0], vec![0.3 * deepest], vec![0.6 * deepest]],
            "the surface stays lower after a deep press",
        )
    };
    let used = |form| {
        plain(
            "softening-by-use",
            form,
            share(),
            "where it was pressed before it is softer",
        )
    };
    vec![
        set(form::SET),
        set(form::SET_ALL_OVER),
        used(form::MULLINS),
        used(form::MULLINS_ALL_OVER),
    ]
}

fn history_laws() -> Vec<Law> {
    let looped = |form| {
        law(
            "elastic-hysteresis",
            form,
            vec![Parameter::positive("A", "N", 0.5)],
            vec![Parameter::scale("d", "m", 1e-3, 0.6)],
            logs(&[3e-4, 1e-3, 2e-3]),
            "going in costs more than coming out gives back, at any speed",
        )
    };
    vec![
        plain(
            "elastic-damping",
            form::DAMPING,
            Parameter::positive("c_over_k", "s", 0.03),
            "the force depends on how fast the tool goes in",
        ),
        law(
            "stress-relaxation",
            form::RELAXATION,
            vec![Parameter::positive("s", "1", 0.2)],
            vec![Parameter::scale("tau", "s", 0.5, 0.8)],
            logs(&[0.1, 0.3, 1.0, 3.0]),
            "the force sinks while the tool stands still",
        ),
        looped(form::HYSTERESIS),
        looped(form::STOPS),
        plain(
            "guide-friction",
            form::GUIDE,
            Parameter::positive("Fc", "N", 0.4),
            "a constant friction opposes going in and coming out",
        ),
        plain(
            "stiffness-drift",
            form::DRIFT,
            Parameter::amplitude("kappa", "1/s", 1e-3),
            "the stiffness changes with time",
        ),
        plain(
            "adhesion",
            form::ADHESION,
            Parameter::positive("Fa", "N", 0.5),
            "it clings to the tool on the way out",
        ),
    ]
}

fn sensor_laws(presses: &Presses) -> Vec<Law> {
    let largest = presses.largest.max(1e-2);
    vec![
        plain(
            "force-bias",
            form::BIAS,
            Parameter::amplitude("b", "N", 0.3),
            "the sensor reads a force without touching",
        ),
        plain(
            "force-drift",
            form::SENSOR_DRIFT,
            Parameter::amplitude("d", "N/s", 0.1 / 60.0),
            "the reading without touching creeps with time",
        ),
        law(
            "force-saturation",
            form::SATURATION,
            Vec::new(),
            // Nothing larger than the limit can have been read.
            vec![Parameter {
                low: (0.97 * largest).ln(),
                ..Parameter::scale("Fs", "N", largest, 0.3)
            }],
            vec![vec![(0.985 * largest).ln()]],
            "the sensor cuts off large forces",
        ),
        plain(
            "time-delay",
            form::DELAY,
            Parameter::amplitude("tau", "s", 0.03),
            "the motion is recorded later than the force",
        ),
        plain(
            "sensor-lag",
            form::LAG,
            Parameter::positive("Tf", "s", 0.05),
            "the force sensor follows slowly",
        ),
    ]
}
