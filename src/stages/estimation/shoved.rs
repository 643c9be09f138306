//! Mass and friction from a fast push as a whole: being pushed and turned, letting go, coasting to rest.
//!
//! Output error: the measured wrench drives a simulated body ([`Shoved`]), and its way and heading are compared with
//! the track; neither a speed nor an acceleration is taken from differences. While it is pushed, the force tells the
//! friction force; while it coasts, the way tells the friction force over the mass. One push has one friction, so that the
//! scatter of friction from push to push does not reach the mass. Where the blow at first touch is soft, or read often
//! enough to tell its impulse, the push is followed from rest on; where it is not, from after it, from an unknown motion.

use nalgebra::{DMatrix, DVector, Matrix5, Vector2, Vector5};
use rayon::prelude::*;

use super::Config;
use super::accelerate::Accelerated;
use super::basins::{Basin, FIRST, polished};
use super::coast::Shape;
use super::face::Face;
use super::facts::Ground;
use super::shoved_run::{Run, run_of};
use super::spin::Spun;
use crate::capture::{Interaction, Segmented};
use crate::math::{Dual, Fit, Loss, Settings, effective_samples, levenberg_marquardt_exact, median, quantile};
use crate::physics::{PlaneMotion, Rubbing, Shoved, Simulator};

/// Log standard deviations of the torsional radius and of the radius of gyration about those of the shape.
const RADII: [f64; 2] = [0.3, 0.2];
/// Delay between force and track that is allowed for (1 sd), s.
const LATE: f64 = 2e-3;
/// Relative doubt beyond which mass or friction is not told, and misfit that still counts as explained, in variances.
const WORTH: f64 = 0.15;
const MISFIT: f64 = 12.0;
/// Relative doubt for every standard deviation of the track by which the law misses beyond noise.
const FORM: f64 = 0.01;
/// Misfit of a push followed from rest to which the law bears it, in variances.
const BORNE: f64 = 3.0;
/// Relative doubt of a push that begins at rest: how its points let go one after another, and how the load tips, are in no law here.
const LETS_GO: f64 = 0.03;
/// What is followed for longer than this, s, is followed in longer steps, up to so many times as long.
const FOLLOWED: f64 = 1.0;
const COARSEST: f64 = 3.0;
/// Unknowns of the law; the motion at the start comes on top.
const LAW: usize = 7;

/// Mass and friction force of a link that was shoved alone; nothing where it was not fast, or where they do not show.
pub(super) fn shoved(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    face: Option<&Face>,
    config: &Config,
) -> Option<(Accelerated, Option<Spun>, Vec<Basin>)> {
    let told = shoved_on(interaction, segmented, link, ground, shape, face, config, LATE)?;
    let whole = &told.whole;
    let worth = whole.mass.1 < WORTH * whole.mass.0 && whole.friction.1 < WORTH * whole.friction.0;
    (worth && whole.rubs(ground)).then_some((told.whole, told.spun, told.basins))
}

/// What one push says.
struct Told {
    whole: Accelerated,
    spun: Option<Spun>,
    delay: (f64, f64),
    /// By how much the logarithm of the mass goes with the delay, 1/s.
    mass_by_delay: f64,
    from_rest: bool,
    misfit: f64,
    basins: Vec<Basin>,
}

/// The same, however little they show; how much later than the track the force is read, s, with its standard deviation, expected
/// within `late` (1 sd), s; by how much the logarithm of the mass goes with it, 1/s; and whether it
/// could be followed from rest on.
pub(super) fn shoved_whole(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    config: &Config,
    late: f64,
) -> Option<(Accelerated, (f64, f64), f64, bool)> {
    let told = shoved_on(interaction, segmented, link, ground, shape, None, config, late)?;
    Some((told.whole, told.delay, told.mass_by_delay, told.from_rest))
}

/// The same, the force acting where the finger touches `face`.
#[expect(
    clippy::too_many_arguments,
    reason = "a recording, what is known beforehand, and where to look"
)]
fn shoved_on(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    face: Option<&Face>,
    config: &Config,
    late: f64,
) -> Option<Told> {
    let told = |rest| told_by(interaction, segmented, link, ground, shape, face, config, late, rest);
    // What the law does not bear, begun at rest, it may bear from the sliding on.
    let whole = told(true).filter(|t| t.misfit < BORNE);
    whole.or_else(|| told(false))
}

