//! The law of a joint from its loads: friction, damping and spring beside the weight and inertia of what hangs on it.
//!
//! `load = (c + u_t) sign(v) + b v + k (q - q0) + s·matter(q, a)`: linear in all that is sought. The scale `s` of the
//! matter is held near 1 as well as its mass is known; a tipped hinge also gets what a centre of mass in another place
//! would add, so that a spring which the weight could feign is not called one. `u_t` is how far the friction of touch `t`
//! strays: a random effect (Laird and Ware 1982) whose spread follows from the touches, so that intervals know how many
//! there were and damping is not read from the touches' scatter. Terms are taken away, not added: a spring hides damping
//! from a fit without it.

use nalgebra::{DMatrix, DVector};

use super::joint_load::JointLoad;
use super::joint_matter::Carried;
use crate::math::{LinearFit, bayesian_linear, effective_samples, mad_sd, quantile, t_quantile};

/// The blocks of one interaction.
pub(super) struct Trial {
    pub interaction: String,
    pub loads: Vec<JointLoad>,
}

/// One number of the law.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number {
    pub value: f64,
    pub sd: f64,
    /// Half the width of the 95 % interval: wider than 1.96 sd where the touches are few.
    pub half95: f64,
}

/// What the loads of a joint say.
pub(super) struct Law {
    pub friction: Number,
    pub damping: Option<Number>,
    /// Damping that is not clear, and stays in for the friction's sake: the two are told in their sum.
    pub unclear: Option<Number>,
    pub spring: Option<Number>,
    /// Where the spring is slack.
    pub rest: Option<Number>,
    /// The speed, where there was but one.
    pub one_speed: Option<f64>,
    /// It only moved one way: what does not turn with the motion, such as weight, adds to friction.
    pub one_way: bool,
}

/// What is asked of the loads.
pub(super) struct Setting<'a> {
    pub turning: bool,
    /// The weight changes as the joint moves.
    pub tipped: bool,
    pub carried: Option<&'a Carried>,
    /// Standard deviation of the axis across itself, m; 0 for a slide.
    pub lateral: f64,
    /// Scatter of friction from trial to trial that is expected before any is seen, as a share.
    pub scatter: f64,
    /// Share of the load by which the law itself may be off.
    pub form: f64,
    /// Of what hangs on it nothing is known: its inertia is in the loads.
    pub unknown: bool,
    /// No force was ever read without a load.
    pub untared: bool,
}

/// Which terms are in, beside friction, a constant and matter.
#[derive(Clone, Copy, Default)]
struct Terms {
    damping: bool,
    spring: bool,
}

impl Terms {
    fn spring_at(self) -> usize {
        1 + usize::from(self.damping)
    }
}

/// Standard deviations of what the priors leave open, in units of a typical load.
const OPEN: f64 = 10.0;
/// The same of a constant load that nothing explains: the sensor's bias; and of a spring that is not slack at the
/// first view.
const CONSTANT: (f64, f64) = (0.02, 0.5);
/// Rounds of reweighting; the first ones with Huber's loss.
const ROUNDS: (usize, usize) = (30, 12);
/// How far a joint and a hand give way under load without anyone seeing it, m.
const GIVE: f64 = 1e-4;
/// A term is believed from this many standard deviations on.
const CLEAR: f64 = 4.0;
/// Share of blocks the other way below which it only moved one way.
const ONE_WAY: f64 = 0.03;
/// Ratio of the fast to the slow blocks from which on their speeds are held to differ.
const VARIED: f64 = 1.6;
/// The same from which on damping may show: what does not is one with friction still.
const DIFFER: f64 = 1.3;
/// How many touches the expected scatter counts for.
const PRIOR_TRIALS: f64 = 2.0;

struct Typical {
    load: f64,
    speed: f64,
    range: f64,
    /// Acceleration.
    gain: f64,
}

