//! Joints that nobody moves and that move all the same, as another does: geared, or linked by something hidden.

use super::joint_paths::{JointMoment, joint_path, travelled};
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Interaction, Segmented};
use crate::math::random_effects;
use crate::stages::estimation::joint_loads;
use crate::twin::{Finding, Joint, JointKind, Model};

/// Least way of the joint that is moved, and of the one that follows: rad, m.
const WAY: [f64; 2] = [0.1, 0.01];
const FOLLOWS: [f64; 2] = [0.02, 0.002];
/// Share of the follower's variance that the other's position has to foretell.
const TOLD: f64 = 0.9;
/// Scatter of the ratio from motion to motion: what is expected, and as a share of the ratio the most that there may be.
const SCATTER: f64 = 0.02;
const ALIKE: f64 = 0.25;
/// Standard deviations from nothing, and motions that have to tell.
const CLEAR: f64 = 5.0;
const FEWEST: usize = 2;
/// The same of a joint that the other one carries, and how far from -1 its ratio has to be: at -1 what is carried stands still,
/// as what merely hangs there may.
const GEARED: f64 = 0.998;
const STANDS: f64 = 0.1;
/// Neighbouring readings that count as one.
const TOGETHER: f64 = 10.0;
/// Block, half span of a velocity, s, and how far the parent may move, m, where it is asked what was handled.
const HANDLED: [f64; 3] = [0.2, 0.1, 3e-3];

/// What one motion says.
struct Followed {
    interaction: String,
    held_out: bool,
    /// Position of the follower for each unit of the other's, with its standard deviation.
    ratio: (f64, f64),
    /// Both positions, row by row.
    rows: Vec<[f64; 2]>,
}

fn of_one_freedom(model: &Model) -> Vec<&Joint> {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    model.twin.joints().filter(kinds).collect()
}

/// Whether a joint was moved so often with another in view that may follow it that this would show.
pub fn tells_coupling(capture: &Capture, segmented: &[Segmented], model: &Model) -> bool {
    let joints = of_one_freedom(model);
    let moved = |i: &Interaction, leads: &Joint| {
        let cut = segmented.iter().find(|s| s.interaction == i.name);
        cut.is_some_and(|cut| joint_loads(i, cut, leads, model, HANDLED).is_some())
    };
    let follows = |leads: &Joint, other: &Joint| other.name != leads.name && other.child != leads.parent;
    let seen = |i: &Interaction, leads: &Joint| {
        let mut others = joints.iter().filter(|j| follows(leads, j));
        others.any(|j| joint_path(i, model, j).is_some())
    };
    let fitted = || capture.interactions.iter().filter(|i| !i.held_out);
    let told = |leads: &&Joint| fitted().filter(|i| seen(i, leads) && moved(i, leads)).count() >= FEWEST;
    joints.len() > 1 && joints.iter().any(told)
}

