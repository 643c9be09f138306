//! Links that were only moved together: what is known is their sum, and it is shared out with the doubt that
//! this leaves.

use std::collections::{BTreeMap, BTreeSet};

use super::Config;
use super::facts::{Facts, Ground};
use super::friction_force::sliding_from;
use super::lift::Weighing;
use super::pool::relative_sd;
use super::push::Push;
use super::resolve::{Before, STAGE};
use super::surface::SurfacePrior;
use super::whole::Whole;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::physics::above;
use crate::twin::{Link, Model, Twin};

/// Shares out weighings and pushes of rigid groups.
pub(super) fn share_out(
    model: &mut Model,
    facts: &BTreeMap<String, Facts>,
    befores: &BTreeMap<String, Before>,
    ground: &Ground,
    config: &Config,
    notices: &mut Notices,
) {
    let of = |(name, found): (&String, &Facts)| -> Vec<Whole> {
        let each = found.weighings.iter();
        each.map(|w| Whole::of(name, w)).collect()
    };
    let wholes: Vec<Whole> = facts.iter().flat_map(of).collect();
    for (name, found) in facts {
        for weighing in found.weighings.iter().filter(|w| !w.along.is_empty()) {
            share_weight(&mut model.twin, name, weighing, befores, config, notices);
        }
        share_friction(model, name, found, (befores, &wholes), ground, config, notices);
    }
}

fn links_of(twin: &Twin, names: &[String]) -> Vec<Link> {
    let find = |n: &String| twin.links().find(|(_, l)| l.name == *n).map(|(_, l)| l.clone());
    names.iter().filter_map(find).collect()
}

fn assumed_mass(link: &Link, befores: &BTreeMap<String, Before>, config: &Config) -> (f64, f64) {
    match &link.mass {
        Some(m) => (m.value, relative_sd(m).max(1e-4)),
        None => befores.get(&link.name).map_or((0.4, 1.2), |b| b.mass(config)),
    }
}

/// Mean and log standard deviation of the share of the sum that `own` has, its own and the rest's logs independent.
fn share(own: (f64, f64), rest: (f64, f64)) -> (f64, f64) {
    let share = own.0 / (own.0 + rest.0);
    (share, (1.0 - share) * own.1.hypot(rest.1))
}

/// Sum of masses with the standard deviation of its logarithm.
fn sum_of(masses: &[(f64, f64)]) -> (f64, f64) {
    let total: f64 = masses.iter().map(|m| m.0).sum();
    let variance: f64 = masses.iter().map(|m| (m.0 * m.1).powi(2)).sum();
    (total, variance.sqrt() / total.max(1e-300))
}

/// Log standard deviation from which on a mass counts as weighed, and the most of a group that weighed parts may be.
pub(super) const WEIGHED: f64 = 0.05;
const MOST: f64 = 0.9;

/// What one part has of a group that was moved as one.
#[derive(Clone, Copy, Debug)]
struct Portion {
    share: f64,
    /// Log standard deviations of the share, and of the share of the total mass.
    share_sd: f64,
    mass_sd: f64,
}

/// Portions of a group of `total` mass: a part that was weighed, or whose mass is told otherwise (`told`), has that, the others
/// part the rest by what is assumed of them.
fn portions(masses: &[(f64, f64)], told: &[bool], total: (f64, f64)) -> Vec<Portion> {
    let weighed = |k: &usize| masses[*k].1 < WEIGHED || told[*k];
    let pick = |of: &dyn Fn(&usize) -> bool| -> Vec<(f64, f64)> {
        (0..masses.len()).filter(|k| of(k)).map(|k| masses[k]).collect()
    };
    let taken = sum_of(&pick(&weighed));
    let known = taken.0 / total.0;
    let left = (1.0 - known).max(1.0 - MOST);
    let open = (total.1 * known).hypot(taken.1 * known) / left;
    let one = |k: usize| {
        if weighed(&k) {
            return Portion {
                share: masses[k].0 / total.0,
                share_sd: masses[k].1.hypot(total.1),
                mass_sd: masses[k].1,
            };
        }
        let (own, own_sd) = share(masses[k], sum_of(&pick(&|j| *j != k && !weighed(j))));
        Portion {
            share: left * own,
            share_sd: own_sd.hypot(open),
            mass_sd: own_sd.hypot(total.1.hypot(taken.1 * known) / left),
        }
    };
    (0..masses.len()).map(one).collect()
}

