//! The limit surface of a link fitted to its pushes.
//!
//! Law: the support's friction on a sliding body is `P (v, c² ω) / sqrt(v² + c² ω²)` at the friction centre
//! (the centre of mass), the ellipsoidal limit surface of Lee and Cutkosky (1991), with `P = mu N` and the
//! torsional radius `c`, less what a patch of contact falls short of it while it slides and turns ([`Between`]); N follows
//! the vertical part of the tool's force.

use nalgebra::{DVector, Vector2, Vector3};

use super::push::{Block, Push};
use crate::math::{Fit, Loss, Settings, correlated_mean, levenberg_marquardt};
use crate::physics::{Between, SHORTFALL};

/// The limit surface of one link, fitted to all of its pushes.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Centre of friction in the link frame, in the plane through the shape's centroid, m, and its sd.
    pub centre: [f64; 3],
    pub centre_sd: [f64; 3],
    /// Torsional radius, m, and its standard deviation.
    pub radius: (f64, f64),
    /// Friction force per push, N, referred to the bare weight, with its own standard deviation.
    pub forces: Vec<(f64, f64)>,
    /// How much the mean of `forces` moves when torsional radius and shortfall move by their standard deviations, N.
    pub shape_effect: f64,
}

/// What is assumed of a link before its pushes are fitted.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePrior {
    /// Centroid of the shape, link frame, and how far the friction centre may be from it, m.
    pub centre: Vector3<f64>,
    pub centre_sd: Vector3<f64>,
    /// Torsional radius, m, and standard deviation of its logarithm.
    pub radius: f64,
    pub radius_log_sd: f64,
    /// Weight on the support, N, for the part of the load that the tool adds or takes.
    pub weight: f64,
    /// Mass, kg, for the part of the force that accelerates it.
    pub mass: f64,
}

/// What all pushes of a link share: centre of friction (link frame, m), torsional radius (m), shortfall of the ellipsoid.
#[derive(Clone, Copy, Debug)]
struct Shape {
    centre: Vector3<f64>,
    radius: f64,
    shortfall: f64,
}

impl Shape {
    fn assumed(prior: &SurfacePrior) -> Self {
        Self {
            centre: prior.centre,
            radius: prior.radius,
            shortfall: SHORTFALL.0,
        }
    }

    /// Of the unknowns of [`fit_shape`].
    fn of(x: &DVector<f64>) -> Self {
        Self {
            centre: Vector3::new(x[1], x[2], x[3]),
            radius: x[4].exp(),
            shortfall: SHORTFALL.0,
        }
    }
}

/// Motion at the centre of friction while the tool pushes.
struct AtCentre {
    /// From the link's origin to the centre of friction, plane axes, m.
    arm: Vector2<f64>,
    /// Its velocity, m/s.
    velocity: Vector2<f64>,
    /// The generalised speed of the limit surface, m/s.
    speed: f64,
    /// What the patch resists of what the ellipsoid says.
    between: Between,
    /// Share by which the tool changes the load.
    load: f64,
}

/// A force above the support tips the load ahead: friction, which balances it, acts at the support, and the pressure
/// moves by their couple over the load. `centre` is where friction acts without it, below the centre of mass.
fn at_centre(block: &Block, shape: &Shape, prior: &SurfacePrior) -> AtCentre {
    let Shape {
        centre,
        radius,
        shortfall,
    } = *shape;
    let load = (1.0 - block.lift / prior.weight).clamp(0.3, 10.0);
    let ahead = block.force * (block.height / (load * prior.weight));
    // Beyond the radius the thing would topple: what is pushed on the table stays within.
    let arm = block.axes * centre + ahead * (radius / ahead.norm().max(radius));
    let velocity = block.velocity + block.spin * Vector2::new(-arm.y, arm.x);
    let speed = (velocity.norm_squared() + (radius * block.spin).powi(2)).sqrt();
    AtCentre {
        arm,
        velocity,
        speed: speed.max(1e-9),
        between: Between::at((radius * block.spin / speed.max(1e-9)).powi(2), shortfall),
        load,
    }
}

/// Share of the speed of what rubs up to which a body hardly turns.
const UNTURNED: f64 = 0.1;

