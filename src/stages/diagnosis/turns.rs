//! How pushed bodies turn, as the ladder of laws sees it: the moment of the finger's force about the body, against what
//! friction under the body's own footprint resists with at the measured motion, and where the finger met the face.
//!
//! Law: `p x F = c x F + T(v, w)`, with `F` the measured force, `p` where it acts, `c` the centre of mass and `T/F` the
//! moment of Coulomb friction over the resultant of the same friction, both summed over a pressure that is linear over the
//! footprint (Goyal, Ruina and Papadopoulos 1991). Arms, not moments, are compared: each force tells its own level.

use std::f64::consts::PI;

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::Quantity;
use super::family::{Active, Channel, ChannelKind, Family, Group, Parameter, Sheet};
use super::fit::Fit;
use super::shows_in::TIME;
use super::turn_laws::{self, form, scatter, turn_laws};
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::geometry::mass_properties;
use crate::math::median;
use crate::physics::pressed_underside;
use crate::stages::estimation::{Company, Turned, company, support_normal, tumbles, turned};
use crate::twin::{Link, Model};

/// Fewest pushes from which a cause is named.
const FEWEST: usize = 4;
/// Noise of an arm and of where the finger meets the face, m: what a mesh and an encoder leave.
const ARM: f64 = 1e-4;
const FACE: f64 = 1e-4;
/// How well the direction of the measured force is known, rad, as far as it matters for the arm.
const DIRECTION: f64 = 0.01;
/// Share of the friction force that inertia may reach; above that the balance of a stretch is not a quasi-static one.
const INERTIAL: f64 = 0.3;
/// What is not known of how hard a body is to turn, as a share, and the noise of an angle where nothing tells it, rad.
const INERTIA: f64 = 0.15;
const ANGLE: f64 = 2e-3;
/// Share of the usual friction below which it does not slide everywhere.
const HELD: f64 = 0.75;
/// Difference of the tool's headings from which on its frame is not that of the room, rad.
const TURNS: f64 = 0.3;
/// Least offset and least share that are more than meshes and footprints may be off by, m.
const NEGLIGIBLE: (f64, f64) = (7e-4, 0.12);
/// Least scale and turn of the tracking, rad, that are more than a shape and a finger may be off by.
const FRAME: f64 = 0.008;
/// A centre this near the centroid is in it: m, and standard deviations.
const CENTRED: (f64, f64) = (1e-3, 2.5);

/// One stretch of a push, ready for the balance of moments.
struct Row {
    turned: Turned,
    /// From the tracked origin to the centroid, and how far the push tips the load ahead of it, plane of the support, m.
    centre: Vector2<f64>,
    ahead: Vector2<f64>,
    /// Horizontal axes of the link in the plane: how the centre moves with its two unknowns.
    across: [Vector2<f64>; 2],
    /// What turning it faster takes of the arm of the force, m, with what is not known of that.
    inert: (f64, f64),
    /// What friction resists with over the force, the rest of which makes it faster.
    resists: f64,
    /// Points of the footprint about the centre of pressure, plane of the support, with their shares of the load.
    points: Vec<(Vector2<f64>, f64)>,
}

/// All pushes of single bodies that a finger made.
pub struct Turns {
    sheet: Sheet,
    rows: Vec<Vec<Row>>,
    bodies: Vec<usize>,
    names: Vec<String>,
}

