//! A diagnosis of a model that there is already: its numbers are tried on the capture beside those that the capture
//! itself tells of the same shapes and joints.

use super::Options;
use super::carried::{Beside, carries, rubs_otherwise};
use super::given::{FORCE, doubt_carriers, table_friction};
use super::lumps::{as_lumps, lumps_of};
use super::welded::{Welded, bare};
use crate::base::{Estimate, Notices, Result};
use crate::capture::Capture;
use crate::stages::{diagnosis, estimation, interaction};
use crate::twin::{Compared, Friction, FrictionForce, Link, Model, RelationKind, Twin};
use crate::twin::{compared, joints_compared, placed_as, structure_compared};

/// What was found of a model.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What the plainest model with its numbers lacks.
    pub diagnosed: diagnosis::Diagnosed,
    /// What of that it has a number for, as cause and place: that number is tried among the others.
    pub carried: Vec<[String; 2]>,
    /// Its numbers beside measured ones.
    pub numbers: Vec<Compared>,
    /// What it holds together or lets move otherwise than was measured, in words.
    pub structure: Vec<String>,
    /// What it does not carry and a prediction needs, taken from the capture, in words.
    pub lent: Vec<String>,
}

/// What `model` gets wrong of `capture`; nothing is estimated.
pub fn diagnose(
    capture: &Capture,
    model: &Model,
    options: &Options,
    notices: &mut Notices,
) -> Result<diagnosis::Diagnosed> {
    let (sifted, faults) = interaction::sift(capture);
    let capture = sifted.as_ref().unwrap_or(capture);
    let segmented = interaction::segment(capture, model, &options.interaction, notices)?;
    let Some(whole) = Welded::of(capture, &segmented, model) else {
        return diagnosis::diagnose(capture, &segmented, model, &faults, &options.diagnosis, notices);
    };
    let Welded {
        capture,
        segmented,
        model,
        ..
    } = &whole;
    let mut diagnosed = diagnosis::diagnose(capture, segmented, model, &faults, &options.diagnosis, notices)?;
    whole.unfold(&mut diagnosed);
    Ok(diagnosed)
}

/// What a `model` that somebody wrote gets wrong of `capture`, of which `fresh` is a fit without the model.
pub fn judge(
    capture: &Capture,
    model: &Model,
    fresh: &Model,
    options: &Options,
    notices: &mut Notices,
) -> Result<Judged> {
    let lumps = lumps_of(capture, model);
    let structure = structure_compared(&lumps, &fresh.twin);
    let raw = capture;
    let capture = as_lumps(raw, &lumps.lumps);
    let mut given = lumps.model.clone();
    placed_as(&mut given, &fresh.twin);
    rests(&mut given, &fresh.twin);
    let (sifted, faults) = interaction::sift(&capture);
    let capture = sifted.as_ref().unwrap_or(&capture);
    interaction::warn_of_strangers(capture, &given, notices);
    let segmented = interaction::segment(capture, &given, &options.interaction, notices)?;

    // What the capture tells where shapes and joints are those of the model.
    let mut refit = bare(&given);
    let quiet = &mut Notices::default();
    estimation::identify(capture, &segmented, &mut refit, &options.estimation, quiet)?;

    let parted = |name: &str| {
        let alone = model.twin.body_of(name).is_some_and(|b| b.links.len() == 1);
        !alone || fresh.twin.link(name).is_none()
    };
    let lent = lend(&mut given, &refit, &fresh.twin, parted);
    let diagnosed = diagnosis::diagnose(capture, &segmented, &given, &faults, &options.diagnosis, notices)?;
    let of_links = |with: &Twin, several: bool| {
        let mut own = given.twin.clone();
        own.bodies
            .iter_mut()
            .for_each(|b| b.links.retain(|l| parted(&l.name) == several));
        compared(&own, with)
    };
    let whole = (capture, segmented.as_slice(), &refit);
    let beside = Beside::of(&model.twin, (raw, fresh), whole, (&faults, options))?;
    let mut numbers = of_links(&beside.fresh, false);
    numbers.extend(of_links(&beside.refit, true));
    let untold = |name: &str| {
        let found = numbers.iter().filter(|n| n.about == name);
        let told = found.map(|n| n.quantity.as_str());
        !told.into_iter().any(|q| q == FORCE || q == "friction.kinetic")
    };
    let dragged = table_friction(capture, &given, &diagnosed.traces);
    let plain = |name: &str| untold(name) && !rubs_otherwise(&model.twin, name);
    let dragged: Vec<Compared> = dragged.into_iter().filter(|n| plain(&n.about)).collect();
    numbers.extend(dragged);
    doubt_carriers(&mut numbers, &given);
    numbers.extend(joints_compared(&given.twin, &fresh.twin));
    numbers.extend(diagnosis::joint_numbers(capture, &segmented, &given, notices));
    beside.tell(&given.twin, &mut numbers);
    let of_its_own = diagnosed.diagnosis.findings.iter().filter(|f| carries(&model.twin, f));
    let carried = of_its_own.map(|f| [f.cause.clone(), f.place.clone()]).collect();
    Ok(Judged {
        diagnosed,
        carried,
        numbers,
        structure,
        lent,
    })
}

