//! What a thing tells that was set sliding on its support and left alone: friction against inertia, no tool and no force.
//!
//! Output error: the slide is followed from an unknown state at its beginning, under the pressure of the even body that follows the
//! load ([`LimitSurface`]), and compared with the track. Mass cancels; friction shows in how it slows, torsional radius and radius of
//! gyration in how it spins down meanwhile.

use nalgebra::{DVector, Matrix5, Rotation2, Vector2, Vector5};

use super::coast::{Run, Shape, run_of, slopes};
use super::facts::Ground;
use super::push::Plane;
use super::spin::Spun;
use crate::capture::{Interaction, PoseStream, Segmented};
use crate::math::{Fit, Loss, Settings, effective_samples, levenberg_marquardt, median};
use crate::physics::{LimitSurface, Sliding};

/// Step in which it is followed, s, and the speed below which it stands, m/s.
const STEP: f64 = 4e-3;
const STANDS: f64 = 2e-3;
/// Prior of friction: median, and the standard deviation of its logarithm; of the logarithms of both radii over the shape's.
const FRICTION: (f64, f64) = (0.3, 1.0);
const RADII: [f64; 2] = [0.3, 0.3];
/// Most variances by which it may be missed, and turns below which it tells nothing of its radii, rad.
const MISFIT: f64 = 6.0;
const TURNS: f64 = 0.3;
/// How far what stays on the support rises and leans, m and rad, beside the noise of the track.
const RISES: f64 = 1.5e-3;
const LEANS: f64 = 0.03;
/// Noises of the track that are none of it.
const CLEAR: f64 = 6.0;
/// Logarithm of the radius of gyration that the law leaves open in one slide, of both radii together, and of no weight. Only their
/// ratio is sure: how the pressure is spread, and how it follows the load, goes with both alike.
const FORM: f64 = 0.03;
const TOGETHER: f64 = 0.3;
const WIDE: f64 = 1e3;

/// What a slide says of how the body turns; nothing on a slope, and where it flew, hit something, or hardly turned.
pub(super) fn glide(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
) -> Option<Spun> {
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let surface = shape.surface.as_ref()?;
    if interaction.force.is_some() || slopes(ground) || !stays_down(track, segmented, ground) {
        return None;
    }
    let mut run = run_of(track, segmented, ground, &shape.centre, f64::NEG_INFINITY)?;
    unwind(&mut run.heading);
    let turned = run.heading.last()? - run.heading.first()?;
    if turned.abs() < TURNS {
        return None;
    }
    let home = (0..track.len()).find_map(|i| track.pose(i))?.0;
    let normal = home.rotation.inverse() * ground.plane.normal;
    let frame = Plane::of(normal);
    let x = ground.plane.flat(&(home.rotation * frame.x));
    let glider = Glider {
        surface,
        shape,
        gravity: -ground.gravity.dot(&ground.plane.normal),
        ahead: x.y.atan2(x.x) - run.heading[0],
    };
    let fit = glider.fit(&run)?;
    let memory = fit.residuals.len() as f64 / effective_samples(fit.residuals.as_slice()).max(1.0);
    let misfit = 2.0 * fit.cost / (fit.residuals.len() as f64 - NUMBERS as f64).max(1.0);
    if misfit > MISFIT {
        return None;
    }
    let wide = (misfit.max(1.0) * memory.clamp(1.0, 4.0)).sqrt();
    // Nothing here goes with the mass, or tells where its centre is.
    let solved = Vector5::new(0.0, 0.0, 0.0, fit.x[RADIUS], fit.x[RADIUS + 1]);
    let own = |i: usize, k: usize| fit.covariance[(RADIUS + i - 3, RADIUS + k - 3)];
    let mut covariance = Matrix5::from_fn(|i, k| match (i, k) {
        (0, 0) => 1.0,
        (1, 1) | (2, 2) => shape.spread * shape.spread,
        (3.., 3..) => own(i, k),
        _ => 0.0,
    });
    covariance[(4, 4)] += FORM * FORM;
    covariance
        .fixed_view_mut::<2, 2>(3, 3)
        .add_scalar_mut(TOGETHER * TOGETHER);
    // Beside that, what was taken for likely of the radii is of no weight.
    let priors = [shape.spread, shape.spread, WIDE, WIDE];
    let axes = [&ground.plane.x, &ground.plane.y].map(|v| home.rotation.inverse() * v);
    Spun::of(
        &interaction.name,
        (&solved, &covariance),
        priors,
        wide,
        (&axes[0], &axes[1]),
        normal,
    )
}

