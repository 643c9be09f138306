//! Stiffness and damping of the spot that was pressed (Tanaka et al., "haptic vision", eq. 7 with damping).
//!
//! `F = k u + d u'` with the compression u. The tool's travel after touch is exact to microns but holds the
//! tool tip's own yielding; the tracked motion of the body's surface holds none of it but is noisy. Where the
//! body's frame gives way under the tool, it moves by a share r of the tool's travel, and the body's own
//! stiffness is that seen by the tool divided by r. Where it does not move, the compression is the tool's travel.

use nalgebra::{DMatrix, DVector, Vector3};

use super::evidence::{tare_of, tool_at};
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::math::{LinearFit, effective_samples, interpolate, median, robust_linear};

/// Stiffness and damping from one press.
#[derive(Clone, Debug)]
pub(super) struct Press {
    pub interaction: String,
    /// N/m.
    pub stiffness: (f64, f64),
    /// N·s/m, where it stands out.
    pub damping: Option<(f64, f64)>,
    /// The body's frame moved along with the tool.
    pub frame_moved: bool,
}

/// Rows while the tool is in contact: time, normal force, tool travel and its speed.
struct Rows {
    time: Vec<f64>,
    force: Vec<f64>,
    travel: Vec<f64>,
    speed: Vec<f64>,
}

fn rows_of(interaction: &Interaction, segmented: &Segmented, direction: &Vector3<f64>) -> Option<Rows> {
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let tare = tare_of(interaction, segmented);
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let along: Vec<f64> = tool.position.iter().map(|p| p.coords.dot(direction)).collect();
    let mut rows = Rows {
        time: Vec::new(),
        force: Vec::new(),
        travel: Vec::new(),
        speed: Vec::new(),
    };
    for i in 0..stream.time.len() {
        let t = stream.time[i];
        if t < stick.start || t > stick.end || !stream.force[i].x.is_finite() {
            continue;
        }
        let (Some(p), Some(fit)) = (
            tool_at(tool, t),
            crate::math::local_quadratic(&tool.time, &along, t, 0.015),
        ) else {
            continue;
        };
        rows.time.push(t);
        rows.force.push((stream.force[i] - tare.force).dot(direction));
        rows.travel.push(p.coords.dot(direction));
        rows.speed.push(fit.velocity);
    }
    (rows.time.len() >= 20).then_some(rows)
}

/// Force against travel and speed over rows that carry a real load.
fn regress(rows: &Rows, with_damping: bool, least: f64) -> Option<(LinearFit, f64)> {
    let used: Vec<usize> = (0..rows.time.len()).filter(|&i| rows.force[i] > least).collect();
    let columns = if with_damping { 3 } else { 2 };
    let a = DMatrix::from_fn(used.len(), columns, |i, j| match j {
        0 => 1.0,
        1 => rows.travel[used[i]] - rows.travel[0],
        _ => rows.speed[used[i]],
    });
    let b = DVector::from_iterator(used.len(), used.iter().map(|&i| rows.force[i]));
    let fit = robust_linear(&a, &b)?;
    let memory = used.len() as f64 / effective_samples(fit.residuals.as_slice());
    Some((fit, memory.max(1.0).sqrt()))
}

