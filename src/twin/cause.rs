//! The names that a finding may bear.

use crate::base::{Error, Result, nearest_name};

/// Every cause that a diagnosis may name, as `diagnosis.json` and `--causes` spell it.
pub const CAUSES: [&str; 67] = [
    "velocity-weakening-friction",
    "viscous-friction",
    "static-ageing",
    "rate-state-friction",
    "anisotropic-friction",
    "friction-patch",
    "load-dependent-friction",
    "uneven-support-pressure",
    "rolling-resistance",
    "presliding",
    "wear-or-heating",
    "tool-friction",
    "contact-law",
    "com-offset",
    "yaw-inertia",
    "loose-mass",
    "added-inertia",
    "nonuniform-density",
    "support-tilt",
    "gravity-error",
    "length-scale",
    "bump",
    "contact-point-offset",
    "hardening-stiffness",
    "second-stage",
    "power-law-stiffness",
    "elastic-damping",
    "stress-relaxation",
    "plastic-set",
    "elastic-hysteresis",
    "guide-friction",
    "softening-by-use",
    "snap-through",
    "preload",
    "support-compliance",
    "stiffness-drift",
    "adhesion",
    "joint-stiction",
    "joint-damping",
    "joint-quadratic-damping",
    "joint-spring",
    "joint-gravity",
    "detent",
    "latch",
    "backlash",
    "limit-compliance",
    "lever-arm",
    "moving-axis",
    "joint-coupling",
    "soft-close",
    "joint-loose-mass",
    "breakaway-bond",
    "magnet",
    "tether",
    "hidden-body",
    "force-bias",
    "force-bias-world",
    "force-gain",
    "force-drift",
    "force-crosstalk",
    "force-saturation",
    "time-delay",
    "sensor-lag",
    "clock-drift",
    "tracking-error",
    "quantisation",
    "outliers",
];

/// Refuses a name that is not of the catalogue.
///
/// # Errors
/// Where `name` is no cause; the nearest one is offered.
pub fn known_cause(name: &str) -> Result<()> {
    if CAUSES.contains(&name) {
        return Ok(());
    }
    let nearest = nearest_name(name, CAUSES.iter().copied()).unwrap_or_default();
    let expected = format!("names of causes, such as {nearest}");
    Err(Error::bad_input(
        "--causes",
        name,
        "no cause of the catalogue",
        expected,
    ))
}
