//! Effects that only show together: a search for two laws at once with the noise held at what it is at rest.
//!
//! One law beside the plain model leaves the other effect, and the noise that is learnt with it covers both: by its
//! evidence neither law is worth much, or one that mimics both is worth most. With the noise held, what each takes of the
//! error counts in full. A beam of models is kept (Lowerre 1976), one law more each time; the best are then fitted with
//! the noise learnt.

use std::collections::BTreeSet;

use super::family::Family;
use super::fit::{Fit, fit, fit_at};
use super::marginal::Noise;
use super::screen::{Scored, screen};

/// Models that are kept, and laws that are tried beside each.
const BEAM: usize = 3;
const WIDE: usize = 6;

/// The best model of two of these laws, found with the noise held at rest.
pub fn together(family: &dyn Family, laws: &[usize], plain: &Fit) -> Option<Fit> {
    let noise = Noise::start(family);
    let mut beam = vec![fit_at(family, &[], &plain.theta, &noise, &plain.groups)];
    for _ in 0..2 {
        let mut grown: Vec<Fit> = beam.iter().flat_map(|base| grown(family, laws, base)).collect();
        grown.sort_by(|a, b| b.objective.total_cmp(&a.objective));
        let mut met = BTreeSet::new();
        grown.retain(|f| met.insert(f.laws.iter().copied().collect::<BTreeSet<usize>>()));
        grown.truncate(BEAM);
        beam = grown;
    }
    let learnt = beam.iter().map(|f| fit(family, &f.laws, &f.theta, &f.noise, &f.groups));
    learnt.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
}

/// The model with one law more, for each law that is worth it.
fn grown(family: &dyn Family, laws: &[usize], base: &Fit) -> Vec<Fit> {
    let cause = |l: &usize| family.laws()[*l].cause;
    let open = |l: &usize| base.laws.iter().all(|own| cause(own) != cause(l));
    let scored = screen(family, base, laws.iter().copied().filter(open));
    // What has no amplitude has no score that could place it behind others.
    let unscored = |s: &&Scored| family.laws()[s.law].amplitudes == 0;
    let (last, first): (Vec<&Scored>, Vec<&Scored>) = scored.iter().filter(|s| s.worth()).partition(unscored);
    let one = |s: &Scored| {
        let mut own = base.laws.clone();
        own.push(s.law);
        let tries = s.starts.iter();
        let fits = tries.map(|start| fit_at(family, &own, start, &base.noise, &base.groups));
        fits.max_by(|a, b| a.objective.total_cmp(&b.objective))
    };
    first.into_iter().take(WIDE).chain(last).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::super::naming::climb;
    use super::super::toy::Toy;
    use super::*;

    #[test]
    fn two_laws_that_nearly_cancel_are_found_together() {
        // Alone each is a hundredth of what they are together.
        let toy = Toy::new(&[(0, 0.6), (1, 0.6)], 3);
        let plain = fit(
            &toy,
            &[],
            &[0.0],
            &Noise::start(&toy),
            &(0..Toy::FITTED).collect::<Vec<_>>(),
        );
        let both = together(&toy, &[0, 1, 2], &plain).expect("a model of two");
        let laws: BTreeSet<usize> = both.laws.iter().copied().collect();
        assert_eq!(laws, BTreeSet::from([0, 1]));
        for amplitude in &both.theta[1..] {
            assert!((amplitude - 0.6).abs() < 0.1, "{:?}", both.theta);
        }
    }

    #[test]
    fn what_is_hidden_is_found_and_nothing_where_nothing_is() {
        let causes = |hidden: &[(usize, f64)]| {
            let toy = Toy::new(hidden, 5);
            let ladder = climb(&toy, &Config::default()).expect("interactions");
            ladder.taken.iter().map(|t| t.law).collect::<BTreeSet<usize>>()
        };
        assert_eq!(causes(&[]), BTreeSet::new());
        assert_eq!(causes(&[(2, 0.3)]), BTreeSet::from([2]));
        assert_eq!(causes(&[(0, 0.3), (2, 0.2)]), BTreeSet::from([0, 2]));
    }
}
