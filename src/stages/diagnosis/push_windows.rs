//! A push averaged over windows of slip, and how well each mean is known.

use nalgebra::{Vector2, Vector3};

use super::family::Covariate;
use super::push_states::State;
use super::shows_in::{DISTANCE, LOAD, PAST, SPEEDING, TIME, TOOL_HEADING, WORN};
use crate::math::median;

/// Edges of the windows of slip over which a push is averaged, m: fine where it begins.
pub const EDGES: [f64; 6] = [0.0, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3];
/// Width of the windows after that, m.
pub const WIDTH: f64 = 8e-3;

/// Readings of a window whose mean has the noise that is taken for all.
pub const USUAL: f64 = 9.0;

/// Which window a moment falls into.
fn window(s: &State, i: usize) -> usize {
    if !s.contact {
        return i / 25;
    }
    let fine = EDGES.iter().filter(|e| s.slip >= **e).count();
    let coarse = ((s.slip - EDGES[EDGES.len() - 1]) / WIDTH).max(0.0) as usize;
    1000 + fine + coarse
}

/// Where the window that begins at `from` ends: what goes back the way that it came does so in another one, since the mean of a
/// force that turned round is none.
fn end(states: &[State], from: usize) -> usize {
    let (first, key) = (&states[from], window(&states[from], from));
    let goes_on = |i: usize| {
        let s = &states[i];
        window(s, i) == key && (!s.contact || s.heading.dot(&first.heading) >= 0.0)
    };
    (from..states.len()).find(|i| !goes_on(*i)).unwrap_or(states.len())
}

/// Windows from which on, with so many readings each, a push tells how its readings go together.
const TELL: (u32, f64) = (3, 8.0);
/// By how much more, squared, the mean of readings scatters that ring together than that of free ones. Readings alternate where it
/// comes out below the second; below the third nothing is believed, for a few windows tell it badly.
const RING: f64 = 3.0;
const ALTERNATE: f64 = 0.7;
const LEAST: f64 = 0.3;

/// By how much more, squared, the mean over a settled window of a push scatters than it would were its readings free of each
/// other: less than once where they alternate, as the force of a finger does that sticks and slips, for whole swings leave
/// no trace in the mean. Told by how far the two halves of each window are apart.
fn correlated(states: &[State], measured: &[Vector2<f64>]) -> f64 {
    let (mut apart, mut free, mut count) = (0.0, 0.0, 0_u32);
    let mut from = 0;
    while from < states.len() {
        let to = end(states, from);
        let sizes: Vec<f64> = measured[from..to].iter().map(|m| m.norm()).collect();
        let n = sizes.len() as f64;
        let settled = states[from].contact && states[from].slip > EDGES[EDGES.len() - 1];
        if settled && n >= TELL.1 {
            let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
            let (all, [first, last]) = (mean(&sizes), [&sizes[..sizes.len() / 2], &sizes[sizes.len() / 2..]]);
            apart += 0.25 * (mean(first) - mean(last)).powi(2);
            free += sizes.iter().map(|s| (s - all).powi(2)).sum::<f64>() / (n * n);
            count += 1;
        }
        from = to;
    }
    if count < TELL.0 {
        return RING;
    }
    // As many windows tell the ratio to about this share of it.
    let told = (1.0 + 2.0 / f64::from(count)) * apart / free.max(1e-300);
    if told < ALTERNATE { told.max(LEAST) } else { RING }
}

/// How many times the usual change of speed is that of the noise of a path.
const USUALLY: f64 = 2.0;

/// Leaves of how a hand speeds up and slows down about each moment what is beyond the noise of its path, which all of them have.
pub(super) fn beyond_noise(states: &mut [State]) {
    let led = |s: &&State| s.contact && s.led;
    let all: Vec<f64> = states.iter().filter(led).map(|s| s.hurried).collect();
    let noise = USUALLY * median(&all).unwrap_or(0.0);
    let less = |s: &mut State| s.hurried = (s.hurried * s.hurried - noise * noise).max(0.0).sqrt();
    states.iter_mut().for_each(less);
}

/// How far the direction in which friction is foretold strays from moment to moment, rad, as the noise of a path has it.
pub(super) fn veer(states: &[State]) -> f64 {
    let turns = states.windows(2).filter_map(|pair| {
        let [a, b] = [pair[0].heading, pair[1].heading];
        (pair[0].contact && pair[1].contact && a.dot(&b) > 0.0).then(|| a.perp(&b).atan2(a.dot(&b)).powi(2))
    });
    let (sum, count) = turns.fold((0.0, 0.0), |(s, n), t| (s + t, n + 1.0));
    (0.5 * sum / f64::max(count, 1.0)).sqrt()
}

