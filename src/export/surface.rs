//! How a link touches: friction, restitution and compliance, as measured or by documented default.

use crate::base::Estimate;
use crate::twin::Link;

/// Coefficient of friction of a link that was never slid.
pub(super) const DEFAULT_FRICTION: f64 = 0.5;

/// The contact properties of a link.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Coefficient before it slides.
    pub(super) static_friction: f64,
    /// Coefficient while it slides.
    pub(super) kinetic_friction: f64,
    /// Neither was measured.
    pub(super) assumed: bool,
    /// Ratio of friction torque to friction force, m.
    pub(super) torsional_radius: Option<f64>,
    /// Rolling resistance, m.
    pub(super) rolling: Option<f64>,
    /// Coefficient of restitution.
    pub(super) restitution: Option<f64>,
    /// Stiffness, N/m, and damping, N·s/m, where it was pressed.
    pub(super) compliance: Option<(f64, Option<f64>)>,
    /// How far the support gives under it, m/N, where that was seen; the stiffness holds it too.
    pub(super) sinks: Option<f64>,
}

/// What `link`, of the exported `mass` (kg) under `gravity` (m/s²), shows to whatever touches it.
///
/// Where the coefficient is not known but the force of friction is, the coefficient is the force over
/// `mass · gravity`: their product, which the data do fix, is then what the simulator feels.
pub(super) fn surface_of(link: &Link, mass: f64, gravity: f64) -> Surface {
    let weight = mass * gravity;
    let by_force = |e: &Option<Estimate>| e.as_ref().filter(|_| weight > 0.0).map(|e| e.value / weight);
    let value = |e: &Option<Estimate>| e.as_ref().map(|e| e.value);
    let at_rest = value(&link.friction.static_).or_else(|| by_force(&link.friction_force.static_));
    let sliding = value(&link.friction.kinetic).or_else(|| by_force(&link.friction_force.kinetic));
    let kinetic_friction = sliding.or(at_rest).unwrap_or(DEFAULT_FRICTION);
    Surface {
        static_friction: at_rest.unwrap_or(kinetic_friction).max(kinetic_friction),
        kinetic_friction,
        assumed: at_rest.or(sliding).is_none(),
        torsional_radius: value(&link.friction.torsional_radius),
        rolling: value(&link.friction.rolling),
        restitution: value(&link.restitution),
        compliance: value(&link.stiffness)
            .filter(|k| *k > 0.0)
            .map(|k| (k, value(&link.damping))),
        sinks: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;

    #[test]
    fn the_product_that_is_known_is_kept() {
        let mut link = Link::new("tin", Pose::identity());
        link.friction_force.kinetic = Some(Estimate::measured(2.0, 0.1, "N", Vec::new(), "push-static"));
        let surface = surface_of(&link, 0.5, 10.0);
        assert!((surface.kinetic_friction - 0.4).abs() < 1e-12);
        assert!(!surface.assumed);
    }
}
