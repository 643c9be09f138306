//! Which law the data ask for: score tests, full fits, evidence with a veto of left-out interactions, one effect after
//! the other.

use nalgebra::{Cholesky, DVector};

use super::Config;
use super::evidence::{leave_one_out, paired};
use super::family::Family;
use super::fit::{Fit, fit};
use super::held_out::standing;
use super::leftover::left_over;
use super::marginal::Noise;
use super::screen::{Candidate, Scored, fitted, polished, screen, stands};
use crate::twin::{Evidence, Gain};

/// Log evidence over the plain model, nats, from which on a cause is named, unless a family knows better; and beside others.
pub const NAMED: f64 = 8.0;
/// Causes this close to the best cannot be ruled out, nats.
pub(super) const RIVAL: f64 = 5.0;
/// What the amplitudes of a cause must be worth by themselves to be named, nats: two standard deviations.
const SEEN: f64 = 2.0;
/// A null that a candidate's parameters make better by this had not converged, nats.
const SLIP: f64 = 0.3;
/// At most this many effects are taken up.
const EFFECTS: usize = 3;

/// One effect that was taken up.
#[derive(Clone, Debug)]
pub struct Taken {
    pub law: usize,
    /// Log evidence over the model without it, nats.
    pub gain: f64,
    /// Other laws that do nearly as well in its place.
    pub rivals: Vec<Rival>,
    /// What it gains on interactions that were not fitted, once they have judged it.
    pub told: Option<Gain>,
}

/// A law that does nearly as well in the place of one that was taken up.
#[derive(Clone, Debug)]
pub struct Rival {
    pub law: usize,
    /// Log evidence over the model without it, nats.
    pub gain: f64,
    /// The model with it.
    pub fit: Fit,
}

/// What became of one kind of experiment.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// The plain model.
    pub plain: Fit,
    /// The model with all effects that stand.
    pub full: Fit,
    /// The effects, in order.
    pub taken: Vec<Taken>,
    /// Laws of which these data say nothing.
    pub untestable: Vec<usize>,
    /// Every law that was fitted beside the plain model, with the objective of its fit.
    pub tried: Vec<(usize, f64)>,
    /// What the effects that were taken up do not explain; where none was, what the plain model leaves far beyond clean data.
    pub left: Option<Evidence>,
    /// What interactions that were fitted show beyond doubt, and those that were held out do not bear out: something is wrong
    /// that has no name.
    pub overruled: Option<Evidence>,
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
    let (seen, unseen): (Vec<usize>, Vec<usize>) =
        (0..family.laws().len()).filter(allowed).partition(|l| family.shows(*l));
    let (all, closer): (Vec<usize>, Vec<usize>) = seen.into_iter().partition(|l| family.laws()[*l].extends.is_empty());
    let plain = started(family, &groups)?;
    let mut climb = Climb {
        family,
        all,
        closer,
        full: plain.clone(),
        plain,
        taken: Vec::new(),
        untestable: unseen,
        tried: Vec::new(),
        hoped: false,
        polishes: 0,
    };
    climb.climb();
    climb.keep_the_hoped_for();
    climb.take_up_together();
    climb.drop_the_needless();
    climb.revise();
    climb.prefer_the_likeliest();
    climb.prefer_what_takes_away();
    climb.look_closer(0);
    climb.take_one_for_two();
    climb.take_two_for_one();
    climb.drop_the_misshapen();
    climb.look_closer_at_others();
    let refuted = climb.drop_the_refuted();
    let ladder = standing(family, climb.finish());
    Some(Ladder {
        left: refuted.or(ladder.left),
        ..ladder
    })
}

/// What the search has come to.
pub(super) struct Climb<'a> {
    pub(super) family: &'a dyn Family,
    /// The laws that may be named, and the closer forms of some of them.
    pub(super) all: Vec<usize>,
    pub(super) closer: Vec<usize>,
    pub(super) plain: Fit,
    pub(super) full: Fit,
    pub(super) taken: Vec<Taken>,
    pub(super) untestable: Vec<usize>,
    pub(super) tried: Vec<(usize, f64)>,
    /// The first effect does not foretell left-out interactions better by itself: only with a second one may it stay.
    pub(super) hoped: bool,
    pub(super) polishes: usize,
}

