//! Models drawn from what the twin knows, for training on many worlds instead of one (domain randomisation).
//!
//! The twin keeps each number's interval, and of mass and friction also that of their product, the force of friction:
//! their draws are correlated so that the product scatters as it was measured. All else is drawn on its own. What has no
//! interval keeps its value, and what was never measured its default.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::draw::{Draws, Sign, at, log_sd, settle};
use super::inertial::{six, tensor};
use super::write::{Files, Format, exports_as};
use crate::base::{Error, Estimate, Result, Seed, StagedFolder};
use crate::twin::{Joint, Link, Model, read_twin};

/// The folder in a twin's folder that holds its variants, and the file that lists a variant's numbers.
const FOLDER: &str = "variants";
const LIST: &str = "draw.json";
/// From a variant's folder to the twin's.
const UP: &str = "../../";

/// What was drawn for one variant.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Drawn {
    /// The seed of the run.
    pub seed: u64,
    /// Number of the variant.
    pub index: usize,
    /// By link: mass, kg; kinetic friction; centre of mass, m, link frame.
    pub links: BTreeMap<String, DrawnLink>,
    /// By joint: dry friction, N or N·m; damping; stiffness; ends.
    pub joints: BTreeMap<String, DrawnJoint>,
    /// Gravity as things on the table feel it, m/s², world.
    pub gravity: [f64; 3],
}

/// What was drawn for a link; absent where the twin says nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DrawnLink {
    /// kg.
    pub mass: Option<f64>,
    /// m, link frame.
    pub com: Option<[f64; 3]>,
    /// ixx, iyy, izz, ixy, ixz, iyz, kg·m².
    pub inertia: Option<[f64; 6]>,
    /// Coefficient before it slides.
    pub friction_static: Option<f64>,
    /// Coefficient while it slides.
    pub friction_kinetic: Option<f64>,
    /// N/m.
    pub stiffness: Option<f64>,
    /// N·s/m.
    pub damping: Option<f64>,
    /// Coefficient of restitution.
    pub restitution: Option<f64>,
}

/// What was drawn for a joint; absent where the twin says nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DrawnJoint {
    /// World at the first view, unit.
    pub axis: [f64; 3],
    /// World at the first view, m.
    pub origin: [f64; 3],
    /// rad or m.
    pub limits: Option<[f64; 2]>,
    /// N·m or N.
    pub friction: Option<f64>,
    /// N·m·s/rad or N·s/m.
    pub damping: Option<f64>,
    /// N·m/rad or N/m.
    pub stiffness: Option<f64>,
    /// rad or m.
    pub rest: Option<f64>,
}

/// The twin of a folder as `count` models, each in `variants/NNN` below it, in the named formats; returns the folder's path
/// relative to the twin's. Variants of an earlier run are replaced.
///
/// # Errors
/// Where the twin cannot be read or a file cannot be written.
pub fn export_variants(folder: &Path, formats: &[Format], count: usize, seed: Seed) -> Result<Vec<String>> {
    let (model, _) = read_twin(folder)?;
    let staged = StagedFolder::create(&folder.join(FOLDER), &format!("000/{LIST}"))?;
    let mut names = Vec::new();
    for index in 0..count {
        let (drawn, list) = variant(&model, seed, index);
        let (files, _) = variant_files(&drawn, formats)?;
        let name = format!("{index:03}");
        for (path, bytes) in &files {
            staged.write(&format!("{name}/{path}"), bytes)?;
        }
        let mut text = serde_json::to_string_pretty(&list).map_err(|e| Error::Failed(e.to_string()))?;
        text.push('\n');
        staged.write(&format!("{name}/{LIST}"), text.as_bytes())?;
        names.push(format!("{FOLDER}/{name}"));
    }
    staged.commit()?;
    Ok(names)
}

/// The files of a variant, which use the meshes of the twin's folder two levels above.
fn variant_files(model: &Model, formats: &[Format]) -> Result<(Files, Vec<super::ExportNote>)> {
    let mut model = model.clone();
    let above = |path: &String| format!("{UP}{path}");
    let lifted = |(path, mesh)| (above(&path), mesh);
    model.meshes = std::mem::take(&mut model.meshes).into_iter().map(lifted).collect();
    let textures = std::mem::take(&mut model.textures);
    model.textures = textures.into_iter().map(|(p, t)| (above(&p), t)).collect();
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        link.mesh = link.mesh.as_ref().map(above);
        link.collision = link.collision.iter().map(above).collect();
    }
    exports_as(&model, formats)
}

