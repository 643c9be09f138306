//! Friction between finger and body from force and motion where they touch.
//!
//! Coulomb's law at the contact: where the finger slides along the face, the tangential force is `mu_f` times the normal
//! one; where it sticks, it is at most that, and only a lower bound is learnt. Whether it slides shows in the difference
//! of the velocities of finger and body at the point where they touch, of which no force and no forward model knows.

use nalgebra::{Isometry2, Isometry3, Rotation2, UnitQuaternion, Vector2, Vector3};

use super::evidence::{MotionState, mean_wrench, motion_at, tare_of};
use crate::base::{Estimate, Pose};
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::math::{chi_squared_tail, median, normal_quantile, quantile, random_effects};
use crate::physics::{Action, Footprint, Linkage};
use crate::twin::Model;

/// Span of one reading, and half the span over which velocities are taken, s.
const SPAN: f64 = 0.05;
const SMOOTHING: f64 = 0.1;
/// The finger slides where its speed along the face is this many standard deviations, and this share of its own speed.
const CLEAR: (f64, f64) = (4.0, 0.1);
/// Readings of a push that must slide for it to tell the friction.
const ENOUGH: usize = 3;
/// Doubt of the face's direction, rad: of the mesh and of the tracked heading (1 sd, anew in every push).
const FACE: f64 = 0.012;
/// Doubt of a finger's velocity, m/s (1 sd).
const ENCODER: f64 = 3e-4;
/// Scatter of the friction from push to push that is expected before any is seen, a share.
const SCATTER: f64 = 0.03;
/// How far the finger may seem from the face, m.
const NEAR: f64 = 0.008;
/// Largest friction of a finger that is thought of: what no measurement bounds from above.
pub(super) const MOST: f64 = 3.0;

/// What one push says of the friction between finger and body.
#[derive(Clone, Debug)]
pub(super) struct Slip {
    pub interaction: String,
    /// The coefficient and its standard deviation, where the finger slid.
    pub slid: Option<(f64, f64)>,
    /// It is not less than this (2.5 %).
    pub least: f64,
    /// How steep the force was at most, tangential over normal.
    pub most: f64,
}

/// One reading of the contact.
struct Reading {
    /// Tangential over normal force; its sign is that of the tangent.
    ratio: f64,
    /// Velocity of the finger along the face, past the body, m/s, and whether it stands out.
    speed: f64,
    slides: bool,
}

/// What a push says of the finger's friction; nothing where force, track or outline are missing.
pub(super) fn slip_of(
    model: &Model,
    name: &str,
    interaction: &Interaction,
    segmented: &Segmented,
    action: &Action,
) -> Option<Slip> {
    let normal = action.normal.into_inner();
    let height = action.tool.position.first()?.coords.dot(&normal);
    let linkage = Linkage::new(model, model.twin.body_of(name)?, &action.start, &normal, height)?;
    let (outline, _) = linkage.outline(linkage.index(name)?)?;
    let plane = PlaneFrame {
        turn: UnitQuaternion::rotation_between(&normal, &Vector3::z())?,
        start: *action.start.get(name)?,
    };
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let mut readings = Vec::new();
    let mut t = slide.start + SPAN;
    while t + SPAN <= slide.end {
        readings.extend(read(interaction, segmented, name, action, outline, &plane, t));
        t += SPAN;
    }
    let sizes: Vec<f64> = readings.iter().map(|r: &Reading| r.ratio.abs()).collect();
    // Friction points the way the finger slides; where it does not, something else was taken for sliding.
    let slides = |r: &&Reading| r.slides && r.ratio * r.speed > 0.0;
    let slid: Vec<f64> = readings.iter().filter(slides).map(|r| r.ratio.abs()).collect();
    let told = slid.len() >= ENOUGH && 3 * slid.len() >= readings.len();
    let middle = median(&slid).filter(|_| told);
    let face = |mu: f64| FACE * (1.0 + mu * mu);
    let most = quantile(&sizes, 0.9)?;
    Some(Slip {
        interaction: interaction.name.clone(),
        slid: middle.map(|mu| {
            let spread = slid.iter().map(|r| (r - mu).powi(2)).sum::<f64>() / slid.len() as f64;
            (mu, face(mu).hypot((spread / slid.len() as f64).sqrt()))
        }),
        least: (most - 1.96 * face(most)).max(0.0),
        most,
    })
}

/// The plane of the support, and where the body was in the world at first.
#[derive(Clone, Debug)]
pub(super) struct PlaneFrame {
    pub turn: UnitQuaternion<f64>,
    pub start: Pose,
}

