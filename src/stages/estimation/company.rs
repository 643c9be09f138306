//! Who moved along with what was pushed: its friction is felt too.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::base::Notices;
use crate::capture::{Capture, Interaction, PhaseKind, PoseStream, Segmented};
use crate::math::median;
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
                // What is beside it goes another way where both turn.
                if !alike && !stayed(interaction, [link, name]) {
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

/// Whether two went as one whenever either of them went, at least once.
pub fn always_as_one(capture: &Capture, segmented: &[Segmented], twin: &Twin, pair: [&str; 2]) -> bool {
    let went = |cut: &Segmented, name: &str| cut.phases.iter().any(|p| p.moving.iter().any(|m| m == name));
    let mut moved = segmented
        .iter()
        .filter(|cut| pair.iter().any(|name| went(cut, name)))
        .peekable();
    let as_one = |cut: &Segmented| {
        let run = capture.interactions.iter().find(|i| i.name == cut.interaction)?;
        let rigid = |others: &[String]| others.iter().any(|o| o == pair[1]);
        let company = company(run, cut, pair[0], twin);
        Some(matches!(company, Company::Rigid(others) if rigid(&others)) && stayed(run, pair))
    };
    moved.peek().is_some() && moved.all(|cut| as_one(cut) == Some(true))
}

/// How far two may have moved against each other, m and rad, the noise of some poses in it.
const SHIFTED: [f64; 2] = [1.2e-3, 0.02];
/// Poses of which the middle is taken.
const POSES: usize = 7;

/// Whether the second is at the end where it was in the frame of the first.
fn stayed(run: &Interaction, [first, second]: [&str; 2]) -> bool {
    let tracks = run.tracks.get(first).zip(run.tracks.get(second));
    tracks
        .and_then(|(a, b)| shift(a, b))
        .is_some_and(|[m, rad]| m < SHIFTED[0] && rad < SHIFTED[1])
}

/// By how much the second has moved in the frame of the first, m and rad.
fn shift(first: &PoseStream, second: &PoseStream) -> Option<[f64; 2]> {
    let seen = |k: &usize| first.pose(*k).is_some() && second.pose(*k).is_some();
    let rows: Vec<usize> = (0..first.len().min(second.len())).filter(seen).collect();
    let n = POSES.min(rows.len());
    let before = placed(first, second, &rows[..n])?;
    let after = placed(first, second, &rows[rows.len() - n..])?;
    let between = before.inverse() * after;
    Some([between.translation.vector.norm(), between.rotation.angle()])
}

/// Where the second is in the frame of the first, the middle of some poses.
fn placed(first: &PoseStream, second: &PoseStream, rows: &[usize]) -> Option<Isometry3<f64>> {
    let each: Vec<Isometry3<f64>> = rows
        .iter()
        .filter_map(|k| Some(first.pose(*k)?.0.inverse() * second.pose(*k)?.0))
        .collect();
    let start = each.first()?.rotation;
    let middle = |of: &dyn Fn(&Isometry3<f64>) -> f64| median(&each.iter().map(of).collect::<Vec<f64>>());
    let place = |k: usize| middle(&|p| p.translation.vector[k]);
    let turn = |k: usize| middle(&|p| (start.inverse() * p.rotation).scaled_axis()[k]);
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(turn(0)?, turn(1)?, turn(2)?));
    let translation = Translation3::new(place(0)?, place(1)?, place(2)?);
    Some(Isometry3::from_parts(translation, start * turned))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A track that sets out from `place` and turns about the origin by `angle` in all.
    fn turned(place: [f64; 3], angle: f64) -> PoseStream {
        let at = |k: usize| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle * k as f64 / 40.0);
        PoseStream {
            time: (0..41).map(|k| 0.01 * k as f64).collect(),
            position: (0..41).map(|k| at(k) * Point3::from(place)).collect(),
            rotation: (0..41).map(|k| Some(at(k))).collect(),
        }
    }

    #[test]
    fn what_is_glued_beside_it_stays_in_its_frame_though_it_goes_another_way() {
        let (left, right) = (turned([0.0; 3], 0.4), turned([0.08, 0.0, 0.0], 0.4));
        let [m, rad] = shift(&left, &right).expect("both seen");
        assert!(m < 1e-9 && rad < 1e-9, "{m} {rad}");
        let [m, rad] = shift(&left, &turned([0.08, 0.0, 0.0], 0.3)).expect("both seen");
        assert!(m > SHIFTED[0] && rad > SHIFTED[1], "{m} {rad}");
    }
}
