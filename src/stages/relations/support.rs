//! What stands on the table.

use nalgebra::{Point3, Vector3};

use super::Config;
use super::evidence::excursion;
use super::placing::Placed;
use crate::capture::{Capture, Kind, track_noise};
use crate::twin::{Relation, RelationKind, SUPPORT};

/// The arc between the table and a thing that stands on it.
pub fn standing(
    capture: &Capture,
    thing: &Placed,
    table: &Point3<f64>,
    up: &Vector3<f64>,
    config: &Config,
) -> Option<Relation> {
    let tried = tried(capture, &thing.name, up);
    let stands = match thing.extent(up) {
        Some((low, _)) => (low - up.dot(&table.coords)).abs() < config.standing,
        None => tried.glided,
    };
    if !stands {
        return None;
    }
    let shown = !tried.moved.is_empty();
    Some(Relation {
        a: SUPPORT.into(),
        b: thing.name.clone(),
        kind: if shown {
            RelationKind::Resting
        } else {
            RelationKind::Unknown
        },
        rotation_dof: 3,
        translation_dof: 3,
        probability: if shown { 0.99 } else { 0.5 },
        from: tried.moved,
        breakaway: None,
    })
}

struct Tried {
    /// The interactions in which it moved.
    moved: Vec<String>,
    /// It moved along the table without leaving it.
    glided: bool,
}

fn tried(capture: &Capture, name: &str, up: &Vector3<f64>) -> Tried {
    let noise = track_noise(capture, name);
    let mut out = Tried {
        moved: Vec::new(),
        glided: false,
    };
    for run in capture
        .fitted()
        .filter(|i| i.kind != Kind::Press && i.kind != Kind::Hold)
    {
        let Some(shift) = run.tracks.get(name).and_then(|t| excursion(t, noise)) else {
            continue;
        };
        out.moved.push(run.name.clone());
        let height = up.dot(&shift);
        let level = (shift - up * height).norm();
        out.glided |= run.kind == Kind::Push && level > 3e-3 && height.abs() < 0.15 * level + 1e-3;
    }
    out
}
