//! The rows of a score: one right answer beside its estimate.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde_json::json;

use super::mesh_distance::{mean_distance, seen_distance};
use super::score::{ScoreRow, same, word};
use super::{Joint, Link, Model, TrueBody, TrueJoint, TruePlane};
use crate::base::{Estimate, Result};
use crate::geometry::Mesh;

/// The rows of one body or link.
pub(super) fn body_rows(
    model: &Model,
    name: &str,
    truth: &TrueBody,
    meshes: Option<&BTreeMap<String, Mesh>>,
) -> Result<Vec<ScoreRow>> {
    let link = model.twin.links().map(|(_, l)| l).find(|l| same(&l.name, name));
    let mut rows: Vec<ScoreRow> = scalars(link, truth)
        .into_iter()
        .filter_map(|(quantity, unit, right, estimate)| Some(scalar(name, quantity, unit, right?, estimate)))
        .collect();
    if let Some(right) = &truth.com {
        let mut row = list(name, "com", "mm", right, link.and_then(|l| l.com.as_ref()));
        row.relative = None;
        in_millimetres(&mut row);
        rows.push(row);
    }
    if let Some(right) = &truth.inertia {
        rows.push(list(
            name,
            "inertia",
            "kg·m²",
            right,
            link.and_then(|l| l.inertia.as_ref()),
        ));
    }
    if let Some(right) = truth.mesh.as_ref().and_then(|path| meshes?.get(path)) {
        let mesh = link.and_then(|l| model.meshes.get(l.mesh.as_ref()?));
        rows.push(shape(name, "mesh", right, mesh, seen_distance)?);
        rows.push(shape(name, "mesh_whole", right, mesh, mean_distance)?);
    }
    for plane in &truth.symmetry {
        rows.extend(symmetry(name, plane, link));
    }
    Ok(rows)
}

type Scalar<'a> = (&'static str, &'static str, Option<f64>, Option<&'a Estimate>);

fn scalars<'a>(link: Option<&'a Link>, truth: &TrueBody) -> Vec<Scalar<'a>> {
    let of = |pick: fn(&Link) -> &Option<Estimate>| link.and_then(|l| pick(l).as_ref());
    vec![
        ("mass", "kg", truth.mass, of(|l| &l.mass)),
        (
            "friction_static",
            "1",
            truth.friction_static,
            of(|l| &l.friction.static_),
        ),
        (
            "friction_kinetic",
            "1",
            truth.friction_kinetic,
            of(|l| &l.friction.kinetic),
        ),
        ("stiffness", "N/m", truth.stiffness, of(|l| &l.stiffness)),
        ("damping", "N·s/m", truth.damping, of(|l| &l.damping)),
        ("restitution", "1", truth.restitution, of(|l| &l.restitution)),
    ]
}

/// The rows of one joint. Limits and the sign of the axis are compared as the truth turns.
pub(super) fn joint_rows(model: &Model, truth: &TrueJoint) -> Vec<ScoreRow> {
    let about = format!("{}|{}", truth.a, truth.b);
    let along = |j: &&Joint| same(&j.parent, &truth.a) && same(&j.child, &truth.b);
    let against = |j: &&Joint| same(&j.parent, &truth.b) && same(&j.child, &truth.a);
    let joints = || model.twin.joints();
    let found = joints().find(along).or_else(|| joints().find(against));
    let mut row = empty(&about, "type", "");
    row.truth = serde_json::to_value(truth.kind).unwrap_or_default();
    row.right = Some(found.is_some_and(|j| j.kind == truth.kind));
    if let Some(joint) = found {
        row.estimate = serde_json::to_value(joint.kind).unwrap_or_default();
        row.status = "measured".into();
    }
    let mut rows = vec![row, axis(&about, truth, found)];
    if let Some(right) = truth.origin.filter(|_| turns(truth)) {
        rows.push(origin(&about, truth, &right, found));
    }
    if let Some(right) = truth.limits {
        let flipped = found
            .filter(|j| reversed(j, truth))
            .and_then(|j| Some(mirrored(j.limits.as_ref()?)));
        let plain = found.and_then(|j| j.limits.clone());
        let unit = if turns(truth) { "rad" } else { "m" };
        rows.push(list(&about, "limits", unit, &right, flipped.or(plain).as_ref()));
    }
    let of = |pick: fn(&Joint) -> &Option<Estimate>| found.and_then(|j| pick(j).as_ref());
    let scalars = [
        ("joint_friction", truth.friction, of(|j| &j.friction)),
        ("joint_damping", truth.damping, of(|j| &j.damping)),
        ("joint_stiffness", truth.stiffness, of(|j| &j.stiffness)),
    ];
    for (quantity, right, estimate) in scalars {
        let unit = estimate.map_or("", |e| e.unit.as_str());
        rows.extend(right.map(|right| scalar(&about, quantity, unit, right, estimate)));
    }
    rows
}