impl PlaneFrame {
    pub fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        (self.turn * v).xy()
    }

    /// How the body has moved in the plane since the start. Noise of the angles at which it leans has no say, however high above the
    /// origin of the room the plane lies.
    pub fn moved(&self, pose: &Isometry3<f64>) -> Isometry2<f64> {
        let relative = self.turn * pose.rotation * self.start.rotation.inverse() * self.turn.inverse();
        let yaw = relative.scaled_axis().z;
        let [before, now] = [&self.start.translation, &pose.translation].map(|t| self.flat(&t.vector));
        Isometry2::new(now - Rotation2::new(yaw) * before, yaw)
    }
}

fn read(
    interaction: &Interaction,
    segmented: &Segmented,
    name: &str,
    action: &Action,
    outline: &Footprint,
    plane: &PlaneFrame,
    t: f64,
) -> Option<Reading> {
    let (stream, path) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let wrench = mean_wrench(stream, t - 0.5 * SPAN, t + 0.5 * SPAN, &tare_of(interaction, segmented))?;
    let body: MotionState = motion_at(interaction.tracks.get(name)?, t, SMOOTHING)?;
    let tool = motion_at(path, t, SMOOTHING)?;
    let at = (plane.turn * tool.pose.translation.vector).xy();
    let near = outline.nearest(&plane.moved(&body.pose), &at.into());
    if (near.distance - action.tool.radius).abs() > NEAR {
        return None;
    }
    let (inward, tangent) = (-near.outward, Vector2::new(near.outward.y, -near.outward.x));
    let force = plane.flat(&wrench.force);
    let (pressing, along) = (force.dot(&inward), force.dot(&tangent));
    let noise = segmented.force_noise.unwrap_or(0.0) / (wrench.rows as f64).sqrt();
    if pressing < (10.0 * noise).max(1e-6) {
        return None;
    }
    let arm = near.point.coords - plane.flat(&body.pose.translation.vector);
    let spin = (plane.turn * body.spin).z;
    let carried = plane.flat(&body.velocity) + spin * Vector2::new(-arm.y, arm.x);
    let way = plane.flat(&tool.velocity);
    let speed = (way - carried).dot(&tangent);
    let place = segmented.position_noise.unwrap_or(3e-4);
    let heading = segmented.rotation_noise.unwrap_or(3e-3) * arm.norm();
    let sd = (place.hypot(heading) * body.velocity_gain).hypot(ENCODER);
    Some(Reading {
        ratio: along / pressing,
        speed,
        slides: speed.abs() > CLEAR.0 * sd && speed.abs() > CLEAR.1 * way.norm(),
    })
}

/// The finger's friction from all pushes: measured where it slid, else bounded from below; `prior` is median and
/// standard deviation of the logarithm.
pub(super) fn finger_friction(slips: &[Slip], prior: (f64, f64)) -> Option<Estimate> {
    let slid: Vec<&Slip> = slips.iter().filter(|s| s.slid.is_some()).collect();
    let (values, sds): (Vec<f64>, Vec<f64>) = slid.iter().filter_map(|s| s.slid).unzip();
    if let Some(middle) = median(&values) {
        let found = random_effects(&values, &sds, SCATTER * middle)?;
        let from = slid.iter().map(|s| s.interaction.clone()).collect();
        let low = (found.mean - found.half95).max(0.0);
        return Some(
            Estimate::measured(found.mean, found.sd, "1", from, "push-slip")
                .with_interval([low, found.mean + found.half95]),
        );
    }
    let steepest = slips.iter().max_by(|a, b| a.least.total_cmp(&b.least))?;
    // The median of the prior above the bound: half of what probability is left lies on either side.
    let z = (steepest.least.max(1e-6) / prior.0).ln() / prior.1;
    let tail = 0.5 * chi_squared_tail(z * z, 1.0);
    let below = if z > 0.0 { 1.0 - tail } else { tail };
    let value = prior.0 * (prior.1 * normal_quantile(0.5 * (1.0 + below))).exp();
    let value = value.clamp(steepest.least, MOST);
    let sd = value * prior.1;
    let bounded = Estimate::assumed(value, sd, "1", "push-stick: a lower bound, the finger never slid");
    Some(
        Estimate {
            from: vec![steepest.interaction.clone()],
            ..bounded
        }
        .with_interval([steepest.least.min(value), MOST]),
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    /// A body on a table one metre up that is tracked with noise of its lean.
    #[test]
    fn lean_moves_nothing_in_the_plane() {
        let pose = |x: f64, lean: f64, yaw: f64| {
            let rotation = UnitQuaternion::from_euler_angles(lean, -lean, yaw);
            Isometry3::from_parts(Vector3::new(x, 0.3, 1.0).into(), rotation)
        };
        let frame = PlaneFrame {
            turn: UnitQuaternion::identity(),
            start: Pose(pose(0.2, 0.004, 0.1)),
        };
        let moved = frame.moved(&pose(0.25, -0.004, 0.3));
        let about = moved * Point2::new(0.2, 0.3);
        assert!((about - Point2::new(0.25, 0.3)).norm() < 1e-12, "{about}");
        assert!((moved.rotation.angle() - 0.2).abs() < 1e-4);
    }
}
