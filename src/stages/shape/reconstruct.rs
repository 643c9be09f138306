//! The verb of the shape pass.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::Config;
use super::anchor::{anchors, origins};
use super::borders::split_among;
use super::colours::part_by_colour;
use super::complete::{Context, FindSymmetry, claim, complete};
use super::discover::{Thing, discover, give_names, standing, without_crumbs};
use super::fields::{blocks_near_points, integrate, ranges};
use super::flat::warn_of_flat;
use super::given::{given_meshes, name_the_only_one, put_given};
use super::instances::part_by_instances;
use super::range::Range;
use super::solid::Part;
use super::split::Split;
use super::support::{Ground, find_support};
use super::volume::Volume;
use super::walls::clear_walls;
use crate::base::{Notices, Pose, Result};
use crate::capture::Capture;
use crate::geometry::{BlockGrid, Mesh, Texture, grid_surface, simplify, submesh};
use crate::twin::{Superquadric, SupportPlane, Symmetry};

/// Most blocks of a sparse field: bounds its memory near 200 MB.
const MOST_BLOCKS: usize = 14_000;
/// Most voxels of the dense volume around one thing: bounds its memory near 250 MB.
const MOST_VOXELS: f64 = 6e6;

/// Voxels of the scene as a whole, in voxels of the things.
const SCENE_COARSENESS: f64 = 2.0;
/// Most triangles of the scene as a whole.
const MOST_SCENE_TRIANGLES: usize = 150_000;

/// What the views show: the table and the things on it.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// The table, given or found; absent where there was neither.
    pub support: Option<SupportPlane>,
    /// The things, named as `docs/capture-format.md` says.
    pub objects: Vec<ShapedObject>,
    /// All that the views show, as an open coloured surface in the world frame; only where no support is given,
    /// so that the things are in a place that is worth showing.
    pub scene: Option<Mesh>,
}

/// One thing with its closed mesh.
#[derive(Clone, Debug)]
pub struct ShapedObject {
    /// From `bodies`, from the track that lies in it, or `object-0`, ….
    pub name: String,
    /// World-from-link at the first view: the track's frame where there is one, else the mesh's centre
    /// with the axes of the world.
    pub world_from_link: Pose,
    /// Closed mesh in the link frame.
    pub mesh: Mesh,
    /// Fraction of its area that was seen.
    pub seen: f64,
    /// Convex parts in the link frame, for contact; left empty here.
    pub collision: Vec<Mesh>,
    /// A superquadric that stands for the shape; left out here.
    pub superquadric: Option<Superquadric>,
    /// The colours that the views show on the mesh; left out here, and void once the mesh changes.
    pub texture: Option<Texture>,
}

/// Fuses the views, finds the table, separates the things, closes and colours their meshes.
///
/// # Errors
/// Settings that cannot work, and a `bodies` mesh that cannot be read.
pub fn reconstruct(capture: &Capture, config: &Config, notices: &mut Notices) -> Result<Shapes> {
    reconstruct_with(capture, config, &|_, _, _| Ok(Symmetry::default()), notices)
}

/// As `reconstruct`; what was not seen of a thing is completed by the symmetry that `find` is sure of.
///
/// # Errors
/// As `reconstruct`, and those of `find`.
pub fn reconstruct_with(
    capture: &Capture,
    config: &Config,
    find: &FindSymmetry,
    notices: &mut Notices,
) -> Result<Shapes> {
    config.check()?;
    let anchors = anchors(capture);
    let given = given_meshes(capture, &anchors, notices)?;
    if capture.views.is_empty() {
        let support = capture.support.as_ref().map(|s| SupportPlane {
            point: s.point.coords.into(),
            normal: s.normal.into_inner().into(),
            material: s.material.clone(),
            gravity: None,
        });
        return Ok(Shapes {
            support,
            objects: given,
            scene: None,
        });
    }
    let mut ranges = ranges(capture)?;
    let ground = find_support(capture, &ranges, notices);
    ranges.iter_mut().for_each(|r| r.seen_from(&ground.world_from_field));
    let floor = floor_above(&ground, config);
    let scene = capture
        .support
        .is_none()
        .then(|| scene(&ranges, config, &ground, notices))
        .transpose()?;
    let up = ground.world_from_field.rotation.inverse() * -capture.gravity.normalize();
    let room_up = scene.is_some().then_some(up);
    let named = origins(&anchors, &ground.world_from_field.inverse());
    let (things, room) = find_things(&ranges, config, floor, &named, room_up.as_ref(), notices)?;
    let mut things = part_by_instances(things, capture, &ranges, notices);
    for name in give_names(&mut things, named) {
        notices.note("shape", &name, "it is tracked, but the views do not show it");
    }
    let things = part_by_colour(things, (config.voxel, floor), notices);
    warn_of_flat(&ranges, &things, floor, &ground, notices);
    let seen = make_solids(&ranges, (&things, &room), config, floor, (&ground, find), notices)?;
    let mut objects = name_and_place(seen, &anchors, &ground.world_from_field);
    put_given(&mut objects, given);
    name_the_only_one(&mut objects, capture, &anchors, notices);
    Ok(Shapes {
        support: ground.plane,
        objects,
        scene,
    })
}