fn turns(joint: &TrueJoint) -> bool {
    use super::JointKind::{Fixed, Prismatic};
    !matches!(joint.kind, Fixed | Prismatic)
}

/// The estimate's positive motion is the truth's negative one: the axis points the other way, or parent and
/// child have changed places, but not both.
fn reversed(joint: &Joint, truth: &TrueJoint) -> bool {
    let opposite = Vector3::from(joint.axis.value).dot(&Vector3::from(truth.axis)) < 0.0;
    let swapped = same(&joint.parent, &truth.b) && same(&joint.child, &truth.a);
    opposite != swapped
}

fn mirrored(limits: &Estimate<[f64; 2]>) -> Estimate<[f64; 2]> {
    let mut out = limits.clone();
    out.value = [-limits.value[1], -limits.value[0]];
    out.sd = limits.sd.map(|[a, b]| [b, a]);
    out.ci95 = limits
        .ci95
        .map(|[low, high]| [[-high[1], -high[0]], [-low[1], -low[0]]]);
    out
}

/// The angle between two lines, degrees. The interval is that of the direction's components: it holds where the
/// true direction, of either sign, is within it.
fn axis(about: &str, truth: &TrueJoint, found: Option<&Joint>) -> ScoreRow {
    let mut row = empty(about, "axis", "degrees");
    row.truth = json!(truth.axis);
    if let Some(joint) = found {
        let (a, b) = (Vector3::from(truth.axis).normalize(), Vector3::from(joint.axis.value));
        let sign = if a.dot(&b) < 0.0 { -1.0 } else { 1.0 };
        let angle = a.cross(&b).norm().atan2(a.dot(&b).abs());
        row.estimate = json!(joint.axis.value);
        row.error = Some(angle.to_degrees());
        row.holds = joint.axis.ci95.map(|ci| holds(&(a * sign).into(), &ci));
        row.status = word(joint.axis.status).into();
    }
    row
}

/// How far the true line passes from the estimated point, mm; the point may lie anywhere along the line.
fn origin(about: &str, truth: &TrueJoint, right: &[f64; 3], found: Option<&Joint>) -> ScoreRow {
    let mut row = empty(about, "origin", "mm");
    row.truth = json!(right);
    if let Some(joint) = found {
        let direction = Vector3::from(truth.axis).normalize();
        let between = Vector3::from(joint.origin.value) - Vector3::from(*right);
        row.estimate = json!(joint.origin.value);
        row.error = Some(1e3 * between.cross(&direction).norm());
        row.status = word(joint.origin.status).into();
    }
    row
}

/// A distance between the surfaces, mm: `mesh` is the mean from what was seen to the truth, `mesh_whole` the
/// mean both ways, with what was closed or mirrored.
fn shape(
    about: &str,
    quantity: &str,
    right: &Mesh,
    mesh: Option<&Mesh>,
    distance: fn(&Mesh, &Mesh) -> Result<f64>,
) -> Result<ScoreRow> {
    let mut row = empty(about, quantity, "mm");
    row.truth = json!("surface");
    if let Some(mesh) = mesh {
        row.error = Some(1e3 * distance(mesh, right)?);
        row.estimate = json!("surface");
        row.status = "derived".into();
    }
    Ok(row)
}

