//! What the plain model says of the motion of a pushed body, and what the blow of the tool leaves in the force.

use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};

use super::blows::Blow;
use crate::capture::{Interaction, PhaseKind, PoseStream, Segmented};
use crate::math::{interpolate, median, quantile};
use crate::physics::PushPrediction;
use crate::twin::Link;

/// Time after the force rose in which it is highest, s.
const OVERSHOOTS: f64 = 0.25;
/// How long before the force rose the tool is looked at, s.
const BEFORE: [f64; 2] = [0.03, 0.11];
/// The blow with which the tool meets a body: how far the force overshoots what comes after, or speed times the square root of
/// stiffness and mass, the stiffness as the force rose.
pub fn impact(time: &[f64], force: &[Vector3<f64>], (motion, end): (&Motion, f64), onset: f64, mass: f64) -> Blow {
    let speed = motion.at(onset + 0.05).speed.max(1e-4);
    let near = |i: &usize| (time[*i] - onset).abs() < 0.15 && *i > 0;
    let steep = |i: usize| (force[i].norm() - force[i - 1].norm()) / (time[i] - time[i - 1]).max(1e-6);
    let rate = (0..time.len()).filter(near).map(steep).fold(0.0, f64::max);
    let level = motion.at(onset + 0.05).force.norm();
    let highest = |until: f64| {
        let within = (0..time.len()).filter(|i| (-0.15..until).contains(&(time[*i] - onset)));
        within.map(|i| force[i].norm()).fold(0.0, f64::max)
    };
    let slides = (0..time.len()).filter(|i| (onset + OVERSHOOTS..end).contains(&time[*i]));
    let steady = median(&slides.map(|i| force[i].norm()).collect::<Vec<f64>>());
    Blow {
        size: (speed * (rate / speed * mass).sqrt()).max(highest(0.15) - level),
        over: steady.map_or(0.0, |s| highest(OVERSHOOTS) - s),
        level: steady.unwrap_or(0.0),
        speed,
        swings: (rate / speed / mass).sqrt(),
        ..Blow::default()
    }
}

/// Share of what the plain model says, and standard deviations of a reading, from which on the tool touches, for this many readings.
const TOUCHES: (f64, f64, usize) = (0.15, 6.0, 3);

/// When the force first stood off the tare, and when it first reached half of what the plain model says. Something else may move
/// what is touched before, or help to.
pub fn rise(
    time: &[f64],
    (force, noise): (&[Vector3<f64>], f64),
    flat: &dyn Fn(&Vector3<f64>) -> Vector2<f64>,
    along: &Vector2<f64>,
    found: &PushPrediction,
    touched: (f64, f64),
) -> Option<[f64; 2]> {
    let of = |i: usize| flat(&force[i]).dot(along);
    let rest: Vec<f64> = (0..time.len()).filter(|i| time[*i] < touched.0 - 0.3).map(of).collect();
    let tare = median(&rest).unwrap_or(0.0);
    let inside: Vec<f64> = found
        .prediction
        .force
        .iter()
        .map(|f| flat(f).dot(along))
        .filter(|f| f.abs() > 1e-9)
        .collect();
    let level = median(&inside)?;
    let above = |i: &usize| of(*i) - tare > 0.5 * level && time[*i] > touched.0 - 0.3;
    let onset = (0..time.len()).find(above).map(|i| time[i])?;
    let stands_off = |i: usize| of(i) - tare > (TOUCHES.0 * level.abs()).max(TOUCHES.1 * noise);
    let all = 0..(time.len() + 1).saturating_sub(TOUCHES.2);
    // Without a tare nothing tells it from a bias.
    let begun = all
        .filter(|_| rest.len() > TOUCHES.2)
        .find(|i| (*i..i + TOUCHES.2).all(stands_off));
    Some([begun.map_or(onset, |i| time[i].min(onset)), onset])
}

/// Readings of a track that are averaged, and how far from the plain model's way (m, root mean square) the track is followed.
const SMOOTH: usize = 5;
const ASTRAY: f64 = 2e-3;

/// What the plain model says of the motion of the pushed body.
pub struct Motion {
    pub time: Vec<f64>,
    pub at: Vec<Vector2<f64>>,
    /// Since the push began, rad.
    pub turn: Vec<f64>,
    /// Heading before it, rad.
    pub start: f64,
    pub speed: Vec<f64>,
    pub force: Vec<Vector2<f64>>,
}

