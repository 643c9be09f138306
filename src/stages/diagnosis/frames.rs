//! Tracking in a frame that is not the tool's: what is pushed straight then goes a little too far, or a little aside,
//! the same way in every push.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, UnitQuaternion};

use super::hand_frames::hand_ways;
use super::{Curve, Quantity, Trace};
use crate::base::Estimate;
use crate::capture::Capture;
use crate::math::{correlated_mean, interpolate, mad_sd, median, quantile, t_tail};
use crate::twin::{CauseOdds, Evidence, Finding, Gain, Model};

/// Fewest pushes that tell it.
const FEWEST: usize = 5;
/// A scale nearer to one, and a rotation smaller (rad), may be the shape's or the finger's.
const LEAST: [f64; 2] = [0.008, 0.012];
/// Standard errors over the pushes from which on it is named.
const CLEAR: f64 = 6.0;
/// Share of the error above the noise that it has to take away on touches that did not tell it.
const WORTH: f64 = 0.3;
/// Standard error of a median over that of a mean.
const MEDIAN: f64 = 1.25;
/// Shortest way that tells it, m.
const WAY: f64 = 0.012;
/// What turns by less went straight, rad: how far a body that turns goes aside is told by its friction, and known less well.
const STRAIGHT: f64 = 0.15;
/// Share of a recording in which tool and body are nearest: they touch.
const TOUCHING: f64 = 0.1;
/// Part of the way that is compared: the tool touches, and has not yet let go.
pub(super) const PART: [f64; 2] = [0.15, 0.95];

/// A scale or a rotation of the tracking as a finding; nothing where neither is clear or where it does not foretell
/// pushes that were not fitted.
pub fn frame_finding(capture: &Capture, model: &Model, traces: &[Trace]) -> Option<Finding> {
    let pushed = found(traces, &|t| reach(capture, &t.interaction).unwrap_or(0.0));
    pushed.or_else(|| told_by(&hand_ways(capture, model).iter().collect::<Vec<_>>()))
}

/// Whether enough pushes went far enough for a scale or a rotation of the tracking to show.
pub fn tells_frame(capture: &Capture, model: &Model, traces: &[Trace]) -> bool {
    let fitted = traces.iter().filter(|t| !t.held_out);
    let told = fitted.filter(|t| Way::of(t, reach(capture, &t.interaction).unwrap_or(0.0)).is_some());
    let held = hand_ways(capture, model)
        .iter()
        .filter(|w| !w.held_out && w.way.tells.contains(&true))
        .count();
    told.count() >= FEWEST || held >= FEWEST
}

/// How far from the tool, in the plane, what is tracked is while they touch, m.
fn reach(capture: &Capture, name: &str) -> Option<f64> {
    let push = capture.interactions.iter().find(|i| i.name == name)?;
    let track = match &push.target {
        Some(target) => push.tracks.get(target),
        None => push.tracks.values().next(),
    }?;
    let path = push.tool_path.as_ref()?;
    let up = -capture.gravity.try_normalize(1e-9)?;
    let own: [Vec<f64>; 3] = [0, 1, 2].map(|k| path.position.iter().map(|p| p[k]).collect());
    let away = track.time.iter().zip(&track.position).filter_map(|(t, at)| {
        let tool = |k: usize| interpolate(&path.time, &own[k], *t);
        let off = at - Point3::new(tool(0)?, tool(1)?, tool(2)?);
        Some((off - up * off.dot(&up)).norm())
    });
    quantile(&away.collect::<Vec<_>>(), TOUCHING)
}

fn found(traces: &[Trace], reach: &dyn Fn(&Trace) -> f64) -> Option<Finding> {
    let own = |t: &Trace| {
        Some(Gone {
            interaction: t.interaction.clone(),
            held_out: t.held_out,
            way: Way::of(t, reach(t))?,
        })
    };
    let ways: Vec<Gone> = traces.iter().filter_map(own).collect();
    // What went straight tells it best; all together may, too.
    let straight: Vec<_> = ways.iter().filter(|w| w.way.turned < STRAIGHT).collect();
    told_by(&straight).or_else(|| told_by(&ways.iter().collect::<Vec<_>>()))
}

/// A touch with how what it moved went.
pub(super) struct Gone {
    pub interaction: String,
    pub held_out: bool,
    pub way: Way,
}

