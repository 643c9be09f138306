//! Where something is left without a name: the interactions and quantities that are missed most.

use super::compare::misses;
use super::family::Family;
use super::fit::Fit;
use super::held_out::left;
use super::marginal::weights;
use super::{Config, Trace};
use crate::twin::{Evidence, Miss, Verdict};

/// How many are listed.
const MOST: usize = 3;

/// A miss with how many times what is allowed it is.
pub(super) type Rated = (f64, Miss);

/// The worst of them, worst first.
fn worst(mut all: Vec<Rated>) -> Vec<Miss> {
    all.retain(|(by, miss)| by.is_finite() && miss.rmse > 0.0);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(MOST).map(|(_, miss)| miss).collect()
}

/// Where the verdict is unknown, what is missed most (beside `named` causes where these leave something, else of all that the
/// twin foretells) and what that depends on.
pub fn where_left(
    verdict: Verdict,
    (mut named, depends): (Vec<Miss>, Vec<Evidence>),
    traces: &[Trace],
    config: &Config,
) -> (Vec<Miss>, Vec<Evidence>) {
    if verdict != Verdict::Unknown {
        return (Vec::new(), Vec::new());
    }
    named.truncate(MOST);
    let missed = if named.is_empty() {
        worst(misses(traces, config))
    } else {
        named
    };
    (missed, depends)
}

/// What a family's model misses most.
pub fn missed_by(family: &dyn Family, fit: &Fit) -> Vec<Miss> {
    let mut all = Vec::new();
    for (g, group) in family.groups().iter().enumerate() {
        let (left, weights) = (left(family, fit, g, true), weights(family, g));
        for (k, kind) in family.kinds().iter().enumerate() {
            let kinds = group.channels.iter();
            let own = kinds.flat_map(|c| std::iter::repeat_n(c.kind == k, c.measured.len()));
            let (mut sum, mut total) = (0.0, 0.0);
            for ((e, w), _) in left.iter().zip(&weights).zip(own).filter(|(_, own)| *own) {
                (sum, total) = (sum + (w * e).powi(2), total + w * w);
            }
            let rmse = (sum / f64::max(total, 1e-30)).sqrt();
            let miss = Miss {
                interaction: group.name.clone(),
                held_out: group.held_out,
                quantity: kind.quantity.name().into(),
                unit: kind.quantity.unit().into(),
                rmse,
                noise: (kind.sigma > 0.0).then_some(kind.sigma),
                of: family.samples_are().into(),
            };
            all.push((rmse / kind.sigma, miss));
        }
    }
    worst(all)
}
