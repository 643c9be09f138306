//! How friction comes up when a push begins: a body that moves while the force still rises slides on bristles.
//!
//! Where the tool stands against the body is read while it slides; that is the place of the body at every moment of the
//! rise too, so that the way it had come when most of the force was there is known far better than one image of it. A
//! finger that gives way does not feign it: the body stays where it is until friction is full.

use nalgebra::{Point3, Vector3};

use super::clocks::{Clocks, worth_a_word};
use super::contact_law::contact_law_finding;
use super::predict::Scene;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Interaction, Kind, PoseStream, Segmented};
use crate::math::{interpolate, median, quantile, random_effects};
use crate::stages::estimation::{action_of, travel_direction};
use crate::twin::{Finding, Model};

/// Seconds of one sample of the force, and over which the tool's path is averaged.
const BIN: f64 = 0.006;
const SMOOTH: f64 = 0.012;
/// Seconds of one reading of a rise, and how long before it begins it is looked at.
const FINE: f64 = 0.002;
const BEFORE: f64 = 0.03;
/// Way of the tool after the force rose in which the body slides, m.
const SLIDES: [f64; 2] = [3e-3, 12e-3];
/// Share of the force at which it counts as up.
pub(super) const UP: f64 = 0.8;
/// Share of it at which it begins to rise; a level below that of the noise by so much tells nothing.
const BEGINS: f64 = 0.15;
const CLEAR_OF_NOISE: f64 = 12.0;
/// A force that first overshoots this many times is a blow.
const CALM: f64 = 1.5;
/// The finger slides along the face, or it is not the body that goes, where the two part by this share of the way.
const TOGETHER: f64 = 0.08;
/// Least standard deviation of one push, and scatter from push to push, m.
pub(super) const FLOOR: f64 = 3e-5;
/// Doubt of the way, as a share, since bristles may bend by another curve than in proportion.
const FORM: f64 = 0.15;
/// Fewest pushes, standard deviations, and the least way that is more than rounding of dry friction, m.
const FEWEST: usize = 3;
const CLEAR: f64 = 5.0;
const LEAST: f64 = 2e-4;
/// No bristles bend over a longer way, m: a force that grows over that has another reason.
const MOST: f64 = 4e-3;
/// Fewest readings of each part.
const READINGS: usize = 5;

/// The beginning of one push.
#[derive(Clone, Debug)]
pub(super) struct Onset {
    pub(super) interaction: String,
    pub(super) held_out: bool,
    /// Way at which friction would be up in full, m, with its standard deviation.
    pub(super) way: (f64, f64),
    /// Speed of the tool while the body slides, m/s.
    pub(super) speed: f64,
    /// Friction in full, N.
    pub(super) level: f64,
    /// Way of the body, m, beside the force, N.
    rows: Vec<[f64; 2]>,
    /// The same from before first touch on, reading by reading; what each scatters by, N.
    pub(super) rise: Vec<Reading>,
    pub(super) noise: f64,
    /// When the body begins to slide, s, with its standard deviation.
    pub(super) slips: (f64, f64),
    /// Time from one reading of the force to the next, s.
    pub(super) step: f64,
}

/// What was read at one moment of a rise: s; way of the body, m, as in [`Onset`]; N.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) time: f64,
    pub(super) way: f64,
    pub(super) force: f64,
}

impl Onset {
    /// One of which only its end is told: its name, whether it is held out, speed and way.
    #[cfg(test)]
    pub(super) fn told(name: &str, held_out: bool, speed: f64, way: (f64, f64)) -> Self {
        Self {
            interaction: name.to_owned(),
            held_out,
            way,
            speed,
            level: 1.0,
            rows: Vec::new(),
            rise: Vec::new(),
            noise: 0.0,
            slips: (0.0, 0.0),
            step: 0.0,
        }
    }

    /// How long the force is followed after the body slides, s.
    pub(super) fn followed(&self) -> f64 {
        self.rise.last().map_or(0.0, |r| r.time - self.slips.0)
    }
}