fn told_by(ways: &[&Gone]) -> Option<Finding> {
    let (held, fitted): (Vec<&Gone>, Vec<&Gone>) = ways.iter().copied().partition(|w| w.held_out);
    if fitted.len() < FEWEST {
        return None;
    }
    let slopes = |k: usize| fitted.iter().filter_map(|w| w.way.slope(k)).collect::<Vec<_>>();
    let told = [0, 1].map(|k| Told::of(&slopes(k), LEAST[k]).filter(|_| slopes(k).len() >= FEWEST));
    let clear = |k: usize| told[k].as_ref().filter(|t| t.clear);
    let turned = clear(1).is_some();
    let main = clear(1).or(clear(0))?;
    let judged = if held.is_empty() { &fitted } else { &held };
    let (scale, angle) = (clear(0).map_or(0.0, |t| t.value), clear(1).map_or(0.0, |t| t.value));
    let noise = judged.iter().filter_map(|w| w.way.noise).fold(0.0, f64::max);
    let before = error(judged.iter().map(|w| &w.way), 0.0, 0.0)?;
    let after = error(judged.iter().map(|w| &w.way), scale, angle)?;
    let above = |x: f64| (x * x - noise * noise).max(0.0);
    let reduction = 1.0 - (above(after) / above(before).max(1e-30)).sqrt();
    if reduction < WORTH {
        return None;
    }
    let from: Vec<String> = fitted.iter().map(|t| t.interaction.clone()).collect();
    let names = [("s", "1"), ("a", "rad")];
    let stated = names.iter().zip(&told).filter_map(|((name, unit), t)| {
        let t = t.as_ref()?;
        let estimate = Estimate::measured(t.value, t.sd, unit, from.clone(), "way against the tool's");
        Some(((*name).to_owned(), estimate))
    });
    // A scale alone is that of all lengths as well as of this tracking.
    let (cause, other) = if turned {
        ("tracking-error", None)
    } else {
        ("length-scale", Some("tracking-error"))
    };
    let words = if turned {
        format!(
            "what is tracked goes {:.1} degrees aside of the tool that moves it",
            main.value.to_degrees()
        )
    } else {
        format!(
            "what is tracked goes {:.1} % too far for the tool that moves it",
            100.0 * main.value
        )
    };
    Some(Finding {
        leader: None,
        priors: BTreeMap::new(),
        cause: cause.into(),
        place: "sensor".into(),
        probability: if other.is_some() { 0.7 } else { 0.95 },
        alternatives: other
            .map(|c| CauseOdds {
                cause: c.into(),
                probability: 0.3,
            })
            .into_iter()
            .collect(),
        parameters: stated.collect::<BTreeMap<_, _>>(),
        evidence: vec![Evidence {
            residual: "position, against the way".into(),
            test: "median over pushes, Student's t".into(),
            statistic: main.value / main.scatter,
            p_value: (2.0 * t_tail((main.value / main.scatter).abs(), fitted.len() as f64 - 1.0)).min(1.0),
            words,
        }],
        gain: Gain {
            quantity: Quantity::Position.name().into(),
            rmse_before: before,
            rmse_after: after,
            unit: Quantity::Position.unit().into(),
            held_out: held.iter().map(|t| t.interaction.clone()).collect(),
            reduction,
            ..Gain::default()
        },
    })
}

/// Share of the error that a frame has to take away for all else to be asked of tracks that are put right first, and where pushes
/// agree on it to so many standard errors.
const SURE: f64 = 0.6;
const AGREED: (f64, f64) = (10.0, 0.4);

/// The capture with its tracks turned and scaled about the origin as the finding has it; nothing where it is not beyond doubt.
pub fn put_right(capture: &Capture, finding: &Finding) -> Option<Capture> {
    let agreed = finding.evidence.iter().any(|e| e.statistic.abs() > AGREED.0);
    if finding.gain.reduction < if agreed { AGREED.1 } else { SURE } {
        return None;
    }
    let of = |name: &str| finding.parameters.get(name).map_or(0.0, |e| e.value);
    let up = -capture.gravity.try_normalize(1e-9)?;
    let turn = UnitQuaternion::from_axis_angle(&Unit::new_unchecked(up), -of("a"));
    let mut out = capture.clone();
    for track in out.interactions.iter_mut().flat_map(|i| i.tracks.values_mut()) {
        for position in &mut track.position {
            *position = turn * *position / (1.0 + of("s"));
        }
        for rotation in track.rotation.iter_mut().flatten() {
            *rotation = turn * *rotation;
        }
    }
    Some(out)
}

