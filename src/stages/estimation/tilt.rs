//! Friction from a support that turns until the body slides (Tanaka et al., "haptic vision", eqs. 3 and 4).

use nalgebra::{DVector, Point3, Vector3};

use super::Config;
use super::facts::{ground_of, subject};
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::{Fit, Loss, Settings, effective_samples, levenberg_marquardt, turned_displacement};
use crate::physics::{Slope, Tilted};
use crate::twin::Model;

/// Friction coefficients from one tilt.
#[derive(Clone, Debug)]
pub(super) struct Slide {
    pub interaction: String,
    pub static_: (f64, f64),
    pub kinetic: (f64, f64),
}

/// One tilt in which a body slid: friction coefficients with their standard deviations, and which way it went.
#[derive(Clone, Debug)]
pub struct SlidDown {
    /// Of the interaction.
    pub name: String,
    /// The interaction was kept back to judge with.
    pub held_out: bool,
    /// Static friction.
    pub static_: (f64, f64),
    /// Kinetic friction.
    pub kinetic: (f64, f64),
    /// Heading of the steepest descent in the support's plane as it was at first, rad.
    pub heading: f64,
    /// How far the body was turned about the support's normal, rad.
    pub turn: f64,
}

/// All tilts in which this body slid.
pub fn slid_down(capture: &Capture, segmented: &[Segmented], model: &Model, target: &str) -> Vec<SlidDown> {
    let (ground, config) = (ground_of(capture, &model.twin), Config::default());
    let tilts = capture.interactions.iter().filter(|i| i.kind == Kind::Tilt);
    let one = |interaction: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        if subject(interaction, cut) != Some(target) {
            return None;
        }
        let run = run_of(interaction, cut, target, &ground.gravity, &ground.point, &config)?;
        let slide = slide_of(interaction, cut, target, &ground.gravity, &ground.point, &config)?;
        let plane = &ground.plane;
        let turn = interaction.tracks.get(target)?.rotation.iter().flatten().next()?;
        // Whichever of its axes does not stand upright.
        let flat = |axis: &Vector3<f64>| (turn * axis).dot(&plane.normal).abs() < 0.8;
        let ahead = turn
            * if flat(&Vector3::x()) {
                Vector3::x()
            } else {
                Vector3::y()
            };
        Some(SlidDown {
            name: slide.interaction,
            held_out: interaction.held_out,
            static_: slide.static_,
            kinetic: slide.kinetic,
            heading: run.downhill.dot(&plane.y).atan2(run.downhill.dot(&plane.x)),
            turn: ahead.dot(&plane.y).atan2(ahead.dot(&plane.x)),
        })
    };
    tilts.filter_map(one).collect()
}

/// Displacement down the slope against time, with the slope that drives it.
struct Run {
    downhill: Vector3<f64>,
    time: Vec<f64>,
    distance: Vec<f64>,
    noise: f64,
    drive: Slope,
}

/// Reads the slide out of the tracks: displacement in the turning support, along the steepest descent.
fn run_of(
    interaction: &Interaction,
    segmented: &Segmented,
    target: &str,
    gravity: &Vector3<f64>,
    guess: &Point3<f64>,
    config: &Config,
) -> Option<Run> {
    let path = interaction.support_path.as_ref()?;
    let track = interaction.tracks.get(target)?;
    let normals: Vec<Vector3<f64>> = path.vector.iter().map(|n| n.into_inner()).collect();
    let noise = segmented.position_noise.unwrap_or(5e-4).max(1e-5);
    let turned = turned_displacement(&path.time, &normals, &track.time, &track.position, noise, guess)?;
    let downhill = turned.downhill(normals.first()?, gravity)?;
    let drive = Slope {
        time: path.time.clone(),
        along: normals.iter().map(|n| (gravity - n * gravity.dot(n)).norm()).collect(),
        normal: normals.iter().map(|n| -gravity.dot(n)).collect(),
    };
    let home = track.rotation.iter().flatten().next().copied();
    let mut run = Run {
        downhill,
        time: Vec::new(),
        distance: Vec::new(),
        noise,
        drive,
    };
    for i in 0..track.len() {
        let d = turned.displacement[i];
        let tipped = match (track.rotation[i], home) {
            (Some(q), Some(q0)) => {
                let relative = turned.turn[i].inverse() * q * q0.inverse();
                (relative * normals[0]).angle(&normals[0]) > 0.1
            }
            _ => false,
        };
        if tipped || d.norm() > config.tilt_distance || d.dot(&normals[0]).abs() > 0.02 {
            // A knock before the support turns is over by the time that it does.
            if turned.turn[i].angle() < 2e-3 {
                continue;
            }
            break;
        }
        if d.x.is_finite() {
            run.time.push(track.time[i]);
            run.distance.push(d.dot(&downhill));
        }
    }
    (run.time.len() > 20).then_some(run)
}

