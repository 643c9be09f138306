//! Sliding friction from pushes and pulls: blocks of wrench and motion, and the limit surface fitted to them.
//!
//! Law: the support's friction on a sliding body is `P (v, c² ω) / sqrt(v² + c² ω²)` at the friction centre
//! (the centre of mass), the ellipsoidal limit surface of Lee and Cutkosky (1991), with `P = mu N` and the
//! torsional radius `c`; N follows the vertical part of the tool's force.

use nalgebra::{DVector, Vector2, Vector3};

use super::Config;
use super::evidence::{bridge_snapshots, mean_wrench, motion_at, tare_of, tool_at};
use crate::capture::{Interaction, PhaseKind, PoseStream, Segmented, ToolShape};
use crate::math::{Fit, Loss, Settings, correlated_mean, levenberg_marquardt};

/// Wrench and motion of the pushed link averaged over a block of time, in the plane of the support.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Force on the body, N, in the plane's axes.
    pub force: Vector2<f64>,
    /// Force on the body along the support's normal, N.
    pub lift: f64,
    /// Moment about the link's origin along the normal, N·m.
    pub moment: f64,
    /// Velocity of the link's origin, m/s.
    pub velocity: Vector2<f64>,
    /// Spin about the normal, rad/s.
    pub spin: f64,
    /// Acceleration of the link's origin, m/s².
    pub acceleration: Vector2<f64>,
    /// Axes of the link in the plane: plane vector of a link vector is `axes * v`.
    pub axes: nalgebra::Matrix2x3<f64>,
    /// Standard deviation of the velocity, m/s.
    pub velocity_sd: f64,
}

/// One push of one link.
#[derive(Clone, Debug)]
pub(super) struct Push {
    pub interaction: String,
    pub blocks: Vec<Block>,
    /// Mean direction of the motion in the plane, world.
    pub direction: Vector3<f64>,
    /// The pose between was not seen, only before and after.
    pub bridged: bool,
    /// Standard deviation of the jerking relative to the force.
    pub chatter: f64,
    /// Force at which it broke away, N, with its standard deviation, where it stuck first.
    pub breakaway: Option<(f64, f64)>,
}

/// Two axes that span the support, and its normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub x: Vector3<f64>,
    pub y: Vector3<f64>,
    pub normal: Vector3<f64>,
}

impl Plane {
    pub fn of(normal: Vector3<f64>) -> Self {
        let seed = if normal.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let x = (seed - normal * normal.dot(&seed)).normalize();
        Self {
            x,
            y: normal.cross(&x),
            normal,
        }
    }

    pub fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(v.dot(&self.x), v.dot(&self.y))
    }
}

/// How far the tool's surface is from its origin along `direction`, m.
fn reach(interaction: &Interaction, direction: &Vector3<f64>) -> f64 {
    match interaction.tool.as_ref().map(|t| (&t.shape, t.grip || t.pin)) {
        Some((_, true)) | None => 0.0,
        Some((ToolShape::Sphere { radius }, _)) => *radius,
        Some((ToolShape::Box { half }, _)) => (0..3)
            .map(|k| half[k] / direction[k].abs().max(1e-9))
            .fold(f64::INFINITY, f64::min),
        Some((ToolShape::Cylinder { radius, .. }, _)) => *radius,
        Some((ToolShape::Mesh(_), _)) => 0.0,
    }
}

/// The blocks of one push; `None` where it has no force, no track, or nothing slid.
pub(super) fn read_push(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    plane: &Plane,
    config: &Config,
) -> Option<Push> {
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let track = interaction.tracks.get(link)?;
    let bridged = track.is_snapshot_pair();
    let whole;
    let (track, start, end) = if bridged {
        whole = bridge_snapshots(track, tool, slide.start, slide.end)?;
        (&whole, slide.start, slide.end)
    } else {
        (track, slide.start + config.settling, slide.end - 0.5 * config.settling)
    };
    let tare = tare_of(interaction, segmented);
    let noise = if bridged {
        0.0
    } else {
        segmented.position_noise.unwrap_or(3e-4)
    };
    let mut blocks = Vec::new();
    let mut t = start + 0.5 * config.block;
    while t + 0.5 * config.block <= end {
        let wrench = mean_wrench(stream, t - 0.5 * config.block, t + 0.5 * config.block, &tare);
        let motion = motion_at(track, t, config.smoothing);
        if let (Some(w), Some(m), Some(p)) = (wrench, motion, tool_at(tool, t)) {
            let along = w.force.try_normalize(1e-9).unwrap_or_default();
            // Without torque the line of action is taken through the tool's surface along the force.
            let arm = p + along * reach(interaction, &along) - m.pose.translation.vector;
            let moment = match w.torque {
                Some(torque) => torque + (p.coords - m.pose.translation.vector).cross(&w.force),
                None => arm.coords.cross(&w.force),
            };
            let axes = m.pose.rotation.to_rotation_matrix().into_inner();
            // Where the body jerks, the force dips while it sticks and is `mu N` while it slides: the median of a
            // block lies nearer to the friction force than its mean.
            let plateau = if bridged {
                1.0
            } else {
                steadiness(
                    interaction,
                    segmented,
                    plane,
                    t - 0.5 * config.block,
                    t + 0.5 * config.block,
                )
                .0
            };
            blocks.push(Block {
                force: plateau * plane.flat(&w.force),
                lift: w.force.dot(&plane.normal),
                moment: plateau * moment.dot(&plane.normal),
                velocity: plane.flat(&m.velocity),
                spin: m.spin.dot(&plane.normal),
                acceleration: if bridged {
                    Vector2::zeros()
                } else {
                    plane.flat(&m.acceleration)
                },
                axes: nalgebra::Matrix2x3::from_rows(&[plane.x.transpose() * axes, plane.y.transpose() * axes]),
                velocity_sd: noise * m.velocity_gain,
            });
        }
        t += config.block;
    }
    let chatter = if bridged {
        0.0
    } else {
        steadiness(interaction, segmented, plane, start, end).1
    };
    let path: Vector2<f64> = blocks.iter().map(|b| b.velocity).sum();
    (blocks.len() >= 2 && path.norm() > 0.0).then(|| Push {
        interaction: interaction.name.clone(),
        direction: (plane.x * path.x + plane.y * path.y).normalize(),
        blocks,
        bridged,
        chatter,
        breakaway: breakaway(interaction, segmented, plane, track),
    })
}

