//! Things in MuJoCo with three tools and four actions: the claim of the paper, errors, intervals, the learnt prior.

use std::path::{Path, PathBuf};

use palpate::base::{Notices, Progress, Seed};
use palpate::capture::{Capture, read_capture};
use palpate::physics::tabletop::Coefficients;
use palpate::pipeline::{Options, Pass, build};
use palpate::stages::snapshots::{
    Bench, Config, Evaluation, Judged, LearntPrior, Prior, Scales, Search, Seen, Space, fresh, gather, judge, optimise,
    study,
};
use serde_json::Value;

use super::{cpu, python};

/// What the things are made of, in turn, and their kinds.
const MATERIALS: [&str; 4] = ["felt", "wood", "rubber", "card"];
const KINDS: [&str; 5] = ["box", "tall", "can", "puck", "ball"];
/// Trials of each tool and action, and of the one that is held out: the Gaussian of ten trials is itself a quarter of a nat
/// from the truth, which is as much as a search moves at its end.
const TRIALS: &str = "10";
const HELD_TRIALS: &str = "40";
/// Seed of the simulations by which points are judged that a search of another seed found.
const JUDGE: Seed = Seed(1);
/// Times as many simulations judge a point as find it.
const JUDGED_BY: usize = 4;

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    for (rank, i) in order.into_iter().enumerate() {
        out[i] = rank as f64;
    }
    out
}

/// Spearman's rank correlation; not a number below two pairs.
fn spearman(pairs: &[(f64, f64)]) -> f64 {
    if pairs.len() < 2 {
        return f64::NAN;
    }
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let (x, y) = (ranks(&a), ranks(&b));
    let middle = (x.len() as f64 - 1.0) / 2.0;
    let cross: f64 = x.iter().zip(&y).map(|(u, v)| (u - middle) * (v - middle)).sum();
    let square: f64 = x.iter().map(|u| (u - middle).powi(2)).sum();
    cross / square
}

/// One thing: its capture, what can be simulated, its material and true friction.
struct Thing {
    bench: Bench,
    material: Option<String>,
    friction: f64,
}

/// The seed of thing `k`; `PALPATE_FROM` names that of the first one.
fn seed_of(k: usize) -> usize {
    std::env::var("PALPATE_FROM").map_or(500, |v| v.parse().expect("a number")) + k
}

fn folder_of(k: usize) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("snapshot-things")
        .join(format!("seed-{}", seed_of(k)))
}

/// Thing `k`, made with MuJoCo where it is not there yet.
fn thing(k: usize) -> Thing {
    let out = folder_of(k);
    if !out.join("truth.json").exists() {
        python(&[
            "tests/worlds/snapshot_world.py",
            &out.display().to_string(),
            "--seed",
            &seed_of(k).to_string(),
            "--trials",
            TRIALS,
            "--held-trials",
            HELD_TRIALS,
            "--thing",
            KINDS[k % KINDS.len()],
            "--material",
            MATERIALS[k % MATERIALS.len()],
        ]);
    }
    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("truth.json")).expect("truth")).expect("parses");
    let capture: Capture = read_capture(&out).expect("a capture");
    let options = Options {
        passes: vec![Pass::Shape],
        ..Options::default()
    };
    let model = build(&capture, &options, &Progress::silent()).expect("builds").model;
    let benches = gather(&capture, &model, &Config::default(), &mut Notices::default()).expect("gathers");
    let bench = benches.into_values().next().expect("a thing");
    Thing {
        material: capture.prior(&bench.name).and_then(|b| b.material.clone()),
        friction: truth["bodies"]["thing"]["friction_kinetic"].as_f64().expect("friction"),
        bench,
    }
}

/// The divergence at a point as it is judged: more simulations than found it, all points by the same starts.
fn judged(bench: &Bench, at: &Coefficients, held_out: bool, config: &Config) -> Judged {
    let config = Config {
        simulations: JUDGED_BY * config.simulations,
        ..config.clone()
    };
    judge(bench, at, held_out, &config, JUDGE, 0).expect("trials")
}

/// One evaluation of the search as it is judged.
struct Step {
    /// Training and test divergence.
    pair: (f64, f64),
    /// Whether the search took it for better than all before.
    improved: bool,
    /// Whether it then was, as judged: some of what looks better is the luck of one evaluation's dice.
    better: bool,
    /// Whether it was by more than the scatter of the trials explains.
    fell: bool,
}