/// What rests on what, as it was found: no file says that.
fn rests(given: &mut Model, fresh: &Twin) {
    let known = |name: &str| given.twin.link(name).is_some();
    let resting = fresh.relations.iter().filter(|r| r.kind == RelationKind::Resting);
    let found: Vec<_> = resting.filter(|r| known(&r.a) && known(&r.b)).cloned().collect();
    given.twin.relations.extend(found);
}

/// Gives the model what it does not carry and a push cannot be foretold without: the finger's friction, how it resists
/// turning, and drag on the table where it says none.
fn lend(given: &mut Model, refit: &Model, fresh: &Twin, parted: impl Fn(&str) -> bool) -> Vec<String> {
    let mut words = Vec::new();
    let dragged =
        |l: &Link| !l.friction_force.is_empty() || l.friction.kinetic.is_some() || l.friction.static_.is_some();
    // What the model says to hang clear of the table does.
    let drags: Vec<String> = given
        .twin
        .bodies
        .iter()
        .filter(|b| b.links.iter().any(dragged))
        .map(|b| b.name.clone())
        .collect();
    let links = given.twin.bodies.iter_mut().flat_map(|b| {
        let says = drags.contains(&b.name);
        b.links.iter_mut().map(move |l| (says, l))
    });
    for (says, link) in links {
        let own = if parted(&link.name) { &refit.twin } else { fresh };
        let Some(found) = own.link(&link.name) else { continue };
        let Friction {
            tool,
            torsional_radius,
            creep_speed,
            creep_ratio,
            ..
        } = &found.friction;
        let mut lent: Vec<&str> = Vec::new();
        let mut give = |to: &mut Option<Estimate>, from: &Option<Estimate>, word| {
            if to.is_none() && from.is_some() {
                to.clone_from(from);
                lent.push(word);
            }
        };
        give(&mut link.friction.tool, tool, "friction of the tool");
        give(
            &mut link.friction.torsional_radius,
            torsional_radius,
            "resistance to turning",
        );
        if link.friction.creep_speed.is_none() && link.friction.creep_ratio.is_none() {
            give(&mut link.friction.creep_speed, creep_speed, "creep");
            give(&mut link.friction.creep_ratio, creep_ratio, "creep");
        }
        if !says && !found.friction_force.is_empty() {
            let FrictionForce { static_, kinetic } = &found.friction_force;
            link.friction_force.static_.clone_from(static_);
            link.friction_force.kinetic.clone_from(kinetic);
            lent.push("friction on the table");
        }
        if !lent.is_empty() {
            words.push(format!("{}: {}", link.name, lent.join(", ")));
        }
    }
    words
}