fn typical(trials: &[Trial]) -> Option<Typical> {
    let all = || trials.iter().flat_map(|t| &t.loads);
    let sizes = |of: fn(&JointLoad) -> f64| quantile(&all().map(|l| of(l).abs()).collect::<Vec<f64>>(), 0.5);
    let [low, high] = all().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| {
        [l.min(x.position), h.max(x.position)]
    });
    Some(Typical {
        load: sizes(|l| l.load)?.max(1e-9),
        speed: sizes(|l| l.speed)?.max(1e-9),
        range: (high - low).max(1e-6),
        gain: sizes(|l| l.acceleration)?.max(1e-9),
    })
}

/// Median load, N or N·m.
pub(super) fn typical_load(trials: &[Trial]) -> f64 {
    typical(trials).map_or(0.0, |t| t.load)
}

/// The fit of the terms to the trials; column 0 is friction, then damping and spring where they are in.
fn fit(trials: &[Trial], terms: Terms, setting: &Setting, size: &Typical) -> Option<LinearFit> {
    let loads: Vec<(usize, &JointLoad)> = trials
        .iter()
        .enumerate()
        .flat_map(|(t, trial)| trial.loads.iter().map(move |l| (t, l)))
        .collect();
    type Column<'a> = (Box<dyn Fn(&JointLoad) -> f64 + 'a>, f64, f64);
    let mut columns: Vec<Column> = vec![(Box::new(|l| l.speed.signum()), 0.0, OPEN * size.load)];
    if terms.damping {
        columns.push((Box::new(|l| l.speed), 0.0, OPEN * size.load / size.speed));
    }
    if terms.spring {
        columns.push((Box::new(|l| l.position), 0.0, OPEN * size.load / size.range));
    }
    let constant = if terms.spring { CONSTANT.1 } else { CONSTANT.0 };
    columns.push((Box::new(|_| 1.0), 0.0, constant * size.load));
    match setting.carried {
        Some(carried) => {
            columns.push((
                Box::new(|l| carried.load(l.position, l.acceleration)),
                1.0,
                carried.relative,
            ));
        }
        None if setting.tipped => columns.push((Box::new(|_| 1.0), 0.0, OPEN * size.load)),
        None => {}
    }
    if setting.unknown {
        columns.push((Box::new(|l| l.acceleration), 0.0, OPEN * size.load / size.gain));
    }
    if setting.turning && setting.tipped {
        let slack = setting.carried.map_or(OPEN * size.load, Carried::slack);
        columns.push((Box::new(|l| l.position.cos()), 0.0, slack));
        columns.push((Box::new(|l| l.position.sin()), 0.0, slack));
    }
    if setting.lateral > 0.0 {
        columns.push((Box::new(|l| l.aside[0]), 0.0, setting.lateral));
        columns.push((Box::new(|l| l.aside[1]), 0.0, setting.lateral));
    }
    let (shared, all) = (columns.len(), columns.len() + trials.len());
    let a = DMatrix::from_fn(loads.len(), all, |i, j| match (columns.get(j), loads[i]) {
        (Some(column), (_, load)) => (column.0)(load),
        (None, (t, load)) if j == shared + t => load.speed.signum(),
        _ => 0.0,
    });
    let b = DVector::from_iterator(loads.len(), loads.iter().map(|l| l.1.load));
    let of_prior = |pick: fn(&Column) -> f64| DVector::from_fn(all, |j, _| columns.get(j).map_or(0.0, pick));
    let (mean, mut sd) = (of_prior(|c| c.1), of_prior(|c| c.2.max(1e-12)));
    // One touch alone does not show how much it strays.
    let expected = setting.scatter * if trials.len() > 1 { 1.0 } else { 2.0 };
    sd.rows_mut(shared, trials.len()).fill(expected * size.load);
    let doubt = DVector::from_iterator(
        loads.len(),
        loads.iter().map(|l| GIVE * l.1.aside[0].hypot(l.1.aside[1])),
    );
    robust(&a, &b, &doubt, (&mean, &mut sd), shared, expected, size.load)
}