/// The motion at one time.
pub struct Moment {
    pub at: Vector2<f64>,
    pub turn: f64,
    pub speed: f64,
    pub force: Vector2<f64>,
}

impl Motion {
    pub fn of(found: &PushPrediction, link: &Link, plane: &[Vector3<f64>; 2]) -> Option<Self> {
        let poses = found.prediction.poses.get(&link.name)?;
        let com = link.com.as_ref().map(|c| c.value);
        let radius = link.friction.torsional_radius.as_ref().map_or(0.02, |r| r.value);
        let time = found.prediction.time.clone();
        let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&plane[0]), v.dot(&plane[1]));
        let middle = nalgebra::Point3::from(com.unwrap_or([0.0; 3]));
        let at: Vec<Vector2<f64>> = poses.iter().map(|p| flat(&(p.0 * middle).coords)).collect();
        let normal = plane[0].cross(&plane[1]);
        let yaw = |p: &crate::base::Pose| (p.rotation * poses[0].rotation.inverse()).scaled_axis().dot(&normal);
        let turn: Vec<f64> = poses.iter().map(yaw).collect();
        let start = poses[0].rotation.scaled_axis().dot(&normal);
        let h = 4.min(time.len().saturating_sub(1) / 2).max(1);
        let speed = (0..time.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(h), (i + h).min(time.len() - 1));
                let moved = (at[b] - at[a]).norm().hypot(radius * (turn[b] - turn[a]));
                moved / (time[b] - time[a]).max(1e-6)
            })
            .collect();
        let force = found.prediction.force.iter().map(flat).collect();
        Some(Self {
            time,
            at,
            turn,
            start,
            speed,
            force,
        })
    }

    /// Where the body went as it was tracked, where that is not where the plain model has it: laws of a place ask where it really was.
    pub fn led_by(&mut self, track: &PoseStream, link: &Link, plane: &[Vector3<f64>; 2]) {
        let middle = Vector3::from(link.com.as_ref().map_or([0.0; 3], |c| c.value));
        let rows = (0..track.len()).filter_map(|i| {
            let turn = track.rotation[i]?;
            let place = track.position[i].coords + turn * middle;
            place.iter().all(|x| x.is_finite()).then_some((track.time[i], place))
        });
        let (time, places): (Vec<f64>, Vec<Vector3<f64>>) = rows.unzip();
        if time.len() < SMOOTH {
            return;
        }
        let axes = plane.map(|axis| places.iter().map(|p| p.dot(&axis)).collect::<Vec<f64>>());
        let mean = |axis: &Vec<f64>, t: f64| {
            let i = time.partition_point(|x| *x < t);
            let from = i.saturating_sub(SMOOTH / 2).min(time.len() - SMOOTH);
            axis[from..from + SMOOTH].iter().sum::<f64>() / SMOOTH as f64
        };
        let tracked: Vec<Vector2<f64>> = self
            .time
            .iter()
            .map(|t| Vector2::new(mean(&axes[0], *t), mean(&axes[1], *t)))
            .collect();
        let apart = self.at.iter().zip(&tracked).map(|(a, b)| (a - b).norm_squared());
        if (apart.sum::<f64>() / self.at.len().max(1) as f64).sqrt() > ASTRAY {
            self.at = tracked;
        }
    }

    /// From when to when the tool moves it, s; a hand that takes `hold` of it does so while all rests.
    pub fn touched_by(&self, found: &PushPrediction, hold: Option<&Segmented>) -> Option<(f64, f64)> {
        let rest = hold
            .and_then(|s| s.phases.first())
            .filter(|p| p.kind == PhaseKind::Rest);
        let first = found.contact.first()?.0;
        Some((rest.map_or(first, |p| p.end.max(first)), found.contact.last()?.1))
    }

    /// Change of its speed about `t` over `span` seconds, m/s²; nothing before it was moved.
    pub fn acceleration(&self, t: f64, span: f64) -> f64 {
        let speed = |t: f64| interpolate(&self.time, &self.speed, t).unwrap_or(0.0);
        (speed(t + 0.5 * span) - speed(t - 0.5 * span)) / span
    }

    /// The largest such change, m/s², just before or after.
    pub fn hurry(&self, t: f64, span: f64) -> f64 {
        let each = HURRY.map(|k| self.acceleration(t + k * span, span).abs());
        each.into_iter().fold(0.0, f64::max)
    }

    pub fn at(&self, t: f64) -> Moment {
        let i = self.time.partition_point(|x| *x < t).clamp(1, self.time.len() - 1);
        let share = ((t - self.time[i - 1]) / (self.time[i] - self.time[i - 1]).max(1e-9)).clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + share * (b - a);
        let vector = |v: &[Vector2<f64>]| v[i - 1].lerp(&v[i], share);
        let force = if self.force[i].norm() > 0.0 {
            self.force[i]
        } else {
            self.force[i - 1]
        };
        let force = if self.force[i - 1].norm() > 0.0 && self.force[i].norm() > 0.0 {
            vector(&self.force)
        } else {
            force
        };
        Moment {
            at: vector(&self.at),
            turn: mix(self.turn[i - 1], self.turn[i]),
            speed: interpolate(&self.time, &self.speed, t).unwrap_or(0.0),
            force,
        }
    }
}

