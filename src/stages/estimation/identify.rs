//! The verb of the physics pass.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::Config;
use super::basins::told_of_basins;
use super::body::{fill_inertial, write_centre, write_presses};
use super::chain::fit_chains;
use super::coast::Shape;
use super::facts::{Facts, Ground, gather, ground_of};
use super::finger::fit_fingers;
use super::joint::joint_dynamics;
use super::materials::{MaterialFriction, material_friction};
use super::push::Plane;
use super::resolve::{Before, conclude};
use super::rolling::write_rolling;
use super::share::share_out;
use super::solid::{Solid, solid_of};
use super::toss::identify_tosses;
use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::geometry::Mesh;
use crate::physics::{LimitSurface, pressed_underside};
use crate::twin::{Joint, Model};

/// Writes matter (mass, centre of mass, inertia, friction, stiffness) into the links of `model`, and
/// friction, damping and spring into its joints, from the interactions that are not held out.
pub fn identify(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    config: &Config,
    notices: &mut Notices,
) -> Result<()> {
    config.check()?;
    let ground = ground_of(capture, &model.twin);
    let befores = befores(capture, model, &config.materials)?;
    let shapes = shapes(model, &befores, &ground);
    let facts = gather(capture, segmented, &ground, model, &shapes, config, notices);
    // Also of what was never touched by itself.
    for (name, before) in &befores {
        if let (Some(link), Some(mass)) = (model.twin.link_mut(name), before.given_mass()) {
            link.mass.get_or_insert(mass);
        }
    }
    for (name, found) in &facts {
        write_link(model, name, found, &befores, &ground, config, notices);
    }
    share_out(model, &facts, &befores, &ground, config, notices);
    for (name, found) in &facts {
        if let (Some(link), Some(before)) = (model.twin.link_mut(name), befores.get(name)) {
            write_centre(link, found, before, &ground);
        }
    }
    for (name, before) in &befores {
        if let Some(link) = model.twin.link_mut(name) {
            fill_inertial(link, before, facts.get(name), shapes.get(name));
        }
    }
    joint_dynamics(capture, segmented, model, (&ground, config), &|_| true, notices);
    let hang = fit_chains(capture, segmented, model, notices);
    // What hangs free of the support loads its joint with nothing but the joint's own.
    let free = |j: &Joint| hang.contains(&j.child) && j.friction.as_ref().is_none_or(|f| !f.is_measured());
    joint_dynamics(capture, segmented, model, (&ground, config), &free, notices);
    fit_fingers(capture, segmented, model);
    identify_tosses(capture, model, notices);
    write_rolling(capture, segmented, model);
    Ok(())
}

fn write_link(
    model: &mut Model,
    name: &str,
    facts: &Facts,
    befores: &BTreeMap<String, Before>,
    ground: &Ground,
    config: &Config,
    notices: &mut Notices,
) {
    let (Some(link), Some(before)) = (model.twin.link_mut(name), befores.get(name)) else {
        if !facts.is_empty() {
            notices.warn(
                super::resolve::STAGE,
                name,
                "it was touched, but the twin has no link of that name",
            );
        }
        return;
    };
    conclude(link, facts, before, ground, config, notices);
    if let Some(words) = told_of_basins(&facts.basins) {
        notices.note(super::resolve::STAGE, name, words);
    }
    write_presses(link, facts);
}

/// What the shape says of how a link coasts.
pub(super) fn shapes(model: &Model, befores: &BTreeMap<String, Before>, ground: &Ground) -> BTreeMap<String, Shape> {
    let of = |(name, before): (&String, &Before)| {
        let link = model.twin.link(name)?;
        let normal = link.pose.rotation.inverse() * ground.plane.normal;
        Some((name.clone(), before.shape(&normal)))
    };
    befores.iter().filter_map(of).collect()
}

/// What is known beforehand of every link; friction by pair of `materials` comes before the built-in table.
pub(super) fn befores<'a>(
    capture: &'a Capture,
    model: &Model,
    materials: &[MaterialFriction],
) -> Result<BTreeMap<String, Before<'a>>> {
    let support = capture.support.as_ref();
    let normal = ground_of(capture, &model.twin).plane.normal;
    let mut out = BTreeMap::new();
    for (_, link) in model.twin.links() {
        let given = capture.prior(&link.name);
        let pair = given
            .and_then(|g| g.material.as_deref())
            .zip(support.and_then(|s| s.material.as_deref()));
        let table = match pair {
            Some((a, b)) => material_friction(materials, a, b)?,
            None => None,
        };
        let mesh = link.mesh.as_ref().and_then(|path| model.meshes.get(path));
        let solid = mesh.and_then(solid_of);
        let up = link.pose.rotation.inverse() * normal;
        let height = mesh.zip(solid.as_ref()).map_or(0.0, |(m, s)| {
            let heights = m.vertices.iter().map(|v| v.coords.dot(&up));
            s.centroid.coords.dot(&up) - heights.fold(f64::INFINITY, f64::min)
        });
        let surface = mesh.zip(solid.as_ref()).and_then(|(m, s)| surface_of(m, s, &up));
        out.insert(
            link.name.clone(),
            Before {
                given,
                height,
                solid,
                surface,
                support_friction: support.and_then(|s| s.friction),
                table: table.map(|t| ((t.kinetic, t.kinetic_sd), (t.static_, t.static_sd))),
            },
        );
    }
    Ok(out)
}

/// Friction under an even pressure on what stands below where `up` (mesh axes) is up, axes of [`Plane::of`].
fn surface_of(mesh: &Mesh, solid: &Solid, up: &Vector3<f64>) -> Option<Arc<LimitSurface>> {
    let frame = Plane::of(*up);
    let rows = [frame.x, frame.y, frame.normal].map(|v| v.transpose());
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_rows(&rows));
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let pose = Isometry3::from_parts(Translation3::identity(), turn);
    let pressed = pressed_underside(mesh, &pose, &(pose * solid.centroid).xy())?;
    LimitSurface::of(&pressed.points).map(Arc::new)
}
