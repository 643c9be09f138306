//! Which laws are worth a full fit, by score tests, and their fits.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::evidence::{leave_one_out, paired};
use super::family::{Family, Parameter, Scatter};
use super::fit::{Fit, fit, roughly};
use super::marginal::{Noise, Point, group_state};

/// Score, nats, below which a law is not fitted.
const WORTH: f64 = 2.0;
/// How many laws are fitted in full; and of how many of the first of them the causes are so in all their forms: a form that is far from
/// its best shape where the search begins scores little.
const FITTED: usize = 12;
const LEADING: usize = 5;

/// How far the base may make room for a law before the fit, standard deviations.
const ROOM: f64 = 8.0;

/// A law with its full fit.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub law: usize,
    pub fit: Fit,
    /// Log evidence over the model without it, nats.
    pub gain: f64,
    /// Gain in foretelling left-out interactions, and its standard error, nats.
    pub foretold: (f64, f64),
    /// A number of the base was nowhere near what is known of it, or interactions scattered as none do, and with the candidate it is
    /// and they do not.
    pub relieves: bool,
}

impl Candidate {
    /// Left-out interactions are foretold better with it; or no worse, where the base feigns it with a number that cannot be what
    /// it came to: what is feigned in all of them is so in those that are left out.
    pub fn stands(&self) -> bool {
        let first = self.fit.laws.len() == 1;
        let plenty = first && self.gain > PLENTY && self.foretold.0 > (MOST_OF_IT * self.foretold.1).max(3.0);
        stands(self.foretold) || plenty || (self.relieves && self.foretold.0 > -self.foretold.1.max(1.0))
    }

    /// Standard deviations of its own parameters.
    pub fn sds(&self, family: &dyn Family) -> Vec<f64> {
        let (all, own) = (self.fit.theta.len(), family.laws()[self.law].parameters.len());
        let variance = |k| self.fit.covariance[(k, k)];
        (all - own..all).map(|k| variance(k).max(0.0).sqrt()).collect()
    }

    /// Its own parameters: the last of its fit.
    pub fn own(&self, family: &dyn Family) -> &[f64] {
        &self.fit.theta[self.fit.theta.len() - family.laws()[self.law].parameters.len()..]
    }
}

/// Gain of a first effect, nats, from which on a part of the standard error is enough: a few unlike interactions foretell each other
/// badly, whatever is true of all.
pub const PLENTY: f64 = 50.0;
const MOST_OF_IT: f64 = 0.7;

/// Whether a gain with its standard error, nats, is one.
pub fn stands(foretold: (f64, f64)) -> bool {
    foretold.0 > foretold.1.max(3.0)
}

/// A law's score and where its fit should start, best first.
pub struct Scored {
    pub law: usize,
    score: f64,
    pub starts: Vec<Vec<f64>>,
}

impl Scored {
    /// Whether a full fit may be worth it.
    pub fn worth(&self) -> bool {
        self.score > WORTH && !self.starts.is_empty()
    }
}

/// Score (Lagrange multiplier) test of every law at every point of its grid.
pub fn screen(family: &dyn Family, base: &Fit, laws: impl Iterator<Item = usize>) -> Vec<Scored> {
    let laws: Vec<usize> = laws.collect();
    let mut numbers = family.base().iter().enumerate();
    let strained = numbers.any(|(k, p)| off(base, k, p) > STRAINED);
    let grid = |law: usize| &family.laws()[law].grid;
    let each = laws.into_par_iter();
    let mut scored: Vec<Scored> = each
        .map(|law| scored_at(family, base, (law, grid(law)), strained))
        .collect();
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    scored
}

