//! What a capture cannot tell, and what in it looks like a mistake, in words.

use super::inspect::{body_names, is_link_of};
use super::inspect_views::summarise_views;
use super::inspection::{InteractionSummary, Missing, ViewSummary};
use super::{Capture, Interaction, Kind};

/// Below this azimuth coverage much of a body is unseen, degrees.
const FEW_VIEWS: f64 = 240.0;

/// What was done to one body, in the interactions that may be used to fit.
struct Evidence<'a> {
    capture: &'a Capture,
    body: &'a str,
}

impl Evidence<'_> {
    fn any(&self, test: impl Fn(&Interaction) -> bool) -> bool {
        self.capture.fitted().any(|x| acts_on(x, self.body) && test(x))
    }

    fn done(&self, kinds: &[Kind]) -> bool {
        self.any(|x| kinds.contains(&x.kind))
    }

    fn with_force(&self, kinds: &[Kind]) -> bool {
        self.any(|x| kinds.contains(&x.kind) && x.force.is_some())
    }

    fn weight_known(&self) -> bool {
        self.with_force(&[Kind::Lift]) || self.capture.prior(self.body).is_some_and(|b| b.mass.is_some())
    }

    fn slid_under_force(&self) -> bool {
        self.with_force(&[Kind::Push, Kind::Pull])
    }

    fn friction_by_itself(&self) -> bool {
        let tilted = self.any(|x| x.kind == Kind::Tilt && x.support_path.is_some() && !x.tracks.is_empty());
        let tossed = self.any(|x| x.kind == Kind::Toss && !x.tracks.is_empty());
        tilted || tossed || self.capture.support.as_ref().is_some_and(|s| s.friction.is_some())
    }

    fn mass(&self) -> Option<&'static str> {
        if self.weight_known() || (self.slid_under_force() && self.friction_by_itself()) {
            return None;
        }
        Some(if self.slid_under_force() {
            "slow pushes and pulls give only friction times weight; a lift with a force sensor tells the mass, \
             a tilt or a known friction lets the pushes tell it"
        } else {
            "no lift with a force sensor, and no push with force beside a tilt or a known friction"
        })
    }

    fn friction(&self) -> Option<&'static str> {
        let slid = self.slid_under_force();
        if self.friction_by_itself() || (slid && self.weight_known()) {
            return None;
        }
        Some(if slid {
            "slow pushes and pulls give only friction times weight; a lift tells the weight, a tilt the friction"
        } else {
            "no tilt, and no push with force beside a lift or a known mass"
        })
    }

    fn stiffness(&self) -> Option<&'static str> {
        (!self.with_force(&[Kind::Press])).then_some("no press with a force sensor")
    }

    fn centre_of_mass(&self) -> Option<&'static str> {
        let torque = |x: &Interaction| x.force.as_ref().is_some_and(|f| f.torque.is_some());
        if self.any(|x| x.kind == Kind::Lift && torque(x)) {
            return None;
        }
        let turning = |x: &Interaction| x.tracks.values().any(|t| t.rotation.iter().any(Option::is_some));
        if self.any(|x| x.kind == Kind::Push && turning(x)) {
            return Some("off-centre pushes tell it in the plane of the table; its height takes a lift with torque");
        }
        Some(if self.with_force(&[Kind::Lift]) {
            "the lift has no torque; record tx, ty, tz, or push off the centre with the orientation tracked"
        } else {
            "no lift with torque, and no off-centre push with the orientation tracked"
        })
    }

    fn restitution(&self) -> Option<&'static str> {
        (!self.done(&[Kind::Toss])).then_some("no toss: nothing hit anything and flew back")
    }
}

fn acts_on(x: &Interaction, body: &str) -> bool {
    match &x.target {
        Some(target) => target == body || is_link_of(body, target),
        None => x.tracks.contains_key(body),
    }
}

