//! Parts the friction of a hinge from the drag of its two links over the support: three forces that one push feels
//! only in sum, but that turns and slides of both links weigh differently.

use nalgebra::{DMatrix, DVector, Point2, Point3, Vector3};

use super::Config;
use super::evidence::{MotionState, mean_wrench, motion_at, tare_of, tool_at};
use super::facts::{Ground, subject};
use crate::capture::{Capture, Interaction, PhaseKind, Segmented};
use crate::math::weighted_linear;
use crate::physics::Footprint;
use crate::twin::{Joint, Link, Model};

/// What was parted: values with standard deviations.
#[derive(Clone, Debug)]
pub(super) struct Parted {
    /// Friction force of the child, N.
    pub child: (f64, f64),
    /// Friction force of the parent, N.
    pub parent: (f64, f64),
    /// Friction of the joint, N·m.
    pub joint: (f64, f64),
    /// The interactions that tell.
    pub from: Vec<String>,
}

/// One balance `a · (child, parent, joint) = b`.
struct Row {
    a: [f64; 3],
    b: f64,
    /// Trust in the law itself: force sensor, pressure, limit surface.
    sd: f64,
    /// Interaction and balance: rows of one group share their errors.
    group: (String, usize),
}

/// Points that carry a link, link frame.
struct Foot(Vec<Point3<f64>>);

/// Slip below which a foot may stick or creep, m/s, and turning below which a joint may, rad/s.
const SLIDING: f64 = 8e-3;
const TURNING: f64 = 0.06;
/// Share by which pressure under a foot may differ from uniform, as an error of force.
const FORM: f64 = 0.03;
/// Vertices this near to the lowest one bear on the support, m.
const BEARING: f64 = 2.5e-3;
/// Misfit in standard deviations beyond which the balances contradict each other.
const DISAGREEMENT: f64 = 2.5;
/// A link whose lowest point is higher above the support than this bears on nothing, m.
const CLEAR: f64 = 5e-3;

