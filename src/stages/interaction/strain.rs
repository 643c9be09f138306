//! Whether hands that hold already when their recordings begin read a load there or the sensor's tare: what moves resists against its way
//! and its acceleration, whichever way it goes, and a wrong tare is left of that.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::capture::{Interaction, Kind, Segmented};

/// Half the seconds over which it is told how a hand goes, and the share of its fastest from which on it goes.
const HALF: f64 = 0.1;
const GOES: f64 = 0.3;
/// What is left of the force, in squares, over what is left with the other tares, from which on down it tells them apart.
const CLEARLY: f64 = 0.7;
/// Fewest moments that tell.
const MOMENTS: usize = 20;

/// A moment in which a hand goes on.
struct Going {
    time: f64,
    force: Vector3<f64>,
    way: Vector3<f64>,
    acceleration: Vector3<f64>,
}

pub(super) fn pulls(interaction: &Interaction) -> bool {
    interaction.kind == Kind::Pull && interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin)
}

/// Whether the force of all pulls by hand is the simpler if nothing is taken off it than less what each read at its beginning, or less
/// `common` (N, of seconds).
pub(super) fn strains(held: &[(&Interaction, &Segmented)], common: Option<&dyn Fn(f64) -> Vector3<f64>>) -> bool {
    let all = || held.iter().filter(|(i, _)| pulls(i));
    let mut bare: Vec<Going> = Vec::new();
    let (mut own, mut alike): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
    for (interaction, segmented) in all() {
        let tare = segmented.force_tare.unwrap_or_default();
        for g in going(interaction) {
            own.push(g.force - tare);
            alike.push(g.force - common.map_or(tare, |c| c(g.time)));
            bare.push(g);
        }
    }
    let read: Vec<Vector3<f64>> = bare.iter().map(|g| g.force).collect();
    let left = |loads: &[Vector3<f64>]| left_of(&bare, loads);
    match (left(&read), left(&own), left(&alike)) {
        (Some(none), Some(own), Some(alike)) => bare.len() >= MOMENTS && none < CLEARLY * own.min(alike),
        _ => false,
    }
}

/// What is left of loads, N², without a part along the way and one along the acceleration, each the same share all over.
fn left_of(moving: &[Going], loads: &[Vector3<f64>]) -> Option<f64> {
    let mut normal = Matrix2::<f64>::zeros();
    let mut told = Vector2::<f64>::zeros();
    for (g, load) in moving.iter().zip(loads) {
        for (i, a) in [g.way, g.acceleration].iter().enumerate() {
            told[i] += a.dot(load);
            for (j, b) in [g.way, g.acceleration].iter().enumerate() {
                normal[(i, j)] += a.dot(b);
            }
        }
    }
    let shares = normal.try_inverse()? * told;
    Some(loads.iter().map(Vector3::norm_squared).sum::<f64>() - told.dot(&shares))
}

fn going(interaction: &Interaction) -> Vec<Going> {
    let Some((path, stream)) = interaction.tool_path.as_ref().zip(interaction.force.as_ref()) else {
        return Vec::new();
    };
    let place = |t: f64| {
        let next = path.time.partition_point(|x| *x < t);
        let (a, b) = (next.checked_sub(1)?, (next < path.time.len()).then_some(next)?);
        let share = (t - path.time[a]) / (path.time[b] - path.time[a]).max(1e-9);
        Some(path.position[a].coords.lerp(&path.position[b].coords, share))
    };
    let force = |t: f64| {
        let [from, to] = [t - 0.5 * HALF, t + 0.5 * HALF].map(|x| stream.time.partition_point(|y| *y < x));
        let rows = stream.force[from..to]
            .iter()
            .filter(|f| f.iter().all(|x| x.is_finite()));
        let (sum, count) = rows.fold((Vector3::zeros(), 0), |(sum, n), f| (sum + f, n + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let (Some(first), Some(last)) = (path.time.first(), path.time.last()) else {
        return Vec::new();
    };
    let steps = ((last - first) / HALF).max(0.0) as usize;
    let one = |k: usize| {
        let time = first + HALF * k as f64;
        let [before, now, after] = [place(time - HALF)?, place(time)?, place(time + HALF)?];
        Some(Going {
            time,
            force: force(time)?,
            way: (after - before) / (2.0 * HALF),
            acceleration: (after + before - 2.0 * now) / HALF.powi(2),
        })
    };
    let mut all: Vec<Going> = (0..=steps).filter_map(one).collect();
    let fastest = all.iter().map(|g| g.way.norm()).fold(0.0, f64::max);
    all.retain(|g| g.way.norm() > (GOES * fastest).max(1e-6));
    for g in &mut all {
        g.way.normalize_mut();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(k: u32, tare: Vector3<f64>) -> Going {
        let angle = 0.7 * f64::from(k);
        let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
        Going {
            time: f64::from(k),
            force: 2.0 * way + tare,
            way,
            acceleration: 0.1 * Vector3::new(-angle.sin(), angle.cos(), 0.0),
        }
    }

    #[test]
    fn a_tare_is_left_of_what_resists_its_way() {
        let moving: Vec<Going> = (0..40).map(|k| moment(k, Vector3::x() * 0.5)).collect();
        let read: Vec<Vector3<f64>> = moving.iter().map(|g| g.force).collect();
        let less: Vec<Vector3<f64>> = read.iter().map(|f| f - Vector3::x() * 0.5).collect();
        assert!(left_of(&moving, &less).expect("two ways") < 1e-9);
        assert!(left_of(&moving, &read).expect("two ways") > 5.0);
    }
}
