//! What may be wrong with a linear spring: laws of the material and of the force sensor.

use super::family::Active;
use super::press_moment::Moment;
use super::press_reads::FINE;
use super::sensor_lag::ramp;

pub(super) mod form {
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
    pub const GUIDE_HELD: usize = 21;
    pub const LAG_OF_TWO: usize = 22;
    pub const CUBIC: usize = 23;
    pub const BOND: usize = 24;
    pub const DAMPING_GROWN: usize = 25;
    pub const GUIDE_SOFT: usize = 26;
    pub const DAMPING_POWER: usize = 27;
    pub const RELAXATION_OF_TWO: usize = 28;
    pub const STOPS_UNLIKE: usize = 29;
    pub const SATURATION_ROUND: usize = 30;
    pub const ADHESION_STRUNG: usize = 31;
    pub const STAGE_ROUND: usize = 32;
    pub const SNAP_SHAPED: usize = 33;
    pub const EXPONENTIAL: usize = 34;
}

/// Rate at which a power of it is told as a linear damper, m/s.
const DAMPED_AT: f64 = 0.01;

/// Through how many equal poles what is read follows.
pub(super) fn poles(form: usize) -> u8 {
    u8::from(form == form::LAG) + 2 * u8::from(form == form::LAG_OF_TWO)
}

/// Below this a lag may be how the tip and what is pressed give, s, and a step at contact how the surface is met, N.
const SLIGHT: f64 = 15.5e-3;
const STEP: f64 = 0.1;
/// Largest rate over which the friction of a guide turns, m/s.
pub(super) const TURNS: f64 = 2e-3;

/// Whether a law is of so little that it tells nothing, or is one of another cause at these values.
pub(super) fn slight(form: usize, values: &[f64]) -> bool {
    let below = |least: f64| values.first().is_some_and(|value| value.abs() < least);
    // A friction that sets in over as large a speed as that is a damper.
    let soft = form == self::form::GUIDE_SOFT && values.get(1).is_some_and(|vs| *vs > TURNS.ln() - 0.02);
    (poles(form) > 0 && below(SLIGHT)) || (form == self::form::PRELOAD && below(STEP)) || soft
}

/// One pole: what it reads, and what it followed last, N.
#[derive(Clone, Copy, Default)]
struct Pole {
    reads: f64,
    followed: f64,
}

impl Pole {
    /// What it reads `step` seconds later of a force that went evenly to `force` meanwhile: exact, so that a lag shorter than
    /// a sample is seen as well.
    fn follow(&mut self, force: f64, step: f64, lag: f64) -> f64 {
        let rate = (force - self.followed) / step.max(1e-9);
        // Behind a ramp it stays by the lag.
        let behind = self.reads - (self.followed - lag * rate);
        self.reads = force - lag * rate + behind * (-step / lag.max(1e-9)).exp();
        self.followed = force;
        self.reads
    }
}

/// Ways after which the stops of a Prandtl-Ishlinskii model give way, over their middle (Visintin 1994).
const STOPS: [f64; 4] = [0.35, 0.7, 1.4, 2.8];

/// How much lower presses as deep as these (m; here, and anywhere on the body) have left the surface, m.
pub(super) fn lower(a: &Active, deepest: [f64; 2]) -> f64 {
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

/// How the tool met a surface: how fast, m/s, and the force that told it, N.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    pub speed: f64,
    pub force: f64,
}

impl Met {
    /// How much deeper than the surface of a spring of `stiffness` (N/m) the tool was where what was read told it, m, beside a
    /// `delay` (s) of the force behind the path.
    pub fn late(&self, stiffness: f64, delay: f64, active: &[Active]) -> f64 {
        // How long it took to where a spring alone comes to that force.
        let depth = self.force.max(0.0) / (stiffness * self.speed).max(1e-9);
        let one = |a: &Active| match a.law.form {
            form::DELAY => a.values[0],
            form::LAG | form::LAG_OF_TWO => self.behind(stiffness, a.values[0], poles(a.law.form)),
            // What resists by its rate is felt before it is deep.
            form::DAMPING | form::DAMPING_POWER => -a.values[0].clamp(0.0, depth),
            form::RELAXATION => -depth * (1.0 - 1.0 / (1.0 + a.values[0].max(0.0))),
            form::RELAXATION_OF_TWO => {
                let both = a.values[0].max(0.0) * (1.0 + a.values[2].exp());
                -depth * (1.0 - 1.0 / (1.0 + both))
            }
            _ => 0.0,
        };
        self.speed * (delay + active.iter().map(one).sum::<f64>())
    }

    /// By how many seconds a lagging reading is behind an even rise where it comes to that force, in the middle of a sample.
    fn behind(&self, stiffness: f64, lag: f64, poles: u8) -> f64 {
        // A step that was read is not behind.
        if self.force <= 0.0 {
            return 0.0;
        }
        let up = self.force / (stiffness * self.speed).max(1e-9);
        // A reading never comes to more than its lag behind.
        let (mut low, mut high) = (up, up + lag);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if ramp(middle, lag, poles) < up {
                low = middle;
            } else {
                high = middle;
            }
        }
        let seen = high + 0.5 * FINE;
        seen - ramp(seen, lag, poles)
    }
}