/// What these data cannot tell, quantity by quantity, with the bodies that it is about.
pub(super) fn missing(capture: &Capture) -> Vec<Missing> {
    let mut out = missing_shape(capture);
    let names = body_names(capture);
    for (estimate, ask) in QUESTIONS {
        let mut reasons: Vec<Missing> = Vec::new();
        for body in &names {
            let Some(reason) = ask(&Evidence { capture, body }) else {
                continue;
            };
            match reasons.iter_mut().find(|m| m.reason == reason) {
                Some(missing) => missing.bodies.push(body.clone()),
                None => reasons.push(of_scene(estimate, reason, vec![body.clone()])),
            }
        }
        out.append(&mut reasons);
    }
    out.extend(missing_between(capture, &names));
    if capture.held_out().next().is_none() {
        out.push(of_scene(
            "prediction error",
            "no interaction is held out: predictions are not checked",
            Vec::new(),
        ));
    }
    out
}

type Question = for<'a, 'b> fn(&'a Evidence<'b>) -> Option<&'static str>;

const QUESTIONS: [(&str, Question); 5] = [
    ("mass", |e| e.mass()),
    ("friction coefficient", |e| e.friction()),
    ("centre of mass", |e| e.centre_of_mass()),
    ("stiffness", |e| e.stiffness()),
    ("restitution", |e| e.restitution()),
];

fn of_scene(estimate: &str, reason: impl Into<String>, bodies: Vec<String>) -> Missing {
    Missing {
        estimate: estimate.into(),
        bodies,
        reason: reason.into(),
    }
}

fn missing_shape(capture: &Capture) -> Vec<Missing> {
    let without_mesh = |name: &String| capture.prior(name).is_none_or(|b| b.mesh.is_none());
    let bodies: Vec<String> = body_names(capture).into_iter().filter(without_mesh).collect();
    match summarise_views(capture) {
        None if bodies.is_empty() => Vec::new(),
        None => vec![of_scene("shape", "no views and no mesh", bodies)],
        Some(ViewSummary {
            azimuth_coverage_deg: seen,
            ..
        }) if seen < FEW_VIEWS => {
            let reason = format!("views cover {seen:.0} of 360 degrees of azimuth: the far sides are not seen");
            vec![of_scene("whole shape", reason, Vec::new())]
        }
        Some(_) => Vec::new(),
    }
}

fn missing_between(capture: &Capture, names: &[String]) -> Vec<Missing> {
    let mut out = Vec::new();
    if names.len() > 1 && !capture.fitted().any(|x| x.tracks.len() > 1) {
        let reason = "no interaction tracks two bodies at once: whether one moves the other is not known";
        out.push(of_scene("relations", reason, Vec::new()));
    }
    let led = |x: &Interaction| matches!(x.kind, Kind::Pull | Kind::Push | Kind::Lift | Kind::Toss);
    let followed = |x: &Interaction| !x.tracks.is_empty() || (x.tool_path.is_some() && x.tool.is_some());
    if !capture.fitted().any(|x| led(x) && followed(x)) {
        let reason = "nothing was moved by a tool while it was tracked";
        out.push(of_scene("joints", reason, Vec::new()));
    }
    out
}

/// What looks like a mistake in the recording: it can be read, but is it meant?
pub(super) fn doubts(capture: &Capture, summaries: &[InteractionSummary]) -> Vec<String> {
    let mut out = Vec::new();
    let dark = summarise_views(capture).filter(|v| v.worst_valid_fraction < 0.05);
    if let Some(views) = dark {
        let share = 100.0 * views.worst_valid_fraction;
        out.push(format!(
            "a view has depth in {share:.1} % of its pixels: depth_unit, depth_min, depth_max?"
        ));
    }
    let mut grouped: Vec<(String, &str, usize)> = Vec::new();
    for (x, summary) in capture.interactions.iter().zip(summaries) {
        let of_one = [
            unknown_target(capture, x),
            clocks_apart(summary),
            untared(x, summary),
            unsaid(x),
        ];
        for doubt in of_one.into_iter().flatten() {
            match grouped.iter_mut().find(|(met, _, _)| *met == doubt) {
                Some((_, _, more)) => *more += 1,
                None => grouped.push((doubt, &x.name, 0)),
            }
        }
    }
    out.extend(grouped.into_iter().map(|(doubt, name, more)| match more {
        0 => format!("{name}: {doubt}"),
        _ => format!("{name} and {more} more: {doubt}"),
    }));
    out
}

