//! Stops that nobody felt but that are there: a lid that lies on its rim at the first view, a drawer that stands at the back
//! of its case. An end that no touch reached is no limit of the twin; without any, and with the contact of what a joint
//! holds left out, the lid of the exported scene would fall through its case. So the exports stop it where it lay, and say so.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use super::ExportNote;
use super::scene::{Motion, Part, Scene, Tree};
use crate::geometry::{Mesh, SurfaceDistance};
use crate::twin::{JointKind, Model};

/// Share of the way seen by which a joint may have been beyond where it stood at first: noise.
const BEYOND: f64 = 0.05;
/// Least way by which a joint shows to which side it goes: rad, m.
const LEAST_WAY: [f64; 2] = [0.1, 0.01];
/// How far the outermost point of the child is moved on for a try, m.
const TRY: f64 = 5e-3;
/// Share of the points that the try brings into the other, over those of the try to the open side.
const BLOCKED: f64 = 0.03;
/// Points of a surface that are tried at most.
const MOST_POINTS: usize = 1500;
/// Where the other end is open: three quarters of a round, rad; and this many times the way seen, or 1 m.
const OPEN: (f64, f64) = (4.7, 3.0);

/// Gives every single motion that began at one end of its way, and is blocked there by the other's surface, a stop.
pub(super) fn stop_where_it_lay(scene: &mut Scene, model: &Model) {
    let mut notes = Vec::new();
    for tree in &mut scene.trees {
        for k in 0..tree.parts.len() {
            let Some(range) = blocked(tree, k, model) else { continue };
            let part = &mut tree.parts[k];
            let Some(hold) = part.attachment.as_mut() else { continue };
            let motion = &mut hold.motions[0];
            let [low, high] = motion.stated_range;
            (motion.range, motion.lay) = (Some(range), true);
            motion.stated_range = [low.max(range[0]), high.min(range[1])];
            let words = "assumed: a stop where the two lay on each other at the first view; no end was felt there";
            notes.push(ExportNote::new("all", &hold.joint, words));
        }
    }
    scene.notes.extend(notes);
}

/// The range of a motion that cannot go on to the side on which it stood at first.
fn blocked(tree: &Tree, k: usize, model: &Model) -> Option<[f64; 2]> {
    let part = &tree.parts[k];
    let hold = part.hold()?;
    let single = matches!(hold.kind, JointKind::Revolute | JointKind::Prismatic);
    let [motion] = &hold.motions[..] else { return None };
    if !single || motion.range.is_some() || hold.follows.is_some() {
        return None;
    }
    let joint = model.twin.joints().find(|j| j.name == hold.joint)?;
    let start = joint.position.as_ref().map_or(0.0, |p| p.value);
    let ends = joint.travelled?.map(|v| v - start);
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let way = high - low;
    if way < LEAST_WAY[usize::from(!motion.turns)] {
        return None;
    }
    let closing = match () {
        () if low > -BEYOND * way => -1.0,
        () if high < BEYOND * way => 1.0,
        () => return None,
    };
    let pair = Pair {
        parent: surface(&tree.parts[hold.parent], model)?,
        child: surface(part, model)?,
        parent_from_part: hold.parent_from_part,
    };
    let step = if motion.turns { TRY / pair.reach(motion) } else { TRY };
    let [closed, open] = [closing, -closing].map(|side| pair.overlap(motion, side * step));
    if closed? - open? < BLOCKED {
        return None;
    }
    let far = if motion.turns { OPEN.0 } else { (OPEN.1 * way).max(1.0) };
    Some(if closing < 0.0 { [0.0, far] } else { [-far, 0.0] })
}

/// The closed surface of a part, in its own frame.
fn surface(part: &Part, model: &Model) -> Option<Mesh> {
    let mesh = model.meshes.get(part.visual.as_ref()?).filter(|_| !part.flat)?;
    Some(mesh.transformed(&Isometry3::from_parts(
        Translation3::from(part.link_origin),
        UnitQuaternion::identity(),
    )))
}

struct Pair {
    parent: Mesh,
    child: Mesh,
    parent_from_part: Isometry3<f64>,
}

