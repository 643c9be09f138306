//! The verb: from snapshots to parameters, predictions of what was held out, and what is left open.

use nalgebra::Vector2;
use rand_distr::{Distribution, StandardNormal, StudentT};

use super::Config;
use super::bench::{Bench, Simulated};
use super::course::{Keeper, Of};
use super::effects::{Effect, Gaussian, energy_distance};
use super::gather::{STAGE, gather, holds_snapshots_only, warn_of_tracks};
use super::judge::{Judged, judge};
use super::learnt::{Seen, ShapeClass};
use super::posterior::{self, Marginal, Posterior, posterior};
use super::report::{GroupResult, SearchStep, Snapshots, ThingResult};
use super::search::Search;
use super::space::{DIMENSIONS, Prior, Scales, Scores, Space};
use super::write::write_link;
use crate::base::{Notices, Result, Seed, Status, rng_for};
use crate::capture::Capture;
use crate::math::{chi_squared_tail, quantile};
use crate::physics::tabletop::Coefficients;
use crate::twin::Model;

/// Draws of the posterior by which predictions are made.
const DRAWS: usize = 48;
/// Space-filling points with which a search begins: the same for every budget, so that a longer search goes on from a shorter
/// one.
const FIRST: usize = 10;
/// Friction is tried at least this far to either side of a learnt belief's middle, on the search's scale.
const BESIDE: f64 = 0.1;
/// Share of the prior's spread above which a parameter's data say next to nothing for other things either.
const SAYS: f64 = 0.9;

/// Infers friction and its companions from snapshot pairs and writes them into the links of `model`. Nothing where the
/// capture holds other tracks as well, or nothing that a tool moved.
pub fn infer(
    capture: &Capture,
    model: &mut Model,
    config: &Config,
    seed: Seed,
    notices: &mut Notices,
) -> Result<Option<Snapshots>> {
    config.check()?;
    if !holds_snapshots_only(capture) {
        warn_of_tracks(capture, notices);
        return Ok(None);
    }
    let benches = gather(capture, model, config, notices)?;
    let mut things = Vec::new();
    for bench in benches.values() {
        let known = capture.support.as_ref().and_then(|s| s.friction);
        let plain = Space::new(
            config,
            known.and_then(|f| Some((f.kinetic?, f.kinetic_sd.unwrap_or(0.05 * f.kinetic?)))),
        );
        let material = capture.prior(&bench.name).and_then(|b| b.material.as_deref());
        let shape = ShapeClass::of(&bench.solid);
        let mut space = config
            .learnt
            .as_ref()
            .map_or(plain, |l| l.apply(plain, shape, material));
        if known.is_some() {
            space.priors[0] = plain.priors[0];
        }
        let scales = Scales {
            prior: space,
            search: plain,
            begin: config.learnt.as_ref().and_then(|l| l.least(shape)),
        };
        let search = match &config.keeper {
            Some(keeper) => kept(bench, &scales, config, seed, &capture.digest, keeper)?,
            None => optimise(bench, &scales.search, config, seed, fresh(seed, &scales)),
        };
        let Some((mut thing, posterior)) = study(bench, &scales, config, seed, &search) else {
            notices.warn(STAGE, &bench.name, "every trial was held out: nothing is left to fit");
            continue;
        };
        warn_of_misses(bench, &scales.prior, config, seed, notices);
        write_link(capture, model, bench, &posterior, &thing, config, notices);
        thing.seen.material = material.map(str::to_owned);
        thing.weighed = model
            .twin
            .link(&bench.name)
            .and_then(|l| l.mass.as_ref())
            .is_some_and(|m| m.status != Status::Assumed);
        things.push(thing);
    }
    Ok(Some(Snapshots { things }))
}