/// Span over which force is averaged before jerking is looked for, s.
const JERK: f64 = 0.02;

/// Median over mean, and relative scatter beyond the sensor's noise, of the horizontal force between two times.
pub(super) fn steadiness(
    interaction: &Interaction,
    segmented: &Segmented,
    plane: &Plane,
    start: f64,
    end: f64,
) -> (f64, f64) {
    let Some(stream) = &interaction.force else {
        return (1.0, 0.0);
    };
    let tare = tare_of(interaction, segmented).force;
    let rows: Vec<f64> = (0..stream.time.len())
        .filter(|&i| stream.time[i] >= start && stream.time[i] <= end)
        .map(|i| plane.flat(&(stream.force[i] - tare)).norm())
        .filter(|f| f.is_finite())
        .collect();
    // Faster jerking than this is the contact's own ringing: its mean is right by the balance of momentum.
    let width = ((JERK * rows.len() as f64 / (end - start).max(1e-9)).round() as usize).max(1);
    if rows.len() < 2 * width || rows.len() < 20 {
        return (1.0, 0.0);
    }
    let smooth: Vec<f64> = rows
        .windows(width)
        .map(|w| w.iter().sum::<f64>() / width as f64)
        .collect();
    let mean = smooth.iter().sum::<f64>() / smooth.len() as f64;
    let variance = smooth.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / smooth.len() as f64;
    let noise = segmented.force_noise.unwrap_or(0.0);
    match crate::math::median(&smooth) {
        Some(median) if mean > 0.0 => {
            let excess = (variance - 1.2 * noise * noise / width as f64).max(0.0);
            (median / mean, excess.sqrt() / mean)
        }
        _ => (1.0, 0.0),
    }
}

/// Largest horizontal force in the first moments of sliding, where the body stuck long enough before for the
/// touch not to be a blow.
fn breakaway(
    interaction: &Interaction,
    segmented: &Segmented,
    plane: &Plane,
    track: &PoseStream,
) -> Option<(f64, f64)> {
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let stream = interaction.force.as_ref()?;
    if stick.end - stick.start < 0.03 || track.len() < 2 {
        return None;
    }
    let tare = tare_of(interaction, segmented);
    let span = (0.2 * (stick.end - stick.start)).clamp(0.01, 0.05);
    let mut best: Option<(f64, f64)> = None;
    let mut t = stick.start + 0.5 * (stick.end - stick.start);
    while t < (slide.start + 0.15).min(slide.end) {
        if let Some(w) = mean_wrench(stream, t - 0.5 * span, t + 0.5 * span, &tare) {
            let force = plane.flat(&w.force).norm();
            let sd = segmented.force_noise.unwrap_or(0.0) / (w.rows as f64).sqrt();
            if best.is_none_or(|(b, _)| force > b) {
                best = Some((force, sd));
            }
        }
        t += 0.25 * span;
    }
    let (peak, noise) = best?;
    // The body is caught up with at the tool's speed v: through a contact of stiffness k the force overshoots by
    // up to v sqrt(k m), with k v the rate at which it rose and m at most peak / (0.1 g).
    let tool = interaction.tool_path.as_ref()?;
    let step = tool_at(tool, stick.end)? - tool_at(tool, stick.end - 0.1)?;
    let rate = peak / (stick.end - stick.start);
    let overshoot = (peak / 3.0 * rate * step.norm() / 0.1).sqrt();
    // The largest of several noisy means lies about one standard deviation too high.
    (overshoot < 0.25 * peak).then(|| (peak - noise, noise + 0.02 * peak + 0.5 * overshoot))
}

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
    /// How much the mean of `forces` moves when the radius moves by its standard deviation, N.
    pub radius_effect: f64,
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

