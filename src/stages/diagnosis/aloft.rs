//! What hands read across the weight of what hangs on them: a reading that leaks from one axis to another, or gravity that does not
//! point where the capture says.
//!
//! What hangs free pulls along gravity and nowhere else, whatever it stands on before. So a slope that pushes felt is gravity's where
//! lifts feel it, too, and the table's where they do not; and what lifts alone feel is the sensor's.

use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};

use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Kind, Segmented};
use crate::stages::estimation::hung;
use crate::twin::{CauseOdds, Finding};

/// Share of the weight that a hand may read across it without a cause: its own turns, and where it is thought to point.
const HAND: f64 = 0.006;
/// Share and standard deviations from which on it counts.
const LEAST: f64 = 0.03;
const CLEAR: f64 = 5.0;
/// Half the difference of two misfits from which on the one is told from the other, nats, and the most that the right one may have.
const PARTED: f64 = 6.0;
const FITS: f64 = 12.0;
/// Turn of the tool from which on its frame is not that of the room, rad.
const TURNS: f64 = 0.3;
/// Travel of a push that feels a slope, m, and the turn of its heading from which on another one does, rad.
const PUSHED: f64 = 0.01;
const HEADS: f64 = 1.0;
/// Odds of a name that the lifts decided, and of one beside which another is as good.
const SURE: f64 = 0.95;
const LEANING: [f64; 2] = [0.8, 0.15];
const OPEN: [f64; 2] = [0.5, 0.45];
/// Where a wrong strength of gravity would be found as well, the most by which it may be off.
const STRENGTH: f64 = 0.05;

/// One lift: what was read across the weight as a share of it, and its standard deviation.
struct Across {
    name: String,
    held_out: bool,
    share: Vector2<f64>,
    sd: f64,
    weight: f64,
    /// Turn of the tool about the vertical.
    turn: Matrix2<f64>,
}

/// Has the lifts decide between what was found of pushes, and say what they alone show.
pub fn told_aloft(capture: &Capture, segmented: &[Segmented], findings: &mut Vec<Finding>) {
    let Some(up) = (-capture.gravity).try_normalize(1e-9) else {
        return;
    };
    weigh_in(&lifts(capture, segmented, &up), slopes_show(capture), findings);
}

/// The same of lifts that were read; `slopes_show` where pushes would have felt a slope.
fn weigh_in(all: &[Across], slopes_show: bool, findings: &mut Vec<Finding>) {
    let fitted: Vec<&Across> = all.iter().filter(|a| !a.held_out).collect();
    let (Some(room), Some(tool)) = (pooled(&fitted, |_| Matrix2::identity()), pooled(&fitted, |a| a.turn)) else {
        return;
    };
    if let Some(slope) = findings.iter_mut().find(|f| leans(f)) {
        let Some((felt, sd)) = slope_of(slope) else { return };
        let sd = sd.hypot(HAND).hypot(room.sd);
        let misfit = |of: Vector2<f64>| 0.5 * ((room.share - of) / sd).norm_squared();
        let [of_gravity, of_table] = [misfit(felt), misfit(Vector2::zeros())];
        if of_table - of_gravity > PARTED && of_gravity < FITS {
            decide(slope, "gravity-error", "lifts read it, too");
            with_its_strength(findings);
            return;
        }
        if of_gravity - of_table > PARTED && of_table < FITS {
            decide(slope, "support-tilt", "lifts read no such thing");
            return;
        }
    }
    let named = findings
        .iter()
        .any(|f| f.cause == "force-crosstalk" || f.cause == "gravity-error");
    let best = if tool.turns && tool.left < room.left {
        &tool
    } else {
        &room
    };
    if named || best.share.norm() < LEAST.max(CLEAR * best.sd) || best.left > FITS * fitted.len() as f64 {
        return;
    }
    // What friction takes along one way and not along the other, turned by the sensor into something else, is no slope of its own.
    let large = best.share.norm();
    findings.retain(|f| !leans(f) || slope_of(f).is_some_and(|s| s.0.norm() > 0.5 * large));
    let turned = tool.turns && 0.5 * (room.left - tool.left) > PARTED;
    let odds = match (turned, slopes_show) {
        (true, _) => [SURE, 0.0],
        (false, true) => LEANING,
        (false, false) => OPEN,
    };
    findings.push(finding(all, &fitted, best, odds));
}

