//! What a touch is expected to tell: its forward model linearised about a draw of the belief.
//!
//! Fisher information with the scatter of friction from touch to touch as a random effect: `I = J' R^-1 J`, `R` the noise
//! of the reduced readings with that scatter in it, so that more samples of one push cannot beat it down.

use nalgebra::{DMatrix, Matrix2xX, Point2, Vector2};

use super::belief::{Belief, Information, State, UNKNOWNS};
use super::candidates::{Candidate, Way};
use crate::capture::Noise;
use crate::physics::{Contact, Dissipator, solve_contact};

/// What the sensors of the rig are taken to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Senses {
    /// N and N·m of one reading (1 sd).
    pub force: f64,
    pub torque: f64,
    /// rad of one pose (1 sd).
    pub rotation: f64,
    /// Whether torques are felt at all.
    pub torques: bool,
    pub gravity: f64,
    /// Scatter of friction from touch to touch, and doubt of its laws.
    pub scatter: f64,
    pub form: f64,
}

impl Senses {
    pub fn new(noise: &Noise, torques: bool, gravity: f64, (scatter, form): (f64, f64)) -> Self {
        Self {
            force: noise.force.unwrap_or(0.04),
            torque: noise.torque.unwrap_or(0.003),
            rotation: noise.rotation.unwrap_or(4e-3),
            torques,
            gravity,
            scatter,
            form,
        }
    }
}

/// Readings of a second average so many independent ones.
const AVERAGED: f64 = 20.0;
/// Relative doubt of mass and of the friction force from one fast push that lets go, of friction from one tilt.
const COAST: [f64; 2] = [0.025, 0.025];
const TILT: f64 = 0.01;
/// Doubt of how far beside the line of a fast push the centre of mass lies, m: a body that it does not go through turns.
const ASIDE: f64 = 2.5e-3;
/// Share by which the turn of a push may be off the limit surface, and the least doubt of it, rad.
const TURN: (f64, f64) = (0.05, 0.01);
/// Doubt of a centre of mass beyond the torque's own: where the tool holds, m.
const HELD: f64 = 3e-4;

/// One reduced reading: its value at a state, and its standard deviation there.
type Reading = (f64, f64);

/// Information that `candidate` is expected to bring where the truth is `state`.
pub(super) fn information(candidate: &Candidate, state: &State, senses: &Senses) -> Information {
    let at = readings(candidate, state, senses);
    let mut gradients = vec![State::zeros(); at.len()];
    for k in 0..UNKNOWNS {
        let step = if (2..4).contains(&k) { 5e-4 } else { 0.01 };
        let mut moved = *state;
        moved[k] += step;
        let there = readings(candidate, &moved, senses);
        for (gradient, (a, b)) in gradients.iter_mut().zip(at.iter().zip(&there)) {
            gradient[k] = (b.0 - a.0) / step;
        }
    }
    let pairs = gradients.iter().zip(&at);
    pairs.fold(Information::zeros(), |sum, (g, (_, sd))| {
        sum + g * g.transpose() * sd.powi(-2)
    })
}

fn readings(candidate: &Candidate, state: &State, senses: &Senses) -> Vec<Reading> {
    let weight = state[0].exp() * senses.gravity;
    let averaged = AVERAGED.sqrt();
    match &candidate.way {
        Way::Lift => {
            let mut out = vec![(state[0], (senses.force / averaged / weight).hypot(2e-3))];
            if senses.torques {
                let sd = (senses.torque / averaged / weight).hypot(HELD);
                out.extend([(state[2], sd), (state[3], sd)]);
            }
            out
        }
        Way::Push { point, outward, way } => push(candidate, (point, outward, way), state, senses),
        Way::Coast => {
            let way = candidate.direction.xy();
            let aside = way.perp(&Belief::centre(state).coords) / way.norm().max(1e-9);
            vec![
                (state[0], COAST[0]),
                (state[0] + state[1], COAST[1].hypot(senses.scatter)),
                (aside, ASIDE),
            ]
        }
        Way::Tilt => vec![(state[1], TILT.hypot(senses.scatter))],
    }
}

/// Force, its direction, turn and sideways shift of a slow push, by the ellipsoidal limit surface at the first contact.
fn push(
    candidate: &Candidate,
    (point, outward, way): (&Point2<f64>, &Vector2<f64>, &Vector2<f64>),
    state: &State,
    senses: &Senses,
) -> Vec<Reading> {
    let arm = point - Belief::centre(state);
    let radius = state[4].exp();
    let friction = (state[0] + state[1]).exp() * senses.gravity;
    let body = Dissipator {
        rows: DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![1.0, 1.0, radius])),
        points: Vec::new(),
        force: friction,
        creep: 0.0,
        damping: 0.0,
        pull: 0.0,
    };
    let contact = Contact {
        jacobian: Matrix2xX::from_row_slice(&[1.0, 0.0, -arm.y, 0.0, 1.0, arm.x]),
        inward: -outward,
        tool_velocity: way * candidate.speed,
        friction: state[5].exp(),
        bilateral: false,
    };
    let Some(solved) = solve_contact(&[body], &contact) else {
        return Vec::new();
    };
    let seconds = candidate.travel / candidate.speed;
    let size = solved.force.norm().max(1e-9);
    let force = (senses.force / averaged() / size)
        .hypot(senses.scatter)
        .hypot(senses.form);
    let lean = solved.force.y.atan2(solved.force.x);
    let turn = solved.velocity[2] * seconds;
    let turn_sd = (1.4 * senses.rotation / averaged()).hypot(TURN.0 * turn).hypot(TURN.1);
    vec![
        (size.ln(), force),
        (lean, (senses.force / averaged() / size).hypot(0.03)),
        (turn, turn_sd),
    ]
}

fn averaged() -> f64 {
    AVERAGED.sqrt()
}
