//! glTF 2.0, binary: the scene to look at and, by KHR_physics_rigid_bodies and KHR_implicit_shapes, to run.
//!
//! Both extensions are drafts; what is written follows the schema in which a collider has a `geometry` that
//! is either a `shape` or a `node` with a mesh. glTF is y-up: one root node turns the z-up world.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::glb_buffer::Buffer;
use super::scene::{Attachment, Floor, Motion, Part, Scene, Tree};
use super::urdf::upright_to;
use crate::base::{Error, Result};
use crate::twin::{JointKind, Model, SCENE_MESH};

/// Name of the extension for bodies and joints.
pub(super) const PHYSICS: &str = "KHR_physics_rigid_bodies";
const SHAPES: &str = "KHR_implicit_shapes";
/// Edge of the cube that stands for a shape which nobody saw, m.
const MARKER: f64 = 0.01;
/// Materials without an image; those with one follow.
const PLAIN: usize = 2;
/// Half edge and thickness of the slab that stands for the table, m.
const SLAB: [f64; 2] = [0.5, 0.01];

/// A file in the making.
#[derive(Default)]
pub(super) struct Document {
    pub(super) buffer: Buffer,
    pub(super) nodes: Vec<Value>,
    meshes: Vec<Value>,
    images: Vec<Value>,
    surfaces: Vec<Value>,
    joints: Vec<Value>,
}

/// The file's bytes.
pub(super) fn of_scene(scene: &Scene, model: &Model) -> Result<Vec<u8>> {
    let (document, root) = Document::of(scene, model)?;
    Ok(document.finish_as(scene, root, |_| ()))
}

impl Document {
    /// The scene with its meshes, and the root of its nodes.
    pub(super) fn of(scene: &Scene, model: &Model) -> Result<(Self, usize)> {
        let mut document = Self::default();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        let root = document.node("scene", &Isometry3::from_parts(Translation3::identity(), turn));
        let seen = model.meshes.get(SCENE_MESH).filter(|m| !m.triangles.is_empty());
        if let Some(floor) = &scene.floor {
            let slab = document.table(floor, seen.is_none());
            document.adopt(root, slab);
        }
        if let Some(mesh) = seen {
            let node = document.node("_scene", &Isometry3::identity());
            let primitive = document.buffer.primitive(mesh, true, 0);
            document.nodes[node]["mesh"] = json!(document.mesh("_scene", primitive));
            document.adopt(root, node);
        }
        for tree in &scene.trees {
            let top = document.tree(tree, model)?;
            document.adopt(root, top);
        }
        if document.meshes.is_empty() {
            document.markers(scene);
        }
        Ok((document, root))
    }

    /// A small cube on each part of a scene of which nobody saw a shape: viewers refuse a file that shows nothing.
    fn markers(&mut self, scene: &Scene) {
        for (_, part) in scene.parts() {
            let Some(holder) = self.nodes.iter().position(|n| n["name"] == part.name.as_str()) else {
                continue;
            };
            let name = format!("{}_marker", part.name);
            let node = self.node(&name, &Isometry3::identity());
            let cube = super::inertial::cuboid_mesh(Vector3::repeat(MARKER));
            let primitive = self.buffer.primitive(&cube, true, 1);
            self.nodes[node]["mesh"] = json!(self.mesh(&name, primitive));
            self.nodes[node]["extras"] = json!({ "marker": "nobody saw the shape of what stands here" });
            self.adopt(holder, node);
        }
    }

