//! A tool that is turned to face each motion: what its sensor reads wrongly in its own frame goes along where each motion leads.

use nalgebra::Vector3;

use super::family::{Law, Parameter};
use super::motion_laws::{Maker, form};
use super::motion_reads::Read;
use crate::stages::estimation::JointLoad;

/// Unit vector, in the room, from where a motion begins to the farthest point that the tool comes to; zero where it does not move.
pub(super) fn chord(loads: &[JointLoad]) -> Vector3<f64> {
    let (mut at, mut far) = (Vector3::zeros(), Vector3::zeros());
    for pair in loads.windows(2) {
        let step = pair[1].position - pair[0].position;
        at += pair[1].way * (pair[1].lever * step);
        far = if at.norm_squared() > far.norm_squared() {
            at
        } else {
            far
        };
    }
    far.try_normalize(1e-9).unwrap_or_default()
}

/// Whether motions set out both ways along the freedom: where all go one way, what goes along them goes along it.
pub(super) fn both_ways(reads: &[Read]) -> bool {
    let way = |r: &Read| {
        let first = r.loads.first()?.position;
        let away = |l: &&JointLoad| (l.position - first).abs();
        let far = r.loads.iter().max_by(|a, b| away(a).total_cmp(&away(b)))?;
        Some(far.position > first)
    };
    let ways: Vec<bool> = reads.iter().filter_map(way).collect();
    ways.contains(&true) && ways.contains(&false)
}

/// What a sensor adds along where each motion leads.
pub(super) fn faced_laws(make: &Maker) -> Vec<Law> {
    vec![
        make.plain(
            "force-bias",
            form::BIAS_FACED,
            Parameter::amplitude("b", "N", 0.3),
            "a constant force along where each motion leads is read that is not there",
        ),
        make.law(
            "force-drift",
            form::DRIFT_FACED,
            (
                vec![Parameter::amplitude("d", "N/s", 0.002)],
                vec![Parameter::nought_before()],
            ),
            vec![vec![0.0]],
            "what is read along where each motion leads drifts with time",
        ),
    ]
}