/// A mass of `link` with what rose with it: subtracts what is known of the others, else splits by volume.
fn share_weight(
    twin: &mut Twin,
    name: &str,
    weighing: &Weighing,
    befores: &BTreeMap<String, Before>,
    config: &Config,
    notices: &mut Notices,
) {
    let mut group = vec![name.to_string()];
    group.extend(weighing.along.iter().cloned());
    let links = links_of(twin, &group);
    let known: Vec<&Link> = links
        .iter()
        .filter(|l| l.mass.as_ref().is_some_and(|m| m.status != Status::Assumed))
        .collect();
    let open: Vec<&Link> = links
        .iter()
        .filter(|l| !known.iter().any(|k| k.name == l.name))
        .collect();
    let taken: f64 = known.iter().filter_map(|l| l.mass.as_ref()).map(|m| m.value).sum();
    let variance: f64 = known
        .iter()
        .filter_map(|l| l.mass.as_ref())
        .map(|m| (relative_sd(m) * m.value).powi(2))
        .sum();
    let left = weighing.mass - taken;
    let from = vec![weighing.interaction.clone()];
    if let ([only], true) = (&open[..], left > 0.0) {
        let sd = (weighing.sd.powi(2) + variance).sqrt();
        let mass = Estimate::measured(left, sd, "kg", from, "lift, the rest subtracted");
        if let Some(link) = twin.link_mut(&only.name) {
            link.mass = Some(mass);
        }
        return;
    }
    let sum = group
        .iter()
        .map(|n| format!("mass({n})"))
        .collect::<Vec<_>>()
        .join(" + ");
    notices.warn(
        STAGE,
        name,
        format!(
            "{} lifted {:.4} kg of several bodies at once: only {sum} is known",
            weighing.interaction, weighing.mass
        ),
    );
    for link in &open {
        let own = assumed_mass(link, befores, config);
        let others = open.iter().filter(|o| o.name != link.name);
        let rest = sum_of(&others.map(|o| assumed_mass(o, befores, config)).collect::<Vec<_>>());
        let (share, log_sd) = share(own, rest);
        let mut mass = super::pool::positive(
            left * share,
            log_sd.hypot(weighing.sd / weighing.mass),
            "kg",
            from.clone(),
            "lift, split by volume",
        );
        mass.status = Status::Assumed;
        mass.confounded = Some(Confounded {
            with: group
                .iter()
                .filter(|n| **n != link.name)
                .map(|n| format!("mass({n})"))
                .collect(),
            known: format!("{sum} = {:.4} kg", weighing.mass),
            experiment: "lift them one by one".into(),
        });
        if let Some(link) = twin.link_mut(&link.name) {
            link.mass = Some(mass);
        }
    }
}

