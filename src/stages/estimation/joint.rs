//! Friction, damping and spring of joints from the load that the tool puts on the child.

use nalgebra::Vector3;

use super::Config;
use super::drag::{Drag, less_drag, parted_friction, table_drag};
use super::drive::{Drive, drive_of};
use super::facts::{Ground, subject};
use super::joint_effort::{friction_of, joint_effort};
use super::joint_law::{Number, Setting, Trial, law_of, typical_load};
use super::joint_led::{beside_bias, untared};
use super::joint_load::{JointAtWork, JointLoad, Span, go_on_over_turns, joint_loads};
use super::joint_matter::{Carried, family, weight_open};
use super::parting::{Parted, part};
use super::pool::relative_sd;
use super::resolve::STAGE;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::{Capture, Interaction, PhaseKind, Segmented};
use crate::math::quantile;
use crate::twin::{Joint, JointEffort, JointKind, Model};

/// Writes friction, damping and spring of every joint of one freedom of the twin that `which` asks for.
pub(super) fn joint_dynamics(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    (ground, config): (&Ground, &Config),
    which: &dyn Fn(&Joint) -> bool,
    notices: &mut Notices,
) {
    let joints: Vec<Joint> = model.twin.joints().filter(|j| which(j)).cloned().collect();
    for joint in joints {
        if !matches!(
            joint.kind,
            JointKind::Revolute | JointKind::Prismatic | JointKind::Screw
        ) {
            continue;
        }
        let effort = joint_effort(capture, segmented, &joint, model);
        let trials: Vec<Trial> = capture
            .fitted()
            .filter_map(|i| {
                let cut = segmented.iter().find(|s| s.interaction == i.name)?;
                trial_of(i, cut, &joint, model, &ground.gravity, config)
            })
            .filter_map(|t| beyond_latch(t, effort.as_ref()))
            .collect();
        write_effort(&joint, &effort, model);
        if trials.is_empty() {
            let unit = if joint.kind == JointKind::Prismatic {
                "N"
            } else {
                "N·m"
            };
            let friction = effort.as_ref().and_then(|e| friction_of(e, unit));
            let only = Dynamics {
                friction,
                ..Dynamics::default()
            };
            only.write(&joint, model);
            continue;
        }
        let drag = table_drag(&joint, model, ground);
        let parted = part(capture, segmented, &joint, model, ground, config);
        let carried = Carried::of(&joint, model, &ground.gravity, config);
        let setting = Setting {
            turning: joint.kind != JointKind::Prismatic,
            tipped: tipped(&joint, &ground.gravity),
            carried: carried.as_ref(),
            lateral: joint
                .lateral
                .filter(|_| joint.kind != JointKind::Prismatic)
                .unwrap_or(0.0),
            scatter: config.friction_scatter,
            form: config.model_form,
            unknown: capture
                .interactions
                .iter()
                .all(|i| !i.tracks.contains_key(&joint.child)),
            untared: untared(capture, segmented, &joint),
        };
        let mut found = conclude(&trials, &setting, (drag, parted), &joint, notices);
        if let Some(driven) = drive_of(capture, segmented, &joint, model) {
            write_drive(&driven, &joint, model, &mut found, config.model_form, notices);
            found.rest = None;
        }
        found.write(&joint, model);
    }
}

fn write_effort(joint: &Joint, effort: &Option<JointEffort>, model: &mut Model) {
    let joints = model.twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
    for target in joints.filter(|j| j.name == joint.name && j.child == joint.child) {
        target.effort.clone_from(effort);
    }
}

/// The loads that no latch holds: friction is that of the way after it.
fn beyond_latch(mut trial: Trial, effort: Option<&JointEffort>) -> Option<Trial> {
    if let Some(latch) = effort.and_then(|e| e.latch.as_ref()) {
        let until = latch.until.value + latch.until.sd.unwrap_or(0.0);
        trial.loads.retain(|l| l.position.abs() > until);
    }
    (trial.loads.len() >= 4).then_some(trial)
}