/// A search that nothing was evaluated for yet; it begins where things of its kind were, if any are known.
pub fn fresh(seed: Seed, scales: &Scales) -> Search {
    if scales.prior == scales.search {
        return Search::new(seed, FIRST);
    }
    let level = |score: f64| scales.to_search(&[score; DIMENSIONS]);
    let (low, middle, high) = (level(-1.0), level(0.0), level(1.0));
    // Where things of its shape fitted best, with the friction of its material: what only this simulation wants to be so is
    // common to a shape. A little friction to either side, which moves effects most; the middle; and where one would begin from nothing.
    let mut first = middle;
    if let Some(values) = scales.begin {
        for k in 1..DIMENSIONS {
            first[k] = scales.search.priors[k].score(values[k]);
        }
    }
    let by = (0.5 * (high[0] - low[0])).max(BESIDE);
    let beside = |by: f64| {
        let mut at = first;
        at[0] += by;
        at
    };
    let mut starts = vec![first, beside(by), beside(-by), middle, [0.0; DIMENSIONS]];
    starts.dedup();
    Search::guided(seed, starts)
}

/// A search that goes on from where it was put down, and is put down after every evaluation.
fn kept(bench: &Bench, scales: &Scales, config: &Config, seed: Seed, capture: &str, keeper: &Keeper) -> Result<Search> {
    let thing = &bench.name;
    let of = Of {
        capture,
        seed,
        thing,
        space: &scales.prior,
    };
    let mut search = keeper.take_up(&of, fresh(seed, scales))?;
    while search.evaluations.len() < config.evaluations && evaluate(bench, &scales.search, config, seed, &mut search) {
        keeper.put_down(&of, &search)?;
    }
    Ok(search)
}

/// Posterior, predictions and course of one thing after a search; nothing where no trial may be fitted.
pub fn study(
    bench: &Bench,
    scales: &Scales,
    config: &Config,
    seed: Seed,
    search: &Search,
) -> Option<(ThingResult, Posterior)> {
    let fitted = bench.fitted();
    if fitted.is_empty() {
        return None;
    }
    let space = &scales.prior;
    let mut order: Vec<_> = search.evaluations.iter().collect();
    order.sort_by(|a, b| a.divergence.total_cmp(&b.divergence));
    let guesses: Vec<Scores> = order.iter().take(4).map(|e| scales.to_prior(&e.at)).collect();
    let found = posterior(bench, space, config, &guesses, seed)?;
    let marginals = std::array::from_fn(|k| found.marginal(space, k));
    // What rocks and falls moves by how it tips, of which friction is but a part.
    let open = |k: usize| k == 0 && bench.tips();
    let fixed =
        std::array::from_fn(|k| !open(k) && fixes(&marginals[k], &space.priors[k], &scales.search.priors[k], config));
    let best = order.first().map_or([0.0; DIMENSIONS], |e| e.at);
    let values = |of: &Space, at: &Scores| std::array::from_fn(|k| of.priors[k].value(at[k]));
    let steps = steps(bench, &scales.search, config, search, seed);
    let groups = (0..bench.groups.len())
        .map(|g| predict(bench, g, space, &found, seed))
        .collect();
    let simulated = search.evaluations.len() * fitted.len() * draws_of(fitted.len(), config.simulations)
        + found.points.len() * fitted.len() * posterior::draws_of(fitted.len(), config);
    let thing = ThingResult {
        name: bench.name.clone(),
        groups,
        search: steps,
        marginals,
        before: values(space, &[0.0; DIMENSIONS]),
        fixed,
        tips: bench.tips(),
        seen: Seen {
            shape: ShapeClass::of(&bench.solid),
            material: None,
            least: values(&scales.search, &best),
            told: std::array::from_fn(|k| told(&marginals[k], &space.priors[k], fixed[k])),
        },
        weighed: false,
        best: values(&scales.search, &best),
        share: found.share,
        effective: found.effective,
        simulated,
    };
    Some((thing, found))
}

