//! Where a hand that holds a body turns back, reading by reading: how the force turns round with it.

use nalgebra::Vector3;

use super::bristles::FEWEST;
use super::predict::Scene;
use crate::capture::{Capture, Interaction, Kind, PoseStream, Segmented};
use crate::math::{interpolate, local_quadratic, median, quantile};
use crate::stages::estimation::support_normal;
use crate::twin::Model;

/// Seconds of one reading of the force at least, and half of the span over which the hand's path is averaged, in its rows and s.
const BIN: f64 = 0.004;
const SMOOTH: (f64, f64) = (3.5, 0.01);
/// Share of its length by which a path may leave its line.
const STRAIGHT: f64 = 0.03;
/// Noises of its path, and the least way, m, by which a hand has to go back.
const BACK: (f64, f64) = (8.0, 2e-5);
/// Way before and after it turns that is looked at, m.
const NEAR: [f64; 2] = [2e-3, 8e-3];
/// Seconds on each side of a turn outside of which nothing is looked at.
const SOON: f64 = 1.0;
/// Fewest readings about one turn.
const READINGS: usize = 12;

/// What was read at one moment: s; m along the line of the hand; m/s; m/s²; N along that line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub time: f64,
    pub way: f64,
    pub speed: f64,
    pub acceleration: f64,
    pub force: f64,
}

/// A stretch on which the hand goes one way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// Its first moment and the one past its last.
    pub from: usize,
    pub to: usize,
    /// Along the line or against it.
    pub sign: f64,
    /// When it sets out, s.
    pub goes: f64,
}

/// One pull whose hand turns back.
#[derive(Clone, Debug)]
pub(super) struct Drag {
    pub interaction: String,
    pub held_out: bool,
    pub body: String,
    /// kg, as far as it is known.
    pub mass: f64,
    pub moments: Vec<Moment>,
    pub stretches: Vec<Stretch>,
    /// Time from one reading to the next, s.
    pub step: f64,
    /// Half of the time over which the hand's path is smoothed, s.
    pub half: f64,
    /// Noise of one reading of the force, N.
    pub noise: f64,
    /// When the body was tracked, s, and where it was then along the line, m.
    pub tracked: Vec<[f64; 2]>,
}

impl Drag {
    /// The moments about the beginning of a stretch: from shortly before it, to where the hand turns again or is away.
    pub fn about(&self, stretch: usize) -> std::ops::Range<usize> {
        let (before, after) = (&self.stretches[stretch - 1], &self.stretches[stretch]);
        let (turn, goes) = (self.moments[after.from].way, after.goes);
        let near = |i: usize, far: f64| {
            let m = &self.moments[i];
            (m.way - turn).abs() < far && (m.time - goes).abs() < SOON
        };
        let from = (before.from..after.from).find(|i| near(*i, NEAR[0]) && (*i..after.from).all(|k| near(k, NEAR[0])));
        let to = (after.from..after.to).find(|i| !near(*i, NEAR[1]));
        from.unwrap_or(after.from)..to.unwrap_or(after.to)
    }

    /// How far the hand goes after it set out while its smoothed path still turns, m: what happens within that is not resolved.
    pub fn blur(&self, stretch: usize) -> f64 {
        let about = self.moments[self.about(stretch)].iter();
        0.5 * about.map(|m| m.acceleration.abs()).fold(0.0, f64::max) * self.half * self.half
    }

    /// The stretches before which the hand went the other way.
    pub fn turns(&self) -> impl Iterator<Item = usize> + '_ {
        (1..self.stretches.len()).filter(|k| self.about(*k).len() >= READINGS)
    }
}