/// The whole coloured surface that the views show, with the table, open; in the world frame. The voxel grows
/// where the scene is too large for it.
///
/// # Errors
/// Settings that cannot work.
pub fn seen_surface(capture: &Capture, config: &Config, notices: &mut Notices) -> Result<Mesh> {
    config.check()?;
    let ranges = ranges(capture)?;
    let field = sparse_field(&ranges, config, |_| true, "scene", notices)?;
    Ok(grid_surface(&field, 0.0))
}

/// Height above which a surface is a thing and no longer the support, m.
fn floor_above(ground: &Ground, config: &Config) -> f64 {
    if ground.plane.is_none() {
        return f64::NEG_INFINITY;
    }
    (3.0 * ground.roughness).clamp(0.0025_f64.max(1.25 * config.voxel), 0.010)
}

fn sparse_field(
    ranges: &[Range],
    config: &Config,
    keep: impl Fn(&Point3<f64>) -> bool + Sync,
    about: &str,
    notices: &mut Notices,
) -> Result<BlockGrid> {
    let mut voxel = config.voxel;
    let mut keys = blocks_near_points(ranges, voxel, &keep);
    while keys.len() > MOST_BLOCKS {
        voxel *= (keys.len() as f64 / MOST_BLOCKS as f64).sqrt().max(1.1);
        keys = blocks_near_points(ranges, voxel, &keep);
    }
    if voxel > config.voxel {
        notices.note(
            "shape",
            about,
            format!("fused with voxels of {:.1} mm to bound the memory", voxel * 1e3),
        );
    }
    let mut field = BlockGrid::with_keys(voxel, &keys);
    integrate(&mut field, ranges, config.truncation * voxel)?;
    Ok(field)
}

/// The things, and the surface around them that belongs to none; `room_up`, against gravity, where there may
/// be walls.
fn find_things(
    ranges: &[Range],
    config: &Config,
    floor: f64,
    named: &[(String, Point3<f64>)],
    room_up: Option<&Vector3<f64>>,
    notices: &mut Notices,
) -> Result<(Vec<Thing>, Mesh)> {
    let field = sparse_field(ranges, config, |p| p.z > floor, "views", notices)?;
    let surface = grid_surface(&field, 0.0);
    let Some(up) = room_up else {
        return Ok((discover(&surface, floor, 1.5 * field.voxel, notices), Mesh::default()));
    };
    let (above, _) = submesh(&surface, |t| surface.corners(t).iter().all(|p| p.z > floor));
    let frames: Vec<Point3<f64>> = named.iter().map(|(_, p)| *p).collect();
    let mut room = clear_walls(above, ranges, up, &frames, notices);
    let pieces = discover(&room.inner, floor, 3.0 * field.voxel, notices);
    let (remains, pieces): (Vec<Thing>, Vec<Thing>) = pieces.into_iter().partition(|p| room.is_remains(&p.surface));
    for piece in remains {
        let area = piece.surface.area() * 1e4;
        notices.note(
            "shape",
            "views",
            format!("a piece of {area:.0} cm² is left over of a wall"),
        );
        room.outer.append(&piece.surface);
    }
    let things = standing(pieces, &frames, &mut room.outer, notices);
    Ok((things, room.outer))
}

/// All that the views show, in the world frame, coarser than the things.
fn scene(ranges: &[Range], config: &Config, ground: &Ground, notices: &mut Notices) -> Result<Mesh> {
    let coarse = Config {
        voxel: SCENE_COARSENESS * config.voxel,
        ..config.clone()
    };
    let field = sparse_field(ranges, &coarse, |_| true, "scene", notices)?;
    let mut mesh = without_crumbs(&grid_surface(&field, 0.0));
    let mut error = 0.1 * field.voxel;
    mesh = simplify(&mesh, error);
    while mesh.triangles.len() > MOST_SCENE_TRIANGLES {
        error *= 2.0;
        mesh = simplify(&mesh, error);
    }
    Ok(mesh.transformed(&ground.world_from_field))
}

