//! A solid made ready for contact: feet, shell, pieces, friction, and what it stands on.

use nalgebra::Translation3;

use super::body::{RigidBody, reach_of};
use super::distance::Piece;
use super::footprint::{Foot, lowest_of, shell, underside};
use super::friction::DryFriction;
use super::patch::{Patch, Spring, Standing};
use crate::lab::{FrictionSpec, Scene, Solid};

/// Gap within which a thing rests on another at first, m.
const TOUCHING: f64 = 3e-4;

/// A solid with what the contacts need of it.
pub(super) struct Prepared<'a> {
    pub solid: &'a Solid,
    pub feet: Vec<(Foot, f64)>,
    pub shell: Vec<(Foot, f64)>,
    pub pieces: Vec<Piece>,
    friction: FrictionSpec,
}

impl<'a> Prepared<'a> {
    /// Reads the friction of its body in the scene.
    pub fn new(scene: &Scene, solid: &'a Solid) -> Self {
        let spec = scene.body.iter().find(|b| b.name == solid.name);
        Self {
            solid,
            feet: underside(solid),
            shell: shell_of(solid),
            pieces: solid.parts.iter().map(|part| Piece::of(solid, part)).collect(),
            friction: spec.map(|s| s.friction).unwrap_or_default(),
        }
    }
}

/// Points all over a solid: of its pieces, or of its surface where it has many.
pub(super) fn shell_of(solid: &Solid) -> Vec<(Foot, f64)> {
    let com = solid.com.coords;
    if solid.parts.len() > 6 && !solid.mesh.vertices.is_empty() {
        let every = solid.mesh.vertices.len().div_ceil(96);
        let points = solid.mesh.vertices.iter().step_by(every);
        return points
            .map(|p| {
                (
                    Foot::Ball {
                        at: p.coords - com,
                        radius: 0.0,
                    },
                    1.0,
                )
            })
            .collect();
    }
    let parts = solid.parts.iter().flat_map(|part| {
        shell(&part.shape)
            .into_iter()
            .map(move |(p, radius)| (part.body_from_part.0 * nalgebra::Point3::from(p), radius))
    });
    parts
        .map(|(p, radius)| {
            (
                Foot::Ball {
                    at: p.coords - com,
                    radius,
                },
                1.0,
            )
        })
        .collect()
}

/// Whether `upper` rests on `lower` where they are at first.
pub(crate) fn rests_on(scene: &Scene, upper: &Solid, lower: &Solid) -> bool {
    let body = |solid: &Solid| RigidBody::new(solid, false, reach_of(solid));
    let (a, b) = (body(upper), body(lower));
    let gap = (a.frame.position - b.frame.position).norm() - a.reach - b.reach;
    gap < TOUCHING
        && !standing_patches(
            &Prepared::new(scene, upper),
            &Prepared::new(scene, lower),
            &a,
            &b,
            scene,
        )
        .is_empty()
}

/// The patches by which `upper` stands on `lower`; none where it does not.
pub(super) fn standing_patches(
    upper: &Prepared,
    lower: &Prepared,
    a: &RigidBody,
    b: &RigidBody,
    scene: &Scene,
) -> Vec<Patch> {
    let mass = if b.fixed { a.mass } else { a.mass.min(b.mass) };
    let law = law_of(scene, upper, lower);
    let mut rests = false;
    let patches = lower.pieces.iter().map(|piece| {
        let mut patch = Patch::new(&upper.feet, a.reach, piece.clone(), Spring::carrying(mass), law);
        let (depth, up) = patch.deepest(&a.frame, &b.frame);
        if depth.abs() < TOUCHING && up > 0.7 {
            patch.level_out(depth);
            rests = true;
        }
        patch
    });
    let patches: Vec<Patch> = patches.collect();
    if rests { patches } else { Vec::new() }
}

/// Friction of a pair: its own where the scene gives one, else that of the first.
pub(super) fn law_of(scene: &Scene, first: &Prepared, second: &Prepared) -> DryFriction {
    let (a, b) = (&first.solid.name, &second.solid.name);
    let pair = scene
        .pair
        .iter()
        .find(|p| (&p.a, &p.b) == (a, b) || (&p.b, &p.a) == (a, b));
    let friction = pair.map_or(first.friction, |p| p.friction);
    DryFriction::new(friction.static_, friction.kinetic)
}

/// The body on the table; none for what is held to the world.
pub(super) fn standing_of(prepared: &Prepared, body: &RigidBody) -> Option<Standing> {
    if body.fixed {
        return None;
    }
    let world_from_com = prepared.solid.world_from_body.0 * Translation3::from(prepared.solid.com.coords);
    let lowest = lowest_of(&prepared.feet, &world_from_com);
    let guards: Vec<(Foot, f64)> = prepared.shell.iter().map(|(foot, _)| (foot.clone(), 0.25)).collect();
    let law = DryFriction::new(prepared.friction.static_, prepared.friction.kinetic);
    Some(Standing::new(
        &prepared.feet,
        &guards,
        body.reach,
        body.mass,
        lowest,
        law,
    ))
}
