//! What smoothing and noise make of the speed of a joint, and what they leave open of its load.

use nalgebra::{DMatrix, DVector};

use super::motion_reads::{BIN, Read};
use crate::math::robust_linear;
use crate::stages::estimation::JointLoad;

/// Share of the load that the plain model leaves open: the arm of the force, the axis.
const EVEN: f64 = 0.015;
/// Share of the change of the inertial force within the span of its smoothing that is left open.
const BLURRED: f64 = 0.15;
/// Standard deviations of an acceleration at which it counts half.
const TOLD: f64 = 3.0;
/// The same where all else that friction does is allowed for.
const BLURRED_ALONE: f64 = 0.3;
/// Share of friction up to which the change of the inertial force hides nothing of it. At 0 no start is judged so: at 1 drawers
/// of MuJoCo worlds that hold a spring or a latch had a stiction that is not there.
const QUIET: f64 = 0.0;
/// Share of a speed, by which it changes within the span of its smoothing, from which on it may as well stand.
const UNSURE: f64 = 0.2;

/// Accelerations from the neighbours' speeds, drawn to nothing where they do not stand out of the noise: what is only
/// noise there would draw an inertia that is fitted to it to nothing.
pub(super) fn gains(loads: &[JointLoad], halves: &[f64], jitter: f64) -> Vec<f64> {
    let one = |i: usize| drawn(slope(loads, halves, jitter, i));
    (0..loads.len()).map(one).collect()
}

/// Acceleration at one moment from the neighbours' speeds, and its noise.
fn slope(loads: &[JointLoad], halves: &[f64], jitter: f64, i: usize) -> [f64; 2] {
    let (a, b) = (i.saturating_sub(1), (i + 1).min(loads.len() - 1));
    let apart = (loads[b].time - loads[a].time).max(1e-6);
    let unlike = (2.0 * (1.0 - alike(apart / halves[i]))).max(0.0).sqrt();
    let gain = (loads[b].speed - loads[a].speed) / apart;
    [gain, jitter * loads[i].speed_gain * unlike / apart]
}

fn drawn([gain, noise]: [f64; 2]) -> f64 {
    if noise > 0.0 {
        gain / (1.0 + (TOLD * noise / gain.abs().max(1e-12)).powi(4))
    } else {
        gain
    }
}

/// What noise leaves open of the acceleration at one moment. What a tool leads goes steadily where no change stands out; what nothing
/// touches slows down by what holds it, however little of that stands out.
fn unsure_gain(read: &Read, i: usize) -> f64 {
    let [gain, noise] = slope(&read.loads, &read.halves, read.jitter, i);
    let taken = drawn([gain, noise]);
    if read.is_free(i) {
        noise.hypot(gain - taken)
    } else {
        noise * taken.abs() / gain.abs().max(1e-12)
    }
}

/// Correlation of two slopes of parabolas that are `apart` half spans from each other: their windows share rows.
fn alike(apart: f64) -> f64 {
    let shared = (1.0 - apart).max(-1.0);
    (0.5 * (shared.powi(3) + 1.0) + 0.75 * apart * (shared.powi(2) - 1.0)).clamp(-1.0, 1.0)
}

/// What is left open at one moment.
pub(super) struct Open {
    /// Standard deviation of the load, N·m or N.
    pub aside: f64,
    /// It may as well stand still.
    pub unsure: bool,
}

impl Open {
    /// Of the moment `i`: the arm of the force, the noise of the speed as far as the load depends on it (or it would speak
    /// against damping), and a speed that changes within the span of its own smoothing. Beside `gains`: the speed below which
    /// the direction of friction is not sure, friction, and inertia.
    pub fn at(read: &Read, gains: &[f64], i: usize, [slow, friction, inert]: [f64; 3]) -> Self {
        let l = &read.loads;
        let reach = (read.halves[i] / BIN).ceil() as usize;
        let near = i.saturating_sub(reach)..(i + reach + 1).min(l.len());
        let spread = |of: &dyn Fn(usize) -> f64| {
            let ends = near.clone().map(of);
            let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            high - low
        };
        let speed = l[i].speed.abs() + slow;
        // A smoothed speed runs ahead of a start: there the load may still be anything up to friction.
        let share = (spread(&|k| l[k].speed) / speed - 0.1).max(0.0);
        let shaken = 1.5 * read.jitter * l[i].speed_gain / speed;
        // So does what speeds it up: within the span all that it changes by, beyond noise, may be anywhere.
        let noise = 3.0 * read.jitter * l[i].speed_gain / BIN;
        let changes = inert * (spread(&|k| gains[k]) - noise).max(0.0);
        // Where inertia is of no weight, more than friction is no matter of when it set out.
        let quiet = changes < QUIET * friction;
        let unsteady = if quiet && (share > UNSURE || l[i].speed.abs() < slow) {
            BLURRED_ALONE * changes
        } else {
            friction * (2.5 * share).powi(2).min(4.0) + BLURRED * changes
        };
        Self {
            aside: (unsteady + EVEN.hypot(shaken) * l[i].load.abs()).hypot(inert * unsure_gain(read, i)),
            unsure: quiet && share > UNSURE,
        }
    }
}

