//! What hands hold goes where they go: a scale or a rotation of the tracking shows in the way of what they hold beside theirs,
//! whatever forces and joints there are.
//!
//! The place that is held is where the tool was at first, in the frame of what is tracked. What runs on a rail goes along it as far as
//! a finger that shoves it does, too.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::frames::{Gone, PART, Way};
use crate::capture::{Capture, Interaction, Kind, PoseStream};
use crate::math::{interpolate, mad_sd};
use crate::twin::{JointKind, Model};

/// Shortest way of a hand that tells it, m.
const WAY: f64 = 0.02;
/// What turns by more hangs on where exactly it is held, rad.
const TURNED: f64 = 0.15;
/// Correlation of load and way from which on a grip that gives looks like a scale or a rotation.
const LOADED: f64 = 0.85;
/// Rows at the beginning from which the place is taken that is held, and fewest rows.
const FIRST: usize = 8;
const FEWEST: usize = 20;
/// Steeper than this a way has no side that is level.
const STEEP: f64 = 0.3;
/// Share of the largest load along a rail from which on a finger touches.
const TOUCHES: f64 = 0.3;

/// Every touch in which a hand moved what it holds far enough, and hardly turned it, or a finger what runs on a rail.
pub(super) fn hand_ways(capture: &Capture, model: &Model) -> Vec<Gone> {
    let Some(up) = (-capture.gravity).try_normalize(1e-9) else {
        return Vec::new();
    };
    let on_rail = |i: &Interaction| {
        let mut joints = model.twin.joints().filter(|j| j.kind == JointKind::Prismatic);
        i.kind == Kind::Push && joints.any(|j| i.target.as_ref() == Some(&j.child))
    };
    let one = |i: &Interaction| {
        Some(Gone {
            interaction: i.name.clone(),
            held_out: i.held_out,
            way: way(i, &up, on_rail(i))?,
        })
    };
    capture.interactions.iter().filter_map(one).collect()
}

/// Means about each time of `at`, over half of its step to either side.
fn beside(time: &[f64], rows: &[Vector3<f64>], at: &[f64]) -> Vec<Option<Vector3<f64>>> {
    let step = (at[at.len() - 1] - at[0]) / (at.len() - 1) as f64;
    let parts: [Vec<f64>; 3] = [0, 1, 2].map(|k| rows.iter().map(|r| r[k]).collect());
    let between = |t: f64| {
        let of = |k: usize| interpolate(time, &parts[k], t);
        Some(Vector3::new(of(0)?, of(1)?, of(2)?))
    };
    let mean = |t: &f64| {
        let own = time.partition_point(|x| *x < t - 0.5 * step)..time.partition_point(|x| *x <= t + 0.5 * step);
        if own.is_empty() {
            return between(*t);
        }
        let n = own.len() as f64;
        Some(rows[own].iter().sum::<Vector3<f64>>() / n).filter(|v| v.x.is_finite())
    };
    at.iter().map(mean).collect()
}

