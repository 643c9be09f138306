//! How much of what was hidden is in the data, whatever anybody makes of them: the same scene and seed without it, laid beside.

use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Progress, Seed};
use palpate::capture::{Capture, Interaction};
use palpate::lab::{Scene, synthesise};
use palpate::twin::Verdict;

use crate::table::{Seen, share};

/// Root mean square of what an effect changes of a reading, over the noise of one, from which on it is visible.
const VISIBLE: f64 = 3.0;

/// Root mean square of what the hidden effect changes of a reading, over the noise of that reading: the largest of all forces and
/// tracks of all interactions. Dice fall alike with and without it, so that all that differs is its doing.
pub fn shown(scene: &Scene, number: u64, with: &Capture) -> Option<f64> {
    let mut plain = scene.clone();
    plain.hide.clear();
    let made = synthesise(&plain, Path::new("."), Seed(number), &Progress::silent()).ok()?;
    let without = &made.capture;
    let noise = [scene.noise.force, scene.noise.position];
    let pairs = with.interactions.iter().filter_map(|i| {
        let other = without.interactions.iter().find(|o| o.name == i.name)?;
        Some(changed(i, other, noise))
    });
    pairs.reduce(f64::max)
}

fn changed(a: &Interaction, b: &Interaction, [force, position]: [f64; 2]) -> f64 {
    let of = |i: &Interaction| i.force.as_ref().map_or_else(Vec::new, |s| s.force.clone());
    let mut most = rms(&of(a), &of(b)) / force;
    for (name, track) in &a.tracks {
        let Some(other) = b.tracks.get(name) else { continue };
        let [own, other] = [track, other].map(|t| t.position.iter().map(|p| p.coords).collect::<Vec<_>>());
        most = most.max(rms(&own, &other) / position);
    }
    most
}

/// Per axis, over the readings that both have.
fn rms(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let both = a.iter().zip(b).map(|(a, b)| (a - b).norm_squared() / 3.0);
    let (sum, count) = both
        .filter(|x| x.is_finite())
        .fold((0.0, 0.0_f64), |(s, n), x| (s + x, n + 1.0));
    (sum / count.max(1.0)).sqrt()
}

/// Effects that no cause of the catalogue is. Whether one is visible is told by the readings, not by the verdict.
pub fn outside(all: &[&Seen]) {
    let visible: Vec<&Seen> = all
        .iter()
        .copied()
        .filter(|s| s.shown.is_some_and(|x| x > VISIBLE))
        .collect();
    let called =
        |of: &[&Seen], verdicts: &[Verdict]| of.iter().map(|s| verdicts.contains(&s.verdict)).collect::<Vec<_>>();
    share(
        "outside the catalogue, visible (3 noises): unknown or ambiguous",
        ">= 0.85",
        &called(&visible, &[Verdict::Unknown, Verdict::Ambiguous]),
    );
    share("  of them: unknown", "-", &called(&visible, &[Verdict::Unknown]));
    share(
        "  of them: explained by a name",
        "-",
        &called(&visible, &[Verdict::Explained]),
    );
    share(
        "  of them: called adequate",
        "-",
        &called(&visible, &[Verdict::Adequate]),
    );
    share(
        "outside the catalogue, all: called adequate",
        "-",
        &called(all, &[Verdict::Adequate]),
    );
}
