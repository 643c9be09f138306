//! Mass by what is dragged under several loads: friction `mu (m g + P)` grows with the load `P` that a hand adds, which the sensor reads,
//! so that its slope is the coefficient and where it comes to nothing the weight.

use nalgebra::{DMatrix, DVector};

use super::Config;
use super::push::Push;
use super::surface::{SurfacePrior, fit_surface};
use crate::base::Estimate;
use crate::math::weighted_linear;

/// How the mass was told, as the estimate says it.
pub(super) const METHOD: &str = "drags-under-loads";
/// Fewest drags, and by how much their loads have to differ, as a share of the weight.
const FEWEST: usize = 4;
const DIFFER: f64 = 0.25;
/// Rounds in which weight and loads settle.
const ROUNDS: usize = 4;
/// Largest relative doubt of a mass that is told, and least one: friction that sticks by itself, too, or that grows less than the load
/// does, looks like another weight.
const DOUBT: (f64, f64) = (0.15, 0.02);

/// The mass by these drags, with `prior` for all but the weight.
pub(super) fn mass_by_loads(pushes: &[Push], prior: &SurfacePrior, g: f64, config: &Config) -> Option<Estimate> {
    let lifts: Vec<f64> = pushes.iter().map(lift).collect();
    let (low, high) = lifts
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let (mut prior, mut doubt) = (*prior, f64::INFINITY);
    for _ in 0..ROUNDS {
        let surface = fit_surface(pushes, &prior)?;
        let rows: Vec<(f64, (f64, f64))> = lifts
            .iter()
            .zip(&surface.forces)
            .filter(|(_, f)| f.0.is_finite())
            .map(|(lift, f)| {
                let load = (1.0 - lift / prior.weight).max(0.1);
                (*lift, (f.0 * load, f.1 * load))
            })
            .collect();
        let (weight, sd) = weight_of(&rows, config.friction_scatter)?;
        (prior.weight, prior.mass, doubt) = (weight, weight / g, sd);
    }
    let told = doubt < DOUBT.0 && high - low > DIFFER * prior.weight;
    told.then(|| {
        let from = pushes.iter().map(|p| p.interaction.clone()).collect();
        Estimate::measured(prior.mass, prior.mass * doubt.hypot(DOUBT.1), "kg", from, METHOD)
    })
}

/// Mean force along the normal, N.
fn lift(push: &Push) -> f64 {
    push.blocks.iter().map(|b| b.lift).sum::<f64>() / push.blocks.len().max(1) as f64
}

/// The weight, N, with its relative standard deviation, by the force along the normal and friction with its standard deviation, N.
fn weight_of(rows: &[(f64, (f64, f64))], scatter: f64) -> Option<(f64, f64)> {
    let n = rows.len();
    if n < FEWEST {
        return None;
    }
    let a = DMatrix::from_fn(n, 2, |i, k| if k == 0 { 1.0 } else { -rows[i].0 });
    let b = DVector::from_iterator(n, rows.iter().map(|r| r.1.0));
    let weights = DVector::from_iterator(
        n,
        rows.iter()
            .map(|(_, (f, sd))| (sd * sd + (scatter * f).powi(2)).max(1e-12).recip()),
    );
    let fit = weighted_linear(&a, &b, &weights)?;
    let squares: f64 = fit.residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum();
    let scale = (squares / (n as f64 - 2.0)).max(1.0);
    let (level, slope) = (fit.x[0], fit.x[1]);
    if level <= 0.0 || slope <= 0.0 {
        return None;
    }
    let c = &fit.covariance;
    let relative = c[(0, 0)] / level.powi(2) + c[(1, 1)] / slope.powi(2) - 2.0 * c[(0, 1)] / (level * slope);
    Some((level / slope, (scale * relative.max(0.0)).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_part_weight_and_friction_and_one_load_does_not() {
        // 5 N of weight at 0.3, pressed down by up to 8 N.
        let rows = |loads: &[f64]| -> Vec<(f64, (f64, f64))> {
            let scatter = |i: usize| 1.0 + 0.01 * ((i * 7 % 5) as f64 - 2.0);
            let each = loads.iter().enumerate();
            each.map(|(i, p)| (-p, (0.3 * (5.0 + p) * scatter(i), 0.005))).collect()
        };
        let (weight, sd) = weight_of(&rows(&[0.0, 1.5, 4.0, 8.0, 0.0, 1.5, 4.0, 8.0]), 0.015).expect("loads");
        assert!((weight / 5.0 - 1.0).abs() < 2.0 * sd && sd < 0.05, "{weight} {sd}");
        let one = weight_of(&rows(&[0.0, 0.01, 0.0, 0.01, 0.0, 0.01]), 0.015);
        assert!(one.is_none_or(|(_, sd)| sd > DOUBT.0), "{one:?}");
    }
}
