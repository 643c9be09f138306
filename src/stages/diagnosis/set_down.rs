//! Hands that read the same before they lift and after they have set down, as free tools do.

use nalgebra::Vector3;

use super::tares::{BEFORE, CLEAR, SAMPLES};
use crate::capture::{Interaction, Kind, PhaseKind, Segmented};

/// Whether a hand reads the same before it lifts what it holds and after it has put that down. What a hand strains at is
/// mostly another load where it was set down again.
pub(super) fn puts_down_as_it_was(interaction: &Interaction, segmented: &Segmented) -> bool {
    let moved: Vec<_> = segmented
        .phases
        .iter()
        .filter(|p| matches!(p.kind, PhaseKind::Stick | PhaseKind::Slide))
        .collect();
    let (Some(first), Some(last), Some(stream)) = (moved.first(), moved.last(), interaction.force.as_ref()) else {
        return false;
    };
    let mean = |within: &dyn Fn(f64) -> bool| {
        let rows = stream.time.iter().zip(&stream.force);
        let own: Vec<&Vector3<f64>> = rows
            .filter(|(t, f)| within(**t) && f.iter().all(|x| x.is_finite()))
            .map(|(_, f)| f)
            .collect();
        let n = own.len();
        (n >= SAMPLES).then(|| (own.into_iter().sum::<Vector3<f64>>() / n as f64, 1.0 / n as f64))
    };
    let begin = stream.time.first().copied().unwrap_or(0.0);
    let until = begin + BEFORE * (first.start - begin);
    let end = stream.time.last().copied().unwrap_or(0.0);
    let after = end - BEFORE * (end - last.end);
    let both = mean(&|t| t <= until).zip(mean(&|t| t >= after));
    let noise = segmented.force_noise.unwrap_or(0.0);
    interaction.kind == Kind::Lift
        && both.is_some_and(|((a, va), (b, vb))| (a - b).norm() < CLEAR * noise * (va + vb).sqrt())
}