/// The judged course of the search.
fn course(thing: &Thing, space: &Space, search: &Search, config: &Config) -> Vec<Step> {
    let (mut least, mut lowest) = (f64::INFINITY, f64::INFINITY);
    let mut fallen: Option<Judged> = None;
    let mut step = |e: &Evaluation| {
        let improved = e.divergence < least;
        least = least.min(e.divergence);
        let at = space.coefficients(&e.at);
        let side = |held_out| judged(&thing.bench, &at, held_out, config);
        let train = side(false);
        let pair = (train.divergence, side(true).divergence);
        let better = improved && pair.0 < lowest;
        let fell = improved && fallen.as_ref().is_none_or(|before| train.fell_from(before));
        if better {
            lowest = pair.0;
        }
        if fell {
            fallen = Some(train);
        }
        Step {
            pair,
            improved,
            better,
            fell,
        }
    };
    search.evaluations.iter().map(&mut step).collect()
}

/// The pairs of the steps that are chosen.
fn pairs(steps: &[Step], chosen: impl Fn(&Step) -> bool) -> Vec<(f64, f64)> {
    steps.iter().filter(|s| chosen(s)).map(|s| s.pair).collect()
}

/// The judged divergence of what the search would name after every evaluation.
fn incumbents(thing: &Thing, space: &Space, search: &Search, config: &Config) -> Vec<f64> {
    let (mut least, mut value) = (f64::INFINITY, f64::NAN);
    let mut after = |e: &Evaluation| {
        if e.divergence < least {
            least = e.divergence;
            value = judged(&thing.bench, &space.coefficients(&e.at), false, config).divergence;
        }
        value
    };
    search.evaluations.iter().map(&mut after).collect()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// The defaults; `PALPATE_SIMULATIONS` and `PALPATE_POINTS` change what an evaluation and the posterior cost.
fn config() -> Config {
    let set = |name: &str, plain: usize| std::env::var(name).map_or(plain, |v| v.parse().expect("a number"));
    let plain = Config::default();
    Config {
        simulations: set("PALPATE_SIMULATIONS", plain.simulations),
        points: set("PALPATE_POINTS", plain.points),
        ..plain
    }
}

/// Claim of the paper, errors, intervals; with `learnt` also what a prior from the others saves.
pub fn lab_things(count: usize, learnt: bool) {
    let config = config();
    let space = Space::new(&config, None);
    let (mut inside, mut errors, mut whole) = (0, Vec::new(), Vec::new());
    let (mut improving, mut bettering, mut falling) = (Vec::new(), Vec::new(), Vec::new());
    let mut followed = (0, 0);
    let mut all: Vec<(Thing, Seen, Search)> = Vec::new();
    for k in 0..count {
        let thing = thing(k);
        let begin = cpu();
        let scales = Scales::plain(space);
        let search = optimise(&thing.bench, &space, &config, Seed(0), fresh(Seed(0), &scales));
        let (mut found, _) = study(&thing.bench, &scales, &config, Seed(0), &search).expect("fitted trials");
        let spent = cpu() - begin;
        let m = &found.marginals[0];
        let steps = course(&thing, &space, &search, &config);
        let (better, fallen) = (pairs(&steps, |s| s.improved), pairs(&steps, |s| s.fell));
        whole.push(spearman(&pairs(&steps, |_| true)));
        improving.push(spearman(&better));
        bettering.push(spearman(&pairs(&steps, |s| s.better)));
        falling.push(spearman(&fallen));
        followed.0 += fallen.windows(2).filter(|w| w[1].1 < w[0].1).count();
        followed.1 += fallen.len() - 1;
        inside += usize::from((m.ci95[0]..=m.ci95[1]).contains(&thing.friction));
        if found.fixed[0] {
            errors.push((m.median / thing.friction - 1.0).abs());
        }
        println!(
            "{} {k}: friction {:.3}, told {:.3} [{:.3} {:.3}] {}; rank correlation over the search {:.2}, over its {} improvements {:.2}, \
             over those that were {:.2}, over the {} beyond doubt {:.2} ({:.3?}); \
             test divergence {:.2} at first, {:.2} at the best; {spent:.1} CPU s",
            KINDS[k % KINDS.len()],
            thing.friction,
            m.median,
            m.ci95[0],
            m.ci95[1],
            if found.fixed[0] { "measured" } else { "assumed" },
            whole[k],
            better.len(),
            improving[k],
            bettering[k],
            fallen.len(),
            falling[k],
            fallen,
            better[0].1,
            better[better.len() - 1].1,
        );
        found.seen.material = thing.material.clone();
        all.push((thing, found.seen, search));
    }
    let within = errors.iter().filter(|e| **e < 0.1).count();
    println!(
        "friction called measured in {} of {count}; median error {:.1} %, at most 10 % in {within}",
        errors.len(),
        100.0 * median(&errors)
    );
    println!("95 % intervals hold the truth in {inside} of {count}");
    for (what, values) in [
        ("all evaluations", &whole),
        ("what the search took for improvements", &improving),
        ("what improved as judged", &bettering),
        ("what fell beyond the scatter of the trials", &falling),
    ] {
        let high = values.iter().filter(|r| **r >= 0.8 - 1e-9).count();
        println!(
            "rank correlation of training and test divergence, {what}: median {:.2}, 0.8 or more in {high} of {}",
            median(values),
            values.iter().filter(|r| r.is_finite()).count(),
        );
    }
    println!(
        "test divergence fell too at {} of {} falls beyond doubt",
        followed.0, followed.1
    );
    if learnt {
        with_learnt_prior(&all);
    }
}

/// Evaluations to the same divergence, from nothing and from what was learnt of the other things. The search that names the divergence
/// reaches it by its making, which another one from nothing need not: so that is counted as well.
fn with_learnt_prior(all: &[(Thing, Seen, Search)]) {
    let config = config();
    let (mut plain, mut started, mut again) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (thing, seen, plainly)) in all.iter().enumerate() {
        let others: Vec<Seen> = all
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != k)
            .map(|(_, (_, s, _))| s.clone())
            .collect();
        let from_nothing = Space::new(&config, None);
        let others = LearntPrior::from_seen(&others);
        let learnt = others.apply(from_nothing, seen.shape, thing.material.as_deref());
        let scales = Scales {
            prior: learnt,
            search: from_nothing,
            begin: others.least(seen.shape),
        };
        let guided = optimise(&thing.bench, &from_nothing, &config, Seed(0), fresh(Seed(0), &scales));
        let nothing = fresh(Seed(1), &Scales::plain(from_nothing));
        let other = optimise(&thing.bench, &from_nothing, &config, Seed(1), nothing);
        let judge = |s: &Search| incumbents(thing, &from_nothing, s, &config);
        let (a, b, c) = (judge(plainly), judge(&guided), judge(&other));
        // What the search from nothing names after its whole budget, with a margin.
        let target = 1.1 * a.last().expect("some") + 0.02;
        let reached = |course: &[f64]| {
            course
                .iter()
                .position(|d| *d <= target)
                .map_or(config.evaluations + 1, |i| i + 1)
        };
        let (ours, theirs, others) = (reached(&b), reached(&a), reached(&c));
        let told = |k: usize| match learnt.priors[k] {
            Prior::LogNormal(median, sd) => format!("{median:.3} x/ {:.2}", sd.exp()),
            Prior::LogUniform(..) => "nothing".into(),
        };
        println!(
            "{} {k} of {}: friction {:.3}, believed {} (tool {}, rolling {}, restitution {}); {theirs} evaluations from nothing ({others} of another seed), {ours} with the belief, to {target:.3} nats; \
             at first {:.2} and {:.2}, at the end {:.3} and {:.3}",
            KINDS[k % KINDS.len()],
            thing.material.as_deref().unwrap_or("-"),
            thing.friction,
            told(0),
            told(2),
            told(1),
            told(3),
            a[0],
            b[0],
            a[a.len() - 1],
            b[b.len() - 1],
        );
        plain.push(theirs as f64);
        started.push(ours as f64);
        again.push(others as f64);
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    println!(
        "evaluations to the same divergence: {:.1} from nothing, {:.1} with what the others told (means of {} things; medians {:.0} and {:.0})",
        mean(&plain),
        mean(&started),
        plain.len(),
        median(&plain),
        median(&started)
    );
    println!(
        "the same from nothing by another seed than that which names the divergence: mean {:.1}, median {:.0}",
        mean(&again),
        median(&again)
    );
    println!("  each: {plain:?} | {started:?} | {again:?}");
}