/// Speed of the tool over the middle of its way, from `onset` to `end` (s), m/s: a tip that gives waits where it begins.
pub fn going(
    interaction: &Interaction,
    plane: &[Vector3<f64>; 2],
    along: &Vector2<f64>,
    [onset, end]: [f64; 2],
) -> Option<f64> {
    let way = plane[0] * along.x + plane[1] * along.y;
    let path = interaction.tool_path.as_ref()?;
    let places: Vec<f64> = path.position.iter().map(|p| p.coords.dot(&way)).collect();
    let at = |share: f64| interpolate(&path.time, &places, onset + share * (end - onset));
    Some((at(0.75)? - at(0.25)?) / (0.5 * (end - onset)).max(1e-6))
}

/// Speed with which the tool came to the body, m/s. One that comes fast is slowed down by the blow, which is no slow start.
pub fn approach(interaction: &Interaction, plane: &[Vector3<f64>; 2], along: &Vector2<f64>, onset: f64) -> Option<f64> {
    let way = plane[0] * along.x + plane[1] * along.y;
    let path = interaction.tool_path.as_ref()?;
    let places: Vec<f64> = path.position.iter().map(|p| p.coords.dot(&way)).collect();
    let at = |before: f64| interpolate(&path.time, &places, onset - before);
    Some((at(BEFORE[0])? - at(BEFORE[1])?).abs() / (BEFORE[1] - BEFORE[0]))
}

/// Spans from a moment at which it is asked whether a hand speeds up or slows down.
const HURRY: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// Half the time over which it is asked whether a tool goes on, s.
const GOES_ON: f64 = 0.02;

/// How fast a tool goes on along its way, m/s, at any time; nothing of one that holds what it moves, which goes to and fro.
pub fn going_on<'a>(
    interaction: &'a Interaction,
    plane: &[Vector3<f64>; 2],
    along: &Vector2<f64>,
) -> Option<impl Fn(f64) -> f64 + 'a> {
    let holds = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    let path = interaction.tool_path.as_ref().filter(|_| !holds)?;
    let way = plane[0] * along.x + plane[1] * along.y;
    let places: Vec<f64> = path.position.iter().map(|p| p.coords.dot(&way)).collect();
    let at = move |t: f64| interpolate(&path.time, &places, t);
    Some(move |t: f64| {
        let gone = at(t + GOES_ON).zip(at(t - GOES_ON)).map(|(to, from)| to - from);
        gone.map_or(f64::INFINITY, |g| g / (2.0 * GOES_ON))
    })
}

/// How far a tool is back, or to a side, from where it stopped, m, that touches no more.
const LEAVES: f64 = 1e-3;

/// When a tool that pushed until `end` (s) leaves what it pushed, s: until then it may press on.
pub fn leaves(interaction: &Interaction, plane: &[Vector3<f64>; 2], along: &Vector2<f64>, end: f64) -> f64 {
    let path = interaction.tool_path.as_ref();
    path.map_or(end, |path| left_by(path, plane, along, end))
}

fn left_by(path: &PoseStream, plane: &[Vector3<f64>; 2], along: &Vector2<f64>, end: f64) -> f64 {
    let way = plane[0] * along.x + plane[1] * along.y;
    let from = path.time.partition_point(|t| *t < end);
    let Some(stopped) = path.position.get(from) else {
        return end;
    };
    let left = |p: &Point3<f64>| {
        let gone = p - stopped;
        let on = gone.dot(&way);
        on < -LEAVES || (gone - way * on).norm() > LEAVES
    };
    let first = (from..path.time.len()).find(|i| left(&path.position[*i]));
    first.map_or(f64::INFINITY, |i| path.time[i])
}