/// The beginnings of all pushes of bodies of one link, body by body.
pub fn onsets(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<(String, Vec<Onset>)> {
    let one = |name: &str| {
        let pushes = capture.interactions.iter().filter(|i| i.kind == Kind::Push);
        let all = pushes.filter_map(|interaction| {
            let segmented = segmented.iter().find(|s| s.interaction == interaction.name);
            let scene = Scene {
                capture,
                interaction,
                segmented,
                model,
            };
            onset(&scene, interaction, name)
        });
        (name.to_owned(), all.collect())
    };
    let alone = model.twin.bodies.iter().filter(|b| b.links.len() == 1);
    alone.map(|b| one(&b.links[0].name)).collect()
}

/// Bodies whose friction comes up over a way that can be seen, or fingers whose force does not go as their squeeze; `clocks`
/// is what the same pushes say of two clocks.
pub fn onset_findings(begun: &[(String, Vec<Onset>)], clocks: &Clocks) -> Vec<Finding> {
    let one = |(name, all): &(String, Vec<Onset>)| told(all, name, clocks).or_else(|| contact_law_finding(all, name));
    begun.iter().filter_map(one).collect()
}

/// Whether a body was pushed from rest so often, with force and track, that a way of its own would show.
pub fn begin_slowly(begun: &[(String, Vec<Onset>)]) -> bool {
    let fitted = |all: &[Onset]| all.iter().filter(|o| !o.held_out).count();
    begun.iter().any(|(_, all)| fitted(all) >= FEWEST)
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The tool's way along the push, by time.
struct Way<'a> {
    path: &'a PoseStream,
    along: Vector3<f64>,
}

impl Way<'_> {
    /// m; the mean of what was read about `t`.
    fn at(&self, t: f64) -> Option<f64> {
        let (from, to) = (
            self.path.time.partition_point(|x| *x < t - 0.5 * SMOOTH),
            self.path.time.partition_point(|x| *x <= t + 0.5 * SMOOTH),
        );
        let near: Vec<f64> = self.path.position[from..to]
            .iter()
            .map(|p| p.coords.dot(&self.along))
            .filter(|x| x.is_finite())
            .collect();
        if near.len() > 2 {
            return mean(&near);
        }
        let all: Vec<f64> = self.path.position.iter().map(|p| p.coords.dot(&self.along)).collect();
        interpolate(&self.path.time, &all, t)
    }

    /// When it is farthest.
    fn turns_back(&self) -> Option<f64> {
        let all = self.path.position.iter().map(|p| p.coords.dot(&self.along));
        let finite = all.enumerate().filter(|(_, x)| x.is_finite());
        finite
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _)| self.path.time[i])
    }
}

fn onset(scene: &Scene, interaction: &Interaction, name: &str) -> Option<Onset> {
    let action = action_of(scene.capture, interaction, scene.segmented, scene.model)?;
    let track = interaction.tracks.get(name).filter(|_| action.target == name)?;
    let along = travel_direction(&action)?;
    let way = Way {
        path: interaction.tool_path.as_ref()?,
        along,
    };
    let end = way.turns_back()?;
    let (time, force, noise) = scene.raw_force(BIN)?;
    let before_end = time.partition_point(|t| *t < end);
    let force: Vec<f64> = force[..before_end].iter().map(|f| f.dot(&along)).collect();
    let half = 0.5 * quantile(&force, 0.95)?;
    let risen = force.iter().position(|f| *f > half)?;
    let tool: Option<Vec<f64>> = time[..before_end].iter().map(|t| way.at(*t)).collect();
    let tool = tool?;
    let beyond: Vec<f64> = tool.iter().map(|s| s - tool[risen]).collect();
    let slides = |i: &usize| *i >= risen && beyond[*i] > SLIDES[0] && beyond[*i] < SLIDES[1];
    let sliding: Vec<usize> = (0..before_end).filter(slides).collect();
    let level =
        median(&sliding.iter().map(|i| force[*i]).collect::<Vec<f64>>()).filter(|_| sliding.len() > READINGS)?;
    let first = (0..risen).rfind(|i| force[*i] < BEGINS * level)?;
    let rise = first..before_end.min(*sliding.first()?);
    let highest = rise.clone().map(|i| force[i]).fold(0.0, f64::max);
    if level < CLEAR_OF_NOISE * noise? || highest > CALM * level {
        return None;
    }
    let within = (time[sliding[0]], time[*sliding.last()?]);
    let (zero, sd) = body_at_rest(track, &way, (time[first] - 2.0 * BIN, time[risen]), within)?;
    let up = rise.clone().find(|i| force[*i] > UP * level)?;
    // It came to be so between two readings.
    let past = (force[up] - UP * level) / (force[up] - force[up.checked_sub(1)?]).max(1e-12);
    let up = tool[up] - past.clamp(0.0, 1.0) * (tool[up] - tool[up - 1]);
    let (start, stop) = (sliding[0], *sliding.last()?);
    let speed = (tool[stop] - tool[start]) / (time[stop] - time[start]);
    let (moments, forces, scatter) = scene.raw_force(FINE)?;
    let near = |t: &f64| *t > time[first] - BEFORE && *t < within.1;
    let near = (0..moments.len()).filter(|i| near(&moments[*i]));
    let reading = |i: usize| Reading {
        time: moments[i],
        way: way.at(moments[i]).unwrap_or(f64::NAN) - zero,
        force: forces[i].dot(&along),
    };
    let readings: Vec<Reading> = near
        .map(reading)
        .filter(|r| r.way.is_finite() && r.force.is_finite())
        .collect();
    let when = |at: f64| readings.iter().find(|r| r.way > at).map(|r| r.time);
    let slips = (when(0.0)?, (0.5 * (when(sd)? - when(-sd)?)).max(0.5 * FINE));
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    Some(Onset {
        slips,
        step: median(&steps)?,
        rise: readings,
        noise: scatter?,
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        way: ((up - zero) / UP, sd / UP),
        speed,
        level,
        rows: rise.map(|i| [tool[i] - zero, force[i]]).collect(),
    })
}