impl Turns {
    /// What a capture has of them; nothing where no push tells how a body turns.
    pub fn new(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<Self> {
        let mut out = Self {
            sheet: Sheet::default(),
            rows: Vec::new(),
            bodies: Vec::new(),
            names: Vec::new(),
        };
        for interaction in capture.interactions.iter().filter(|i| i.kind == Kind::Push) {
            let Some((name, rows)) = rows_of(capture, interaction, segmented, model) else {
                continue;
            };
            let known = out.names.iter().position(|n| *n == name);
            let index = known.unwrap_or(out.names.len());
            if known.is_none() {
                out.names.push(name);
            }
            let noise = capture.noise.position.unwrap_or(3e-4);
            out.sheet.groups.push(Group {
                name: interaction.name.clone(),
                held_out: interaction.held_out,
                channels: channels(&rows, noise),
            });
            out.rows.push(rows);
            out.bodies.push(index);
        }
        if out.rows.is_empty() {
            return None;
        }
        let kind = |sigma| ChannelKind {
            quantity: Quantity::Position,
            sigma,
            jitter: 0.0,
        };
        out.sheet.kinds = vec![kind(ARM), kind(FACE)];
        for _ in &out.names {
            out.sheet.base.extend([
                Parameter::amplitude("centre_1", "m", 0.01),
                Parameter::amplitude("centre_2", "m", 0.01),
                // A body may stand on its rim: then it resists turning more. Less than evenly it cannot be in the plain model.
                Parameter {
                    low: -0.08,
                    high: 0.8,
                    ..Parameter::amplitude("log_radius", "1", 0.25)
                },
            ]);
        }
        out.sheet.base.push(Parameter::amplitude("inside", "m", 1e-3));
        out.sheet.base.push(Parameter::amplitude("delay", "s", 5e-3));
        out.sheet.scatter = scatter();
        out.sheet.laws = turn_laws(out.tool_turns());
        Some(out)
    }

    /// Where the centre of a body is from the centroid of its shape, m, frame of the link, with its standard deviation, as far as turning
    /// told it; and the pushes that did.
    pub fn centre(&self, full: &Fit, name: &str) -> Option<(Vector3<f64>, Vector3<f64>, Vec<String>)> {
        let body = self.names.iter().position(|n| n == name)?;
        let own = || full.groups.iter().filter(|g| self.bodies[**g] == body);
        let axes = level(&self.rows[*own().next()?].first()?.turned.axes);
        let (mut away, mut sd) = (Vector3::zeros(), Vector3::repeat(f64::INFINITY));
        for (k, axis) in axes.into_iter().enumerate() {
            let at = 3 * body + k;
            (away[axis], sd[axis]) = (full.theta[at], full.covariance[(at, at)].max(0.0).sqrt());
        }
        let from: Vec<String> = own().map(|g| self.sheet.groups[*g].name.clone()).collect();
        (from.len() >= FEWEST).then_some((away, sd, from))
    }

    /// Whether the tool was turned from push to push.
    fn tool_turns(&self) -> bool {
        let headings: Vec<f64> = self.rows.iter().flatten().map(|r| r.turned.tool).collect();
        let apart = |a: &f64| (a - headings[0] + PI).rem_euclid(2.0 * PI) - PI;
        headings.iter().any(|a| apart(a).abs() > TURNS)
    }
}

fn rows_of(
    capture: &Capture,
    interaction: &Interaction,
    segmented: &[Segmented],
    model: &Model,
) -> Option<(String, Vec<Row>)> {
    let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
    let name = interaction
        .target
        .clone()
        .or_else(|| interaction.tracks.keys().next().cloned())?;
    let link = model
        .twin
        .body_of(&name)
        .filter(|b| b.links.len() == 1)?
        .links
        .first()?;
    let normal = support_normal(capture, model);
    // With another thing along it turns about the centre of both.
    let accompanied = company(interaction, cut, &name, &model.twin) != Company::Alone;
    if accompanied || interaction.tracks.get(&name).is_some_and(|t| tumbles(t, &normal)) {
        return None;
    }
    let stretches = turned(capture, interaction, cut, model, &name)?;
    let mesh = model.meshes.get(link.mesh.as_ref()?)?;
    let solid = mass_properties(mesh)?;
    let centroid = solid.centroid;
    let weight = weight_of(link, capture, model);
    let mass = weight / capture.gravity.norm().max(1e-6);
    let noise = capture.noise.rotation.or(cut.rotation_noise).unwrap_or(ANGLE);
    let friction = |t: &Turned| (t.force - centre_faster(t, &centroid) * mass).norm();
    let moves = |t: &&Turned| t.velocity.norm() >= 4.0 * t.velocity_sd;
    // What hardly moves any more may hold less than friction.
    let usual = median(&stretches.iter().filter(moves).map(friction).collect::<Vec<f64>>())?;
    let rows = stretches.into_iter().filter_map(|t| {
        let hurried = mass * t.acceleration.norm() > INERTIAL * t.force.norm();
        if !moves(&&t) || hurried || friction(&t) < HELD * usual {
            return None;
        }
        // Where the link lies in its own horizontal plane, about its origin.
        let flat = t.axes;
        let across: [Vector2<f64>; 2] = horizontal(&flat)?;
        let pose = upright(&flat)?;
        let load = (1.0 - t.lift / weight).clamp(0.3, 3.0);
        let centre = flat * centroid.coords;
        let ahead = t.force * (t.height / (load * weight));
        let wanted = Point2::from(centre + ahead);
        let under = pressed_underside(mesh, &pose, &wanted)?;
        let up = pose.rotation.inverse() * Vector3::z();
        let yaw = mass * up.dot(&(solid.inertia_per_density * up)) / solid.volume;
        let arm = |rate: f64| yaw * rate / t.force.norm().max(1e-9);
        Some(Row {
            inert: (
                arm(t.spin_rate.0),
                arm((INERTIA * t.spin_rate.0).hypot(noise * t.spin_rate.1)),
            ),
            resists: (friction(&t) / t.force.norm().max(1e-9)).clamp(0.5, 1.5),
            turned: t,
            centre,
            ahead: under.centre.coords - centre,
            across,
            points: under.points,
        })
    });
    let rows: Vec<Row> = rows.collect();
    (rows.len() >= 2).then_some((name, rows))
}

/// Acceleration of the centroid, m/s², of which that of the tracked origin is told.
fn centre_faster(t: &Turned, centroid: &Point3<f64>) -> Vector2<f64> {
    let at = t.axes * centroid.coords;
    t.acceleration + Vector2::new(-at.y, at.x) * t.spin_rate.0 - at * t.spin.powi(2)
}

/// N: as measured, else as friction says.
fn weight_of(link: &Link, capture: &Capture, model: &Model) -> f64 {
    let gravity = -capture.gravity.dot(&support_normal(capture, model));
    let friction = link.friction_force.kinetic.as_ref().map_or(1.0, |f| f.value);
    link.mass
        .as_ref()
        .filter(|m| m.is_told())
        .map_or(friction / 0.35, |m| m.value * gravity)
}

/// Which two axes of a link do not stand upright.
fn level(axes: &nalgebra::Matrix2x3<f64>) -> [usize; 2] {
    let flat = |k: usize| axes.column(k).norm();
    let upright = (0..3).min_by(|a, b| flat(*a).total_cmp(&flat(*b))).unwrap_or(2);
    [(upright + 1) % 3, (upright + 2) % 3]
}

/// Those axes, in the plane.
fn horizontal(axes: &nalgebra::Matrix2x3<f64>) -> Option<[Vector2<f64>; 2]> {
    let [a, b] = level(axes).map(|k| axes.column(k).into_owned());
    Some([a.try_normalize(1e-6)?, b.try_normalize(1e-6)?])
}

/// The link turned as it stands, its origin at nought, the support's normal upwards.
fn upright(axes: &nalgebra::Matrix2x3<f64>) -> Option<nalgebra::Isometry3<f64>> {
    let (x, y): (Vector3<f64>, Vector3<f64>) = (axes.row(0).transpose(), axes.row(1).transpose());
    let rows = [x.transpose(), y.transpose(), x.cross(&y).transpose()];
    let matrix = nalgebra::Matrix3::from_rows(&rows);
    let turn = nalgebra::UnitQuaternion::from_matrix(&matrix);
    turn.coords
        .iter()
        .all(|v| v.is_finite())
        .then(|| nalgebra::Isometry3::from_parts(Point3::origin().coords.into(), turn))
}

/// The arm of the force about the tracked origin, and how far the finger is inside of the face.
fn channels(rows: &[Row], noise: f64) -> Vec<Channel> {
    let doubt = |r: &Row| {
        let t = &r.turned;
        let (size, speed) = (t.force.norm().max(1e-9), t.velocity.norm().max(1e-9));
        let arm = DIRECTION * (t.moment / size).abs().max(0.03);
        // The motion is known less well than its smoothing shows where it is slow.
        let shaken = 0.05 * t.velocity_sd / speed;
        let hurried = 0.01 * t.acceleration.norm() / 9.81;
        arm.hypot(shaken).hypot(hurried).hypot(0.3 * noise).hypot(r.inert.1)
    };
    let channel = |kind: usize, measured: Vec<f64>, aside: Vec<f64>| Channel {
        kind,
        change: vec![0.0; measured.len()],
        starts: (0..measured.len()).map(|i| i == 0).collect(),
        measured,
        aside,
    };
    let arms = rows.iter().map(|r| r.turned.moment / r.turned.force.norm().max(1e-9));
    vec![
        channel(0, arms.collect(), rows.iter().map(doubt).collect()),
        channel(
            1,
            rows.iter().map(|r| r.turned.inside).collect(),
            rows.iter().map(|_| 0.3 * noise).collect(),
        ),
    ]
}

impl Row {
    /// The arm of friction's moment about the centre of pressure, m, where that is moved by `shift`.
    fn resisted(&self, shift: &Vector2<f64>) -> f64 {
        let t = &self.turned;
        let at = self.centre + self.ahead + shift;
        let velocity = t.velocity + t.spin * Vector2::new(-at.y, at.x);
        let (mut force, mut moment) = (Vector2::zeros(), 0.0);
        for (r, share) in &self.points {
            let v = velocity + t.spin * Vector2::new(-r.y, r.x);
            let way = v / v.norm().max(1e-9);
            force += way * *share;
            moment += r.perp(&way) * share;
        }
        moment / force.norm().max(0.05)
    }
}

impl Family for Turns {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let body = self.bodies[group];
        let own = &base[3 * body..3 * body + 3];
        let (inside, delay) = (base[base.len() - 2], base[base.len() - 1]);
        let middle: f64 = active
            .iter()
            .filter(|a| a.law.form == form::MIDDLE)
            .map(|a| a.values[0])
            .sum();
        let share = (2.0 * own[2]).exp() * (1.0 - middle).powi(2) * (1.0 + scatter[2]);
        let mut out = Vec::with_capacity(2 * self.rows[group].len());
        let mut faces = Vec::with_capacity(self.rows[group].len());
        for row in &self.rows[group] {
            let t = &row.turned;
            let way = t.force / t.force.norm().max(1e-9);
            let shift = row.across[0] * own[0] + row.across[1] * own[1];
            let (mut offset, mut frame) = (Vector2::zeros(), [0.0; 2]);
            for a in active {
                let framed = turn_laws::framed(a, t, &(row.centre + row.ahead + shift));
                frame = [frame[0] + framed[0], frame[1] + framed[1]];
                let step = |v: &[f64]| Vector2::new(v[0], v[1]);
                offset += match a.law.form {
                    form::OFFSET_ROOM => step(a.values),
                    form::OFFSET_TOOL => nalgebra::Rotation2::new(t.tool) * step(a.values),
                    _ => Vector2::zeros(),
                };
            }
            let at = row.centre + row.ahead + shift + offset;
            out.push(at.perp(&way) + share * row.resists * row.resisted(&shift) + row.inert.0 + frame[0] + scatter[0]);
            let closing = -t.velocity.dot(&t.outward);
            faces.push(inside + delay * closing - offset.dot(&t.outward) + frame[1] + scatter[1]);
        }
        out.extend(faces);
        out
    }