/// By how much the body's frame moves per metre of tool travel, with its standard deviation.
fn share_of_frame(
    interaction: &Interaction,
    target: &str,
    direction: &Vector3<f64>,
    rows: &Rows,
) -> Option<(f64, f64)> {
    let track = interaction.tracks.get(target).filter(|t| t.len() > 8)?;
    let (start, end) = (rows.time[0], rows.time[rows.time.len() - 1]);
    let depth: Vec<f64> = track.position.iter().map(|p| p.coords.dot(direction)).collect();
    let rest: Vec<f64> = (0..track.len())
        .filter(|&i| track.time[i] < start)
        .map(|i| depth[i])
        .collect();
    let home = median(&rest);
    let used: Vec<usize> = (0..track.len())
        .filter(|&i| track.time[i] >= start && track.time[i] <= end && depth[i].is_finite())
        .collect();
    let contact = rows.travel[0];
    let travel = |i: usize| interpolate(&rows.time, &rows.travel, track.time[i]).map_or(f64::NAN, |x| x - contact);
    // The rows at rest pin the start of the line, since contact began at zero travel.
    let mut points: Vec<(f64, f64)> = used
        .iter()
        .map(|&i| (travel(i), depth[i]))
        .filter(|p| p.0.is_finite())
        .collect();
    points.extend(rest.iter().filter(|d| d.is_finite()).map(|d| (0.0, *d)));
    home?;
    let a = DMatrix::from_fn(points.len(), 2, |i, j| if j == 0 { 1.0 } else { points[i].0 });
    let b = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let fit = robust_linear(&a, &b)?;
    Some((fit.x[1], fit.sd(1)))
}

/// Stiffness and damping from one press; `None` where nothing was squeezed.
pub(super) fn press_of(
    interaction: &Interaction,
    segmented: &Segmented,
    target: &str,
    down: &Vector3<f64>,
) -> Option<Press> {
    let direction = pressing_direction(interaction, segmented).unwrap_or(*down);
    let rows = rows_of(interaction, segmented, &direction)?;
    let largest = crate::math::quantile(&rows.force, 0.95)?;
    let noise = segmented.force_noise.unwrap_or(0.0);
    if largest < 10.0 * noise {
        return None;
    }
    let least = (0.1 * largest).max(4.0 * noise);
    let (fit, memory) = regress(&rows, true, least)?;
    let clear = fit.x[2] > 3.0 * fit.sd(2) * memory;
    let (fit, memory) = if clear {
        (fit, memory)
    } else {
        regress(&rows, false, least)?
    };
    let seen = (fit.x[1], fit.sd(1) * memory);
    if !(seen.0 > 3.0 * seen.1) {
        return None;
    }
    let moved = share_of_frame(interaction, target, &direction, &rows).filter(|(r, sd)| *r > 0.3 && *r > 4.0 * sd);
    let (share, share_sd) = match moved {
        Some(share) => most_of_the_travel(share),
        None => (1.0, 0.0),
    };
    let relative = ((seen.1 / seen.0).powi(2) + (share_sd / share).powi(2) + 0.003_f64.powi(2)).sqrt();
    let stiffness = seen.0 / share;
    Some(Press {
        interaction: interaction.name.clone(),
        stiffness: (stiffness, stiffness * relative),
        damping: clear.then(|| (fit.x[2] / share, fit.sd(2) * memory / share)),
        frame_moved: moved.is_some(),
    })
}

/// The share of the tool's travel that is the body's: as measured, but it cannot exceed one, and tool tips are
/// made stiff: prior 1 minus a half-normal of 3 %. Mean and sd of the product with the measurement, on a grid.
fn most_of_the_travel(measured: (f64, f64)) -> (f64, f64) {
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for i in 0..=700 {
        let r = 1.0 - 1e-3 * i as f64;
        let z = (r - measured.0) / measured.1.max(1e-3);
        // Heavy tail on the prior, so that a soft tip that is really seen prevails.
        let prior = 1.0 / (1.0 + ((1.0 - r) / 0.03).powi(2));
        let weight = prior * (-0.5 * z * z).exp();
        total += weight;
        first += weight * r;
        second += weight * r * r;
    }
    if total <= 0.0 {
        return (measured.0.min(1.0), measured.1);
    }
    let mean = first / total;
    (mean, (second / total - mean * mean).max(0.0).sqrt())
}

/// The direction of the mean force under load.
fn pressing_direction(interaction: &Interaction, segmented: &Segmented) -> Option<Vector3<f64>> {
    let stream = interaction.force.as_ref()?;
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let tare = tare_of(interaction, segmented);
    let mean = super::evidence::mean_wrench(stream, stick.start, stick.end, &tare)?;
    mean.force.try_normalize(1e-6)
}
