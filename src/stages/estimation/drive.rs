//! A slide that is driven hard enough for its inertia to show: moving mass, damping, friction and a constant force
//! from one linear balance without any derivative of the track.
//!
//! Weak form: `F = M q'' + b q' + fc sgn(q') + f0` multiplied by smooth bumps `phi` of compact support and integrated by
//! parts, `∫ phi F = M ∫ phi'' q - b ∫ phi' q + fc ∫ phi sgn(q') + f0 ∫ phi` (Shinbrot's modulating functions, 1957).
//! Intervals come from leaving out stretches of the recording, so friction that changes on the way widens them.

use nalgebra::{DMatrix, DVector, Vector3};

use super::evidence::tare_of;
use super::facts::subject;
use super::joint_led::held_at_first;
use crate::capture::{Capture, Interaction, Segmented};
use crate::math::{interpolate, local_quadratic, robust_linear, t_quantile};
use crate::twin::{Joint, JointKind, Model};

/// Half width of a bump, s, and the slowest force and track that can be multiplied by it, Hz.
const HALF: f64 = 0.05;
const RATE: f64 = 400.0;
/// Half the span over which the direction of motion is read, s.
const READ: f64 = 7e-3;
/// Stretches that are left out in turn.
const STRETCHES: usize = 12;
/// The moving mass must stand out by this many standard deviations for the balance to be believed.
const CLEAR: f64 = 20.0;

/// What a driven slide says: value, standard deviation and half the 95 % interval.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    /// kg.
    pub mass: [f64; 3],
    /// N·s/m.
    pub damping: [f64; 3],
    /// N.
    pub friction: [f64; 3],
    /// N.
    pub constant: [f64; 3],
    pub from: Vec<String>,
}

struct Rows {
    a: Vec<[f64; 4]>,
    b: Vec<f64>,
}

/// The balance of a prismatic joint whose child is driven; `None` where its inertia does not show.
pub(super) fn drive_of(capture: &Capture, segmented: &[Segmented], joint: &Joint, model: &Model) -> Option<Drive> {
    if joint.kind != JointKind::Prismatic || model.twin.link(&joint.child)?.mass.is_some() {
        return None;
    }
    let (mut rows, mut from) = (
        Rows {
            a: Vec::new(),
            b: Vec::new(),
        },
        Vec::new(),
    );
    for interaction in capture.fitted() {
        let Some(cut) = segmented.iter().find(|s| s.interaction == interaction.name) else {
            continue;
        };
        if subject(interaction, cut) == Some(joint.child.as_str())
            && add_rows(interaction, cut, joint, &mut rows).is_some()
        {
            from.push(interaction.name.clone());
        }
    }
    solve(&rows, from)
}

/// Weak balances of one interaction, half a bump apart.
fn add_rows(interaction: &Interaction, cut: &Segmented, joint: &Joint, rows: &mut Rows) -> Option<()> {
    let (stream, track) = (interaction.force.as_ref()?, interaction.tracks.get(&joint.child)?);
    let rate = |time: &[f64]| (time.len() as f64 - 1.0) / (time[time.len() - 1] - time[0]);
    let stands = interaction.tracks.get(&joint.parent).is_none_or(|p| {
        let still = |i: &nalgebra::Point3<f64>| (i - p.position[0]).norm() < 1e-4;
        p.position.iter().filter(|x| x.x.is_finite()).all(still)
    });
    if track.len() < 200 || stream.time.len() < 200 || rate(&track.time) < RATE || rate(&stream.time) < RATE || !stands
    {
        return None;
    }
    let axis = Vector3::from(joint.axis.value);
    let way: Vec<f64> = track.position.iter().map(|p| p.coords.dot(&axis)).collect();
    let tare = if held_at_first(interaction, cut) {
        Vector3::zeros()
    } else {
        tare_of(interaction, cut).force
    };
    let along: Vec<f64> = stream.force.iter().map(|f| (f - tare).dot(&axis)).collect();
    let way: Vec<f64> = stream
        .time
        .iter()
        .map(|t| interpolate(&track.time, &way, *t).unwrap_or(f64::NAN))
        .collect();
    let sign: Vec<f64> = stream
        .time
        .iter()
        .map(|t| local_quadratic(&stream.time, &way, *t, READ).map_or(f64::NAN, |f| f.velocity.signum()))
        .collect();
    let mut centre = stream.time[0] + HALF;
    while centre + HALF < stream.time[stream.time.len() - 1] {
        let (row, right) = weak(&stream.time, &way, &sign, &along, centre);
        if right.is_finite() && row.iter().all(|x| x.is_finite()) {
            rows.a.push(row);
            rows.b.push(right);
        }
        centre += 0.5 * HALF;
    }
    Some(())
}

