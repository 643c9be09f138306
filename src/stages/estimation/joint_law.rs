//! The law of a joint from its loads: friction, damping and spring beside the weight and inertia of what hangs on it.
//!
//! `load = c sign(v) + b v + k (q - q0) + s·matter(q, a)`: linear in all that is sought. The scale `s` of the matter is
//! held near 1 as well as its mass is known; a tipped hinge also gets what a centre of mass in another place would add,
//! so that a spring which the weight could feign is not called one.

use nalgebra::{DMatrix, DVector};

use super::joint_load::JointLoad;
use super::joint_matter::Carried;
use crate::math::{LinearFit, bayesian_linear, effective_samples, mad_sd, quantile};

/// The blocks of one interaction.
pub(super) struct Trial {
    pub interaction: String,
    pub loads: Vec<JointLoad>,
    /// Relative standard deviation of the force's jerking.
    pub chatter: f64,
}

/// What the loads of a joint say: values with standard deviations.
pub(super) struct Law {
    pub friction: (f64, f64),
    pub damping: Option<(f64, f64)>,
    pub spring: Option<(f64, f64)>,
    /// Where the spring is slack.
    pub rest: Option<(f64, f64)>,
    /// The speed, where there was but one.
    pub one_speed: Option<f64>,
}

/// What is asked of the loads.
pub(super) struct Setting<'a> {
    pub turning: bool,
    /// The weight changes as the joint moves.
    pub tipped: bool,
    pub carried: Option<&'a Carried>,
    /// Share by which axis and origin put the load in doubt.
    pub geometry: f64,
    /// Scatter of friction from trial to trial that is expected before any is seen, as a share.
    pub scatter: f64,
}

/// Which terms are in, beside friction, a constant and matter.
#[derive(Clone, Copy, Default)]
struct Terms {
    damping: bool,
    spring: bool,
}

/// Standard deviations of what the priors leave open, in units of a typical load.
const OPEN: f64 = 10.0;
/// The same of a constant load that nothing explains: the sensor's bias; and of a spring that is not slack at the
/// first view.
const CONSTANT: (f64, f64) = (0.02, 0.5);
/// Rounds of reweighting; the first ones with Huber's loss.
const ROUNDS: (usize, usize) = (30, 12);
/// A term is believed from this many standard deviations on.
const CLEAR: f64 = 4.0;

struct Typical {
    load: f64,
    speed: f64,
    range: f64,
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
    })
}

/// The fit of the terms to the trials; column 0 is friction, then damping and spring where they are in.
fn fit(trials: &[&Trial], terms: Terms, setting: &Setting, size: &Typical) -> Option<LinearFit> {
    let loads: Vec<&JointLoad> = trials.iter().flat_map(|t| &t.loads).collect();
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
    if setting.turning && setting.tipped {
        let slack = setting.carried.map_or(OPEN * size.load, Carried::slack);
        columns.push((Box::new(|l| l.position.cos()), 0.0, slack));
        columns.push((Box::new(|l| l.position.sin()), 0.0, slack));
    }
    let a = DMatrix::from_fn(loads.len(), columns.len(), |i, j| (columns[j].0)(loads[i]));
    let b = DVector::from_iterator(loads.len(), loads.iter().map(|l| l.load));
    let mean = DVector::from_iterator(columns.len(), columns.iter().map(|c| c.1));
    let sd = DVector::from_iterator(columns.len(), columns.iter().map(|c| c.2.max(1e-12)));
    robust(&a, &b, (&mean, &sd), size.load)
}

/// Reweighted least squares with priors; the covariance allows for the memory of the residuals.
fn robust(a: &DMatrix<f64>, b: &DVector<f64>, prior: (&DVector<f64>, &DVector<f64>), size: f64) -> Option<LinearFit> {
    let mut noise = 0.1 * size;
    let mut trust = DVector::from_element(b.len(), 1.0);
    let mut fit = bayesian_linear(a, b, &(&trust / noise.powi(2)), prior.0, prior.1)?;
    for round in 0..ROUNDS.0 {
        noise = mad_sd(fit.residuals.as_slice())?.max(1e-4 * size);
        for (w, r) in trust.iter_mut().zip(fit.residuals.iter()) {
            *w = if round < ROUNDS.1 {
                (1.345 * noise / r.abs().max(1e-300)).min(1.0)
            } else {
                (1.0 - (r / (4.685 * noise)).powi(2)).max(0.0).powi(2)
            };
        }
        fit = bayesian_linear(a, b, &(&trust / noise.powi(2)), prior.0, prior.1)?;
    }
    let memory = (b.len() as f64 / effective_samples(fit.residuals.as_slice())).max(1.0);
    let x = fit.x.clone();
    let spread = bayesian_linear(a, b, &(&trust / (memory * noise.powi(2))), prior.0, prior.1)?;
    Some(LinearFit { x, ..spread })
}

