//! Mass and friction from a fast push as a whole: being pushed and turned, letting go, coasting to rest.
//!
//! Output error: the measured wrench drives a simulated body ([`Shoved`]), and its way and heading are compared with
//! the track; neither a speed nor an acceleration is taken from differences. While it is pushed, the force tells the
//! friction force; while it coasts, the way tells the friction force over the mass. One push has one friction, so that the
//! scatter of friction from push to push does not reach the mass. The blow at first touch lasts for a few readings, too
//! few to tell its impulse: what is compared begins after it, from an unknown motion.

use nalgebra::{DVector, Matrix5, UnitQuaternion, Vector2, Vector3, Vector5};

use super::Config;
use super::accelerate::Accelerated;
use super::action::rest_pose;
use super::basins::{Basin, apart, basins_of};
use super::coast::Shape;
use super::evidence::{Tare, mean_wrench, tare_of, tool_at};
use super::face::Face;
use super::facts::Ground;
use super::push::Plane;
use super::spin::Spun;
use crate::capture::{Interaction, PhaseKind, Segmented, WrenchStream};
use crate::math::{Fit, Loss, Settings, effective_samples, levenberg_marquardt, median, quantile};
use crate::physics::{PlaneMotion, Shove, Shoved, Simulator};

/// Least speed at which a body coasts a millimetre and more once it is let go, m/s.
const FAST: f64 = 0.1;
/// Log standard deviations of the torsional radius and of the radius of gyration about those of the shape.
const RADII: [f64; 2] = [0.3, 0.2];
/// Delay between force and track that is allowed for (1 sd), s.
const LATE: f64 = 2e-3;
/// Relative doubt beyond which mass or friction is not told, and misfit that still counts as explained, in variances.
const WORTH: f64 = 0.15;
const MISFIT: f64 = 12.0;
/// Relative doubt for every standard deviation of the track by which the law misses beyond noise.
const FORM: f64 = 0.01;
/// Rows of the track that are compared at most.
const MOST: usize = 300;
/// Time after the last motion that is compared, s.
const REST: f64 = 0.08;
/// What exceeds this many times the usual force of the push is a blow; time after it until its force is forgotten, s.
const BLOW: f64 = 2.5;
const AFTER: f64 = 0.012;
/// Readings, at 500 a second or fewer, from which on the impulse of a blow is known.
const OFTEN: f64 = 4.0;
/// Time before the touch that is compared, s: what stands there has no speed. Misfit to which the law bears it, in variances.
const STANDS: f64 = 0.03;
const BORNE: f64 = 3.0;
/// Relative doubt of a push that begins at rest: how its points let go one after another, and how the load tips, are in no law here.
const LETS_GO: f64 = 0.03;
/// Iterations after which the best of several starts is chosen.
const FIRST: usize = 8;
/// Unknowns of the law; the motion at the start comes on top.
const LAW: usize = 7;

struct Run {
    shoves: Vec<Shove>,
    time: Vec<f64>,
    position: Vec<Vector2<f64>>,
    heading: Vec<f64>,
    /// From the tracked point to the centroid at the start, m.
    centre: Vector2<f64>,
    noise: (f64, f64),
    /// World-from-link turn at the start, and the heading at which the link's own plane axes are those of the plane.
    home: UnitQuaternion<f64>,
    aligned: f64,
    /// Along the support's normal, m/s².
    gravity: f64,
}

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
    worth.then_some((told.whole, told.spun, told.basins))
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
    let wide = (misfit.max(1.0) * memory.clamp(1.0, 8.0)).sqrt();
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

