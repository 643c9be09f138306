//! Whether held-out interactions can tell of a law at all.

use super::family::Family;
use super::fit::Fit;
use super::held_out::left;
use super::marginal::weights;

/// Change of what is foretold of them, in units of the noise, from which on they can.
const TELLS: f64 = 0.3;

/// The same numbers with a law of no amplitude.
pub fn silent(family: &dyn Family, full: &Fit, law: usize) -> Fit {
    let mut out = full.clone();
    let mut at = family.base().len();
    for l in &full.laws {
        let own = &family.laws()[*l];
        if *l == law {
            out.theta[at..at + own.amplitudes].fill(0.0);
        }
        at += own.parameters.len();
    }
    out
}

/// Whether a law changes what is foretold of held-out interactions by enough, where that is known well, for them to judge it.
pub fn moved(family: &dyn Family, before: &Fit, after: &Fit, law: usize) -> bool {
    let kind = family.about(law);
    let (mut square, mut total) = (0.0, 0.0);
    for g in (0..family.groups().len()).filter(|g| family.groups()[*g].held_out) {
        let channels = family.groups()[g].channels.iter();
        let own = channels.flat_map(|c| std::iter::repeat_n(c.kind == kind, c.measured.len()));
        let changes = left(family, before, g, true)
            .into_iter()
            .zip(left(family, after, g, true));
        for (((a, b), w), _) in changes.zip(weights(family, g)).zip(own).filter(|(_, own)| *own) {
            square += (w * (a - b)).powi(2);
            total += w * w;
        }
    }
    (square / f64::max(total, 1e-30)).sqrt() > TELLS * family.kinds().get(kind).map_or(0.0, |k| k.sigma)
}

#[cfg(test)]
mod tests {
    use super::super::fit::fit;
    use super::super::marginal::Noise;
    use super::super::toy::Toy;
    use super::*;

    #[test]
    fn held_out_interactions_without_an_effect_cannot_tell_it_and_those_with_it_can() {
        let toy = Toy::new(&[(2, 0.4)], 9);
        let groups: Vec<usize> = (0..Toy::FITTED).collect();
        let full = fit(&toy, &[2], &[1.0, 0.1], &Noise::start(&toy), &groups);
        let quiet = silent(&toy, &full, 2);
        assert!(full.theta[1] > 0.3 && quiet.theta[1] == 0.0 && quiet.theta[0] == full.theta[0]);
        assert!(moved(&toy, &quiet, &full, 2) && !moved(&toy, &full, &full, 2));
    }
}