/// A body's closed mesh in the field's frame, with the name that it was found under.
struct Solid {
    name: Option<String>,
    mesh: Mesh,
}

fn make_solids(
    ranges: &[Range],
    (things, room): (&[Thing], &Mesh),
    config: &Config,
    floor: f64,
    (ground, find): (&Ground, &FindSymmetry),
    notices: &mut Notices,
) -> Result<Vec<Solid>> {
    let mut solids = Vec::new();
    for (i, thing) in things.iter().enumerate() {
        let parts = split_among(things, i, config.voxel, notices);
        let mut volume = volume_of(ranges, (things, room), i, &parts, config, floor, notices)?;
        if let [] | [_] = &thing.named[..] {
            let context = Context {
                things,
                room,
                which: i,
                parts: &parts,
                ground,
            };
            complete(&mut volume, &context, config.truncation, find, notices)?;
        }
        for body in 0..thing.named.len().max(1) as u32 {
            let part = Part {
                volume: &volume,
                body,
                planes: &parts.planes,
            };
            let name = thing.named.get(body as usize).map(|(n, _)| n.clone());
            let about = name.clone().unwrap_or_else(|| "views".into());
            match part.mesh(ground.plane.is_some()) {
                Some(mesh) => solids.push(Solid { name, mesh }),
                None => notices.warn(
                    "shape",
                    &about,
                    "something was seen of which no closed body could be made",
                ),
            }
        }
    }
    Ok(solids)
}

fn volume_of(
    ranges: &[Range],
    (things, room): (&[Thing], &Mesh),
    which: usize,
    parts: &Split,
    config: &Config,
    floor: f64,
    notices: &mut Notices,
) -> Result<Volume> {
    let thing = &things[which];
    let bounds = thing.bounds();
    let extent = bounds.1 - bounds.0;
    let cells = |v: f64| extent.iter().map(|e| e / v + 14.0).product::<f64>();
    let mut voxel = config.voxel;
    while cells(voxel) > MOST_VOXELS {
        voxel *= 1.1;
    }
    if voxel > config.voxel {
        let about = thing.named.first().map_or("views", |(n, _)| n.as_str());
        let words = format!(
            "a thing of {:.2} m is meshed with voxels of {:.1} mm",
            extent.norm(),
            voxel * 1e3
        );
        notices.note("shape", about, words);
    }
    let mut volume = Volume::build(ranges, voxel, config.truncation * voxel, floor, bounds)?;
    claim(&mut volume, things, room, which, parts);
    Ok(volume)
}

/// Names what has none, and moves every mesh into its link frame.
fn name_and_place(
    solids: Vec<Solid>,
    anchors: &BTreeMap<String, Pose>,
    world_from_field: &Isometry3<f64>,
) -> Vec<ShapedObject> {
    let taken: BTreeSet<String> = solids.iter().filter_map(|s| s.name.clone()).collect();
    let mut free = (0..).map(|i| format!("object-{i}")).filter(|n| !taken.contains(n));
    let named: Vec<(String, Mesh)> = solids
        .into_iter()
        .map(|s| (s.name.or_else(|| free.next()).unwrap_or_default(), s.mesh))
        .collect();
    named
        .into_par_iter()
        .map(|(name, mesh)| place(anchors.get(&name).copied(), name, mesh, world_from_field))
        .collect()
}

fn place(anchor: Option<Pose>, name: String, mut mesh: Mesh, world_from_field: &Isometry3<f64>) -> ShapedObject {
    for p in &mut mesh.vertices {
        *p = world_from_field * *p;
    }
    let world_from_link = anchor.unwrap_or_else(|| {
        let middle = mesh
            .bounds()
            .map_or(Point3::origin(), |(low, high)| nalgebra::center(&low, &high));
        Pose(Isometry3::from_parts(
            Translation3::from(middle.coords),
            UnitQuaternion::identity(),
        ))
    });
    let seen = seen_fraction(&mesh);
    let link_from_world = world_from_link.0.inverse();
    for p in &mut mesh.vertices {
        *p = link_from_world * *p;
    }
    ShapedObject {
        name,
        world_from_link,
        mesh,
        seen,
        collision: Vec::new(),
        superquadric: None,
        texture: None,
    }
}

/// Share of the area whose three corners were seen.
fn seen_fraction(mesh: &Mesh) -> f64 {
    let seen = |t: usize| mesh.seen.is_empty() || mesh.triangles[t].iter().all(|v| mesh.seen[*v as usize]);
    let area: f64 = (0..mesh.triangles.len())
        .filter(|t| seen(*t))
        .map(|t| 0.5 * mesh.scaled_normal(t).norm())
        .sum();
    area / mesh.area().max(1e-12)
}