/// Friction force of one push by its power balance at a given centre and radius: work of the tool less the
/// change of kinetic energy, over the generalised path.
fn force_by_power(push: &Push, shape: &Shape, prior: &SurfacePrior) -> Option<(f64, f64)> {
    let (mut ratios, mut work, mut path) = (Vec::new(), 0.0, 0.0);
    for block in &push.blocks {
        let AtCentre {
            arm,
            velocity: v,
            speed,
            between,
            load,
        } = at_centre(block, shape, prior);
        if speed < 4.0 * block.velocity_sd || speed < 5e-4 {
            continue;
        }
        let twist = match block.moment {
            Some(moment) => (moment - arm.perp(&block.force)) * block.spin,
            // What an unknown moment works does not count where it hardly turns.
            None if shape.radius * block.spin.abs() < UNTURNED * speed => 0.0,
            None => continue,
        };
        let power = (block.force - prior.mass * block.acceleration).dot(&v) + twist;
        // Noise in the velocity lengthens the path; its expectation is taken off.
        let honest = (speed * speed - block.velocity_sd.powi(2))
            .max(0.25 * speed * speed)
            .sqrt();
        ratios.push(power / (load * honest * between.work));
        work += power;
        path += load * honest * between.work;
    }
    let scatter = correlated_mean(&ratios)?;
    let own = if ratios.len() < 4 {
        0.03 * (work / path).abs()
    } else {
        scatter.sd
    };
    (work > 0.0).then(|| (work / path, own.hypot(push.tare_sd)))
}

/// Fits friction centre and torsional radius to all pushes of a link, then the force of each push.
pub(super) fn fit_surface(pushes: &[Push], prior: &SurfacePrior) -> Option<Surface> {
    let guess = crate::math::median(
        &pushes
            .iter()
            .filter_map(|p| force_by_power(p, &Shape::assumed(prior), prior))
            .map(|f| f.0)
            .collect::<Vec<_>>(),
    )?;
    let fit = fit_shape(pushes, prior, guess)?;
    let shape = Shape::of(&fit.x);
    let Shape { centre, radius, .. } = shape;
    let blocks: usize = pushes.iter().map(|p| p.blocks.len()).sum();
    // Blocks of one push share its errors: count pushes, not blocks. Where pushes are enough, what each of them moves
    // says it better.
    let misfit = (fit.cost * 2.0 / (3 * blocks) as f64).max(1.0).sqrt();
    let counted = misfit * (blocks as f64 / pushes.len() as f64).sqrt();
    let moved = jackknife(pushes, prior, guess, &fit);
    let sd = |i: usize, most: f64| {
        match &moved {
            Some(moved) => (fit.sd(i) * misfit).hypot(moved[i]),
            None => fit.sd(i) * counted,
        }
        .min(most)
    };
    let radius_log_sd = sd(4, prior.radius_log_sd).hypot(0.02);
    let forces: Vec<(f64, f64)> = pushes
        .iter()
        .map(|p| force_by_power(p, &shape, prior).unwrap_or((f64::NAN, f64::NAN)))
        .collect();
    let mean_at = |shape: Shape| {
        let f: Vec<f64> = pushes
            .iter()
            .filter_map(|p| force_by_power(p, &shape, prior))
            .map(|f| f.0)
            .collect();
        f.iter().sum::<f64>() / f.len().max(1) as f64
    };
    let radius_at = |sign: f64| Shape {
        radius: radius * (sign * radius_log_sd).exp(),
        ..shape
    };
    let shortfall_at = |sign: f64| Shape {
        shortfall: shape.shortfall + sign * SHORTFALL.1,
        ..shape
    };
    let by_radius = 0.5 * (mean_at(radius_at(1.0)) - mean_at(radius_at(-1.0)));
    let by_shortfall = 0.5 * (mean_at(shortfall_at(1.0)) - mean_at(shortfall_at(-1.0)));
    Some(Surface {
        centre: [centre.x, centre.y, centre.z],
        centre_sd: [0, 1, 2].map(|k| sd(k + 1, prior.centre_sd[k]).hypot(2e-4)),
        radius: (radius, radius * radius_log_sd),
        shape_effect: by_radius.hypot(by_shortfall),
        forces,
    })
}

/// Fewest pushes whose leaving out tells the doubt.
const ENOUGH: usize = 3;

/// Standard deviations of the unknowns of [`fit_shape`] by leaving out one push at a time; none where they are few.
fn jackknife(pushes: &[Push], prior: &SurfacePrior, guess: f64, whole: &Fit) -> Option<[f64; UNKNOWNS]> {
    if pushes.len() < ENOUGH {
        return None;
    }
    let n = pushes.len() as f64;
    let mut sums = [0.0; UNKNOWNS];
    for out in 0..pushes.len() {
        let rest: Vec<Push> = (0..pushes.len())
            .filter(|i| *i != out)
            .map(|i| pushes[i].clone())
            .collect();
        let fit = fit_shape(&rest, prior, guess)?;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += (fit.x[k] - whole.x[k]).powi(2);
        }
    }
    Some(sums.map(|s| ((n - 1.0) / n * s).sqrt()))
}

