//! Interactions that were not fitted judge each effect: what makes them worse is no cause, however well it fits.

use super::alike::{acts_at_a_place, on_the_table};
use super::evidence::{foretold, paired};
use super::family::{Family, Scatter, interactions};
use super::fit::{Fit, fit, parameters};
use super::judges::{moved, silent};
use super::leftover::left_over;
use super::marginal::{Point, group_state, predict, weights};
use super::named::values;
use super::naming::{Ladder, Taken};
use super::screen::{PLENTY, stands};
use crate::twin::{Evidence, Gain};

/// Share of the error above the noise that a finding may add on interactions that were not fitted.
const WORSE: f64 = -0.1;
/// Share of it that a law of one place among many may add, where there is an error above the noise, times this, at all.
const MISPLACED: f64 = -0.025;
const ABOVE: f64 = 1.5;
/// Log evidence of a first law, nats, from which on held-out interactions that repeats leave as open do not say that it is misplaced; in 148 clean
/// captures of six engines two laws came to more than 15, one at a place to 25.
const SHOWN: f64 = 30.0;
/// The largest statistic that is stated.
const MOST: f64 = 1e6;
/// Share of it that such a law has to take away where every interaction passes its place.
const IDLE: f64 = 0.1;
/// Log evidence, nats, beyond which a law stands though no held-out interaction can judge it, where it is the first and where it is
/// not. Stops of MuJoCo joints that no held-out motion came to gained 35 and 85 nats, laws of a place in 44 clean captures of such
/// joints nothing.
const BEYOND_DOUBT: (f64, f64) = (20.0, 100.0);
/// Share of the error that a law of one place takes away below which held-out interactions do not show it.
const UNSEEN: f64 = 0.05;
/// From this share of what repeats leave open on, a law that every interaction meets has to make its error smaller.
const REPEATS: f64 = 1.0;
/// What it adds there beside the noise at rest, in units of that.
const SHAKEN: f64 = 1.5;
/// Share of the first effect's log evidence below which one after it is a lesser one; share of the error above the noise that such a
/// one has to take away where something is left unexplained.
const LESSER: f64 = 0.5;
const HOLLOW: f64 = 0.05;
/// Share of it that none may add where something is left, however well it foretells how far off it is.
const RUINS: f64 = -0.5;

/// The ladder with the effects that held-out interactions do not speak against, and what these leave.
pub fn standing(family: &dyn Family, mut ladder: Ladder) -> Ladder {
    loop {
        judge(family, &mut ladder);
        if ladder.taken.iter().all(|t| t.told.is_some()) {
            ladder.overruled = ladder.overruled.filter(|_| ladder.taken.is_empty());
            return ladder;
        }
        let first = ladder.taken.first().filter(|t| t.gain > PLENTY);
        ladder.overruled = first.map(|t| overruled(family, t)).or(ladder.overruled);
        ladder.taken.retain(|t| t.told.is_some());
        let laws: Vec<usize> = ladder.taken.iter().map(|t| t.law).collect();
        ladder.full = refit(family, &ladder, &laws);
        ladder.left = left_over(family, &ladder.plain, &ladder.full);
    }
}

/// That a law fits what was fitted much better and does not foretell the rest.
fn overruled(family: &dyn Family, taken: &Taken) -> Evidence {
    let law = &family.laws()[taken.law];
    let kind = family.kinds().get(family.about(taken.law));
    Evidence {
        residual: kind.map_or_else(|| "all".into(), |k| k.quantity.name().into()),
        test: "log evidence of a law that held-out interactions do not bear out, nats".into(),
        statistic: taken.gain.min(MOST),
        p_value: (-taken.gain).exp(),
        words: format!(
            "{} would explain the interactions that were fitted, and those that were held out do not bear it out: something is \
             wrong that has no name",
            law.cause
        ),
    }
}

/// Share of the error, and log evidence, nats, below which an effect that nothing was held out for says nothing.
const NOTHING: f64 = 0.03;
const PLAIN: f64 = 15.0;
/// The same of what acts at a place of the table, however much the evidence.
const RUINED: f64 = -0.05;

/// Share of the gain that one interaction of so many or more has, from which on none of the others bears it out.
const ALONE: (f64, usize) = (0.9, 5);

