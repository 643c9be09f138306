//! Friction from coasting: a body that slides on after the tool has left it is slowed by `mu g` alone.
//!
//! Output error: the slide is simulated from an unknown state at release and compared with the track, so no speed is
//! taken from differences. No force enters: with the force of the push this parts mass from friction.

use std::sync::Arc;

use nalgebra::{DVector, Point3, Rotation2, Vector2, Vector3};

use super::evidence::{tare_of, tool_at};
use super::facts::Ground;
use crate::capture::{Interaction, PoseStream, Segmented};
use crate::math::{Fit, Loss, Settings, effective_samples, levenberg_marquardt, median};
use crate::physics::{LimitSurface, PlaneMotion, Simulator, Slider};

/// Kinetic friction from one coasting.
#[derive(Clone, Debug)]
pub(super) struct Coast {
    pub interaction: String,
    pub kinetic: (f64, f64),
}

/// What is taken of the shape: centroid (link frame) with torsional radius and radius of gyration, m.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub centre: Point3<f64>,
    pub torsional_radius: f64,
    pub gyration_radius: f64,
    /// How far the centre of mass may be from the centroid in the plane, m (1 sd per axis).
    pub spread: f64,
    /// Height of the centroid above the support, m.
    pub height: f64,
    /// Friction under an even pressure, axes of [`Plane::of`] the normal in the link frame; none where no underside is known.
    pub surface: Option<Arc<LimitSurface>>,
}

/// Share of the largest force below which the tool counts as gone.
const GONE: f64 = 0.03;
/// Force is averaged over this span before it is judged, s.
const SPAN: f64 = 8e-3;
/// Distance that must be coasted, in standard deviations of the track.
const CLEAR: f64 = 8.0;
/// Log standard deviation of the ratio of torsional radius to radius of gyration.
const RATIO: f64 = 0.3;
/// Relative doubt beyond which a coasting says nothing.
const WORTH: f64 = 0.25;
/// Forces above this multiple of the noise cannot go on without being seen.
const FELT: f64 = 15.0;
/// Share of the body's way that the tool may still go after it has let go.
const FOLLOWS: f64 = 0.7;
/// Time at rest afterwards that is compared as well, s.
const REST: f64 = 0.15;

/// Samples of the coasting: time and plane pose of the centre.
pub(super) struct Run {
    pub time: Vec<f64>,
    pub position: Vec<Vector2<f64>>,
    pub heading: Vec<f64>,
    pub noise: (f64, f64),
}

/// Share of gravity along the support from which on nothing is read off a coasting.
const SLOPE: f64 = 0.02;

/// Whether the weight pulls along the support.
pub(super) fn slopes(ground: &Ground) -> bool {
    ground.plane.flat(&ground.gravity).norm() > SLOPE * ground.gravity.norm()
}

/// Friction from the end of a push; `None` where the body stopped with the tool.
pub(super) fn coast_of(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    form: f64,
) -> Option<Coast> {
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let released = release(interaction, segmented)?;
    if slopes(ground) {
        return None;
    }
    let run = run_of(track, segmented, ground, &shape.centre, released)?;
    if hardly_felt(interaction, segmented) && follows(interaction, ground, &run) {
        return None;
    }
    let g = -ground.gravity.dot(&ground.plane.normal);
    let fit = fit(&run, shape, g)?;
    let memory = run.time.len() as f64 / effective_samples(fit.residuals.as_slice()).max(1.0);
    let misfit = 2.0 * fit.cost / (fit.residuals.len() as f64 - 9.0).max(1.0);
    let own = fit.sd(0) * (misfit.max(1.0) * memory.clamp(1.0, 4.0)).sqrt();
    (own < WORTH && misfit < 25.0).then(|| Coast {
        interaction: interaction.name.clone(),
        kinetic: (fit.x[0].exp(), fit.x[0].exp() * own.hypot(form)),
    })
}

