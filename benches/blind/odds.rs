//! Stated odds against what was right, and the temperature that would have stated them best.

use palpate::twin::Finding;

use crate::scenes::Sort;
use crate::table::Seen;

/// The causes of a finding with their odds, its own first.
pub fn stated(finding: &Finding) -> Vec<(String, f64)> {
    let own = std::iter::once((finding.cause.clone(), finding.probability));
    own.chain(finding.alternatives.iter().map(|a| (a.cause.clone(), a.probability)))
        .collect()
}

/// A finding's odds, and which of its causes was hidden; nothing where none of them was.
type Judged = (Vec<f64>, Option<usize>);

fn judged(all: &[Seen], counted: impl Fn(Sort) -> bool) -> Vec<Judged> {
    let one = |s: &Seen, set: &Vec<(String, f64)>| {
        let right = set.iter().position(|(cause, _)| s.causes.contains(cause));
        (set.iter().map(|o| o.1).collect(), right)
    };
    let each = all.iter().filter(|s| counted(s.sort));
    each.flat_map(|s| s.odds.iter().map(move |set| one(s, set))).collect()
}

/// Odds raised to a power: what another temperature would have stated.
fn tempered(odds: &[f64], power: f64) -> Vec<f64> {
    let raised: Vec<f64> = odds.iter().map(|p| p.powf(power)).collect();
    let total: f64 = raised.iter().sum();
    // What the alternatives left out is left out as before.
    let stated: f64 = odds.iter().sum::<f64>().min(1.0);
    raised.iter().map(|p| stated * p / total).collect()
}

/// Of five bins: how many, what was said on average, what share was right.
fn bins(said: &[(f64, bool)]) -> Vec<[f64; 3]> {
    let bin = |k: usize| {
        let within = |p: f64| ((p * 5.0) as usize).min(4) == k;
        let own: Vec<&(f64, bool)> = said.iter().filter(|s| within(s.0)).collect();
        let n = own.len() as f64;
        let mean = own.iter().map(|s| s.0).sum::<f64>() / n.max(1.0);
        let right = own.iter().filter(|s| s.1).count() as f64 / n.max(1.0);
        [n, mean, right]
    };
    (0..5).map(bin).collect()
}

fn error(said: &[(f64, bool)]) -> f64 {
    let each = bins(said).into_iter().map(|[n, mean, right]| n * (mean - right).abs());
    each.sum::<f64>() / said.len().max(1) as f64
}

/// Expected calibration errors of the stated probabilities: of all that was named, of effects outside the catalogue every name
/// a wrong one; of single effects.
pub fn calibration(all: &[Seen]) {
    stated_of("all cases", &judged(all, |_| true));
    let single = |sort: Sort| matches!(sort, Sort::Single | Sort::Narrow | Sort::Clean);
    stated_of("single effects and clean data", &judged(all, single));
}

fn stated_of(which: &str, judged: &[Judged]) {
    let said: Vec<(f64, bool)> = judged
        .iter()
        .filter_map(|(odds, right)| Some((*odds.first()?, *right == Some(0))))
        .collect();
    let each: Vec<String> = bins(&said)
        .into_iter()
        .filter(|b| b[0] > 0.0)
        .map(|[n, m, r]| format!("{m:.2} said, {r:.2} right of {n}"))
        .collect();
    println!(
        "calibration error of the odds, {which}: {:.3} (bar 0.05): {}",
        error(&said),
        each.join("; ")
    );
}

/// Powers of the stated odds and what they would have been worth: calibrate on seeds that do not judge.
pub fn temperatures(all: &[Seen]) {
    let judged = judged(all, |_| true);
    println!("power of the odds, nats lost per finding, calibration error:");
    for power in [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0] {
        let (mut lost, mut said) = (0.0, Vec::new());
        for (odds, right) in &judged {
            let odds = tempered(odds, power);
            let top = odds
                .iter()
                .enumerate()
                .fold(0, |best, (k, p)| if *p > odds[best] { k } else { best });
            said.push((odds[top], *right == Some(top)));
            lost -= right.map_or(0.0, |k| odds[k].max(1e-3).ln());
        }
        println!(
            "  {power:.2}  {:.4}  {:.3}",
            lost / judged.len().max(1) as f64,
            error(&said)
        );
    }
}
