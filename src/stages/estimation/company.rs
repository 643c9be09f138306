//! Who moved along with what was pushed: its friction is felt too.

use nalgebra::Vector3;

use crate::base::Notices;
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::twin::Twin;

/// Whether nothing but the link moved, and it hangs on no joint.
pub(super) fn alone(interaction: &Interaction, cut: &Segmented, link: &str, twin: &Twin) -> bool {
    matches!(company(interaction, cut, link, twin), Company::Alone)
}

/// Who else moved while a link was pushed or pulled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Company {
    /// Nobody.
    Alone,
    /// These moved along as if one body with it.
    Rigid(Vec<String>),
    /// Something moved in another way, or the link hangs on a joint: its own friction is not what was felt.
    Jointed,
}

/// Says whose friction the force of a push is.
pub(super) fn noted(others: Vec<String>, link: &str, interaction: &str, notices: &mut Notices) -> Vec<String> {
    let words = format!(
        "{} moved along with `{link}`: the force is that of all",
        others.join(", ")
    );
    notices.note("estimation", interaction, words);
    others
}

/// Who else moved while `link` was pushed or pulled.
pub fn company(interaction: &Interaction, cut: &Segmented, link: &str, twin: &Twin) -> Company {
    let family: Vec<&str> = twin
        .body_of(link)
        .map_or(Vec::new(), |b| b.links.iter().map(|l| l.name.as_str()).collect());
    let moved: Vec<&String> = cut
        .of(PhaseKind::Slide)
        .flat_map(|p| &p.moving)
        .filter(|n| *n != link)
        .collect();
    let own = displacement(interaction, link);
    let mut others = Vec::new();
    for name in moved {
        match (&own, displacement(interaction, name)) {
            (Some((shift, turn)), Some((s, r))) => {
                let alike = (s - shift).norm() < 0.25 * shift.norm() + 1e-3 && (r - turn).norm() < 0.1;
                if !alike {
                    return Company::Jointed;
                }
                others.push(name.clone());
            }
            _ => return Company::Jointed,
        }
    }
    // A sibling that stood still while the link moved: the joint between them carried a load.
    if family.len() > 1 && family.iter().any(|n| *n != link && !others.iter().any(|o| o == n)) {
        return Company::Jointed;
    }
    if others.is_empty() {
        Company::Alone
    } else {
        Company::Rigid(others)
    }
}

/// Total displacement and rotation of a track.
fn displacement(interaction: &Interaction, name: &str) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let track = interaction.tracks.get(name)?;
    let rows: Vec<usize> = (0..track.len()).filter(|&i| track.position[i].x.is_finite()).collect();
    let (first, last) = (*rows.first()?, *rows.last()?);
    let turn = match (track.rotation[first], track.rotation[last]) {
        (Some(a), Some(b)) => (b * a.inverse()).scaled_axis(),
        _ => Vector3::zeros(),
    };
    Some((track.position[last] - track.position[first], turn))
}
