//! The joint fit of one link written into it: the last word on mass and kinetic friction where the data part them,
//! what stays open where they do not, and the ledger of what each interaction did.

use super::Config;
use super::accelerate::Accelerated;
use super::facts::Facts;
use super::friction_force::Sliding;
use super::loaded::METHOD;
use super::pool::{positive, relative_sd};
use super::resolve::{Before, STAGE};
use super::together::{Moved, NOISY, Prior, Together, Word, learnt, ledger, left_open, together};
use crate::base::{Estimate, Notices};
use crate::twin::{LedgerEntry, Link};

/// Relative doubt below which a number counts as known.
const ENOUGH: f64 = 0.15;
/// Share by which the doubt must grow without an interaction for the number to rest on it.
const RESTS: f64 = 1.02;
/// Share of the prior's doubt that is left where the data say nothing of a direction.
const NOTHING: f64 = 0.9;

/// Fits everything that was done to `link` together and writes it.
pub(super) fn combine(
    link: &mut Link,
    facts: &Facts,
    sliding: &Sliding,
    before: &Before,
    g: f64,
    config: &Config,
    notices: &mut Notices,
) {
    let mut words = words_of(facts, sliding, g);
    // What all drags under loads say together stands for one weighing.
    let loaded = link.mass.as_ref().filter(|m| m.method == METHOD);
    words.extend(loaded.and_then(|m| Word::weighed(m.from.first()?, (m.value, m.sd?))));
    let prior = prior_of(sliding, before, config);
    let Some(found) = together(&words, &prior, config.friction_scatter) else {
        return;
    };
    let blind = learnt(&found, &prior).is_some_and(|l| l[0] > NOTHING);
    if let Some(said) = left_open(&found, ENOUGH).filter(|_| blind) {
        notices.note(STAGE, &link.name, said);
    }
    let moved = ledger(&words, &prior, config.friction_scatter);
    link.ledger = moved.iter().flat_map(entries).collect();
    // Near the noise of the force logarithms are crooked.
    let middle = sliding.kinetic.value;
    let noisy = sliding.trials.iter().any(|(_, (_, sd))| *sd > NOISY * middle);
    let least = if noisy { 0.5 } else { 0.0 };
    write(&mut link.mass, &found, 0, &moved, least);
    write(&mut link.friction.kinetic, &found, 1, &moved, least);
    let parted = [&link.mass, &link.friction.kinetic].into_iter().flatten();
    if parted.filter(|e| e.is_measured()).count() == 2 {
        write_force(&mut link.friction_force.kinetic, &found, g, least);
    }
}

/// The force of friction, with what pushes are off in common, as the two factors have it: a push that strayed carries it no more
/// than it does those.
fn write_force(target: &mut Option<Estimate>, found: &Together, g: f64, least: f64) {
    let Some(old) = target.as_ref().filter(|e| e.is_measured()) else {
        return;
    };
    let (value, sd) = (g * found.x.sum().exp(), found.sd([1.0; 3]));
    let apart = (value / old.value).ln().abs();
    let extra = (apart - 2.0 * sd.hypot(relative_sd(old))).max(least * apart);
    let method = format!("{}, joint-fit", old.method);
    *target = Some(positive(value, sd.hypot(extra), &old.unit, old.from.clone(), &method));
}

fn words_of(facts: &Facts, sliding: &Sliding, g: f64) -> Vec<Word> {
    let alone = facts.weighings.iter().filter(|w| w.along.is_empty());
    let lifts = alone.filter_map(|w| Word::weighed(&w.interaction, (w.mass, w.sd)));
    // Where inertia showed, the motion as a whole tells friction better than its steady part.
    let driven: Vec<&Accelerated> = facts.driven().iter().collect();
    let whole = |name: &String| driven.iter().any(|a| a.interaction == *name);
    let pushes = sliding
        .trials
        .iter()
        .filter(|(name, _)| !whole(name))
        .filter_map(|(name, (f, sd))| Word::pushed_about(name, (f / g, sd / g), sliding.kinetic.value / g));
    let both = driven
        .iter()
        .flat_map(|a| Word::driven(&a.interaction, a.mass, (a.friction.0 / g, a.friction.1 / g), a.shared));
    let tilts = facts
        .slides
        .iter()
        .filter_map(|s| Word::slid(&s.interaction, s.kinetic));
    let coasts = facts
        .coasts
        .iter()
        .filter_map(|c| Word::slid(&c.interaction, c.kinetic));
    lifts.chain(both).chain(pushes).chain(tilts).chain(coasts).collect()
}