/// A target that no other place names; a tool that holds it tells where it is, so that needs no track.
fn unknown_target(capture: &Capture, x: &Interaction) -> Option<String> {
    let target = x
        .target
        .as_ref()
        .filter(|_| !x.tool.as_ref().is_some_and(|t| t.grip || t.pin))?;
    let named = |name: &String| name == target || is_link_of(name, target);
    let tracked = capture.interactions.iter().any(|other| other.tracks.keys().any(named));
    let known = tracked || capture.bodies.iter().any(|b| named(&b.name));
    (!known).then(|| format!("its target `{target}` is neither tracked nor listed under bodies"))
}

fn clocks_apart(summary: &InteractionSummary) -> Option<String> {
    let first = summary.streams.first()?;
    let apart = summary
        .streams
        .iter()
        .find(|s| s.span[0] > first.span[1] || s.span[1] < first.span[0])?;
    let ([a, b], [c, d]) = (first.span, apart.span);
    Some(format!(
        "{} ({a:.3} to {b:.3} s) and {} ({c:.3} to {d:.3} s) have no time in common: one clock?",
        first.name, apart.name
    ))
}

/// The mean force of the first readings stands out of the noise although the tool should not touch yet.
fn untared(x: &Interaction, summary: &InteractionSummary) -> Option<String> {
    let force = x
        .force
        .as_ref()
        .filter(|_| matches!(x.kind, Kind::Push | Kind::Press | Kind::Hold))?;
    let noise = summary
        .streams
        .iter()
        .flat_map(|s| &s.noise)
        .find(|n| n.quantity == "force")?
        .sd;
    let readings = force.force.iter().filter(|f| f.iter().all(|v| v.is_finite())).take(10);
    let (count, sum) = readings.fold((0.0, nalgebra::Vector3::zeros()), |(n, sum), f| (n + 1.0, sum + f));
    let start = (sum / f64::max(count, 1.0)).norm();
    let peak = summary.peak_force.unwrap_or_default();
    (start > 5.0 * noise && start > 0.1 * peak)
        .then(|| format!("the force begins at {start:.3} N: not tared, or in contact from the first reading"))
}

fn unsaid(x: &Interaction) -> Option<String> {
    if x.kind == Kind::Tilt && x.support_path.is_none() {
        return Some("a tilt without support_path: the angle at which the body slid is not known".into());
    }
    let held = x.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    (x.force.is_some() && x.tool_path.is_none() && !held)
        .then(|| "a force without tool_path: where it acts is not known".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Noise, PoseStream, WrenchStream};

    fn capture(kinds: &[Kind]) -> Capture {
        let track = PoseStream {
            time: vec![0.0],
            position: vec![Default::default()],
            rotation: vec![None],
        };
        let force = WrenchStream {
            time: vec![0.0],
            force: vec![Default::default()],
            torque: None,
        };
        let interaction = |kind: &Kind| Interaction {
            name: kind.name().into(),
            kind: *kind,
            action: None,
            tool_name: None,
            tool: None,
            target: Some("box".into()),
            force: (*kind != Kind::Tilt).then(|| force.clone()),
            tool_path: None,
            support_path: (*kind == Kind::Tilt).then(Default::default),
            tracks: [("box".to_owned(), track.clone())].into(),
            frames: None,
            held_out: false,
        };
        Capture {
            root: "".into(),
            name: "c".into(),
            gravity: [0.0, 0.0, -9.8].into(),
            support: None,
            cameras: vec![],
            views: vec![],
            bodies: vec![],
            noise: Noise::default(),
            interactions: kinds.iter().map(interaction).collect(),
            truth: None,
            digest: String::new(),
        }
    }

    #[test]
    fn a_mass_takes_a_lift_or_a_push_beside_a_friction() {
        let table = [
            (vec![Kind::Push], true, true),
            (vec![Kind::Lift], false, true),
            (vec![Kind::Push, Kind::Lift], false, false),
            (vec![Kind::Push, Kind::Tilt], false, false),
            (vec![Kind::Tilt], true, false),
            (vec![Kind::Press], true, true),
        ];
        for (kinds, no_mass, no_friction) in table {
            let said = missing(&capture(&kinds));
            let lacks = |name: &str| said.iter().any(|m| m.estimate == name);
            assert_eq!(
                (lacks("mass"), lacks("friction coefficient")),
                (no_mass, no_friction),
                "{kinds:?}"
            );
            assert_eq!(lacks("stiffness"), kinds != [Kind::Press], "{kinds:?}");
            assert!(lacks("shape") && lacks("prediction error"));
        }
    }
}
