//! How far the force overshoots where a push sets a body going, against how long it had rested.
//!
//! Where that is over within a millimetre, what is read there goes with a fraction of a millimetre by which the start is not known, and
//! pushes differ by it; the peak itself does not. Dry friction that ages grows by the same with each tenfold of the rest
//! (Dieterich 1972).

use nalgebra::{DMatrix, DVector};

use super::blows::Blow;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::math::weighted_linear;
use crate::twin::{Finding, Profile, ProfileBin};

/// Fewest pushes, and by what factor their rests have to differ.
const FEWEST: usize = 6;
const RESTS: f64 = 4.0;
/// Standard deviations; least growth over all rests, and least scatter of a peak, as shares of the friction.
const CLEAR: f64 = 10.0;
const LEAST: f64 = 0.04;
const SCATTER: f64 = 0.004;
/// What is left beside rests over what is left beside the order of the pushes, in squares, at most.
const BETTER: f64 = 0.3;
/// Stretches of the rest in which peaks are shown.
const BINS: usize = 6;
const CAUSE: &str = "static-ageing";
const PLACE: &str = "support";
/// Share of the growth by which a peak may come short of the friction that held.
const SHORT: f64 = 0.15;

/// Overshoots by a line of something, beside a line of the speed: its slope with its standard deviation, and what is left, N².
fn by(all: &[&Blow], of: &dyn Fn(usize, &Blow) -> f64) -> Option<(f64, f64, f64)> {
    let columns = DMatrix::from_fn(all.len(), 3, |i, k| match k {
        0 => 1.0,
        1 => of(i, all[i]),
        _ => all[i].speed,
    });
    let over = DVector::from_iterator(all.len(), all.iter().map(|b| b.over));
    let paces: Vec<f64> = all.iter().map(|b| b.speed).collect();
    let (low, high) = paces
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    // Speeds that hardly differ tell nothing, and would be a line of noise.
    let width = if high > 1.3 * low { 3 } else { 2 };
    let fit = weighted_linear(
        &columns.columns(0, width).into_owned(),
        &over,
        &DVector::from_element(all.len(), 1.0),
    )?;
    let left = fit.residuals.norm_squared();
    let free = (all.len() - width) as f64;
    let level = all.iter().map(|b| b.level).sum::<f64>() / all.len() as f64;
    let scatter = (left / free).sqrt().max(SCATTER * level);
    Some((fit.x[1], scatter * fit.sd(1), left))
}

/// Friction that grows with rest, by the peaks of one body's pushes, and how they do.
pub(super) fn aged(all: &[&Blow]) -> Option<(Finding, Profile)> {
    let told: Vec<&Blow> = all.iter().copied().filter(|b| !b.first && b.wait > 0.0).collect();
    let fitted: Vec<&Blow> = told.iter().copied().filter(|b| !b.held_out).collect();
    let rests = fitted.iter().map(|b| b.wait);
    let (short, long) = rests.fold((f64::INFINITY, 0.0_f64), |(l, h), w| (l.min(w), h.max(w)));
    if fitted.len() < FEWEST || long < RESTS * short {
        return None;
    }
    let (slope, sd, left) = by(&fitted, &|_, b| b.wait.ln())?;
    let (_, _, by_order) = by(&fitted, &|i, _| i as f64)?;
    let level = fitted.iter().map(|b| b.level).sum::<f64>() / fitted.len() as f64;
    let grows = slope * (long / short).ln();
    if slope < CLEAR * sd || grows < LEAST * level || left > BETTER * by_order {
        return None;
    }
    // Those that were not fitted judge it, if there are any.
    let judges = told.iter().copied().filter(|b| b.held_out);
    let judges: Vec<&Blow> = judges.collect();
    let of = if judges.is_empty() { &fitted } else { &judges };
    let mean = |value: &dyn Fn(&Blow) -> f64| fitted.iter().map(|b| value(b)).sum::<f64>() / fitted.len() as f64;
    let (usual, rest) = (mean(&|b| b.over), mean(&|b| b.wait.ln()));
    let rms =
        |error: &dyn Fn(&Blow) -> f64| (of.iter().map(|b| error(b).powi(2)).sum::<f64>() / of.len() as f64).sqrt();
    let errors: [&dyn Fn(&Blow) -> f64; 2] = [&|b| b.over - usual, &|b| b.over - usual - slope * (b.wait.ln() - rest)];
    let [before, after] = errors.map(rms);
    let tenfold = std::f64::consts::LN_10 / level;
    let names = |of: &[&Blow]| of.iter().map(|b| b.interaction.clone()).collect::<Vec<String>>();
    let finding = Told {
        cause: CAUSE,
        place: PLACE,
        probability: 0.95,
        rivals: &[],
        parameter: (
            "beta",
            Estimate::measured(
                tenfold * slope,
                tenfold * sd.hypot(SHORT * slope),
                "1",
                names(&fitted),
                "peaks of the force by how long the body had rested",
            ),
        ),
        residual: "overshoot",
        statistic: slope / sd,
        words: format!(
            "pushes overshoot by {:.2} N more after ten times the rest",
            slope * std::f64::consts::LN_10
        ),
        gain: gain("force", "N", [before, after], names(&judges)),
    };
    Some((finding.finding(), profile(&told, errors)))
}