/// What a pressed thing and a sensor remember from sample to sample.
pub struct Memory {
    stiffness: f64,
    scale: f64,
    /// Deepest so far at this spot, and anywhere on the body, m.
    deepest: [f64; 2],
    /// The same, from where the surface was at first, before this press and up to now.
    past: [f64; 2],
    sunk_to: [f64; 2],
    /// Forces of the relaxing arms, N.
    arms: [f64; 2],
    /// State of the hysteretic element, −1 to 1.
    loop_state: f64,
    /// Stretch of the stops, m.
    stops: [f64; STOPS.len()],
    /// Depth before, m.
    before: f64,
    /// Friction of a guide over its most.
    guide: f64,
    /// A slow sensor.
    slow: [Pole; 2],
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
            sunk_to: past,
            arms: [0.0; 2],
            loop_state: 0.0,
            stops: [0.0; STOPS.len()],
            before: 0.0,
            guide: 0.0,
            slow: [Pole::default(); 2],
            first: true,
        }
    }

    /// The reading at one moment, N; `shift` (m) is how much later than thought the surface was met.
    pub fn force(&mut self, m: &Moment, shift: f64, active: &[Active]) -> f64 {
        // Depth counts from where this press met the surface, what stays down from where it was at first.
        let from_contact = m.depth - shift;
        let from_first = from_contact + sunk(self.past, active);
        if from_contact > 0.0 {
            self.sunk_to = self.sunk_to.map(|d| d.max(from_first));
        }
        let late = |a: &&Active| a.law.form == form::DELAY;
        let delay: f64 = active.iter().filter(late).map(|a| a.values[0]).sum();
        let depth = from_first - sunk(self.sunk_to, active) - m.rate * delay;
        let inside = depth.max(0.0);
        let moved = inside - self.before;
        let mut force = self.stiffness * inside;
        for a in active {
            force += self.material(a, m, depth, inside, moved);
        }
        let clings = |a: &Active| matches!(a.law.form, form::ADHESION | form::ADHESION_STRUNG | form::BOND);
        if inside > 0.0 || !active.iter().any(clings) {
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
        let used = |deepest: f64| -k * inside * v[0] * ((deepest - inside) / v[1].exp()).clamp(0.0, 1.0);
        match a.law.form {
            form::CURVED => k * inside * v[0] * inside / s,
            form::EXPONENTIAL => k * inside * super::press_closer::grown(2.0 * v[0] * inside / s),
            form::CUBIC => k * inside * v[0] * (inside / s).powi(2),
            form::STAGE => k * v[0] * (inside - v[1]).max(0.0),
            // It begins to bear by and by.
            form::STAGE_ROUND => {
                let (into, over) = ((inside - v[1]) / v[2].exp(), v[2].exp());
                k * v[0] * over * (into.max(0.0) + (-into.abs()).exp().ln_1p())
            }
            form::POWER if touching => k * inside * ((inside / s).powf(v[0]) - 1.0),
            form::DAMPING if touching => k * v[0] * m.rate,
            form::DAMPING_POWER if touching => {
                k * v[0] * DAMPED_AT * m.rate.signum() * (m.rate.abs() / DAMPED_AT).powf(v[1])
            }
            // As much of it as is touched resists (Hunt and Crossley 1975, where that is not soon all of it).
            form::DAMPING_GROWN if touching => k * v[0] * m.rate * inside / (inside + v[1].exp()),
            form::RELAXATION => self.relaxing(0, [v[0] * k * moved, v[1].exp(), m.step], touching),
            // A second arm that is slower (Wiechert 1893).
            form::RELAXATION_OF_TWO => {
                let quick = self.relaxing(0, [v[0] * k * moved, v[1].exp(), m.step], touching);
                let slower = [v[0] * v[2].exp() * k * moved, (v[1] + v[3]).exp(), m.step];
                quick + self.relaxing(1, slower, touching)
            }
            form::HYSTERESIS => {
                let turn = moved / v[1].exp();
                self.loop_state = (self.loop_state + turn - turn.abs() * self.loop_state).clamp(-1.0, 1.0);
                if touching { v[0] * self.loop_state } else { 0.0 }
            }
            form::STOPS | form::STOPS_UNLIKE => {
                // How far apart the stops are, and how the force of one goes with its way, as powers.
                let [apart, shares] = if v.len() > 3 { [v[2].exp(), v[3]] } else { [1.0, 0.0] };
                let (mut sum, mut all) = (0.0, 0.0);
                for (stretch, reach) in self.stops.iter_mut().zip(STOPS) {
                    let (limit, share) = (reach.powf(apart) * v[1].exp(), reach.powf(shares));
                    *stretch = (*stretch + moved).clamp(-limit, limit);
                    sum += share * *stretch / limit;
                    all += share;
                }
                if touching { v[0] * sum / all } else { 0.0 }
            }
            form::GUIDE if touching => v[0] * (m.rate / 1e-4).tanh(),
            // It lets go of what stands.
            form::GUIDE_SOFT if touching => v[0] * (m.rate / v[1].exp()).tanh(),
            form::GUIDE_HELD => {
                self.guide = (self.guide + moved / v[1].exp()).clamp(-1.0, 1.0);
                if touching { v[0] * self.guide } else { 0.0 }
            }
            form::MULLINS => used(self.deepest[0]),
            form::MULLINS_ALL_OVER => used(self.deepest[1]),
            form::SNAP if touching => -v[0] * (-((inside - v[1]) / v[2].exp()).powi(2) / 2.0).exp(),
            // Flatter or narrower at its top, and with a tail.
            form::SNAP_SHAPED if touching => {
                let away = ((inside - v[1]).abs() / v[2].exp()).powf(v[3].exp());
                -v[0] * (1.0 + 0.5 * away * (-v[4]).exp()).powf(-v[4].exp())
            }
            form::PRELOAD if touching => v[0] * (1.0 - (-inside / v[1].exp()).exp()),
            form::DRIFT => k * inside * v[0] * m.time,
            // Drawn out as far as it was pressed in, until it lets go.
            form::BOND if m.rate < 0.0 && depth < 0.0 && self.deepest[0] > 0.0 => {
                let beyond = (-depth - v[0].max(0.0) / k).max(0.0);
                -(k * (-depth - beyond)) * (-beyond / v[1].exp()).exp()
            }
            // It strings: drawn out it pulls the more at first, and lets go by and by.
            form::ADHESION_STRUNG if m.rate < 0.0 && depth < 0.0 && self.deepest[0] > 0.0 => {
                let gap = -depth / v[1].exp();
                -v[0] * gap * (1.0 - gap).exp()
            }
            form::ADHESION if m.rate < 0.0 && self.deepest[0] > 0.0 => -v[0] * (-depth.abs() / v[1].exp()).exp(),
            _ => 0.0,
        }
    }

    /// The force, N, of an arm that is drawn by `drawn` newtons over a `step` (s) and dies within `tau` (s).
    fn relaxing(&mut self, arm: usize, [drawn, tau, step]: [f64; 3], touching: bool) -> f64 {
        let decay = (-step / tau).exp();
        self.arms[arm] = self.arms[arm] * decay + drawn * (1.0 + decay) / 2.0;
        if touching { self.arms[arm] } else { 0.0 }
    }

    fn read(&mut self, a: &Active, m: &Moment, force: f64) -> f64 {
        let v = a.values;
        match a.law.form {
            form::BIAS => force + v[0],
            form::SENSOR_DRIFT => force + v[0] * (m.time + v[1]),
            form::SATURATION => force.min(v[0].exp()),
            form::SATURATION_ROUND => {
                let over = (force / v[0].exp()).abs().powf(v[1].exp());
                force / (1.0 + over).powf((-v[1]).exp())
            }
            form::LAG | form::LAG_OF_TWO => {
                let poles = poles(a.law.form);
                let mut read = force;
                for pole in &mut self.slow[..usize::from(poles)] {
                    if self.first {
                        *pole = Pole {
                            reads: read,
                            followed: read,
                        };
                    }
                    read = pole.follow(read, m.step, v[0] / f64::from(poles));
                }
                read
            }
            _ => force,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::diagnosis::family::Law;

    fn law(form: usize) -> Law {
        Law {
            cause: "adhesion",
            place: "pad".into(),
            form,
            parameters: Vec::new(),
            amplitudes: 1,
            grid: Vec::new(),
            extends: &[],
            words: "",
        }
    }

    #[test]
    fn a_bond_draws_as_far_out_as_it_was_pressed_in_and_lets_go() {
        let (law, values) = (law(form::BOND), [0.5, 1e-5_f64.ln()]);
        let active = [Active {
            law: &law,
            values: &values,
        }];
        let mut memory = Memory::new(1e3, 2e-3, [0.0; 2]);
        let mut at = |depth: f64, rate: f64| {
            let moment = Moment {
                step: 0.04,
                depth,
                rate,
                ..Moment::default()
            };
            memory.force(&moment, 0.0, &active)
        };
        assert!((at(1e-3, 0.01) - 1.0).abs() < 1e-9);
        assert!((at(-2e-4, -0.01) + 0.2).abs() < 1e-9);
        assert!((at(-5e-4, -0.01) + 0.5).abs() < 1e-9);
        assert!(at(-7e-4, -0.01).abs() < 1e-3);
    }

    #[test]
    fn what_resists_by_its_rate_is_felt_before_it_is_deep() {
        let (law, values) = (law(form::DAMPING), [0.05]);
        let active = [Active {
            law: &law,
            values: &values,
        }];
        // At 20 mm/s a spring alone of 1 kN/m comes to 0.1 N after 5 ms and 0.1 mm; this one is at its surface.
        let met = Met {
            speed: 0.02,
            force: 0.1,
        };
        assert!((met.late(1e3, 0.0, &active) + 1e-4).abs() < 1e-9);
        assert!(met.late(1e3, 0.0, &[]).abs() < 1e-12);
    }
}
