//! The diagnosis on scenes of the lab that hide an effect, two, or none, without the truth:
//! `cargo bench --bench blind -- [CASES] [first=N] [only=clean|single|outside|pair|narrow] [scene=NAME] [quiet] [calibrate] [keep=FOLDER]`. Where it
//! could not tell the hidden cause from others the experiments that it asks for are made, up to three. `calibrate` prints what other
//! temperatures of the odds would have stated.
//!
//! A quarter of the cases is clean, strengths are log-uniform over a factor 16. Effects are counted by their size d', what
//! a likelihood-ratio test that knows the cause sees: `sqrt(2 (ll with the cause − ll of the plain model))`. Shares come
//! with 95 % intervals (Clopper and Pearson 1934).
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::print_stdout,
    clippy::disallowed_macros,
    reason = "a program that prints its figures"
)]

mod numbers;
mod odds;
mod parted;
mod scenes;
mod shown;
mod table;

use std::path::Path;

use palpate::base::{Notices, Progress, Seed, Stopwatch};
use palpate::capture::write_capture_with;
use palpate::lab::synthesise;
use palpate::pipeline::{Options, Pass, build, diagnose};
use palpate::twin::{CAUSES, Diagnosis, Verdict};
use scenes::{Case, Sort, case};
use table::{Seen, print_table};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |key: &str| words.iter().find_map(|w| w.strip_prefix(key)?.parse::<u64>().ok());
    let cases = words.iter().find_map(|w| w.parse::<u64>().ok()).unwrap_or(40);
    let first = number("first=").unwrap_or(1);
    let only = words.iter().find_map(|w| w.strip_prefix("only=")).map(|w| match w {
        "clean" => Sort::Clean,
        "single" => Sort::Single,
        "outside" => Sort::Outside,
        "pair" => Sort::Pair,
        _ => Sort::Narrow,
    });
    let keep = words.iter().find_map(|w| w.strip_prefix("keep="));
    let scene = words.iter().find_map(|w| w.strip_prefix("scene="));
    let quiet = words.iter().any(|w| w == "quiet");
    let mut seen = Vec::new();
    for number in first..first + cases {
        let case = case(number, only, scene);
        match judge(&case, number, keep) {
            Some(one) => {
                if !quiet || (one.sort == Sort::Clean && !one.named.is_empty()) {
                    println!("{}", one.line(number));
                }
                seen.push(one);
            }
            None => println!("{number}: {:?} {:?}: not made", case.sort, case.causes),
        }
    }
    print_table(&seen);
    if words.iter().any(|w| w == "calibrate") {
        odds::temperatures(&seen);
    }
}

fn judge(case: &Case, number: u64, keep: Option<&str>) -> Option<Seen> {
    let made = synthesise(&case.scene, Path::new("."), Seed(number), &Progress::silent()).ok()?;
    if let Some(folder) = keep {
        write_capture_with(&made.capture, &Path::new(folder).join(number.to_string()), &made.files).ok()?;
    }
    let mut options = Options {
        passes: Pass::ALL.into_iter().filter(|p| !matches!(p, Pass::Symmetry)).collect(),
        ..Options::default()
    };
    let watch = Stopwatch::start();
    let run = build(&made.capture, &options, &Progress::silent()).ok()?;
    let seconds = watch.seconds();
    let asked = match case.causes.as_slice() {
        [cause] => parted::parted(&case.scene, number, &run.diagnosis, cause, &options),
        _ => None,
    };
    let mut only = |causes: Vec<String>| {
        options.diagnosis.causes = Some(causes);
        diagnose(&made.capture, &run.model, &options, &mut Notices::default()).ok()
    };
    let told: Vec<String> = case
        .causes
        .iter()
        .filter(|c| !c.starts_with("outside"))
        .cloned()
        .collect();
    let (mut size, mut oracle, mut best, mut short) = (None, None, None, None);
    let (mut struck, mut declared, mut parted_from) = (None, None, None);
    if let ([cause], false) = (told.as_slice(), case.sort == Sort::Clean) {
        let knowing = only(vec![cause.clone()])?;
        size = knowing.effect_sizes.get(cause.as_str()).copied();
        oracle = gain_of(&knowing.diagnosis);
        best = Some(knowing.log_likelihood);
    }
    let shown = (case.sort == Sort::Outside).then(|| shown::shown(&case.scene, number, &made.capture));
    let mut stood_in = Vec::new();
    let (mut visible, mut smaller) = (None, None);
    if case.sort == Sort::Pair {
        let knowing = only(told.clone())?;
        let found = names(&knowing.diagnosis);
        visible = Some(told.iter().all(|c| found.iter().flatten().any(|n| n == c)));
        let sizes = told.iter().filter_map(|c| knowing.effect_sizes.get(c.as_str()));
        smaller = (sizes.clone().count() == told.len()).then(|| sizes.fold(f64::INFINITY, |a, b| a.min(*b)));
    }
    if let Some(d) = size.filter(|d| *d > 7.0) {
        let others = CAUSES
            .iter()
            .filter(|c| !told.iter().any(|t| t == *c))
            .map(|c| (*c).to_owned());
        let without = only(others.collect())?;
        let named = names(&without.diagnosis);
        stood_in = named.iter().map(|n| n.join(" or ")).collect();
        struck = Some(named.is_empty() || without.diagnosis.verdict != Verdict::Explained);
        // The whole catalogue tells both, as what these data cannot part.
        let sets = names(&run.diagnosis);
        let beside = |mimic: &String| {
            let both = |n: &&Vec<String>| n.contains(mimic) && told.iter().all(|t| n.contains(t));
            sets.iter().any(|n| both(&n))
        };
        let mimic = named.first().and_then(|n| n.first());
        declared = struck.map(|unsure| unsure || mimic.is_some_and(beside));
        let nearest = without.effect_sizes.values().copied().fold(0.0, f64::max);
        parted_from = Some(0.5 * (d * d - nearest * nearest));
        short = best.map(|best| best - without.log_likelihood);
    }
    Some(Seen {
        sort: case.sort,
        scene: case.scene.name.clone(),
        causes: case.causes.clone(),
        strength: case.strength,
        size,
        oracle,
        struck,
        stood_in,
        declared,
        parted_from,
        short,
        visible,
        smaller,
        shown: shown.flatten(),
        asked,
        numbers: case.causes.first().map_or_else(Vec::new, |cause| {
            let truth = made.truth.cause_parameters.get(cause).cloned().unwrap_or_default();
            numbers::held(&run.diagnosis.findings, cause, &truth)
        }),
        gain: gain_of(&run.diagnosis),
        odds: run.diagnosis.findings.iter().map(odds::stated).collect(),
        verdict: run.diagnosis.verdict,
        named: names(&run.diagnosis),
        seconds,
    })
}

/// Share of the error above the noise that the first finding takes away on held-out interactions.
fn gain_of(diagnosis: &Diagnosis) -> Option<f64> {
    diagnosis.findings.first().map(|f| f.gain.reduction)
}

/// Every finding with its rivals.
fn names(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let each = diagnosis.findings.iter();
    each.map(|f| {
        let rivals = f.alternatives.iter().map(|a| a.cause.clone());
        std::iter::once(f.cause.clone()).chain(rivals).collect()
    })
    .collect()
}