/// Pearson's correlation of those that are both read.
fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let all: Vec<(f64, f64)> = pairs.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let n = all.len().max(1) as f64;
    let (x, y) = (
        all.iter().map(|p| p.0).sum::<f64>() / n,
        all.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let sum = |of: &dyn Fn(f64, f64) -> f64| all.iter().map(|p| of(p.0 - x, p.1 - y)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt().max(1e-30)
}

/// A pose and where the tool is at its time.
struct Row {
    tool: Vector3<f64>,
    at: Point3<f64>,
    rotation: UnitQuaternion<f64>,
    load: Vector3<f64>,
}

fn rows(interaction: &Interaction, track: &PoseStream, path: &PoseStream) -> Vec<Row> {
    let tool: Vec<Vector3<f64>> = path.position.iter().map(|p| p.coords).collect();
    let tools = beside(&path.time, &tool, &track.time);
    let loads = interaction
        .force
        .as_ref()
        .map(|f| beside(&f.time, &f.force, &track.time));
    let one = |i: usize| {
        Some(Row {
            tool: tools[i]?,
            at: track.position[i],
            rotation: track.rotation[i]?,
            load: loads.as_ref().and_then(|l| l[i]).unwrap_or_default(),
        })
    };
    let all = (0..track.len()).filter_map(one);
    all.filter(|r| r.at.x.is_finite() && r.tool.x.is_finite()).collect()
}

/// Leaves those in which a finger touches.
fn touching(all: &mut Vec<Row>) {
    let most = all.iter().map(|r| r.load.norm()).fold(0.0, f64::max);
    all.retain(|r| r.load.norm() > TOUCHES * most);
}

fn way(interaction: &Interaction, up: &Vector3<f64>, on_rail: bool) -> Option<Way> {
    let holds = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    if !holds && !on_rail {
        return None;
    }
    let track = interaction.tracks.get(interaction.target.as_ref()?)?;
    let path = interaction.tool_path.as_ref().filter(|p| p.len() > FEWEST)?;
    if track.len() < FEWEST {
        return None;
    }
    let mut all = rows(interaction, track, path);
    if !holds {
        touching(&mut all);
    }
    if all.len() < FEWEST {
        return None;
    }
    let mean = |of: &dyn Fn(&Row) -> Vector3<f64>| all[..FIRST].iter().map(of).sum::<Vector3<f64>>() / FIRST as f64;
    let held = mean(&|r| r.rotation.inverse() * (r.tool - r.at.coords));
    let home = mean(&|r| r.tool);
    let farthest = all
        .iter()
        .map(|r| r.tool - home)
        .max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let turned = all
        .iter()
        .map(|r| all[0].rotation.angle_to(&r.rotation))
        .fold(0.0, f64::max);
    let length = farthest.norm();
    if length < WAY || turned > TURNED {
        return None;
    }
    let ahead = farthest / length;
    let side = up.cross(&ahead);
    let level = side.norm() > 1.0 - STEEP;
    let side = side.try_normalize(1e-9).unwrap_or_default();
    let moved = |r: &&Row| (PART[0]..PART[1]).contains(&((r.tool - home).dot(&ahead) / length));
    let moving: Vec<&Row> = all.iter().filter(moved).collect();
    let off = |r: &Row| r.at.coords + r.rotation * held - r.tool;
    let of = |r: &&Row| ((r.tool - home).dot(&ahead), off(r).dot(&ahead), off(r).dot(&side));
    // A grip gives along and across by the load there.
    let loaded = |along: &Vector3<f64>| {
        let pairs = moving.iter().map(|r| ((r.tool - home).dot(&ahead), r.load.dot(along)));
        correlation(pairs).abs() > LOADED
    };
    let steps: Vec<f64> = all.windows(2).map(|w| (off(&w[1]) - off(&w[0])).dot(&ahead)).collect();
    (moving.len() >= FEWEST).then(|| Way {
        rows: moving.iter().map(of).collect(),
        noise: mad_sd(&steps).map(|s| s / std::f64::consts::SQRT_2),
        turned,
        tells: [!loaded(&ahead), holds && level && !loaded(&side)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Tool, ToolShape, WrenchStream};

    /// A hand that draws something 12 cm along a line and half way back against 1 N, tracked in a frame that is scaled and turned.
    fn drawn(scale: f64, angle: f64, gives: f64) -> Interaction {
        let time: Vec<f64> = (0..400).map(|i| 0.01 * f64::from(i)).collect();
        let ahead = Vector3::new(0.6, 0.8, 0.0);
        let way = |t: f64| 0.12 * (t / 2.0).min(1.0) - 0.06 * ((t - 2.5) / 1.5).clamp(0.0, 1.0);
        let load = |t: f64| if gives > 0.0 { 20.0 * way(t) } else { (2.2 - t).signum() };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let hand = |t: f64| Vector3::new(0.3, -0.2, 0.1) + ahead * way(t);
        let body = |t: f64| {
            let true_place = hand(t) - Vector3::new(0.05, 0.0, 0.0) - ahead * (gives * load(t));
            let ripple = Vector3::new((41.0 * t).sin(), (67.0 * t).cos(), 0.0) * 1e-4;
            Point3::from(turn * true_place * (1.0 + scale) + ripple)
        };
        let stream = |at: &dyn Fn(f64) -> Point3<f64>, q: UnitQuaternion<f64>| PoseStream {
            position: time.iter().map(|t| at(*t)).collect(),
            rotation: vec![Some(q); time.len()],
            time: time.clone(),
        };
        Interaction {
            name: "pull-00".into(),
            kind: Kind::Pull,
            action: None,
            tool_name: None,
            support_path: None,
            frames: None,
            held_out: false,
            target: Some("drawer".into()),
            tool: Some(Tool {
                shape: ToolShape::Sphere { radius: 0.01 },
                grip: true,
                pin: false,
            }),
            force: Some(WrenchStream {
                force: time.iter().map(|t| ahead * load(*t)).collect(),
                time: time.clone(),
                torque: None,
            }),
            tool_path: Some(stream(&|t| hand(t).into(), UnitQuaternion::identity())),
            tracks: [("drawer".to_owned(), stream(&body, turn))].into(),
        }
    }

    #[test]
    fn what_a_hand_holds_tells_how_its_tracking_is_scaled_and_turned() {
        for (scale, angle) in [(0.03, 0.0), (0.0, 0.04), (-0.02, -0.03)] {
            let way = way(&drawn(scale, angle, 0.0), &Vector3::z(), false).expect("a way");
            let [along, across] = [0, 1].map(|k| way.slope(k).expect("it tells"));
            assert!((along - scale).abs() < 2e-3, "{along} for {scale}");
            assert!((across - angle).abs() < 2e-3, "{across} for {angle}");
        }
    }

    #[test]
    fn a_finger_tells_a_scale_of_what_runs_on_a_rail_and_no_turn() {
        let mut shoved = drawn(-0.03, 0.0, 0.0);
        shoved.tool.iter_mut().for_each(|t| t.grip = false);
        assert!(way(&shoved, &Vector3::z(), false).is_none());
        let way = way(&shoved, &Vector3::z(), true).expect("a way");
        let along = way.slope(0).expect("it tells");
        assert!((along + 0.03).abs() < 2e-3, "{along}");
        assert!(way.slope(1).is_none());
    }

    #[test]
    fn a_grip_that_gives_is_no_scale() {
        let way = way(&drawn(0.0, 0.0, 1e-3), &Vector3::z(), false).expect("a way");
        assert!(way.slope(0).is_none(), "{:?}", way.slope(0));
    }
}