/// Where the tool is, m along its way, when it would touch the body as it rests in the way in which it touches it while
/// it slides, with the standard deviation.
fn body_at_rest(
    track: &PoseStream,
    way: &Way,
    (rest, risen): (f64, f64),
    (from, to): (f64, f64),
) -> Option<(f64, f64)> {
    let still: Vec<usize> = (0..track.len())
        .filter(|i| track.time[*i] < rest && track.position[*i].coords.iter().all(|x| x.is_finite()))
        .collect();
    let of = |k: usize| median(&still.iter().map(|i| track.position[*i][k]).collect::<Vec<f64>>());
    let origin = Point3::new(of(0)?, of(1)?, of(2)?);
    let touch = way.path.position[way.path.time.partition_point(|t| *t < risen).min(way.path.len() - 1)];
    let turn = still.get(still.len() / 2).and_then(|i| track.rotation[*i]);
    // The point of the body that the tool touches.
    let anchor = turn.map(|q| q.inverse() * (touch - origin));
    let place = |i: usize| {
        let arm = anchor.zip(track.rotation[i]).map_or(Vector3::zeros(), |(a, q)| q * a);
        (track.position[i].coords + arm).dot(&way.along)
    };
    let rests: Vec<f64> = still.iter().map(|i| place(*i)).collect();
    let moving = (0..track.len()).filter(|i| track.time[*i] >= from && track.time[*i] <= to);
    let pairs: Vec<[f64; 2]> = moving
        .filter_map(|i| Some([way.at(track.time[i])?, place(i)]))
        .filter(|p| p[1].is_finite())
        .collect();
    if rests.len() < READINGS || pairs.len() < READINGS {
        return None;
    }
    let gaps: Vec<f64> = pairs.iter().map(|[s, x]| s - x).collect();
    let (gap, at_rest) = (mean(&gaps)?, mean(&rests)?);
    let middle = mean(&pairs.iter().map(|p| p[0]).collect::<Vec<f64>>())?;
    let (xy, xx) = pairs.iter().fold((0.0, 0.0), |(xy, xx), [s, x]| {
        let d = s - middle;
        (xy + d * (s - x - gap), xx + d * d)
    });
    let spread = |values: &[f64], centre: f64| {
        let squares: f64 = values.iter().map(|v| (v - centre).powi(2)).sum();
        (squares / (values.len() as f64).powi(2)).sqrt()
    };
    let sd = spread(&rests, at_rest).hypot(spread(&gaps, gap)).hypot(FLOOR);
    ((xy / xx.max(1e-12)).abs() < TOGETHER).then_some((gap + at_rest, sd))
}

fn told(all: &[Onset], name: &str, clocks: &Clocks) -> Option<Finding> {
    let fitted: Vec<&Onset> = all.iter().filter(|o| !o.held_out).collect();
    let (values, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|o| o.way).unzip();
    let pooled = random_effects(&values, &sds, FLOOR).filter(|_| fitted.len() >= FEWEST)?;
    // Beside a delay, what is left where the speed is none.
    let (way, sd) = clocks.way_beside(name).unwrap_or((pooled.mean, pooled.sd));
    let odds = clocks.odds_of_a_way();
    let statistic = way / sd;
    if statistic < CLEAR || !(LEAST..MOST).contains(&way) || odds < 0.5 {
        return None;
    }
    let held: Vec<&Onset> = all.iter().filter(|o| o.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    let rms = |share: &dyn Fn(f64) -> f64| {
        let each = |o: &&Onset| {
            let own = o.rows.iter().filter(|r| r[0] > 0.1 * way);
            own.map(|[x, f]| (f - o.level * share(*x)).powi(2))
                .collect::<Vec<f64>>()
        };
        let squares: Vec<f64> = judged.iter().flat_map(each).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let [before, after] = [rms(&|_| 1.0), rms(&|x| (x / way).min(1.0))];
    // One that does not foretell pushes that were not fitted is none.
    if !held.is_empty() && after > before {
        return None;
    }
    let told = Told {
        cause: "presliding",
        place: name,
        probability: 0.9 * odds,
        rivals: &[("time-delay", worth_a_word(1.0 - odds))],
        parameter: (
            "way",
            Estimate::measured(
                way,
                sd.hypot(FORM * way),
                "m",
                fitted.iter().map(|o| o.interaction.clone()).collect(),
                "way of the body while the force of slow pushes rises",
            ),
        ),
        residual: "beginning",
        statistic,
        words: format!(
            "friction of {name} comes up over {:.2} mm of its way in every push",
            1e3 * way
        ),
        gain: gain(
            "force",
            "N",
            [before, after],
            held.iter().map(|o| o.interaction.clone()).collect(),
        ),
    };
    Some(told.finding())
}
