//! How the tool (or the support) moves: smooth speed profiles along a line or an arc.

use nalgebra::{UnitQuaternion, Vector3};

use super::body::Frame;

/// A stretch of time over which the speed goes smoothly (as a cubic) from one value to another.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    start: f64,
    duration: f64,
    from: f64,
    first: f64,
    last: f64,
}

impl Ramp {
    fn at(&self, time: f64) -> (f64, f64) {
        let t = (time - self.start).clamp(0.0, self.duration);
        let u = if self.duration > 0.0 { t / self.duration } else { 0.0 };
        let gain = self.last - self.first;
        let travel = self.from + self.first * t + gain * self.duration * u * u * u * (1.0 - 0.5 * u);
        (travel, self.first + gain * u * u * (3.0 - 2.0 * u))
    }
}

/// How far a thing has travelled at each time, legs and rests one after another.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    ramps: Vec<Ramp>,
    time: f64,
    travel: f64,
    speed: f64,
}

impl Moves {
    /// At rest at a travel, from time 0 on.
    pub fn from(travel: f64) -> Self {
        Self {
            travel,
            ..Self::default()
        }
    }

    /// Goes on as it goes for some seconds (at rest, it rests).
    pub fn rest(mut self, seconds: f64) -> Self {
        self.ramp(self.speed, seconds.max(0.0));
        self
    }

    /// Goes straight to the travel `to`, with at most `speed` on the way and the speed `last` there, with mean
    /// accelerations of `gather` and `brake`. Where it must turn about, it must be at rest.
    pub fn leg(mut self, to: f64, last: f64, speed: f64, gather: f64, brake: f64) -> Self {
        let (distance, sign) = ((to - self.travel).abs(), (to - self.travel).signum());
        let first = self.speed.abs();
        let (up, down) = (0.5 / gather, 0.5 / brake);
        let highest = ((distance + first * first * up + last * last * down) / (up + down)).sqrt();
        let peak = speed.min(highest).max(first).max(last).max(1e-9);
        let plateau = distance - (peak * peak - first * first) * up - (peak * peak - last * last) * down;
        self.ramp(sign * peak, (peak - first) / gather);
        self.ramp(sign * peak, plateau.max(0.0) / peak);
        self.ramp(sign * last, (peak - last) / brake);
        self.travel = to;
        self
    }

    fn ramp(&mut self, last: f64, duration: f64) {
        self.ramps.push(Ramp {
            start: self.time,
            duration,
            from: self.travel,
            first: self.speed,
            last,
        });
        self.time += duration;
        self.travel += 0.5 * (self.speed + last) * duration;
        self.speed = last;
    }

    /// When it is over.
    pub fn end(&self) -> f64 {
        self.time
    }

    /// Travel and its rate at a time.
    pub fn at(&self, time: f64) -> (f64, f64) {
        let ramp = self.ramps.iter().rev().find(|r| r.start <= time).or(self.ramps.first());
        ramp.map_or((self.travel, 0.0), |r| r.at(time))
    }

    /// The farthest travels either way.
    pub fn range(&self) -> (f64, f64) {
        let ends = self.ramps.iter().map(|r| r.from).chain([self.travel]);
        ends.fold((0.0, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)))
    }
}

/// The way along which the tool travels.
#[derive(Clone, Debug)]
pub(crate) enum Course {
    /// Straight on.
    Line { direction: Vector3<f64> },
    /// About an axis; travel is measured along the arc, and `turning` takes the tool's axes along. With a `pitch`
    /// (m/rad) it climbs along the axis.
    Arc {
        centre: Vector3<f64>,
        axis: Vector3<f64>,
        pitch: f64,
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
    /// Angle about the vertical by which the tool is turned on its way, rad.
    pub twist: Option<Moves>,
}

impl Drive {
    /// The tool at a time.
    pub fn frame(&self, time: f64) -> Frame {
        let (travel, rate) = self.moves.at(time);
        let mut frame = self.frame_at(travel, rate);
        if let Some(twist) = &self.twist {
            let (angle, spin) = twist.at(time);
            frame.rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * angle) * frame.rotation;
            frame.matrix = frame.rotation.to_rotation_matrix().into_inner();
            frame.angular_velocity += Vector3::z() * spin;
        }
        frame
    }

    /// Whether it twists at one of two times.
    pub fn twists(&self, time: f64, soon: f64) -> bool {
        let twist = self.twist.as_ref();
        twist.is_some_and(|t| t.at(time) != t.at(soon) || t.at(time).1 != 0.0)
    }

    /// The tool at a travel.
    pub fn frame_at(&self, travel: f64, rate: f64) -> Frame {
        match &self.course {
            Course::Line { direction } => {
                let mut frame = Frame::at(self.origin + direction * travel, self.rotation);
                frame.velocity = direction * rate;
                frame
            }
            Course::Arc {
                centre,
                axis,
                pitch,
                turning,
            } => {
                let arm = self.origin - centre;
                let radius = (arm - axis * axis.dot(&arm)).norm().max(1e-6);
                let turn = UnitQuaternion::from_scaled_axis(axis * (travel / radius));
                let arm = turn * arm;
                let rotation = if *turning { turn * self.rotation } else { self.rotation };
                let mut frame = Frame::at(centre + arm + axis * (pitch * travel / radius), rotation);
                let spin = axis * (rate / radius);
                frame.velocity = spin.cross(&arm) + spin * *pitch;
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
    fn moves_arrive_and_their_rate_is_the_derivative() {
        let moves = Moves::from(0.1)
            .rest(0.5)
            .leg(0.02, 0.005, 0.05, 0.5, 2.0)
            .leg(-0.05, 0.0, 0.03, 1.0, 0.5)
            .rest(0.1)
            .leg(0.0, 0.0, 10.0, 1.0, 1.0);
        assert!((moves.at(0.3).0 - 0.1).abs() < 1e-12 && moves.at(moves.end()).0.abs() < 1e-12);
        for k in 0..800 {
            let t = 0.4 + 0.01 * f64::from(k);
            let slope = (moves.at(t + 1e-6).0 - moves.at(t - 1e-6).0) / 2e-6;
            assert!((slope - moves.at(t).1).abs() < 1e-5, "at {t}");
        }
    }
}
