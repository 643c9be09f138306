//! Friction and damping that a model states of a joint, tried on the loads that moved it.
//!
//! `load = (f + u_t) sign(v) + b v + matter + c`: the model's weight and inertia are taken off, `u_t` is how far the
//! friction of touch `t` strays, `c` the sensor's bias. The pair `(f, b)` of the model is tried as one, for motions of
//! one speed leave only a sum: the one number is accused without which the other would do.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::base::Notices;
use crate::capture::{Capture, Segmented};
use crate::math::{LinearFit, bayesian_linear, effective_samples, mad_sd, median, quantile};
use crate::physics::pressed_underside;
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Compared, Joint, JointKind, Model};

/// Block and half span of velocities, s, and how far the parent may move, m.
const SPAN: [f64; 3] = [0.06, 0.09, 3e-3];
/// Share of the usual speed from which on it slides, and by which the speed may change within a span.
const SLIDES: f64 = 0.4;
const STEADY: f64 = 0.15;
/// Share of the load by which friction strays from touch to touch, and by which the law itself may be off.
const STRAYS: f64 = 0.02;
const FORM: f64 = 0.01;
/// Share of the load that a sensor's bias may be.
const BIAS: f64 = 0.02;
/// Share by which the drag of a child on the table may be another than the model's.
const DRAG: f64 = 0.15;
/// Fewest blocks.
const FEWEST: usize = 8;
/// 95 % of chi-squared with two degrees of freedom, and of a normal number.
const PAIR: f64 = 5.991;
const ONE: f64 = 1.96;

/// What the loads say of each joint's friction and damping beside what the model says.
pub fn joint_numbers(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    notices: &mut Notices,
) -> Vec<Compared> {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let mut all = Vec::new();
    for joint in model.twin.joints().filter(kinds) {
        let Some(friction) = joint.friction.as_ref() else {
            continue;
        };
        let damping = joint.damping.as_ref().map_or(0.0, |d| d.value);
        match rows(capture, segmented, model, joint).and_then(|rows| Told::of(&rows)) {
            Ok(told) => all.extend(told.beside(joint, [friction.value, damping])),
            Err(why) => notices.note(
                "diagnosis",
                &joint.name,
                format!("its friction and damping are not tried: {why}"),
            ),
        }
    }
    all
}

/// One block: touch, load less what the model knows of it, speed.
struct Row {
    touch: usize,
    load: f64,
    speed: f64,
    drag: f64,
}

fn rows(capture: &Capture, segmented: &[Segmented], model: &Model, joint: &Joint) -> Result<Vec<Row>, String> {
    let hung = Hung::of(joint, model, &capture.gravity)?;
    let mut out = Vec::new();
    for (touch, interaction) in capture.interactions.iter().enumerate() {
        let Some(cut) = segmented.iter().find(|s| s.interaction == interaction.name) else {
            continue;
        };
        let Some(loads) = joint_loads(interaction, cut, joint, model, SPAN) else {
            continue;
        };
        let usual = quantile(&loads.iter().map(|l| l.speed.abs()).collect::<Vec<f64>>(), 0.9).unwrap_or(0.0);
        let slides = |l: &&JointLoad| l.speed.abs() > SLIDES * usual;
        let steady = |l: &&JointLoad| l.acceleration.abs() * SPAN[1] < STEADY * l.speed.abs();
        out.extend(
            loads
                .iter()
                .filter(slides)
                .filter(steady)
                .filter(|l| hung.within(l))
                .map(|l| Row {
                    touch,
                    load: l.load - hung.load(l),
                    speed: l.speed,
                    drag: hung.drag * l.speed.signum(),
                }),
        );
    }
    if out.len() < FEWEST {
        return Err("no touch moves it steadily while what holds it stands".into());
    }
    Ok(out)
}

/// What hangs on a joint, as the model has it.
struct Hung {
    /// Mass, kg, arm from the joint's origin, m, and inertia about the axis through its centre, kg·m².
    parts: Vec<(f64, Vector3<f64>, f64)>,
    axis: Unit<Vector3<f64>>,
    slides: bool,
    gravity: Vector3<f64>,
    /// Friction on the table along the freedom, N or N·m, of what stands on it.
    drag: f64,
    limits: Option<[f64; 2]>,
}