/// States and forces averaged over windows of slip, and of time at rest, with the standard deviation of each mean.
pub(super) fn windows(
    states: &[State],
    measured: &[Vector2<f64>],
    along: &Vector2<f64>,
    noise: f64,
) -> (Vec<State>, Vec<Vector2<f64>>, Vec<f64>) {
    let mut out: (Vec<State>, Vec<Vector2<f64>>, Vec<f64>) = Default::default();
    let correlated = correlated(states, measured);
    let mut from = 0;
    while from < states.len() {
        let to = end(states, from);
        let n = (to - from) as f64;
        let mean = |of: &dyn Fn(&State) -> f64| states[from..to].iter().map(of).sum::<f64>() / n;
        let force = measured[from..to].iter().sum::<Vector2<f64>>() / n;
        let middle = &states[from + (to - from) / 2];
        let off = |m: &Vector2<f64>| (m - force).norm_squared();
        let spread = measured[from..to].iter().map(off).sum::<f64>() / n;
        out.0.push(State {
            veer: veer(&states[from.saturating_sub(1)..(to + 1).min(states.len())]) / n.sqrt(),
            time: mean(&|s| s.time),
            since: mean(&|s| s.since),
            span: states[to - 1].time - states[from].time,
            slip: mean(&|s| s.slip),
            worn: mean(&|s| s.worn),
            speed: mean(&|s| s.speed),
            turned: mean(&|s| s.turned),
            inertia: mean(&|s| s.inertia),
            hurried: mean(&|s| s.hurried),
            loaded: mean(&|s| s.loaded),
            ringing: mean(&|s| s.ringing),
            phases: [mean(&|s| s.phases[0]), mean(&|s| s.phases[1])],
            force: states[from..to].iter().map(|s| s.force).sum::<Vector2<f64>>() / n,
            ..middle.clone()
        });
        // The size of the mean force: noise across the push adds nothing to it.
        let size = measured[from..to].iter().map(|m| m.norm()).sum::<f64>() / n;
        let direction = force.try_normalize(1e-9).unwrap_or(*along);
        out.1.push(if middle.contact { direction * size } else { force });
        // Neighbouring readings ring together; at rest a window of a few has the noise of a few.
        let settled = middle.contact && middle.slip > EDGES[EDGES.len() - 1];
        let ringing = if settled { correlated } else { RING } * spread / n;
        let few = noise * noise * (1.0 / n - 1.0 / USUAL);
        let variance = if middle.contact { ringing } else { ringing.max(few) };
        out.2.push(variance.sqrt());
        from = to;
    }
    out
}

/// A number of every moment of a push, of what it is along and across its way; of the second nothing is said.
fn column(states: &[State], value: impl Fn(&State) -> f64) -> Vec<f64> {
    let along = states.iter().map(|s| if s.contact { value(s) } else { f64::NAN });
    along.chain(states.iter().map(|_| f64::NAN)).collect()
}

/// What the moments of a push differ in.
pub fn covariates(states: &[State]) -> Vec<Covariate> {
    vec![
        ("speed", "m/s", column(states, |s| s.speed)),
        ("heading", "rad", column(states, |s| s.heading.y.atan2(s.heading.x))),
        ("slip since the push began", "m", column(states, |s| s.slip)),
        ("place along x", "m", column(states, |s| s.at.x)),
        ("place along y", "m", column(states, |s| s.at.y)),
        (TIME, "s", column(states, |s| s.time)),
        ("waiting time", "s", column(states, |s| s.wait)),
    ]
}

/// Slowest speed of which the logarithm says something, m/s.
const SLOW: f64 = 1e-3;

/// Slow pushes lie far apart only by the logarithm of their speed.
pub fn besides(states: &[State]) -> Vec<Covariate> {
    vec![("logarithm of speed", "1", column(states, |s| s.speed.max(SLOW).ln()))]
}

/// What profiles alone are laid out against; `weight` in N, `place` where a law acts.
pub fn only_shown(states: &[State], weight: f64, place: Option<Vector2<f64>>) -> Vec<Covariate> {
    let seen = |s: &State| {
        let way = s.tool.inverse() * Vector3::new(s.heading.x, s.heading.y, 0.0);
        way.y.atan2(way.x)
    };
    let mut all = vec![
        (LOAD, "N", column(states, |s| weight * s.loaded)),
        (WORN, "m", column(states, |s| s.worn)),
        (SPEEDING, "N", column(states, |s| s.inertia)),
        (TOOL_HEADING, "rad", column(states, seen)),
    ];
    if let Some(place) = place {
        all.push((DISTANCE, "m", column(states, |s| (s.at - place).norm())));
        all.push((PAST, "m", column(states, |s| (s.at - place).dot(&s.heading))));
    }
    all
}
