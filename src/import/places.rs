//! Where things were: pose topics and the tree of frames, brought into one world frame.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use super::messages::Placed;

/// Poses of one frame in another over time, sorted.
type Samples = Vec<(f64, Isometry3<f64>)>;

/// How each frame stands in its parent, as `tf2` keeps it.
#[derive(Default)]
pub(super) struct FrameTree {
    /// Child → its parent, whether it never moves, and parent-from-child over time.
    edges: BTreeMap<String, (String, bool, Samples)>,
}

/// More links of a chain than this are a loop.
const DEEPEST: usize = 64;
/// Two turns nearer to opposite than this cannot be interpolated.
const OPPOSITE: f64 = 1e-9;

impl FrameTree {
    /// Adds transforms of a topic; those of `/tf_static` hold at all times.
    pub(super) fn add(&mut self, all: Vec<Placed>, is_static: bool) {
        for one in all {
            let Some(child) = one.child else { continue };
            let edge = self
                .edges
                .entry(child)
                .or_insert_with(|| (one.frame.clone(), is_static, Vec::new()));
            edge.2.push((one.time, one.pose));
        }
    }

    /// Sorts what was added; looking up needs it.
    pub(super) fn settle(&mut self) {
        for (_, _, samples) in self.edges.values_mut() {
            samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }

    /// The frames of the chain from `frame` up to `world`, `frame` first; none where it does not reach it.
    fn chain<'a>(&'a self, world: &str, frame: &'a str) -> Option<Vec<&'a str>> {
        let (mut chain, mut at) = (Vec::new(), frame);
        while at != world {
            chain.push(at);
            at = &self.edges.get(at)?.0;
            if chain.len() > DEEPEST {
                return None;
            }
        }
        Some(chain)
    }

    /// True where there is a chain of transforms between the two.
    pub(super) fn reaches(&self, world: &str, frame: &str) -> bool {
        self.chain(world, frame).is_some()
    }

    /// World-from-frame at a time: linear and by great arcs between samples, none before the first or after the last.
    pub(super) fn at(&self, world: &str, frame: &str, time: f64) -> Option<Isometry3<f64>> {
        let mut whole = Isometry3::identity();
        for child in self.chain(world, frame)? {
            let (_, is_static, samples) = self.edges.get(child)?;
            let here = if *is_static {
                samples.last()?.1
            } else {
                between(samples, time)?
            };
            whole = here * whole;
        }
        Some(whole)
    }

    /// World-from-frame whenever something of its chain was told.
    pub(super) fn track(&self, world: &str, frame: &str) -> Samples {
        let moving = self.chain(world, frame).unwrap_or_default().into_iter();
        let moving = moving
            .filter_map(|c| self.edges.get(c))
            .filter(|(_, is_static, _)| !is_static);
        let mut times: Vec<f64> = moving.flat_map(|(_, _, s)| s.iter().map(|(t, _)| *t)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let placed = |t: f64| Some((t, self.at(world, frame, t)?));
        times.into_iter().filter_map(placed).collect()
    }
}

/// Where a thing that was told over time was at `time`; none outside of what was told.
pub(super) fn between(samples: &[(f64, Isometry3<f64>)], time: f64) -> Option<Isometry3<f64>> {
    let after = samples.partition_point(|(t, _)| *t < time);
    let (next, upper) = samples.get(after)?;
    if *next == time {
        return Some(*upper);
    }
    let (last, lower) = samples.get(after.checked_sub(1)?)?;
    let share = (time - last) / (next - last);
    Some(lower.try_lerp_slerp(upper, share, OPPOSITE).unwrap_or(*lower))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn told(time: f64, frame: &str, child: &str, x: f64) -> Placed {
        Placed {
            time,
            frame: frame.into(),
            child: Some(child.into()),
            pose: Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * x),
        }
    }

    #[test]
    fn a_chain_is_followed_up_to_the_world() {
        let mut tree = FrameTree::default();
        tree.add(
            vec![told(0.0, "world", "arm", 0.0), told(1.0, "world", "arm", 1.0)],
            false,
        );
        tree.add(vec![told(0.0, "arm", "camera", 0.5)], true);
        tree.settle();
        let half = tree.at("world", "camera", 0.5).expect("placed");
        let expected = Isometry3::new(Vector3::new(0.5, 0.0, 0.0), Vector3::z() * 0.5);
        let expected = expected * Isometry3::new(Vector3::new(0.5, 0.0, 0.0), Vector3::z() * 0.5);
        assert!((half.translation.vector - expected.translation.vector).norm() < 1e-12);
        assert!(half.rotation.angle_to(&expected.rotation) < 1e-9);
        assert!(
            tree.at("world", "camera", 1.5).is_none(),
            "nothing is said beyond the last sample"
        );
        assert!(!tree.reaches("map", "camera"));
        assert_eq!(tree.track("world", "camera").len(), 2);
    }

    #[test]
    fn a_loop_of_frames_is_no_chain() {
        let mut tree = FrameTree::default();
        tree.add(vec![told(0.0, "a", "b", 0.0), told(0.0, "b", "a", 0.0)], false);
        assert!(!tree.reaches("world", "a"));
    }
}