/// What is left of the peaks against the rest before them, shortest first, a bin to each few pushes.
fn profile(all: &[&Blow], errors: [&dyn Fn(&Blow) -> f64; 2]) -> Profile {
    let mut by_rest = all.to_vec();
    by_rest.sort_by(|a, b| a.wait.total_cmp(&b.wait));
    let bin = |some: &[&Blow]| {
        let n = some.len() as f64;
        let mean = |of: &dyn Fn(&Blow) -> f64| some.iter().map(|b| of(b)).sum::<f64>() / n;
        let [before, after] = errors.map(mean);
        let spread = some.iter().map(|b| (errors[1](b) - after).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        ProfileBin {
            at: mean(&|b| b.wait.log10()),
            before,
            after,
            sd: (spread / n).sqrt(),
        }
    };
    Profile {
        cause: CAUSE.into(),
        place: PLACE.into(),
        quantity: "force".into(),
        unit: "N".into(),
        covariate: "the rest before a push, as the logarithm to base ten of seconds".into(),
        covariate_unit: "1".into(),
        bins: by_rest.chunks(by_rest.len().div_ceil(BINS)).map(bin).collect(),
        interaction: by_rest.last().map_or_else(String::new, |b| b.interaction.clone()),
        held_out: by_rest.last().is_some_and(|b| b.held_out),
        samples: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blows(grows: f64) -> Vec<Blow> {
        let rests = [1.0, 13.0, 33.0, 4.0, 103.0, 6.0, 100.0, 12.0, 200.0];
        let one = |(k, wait): (usize, f64)| Blow {
            interaction: format!("push-{k:02}"),
            held_out: k == 8,
            over: 0.6 + grows * f64::ln(wait) + 0.02 * ((k * 7 % 5) as f64 - 2.0),
            speed: 0.008,
            came: 0.008,
            level: 3.5,
            wait,
            first: k == 0,
            ..Blow::default()
        };
        rests.into_iter().enumerate().map(one).collect()
    }

    #[test]
    fn peaks_that_grow_with_rest_are_ageing_and_others_are_not() {
        let told = |grows: f64| aged(&blows(grows).iter().collect::<Vec<&Blow>>());
        let (found, profile) = told(0.16).expect("ageing");
        let [first, last] = [profile.bins[0], profile.bins[profile.bins.len() - 1]];
        assert!(first.before < -0.1 && last.before > 0.1 && first.after.abs().max(last.after.abs()) < 0.05);
        let beta = &found.parameters["beta"];
        assert!(
            (beta.value - 0.105).abs() < 2.0 * beta.sd.expect("measured"),
            "{beta:?}"
        );
        assert!(found.gain.rmse_after < 0.3 * found.gain.rmse_before && found.gain.held_out == ["push-08"]);
        assert!(told(0.0).is_none() && told(0.01).is_none());
    }

    #[test]
    fn peaks_that_grow_from_push_to_push_are_not_ageing() {
        let mut all = blows(0.0);
        for (k, b) in all.iter_mut().enumerate() {
            b.over += 0.1 * k as f64;
            b.wait = 3.0 + 4.0 * k as f64;
        }
        assert!(aged(&all.iter().collect::<Vec<&Blow>>()).is_none());
    }
}