/// When the tool let go for good, s.
fn release(interaction: &Interaction, segmented: &Segmented) -> Option<f64> {
    let stream = interaction.force.as_ref()?;
    let tare = tare_of(interaction, segmented).force;
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let width = ((SPAN * rate).round() as usize).max(1);
    let size: Vec<f64> = stream.force.iter().map(|f| (f - tare).norm()).collect();
    let smooth: Vec<f64> = size.windows(width).map(|w| median(w).unwrap_or(0.0)).collect();
    let largest = smooth.iter().copied().fold(0.0, f64::max);
    let noise = segmented.force_noise.unwrap_or(0.02);
    let last = smooth.iter().rposition(|f| *f > (GONE * largest).max(4.0 * noise))?;
    stream.time.get(last + width).copied()
}

/// Whether what is felt while it is pushed is so near the noise that the sensor would not show it go on.
fn hardly_felt(interaction: &Interaction, segmented: &Segmented) -> bool {
    let tare = tare_of(interaction, segmented).force;
    let noise = segmented.force_noise.unwrap_or(0.02);
    let all = interaction.force.iter().flat_map(|stream| &stream.force);
    let felt: Vec<f64> = all.map(|f| (f - tare).norm()).filter(|f| *f > 4.0 * noise).collect();
    median(&felt).is_none_or(|f| f < FELT * noise)
}

/// Whether the tool went along with the body after the force was gone: what drags so little that it drowns in the noise
/// of the sensor is pushed on without being felt.
fn follows(interaction: &Interaction, ground: &Ground, run: &Run) -> bool {
    let ends = || {
        Some((
            *run.position.first()?,
            *run.position.last()?,
            *run.time.first()?,
            *run.time.last()?,
        ))
    };
    let moved = || {
        let (from, to, start, end) = ends()?;
        let path = interaction.tool_path.as_ref()?;
        let tool = |t: f64| tool_at(path, t).map(|p| ground.plane.flat(&p.coords));
        let (way, home) = (to - from, tool(start)?);
        // Its farthest: it may draw back before the end.
        let steps = (0..=20).filter_map(|k| tool(start + (end - start) * f64::from(k) / 20.0));
        let along = steps.map(|p| (p - home).dot(&way) / way.norm_squared().max(1e-12));
        Some(along.fold(0.0, f64::max))
    };
    moved().is_some_and(|share| share > FOLLOWS)
}

/// The track from release to a little after it stands; `None` where it went no clear way.
pub(super) fn run_of(
    track: &PoseStream,
    segmented: &Segmented,
    ground: &Ground,
    centre: &Point3<f64>,
    released: f64,
) -> Option<Run> {
    let noise = (
        segmented.position_noise.unwrap_or(3e-4).max(2e-5),
        segmented.rotation_noise.unwrap_or(3e-3).max(2e-4),
    );
    let mut run = Run {
        time: Vec::new(),
        position: Vec::new(),
        heading: Vec::new(),
        noise,
    };
    let rows: Vec<usize> = (0..track.len())
        .filter(|&i| track.time[i] >= released && track.pose(i).is_some())
        .collect();
    let home = track.pose(*rows.first()?)?.0;
    for i in rows {
        let pose = track.pose(i)?.0;
        run.time.push(track.time[i]);
        run.position.push(ground.plane.flat(&(pose * centre).coords));
        let turn: Vector3<f64> = (pose.rotation * home.rotation.inverse()).scaled_axis();
        run.heading.push(turn.dot(&ground.plane.normal));
    }
    let tail = run.position.len().checked_sub(5)?;
    let axis = |k: usize| median(&run.position[tail..].iter().map(|p| p[k]).collect::<Vec<_>>());
    let end = Vector2::new(axis(0)?, axis(1)?);
    let stands = (0..run.time.len())
        .rev()
        .find(|&i| (run.position[i] - end).norm() > 4.0 * noise.0)?;
    let until = run.time[stands] + REST;
    let kept = run.time.partition_point(|t| *t <= until);
    run.time.truncate(kept);
    run.position.truncate(kept);
    run.heading.truncate(kept);
    let way = (run.position[0] - end).norm();
    (way > CLEAR * noise.0 && stands >= 4).then_some(run)
}

