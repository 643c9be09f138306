//! What an outside engine must be told beside the exported files: names, frames, the table, bonds.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};
use serde::Serialize;

use super::engine::no_table;
use super::feet::{Corners, RADIUS, feet};
use super::layout::lay_out;
use super::scene::{Floor, Part, Scene, Tree};
use super::trial::{Hold, Trial, TrialShape, place};
use crate::base::{Error, Pose, Result};
use crate::twin::Model;

/// A scene for an engine that reads the exported files.
#[derive(Clone, Debug, Serialize)]
pub struct StagedScene {
    /// m/s², world.
    pub gravity: [f64; 3],
    /// A point of the table, m, world.
    pub point: [f64; 3],
    /// Away from the table, unit, world.
    pub normal: [f64; 3],
    /// What moves as one, in the order of the twin's bodies.
    pub trees: Vec<StagedTree>,
    /// Names of parts of different trees that move as one.
    pub welds: Vec<[String; 2]>,
    /// Radius of the balls on which things stand that have feet, m.
    pub foot: f64,
}

/// A body with its links.
#[derive(Clone, Debug, Serialize)]
pub struct StagedTree {
    /// Its own URDF, relative to the twin's folder.
    pub file: String,
    /// Held to the world.
    pub anchored: bool,
    /// World-from-root at the first view.
    pub pose: Pose,
    /// The root first.
    pub parts: Vec<StagedPart>,
}

/// A link as the exports have it.
#[derive(Clone, Debug, Serialize)]
pub struct StagedPart {
    /// In the exported files.
    pub name: String,
    /// In the twin.
    pub link: String,
    /// Where the link's frame has its origin, part frame, m; the axes are the same.
    pub origin: [f64; 3],
    /// Centre of mass, part frame, m.
    pub com: [f64; 3],
    /// Coefficient of kinetic friction against the table.
    pub friction: f64,
    /// How many convex parts it has; none: it touches nothing.
    pub hulls: usize,
    /// The exports state how stiff it is.
    pub soft: bool,
    /// Centres of the balls on which it stands in an engine that has no face with all its corners, part frame, m.
    pub feet: Vec<[f64; 3]>,
}

/// A trial in the frames of the exported files.
#[derive(Clone, Debug, Serialize)]
pub struct StagedTrial {
    /// The interaction's name.
    pub name: String,
    /// The part that is touched.
    pub target: String,
    /// The tool's shape.
    pub shape: TrialShape,
    /// How it is joined to the target.
    pub hold: Hold,
    /// Between the tool and the target.
    pub friction: f64,
    /// s.
    pub time: Vec<f64>,
    /// World-from-tool.
    pub path: Vec<Pose>,
    /// World-from-root at the start, by tree.
    pub roots: Vec<Pose>,
    /// Whether a tree takes part, by tree.
    pub present: Vec<bool>,
    /// Joints with one freedom by their names in the files, m or rad.
    pub positions: BTreeMap<String, f64>,
}

/// Lays a twin and its trials out for an outside engine.
///
/// # Errors
/// Where there is no table, a trial names no link, or the joints of a body do not make one tree.
pub fn stage(model: &Model, trials: &[Trial]) -> Result<(StagedScene, Vec<StagedTrial>)> {
    let scene = lay_out(model)?;
    let floor = scene.floor.as_ref();
    let floor = floor.ok_or_else(no_table)?;
    let solid = scene.trees.iter().filter(|t| touches(t));
    let staged = StagedScene {
        foot: RADIUS,
        gravity: scene.gravity.into(),
        point: floor.point.into(),
        normal: floor.normal.into_inner().into(),
        trees: solid.map(|t| tree(t, model, floor)).collect(),
        welds: welds(&scene),
    };
    let trials = trials.iter().map(|t| trial(&scene, t)).collect::<Result<_>>()?;
    Ok((staged, trials))
}

/// A tree without anything that could touch would only fall.
fn touches(tree: &Tree) -> bool {
    tree.parts.iter().any(|p| !p.is_bare())
}

fn welds(scene: &Scene) -> Vec<[String; 2]> {
    let both = |ends: &[super::scene::PartId; 2]| ends.iter().all(|id| touches(&scene.trees[id.tree]));
    let ends = scene.welds.iter().map(|w| w.ends).filter(both);
    ends.map(|e| e.map(|id| scene.part(id).name.clone())).collect()
}

fn tree(tree: &Tree, model: &Model, floor: &Floor) -> StagedTree {
    let root = tree.parts.first();
    StagedTree {
        file: format!("urdf/{}.urdf", tree.name),
        anchored: tree.anchored,
        pose: Pose(root.map_or_else(Isometry3::identity, |p| p.world_from_part)),
        parts: tree.parts.iter().map(|p| part(p, model, floor)).collect(),
    }
}

fn part(part: &Part, model: &Model, floor: &Floor) -> StagedPart {
    let feet = feet(part, model, Some(floor), Corners::Few);
    StagedPart {
        name: part.name.clone(),
        link: part.link.clone(),
        origin: part.link_origin.into(),
        com: part.com.into(),
        friction: part.surface.kinetic_friction,
        hulls: part.hulls.len(),
        soft: part.surface.compliance.is_some(),
        feet: feet.iter().map(|at| at.coords.into()).collect(),
    }
}

fn trial(scene: &Scene, trial: &Trial) -> Result<StagedTrial> {
    let missing = || Error::Failed(format!("{}: no link {} in the twin", trial.name, trial.target));
    let target = scene.find(&trial.target).ok_or_else(missing)?;
    let placed = place(scene, &trial.start);
    let trees = scene.trees.iter().zip(&placed.parts).filter(|(t, _)| touches(t));
    let here = trial.trees(scene);
    let solid = scene.trees.iter().filter(|t| touches(t));
    Ok(StagedTrial {
        name: trial.name.clone(),
        target: scene.part(target).name.clone(),
        shape: trial.shape.clone(),
        hold: trial.hold,
        friction: trial.friction,
        time: trial.time.clone(),
        path: trial.path.clone(),
        roots: trees.filter_map(|(_, p)| p.first().map(|r| Pose(*r))).collect(),
        present: solid.map(|t| here.contains(&t.name)).collect(),
        positions: placed.positions,
    })
}

impl StagedPart {
    /// World-from-link, from the pose of the part.
    pub fn link_pose(&self, world_from_part: &Pose) -> Pose {
        Pose(world_from_part.0 * Translation3::from(nalgebra::Vector3::from(self.origin)))
    }
}