/// Block and half span of velocities, s, and how far the parent may move, m, of what shows which way it went.
const EFFORT: [f64; 3] = [0.1, 0.3, 1e-3];

/// A slide whose inertia shows: mass of the child, friction and damping of the joint.
fn write_drive(
    driven: &Drive,
    joint: &Joint,
    model: &mut Model,
    found: &mut Dynamics,
    form: f64,
    notices: &mut Notices,
) {
    // The law of friction and damping may itself be off by a share, which no stretch of the recording shows.
    let estimate = |v: [f64; 3], unit: &str| {
        let (sd, half) = (v[1].hypot(form * v[0]), v[2].hypot(1.96 * form * v[0]));
        let told = Estimate::measured(v[0], sd, unit, driven.from.clone(), "joint-drive");
        not_negative(told.with_interval([v[0] - half, v[0] + half]))
    };
    found.friction = Some(estimate(driven.friction, "N"));
    found.damping = Some(estimate(driven.damping, "N·s/m"));
    if let Some(link) = model.twin.link_mut(&joint.child) {
        link.mass = Some(estimate(driven.mass, "kg"));
    }
    let [constant, _, half] = driven.constant;
    if constant.abs() > half {
        let message = format!(
            "a constant force of {constant:.3} ± {half:.3} N acts along the joint beside friction: a bias of the sensor, \
             or a slope"
        );
        notices.note(STAGE, &joint.name, message);
    }
}

/// What the loads of a joint said.
#[derive(Clone, Default)]
struct Dynamics {
    friction: Option<Estimate>,
    damping: Option<Estimate>,
    stiffness: Option<Estimate>,
    rest: Option<Estimate>,
}

impl Dynamics {
    fn write(&self, joint: &Joint, model: &mut Model) {
        let joints = model.twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
        for target in joints.filter(|j| j.name == joint.name && j.child == joint.child) {
            (target.friction, target.damping) = (self.friction.clone(), self.damping.clone());
            (target.stiffness, target.rest) = (self.stiffness.clone(), self.rest.clone());
        }
    }
}

/// True where the weight of what hangs on the joint loads it.
fn tipped(joint: &Joint, gravity: &Vector3<f64>) -> bool {
    let (axis, down) = (
        Vector3::from(joint.axis.value),
        gravity.try_normalize(1e-9).unwrap_or_default(),
    );
    let lean = if joint.kind == JointKind::Revolute {
        axis.cross(&down).norm()
    } else {
        axis.dot(&down).abs().max(if joint.kind == JointKind::Screw {
            axis.cross(&down).norm()
        } else {
            0.0
        })
    };
    lean > UPRIGHT
}

/// Sine of an axis' lean from the vertical that still counts as upright.
const UPRIGHT: f64 = 0.035;

