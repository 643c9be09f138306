//! A toss cut into short windows: free flights, and stretches about the moments at which it touches.
//!
//! Impacts are chaotic: over a whole toss a small error of the state grows until nothing can be compared. A window starts
//! anew from the track itself (multiple shooting), so that each one is nearly linear in what is sought.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use super::conditions::{Body, Conditions};
use super::local::{BACK, Level, Toss, local};
use crate::math::quantile;
use crate::physics::{Landing, State, Thrown};

/// What simulates a body under given conditions, with the noise that it is held against.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The body.
    pub thrown: Thrown,
    /// Where it lands.
    pub land: Landing,
    /// Noise of the tracks.
    pub level: Level,
    /// What turns a rotation into a length, m.
    pub reach: f64,
    /// Height of a body that lies, over that of the support, m.
    pub lying: f64,
}

impl Simulated {
    /// Of a body under conditions.
    pub fn new(body: &Body, at: &Conditions, level: &Level) -> Self {
        let (thrown, land) = body.thrown(at);
        let (level, reach, lying) = (*level, body.reach(), at.lying - at.rise);
        Self {
            thrown,
            land,
            level,
            reach,
            lying,
        }
    }
}

impl Window {
    /// Where it lands: nowhere in flight, whatever a start that is still far off would run into; else on the support,
    /// which is where the corners are that bear a body that touches at the start.
    pub fn land(&self, by: &Simulated) -> Landing {
        let height = match self.scene {
            Scene::Flight => f64::NEG_INFINITY,
            _ if self.touches => by.land.height + by.thrown.bearing(&self.start, &by.land, by.level.uneven),
            _ => by.land.height,
        };
        Landing { height, ..by.land }
    }
}

/// What a window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// Nothing touches: the start is free, and what it could explain is taken out of the residuals.
    Flight,
    /// An impact, or sliding.
    Contact,
    /// It lies: how far the corners that bear it are from the support, and how they slope against it.
    Rest,
}

/// A stretch of a toss that is simulated from its own start.
#[derive(Clone, Debug)]
pub struct Window {
    /// Index of the toss.
    pub toss: usize,
    /// First row.
    pub from: usize,
    /// Last row.
    pub to: usize,
    /// The state at the first row.
    pub start: State,
    /// What it shows.
    pub scene: Scene,
    /// It touches at the start: the support is where its lowest corner is.
    pub touches: bool,
    /// Standard deviation of velocity, spin and the hinge's rate at the start, m/s and rad/s.
    pub doubt: [f64; 3],
}

/// Span over which a window foretells, s, and its fewest rows.
const AHEAD: (f64, usize) = (0.068, 5);
/// Most rows of a window that are compared.
const COMPARED: usize = 12;
/// Nothing touches above this clearance, m.
pub const CLEAR: f64 = 4e-3;
/// Shortest flight: s and rows.
const FLIGHT: (f64, usize) = (0.06, 9);
/// Slower than this nothing is learnt, m/s.
const SLOW: f64 = 0.05;
/// How far the model's speeds may be off by themselves, m/s: what no window can tell better.
const FORM: f64 = 3e-3;
/// Corners within this of the lowest bear a body that lies, m; and how well a surface and a table are what they are
/// said to be, m.
const SEAT: f64 = 5e-3;
const LYING: f64 = 1e-4;
/// The same of the slope of a face, rad, and as a share of the body's reach of the height of corners that bear it.
const SLOPE: f64 = 2e-3;
const LEVEL: f64 = 0.2;
/// Noise that a short parabola may leave in flight, in units of what it mostly leaves.
const JOLT: f64 = 8.0;
/// Step of the simulation, s.
pub const STEP: f64 = 2e-3;
/// Gravity of a flight that nothing holds, over that of the capture.
const FALLS: std::ops::Range<f64> = 0.6..1.4;
/// The same of the hinge of a body that swings about it.
const SWINGS: std::ops::Range<f64> = 0.4..1.8;

/// How unevenly corners stand that bear the body where tosses end at rest, m.
pub fn unevenness(tosses: &[Toss], thrown: &Thrown, land: &Landing) -> Option<f64> {
    let one = |(i, toss): (usize, &Toss)| {
        let clear = clearances(toss, thrown, land);
        let lies = lying(i, toss, &clear, toss.rows(BACK))?;
        let state = toss.state(lies.to);
        Some(thrown.bearing(&state, land, SEAT) - thrown.clearance(&state, land))
    };
    let all: Vec<f64> = tosses.iter().enumerate().filter_map(one).collect();
    quantile(&all, 0.75)
}

/// Clearance of every row, m.
pub fn clearances(toss: &Toss, thrown: &Thrown, land: &Landing) -> Vec<f64> {
    (0..toss.time.len())
        .map(|j| thrown.clearance(&toss.state(j), land))
        .collect()
}