/// Joints that follow another, or one that carries them.
pub fn coupling_findings(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Finding> {
    let joints = of_one_freedom(model);
    let mut out = Vec::new();
    for (i, first) in joints.iter().enumerate() {
        for second in joints.iter().filter(|j| j.parent == first.child) {
            out.extend(coupled(capture, segmented, model, first, second));
        }
        // A cable or a gear may link two that stand apart.
        for second in joints[i + 1..]
            .iter()
            .filter(|j| j.parent != first.child && j.child != first.parent)
        {
            out.extend(coupled(capture, segmented, model, first, second).or_else(|| {
                // It may only drive one way.
                coupled(capture, segmented, model, second, first)
            }));
        }
    }
    out
}

/// What follows a joint by something that gives swings: no mass is loose in the joint that leads it.
pub fn without_what_follows(findings: &mut Vec<Finding>) {
    let leaders: Vec<String> = findings.iter().filter_map(|f| f.leader.clone()).collect();
    findings.retain(|f| f.cause != "joint-loose-mass" || !leaders.contains(&f.place));
}

fn coupled(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    leads: &Joint,
    follows: &Joint,
) -> Option<Finding> {
    let one = |interaction: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        joint_loads(interaction, cut, leads, model, HANDLED)?;
        let [lead, other] = [leads, follows].map(|j| joint_path(interaction, model, j));
        let carried = follows.parent == leads.child;
        let told = if carried { GEARED } else { TOLD };
        let rode = |f: &Followed| carried && (f.ratio.0 + 1.0).abs() < STANDS;
        followed(interaction, (&lead?, leads.kind), (&other?, follows.kind), told).filter(|f| !rode(f))
    };
    let all: Vec<Followed> = capture.interactions.iter().filter_map(one).collect();
    let fitted: Vec<&Followed> = all.iter().filter(|f| !f.held_out).collect();
    if fitted.len() < FEWEST {
        return None;
    }
    let (ratios, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|f| f.ratio).unzip();
    let pooled = random_effects(&ratios, &sds, SCATTER)?;
    let statistic = pooled.mean.abs() / pooled.sd;
    if statistic < CLEAR || pooled.between > ALIKE * pooled.mean.abs() {
        return None;
    }
    let from: Vec<String> = fitted.iter().map(|f| f.interaction.clone()).collect();
    let turns = follows.kind == JointKind::Revolute;
    let unit = match (turns, leads.kind == JointKind::Revolute) {
        (true, true) | (false, false) => "1",
        (true, false) => "rad/m",
        (false, true) => "m/rad",
    };
    let held: Vec<&Followed> = all.iter().filter(|f| f.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    let [before, after] = [0.0, pooled.mean].map(|ratio| rms(judged, ratio));
    let words = format!(
        "{} moves by {:.2} {unit} of {} though nobody touches it",
        follows.name, pooled.mean, leads.name
    );
    let (quantity, angle) = if turns { ("angle", "rad") } else { ("position", "m") };
    let told = Told {
        cause: "joint-coupling",
        place: &follows.name,
        probability: 0.95,
        rivals: &[],
        parameter: (
            "rho",
            Estimate::measured(pooled.mean, pooled.sd, unit, from, "regression of joint positions"),
        ),
        residual: "positions",
        statistic,
        words,
        gain: gain(
            quantity,
            angle,
            [before, after],
            held.iter().map(|f| f.interaction.clone()).collect(),
        ),
    };
    Some(Finding {
        leader: Some(leads.name.clone()),
        ..told.finding()
    })
}

/// Root mean square of what a ratio leaves of the follower's way from where it began.
fn rms(all: &[&Followed], ratio: f64) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for f in all {
        let [x0, y0] = f.rows[0];
        square += f
            .rows
            .iter()
            .map(|[x, y]| (y - y0 - ratio * (x - x0)).powi(2))
            .sum::<f64>();
        count += f.rows.len() as f64;
    }
    (square / f64::max(count, 1.0)).sqrt()
}

/// The straight line of the follower's position over the other's.
fn followed(
    interaction: &Interaction,
    (lead, lead_kind): (&[JointMoment], JointKind),
    (other, other_kind): (&[JointMoment], JointKind),
    told: f64,
) -> Option<Followed> {
    let least = |kind: JointKind, of: [f64; 2]| of[usize::from(kind == JointKind::Prismatic)];
    if travelled(lead) < least(lead_kind, WAY) || travelled(other) < least(other_kind, FOLLOWS) {
        return None;
    }
    let beside = |m: &JointMoment| {
        let i = other.partition_point(|o| o.time < m.time).min(other.len() - 1);
        [m.position, other[i].position]
    };
    let rows: Vec<[f64; 2]> = lead.iter().map(beside).collect();
    let n = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>() / n;
    let (mx, my) = (mean(0), mean(1));
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| rows.iter().map(f).sum::<f64>();
    let sxx = sum(&|r| (r[0] - mx).powi(2)).max(1e-300);
    let syy = sum(&|r| (r[1] - my).powi(2)).max(1e-300);
    let ratio = sum(&|r| (r[0] - mx) * (r[1] - my)) / sxx;
    let left = sum(&|r| (r[1] - my - ratio * (r[0] - mx)).powi(2));
    if left > (1.0 - told) * syy {
        return None;
    }
    let sd = (left * TOGETHER / (n * sxx)).sqrt();
    Some(Followed {
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        ratio: (ratio, sd),
        rows,
    })
}