fn conclude(
    trials: &[Trial],
    setting: &Setting,
    (drag, parted): (Option<Drag>, Option<Parted>),
    joint: &Joint,
    notices: &mut Notices,
) -> Dynamics {
    let from: Vec<String> = trials.iter().map(|t| t.interaction.clone()).collect();
    let units = units_of(joint.kind);
    let Some(law) = law_of(trials, setting) else {
        let message = "its loads do not tell its friction: move it farther, at several speeds, to and fro";
        notices.note(STAGE, &joint.name, message);
        return Dynamics::default();
    };
    let estimate = |n: Number, unit: &str| {
        Estimate::measured(n.value, n.sd, unit, from.clone(), "joint-load")
            .with_interval([n.value - n.half95, n.value + n.half95])
    };
    // What resists takes energy away: it is never negative, though a difference of loads may be.
    let resists = |n: Number, unit: &str| not_negative(estimate(n, unit));
    let mut friction = resists(law.friction, units[0]);
    if let Some(speed) = law.one_speed {
        let low = 0.3 * law.friction.value;
        let [_, high] = friction.ci95.unwrap_or([low, law.friction.value]);
        friction = friction.with_interval([low, high]);
        friction.status = Status::Assumed;
        friction.confounded = Some(Confounded {
            with: vec!["damping".into()],
            known: format!("friction + {speed:.3} damping = {:.4} {}", law.friction.value, units[0]),
            experiment: "move the joint at half and at twice the speed".into(),
        });
    }
    // Along a straight way the weight is the same everywhere: only its change with acceleration would tell it, too little.
    let straight = joint.kind == JointKind::Prismatic && setting.carried.is_none_or(|c| c.relative > 0.05);
    let open = straight || relative_sd(&friction) > 0.05;
    if law.one_way && setting.tipped && friction.confounded.is_none() && open {
        if let Some(carried) = setting.carried {
            // A density that nobody knows errs by a factor, not by a share.
            let [less, more] = weight_open(trials, carried);
            let half = 1.96 * friction.sd.unwrap_or(0.0);
            let interval = [(friction.value - less - half).max(0.0), friction.value + more + half];
            friction = friction.with_interval(interval);
        }
        friction.status = Status::Assumed;
        friction.confounded = Some(Confounded {
            with: vec![format!("mass({})", joint.child)],
            known: format!(
                "friction({}) + the weight of {} along it, of which only a sum was felt",
                joint.name, joint.child
            ),
            experiment: "move the joint the other way too, or weigh the child".into(),
        });
    }
    if let (Some(_), Some(parted), JointKind::Revolute) = (&drag, parted, joint.kind) {
        friction = not_negative(parted_friction(&parted, units[0]));
    } else if let Some(drag) = drag.as_ref().filter(|d| free_of(d, joint.kind) > law.friction.value) {
        let message = format!(
            "the load is {:.4} {}, less than the child's friction on the support would be ({:.4} or more): it is taken \
             to hang free of it",
            law.friction.value,
            units[0],
            free_of(drag, joint.kind)
        );
        notices.note(STAGE, &joint.name, message);
    } else if let Some(drag) = drag {
        friction = less_drag(&friction, &drag, joint, units[0], notices);
    }
    Dynamics {
        friction: Some(friction),
        damping: law
            .damping
            .map(|d| resists(d, units[1]))
            .or_else(|| Some(beside_friction(resists(law.unclear?, units[1]), trials, units[0]))),
        stiffness: law.spring.map(|s| resists(s, units[2])),
        rest: law
            .rest
            .map(|r| beside_bias(estimate(r, units[3]), law.spring, units[0], setting.untared)),
    }
}

/// Of friction, damping, spring and position.
fn units_of(kind: JointKind) -> [&'static str; 4] {
    if kind == JointKind::Prismatic {
        return ["N", "N·s/m", "N/m", "m"];
    }
    ["N·m", "N·m·s/rad", "N·m/rad", "rad"]
}

/// Damping that is told in a sum with friction alone.
fn beside_friction(damping: Estimate, trials: &[Trial], unit: &str) -> Estimate {
    let told = Confounded {
        with: vec!["friction".into()],
        known: format!(
            "{:.4} {unit} at the speeds of these touches, with friction",
            typical_load(trials)
        ),
        experiment: "move the joint at a quarter and at four times the speed".into(),
    };
    let status = Status::Assumed;
    Estimate { status, ..damping }.with_confounded(told)
}

/// The same with an interval that ends at 0.
fn not_negative(estimate: Estimate) -> Estimate {
    match estimate.ci95 {
        Some([low, high]) if low < 0.0 => estimate.with_interval([0.0, high.max(0.0)]),
        _ => estimate,
    }
}

/// The drag that a load must reach for the child to bear on the support, N or N·m: of a slide, which mostly rides in
/// its parent, the likely one; of a hinge, whose links mostly stand side by side, the least.
fn free_of(drag: &Drag, kind: JointKind) -> f64 {
    if kind == JointKind::Prismatic {
        drag.value
    } else {
        drag.least
    }
}