/// Score test of one law at every point of a grid.
pub fn scored_at(family: &dyn Family, base: &Fit, (law, grid): (usize, &[Vec<f64>]), strained: bool) -> Scored {
    let each = grid.iter().filter_map(|shape| score(family, base, law, shape));
    let mut points: Vec<(f64, Vec<f64>)> = each.collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Without an amplitude the base is not told to make room, and one that feigns the law cannot: it may also have to
    // start afresh.
    let anew = family.laws()[law].amplitudes == 0 || strained;
    if let Some(afresh) = points.first().filter(|_| anew).map(|p| (p.0, fresh(family, law, &p.1))) {
        points.insert(1, afresh);
    }
    Scored {
        law,
        score: points.first().map_or(0.0, |p| p.0),
        starts: points
            .into_iter()
            .take(if strained { 3 } else { 2 })
            .map(|p| p.1)
            .collect(),
    }
}

/// The start with the family's own base as it may be before any data.
fn fresh(family: &dyn Family, law: usize, start: &[f64]) -> Vec<f64> {
    let mut out = start.to_vec();
    out.iter_mut().zip(family.afresh(law)).for_each(|(x, p)| *x = p);
    out
}

/// Gain in nats of the best amplitude of a law at fixed shape, and the start that it gives; nothing where the data do
/// not feel the law.
fn score(family: &dyn Family, base: &Fit, law: usize, shape: &[f64]) -> Option<(f64, Vec<f64>)> {
    let form = &family.laws()[law];
    let (b, a) = (base.theta.len(), form.amplitudes);
    let mut theta = base.theta.clone();
    theta.extend(std::iter::repeat_n(0.0, a));
    theta.extend(shape);
    let mut laws = base.laws.clone();
    laws.push(law);
    let priors = super::fit::parameters(family, &laws);
    // A secant: some laws have no slope at zero.
    let step = |(k, p): (usize, &Parameter)| if k >= b { 0.05 * p.sd } else { 1e-4 * p.sd };
    let steps: Vec<f64> = priors.iter().enumerate().map(step).collect();
    if a == 0 {
        return Some((WORTH + 1.0, theta));
    }
    let noise = if loud(family, &base.noise) {
        quiet(family, &base.noise)
    } else {
        unscattered(family, &base.noise)
    };
    let point = Point {
        laws: &laws,
        theta: &theta,
    };
    let mut h = DMatrix::zeros(theta.len(), theta.len());
    let mut g = DVector::zeros(theta.len());
    for group in &base.groups {
        let state = group_state(family, *group, &point, &steps, &noise);
        h += state.information;
        g += state.gradient;
    }
    // The prior pulls at what the base has taken of an effect: what a parameter of the base can feign shows only there.
    for k in 0..b {
        h[(k, k)] += priors[k].sd.powi(-2);
        g[k] -= (theta[k] - priors[k].centre) / priors[k].sd.powi(2);
    }
    let hbb = Cholesky::new(h.view((0, 0), (b, b)).into_owned())?;
    let hba = h.view((0, b), (b, a)).into_owned();
    let solved = hbb.solve(&hba);
    let schur = h.view((b, b), (a, a)).into_owned() - hba.transpose() * &solved;
    let felt: f64 = (0..a)
        .map(|k| schur[(k, k)] * priors[b + k].sd.powi(2))
        .fold(0.0, f64::max);
    if felt < 1.0 {
        return None;
    }
    let rest = g.rows(b, a).into_owned() - solved.transpose() * g.rows(0, b).into_owned();
    let with_prior =
        schur + DMatrix::from_diagonal(&DVector::from_iterator(a, (0..a).map(|k| priors[b + k].sd.powi(-2))));
    let amplitude = Cholesky::new(with_prior)?.solve(&rest);
    for k in 0..a {
        theta[b + k] = amplitude[k].clamp(priors[b + k].low, priors[b + k].high);
    }
    // The base makes room, or scatter between interactions would have to.
    let room = hbb.solve(&(g.rows(0, b) - &hba * &amplitude));
    for k in 0..b {
        let p = &priors[k];
        theta[k] = (theta[k] + room[k].clamp(-ROOM * p.sd, ROOM * p.sd)).clamp(p.low, p.high);
    }
    let usable: f64 = (0..a).map(|k| theta[b + k] * rest[k]).sum();
    Some((0.5 * usable, theta))
}

