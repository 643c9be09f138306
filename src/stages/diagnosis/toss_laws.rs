//! What may be wrong with a plain body that flies, strikes and slides: laws of the body, the support, gravity and what
//! tracks it.

use super::family::{Law, Parameter};
use crate::stages::estimation::{Conditions, Sought, sought_of_flights, sought_of_tosses};

/// How far a carved shape's centre may be from that of its mass, m.
const CARVED: f64 = 0.03;

/// Numbers of the conditions that laws move, after those that the plain model has.
pub fn movable(hinged: bool) -> Vec<Sought> {
    let mut all = sought_of_tosses();
    if hinged {
        let known: Vec<&str> = all.iter().map(|s| s.name).collect();
        let more = sought_of_flights(CARVED);
        all.extend(
            more.into_iter()
                .filter(|s| !known.contains(&s.name) && !s.name.starts_with("hinge")),
        );
    }
    let wide = (-10.0, 10.0);
    let of = |name, step, get: fn(&Conditions) -> f64, set: fn(&mut Conditions, f64)| Sought {
        name,
        prior: (0.0, 1.0),
        range: wide,
        step,
        get,
        set,
    };
    all.extend([
        // The mesh alone is larger: lengths of the track and gravity are right.
        Sought {
            prior: (0.0, SIZE),
            ..of("size", 2e-3, |c| c.size, |c, x| c.size = x)
        },
        of("scale", 2e-3, |c| c.scale, |c, x| c.scale = x),
        of(
            "gravity-tilt-x",
            2e-3,
            |c| c.gravity_tilt[0],
            |c, x| c.gravity_tilt[0] = x,
        ),
        of(
            "gravity-tilt-y",
            2e-3,
            |c| c.gravity_tilt[1],
            |c, x| c.gravity_tilt[1] = x,
        ),
        of(
            "support-tilt-x",
            2e-3,
            |c| c.support_tilt[0],
            |c, x| c.support_tilt[0] = x,
        ),
        of(
            "support-tilt-y",
            2e-3,
            |c| c.support_tilt[1],
            |c, x| c.support_tilt[1] = x,
        ),
        of("excess-slow", 0.05, |c| c.excess.0, |c, x| c.excess = (x, 0.03)),
        of("excess-fast", 0.05, |c| c.excess.0, |c, x| c.excess = (x, 0.2)),
        of("viscous", 0.05, |c| c.viscous, |c, x| c.viscous = x),
        of(
            "hinge-friction",
            2e-3,
            |c| c.hinge_friction,
            |c, x| c.hinge_friction = x,
        ),
        of("hinge-damping", 2e-4, |c| c.hinge_damping, |c, x| c.hinge_damping = x),
    ]);
    all
}

/// What the plain model of a toss is free in.
const BASE: [&str; 8] = [
    "restitution",
    "friction",
    "rounding",
    "rise",
    "lying",
    "size",
    "drag",
    "inertia",
];

/// The plain model's parameters; of a shape that was carved from the tosses nobody knows where its mass is.
pub fn base(hinged: bool, carved: bool) -> Vec<Parameter> {
    let all = movable(hinged);
    let own = |name: &str| {
        let s = all.iter().find(|s| s.name == name)?;
        let sd = match name {
            "rise" => SURFACE,
            "lying" => LYING,
            _ => s.prior.1,
        };
        Some(parameter(s, sd))
    };
    let mut out: Vec<Parameter> = BASE.iter().filter_map(|name| own(name)).collect();
    if hinged || carved {
        let open = all
            .iter()
            .filter(|s| s.name.contains("centre") || s.name.contains("second") || s.name.contains("spread"));
        out.extend(open.map(|s| parameter(s, s.prior.1)));
    }
    if hinged {
        out.extend(own("hinge-friction"));
    }
    out
}

fn parameter(s: &Sought, sd: f64) -> Parameter {
    Parameter {
        name: s.name,
        unit: unit_of(s.name),
        centre: s.prior.0,
        sd,
        low: s.range.0,
        high: s.range.1,
        log: false,
    }
}

/// How well a capture says where the surfaces of body and support are, m; and how much lower or higher a body lies than it
/// strikes.
const SURFACE: f64 = 5e-4;
const LYING: f64 = 2e-4;
/// How far the law of impact itself may be off, as a logarithm of the inertia that it seems to show (Newton's restitution
/// at corners that strike together is a model): a ratio that is nearer to one is no finding.
pub const IMPACT: f64 = 0.22;
/// How far the size of the mesh may be off, as a share.
const SIZE: f64 = 0.01;

fn unit_of(name: &str) -> &'static str {
    match name {
        "restitution" | "friction" | "inertia" | "size" => "1",
        "drag" => "1/m",
        "hinge-friction" => "N·m/kg",
        _ => "m",
    }
}

