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

/// A drift of the sensor that begins at a rate `d` and settles, as of one that warms up.
pub fn warming(make: &Maker, d: Parameter) -> Law {
    // What takes longer is even for as long as a capture lasts.
    let settles = Parameter {
        high: 400f64.ln(),
        ..Parameter::scale("settles", "s", 60.0, 0.8)
    };
    make.law(
        "force-drift",
        form::DRIFT_SETTLING,
        (vec![d], vec![Parameter::nought_before(), settles]),
        vec![vec![0.0, 25f64.ln()], vec![0.0, 80f64.ln()]],
        "what is read drifts with time, and settles",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lever of 0.3 m that is turned from one angle to another.
    fn turned(from: f64, to: f64) -> Vec<JointLoad> {
        let one = |i: u32| {
            let angle = from + (to - from) * f64::from(i) / 200.0;
            JointLoad {
                time: 0.01 * f64::from(i),
                load: 1.0,
                lever: 0.3,
                aside: [0.0; 2],
                way: Vector3::new(-angle.sin(), angle.cos(), 0.0),
                position: angle,
                speed: 0.1,
                speed_gain: 8.0,
                acceleration: 0.0,
            }
        };
        (0..=200).map(one).collect()
    }

    #[test]
    fn a_chord_leads_from_where_a_motion_begins_to_its_farthest_point() {
        let expected = Vector3::new(1.0_f64.cos() - 1.0, 1.0_f64.sin(), 0.0).normalize();
        let there = turned(0.0, 1.0);
        assert!((chord(&there) - expected).norm() < 0.01, "{}", chord(&there));
        // Back again it is the same motion.
        let and_back = [there, turned(1.0, 0.2)].concat();
        assert!((chord(&and_back) - expected).norm() < 0.01);
        assert!((chord(&turned(1.0, 0.0)) + expected).norm() < 0.01);
        assert_eq!(chord(&turned(0.5, 0.5)), Vector3::zeros());
    }

    #[test]
    fn motions_that_all_lead_one_way_do_not_face_both() {
        let read = |from: f64, to: f64| Read {
            interaction: "pull".into(),
            held_out: false,
            halves: vec![0.02; 201],
            noise: 0.01,
            jitter: 1e-3,
            zero: 0.0,
            by_hand: false,
            loads: turned(from, to),
        };
        assert!(!both_ways(&[read(0.0, 1.0), read(0.2, 0.9)]));
        assert!(both_ways(&[read(0.0, 1.0), read(0.9, 0.2)]));
    }
}
