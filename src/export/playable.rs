//! The twin as the engine on the report's page takes it: the numbers of the exports, as data.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use serde::Serialize;

use super::layout::lay_out;
use super::scene::{Attachment, Part, PartId, Scene, Tree};
use crate::base::{Error, Pose, Result};
use crate::twin::{JointKind, Model};

/// What a page needs to let a twin move: the same parts, joints and bonds as in the other exports.
#[derive(Clone, Debug, Serialize)]
pub struct Playable {
    /// m/s², world.
    pub gravity: [f64; 3],
    /// The table's top.
    pub floor: PlayFloor,
    /// Parents before their children.
    pub parts: Vec<PlayPart>,
    /// What holds parts of different trees together.
    pub bonds: Vec<PlayBond>,
}

/// The plane on which things stand.
#[derive(Clone, Debug, Serialize)]
pub struct PlayFloor {
    /// A point of it, m, world.
    pub point: [f64; 3],
    /// Away from the table, unit, world.
    pub normal: [f64; 3],
}

/// A rigid part in its own frame, which lies on the joint's origin for what turns.
#[derive(Clone, Debug, Serialize)]
pub struct PlayPart {
    /// The twin's name of the link.
    pub link: String,
    /// Parts of the same tree are held together by joints.
    pub tree: usize,
    /// World-from-part at the first view: x y z qx qy qz qw, m.
    pub pose: [f64; 7],
    /// Where the link's frame has its origin, part frame, m (the axes are the same).
    pub origin: [f64; 3],
    /// kg.
    pub mass: f64,
    /// Part frame, m.
    pub com: [f64; 3],
    /// Principal moments about the centre of mass, kg·m².
    pub moments: [f64; 3],
    /// Part-from-principal axes: qx qy qz qw.
    pub principal: [f64; 4],
    /// Coefficient of kinetic friction.
    pub friction: f64,
    /// Rolling resistance, m.
    pub rolling: Option<f64>,
    /// Files of the convex parts, by which the page finds them; empty: it touches nothing.
    pub hulls: Vec<String>,
    /// What was not measured, in words.
    pub assumed: Vec<&'static str>,
    /// Held to the world.
    pub anchored: bool,
    /// How it hangs on its parent, unless it is a root.
    pub joint: Option<PlayJoint>,
}

/// A joint at the origin of its child's frame, at position 0 at the first view.
#[derive(Clone, Debug, Serialize)]
pub struct PlayJoint {
    /// The twin's name of it.
    pub name: String,
    /// Which part it hangs on.
    pub parent: usize,
    /// How it moves.
    pub kind: JointKind,
    /// Unit, world at the first view.
    pub axis: [f64; 3],
    /// The freedom along or about the axis, where there is one.
    pub motion: Option<PlayMotion>,
    /// How far a screw advances as it turns, m/rad.
    pub pitch: Option<f64>,
    /// The joint of one freedom that it follows.
    pub follows: Option<PlayLeader>,
}

/// What a joint follows.
#[derive(Clone, Debug, Serialize)]
pub struct PlayLeader {
    /// The part that hangs on the joint which leads.
    pub part: usize,
    /// Motion for each unit of the leader's, both zero at the first view.
    pub ratio: f64,
}

/// One freedom: m, N, kg or rad, N·m.
#[derive(Clone, Debug, Serialize)]
pub struct PlayMotion {
    /// About the axis, not along it.
    pub turns: bool,
    /// It is the joint's only freedom.
    pub alone: bool,
    /// Measured ends.
    pub range: Option<[f64; 2]>,
    /// Dry friction, N or N·m.
    pub friction: f64,
    /// N·s/m or N·m·s/rad.
    pub damping: f64,
    /// N/m or N·m/rad.
    pub stiffness: f64,
    /// Where the spring is slack.
    pub rest: f64,
}

/// A bond between two parts.
#[derive(Clone, Debug, Serialize)]
pub struct PlayBond {
    /// Which parts.
    pub ends: [usize; 2],
    /// The force at which it gives way, N; never, where it is not known.
    pub breakaway: Option<f64>,
}