/// Whether a lift told what is read across a weight.
pub fn tells_across(capture: &Capture, segmented: &[Segmented]) -> bool {
    let up = (-capture.gravity).try_normalize(1e-9);
    up.is_some_and(|up| lifts(capture, segmented, &up).iter().any(|l| !l.held_out))
}

/// Whether a finding is of something that pulls things along the table.
fn leans(finding: &Finding) -> bool {
    ["support-tilt", "gravity-error"].contains(&finding.cause.as_str()) && slope_of(finding).is_some()
}

/// What a tool has to bring up for each newton of load, and its standard deviation.
fn slope_of(finding: &Finding) -> Option<(Vector2<f64>, f64)> {
    let [x, y] = [finding.parameters.get("tx")?, finding.parameters.get("ty")?];
    let sd = x.sd.unwrap_or(0.0).max(y.sd.unwrap_or(0.0));
    Some((Vector2::new(x.value, y.value), sd))
}

fn of_strength(finding: &Finding) -> bool {
    let rival = finding.alternatives.iter().any(|a| a.cause == "gravity-error");
    let off = finding.parameters.get("g").is_some_and(|g| g.value.abs() < STRENGTH);
    finding.cause == "force-gain" && rival && off
}

/// A strength of gravity that lifts of stated weights found wrong is a part of the same error as its direction.
fn with_its_strength(findings: &mut Vec<Finding>) {
    let Some(strength) = findings.iter().position(of_strength) else {
        return;
    };
    let strength = findings.remove(strength);
    if let Some(slope) = findings.iter_mut().find(|f| leans(f)) {
        let scale = strength.parameters.get("g").cloned();
        slope.parameters.extend(scale.map(|g| ("scale".to_owned(), g)));
        slope.evidence.extend(strength.evidence);
    }
}

/// Gives a finding the name that the lifts leave it.
fn decide(finding: &mut Finding, cause: &str, why: &str) {
    let own = std::iter::once((finding.cause.clone(), finding.probability));
    let others = finding.alternatives.iter().map(|a| (a.cause.clone(), a.probability));
    let both = ["support-tilt", "gravity-error"];
    let all: Vec<(String, f64)> = own.chain(others).collect();
    let whole: f64 = all.iter().filter(|a| both.contains(&a.0.as_str())).map(|a| a.1).sum();
    let rest = all.into_iter().filter(|a| !both.contains(&a.0.as_str()));
    finding.alternatives = rest
        .map(|(cause, probability)| CauseOdds { cause, probability })
        .collect();
    finding.cause = cause.into();
    finding.probability = whole;
    if let Some(first) = finding.evidence.first_mut() {
        first.words = format!("{}; {why}", first.words);
    }
}

fn lifts(capture: &Capture, segmented: &[Segmented], up: &Vector3<f64>) -> Vec<Across> {
    let gravity = -up * capture.gravity.norm();
    let Some(level) = UnitQuaternion::rotation_between(up, &Vector3::z()) else {
        return Vec::new();
    };
    let one = |interaction: &crate::capture::Interaction| {
        let own = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let read = hung(interaction, own, &gravity)?;
        let weight = read.force.dot(up);
        let flat = level * read.force;
        let ahead = read.rotation.map(|r| (level * (r * Vector3::x())).xy());
        let ahead = ahead.and_then(|a| a.try_normalize(1e-3)).unwrap_or(Vector2::x());
        (weight > 0.0).then(|| Across {
            name: interaction.name.clone(),
            held_out: interaction.held_out,
            share: flat.xy() / weight,
            sd: (read.sd / weight).hypot(HAND),
            weight,
            turn: Matrix2::new(ahead.x, -ahead.y, ahead.y, ahead.x),
        })
    };
    let lifts = capture.interactions.iter().filter(|i| i.kind == Kind::Lift);
    lifts.filter_map(one).collect()
}