/// The model without the candidate, fitted again from where the best candidates have its shared parameters: a null
/// that did not converge would make discoveries.
pub fn polished(family: &dyn Family, base: Fit, scored: &[Scored]) -> Fit {
    let mut best = base;
    for s in scored.iter().take(2) {
        let Some(start) = s.starts.first() else { continue };
        let mut laws = best.laws.clone();
        laws.push(s.law);
        let with = fit(family, &laws, start, &best.noise, &best.groups);
        let shared = &with.theta[..best.theta.len()];
        let again = fit(family, &best.laws, shared, &with.noise, &best.groups);
        if again.objective > best.objective {
            best = again;
        }
    }
    best
}

/// The plain model may have taken an effect for scatter between interactions: without that.
fn unscattered(family: &dyn Family, noise: &Noise) -> Noise {
    let mut noise = noise.clone();
    noise
        .tau
        .iter_mut()
        .zip(family.scatter())
        .for_each(|(t, s)| *t = t.min(s.tau));
    noise
}

/// Noise over that at rest, and its correlation, above which the plain model may have taken an effect for noise.
const LOUD: (f64, f64) = (1.5, 0.5);

/// Or it may have taken an effect for noise that wanders: then everything smooth looks like it, and the search starts
/// from the noise at rest.
fn quiet(family: &dyn Family, noise: &Noise) -> Noise {
    let mut noise = unscattered(family, noise);
    for (k, kind) in family.kinds().iter().enumerate() {
        noise.sigma[k] = noise.sigma[k].min(LOUD.0 * kind.sigma);
        noise.rho[k] = noise.rho[k].min(LOUD.1);
    }
    noise
}

/// Whether any kind of channel is louder than noise is at rest.
fn loud(family: &dyn Family, noise: &Noise) -> bool {
    let levels = family.kinds().iter().zip(&noise.sigma);
    levels
        .zip(&noise.rho)
        .any(|((kind, sigma), rho)| *sigma > LOUD.0 * kind.sigma && *rho > LOUD.1)
}

/// Standard deviations from what is known of it at which a number of the base cannot be what it came to, and at which it may.
const STRAINED: f64 = 4.0;
const EASY: f64 = 2.0;

/// By how many standard deviations of what is known of it a number of the base is off.
fn off(fit: &Fit, k: usize, number: &Parameter) -> f64 {
    ((fit.theta[k] - number.centre) / number.sd).abs()
}

/// How many times the scatter that was expected of interactions what is taken for it cannot be, and may be.
const TORN: f64 = 10.0;
const EVEN: f64 = 2.0;

fn relieves(family: &dyn Family, base: &Fit, with: &Fit) -> bool {
    let mut numbers = family.base().iter().enumerate();
    let torn =
        |k: usize, s: &Scatter| !s.nuisance && base.noise.tau[k] > TORN * s.tau && with.noise.tau[k] < EVEN * s.tau;
    let mut scatter = family.scatter().iter().enumerate();
    numbers.any(|(k, p)| off(base, k, p) > STRAINED && off(with, k, p) < EASY) || scatter.any(|(k, s)| torn(k, s))
}

/// What is left of such a scatter where a fault of the sensor is the reason.
const CALMED: f64 = 0.4;

/// Whether a fault of the sensor ends most of what is new in every interaction, where that is far more than it is of a sound one: no
/// form of another effect makes interactions differ so.
pub fn calms(family: &dyn Family, law: usize, [without, with]: [&Fit; 2]) -> bool {
    let mut scatter = family.scatter().iter().enumerate();
    let taus = |k: usize| [without, with].map(|f| f.noise.tau[k]);
    family.laws()[law].place == "sensor" && scatter.any(|(k, s)| s.nuisance && calmed(taus(k), s.tau))
}