impl Hung {
    fn of(joint: &Joint, model: &Model, gravity: &Vector3<f64>) -> Result<Self, String> {
        let axis = Unit::try_new(Vector3::from(joint.axis.value), 1e-9).ok_or("its axis has no direction")?;
        let (origin, slides) = (Point3::from(joint.origin.value), joint.kind == JointKind::Prismatic);
        let mut out = Self {
            parts: Vec::new(),
            axis,
            slides,
            gravity: *gravity,
            drag: 0.0,
            limits: joint.limits.as_ref().map(|l| l.value),
        };
        let mut names = vec![joint.child.clone()];
        let mut at = 0;
        while at < names.len() {
            let more = model.twin.joints().filter(|j| j.parent == names[at]);
            let more: Vec<String> = more.map(|j| j.child.clone()).filter(|n| !names.contains(n)).collect();
            names.extend(more);
            let link = model.twin.link(&names[at]).ok_or("its child is not in the model")?;
            at += 1;
            let pose = link.pose.0;
            if let Some(mass) = link.mass.as_ref().map(|m| m.value) {
                let com = link.com.as_ref().map_or(Point3::origin(), |c| Point3::from(c.value));
                let along = pose.rotation.inverse() * axis.into_inner();
                let about = link.inertia.as_ref().map_or(0.0, |i| {
                    let [xx, yy, zz, xy, xz, yz] = i.value;
                    let m = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                    along.dot(&(m * along))
                });
                out.parts.push((mass, pose * com - origin, about));
            }
            if let Some(force) = link.friction_force.kinetic.as_ref() {
                let mesh = link.mesh.as_ref().and_then(|m| model.meshes.get(m));
                out.drag += force.value
                    * if slides {
                        1.0
                    } else {
                        out.reach(mesh, &pose, &origin, link)
                    };
            }
        }
        Ok(out)
    }

    /// Mean distance from the axis of what stands on the table, m.
    fn reach(
        &self,
        mesh: Option<&crate::geometry::Mesh>,
        pose: &Isometry3<f64>,
        origin: &Point3<f64>,
        link: &crate::twin::Link,
    ) -> f64 {
        let com = link.com.as_ref().map_or(Point3::origin(), |c| Point3::from(c.value));
        let centre = (pose * com).xy();
        let pressed = mesh.and_then(|m| pressed_underside(m, pose, &centre));
        pressed.map_or((centre - origin.xy()).norm(), |p| {
            let away = |(at, share): &(nalgebra::Vector2<f64>, f64)| share * (p.centre + at - origin.xy()).norm();
            p.points.iter().map(away).sum()
        })
    }

    /// Away from the ends that the model gives it.
    fn within(&self, l: &JointLoad) -> bool {
        self.limits.is_none_or(|[low, high]| {
            let rim = 0.02 * (high - low);
            l.position > low + rim && l.position < high - rim
        })
    }

    /// Weight, inertia and drag, N or N·m.
    fn load(&self, l: &JointLoad) -> f64 {
        let axis = self.axis.into_inner();
        let turn = UnitQuaternion::from_axis_angle(&self.axis, l.position);
        let of = |(mass, arm, about): &(f64, Vector3<f64>, f64)| {
            if self.slides {
                return mass * (l.acceleration - self.gravity.dot(&axis));
            }
            let arm = turn * arm;
            let across = (arm - axis * axis.dot(&arm)).norm_squared();
            (about + mass * across) * l.acceleration - mass * self.gravity.dot(&axis.cross(&arm))
        };
        self.parts.iter().map(of).sum::<f64>() + self.drag * l.speed.signum()
    }
}

/// Friction and damping as the loads have them.
struct Told {
    value: [f64; 2],
    covariance: [[f64; 2]; 2],
    /// The speed of most of them, rad/s or m/s.
    speed: f64,
}