/// Lays a twin out for the engine of the page, with the defaults of the other exports.
///
/// # Errors
/// Where there is no table and no gravity to put one under it, or the joints of a body make no tree.
pub fn playable(model: &Model) -> Result<Playable> {
    let scene = lay_out(model)?;
    let floor = scene
        .floor
        .as_ref()
        .ok_or_else(|| Error::Failed("no table: everything would fall".into()))?;
    let mut parts = Vec::new();
    let mut firsts = Vec::new();
    for (index, tree) in scene.trees.iter().enumerate() {
        let first = parts.len();
        firsts.push(first);
        parts.extend(tree.parts.iter().map(|p| part(p, tree, index, first)));
    }
    let leads = followed(&scene, &firsts);
    for (follower, leader) in leads {
        if let Some(joint) = parts.get_mut(follower).and_then(|p: &mut PlayPart| p.joint.as_mut()) {
            joint.follows = Some(leader);
        }
    }
    Ok(Playable {
        gravity: scene.gravity.into(),
        floor: PlayFloor {
            point: floor.point.into(),
            normal: floor.normal.into_inner().into(),
        },
        parts,
        bonds: bonds(&scene, &firsts),
    })
}

/// Every part whose joint follows another, with what it follows.
fn followed(scene: &Scene, firsts: &[usize]) -> Vec<(usize, PlayLeader)> {
    let at = |id: PartId| firsts[id.tree] + id.part;
    let single = |p: &Part| p.hold().is_some_and(|h| h.motions.len() == 1);
    let of = |(id, part): (PartId, &Part)| {
        let (leader, ratio) = part.hold().filter(|_| single(part))?.follows.as_ref()?;
        let leads = |p: &Part| single(p) && p.hold().is_some_and(|h| h.joint == *leader);
        let (leader, _) = scene.parts().find(|(_, p)| leads(p))?;
        let leader = PlayLeader {
            part: at(leader),
            ratio: *ratio,
        };
        Some((at(id), leader))
    };
    scene.parts().filter_map(of).collect()
}

fn bonds(scene: &Scene, firsts: &[usize]) -> Vec<PlayBond> {
    let bond = |w: &super::scene::Weld| PlayBond {
        ends: w.ends.map(|id| firsts[id.tree] + id.part),
        breakaway: w.breakaway,
    };
    scene.welds.iter().map(bond).collect()
}

fn part(part: &Part, tree: &Tree, index: usize, first: usize) -> PlayPart {
    let (moments, principal) = principal(&part.inertia);
    PlayPart {
        link: part.link.clone(),
        tree: index,
        pose: Pose(part.world_from_part).to_seven(),
        origin: part.link_origin.into(),
        mass: part.mass,
        com: part.com.into(),
        moments: moments.into(),
        principal: principal.coords.into(),
        friction: rubbing(part),
        rolling: part.surface.rolling,
        hulls: part.hulls.clone(),
        assumed: part.assumed.clone(),
        anchored: tree.anchored && part.attachment.is_none(),
        joint: part.hold().map(|h| joint(h, &part.world_from_part, first)),
    }
}

/// What a link that moves by its joint alone rubs on is in the measured friction of that joint: rubbing on the table with a
/// friction that nobody measured it would be slowed twice, or jam.
fn rubbing(part: &Part) -> f64 {
    let slowed = part.hold().is_some_and(|h| h.motions.iter().any(|m| m.friction > 0.0));
    if part.surface.assumed && slowed {
        return 0.0;
    }
    part.surface.kinetic_friction
}

fn joint(hold: &Attachment, world_from_part: &Isometry3<f64>, first: usize) -> PlayJoint {
    let main = hold.motions.iter().find(|m| m.axis == hold.axis);
    PlayJoint {
        name: hold.joint.clone(),
        parent: first + hold.parent,
        kind: hold.kind,
        axis: (world_from_part.rotation * hold.axis.into_inner()).into(),
        motion: main.map(|m| PlayMotion {
            turns: m.turns,
            alone: hold.motions.len() == 1,
            range: m.range,
            friction: m.friction,
            damping: m.damping,
            stiffness: m.stiffness,
            rest: m.rest,
        }),
        pitch: hold.is_threaded().then_some(hold.pitch),
        follows: None,
    }
}

/// Principal moments, and the turn from principal to part axes.
fn principal(inertia: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let eigen = inertia.symmetric_eigen();
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let turn = nalgebra::Rotation3::from_matrix_unchecked(axes);
    (eigen.eigenvalues, UnitQuaternion::from_rotation_matrix(&turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_moments_make_the_tensor_again() {
        let tensor = Matrix3::new(3.0, 0.4, -0.2, 0.4, 2.0, 0.1, -0.2, 0.1, 1.5);
        let (moments, turn) = principal(&tensor);
        let r = turn.to_rotation_matrix();
        let again = r.matrix() * Matrix3::from_diagonal(&moments) * r.matrix().transpose();
        assert!((again - tensor).norm() < 1e-12, "{again}");
    }
}
