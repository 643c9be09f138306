//! Turns what the ladder took up into findings: parameters with intervals, odds, evidence, and the gain on
//! interactions that were not fitted.

use std::collections::BTreeMap;

use super::alike::acts_at_a_place;
use super::evidence::{foretold, paired};
use super::family::{Family, Law, Scatter};
use super::fit::{Fit, parameters};
use super::marginal::{Point, group_state, predict, weights};
use super::naming::{Ladder, Taken};
use super::profile::profile;
use super::screen::stands;
use crate::base::Estimate;
use crate::twin::{CauseOdds, Evidence, Finding, Gain};

/// Raw Bayes factors are overconfident where no form of a law is quite right: log odds are divided by this.
pub const TEMPERATURE: f64 = 1.5;
/// Share of the error above the noise that a finding may add on interactions that were not fitted.
const WORSE: f64 = -0.1;
/// Share of it that a law of one place among many may add, where there is an error above the noise, times this, at all.
const MISPLACED: f64 = -0.025;
const ABOVE: f64 = 1.5;
/// Share of it that such a law has to take away where every interaction passes its place.
const IDLE: f64 = 0.1;
/// Log evidence, nats, beyond which a law stands though no held-out interaction can judge it, where it is the first and where it is
/// not; change of what is foretold of them, in units of the noise, from which on they can. Stops of MuJoCo joints that no held-out
/// motion came to gained 35 and 85 nats, laws of a place in 44 clean captures of such joints nothing.
const BEYOND_DOUBT: (f64, f64) = (20.0, 100.0);
const TELLS: f64 = 0.3;
/// From this share of what repeats leave open on, a law that every interaction meets has to make its error smaller.
const REPEATS: f64 = 1.0;
/// What it adds there beside the noise at rest, in units of that.
const SHAKEN: f64 = 1.5;
/// Share of the first effect's log evidence below which one after it is a lesser one; share of the error above the noise that such a
/// one has to take away where something is left unexplained.
const LESSER: f64 = 0.5;
const HOLLOW: f64 = 0.05;
/// Causes less likely than this are not listed.
const NEGLIGIBLE: f64 = 0.005;

/// The findings of one kind of experiment, in the order in which they were taken up.
pub fn findings(family: &dyn Family, ladder: &Ladder) -> Vec<Finding> {
    let mut laws: Vec<usize> = Vec::new();
    let mut out = Vec::new();
    for taken in &ladder.taken {
        let before = refit(family, ladder, &laws);
        laws.push(taken.law);
        let after = refit(family, ladder, &laws);
        let law = &family.laws()[taken.law];
        let odds = odds(family, taken);
        let own = odds
            .iter()
            .find(|o| o.cause == law.cause)
            .map_or(1.0, |o| o.probability);
        let first = out.is_empty();
        let cumulative = judged(family, ladder, (taken, first), [&before, &after]);
        // While another effect is not in the model, what is foretold may be no better, and says nothing of this one.
        let tells = cumulative.as_ref().is_some_and(|g| g.reduction > 0.0);
        let beside = (!tells).then(|| beside_all(family, ladder, (taken, first))).flatten();
        let Some(gain) = beside.or(cumulative) else {
            laws.pop();
            continue;
        };
        out.push(Finding {
            leader: None,
            cause: law.cause.into(),
            place: law.place.clone(),
            probability: own,
            alternatives: odds.into_iter().filter(|o| o.cause != law.cause).collect(),
            parameters: estimates(family, ladder, taken.law),
            evidence: std::iter::once(evidence(family, taken))
                .chain(profile(family, &before))
                .collect(),
            gain,
        });
    }
    with_its_state(out)
}

/// Evidence of what ages at rest over that of what goes with speed, or the other way round, up to which they are one law.
const OF_ONE_LAW: f64 = 3.0;

/// Friction that goes with the logarithm of speed and ages at rest is one law of rate and state (Dieterich 1979; Ruina 1983).
fn with_its_state(mut findings: Vec<Finding>) -> Vec<Finding> {
    let of = |cause: &str| findings.iter().position(|f| f.cause == cause);
    let (Some(rate), Some(state)) = (of("rate-state-friction"), of("static-ageing")) else {
        return findings;
    };
    let worth = |k: usize| findings[k].evidence.first().map_or(0.0, |e| e.statistic);
    let ratio = worth(rate) / worth(state);
    if (1.0 / OF_ONE_LAW..OF_ONE_LAW).contains(&ratio) {
        let aged = findings[state].evidence.clone();
        findings[rate].evidence.extend(aged);
        findings.remove(state);
    }
    findings
}