    fn node(&mut self, name: &str, pose: &Isometry3<f64>) -> usize {
        let (t, q) = (pose.translation.vector, pose.rotation);
        let mut node = json!({ "name": name });
        if t != Vector3::zeros() {
            node["translation"] = json!([t.x, t.y, t.z]);
        }
        if q != UnitQuaternion::identity() {
            node["rotation"] = json!([q.i, q.j, q.k, q.w]);
        }
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn adopt(&mut self, parent: usize, child: usize) {
        match self.nodes[parent]["children"].as_array_mut() {
            Some(children) => children.push(json!(child)),
            None => self.nodes[parent]["children"] = json!([child]),
        }
    }

    fn mesh(&mut self, name: &str, primitive: Value) -> usize {
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        self.meshes.len() - 1
    }

    /// A thin slab whose top is the table; not drawn where the table itself was seen and is.
    fn table(&mut self, floor: &Floor, drawn: bool) -> usize {
        let centre = floor.point - floor.normal.into_inner() * (0.5 * SLAB[1]);
        let pose = Isometry3::from_parts(centre.into(), upright_to(&floor.normal));
        let node = self.node("support", &pose);
        if drawn {
            let slab = super::inertial::cuboid_mesh(Vector3::new(2.0 * SLAB[0], 2.0 * SLAB[0], SLAB[1]));
            let primitive = self.buffer.primitive(&slab, true, 1);
            self.nodes[node]["mesh"] = json!(self.mesh("support", primitive));
        }
        self.surfaces.push(
            json!({ "staticFriction": 0.0, "dynamicFriction": 0.0, "restitution": 0.0,
            "frictionCombine": "maximum", "restitutionCombine": "maximum" }),
        );
        let surface = self.surfaces.len() - 1;
        let collider = json!({ "geometry": { "shape": 0 }, "physicsMaterial": surface });
        self.nodes[node]["extensions"] = json!({ PHYSICS: { "collider": collider } });
        node
    }

    /// The nodes of a tree; returns its root's.
    fn tree(&mut self, tree: &Tree, model: &Model) -> Result<usize> {
        let mut nodes: Vec<usize> = Vec::new();
        for part in &tree.parts {
            let world_from_link = link_pose(part);
            let above = part.hold().map(|h| (h, &tree.parts[h.parent], nodes[h.parent]));
            let pose = above.map_or(world_from_link, |(_, p, _)| link_pose(p).inverse() * world_from_link);
            let node = self.part(part, &pose, tree.anchored && above.is_none(), model)?;
            if let Some((hold, parent, parent_node)) = above {
                self.adopt(parent_node, node);
                self.joint(hold, (parent, parent_node), (part, node), model);
            }
            nodes.push(node);
        }
        nodes
            .first()
            .copied()
            .ok_or_else(|| Error::Failed(format!("body {} has no link", tree.name)))
    }

    fn part(&mut self, part: &Part, pose: &Isometry3<f64>, anchored: bool, model: &Model) -> Result<usize> {
        let node = self.node(&part.name, pose);
        let visual = part.visual.as_ref().and_then(|p| model.meshes.get(p));
        if let Some(mesh) = visual.filter(|m| !m.triangles.is_empty()) {
            let texture = part.visual.as_ref().and_then(|p| model.textures.get(p));
            let primitive = match texture.and_then(|t| Some((t, t.png()?))) {
                Some((texture, png)) => {
                    let image = self.buffer.image(&png);
                    self.images
                        .push(json!({ "name": part.name, "bufferView": image, "mimeType": "image/png" }));
                    self.buffer.textured(mesh, texture, PLAIN + self.images.len() - 1)
                }
                None => self.buffer.primitive(mesh, true, 0),
            };
            self.nodes[node]["mesh"] = json!(self.mesh(&part.name, primitive));
        }
        if !anchored {
            self.nodes[node]["extensions"] = json!({ PHYSICS: { "motion": motion(part) } });
        }
        if let Some(link) = model.twin.link(&part.link) {
            let twin = serde_json::to_value(link).map_err(|e| Error::Failed(e.to_string()))?;
            self.nodes[node]["extras"] = json!({ "twin": twin, "assumed": part.assumed });
        }
        self.colliders(part, node, model);
        Ok(node)
    }

    /// A child node for each convex part. The node that lends its mesh stands outside the scene, so that
    /// viewers do not draw it.
    fn colliders(&mut self, part: &Part, node: usize, model: &Model) {
        let s = &part.surface;
        self.surfaces.push(
            json!({ "staticFriction": s.static_friction, "dynamicFriction": s.kinetic_friction,
            "restitution": s.restitution.unwrap_or(0.0),
            "frictionCombine": "maximum", "restitutionCombine": "maximum" }),
        );
        let surface = self.surfaces.len() - 1;
        for (k, path) in part.hulls.iter().enumerate() {
            let Some(mesh) = model.meshes.get(path).filter(|m| !m.triangles.is_empty()) else {
                continue;
            };
            let name = format!("{}_hull_{k}", part.name);
            let primitive = self.buffer.primitive(mesh, false, 0);
            let lender = self.node(&name, &Isometry3::identity());
            self.nodes[lender]["mesh"] = json!(self.mesh(&name, primitive));
            let collider = self.node(&format!("{name}_collider"), &Isometry3::identity());
            self.nodes[collider]["extensions"] = json!({ PHYSICS: { "collider": {
                "geometry": { "node": lender, "convexHull": true }, "physicsMaterial": surface } } });
            self.adopt(node, collider);
        }
    }

    /// Two nodes at the joint, x along its axis: one on the parent, one on the child, which is constrained.
    fn joint(&mut self, hold: &Attachment, parent: (&Part, usize), child: (&Part, usize), model: &Model) {
        let turn = UnitQuaternion::rotation_between(&Vector3::x(), &hold.axis)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI));
        let world = child.0.world_from_part * turn;
        let ends = [(parent, "parent"), (child, "child")].map(|((part, node), side)| {
            let pose = link_pose(part).inverse() * world;
            let end = self.node(&format!("{}_{side}", hold.name), &pose);
            self.adopt(node, end);
            end
        });
        self.joints.push(description(hold));
        let joint = json!({ "connectedNode": ends[0], "joint": self.joints.len() - 1, "enableCollision": false });
        self.nodes[ends[1]]["extensions"] = json!({ PHYSICS: { "joint": joint } });
        let twin = model.twin.joints().find(|j| j.name == hold.joint);
        if let Some(value) = twin.and_then(|j| serde_json::to_value(j).ok()) {
            self.nodes[ends[1]]["extras"] = json!({ "twin": value });
        }
    }

    /// The file's bytes, with a last change to what is in it.
    pub(super) fn finish_as(self, scene: &Scene, root: usize, change: impl FnOnce(&mut Value)) -> Vec<u8> {
        let mut used = vec![PHYSICS];
        let mut extensions = json!({ PHYSICS: { "physicsMaterials": self.surfaces, "physicsJoints": self.joints } });
        if scene.floor.is_some() {
            used.push(SHAPES);
            let size = [2.0 * SLAB[0], 2.0 * SLAB[0], SLAB[1]];
            extensions[SHAPES] = json!({ "shapes": [{ "type": "box", "box": { "size": size } }] });
        }
        for list in ["physicsMaterials", "physicsJoints"] {
            if extensions[PHYSICS][list].as_array().is_some_and(Vec::is_empty) {
                extensions[PHYSICS].as_object_mut().map(|o| o.shift_remove(list));
            }
        }
        let notes: Vec<String> = scene
            .notes_for("gltf")
            .map(|n| format!("{}: {}", n.about, n.message))
            .collect();
        let plain = |r: f64, g: f64, b: f64| {
            json!({ "doubleSided": true, "pbrMetallicRoughness":
                { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 } })
        };
        let mut materials = vec![plain(1.0, 1.0, 1.0), plain(0.6, 0.57, 0.52)];
        for texture in 0..self.images.len() {
            let mut material = plain(1.0, 1.0, 1.0);
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": texture });
            materials.push(material);
        }
        let mut document = json!({
            "asset": { "version": "2.0", "generator": concat!("palpate ", env!("CARGO_PKG_VERSION")),
                       "extras": { "notes": notes, "gravity": scene.gravity.as_slice() } },
            "extensionsUsed": used, "extensions": extensions,
            "scene": 0, "scenes": [{ "name": scene.name, "nodes": [root] }], "nodes": self.nodes,
        });
        if !self.meshes.is_empty() {
            document["materials"] = Value::Array(materials);
            document["meshes"] = Value::Array(self.meshes);
        }
        if !self.images.is_empty() {
            let each = (0..self.images.len()).map(|source| json!({ "source": source, "sampler": 0 }));
            document["textures"] = each.collect();
            // Linear, clamped to the edge, no smaller copies: the gutters are two pixels.
            document["samplers"] = json!([{ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 }]);
            document["images"] = Value::Array(self.images);
        }
        change(&mut document);
        self.buffer.container(document)
    }
}