/// Reweighted least squares with priors. The random effects' spread follows from themselves by expectation and
/// maximisation, beside what is expected of it; the covariance allows for the memory of the residuals.
fn robust(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    doubt: &DVector<f64>,
    prior: (&DVector<f64>, &mut DVector<f64>),
    shared: usize,
    expected: f64,
    size: f64,
) -> Option<LinearFit> {
    let (mean, sd) = prior;
    let trials = a.ncols() - shared;
    let (mut noise, mut memory) = (0.1 * size, 1.0);
    let sizes = |noise: f64| doubt.map(|d| d.hypot(noise));
    let weights =
        |trust: &DVector<f64>, noise: f64, memory: f64| trust.zip_map(&sizes(noise), |w, s| w / (memory * s * s));
    let mut trust = DVector::from_element(b.len(), 1.0);
    let mut fit = bayesian_linear(a, b, &weights(&trust, noise, memory), mean, sd)?;
    for round in 0..ROUNDS.0 {
        let whitened = fit.residuals.zip_map(&sizes(noise), |r, s| r * noise / s);
        noise = mad_sd(whitened.as_slice())?.max(1e-4 * size);
        for ((w, r), s) in trust.iter_mut().zip(fit.residuals.iter()).zip(sizes(noise).iter()) {
            *w = if round < ROUNDS.1 {
                (1.345 * s / r.abs().max(1e-300)).min(1.0)
            } else {
                (1.0 - (r / (4.685 * s)).powi(2)).max(0.0).powi(2)
            };
        }
        if round >= ROUNDS.1 {
            let trusted: Vec<f64> = whitened.iter().zip(trust.iter()).map(|(r, w)| r * w.sqrt()).collect();
            memory = (b.len() as f64 / effective_samples(&trusted)).max(1.0);
            let squares: f64 = (shared..a.ncols())
                .map(|k| fit.x[k].powi(2) + fit.covariance[(k, k)])
                .sum();
            let friction = fit.x[0].abs().max(0.05 * size);
            let from_prior = PRIOR_TRIALS * (expected * friction).powi(2);
            let spread = ((squares + from_prior) / (trials as f64 + PRIOR_TRIALS)).sqrt();
            sd.rows_mut(shared, trials).fill(spread.max(1e-9 * size));
        }
        fit = bayesian_linear(a, b, &weights(&trust, noise, memory), mean, sd)?;
    }
    Some(fit)
}

/// Component `k` with its doubt: of the fit and of the law's form.
fn read(fit: &LinearFit, k: usize, natural: f64, trials: usize, setting: &Setting) -> Number {
    let fitted = fit.sd(k);
    let more = setting.form * natural;
    Number {
        value: fit.x[k],
        sd: fitted.hypot(more),
        half95: (t_quantile(0.975, trials as f64 - 1.0 + PRIOR_TRIALS) * fitted).hypot(1.96 * more),
    }
}

