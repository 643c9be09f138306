//! A force sensor that lags: the body slides already while what is read still rises, by the same time in every push.
//!
//! What the finger exerts rises evenly until the body slides, and then stays; that, seen through one pole or two equal ones, is
//! laid beside what is read. Friction that comes up over a way, a soft finger and clocks that run apart are fitted beside it, push by push, and
//! it has to be better than either.

use nalgebra::{DVector, Vector3};

use super::bristles::Bristles;
use super::clocks::worth_a_word;
use super::joint_lag::lag_of_joints;
use super::onset::{Onset, Reading};
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Kind, Segmented};
use crate::math::{Settings, levenberg_marquardt, mad_sd, quantile, random_effects};
use crate::twin::{Finding, Gain, Model};

/// Fewest pushes, standard deviations, and the least lag, s: what a tip that rings leaves seems up to 12 ms.
const FEWEST: usize = 2;
const CLEAR: f64 = 6.0;
const LEAST: f64 = 15.5e-3;
/// The longest: what comes up more slowly than that goes with something else, as with the speed.
const LONGEST: f64 = 0.2;
/// Log evidence over what is like it.
const BETTER: f64 = 8.0;
/// Scatter from push to push, as a share.
const SCATTER: f64 = 0.15;
/// What of the sliding force the model of a rise leaves, as a share, and what is known of its level.
const ROUGH: f64 = 0.02;
const LEVEL: f64 = 0.05;
/// Half the mean square of what a fit may leave, in standard deviations.
const MISFIT: f64 = 2.0;
/// Lags that the rise has to be followed for.
const FOLLOWED: f64 = 4.0;
/// By how much the lag of some number of poles may pass for that of one or two, as a share, and the rise of the force for a part of it, s.
const FORM: (f64, f64) = (0.2, 3e-3);
/// Weight of what is known of a size beforehand, nearly nothing: in 1/10 ms, 1/mm, or of a power.
const FREE: f64 = 0.03;
/// Fewest readings of a rise.
const READINGS: usize = 10;
/// Half of the window over which the lag is undone, as a share of one pole's time.
const WINDOW: f64 = 0.25;

/// What is read of a finger.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Read {
    /// Through so many equal poles.
    Lagging(u8),
    /// As it is, but by another clock.
    Late,
    /// As it is; friction comes up over a way.
    Presliding,
    /// As it is, of a finger whose force grows as a power of its squeeze.
    Soft,
}

/// The lag of a capture's force sensor.
#[derive(Clone, Debug)]
pub struct SensorLag {
    /// Sum over the poles, s, with its standard deviation.
    pub seconds: (f64, f64),
    pub(super) poles: u8,
    /// How probable it is that clocks run apart instead.
    pub(super) late: f64,
    pub(super) from: Vec<String>,
    pub(super) gain: Gain,
}

/// A unit ramp from time 0 on, through so many poles of `lag` seconds in all.
pub(super) fn ramp(u: f64, lag: f64, poles: u8) -> f64 {
    if u <= 0.0 {
        return 0.0;
    }
    let lag = lag.max(1e-6);
    if poles == 1 {
        return u - lag * (1.0 - (-u / lag).exp());
    }
    let a = 0.5 * lag;
    u - 2.0 * a + (2.0 * a + u) * (-u / a).exp()
}

/// One push, so read.
struct Fitted<'a> {
    push: &'a Onset,
    /// Its lag, s, its delay, s, or the way of presliding, m.
    size: (f64, f64),
    cost: f64,
    /// Sums of squares of what is left without a lag, all else the same, and with it, N², over so many readings.
    squares: [f64; 2],
    count: usize,
}

/// What was exerted rises over `rise` seconds until the body slides at `slips`, and stays.
fn exerted(read: Read, row: &Reading, (slips, rise): (f64, f64), size: f64) -> f64 {
    let since = row.time - slips;
    match read {
        Read::Lagging(poles) => (ramp(since + rise, size, poles) - ramp(since, size, poles)) / rise,
        Read::Late => ((since - size + rise) / rise).clamp(0.0, 1.0),
        Read::Soft => (1.0 + since / rise).clamp(0.0, 1.0).powf(1.0 + size.min(4.0)),
        Read::Presliding => (row.way / size.max(1e-7)).clamp(0.0, 1.0),
    }
}