/// World-from-link: the twin's own frame, whose axes are the part's.
pub(super) fn link_pose(part: &Part) -> Isometry3<f64> {
    part.world_from_part * Translation3::from(part.link_origin)
}

fn motion(part: &Part) -> Value {
    let com = part.com - part.link_origin;
    let (moments, axes) = principal(&part.inertia);
    json!({ "mass": part.mass, "centerOfMass": com.as_slice(), "inertiaDiagonal": moments.as_slice(),
            "inertiaOrientation": [axes.i, axes.j, axes.k, axes.w] })
}

/// Principal moments, and the rotation from the principal axes to the part's.
fn principal(inertia: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let diagonal = Matrix3::from_diagonal(&inertia.diagonal());
    if (inertia - diagonal).norm() <= 1e-12 * inertia.norm() {
        return (inertia.diagonal(), UnitQuaternion::identity());
    }
    let eigen = inertia.symmetric_eigen();
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes = -axes;
    }
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    (eigen.eigenvalues, UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Limits of the axes that are held, the range of the one that moves, and its spring and damper. The
/// joint's x axis is the twin's axis.
fn description(hold: &Attachment) -> Value {
    let (linear, angular): (&[u8], &[u8]) = match hold.kind {
        JointKind::Fixed => (&[0, 1, 2], &[0, 1, 2]),
        JointKind::Revolute | JointKind::Screw => (&[0, 1, 2], &[1, 2]),
        JointKind::Prismatic => (&[1, 2], &[0, 1, 2]),
        JointKind::Cylindrical => (&[1, 2], &[1, 2]),
        JointKind::Planar => (&[0], &[1, 2]),
        JointKind::Spherical => (&[0, 1, 2], &[]),
    };
    let mut limits = Vec::new();
    if !linear.is_empty() {
        limits.push(json!({ "linearAxes": linear, "min": 0.0, "max": 0.0 }));
    }
    if !angular.is_empty() {
        limits.push(json!({ "angularAxes": angular, "min": 0.0, "max": 0.0 }));
    }
    let along_x = |m: &&Motion| m.axis == hold.axis;
    let mut drives = Vec::new();
    for m in hold.motions.iter().filter(along_x) {
        let (axes, kind) = if m.turns {
            ("angularAxes", "angular")
        } else {
            ("linearAxes", "linear")
        };
        if let Some([low, high]) = m.range {
            limits.push(json!({ axes: [0], "min": low, "max": high }));
        }
        if m.stiffness > 0.0 || m.damping > 0.0 {
            drives.push(
                json!({ "type": kind, "mode": "force", "axis": 0, "stiffness": m.stiffness,
                "damping": m.damping, "positionTarget": m.rest, "velocityTarget": 0.0 }),
            );
        }
    }
    let mut joint = json!({ "limits": limits });
    if !drives.is_empty() {
        joint["drives"] = Value::Array(drives);
    }
    joint
}
