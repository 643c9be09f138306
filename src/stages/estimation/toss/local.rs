//! What a track says about one moment: place, rotation and their rates by short polynomials, and the noise that is left.

use nalgebra::{DMatrix, UnitQuaternion, Vector3};

use crate::math::quantile;
use crate::physics::{Landing, State, Thrown, Velocity};

/// One recorded toss: what the track says of `O`, the root's orientation and the hinge.
#[derive(Clone, Debug)]
pub struct Toss {
    /// Name of the interaction.
    pub name: String,
    /// It may not be used to fit.
    pub held_out: bool,
    /// s.
    pub time: Vec<f64>,
    /// `O`, world, m.
    pub place: Vec<Vector3<f64>>,
    /// World-from-root.
    pub turn: Vec<UnitQuaternion<f64>>,
    /// rad; zero without a hinge.
    pub angle: Vec<f64>,
}

/// Noise of the tracks, one standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// m.
    pub place: f64,
    /// rad.
    pub turn: f64,
    /// Of the hinge's angle, rad.
    pub angle: f64,
    /// How unevenly the corners stand that bear a body which lies, m: of tracking and shape.
    pub uneven: f64,
}

/// Span from which a state is read, s, and its fewest rows.
pub(super) const BACK: (f64, usize) = (0.034, 6);

/// Rows `from..=to` of a toss as polynomials about row `at`: value and slope of place, rotation vector from `at`'s
/// orientation, and angle; with the root mean square of what is left of place and rotation.
pub(super) struct Local {
    value: [f64; 7],
    slope: [f64; 7],
    pub(super) left: [f64; 3],
}

pub(super) fn local(
    toss: &Toss,
    rows: std::ops::RangeInclusive<usize>,
    at: usize,
    degree: usize,
    known: &[f64; 7],
) -> Option<Local> {
    let n = rows.clone().count();
    let t0 = toss.time[at];
    let base = toss.turn[at].inverse();
    let time: Vec<f64> = rows.clone().map(|j| toss.time[j] - t0).collect();
    let a = DMatrix::from_fn(n, degree + 1, |i, j| time[i].powi(j as i32));
    let first = *rows.start();
    let b = DMatrix::from_fn(n, 7, |i, k| {
        let j = first + i;
        let raw = match k {
            0..=2 => toss.place[j][k],
            3..=5 => (toss.turn[j] * base).scaled_axis()[k - 3],
            _ => toss.angle[j],
        };
        raw - 0.5 * known[k] * time[i] * time[i]
    });
    let x = nalgebra::Cholesky::new(a.transpose() * &a)?.solve(&(a.transpose() * &b));
    let rest = &b - &a * &x;
    let freedom = n.saturating_sub(degree + 1).max(1) as f64;
    let rms = |from: usize, count: usize| (rest.columns(from, count).norm_squared() / freedom / count as f64).sqrt();
    Some(Local {
        value: std::array::from_fn(|k| x[(0, k)]),
        slope: std::array::from_fn(|k| x[(1, k)]),
        left: [rms(0, 3), rms(3, 3), rms(6, 1)],
    })
}

fn state_of(fit: &Local, turn: &UnitQuaternion<f64>) -> State {
    let v = &fit.value;
    State {
        place: Vector3::new(v[0], v[1], v[2]),
        turn: UnitQuaternion::from_scaled_axis(Vector3::new(v[3], v[4], v[5])) * turn,
        angle: v[6],
        velocity: Velocity::from_row_slice(&fit.slope),
    }
}

impl Toss {
    /// The pose of a row, at rest.
    pub fn state(&self, row: usize) -> State {
        State {
            place: self.place[row],
            turn: self.turn[row],
            angle: self.angle[row],
            velocity: Velocity::zeros(),
        }
    }

    /// How many rows make up a span.
    pub(super) fn rows(&self, span: (f64, usize)) -> usize {
        let n = self.time.len().max(2);
        let mean = (self.time[n - 1] - self.time[0]) / (n - 1) as f64;
        ((span.0 / mean.max(1e-6)).round() as usize).max(span.1)
    }

    /// The state at a row from the rows before it and after it; in flight the curvature is the model's.
    pub(super) fn read(
        &self,
        rows: std::ops::RangeInclusive<usize>,
        at: usize,
        flight: Option<(&Thrown, &Landing)>,
    ) -> Option<(State, [f64; 3])> {
        let Some((thrown, land)) = flight else {
            let fit = local(self, rows, at, 2, &[0.0; 7])?;
            return Some((state_of(&fit, &self.turn[at]), fit.left));
        };
        let mut known = [0.0; 7];
        let mut fit = local(self, rows.clone(), at, 1, &known)?;
        for _ in 0..2 {
            let state = state_of(&fit, &self.turn[at]);
            known.copy_from_slice(thrown.free_acceleration(&state, land).as_slice());
            fit = local(self, rows.clone(), at, 1, &known)?;
        }
        Some((state_of(&fit, &self.turn[at]), fit.left))
    }
}

/// The noise of the tracks: what a short parabola leaves where the motion is smooth.
pub fn noise_level(tosses: &[Toss]) -> Level {
    let (mut place, mut turn, mut angle) = (Vec::new(), Vec::new(), Vec::new());
    for toss in tosses {
        let n = toss.rows(BACK);
        for at in (n..toss.time.len()).step_by(2) {
            if let Some(fit) = local(toss, at + 1 - n..=at, at, 2, &[0.0; 7]) {
                place.push(fit.left[0]);
                turn.push(fit.left[1]);
                angle.push(fit.left[2]);
            }
        }
    }
    Level {
        place: quantile(&place, 0.3).unwrap_or(1e-4).max(1e-5),
        turn: quantile(&turn, 0.3).unwrap_or(1e-3).max(1e-4),
        angle: quantile(&angle, 0.5).unwrap_or(1e-3).max(1e-4),
        uneven: 5e-4,
    }
}