fn prior_of(sliding: &Sliding, before: &Before, config: &Config) -> Prior {
    let (mass, mass_sd) = before.mass(config);
    let (friction, friction_sd) = before.kinetic(config);
    let common = sliding.common / sliding.kinetic.value;
    Prior {
        mean: [mass.ln(), friction.ln(), 0.0],
        sd: [mass_sd, (friction_sd / friction).max(1e-3), common.max(1e-4)],
    }
}

/// Writes one number, where the closed forms already found that the data fix it; `least` of what lies between the two is
/// doubted in any case.
fn write(target: &mut Option<Estimate>, found: &Together, k: usize, moved: &[Moved], least: f64) {
    let Some(old) = target.as_ref().filter(|e| e.is_measured()) else {
        return;
    };
    let (value, sd) = (found.x[k].exp(), found.covariance[(k, k)].sqrt());
    // Closed form and joint fit are two ways to one number: far apart, neither is to be trusted beyond the other.
    let apart = (value / old.value).ln().abs();
    let extra = (apart - 2.0 * sd.hypot(relative_sd(old))).max(least * apart);
    let mut rests: Vec<&Moved> = moved.iter().filter(|m| m.doubt[k] > RESTS).collect();
    rests.sort_by(|a, b| b.doubt[k].total_cmp(&a.doubt[k]));
    let mut from: Vec<String> = Vec::new();
    for name in rests.iter().map(|m| &m.interaction) {
        if !from.contains(name) {
            from.push(name.clone());
        }
    }
    if from.is_empty() {
        from.clone_from(&old.from);
    }
    let ends = found.ci95[k].map(|end| {
        let off = end - found.x[k];
        value * (off.signum() * off.hypot(1.96 * extra)).exp()
    });
    *target = Some(
        Estimate::measured(
            value,
            value * sd.hypot(extra),
            &old.unit,
            from,
            &format!("{}, joint-fit", old.method),
        )
        .with_interval(ends),
    );
}

fn entries(moved: &Moved) -> [LedgerEntry; 2] {
    ["mass", "friction.kinetic"].map(|quantity| {
        let k = usize::from(quantity != "mass");
        LedgerEntry {
            interaction: moved.interaction.clone(),
            quantity: quantity.into(),
            moved: moved.by[k],
            doubt_without: moved.doubt[k],
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_push_that_strays_carries_the_force_no_more_than_the_friction() {
        let prior = Prior {
            mean: [-0.7, -1.2, 0.0],
            sd: [0.7, 0.5, 0.007],
        };
        // 0.5 kg and 0.3, in kilograms; one push of five is 40 % low.
        let pushes = [0.15, 0.1502, 0.1497, 0.15, 0.09];
        let words = pushes.iter().filter_map(|p| Word::pushed("push", (*p, 6e-4)));
        let words: Vec<Word> = Word::weighed("lift", (0.5, 1e-3)).into_iter().chain(words).collect();
        let found = together(&words, &prior, 0.015).expect("solved");
        let mean = 9.81 * pushes.iter().sum::<f64>() / 5.0;
        let mut force = Some(Estimate::measured(mean, 0.1, "N", vec!["push".into()], "test"));
        write_force(&mut force, &found, 9.81, 0.0);
        let force = force.expect("a force");
        let product = 9.81 * (found.x[0] + found.x[1]).exp();
        assert!((force.value / product - 1.0).abs() < 5e-3, "{} {product}", force.value);
        assert!(
            (force.value / 1.4715 - 1.0).abs() < 0.03 && mean < 1.36,
            "{}",
            force.value
        );
        assert!(force.ci95.is_some_and(|[low, high]| low < 1.4715 && 1.4715 < high));
    }
}
