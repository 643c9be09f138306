//! A pad whose stiffness is another from spot to spot: the plain model takes that up, and foretells no other spot.

use super::fit::Fit;
use super::presses::Presses;
use crate::twin::Evidence;

/// Fewest spots of one body, the least scatter of their log stiffness, and how many times its doubt that has to be: clean pads of an
/// outside world came to 0.021 at most, one whose spots differ to 0.095.
const SPOTS: usize = 3;
const UNEVEN: f64 = 0.05;
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

/// Standard deviation of the log stiffness over the spots of a body, and the doubt of one of them.
fn spread(presses: &Presses, plain: &Fit, body: usize) -> Option<(f64, f64)> {
    let bodies = presses.names.len();
    let own = |spot: &usize| (0..presses.spots.len()).any(|g| presses.spots[g] == *spot && presses.bodies[g] == body);
    let spots: Vec<usize> = (0..presses.all_spots).filter(own).map(|spot| bodies + spot).collect();
    let n = spots.len() as f64;
    if spots.len() < SPOTS {
        return None;
    }
    let mean = spots.iter().map(|k| plain.theta[*k]).sum::<f64>() / n;
    let scatter = spots.iter().map(|k| (plain.theta[*k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // What the body's own stiffness shares with all of its spots is no doubt of a difference.
    let common: f64 = spots
        .iter()
        .flat_map(|a| spots.iter().map(move |b| plain.covariance[(*a, *b)]))
        .sum::<f64>()
        / (n * n);
    let doubt = spots
        .iter()
        .map(|k| (plain.covariance[(*k, *k)] - common).max(0.0))
        .sum::<f64>()
        / n;
    Some((scatter.sqrt(), doubt.sqrt().max(1e-6)))
}
