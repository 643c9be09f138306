//! What a joint remembers: that it was moved at all, where it turned back, and a part that swings after it.

use super::family::{Active, Law, Parameter};
use super::motion_laws::{Maker, Moved, form, logs};
use super::motion_stops::Stop;
use super::motions::Scale;

/// Which way a joint goes, and how far it has come since it turned back.
#[derive(Clone, Default)]
pub struct Turning {
    /// Way that is told from none, rad or m.
    least: f64,
    /// 1 or -1; 0 before it was seen to move.
    way: f64,
    /// The farthest point that it came to that way, rad or m.
    far: f64,
    /// Where it last turned back, and where this motion began, rad or m.
    turned: Option<f64>,
    start: Option<f64>,
    /// In this motion it moved, and turned back.
    moved: bool,
    came_back: bool,
    /// Where it was first seen, and how far it has come from there so far, rad or m.
    first: Option<f64>,
    reach: f64,
}

impl Turning {
    /// Nothing seen yet; ways shorter than `least`, rad or m, are none.
    pub fn new(least: f64) -> Self {
        Self {
            least,
            ..Self::default()
        }
    }

    /// Where it is found when a motion begins it was brought unseen: straight there from where it was left.
    fn brought(&mut self, position: f64) {
        let ahead = self.way * (position - self.far);
        if ahead > 0.0 {
            self.far = position;
        } else if ahead < -self.least {
            self.turned = Some(self.far);
            (self.way, self.far) = (-self.way, position);
        }
    }

    /// Another motion begins.
    pub fn begin(&mut self) {
        (self.start, self.moved, self.came_back) = (None, false, false);
    }

    /// Way since this motion began, rad or m, before it first turns back in it.
    pub fn began(&self, position: f64) -> Option<f64> {
        self.start
            .filter(|_| !self.came_back)
            .map(|start| (position - start).abs())
    }

    /// How far it has come so far from where it was first seen, rad or m.
    pub fn reached(&mut self, position: f64) -> f64 {
        let first = *self.first.get_or_insert(position);
        self.reach = self.reach.max((position - first).abs());
        self.reach
    }

    /// Way since it last turned back, rad or m, and whether it was seen to; from where it set out where it was not.
    pub fn back(&mut self, position: f64, speed: f64, still: bool) -> (f64, bool) {
        if self.start.is_none() {
            self.brought(position);
        }
        let start = *self.start.get_or_insert(position);
        if !still && speed * self.way <= 0.0 {
            if self.way != 0.0 {
                self.turned = Some(self.far);
                self.came_back |= self.moved;
            }
            (self.way, self.far) = (speed.signum(), position);
        }
        self.moved |= !still;
        if self.way * (position - self.far) > 0.0 {
            self.far = position;
        }
        ((position - self.turned.unwrap_or(start)).abs(), self.turned.is_some())
    }
}

/// How much of a play of `half` to either side is still to be gone through, 1 to 0, its end rounded so that a fit can find it. What
/// was done to the joint between two motions is not seen: `anew`, it begins every one of them in the middle of its play.
pub fn freed(m: &Moved, half: f64, anew: bool) -> f64 {
    let (way, whole) = match m.began {
        Some(began) if anew => (began, half),
        // At first it may be anywhere in its play.
        _ if !m.turned_back => (m.back, half),
        _ => (m.back, 2.0 * half),
    };
    1.0 / (1.0 + ((way - whole) / (EDGE * whole)).exp())
}

/// Share of a play over which its end is rounded.
const EDGE: f64 = 0.08;

/// What a bond that its first motion breaks adds to friction, N·m or N.
pub fn bonded(m: &Moved, active: &[Active]) -> f64 {
    let bonds = active.iter().filter(|a| a.law.form == form::BOND);
    bonds
        .map(|a| a.values[0] * (-m.reached / a.values[1].exp()).exp())
        .sum()
}

