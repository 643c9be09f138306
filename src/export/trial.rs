//! A recorded touch as an engine plays it: where everything stood, what the tool was, and the way it went.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use serde::Serialize;

use super::scene::{Attachment, Scene, Tree};
use crate::base::Pose;

/// The shape of a tool in its own frame, m.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum TrialShape {
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box.
    Box {
        /// Half edges, m.
        half: [f64; 3],
    },
    /// A cylinder along z.
    Cylinder {
        /// m.
        radius: f64,
        /// m.
        half_height: f64,
    },
    /// The hull of points.
    Hull {
        /// m.
        points: Vec<[f64; 3]>,
    },
}

/// How a tool is joined to what it touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// By contact alone.
    Touch,
    /// As one rigid thing with it, from the start.
    Grip,
    /// By a free pivot at the tool's origin, from the start.
    Pin,
}

/// What touches, and on which way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// The interaction's name.
    pub name: String,
    /// The link that is touched.
    pub target: String,
    /// The tool's shape.
    pub shape: TrialShape,
    /// How it is joined to the target.
    pub hold: Hold,
    /// Coefficient of friction between the tool and the target.
    pub friction: f64,
    /// Seconds from the start, not decreasing; the first is 0.
    pub time: Vec<f64>,
    /// World-from-tool, one a time.
    pub path: Vec<Pose>,
    /// World-from-link at the start, by link; what is not named is where the first view had it.
    pub start: BTreeMap<String, Pose>,
    /// The links whose bodies take part; those that nothing came near are left out.
    pub present: BTreeSet<String>,
}

/// What an engine made of a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Played {
    /// World-from-link of every link that takes part, at rest before the tool came.
    pub settled: BTreeMap<String, Pose>,
    /// The same when the tool had gone its way.
    pub ended: BTreeMap<String, Pose>,
    /// Seconds from the start and the force of the tool on what it touches, N, world; means over a hundredth of a second.
    pub force: Vec<(f64, [f64; 3])>,
}

/// Where every part stands at the start of a trial.
pub(super) struct Placement {
    /// World-from-part, by tree and part.
    pub(super) parts: Vec<Vec<Isometry3<f64>>>,
    /// Of each joint with one freedom: m or rad from the first view.
    pub(super) positions: BTreeMap<String, f64>,
}

impl Trial {
    /// World-from-tool at a time, linear (slerp) between the rows and at rest beyond them.
    pub(super) fn tool_at(&self, time: f64) -> Isometry3<f64> {
        let after = self.time.partition_point(|t| *t <= time);
        match (after.checked_sub(1), self.path.get(after)) {
            (None, _) => self.path.first().map_or_else(Isometry3::identity, |p| p.0),
            (Some(i), None) => self.path[i].0,
            (Some(i), Some(b)) => {
                let share = (time - self.time[i]) / (self.time[after] - self.time[i]).max(1e-12);
                let a = self.path[i].0;
                a.try_lerp_slerp(&b.0, share, 1e-9).unwrap_or(a)
            }
        }
    }

    /// Names of the trees that take part: those that hold a link that does, and what they are glued to.
    pub(super) fn trees(&self, scene: &Scene) -> BTreeSet<String> {
        let mine = |t: &Tree| {
            t.parts
                .iter()
                .any(|p| self.present.contains(&p.link) || p.link == self.target)
        };
        let mut present: Vec<bool> = scene.trees.iter().map(mine).collect();
        for _ in &scene.trees {
            for [a, b] in scene.welds.iter().map(|w| w.ends.map(|id| id.tree)) {
                let either = present[a] || present[b];
                (present[a], present[b]) = (either, either);
            }
        }
        let named = scene.trees.iter().zip(present).filter(|(_, p)| *p);
        named.map(|(t, _)| t.name.clone()).collect()
    }

    /// How long the tool is on its way, s.
    pub(super) fn duration(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }
}

/// The starting poses as the scene can take them: roots where they were, each joint with one freedom where its child
/// was seen, everything else as at the first view.
pub(super) fn place(scene: &Scene, start: &BTreeMap<String, Pose>) -> Placement {
    let mut positions = BTreeMap::new();
    let parts = scene.trees.iter().map(|t| place_tree(t, start, &mut positions));
    let parts = parts.collect();
    Placement { parts, positions }
}

fn place_tree(
    tree: &Tree,
    start: &BTreeMap<String, Pose>,
    positions: &mut BTreeMap<String, f64>,
) -> Vec<Isometry3<f64>> {
    let mut placed: Vec<Isometry3<f64>> = Vec::new();
    for part in &tree.parts {
        let part_from_link = Translation3::from(part.link_origin);
        let seen = start.get(&part.link).map(|p| p.0 * part_from_link.inverse());
        let pose = match part.hold() {
            None if tree.anchored => part.world_from_part,
            None => seen.unwrap_or(part.world_from_part),
            Some(hold) => {
                let at_first_view = placed[hold.parent] * hold.parent_from_part;
                let q = seen.map_or(0.0, |s| position(hold, &(at_first_view.inverse() * s)));
                if let [motion] = hold.motions.as_slice() {
                    positions.insert(motion.name.clone(), q);
                }
                at_first_view * moved(hold, q)
            }
        };
        placed.push(pose);
    }
    placed
}

/// Along or about the axis of a joint with one freedom, within its range; nought for any other.
fn position(hold: &Attachment, start_from_now: &Isometry3<f64>) -> f64 {
    let [motion] = hold.motions.as_slice() else { return 0.0 };
    let q = if motion.turns {
        start_from_now.rotation.scaled_axis().dot(&motion.axis)
    } else {
        start_from_now.translation.vector.dot(&motion.axis)
    };
    motion.range.map_or(q, |[low, high]| q.clamp(low, high))
}

fn moved(hold: &Attachment, q: f64) -> Isometry3<f64> {
    match hold.motions.as_slice() {
        [m] if m.turns => {
            let advance = if hold.is_threaded() { hold.pitch * q } else { 0.0 };
            let along = Translation3::from(m.axis.into_inner() * advance);
            Isometry3::from_parts(along, UnitQuaternion::from_axis_angle(&m.axis, q))
        }
        [m] => Translation3::from(m.axis.into_inner() * q).into(),
        _ => Isometry3::identity(),
    }
}
