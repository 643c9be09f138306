//! Which law the data ask for: score tests, full fits, evidence with a veto of left-out interactions, one effect after
//! the other.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::Config;
use super::alike::may_be_form;
use super::evidence::{leave_one_out, paired};
use super::family::Family;
use super::fit::{Fit, fit};
use super::marginal::{Noise, Point, group_state};

/// Log evidence over the plain model, nats, from which on a cause is named, unless a family knows better; and beside others.
pub const NAMED: f64 = 8.0;
/// Causes this close to the best cannot be ruled out, nats.
const RIVAL: f64 = 5.0;
/// Score, nats, below which a law is not fitted.
const WORTH: f64 = 2.0;
/// What the amplitudes of a cause must be worth by themselves to be named, nats: two standard deviations.
const SEEN: f64 = 2.0;
/// A null that a candidate's parameters make better by this had not converged, nats.
const SLIP: f64 = 0.3;
/// How many laws are fitted in full.
const FITTED: usize = 12;
/// At most this many effects are taken up.
const EFFECTS: usize = 3;

/// A law with its full fit.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub law: usize,
    pub fit: Fit,
    /// Log evidence over the model without it, nats.
    pub gain: f64,
    /// Gain in foretelling left-out interactions, and its standard error, nats.
    pub foretold: (f64, f64),
}

impl Candidate {
    fn stands(&self) -> bool {
        self.foretold.0 > self.foretold.1.max(3.0)
    }
}

/// One effect that was taken up.
#[derive(Clone, Debug)]
pub struct Taken {
    pub law: usize,
    /// Log evidence over the model without it, nats.
    pub gain: f64,
    /// Other laws that do nearly as well in its place, with their own gain.
    pub rivals: Vec<(usize, f64)>,
}

/// What became of one kind of experiment.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// The plain model.
    pub plain: Fit,
    /// The model with all effects that were taken up.
    pub full: Fit,
    /// The effects, in order.
    pub taken: Vec<Taken>,
    /// Laws of which these data say nothing.
    pub untestable: Vec<usize>,
    /// Every law that was fitted beside the plain model, with the objective of its fit.
    pub tried: Vec<(usize, f64)>,
}

impl Ladder {
    /// Effect size of every law that was fitted: `sqrt(2 (ll − ll of the plain model))`, what a likelihood-ratio test that
    /// knows the law sees.
    pub fn effect_sizes(&self) -> impl Iterator<Item = (usize, f64)> {
        let base = self.plain.objective;
        self.tried
            .iter()
            .map(move |(law, o)| (*law, (2.0 * (o - base)).max(0.0).sqrt()))
    }
}