impl Told {
    fn of(rows: &[Row]) -> Result<Self, String> {
        let sizes: Vec<f64> = rows.iter().map(|r| (r.load + r.drag).abs()).collect();
        let speeds: Vec<f64> = rows.iter().map(|r| r.speed.abs()).collect();
        let none = || "its loads tell nothing".to_owned();
        let (size, speed) = (
            median(&sizes).ok_or_else(none)?.max(1e-9),
            median(&speeds).ok_or_else(none)?,
        );
        let mut touches: Vec<usize> = rows.iter().map(|r| r.touch).collect();
        touches.dedup();
        let all = 4 + touches.len();
        let a = DMatrix::from_fn(rows.len(), all, |i, k| match k {
            0 => rows[i].speed.signum(),
            1 => rows[i].speed,
            2 => 1.0,
            3 => rows[i].drag,
            _ if touches[k - 4] == rows[i].touch => rows[i].speed.signum(),
            _ => 0.0,
        });
        let b = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.load));
        let open = 10.0 * size;
        let sd = DVector::from_fn(all, |k, _| match k {
            0 => open,
            1 => open / speed,
            2 => BIAS * size,
            3 => DRAG,
            _ => STRAYS * size,
        });
        let fit = calmed(&a, &b, &sd, size).ok_or_else(none)?;
        let mut covariance = [[0.0; 2]; 2];
        for (i, row) in covariance.iter_mut().enumerate() {
            for (k, c) in row.iter_mut().enumerate() {
                *c = fit.covariance[(i, k)];
            }
        }
        // The law's own error is one of the whole load: it may lie in either.
        covariance[0][0] += (FORM * size).powi(2);
        covariance[1][1] += (FORM * size / speed).powi(2);
        Ok(Self {
            value: [fit.x[0], fit.x[1]],
            covariance,
            speed,
        })
    }

    /// Both numbers, where the loads part them or one of them cannot be; else their sum.
    fn beside(&self, joint: &Joint, own: [f64; 2]) -> Vec<Compared> {
        let units = match joint.kind {
            JointKind::Prismatic => ["N", "N·s/m", "m/s"],
            _ => ["N·m", "N·m·s/rad", "rad/s"],
        };
        let row = |quantity: String, model: f64, measured: f64, sd: f64, outside: bool, unit: &str, note| Compared {
            about: joint.name.clone(),
            quantity,
            model,
            measured,
            ci95: [measured - ONE * sd, measured + ONE * sd],
            outside,
            unit: unit.into(),
            note,
        };
        let [[ff, fb], [_, bb]] = self.covariance;
        let away = [self.value[0] - own[0], self.value[1] - own[1]];
        let squared =
            (away[0].powi(2) * bb - 2.0 * away[0] * away[1] * fb + away[1].powi(2) * ff) / (ff * bb - fb * fb);
        let speed = self.speed;
        let total = |[f, b]: [f64; 2]| f + b * speed;
        let total_sd = (ff + 2.0 * speed * fb + speed * speed * bb).sqrt();
        let words = format!("friction + {} {} of damping", short(speed), units[2]);
        let sum = |outside, note: &str| {
            let note = Some(note.to_owned());
            row(
                words.clone(),
                total(own),
                total(self.value),
                total_sd,
                outside,
                units[0],
                note,
            )
        };
        if squared <= PAIR {
            return vec![sum(false, "its friction and damping fit together")];
        }
        // What one of them would have to be, were the other right.
        let alone = [
            (
                self.value[0] - fb / bb * away[1],
                (ff - fb * fb / bb).sqrt(),
                away[1].abs() <= ONE * bb.sqrt(),
            ),
            (
                self.value[1] - fb / ff * away[0],
                (bb - fb * fb / ff).sqrt(),
                away[0].abs() <= ONE * ff.sqrt(),
            ),
        ];
        let can = alone.map(|(value, sd, fits)| fits && value > -ONE * sd);
        let names = ["friction", "damping"];
        let one = |k: usize| {
            let (value, sd, _) = alone[k];
            let note = format!("with the {} of the model, which fits", names[1 - k]);
            row(names[k].into(), own[k], value, sd, true, units[k], Some(note))
        };
        match can {
            [true, false] => vec![one(0)],
            [false, true] => vec![one(1)],
            [true, true] => vec![sum(
                true,
                "one of the two: moved at half and at twice the speed it would tell which",
            )],
            [false, false] => {
                let both = [ff.sqrt(), bb.sqrt()];
                let of = |k: usize| row(names[k].into(), own[k], self.value[k], both[k], true, units[k], None);
                vec![of(0), of(1)]
            }
        }
    }
}

/// The fit by least squares, its noise and memory from its own residuals.
fn calmed(a: &DMatrix<f64>, b: &DVector<f64>, sd: &DVector<f64>, size: f64) -> Option<LinearFit> {
    let mean = DVector::zeros(sd.len());
    let (mut noise, mut memory) = (0.1 * size, 1.0);
    let mut trust = DVector::from_element(b.len(), 1.0);
    let mut fit = None;
    for _ in 0..12 {
        let weights = trust.map(|w| w / (memory * noise * noise));
        let found = bayesian_linear(a, b, &weights, &mean, sd)?;
        noise = mad_sd(found.residuals.as_slice())?.max(1e-3 * size);
        trust = found.residuals.map(|r| (1.345 * noise / r.abs().max(1e-300)).min(1.0));
        let trusted: Vec<f64> = found
            .residuals
            .iter()
            .zip(trust.iter())
            .map(|(r, w)| r * w.sqrt())
            .collect();
        memory = (b.len() as f64 / effective_samples(&trusted)).max(1.0);
        fit = Some(found);
    }
    fit
}

/// Three digits.
fn short(value: f64) -> String {
    format!("{value:.3}")
}