/// A law, with the numbers that it moves: for each of its parameters, which numbers by how much.
pub struct TossLaw {
    pub law: Law,
    pub moves: Vec<Vec<(&'static str, f64)>>,
    /// It is about flight.
    pub flies: bool,
}

fn law(cause: &'static str, place: &str, amplitudes: Vec<Parameter>, words: &'static str) -> Law {
    Law {
        cause,
        place: place.into(),
        form: 0,
        amplitudes: amplitudes.len(),
        parameters: amplitudes,
        grid: vec![Vec::new()],
        extends: &[],
        words,
    }
}

/// Every law that tosses can show.
pub fn toss_laws(link: &str, joint: Option<&str>, carved: bool) -> Vec<TossLaw> {
    // Of a shape that was carved from the tosses nobody knows where its mass is: it may fly in any way.
    let mut all = if carved { Vec::new() } else { world_laws() };
    if !carved {
        all.extend(body_laws(link));
    }
    if let Some(joint) = joint {
        all.push(TossLaw {
            law: law(
                "joint-damping",
                joint,
                vec![Parameter::positive("b_over_mass", "N·m·s/(rad·kg)", 2e-3)],
                "the hinge resists in proportion to its speed",
            ),
            moves: vec![vec![("hinge-damping", 1.0)]],
            flies: true,
        });
    }
    for (form, own) in all.iter_mut().enumerate() {
        own.law.form = form;
    }
    all
}

fn world_laws() -> Vec<TossLaw> {
    let amplitude = Parameter::amplitude;
    vec![
        TossLaw {
            law: law(
                "length-scale",
                "sensor",
                vec![amplitude("s", "1", 0.03)],
                "all lengths of the track are off by one factor: bodies fall too slowly or too fast, and lie too low or too high",
            ),
            moves: vec![vec![("scale", 1.0)]],
            flies: true,
        },
        TossLaw {
            law: law(
                "gravity-error",
                "support",
                vec![amplitude("g", "1", 0.02)],
                "bodies fall faster or slower than the gravity of the capture has them, and lie where they should",
            ),
            moves: vec![vec![("gravity", 1.0)]],
            flies: true,
        },
        TossLaw {
            law: law(
                "gravity-error",
                "support",
                vec![amplitude("tilt_x", "rad", 0.05), amplitude("tilt_y", "rad", 0.05)],
                "bodies in flight are drawn sideways: gravity is not where the capture has it",
            ),
            moves: vec![vec![("gravity-tilt-x", 1.0)], vec![("gravity-tilt-y", 1.0)]],
            flies: true,
        },
        TossLaw {
            law: law(
                "clock-drift",
                "sensor",
                vec![amplitude("e", "1", 1e-3)],
                "the clock runs at another rate: bodies fall too slowly or too fast",
            ),
            moves: vec![vec![("gravity", -2.0)]],
            flies: true,
        },
        TossLaw {
            law: law(
                "tracking-error",
                "sensor",
                vec![amplitude("tilt_x", "rad", 0.035), amplitude("tilt_y", "rad", 0.035)],
                "the frame of the track is turned: bodies are drawn sideways in flight and strike as on a slope",
            ),
            moves: vec![
                vec![("gravity-tilt-x", 1.0), ("support-tilt-x", 1.0)],
                vec![("gravity-tilt-y", 1.0), ("support-tilt-y", 1.0)],
            ],
            flies: true,
        },
        TossLaw {
            law: law(
                "support-tilt",
                "support",
                vec![amplitude("tilt_x", "rad", 0.05), amplitude("tilt_y", "rad", 0.05)],
                "bodies strike and slide as on a slope, and are not drawn sideways in flight",
            ),
            moves: vec![vec![("support-tilt-x", 1.0)], vec![("support-tilt-y", 1.0)]],
            flies: false,
        },
    ]
}

fn body_laws(link: &str) -> Vec<TossLaw> {
    let amplitude = Parameter::amplitude;
    let weakening = |numbers: &'static str| TossLaw {
        law: law(
            "velocity-weakening-friction",
            "support",
            vec![Parameter::positive("a", "1", 0.3)],
            "friction falls as the body slides faster",
        ),
        moves: vec![vec![(numbers, 1.0)]],
        flies: false,
    };
    vec![
        TossLaw {
            law: law(
                "nonuniform-density",
                link,
                vec![amplitude("log_inertia_ratio", "1", 0.4)],
                "impacts turn the body less or more than its shape at uniform density would: its mass lies farther out or in",
            ),
            moves: vec![vec![("inertia", 1.0)]],
            flies: false,
        },
        TossLaw {
            law: law(
                "com-offset",
                link,
                vec![
                    amplitude("x", "m", 0.01),
                    amplitude("y", "m", 0.01),
                    amplitude("z", "m", 0.01),
                ],
                "in flight the body turns about a point that is not the centroid of its shape",
            ),
            moves: vec![
                vec![("centre-x", 1.0)],
                vec![("centre-y", 1.0)],
                vec![("centre-z", 1.0)],
            ],
            flies: false,
        },
        weakening("excess-slow"),
        weakening("excess-fast"),
        TossLaw {
            law: law(
                "viscous-friction",
                "support",
                vec![Parameter::positive("b_over_load", "s/m", 0.3)],
                "friction grows as the body slides faster",
            ),
            moves: vec![vec![("viscous", 1.0)]],
            flies: false,
        },
    ]
}
