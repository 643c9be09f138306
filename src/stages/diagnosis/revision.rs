//! Looks again at the effects that were taken up: what shows only together, what others made needless, what is better
//! named beside the others, and what is but the form of a larger one.

use super::alike::{may_be_form, of_one_form};
use super::evidence::{leave_one_out, paired};
use super::family::{Family, Law};
use super::fit::{Fit, fit};
use super::held_out::gain;
use super::leftover::left_over;
use super::named::{odds, values};
use super::naming::{Climb, NAMED, RIVAL, Rival, Taken, taken_up};
use super::screen::{Candidate, Scored, calms, scored_at, stands};
use super::together::together;

/// Log evidence, nats, that a form with more numbers has to be worth over the one that it extends.
const CLOSER: f64 = 6.0;
/// Share of the largest log evidence below which a third effect is none.
const THIRD: f64 = 0.05;
/// By how much another law has to do better beside all other effects to take one's place, nats.
const CLEARLY: f64 = 1.0;
/// Share of the error below which an effect takes next to nothing away, and above which it takes most; evidence that is about the same, nats.
const TAKES: (f64, f64) = (0.2, 0.5);
pub(super) const EVEN: f64 = 2.0;

impl Climb<'_> {
    /// Where the effects leave something, two that only show together may do better.
    pub(super) fn take_up_together(&mut self) {
        let family = self.family;
        if left_over(family, &self.plain, &self.full).is_none() {
            return;
        }
        // A sensor that is off in one way or another feigns what the form of a law leaves.
        let physical = self.all.iter().copied();
        let physical: Vec<usize> = physical.filter(|l| family.laws()[*l].place != "sensor").collect();
        let Some(both) = together(family, &physical, &self.plain) else {
            return;
        };
        let causes: Vec<&str> = both.laws.iter().map(|l| self.cause(*l)).collect();
        let slight = |law: &usize| {
            let own: Vec<f64> = values(family, &both, *law).iter().map(|v| v.0).collect();
            family.negligible(*law, &own)
        };
        if of_one_form(&causes) || both.laws.iter().any(slight) {
            return;
        }
        let [with, without] = [&both, &self.full].map(|f| leave_one_out(family, f));
        if both.log_evidence < self.full.log_evidence + NAMED || !stands(paired(&with, &without)) {
            return;
        }
        self.full = both;
        let one = |law: &usize| Taken {
            law: *law,
            gain: f64::INFINITY,
            rivals: Vec::new(),
            told: None,
        };
        self.taken = self.full.laws.iter().map(one).collect();
        for k in 0..self.taken.len() {
            self.taken[k].gain = self.full.log_evidence - self.smaller(k).log_evidence;
        }
        self.taken.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        self.climb();
    }

    /// Whether a law is what the form of another effect leaves. Where with it nothing is left any more, it is less likely so: what a
    /// form leaves is seldom the whole of another law.
    pub(super) fn is_form(&self, (law, gain): (usize, f64), others: &[&Taken], [without, with]: [&Fit; 2]) -> bool {
        let taken = || others.iter().map(|t| (self.cause(t.law), t.gain));
        let whole = || {
            let left = |fit: &Fit| left_over(self.family, &self.plain, fit).is_some();
            left(without) && !left(with)
        };
        if calms(self.family, law, [without, with]) {
            return false;
        }
        let form = |whole: bool| may_be_form(self.cause(law), gain, whole, taken());
        // Where two are there already, what is slight beside the larger one is what their forms leave.
        let largest = others.iter().map(|t| t.gain).fold(0.0, f64::max);
        let slight = others.len() > 1 && gain < THIRD * largest;
        slight || form(false) && (form(true) || !whole())
    }

    /// Effects that the others made needless are dropped again.
    pub(super) fn drop_the_needless(&mut self) {
        let mut k = 0;
        while self.taken.len() > 1 && k < self.taken.len() {
            let smaller = self.smaller(k);
            // What a law that is also on could not be told from before, it has to be worth as much beside it.
            let own = &self.taken[k];
            let told = |t: &Taken| own.rivals.iter().any(|r| self.cause(r.law) == self.cause(t.law));
            let mimicked = self.taken.iter().any(|t| t.law != own.law && told(t));
            let needed = if mimicked { NAMED } else { 0.5 * NAMED };
            if self.full.log_evidence - smaller.log_evidence < needed {
                self.taken.remove(k);
                self.full = smaller;
                k = 0;
            } else {
                k += 1;
            }
        }
    }

    /// The model without one of its effects.
    pub(super) fn smaller(&self, k: usize) -> Fit {
        let others = self.taken.iter().enumerate().filter(|(i, _)| *i != k);
        let laws: Vec<usize> = others.map(|(_, t)| t.law).collect();
        let start = without(self.family, &self.full, self.taken[k].law);
        fit(self.family, &laws, &start, &self.full.noise, &self.plain.groups)
    }

    /// What an effect was named, and what else could be named in its place, was found while later effects were not yet
    /// in the model: beside them another may do better.
    pub(super) fn revise(&mut self) {
        let count = self.taken.len();
        for k in (0..count).filter(|_| count > 1) {
            let base = self.smaller(k);
            let own = (self.taken[k].law, self.full.log_evidence - base.log_evidence);
            let scored = self.scored(&base, &self.others(k));
            let found = self.found(&base, &scored);
            let better = |c: &&Candidate| {
                c.law != own.0 && c.stands() && self.rank(c.law, c.gain) > self.rank(own.0, own.1) + CLEARLY
            };
            let (revised, full) = match found.iter().find(better) {
                Some(other) => (taken_up(other.law, other.gain, &found), other.fit.clone()),
                None => (taken_up(own.0, own.1, &found), self.full.clone()),
            };
            self.taken[k] = revised;
            self.full = full;
        }
    }

    /// Tries the closer forms of the effects from the first of these on: what they have more, they have from where the form that was
    /// taken up lies.
    pub(super) fn look_closer(&mut self, first: usize) {
        let family = self.family;
        for k in first..self.taken.len() {
            let own = &family.laws()[self.taken[k].law];
            let closer = self.closer_than(own);
            if closer.is_empty() {
                continue;
            }
            let base = self.smaller(k);
            let shape: Vec<f64> = values(family, &self.full, self.taken[k].law)
                .iter()
                .skip(own.amplitudes)
                .map(|v| v.0)
                .collect();
            let scored: Vec<Scored> = closer
                .iter()
                .map(|l| scored_at(family, &base, (*l, &from(&shape, &family.laws()[*l])), false))
                .collect();
            let before = leave_one_out(family, &self.full);
            let worth = self.full.log_evidence - base.log_evidence + CLOSER;
            let foretells = |fit: &Fit| paired(&leave_one_out(family, fit), &before).0 > 0.0;
            let found = self
                .found(&base, &scored)
                .into_iter()
                .find(|c| c.gain > worth && foretells(&c.fit));
            if let Some(better) = found {
                let mut taken = taken_up(better.law, better.gain, &[]);
                taken.rivals = std::mem::take(&mut self.taken[k].rivals);
                taken.rivals.retain(|r| r.gain > better.gain - RIVAL);
                self.taken[k] = taken;
                self.full = better.fit;
            }
        }
    }

    /// The closer forms of a law.
    pub(super) fn closer_than(&self, own: &Law) -> Vec<usize> {
        let laws = self.family.laws();
        let extends = |l: &usize| {
            let other = &laws[*l];
            other.cause == own.cause && other.place == own.place && other.extends.contains(&own.form)
        };
        self.closer.iter().copied().filter(extends).collect()
    }

    /// An effect that was taken up since less was asked of its law gives way to the law that is the likelier one beside it.
    pub(super) fn prefer_the_likeliest(&mut self) {
        for k in 0..self.taken.len() {
            let own = &self.taken[k];
            let likeliest = odds(self.family, own).into_iter().next();
            let Some(cause) = likeliest.map(|o| o.cause).filter(|c| c != self.cause(own.law)) else {
                continue;
            };
            let of_it = own.rivals.iter().filter(|r| self.cause(r.law) == cause);
            let Some(best) = of_it.max_by(|a, b| a.gain.total_cmp(&b.gain)).map(|r| r.law) else {
                continue;
            };
            let base = self.smaller(k);
            let found = self.found(&base, &self.scored(&base, &self.others(k)));
            let better = found
                .iter()
                .find(|c| c.law == best && c.stands() && c.gain > own.gain - CLEARLY);
            if let Some(better) = better {
                (self.taken[k], self.full) = (taken_up(best, better.gain, &found), better.fit.clone());
            }
        }
    }

    /// Where the only effect fits the scatter and takes away next to nothing of the error, a rival of about the same evidence that takes
    /// most of it away is the cause, and none that does not is. What was held out judges later, and must not choose.
    pub(super) fn prefer_what_takes_away(&mut self) {
        let family = self.family;
        let [own] = self.taken.as_slice() else { return };
        let share = |law: usize, fit: &Fit| {
            let anew = family.laws()[law].place != "sensor";
            gain(family, &self.plain, fit, family.about(law), anew).reduction
        };
        let judged = family.groups().iter().any(|g| g.held_out);
        if judged || own.rivals.is_empty() || share(own.law, &self.full) >= TAKES.0 {
            return;
        }
        let mut rivals: Vec<Rival> = own.rivals.clone();
        rivals.retain(|r| share(r.law, &r.fit) >= TAKES.0);
        let named = |r: &Rival| {
            let own: Vec<f64> = values(family, &r.fit, r.law).iter().map(|v| v.0).collect();
            r.gain >= family.named_from(r.law, &own)
        };
        let most = |r: &&Rival| r.gain > own.gain - EVEN && named(r) && share(r.law, &r.fit) > TAKES.1;
        let best = rivals.iter().filter(most).max_by(|a, b| a.gain.total_cmp(&b.gain));
        let Some(best) = best.cloned() else { return };
        rivals.retain(|r| r.law != best.law);
        self.taken = vec![Taken {
            law: best.law,
            gain: best.gain,
            rivals,
            told: None,
        }];
        self.full = best.fit;
    }

    fn others(&self, k: usize) -> Vec<&Taken> {
        let others = self.taken.iter().enumerate().filter(|(i, _)| *i != k);
        others.map(|(_, t)| t).collect()
    }

    /// Beside the others an effect may turn out to be what the form of a larger one leaves.
    pub(super) fn drop_the_misshapen(&mut self) {
        while let Some(k) = (0..self.taken.len()).find(|k| {
            let own = &self.taken[*k];
            let others: Vec<&Taken> = self.taken.iter().filter(|t| t.law != own.law).collect();
            !others.is_empty() && self.is_form((own.law, own.gain), &others, [&self.smaller(*k), &self.full])
        }) {
            self.full = self.smaller(k);
            self.taken.remove(k);
        }
    }
}

