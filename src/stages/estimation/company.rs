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

/// Whether two went as one whenever either of them went, at least once, from where they were in each other's frame; what was held
/// out is not asked.
pub fn always_as_one(capture: &Capture, segmented: &[Segmented], twin: &Twin, pair: [&str; 2]) -> bool {
    let went = |cut: &Segmented| {
        let moving = |name: &str| cut.phases.iter().any(|p| p.moving.iter().any(|m| m == name));
        pair.iter().any(|name| moving(name))
    };
    let mut first: Option<Isometry3<f64>> = None;
    let mut as_one = |run: &Interaction, cut: &Segmented| -> Option<bool> {
        let [from, _] = places(run.tracks.get(pair[0])?, run.tracks.get(pair[1])?)?;
        let [m, rad] = apart(first.get_or_insert(from), &from);
        let company = company(run, cut, pair[0], twin);
        let rigid = matches!(company, Company::Rigid(others) if others.iter().any(|o| o == pair[1]));
        Some(rigid && stayed(run, pair) && m < AGAIN[0] && rad < AGAIN[1])
    };
    let runs = capture.fitted();
    let cut_of = |run: &Interaction| segmented.iter().find(|s| s.interaction == run.name);
    let mut moved = runs
        .filter_map(|run| Some((run, cut_of(run).filter(|cut| went(cut))?)))
        .peekable();
    moved.peek().is_some() && moved.all(|(run, cut)| as_one(run, cut) == Some(true))
}

/// How far they may be from where they were in each other's frame before, m and rad.
const AGAIN: [f64; 2] = [4e-3, 0.06];
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
    let [before, after] = places(first, second)?;
    Some(apart(&before, &after))
}

fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> [f64; 2] {
    let between = a.inverse() * b;
    [between.translation.vector.norm(), between.rotation.angle()]
}

/// Where the second is in the frame of the first at the beginning and at the end, by the first and the last poses of each.
fn places(first: &PoseStream, second: &PoseStream) -> Option<[Isometry3<f64>; 2]> {
    let seen = |t: &PoseStream| -> Vec<Isometry3<f64>> { (0..t.len()).filter_map(|k| Some(t.pose(k)?.0)).collect() };
    let (a, b) = (seen(first), seen(second));
    let n = POSES.min(a.len()).min(b.len());
    let at_first = placed(&a[..n], &b[..n])?;
    Some([at_first, placed(&a[a.len() - n..], &b[b.len() - n..])?])
}

/// Where the second is in the frame of the first, the middle of some poses.
fn placed(first: &[Isometry3<f64>], second: &[Isometry3<f64>]) -> Option<Isometry3<f64>> {
    let each: Vec<Isometry3<f64>> = first.iter().zip(second).map(|(a, b)| a.inverse() * b).collect();
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
