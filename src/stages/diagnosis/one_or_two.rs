//! One effect in a closer form, two in plain ones, or a closer form of another effect: which of them explains more. And what of it
//! something else speaks against.

use super::alike::are_alike;
use super::evidence::{leave_one_out, paired};
use super::fit::Fit;
use super::leftover::left_over;
use super::named::values;
use super::naming::{Climb, NAMED, Taken, taken_up};
use super::revision::{EVEN, from};
use super::screen::{Candidate, Scored, scored_at, screen};
use crate::twin::Evidence;

/// Share of the gain of the effect that was taken up, from which on the closer forms of another one are tried in its place.
const NEARLY: f64 = 0.5;

impl Climb<'_> {
    /// Two effects of which one alone, in a closer form, explains as much are that one: what came first fitted a part of its form.
    pub(super) fn take_one_for_two(&mut self) {
        let family = self.family;
        let [a, b] = self.taken.as_slice() else { return };
        let worth = self.full.log_evidence - self.plain.log_evidence;
        let before = leave_one_out(family, &self.full);
        let one = |own: &Taken| {
            let law = &family.laws()[own.law];
            let shape: Vec<f64> = values(family, &self.full, own.law)
                .iter()
                .skip(law.amplitudes)
                .map(|v| v.0)
                .collect();
            let closer = self.closer_than(law);
            let score = |l: &usize| scored_at(family, &self.plain, (*l, &from(&shape, &family.laws()[*l])), false);
            let scored: Vec<Scored> = closer.iter().map(score).collect();
            self.found(&self.plain, &scored).into_iter().next()
        };
        let as_well =
            |c: &Candidate| c.gain > worth - EVEN && paired(&leave_one_out(family, &c.fit), &before).0 > -EVEN;
        let found = [a, b].into_iter().filter_map(one).filter(as_well);
        if let Some(best) = found.max_by(|x, y| x.gain.total_cmp(&y.gain)) {
            self.taken = vec![taken_up(best.law, best.gain, &[])];
            self.full = best.fit;
        }
    }

    /// One effect in a form of many numbers may be two: another beside the plainer form that it extends, where that leaves something and both
    /// explain clearly more.
    pub(super) fn take_two_for_one(&mut self) {
        let family = self.family;
        let [own] = self.taken.as_slice() else { return };
        let closer = &family.laws()[own.law];
        let plainer = |l: &usize| {
            let law = &family.laws()[*l];
            law.cause == closer.cause && law.place == closer.place && closer.extends.contains(&law.form)
        };
        let scored = screen(family, &self.plain, self.all.iter().copied().filter(plainer));
        let Some(base) = self.found(&self.plain, &scored).into_iter().next() else {
            return;
        };
        let first = taken_up(base.law, base.gain, &[]);
        let found = self.found(&base.fit, &self.scored(&base.fit, &[&first]));
        let before = leave_one_out(family, &self.full);
        let two = found.iter().find(|c| {
            c.stands()
                && c.fit.log_evidence > self.full.log_evidence + NAMED
                && paired(&leave_one_out(family, &c.fit), &before).0 > 0.0
                && !self.is_form((c.law, c.gain), &[&first], [&base.fit, &c.fit])
        });
        if let Some(two) = two {
            self.full = two.fit.clone();
            self.taken = vec![first, taken_up(two.law, two.gain, &found)];
        }
    }

    /// Where the only effect leaves something, a closer form of another whose plain one came near it may leave nothing: in plain forms the
    /// wrong law can be the nearer one.
    pub(super) fn look_closer_at_others(&mut self) {
        let family = self.family;
        let [own] = self.taken.as_slice() else { return };
        if left_over(family, &self.plain, &self.full).is_none() {
            return;
        }
        let cause = self.cause(own.law);
        let near = |(law, objective): &(usize, f64)| {
            let alike = self.cause(*law) != cause && are_alike(self.cause(*law), cause);
            let gain = objective - self.plain.objective;
            alike && gain > NEARLY * own.gain && !self.closer_than(&family.laws()[*law]).is_empty()
        };
        let others: Vec<usize> = self.tried.iter().filter(|t| near(t)).map(|t| t.0).collect();
        let found = self.found(&self.plain, &screen(family, &self.plain, others.into_iter()));
        let closer = |plainer: &Candidate| {
            let law = &family.laws()[plainer.law];
            let shape = &plainer.own(family)[law.amplitudes..];
            let score = |l: usize| scored_at(family, &self.plain, (l, &from(shape, &family.laws()[l])), false);
            let scored: Vec<Scored> = self.closer_than(law).into_iter().map(score).collect();
            self.found(&self.plain, &scored)
        };
        let before = leave_one_out(family, &self.full);
        let worth = self.full.log_evidence - self.plain.log_evidence;
        let better = |c: &Candidate| {
            c.gain > worth + NAMED
                && c.stands()
                && paired(&leave_one_out(family, &c.fit), &before).0 > 0.0
                && left_over(family, &self.plain, &c.fit).is_none()
        };
        let all = found.iter().flat_map(closer).filter(better);
        if let Some(best) = all.max_by(|a, b| a.gain.total_cmp(&b.gain)) {
            self.taken = vec![taken_up(best.law, best.gain, &[])];
            self.full = best.fit;
        }
    }

    /// An effect that something else speaks against is none, however well it fits: a rival of about the same evidence takes its place, or
    /// nothing has a name; then what speaks against it.
    pub(super) fn drop_the_refuted(&mut self) -> Option<Evidence> {
        let against = |law: usize, fit: &Fit| {
            let own: Vec<f64> = values(self.family, fit, law).iter().map(|v| v.0).collect();
            self.family.refuted(law, &own)
        };
        let each = self.taken.iter().enumerate();
        let (k, told) = each
            .into_iter()
            .find_map(|(k, t)| Some((k, against(t.law, &self.full)?)))?;
        let rivals = self.taken[k].rivals.iter().filter(|r| against(r.law, &r.fit).is_none());
        let Some(best) = rivals.max_by(|a, b| a.gain.total_cmp(&b.gain)).cloned() else {
            self.full = self.smaller(k);
            self.taken.remove(k);
            return Some(told);
        };
        let refuted = self.taken[k].law;
        let own = &mut self.taken[k];
        own.rivals
            .retain(|r| r.law != best.law && self.family.laws()[r.law].form != self.family.laws()[refuted].form);
        (own.law, own.gain) = (best.law, best.gain);
        self.full = best.fit;
        None
    }
}