/// Fits the plain model and takes up effects while the data ask for them.
///
/// With the threshold none of 24 clean captures of MuJoCo worlds, on seeds not used for tuning, got a name.
pub fn climb(family: &dyn Family, config: &Config) -> Option<Ladder> {
    let groups: Vec<usize> = (0..family.groups().len())
        .filter(|g| !family.groups()[*g].held_out)
        .collect();
    if groups.is_empty() {
        return None;
    }
    let allowed = |l: &usize| config.allows(family.laws()[*l].cause);
    let all: Vec<usize> = (0..family.laws().len()).filter(allowed).collect();
    let mut plain = started(family, &groups)?;
    let mut full = plain.clone();
    let mut taken: Vec<Taken> = Vec::new();
    let mut untestable = Vec::new();
    let mut tried = Vec::new();
    let mut rounds = 0;
    while taken.len() < EFFECTS {
        let on: Vec<usize> = taken.iter().map(|t| t.law).collect();
        let causes: Vec<&str> = on.iter().map(|l| family.laws()[*l].cause).collect();
        let open = |l: &&usize| !causes.contains(&family.laws()[**l].cause);
        let scored = screen(family, &full, all.iter().filter(open).copied());
        if taken.is_empty() {
            untestable = scored.iter().filter(|s| s.starts.is_empty()).map(|s| s.law).collect();
        }
        full = polished(family, full, &scored);
        if taken.is_empty() {
            plain = full.clone();
        }
        let mut found = fitted(family, &full, &scored);
        // A candidate's own parameters are the last of its fit.
        let own = |c: &Candidate| c.fit.theta[c.fit.theta.len() - family.laws()[c.law].parameters.len()..].to_vec();
        if taken.is_empty() {
            tried = found.iter().map(|c| (c.law, c.fit.objective)).collect();
        }
        found.retain(|c| !family.negligible(c.law, &own(c)));
        let cause = |law: usize| family.laws()[law].cause;
        let rank = |c: &Candidate| c.gain + family.head_start(c.law);
        found.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
        let Some(best) = found
            .iter()
            .find(|c| c.stands() && !may_be_form(cause(c.law), c.gain, taken.iter().map(|t| (cause(t.law), t.gain))))
            .cloned()
        else {
            break;
        };
        let least = if taken.is_empty() {
            family.named_from(best.law)
        } else {
            NAMED
        };
        if best.gain < least || significance(family, &best) < SEEN {
            break;
        }
        // A null that had not converged would make discoveries: the candidate's shared parameters may be nearer.
        let shared = &best.fit.theta[..full.theta.len()];
        let again = fit(family, &full.laws, shared, &best.fit.noise, &full.groups);
        if rounds < EFFECTS && again.objective > full.objective + SLIP {
            rounds += 1;
            full = again;
            continue;
        }
        let near = |c: &&Candidate| c.law != best.law && c.gain > best.gain - RIVAL;
        let rivals = found.iter().filter(near).map(|c| (c.law, c.gain)).collect();
        taken.push(Taken {
            law: best.law,
            gain: best.gain,
            rivals,
        });
        full = best.fit;
    }
    let (full, taken) = backward(family, &plain, full, taken);
    Some(Ladder {
        plain,
        full,
        taken,
        untestable,
        tried,
    })
}

/// The plain model, fitted from two levels of scatter.
fn started(family: &dyn Family, groups: &[usize]) -> Option<Fit> {
    let centre: Vec<f64> = family.base().iter().map(|p| p.centre).collect();
    let noise = Noise::start(family);
    let mut tight = noise.clone();
    tight.tau.iter_mut().for_each(|t| *t *= 0.3);
    let starts = [
        fit(family, &[], &centre, &noise, groups),
        fit(family, &[], &centre, &tight, groups),
    ];
    starts.into_iter().max_by(|a, b| a.objective.total_cmp(&b.objective))
}

/// Half the squared amplitudes of a candidate over their covariance at its shape, nats: what they alone can be worth.
/// A law without amplitudes is not judged by them.
fn significance(family: &dyn Family, candidate: &Candidate) -> f64 {
    let law = &family.laws()[candidate.law];
    let (own, a) = (law.parameters.len(), law.amplitudes);
    if a == 0 {
        return f64::INFINITY;
    }
    let first = candidate.fit.theta.len() - own;
    let block = candidate.fit.covariance.view((first, first), (own, own)).into_owned();
    let Some(precision) = Cholesky::new(block).map(|c| c.inverse()) else {
        return f64::INFINITY;
    };
    let amplitude = DVector::from_column_slice(&candidate.fit.theta[first..first + a]);
    0.5 * amplitude.dot(&(precision.view((0, 0), (a, a)) * &amplitude))
}