/// Causes by which force and motion are read at two times, and the share of what is above the noise that one takes away beside another
/// effect of a joint: of MuJoCo hinges and drawers that are damped five had one that is not there, which took 0 to 0.38 of it; one that
/// is took 0.58. One that stands by itself may take less where its evidence is as large as this, nats: of a clean hinge one of 24 took 0.09.
const READ_LATE: [&str; 2] = ["sensor-lag", "time-delay"];
const MOST_OF_IT: f64 = 0.5;
const SURELY_LATE: f64 = 50.0;

/// Whether one interaction alone asks for what the others might have passed as well.
fn of_one_alone(before: &Fit, after: &Fit) -> bool {
    let pairs = after.states.iter().zip(&before.states);
    let gains: Vec<f64> = pairs
        .map(|(a, b)| (a.log_likelihood - b.log_likelihood).max(0.0))
        .collect();
    let most = gains.iter().copied().fold(0.0, f64::max);
    gains.len() >= ALONE.1 && most > ALONE.0 * gains.iter().sum::<f64>()
}

/// Measures each effect on held-out interactions, beside those before it that stand.
fn judge(family: &dyn Family, ladder: &mut Ladder) {
    let mut laws: Vec<usize> = Vec::new();
    for k in 0..ladder.taken.len() {
        let taken = (&ladder.taken[k], laws.is_empty());
        let before = refit(family, ladder, &laws);
        laws.push(taken.0.law);
        let after = refit(family, ladder, &laws);
        let cumulative = judged(family, ladder, taken, [&before, &after]);
        // While another effect is not in the model, what is foretold may be no better, and says nothing of this one.
        let tells = cumulative.as_ref().is_some_and(|g| g.reduction > 0.0);
        let beside = (!tells).then(|| beside_all(family, ladder, taken)).flatten();
        let told = beside.or(cumulative);
        if told.is_none() {
            laws.pop();
        }
        ladder.taken[k].told = told;
    }
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
    // Held-out interactions that go as repeats go cannot speak against what all others show.
    let slight = first && taken.gain > SHOWN && gain.rmse_after < REPEATS * family.unforeseen();
    let misplaced =
        law.grid.len() > 1 && gain.reduction < MISPLACED && above_noise(family, &gain, taken.law) && !slight;
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
    // Nor can those tell that it does nothing to, though the numbers of the plain model are others beside it.
    let quiet = silent(family, after, taken.law);
    let mute = taken.gain > undoubted && [before, &quiet].iter().any(|b| !moved(family, b, after, taken.law));
    let idle = law.grid.len() > 1 && family.passes_all_places() && gain.reduction < IDLE && !mute;
    let idle = idle && (acts_at_a_place(law.cause) || !foretells());
    // What only interactions show that were fitted has to show it well.
    let unseen = acts_at_a_place(law.cause) && gain.reduction < UNSEEN;
    let faint = first && unseen && taken.gain < BEYOND_DOUBT.0;
    let further = !first && taken.gain < LESSER * ladder.taken[0].gain;
    let hollow = further && hollow(family, ladder, &gain, taken.law);
    let ruins = ladder.left.is_some() && gain.reduction < RUINS && above_noise(family, &gain, taken.law);
    // What one interaction alone asks for, while those that were held out go as repeats go without it, is of that one.
    let of_table = on_the_table(law.cause);
    let as_repeats = gain.held_out.is_empty() || gain.rmse_before < REPEATS * family.unforeseen();
    if of_table && as_repeats && of_one_alone(before, after) {
        return None;
    }
    // What is read late beside another effect of a joint is mostly what smoothed motions leave of that at their starts.
    if READ_LATE.contains(&law.cause) && says_little_of_lateness(family, &gain, taken, first) {
        return None;
    }
    // So is what swings in the moved part.
    if law.cause == "joint-loose-mass" && !first && takes_away(sigma_of(family, taken), &gain) < MOST_OF_IT {
        return None;
    }
    // Where none was held out, what leaves the error of those that were fitted as it is explains nothing; at a place of the table what
    // makes it worse is what the form of something else leaves there.
    let ruined = of_table && gain.reduction < RUINED;
    if gain.held_out.is_empty() && (ruined || gain.reduction < NOTHING && taken.gain < PLAIN) {
        return None;
    }
    let vetoed =
        !gain.held_out.is_empty() && (idle || faint || hollow || ruins || (worse || misplaced) && !foretells());
    (!vetoed).then_some(gain)
}

/// Noise at rest of what an effect is about.
fn sigma_of(family: &dyn Family, taken: &Taken) -> f64 {
    let kind = family.kinds().get(family.about(taken.law));
    kind.map_or(0.0, |k| k.sigma)
}