/// One push with a size of its own, or with the one that is given.
fn fit(push: &Onset, read: Read, given: Option<f64>) -> Option<Fitted<'_>> {
    let rows: Vec<&Reading> = push.rise.iter().filter(|r| r.force.is_finite()).collect();
    if rows.len() < READINGS {
        return None;
    }
    let doubt = push.noise.hypot(ROUGH * push.level);
    let unit = match read {
        Read::Presliding => 1e-3,
        Read::Soft => 1.0,
        _ => 1e-2,
    };
    // Size, log rise, shift of the moment at which it slides, and of the level, the latter two in their standard deviations.
    let of = |x: &DVector<f64>| {
        let own = if read == Read::Late { x[0] } else { x[0].abs() } * unit;
        let rise = x[1].exp().clamp(1e-3, 0.5);
        (
            given.unwrap_or(own),
            (push.slips.0 + x[2] * push.slips.1, rise),
            push.level * (1.0 + LEVEL * x[3]),
        )
    };
    let beside = |x: &DVector<f64>, read: Read, size: f64| -> Vec<f64> {
        let (_, when, level) = of(x);
        rows.iter()
            .map(|r| r.force - level * exerted(read, r, when, size))
            .collect()
    };
    let left = |x: &DVector<f64>| beside(x, read, of(x).0);
    let residuals = |x: &DVector<f64>| {
        // What has no say in the end is kept in reach.
        let fixed = if given.is_some() { x[0] } else { FREE * x[0] };
        let priors = [x[2], x[3], (x[1] - 0.01_f64.ln()) / 1.5, fixed];
        DVector::from_iterator(rows.len() + 4, left(x).into_iter().map(|l| l / doubt).chain(priors))
    };
    let steps = DVector::from_element(4, 1e-3);
    let starts = [0.3, 3.0].map(|size| DVector::from_vec(vec![size, 0.01_f64.ln(), 0.0, 0.0]));
    let fits = starts.map(|start| levenberg_marquardt(&start, &steps, Settings::default(), residuals));
    let best = fits.into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    Some(Fitted {
        push,
        size: (of(&best.x).0, best.sd(0) * unit),
        cost: best.cost,
        squares: [beside(&best.x, Read::Late, 0.0), left(&best.x)].map(|l| l.iter().map(|l| l * l).sum()),
        count: rows.len(),
    })
}

/// By how much the second fits these pushes worse.
fn worse(than: &[Fitted], other: &[Fitted]) -> f64 {
    let own = |f: &Fitted| other.iter().find(|o| o.push.interaction == f.push.interaction);
    than.iter().filter_map(|f| Some(own(f)?.cost - f.cost)).sum()
}

/// What pushes that were fitted say by one way of reading them.
fn by(all: &[Onset], read: Read) -> Vec<Fitted<'_>> {
    let fitted = all.iter().filter(|o| !o.held_out);
    fitted.filter_map(|push| fit(push, read, None)).collect()
}

/// The pushes that tell a lag: by how many poles, what each says, and what is typical of them, s.
fn telling(all: &[Onset]) -> Option<(u8, Vec<Fitted<'_>>, f64)> {
    // A rise that goes neither way, as that of a tip that rings, tells no lag.
    let telling = |f: &Fitted| f.cost < MISFIT * f.push.rise.len() as f64;
    let [one, two] = [1, 2].map(|poles| {
        by(all, Read::Lagging(poles))
            .into_iter()
            .filter(telling)
            .collect::<Vec<Fitted>>()
    });
    // A push that was over before what is read had come up makes it seem shorter, and does not tell it.
    let typical = quantile(&two.iter().map(|f| f.size.0).collect::<Vec<f64>>(), 0.75)?;
    let [one, two] = [one, two].map(|all| {
        let long = |f: &Fitted| f.push.followed() > FOLLOWED * typical;
        all.into_iter().filter(long).collect::<Vec<Fitted>>()
    });
    let (poles, told) = if worse(&one, &two) < 0.0 { (2, two) } else { (1, one) };
    (told.len() >= FEWEST).then_some((poles, told, typical))
}