/// The same, from rest on, before the finger touched, or from the sliding on.
#[expect(
    clippy::too_many_arguments,
    reason = "a recording, what is known beforehand, and where to look"
)]
fn told_by(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    face: Option<&Face>,
    config: &Config,
    late: f64,
    from_rest: bool,
) -> Option<Told> {
    let run = run_of(interaction, segmented, link, ground, shape, face, from_rest)?;
    let (fit, basins) = fit(&run, shape, late)?;
    let memory = run.time.len() as f64 * 3.0 / effective_samples(fit.residuals.as_slice()).max(1.0);
    let misfit = 2.0 * fit.cost / (fit.residuals.len() as f64 - (LAW + 6) as f64).max(1.0);
    // What the solver's own step adds to the misfit is systematic: it counts in full beside the noise.
    let solver = Following { run: &run, shape, late }.solver_error(&fit.x);
    let wide = (misfit.max(1.0) * memory.clamp(1.0, 8.0)).sqrt().hypot(solver);
    let lets_go = if from_rest { LETS_GO } else { 0.0 };
    let form = config
        .model_form
        .hypot(FORM * (misfit - 1.0).max(0.0).sqrt())
        .hypot(lets_go);
    let sds = [0, 1].map(|k| (fit.sd(k) * wide).hypot(form));
    let shared = fit.covariance[(0, 1)] * wide * wide;
    let [mass, friction] = [0, 1].map(|k| (fit.x[k].exp(), fit.x[k].exp() * sds[k]));
    let whole = Accelerated {
        interaction: interaction.name.clone(),
        mass,
        friction,
        shared,
    };
    let at = [0, 2, 3, 4, 5];
    let solved = Vector5::from_fn(|i, _| fit.x[at[i]]);
    let covariance = Matrix5::from_fn(|i, j| fit.covariance[(at[i], at[j])]);
    let priors = [shape.spread, shape.spread, RADII[0], RADII[1]];
    let [x, y, normal] = [&ground.plane.x, &ground.plane.y, &ground.plane.normal].map(|v| run.home.inverse() * v);
    let spun = Spun::of(
        &interaction.name,
        (&solved, &covariance),
        priors,
        wide,
        (&x, &y),
        normal,
    );
    (misfit < MISFIT).then_some(Told {
        whole,
        spun,
        delay: (fit.x[6], fit.sd(6) * wide),
        mass_by_delay: fit.covariance[(0, 6)] / fit.covariance[(6, 6)].max(1e-300),
        from_rest,
        misfit,
        basins,
    })
}

/// Logarithms of mass and friction force, centre of mass off the centroid (m), logarithms of the radii over those of the
/// shape, and how much later than the track the force is, s.
fn fit(run: &Run, shape: &Shape, late: f64) -> Option<(Fit, Vec<Basin>)> {
    let sizes: Vec<f64> = run.shoves.iter().map(|s| s.force.norm()).collect();
    let strong = quantile(&sizes, 0.95)?;
    let typical = median(&sizes.into_iter().filter(|f| *f > 0.1 * strong).collect::<Vec<_>>()).filter(|f| *f > 0.0)?;
    let following = Following { run, shape, late };
    let residuals = |x: &DVector<f64>| DVector::from_vec(following.residuals(x.as_slice()));
    let slopes = |x: &DVector<f64>| following.slopes(x);
    let settings = |iterations: usize| Settings {
        loss: Loss::Huber(2.5),
        iterations,
        tolerance: 1e-6,
    };
    let early = 6.min(run.time.len() - 1);
    let span = (run.time[early] - run.time[0]).max(1e-6);
    let velocity = (run.position[early] - run.position[0]) / span;
    let spin = (run.heading[early] - run.heading[0]) / span;
    // Several starts: what is driven hard and what barely moves lie in different basins.
    let starts = [(0.03, 0.9), (0.1, 0.8), (0.3, 0.6)];
    let fits = starts.par_iter().filter_map(|(per_newton, share)| {
        let mut start = DVector::zeros(LAW + 6);
        start[0] = f64::ln(per_newton * typical);
        start[1] = f64::ln(share * typical);
        let motion = [
            run.position[0].x,
            run.position[0].y,
            velocity.x,
            velocity.y,
            run.heading[0],
            spin,
        ];
        start.rows_mut(LAW, 6).copy_from_slice(&motion);
        levenberg_marquardt_exact(&start, settings(FIRST), residuals, slopes)
    });
    let again =
        |from: &Fit, iterations: usize| levenberg_marquardt_exact(&from.x, settings(iterations), residuals, slopes);
    polished(fits.collect(), again)
}

