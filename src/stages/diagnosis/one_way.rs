//! Friction that is larger one way than back, as of a nap or a ratchet, where a slope was named.
//!
//! To touches of one load both cost as much along their ways. But a slope pulls the same way whatever moves, so that a tool has to hold
//! against it across the way too, or what it pushes slips aside; friction is always straight against the slip. So the part of the force
//! across the slip tells them apart, whatever the contact is: it is what gravity adds, and nothing of the friction.

use nalgebra::{Vector2, Vector3};

use super::pushes::Pushes;
use super::shaking::stretch;
use crate::capture::{Capture, Interaction};
use crate::twin::{Evidence, Finding, Model};

/// Shares of a touch at its beginning and its end that are left out, and pieces that the rest is judged in.
const ENDS: [f64; 2] = [0.15, 0.1];
const PIECES: usize = 4;
/// Shortest way of a piece, m, and seconds over which a place is averaged.
const SHORTEST: f64 = 3e-3;
const SMOOTH: f64 = 0.05;
/// How well the direction of a force is read beside the way, rad, and as a share of the angle by which what is pushed turns meanwhile.
const ASIDE: [f64; 2] = [0.02, 0.5];
/// Fewest touches; the share of what a slope would add that is none; and standard deviations from there to half of it.
const FEWEST: usize = 6;
const NONE: f64 = 0.3;
const CLEAR: f64 = 3.5;
/// What is left of the odds of a slope that nothing across bears out.
const REFUTED: f64 = 0.3;

/// What a touch has across its slip, N: as it was read with how well, and as the slope has it.
struct Across {
    read: f64,
    sd: f64,
    sloped: f64,
}

/// That a slope named of `pushes` is none, since they read nothing of it across their ways; it keeps a part of its odds.
pub(super) fn one_way(
    pushes: &Pushes,
    (capture, model): (&Capture, &Model),
    findings: &mut [Finding],
) -> Option<Evidence> {
    let leans = |f: &&mut Finding| ["support-tilt", "gravity-error"].contains(&f.cause.as_str());
    let finding = findings.iter_mut().find(leans)?;
    let [x, y] = [finding.parameters.get("tx")?, finding.parameters.get("ty")?];
    let slope = Vector2::new(x.value, y.value);
    let touches: Vec<Across> = (0..pushes.sheet.groups.len())
        .filter_map(|g| {
            let name = &pushes.sheet.groups[g].name;
            let interaction = capture.interactions.iter().find(|i| i.name == *name)?;
            across(interaction, pushes, model, slope * pushes.loads[pushes.bodies[g]])
        })
        .collect();
    let (share, sd) = borne_out(&touches)?;
    let refuted = share < NONE && 0.5 - share > CLEAR * sd;
    if !refuted {
        return None;
    }
    finding.less_likely(REFUTED);
    let usual = (touches.iter().map(|t| t.sloped.powi(2)).sum::<f64>() / touches.len() as f64).sqrt();
    let told = Evidence {
        residual: "force across the slip".into(),
        test: "share of what a slope adds there that was read".into(),
        statistic: share,
        p_value: (-0.5 * ((1.0 - share) / sd).powi(2)).exp(),
        words: format!(
            "{} touches cost more one way than back, as on a slope; but of the {usual:.2} N that a slope would add across their ways \
             {:.0} +- {:.0} % were read: friction is larger one way, as of a nap or a ratchet, of which the catalogue knows nothing",
            touches.len(),
            100.0 * share,
            196.0 * sd
        ),
    };
    finding.evidence.push(told.clone());
    Some(told)
}

/// The share of what a slope adds across that was read, and its standard deviation, from touch to touch where they differ by more than
/// they are read.
fn borne_out(touches: &[Across]) -> Option<(f64, f64)> {
    let n = touches.len();
    let all: f64 = touches.iter().map(|t| (t.sloped / t.sd).powi(2)).sum();
    if n < FEWEST || all <= 0.0 {
        return None;
    }
    let share = touches.iter().map(|t| t.read * t.sloped / t.sd.powi(2)).sum::<f64>() / all;
    let left: f64 = touches
        .iter()
        .map(|t| ((t.read - share * t.sloped) / t.sd).powi(2))
        .sum();
    Some((share, ((left / (n as f64 - 1.0)).max(1.0) / all).sqrt()))
}

/// Means over the pieces of one touch.
fn across(interaction: &Interaction, pushes: &Pushes, model: &Model, added: Vector2<f64>) -> Option<Across> {
    let (times, forces) = stretch(interaction, ENDS)?;
    let name = interaction.target.as_ref()?;
    let (track, link) = (interaction.tracks.get(name)?, model.twin.link(name)?);
    let middle = Vector3::from(link.com.as_ref().map_or([0.0; 3], |c| c.value));
    let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&pushes.plane[0]), v.dot(&pushes.plane[1]));
    let place = |t: f64| {
        let near = (0..track.len()).filter(|i| (track.time[*i] - t).abs() <= SMOOTH);
        let placed = near.filter_map(|i| {
            let turned = track.rotation[i].map_or(middle, |q| q * middle);
            let at = flat(&(track.position[i].coords + turned));
            at.iter().all(|x| x.is_finite()).then_some(at)
        });
        let (sum, n) = placed.fold((Vector2::zeros(), 0.0), |(s, n), p| (s + p, n + 1.0));
        (n > 0.0).then(|| sum / n)
    };
    let row = |t: f64| {
        track
            .time
            .partition_point(|x| *x < t)
            .min(track.len().saturating_sub(1))
    };
    let turn = |t: f64| track.rotation.get(row(t)).copied().flatten();
    let turned = turn(*times.last()?)
        .zip(turn(times[0]))
        .map_or(0.0, |(last, first)| last.angle_to(&first));
    let felt = forces.iter().map(|f| flat(f).norm()).sum::<f64>() / forces.len() as f64;
    let length = times.len() / PIECES;
    let pieces: Vec<[f64; 2]> = (0..PIECES)
        .filter_map(|k| {
            let piece = k * length..(k + 1) * length;
            let went = place(*times.get(piece.end.checked_sub(1)?)?)? - place(times[piece.start])?;
            let slip = went.try_normalize(SHORTEST)?;
            let force = forces[piece.clone()].iter().map(flat).sum::<Vector2<f64>>() / length as f64;
            Some([slip.perp(&force), slip.perp(&added)])
        })
        .collect();
    let mean = |k: usize| pieces.iter().map(|p| p[k]).sum::<f64>() / pieces.len() as f64;
    (!pieces.is_empty()).then(|| Across {
        read: mean(0),
        sd: felt * ASIDE[0].hypot(ASIDE[1] * turned),
        sloped: mean(1),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve touches all round of which so large a share of what a slope adds is read, with what else friction does across.
    fn touches(share: f64) -> Vec<Across> {
        let one = |k: i32| {
            let sloped = 0.2 * (0.5 * f64::from(k)).sin();
            Across {
                read: share * sloped + 0.02 * (7.3 * f64::from(k)).sin(),
                sd: 0.02,
                sloped,
            }
        };
        (0..12).map(one).collect()
    }

    #[test]
    fn a_slope_is_borne_out_across_and_a_ratchet_is_not() {
        let (slope, sd) = borne_out(&touches(1.0)).expect("touches");
        assert!((slope - 1.0).abs() < 0.1 && sd < 0.1, "{slope} {sd}");
        let (ratchet, sd) = borne_out(&touches(0.0)).expect("touches");
        assert!(ratchet.abs() < 0.1 && 0.5 - ratchet > CLEAR * sd, "{ratchet} {sd}");
    }
}