/// What all lifts have in common, seen in one frame.
struct Pooled {
    share: Vector2<f64>,
    sd: f64,
    /// Weighted squares of what it leaves.
    left: f64,
    turns: bool,
}

fn pooled(lifts: &[&Across], frame: impl Fn(&Across) -> Matrix2<f64>) -> Option<Pooled> {
    let weight: f64 = lifts.iter().map(|l| l.sd.powi(-2)).sum();
    let own = |l: &Across| frame(l).transpose() * l.share;
    let sum: Vector2<f64> = lifts.iter().map(|l| own(l) * l.sd.powi(-2)).sum();
    let share = sum / weight.max(1e-12);
    let left: f64 = lifts.iter().map(|l| ((own(l) - share) / l.sd).norm_squared()).sum();
    let free = (2.0 * lifts.len() as f64 - 2.0).max(1.0);
    let turns: Vec<Matrix2<f64>> = lifts.iter().map(|l| frame(l)).collect();
    (!lifts.is_empty()).then(|| Pooled {
        share,
        // The hand's own is the same in all of them.
        sd: (left / free).max(1.0).sqrt().mul_add(weight.sqrt().recip(), HAND),
        left,
        turns: turns.iter().any(|t| (t - turns[0]).norm() > TURNS),
    })
}

/// Whether pushes went along two ways, so that a slope would have shown.
fn slopes_show(capture: &Capture) -> bool {
    let pushes = capture.fitted().filter(|i| matches!(i.kind, Kind::Push | Kind::Pull));
    let headings: Vec<Vector2<f64>> = pushes
        .filter_map(|i| {
            let track = i.tracks.get(i.target.as_ref()?)?;
            let way = (track.position.last()? - track.position.first()?).xy();
            (way.norm() > PUSHED).then(|| way.normalize())
        })
        .collect();
    headings.iter().any(|h| h.angle(&headings[0]) > HEADS)
}