/// Motion at the friction centre: velocity, its generalised speed, and the share by which the load is changed.
fn at_centre(block: &Block, centre: &Vector3<f64>, radius: f64, prior: &SurfacePrior) -> (Vector2<f64>, f64, f64) {
    let arm = block.axes * centre;
    let v = block.velocity + block.spin * Vector2::new(-arm.y, arm.x);
    let speed = (v.norm_squared() + (radius * block.spin).powi(2)).sqrt();
    let load = (1.0 - block.lift / prior.weight).clamp(0.3, 3.0);
    (v, speed.max(1e-9), load)
}

/// Friction force of one push by its power balance at a given centre and radius: work of the tool less the
/// change of kinetic energy, over the generalised path.
fn force_by_power(push: &Push, centre: &Vector3<f64>, radius: f64, prior: &SurfacePrior) -> Option<(f64, f64)> {
    let (mut ratios, mut work, mut path) = (Vec::new(), 0.0, 0.0);
    for block in &push.blocks {
        let (v, speed, load) = at_centre(block, centre, radius, prior);
        if speed < 4.0 * block.velocity_sd || speed < 5e-4 {
            continue;
        }
        let arm = block.axes * centre;
        let moment = block.moment - (arm.x * block.force.y - arm.y * block.force.x);
        let power = (block.force - prior.mass * block.acceleration).dot(&v) + moment * block.spin;
        // Noise in the velocity lengthens the path; its expectation is taken off.
        let honest = (speed * speed - block.velocity_sd.powi(2))
            .max(0.25 * speed * speed)
            .sqrt();
        ratios.push(power / (load * honest));
        work += power;
        path += load * honest;
    }
    let scatter = correlated_mean(&ratios)?;
    let own = if ratios.len() < 4 {
        0.03 * (work / path).abs()
    } else {
        scatter.sd
    };
    (work > 0.0).then(|| (work / path, own))
}

/// Fits friction centre and torsional radius to all pushes of a link, then the force of each push.
pub(super) fn fit_surface(pushes: &[Push], prior: &SurfacePrior) -> Option<Surface> {
    let guess = crate::math::median(
        &pushes
            .iter()
            .filter_map(|p| force_by_power(p, &prior.centre, prior.radius, prior))
            .map(|f| f.0)
            .collect::<Vec<_>>(),
    )?;
    let fit = fit_shape(pushes, prior, guess)?;
    let centre = Vector3::new(fit.x[1], fit.x[2], fit.x[3]);
    let radius = fit.x[4].exp();
    let blocks: usize = pushes.iter().map(|p| p.blocks.len()).sum();
    // Blocks of one push share its errors: count pushes, not blocks.
    let inflate = (fit.cost * 2.0 / (3 * blocks) as f64).max(1.0).sqrt() * (blocks as f64 / pushes.len() as f64).sqrt();
    let sd = |i: usize, most: f64| (fit.sd(i) * inflate).min(most);
    let radius_log_sd = sd(4, prior.radius_log_sd).hypot(0.02);
    let forces: Vec<(f64, f64)> = pushes
        .iter()
        .map(|p| force_by_power(p, &centre, radius, prior).unwrap_or((f64::NAN, f64::NAN)))
        .collect();
    let mean_at = |radius: f64| {
        let f: Vec<f64> = pushes
            .iter()
            .filter_map(|p| force_by_power(p, &centre, radius, prior))
            .map(|f| f.0)
            .collect();
        f.iter().sum::<f64>() / f.len().max(1) as f64
    };
    Some(Surface {
        centre: [centre.x, centre.y, centre.z],
        centre_sd: [0, 1, 2].map(|k| sd(k + 1, prior.centre_sd[k]).hypot(2e-4)),
        radius: (radius, radius * radius_log_sd),
        radius_effect: 0.5 * (mean_at(radius * radius_log_sd.exp()) - mean_at(radius * (-radius_log_sd).exp())).abs(),
        forces,
    })
}

/// Joint least squares over all blocks: log force, friction centre, log radius.
fn fit_shape(pushes: &[Push], prior: &SurfacePrior, guess: f64) -> Option<Fit> {
    let residuals = |x: &DVector<f64>| {
        let (force, centre, radius) = (x[0].exp(), Vector3::new(x[1], x[2], x[3]), x[4].exp());
        let mut out = Vec::new();
        for push in pushes {
            // A bridged path is right only on the average.
            let trust = if push.bridged { 0.2 } else { 0.05 };
            for block in &push.blocks {
                let (v, speed, load) = at_centre(block, &centre, radius, prior);
                let direction_sd = trust + block.velocity_sd / speed;
                let arm = block.axes * centre;
                let moment = block.moment - (arm.x * block.force.y - arm.y * block.force.x);
                let predicted = force * load / speed * v + prior.mass * block.acceleration;
                let turning = force * load * radius * radius * block.spin / speed;
                let difference = (block.force - predicted) / (direction_sd * guess);
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