    /// A lift that reads its place beside where it is shifts the centre of mass by as much: where turning finds the centre
    /// in the centroid once the contact is put right, an offset of it was none.
    fn feigned(&self, full: &Fit) -> Vec<(&'static str, &str)> {
        if full.laws.iter().all(|l| self.sheet.laws[*l].form == form::MIDDLE) {
            return Vec::new();
        }
        let centred = |k: usize| full.theta[k].abs() < CENTRED.0 + CENTRED.1 * full.covariance[(k, k)].max(0.0).sqrt();
        let bodies = self.names.iter().enumerate();
        bodies
            .filter(|(i, _)| centred(3 * i) && centred(3 * i + 1))
            .map(|(_, name)| ("com-offset", name.as_str()))
            .collect()
    }

    fn about(&self, law: usize) -> usize {
        usize::from(self.sheet.laws[law].form != form::MIDDLE)
    }

    fn named_from(&self, _law: usize, _values: &[f64]) -> f64 {
        if self.sheet.groups.iter().filter(|g| !g.held_out).count() < FEWEST {
            f64::INFINITY
        } else {
            super::naming::NAMED
        }
    }

    fn negligible(&self, law: usize, values: &[f64]) -> bool {
        let least = match self.sheet.laws[law].form {
            form::MIDDLE => NEGLIGIBLE.1,
            form::FRAME | form::SCALE => FRAME,
            _ => NEGLIGIBLE.0,
        };
        let size = values.iter().map(|v| v * v).sum::<f64>().sqrt();
        size < least
    }

    fn covariates(&self, group: usize) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let of = |value: &dyn Fn(&Row) -> f64| {
            let each: Vec<f64> = self.rows[group].iter().map(value).collect();
            [each.clone(), each].concat()
        };
        vec![
            (
                "heading of the face",
                "rad",
                of(&|r| r.turned.outward.y.atan2(r.turned.outward.x)),
            ),
            ("spin", "rad/s", of(&|r| r.turned.spin)),
            (TIME, "s", of(&|r| r.turned.time)),
        ]
    }
}