fn finding(all: &[Across], fitted: &[&Across], best: &Pooled, odds: [f64; 2]) -> Finding {
    let held: Vec<&Across> = all.iter().filter(|a| a.held_out).collect();
    let judged = if held.is_empty() { fitted } else { &held };
    let frame = |a: &Across| if best.turns { a.turn } else { Matrix2::identity() };
    let rms = |of: &dyn Fn(&Across) -> Vector2<f64>| {
        let squares: f64 = judged.iter().map(|a| (of(a) * a.weight).norm_squared()).sum();
        (squares / judged.len().max(1) as f64).sqrt()
    };
    let errors = [rms(&|a| a.share), rms(&|a| a.share - frame(a) * best.share)];
    let from: Vec<String> = fitted.iter().map(|a| a.name.clone()).collect();
    let size = best.share.norm();
    Told {
        cause: "force-crosstalk",
        place: "sensor",
        probability: odds[0],
        rivals: &[("gravity-error", odds[1])],
        parameter: (
            "C",
            Estimate::measured(size, best.sd, "1", from, "lifts: what is read across the weight"),
        ),
        residual: "force across the weight",
        statistic: size / best.sd,
        words: format!(
            "of what hangs free {:.1} % is read across its weight: ({:.3}, {:.3}) of it in the frame of the {}",
            100.0 * size,
            best.share.x,
            best.share.y,
            if best.turns { "tool" } else { "world" }
        ),
        gain: gain("force", "N", errors, held.iter().map(|a| a.name.clone()).collect()),
    }
    .finding()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lifts of 5 N that read `share` of it across, the tool turned by 0.5 rad more each time.
    fn lifts(share: impl Fn(&Matrix2<f64>) -> Vector2<f64>) -> Vec<Across> {
        let one = |k: u32| {
            let (sin, cos) = (0.5 * f64::from(k)).sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            Across {
                name: format!("lift-{k}"),
                held_out: k == 3,
                share: share(&turn) + Vector2::x() * if k.is_multiple_of(2) { 1e-3 } else { -1e-3 },
                sd: 7e-3,
                weight: 5.0,
                turn,
            }
        };
        (0..4).map(one).collect()
    }

    fn slope(tx: f64) -> Finding {
        let told = Told {
            cause: "support-tilt",
            place: "support",
            probability: 0.8,
            rivals: &[("gravity-error", 0.15), ("tether", 0.03)],
            parameter: ("tx", Estimate::measured(tx, 1e-3, "rad", Vec::new(), "pushes")),
            residual: "force",
            statistic: 9.0,
            words: "pushing one way needs more force".into(),
            gain: gain("force", "N", [1.0, 0.1], Vec::new()),
        };
        let mut finding = told.finding();
        let ty = Estimate::measured(0.0, 1e-3, "rad", Vec::new(), "pushes");
        finding.parameters.insert("ty".into(), ty);
        finding
    }

    fn judged(all: &[Across], mut findings: Vec<Finding>) -> Vec<Finding> {
        weigh_in(all, true, &mut findings);
        findings
    }

    #[test]
    fn a_slope_that_lifts_read_is_gravitys_and_one_that_they_do_not_is_the_tables() {
        let tilted = judged(&lifts(|_| Vector2::new(0.08, 0.0)), vec![slope(0.08)]);
        assert_eq!((tilted.len(), tilted[0].cause.as_str()), (1, "gravity-error"));
        assert!(tilted[0].probability > 0.94 && tilted[0].alternatives.len() == 1);
        let strong = Told {
            cause: "force-gain",
            place: "sensor",
            probability: 0.67,
            rivals: &[("gravity-error", 0.3)],
            parameter: (
                "g",
                Estimate::measured(0.035, 2e-3, "1", Vec::new(), "lifts of stated weights"),
            ),
            residual: "force",
            statistic: 17.0,
            words: "stated weights are read as 1.035 times what they weigh".into(),
            gain: gain("force", "N", [0.3, 0.01], Vec::new()),
        };
        let both = judged(&lifts(|_| Vector2::new(0.08, 0.0)), vec![slope(0.08), strong.finding()]);
        assert!(both.len() == 1 && both[0].parameters.contains_key("scale") && both[0].evidence.len() == 2);
        let level = judged(&lifts(|_| Vector2::zeros()), vec![slope(0.08)]);
        assert_eq!((level.len(), level[0].cause.as_str()), (1, "support-tilt"));
        assert!(level[0].probability > 0.94);
    }

    #[test]
    fn what_lifts_alone_read_is_the_sensors_and_a_slight_slope_beside_it_is_none() {
        let leak = Vector2::new(0.1, -0.05);
        let found = judged(&lifts(|turn| turn * leak), vec![slope(0.012)]);
        assert_eq!((found.len(), found[0].cause.as_str()), (1, "force-crosstalk"));
        assert!(found[0].probability > 0.9 && found[0].gain.held_out == ["lift-3"] && found[0].gain.reduction > 0.9);
        assert!(judged(&lifts(|_| Vector2::new(0.01, 0.0)), Vec::new()).is_empty());
        // Of a tool that was held the same way each time, whichever way that was, nobody knows the frame.
        let mut askew = lifts(|_| leak);
        let turn = askew[2].turn;
        askew.iter_mut().for_each(|a| a.turn = turn);
        let found = judged(&askew, Vec::new());
        assert!(found[0].probability < 0.9 && found[0].gain.reduction > 0.9);
    }
}