/// Static and kinetic friction from one tilt; `None` where the body did not slide.
pub(super) fn slide_of(
    interaction: &Interaction,
    segmented: &Segmented,
    target: &str,
    gravity: &Vector3<f64>,
    guess: &Point3<f64>,
    config: &Config,
) -> Option<Slide> {
    let run = run_of(interaction, segmented, target, gravity, guess, config)?;
    let far = crate::math::quantile(&run.distance, 0.995)?;
    if far < 8.0 * run.noise {
        return None;
    }
    let (static_, kinetic) = coefficients(&run)?;
    let sd = |(mu, sd): (f64, f64)| {
        let angle = config.angle_sd * (1.0 + mu * mu);
        (mu, (sd * sd + angle.powi(2) + (config.model_form * mu).powi(2)).sqrt())
    };
    Some(Slide {
        interaction: interaction.name.clone(),
        static_: sd(static_),
        kinetic: sd(kinetic),
    })
}

/// Kinetic friction and the offset of the distance for a given excess of static over kinetic friction.
fn fit_at(run: &Run, excess: f64, start: &DVector<f64>) -> Option<Fit> {
    let settings = Settings {
        loss: Loss::Huber(2.5),
        iterations: 30,
        tolerance: 1e-6,
    };
    levenberg_marquardt(start, &DVector::from_vec(vec![1e-5, 1e-6]), settings, |x| {
        let body = Tilted {
            friction: [x[0] + excess, x[0]],
        };
        let path = body.slid(&run.drive, &run.time);
        let rows = run.distance.iter().zip(path).map(|(d, s)| (d - s - x[1]) / run.noise);
        DVector::from_iterator(run.time.len(), rows)
    })
}

/// Mean and standard deviation of the static and the kinetic coefficient. The excess of static over kinetic is
/// never negative and, near zero, moves the slide only in second order: it is integrated out on a grid.
fn coefficients(run: &Run) -> Option<((f64, f64), (f64, f64))> {
    let slope = first_slope(run);
    let grid: Vec<f64> = (0..24).map(|i| 0.4 * slope * (i as f64 / 23.0).powi(2)).collect();
    let mut start = DVector::from_vec(vec![0.95 * slope, 0.0]);
    let mut fits = Vec::new();
    for excess in &grid {
        if let Some(fit) = fit_at(run, *excess, &start) {
            start.clone_from(&fit.x);
            fits.push((*excess, fit));
        }
    }
    let best = fits.iter().map(|(_, f)| f).min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let n = best.residuals.len() as f64;
    let misfit = (best.residuals.norm_squared() / (n - 3.0).max(1.0)).max(1.0);
    // Residuals that remember their past count for fewer.
    let inflate = misfit * n / effective_samples(best.residuals.as_slice());
    let weight = |i: usize| {
        let width = 0.5 * (fits[(i + 1).min(fits.len() - 1)].0 - fits[i.saturating_sub(1)].0);
        width * (-(fits[i].1.cost - best.cost) / inflate).exp()
    };
    let moments = |pick: &dyn Fn(usize) -> f64, own: &dyn Fn(usize) -> f64| {
        let total: f64 = (0..fits.len()).map(weight).sum();
        let mean = (0..fits.len()).map(|i| weight(i) * pick(i)).sum::<f64>() / total;
        let spread = (0..fits.len())
            .map(|i| weight(i) * ((pick(i) - mean).powi(2) + own(i)))
            .sum::<f64>()
            / total;
        (mean, spread.sqrt())
    };
    let own = |i: usize| fits[i].1.covariance[(0, 0)] * inflate;
    let static_ = moments(&|i| fits[i].1.x[0] + fits[i].0, &own);
    let kinetic = moments(&|i| fits[i].1.x[0], &own);
    (static_.0.is_finite() && kinetic.0.is_finite()).then_some((static_, kinetic))
}

/// The slope at which the distance leaves its noise: a little above the static coefficient.
fn first_slope(run: &Run) -> f64 {
    let onset = (0..run.time.len().saturating_sub(3))
        .find(|&i| run.distance[i..i + 3].iter().all(|d| *d > 5.0 * run.noise))
        .map_or(run.time[run.time.len() - 1], |i| run.time[i]);
    let (a, n) = run.drive.at(onset);
    a / n.max(1e-9)
}