/// Says where a tool, on the path that was recorded, goes past a thing that moved.
fn warn_of_misses(bench: &Bench, prior: &Space, config: &Config, seed: Seed, notices: &mut Notices) {
    let fitted = bench.fitted();
    let middle = prior.coefficients(&[0.0; DIMENSIONS]);
    let draws = draws_of(fitted.len(), config.simulations);
    let found = bench.outcomes(&fitted, &[middle], draws, seed, 0);
    let still = |draws: &Vec<Simulated>| draws.iter().all(|s| s.effect.norm() < bench.noise());
    let missed = fitted.iter().zip(found.iter().flatten());
    let missed: Vec<&str> = missed
        .filter(|(i, draws)| bench.trials[**i].effect.norm() > bench.noise() && still(draws))
        .map(|(i, _)| bench.trials[*i].name.as_str())
        .collect();
    if let Some(first) = missed.first() {
        let words = format!(
            "{} of {} trials moved it, but there the tool on its recorded path does not reach it ({first}, …): its shape, its size or its \
             frame is not what it was",
            missed.len(),
            fitted.len()
        );
        notices.warn(STAGE, &bench.name, words);
    }
}

/// Whether the data fix a parameter: they leave little of what was believed of it, learnt or not, and little of what is believed of any thing.
fn fixes(m: &Marginal, prior: &Prior, plain: &Prior, config: &Config) -> bool {
    m.contraction < config.contraction && m.contraction * prior.width() < config.certain * plain.width()
}

/// What the data alone say of the logarithm of a parameter, with its standard deviation: the posterior without its prior.
/// Nothing where they say next to nothing.
fn told(m: &Marginal, prior: &Prior, fixed: bool) -> Option<(f64, f64)> {
    let (middle, spread) = (m.median.ln(), (m.ci95[1] / m.ci95[0]).ln() / (2.0 * 1.96));
    match prior {
        Prior::LogNormal(median, sd) if m.contraction < SAYS => {
            let (after, before) = (spread.powi(-2), sd.powi(-2));
            let alone = (after - before).max(0.1 * before);
            Some(((after * middle - before * median.ln()) / alone, alone.powf(-0.5)))
        }
        Prior::LogUniform(..) if fixed => Some((middle, spread)),
        _ => None,
    }
}

pub(super) fn draws_of(trials: usize, simulations: usize) -> usize {
    (simulations / trials.max(1)).clamp(2, 64)
}

/// Spread below which no effect is believed to repeat, m.
pub(super) fn floor(bench: &Bench) -> f64 {
    (std::f64::consts::SQRT_2 * bench.place_sd).max(2e-3)
}

/// The mean divergence (nats) of the measured from the simulated effects over the groups that are held out, or that are not;
/// nothing where there are none. Starts are drawn afresh for every `round`.
pub fn divergence(
    bench: &Bench,
    point: &Coefficients,
    held_out: bool,
    config: &Config,
    seed: Seed,
    round: usize,
) -> Option<f64> {
    judge(bench, point, held_out, config, seed, round).map(|j| j.divergence)
}

/// Goes on with a search until its budget is spent.
pub fn optimise(bench: &Bench, space: &Space, config: &Config, seed: Seed, mut search: Search) -> Search {
    while search.evaluations.len() < config.evaluations && evaluate(bench, space, config, seed, &mut search) {}
    search
}

/// One evaluation more; false where no trial may be fitted.
fn evaluate(bench: &Bench, space: &Space, config: &Config, seed: Seed, search: &mut Search) -> bool {
    let (at, by) = search.ask();
    let round = search.evaluations.len() + 1;
    let found = divergence(bench, &space.coefficients(&at), false, config, seed, round);
    if let Some(value) = found {
        search.tell(at, value, by);
    }
    found.is_some()
}

/// The course of the search; wherever it improved, with the held-out divergence and whether that improvement is beyond doubt, all
/// judged from the same starts.
fn steps(bench: &Bench, space: &Space, config: &Config, search: &Search, seed: Seed) -> Vec<SearchStep> {
    let mut least = f64::INFINITY;
    let mut fallen: Option<Judged> = None;
    let mut out = Vec::new();
    for e in &search.evaluations {
        let improved = e.divergence < least;
        least = least.min(e.divergence);
        let point = space.coefficients(&e.at);
        let side = |held_out| judge(bench, &point, held_out, config, seed, 0);
        let again = improved.then(|| side(false)).flatten();
        let fell = again
            .as_ref()
            .is_some_and(|now| fallen.as_ref().is_none_or(|before| now.fell_from(before)));
        out.push(SearchStep {
            train: e.divergence,
            test: improved.then(|| side(true)).flatten().map(|j| j.divergence),
            improved,
            fell,
            values: std::array::from_fn(|k| space.priors[k].value(e.at[k])),
        });
        if fell {
            fallen = again;
        }
    }
    out
}