/// Whether enough pushes rise so that a lag of the sensor would show.
pub fn tells_lag(all: &[Onset]) -> bool {
    telling(all).is_some()
}

/// The lag of a capture's force sensor, as pushes tell it, or motions of joints, or hands that turn back.
pub fn lag_of_all(
    (capture, segmented, model): (&Capture, &[Segmented], &Model),
    begun: &[Onset],
    turned: &Option<Bristles>,
) -> Option<SensorLag> {
    let of_joints = || lag_of_joints(capture, segmented, model);
    let of_hands = || turned.as_ref().and_then(Bristles::lag);
    lag_of(begun).or_else(of_joints).or_else(of_hands)
}

/// The lag that all pushes share; nothing where it is not clear.
pub fn lag_of(all: &[Onset]) -> Option<SensorLag> {
    let (poles, told, typical) = telling(all)?;
    let (values, sds): (Vec<f64>, Vec<f64>) = told.iter().map(|f| f.size).unzip();
    let pooled = random_effects(&values, &sds, SCATTER * typical)?;
    let like_it = [Read::Late, Read::Presliding, Read::Soft].map(|read| worse(&told, &by(all, read)));
    let better = like_it.into_iter().fold(f64::INFINITY, f64::min);
    // Within one reading nothing comes up.
    let steps: Vec<f64> = all.iter().map(|o| o.step).collect();
    let least = LEAST.max(quantile(&steps, 0.5)?);
    if !(least..LONGEST).contains(&pooled.mean) || pooled.mean < CLEAR * pooled.sd || better < BETTER {
        return None;
    }
    let held = all.iter().filter(|o| o.held_out).map(|o| o.interaction.clone());
    let errors = errors(&judges(all), pooled.mean, poles);
    Some(SensorLag {
        seconds: (pooled.mean, pooled.sd),
        poles,
        late: 0.0,
        from: told.iter().map(|f| f.push.interaction.clone()).collect(),
        gain: gain("force", "N", errors, held.collect()),
    })
}

/// Pushes that were held out; all of them where none was.
fn judges(all: &[Onset]) -> Vec<&Onset> {
    let held: Vec<&Onset> = all.iter().filter(|o| o.held_out).collect();
    if held.is_empty() { all.iter().collect() } else { held }
}

/// Error at the beginning of these pushes without the lag, s, and with it, N.
fn errors(judges: &[&Onset], seconds: f64, poles: u8) -> [f64; 2] {
    let read = Read::Lagging(poles);
    let each: Vec<Fitted> = judges.iter().filter_map(|o| fit(o, read, Some(seconds))).collect();
    let count = each.iter().map(|f| f.count).sum::<usize>().max(1) as f64;
    [0, 1].map(|k| (each.iter().map(|f| f.squares[k]).sum::<f64>() / count).sqrt())
}

impl SensorLag {
    /// As `diagnosis.json` says it.
    pub fn finding(&self) -> Finding {
        let (seconds, sd) = self.seconds;
        let method = "rise of what is read while the body slides already";
        let told = Told {
            cause: "sensor-lag",
            place: "force",
            probability: 0.95 * (1.0 - self.late),
            rivals: &[("time-delay", worth_a_word(self.late))],
            parameter: (
                "Tf",
                Estimate::measured(
                    seconds,
                    sd.hypot(FORM.0 * seconds).hypot(FORM.1),
                    "s",
                    self.from.clone(),
                    method,
                ),
            ),
            residual: "beginning",
            statistic: seconds / sd,
            words: format!(
                "what is read of the force comes up {:.0} ms after what is moved goes, every time, however fast",
                1e3 * seconds
            ),
            gain: self.gain.clone(),
        };
        told.finding()
    }

