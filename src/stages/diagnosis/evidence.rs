//! How well a fitted model foretells each interaction from the others, without fitting anew.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::family::Family;
use super::fit::{Fit, parameters};
use super::marginal::{Point, group_state};

/// Information of all fitted interactions with that of the prior, and the gradient of the objective.
fn whole(family: &dyn Family, fit: &Fit) -> (DMatrix<f64>, DVector<f64>) {
    let priors = parameters(family, &fit.laws);
    let mut h = DMatrix::from_diagonal(&DVector::from_iterator(
        priors.len(),
        priors.iter().map(|x| x.sd.powi(-2)),
    ));
    let slope = priors.iter().zip(&fit.theta);
    let slope = slope.map(|(x, t)| -(t - x.centre) / x.sd.powi(2));
    let mut b = DVector::from_iterator(priors.len(), slope);
    for state in &fit.states {
        h += &state.information;
        b += &state.gradient;
    }
    (h, b)
}

/// Log predictive density of each interaction given all others, at the fitted noise: exact for models that are linear
/// about the fit.
pub fn leave_one_out(family: &dyn Family, fit: &Fit) -> Vec<f64> {
    let (h, b) = whole(family, fit);
    let p = b.len();
    let one = |state: &super::marginal::GroupState| {
        let without = &h - &state.information;
        let Some(solve) = Cholesky::new(without) else {
            return state.log_likelihood;
        };
        let inverse = solve.inverse();
        let moved = &inverse * (&b - &state.gradient);
        let gradient = &state.gradient - &state.information * &moved;
        let square = state.square - 2.0 * moved.dot(&state.gradient) + moved.dot(&(&state.information * &moved));
        let m = DMatrix::identity(p, p) + &inverse * &state.information;
        let lu = m.lu();
        let explained = lu.solve(&(&inverse * &gradient)).map_or(0.0, |x| gradient.dot(&x));
        let log_det = lu.determinant().abs().max(1e-300).ln();
        let constant = state.samples as f64 * std::f64::consts::TAU.ln();
        -0.5 * (square - explained + state.log_det + log_det + constant)
    };
    fit.states.iter().map(one).collect()
}

/// Log predictive density of interactions that were not fitted, what is not known of the parameters and what is new in
/// every interaction integrated out: to first order about the fit.
pub fn foretold(family: &dyn Family, fit: &Fit, groups: &[usize]) -> Vec<f64> {
    let priors = parameters(family, &fit.laws);
    let steps: Vec<f64> = priors.iter().map(|x| 1e-4 * x.sd).collect();
    let (h, _) = whole(family, fit);
    let point = Point {
        laws: &fit.laws,
        theta: &fit.theta,
    };
    let one = |g: &usize| {
        let state = group_state(family, *g, &point, &steps, &fit.noise);
        let (Some(before), Some(after)) = (Cholesky::new(h.clone()), Cholesky::new(&h + &state.information)) else {
            return state.log_likelihood;
        };
        let log_det = |c: &Cholesky<f64, nalgebra::Dyn>| c.l().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        state.log_likelihood + 0.5 * state.gradient.dot(&after.solve(&state.gradient)) + log_det(&before)
            - log_det(&after)
    };
    groups.iter().map(one).collect()
}

/// No single interaction speaks for more than this, nats: a model that is wrong somewhere gains there by accident.
const VOICE: f64 = 5.0;

/// Mean gain over interactions times their number, with its standard error; each interaction's gain is cut.
pub fn paired(after: &[f64], before: &[f64]) -> (f64, f64) {
    let gains: Vec<f64> = after
        .iter()
        .zip(before)
        .map(|(a, b)| (a - b).clamp(-VOICE, VOICE))
        .collect();
    let n = gains.len() as f64;
    let total: f64 = gains.iter().sum();
    let mean = total / n;
    let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (total, (n * variance).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::fit::fit_at;
    use super::super::marginal::Noise;
    use super::super::toy::Toy;
    use super::*;

    /// Log evidence is exact for a linear model: what each interaction adds to it is what the others foretell of it.
    #[test]
    fn what_is_foretold_of_an_interaction_is_what_it_adds_to_the_evidence() {
        let toy = Toy::new(&[(0, 0.8)], 7);
        let noise = Noise::start(&toy);
        let of = |groups: &[usize]| fit_at(&toy, &[0, 2], &[0.0; 3], &noise, groups);
        let fitted: Vec<usize> = (0..Toy::FITTED).collect();
        let whole = of(&fitted);
        for (k, told) in leave_one_out(&toy, &whole).into_iter().enumerate() {
            let others: Vec<usize> = fitted.iter().copied().filter(|g| *g != k).collect();
            let added = whole.log_evidence - of(&others).log_evidence;
            assert!((told - added).abs() < 1e-3, "{k}: {told} {added}");
        }
        let held = Toy::FITTED;
        let more: Vec<usize> = fitted.iter().copied().chain([held]).collect();
        let added = of(&more).log_evidence - whole.log_evidence;
        let told = foretold(&toy, &whole, &[held])[0];
        assert!((told - added).abs() < 1e-3, "{told} {added}");
    }
}