/// A push as it is compared with the law.
struct Following<'a> {
    run: &'a Run,
    shape: &'a Shape,
    late: f64,
}

impl Following<'_> {
    /// The solver's step, s: longer for what is followed for long. What it costs in accuracy counts in the doubt.
    fn step(&self) -> f64 {
        let (first, last) = (self.run.time.first(), self.run.time.last());
        let span = first.zip(last).map_or(0.0, |(a, b)| b - a);
        Shoved::<f64>::STEP * (span / FOLLOWED).clamp(1.0, COARSEST)
    }

    /// The body at `x`, and how the tracked point moves at the start.
    fn at<T: Rubbing>(&self, x: &[T]) -> (Shoved<'_, T>, PlaneMotion<T>) {
        let (run, shape) = (self.run, self.shape);
        let off = Vector2::new(x[2], x[3]);
        let body = Shoved {
            mass: x[0].exp(),
            friction: x[1].exp(),
            torsional_radius: x[4].exp() * shape.torsional_radius,
            gyration_radius: x[5].exp() * shape.gyration_radius,
            centre: Vector2::new(off.x + run.centre.x, off.y + run.centre.y),
            height: shape.height,
            gravity: run.gravity,
            surface: shape.surface.as_deref().map(|s| (s, run.aligned)),
            off,
            late: x[6],
        };
        let start = PlaneMotion {
            position: Vector2::new(x[LAW], x[LAW + 1]),
            velocity: Vector2::new(x[LAW + 2], x[LAW + 3]),
            heading: x[LAW + 4],
            spin: x[LAW + 5],
        };
        (body, start)
    }

    /// What halving the step changes, root mean square, in standard deviations of the track.
    fn solver_error(&self, x: &DVector<f64>) -> f64 {
        let (body, start) = self.at(x.as_slice());
        let (place, turn) = self.run.noise;
        let apart = |a: &PlaneMotion, b: &PlaneMotion| {
            let moved = (a.position - b.position).norm() / place;
            moved.hypot((a.heading - b.heading) / turn)
        };
        let start = body.centred(&start);
        body.solver_error(&start, &self.run.shoves, &self.run.time, self.step(), apart)
    }

    /// What is left over at `x`, in standard deviations: that of the priors, then place and heading at each time.
    fn residuals<T: Rubbing>(&self, x: &[T]) -> Vec<T> {
        let (run, shape) = (self.run, self.shape);
        let (body, start) = self.at(x);
        let path = body.simulate_with_step(&body.centred(&start), &run.shoves, run.time[0], &run.time, self.step());
        let mut out = vec![
            x[2] * shape.spread.recip(),
            x[3] * shape.spread.recip(),
            x[4] * RADII[0].recip(),
            x[5] * RADII[1].recip(),
            x[6] * self.late.recip(),
        ];
        for (i, seen) in path.iter().enumerate() {
            let miss = |measured: f64, seen: T, noise: f64| (T::of(measured) - seen) * noise.recip();
            out.extend([
                miss(run.position[i].x, seen.position.x, run.noise.0),
                miss(run.position[i].y, seen.position.y, run.noise.0),
                miss(run.heading[i], seen.heading, run.noise.1),
            ]);
        }
        out
    }

    /// Their derivatives.
    fn slopes(&self, x: &DVector<f64>) -> DMatrix<f64> {
        let numbers: Vec<Dual<{ LAW + 6 }>> = x.iter().enumerate().map(|(k, v)| Dual::variable(*v, k)).collect();
        let rows = self.residuals(&numbers);
        DMatrix::from_fn(rows.len(), x.len(), |i, j| rows[i].slopes[j])
    }
}