/// The angle to the nearest plane that was found, and the distance between the two along the normal.
fn symmetry(about: &str, truth: &TruePlane, link: Option<&Link>) -> Vec<ScoreRow> {
    let normal = Vector3::from(truth.normal).normalize();
    let cosine = |n: &[f64; 3]| normal.dot(&Vector3::from(*n)).abs();
    let planes = link.map_or(&[][..], |l| &l.symmetry);
    let best = planes
        .iter()
        .max_by(|p, q| cosine(&p.normal).total_cmp(&cosine(&q.normal)));
    let mut angle = empty(about, "symmetry_angle", "degrees");
    let mut offset = empty(about, "symmetry_offset", "mm");
    angle.truth = json!(truth.normal);
    offset.truth = json!(1e3 * truth.offset);
    if let Some(plane) = best {
        let n = Vector3::from(plane.normal);
        let sign = if n.dot(&normal) < 0.0 { -1.0 } else { 1.0 };
        angle.estimate = json!(plane.normal);
        angle.error = Some(n.cross(&normal).norm().atan2(n.dot(&normal).abs()).to_degrees());
        offset.estimate = json!(1e3 * sign * plane.offset);
        offset.error = Some(1e3 * (sign * plane.offset - truth.offset).abs());
        angle.status = "derived".into();
        offset.status = "derived".into();
    }
    vec![angle, offset]
}

fn scalar(about: &str, quantity: &str, unit: &str, right: f64, estimate: Option<&Estimate>) -> ScoreRow {
    let mut row = empty(about, quantity, unit);
    row.truth = json!(right);
    if let Some(e) = estimate {
        let error = (e.value - right).abs();
        row.estimate = json!(e.value);
        row.error = Some(error);
        row.relative = (right != 0.0).then(|| error / right.abs());
        row.holds = e.ci95.map(|ci| holds(&[right], &[ci]));
        row.status = word(e.status).into();
    }
    row
}

fn list<const N: usize>(
    about: &str,
    quantity: &str,
    unit: &str,
    right: &[f64; N],
    e: Option<&Estimate<[f64; N]>>,
) -> ScoreRow
where
    [[f64; 2]; N]: serde::Serialize,
{
    let mut row = empty(about, quantity, unit);
    row.truth = json!(right.to_vec());
    if let Some(e) = e {
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let error = norm(&mut e.value.iter().zip(right).map(|(a, b)| a - b));
        let size = norm(&mut right.iter().copied());
        row.estimate = json!(e.value.to_vec());
        row.error = Some(error);
        row.relative = (size > 0.0).then(|| error / size);
        row.holds = e.ci95.as_ref().map(|ci| holds(right, ci));
        row.status = word(e.status).into();
    }
    row
}

fn holds<const N: usize>(right: &[f64; N], intervals: &[[f64; 2]; N]) -> bool {
    right
        .iter()
        .zip(intervals)
        .all(|(v, [low, high])| *low <= *v && *v <= *high)
}

fn in_millimetres(row: &mut ScoreRow) {
    for value in [&mut row.truth, &mut row.estimate] {
        let numbers: Vec<f64> = value
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|v| v.as_f64())
            .collect();
        if !numbers.is_empty() {
            *value = json!(numbers.iter().map(|v| 1e3 * v).collect::<Vec<_>>());
        }
    }
    row.error = row.error.map(|e| 1e3 * e);
}

fn empty(about: &str, quantity: &str, unit: &str) -> ScoreRow {
    ScoreRow {
        about: about.into(),
        quantity: quantity.into(),
        unit: unit.into(),
        truth: serde_json::Value::Null,
        estimate: serde_json::Value::Null,
        error: None,
        relative: None,
        holds: None,
        right: None,
        status: "absent".into(),
    }
}