/// Stretches of the way that may each have a load of their own.
const STRETCHES: usize = 12;

/// Inertia by least squares beside dry friction, a spring and a constant, or beside a load that goes with the place: the
/// larger of the two; 0 where none shows.
pub(super) fn inertia_of(reads: &[Read], slow: f64) -> f64 {
    let each = reads
        .iter()
        .flat_map(|r| r.loads.iter().zip(gains(&r.loads, &r.halves, r.jitter)));
    let moving = each.filter(|(l, gain)| l.speed.abs() > slow && gain.is_finite() && l.load.is_finite());
    let rows: Vec<(&JointLoad, f64)> = moving.collect();
    let places = || rows.iter().map(|(l, _)| l.position);
    let (low, high) = places().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
    let stretch = |q: f64| ((q - low) / (high - low).max(1e-12) * STRETCHES as f64) as usize;
    let loads = DVector::from_iterator(rows.len(), rows.iter().map(|(l, _)| l.load));
    let fitted = |width: usize, other: &dyn Fn(&JointLoad, usize) -> f64| {
        let columns = DMatrix::from_fn(rows.len(), 2 + width, |i, k| match (k, rows[i]) {
            (0, (_, gain)) => gain,
            (1, (l, _)) => l.speed.signum(),
            (_, (l, _)) => other(l, k - 2),
        });
        robust_linear(&columns, &loads).map_or(0.0, |fit| fit.x[0].max(0.0))
    };
    let straight = fitted(2, &|l, k| if k == 0 { l.position } else { 1.0 });
    let by_place = fitted(STRETCHES, &|l, k| {
        f64::from(u8::from(stretch(l.position).min(STRETCHES - 1) == k))
    });
    straight.max(by_place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(i: u32, speed: f64) -> JointLoad {
        JointLoad {
            time: BIN * f64::from(i),
            load: 1.0,
            lever: 0.4,
            aside: [0.0; 2],
            way: nalgebra::Vector3::y(),
            position: 0.0,
            speed,
            speed_gain: 8.0,
            acceleration: 0.0,
        }
    }

    #[test]
    fn an_acceleration_that_is_noise_is_none_and_a_start_is_one() {
        // Half a metre a second with noise of the track, after a start within a fifth of a second.
        let noise = |i: u32| 0.004 * (f64::from(i * 37 % 11) - 5.0) / 5.0;
        let speeds = (0..40).map(|i| 0.5 * (f64::from(i) / 5.0).min(1.0) + noise(i));
        let loads: Vec<JointLoad> = speeds.enumerate().map(|(i, v)| load(i as u32, v)).collect();
        let found = gains(&loads, &vec![0.1; loads.len()], 1e-3);
        assert!((found[2] / 2.5 - 1.0).abs() < 0.15, "{}", found[2]);
        assert!(found[8..].iter().all(|g| g.abs() < 0.02), "{:?}", &found[8..]);
        assert!((alike(0.0) - 1.0).abs() < 1e-12 && alike(2.0).abs() < 1e-12);
    }

    /// What swings on by itself slows down by its friction, though that does not stand out of the noise of its speed from one moment to
    /// the next; what is led goes steadily.
    #[test]
    fn what_coasts_may_slow_down_unseen_and_what_is_led_may_not() {
        let coasts = |felt: f64| {
            let one = |i: u32| JointLoad {
                load: felt,
                ..load(i, 1.5 - 0.04 * f64::from(i))
            };
            Read {
                interaction: "push".into(),
                held_out: false,
                loads: (0..20).map(one).collect(),
                halves: vec![0.08; 20],
                noise: 0.01,
                jitter: 0.003,
                zero: 0.0,
                by_hand: false,
            }
        };
        let (free, led) = (coasts(0.0), coasts(1.0));
        let noise = slope(&free.loads, &free.halves, free.jitter, 9)[1];
        assert!(noise > 0.4 && gains(&free.loads, &free.halves, free.jitter)[9].abs() < 0.5);
        assert!(unsure_gain(&free, 9) > noise && unsure_gain(&free, 9) < 1.5 + noise);
        assert!(
            unsure_gain(&led, 9) < 0.5 * noise,
            "{} of {noise}",
            unsure_gain(&led, 9)
        );
    }
}
