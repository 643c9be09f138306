//! The twin as a simulator sees it: trees of parts with frames on their joints, nothing left out.
//!
//! A part's frame has the axes of the twin's link frame. Its origin is that of the link frame too, except
//! for a child that turns: there it is the joint's origin, since URDF wants it on the axis.

use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

use super::ExportNote;
use super::surface::Surface;
use crate::twin::JointKind;

/// Everything that is written into a simulator's file.
pub(super) struct Scene {
    pub(super) name: String,
    pub(super) gravity: Vector3<f64>,
    pub(super) floor: Option<Floor>,
    pub(super) trees: Vec<Tree>,
    /// Links of different trees that move as one.
    pub(super) welds: Vec<Weld>,
    pub(super) notes: Vec<ExportNote>,
}

/// Two parts that move as one, up to a force.
pub(super) struct Weld {
    pub(super) ends: [PartId; 2],
    /// The force at which the bond gives way, N.
    pub(super) breakaway: Option<f64>,
}

/// Which part of which tree.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct PartId {
    pub(super) tree: usize,
    pub(super) part: usize,
}

/// The table's top.
pub(super) struct Floor {
    pub(super) point: Vector3<f64>,
    pub(super) normal: Unit<Vector3<f64>>,
}

/// What moves as one tree; the root first, each part after its parent.
pub(super) struct Tree {
    pub(super) name: String,
    pub(super) parts: Vec<Part>,
    /// Held to the world.
    pub(super) anchored: bool,
}

/// One rigid part.
pub(super) struct Part {
    pub(super) name: String,
    /// The twin's name for it.
    pub(super) link: String,
    pub(super) world_from_part: Isometry3<f64>,
    /// Where the twin's link frame has its origin, part frame (the axes are the same).
    pub(super) link_origin: Vector3<f64>,
    pub(super) mass: f64,
    /// Part frame.
    pub(super) com: Vector3<f64>,
    /// About the centre of mass, part axes.
    pub(super) inertia: Matrix3<f64>,
    pub(super) assumed: Vec<&'static str>,
    pub(super) visual: Option<String>,
    /// Path of the visual mesh's image, where its colours were seen.
    pub(super) texture: Option<String>,
    /// The visual mesh lies in a plane.
    pub(super) flat: bool,
    pub(super) hulls: Vec<String>,
    /// Mean sRGB colour, 0 to 1.
    pub(super) color: [f64; 3],
    pub(super) surface: Surface,
    pub(super) attachment: Option<Attachment>,
}

/// How a part hangs on its parent.
pub(super) struct Attachment {
    pub(super) parent: usize,
    pub(super) name: String,
    pub(super) joint: String,
    pub(super) kind: JointKind,
    pub(super) parent_from_part: Isometry3<f64>,
    /// Its freedoms, in order from the parent; none where it is fixed.
    pub(super) motions: Vec<Motion>,
    /// The joint's axis, part axes.
    pub(super) axis: Unit<Vector3<f64>>,
    /// m/rad, for a screw.
    pub(super) pitch: f64,
    /// The joint of one freedom that it follows, by the twin's name, and how far for each unit of that one's way.
    pub(super) follows: Option<(String, f64)>,
}

/// One degree of freedom.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    pub(super) name: String,
    pub(super) turns: bool,
    /// Unit, part axes.
    pub(super) axis: Unit<Vector3<f64>>,
    /// Measured ends, zero at the first view.
    pub(super) range: Option<[f64; 2]>,
    /// The end at zero was not felt: there the two lay on each other at the first view. The other end is open.
    pub(super) lay: bool,
    /// Where a format must have ends: the measured ones, or the travel that was seen, widened.
    pub(super) stated_range: [f64; 2],
    pub(super) friction: f64,
    pub(super) damping: f64,
    pub(super) stiffness: f64,
    pub(super) rest: f64,
}

impl Scene {
    /// The part that the twin calls `name`, a link or a body (then its root) or `body/link`.
    pub(super) fn find(&self, name: &str) -> Option<PartId> {
        let link = name.rsplit_once('/').map(|(_, link)| link);
        self.parts()
            .find(|(_, p)| p.link == name || Some(p.link.as_str()) == link)
            .map(|(id, _)| id)
    }

    /// What each joint that follows another does: its own motion, that of its leader, and the ratio of the two.
    pub(super) fn couplings(&self) -> impl Iterator<Item = (&Motion, &Motion, f64)> {
        let holds = || self.parts().filter_map(|(_, p)| p.hold());
        holds().filter_map(move |hold| {
            let (leader, ratio) = hold.follows.as_ref()?;
            let leader = holds().find(|h| h.joint == *leader)?;
            match (hold.motions.as_slice(), leader.motions.as_slice()) {
                ([own], [other]) => Some((own, other, *ratio)),
                _ => None,
            }
        })
    }

    /// The leader of a motion, and the ratio, where it follows another.
    pub(super) fn leader(&self, name: &str) -> Option<(&str, f64)> {
        let found = self.couplings().find(|(own, ..)| own.name == name);
        found.map(|(_, leader, ratio)| (leader.name.as_str(), ratio))
    }

    /// Every part with its place.
    pub(super) fn parts(&self) -> impl Iterator<Item = (PartId, &Part)> {
        self.trees.iter().enumerate().flat_map(|(tree, t)| {
            let at = move |(part, p)| (PartId { tree, part }, p);
            t.parts.iter().enumerate().map(at)
        })
    }

    /// The part at a place.
    pub(super) fn part(&self, id: PartId) -> &Part {
        &self.trees[id.tree].parts[id.part]
    }

    /// The notes that belong into a file of `format`.
    pub(super) fn notes_for(&self, format: &str) -> impl Iterator<Item = &ExportNote> {
        self.notes.iter().filter(move |n| n.concerns(format))
    }
}

impl Attachment {
    /// Whether it advances as it turns.
    pub(super) fn is_threaded(&self) -> bool {
        self.kind == JointKind::Screw && self.pitch != 0.0
    }
}

impl Part {
    /// How the part hangs on its parent, unless it is a root.
    pub(super) fn hold(&self) -> Option<&Attachment> {
        self.attachment.as_ref()
    }

    /// Whether the part has nothing that could touch.
    pub(super) fn is_bare(&self) -> bool {
        self.hulls.is_empty()
    }
}