/// Whether it neither rises nor leans on its way.
fn stays_down(track: &PoseStream, segmented: &Segmented, ground: &Ground) -> bool {
    let poses = || (0..track.len()).filter_map(|i| track.pose(i)).map(|p| p.0);
    let heights: Vec<f64> = poses()
        .map(|p| p.translation.vector.dot(&ground.plane.normal))
        .collect();
    let Some((middle, first)) = median(&heights).zip(poses().next()) else {
        return false;
    };
    let noise = (
        segmented.position_noise.unwrap_or(3e-4),
        segmented.rotation_noise.unwrap_or(3e-3),
    );
    let up = first.rotation.inverse() * ground.plane.normal;
    let leans = |p: &nalgebra::Isometry3<f64>| (p.rotation * up).angle(&ground.plane.normal);
    let low = |h: &f64| (h - middle).abs() < RISES + CLEAR * noise.0;
    heights.iter().all(low) && poses().all(|p| leans(&p) < LEANS + CLEAR * noise.1)
}

/// Headings without the jumps of whole turns.
fn unwind(headings: &mut [f64]) {
    let mut before = headings.first().copied().unwrap_or(0.0);
    for heading in headings {
        let turns = ((before - *heading) / std::f64::consts::TAU).round();
        *heading += turns * std::f64::consts::TAU;
        before = *heading;
    }
}

/// Logarithm of friction; place, speed, heading and spin at first; then the logarithms of the radii over those of the shape.
const NUMBERS: usize = 9;
const RADIUS: usize = 7;

/// A body on its support.
struct Glider<'a> {
    surface: &'a LimitSurface,
    shape: &'a Shape,
    /// m/s².
    gravity: f64,
    /// How far the axes of the pressure are turned ahead of the heading, rad.
    ahead: f64,
}

/// Place of the centre of mass, its speed, heading and spin.
#[derive(Clone, Copy)]
struct Going {
    at: Vector2<f64>,
    velocity: Vector2<f64>,
    heading: f64,
    spin: f64,
}

impl Going {
    fn after(&self, (a, alpha): (Vector2<f64>, f64), h: f64) -> Self {
        Self {
            at: self.at + h * self.velocity + 0.5 * h * h * a,
            velocity: self.velocity + h * a,
            heading: self.heading + h * self.spin + 0.5 * h * h * alpha,
            spin: self.spin + h * alpha,
        }
    }
}

