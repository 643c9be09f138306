//! USD Physics as text (`.usda`): bodies with matter, colliders, joints, and the intervals as custom data.
//!
//! Lengths are metres and masses kilograms, z is up. Angles of joints are degrees, as the schema has them. USD cannot
//! refer to OBJ files, so the meshes are inside.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Matrix3, Rotation3, SymmetricEigen, Unit, UnitQuaternion, Vector3};

use super::doubts::{self, Doubt};
use super::scene::{Attachment, Motion, Part, PartId, Scene, Tree};
use super::urdf::upright_to;
use super::xml::number;
use crate::twin::{Joint, JointKind, Link, Model};

/// Joints move in degrees.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The file's text.
pub(super) fn of_scene(scene: &Scene, model: &Model) -> String {
    let mut out = Usda::default();
    out.text
        .push_str("#usda 1.0\n(\n    defaultPrim = \"scene\"\n    kilogramsPerUnit = 1\n");
    out.text.push_str("    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n\n");
    for note in scene.notes_for("usd") {
        out.line(&format!("# {}: {}", note.about, note.message.replace('\n', " ")));
    }
    out.open("def Xform \"scene\"", &[], &[]);
    physics_scene(&mut out, scene);
    for (_, part) in scene.parts() {
        material(&mut out, part);
        out.colors(part);
    }
    support(&mut out, scene);
    for tree in &scene.trees {
        out.tree(tree, model);
    }
    for weld in &scene.welds {
        out.weld(scene, weld.ends, weld.breakaway);
    }
    out.close();
    out.text
}

#[derive(Default)]
pub(super) struct Usda {
    text: String,
    pub(super) depth: usize,
}