impl Foot {
    fn of(link: &Link, model: &Model, ground: &Ground) -> Option<Self> {
        let mesh = model.meshes.get(link.mesh.as_ref()?)?;
        let world: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| link.pose.0 * v).collect();
        let height = |p: &Point3<f64>| (p - ground.point).dot(&ground.plane.normal);
        let low = world.iter().map(height).fold(f64::INFINITY, f64::min);
        if low > CLEAR {
            return Some(Self(Vec::new()));
        }
        let bearing = world.iter().filter(|p| height(p) < low + BEARING);
        let flat = |p: &Point3<f64>| Point2::from(ground.plane.flat(&(p - ground.point)));
        let outline = Footprint::hull(bearing.map(flat).collect())?;
        let corners = outline.corners();
        let range = |k: usize| {
            let values = corners.iter().map(|c| c[k]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let ((x0, x1), (y0, y1)) = (range(0), range(1));
        let steps = 14;
        let at = |i: usize, low: f64, high: f64| low + (high - low) * (i as f64 + 0.5) / f64::from(steps);
        let mut points = Vec::new();
        for i in 0..steps as usize {
            for j in 0..steps as usize {
                let p = Point2::new(at(i, x0, x1), at(j, y0, y1));
                if outline.nearest(&nalgebra::Isometry2::identity(), &p).distance < 0.0 {
                    let lifted = ground.point + ground.plane.x * p.x + ground.plane.y * p.y;
                    points.push(link.pose.0.inverse_transform_point(&lifted));
                }
            }
        }
        Some(Self(points))
    }

    /// Mean direction of friction, mean moment about `axis` along the normal, and mean slip, m/s, under uniform
    /// pressure and Coulomb's law at every point (Goyal, Ruina and Papadopoulos 1991).
    fn drag(&self, motion: &MotionState, axis: &Point3<f64>, normal: &Vector3<f64>) -> (Vector3<f64>, f64, f64) {
        let (mut force, mut moment, mut slip) = (Vector3::zeros(), 0.0, 0.0);
        for p in &self.0 {
            let p = motion.pose * p;
            let v = motion.velocity + motion.spin.cross(&(p.coords - motion.pose.translation.vector));
            let v = v - normal * normal.dot(&v);
            let d = -v / v.norm().max(1e-9);
            force += d;
            moment += (p - axis).cross(&d).dot(normal);
            slip += v.norm();
        }
        let n = self.0.len().max(1) as f64;
        (force / n, moment / n, slip / n)
    }
}

/// Parts the three, where the pushes weigh them differently; nothing where they do not or where the joint does not
/// turn about the support's normal.
pub(super) fn part(
    capture: &Capture,
    segmented: &[Segmented],
    joint: &Joint,
    model: &Model,
    ground: &Ground,
    config: &Config,
) -> Option<Parted> {
    let axis = Vector3::from(joint.axis.value);
    if axis.dot(&ground.plane.normal).abs() < 0.98 {
        return None;
    }
    let link = |name: &str| model.twin.links().find(|(_, l)| l.name == name).map(|(_, l)| l);
    let (parent, child) = (link(&joint.parent)?, link(&joint.child)?);
    let feet = (Foot::of(parent, model, ground)?, Foot::of(child, model, ground)?);
    if feet.0.0.is_empty() || feet.1.0.is_empty() {
        return None;
    }
    let rows: Vec<Row> = capture
        .fitted()
        .filter_map(|i| {
            let cut = segmented.iter().find(|s| s.interaction == i.name)?;
            rows_of(i, cut, joint, parent, &feet, ground, config)
        })
        .flatten()
        .collect();
    solve(&rows)
}

/// The balances of one push, block by block.
fn rows_of(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    parent: &Link,
    feet: &(Foot, Foot),
    ground: &Ground,
    config: &Config,
) -> Option<Vec<Row>> {
    let about = subject(interaction, cut)?;
    let (stream, path) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let (of_parent, of_child) = (
        interaction.tracks.get(&joint.parent)?,
        interaction.tracks.get(&joint.child)?,
    );
    let slide = cut.of(PhaseKind::Slide).next()?;
    let tare = tare_of(interaction, cut);
    let normal = ground.plane.normal;
    let half = config.smoothing.max(0.15);
    let mut rows = Vec::new();
    let mut t = slide.start + config.settling + 0.5 * config.block;
    while t + 0.5 * config.block <= slide.end - 0.5 * config.settling {
        let wrench = mean_wrench(stream, t - 0.5 * config.block, t + 0.5 * config.block, &tare);
        let states = motion_at(of_parent, t, half).zip(motion_at(of_child, t, half));
        t += config.block;
        let (Some(w), Some((p, c)), Some(tool)) = (wrench, states, tool_at(path, t - config.block)) else {
            continue;
        };
        let axis = p.pose * parent.pose.0.inverse() * Point3::from(joint.origin.value);
        let moment = ((tool - axis).cross(&w.force) + w.torque.unwrap_or_default()).dot(&normal);
        let (d_parent, m_parent, slip_parent) = feet.0.drag(&p, &axis, &normal);
        let (d_child, m_child, slip_child) = feet.1.drag(&c, &axis, &normal);
        let rate = (c.spin - p.spin).dot(&normal);
        let sd = (FORM * w.force.norm()).hypot(0.02);
        let mut push = |a: [f64; 3], b: f64, sd: f64, balance: usize| {
            let group = (interaction.name.clone(), balance);
            rows.push(Row { a, b, sd, group });
        };
        if slip_parent > SLIDING && slip_child > SLIDING {
            for (k, e) in [ground.plane.x, ground.plane.y].iter().enumerate() {
                push([d_child.dot(e), d_parent.dot(e), 0.0], -w.force.dot(e), sd, k);
            }
            push([m_child, m_parent, 0.0], -moment, 0.04 * sd, 2);
        }
        if rate.abs() > TURNING && slip_child > SLIDING {
            let own = if about == joint.child { -moment } else { 0.0 };
            push([m_child, 0.0, -rate.signum()], own, 0.04 * sd, 3);
        }
    }
    Some(rows)
}

/// Robust least squares; errors of one group are taken as common to all of its rows.
fn solve(rows: &[Row]) -> Option<Parted> {
    if rows.len() < 8 {
        return None;
    }
    let mut groups: Vec<&(String, usize)> = rows.iter().map(|r| &r.group).collect();
    groups.sort();
    groups.dedup();
    let members = |g: &(String, usize)| rows.iter().filter(|r| r.group == *g).count() as f64;
    let a = DMatrix::from_fn(rows.len(), 3, |i, j| rows[i].a[j]);
    let b = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.b));
    // A group weighs as one to three measurements, however many blocks it has.
    let base: Vec<f64> = rows
        .iter()
        .map(|r| (members(&r.group).min(3.0) / members(&r.group)) / r.sd.powi(2))
        .collect();
    let mut weights = DVector::from_vec(base.clone());
    let mut fit = weighted_linear(&a, &b, &weights)?;
    for _ in 0..25 {
        for i in 0..rows.len() {
            let r = (fit.residuals[i] / rows[i].sd).abs();
            weights[i] = base[i] * (1.5 / r.max(1e-12)).min(1.0);
        }
        fit = weighted_linear(&a, &b, &weights)?;
    }
    let misfit: f64 = (0..rows.len()).map(|i| weights[i] * fit.residuals[i].powi(2)).sum();
    let freedom = (weights.iter().zip(rows).map(|(w, r)| w * r.sd.powi(2)).sum::<f64>() - 3.0).max(1.0);
    let scale = (misfit / freedom).max(1.0).sqrt();
    let read = |k: usize| (fit.x[k], fit.sd(k) * scale);
    let mut from: Vec<String> = groups.iter().map(|g| g.0.clone()).collect();
    from.dedup();
    let parted = Parted {
        child: read(0),
        parent: read(1),
        joint: read(2),
        from,
    };
    let [child, joint] = [parted.child, parted.joint];
    let clear = joint.0 > 4.0 * joint.1 && child.0 > -2.0 * child.1 && parted.parent.0 > 4.0 * parted.parent.1;
    (clear && scale < DISAGREEMENT).then_some(parted)
}