/// All pulls of single bodies along the support whose hand turns back on its line.
pub(super) fn drags(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Drag> {
    let up = support_normal(capture, model).into_inner();
    let of = |interaction: &Interaction| {
        let segmented = segmented.iter().find(|s| s.interaction == interaction.name);
        let scene = Scene {
            capture,
            interaction,
            segmented,
            model,
        };
        drag(&scene, &up)
    };
    let pulls = capture.interactions.iter().filter(|i| i.kind == Kind::Pull);
    pulls.filter_map(of).collect()
}

fn drag(scene: &Scene, up: &Vector3<f64>) -> Option<Drag> {
    let interaction = scene.interaction;
    interaction.tool.as_ref().filter(|t| t.grip)?;
    let body = scene.model.twin.body_of(interaction.target.as_ref()?)?;
    let link = body.links.first().filter(|_| body.links.len() == 1)?;
    let path = interaction.tool_path.as_ref()?;
    let line = line_of(path, up)?;
    let along = |p: &PoseStream| -> Vec<f64> { p.position.iter().map(|p| p.coords.dot(&line)).collect() };
    let ways = along(path);
    let step = median(&path.time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>())?;
    let (time, force, noise) = scene.raw_force(BIN)?;
    let half = SMOOTH.1.max(SMOOTH.0 * step);
    let moment = |(t, f): (&f64, &Vector3<f64>)| {
        let fit = local_quadratic(&path.time, &ways, *t, half)?;
        let force = f.dot(&line);
        force.is_finite().then_some(Moment {
            time: *t,
            way: fit.value,
            speed: fit.velocity,
            acceleration: fit.acceleration,
            force,
        })
    };
    let moments: Vec<Moment> = time.iter().zip(&force).filter_map(moment).collect();
    let stretches = stretches(&moments, (BACK.0 * noise_of(&path.time, &ways, half)).max(BACK.1));
    let rate = median(&moments.windows(2).map(|m| m[1].time - m[0].time).collect::<Vec<f64>>());
    let tracked = interaction.tracks.get(&link.name).map_or_else(Vec::new, |track| {
        let places = along(track).into_iter();
        track
            .time
            .iter()
            .copied()
            .zip(places)
            .filter(|p| p.1.is_finite())
            .map(|(t, x)| [t, x])
            .collect()
    });
    let rate = rate.filter(|_| stretches.len() > 1)?;
    Some(Drag {
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        body: link.name.clone(),
        mass: link.mass.as_ref().map_or(0.3, |m| m.value),
        step: rate,
        half,
        moments,
        stretches,
        noise: noise.unwrap_or(0.0),
        tracked,
    })
}

/// The direction along the support on which a path goes to and fro; nothing of one that leaves it.
fn line_of(path: &PoseStream, up: &Vector3<f64>) -> Option<Vector3<f64>> {
    let flat = |p: &Vector3<f64>| p - up * p.dot(up);
    let all: Vec<Vector3<f64>> = path
        .position
        .iter()
        .map(|p| p.coords)
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    let first = *all.first()?;
    let farthest = all
        .iter()
        .max_by(|a, b| flat(&(*a - first)).norm().total_cmp(&flat(&(*b - first)).norm()))?;
    let line = flat(&(farthest - first)).try_normalize(1e-6)?;
    let ways: Vec<f64> = all.iter().map(|p| (p - first).dot(&line)).collect();
    let length = quantile(&ways, 0.95)? - quantile(&ways, 0.05)?;
    let off: Vec<f64> = all
        .iter()
        .map(|p| ((p - first) - line * (p - first).dot(&line)).norm())
        .collect();
    (quantile(&off, 0.95)? < (STRAIGHT * length).max(BACK.1)).then_some(line)
}

/// What a path is off its local parabola by, m, as its mean over a span is.
fn noise_of(time: &[f64], ways: &[f64], half: f64) -> f64 {
    let stride = (time.len() / 200).max(1);
    let off = (0..time.len()).step_by(stride).filter_map(|i| {
        let fit = local_quadratic(time, ways, time[i], half)?;
        Some((ways[i] - fit.value).abs() * fit.gain[0])
    });
    let all: Vec<f64> = off.filter(|x| x.is_finite()).collect();
    1.5 * median(&all).unwrap_or(0.0)
}

/// The stretches on which a hand goes one way, each by more than `back`.
fn stretches(moments: &[Moment], back: f64) -> Vec<Stretch> {
    let mut out: Vec<Stretch> = Vec::new();
    let Some(first) = moments.first() else { return out };
    let (mut low, mut high) = ((0, first.way), (0, first.way));
    for (i, m) in moments.iter().enumerate() {
        let sign = out.last().map_or(0.0, |s| s.sign);
        if m.way >= high.1 {
            high = (i, m.way);
        }
        if m.way <= low.1 {
            low = (i, m.way);
        }
        let turned = if m.way > low.1 + back && sign <= 0.0 {
            Some((low.0, 1.0))
        } else if m.way < high.1 - back && sign >= 0.0 {
            Some((high.0, -1.0))
        } else {
            None
        };
        if let Some((from, sign)) = turned {
            if let Some(last) = out.last_mut() {
                last.to = from;
            }
            let goes = sets_out(moments, from, (sign, back));
            out.push(Stretch {
                from,
                to: moments.len(),
                sign,
                goes,
            });
            (low, high) = ((i, m.way), (i, m.way));
        }
    }
    out
}

/// When a hand sets out from where it is farthest: what goes four times as far took twice as long, if it speeds up evenly.
fn sets_out(moments: &[Moment], from: usize, (sign, back): (f64, f64)) -> f64 {
    let gone = |far: f64| {
        let away = |m: &&Moment| sign * (m.way - moments[from].way) > far;
        moments[from..].iter().find(away).map(|m| m.time)
    };
    let whole = gone(back).zip(gone(0.25 * back));
    whole.map_or(moments[from].time, |(whole, quarter)| {
        (2.0 * quarter - whole).max(moments[from].time)
    })
}

/// What the body lags behind the hand by, m, at the moments at which it was tracked.
pub(super) fn apart(drag: &Drag) -> Vec<[f64; 2]> {
    let (time, way): (Vec<f64>, Vec<f64>) = drag.moments.iter().map(|m| (m.time, m.way)).unzip();
    let each = drag.tracked.iter();
    each.filter_map(|[t, x]| Some([*t, interpolate(&time, &way, *t)? - x]))
        .collect()
}

/// Whether hands turned back so often, with what they hold tracked, that friction which turns round over a way would show.
pub(super) fn tells_bristles(capture: &Capture, segmented: &[Segmented], model: &Model) -> bool {
    let all = drags(capture, segmented, model);
    let tracked = all.iter().filter(|d| !d.held_out && !d.tracked.is_empty());
    tracked.map(|d| d.turns().count()).sum::<usize>() >= FEWEST
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A hand that goes twice to and fro by 20 mm at a speed, m/s, with this acceleration, m/s², and feels nothing.
    pub(in super::super) fn drag(k: u32, speed: f64, acceleration: f64) -> Drag {
        let (step, length) = (4e-3, 0.02);
        let ramp = speed / acceleration;
        let lasts = length / speed + ramp;
        let one = |t: f64| -> [f64; 3] {
            if t < ramp {
                [0.5 * acceleration * t * t, acceleration * t, acceleration]
            } else if t < lasts - ramp {
                [speed * (t - 0.5 * ramp), speed, 0.0]
            } else {
                let left = lasts - t;
                [
                    length - 0.5 * acceleration * left * left,
                    acceleration * left,
                    -acceleration,
                ]
            }
        };
        let mut moments = Vec::new();
        for i in 0..(4.0 * lasts / step) as usize {
            let t = step * i as f64;
            let (stretch, back) = ((t / lasts) as usize, (t / lasts) as usize % 2 == 1);
            let [way, v, a] = one(t - lasts * stretch as f64);
            let sign = if back { -1.0 } else { 1.0 };
            moments.push(Moment {
                time: t,
                way: if back { length - way } else { way },
                speed: sign * v,
                acceleration: sign * a,
                force: 0.0,
            });
        }
        Drag {
            interaction: format!("pull-{k}"),
            held_out: false,
            body: "box".into(),
            mass: 0.5,
            stretches: stretches(&moments, 2e-5),
            moments,
            step,
            half: 0.01,
            noise: 0.01,
            tracked: Vec::new(),
        }
    }

    /// Tracks the body, by how far it lags behind the hand at each moment, m.
    pub(in super::super) fn follow(drag: &mut Drag, lag: &dyn Fn(usize) -> f64) {
        let noise = |i: usize| 5e-5 * ((i * 31 % 17) as f64 / 8.0 - 1.0);
        let own = drag.moments.iter().enumerate().step_by(3);
        drag.tracked = own.map(|(i, m)| [m.time, m.way - lag(i) + noise(i)]).collect();
    }

    #[test]
    fn a_hand_that_turns_back_goes_in_stretches() {
        let drag = drag(0, 0.02, 0.2);
        let signs: Vec<f64> = drag.stretches.iter().map(|s| s.sign).collect();
        assert_eq!(signs, [1.0, -1.0, 1.0, -1.0]);
        let lasts = 0.02 / 0.02 + 0.1;
        for (k, s) in drag.stretches.iter().enumerate() {
            assert!((s.goes - lasts * k as f64).abs() < 0.02, "{s:?}");
        }
        assert_eq!(drag.turns().count(), 3);
    }
}
