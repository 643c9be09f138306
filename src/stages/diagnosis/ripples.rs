//! A force that swings with the way: of a table with ribs, a texture, teeth that catch.
//!
//! The catalogue has one place that is rough, and no grid of them. What counts is one wavelength in touches along one line, and that one
//! wave is nearly all of what the force does.

use nalgebra::{DMatrix, DVector, Vector3};

use super::sensor::rounded_away;
use super::shaking::{shaken, stretch, tell_beside};
use crate::capture::{Capture, Interaction, Kind, Segmented, SensorFaults};
use crate::math::{Grid, Spectrum, interpolate, median, weighted_linear};
use crate::twin::{BaseFit, Evidence, Finding, Model};

/// Shortest wavelength that is tried, m; what sticks and slips on a soft finger has shorter ones.
const SHORTEST: f64 = 2e-3;
/// Wavelengths that a stretch has at least, and frequencies that are tried to one of its own width.
const PERIODS: f64 = 3.0;
const FINE: f64 = 4.0;
/// Shortest way, m; share of it that goes straight ahead; speed of a stretch's middle one above which a sample counts.
const WAY: f64 = 0.015;
const STRAIGHT: f64 = 0.8;
const MOVES: f64 = 0.3;
/// Shares of a touch that are its beginning and its end.
const ENDS: [f64; 2] = [0.1, 0.03];
/// Share of what is above the noise, but for a cubic, that one wave takes away: a patch has many.
const ONE: f64 = 0.7;
/// Swing in the second half over that in the first: what a touch sets ringing dies away, and ribs do not.
const LASTS: f64 = 0.5;
/// Fewest samples.
const SAMPLES: usize = 30;
/// Power over the middle one of the spectrum from which on it is one wavelength; half of how far the force swings, in units of the noise of
/// a reading and as a share of the force.
const CLEAR: f64 = 20.0;
const SWINGS: (f64, f64) = (1.0, 0.01);
/// Touches that have it at least; cosine between the lines of two of them; by how much their wavelengths differ, in units of what the
/// shorter way resolves.
const FEWEST: usize = 2;
const ALONG: f64 = 0.97;
const SAME: f64 = 0.6;

/// The top of the spectrum of one touch over its way.
#[derive(Clone, Debug)]
struct Ripple {
    interaction: String,
    line: Vector3<f64>,
    /// 1/m.
    frequency: f64,
    /// Half of how far it swings, N.
    force: f64,
    /// Power over the middle one of the spectrum.
    ratio: f64,
    /// m.
    way: f64,
}

impl Ripple {
    fn like(&self, other: &Self) -> bool {
        let apart = (self.frequency - other.frequency).abs() * self.way.min(other.way);
        self.line.dot(&other.line).abs() > ALONG && apart < SAME
    }
}

/// What swings with the clock or with the way, told beside what the plain model leaves.
pub fn swinging(
    of: (&Capture, &[Segmented], &Model),
    faults: &SensorFaults,
    (findings, base): (&mut [Finding], &mut BaseFit),
) -> Vec<Evidence> {
    let shakes = shaken((of.0, of.1), faults, (&mut *findings, &mut *base));
    let ripples = rippled(of, rounded_away(faults), (findings, base));
    shakes.into_iter().chain(ripples).collect()
}

/// A force that swings with the way, if one does: it is told beside what the plain model leaves, and makes what was named less sure.
/// Rounding takes `lost` (N, standard deviation) from what is read.
fn rippled(
    (capture, segmented, model): (&Capture, &[Segmented], &Model),
    lost: f64,
    told: (&mut [Finding], &mut BaseFit),
) -> Option<Evidence> {
    let jointed = |i: &Interaction| {
        let body = i.target.as_ref().and_then(|t| model.twin.body_of(t));
        body.is_none_or(|b| !b.joints.is_empty())
    };
    let slides = |i: &&Interaction| matches!(i.kind, Kind::Push | Kind::Pull) && !jointed(i);
    let noises: Vec<f64> = segmented.iter().filter_map(|s| s.force_noise).collect();
    let noise = capture.noise.force.or_else(|| median(&noises)).unwrap_or(0.0);
    // What grows evenly and is rounded goes up stairs, half a step to either side.
    let noise = noise.max(3.0_f64.sqrt() * lost);
    let all = capture.interactions.iter().filter(slides);
    let tops: Vec<Ripple> = all.filter_map(|i| ripple_of(i, noise)).collect();
    tell_beside(common(&tops).map(|own| evidence(&own)), told)
}

/// The touches along one line that have one wavelength, the most there are.
fn common(tops: &[Ripple]) -> Option<Vec<Ripple>> {
    let like = |one: &Ripple| tops.iter().filter(|t| t.like(one)).cloned().collect::<Vec<_>>();
    let most = tops.iter().map(like).max_by_key(Vec::len)?;
    (most.len() >= FEWEST).then_some(most)
}

