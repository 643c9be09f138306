//! What was named beside what was hidden, counted.

use palpate::twin::Verdict;
use statrs::distribution::{Beta, ContinuousCDF};

use crate::odds::calibration;
use crate::parted::Parted;
use crate::scenes::Sort;
use crate::shown::outside;

/// Causes that the same data often cannot part.
const ALIASES: &[&[&str]] = &[
    &["magnet", "bump", "friction-patch"],
    &[
        "support-tilt",
        "gravity-error",
        "force-bias-world",
        "tether",
        "outside-ratchet",
    ],
    &["wear-or-heating", "force-drift", "stiffness-drift"],
    &["time-delay", "sensor-lag", "elastic-damping", "stress-relaxation"],
    &[
        "hardening-stiffness",
        "second-stage",
        "power-law-stiffness",
        "force-saturation",
    ],
    &[
        "elastic-hysteresis",
        "guide-friction",
        "softening-by-use",
        "plastic-set",
    ],
    &["joint-spring", "joint-gravity", "limit-compliance"],
    &[
        "joint-damping",
        "joint-quadratic-damping",
        "velocity-weakening-friction",
        "viscous-friction",
        "rate-state-friction",
    ],
    &["force-bias", "force-gain", "load-dependent-friction", "added-inertia"],
    &[
        "static-ageing",
        "velocity-weakening-friction",
        "breakaway-bond",
        "rate-state-friction",
    ],
    &["detent", "latch", "snap-through"],
    &[
        "com-offset",
        "uneven-support-pressure",
        "tool-friction",
        "contact-point-offset",
    ],
    &["support-compliance", "length-scale", "tracking-error"],
];

/// Log-likelihood, nats, by which another cause has to fit worse for its misfit to be visible.
const MISFIT: f64 = 5.0;

/// One case, judged.
pub struct Seen {
    pub sort: Sort,
    pub scene: String,
    pub causes: Vec<String>,
    pub strength: f64,
    /// Effect size d'; nothing where the cause is not fitted by likelihood.
    pub size: Option<f64>,
    /// Held-out gain of a diagnosis that was told the cause.
    pub oracle: Option<f64>,
    /// With the true cause struck from the list: no name, or not one that stands alone.
    pub struck: Option<bool>,
    /// What was named then.
    pub stood_in: Vec<String>,
    /// That, or the name is one that the whole catalogue tells beside the true cause.
    pub declared: Option<bool>,
    /// By how much the true cause fits better than any single other does, nats.
    pub parted_from: Option<f64>,
    /// By how much the true cause fits better than all that was named once it was struck, nats.
    pub short: Option<f64>,
    /// Of a pair: a diagnosis that was told both causes, and no other, names both.
    pub visible: Option<bool>,
    /// Of a pair: the smaller of the two effect sizes, each over the plain model; nothing where one is not fitted by likelihood.
    pub smaller: Option<f64>,
    /// Of an effect outside the catalogue: what it changes of the readings, over their noise.
    pub shown: Option<f64>,
    /// Of causes that were not told apart: what came of the touches that were asked for.
    pub asked: Option<Parted>,
    /// Numbers of the finding that is right, and whether their intervals hold the truth.
    pub numbers: Vec<(String, bool)>,
    pub gain: Option<f64>,
    /// Of each finding all causes with their stated odds, its own first.
    pub odds: Vec<Vec<(String, f64)>>,
    pub verdict: Verdict,
    pub named: Vec<Vec<String>>,
    pub seconds: f64,
}

impl Seen {
    pub fn line(&self, number: u64) -> String {
        let size = self.size.or(self.smaller).map_or("-".into(), |d| format!("{d:.1}"));
        let hidden = if self.causes.is_empty() {
            "nothing".into()
        } else {
            self.causes.join(" and ")
        };
        let named: Vec<String> = self.named.iter().map(|n| n.join(" or ")).collect();
        let mark = if self.first_right() || (self.causes.is_empty() && self.named.is_empty()) {
            ' '
        } else {
            '*'
        };
        format!(
            "{mark}{number:>5} {:<13} {:<7} s {:.2} d' {size:>5}  {hidden:<34} {:<9} {}{}{}{} [{:.1} s]",
            self.scene,
            format!("{:?}", self.sort).to_lowercase(),
            self.strength,
            format!("{:?}", self.verdict).to_lowercase(),
            named.join("; "),
            self.odds
                .first()
                .map_or_else(String::new, |o| format!(" ({:.2})", o[0].1)),
            match (self.struck, self.visible) {
                (Some(false), _) => self.mimic(),
                (_, Some(true)) => " (both can be seen)".into(),
                _ => self
                    .shown
                    .map_or_else(String::new, |x| format!(" (changes {x:.1} noises)")),
            },
            self.asked.as_ref().map_or_else(String::new, came_of),
            self.seconds
        )
    }