impl Usda {
    pub(super) fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{}{text}", "    ".repeat(self.depth));
    }

    /// Opens a prim with its applied schemas and the lines of its custom data.
    pub(super) fn open(&mut self, head: &str, schemas: &[&str], data: &[String]) {
        if schemas.is_empty() && data.is_empty() {
            self.line(head);
        } else {
            self.line(&format!("{head} ("));
            self.depth += 1;
            if !data.is_empty() {
                self.line("customData = {");
                self.depth += 1;
                data.iter().for_each(|d| self.line(d));
                self.depth -= 1;
                self.line("}");
            }
            if !schemas.is_empty() {
                let list: Vec<String> = schemas.iter().map(|s| format!("\"{s}\"")).collect();
                self.line(&format!("prepend apiSchemas = [{}]", list.join(", ")));
            }
            self.depth -= 1;
            self.line(")");
        }
        self.line("{");
        self.depth += 1;
    }

    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    fn place(&mut self, pose: &Isometry3<f64>) {
        self.line(&format!(
            "double3 xformOp:translate = {}",
            triple(&pose.translation.vector)
        ));
        self.line(&format!("quatd xformOp:orient = {}", quaternion(&pose.rotation)));
        self.line("uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]");
    }

    fn tree(&mut self, tree: &Tree, model: &Model) {
        let jointed = tree.parts.len() > 1;
        let schemas: &[&str] = if jointed { &["PhysicsArticulationRootAPI"] } else { &[] };
        self.open(&format!("def Xform \"{}_body\"", tree.name), schemas, &[]);
        for part in &tree.parts {
            self.part(part, model);
        }
        let path = |part: &Part| format!("</scene/{}_body/{}>", tree.name, part.name);
        for part in &tree.parts {
            if let Some(hold) = part.hold() {
                let known = model.twin.joints().find(|j| j.name == hold.joint);
                self.joint(hold, [path(&tree.parts[hold.parent]), path(part)], known);
            }
        }
        if let Some(root) = tree.parts.first().filter(|_| tree.anchored) {
            self.open(&format!("def PhysicsFixedJoint \"{}_hold\"", root.name), &[], &[]);
            self.line(&format!("rel physics:body1 = {}", path(root)));
            self.frames(&root.world_from_part, &Isometry3::identity());
            self.close();
        }
        self.close();
    }

    fn part(&mut self, part: &Part, model: &Model) {
        let data = model.twin.link(&part.link).map_or(Vec::new(), |l| link_data(l, part));
        let head = format!("def Xform \"{}\"", part.name);
        self.open(&head, &["PhysicsRigidBodyAPI", "PhysicsMassAPI"], &data);
        self.place(&part.world_from_part);
        let (moments, axes) = principal(&part.inertia);
        self.line(&format!("float physics:mass = {}", number(part.mass)));
        self.line(&format!("point3f physics:centerOfMass = {}", triple(&part.com)));
        self.line(&format!("float3 physics:diagonalInertia = {}", triple(&moments)));
        self.line(&format!("quatf physics:principalAxes = {}", quaternion(&axes)));
        if let Some(mesh) = part.visual.as_ref().and_then(|p| model.meshes.get(p)) {
            self.visual(part, mesh, model);
        }
        for (k, mesh) in part.hulls.iter().filter_map(|p| model.meshes.get(p)).enumerate() {
            let schemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "MaterialBindingAPI"];
            self.open(&format!("def Mesh \"{}_hull_{k}\"", part.name), &schemas, &[]);
            self.line("uniform token physics:approximation = \"convexHull\"");
            self.line("uniform token purpose = \"guide\"");
            let target = format!("</scene/{}_surface>", part.name);
            self.line(&format!("rel material:binding:physics = {target}"));
            self.mesh(mesh, &part.link_origin);
            self.close();
        }
        self.close();
    }

    /// Frames of a joint on its two bodies; the first may be the world.
    fn frames(&mut self, first: &Isometry3<f64>, second: &Isometry3<f64>) {
        for (k, frame) in [first, second].into_iter().enumerate() {
            let at = triple(&frame.translation.vector);
            self.line(&format!("point3f physics:localPos{k} = {at}"));
            self.line(&format!("quatf physics:localRot{k} = {}", quaternion(&frame.rotation)));
        }
    }

    /// The joint's axis is x of both frames. What has more than one freedom is the general joint with limits.
    fn joint(&mut self, hold: &Attachment, [parent, child]: [String; 2], known: Option<&Joint>) {
        let (kind, single) = match hold.kind {
            JointKind::Fixed => ("PhysicsFixedJoint", false),
            JointKind::Revolute | JointKind::Screw => ("PhysicsRevoluteJoint", true),
            JointKind::Prismatic => ("PhysicsPrismaticJoint", true),
            JointKind::Spherical => ("PhysicsSphericalJoint", false),
            JointKind::Cylindrical | JointKind::Planar => ("PhysicsJoint", false),
        };
        let motion = hold.motions.first().filter(|_| single);
        let drive = motion.filter(|m| m.stiffness > 0.0 || m.damping > 0.0);
        let instance = if motion.is_some_and(|m| m.turns) {
            "angular"
        } else {
            "linear"
        };
        let mut schemas: Vec<String> = drive
            .map(|_| format!("PhysicsDriveAPI:{instance}"))
            .into_iter()
            .collect();
        let locked = locked(hold.kind);
        schemas.extend(locked.iter().map(|axis| format!("PhysicsLimitAPI:{axis}")));
        let schemas: Vec<&str> = schemas.iter().map(String::as_str).collect();
        self.open(
            &format!("def {kind} \"{}\"", hold.name),
            &schemas,
            &joint_data(hold, known),
        );
        self.line(&format!("rel physics:body0 = {parent}"));
        self.line(&format!("rel physics:body1 = {child}"));
        let frame = Isometry3::from_parts(Vector3::zeros().into(), x_onto(&hold.axis));
        self.frames(&(hold.parent_from_part * frame), &frame);
        if single || hold.kind == JointKind::Spherical {
            self.line("uniform token physics:axis = \"X\"");
        }
        if let Some(motion) = motion {
            self.limits(motion);
        }
        for axis in locked {
            self.line(&format!("float limit:{axis}:physics:low = 1"));
            self.line(&format!("float limit:{axis}:physics:high = -1"));
        }
        if let Some(motion) = drive {
            self.drive(motion, instance);
        }
        self.close();
    }

    fn limits(&mut self, motion: &Motion) {
        let unit = if motion.turns { DEGREE } else { 1.0 };
        if let Some([low, high]) = motion.range {
            self.line(&format!("float physics:lowerLimit = {}", number(low / unit)));
            self.line(&format!("float physics:upperLimit = {}", number(high / unit)));
        }
    }

    /// A drive towards the rest position is a spring, towards standstill a damper.
    fn drive(&mut self, motion: &Motion, instance: &str) {
        let unit = if motion.turns { DEGREE } else { 1.0 };
        let head = format!("drive:{instance}:physics");
        self.line(&format!("uniform token {head}:type = \"force\""));
        self.line(&format!("float {head}:stiffness = {}", number(motion.stiffness * unit)));
        self.line(&format!("float {head}:damping = {}", number(motion.damping * unit)));
        self.line(&format!("float {head}:targetPosition = {}", number(motion.rest / unit)));
    }

    fn weld(&mut self, scene: &Scene, [a, b]: [PartId; 2], breakaway: Option<f64>) {
        let path = |id: PartId| format!("</scene/{}_body/{}>", scene.trees[id.tree].name, scene.part(id).name);
        let name = format!("{}_{}_bond", scene.part(a).name, scene.part(b).name);
        self.open(&format!("def PhysicsFixedJoint \"{name}\""), &[], &[]);
        self.line(&format!("rel physics:body0 = {}", path(a)));
        self.line(&format!("rel physics:body1 = {}", path(b)));
        let between = scene.part(a).world_from_part.inverse() * scene.part(b).world_from_part;
        self.frames(&between, &Isometry3::identity());
        if let Some(force) = breakaway {
            self.line(&format!("float physics:breakForce = {}", number(force)));
        }
        self.close();
    }
}