fn run_of(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    face: Option<&Face>,
    from_rest: bool,
) -> Option<Run> {
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let plane = &ground.plane;
    if plane.flat(&ground.gravity).norm() > 0.02 * ground.gravity.norm() {
        return None;
    }
    let rest = segmented.phases.first().filter(|p| p.kind == PhaseKind::Rest)?;
    let home = rest_pose(track, (rest.start, rest.end))?.0;
    let onset = segmented.of(PhaseKind::Slide).map(|p| p.start).reduce(f64::min)?;
    let tare = tare_of(interaction, segmented);
    let touch = segmented
        .of(PhaseKind::Stick)
        .map(|p| p.start)
        .reduce(f64::min)
        .unwrap_or(onset);
    let from = match after_blows(stream, &tare, plane, onset)? {
        from if !from_rest => from,
        from => (from <= onset).then_some(onset.min(touch) - STANDS)?,
    };
    let origin = plane.flat(&home.translation.vector);
    let heading = |i: usize| {
        let turn: Vector3<f64> = (track.rotation[i]? * home.rotation.inverse()).scaled_axis();
        Some(turn.dot(&plane.normal))
    };
    let noise = (
        segmented.position_noise.unwrap_or(3e-4).max(2e-5),
        segmented.rotation_noise.unwrap_or(3e-3).max(2e-4),
    );
    let mut rows: Vec<(f64, Vector2<f64>, f64)> = (0..track.len())
        .filter(|&i| track.time[i] >= from && track.position[i].coords.iter().all(|x| x.is_finite()))
        .filter_map(|i| Some((track.time[i], plane.flat(&track.position[i].coords), heading(i)?)))
        .collect();
    let last = rows.last()?.1;
    let stands = rows.iter().rposition(|r| (r.1 - last).norm() > 4.0 * noise.0)?;
    let until = rows[stands].0 + REST;
    rows.retain(|r| r.0 <= until);
    let speeds: Vec<f64> = rows
        .windows(4)
        .map(|w| (w[3].1 - w[0].1).norm() / (w[3].0 - w[0].0).max(1e-6))
        .collect();
    if rows.len() < 12 || quantile(&speeds, 0.95)? < FAST {
        return None;
    }
    let rows: Vec<_> = rows.iter().step_by(rows.len().div_ceil(MOST)).collect();
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let half = 0.5 / rate.min(500.0);
    let shove = |&t: &f64| {
        let wrench = mean_wrench(stream, t - half, t + half, &tare)?;
        let finger = tool_at(tool, t)?;
        let row = track.time.partition_point(|x| *x < t).min(track.len() - 1);
        // Without torque the force acts where finger and face touch.
        let touch = match (wrench.torque, face, track.pose(row)) {
            (None, Some(face), Some(pose)) => face.touch(&pose.0, &finger).unwrap_or_default(),
            _ => Vector3::zeros(),
        };
        Some(Shove {
            time: t,
            force: plane.flat(&wrench.force),
            at: plane.flat(&(finger + touch).coords).into(),
            moment: wrench.torque.map_or(0.0, |m| m.dot(&plane.normal)),
            height: (finger - ground.point).dot(&plane.normal).max(0.0),
            lift: wrench.force.dot(&plane.normal),
        })
    };
    let inside = stream.time.iter().filter(|t| **t >= from && **t <= until);
    Some(Run {
        shoves: inside.filter_map(shove).collect(),
        time: rows.iter().map(|r| r.0).collect(),
        position: rows.iter().map(|r| r.1).collect(),
        heading: rows.iter().map(|r| r.2).collect(),
        centre: plane.flat(&(home * shape.centre).coords) - origin,
        noise,
        home: home.rotation,
        aligned: {
            let own = plane.flat(&(home.rotation * Plane::of(home.rotation.inverse() * plane.normal).x));
            -own.y.atan2(own.x)
        },
        gravity: -ground.gravity.dot(&plane.normal),
    })
}