    /// What stood in for the true cause when that was struck from the list.
    fn mimic(&self) -> String {
        let short = self.short.map_or_else(String::new, |n| format!(", {n:.1} nats short"));
        let declared = if self.declared == Some(true) {
            ", told beside it"
        } else {
            ""
        };
        format!(" (struck: {}{short}{declared})", self.stood_in.join("; "))
    }

    fn first_right(&self) -> bool {
        let (Some(cause), Some(first)) = (self.causes.first(), self.named.first()) else {
            return false;
        };
        first.first() == Some(cause)
    }

    fn in_class(&self) -> bool {
        let (Some(cause), Some(first)) = (self.causes.first(), self.named.first().and_then(|n| n.first())) else {
            return false;
        };
        cause == first
            || ALIASES
                .iter()
                .any(|a| a.contains(&cause.as_str()) && a.contains(&first.as_str()))
    }

    fn in_set(&self) -> bool {
        self.named.iter().flatten().any(|n| self.causes.first() == Some(n))
    }
}

fn came_of(asked: &Parted) -> String {
    let done = asked.done.join(", ");
    match asked.after {
        _ if asked.none => " (asked: no touch tells)".into(),
        Some(n) if asked.right => format!(" (asked: told after {n}: {done})"),
        Some(n) => format!(" (asked: WRONG after {n}: {done})"),
        None => format!(" (asked: not told: {done})"),
    }
}