/// Where the fit of a closer form starts: at the shape of the one that it extends, with each of its own starts of what it has more.
pub(super) fn from(shape: &[f64], closer: &Law) -> Vec<Vec<f64>> {
    let more = |start: &Vec<f64>| {
        let shared = closer.parameters.len() - closer.amplitudes - start.len();
        shape.iter().take(shared).chain(start).copied().collect()
    };
    closer.grid.iter().map(more).collect()
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

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::super::marginal::Noise;
    use super::super::naming::climb;
    use super::super::toy::Toy;
    use super::*;

    #[test]
    fn a_closer_form_is_taken_where_it_is_worth_its_number_and_what_it_extends_where_not() {
        let of = |law: usize| {
            let ladder = climb(&Toy::new(&[(law, 0.4)], 9), &Config::default()).expect("interactions");
            let laws: Vec<usize> = ladder.taken.iter().map(|t| t.law).collect();
            (laws, ladder.left.is_some(), ladder.full.theta)
        };
        let (laws, left, _) = of(2);
        assert_eq!((laws.as_slice(), left), (&[2][..], false));
        let (laws, left, theta) = of(3);
        assert_eq!((laws.as_slice(), left), (&[3][..], false));
        assert!(
            (theta[1] - 0.4).abs() < 0.05 && (theta[2] - 0.5).abs() < 0.1,
            "{theta:?}"
        );
    }

    #[test]
    fn one_effect_in_a_closer_form_stands_for_two_that_explain_no_more() {
        let left = |hidden: &[(usize, f64)]| {
            let toy = Toy::new(hidden, 9).all_fitted();
            let groups: Vec<usize> = (0..Toy::FITTED).collect();
            let noise = Noise::start(&toy);
            let plain = fit(&toy, &[], &[1.0], &noise, &groups);
            let full = fit(&toy, &[2, 0], &[1.0, 0.1, 0.1], &noise, &groups);
            let mut climb = Climb {
                family: &toy,
                all: vec![0, 1, 2],
                closer: vec![3],
                plain,
                full,
                taken: [2, 0].map(|law| taken_up(law, 20.0, &[])).into(),
                untestable: Vec::new(),
                tried: Vec::new(),
                hoped: false,
                polishes: 0,
            };
            climb.take_one_for_two();
            (climb.taken.iter().map(|t| t.law).collect::<Vec<_>>(), climb.full.laws)
        };
        assert_eq!(left(&[(3, 0.4)]), (vec![3], vec![3]));
        assert_eq!(left(&[(2, 0.4), (0, 0.3)]), (vec![2, 0], vec![2, 0]));
    }

    #[test]
    fn two_effects_in_plain_forms_stand_for_one_of_more_numbers_that_explains_less() {
        let taken = |hidden: &[(usize, f64)]| {
            let toy = Toy::new(hidden, 9).all_fitted();
            let groups: Vec<usize> = (0..Toy::FITTED).collect();
            let noise = Noise::start(&toy);
            let plain = fit(&toy, &[], &[1.0], &noise, &groups);
            let full = fit(&toy, &[3], &[1.0, 0.1, 0.5], &noise, &groups);
            let mut climb = Climb {
                family: &toy,
                all: vec![0, 1, 2],
                closer: vec![3],
                plain,
                full,
                taken: vec![taken_up(3, 20.0, &[])],
                untestable: Vec::new(),
                tried: Vec::new(),
                hoped: false,
                polishes: 0,
            };
            climb.take_two_for_one();
            (climb.taken.iter().map(|t| t.law).collect::<Vec<_>>(), climb.full.laws)
        };
        assert_eq!(taken(&[(3, 0.4)]), (vec![3], vec![3]));
        assert_eq!(taken(&[(2, 0.4), (0, 0.3)]), (vec![2, 0], vec![2, 0]));
    }

    #[test]
    fn what_takes_most_away_stands_before_what_takes_nothing() {
        let toy = Toy::new(&[(2, 0.4)], 9).all_fitted();
        let groups: Vec<usize> = (0..Toy::FITTED).collect();
        let noise = Noise::start(&toy);
        let plain = fit(&toy, &[], &[1.0], &noise, &groups);
        let with = |law: usize| fit(&toy, &[law], &[1.0, 0.1], &noise, &groups);
        let preferred = |gains: [f64; 2]| {
            let mut climb = Climb {
                family: &toy,
                all: vec![0, 1, 2],
                closer: Vec::new(),
                plain: plain.clone(),
                full: with(0),
                taken: vec![Taken {
                    law: 0,
                    gain: gains[0],
                    rivals: vec![Rival {
                        law: 2,
                        gain: gains[1],
                        fit: with(2),
                    }],
                    told: None,
                }],
                untestable: Vec::new(),
                tried: Vec::new(),
                hoped: false,
                polishes: 0,
            };
            climb.prefer_what_takes_away();
            (climb.taken[0].law, climb.full.laws)
        };
        assert_eq!(preferred([10.0, 9.5]), (2, vec![2]));
        // Not against what the evidence says.
        assert_eq!(preferred([12.0, 9.5]), (0, vec![0]));
        // Nor what is too little to be named.
        assert_eq!(preferred([8.5, 7.5]), (0, vec![0]));
    }
}