/// When the last blow is over, s: the force that is usual in contact is exceeded no more.
fn after_blows(stream: &WrenchStream, tare: &Tare, plane: &Plane, onset: f64) -> Option<f64> {
    let size = |i: usize| plane.flat(&(stream.force[i] - tare.force)).norm();
    let rows: Vec<usize> = (0..stream.time.len()).filter(|&i| size(i).is_finite()).collect();
    let strong = rows.iter().map(|i| size(*i)).fold(0.0, f64::max);
    let touching: Vec<f64> = rows
        .iter()
        .map(|i| size(*i))
        .filter(|f| *f > 0.05 * strong.min(10.0))
        .collect();
    let usual = median(&touching)?;
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let mut end = onset;
    for blow in rows.chunk_by(|a, b| (size(*a) > BLOW * usual) == (size(*b) > BLOW * usual)) {
        let span = stream.time[blow[blow.len() - 1]] - stream.time[blow[0]];
        // One that is read often enough tells its impulse.
        if size(blow[0]) > BLOW * usual && span * rate.min(500.0) < OFTEN {
            end = end.max(stream.time[blow[blow.len() - 1]] + AFTER);
        }
    }
    Some(end)
}

/// Logarithms of mass and friction force, centre of mass off the centroid (m), logarithms of the radii over those of the
/// shape, and how much later than the track the force is, s.
fn fit(run: &Run, shape: &Shape, late: f64) -> Option<(Fit, Vec<Basin>)> {
    let sizes: Vec<f64> = run.shoves.iter().map(|s| s.force.norm()).collect();
    let strong = quantile(&sizes, 0.95)?;
    let typical = median(&sizes.into_iter().filter(|f| *f > 0.1 * strong).collect::<Vec<_>>()).filter(|f| *f > 0.0)?;
    let residuals = |x: &DVector<f64>| {
        let off = Vector2::new(x[2], x[3]);
        let body = Shoved {
            mass: x[0].exp(),
            friction: x[1].exp(),
            torsional_radius: shape.torsional_radius * x[4].exp(),
            gyration_radius: shape.gyration_radius * x[5].exp(),
            centre: run.centre + off,
            height: shape.height,
            gravity: run.gravity,
            surface: shape.surface.as_deref().map(|s| (s, run.aligned)),
            off,
        };
        let start = PlaneMotion {
            position: Vector2::new(x[LAW], x[LAW + 1]),
            velocity: Vector2::new(x[LAW + 2], x[LAW + 3]),
            heading: x[LAW + 4],
            spin: x[LAW + 5],
        };
        let times: Vec<f64> = run.time.iter().map(|t| t + x[6]).collect();
        let path = body.simulate(&body.centred(&start), &run.shoves, times[0], &times);
        let mut out = vec![
            off.x / shape.spread,
            off.y / shape.spread,
            x[4] / RADII[0],
            x[5] / RADII[1],
            x[6] / late,
        ];
        for (i, seen) in path.iter().enumerate() {
            let miss = (run.position[i] - seen.position) / run.noise.0;
            out.extend([miss.x, miss.y, (run.heading[i] - seen.heading) / run.noise.1]);
        }
        DVector::from_vec(out)
    };
    let steps = DVector::from_vec(vec![
        1e-4, 1e-4, 1e-5, 1e-5, 1e-3, 1e-3, 1e-4, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5, 1e-4,
    ]);
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
    let fits = starts.iter().filter_map(|(per_newton, share)| {
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
        levenberg_marquardt(&start, &steps, settings(FIRST), residuals)
    });
    let again = |from: &Fit, iterations: usize| levenberg_marquardt(&from.x, &steps, settings(iterations), residuals);
    polished(fits.collect(), again)
}

/// The best of what several starts came to, fitted to the end, and the basins that they are in.
fn polished(mut fits: Vec<Fit>, again: impl Fn(&Fit, usize) -> Option<Fit>) -> Option<(Fit, Vec<Basin>)> {
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = again(fits.first()?, 40)?;
    if !best.x.iter().all(|v| v.is_finite()) {
        return None;
    }
    // A start that is elsewhere still may only be slow.
    let others = fits.iter().skip(1).map(|other| match apart(&best, other) {
        true => again(other, FIRST).unwrap_or_else(|| other.clone()),
        false => best.clone(),
    });
    let all: Vec<Fit> = std::iter::once(best.clone()).chain(others).collect();
    Some((best, basins_of(&all)))
}