/// Standard deviation of component `k`, with what leaving out one trial at a time does to it: blocks of one trial
/// share its errors.
fn doubt(trials: &[Trial], whole: &LinearFit, k: usize, terms: Terms, setting: &Setting, size: &Typical) -> f64 {
    let n = trials.len() as f64;
    let spread: f64 = (0..trials.len())
        .filter(|_| trials.len() > 1)
        .filter_map(|out| {
            let rest: Vec<&Trial> = (0..trials.len()).filter(|i| *i != out).map(|i| &trials[i]).collect();
            Some((fit(&rest, terms, setting, size)?.x[k] - whole.x[k]).powi(2))
        })
        .sum();
    let scatter = ((n - 1.0) / n * spread).sqrt();
    // Few trials may agree by chance: the expected scatter is the least; one trial alone shows none.
    let unseen = if trials.len() > 1 { 1.0 } else { 2.0 };
    let repeat = if k == 0 {
        unseen * setting.scatter / n.sqrt()
    } else {
        0.0
    };
    let least = repeat * whole.x[k].abs();
    whole
        .sd(k)
        .hypot(scatter.max(least))
        .hypot(setting.geometry * whole.x[k])
}

/// The law of the joint; `None` where the loads do not even show friction.
pub(super) fn law_of(trials: &[Trial], setting: &Setting) -> Option<Law> {
    let size = typical(trials)?;
    let all: Vec<&Trial> = trials.iter().collect();
    // Noise in the velocities is no variety: the bulk of the blocks must differ.
    let speeds: Vec<f64> = all.iter().flat_map(|t| t.loads.iter().map(|l| l.speed.abs())).collect();
    let (slow, fast) = (quantile(&speeds, 0.1)?, quantile(&speeds, 0.9)?);
    let varied = fast > 1.6 * slow;
    let clear = |terms: Terms, k: usize| {
        let found = fit(&all, terms, setting, &size);
        found.is_some_and(|f| f.x[k] > CLEAR * doubt(trials, &f, k, terms, setting, &size))
    };
    let wide = size.range > if setting.turning { 0.3 } else { 0.02 };
    let mut terms = Terms {
        damping: varied,
        spring: wide,
    };
    terms.damping = varied && clear(terms, 1);
    terms.spring = wide && clear(terms, 1 + usize::from(terms.damping));
    terms.damping = terms.damping && clear(terms, 1);
    let found = fit(&all, terms, setting, &size)?;
    let read = |k: usize| (found.x[k], doubt(trials, &found, k, terms, setting, &size));
    let mut friction = read(0);
    if varied && !terms.damping {
        // Damping may hide below what was seen: its doubt is that of friction too.
        let with = Terms { damping: true, ..terms };
        let both = fit(&all, with, setting, &size)?;
        friction.1 = friction.1.hypot(both.sd(0)).hypot(0.5 * (both.x[0] - friction.0));
    }
    let chatter = trials.iter().map(|t| t.chatter).sum::<f64>() / trials.len() as f64;
    friction.1 = friction.1.hypot(0.25 * chatter * friction.0);
    let at = 1 + usize::from(terms.damping);
    let spring = terms.spring.then(|| read(at));
    let rest = spring.filter(|_| !setting.tipped).map(|(k, _)| {
        let constant = read(at + 1);
        (-constant.0 / k, constant.1 / k)
    });
    (friction.0 > 0.0).then(|| Law {
        friction,
        damping: terms.damping.then(|| read(1)),
        spring,
        rest,
        one_speed: (!varied).then_some(0.5 * (slow + fast)),
    })
}