/// The gain of a law with all others in the model: while another effect is not, what is foretold with the law may be worse.
fn beside_all(family: &dyn Family, ladder: &Ladder, taken: (&Taken, bool)) -> Option<Gain> {
    let others: Vec<usize> = ladder.full.laws.iter().copied().filter(|l| *l != taken.0.law).collect();
    let before = (!others.is_empty()).then(|| refit(family, ladder, &others))?;
    judged(family, ladder, taken, [&before, &ladder.full])
}

/// The gain of a law on held-out interactions; nothing where they speak against it.
fn judged(
    family: &dyn Family,
    ladder: &Ladder,
    (taken, first): (&Taken, bool),
    [before, after]: [&Fit; 2],
) -> Option<Gain> {
    let law = &family.laws()[taken.law];
    // A tare fitted anew would take the place of what is wrong with the sensor.
    let gain = gain(family, before, after, family.about(taken.law), law.place != "sensor");
    // What makes held-out interactions worse is no cause, however well it fits.
    // One that every interaction meets has nothing to hide behind.
    let everywhere = law.grid.len() < 2 && gain.rmse_before < REPEATS * family.unforeseen();
    let worse = gain.reduction < WORSE && (everywhere || worse(family, &gain, family.about(taken.law)));
    // What acts at a place leaves held-out interactions that never come there as they are, and does not make them worse.
    let misplaced = law.grid.len() > 1 && gain.reduction < MISPLACED && above_noise(family, &gain, taken.law);
    // An error is no measure where the numbers of the law, or what is new in every interaction, leave room for it.
    let foretells = || {
        let held: Vec<usize> = (0..family.groups().len())
            .filter(|g| family.groups()[*g].held_out)
            .collect();
        stands(paired(
            &foretold(family, after, &held),
            &foretold(family, before, &held),
        ))
    };
    // Motions that all pass the place have to be foretold better by it, where they can tell.
    let undoubted = if first { BEYOND_DOUBT.0 } else { BEYOND_DOUBT.1 };
    let mute = taken.gain > undoubted && !moved(family, before, after, taken.law);
    let idle = law.grid.len() > 1 && family.passes_all_places() && gain.reduction < IDLE && !mute;
    let idle = idle && (acts_at_a_place(law.cause) || !foretells());
    let further = !first && taken.gain < LESSER * ladder.taken[0].gain;
    let hollow = further && hollow(family, ladder, &gain, taken.law);
    let vetoed = !gain.held_out.is_empty() && (idle || hollow || (worse || misplaced) && !foretells());
    (!vetoed).then_some(gain)
}

