//! Streams of one recording that do not go together: another clock, or a force of the wrong sign.

use crate::capture::{Interaction, Kind};

/// Share of the shorter stream that has to lie within the other.
const OVERLAP: f64 = 0.5;
/// Readings below this share of the largest force do no work that counts.
const LOADED: f64 = 0.3;
/// Work of a push, as a share of force times way, below which it seems to be pushed backwards.
const BACKWARDS: f64 = -0.5;
/// Steps that a push is cut into for it.
const STEPS: usize = 100;
/// Shortest way under load that tells it, m.
const WAY: f64 = 5e-3;

/// What to say of such, if there is anything.
pub(super) fn doubtful(interaction: &Interaction) -> Option<String> {
    other_clock(interaction).or_else(|| backwards(interaction))
}

fn other_clock(interaction: &Interaction) -> Option<String> {
    let ends = |times: &[f64]| Some([*times.first()?, *times.last()?]);
    let [from, until] = ends(&interaction.force.as_ref()?.time)?;
    let apart = |(name, times): (&str, &Vec<f64>)| {
        let [first, last] = ends(times)?;
        let shared = until.min(last) - from.max(first);
        let shorter = (until - from).min(last - first);
        (shorter > 0.0 && shared < OVERLAP * shorter).then(|| {
            format!(
                "the force is of {from:.2} to {until:.2} s, {name} of {first:.2} to {last:.2} s: streams of one recording have one clock, in seconds"
            )
        })
    };
    let tool = interaction.tool_path.iter().map(|p| ("the tool's path", &p.time));
    let tracks = interaction.tracks.iter().map(|(name, t)| (name.as_str(), &t.time));
    tool.chain(tracks).find_map(apart)
}

/// Whether the tool moves against the force that it exerts.
fn backwards(interaction: &Interaction) -> Option<String> {
    let (force, path) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    if interaction.kind != Kind::Push {
        return None;
    }
    let place = |t: f64| path.sample(t).map(|p| p.0);
    let largest = force
        .force
        .iter()
        .map(|f| f.norm())
        .filter(|n| n.is_finite())
        .fold(0.0, f64::max);
    let (mut work, mut most, mut way) = (0.0, 0.0, 0.0);
    // Long steps, so that the noise of the path is no way.
    let rows: Vec<usize> = (0..force.time.len())
        .step_by((force.time.len() / STEPS).max(1))
        .collect();
    for w in rows.windows(2) {
        let f = force.force[w[0]];
        if f.norm() > LOADED * largest
            && let (Some(a), Some(b)) = (place(force.time[w[0]]), place(force.time[w[1]]))
        {
            work += f.dot(&(b - a));
            most += f.norm() * (b - a).norm();
            way += (b - a).norm();
        }
    }
    (way > WAY && work < BACKWARDS * most)
        .then(|| "the tool moves against the force that it exerts: the sign of the force seems to be turned".into())
}