/// Share of the range that a joint was seen to have which a touch of something farther out must move it by.
const TRAVELLED: f64 = 0.25;
/// The speed may change by this share over the span that it is read from.
const STEADY: f64 = 0.5;

/// The blocks of all stretches in which something slid. A balance of momentum holds for means, however a contact
/// chatters.
fn loads(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    config: &Config,
) -> Option<Vec<JointLoad>> {
    let at_work = JointAtWork::new(interaction, cut, joint, model)?;
    let mut out = Vec::new();
    let mut slides: Vec<[f64; 2]> = cut.of(PhaseKind::Slide).map(|p| [p.start, p.end]).collect();
    if slides.is_empty() && at_work.by_hand() {
        slides.extend(to_and_fro(interaction, cut, joint, model));
    }
    for [start, end] in slides {
        let span = Span::of(end - start, config, at_work.led());
        let settling = config.settling.min(1.2 * span.block);
        // Where the speed changes within the span of its parabola it is not that of the block; a span that reaches to where it
        // stands has less friction, and less speed, as of damping.
        let half = span.led.unwrap_or(span.half);
        let mut t = start + settling + half;
        while t + half <= end - 0.5 * settling {
            let steady = |l: &JointLoad| l.acceleration.abs() * half < STEADY * l.speed.abs();
            out.extend(at_work.at(t, span).filter(steady));
            t += span.block;
        }
    }
    go_on_over_turns(&mut out, joint);
    (out.len() >= 4).then_some(out)
}

/// Share of the moments of a motion that go the other way, for it to go to and fro.
const BACK: f64 = 0.25;

/// A motion of a hand that alone tells where the joint is, where it went to and fro; one way alone tells no law.
fn to_and_fro(interaction: &Interaction, cut: &Segmented, joint: &Joint, model: &Model) -> Option<[f64; 2]> {
    let loads = joint_loads(interaction, cut, joint, model, EFFORT)?;
    let fastest = loads.iter().map(|l| l.speed.abs()).fold(0.0, f64::max);
    let moving = || loads.iter().filter(|l| l.speed.abs() > 0.2 * fastest);
    let (all, ahead) = (moving().count(), moving().filter(|l| l.speed > 0.0).count());
    (ahead.min(all - ahead) as f64 > BACK * all as f64).then_some([loads.first()?.time, loads.last()?.time])
}

/// The blocks of one interaction that moved the joint; `None` where it did not. What is handled may hang further out: the
/// joint bears the moment of the tool all the same, and that of weights too, so that its axis must be upright then.
fn trial_of(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    gravity: &Vector3<f64>,
    config: &Config,
) -> Option<Trial> {
    let about = subject(interaction, cut)?;
    let outer = || !tipped(joint, gravity) && family(joint, model).iter().any(|n| n == about);
    if about != joint.child && !outer() {
        return None;
    }
    let mut loads = loads(interaction, cut, joint, model, config)?;
    // Not the fastest: what was locked and snaps is for a moment faster than all that follows.
    let fastest = quantile(&loads.iter().map(|l| l.speed.abs()).collect::<Vec<f64>>(), 0.9)?;
    let least = if joint.kind == JointKind::Prismatic { 2e-3 } else { 0.02 };
    // A joint that went far moved, however slowly.
    let [low, high] = loads.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| {
        [l.min(x.position), h.max(x.position)]
    });
    // In a touch of something farther out it may have stuck: noise is no motion.
    let seen = joint.travelled.map_or(0.0, |[from, to]| to - from);
    if about != joint.child && high - low < TRAVELLED * seen {
        return None;
    }
    let least = if high - low > 15.0 * least { 0.0 } else { least };
    loads.retain(|l| l.speed.abs() > (0.2 * fastest).max(least));
    if loads.len() < 4 {
        return None;
    }
    Some(Trial {
        interaction: interaction.name.clone(),
        loads,
    })
}