/// Stretches of rows in which nothing touches, the motion is smooth and the body falls; the hinge of one that `swings`
/// need not fall evenly.
pub fn flights(toss: &Toss, clear: &[f64], land: &Landing, level: &Level, swings: bool) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    let mut start = 0;
    let back = toss.rows(BACK);
    for j in 0..=clear.len() {
        let rough = || {
            let first = (j + 1).saturating_sub(back).max(start);
            let fit = (j + 1 - first >= 5)
                .then(|| local(toss, first..=j, j, 2, &[0.0; 7]))
                .flatten();
            fit.is_some_and(|f| f.left[0] > JOLT * level.place || f.left[1] > JOLT * level.turn)
        };
        if j < clear.len() && clear[j] > CLEAR && !rough() {
            continue;
        }
        if j > start + FLIGHT.1 && toss.time[j - 1] - toss.time[start] > FLIGHT.0 {
            let height = DVector::from_fn(j - start, |i, _| land.gravity.normalize().dot(&toss.place[start + i]));
            let range = if swings { SWINGS } else { FALLS };
            if range.contains(&falls(&toss.time[start..j], &height, land.gravity.norm())) {
                out.push((start, j - 1));
            }
        }
        start = j + 1;
    }
    out
}

/// Acceleration downwards over gravity, by a parabola.
fn falls(time: &[f64], height: &DVector<f64>, gravity: f64) -> f64 {
    let a = DMatrix::from_fn(time.len(), 3, |i, j| (time[i] - time[0]).powi(j as i32));
    let solved = nalgebra::Cholesky::new(a.transpose() * &a).map(|c| c.solve(&(a.transpose() * height)));
    solved.map_or(0.0, |x| 2.0 * x[2] / gravity)
}

/// The windows of one toss: its flights, and stretches of contact, at most `most` of these.
pub fn cut(index: usize, toss: &Toss, body: &Body, at: &Conditions, level: &Level, most: usize) -> Vec<Window> {
    let by = Simulated::new(body, at, level);
    let (thrown, land) = (&by.thrown, &by.land);
    let clear = clearances(toss, thrown, land);
    let n = toss.time.len();
    let mut out = Vec::new();
    for (from, to) in flights(toss, &clear, land, level, thrown.second.is_some()) {
        if let Some((start, _)) = toss.read(from..=to, from, Some((thrown, land))) {
            let mut window = Window {
                toss: index,
                from,
                to,
                start,
                scene: Scene::Flight,
                touches: false,
                doubt: [0.0; 3],
            };
            settle(&mut window, toss, &by);
            out.push(window);
        }
    }
    let (back, ahead) = (toss.rows(BACK), toss.rows(AHEAD));
    let mut touching = Vec::new();
    let mut at = back.saturating_sub(1);
    while at + ahead < n {
        let rows = at + 1 - back..=at;
        let flies = rows.clone().all(|j| clear[j] > 0.25 * CLEAR);
        let touches = (at..=at + ahead).any(|j| clear[j] < 0.25 * CLEAR);
        let read = toss.read(rows, at, flies.then_some((thrown, land)));
        let smooth = read.filter(|(s, left)| {
            let fast = s
                .velocity
                .fixed_rows::<3>(0)
                .norm()
                .max(s.velocity.fixed_rows::<3>(3).norm() * body.reach());
            touches && left[0] < 2.5 * level.place && left[1] < 2.5 * level.turn && fast > SLOW
        });
        let Some((start, _)) = smooth else {
            at += 1;
            continue;
        };
        let span = toss.time[at] - toss.time[at + 1 - back];
        let gain = if flies {
            (12.0 / back as f64).sqrt()
        } else {
            (192.0 / back as f64).sqrt()
        } / span;
        let doubt = [level.place, level.turn, level.angle].map(|l| l * gain);
        touching.push(Window {
            toss: index,
            from: at,
            to: at + ahead,
            start,
            scene: Scene::Contact,
            touches: clear[at] < 0.25 * CLEAR,
            doubt,
        });
        at += (back / 2).max(2);
    }
    out.extend(lying(index, toss, &clear, back));
    let keep = touching.len().min(most);
    out.extend((0..keep).map(|k| touching[(2 * k + 1) * touching.len() / (2 * keep)].clone()));
    out
}

/// The last rows, where it lies still near the support, which may slope.
fn lying(index: usize, toss: &Toss, clear: &[f64], rows: usize) -> Option<Window> {
    let to = toss.time.len() - 1;
    let from = (to + 1).checked_sub(rows)?;
    let still = (from..=to).all(|j| {
        let span = (toss.time[to] - toss.time[j]).max(1e-3);
        (toss.place[j] - toss.place[to]).norm() < 5e-4 + 0.02 * span && toss.turn[j].angle_to(&toss.turn[to]) < 5e-3
    });
    let doubt = [0.0; 3];
    let scene = Scene::Rest;
    let start = toss.state(to);
    (still && clear[to].abs() < 0.05).then_some(Window {
        toss: index,
        from,
        to,
        start,
        scene,
        touches: true,
        doubt,
    })
}