/// Friction of a group that was pushed as one: the sum is measured, the parts are assumed.
fn share_friction(
    model: &mut Model,
    name: &str,
    facts: &Facts,
    (befores, wholes): (&BTreeMap<String, Before>, &[Whole]),
    ground: &Ground,
    config: &Config,
    notices: &mut Notices,
) {
    let Some((others, _)) = facts.shared.first() else {
        return;
    };
    let of_all = facts.shared.iter().filter(|(o, _)| o == others);
    let pushes: Vec<Push> = of_all.map(|(_, p)| p.clone()).collect();
    let mut group = vec![name.to_string()];
    group.extend(others.iter().cloned());
    let links = links_of(&model.twin, &group);
    if links.len() != group.len() || links[0].friction_force.kinetic.is_some() {
        return;
    }
    let g = ground.gravity.norm();
    let masses: Vec<(f64, f64)> = links.iter().map(|l| assumed_mass(l, befores, config)).collect();
    let total: f64 = masses.iter().map(|m| m.0).sum();
    let mu = befores.get(name).map_or(config.friction_prior, |b| b.kinetic(config));
    let (centre, spread) = befores.get(name).map(Before::centre).unwrap_or_default();
    let mut prior = SurfacePrior {
        centre: centre.coords,
        centre_sd: spread.map(|s| (3.0 * s).max(0.01)),
        radius: 0.04,
        radius_log_sd: 0.7,
        weight: g * total,
        mass: total,
    };
    let Some(first) = sliding_from(&pushes, &prior, config, None, name) else {
        return;
    };
    prior.weight = first.kinetic.value / mu.0;
    prior.mass = prior.weight / g;
    let Some(sliding) = sliding_from(&pushes, &prior, config, None, name) else {
        return;
    };
    let sum = sum_in_words(name, &links);
    notices.warn(
        STAGE,
        name,
        format!("only moved together with {}: only {sum} is measured", others.join(", ")),
    );
    let told: Vec<bool> = links.iter().map(|l| l.mass.is_some()).collect();
    let parts: BTreeSet<String> = group.iter().cloned().collect();
    let one_by_one = Whole::of_parts(&links);
    let whole = wholes.iter().find(|w| w.parts == parts).or(one_by_one.as_ref());
    let group_mass = whole.map_or_else(
        || mass_of_all(&masses, &told, supposed(&masses, sliding.kinetic.value / g, mu)),
        |w| (w.mass, (w.sd / w.mass).max(1e-4)),
    );
    let known = format!("{sum} = {:.4} N", sliding.kinetic.value);
    for (part, portion) in links.iter().zip(portions(&masses, &told, group_mass)) {
        write_share(
            &mut model.twin,
            part,
            &sliding.kinetic,
            portion,
            group_mass,
            g,
            &known,
            &group,
        );
    }
    // What is driven ahead beside it rubs by itself; what stands on it, or rose with it, presses it down.
    let lifted = wholes.iter().any(|w| w.parts == parts);
    let bears = lifted || others.iter().all(|other| above(model, name, other));
    if let Some(whole) = whole.filter(|_| bears) {
        whole.tells_friction(&mut model.twin, name, &sliding.kinetic, g);
    }
}

/// Mass of a group that was not weighed, and the standard deviation of its logarithm: of parts that are `told` their sum, else what is
/// `supposed` of it, but no less than leaves something to the others.
fn mass_of_all(masses: &[(f64, f64)], told: &[bool], (log, sd): (f64, f64)) -> (f64, f64) {
    if told.iter().all(|t| *t) {
        return sum_of(masses);
    }
    let of_told = masses.iter().zip(told).filter(|(m, told)| m.1 < WEIGHED || **told);
    let least = of_told.map(|(m, _)| m.0).sum::<f64>() / MOST;
    (log.exp().max(least), sd)
}

/// Logarithm of a group's mass and its standard deviation: the shapes' opinion and the `force` of friction, in weights of 1 kg,
/// over the assumed friction.
fn supposed(masses: &[(f64, f64)], force: f64, mu: (f64, f64)) -> (f64, f64) {
    let total: f64 = masses.iter().map(|m| m.0).sum();
    // One part may be much heavier than thought, none much lighter than nothing: the doubt is that of the heavy side.
    let heavy = |m: &(f64, f64)| (1.0 + m.0 / total * ((1.96 * m.1).exp() - 1.0)).ln() / 1.96;
    let shape_sd = masses.iter().map(|m| heavy(m).powi(2)).sum::<f64>().sqrt();
    let w = [shape_sd.powi(-2), (mu.1 / mu.0).powi(-2)];
    let log = (w[0] * total.ln() + w[1] * (force / mu.0).ln()) / (w[0] + w[1]);
    (log, (w[0] + w[1]).recip().sqrt())
}

/// What a push of all parts tells. A part that also slid by itself rubs on what carries it: then the lead bears all weights.
fn sum_in_words(name: &str, links: &[Link]) -> String {
    let joined = |what: &str| {
        let each = links.iter().map(|l| format!("{what}({})", l.name));
        each.collect::<Vec<_>>().join(" + ")
    };
    if links.iter().any(slid_alone) {
        format!("friction.kinetic({name}) * ({}) * g", joined("mass"))
    } else {
        joined("friction_force.kinetic")
    }
}