/// What the pushes say together of one number.
struct Told {
    value: f64,
    scatter: f64,
    sd: f64,
    clear: bool,
}

impl Told {
    fn of(each: &[f64], least: f64) -> Option<Self> {
        let value = median(each)?;
        let scatter = MEDIAN * (mad_sd(each)? / (each.len() as f64).sqrt()).max(1e-4);
        let against = each.iter().filter(|x| **x * value < 0.0).count();
        let clear = value.abs() > least && value.abs() > CLEAR * scatter && 6 * against <= each.len();
        Some(Self {
            value,
            scatter,
            sd: scatter.hypot(0.3 * least),
            clear,
        })
    }
}

/// One touch while the tool moves the body: predicted way, and what was seen of it along and across beyond the
/// prediction, m.
pub(super) struct Way {
    pub rows: Vec<(f64, f64, f64)>,
    pub noise: Option<f64>,
    /// By how much the body turned at most, rad.
    pub turned: f64,
    /// Whether what is left along the motion, and across it, is a matter of the tracking.
    pub tells: [bool; 2],
}

impl Way {
    /// A body that turns about where the finger, `reach` away, touches it goes aside by that; so far as it was not foretold, it
    /// is no matter of the tracking.
    fn of(trace: &Trace, reach: f64) -> Option<Self> {
        let find = |word: &str| {
            let own = |c: &&Curve| c.quantity == Quantity::Position && c.label.contains(word);
            trace.curves.iter().find(own)
        };
        let (along, across) = (find("along the motion")?, find("across the motion")?);
        let heading = trace.curves.iter().find(|c| c.quantity == Quantity::Rotation);
        let last = along.predicted.iter().rfind(|p| p.is_finite()).copied()?;
        if last.abs() < WAY {
            return None;
        }
        let rows: Vec<(f64, f64, f64)> = (0..along.time.len().min(across.time.len()))
            .map(|i| {
                let off = |c: &Curve| c.measured[i] - c.predicted[i];
                let turned = heading.filter(|c| c.time.len() == across.time.len()).map_or(0.0, off);
                (along.predicted[i], off(along), off(across) - reach * turned)
            })
            .filter(|r| (PART[0]..PART[1]).contains(&(r.0 / last)) && r.1.is_finite() && r.2.is_finite())
            .collect();
        let headings = trace.curves.iter().filter(|c| c.quantity == Quantity::Rotation);
        let turned = headings.flat_map(|c| &c.measured).filter(|a| a.is_finite());
        (rows.len() >= 8).then_some(Self {
            turned: turned.fold(0.0, |most, a| most.max(a.abs())),
            rows,
            noise: along.noise,
            tells: [true; 2],
        })
    }

    /// Regression of what was seen beyond the prediction, along (0) or across (1), on the way.
    pub fn slope(&self, k: usize) -> Option<f64> {
        let n = self.rows.len() as f64;
        let of = |r: &(f64, f64, f64)| if k == 0 { r.1 } else { r.2 };
        let (x, y) = (
            self.rows.iter().map(|r| r.0).sum::<f64>() / n,
            self.rows.iter().map(of).sum::<f64>() / n,
        );
        let top: f64 = self.rows.iter().map(|r| (r.0 - x) * (of(r) - y)).sum();
        let base: f64 = self.rows.iter().map(|r| (r.0 - x).powi(2)).sum();
        self.tells[k].then_some(top / base.max(1e-30))
    }
}

/// Root mean square of what is left, an offset a push apart, with this scale and rotation.
fn error<'a>(ways: impl Iterator<Item = &'a Way>, scale: f64, angle: f64) -> Option<f64> {
    let mut squares = Vec::new();
    for way in ways {
        for k in (0..2).filter(|k| way.tells[*k]) {
            let left: Vec<f64> = way
                .rows
                .iter()
                .map(|r| if k == 0 { r.1 - scale * r.0 } else { r.2 - angle * r.0 })
                .collect();
            let mean = left.iter().sum::<f64>() / left.len() as f64;
            squares.extend(left.iter().map(|x| (x - mean).powi(2)));
        }
    }
    Some(correlated_mean(&squares)?.mean.sqrt())
}

