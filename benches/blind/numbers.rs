//! Whether the intervals of what was named hold what was hidden, for the numbers that mean the same in the world and in the law.

use std::collections::BTreeMap;

use palpate::twin::Finding;

/// What the world has for a number of a finding; nothing where the two mean something else.
fn hidden(cause: &str, name: &str, t: &BTreeMap<String, f64>) -> Option<f64> {
    let at = |key: &str| t.get(key).copied();
    let along = |size: &str, axis: usize| {
        let (sin, cos) = at("direction")?.sin_cos();
        Some(at(size)? * [cos, sin][axis])
    };
    match (cause, name) {
        ("com-offset", "cx") | ("contact-point-offset", "dx") => along("distance", 0),
        ("com-offset", "cy") | ("contact-point-offset", "dy") => along("distance", 1),
        ("support-tilt", "tx") => along("angle", 0),
        ("support-tilt", "ty") => along("angle", 1),
        ("force-bias-world", "bx") => along("force", 0),
        ("force-bias-world", "by") => along("force", 1),
        ("force-bias", "b") => at("force"),
        ("force-drift", "d") => at("per_second"),
        ("time-delay", "tau") | ("sensor-lag", "Tf") | ("elastic-damping", "c_over_k") => at("seconds"),
        ("presliding", "way") => at("length"),
        ("length-scale", "s") => at("scale"),
        ("support-compliance", "compliance") => at("compliance"),
        ("second-stage", "d") => at("depth"),
        ("second-stage", "k2_over_k") => at("ratio"),
        ("viscous-friction" | "joint-damping", "b") | ("joint-quadratic-damping", "d") => at("damping"),
        ("loose-mass", "share") | ("added-inertia", "e") => at("share"),
        ("loose-mass" | "joint-loose-mass", "rate") => at("rate"),
        ("joint-loose-mass", "inertia") => at("inertia"),
        ("joint-spring", "k") | ("limit-compliance", "k") => at("stiffness"),
        ("joint-spring", "q0") => at("rest"),
        ("limit-compliance", "q_limit") | ("detent", "qd") => at("position"),
        ("joint-gravity", "gc") => at("cos").map(|x| -x),
        ("joint-gravity", "gs") => at("sin"),
        ("lever-arm", "ec" | "es") => at(name),
        ("backlash", "b") => at("half"),
        ("bump" | "magnet" | "friction-patch", "px") => at("x"),
        ("bump" | "magnet" | "friction-patch", "py") => at("y"),
        _ => None,
    }
}

/// Each number of the finding that names what was hidden: its name, and whether its interval holds the truth.
pub fn held(findings: &[Finding], cause: &str, truth: &BTreeMap<String, f64>) -> Vec<(String, bool)> {
    let Some(finding) = findings.iter().find(|f| f.cause == cause) else {
        return Vec::new();
    };
    let of = |(name, e): (&String, &palpate::base::Estimate)| {
        let (value, [low, high]) = (hidden(cause, name, truth)?, e.ci95?);
        let within = |value: f64| low <= value && value <= high;
        // Which way round a joint counts is free, and the cosine goes with it.
        let mirrored = name == "gc" && within(-value);
        Some((format!("{cause} {name}"), within(value) || mirrored))
    };
    finding.parameters.iter().filter_map(of).collect()
}
