//! Moment of inertia about the vertical from a body that hangs on the tool and is twisted to and fro: no friction is in it.
//!
//! The balance of moments about the tool's origin, which stands, is `T = I θ''` (rigid-body identification of a load: Atkeson, An
//! and Hollerbach 1986). It is read in its weak form: both sides are weighed with bumps of a tenth of a second and the derivatives
//! are moved onto the bumps, `∫ T φ dt = I ∫ θ φ'' dt`, so that no track is differentiated and nothing is smoothed.

use nalgebra::{DMatrix, DVector, Vector3};

use super::evidence::tool_at;
use super::lift::aloft;
use crate::capture::{Interaction, PoseStream, Segmented};
use crate::physics::PseudoInertia;

/// Half the width of a bump and the way between two, s.
const HALF: f64 = 0.15;
pub(super) const STEP: f64 = 0.06;
/// Bumps that overlap by so much say so many times what as many of their own would.
const OVERLAP: f64 = 2.0;
/// Fewest bumps, and readings of the track that one takes.
const FEWEST: usize = 12;
pub(super) const DENSE: usize = 10;
/// Turn about another axis, rad, and way of the tool, m, within a bump; how far the vertical in the body may be from where it is
/// twisted most, rad.
const ASIDE: f64 = 0.04;
const STANDS: f64 = 2e-3;
const LIKE: f64 = 0.06;
/// How often the angular acceleration has to be what noise of the track makes of it.
const CLEAR: f64 = 10.0;
/// Doubt beyond which it says nothing, and share that the hand (it gives) and the sensor's scale leave open.
const WORTH: f64 = 0.1;
const FORM: f64 = 0.01;

/// What one such lift says.
#[derive(Clone, Debug)]
pub(super) struct Twist {
    pub interaction: String,
    /// The vertical in the link frame, and the tool's origin in it, m.
    pub normal: Vector3<f64>,
    about: Vector3<f64>,
    /// Moment of inertia about the vertical through the tool's origin, kg·m², and its standard deviation.
    moment: f64,
    sd: f64,
}

impl Twist {
    /// By how much the moment of inertia of this body is more, in standard deviations.
    pub fn misses(&self, body: &PseudoInertia) -> f64 {
        let arm = body.com() - self.about;
        let aside = arm - self.normal * self.normal.dot(&arm);
        let own = self.normal.dot(&(body.inertia() * self.normal));
        (own + body.mass() * aside.norm_squared() - self.moment) / self.sd
    }
}

/// A bump `(1 − u²)⁵` and its first and second derivative in time, `u` from −1 to 1 over its width: so smooth at its ends that
/// trapezia between a dozen readings are exact to a thousandth.
fn bump(u: f64) -> [f64; 3] {
    let rest = 1.0 - u * u;
    if rest <= 0.0 {
        return [0.0; 3];
    }
    let first = -10.0 * u * rest.powi(4) / HALF;
    let second = 10.0 * rest.powi(3) * (9.0 * u * u - 1.0) / (HALF * HALF);
    [rest.powi(5), first, second]
}

/// What a bump sees: the integrals of the balance, and the vertical in the link frame in its middle.
struct Seen {
    row: [f64; 4],
    normal: Vector3<f64>,
    middle: f64,
}

/// What is read of one lift.
struct Lift<'a> {
    track: &'a PoseStream,
    path: &'a PoseStream,
    up: Vector3<f64>,
    /// Torque about the vertical, N·m, at these times, s.
    torque: (&'a [f64], Vec<f64>),
}

impl Lift<'_> {
    /// Nothing where it turns about another axis or the tool goes along the ground.
    fn at(&self, middle: f64) -> Option<Seen> {
        let time = &self.track.time;
        let (from, to) = (
            time.partition_point(|t| *t <= middle - HALF).checked_sub(1)?,
            (time.partition_point(|t| *t < middle + HALF) + 1).min(time.len()),
        );
        let near = time.partition_point(|t| *t < middle);
        let home = self.track.rotation.get(near).copied().flatten()?;
        let turned: Vec<Vector3<f64>> = self.track.rotation[from..to]
            .iter()
            .map(|q| q.map(|q| (q * home.inverse()).scaled_axis()))
            .collect::<Option<_>>()?;
        let aside = |v: &Vector3<f64>| (v - self.up * v.dot(&self.up)).norm();
        if turned.iter().map(aside).fold(0.0, f64::max) > ASIDE || !self.stands(middle) {
            return None;
        }
        let heading: Vec<f64> = turned.iter().map(|v| v.dot(&self.up)).collect();
        let time = &time[from..to];
        let own = |order: usize| weighed(time, &heading, (middle, order), DENSE);
        let level = weighed(time, &vec![1.0; time.len()], (middle, 0), DENSE)?;
        let felt = weighed(self.torque.0, &self.torque.1, (middle, 0), DENSE)?;
        Some(Seen {
            row: [own(2)?, -own(1)?, level, felt],
            normal: home.inverse() * self.up,
            middle,
        })
    }

    fn stands(&self, middle: f64) -> bool {
        let flat = |t: f64| tool_at(self.path, t).map(|p| p.coords - self.up * p.coords.dot(&self.up));
        let places = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|u| flat(middle + u * HALF));
        let [Some(a), Some(b), Some(home), Some(c), Some(d)] = places else {
            return false;
        };
        [a, b, c, d].iter().all(|p| (p - home).norm() < STANDS)
    }
}

