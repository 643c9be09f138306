//! Where tools really were: their recorded ways are set right by when their force was felt.
//!
//! The place of a tool's tip is often known less well than that of the thing. A way is moved by the least shift with which the tool
//! touches when the force begins: out of the face, or up to it. A force begins to be felt a little late (contacts and arms give), so
//! that the thing has gone a part of the way by then; how far, the ends of the touches that were fitted tell, where the tool still
//! pushes and must touch the thing as it was tracked there.

use nalgebra::Vector3;

use super::recorded::{Recorded, TIP};
use crate::base::Result;
use crate::export::{Gap, Hold, gap, meeting};
use crate::twin::Model;

/// Share of the force that is reached in the end above which the tool is felt.
const FELT: f64 = 0.2;
/// The same for a press: what the noise of a sensor hardly reaches three times running.
const TOUCHED: f64 = 0.03;
/// Share of that force with which a tool still pushes at the end of its way, and the time of that end, s.
const PUSHES: f64 = 0.5;
const END: f64 = 0.05;
/// Touches from which on the lateness of the force is learnt, and standard errors by which it must differ from none.
const FEWEST: usize = 5;
const CLEAR: f64 = 2.0;

/// Moves the tools' ways of all touches that would meet the thing more than a millimetre before or after the force says that
/// they did. The way of a press is always moved so, along its heading, since its depth counts.
pub(super) fn set_right(model: &Model, touches: &mut [Recorded]) -> Result<()> {
    let mut felt: Vec<(usize, Gap)> = Vec::new();
    let mut late = Vec::new();
    for (index, touch) in touches.iter_mut().enumerate() {
        let share = if touch.press { TOUCHED } else { FELT };
        let Some(onset) = onset(&touch.force, share).filter(|_| touch.trial.hold == Hold::Touch) else {
            continue;
        };
        if touch.press {
            let shift = meeting(model, &touch.trial, onset)?;
            touch.move_by(shift.unwrap_or_default());
        } else if let Some(first) = gap(model, &touch.trial, onset)? {
            if !touch.held_out {
                late.extend(end_gap(model, touch)?.map(|last| last.distance - first.distance));
            }
            felt.push((index, first));
        }
    }
    let late = clear_mean(&late);
    for (index, first) in felt {
        let shift = -first.out * (first.distance + late);
        if shift.norm() > TIP {
            touches[index].move_by(shift);
        }
    }
    Ok(())
}

impl Recorded {
    fn move_by(&mut self, shift: Vector3<f64>) {
        for pose in &mut self.trial.path {
            pose.0.translation.vector += shift;
        }
        self.shifted = Some(shift.norm()).filter(|s| *s > TIP);
    }
}

/// The gap at the end of a way, where the tool still pushes there.
fn end_gap(model: &Model, touch: &Recorded) -> Result<Option<Gap>> {
    let Some(end) = touch.trial.time.last().copied() else {
        return Ok(None);
    };
    let last: Vec<f64> = touch
        .force
        .iter()
        .filter(|(t, _)| (*t - end).abs() < END)
        .map(|(_, f)| f.norm())
        .collect();
    let pushes = high(&touch.force).is_some_and(|h| last.iter().all(|f| *f > PUSHES * h));
    if last.is_empty() || !pushes {
        return Ok(None);
    }
    let mut trial = touch.trial.clone();
    trial.start.insert(trial.target.clone(), touch.after);
    gap(model, &trial, end)
}

/// The mean, where it is clear of nothing; else nothing.
fn clear_mean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n.max(1.0);
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let error = (square / (n - 1.0).max(1.0) / n.max(1.0)).sqrt();
    if values.len() < FEWEST || mean.abs() < CLEAR * error {
        return 0.0;
    }
    mean
}

/// What the force hardly exceeds, N.
fn high(force: &[(f64, Vector3<f64>)]) -> Option<f64> {
    let mut sizes: Vec<f64> = force.iter().map(|(_, f)| f.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() * 9 / 10).copied()
}

/// When the tool begins to be felt, s: readings over a hundredth of a second (three at least) together above a share of what
/// is reached in the end.
fn onset(force: &[(f64, Vector3<f64>)], share: f64) -> Option<f64> {
    let high = high(force)?;
    let felt = |rows: &[(f64, Vector3<f64>)]| rows.iter().all(|(_, f)| f.norm() > share * high);
    force.windows(3).find(|w| felt(w)).map(|w| w[0].0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_lateness_that_is_clear_counts() {
        assert_eq!(clear_mean(&[1e-3; 4]), 0.0);
        assert_eq!(clear_mean(&[1e-3, -1e-3, 2e-3, -2e-3, 1e-4]), 0.0);
        let mean = clear_mean(&[0.6e-3, 0.8e-3, 0.7e-3, 0.9e-3, 0.5e-3]);
        assert!((mean - 0.7e-3).abs() < 1e-12, "{mean}");
    }
}