/// Log force, friction centre, log radius.
const UNKNOWNS: usize = 5;

/// Joint least squares over all blocks.
fn fit_shape(pushes: &[Push], prior: &SurfacePrior, guess: f64) -> Option<Fit> {
    let residuals = |x: &DVector<f64>| {
        let (force, shape) = (x[0].exp(), Shape::of(x));
        let mut out = Vec::new();
        for push in pushes {
            // A bridged path is right only on the average.
            let trust = if push.bridged { 0.2 } else { 0.05 };
            for block in &push.blocks {
                let AtCentre {
                    arm,
                    velocity: v,
                    speed,
                    between,
                    load,
                } = at_centre(block, &shape, prior);
                let direction_sd = trust + block.velocity_sd / speed;
                let predicted = force * load * between.force / speed * v + prior.mass * block.acceleration;
                let turning = force * load * between.moment * shape.radius.powi(2) * block.spin / speed;
                let difference = (block.force - predicted) / (direction_sd * guess);
                let moment = block.moment.map_or(turning, |m| m - arm.perp(&block.force));
                out.extend([
                    difference.x,
                    difference.y,
                    (moment - turning) / (direction_sd * guess * prior.radius),
                ]);
            }
        }
        out.push((x[0] - guess.ln()) / 1.0);
        out.extend((0..3).map(|k| (x[k + 1] - prior.centre[k]) / prior.centre_sd[k]));
        out.push((x[4] - prior.radius.ln()) / prior.radius_log_sd);
        DVector::from_vec(out)
    };
    let start = DVector::from_vec(vec![
        guess.ln(),
        prior.centre.x,
        prior.centre.y,
        prior.centre.z,
        prior.radius.ln(),
    ]);
    let steps = DVector::from_vec(vec![1e-5, 1e-6, 1e-6, 1e-6, 1e-4]);
    let settings = Settings {
        loss: Loss::Huber(2.0),
        ..Settings::default()
    };
    levenberg_marquardt(&start, &steps, settings, residuals)
}

#[cfg(test)]
impl Push {
    /// A steady one by `force` (N) at `velocity` (m/s) that does not turn, in so many blocks.
    pub fn steady(force: Vector2<f64>, velocity: Vector2<f64>, blocks: u32) -> Self {
        let block = |k: u32| Block {
            time: 0.1 * f64::from(k),
            force,
            lift: 0.0,
            moment: Some(0.0),
            velocity,
            spin: 0.0,
            acceleration: Vector2::zeros(),
            axes: nalgebra::Matrix2x3::identity(),
            velocity_sd: 1e-3,
            height: 0.0,
        };
        Self {
            interaction: "push".into(),
            blocks: (0..blocks).map(block).collect(),
            direction: velocity.push(0.0).normalize(),
            bridged: false,
            chatter: 0.0,
            tare_sd: 0.0,
            breakaway: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const PRIOR: SurfacePrior = SurfacePrior {
        centre: Vector3::new(0.0, 0.0, 0.0),
        centre_sd: Vector3::new(0.01, 0.01, 0.01),
        radius: 0.03,
        radius_log_sd: 0.4,
        weight: 8.0,
        mass: 0.8,
    };

    /// Drags along six headings with 2 N, by a hand that twists so that nothing turns; its moment about the origin, where it was read.
    fn drags(moment: Option<f64>) -> Vec<Push> {
        let one = |k: u32| {
            let heading = TAU * f64::from(k) / 6.0;
            let way = Vector2::new(heading.cos(), heading.sin());
            let mut drag = Push::steady(2.0 * way, 0.05 * way, 5);
            drag.blocks.iter_mut().for_each(|b| b.moment = moment);
            drag
        };
        (0..6).map(one).collect()
    }

    #[test]
    fn a_hand_whose_torque_is_not_read_tells_the_force_and_no_centre() {
        let read = fit_surface(&drags(Some(0.0)), &PRIOR).expect("with torque");
        let unread = fit_surface(&drags(None), &PRIOR).expect("without");
        assert!(read.centre_sd[0] < 0.3 * PRIOR.centre_sd[0], "{:?}", read.centre_sd);
        assert!(unread.centre_sd[0] > 0.9 * PRIOR.centre_sd[0], "{:?}", unread.centre_sd);
        assert!(unread.centre[0].abs() < 1e-3, "{:?}", unread.centre);
        assert!(
            unread.forces.iter().all(|f| (f.0 - 2.0).abs() < 0.05),
            "{:?}",
            unread.forces
        );
    }
}