/// Whether a law changes what is foretold of held-out interactions by enough, where that is known well, for them to judge it.
fn moved(family: &dyn Family, before: &Fit, after: &Fit, law: usize) -> bool {
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

/// Whether held-out interactions are foretold worse by more than noise at rest and repeats leave open: an effect that they do not meet leaves them
/// where noise is, and there the share of what is above it says nothing.
fn worse(family: &dyn Family, gain: &Gain, kind: usize) -> bool {
    let floor = family
        .kinds()
        .get(kind)
        .map_or(0.0, |k| k.sigma)
        .max(family.unforeseen());
    gain.rmse_after.powi(2) - gain.rmse_before.powi(2) > (SHAKEN * floor).powi(2)
}

/// A further effect of a model that stays wrong has to foretell more than what it was fitted to, where there is more.
fn hollow(family: &dyn Family, ladder: &Ladder, gain: &Gain, law: usize) -> bool {
    ladder.left.is_some() && gain.reduction < HOLLOW && above_noise(family, gain, law)
}

fn above_noise(family: &dyn Family, gain: &Gain, law: usize) -> bool {
    let sigma = family.kinds().get(family.about(law)).map_or(0.0, |k| k.sigma);
    gain.rmse_before > ABOVE * sigma
}

/// The model with these laws on, with parameters of the full fit where they are in it.
pub(super) fn refit(family: &dyn Family, ladder: &Ladder, laws: &[usize]) -> Fit {
    if laws.is_empty() {
        return ladder.plain.clone();
    }
    if laws == ladder.full.laws {
        return ladder.full.clone();
    }
    let mut theta = ladder.full.theta[..family.base().len()].to_vec();
    for law in laws {
        theta.extend(values(family, &ladder.full, *law).iter().map(|v| v.0));
    }
    super::fit::fit(family, laws, &theta, &ladder.full.noise, &ladder.plain.groups)
}

/// Parameters of one law in a fit with their standard deviations.
fn values(family: &dyn Family, fit: &Fit, law: usize) -> Vec<(f64, f64)> {
    let mut at = family.base().len();
    for l in &fit.laws {
        let n = family.laws()[*l].parameters.len();
        if *l == law {
            return (at..at + n)
                .map(|k| (fit.theta[k], fit.covariance[(k, k)].max(0.0).sqrt()))
                .collect();
        }
        at += n;
    }
    Vec::new()
}

/// Doubt of an amplitude, as a share, where all of the error is left that the laws should take away; less in proportion where less is.
const MISSHAPEN: f64 = 0.5;

/// Doubt of a logarithm that shapes a law, whose form in nature is a little another: of eleven rates of loose masses one was 4 % off
/// and one 7 %; of a play, in which what bears the load gives as well: of two one was 3 % off and one 11 %.
const SHAPED: f64 = 0.03;
const PLAYED: f64 = 0.06;

/// Doubt of a damping over its stiffness, s: the jump with which it begins is taken in part for where the surface is (of seven
/// blind presses all came out 5 to 12 ms low).
const JUMPED: f64 = 6e-3;

/// What the extended model leaves unexplained where nothing was fitted may pull at its numbers as well.
fn form_doubt(family: &dyn Family, ladder: &Ladder, law: usize) -> f64 {
    let anew = family.laws()[law].place != "sensor";
    // Where something stands each motion tells anew, which leaves little of an effect above the noise.
    let about = family.kinds().get(family.about(law)).map(|k| k.quantity);
    if !matches!(about, Some(super::Quantity::Force | super::Quantity::Torque)) {
        return 0.0;
    }
    let whole = gain(family, &ladder.plain, &ladder.full, family.about(law), anew);
    MISSHAPEN * (1.0 - whole.reduction.clamp(0.0, 1.0))
}

fn estimates(family: &dyn Family, ladder: &Ladder, law: usize) -> BTreeMap<String, Estimate> {
    let (fit, form_doubt) = (&ladder.full, form_doubt(family, ladder, law));
    let from: Vec<String> = fit.groups.iter().map(|g| family.groups()[*g].name.clone()).collect();
    let form = &family.laws()[law];
    let own = values(family, fit, law);
    // What is left of an effect of one place may be because it is at another, within its reach.
    let reach = form.parameters.iter().zip(&own).find(|(p, _)| p.log);
    let displaced = match reach.filter(|_| acts_at_a_place(form.cause)) {
        Some((_, (reach, _))) => form_doubt / MISSHAPEN * reach.exp(),
        None => 0.0,
    };
    let each = form.parameters.iter().zip(own).enumerate();
    let one = |(k, (p, (value, sd))): (usize, (&super::family::Parameter, (f64, f64)))| {
        let method = "marginal-likelihood";
        let shared = match k < form.amplitudes {
            true if p.unit == "1" => 0.0,
            true if form.cause == "elastic-damping" => JUMPED,
            true if p.log => family.common_doubt(),
            true => family.common_doubt() * value,
            false if p.log => 0.0,
            false => family.place_doubt(),
        };
        let misshapen = match (k < form.amplitudes, p.log) {
            (false, true) if form.cause == "backlash" => PLAYED,
            (false, true) => SHAPED,
            (false, false) => displaced,
            (true, true) => form_doubt,
            (true, false) => form_doubt * value,
        };
        let sd = sd.hypot(shared).hypot(misshapen);
        if !p.log {
            return (
                p.name.to_owned(),
                Estimate::measured(value, sd, p.unit, from.clone(), method),
            );
        }
        let middle = value.exp();
        let mut e = Estimate::measured(middle, middle * sd, p.unit, from.clone(), method);
        e.ci95 = Some([(value - 1.96 * sd).exp(), (value + 1.96 * sd).exp()]);
        (p.name.to_owned(), e)
    };
    each.map(one).collect()
}

/// Odds among the causes that do about as well: the forms of a cause count together.
fn odds(family: &dyn Family, taken: &Taken) -> Vec<CauseOdds> {
    let mut sums: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    let all = std::iter::once((taken.law, taken.gain)).chain(taken.rivals.iter().map(|r| (r.law, r.gain)));
    for (law, gain) in all {
        let common = family.commonness(law);
        let law = &family.laws()[law];
        let own = family.laws().iter().filter(|l| l.cause == law.cause).count() as f64;
        let weight = ((gain - taken.gain) / TEMPERATURE).exp();
        let sum = sums.entry(law.cause).or_insert((0.0, own));
        sum.0 += weight * prior(law) * common;
    }
    let weights: Vec<(&str, f64)> = sums.into_iter().map(|(c, (w, n))| (c, w / n.sqrt())).collect();
    let total: f64 = weights.iter().map(|w| w.1).sum();
    let mut odds: Vec<CauseOdds> = weights
        .into_iter()
        .map(|(cause, w)| CauseOdds {
            cause: cause.into(),
            probability: w / total,
        })
        .filter(|o| o.probability > NEGLIGIBLE)
        .collect();
    odds.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    odds
}

/// The prior of a law as evidence that is as much worth in the odds, nats.
pub fn head_start(law: &Law) -> f64 {
    TEMPERATURE * prior(law).ln()
}

/// Where the same data look the same, the commoner cause is the likelier.
fn prior(law: &Law) -> f64 {
    match law.cause {
        "gravity-error" => 0.2,
        "force-bias-world" => 0.4,
        "rate-state-friction" => 0.5,
        _ => 1.0,
    }
}

fn evidence(family: &dyn Family, taken: &Taken) -> Evidence {
    let law = &family.laws()[taken.law];
    let about = family.kinds().get(family.about(taken.law));
    let quantity = about.map_or("force", |k| k.quantity.name());
    Evidence {
        residual: format!("{quantity} over all interactions"),
        test: "log evidence over the model without it".into(),
        statistic: taken.gain,
        p_value: (-taken.gain).exp().min(1.0),
        words: law.words.into(),
    }
}

/// What is left of each sample of a held-out interaction, with what no model could foretell of it fitted `anew`.
pub fn left(family: &dyn Family, fit: &Fit, group: usize, anew: bool) -> Vec<f64> {
    left_of(family, fit, group, &|s| s.nuisance && anew)
}

/// What is left of each sample of an interaction with these of its random effects fitted anew.
pub fn left_of(family: &dyn Family, fit: &Fit, group: usize, anew: &dyn Fn(&Scatter) -> bool) -> Vec<f64> {
    let point = Point {
        laws: &fit.laws,
        theta: &fit.theta,
    };
    let priors = parameters(family, &fit.laws);
    let steps: Vec<f64> = priors.iter().map(|p| 1e-4 * p.sd).collect();
    let state = group_state(family, group, &point, &steps, &fit.noise);
    let own = family.scatter().iter().zip(state.effects.iter());
    let effects: Vec<f64> = own.map(|(s, e)| if anew(s) { *e } else { 0.0 }).collect();
    let predicted = predict(family, group, &point, &effects);
    let measured = family.groups()[group].channels.iter().flat_map(|c| c.measured.iter());
    measured.zip(&predicted).map(|(m, p)| m - p).collect()
}

/// Error on held-out interactions before and after; on the fitted ones where none was held out.
fn gain(family: &dyn Family, before: &Fit, after: &Fit, kind: usize, anew: bool) -> Gain {
    let held: Vec<usize> = (0..family.groups().len())
        .filter(|g| family.groups()[*g].held_out)
        .collect();
    let on = if held.is_empty() {
        before.groups.clone()
    } else {
        held.clone()
    };
    // Samples count by how well they are known: those that still ring from the blow of the tool hardly do.
    let error = |fit: &Fit| {
        let (mut square, mut total) = (0.0, 0.0);
        for g in &on {
            // One kind of channel is the one that the law is about.
            let channels = family.groups()[*g].channels.iter();
            let own = channels.flat_map(|c| std::iter::repeat_n(c.kind == kind, c.measured.len()));
            let rows = left(family, fit, *g, anew).into_iter().zip(weights(family, *g));
            for ((e, w), _) in rows.zip(own).filter(|(_, own)| *own) {
                square += (w * e).powi(2);
                total += w * w;
            }
        }
        (square / total.max(1e-30)).sqrt()
    };
    let (rmse_before, rmse_after) = (error(before), error(after));
    let floor = family.kinds().get(kind).map_or(0.0, |k| k.sigma);
    let quantity = family.kinds().get(kind).map_or(super::Quantity::Force, |k| k.quantity);
    let above = |x: f64| (x * x - floor * floor).max(0.0).sqrt();
    let reduction = if above(rmse_before) > 0.0 {
        1.0 - above(rmse_after) / above(rmse_before)
    } else {
        // Nothing was above the noise that could be made less of.
        -above(rmse_after) / floor.max(1e-12)
    };
    Gain {
        quantity: quantity.name().into(),
        rmse_before,
        rmse_after,
        unit: quantity.unit().into(),
        held_out: held.iter().map(|g| family.groups()[*g].name.clone()).collect(),
        reduction,
    }
}