/// Variant number `index` of a twin, and what was drawn for it. Masses are positive, inertias those of some body, centres of
/// mass within the shape's bounds, ends of joints ordered.
pub fn variant(model: &Model, seed: Seed, index: usize) -> (Model, Drawn) {
    let draws = Draws::new(seed, index);
    let mut out = model.clone();
    out.twin.name = format!("{}-{index:03}", model.twin.name);
    let gravity = Vector3::from(model.twin.gravity).norm();
    for link in out.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let bounds = link.mesh.as_ref().and_then(|p| model.meshes.get(p)).map(|m| {
            let corner = |pick: fn(f64, f64) -> f64, from: f64| {
                let start = Vector3::repeat(from);
                m.vertices.iter().fold(start, |c, v| c.zip_map(&v.coords, pick))
            };
            [corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY)]
        });
        draw_link(&draws, link, bounds, gravity);
    }
    for joint in out.twin.bodies.iter_mut().flat_map(|b| &mut b.joints) {
        draw_joint(&draws, joint);
    }
    if let Some(felt) = out.twin.support.as_mut().and_then(|s| s.gravity.as_mut()) {
        draws.list("gravity", felt, Sign::Any);
        felt.value = (Vector3::from(felt.value).normalize() * gravity).into();
    }
    let list = listed(&out, seed, index);
    (out, list)
}

fn draw_link(draws: &Draws, link: &mut Link, bounds: Option<[Vector3<f64>; 2]>, gravity: f64) {
    let name = link.name.clone();
    let of = |quantity: &str| format!("{name} {quantity}");
    let before = link.mass.as_ref().map(|m| (m.value, log_sd(m)));
    let z_mass = draws.z(&of("mass"));
    let friction = [
        (&mut link.friction.static_, &link.friction_force.static_),
        (&mut link.friction.kinetic, &link.friction_force.kinetic),
    ];
    // One draw for the surface: what makes it rough makes it so at rest and in motion.
    let z_surface = draws.z(&of("friction"));
    for (coefficient, force) in friction {
        let Some(mu) = coefficient else { continue };
        let tie = correlation(mu, &link.mass, force);
        let z = tie * z_mass + (1.0 - tie * tie).sqrt() * z_surface;
        let drawn = at(mu.value, mu.ci95, z, Sign::Positive);
        settle(mu, drawn);
    }
    if let Some(mass) = &mut link.mass {
        let drawn = at(mass.value, mass.ci95, z_mass, Sign::Positive);
        settle(mass, drawn);
    }
    if let (Some(s), Some(k)) = (&mut link.friction.static_, &link.friction.kinetic) {
        s.value = s.value.max(k.value);
    }
    forces(link, z_surface, gravity);
    for (quantity, estimate, sign) in [
        ("rolling", &mut link.friction.rolling, Sign::Nonnegative),
        ("torsional", &mut link.friction.torsional_radius, Sign::Positive),
        ("tool", &mut link.friction.tool, Sign::Positive),
        ("restitution", &mut link.restitution, Sign::Nonnegative),
        ("stiffness", &mut link.stiffness, Sign::Positive),
        ("damping", &mut link.damping, Sign::Nonnegative),
    ] {
        draws.scalar(&of(quantity), estimate, sign);
    }
    if let Some(r) = &mut link.restitution {
        r.value = r.value.min(1.0);
    }
    if let Some(com) = &mut link.com {
        draws.list(&of("com"), com, Sign::Any);
        if let Some([low, high]) = bounds {
            com.value = std::array::from_fn(|k| com.value[k].clamp(low[k], high[k]));
        }
    }
    let now = link.mass.as_ref().map(|m| m.value);
    if let Some(inertia) = &mut link.inertia {
        let (ratio, mass_sd) = match (now, before) {
            (Some(now), Some((was, sd))) => (now / was, sd.unwrap_or(0.0)),
            _ => (1.0, 0.0),
        };
        draw_inertia(draws, &of("inertia"), inertia, ratio, mass_sd);
    }
}

/// Correlation of the logarithms of mass and friction with which their product scatters as the force of friction does:
/// `s_F² = s_m² + s_mu² + 2 rho s_m s_mu`. Nought where the force or an interval is not known.
fn correlation(mu: &Estimate, mass: &Option<Estimate>, force: &Option<Estimate>) -> f64 {
    let sd = |e: &Option<Estimate>| e.as_ref().and_then(log_sd);
    match (log_sd(mu), sd(mass), sd(force)) {
        (Some(mu), Some(m), Some(f)) if mu * m > 1e-12 => ((f * f - m * m - mu * mu) / (2.0 * m * mu)).clamp(-1.0, 1.0),
        _ => 0.0,
    }
}