/// Log friction, the state at release (position, velocity, heading, spin), the ratio of radii, and how far the centre of
/// mass is from the centroid (axes of the plane turned with the body): a body that spins carries its centroid around it.
fn fit(run: &Run, shape: &Shape, g: f64) -> Option<Fit> {
    let end = run.position[run.position.len() - 1];
    let way = run.position[0] - end;
    let spans = run.time[run.time.len() - 1] - REST - run.time[0];
    let speed = -2.0 * way / spans.max(0.01);
    let mu = speed.norm() / (g * spans.max(0.01));
    let turned = run.heading[run.heading.len() - 1] - run.heading[0];
    let start = DVector::from_vec(vec![
        mu.clamp(0.03, 2.0).ln(),
        run.position[0].x,
        run.position[0].y,
        speed.x,
        speed.y,
        run.heading[0],
        2.0 * turned / spans.max(0.01),
        0.0,
        0.0,
        0.0,
    ]);
    let steps = DVector::from_vec(vec![1e-4, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5, 1e-4, 1e-3, 1e-5, 1e-5]);
    let residuals = |x: &DVector<f64>| {
        let slider = Slider {
            deceleration: x[0].exp() * g,
            torsional_radius: shape.torsional_radius * x[7].exp(),
            gyration_radius: shape.gyration_radius,
        };
        let off = Vector2::new(x[8], x[9]);
        let state = PlaneMotion {
            position: Vector2::new(x[1], x[2]) + Rotation2::new(x[5]) * off,
            velocity: Vector2::new(x[3], x[4]),
            heading: x[5],
            spin: x[6],
        };
        let path = slider.simulate(&state, &(), run.time[0], &run.time);
        let mut out = vec![x[7] / RATIO, (x[0] - f64::ln(0.3)) / 1.5];
        out.extend([off.x / shape.spread, off.y / shape.spread]);
        for (i, seen) in path.iter().enumerate() {
            let centroid = seen.position - Rotation2::new(seen.heading) * off;
            let miss = (run.position[i] - centroid) / run.noise.0;
            out.extend([miss.x, miss.y, (run.heading[i] - seen.heading) / run.noise.1]);
        }
        DVector::from_vec(out)
    };
    let settings = Settings {
        loss: Loss::Huber(2.5),
        iterations: 40,
        tolerance: 1e-7,
    };
    let fit = levenberg_marquardt(&start, &steps, settings, residuals)?;
    fit.x.iter().all(|v| v.is_finite()).then_some(fit)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::capture::Kind;
    use crate::stages::estimation::push::Plane;

    /// A tool that goes 40 mm a second along x for `lasts` seconds.
    fn pushed_for(lasts: f64) -> Interaction {
        let time: Vec<f64> = (0..500).map(|i| 0.002 * f64::from(i)).collect();
        let at = |t: &f64| Point3::new(0.04 * t.min(lasts), 0.0, 0.02);
        Interaction {
            name: "push".into(),
            kind: Kind::Push,
            action: None,
            tool_name: None,
            tool: None,
            target: None,
            force: None,
            tool_path: Some(PoseStream {
                position: time.iter().map(at).collect(),
                rotation: vec![None; time.len()],
                time,
            }),
            support_path: None,
            tracks: BTreeMap::new(),
            frames: None,
            held_out: false,
        }
    }

    #[test]
    fn what_the_tool_follows_does_not_coast() {
        let ground = Ground {
            gravity: -9.81 * Vector3::z(),
            plane: Plane::of(Vector3::z()),
            point: Point3::origin(),
        };
        let time: Vec<f64> = (0..90).map(|i| 0.01 * f64::from(i)).collect();
        let run = Run {
            position: time
                .iter()
                .map(|t| ground.plane.flat(&Vector3::new(0.04 * t, 0.0, 0.0)))
                .collect(),
            heading: vec![0.0; time.len()],
            noise: (3e-4, 3e-3),
            time,
        };
        assert!(follows(&pushed_for(0.9), &ground, &run));
        assert!(!follows(&pushed_for(0.1), &ground, &run));
    }
}