/// Whether a push of a part by itself measured its friction force.
fn slid_alone(link: &Link) -> bool {
    link.friction_force.kinetic.as_ref().is_some_and(Estimate::is_measured)
}

#[expect(clippy::too_many_arguments, reason = "one row of the table of shares")]
fn write_share(
    twin: &mut Twin,
    part: &Link,
    force: &Estimate,
    portion: Portion,
    mass: (f64, f64),
    g: f64,
    known: &str,
    group: &[String],
) {
    let confounded = |quantity: &str| Confounded {
        with: group
            .iter()
            .filter(|n| **n != part.name)
            .map(|n| format!("{quantity}({n})"))
            .collect(),
        known: known.into(),
        experiment: "push or lift them one by one".into(),
    };
    let assumed = |value: f64, log_sd: f64, unit: &str, quantity: &str| {
        let mut e = super::pool::positive(
            value,
            log_sd,
            unit,
            force.from.clone(),
            "push of the group, shared by volume",
        );
        e.status = Status::Assumed;
        e.confounded = Some(confounded(quantity));
        e
    };
    let Some(link) = twin.link_mut(&part.name) else { return };
    let relative = relative_sd(force);
    if !slid_alone(link) {
        link.friction_force.kinetic = Some(assumed(
            force.value * portion.share,
            portion.share_sd.hypot(relative),
            "N",
            "friction_force.kinetic",
        ));
    }
    if link.mass.is_none() {
        link.mass = Some(assumed(mass.0 * portion.share, portion.mass_sd, "kg", "mass"));
    }
    if link.friction.kinetic.is_none() {
        link.friction.kinetic = Some(assumed(force.value / (mass.0 * g), mass.1.hypot(relative), "1", "mass"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_friction_of_a_part_that_was_weighed_is_as_open_as_that_of_the_group() {
        let masses = [(0.35, 0.7), (0.3, 1e-3)];
        let (mass, force) = ((0.8, 0.3), 3.9);
        let found = portions(&masses, &[false, true], mass);
        let (low, top) = (found[0], found[1]);
        // Of one kind with its own weight: the force is mu m g with the group's mu.
        let mu = force / (mass.0 * 9.81);
        assert!((force * top.share - mu * 0.3 * 9.81).abs() < 1e-9, "{top:?}");
        assert!(top.share_sd > 0.29 && top.mass_sd < 2e-3, "{top:?}");
        assert!(
            (low.share + top.share - 1.0).abs() < 1e-12 && low.share_sd > 0.1,
            "{low:?}"
        );
    }

    #[test]
    fn parts_that_nobody_weighed_are_as_open_as_their_shapes() {
        let found = portions(&[(0.4, 0.7), (0.1, 0.7)], &[false; 2], (0.5, 0.4));
        assert!((found[0].share - 0.8).abs() < 1e-12, "{found:?}");
        assert!(
            found[1].share_sd > found[0].share_sd && found[1].mass_sd > 0.8,
            "{found:?}"
        );
    }

    /// The upper one was pushed by itself, which tells its mass badly; the lower one bears what is left of the group's.
    #[test]
    fn a_part_whose_mass_is_told_badly_keeps_it_and_the_sum_stays() {
        let (masses, group) = ([(0.5, 0.7), (0.325, 0.3)], (0.88, 0.25));
        let [low, top] = portions(&masses, &[false, true], group).try_into().expect("two");
        assert!((low.share + top.share - 1.0).abs() < 1e-12);
        assert!((top.share * group.0 - 0.325).abs() < 1e-12, "{top:?}");
        // As doubtful as what is taken away.
        assert!(low.share_sd > 0.2, "{low:?}");
        // Where both are told, the whole is their sum, whatever is supposed of it.
        let (whole, sd) = mass_of_all(&[(0.5, 0.01), (0.325, 0.3)], &[true; 2], (0.0, 0.2));
        assert!((whole - 0.825).abs() < 1e-12 && sd > 0.1 && sd < 0.13, "{sd}");
        let (open, _) = mass_of_all(&masses, &[false, true], (0.2_f64.ln(), 0.2));
        assert!((open - 0.325 / MOST).abs() < 1e-12);
    }
}