/// Whether a scatter that was far more than usual is mostly gone.
fn calmed([before, after]: [f64; 2], usual: f64) -> bool {
    before > TORN * usual && after < CALMED * before
}

/// Full fits of the laws that are worth one, and how well they foretell what is left out.
pub fn fitted(family: &dyn Family, base: &Fit, scored: &[Scored]) -> Vec<Candidate> {
    let before = leave_one_out(family, base);
    let mut levels = vec![unscattered(family, &base.noise)];
    if loud(family, &base.noise) {
        levels.push(quiet(family, &base.noise));
    }
    let mut kept: Vec<&Scored> = scored.iter().filter(|s| s.worth()).collect();
    // What has no amplitude has no score that could place it behind others.
    let law = |s: &Scored| &family.laws()[s.law];
    let leading: Vec<&str> = kept.iter().take(LEADING).map(|s| law(s).cause).collect();
    let mut place = 0..;
    let tried = |s: &&Scored| law(s).amplitudes == 0 || leading.contains(&law(s).cause);
    kept.retain(|s| place.next() < Some(FITTED) || tried(s));
    kept.par_iter()
        .map(|s| {
            let mut laws = base.laws.clone();
            laws.push(s.law);
            let tries = s.starts.iter().flat_map(|start| {
                levels
                    .iter()
                    .map(|noise| roughly(family, &laws, start, noise, &base.groups))
            });
            let best = tries.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
            let best = best.map(|f| fit(family, &laws, &f.theta, &f.noise, &base.groups));
            best.map(|fit| Candidate {
                law: s.law,
                gain: fit.log_evidence - base.log_evidence,
                foretold: paired(&leave_one_out(family, &fit), &before),
                relieves: relieves(family, base, &fit),
                fit,
            })
        })
        .collect::<Option<Vec<_>>>()
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::toy::Toy;
    use super::*;

    #[test]
    fn what_ends_a_scatter_that_nothing_has_relieves() {
        let toy = Toy::new(&[(2, 0.4)], 9);
        let groups: Vec<usize> = (0..Toy::FITTED).collect();
        let plain = fit(&toy, &[], &[1.0], &Noise::start(&toy), &groups);
        let with = fit(&toy, &[2], &[1.0, 0.1], &Noise::start(&toy), &groups);
        assert!(!relieves(&toy, &plain, &with));
        let expected = toy.scatter()[0].tau;
        let mut torn = plain.clone();
        torn.noise.tau[0] = 1.5 * TORN * expected;
        assert!(relieves(&toy, &torn, &with));
        // What leaves half of it does not.
        let mut left = with.clone();
        left.noise.tau[0] = 1.5 * EVEN * expected;
        assert!(!relieves(&toy, &torn, &left));
    }

    #[test]
    fn only_what_was_torn_and_is_mostly_gone_is_calmed() {
        assert!(calmed([2.0 * TORN, 0.5 * CALMED * 2.0 * TORN], 1.0));
        assert!(!calmed([2.0 * TORN, 1.5 * CALMED * 2.0 * TORN], 1.0));
        assert!(!calmed([0.5 * TORN, 0.0], 1.0));
    }

    #[test]
    fn what_is_no_sensor_calms_nothing() {
        let toy = Toy::new(&[(2, 0.4)], 9);
        let groups: Vec<usize> = (0..Toy::FITTED).collect();
        let after = fit(&toy, &[], &[1.0], &Noise::start(&toy), &groups);
        let mut before = after.clone();
        for (tau, scatter) in before.noise.tau.iter_mut().zip(toy.scatter()) {
            *tau = 2.0 * TORN * scatter.tau;
        }
        // None of its laws is of a sensor.
        assert!((0..toy.laws().len()).all(|law| !calms(&toy, law, [&before, &after])));
    }
}
