//! A pad whose stiffness is another from spot to spot: the plain model takes that up, and foretells no other spot.

use nalgebra::DMatrix;

use super::fit::Fit;
use super::presses::Presses;
use crate::twin::Evidence;

/// Fewest spots of one body, the least scatter of their log stiffness, and how many times its doubt that has to be: clean pads of an
/// outside world came to 0.021 at most, ones whose spots differ to 0.04 and 0.095.
const SPOTS: usize = 3;
const UNEVEN: f64 = 0.03;
const TOLD: f64 = 4.0;

/// The body whose spots differ most, if some do beyond doubt.
pub(super) fn uneven_pad(presses: &Presses, plain: &Fit) -> Option<Evidence> {
    let each = (0..presses.names.len()).filter_map(|body| spread(presses, plain, body).map(|s| (body, s)));
    let (body, (scatter, doubt)) = each.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let told = scatter > UNEVEN && scatter > TOLD * doubt;
    told.then(|| Evidence {
        residual: "force over all interactions".into(),
        test: "scatter of the stiffness from spot to spot over its doubt".into(),
        statistic: scatter / doubt,
        p_value: (-0.5 * (scatter / doubt).powi(2)).exp(),
        words: format!(
            "{} is stiffer at one spot than at another: by {:.0} % from spot to spot; no cause that was tried does that, and \
             elsewhere it is not foretold",
            presses.names[body],
            100.0 * scatter
        ),
    })
}

/// The spots of a body, if there are enough of them.
fn spread(presses: &Presses, plain: &Fit, body: usize) -> Option<(f64, f64)> {
    let bodies = presses.names.len();
    let own = |spot: &usize| (0..presses.spots.len()).any(|g| presses.spots[g] == *spot && presses.bodies[g] == body);
    let spots: Vec<usize> = (0..presses.all_spots).filter(own).map(|spot| bodies + spot).collect();
    (spots.len() >= SPOTS).then(|| scatter_of(&spots, &plain.theta, &plain.covariance))
}

/// Standard deviation of these parameters, and the doubt of one of them.
fn scatter_of(which: &[usize], theta: &[f64], covariance: &DMatrix<f64>) -> (f64, f64) {
    let n = which.len() as f64;
    let mean = which.iter().map(|k| theta[*k]).sum::<f64>() / n;
    let squares = which.iter().map(|k| (theta[*k] - mean).powi(2)).sum::<f64>();
    // What the body's own stiffness shares with all of its spots is no doubt of a difference.
    let shared = which
        .iter()
        .flat_map(|a| which.iter().map(move |b| covariance[(*a, *b)]));
    let common = shared.sum::<f64>() / (n * n);
    let own = which.iter().map(|k| (covariance[(*k, *k)] - common).max(0.0));
    ((squares / (n - 1.0)).sqrt(), (own.sum::<f64>() / n).sqrt().max(1e-6))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_spots_share_is_no_doubt_of_how_they_differ() {
        let theta = [9.0, 0.1, -0.1, 0.0];
        let own = DMatrix::from_fn(4, 4, |i, j| if i == j { 4e-4 } else { 0.0 });
        let shared = &own + DMatrix::from_element(4, 4, 0.01);
        let [alone, beside] = [&own, &shared].map(|c| scatter_of(&[1, 2, 3], &theta, c));
        assert!((alone.0 - 0.1).abs() < 1e-12 && (beside.0 - alone.0).abs() < 1e-12);
        // One of three less the mean of them: two thirds of its variance.
        assert!((alone.1 - (4e-4_f64 * 2.0 / 3.0).sqrt()).abs() < 1e-12, "{}", alone.1);
        assert!((beside.1 - alone.1).abs() < 1e-9, "{}", beside.1);
    }
}