impl Climb<'_> {
    pub(super) fn cause(&self, law: usize) -> &'static str {
        self.family.laws()[law].cause
    }

    /// Score tests of the laws whose cause none of these effects has.
    pub(super) fn scored(&self, base: &Fit, beside: &[&Taken]) -> Vec<Scored> {
        let causes: Vec<&str> = beside.iter().map(|t| self.cause(t.law)).collect();
        let open = |l: &usize| !causes.contains(&self.cause(*l));
        screen(self.family, base, self.all.iter().copied().filter(open))
    }

    /// Full fits of what is worth one beside `base`, best first.
    pub(super) fn found(&self, base: &Fit, scored: &[Scored]) -> Vec<Candidate> {
        let mut found = fitted(self.family, base, scored);
        found.retain(|c| {
            !self
                .family
                .may_be_negligible(c.law, c.own(self.family), &c.sds(self.family))
        });
        found.sort_by(|a, b| self.rank(b.law, b.gain).total_cmp(&self.rank(a.law, a.gain)));
        found
    }

    pub(super) fn rank(&self, law: usize, gain: f64) -> f64 {
        gain + self.family.head_start(law)
    }

    /// Takes up effects while the data ask for them, each in the form that fits it best.
    pub(super) fn climb(&mut self) {
        loop {
            let before = self.taken.len();
            if before >= EFFECTS || !self.step() {
                return;
            }
            self.look_closer(before);
        }
    }

    /// Takes up one effect, or finds a better null; false when nothing more is asked for.
    pub(super) fn step(&mut self) -> bool {
        let family = self.family;
        let beside: Vec<&Taken> = self.taken.iter().collect();
        let scored = self.scored(&self.full, &beside);
        self.full = polished(family, self.full.clone(), &scored);
        let found = self.found(&self.full, &scored);
        if self.taken.is_empty() {
            // A cause of several forms can be tested where one of them can.
            let felt = |law: usize| {
                let own = scored.iter().filter(|s| self.cause(s.law) == self.cause(law));
                own.flat_map(|s| &s.starts).next().is_some()
            };
            let unfelt: Vec<usize> = scored.iter().map(|s| s.law).filter(|l| !felt(*l)).collect();
            self.untestable.extend(unfelt);
            self.plain = self.full.clone();
            self.tried = found.iter().map(|c| (c.law, c.fit.objective)).collect();
        }
        let others: Vec<&Taken> = self.taken.iter().collect();
        let form = |c: &Candidate| self.is_form((c.law, c.gain), &others, [&self.full, &c.fit]);
        let large = |c: &Candidate| {
            let least = if self.taken.is_empty() {
                family.named_from(c.law, c.own(family))
            } else {
                NAMED
            };
            c.gain >= least && significance(family, c) >= SEEN
        };
        // What gains by no effect of its own has found a better null.
        let idle = |c: &&Candidate| c.gain >= NAMED && significance(family, c) < SEEN;
        if let Some(better) = found.iter().find(idle).and_then(|c| self.null_of(c)) {
            self.polishes += 1;
            self.full = better;
            return true;
        }
        let standing = found.iter().find(|c| c.stands() && large(c) && !form(c));
        let hope = found.first().filter(|c| self.taken.is_empty() && large(c));
        let Some(best) = standing.or(hope) else {
            return false;
        };
        // A null that had not converged would make discoveries: the candidate's shared parameters may be nearer.
        if let Some(better) = self.null_of(best) {
            self.polishes += 1;
            self.full = better;
            return true;
        }
        self.hoped |= standing.is_none();
        let taken = taken_up(best.law, best.gain, &found);
        let full = best.fit.clone();
        self.taken.push(taken);
        self.full = full;
        true
    }

    /// The model without a candidate, fitted from where that has what both share, if it is better there.
    fn null_of(&self, candidate: &Candidate) -> Option<Fit> {
        let shared = &candidate.fit.theta[..self.full.theta.len()];
        let noise = &candidate.fit.noise;
        let again =
            (self.polishes < EFFECTS).then(|| fit(self.family, &self.full.laws, shared, noise, &self.full.groups));
        again.filter(|again| again.objective > self.full.objective + SLIP)
    }

    /// An effect that was only hoped for goes, with all that was taken up after it, unless together they foretell
    /// left-out interactions better than the plain model does.
    fn keep_the_hoped_for(&mut self) {
        if !self.hoped {
            return;
        }
        let [with, without] = [&self.full, &self.plain].map(|f| leave_one_out(self.family, f));
        if self.taken.len() < 2 || !stands(paired(&with, &without)) {
            self.taken.clear();
            self.full = self.plain.clone();
        }
    }

    fn finish(self) -> Ladder {
        let left = left_over(self.family, &self.plain, &self.full);
        Ladder {
            plain: self.plain,
            full: self.full,
            taken: self.taken,
            untestable: self.untestable,
            tried: self.tried,
            left,
            overruled: None,
        }
    }
}

/// An effect with the laws that do nearly as well in its place.
pub(super) fn taken_up(law: usize, gain: f64, found: &[Candidate]) -> Taken {
    let near = |c: &&Candidate| c.law != law && c.gain > gain - RIVAL;
    let rival = |c: &Candidate| Rival {
        law: c.law,
        // What left-out interactions speak against is no likelier than what stands.
        gain: c.gain.min(gain),
        fit: c.fit.clone(),
    };
    Taken {
        law,
        gain,
        rivals: found.iter().filter(near).map(rival).collect(),
        told: None,
    }
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