impl Pair {
    /// Distance of the outermost point of the child from the axis.
    fn reach(&self, motion: &Motion) -> f64 {
        let arms = self.child.vertices.iter().map(|v| v.coords.cross(&motion.axis).norm());
        arms.fold(TRY, f64::max)
    }

    /// Share of the points of either surface that lie inside the other, once the child has moved on.
    fn overlap(&self, motion: &Motion, by: f64) -> Option<f64> {
        let moved = if motion.turns {
            Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&motion.axis, by),
            )
        } else {
            Isometry3::from_parts(
                Translation3::from(motion.axis.into_inner() * by),
                UnitQuaternion::identity(),
            )
        };
        let parent_from_child = self.parent_from_part * moved;
        let child_from_parent = parent_from_child.inverse();
        let within = share_within(&self.child, &self.parent, &parent_from_child)?;
        Some(within + share_within(&self.parent, &self.child, &child_from_parent)?)
    }
}

fn share_within(points: &Mesh, body: &Mesh, body_from_points: &Isometry3<f64>) -> Option<f64> {
    let inside = SurfaceDistance::new(body)?;
    let step = points.vertices.len().div_ceil(MOST_POINTS).max(1);
    let places: Vec<Point3<f64>> = points
        .vertices
        .iter()
        .step_by(step)
        .map(|v| body_from_points * v)
        .collect();
    let within = |p: &&Point3<f64>| inside.signed_or_guessed(p) < 0.0;
    Some(places.iter().filter(within).count() as f64 / places.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::super::adopt::empty;
    use super::super::layout::lay_out;
    use crate::base::{Estimate, Pose};
    use crate::geometry::solids::{cuboid, subdivided};
    use crate::twin::{Body, Joint, JointEffects, JointKind, Link, Model};
    use nalgebra::Isometry3;

    /// A case of 120 x 90 x 60 mm with a lid of 6 mm, hinged at its edge, whose middle is at a height.
    fn lidded(height: f64, travelled: [f64; 2]) -> Model {
        let mut model = empty("box");
        let mut body = Body::rigid(Link::new("case", Pose(Isometry3::translation(0.0, 0.0, 0.03))));
        let lid = Pose(Isometry3::translation(0.0, 0.0, height));
        body.links.push(Link::new("lid", lid));
        for (link, size) in body.links.iter_mut().zip([[0.12, 0.09, 0.06], [0.12, 0.09, 0.006]]) {
            let path = format!("{}.obj", link.name);
            model
                .meshes
                .insert(path.clone(), subdivided(&subdivided(&cuboid(size))));
            link.mesh = Some(path);
        }
        body.joints.push(Joint {
            name: "case_lid".into(),
            kind: JointKind::Revolute,
            parent: "case".into(),
            child: "lid".into(),
            probability: 0.98,
            alternatives: Vec::new(),
            axis: Estimate::known([0.0, -1.0, 0.0], None, "1"),
            origin: Estimate::known([-0.06, 0.0, 0.06], None, "m"),
            pitch: None,
            limits: None,
            travelled: Some(travelled),
            position: None,
            friction: None,
            damping: None,
            stiffness: None,
            rest: None,
            effort: None,
            effects: JointEffects::default(),
            lateral: None,
        });
        model.twin.bodies.push(body);
        model
    }

    #[test]
    fn a_lid_that_lay_on_its_rim_stops_there_and_one_that_hangs_clear_does_not() {
        let range = |height: f64, travelled: [f64; 2]| {
            let scene = lay_out(&lidded(height, travelled)).expect("laid out");
            let told = scene.notes.iter().any(|n| n.message.contains("lay on each other"));
            let hold = scene.parts().find_map(|(_, p)| p.hold()).expect("a joint");
            (hold.motions[0].range, told)
        };
        let (stop, told) = range(0.0635, [-0.01, 1.2]);
        let [low, high] = stop.expect("a stop");
        assert!(low == 0.0 && high > 3.0 && told, "{low} {high}");
        let (stop, _) = range(0.0635, [-1.2, 0.01]);
        assert!(stop.is_none(), "what went through its case has no stop there: {stop:?}");
        assert_eq!(range(0.0635, [-0.6, 1.2]), (None, false));
        assert_eq!(range(0.085, [-0.01, 1.2]), (None, false));
    }
}
