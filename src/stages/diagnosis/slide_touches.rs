//! When the tool of a push touched, and when what it feels there is foretold.

use nalgebra::Point3;

use crate::math::interpolate;
use crate::physics::{Action, PushPrediction};

/// Seconds after first contact in which static friction and presliding rule: the model does not say.
pub(super) const SETTLE: f64 = 0.25;
/// Below this share of its largest speed while it touches the tool starts or stops: the force of a standing tool is not
/// determined.
const STEADY: f64 = 0.7;
/// Way of a finger before it moves what it meets and after it moved it, over which it may press already or still, m: neither is
/// rigid.
const YIELDS: f64 = 2.5e-3;
/// Seconds on each side over which the acceleration of what is moved is taken: nearer to its end a push is not judged.
pub(super) const PULLED: f64 = 0.06;

/// When the tool touched, and how it went.
pub(super) struct Touches {
    way: Way,
    /// Beginning, end, and the speed that is steady enough, m/s.
    each: Vec<(f64, f64, f64)>,
    /// Where the tool was when a touch began or ended.
    ends: Vec<Point3<f64>>,
}

impl Touches {
    pub fn of(action: &Action, found: &PushPrediction) -> Self {
        let way = Way::of(action);
        let time = &found.prediction.time;
        let each = |(from, to): &(f64, f64)| {
            let own = time.iter().filter(|t| (from..=to).contains(t));
            (*from, *to, STEADY * own.map(|t| way.speed(*t)).fold(0.0, f64::max))
        };
        let ends = found.contact.iter().flat_map(|c| [c.0, c.1]);
        Self {
            each: found.contact.iter().map(each).collect(),
            ends: ends.filter_map(|t| way.at(t)).collect(),
            way,
        }
    }

    /// When it touched first; never where it did not.
    pub fn first(&self) -> f64 {
        self.each.first().map_or(f64::INFINITY, |c| c.0)
    }

    /// Whether it touches, and moves what it touches.
    pub fn touching(&self, t: f64) -> bool {
        self.each.iter().any(|c| (c.0..=c.1).contains(&t))
    }

    /// The fastest that it went while it touched, m/s.
    pub fn fastest(&self) -> f64 {
        self.each.iter().map(|c| c.2).fold(0.0, f64::max) / STEADY
    }

    /// Whether the tool never touched.
    pub fn none(&self) -> bool {
        self.each.is_empty()
    }

    /// Whether the tool moves steadily and either has touched for a while or is clear of what it touched.
    pub fn steady(&self, t: f64) -> bool {
        let Some((from, to, steady)) = self.each.iter().rev().find(|c| c.0 <= t) else {
            return false;
        };
        let settled = if t <= *to {
            (from + SETTLE..to - PULLED).contains(&t)
        } else {
            self.apart(t)
        };
        settled && self.way.speed(t) > *steady
    }

    /// Whether the tool is farther than both may yield from where any touch began or ended.
    pub fn apart(&self, t: f64) -> bool {
        let at = self.way.at(t);
        at.is_some_and(|at| self.ends.iter().all(|end| (end - at).norm() > YIELDS))
    }
}

/// Where the tool is.
struct Way {
    time: Vec<f64>,
    axes: [Vec<f64>; 3],
}

impl Way {
    fn of(action: &Action) -> Self {
        let axis = |k: usize| action.tool.position.iter().map(|p| p[k]).collect();
        Self {
            time: action.tool.time.clone(),
            axes: [axis(0), axis(1), axis(2)],
        }
    }

    fn at(&self, t: f64) -> Option<Point3<f64>> {
        let at = |k: usize| interpolate(&self.time, &self.axes[k], t);
        Some(Point3::new(at(0)?, at(1)?, at(2)?))
    }

    fn speed(&self, t: f64) -> f64 {
        let h = 0.04;
        let far = self.at(t + h).zip(self.at(t - h));
        far.map_or(0.0, |(to, from)| (to - from).norm() / (2.0 * h))
    }
}

/// Speed from which on what a tool meets may fly ahead of it, m/s, and the share of the foretold force below which it does.
const FAST: f64 = 0.1;
const UNTOUCHED: f64 = 0.1;

/// Whether what goes so fast (m/s) has left the tool that it was struck by behind: a force (N) that is foretold does not act on it.
pub fn flies(measured: f64, foretold: f64, speed: f64) -> bool {
    speed > FAST && measured < UNTOUCHED * foretold
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nalgebra::Vector3;

    use super::*;
    use crate::physics::{Hold, ToolMotion};

    /// A finger at 40 mm/s that touches from 0.5 to 2 s, stands there until 2.5 s and is drawn back.
    fn pushed() -> (Action, PushPrediction) {
        let way = |t: f64| {
            if t < 2.5 {
                0.04 * t.min(2.0)
            } else {
                0.08 - 0.04 * (t - 2.5)
            }
        };
        let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let action = Action {
            target: "box".into(),
            tool: ToolMotion {
                radius: 0.008,
                hold: Hold::Push,
                turned: Vec::new(),
                position: time.iter().map(|t| Point3::new(way(*t), 0.0, 0.03)).collect(),
                time: time.clone(),
            },
            start: BTreeMap::new(),
            normal: Vector3::z_axis(),
            gravity: 9.81,
        };
        let mut found = PushPrediction::default();
        found.prediction.time = time;
        found.contact = vec![(0.5, 2.0)];
        (action, found)
    }

    #[test]
    fn nothing_is_said_where_a_finger_may_press_already_or_still() {
        let (action, found) = pushed();
        let touches = Touches::of(&action, &found);
        assert!(touches.first() == 0.5 && touches.touching(1.0) && !touches.touching(2.2));
        assert!((touches.fastest() - 0.04).abs() < 1e-9);
        // 4 mm before the touch it is clear of it, 2 mm before it is not.
        assert!(touches.apart(0.4) && !touches.apart(0.45));
        // Not where it sets out, where it stops and stands, nor while it is drawn back by less than what yields.
        let steady = [0.6, 1.0, 1.9, 1.95, 2.3, 2.55, 2.8].map(|t| touches.steady(t));
        assert_eq!(steady, [false, true, true, false, false, false, true]);
    }

    #[test]
    fn only_what_is_fast_and_hardly_felt_flies() {
        let cases = [(0.05, 0.3), (0.05, 0.05), (0.5, 0.3)].map(|(felt, speed)| flies(felt, 1.0, speed));
        assert_eq!(cases, [true, false, false]);
    }
}