/// Whether a law by which force and motion are read at two times takes too little away to be one.
fn says_little_of_lateness(family: &dyn Family, gain: &Gain, taken: &Taken, first: bool) -> bool {
    little_of_lateness(
        sigma_of(family, taken),
        gain,
        (taken.gain, first),
        family.passes_all_places(),
    )
}

/// The same of a law with this log evidence, whether it is the first one, and whether it is of a joint.
fn little_of_lateness(sigma: f64, gain: &Gain, (worth, first): (f64, bool), joint: bool) -> bool {
    let surely = worth >= SURELY_LATE;
    // Where nothing is above the noise there is nothing to take away.
    let idle = !surely && gain.rmse_before < sigma;
    if !idle && takes_away(sigma, gain) >= MOST_OF_IT {
        return false;
    }
    let judged = !gain.held_out.is_empty();
    // Only held-out ones, which it goes without here, could bear a slight one out.
    let unborne = !first && !surely && !judged;
    unborne || judged && joint && !(first && surely)
}

/// Share of the squares of the error above the noise at rest that goes with a law.
fn takes_away(sigma: f64, gain: &Gain) -> f64 {
    let above = |rmse: f64| (rmse * rmse - sigma * sigma).max(0.0);
    1.0 - above(gain.rmse_after) / above(gain.rmse_before).max(1e-30)
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
    fit(family, laws, &theta, &ladder.full.noise, &ladder.plain.groups)
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
pub fn gain(family: &dyn Family, before: &Fit, after: &Fit, kind: usize, anew: bool) -> Gain {
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
        held_out: interactions(family, &held),
        reduction,
        of: family.samples_are().into(),
        noise: (floor > 0.0).then_some(floor),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::super::naming::climb;
    use super::super::toy::Toy;
    use super::*;

    /// An effect of the fitted interactions alone goes, and the model by which what is left is judged is the one without it.
    #[test]
    fn what_held_out_interactions_speak_against_leaves_the_model() {
        let same: [(usize, f64); 1] = [(2, 0.4)];
        let stood = climb(&Toy::new(&same, 11), &Config::default()).expect("interactions");
        assert_eq!((stood.full.laws.as_slice(), stood.left.is_some()), (&[2][..], false));
        assert!(stood.taken[0].told.as_ref().is_some_and(|g| g.reduction > 0.8));

        let toy = Toy::parted([&[(2, 0.4), (0, 0.4)], &[(2, 0.4), (0, -0.4)]], 11);
        let stood = climb(&toy, &Config::default()).expect("interactions");
        assert_eq!(stood.full.laws, [2]);
        assert!(stood.left.is_some(), "the rest of the fitted ones has no name");
        assert!(stood.overruled.is_none());
    }

    /// What all that was fitted shows and the rest speaks against is no name, and not nothing.
    #[test]
    fn what_is_beyond_doubt_and_does_not_foretell_is_said_to_have_no_name() {
        let climbed = |toy: Toy| climb(&toy, &Config::default()).expect("interactions");
        let against = climbed(Toy::parted([&[(2, 1.5)], &[(2, -1.5)]], 11));
        assert!(against.taken.is_empty(), "{:?}", against.full.laws);
        assert!(against.overruled.is_some_and(|e| e.statistic > 50.0));
        assert!(climbed(Toy::new(&[], 11)).overruled.is_none());
    }

    /// A joint's motions start late where they are smoothed: what little that leaves is no lag.
    #[test]
    fn a_lag_of_a_joint_takes_half_of_the_error_away_or_is_beyond_doubt() {
        let of = |rmse_before: f64, rmse_after: f64| Gain {
            rmse_before,
            rmse_after,
            held_out: vec!["pull-07".into()],
            ..Gain::default()
        };
        let little = |rmse: [f64; 2], worth: f64| little_of_lateness(1.0, &of(rmse[0], rmse[1]), (worth, true), true);
        assert!(little([2.0, 1.9], 20.0) && !little([2.0, 1.2], 20.0));
        assert!(!little([2.0, 1.9], 60.0));
        let unjudged = |worth: f64| {
            let gain = Gain {
                held_out: Vec::new(),
                ..of(2.0, 1.9)
            };
            little_of_lateness(1.0, &gain, (worth, false), true)
        };
        assert!(unjudged(20.0) && !unjudged(60.0));
        // Below the noise the shares say nothing.
        assert!(little([0.9, 0.5], 20.0));
    }
}