fn evidence(own: &[Ripple]) -> Evidence {
    let middle = |of: &dyn Fn(&Ripple) -> f64| median(&own.iter().map(of).collect::<Vec<f64>>()).unwrap_or(0.0);
    let ratio = middle(&|r| r.ratio);
    let names: Vec<&str> = own.iter().map(|r| r.interaction.as_str()).collect();
    Evidence {
        residual: "force over the way".into(),
        test: "power at one wavelength over that at the middle one, in the middle touch".into(),
        statistic: ratio,
        p_value: (-(own.len() as f64) * ratio.ln()).exp(),
        words: format!(
            "the force of {} swings by {:.3} N every {:.1} mm of the way: ribs, a texture or teeth, of which the catalogue knows \
             nothing",
            names.join(", "),
            middle(&|r| r.force),
            1e3 / middle(&|r| r.frequency)
        ),
    }
}

/// The wavelength that stands out most of one touch, if one does.
fn ripple_of(interaction: &Interaction, noise: f64) -> Option<Ripple> {
    let ((ways, forces), line) = over_the_way(interaction)?;
    let way = ways.last()? - ways.first()?;
    let usual = median(&forces.iter().map(|f| f.norm()).collect::<Vec<f64>>())?;
    let grid = Grid {
        lowest: PERIODS / way,
        highest: 1.0 / SHORTEST,
        step: 1.0 / (FINE * way),
    };
    let over = (ways, forces);
    let spectrum = Spectrum::of(&over.0, &over.1, grid)?;
    let (top, power) = (0..spectrum.power.len())
        .map(|k| (k, spectrum.power[k]))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (ratio, force) = (power / median(&spectrum.power)?.max(1e-30), power.sqrt());
    let large = ratio > CLEAR && force > SWINGS.0 * noise && force > SWINGS.1 * usual;
    (large && one_wave(&over, grid.at(top))? > ONE && lasts(&over, grid.at(top))? > LASTS).then(|| Ripple {
        interaction: interaction.name.clone(),
        line,
        frequency: grid.at(top),
        force,
        ratio,
        way,
    })
}

/// Share of what a cubic leaves above the noise between neighbours that a wave of this frequency takes away.
fn one_wave((ways, forces): &(Vec<f64>, Vec<Vector3<f64>>), frequency: f64) -> Option<f64> {
    let n = ways.len();
    let a = waves(ways, frequency)?;
    let even = DVector::from_element(n, 1.0);
    let left = |columns: usize| -> Option<f64> {
        let a = a.columns(0, columns).into_owned();
        let one = |c: usize| {
            let y = DVector::from_fn(n, |i, _| forces[i][c]);
            weighted_linear(&a, &y, &even).map(|f| f.residuals.iter().map(|r| r * r).sum::<f64>())
        };
        Some(one(0)? + one(1)? + one(2)?)
    };
    let noise = forces
        .windows(2)
        .map(|w| (w[1] - w[0]).norm_squared() / 2.0)
        .sum::<f64>();
    let (before, after) = (left(4)?, left(6)?);
    Some((before - after) / (before - noise).max(1e-12 * before))
}

/// How much a wave of this frequency swings in the second half of the way over how much in the first, if it grows or dies evenly.
fn lasts((ways, forces): &(Vec<f64>, Vec<Vector3<f64>>), frequency: f64) -> Option<f64> {
    let a = waves(ways, frequency)?;
    let even = DVector::from_element(ways.len(), 1.0);
    // Squares at a quarter and at three quarters of the way.
    let squares = |axis: usize| -> Option<[f64; 2]> {
        let y = DVector::from_fn(ways.len(), |i, _| forces[i][axis]);
        let x = weighted_linear(&a, &y, &even)?.x;
        Some([-0.5, 0.5].map(|at| (x[4] + at * x[6]).powi(2) + (x[5] + at * x[7]).powi(2)))
    };
    let axes = (0..3).map(squares).collect::<Option<Vec<[f64; 2]>>>()?;
    let [first, second] = [0, 1].map(|half| axes.iter().map(|a| a[half]).sum::<f64>());
    Some((second / first.max(1e-30)).sqrt())
}

/// Columns over the way: a cubic, a wave of this frequency, and one that grows evenly from minus one to one.
fn waves(ways: &[f64], frequency: f64) -> Option<DMatrix<f64>> {
    let first = *ways.first()?;
    let way = ways.last()? - first;
    let turn = std::f64::consts::TAU * frequency;
    Some(DMatrix::from_fn(ways.len(), 8, |i, k| {
        let (gone, share) = (turn * (ways[i] - first), 2.0 * (ways[i] - first) / way - 1.0);
        match k {
            4 => gone.sin(),
            5 => gone.cos(),
            6 => share * gone.sin(),
            7 => share * gone.cos(),
            _ => share.powi(k as i32),
        }
    }))
}