impl Glider<'_> {
    /// Accelerations: of the centre of mass, m/s², and about it, rad/s².
    fn rates(&self, going: &Going, x: &[f64]) -> (Vector2<f64>, f64) {
        let friction = x[0].exp();
        let turn = Rotation2::new(going.heading + self.ahead);
        let rubbed = |ahead: Vector2<f64>| {
            self.surface.friction(&Sliding {
                velocity: turn.inverse() * going.velocity,
                spin: going.spin,
                centre: Vector2::zeros(),
                ahead,
                scale: x[RADIUS].exp(),
                slow: STANDS,
            })
        };
        // What slows down bears more on its front.
        let (level, _) = rubbed(Vector2::zeros());
        let (force, moment) = rubbed(-friction * self.shape.height * level);
        let deceleration = friction * self.gravity;
        let gyration = self.shape.gyration_radius * x[RADIUS + 1].exp();
        (turn * force * deceleration, moment * deceleration / gyration.powi(2))
    }

    /// Where its centre is at these times, and how far it has turned.
    fn follow(&self, x: &[f64], times: &[f64]) -> Vec<(Vector2<f64>, f64)> {
        let mut going = Going {
            at: Vector2::new(x[1], x[2]),
            velocity: Vector2::new(x[3], x[4]),
            heading: x[5],
            spin: x[6],
        };
        let mut time = times.first().copied().unwrap_or(0.0);
        let mut rests = false;
        let mut out = Vec::with_capacity(times.len());
        for t in times {
            let steps = ((t - time) / STEP).ceil().max(1.0);
            let h = (t - time) / steps;
            for _ in 0..steps as usize {
                if rests || h <= 0.0 {
                    break;
                }
                let first = self.rates(&going, x);
                let ahead = going.after(first, h);
                let second = self.rates(&ahead, x);
                let mean = (0.5 * (first.0 + second.0), 0.5 * (first.1 + second.1));
                let reach = self.shape.torsional_radius;
                let speed = |g: &Going| g.velocity.norm().hypot(reach * g.spin);
                let before = speed(&going);
                going = going.after(mean, h);
                rests = speed(&going) < STANDS || speed(&going) > before;
            }
            time = *t;
            out.push((going.at, going.heading));
        }
        out
    }

    fn fit(&self, run: &Run) -> Option<Fit> {
        let early = 8.min(run.time.len() - 1);
        let span = (run.time[early] - run.time[0]).max(1e-6);
        let velocity = (run.position[early] - run.position[0]) / span;
        let spin = (run.heading[early] - run.heading[0]) / span;
        let way = (run.position[run.position.len() - 1] - run.position[0]).norm();
        let slows = velocity.norm_squared() / (2.0 * way.max(1e-3)) / self.gravity;
        let start = [
            slows.clamp(0.03, 1.5).ln(),
            run.position[0].x,
            run.position[0].y,
            velocity.x,
            velocity.y,
            run.heading[0],
            spin,
        ];
        let steps = [1e-4, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5, 1e-4, 1e-3, 1e-3];
        let residuals = |x: &DVector<f64>| {
            let mut out = vec![(x[0] - FRICTION.0.ln()) / FRICTION.1];
            out.extend([x[RADIUS] / RADII[0], x[RADIUS + 1] / RADII[1]]);
            let path = self.follow(x.as_slice(), &run.time);
            for (i, (at, heading)) in path.iter().enumerate() {
                let miss = (run.position[i] - at) / run.noise.0;
                out.extend([miss.x, miss.y, (run.heading[i] - heading) / run.noise.1]);
            }
            DVector::from_vec(out)
        };
        let settings = |loss: Loss, iterations: usize| Settings {
            loss,
            iterations,
            tolerance: 1e-6,
        };
        // What the pressure does is found from where the rest fits: with all of it at once the fit strays.
        let even = |x: &DVector<f64>| {
            DVector::from_fn(NUMBERS, |k, _| match k {
                RADIUS => 0.0,
                _ if k > RADIUS => x[RADIUS],
                _ => x[k],
            })
        };
        let start = DVector::from_fn(RADIUS + 1, |k, _| start.get(k).copied().unwrap_or(0.0));
        let first = DVector::from_fn(RADIUS + 1, |k, _| steps[if k < RADIUS { k } else { RADIUS + 1 }]);
        let begun = levenberg_marquardt(&start, &first, settings(Loss::Squares, 40), |x| residuals(&even(x)))?;
        let steps = DVector::from_row_slice(&steps);
        let fit = levenberg_marquardt(&even(&begun.x), &steps, settings(Loss::Huber(2.5), 20), residuals)?;
        fit.x.iter().all(|v| v.is_finite()).then_some(fit)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Point3;

    use super::*;

    /// A plate of 140 mm by 90 mm.
    fn plate() -> Shape {
        let (mut points, mut gyration) = (Vec::new(), 0.0);
        for i in 0..28 {
            for k in 0..18 {
                let p = Vector2::new(-0.0675 + 0.005 * f64::from(i), -0.0425 + 0.005 * f64::from(k));
                gyration += p.norm_squared() / 504.0;
                points.push((p, 1.0 / 504.0));
            }
        }
        let surface = LimitSurface::of(&points).expect("an extent");
        Shape {
            centre: Point3::origin(),
            torsional_radius: surface.radius(),
            gyration_radius: gyration.sqrt(),
            spread: 5e-3,
            height: 0.017,
            surface: Some(Arc::new(surface)),
        }
    }

    #[test]
    fn a_plate_that_is_heavy_at_its_ends_spins_on() {
        let shape = plate();
        let glider = Glider {
            surface: shape.surface.as_deref().expect("known"),
            shape: &shape,
            gravity: 9.81,
            ahead: 0.3,
        };
        let time: Vec<f64> = (0..140).map(|i| 0.01 * f64::from(i)).collect();
        let heavy = 0.5 * 1.9_f64.ln();
        let truth = [0.22_f64.ln(), 0.0, 0.0, 0.4, 0.1, 0.0, -11.0, 0.0, heavy];
        let path = glider.follow(&truth, &time);
        let noise = |i: usize, k: usize| f64::from(((i * 37 + k * 11) % 13) as u32) / 6.0 - 1.0;
        let run = Run {
            position: path
                .iter()
                .enumerate()
                .map(|(i, p)| p.0 + 3e-4 * Vector2::new(noise(i, 0), noise(i, 5)))
                .collect(),
            heading: path.iter().enumerate().map(|(i, p)| p.1 + 2e-3 * noise(i, 7)).collect(),
            noise: (3e-4, 2e-3),
            time,
        };
        let fit = glider.fit(&run).expect("fitted");
        assert!((fit.x[RADIUS + 1] - heavy).abs() < 0.03, "{}", fit.x);
        assert!((fit.x[0] - truth[0]).abs() < 0.03, "{}", fit.x);
    }

    #[test]
    fn what_spins_more_than_a_turn_goes_on() {
        let mut headings = [3.0, -3.1, -2.0, 3.1, 2.9];
        unwind(&mut headings);
        assert!(
            (headings[2] - 4.283).abs() < 1e-3 && (headings[4] - 2.9).abs() < 1e-12,
            "{headings:?}"
        );
    }
}