/// The law of the joint; `None` where the loads do not even show friction.
pub(super) fn law_of(trials: &[Trial], setting: &Setting) -> Option<Law> {
    let size = typical(trials)?;
    // Noise in the velocities is no variety: the bulk of the blocks must differ.
    let speeds: Vec<f64> = trials
        .iter()
        .flat_map(|t| t.loads.iter().map(|l| l.speed.abs()))
        .collect();
    let ahead = trials.iter().flat_map(|t| &t.loads).filter(|l| l.speed > 0.0).count();
    let others = ahead.min(speeds.len() - ahead);
    let (slow, fast) = (quantile(&speeds, 0.1)?, quantile(&speeds, 0.9)?);
    let (differ, varied) = (fast > DIFFER * slow, fast > VARIED * slow);
    let number = |f: &LinearFit, k: usize, natural: f64| read(f, k, natural, trials.len(), setting);
    let mut terms = Terms {
        damping: differ,
        spring: size.range > if setting.turning { 0.3 } else { 0.02 },
    };
    let (per_speed, per_range) = (size.load / size.speed, size.load / size.range);
    let found = loop {
        let found = fit(trials, terms, setting, &size)?;
        let clarity = |there: bool, k: usize, natural: f64| {
            let n = number(&found, k, natural);
            if there { n.value / n.sd } else { f64::INFINITY }
        };
        let damping = clarity(terms.damping, 1, per_speed);
        let spring = clarity(terms.spring, terms.spring_at(), per_range);
        if damping.min(spring) > CLEAR {
            break found;
        }
        if damping < spring {
            terms.damping = false;
        } else {
            terms.spring = false;
        }
    };
    let (mut friction, mut unclear) = (number(&found, 0, size.load), None);
    if varied && !terms.damping {
        // Damping may hide below what is clear, and would be taken for friction: it stays in for the friction's sake.
        let with = Terms { damping: true, ..terms };
        let both = fit(trials, with, setting, &size)?;
        if both.x[1] > 0.0 {
            friction = number(&both, 0, size.load);
            unclear = Some(number(&both, 1, per_speed));
        }
    }
    let spring = terms.spring.then(|| number(&found, terms.spring_at(), per_range));
    let rest = spring.filter(|_| !setting.tipped).map(|k| {
        let constant = number(&found, terms.spring_at() + 1, size.load);
        Number {
            value: -constant.value / k.value,
            sd: constant.sd / k.value,
            half95: constant.half95 / k.value,
        }
    });
    // An interval as wide as the loads themselves says nothing.
    let told = friction.value > 0.0 && friction.half95 < size.load.max(friction.value);
    told.then(|| Law {
        friction,
        damping: terms.damping.then(|| number(&found, 1, per_speed)),
        unclear,
        spring,
        rest,
        one_speed: (!varied && !terms.damping).then_some(0.5 * (slow + fast)),
        one_way: ONE_WAY * speeds.len() as f64 > others as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTING: Setting = Setting {
        turning: true,
        tipped: false,
        carried: None,
        lateral: 0.0,
        scatter: 0.015,
        form: 0.007,
        unknown: false,
        untared: false,
    };

    /// Five touches to and fro at five speeds; `stray` is how far the friction of each is off, as a share.
    fn touches(spring: f64, stray: [f64; 5], back: bool) -> Vec<Trial> {
        let of = |k: usize| {
            let speed: f64 = [0.3, 0.6, 0.9, 1.2, 1.8][k];
            let mut loads = Vec::new();
            for i in 0..40 {
                let there = i < 20;
                let position = 0.03 * f64::from(if there { i } else { 39 - i });
                let speed = if there { speed } else { -speed };
                let wobble = 2e-4 * (f64::from(i * 37 % 11) - 5.0) / 5.0;
                let load = 0.05 * (1.0 + stray[k]) * speed.signum() + 0.02 * speed + spring * position + wobble;
                loads.push(JointLoad {
                    time: 0.1 * f64::from(i),
                    load,
                    lever: 0.1,
                    aside: [0.0; 2],
                    way: nalgebra::Vector3::y(),
                    position,
                    speed,
                    speed_gain: 1.0,
                    acceleration: 0.0,
                });
            }
            loads.truncate(if back { 40 } else { 20 });
            Trial {
                interaction: format!("pull-{k}"),
                loads,
            }
        };
        (0..5).map(of).collect()
    }

    #[test]
    fn a_spring_does_not_hide_damping_and_scatter_does_not_feign_it() {
        let stray = [0.01, -0.012, 0.004, -0.006, 0.009];
        let law = law_of(&touches(0.25, stray, true), &SETTING).expect("a law");
        let (damping, spring) = (law.damping.expect("damping"), law.spring.expect("a spring"));
        for (number, truth) in [(law.friction, 0.05), (damping, 0.02), (spring, 0.25)] {
            assert!((number.value / truth - 1.0).abs() < 0.03, "{number:?} {truth}");
            assert!((number.value - truth).abs() < number.half95, "{number:?} {truth}");
        }
        assert!(law.friction.sd < 0.03 * law.friction.value, "{:?}", law.friction);
        assert!(!law.one_way && law.one_speed.is_none());
    }

    #[test]
    fn what_never_went_back_is_told_so() {
        let law = law_of(&touches(0.0, [0.0; 5], false), &SETTING).expect("a law");
        assert!(law.one_way && law.spring.is_none());
        assert!((law.damping.expect("damping").value / 0.02 - 1.0).abs() < 0.03);
    }
}
