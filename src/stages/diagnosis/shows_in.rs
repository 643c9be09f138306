//! In which covariate each cause of the catalogue shows, and how that is best cut in two.

use std::f64::consts::{PI, TAU};

/// How a covariate is cut into a part and the rest of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// At one value: what grows or falls with it.
    Ends,
    /// Between two values: what is at a place.
    Stretch,
    /// A sector of an angle that comes round after this, rad.
    Sector(f64),
}

/// A covariate to look at residuals against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Its name in the family.
    pub covariate: &'static str,
    pub cut: Cut,
    /// The residual is taken along the motion: what brakes to and fro alike does not cancel.
    pub along: bool,
}

impl View {
    pub const fn new(covariate: &'static str, cut: Cut) -> Self {
        let along = false;
        Self { covariate, cut, along }
    }

    const fn along(self) -> Self {
        Self { along: true, ..self }
    }
}

/// Names of covariates that families make for this alone.
pub const LOAD: &str = "load";
pub const WORN: &str = "way slid since the capture began";
pub const SPEEDING: &str = "force that speeds its mass up";
pub const TOOL_HEADING: &str = "heading seen from the tool";
pub const DISTANCE: &str = "distance from that place";
pub const PAST: &str = "way past that place";
pub const ACCELERATION: &str = "joint acceleration";
pub const BACK: &str = "way since it turned back";
/// Sign of a joint's speed.
pub const DIRECTION: &str = "direction of the motion";
/// Made for every family: the size of what the plain model foretells.
pub const FORETOLD: &str = "predicted size";

const HEADING: &str = "heading";
const POSITION: &str = "joint position";
const SPEED: &str = "joint speed";
pub const TIME: &str = "time since the capture began";
const DEPTH: &str = "depth";
pub const RATE: &str = "rate of the press";

/// The covariates in which a cause shows, the plainest first; none where no one covariate shows it.
pub fn shows_in(cause: &str) -> Vec<View> {
    let ends = |name| View::new(name, Cut::Ends);
    let at = |name| View::new(name, Cut::Stretch);
    let sector = |name, period| View::new(name, Cut::Sector(period));
    match cause {
        "velocity-weakening-friction" | "viscous-friction" | "rate-state-friction" => vec![ends("speed")],
        "joint-damping" | "joint-quadratic-damping" | "joint-stiction" => vec![ends(SPEED).along()],
        "soft-close" => vec![at(POSITION).along(), ends(SPEED).along()],
        "lever-arm" => vec![at(POSITION).along()],
        "joint-spring" | "joint-gravity" | "detent" | "latch" | "limit-compliance" | "moving-axis" => {
            vec![at(POSITION)]
        }
        "backlash" => vec![ends(BACK).along()],
        "joint-loose-mass" => vec![ends(ACCELERATION)],
        "added-inertia" => vec![ends(SPEEDING), ends(ACCELERATION)],
        "loose-mass" | "yaw-inertia" => vec![ends(SPEEDING)],
        "anisotropic-friction" => vec![sector(HEADING, PI)],
        "support-tilt" | "gravity-error" | "force-bias-world" => vec![sector(HEADING, TAU)],
        "force-bias" => vec![sector(TOOL_HEADING, TAU)],
        "force-crosstalk" => vec![sector(TOOL_HEADING, PI)],
        "force-gain" | "force-saturation" => vec![ends(FORETOLD)],
        "friction-patch" => vec![ends(DISTANCE), at("place along x"), at("place along y")],
        "hidden-body" => vec![at("place along x"), at("place along y")],
        "magnet" | "bump" => vec![at(PAST), at("place along x"), at("place along y")],
        "tether" => vec![ends("place along x"), ends("place along y")],
        "static-ageing" => vec![ends("waiting time"), ends("slip since the push began")],
        "breakaway-bond" | "presliding" | "contact-law" => vec![ends("slip since the push began")],
        "wear-or-heating" => vec![ends(WORN), ends(TIME)],
        "stiffness-drift" | "force-drift" | "softening-by-use" | "plastic-set" => vec![ends(TIME)],
        "load-dependent-friction" => vec![ends(LOAD)],
        "hardening-stiffness" | "second-stage" | "power-law-stiffness" | "snap-through" | "preload" => {
            vec![at(DEPTH)]
        }
        "elastic-damping" | "stress-relaxation" | "elastic-hysteresis" | "guide-friction" | "adhesion" => {
            vec![ends(RATE)]
        }
        "com-offset" | "uneven-support-pressure" => vec![sector("heading of the face", TAU)],
        _ => Vec::new(),
    }
}

/// How a covariate is cut of which no cause is known.
pub fn usual(covariate: &'static str) -> View {
    match covariate {
        HEADING | TOOL_HEADING | "heading of the face" => View::new(covariate, Cut::Sector(TAU)),
        _ => View::new(covariate, Cut::Ends),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::CAUSES;

    #[test]
    fn what_brakes_is_looked_at_along_the_motion() {
        assert!(
            shows_in("joint-damping")
                .iter()
                .all(|v| v.along && v.covariate == SPEED)
        );
        assert!(shows_in("joint-spring").iter().all(|v| !v.along));
    }

    #[test]
    fn most_of_the_catalogue_shows_somewhere() {
        let shown = CAUSES.iter().filter(|c| !shows_in(c).is_empty()).count();
        assert!(shown > 2 * CAUSES.len() / 3, "{shown}");
    }
}