    /// The capture with what a finger exerted in pushes and pulls, as far as what was read tells it.
    pub fn undone(&self, capture: &Capture) -> Capture {
        let mut out = capture.clone();
        let lag = self.seconds.0 / f64::from(self.poles);
        let mut louder = 1.0_f64;
        for interaction in &mut out.interactions {
            let moved = matches!(interaction.kind, Kind::Push | Kind::Pull);
            let Some(force) = interaction.force.as_mut().filter(|_| moved) else {
                continue;
            };
            for _ in 0..self.poles {
                let before = scatter(&force.force);
                force.force = sharpened(&force.time, &force.force, lag);
                louder = louder.max(scatter(&force.force) / before.max(1e-9));
            }
        }
        // Neighbours share their noise now: a mean of many is hardly better than one of them.
        let correlated = |noise: f64| noise * louder * f64::from(self.poles) * 4.0;
        out.noise.force = out.noise.force.map(correlated);
        out
    }
}

/// Scatter from reading to reading, N.
fn scatter(force: &[Vector3<f64>]) -> f64 {
    let steps: Vec<f64> = force
        .windows(2)
        .map(|w| w[1].x - w[0].x)
        .filter(|d| d.is_finite())
        .collect();
    mad_sd(&steps).unwrap_or(0.0)
}

/// `F + lag dF/dt` over a window about each reading.
fn sharpened(time: &[f64], force: &[Vector3<f64>], lag: f64) -> Vec<Vector3<f64>> {
    let half = WINDOW * lag;
    let one = |i: usize| {
        let (from, to) = (
            time.partition_point(|t| *t < time[i] - half),
            time.partition_point(|t| *t <= time[i] + half),
        );
        let near: Vec<usize> = (from..to).filter(|k| force[*k].iter().all(|x| x.is_finite())).collect();
        let n = near.len() as f64;
        if near.len() < 3 || !force[i].iter().all(|x| x.is_finite()) {
            return force[i];
        }
        let middle = near.iter().map(|k| time[*k]).sum::<f64>() / n;
        let mean = near.iter().map(|k| force[*k]).sum::<Vector3<f64>>() / n;
        let squares: f64 = near.iter().map(|k| (time[*k] - middle).powi(2)).sum();
        let slope = near
            .iter()
            .map(|k| force[*k] * (time[*k] - middle))
            .sum::<Vector3<f64>>()
            / squares.max(1e-12);
        mean + slope * (time[i] - middle + lag)
    };
    (0..time.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A push that slides from 0 s on, of which what is read rises through one pole of `lag` seconds, if at all.
    fn push(name: &str, lag: f64) -> Onset {
        let mut out = Onset::told(name, false, 0.02, (0.0, 1e-4));
        let row = |k: i32| {
            let time = 0.002 * f64::from(k);
            let whole = ramp(time + 0.02, lag, 1) - ramp(time, lag, 1);
            Reading {
                time,
                way: 0.02 * time,
                force: whole / 0.02 + 0.005 * f64::from(k * 7 % 5 - 2),
            }
        };
        (out.rise, out.noise, out.slips) = ((-40..300).map(row).collect(), 0.01, (0.0, 2e-3));
        out
    }

    #[test]
    fn a_lag_is_told_beside_every_rival() {
        let pushes: Vec<Onset> = ["a", "b", "c"].map(|name| push(name, 0.06)).into();
        // A rival of which the fit failed would count as one that does as well.
        for read in [Read::Late, Read::Presliding, Read::Soft] {
            assert!(fit(&pushes[0], read, None).is_some(), "{read:?}");
        }
        let lag = lag_of(&pushes).expect("a lag");
        assert!((lag.seconds.0 - 0.06).abs() < 0.004, "{:?}", lag.seconds);
        let pushes: Vec<Onset> = ["a", "b", "c"].map(|name| push(name, 1e-4)).into();
        assert!(lag_of(&pushes).is_none());
    }
}
