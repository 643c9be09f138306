//! The verb of the relations pass.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::Config;
use super::carried::Carried;
use super::evidence::{Finding, finding};
use super::placing::{Bearing, Placed, bearing, placed, table, up};
use super::support::standing;
use crate::base::{Estimate, Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::{Joint, JointKind, Model, Relation, RelationKind};

/// The arcs of the constraint graph. `model` already holds the joints, so that jointed pairs come out
/// with the freedom of their joint.
///
/// A pair that was never tried apart is `unknown`, never `fixed`. A thing that merely rests can be taken off:
/// it has all six freedoms.
///
/// # Errors
/// Settings that cannot work.
pub fn relate(
    capture: &Capture,
    _segmented: &[Segmented],
    model: &Model,
    config: &Config,
    notices: &mut Notices,
) -> Result<Vec<Relation>> {
    config.check()?;
    let mut out: Vec<Relation> = model.twin.joints().map(jointed).collect();
    let things = placed(model);
    let up = up(capture, model);
    let hung = hung_together(model);
    let carried = Carried::of(capture, &up);
    for (k, a) in things.iter().enumerate() {
        for b in &things[k + 1..] {
            // Where two origins lie says nothing of links that joints carry.
            let by_joints = (a.mesh.is_none() || b.mesh.is_none()) && hung[&a.name] == hung[&b.name];
            if by_joints || joined(&out, &a.name, &b.name) {
                continue;
            }
            let (below, above) = (carried.bears(&a.name, &b.name), carried.bears(&b.name, &a.name));
            if carried.by_another(&a.name, &b.name) || carried.by_another(&b.name, &a.name) {
                continue;
            }
            let bearing = match bearing(a, b, &up, config) {
                Some(Bearing::Beside | Bearing::Perhaps) if below => Some(Bearing::SecondOnTop),
                Some(Bearing::Beside | Bearing::Perhaps) if above => Some(Bearing::FirstOnTop),
                as_seen => as_seen,
            };
            if let Some(bearing) = bearing {
                out.extend(pair(capture, (a, b), bearing, &up, config, notices));
            }
        }
    }
    if let Some(table) = table(capture, model) {
        let children: Vec<&str> = model.twin.joints().map(|j| j.child.as_str()).collect();
        let rooted = |t: &&Placed| t.mesh.is_some() || !children.contains(&t.name.as_str());
        let on_table: Vec<Relation> = things
            .iter()
            .filter(rooted)
            .filter(|t| !carried.is_borne(&t.name))
            .filter(|t| t.mesh.is_some() || !lies_on_another(&out, &t.name))
            .filter_map(|t| Some((t, standing(capture, t, &table, &up, config)?)))
            .map(|(t, arc)| {
                if children.contains(&t.name.as_str()) {
                    hanging(arc)
                } else {
                    arc
                }
            })
            .collect();
        out.extend(on_table);
    }
    Ok(out)
}

/// What hangs on a joint may hang clear of the table, however low its unseen foot was closed: the joint bears it.
fn hanging(arc: Relation) -> Relation {
    Relation {
        kind: RelationKind::Unknown,
        probability: 0.5,
        ..arc
    }
}

/// The topmost link that each hangs on by joints, itself where it hangs on none.
fn hung_together(model: &Model) -> BTreeMap<String, String> {
    let above = |name: &str| model.twin.joints().find(|j| j.child == name).map(|j| j.parent.as_str());
    let top = |name: &str| {
        // A tree is no deeper than it has joints.
        let steps = 0..model.twin.joints().count();
        let mut at = name.to_owned();
        for _ in steps {
            at = above(&at).map_or(at.clone(), str::to_owned);
        }
        at
    };
    model
        .twin
        .links()
        .map(|(_, l)| (l.name.clone(), top(&l.name)))
        .collect()
}

fn joined(arcs: &[Relation], a: &str, b: &str) -> bool {
    arcs.iter().any(|r| (r.a == a && r.b == b) || (r.a == b && r.b == a))
}

/// True for the upper of a stack: the second of an arc is the one on top.
fn lies_on_another(arcs: &[Relation], name: &str) -> bool {
    arcs.iter().any(|r| r.b == name)
}

fn jointed(joint: &Joint) -> Relation {
    let (rotation_dof, translation_dof) = joint.kind.freedom();
    Relation {
        a: joint.parent.clone(),
        b: joint.child.clone(),
        kind: match joint.kind {
            JointKind::Fixed => RelationKind::Fixed,
            JointKind::Revolute => RelationKind::Revolute,
            JointKind::Prismatic => RelationKind::Prismatic,
            JointKind::Screw => RelationKind::Screw,
            JointKind::Cylindrical => RelationKind::Cylindrical,
            JointKind::Planar => RelationKind::Planar,
            JointKind::Spherical => RelationKind::Spherical,
        },
        rotation_dof,
        translation_dof,
        probability: joint.probability,
        from: joint.axis.from.clone(),
        breakaway: joint
            .effort
            .as_ref()
            .and_then(|e| e.latch.as_ref())
            .map(|l| l.force.clone()),
    }
}

/// The arc between two things that bear on each other.
fn pair(
    capture: &Capture,
    (a, b): (&Placed, &Placed),
    bearing: Bearing,
    up: &Vector3<f64>,
    config: &Config,
    notices: &mut Notices,
) -> Option<Relation> {
    let findings: Vec<Finding> = capture
        .fitted()
        .filter_map(|run| finding(capture, run, (a, b), bearing, up, config))
        .collect();
    let (lower, upper) = if bearing == Bearing::FirstOnTop { (b, a) } else { (a, b) };
    let arc = |kind, freedom: u8, probability, from| Relation {
        a: lower.name.clone(),
        b: upper.name.clone(),
        kind,
        rotation_dof: freedom,
        translation_dof: freedom,
        probability,
        from,
        breakaway: None,
    };
    if findings.iter().all(|f| f.log_odds.abs() < 0.5 && f.gave.is_none()) {
        let seen = a.mesh.is_some() && b.mesh.is_some();
        return seen.then(|| {
            let about = format!("{}, {}", lower.name, upper.name);
            let message = "they touch, and no interaction could have told a bond from mere rest: lift the upper one";
            notices.note("relations", &about, message);
            arc(RelationKind::Unknown, 3, 1.0 - config.prior_fixed, Vec::new())
        });
    }
    let fixed = probability_of_a_bond(&findings, config);
    let names = |keep: &dyn Fn(&Finding) -> bool| -> Vec<String> {
        findings
            .iter()
            .filter(|f| keep(f))
            .map(|f| f.interaction.clone())
            .collect()
    };
    if fixed > 0.9 {
        let mut relation = arc(RelationKind::Fixed, 0, fixed, names(&|f| f.log_odds > 0.0));
        relation.breakaway = breakaway(&findings, true);
        return Some(relation);
    }
    if fixed > UNDECIDED && findings.iter().any(|f| f.gave.is_some()) {
        let mut relation = arc(RelationKind::Unknown, 3, 1.0 - fixed, names(&|f| f.gave.is_some()));
        relation.breakaway = breakaway(&findings, false);
        let about = format!("{}, {}", lower.name, upper.name);
        let message =
            "they came apart under a push that first bore more than friction does: a bond that gave way, or a blow";
        notices.note("relations", &about, message);
        return Some(relation);
    }
    if findings.iter().any(|f| f.parted) {
        let kind = match bearing {
            Bearing::SecondOnTop | Bearing::FirstOnTop => RelationKind::Resting,
            Bearing::Beside => RelationKind::Separate,
            Bearing::Perhaps => return None,
        };
        return Some(arc(kind, 3, 1.0 - fixed, names(&|f| f.parted)));
    }
    (bearing != Bearing::Perhaps).then(|| arc(RelationKind::Unknown, 3, 1.0 - fixed, names(&|_| true)))
}

/// Probability of a bond from which on a pair that came apart is not called resting.
const UNDECIDED: f64 = 0.2;

/// Odds add up over the interactions; one touch that showed a bond counts for what it was then, even if the two came
/// apart later. Once a bond may have given way, what begins with the two in another place says nothing of it.
fn probability_of_a_bond(findings: &[Finding], config: &Config) -> f64 {
    let prior = (config.prior_fixed / (1.0 - config.prior_fixed)).ln();
    let gave = findings.iter().position(|f| f.gave.is_some());
    let as_then = |(i, f): &(usize, &Finding)| gave.is_none_or(|g| *i <= g || f.begins_as(&findings[g], config));
    let of_it: Vec<&Finding> = findings.iter().enumerate().filter(as_then).map(|(_, f)| f).collect();
    let held_before = of_it.iter().take_while(|f| !f.parted || f.gave.is_some());
    let bond: f64 = held_before.map(|f| f.log_odds).sum();
    let all: f64 = of_it.iter().map(|f| f.log_odds).sum();
    let odds = if bond > 5.0 { prior + bond } else { prior + all };
    1.0 / (1.0 + (-odds.clamp(-7.0, 7.0)).exp())
}

fn breakaway(findings: &[Finding], sure: bool) -> Option<Estimate> {
    let found = findings.iter().find(|f| f.gave.is_some())?;
    Some(found.gave.as_ref()?.estimate(&found.interaction, sure))
}