/// What goes straight ahead: how far it has gone, m, with the force, and its line.
type Straight = ((Vec<f64>, Vec<Vector3<f64>>), Vector3<f64>);

fn over_the_way(interaction: &Interaction) -> Option<Straight> {
    let track = interaction.tracks.get(interaction.target.as_ref()?)?;
    let (times, forces) = stretch(interaction, ENDS)?;
    let axis = |k: usize| track.position.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let axes = [axis(0), axis(1), axis(2)];
    let place = |t: f64| {
        let at = |k: usize| interpolate(&track.time, &axes[k], t);
        Some(Vector3::new(at(0)?, at(1)?, at(2)?))
    };
    let places: Vec<Vector3<f64>> = times.iter().map(|t| place(*t)).collect::<Option<_>>()?;
    let whole = places.last()? - places.first()?;
    let line = whole.try_normalize(WAY)?;
    let along: Vec<f64> = places.iter().map(|p| (p - places[0]).dot(&line)).collect();
    // Single steps are noise: a tenth of the stretch tells how fast it goes.
    let reach = (times.len() / 20).max(2);
    let speed = |i: usize| {
        let (a, b) = (i.saturating_sub(reach), (i + reach).min(times.len() - 1));
        (along[b] - along[a]) / (times[b] - times[a])
    };
    let speeds: Vec<f64> = (0..times.len()).map(speed).collect();
    let usual = median(&speeds)?;
    let coarse = along.iter().step_by(reach).copied().collect::<Vec<f64>>();
    let gone: f64 = coarse.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
    if usual <= 0.0 || whole.norm() < STRAIGHT * gone {
        return None;
    }
    let moves = (0..times.len()).filter(|i| speeds[*i] > MOVES * usual);
    let (ways, forces): (Vec<f64>, Vec<Vector3<f64>>) = moves.map(|i| (along[i], forces[i])).unzip();
    (ways.len() >= SAMPLES).then_some(((ways, forces), line))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::*;
    use crate::capture::{PoseStream, WrenchStream};

    /// A push of 6 cm along x in two seconds, over ribs every 9 mm that swing by so many newtons, the less the farther it is by `dies`, 1/m.
    fn push(k: usize, (ribs, dies): (f64, f64)) -> Interaction {
        let (mut wrench, mut track) = (WrenchStream::default(), PoseStream::default());
        for i in 0..500 {
            let t = 0.005 * f64::from(i);
            let way = 0.03 * (t - 0.25).clamp(0.0, 2.0);
            let own = k as f64;
            let wobble = 0.02 * (211.0 * t * (1.0 + t + 0.1 * own)).sin() + 0.02 * (47.0 * (1.0 + 0.3 * own) * t).sin();
            let rubs = if t > 0.25 && t < 2.25 { 2.0 } else { 0.0 };
            let ribs = ribs * (-dies * way).exp() * rubs * 0.5 * (std::f64::consts::TAU * way / 0.009).sin();
            wrench.time.push(t);
            wrench.force.push(Vector3::new(rubs + ribs + wobble, wobble, 0.0));
            track.time.push(t);
            track.position.push(Point3::new(way, 0.0, 0.0));
            track.rotation.push(Some(UnitQuaternion::identity()));
        }
        Interaction {
            name: format!("push-{k}"),
            kind: Kind::Push,
            action: None,
            tool_name: None,
            tool: None,
            target: Some("box".into()),
            force: Some(wrench),
            tool_path: None,
            support_path: None,
            tracks: [("box".to_owned(), track)].into(),
            frames: None,
            held_out: false,
        }
    }

    #[test]
    fn ribs_are_told_by_their_wavelength_and_a_wobble_is_none() {
        let tops = |ribs: f64, dies: f64| {
            (0..4)
                .filter_map(|k| ripple_of(&push(k, (ribs, dies)), 0.02))
                .collect::<Vec<_>>()
        };
        let own = common(&tops(0.2, 0.0)).expect("ribs");
        assert_eq!(own.len(), 4);
        assert!(own.iter().all(|r| (r.frequency - 1.0 / 0.009).abs() < 3.0), "{own:?}");
        assert!(own.iter().all(|r| (r.force - 0.2).abs() < 0.04), "{own:?}");
        assert!(common(&tops(0.0, 0.0)).is_none());
        // A soft finger rings as it meets a body.
        assert!(common(&tops(0.8, 50.0)).is_none());
    }
}
