//! How the tool (or the support) moves: smooth speed profiles along a line or an arc.

use nalgebra::{UnitQuaternion, Vector3};

use super::body::Frame;

/// One smooth move of a travel from `from` to `to`: the speed rises and falls as a cubic, with a plateau between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    start: f64,
    from: f64,
    to: f64,
    peak: f64,
    rise: f64,
    plateau: f64,
    fall: f64,
}

impl Move {
    /// Begins at `start` with at most `speed`, and mean accelerations of `gather` and `brake`.
    pub fn new(start: f64, (from, to): (f64, f64), speed: f64, gather: f64, brake: f64) -> Self {
        let distance = (to - from).abs();
        let cost = 0.5 / gather + 0.5 / brake;
        let peak = speed.min((distance / cost).sqrt()).max(1e-9);
        let plateau = ((distance - peak * peak * cost) / peak).max(0.0);
        Self {
            start,
            from,
            to,
            peak,
            rise: peak / gather,
            plateau,
            fall: peak / brake,
        }
    }

    /// When it is over.
    pub fn end(&self) -> f64 {
        self.start + self.rise + self.plateau + self.fall
    }

    /// Travel and its rate.
    fn at(&self, time: f64) -> (f64, f64) {
        let t = time - self.start;
        let (done, speed) = if t <= 0.0 {
            (0.0, 0.0)
        } else if t < self.rise {
            let u = t / self.rise;
            (self.peak * self.rise * u * u * u * (1.0 - 0.5 * u), self.peak * u * u * (3.0 - 2.0 * u))
        } else if t < self.rise + self.plateau {
            (self.peak * (t - 0.5 * self.rise), self.peak)
        } else {
            let u = ((self.end() - time) / self.fall).clamp(0.0, 1.0);
            let left = self.peak * self.fall * u * u * u * (1.0 - 0.5 * u);
            ((self.to - self.from).abs() - left, self.peak * u * u * (3.0 - 2.0 * u))
        };
        let sign = (self.to - self.from).signum();
        (self.from + sign * done, sign * speed)
    }
}

/// Moves one after another.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves(pub Vec<Move>);

impl Moves {
    /// Travel and its rate at a time.
    pub fn at(&self, time: f64) -> (f64, f64) {
        match self.0.iter().rev().find(|m| m.start <= time).or(self.0.first()) {
            Some(found) => found.at(time),
            None => (0.0, 0.0),
        }
    }

    /// The farthest travels either way.
    pub fn range(&self) -> (f64, f64) {
        self.0.iter().fold((0.0, 0.0), |(l, h): (f64, f64), m| (l.min(m.from.min(m.to)), h.max(m.from.max(m.to))))
    }
}

/// The way along which the tool travels.
#[derive(Clone, Debug)]
pub(crate) enum Course {
    /// Straight on.
    Line { direction: Vector3<f64> },
    /// About an axis; travel is measured along the arc, and `turning` takes the tool's axes along.
    Arc {
        centre: Vector3<f64>,
        axis: Vector3<f64>,
        turning: bool,
    },
}

/// A driven tool.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// Where the tool's origin is at travel 0.
    pub origin: Vector3<f64>,
    pub rotation: UnitQuaternion<f64>,
    pub course: Course,
    pub moves: Moves,
}

impl Drive {
    /// The tool at a time.
    pub fn frame(&self, time: f64) -> Frame {
        let (travel, rate) = self.moves.at(time);
        self.frame_at(travel, rate)
    }

    /// The tool at a travel.
    pub fn frame_at(&self, travel: f64, rate: f64) -> Frame {
        match &self.course {
            Course::Line { direction } => {
                let mut frame = Frame::at(self.origin + direction * travel, self.rotation);
                frame.velocity = direction * rate;
                frame
            }
            Course::Arc { centre, axis, turning } => {
                let arm = self.origin - centre;
                let radius = (arm - axis * axis.dot(&arm)).norm().max(1e-6);
                let turn = UnitQuaternion::from_scaled_axis(axis * (travel / radius));
                let arm = turn * arm;
                let rotation = if *turning { turn * self.rotation } else { self.rotation };
                let mut frame = Frame::at(centre + arm, rotation);
                let spin = axis * (rate / radius);
                frame.velocity = spin.cross(&arm);
                if *turning {
                    frame.angular_velocity = spin;
                }
                frame
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_arrives_and_its_rate_is_the_derivative() {
        let step = Move::new(0.5, (0.1, -0.05), 0.05, 0.5, 2.0);
        assert!((step.at(step.end()).0 + 0.05).abs() < 1e-12);
        for k in 0..400 {
            let t = 0.4 + 0.01 * f64::from(k);
            let slope = (step.at(t + 1e-6).0 - step.at(t - 1e-6).0) / 2e-6;
            assert!((slope - step.at(t).1).abs() < 1e-5, "at {t}");
        }
    }
}
