//! The touches that would part what these data cannot tell apart, worked out with the forward models of the causes that are left.

use rayon::prelude::*;

use super::outlook::{Outlook, entropy, information};
use super::words::words_of;
use crate::base::{Seed, rng_for};
use crate::stages::diagnosis::family::Family;
use crate::stages::diagnosis::fit::Fit;
use crate::stages::diagnosis::marginal::{Point, predict, weights};
use crate::stages::diagnosis::naming::Ladder;
use crate::twin::{AskedTouch, Experiment, Finding};

/// A family with touches that nobody has made yet.
pub struct Imagined {
    /// The family, a group for each of the touches behind those that were measured.
    pub family: Box<dyn Family>,
    pub touches: Vec<AskedTouch>,
}

/// The place of a finding, and what would part its causes.
pub type Asked = (String, Experiment);

/// At most this many touches are asked for at once.
const TOUCHES: usize = 3;
/// A touch that adds less, bits, is not worth making; share of the entropy that is left when the cause is as good as known.
const LEAST: f64 = 0.05;
const KNOWN: f64 = 0.1;
/// Share of the entropy that all touches together have to take away to be asked for.
const TELLS: f64 = 0.2;

/// What of the pool of touches of a family parts the causes of one of its findings best; nothing where none does.
pub fn asked(family: &dyn Family, ladder: &Ladder, finding: &Finding) -> Option<Asked> {
    let members = members(family, ladder, finding)?;
    let total: f64 = members.iter().map(|m| m.1).sum();
    let odds: Vec<f64> = members.iter().map(|m| m.1 / total).collect();
    let imagined = family.imagined()?;
    let first = imagined.family.groups().len() - imagined.touches.len();
    let outlook = |touch: usize| -> Vec<Outlook> {
        let one = |m: &Member| Outlook::of(&*imagined.family, first + touch, m.2, &ladder.full.noise);
        members.iter().map(one).collect()
    };
    let pool: Vec<Vec<Outlook>> = (0..imagined.touches.len()).into_par_iter().map(outlook).collect();
    let whole = entropy(&odds);
    let (chosen, bits) = choose(&pool, &odds);
    if bits < TELLS * whole {
        return None;
    }
    let touches: Vec<AskedTouch> = chosen.iter().map(|k| imagined.touches[*k].clone()).collect();
    let each: Vec<String> = touches.iter().map(words_of).collect();
    let told = foretold(&imagined, first + chosen[0], &members);
    let experiment = Experiment {
        words: format!("{}{told}", each.join(", then ")),
        parts: members.iter().map(|m| m.0.to_owned()).collect(),
        bits: Some(bits),
        touches,
    };
    Some((finding.place.clone(), experiment))
}

/// A cause, its probability, and the fit of the model that has it.
type Member<'a> = (&'a str, f64, &'a Fit);

/// The cause of a finding and those that it was not told from.
fn members<'a>(family: &'a dyn Family, ladder: &'a Ladder, finding: &Finding) -> Option<Vec<Member<'a>>> {
    let cause = |law: usize| family.laws()[law].cause;
    let taken = ladder.taken.iter().find(|t| cause(t.law) == finding.cause)?;
    let mut out: Vec<Member> = vec![(cause(taken.law), finding.probability, &ladder.full)];
    for other in &finding.alternatives {
        let own = taken.rivals.iter().filter(|r| cause(r.law) == other.cause);
        if let Some(best) = own.max_by(|a, b| a.gain.total_cmp(&b.gain)) {
            out.push((cause(best.law), other.probability, &best.fit));
        }
    }
    (out.len() > 1).then_some(out)
}

/// The best touch, then the one that adds most to it, and so on; and what all of them are worth, bits.
fn choose(pool: &[Vec<Outlook>], odds: &[f64]) -> (Vec<usize>, f64) {
    let whole = entropy(odds);
    let (mut chosen, mut so_far, mut bits) = (Vec::new(), vec![Outlook::default(); odds.len()], 0.0);
    while chosen.len() < TOUCHES && whole - bits > KNOWN * whole {
        let joined = |k: usize| -> Vec<Outlook> { so_far.iter().zip(&pool[k]).map(|(a, b)| a.and(b)).collect() };
        // The same dice for all, so that they are compared and not their luck.
        let worth = |k: usize| {
            let dice = &mut rng_for(Seed(chosen.len() as u64), "worth of a touch");
            (k, information(&joined(k), odds, dice))
        };
        let each: Vec<(usize, f64)> = (0..pool.len()).into_par_iter().map(worth).collect();
        let Some((best, all)) = each.into_iter().reduce(|a, b| if b.1 > a.1 { b } else { a }) else {
            break;
        };
        if all - bits < LEAST {
            break;
        }
        so_far = joined(best);
        chosen.push(best);
        bits = all;
    }
    (chosen, bits)
}

/// What a touch would read under each cause, in words: on its first channel, where they lie farthest apart.
fn foretold(imagined: &Imagined, group: usize, members: &[Member]) -> String {
    let family = &*imagined.family;
    let Some(channel) = family.groups()[group].channels.first() else {
        return String::new();
    };
    let unit = family.kinds()[channel.kind].quantity.unit();
    let none = vec![0.0; family.scatter().len()];
    let sure = weights(family, group);
    let read = |fit: &Fit| {
        let point = Point {
            laws: &fit.laws,
            theta: &fit.theta,
        };
        predict(family, group, &point, &none)
    };
    let each: Vec<Vec<f64>> = members.iter().map(|m| read(m.2)).collect();
    let apart = |i: usize| {
        let own = || each.iter().map(|r| r[i]);
        sure[i] * (own().fold(f64::NEG_INFINITY, f64::max) - own().fold(f64::INFINITY, f64::min))
    };
    let Some(most) = (0..channel.measured.len()).max_by(|a, b| apart(*a).total_cmp(&apart(*b))) else {
        return String::new();
    };
    let one = |(m, r): (&Member, &Vec<f64>)| format!("{:.3} {unit} if it is {}", r[most], m.0);
    let words: Vec<String> = members.iter().zip(&each).map(one).collect();
    format!("; where they differ most the first reads {}", words.join(", "))
}