/// A share with its 95 % interval.
pub fn share(name: &str, bar: &str, of: &[bool]) {
    let (n, k) = (of.len() as f64, of.iter().filter(|b| **b).count() as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |d| d.inverse_cdf(p));
    let low = if k == 0.0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
    let high = if k == n { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
    if n > 0.0 {
        println!(
            "{name:<62} {k:>4} of {n:<4} {:.3} [{low:.3}, {high:.3}]  bar {bar}",
            k / n
        );
    }
}

pub fn print_table(all: &[Seen]) {
    let of = |sort: Sort| all.iter().filter(move |s| s.sort == sort);
    let flags =
        |each: &mut dyn Iterator<Item = &Seen>, what: &dyn Fn(&Seen) -> bool| -> Vec<bool> { each.map(what).collect() };
    println!();
    let named = |s: &Seen| !s.named.is_empty();
    share(
        "false names on clean data",
        "<= 2 of 300",
        &flags(&mut of(Sort::Clean), &named),
    );
    for (low, high, bar) in [
        (0.0, 5.0, "-"),
        (5.0, 7.0, ">= 0.8"),
        (7.0, 10.0, ">= 0.9"),
        (10.0, f64::INFINITY, ">= 0.98"),
    ] {
        let within = |s: &&Seen| s.size.is_some_and(|d| d >= low && d < high);
        share(
            &format!("named at d' {low} to {high}"),
            bar,
            &flags(&mut of(Sort::Single).filter(within), &named),
        );
    }
    let plain = |s: &&Seen| s.size.is_none();
    share(
        "named, causes judged by another test than likelihood",
        "-",
        &flags(&mut of(Sort::Single).filter(plain), &named),
    );
    let clear = |s: &&Seen| s.size.is_none_or(|d| d >= 10.0) && !s.named.is_empty();
    share(
        "first name right, d' above 10 or judged otherwise, if named",
        ">= 0.92",
        &flags(&mut of(Sort::Single).filter(clear), &Seen::first_right),
    );
    share(
        "  within its alias class",
        ">= 0.96",
        &flags(&mut of(Sort::Single).filter(clear), &Seen::in_class),
    );
    share(
        "  truth in the stated set",
        ">= 0.97",
        &flags(&mut of(Sort::Single).filter(clear), &Seen::in_set),
    );
    let sets: Vec<usize> = of(Sort::Single).filter(clear).map(|s| s.named[0].len()).collect();
    println!(
        "  mean size of the first set {:.2}  bar <= 1.3",
        sets.iter().sum::<usize>() as f64 / sets.len().max(1) as f64
    );
    share(
        "  a second name",
        "<= 0.04",
        &flags(&mut of(Sort::Single).filter(clear), &|s| s.named.len() > 1),
    );
    outside(&of(Sort::Outside).collect::<Vec<_>>());
    let struck: Vec<bool> = all.iter().filter_map(|s| s.struck).collect();
    share("true cause struck, d' above 7: no sure name", ">= 0.8", &struck);
    share(
        "  or a name that the whole catalogue tells beside the true one",
        ">= 0.8",
        &all.iter().filter_map(|s| s.declared).collect::<Vec<_>>(),
    );
    let seen = |s: &&Seen| s.parted_from.is_some_and(|nats| nats > MISFIT);
    share(
        "  of those where no other cause fits within 5 nats of it",
        "-",
        &all.iter().filter(seen).filter_map(|s| s.struck).collect::<Vec<_>>(),
    );
    let misfits = |s: &&Seen| s.short.is_some_and(|nats| nats > MISFIT);
    share(
        "  of those where what was named fits 5 nats worse (visible misfit)",
        ">= 0.8",
        &all.iter().filter(misfits).filter_map(|s| s.struck).collect::<Vec<_>>(),
    );
    let both = |s: &Seen| s.causes.iter().all(|c| s.named.iter().flatten().any(|n| n == c));
    share(
        "two effects, both among the names",
        ">= 0.8",
        &flags(&mut of(Sort::Pair), &both),
    );
    share(
        "  of those that a diagnosis told both causes names both",
        ">= 0.8",
        &flags(&mut of(Sort::Pair).filter(|s| s.visible == Some(true)), &both),
    );
    share(
        "  of those of which each alone has a d' above 7",
        ">= 0.8",
        &flags(
            &mut of(Sort::Pair).filter(|s| s.smaller.is_some_and(|d| d > 7.0)),
            &both,
        ),
    );
    share(
        "two effects, one at least among the names",
        "-",
        &flags(&mut of(Sort::Pair), &|s| {
            s.causes.iter().any(|c| s.named.iter().flatten().any(|n| n == c))
        }),
    );
    share(
        "narrow protocol: truth in the set, or nothing said",
        "-",
        &flags(&mut of(Sort::Narrow), &|s| s.named.is_empty() || s.in_set()),
    );
    let asked: Vec<&Parted> = all.iter().filter_map(|s| s.asked.as_ref()).collect();
    share(
        "causes not told apart: parted rightly by three experiments",
        ">= 0.9",
        &asked
            .iter()
            .filter(|a| !a.none)
            .map(|a| a.after.is_some() && a.right)
            .collect::<Vec<_>>(),
    );
    share(
        "  of them: another cause told in the end",
        "-",
        &asked
            .iter()
            .filter(|a| !a.none)
            .map(|a| a.after.is_some() && !a.right)
            .collect::<Vec<_>>(),
    );
    share(
        "  of all: no touch of the pool tells, and it is said",
        "-",
        &asked.iter().map(|a| a.none).collect::<Vec<_>>(),
    );
    let mut ratios: Vec<f64> = of(Sort::Single)
        .filter(clear)
        .filter_map(|s| Some(s.gain? / s.oracle.filter(|o| *o > 0.05)?))
        .collect();
    ratios.sort_by(f64::total_cmp);
    if let Some(middle) = ratios.get(ratios.len() / 2) {
        println!(
            "held-out gain over that of a diagnosis told the cause: median {middle:.3} of {}  bar >= 0.98",
            ratios.len()
        );
    }
    let numbers: Vec<&(String, bool)> = of(Sort::Single)
        .filter(|s| s.first_right())
        .flat_map(|s| &s.numbers)
        .collect();
    share(
        "intervals of effects named rightly that hold the truth",
        "0.92 to 0.97",
        &numbers.iter().map(|n| n.1).collect::<Vec<_>>(),
    );
    let missed: Vec<&str> = numbers.iter().filter(|n| !n.1).map(|n| n.0.as_str()).collect();
    println!("  missed: {}", missed.join(", "));
    calibration(all);
    let slow = all.iter().map(|s| s.seconds).fold(0.0, f64::max);
    println!("slowest reconstruction and diagnosis: {slow:.1} s");
}