/// The integral over time of a stream of values, each weighed; nothing where the stream has too few readings there.
pub(super) fn weighed(time: &[f64], values: &[f64], (middle, order): (f64, usize), least: usize) -> Option<f64> {
    let from = time.partition_point(|t| *t <= middle - HALF);
    let to = time.partition_point(|t| *t < middle + HALF);
    if to < from + least || from == 0 || to >= time.len() {
        return None;
    }
    let at = |i: usize| values[i] * bump((time[i] - middle) / HALF)[order];
    // By trapezia: the bump is nought at both ends.
    Some((from..to).map(|i| at(i) * 0.5 * (time[i + 1] - time[i - 1])).sum())
}

/// The moment of inertia of what hangs on the tool, where it was twisted; `gain_sd` is the doubt of the sensor's scale, a share.
pub(super) fn twisted(
    interaction: &Interaction,
    cut: &Segmented,
    link: &str,
    gravity: &Vector3<f64>,
    gain_sd: f64,
) -> Option<Twist> {
    let stream = interaction.force.as_ref()?;
    let torques = stream.torque.as_ref()?;
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let up = -gravity / gravity.norm();
    let stretch = aloft(interaction, cut, &up, link)?;
    let lift = Lift {
        track,
        path: interaction.tool_path.as_ref()?,
        up,
        torque: (&stream.time, torques.iter().map(|t| t.dot(&up)).collect()),
    };
    let count = ((stretch.end - stretch.start) / STEP) as usize;
    let bumps = (0..count).filter_map(|k| lift.at(stretch.start + k as f64 * STEP));
    let mut seen: Vec<Seen> = bumps.collect();
    // It may be tilted as well: what counts is how it hung where it was twisted most.
    let most = seen.iter().max_by(|a, b| a.row[0].abs().total_cmp(&b.row[0].abs()))?;
    let (normal, at) = (most.normal, most.middle);
    seen.retain(|s| s.normal.angle(&normal) < LIKE);
    let rows: Vec<[f64; 4]> = seen.iter().map(|s| s.row).collect();
    let noise = cut.rotation_noise.unwrap_or(3e-3) * noise_gain(&track.time);
    let (moment, own) = solved(&rows, noise)?;
    let sd = own.hypot(moment * FORM.hypot(gain_sd));
    let pose = track.pose(track.time.partition_point(|t| *t < at))?.0;
    (moment > 0.0 && sd < WORTH * moment).then_some(Twist {
        interaction: interaction.name.clone(),
        normal,
        about: pose.inverse_transform_point(&tool_at(lift.path, at)?).coords,
        moment,
        sd,
    })
}

/// Standard deviation of `∫ θ φ'' dt` for unit noise of the readings.
pub(super) fn noise_gain(time: &[f64]) -> f64 {
    let span = time.last().zip(time.first()).map_or(1.0, |(b, a)| b - a);
    let each = span / time.len().max(2) as f64;
    let count = (2.0 * HALF / each) as usize;
    let squares = (0..count).map(|k| (bump(-1.0 + k as f64 * each / HALF)[2] * each).powi(2));
    squares.sum::<f64>().sqrt()
}

/// The first of some unknowns of balances, of which the last column is what they come to, with its standard deviation by what is
/// left: a moment of inertia beside a drag, which a delay between torque and track looks like, and a rest of the torque.
pub(super) fn solved<const N: usize>(rows: &[[f64; N]], noise: f64) -> Option<(f64, f64)> {
    let (unknowns, count) = (N - 1, rows.len());
    if count < FEWEST {
        return None;
    }
    let strong = (rows.iter().map(|r| r[0] * r[0]).sum::<f64>() / count as f64).sqrt();
    if strong < CLEAR * noise {
        return None;
    }
    let a = DMatrix::from_fn(count, unknowns, |i, j| rows[i][j]);
    let b = DVector::from_fn(count, |i, _| rows[i][unknowns]);
    let inverse = (a.transpose() * &a).try_inverse()?;
    let x = &inverse * a.transpose() * &b;
    let left = (&b - &a * &x).norm_squared() / (count - unknowns) as f64;
    Some((x[0], (OVERLAP * left * inverse[(0, 0)]).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a body of 4e-4 kg·m² that swings to and fro, its torque read `late` seconds late.
    fn rows(late: f64) -> Vec<[f64; 4]> {
        let rate = 9.0;
        let at = |step: f64, n: usize| (0..n).map(|k| step * k as f64).collect::<Vec<f64>>();
        let (track, force) = (at(0.01, 250), at(0.002, 1250));
        let heading: Vec<f64> = track.iter().map(|t| 0.4 * (rate * t).sin()).collect();
        let of = |t: &f64| -4e-4 * 0.4 * rate * rate * (rate * (t - late)).sin() + 0.003;
        let torque: Vec<f64> = force.iter().map(of).collect();
        let ones = vec![1.0; track.len()];
        let row = |middle: f64| {
            let own = |order| weighed(&track, &heading, (middle, order), DENSE);
            let felt = weighed(&force, &torque, (middle, 0), DENSE);
            Some([own(2)?, -own(1)?, weighed(&track, &ones, (middle, 0), DENSE)?, felt?])
        };
        (0..40).filter_map(|k| row(STEP * f64::from(k))).collect()
    }

    #[test]
    fn bumps_weigh_a_swing_to_a_thousandth_and_a_delay_hardly_moves_it() {
        let (moment, sd) = solved(&rows(0.0), 0.02).expect("a moment");
        assert!(
            (moment / 4e-4 - 1.0).abs() < 1e-3 && sd < 1e-3 * moment,
            "{moment} {sd}"
        );
        let (moment, _) = solved(&rows(0.01), 0.02).expect("a moment");
        assert!((moment / 4e-4 - 1.0).abs() < 6e-3, "{moment}");
    }

    #[test]
    fn what_noise_would_show_as_well_tells_nothing() {
        assert!(solved(&rows(0.0), 0.5).is_none());
    }
}