/// One frame of the tracking is named: that which was put right before all else, or what fingers told by where they touch, or what
/// is left of how things go.
pub(super) fn take_up_frame(
    findings: &mut Vec<Finding>,
    stands: Option<Finding>,
    left: impl FnOnce() -> Option<Finding>,
) {
    let of_frame = |f: &Finding| matches!(f.cause.as_str(), "tracking-error" | "length-scale");
    if stands.is_some() {
        findings.retain(|f| !of_frame(f));
        findings.extend(stands);
    } else if !findings.iter().any(of_frame) {
        findings.extend(left());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(k: usize, scale: f64, angle: f64) -> Trace {
        let time: Vec<f64> = (0..150).map(|i| f64::from(i) * 0.01).collect();
        let way = |t: &f64| 0.04 * (t - 0.2).clamp(0.0, 1.0);
        let own = 0.002 * ((k * 7 % 5) as f64 - 2.0) / 2.0;
        let curve = |word: &str, predicted: Vec<f64>, measured: Vec<f64>| Curve {
            label: format!("tin: {word} the motion"),
            quantity: Quantity::Position,
            time: time.clone(),
            measured,
            predicted,
            noise: Some(1e-4),
        };
        let ripple = |t: &f64| 1e-4 * (t * 37.0).sin();
        let along = curve(
            "along",
            time.iter().map(way).collect(),
            time.iter().map(|t| (1.0 + scale + own) * way(t) + ripple(t)).collect(),
        );
        let across = curve(
            "across",
            vec![0.0; time.len()],
            time.iter().map(|t| (angle + own) * way(t) + ripple(t)).collect(),
        );
        Trace {
            interaction: format!("push-{k}"),
            held_out: k > 6,
            curves: vec![along, across],
            ..Trace::default()
        }
    }

    #[test]
    fn a_scale_and_a_rotation_of_the_tracking_are_told() {
        let all = |scale: f64, angle: f64| (0..9).map(|k| push(k, scale, angle)).collect::<Vec<_>>();
        let found = |scale: f64, angle: f64| super::found(&all(scale, angle), &|_| 0.05);
        let scaled = found(0.03, 0.0).expect("a scale");
        assert!(scaled.cause == "length-scale" && (scaled.parameters["s"].value - 0.03).abs() < 2e-3);
        let turned = found(0.0, -0.04).expect("a rotation");
        assert!(turned.cause == "tracking-error" && (turned.parameters["a"].value + 0.04).abs() < 2e-3);
        assert!(found(0.0, 0.0).is_none() && found(0.004, 0.005).is_none());
    }

    #[test]
    fn what_turns_does_not_drown_what_went_straight() {
        let turned = |k: usize| {
            let mut trace = push(k, 0.0, if k.is_multiple_of(2) { 0.06 } else { -0.05 });
            let way = &trace.curves[0];
            trace.curves.push(Curve {
                label: "tin: heading".into(),
                quantity: Quantity::Rotation,
                measured: way.predicted.iter().map(|p| 10.0 * p).collect(),
                ..way.clone()
            });
            trace
        };
        let all = (0..9).map(|k| push(k, 0.0, -0.02)).chain((9..18).map(turned));
        let found = found(&all.collect::<Vec<_>>(), &|_| 0.0).expect("a rotation");
        assert!((found.parameters["a"].value + 0.02).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn what_turns_about_the_finger_is_no_rotation_of_the_tracking() {
        let turning = |k: usize| {
            let mut trace = push(k, 0.0, 0.025);
            let way = &trace.curves[0];
            // It turns by as much as it goes aside, 5 cm from the finger, and was not foretold to.
            trace.curves.push(Curve {
                label: "tin: heading".into(),
                quantity: Quantity::Rotation,
                measured: way.predicted.iter().map(|p| 0.025 * p / 0.05).collect(),
                predicted: vec![0.0; way.time.len()],
                ..way.clone()
            });
            trace
        };
        let all: Vec<Trace> = (0..9).map(turning).collect();
        assert!(found(&all, &|_| 0.05).is_none() && found(&all, &|_| 0.0).is_some());
    }
}