fn physics_scene(out: &mut Usda, scene: &Scene) {
    out.open("def PhysicsScene \"physics\"", &[], &[]);
    let size = scene.gravity.norm();
    let down = if size > 0.0 {
        scene.gravity / size
    } else {
        -Vector3::z()
    };
    out.line(&format!("vector3f physics:gravityDirection = {}", triple(&down)));
    out.line(&format!("float physics:gravityMagnitude = {}", number(size)));
    out.close();
}

fn material(out: &mut Usda, part: &Part) {
    let s = &part.surface;
    let head = format!("def Material \"{}_surface\"", part.name);
    out.open(&head, &["PhysicsMaterialAPI"], &[]);
    out.line(&format!("float physics:staticFriction = {}", number(s.static_friction)));
    out.line(&format!(
        "float physics:dynamicFriction = {}",
        number(s.kinetic_friction)
    ));
    out.line(&format!(
        "float physics:restitution = {}",
        number(s.restitution.unwrap_or(0.0))
    ));
    out.close();
}

fn support(out: &mut Usda, scene: &Scene) {
    let Some(floor) = &scene.floor else { return };
    out.open("def Plane \"support\"", &["PhysicsCollisionAPI"], &[]);
    out.line("uniform token axis = \"Z\"");
    out.line("double width = 4");
    out.line("double length = 4");
    out.place(&Isometry3::from_parts(floor.point.into(), upright_to(&floor.normal)));
    out.close();
}

/// The freedoms that a general joint takes away: x is the joint's axis.
fn locked(kind: JointKind) -> &'static [&'static str] {
    match kind {
        JointKind::Cylindrical => &["transY", "transZ", "rotY", "rotZ"],
        JointKind::Planar => &["transX", "rotY", "rotZ"],
        _ => &[],
    }
}

/// Principal moments and the turn from the part's axes onto theirs.
fn principal(inertia: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let eigen = SymmetricEigen::new(*inertia);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let turn = Rotation3::from_matrix_unchecked(axes);
    (eigen.eigenvalues, UnitQuaternion::from_rotation_matrix(&turn))
}

fn link_data(link: &Link, part: &Part) -> Vec<String> {
    let mut out: Vec<String> = doubts::of_link(link).iter().flat_map(told).collect();
    if !part.assumed.is_empty() {
        out.push(format!("string assumed = \"{}\"", part.assumed.join(", ")));
    }
    out
}

fn joint_data(hold: &Attachment, joint: Option<&Joint>) -> Vec<String> {
    let Some(joint) = joint else { return Vec::new() };
    let mut out: Vec<String> = doubts::of_joint(joint).iter().flat_map(told).collect();
    out.push(format!("double probability = {}", number(joint.probability)));
    if hold.kind == JointKind::Screw {
        out.push("string stand_in = \"a screw turns without advancing here\"".into());
    }
    out
}

/// A number, and its interval where it is closed.
fn told(doubt: &Doubt) -> Vec<String> {
    let name = &doubt.name;
    let mut out = vec![format!("double {name} = {}", number(doubt.value))];
    if let Some([low, high]) = doubt.interval {
        out.push(format!("double2 {name}_ci95 = ({}, {})", number(low), number(high)));
    }
    out
}

/// The smallest turn of x onto `axis`.
fn x_onto(axis: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::x(), axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI))
}

pub(super) fn triple(v: &Vector3<f64>) -> String {
    format!("({}, {}, {})", number(v.x), number(v.y), number(v.z))
}

/// Scalar first.
fn quaternion(q: &UnitQuaternion<f64>) -> String {
    format!("({}, {}, {}, {})", number(q.w), number(q.i), number(q.j), number(q.k))
}