/// Load, N·m or N, by which a part of the inertia that hangs on a spring and a damper lags behind, moment by moment:
/// `J (w² y + 2 z w y')` with `y'' + 2 z w y' + w² y = q''`, in small steps of constant acceleration.
pub fn loose(moments: &[Moved], active: &[Active]) -> Vec<f64> {
    let mut load = vec![0.0; moments.len()];
    for a in active.iter().filter(|a| a.law.form == form::LOOSE) {
        let (inertia, rate, ratio) = (a.values[0], a.values[1].exp(), a.values[2].exp().min(0.9));
        let [mut y, mut dy] = [0.0; 2];
        for i in 1..moments.len() {
            let (from, to) = (&moments[i - 1], &moments[i]);
            // After a blow on a stop what swings begins anew: what it was given there is not known.
            if to.stop == Stop::Hit {
                [y, dy] = [0.0; 2];
                continue;
            }
            let lasts = to.time - from.time;
            let steps = (lasts / FINE).ceil().max(1.0);
            let (dt, gain) = (lasts / steps, (to.speed - from.speed) / lasts.max(1e-9));
            for _ in 0..steps as usize {
                dy += (gain - 2.0 * ratio * rate * dy - rate * rate * y) * dt;
                y += dy * dt;
            }
            load[i] += inertia * (rate * rate * y + 2.0 * ratio * rate * dy);
        }
    }
    load
}

/// Step in which what swings is followed, s.
const FINE: f64 = 4e-3;

/// What depends on where the joint turned back, or swings after it.
pub fn history_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let (unit, usual, per, effort) = if s.turns {
        ("rad", 0.02, "kg·m²", "N·m")
    } else {
        ("m", 2e-3, "kg", "N")
    };
    let span = (s.range[1] - s.range[0]).max(1e-6);
    let plays: Vec<f64> = [0.006, 0.015, 0.03, 0.06].iter().map(|x| x * span).collect();
    let play = |form: usize| {
        make.law(
            "backlash",
            form,
            (
                vec![Parameter {
                    high: 1.0,
                    ..Parameter::positive("share", "1", 1.0)
                }],
                vec![Parameter {
                    // More would be most of the way.
                    high: (0.25 * span).ln(),
                    ..Parameter::scale("b", unit, usual, 0.8)
                }],
            ),
            logs(&plays),
            "whenever it turns back the joint moves freely for a while before friction is felt again",
        )
    };
    let bond = make.law(
        "breakaway-bond",
        form::BOND,
        (
            vec![Parameter::positive("Fg", effort, 2.0 * s.load)],
            vec![Parameter::scale("d", unit, 0.01 * span, 0.6)],
        ),
        logs(&[0.004 * span, 0.015 * span]),
        "something holds the joint that its first motion breaks",
    );
    vec![
        bond,
        play(form::BACKLASH),
        play(form::BACKLASH_ANEW),
        make.law(
            "joint-loose-mass",
            form::LOOSE,
            (
                vec![Parameter::positive("inertia", per, 0.3 * s.load / (25.0 * s.speed))],
                vec![
                    Parameter::scale("rate", "rad/s", 25.0, 0.5),
                    Parameter {
                        high: 0.7f64.ln(),
                        ..Parameter::scale("damping_ratio", "1", 0.1, 0.8)
                    },
                ],
            ),
            [12.0f64, 18.0, 25.0, 35.0]
                .iter()
                .map(|w| vec![w.ln(), 0.1f64.ln()])
                .collect(),
            "something in the moved part follows late and swings",
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::Turning;

    /// Ways since it turned back over these places, all of one motion.
    fn motion(turning: &mut Turning, places: &[f64]) -> Vec<f64> {
        turning.begin();
        let speed = |i: usize| places[(i + 1).min(places.len() - 1)] - places[(i + 1).min(places.len() - 1) - 1];
        (0..places.len())
            .map(|i| turning.back(places[i], speed(i), false).0)
            .collect()
    }

    #[test]
    fn what_breaks_holds_until_it_has_moved() {
        let mut turning = Turning::new(0.01);
        let reached: Vec<f64> = [0.2, 0.2, 0.3, 0.25, 0.2].iter().map(|q| turning.reached(*q)).collect();
        assert!(
            reached[1] == 0.0 && reached[4] == reached[2] && reached[2] > 0.09,
            "{reached:?}"
        );
    }

    #[test]
    fn what_was_brought_unseen_goes_on_from_there() {
        let mut turning = Turning::new(0.01);
        motion(&mut turning, &[0.0, 0.1, 0.2, 0.1]);
        // Farther the same way: it turns back where it is found.
        assert!(motion(&mut turning, &[-0.3, -0.2])[1] < 0.11);
        // The other way: it turned back where it was left, and has come all that way.
        let mut turning = Turning::new(0.01);
        motion(&mut turning, &[0.0, 0.1, 0.2, 0.1]);
        assert!(motion(&mut turning, &[0.4, 0.5])[0] > 0.25);
        // By next to nothing: as if it had not been touched.
        let mut turning = Turning::new(0.01);
        motion(&mut turning, &[0.0, 0.1, 0.2, 0.1]);
        assert!(motion(&mut turning, &[0.105, 0.205])[1] > 0.09);
    }
}
