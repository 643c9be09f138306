//! Whether what hangs on the tool weighs the same for as long as it is held.

use nalgebra::Vector3;

use super::facts::subject;
use super::lift::{aloft, height};
use crate::capture::{Interaction, Segmented};
use crate::math::local_quadratic;

/// Seconds of a block of which the mean is taken, and fewest blocks and readings of one.
const BLOCK: f64 = 0.2;
const FEWEST: (usize, usize) = (6, 3);
/// Half the span over which the acceleration is taken, s, and that above which nothing is weighed, m/s².
const SPAN: f64 = 0.12;
const STILL: f64 = 0.4;
/// Neighbouring blocks err alike: standard deviations are this many times as large.
const ALIKE: f64 = 1.5;

/// How the weight of what was held changed while it was.
#[derive(Clone, Debug)]
pub struct Heavier {
    /// What was held.
    pub link: String,
    /// N/s, with its standard deviation.
    pub rate: (f64, f64),
    /// Seconds for which it was told.
    pub lasted: f64,
    /// Mean, N.
    pub weight: f64,
}

/// That of one lift; nothing where it was held too shortly, or shaken all the time.
pub fn heavier(interaction: &Interaction, segmented: &Segmented, gravity: &Vector3<f64>) -> Option<Heavier> {
    let stream = interaction.force.as_ref()?;
    let target = subject(interaction, segmented)?;
    let g = gravity.norm();
    let up = -gravity.try_normalize(1e-9)?;
    let stretch = aloft(interaction, segmented, &up, target)?;
    let (time, height) = height(interaction, &up, target);
    let tare = segmented.force_tare.unwrap_or_default();
    let carried = |i: usize| {
        let t = stream.time[i];
        let a = local_quadratic(&time, &height, t, SPAN)?.acceleration;
        let weight = (stream.force[i] - tare).dot(&up) / (1.0 + a / g);
        (a.abs() < STILL && weight.is_finite()).then_some((t, weight))
    };
    let within = (0..stream.time.len()).filter(|i| (stretch.start..=stretch.end).contains(&stream.time[*i]));
    let rows: Vec<(f64, f64)> = within.filter_map(carried).collect();
    told(target, &rows)
}

fn told(link: &str, rows: &[(f64, f64)]) -> Option<Heavier> {
    let begin = rows.first()?.0;
    let block = |r: &(f64, f64)| ((r.0 - begin) / BLOCK) as usize;
    let means: Vec<(f64, f64)> = rows
        .chunk_by(|a, b| block(a) == block(b))
        .filter(|own| own.len() >= FEWEST.1)
        .map(|own| {
            let n = own.len() as f64;
            (
                own.iter().map(|r| r.0).sum::<f64>() / n,
                own.iter().map(|r| r.1).sum::<f64>() / n,
            )
        })
        .collect();
    if means.len() < FEWEST.0 {
        return None;
    }
    let n = means.len() as f64;
    let middle = means.iter().map(|m| m.0).sum::<f64>() / n;
    let weight = means.iter().map(|m| m.1).sum::<f64>() / n;
    let spread: f64 = means.iter().map(|m| (m.0 - middle).powi(2)).sum();
    let rate = means.iter().map(|m| (m.0 - middle) * (m.1 - weight)).sum::<f64>() / spread;
    let left: f64 = means
        .iter()
        .map(|m| (m.1 - weight - rate * (m.0 - middle)).powi(2))
        .sum();
    let sd = ALIKE * (left / (n - 2.0) / spread).sqrt();
    Some(Heavier {
        link: link.to_owned(),
        rate: (rate, sd),
        lasted: means[means.len() - 1].0 - means[0].0,
        weight,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaks_gets_lighter_and_what_does_not_stays() {
        let held = |rate: f64| -> Vec<(f64, f64)> {
            let wobble = |i: u32| 0.02 * (f64::from(i) * 12.9898).sin();
            let one = |i: u32| (0.01 * f64::from(i), 4.0 + rate * 0.01 * f64::from(i) + wobble(i));
            (0..300).map(one).collect()
        };
        let leaks = told("bag", &held(-0.1)).expect("a rate");
        assert!((leaks.rate.0 + 0.1).abs() < 0.01 && leaks.rate.1 < 0.01, "{leaks:?}");
        let sound = told("bag", &held(0.0)).expect("a rate");
        assert!(sound.rate.0.abs() < 4.0 * sound.rate.1.max(1e-3), "{sound:?}");
        assert!(told("bag", &held(0.0)[..100]).is_none());
    }
}