/// Forces of friction: the product of what was drawn, or drawn themselves where a factor is not known.
fn forces(link: &mut Link, z: f64, gravity: f64) {
    let mass = link.mass.as_ref().map(|m| m.value);
    for (force, mu) in [
        (&mut link.friction_force.static_, &link.friction.static_),
        (&mut link.friction_force.kinetic, &link.friction.kinetic),
    ] {
        let Some(force) = force else { continue };
        let drawn = match (mass, mu) {
            (Some(m), Some(mu)) => mu.value * m * gravity,
            _ => at(force.value, force.ci95, z, Sign::Positive),
        };
        settle(force, drawn);
    }
}

/// Scales with the mass; what is doubtful beyond that stretches the second moments of mass along their principal axes, so
/// that the result is the inertia of some body whatever is drawn (Wensing, Kim & Slotine 2018).
fn draw_inertia(draws: &Draws, name: &str, e: &mut Estimate<[f64; 6]>, ratio: f64, mass_sd: f64) {
    let inertia = tensor(&e.value);
    let spread = |k: usize| e.sd.map_or(0.0, |sd| sd[k] / e.value[k].abs().max(1e-12));
    let relative = (0..3).map(spread).sum::<f64>() / 3.0;
    // Each moment is the sum of two second moments, hence the root of two.
    let own = (2.0 * (relative * relative - mass_sd * mass_sd).max(0.0))
        .sqrt()
        .min(0.5);
    let second = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
    let eigen = second.symmetric_eigen();
    let stretched = Vector3::from_fn(|k, _| {
        let z = draws.z(&format!("{name} {k}"));
        eigen.eigenvalues[k].max(0.0) * (own * z).exp()
    });
    let second = eigen.eigenvectors * Matrix3::from_diagonal(&stretched) * eigen.eigenvectors.transpose() * ratio;
    e.value = six(&(Matrix3::identity() * second.trace() - second));
    (e.sd, e.ci95) = (None, None);
}

fn draw_joint(draws: &Draws, joint: &mut Joint) {
    let name = joint.name.clone();
    let of = |quantity: &str| format!("{name} {quantity}");
    let was = Vector3::from(joint.axis.value);
    draws.list(&of("axis"), &mut joint.axis, Sign::Any);
    let axis = Vector3::from(joint.axis.value).try_normalize(1e-6).unwrap_or(was);
    joint.axis.value = axis.into();
    draws.list(&of("origin"), &mut joint.origin, Sign::Any);
    if let Some(limits) = &mut joint.limits {
        draws.list(&of("limits"), limits, Sign::Any);
        let [a, b] = limits.value;
        limits.value = [a.min(b), a.max(b)];
    }
    for (quantity, estimate, sign) in [
        ("friction", &mut joint.friction, Sign::Nonnegative),
        ("damping", &mut joint.damping, Sign::Nonnegative),
        ("stiffness", &mut joint.stiffness, Sign::Nonnegative),
        ("rest", &mut joint.rest, Sign::Any),
        ("pitch", &mut joint.pitch, Sign::Any),
    ] {
        draws.scalar(&of(quantity), estimate, sign);
    }
    if let Some(coupling) = &mut joint.effects.coupling {
        let mut ratio = Some(coupling.ratio.clone());
        draws.scalar(&of("coupling"), &mut ratio, Sign::Any);
        coupling.ratio = ratio.unwrap_or_else(|| coupling.ratio.clone());
    }
}

fn listed(model: &Model, seed: Seed, index: usize) -> Drawn {
    let value = |e: &Option<Estimate>| e.as_ref().map(|e| e.value);
    let link = |l: &Link| DrawnLink {
        mass: value(&l.mass),
        com: l.com.as_ref().map(|c| c.value),
        inertia: l.inertia.as_ref().map(|i| i.value),
        friction_static: value(&l.friction.static_),
        friction_kinetic: value(&l.friction.kinetic),
        stiffness: value(&l.stiffness),
        damping: value(&l.damping),
        restitution: value(&l.restitution),
    };
    let joint = |j: &Joint| DrawnJoint {
        axis: j.axis.value,
        origin: j.origin.value,
        limits: j.limits.as_ref().map(|l| l.value),
        friction: value(&j.friction),
        damping: value(&j.damping),
        stiffness: value(&j.stiffness),
        rest: value(&j.rest),
    };
    Drawn {
        seed: seed.0,
        index,
        links: model.twin.links().map(|(_, l)| (l.name.clone(), link(l))).collect(),
        joints: model.twin.joints().map(|j| (j.name.clone(), joint(j))).collect(),
        gravity: model.twin.felt_gravity(),
    }
}