/// Effects that the others made needless are dropped again.
fn backward(family: &dyn Family, plain: &Fit, mut full: Fit, mut taken: Vec<Taken>) -> (Fit, Vec<Taken>) {
    let mut k = 0;
    while taken.len() > 1 && k < taken.len() {
        let laws: Vec<usize> = taken
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != k)
            .map(|(_, t)| t.law)
            .collect();
        let start = without(family, &full, taken[k].law);
        let smaller = fit(family, &laws, &start, &full.noise, &plain.groups);
        // What a law that is also on could not be told from before, it has to be worth as much beside it.
        let told = |t: &Taken| family.laws()[t.law].cause;
        let mimicked = taken
            .iter()
            .any(|t| t.law != taken[k].law && taken[k].rivals.iter().any(|r| family.laws()[r.0].cause == told(t)));
        let needed = if mimicked { NAMED } else { 0.5 * NAMED };
        if full.log_evidence - smaller.log_evidence < needed {
            taken.remove(k);
            full = smaller;
            k = 0;
        } else {
            k += 1;
        }
    }
    (full, taken)
}

/// The parameters of a fit without those of one law.
fn without(family: &dyn Family, fit: &Fit, law: usize) -> Vec<f64> {
    let mut at = family.base().len();
    let mut out = fit.theta[..at].to_vec();
    for l in &fit.laws {
        let n = family.laws()[*l].parameters.len();
        if *l != law {
            out.extend(&fit.theta[at..at + n]);
        }
        at += n;
    }
    out
}

/// A law's score and where its fit should start, best first.
struct Scored {
    law: usize,
    score: f64,
    starts: Vec<Vec<f64>>,
}

/// Score (Lagrange multiplier) test of every law at every point of its grid.
fn screen(family: &dyn Family, base: &Fit, laws: impl Iterator<Item = usize>) -> Vec<Scored> {
    let mut scored: Vec<Scored> = laws
        .map(|law| {
            let mut points: Vec<(f64, Vec<f64>)> = family.laws()[law]
                .grid
                .iter()
                .filter_map(|shape| score(family, base, law, shape))
                .collect();
            points.sort_by(|a, b| b.0.total_cmp(&a.0));
            let best = points.first().map_or(0.0, |p| p.0);
            Scored {
                law,
                score: best,
                starts: points.into_iter().take(2).map(|p| p.1).collect(),
            }
        })
        .collect();
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    scored
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
    let step = |(k, p): (usize, &super::family::Parameter)| if k >= b { 0.05 * p.sd } else { 1e-4 * p.sd };
    let steps: Vec<f64> = priors.iter().enumerate().map(step).collect();
    if a == 0 {
        return Some((WORTH + 1.0, theta));
    }
    let noise = unscattered(family, &base.noise);
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
    for k in 0..b {
        h[(k, k)] += priors[k].sd.powi(-2);
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
        theta[k] = (theta[k] + room[k].clamp(-p.sd, p.sd)).clamp(p.low, p.high);
    }
    let usable: f64 = (0..a).map(|k| theta[b + k] * rest[k]).sum();
    Some((0.5 * usable, theta))
}

/// The model without the candidate, fitted again from where the best candidates have its shared parameters: a null
/// that did not converge would make discoveries.
fn polished(family: &dyn Family, base: Fit, scored: &[Scored]) -> Fit {
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

fn fitted(family: &dyn Family, base: &Fit, scored: &[Scored]) -> Vec<Candidate> {
    let before = leave_one_out(family, base);
    let noise = unscattered(family, &base.noise);
    let mut kept: Vec<&Scored> = scored
        .iter()
        .filter(|s| s.score > WORTH && !s.starts.is_empty())
        .collect();
    kept.truncate(FITTED);
    kept.iter()
        .map(|s| {
            let mut laws = base.laws.clone();
            laws.push(s.law);
            let tries = s
                .starts
                .iter()
                .map(|start| fit(family, &laws, start, &noise, &base.groups));
            let best = tries.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
            best.map(|fit| Candidate {
                law: s.law,
                gain: fit.log_evidence - base.log_evidence,
                foretold: paired(&leave_one_out(family, &fit), &before),
                fit,
            })
        })
        .collect::<Option<Vec<_>>>()
        .unwrap_or_default()
}