/// Gauss-Newton on the start of a flight.
pub fn settle(window: &mut Window, toss: &Toss, by: &Simulated) {
    for _ in 0..2 {
        let here = residual(window, toss, by);
        let columns = start_columns(window, toss, by, &here);
        let r = DVector::from_vec(here);
        let Some(step) =
            nalgebra::Cholesky::new(columns.transpose() * &columns).map(|c| c.solve(&(columns.transpose() * r)))
        else {
            return;
        };
        window.start = moved(&window.start, &(-step));
    }
}

/// A state moved by place, rotation, velocity, spin and, with a hinge, angle and rate.
fn moved(s: &State, by: &DVector<f64>) -> State {
    let three = |k: usize| Vector3::new(by[k], by[k + 1], by[k + 2]);
    let mut velocity = s.velocity;
    for k in 0..6 {
        velocity[k] += by[6 + k];
    }
    let hinge = |k: usize| if by.len() > k { by[k] } else { 0.0 };
    velocity[6] += hinge(13);
    State {
        place: s.place + three(0),
        turn: UnitQuaternion::from_scaled_axis(three(3)) * s.turn,
        angle: s.angle + hinge(12),
        velocity,
    }
}

/// How a flight's residuals answer to its start, one column for each number of the state.
pub fn start_columns(window: &Window, toss: &Toss, by: &Simulated, here: &[f64]) -> DMatrix<f64> {
    let count = if by.thrown.second.is_some() { 14 } else { 12 };
    let mut out = DMatrix::zeros(here.len(), count);
    for k in 0..count {
        let step = if k < 6 || k == 12 { 1e-4 } else { 1e-3 };
        let mut shift = DVector::zeros(count);
        shift[k] = step;
        let other = Window {
            start: moved(&window.start, &shift),
            ..window.clone()
        };
        let there = residual(&other, toss, by);
        for (i, (a, b)) in there.iter().zip(here).enumerate() {
            out[(i, k)] = (a - b) / step;
        }
    }
    out
}

/// Foretold less measured over their standard deviation, row by row: place, rotation, and the hinge's angle.
pub fn residual(window: &Window, toss: &Toss, by: &Simulated) -> Vec<f64> {
    let Simulated {
        thrown,
        land,
        level,
        reach,
        lying,
    } = by;
    if window.scene == Scene::Rest {
        let [height, x, y] = thrown.seat(&toss.state(window.to), land, SEAT.max(LEVEL * reach));
        let slope = level.turn.hypot(SLOPE);
        return vec![(height - lying) / level.place.hypot(LYING), x / slope, y / slope];
    }
    let last = window.to - window.from;
    let every = if window.scene == Scene::Flight {
        1
    } else {
        last.div_ceil(COMPARED).max(1)
    };
    let rows: Vec<usize> = (0..=last)
        .rev()
        .step_by(every)
        .collect::<Vec<_>>()
        .into_iter()
        .rev()
        .collect();
    let from_start = rows.first() == Some(&0);
    let mut times: Vec<f64> = rows.iter().map(|k| toss.time[window.from + k]).collect();
    if !from_start {
        times.insert(0, toss.time[window.from]);
    }
    let land = &window.land(by);
    let states = thrown.fly(&window.start, land, &times, STEP);
    let mut out = Vec::with_capacity(7 * rows.len());
    let skip = if from_start { 0 } else { 1 };
    for (k, s) in rows.iter().zip(states.iter().skip(skip)) {
        if *k == 0 && window.scene == Scene::Contact {
            continue;
        }
        let j = window.from + k;
        let dt = toss.time[j] - toss.time[window.from];
        let form = if window.scene == Scene::Flight { 0.0 } else { FORM };
        let sd = |own: f64, doubt: f64, form: f64| (own * own + (doubt * dt).powi(2) + (form * dt).powi(2)).sqrt();
        let place = (s.place - toss.place[j]) / sd(level.place, window.doubt[0], form);
        let turn_sd = sd(level.turn, window.doubt[1], form / reach);
        let turn = (s.turn * toss.turn[j].inverse()).scaled_axis() / turn_sd;
        out.extend(place.iter().chain(turn.iter()));
        if thrown.second.is_some() {
            out.push((s.angle - toss.angle[j]) / sd(level.angle, window.doubt[2], form / reach));
        }
    }
    out
}

/// The first flight of a toss cut in two: its rows, and the state at its start as its first half has it.
pub fn flight_of(toss: &Toss, by: &Simulated) -> Option<((usize, usize), State)> {
    let clear = clearances(toss, &by.thrown, &by.land);
    let all = flights(toss, &clear, &by.land, &by.level, by.thrown.second.is_some());
    let (from, to) = *all.first()?;
    let half = from + (to - from).div_ceil(2).max(5);
    let (start, _) = toss.read(from..=half.min(to), from, Some((&by.thrown, &by.land)))?;
    let doubt = [0.0; 3];
    let mut window = Window {
        toss: 0,
        from,
        to: half.min(to),
        start,
        scene: Scene::Flight,
        touches: false,
        doubt,
    };
    settle(&mut window, toss, by);
    Some(((from, to), window.start))
}