/// One balance: the bump `(1 - s²)⁴` about `centre`, integrated by the trapezoid rule.
fn weak(time: &[f64], way: &[f64], sign: &[f64], force: &[f64], centre: f64) -> ([f64; 4], f64) {
    let from = time.partition_point(|t| *t < centre - HALF);
    let to = time.partition_point(|t| *t <= centre + HALF).min(time.len() - 1);
    let (mut row, mut right) = ([0.0; 4], 0.0);
    for i in from.max(1)..to {
        let s = ((time[i] - centre) / HALF).clamp(-1.0, 1.0);
        let (u, h) = (1.0 - s * s, 0.5 * (time[i + 1] - time[i - 1]));
        let (phi, first) = (u.powi(4), -8.0 * s * u.powi(3) / HALF);
        let second = (48.0 * s * s * u * u - 8.0 * u.powi(3)) / (HALF * HALF);
        // Both derivatives of a bump integrate to zero: a constant way is taken off against rounding.
        let q = way[i] - way[from];
        row[0] += h * second * q;
        row[1] -= h * first * q;
        row[2] += h * phi * sign[i];
        row[3] += h * phi;
        right += h * phi * force[i];
    }
    (row, right)
}

fn solve(rows: &Rows, from: Vec<String>) -> Option<Drive> {
    let n = rows.b.len();
    if n < 4 * STRETCHES {
        return None;
    }
    let without = |stretch: usize| {
        let used: Vec<usize> = (0..n).filter(|i| i * STRETCHES / n != stretch).collect();
        let a = DMatrix::from_fn(used.len(), 4, |i, j| rows.a[used[i]][j]);
        robust_linear(&a, &DVector::from_iterator(used.len(), used.iter().map(|i| rows.b[*i])))
    };
    let whole = without(STRETCHES)?;
    let parts: Vec<DVector<f64>> = (0..STRETCHES).filter_map(|s| Some(without(s)?.x)).collect();
    let count = parts.len() as f64;
    let read = |k: usize| {
        let mean = parts.iter().map(|p| p[k]).sum::<f64>() / count;
        let spread = parts.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>();
        let sd = ((count - 1.0) / count * spread).sqrt();
        [whole.x[k], sd, sd * t_quantile(0.975, count - 1.0)]
    };
    let drive = Drive {
        mass: read(0),
        damping: read(1),
        friction: read(2),
        constant: read(3),
        from,
    };
    (parts.len() == STRETCHES && drive.mass[0] > CLEAR * drive.mass[1] && drive.friction[0] > 0.0).then_some(drive)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driven_slide_gives_mass_damping_and_friction() {
        let (mass, damping, friction, constant) = (20.0, 60.0, 8.0, -1.5);
        let time: Vec<f64> = (0..12000).map(|i| f64::from(i) * 1e-3).collect();
        let way = |t: f64| 0.1 * (1.0 - (2.0 * t).cos()) + 0.02 * (7.0 * t).sin();
        let speed = |t: f64| 0.2 * (2.0 * t).sin() + 0.14 * (7.0 * t).cos();
        let gain = |t: f64| 0.4 * (2.0 * t).cos() - 0.98 * (7.0 * t).sin();
        let load = |t: f64| mass * gain(t) + damping * speed(t) + friction * speed(t).signum() + constant;
        let ways: Vec<f64> = time.iter().map(|t| way(*t)).collect();
        let signs: Vec<f64> = time.iter().map(|t| speed(*t).signum()).collect();
        let loads: Vec<f64> = time.iter().map(|t| load(*t)).collect();
        let mut rows = Rows {
            a: Vec::new(),
            b: Vec::new(),
        };
        for k in 2..470 {
            let (row, right) = weak(&time, &ways, &signs, &loads, 0.025 * f64::from(k));
            rows.a.push(row);
            rows.b.push(right);
        }
        let found = solve(&rows, Vec::new()).expect("solved");
        for (value, truth) in [
            (found.mass, mass),
            (found.damping, damping),
            (found.friction, friction),
            (found.constant, constant),
        ] {
            assert!((value[0] / truth - 1.0).abs() < 2e-3, "{value:?} {truth}");
        }
    }
}