/// How far what is pushed comes back of itself, m, and to a side: something draws it, and it may rest against the tool again.
const BACK: f64 = 2e-3;
const ASIDE: f64 = 4e-3;

/// Whether what is tracked came back along `way`, or to a side of it, after a tool that pushed it until `end` (s): not what slides on.
pub fn drawn_back(track: &PoseStream, way: &Vector3<f64>, end: f64) -> bool {
    let (before, after): (Vec<_>, Vec<_>) = track.time.iter().zip(&track.position).partition(|(t, _)| **t < end);
    let near = |rows: &[(&f64, &Point3<f64>)]| {
        let axis = |k: usize| {
            let places: Vec<f64> = rows.iter().map(|(_, p)| p[k]).filter(|x| x.is_finite()).collect();
            median(&places)
        };
        Some(Vector3::new(axis(0)?, axis(1)?, axis(2)?))
    };
    let stopped = near(&before[before.len().saturating_sub(SMOOTH)..]);
    let rests = near(&after[after.len().saturating_sub(SMOOTH)..]);
    stopped.zip(rests).is_some_and(|(stopped, rests)| {
        let gone = rests - stopped;
        let on = gone.dot(way);
        on < -BACK || on < BACK && (gone - way * on).norm() > ASIDE
    })
}

/// Seconds over which the speed of a tool is taken.
const PACE: f64 = 0.1;

/// How slowly and how fast the tool went for a good part of a stretch, m/s.
pub fn paces(interaction: &Interaction, [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let path = interaction.tool_path.as_ref()?;
    let axes = [0, 1, 2].map(|k| path.position.iter().map(|p| p[k]).collect::<Vec<f64>>());
    let at = |t: f64| {
        let [x, y, z] = [0, 1, 2].map(|k| interpolate(&path.time, &axes[k], t));
        Some(Vector3::new(x?, y?, z?))
    };
    let steps = ((to - from) / PACE).floor().max(0.0) as usize;
    let ends = |k: usize| Some((at(from + k as f64 * PACE)?, at(from + (k + 1) as f64 * PACE)?));
    let each = (0..steps).filter_map(ends).map(|(a, b)| (b - a).norm() / PACE);
    let each: Vec<f64> = each.collect();
    Some([quantile(&each, 0.3)?, quantile(&each, 0.9)?])
}

/// World-from-tool at a time.
pub fn tool_turn(interaction: &Interaction, t: f64) -> UnitQuaternion<f64> {
    let of = |path: &PoseStream| {
        let i = path.time.partition_point(|x| *x < t).min(path.len().saturating_sub(1));
        path.rotation.get(i).copied().flatten()
    };
    interaction
        .tool_path
        .as_ref()
        .and_then(of)
        .unwrap_or_else(UnitQuaternion::identity)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(place: impl Fn(f64) -> f64) -> PoseStream {
        let time: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
        PoseStream {
            position: time.iter().map(|t| Point3::new(place(*t), 0.0, 0.0)).collect(),
            rotation: vec![None; time.len()],
            time,
        }
    }

    /// Pushed on until 1 s, and from 1.2 s on by these speeds along and across its way for 0.3 s, m/s.
    #[test]
    fn what_comes_back_is_drawn_and_what_slides_on_is_not() {
        let drawn = |[on, aside]: [f64; 2]| {
            let after = |t: f64| (t - 1.2).clamp(0.0, 0.3);
            let mut track = path(|t| 0.05 * t.min(1.0) + on * after(t));
            for i in 0..track.len() {
                track.position[i].y = aside * after(track.time[i]);
            }
            drawn_back(&track, &Vector3::x(), 1.0)
        };
        assert!(drawn([-0.02, 0.0]) && drawn([0.0, 0.03]));
        assert!(!drawn([0.05, 0.02]) && !drawn([0.0, 0.0]));
    }

    #[test]
    fn a_finger_leaves_when_it_goes_back_and_not_while_it_stands() {
        let plane = [Vector3::x(), Vector3::y()];
        let stood = path(|t| 0.05 * t.min(1.0));
        let back = path(|t| 0.05 * t.min(1.0) - 0.05 * (t - 1.5).max(0.0));
        assert!(left_by(&stood, &plane, &Vector2::x(), 1.0).is_infinite());
        let left = left_by(&back, &plane, &Vector2::x(), 1.0);
        assert!((left - 1.53).abs() < 0.02, "{left}");
    }
}
