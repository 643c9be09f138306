//! A thing, the tools that moved it, and the trials that were measured, ready to be simulated.

use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::Effect;
use crate::base::{Seed, rng_for};
use crate::physics::tabletop::{Coefficients, Outcome, Path, Solid, Stage, Tool, Trial, simulate};

/// Share of the trials that made a thing fall from which on it is at the edge of tipping.
const TIPS: f64 = 0.02;
/// Least change of height that is a fall, m.
const FALL: f64 = 5e-3;

/// One measured trial, support frame.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The interaction.
    pub name: String,
    /// Tool and action: index into [`Bench::groups`].
    pub group: usize,
    /// Index into [`Bench::tools`], and into its paths.
    pub tool: (usize, usize),
    /// Where the body frame was before, m.
    pub place: Vector3<f64>,
    /// Its turn before, where it was measured.
    pub turn: Option<UnitQuaternion<f64>>,
    /// Seconds from the start of the tool's path to the second snapshot.
    pub seconds: f64,
    /// Displacement of the body frame on the support.
    pub effect: Effect,
    /// Whether it came to lie at another height than it stood at: it fell.
    pub fell: bool,
    /// Impulse that the tool gave, N·s, with its standard deviation, where force was recorded.
    pub impulse: Option<(f64, f64)>,
}

/// Trials of one tool and one action, all fitted or all held out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Label of the tool.
    pub tool: String,
    /// Label of the action.
    pub action: String,
    /// Never fitted.
    pub held_out: bool,
}

/// One simulated trial.
#[derive(Clone, Copy, Debug)]
pub struct Simulated {
    /// Displacement of the body frame on the support, m.
    pub effect: Effect,
    /// Whether it fell, as the measured ones are told to have fallen.
    pub fell: bool,
    /// How it ended.
    pub outcome: Outcome,
}

/// One thing with all its trials.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The link.
    pub name: String,
    /// Its shape.
    pub solid: Solid,
    /// Each tool with the paths that it took.
    pub tools: Vec<(Tool, Vec<Path>)>,
    /// Tool and action labels.
    pub groups: Vec<Group>,
    /// The trials.
    pub trials: Vec<Measured>,
    /// Support-from-body turns (up to yaw) in which it may have stood where none was measured, with their odds.
    pub turns: Vec<(UnitQuaternion<f64>, f64)>,
    /// Doubt of where it stood relative to the tool, m per axis.
    pub place_sd: f64,
    /// m/s².
    pub gravity: Vector3<f64>,
    /// What is believed of its mass before any force: median, kg, and standard deviation of the logarithm.
    pub mass: (f64, f64),
}

impl Bench {
    /// The trials of a group.
    pub fn of_group(&self, group: usize) -> Vec<usize> {
        (0..self.trials.len())
            .filter(|i| self.trials[*i].group == group)
            .collect()
    }

    /// The trials that may be fitted.
    pub fn fitted(&self) -> Vec<usize> {
        (0..self.trials.len())
            .filter(|i| !self.groups[self.trials[*i].group].held_out)
            .collect()
    }

    /// The measured effects of a group.
    pub fn measured(&self, group: usize) -> Vec<Effect> {
        self.of_group(group).iter().map(|i| self.trials[*i].effect).collect()
    }

    /// Whether it stands at the edge of tipping: fitted trials made it fall.
    pub fn tips(&self) -> bool {
        let fitted = self.fitted();
        let fell = fitted.iter().filter(|i| self.trials[**i].fell).count();
        fell as f64 > TIPS * fitted.len() as f64
    }

    /// Change of height from which on a thing is said to have fallen, m: beyond what the snapshots' noise explains.
    pub fn fall(&self) -> f64 {
        FALL.max(self.noise())
    }

    /// Displacement that the snapshots' noise does not explain, m.
    pub fn noise(&self) -> f64 {
        4.0 * std::f64::consts::SQRT_2 * self.place_sd
    }

    /// Mean length of the measured effects, m.
    pub fn travel(&self) -> f64 {
        self.trials.iter().map(|t| t.effect.norm()).sum::<f64>() / self.trials.len().max(1) as f64
    }