/// What the posterior predicts of a group, beside what was measured and what the prior's medians give.
fn predict(bench: &Bench, group: usize, space: &Space, posterior: &Posterior, seed: Seed) -> GroupResult {
    let trials = bench.of_group(group);
    let measured = bench.measured(group);
    let (at_prior, _) = drawn(bench, group, space, &Posterior::prior(DRAWS), seed);
    let (all, means) = drawn(bench, group, space, posterior, seed);
    let of = |samples: &[Effect]| Gaussian::of(samples, floor(bench));
    let kl = |s: &[Effect]| of(&measured).zip(of(s)).map_or(f64::NAN, |(r, s)| r.divergence(&s));
    let axis =
        |k: usize, share: f64| quantile(&all.iter().map(|e| e[k]).collect::<Vec<_>>(), share).unwrap_or(f64::NAN);
    let mean = measured.iter().sum::<Effect>() / measured.len().max(1) as f64;
    let p_value = Gaussian::of(&means, 1e-4).map_or(f64::NAN, |g| chi_squared_tail(g.distance2(&mean), 2.0));
    GroupResult {
        group: bench.groups[group].clone(),
        interactions: trials.iter().map(|i| bench.trials[*i].name.clone()).collect(),
        divergence: [kl(&at_prior), kl(&all)],
        energy: [energy_distance(&measured, &at_prior), energy_distance(&measured, &all)],
        predicted_mean: means.iter().sum::<Effect>() / means.len().max(1) as f64,
        interval: [0, 1].map(|k| [axis(k, 0.025), axis(k, 0.975)]),
        p_value,
        measured,
        at_prior,
        at_posterior: all,
    }
}

/// Effects of a group's trials at draws of a posterior, with noise and with the error of the simulation itself, and the
/// mean of each replicate of the group.
fn drawn(bench: &Bench, group: usize, space: &Space, posterior: &Posterior, seed: Seed) -> (Vec<Effect>, Vec<Effect>) {
    let trials = bench.of_group(group);
    let points: Vec<Coefficients> = posterior.draw(DRAWS).iter().map(|p| space.coefficients(p)).collect();
    let found = bench.outcomes(&trials, &points, 1, seed, group + 1);
    let mut rng = rng_for(seed, &format!("snapshots/predict/{}/{group}", bench.name));
    let noise = 2.0 * bench.place_sd.powi(2);
    let (mut all, mut means) = (Vec::new(), Vec::new());
    for by_trial in &found {
        // Half of the simulation's error is shared by the trials of a replicate, half is each trial's own.
        let mut bell = || {
            let heavy: f64 = StudentT::new(4.0).map_or(0.0, |t| t.sample(&mut rng));
            heavy
        };
        let common = Vector2::new(bell(), bell());
        let effects: Vec<Effect> = by_trial
            .iter()
            .flatten()
            .map(|s| {
                let effect = s.effect;
                let off = posterior.share * effect.norm() * std::f64::consts::FRAC_1_SQRT_2;
                let own = Vector2::new(bell(), bell());
                effect + (common + own) * off
            })
            .collect();
        let sd = noise.sqrt();
        let effects: Vec<Effect> = effects
            .iter()
            .map(|e| {
                let x: f64 = StandardNormal.sample(&mut rng);
                let y: f64 = StandardNormal.sample(&mut rng);
                e + Vector2::new(x, y) * sd
            })
            .collect();
        means.push(effects.iter().sum::<Effect>() / effects.len().max(1) as f64);
        all.extend(effects);
    }
    (all, means)
}