    /// Starts of a trial: as measured, with the doubt of its place and of a turn that was not measured.
    fn starts(&self, trial: &Measured, draws: usize, seed: Seed, round: usize) -> Vec<Isometry3<f64>> {
        let mut rng = rng_for(seed, &format!("snapshots/start/{}/{round}", trial.name));
        (0..draws).map(|_| self.start(trial, &mut rng)).collect()
    }

    fn start(&self, trial: &Measured, rng: &mut ChaCha8Rng) -> Isometry3<f64> {
        let yaw = rng.random_range(0.0..std::f64::consts::TAU);
        let share = rng.random_range(0.0..1.0);
        let x: f64 = StandardNormal.sample(rng);
        let y: f64 = StandardNormal.sample(rng);
        let turn = trial.turn.unwrap_or_else(|| {
            let mut left = share;
            let fits = |(turn, odds): &(UnitQuaternion<f64>, f64)| {
                left -= odds;
                (left <= 0.0).then_some(*turn)
            };
            let lying = self.turns.iter().find_map(fits).or(self.turns.last().map(|t| t.0));
            let spin = UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(&Vector3::z_axis(), yaw));
            spin * lying.unwrap_or_else(UnitQuaternion::identity)
        });
        let place = trial.place + Vector3::new(x, y, 0.0) * self.place_sd;
        let standing = Vector3::new(place.x, place.y, self.solid.standing_height(&turn));
        Isometry3::from_parts(standing.into(), turn)
    }

    /// Outcomes of `draws` simulations of each of `which` trials at each of `points`: by point, trial, draw.
    pub fn outcomes(
        &self,
        which: &[usize],
        points: &[Coefficients],
        draws: usize,
        seed: Seed,
        round: usize,
    ) -> Vec<Vec<Vec<Simulated>>> {
        let starts: Vec<Vec<Isometry3<f64>>> = which
            .iter()
            .map(|i| self.starts(&self.trials[*i], draws, seed, round))
            .collect();
        let mut out: Vec<Vec<Vec<Simulated>>> = vec![vec![Vec::new(); which.len()]; points.len()];
        for (number, (tool, paths)) in self.tools.iter().enumerate() {
            let mine: Vec<usize> = (0..which.len())
                .filter(|w| self.trials[which[*w]].tool.0 == number)
                .collect();
            let mut trials = Vec::with_capacity(points.len() * mine.len() * draws);
            for coefficients in points {
                for w in &mine {
                    let measured = &self.trials[which[*w]];
                    trials.extend(starts[*w].iter().map(|start| Trial {
                        start: *start,
                        path: measured.tool.1,
                        shift: Vector3::zeros(),
                        seconds: measured.seconds,
                        coefficients: *coefficients,
                    }));
                }
            }
            if trials.is_empty() {
                continue;
            }
            let stage = Stage {
                solid: &self.solid,
                tool,
                paths,
                gravity: self.gravity,
            };
            let mut found = simulate(&stage, &trials).into_iter().zip(&trials);
            for by_trial in &mut out {
                for w in &mine {
                    by_trial[*w] = found
                        .by_ref()
                        .take(draws)
                        .map(|(o, t)| self.simulated(&t.start, o))
                        .collect();
                }
            }
        }
        out
    }

    fn simulated(&self, start: &Isometry3<f64>, outcome: Outcome) -> Simulated {
        let lower = (outcome.end.translation.z - start.translation.z).abs();
        Simulated {
            effect: displacement(start, &outcome.end),
            fell: lower.is_nan() || lower > self.fall(),
            outcome,
        }
    }
}

fn displacement(start: &Isometry3<f64>, end: &Isometry3<f64>) -> Effect {
    let moved = end.translation.vector - start.translation.vector;
    // A trial that left the numbers behind tells nothing; it is far off for every comparison.
    if moved.iter().all(|x| x.is_finite()) {
        moved.xy()
    } else {
        Vector2::repeat(1e3)
    }
}
