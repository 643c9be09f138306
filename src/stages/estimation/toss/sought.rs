//! What tosses are fitted with: each number with its prior, its bounds and its step.

use super::conditions::Conditions;

/// One number that is sought, with its prior: normal, cut to a range.
#[derive(Clone, Copy, Debug)]
pub struct Sought {
    /// What it is called.
    pub name: &'static str,
    /// Centre and standard deviation of the prior.
    pub prior: (f64, f64),
    /// Bounds.
    pub range: (f64, f64),
    /// Finite step for derivatives.
    pub step: f64,
    /// Reads it.
    pub get: fn(&Conditions) -> f64,
    /// Sets it.
    pub set: fn(&mut Conditions, f64),
}

macro_rules! sought {
    ($name:expr, $prior:expr, $range:expr, $step:expr, $($field:tt)+) => {
        Sought { name: $name, prior: $prior, range: $range, step: $step, get: |c| c.$($field)+, set: |c, x| c.$($field)+ = x }
    };
}

/// What a rigid body's tosses are fitted with.
pub fn rigid() -> Vec<Sought> {
    vec![
        sought!("restitution", (0.3, 0.4), (0.0, 0.98), 0.02, restitution),
        sought!("friction", (0.4, 0.4), (0.0, 3.0), 0.01, friction),
        sought!("inertia", (0.0, 0.4), (-1.2, 1.2), 0.03, log_inertia),
        sought!("rounding", (0.0, 3e-3), (0.0, 0.02), 4e-4, rounding),
        sought!("rise", (0.0, 1e-3), (-0.01, 0.01), 2e-4, rise),
        sought!("lying", (0.0, 1e-3), (-0.01, 0.01), 2e-4, lying),
        sought!("drag", (0.0, 0.05), (0.0, 0.5), 0.01, drag),
        sought!("gravity", (0.0, 0.02), (-0.3, 0.3), 2e-3, gravity),
        sought!("centre-x", (0.0, 0.01), (-0.1, 0.1), 5e-4, centre.x),
        sought!("centre-y", (0.0, 0.01), (-0.1, 0.1), 5e-4, centre.y),
        sought!("centre-z", (0.0, 0.01), (-0.1, 0.1), 5e-4, centre.z),
    ]
}

/// What the flights of a body of two links are fitted with: where their mass is, and the hinge.
pub fn flying(shape_doubt: f64) -> Vec<Sought> {
    let far = (0.0, shape_doubt);
    let wide = (0.0, 0.5);
    vec![
        sought!("gravity", (0.0, 0.02), (-0.3, 0.3), 2e-3, gravity),
        sought!("drag", (0.0, 0.05), (0.0, 0.5), 0.01, drag),
        sought!("centre-x", far, (-0.1, 0.1), 5e-4, centre.x),
        sought!("centre-y", far, (-0.1, 0.1), 5e-4, centre.y),
        sought!("centre-z", far, (-0.1, 0.1), 5e-4, centre.z),
        sought!("second-x", far, (-0.1, 0.1), 5e-4, second_centre.x),
        sought!("second-y", far, (-0.1, 0.1), 5e-4, second_centre.y),
        sought!("second-z", far, (-0.1, 0.1), 5e-4, second_centre.z),
        sought!("spread-xx", wide, (-3.0, 3.0), 0.02, spread[0][0]),
        sought!("spread-yy", wide, (-3.0, 3.0), 0.02, spread[0][1]),
        sought!("spread-zz", wide, (-3.0, 3.0), 0.02, spread[0][2]),
        sought!("spread-xy", wide, (-3.0, 3.0), 0.02, spread[0][3]),
        sought!("second-spread-xx", wide, (-3.0, 3.0), 0.02, spread[1][0]),
        sought!("second-spread-yy", wide, (-3.0, 3.0), 0.02, spread[1][1]),
        sought!("second-spread-zz", wide, (-3.0, 3.0), 0.02, spread[1][2]),
        sought!("second-spread-xy", wide, (-3.0, 3.0), 0.02, spread[1][3]),
        sought!("hinge-friction", (0.0, 0.05), (0.0, 2.0), 2e-3, hinge_friction),
        sought!("hinge-damping", (0.0, 0.01), (0.0, 1.0), 2e-4, hinge_damping),
    ]
}

/// What the contacts of a body of two links are fitted with.
pub fn landing() -> Vec<Sought> {
    let mut all = rigid();
    all.retain(|s| ["restitution", "friction", "rounding", "rise", "lying"].contains(&s.name));
    all.extend([
        sought!("hinge-friction", (0.0, 0.05), (0.0, 2.0), 2e-3, hinge_friction),
        sought!("hinge-damping", (0.0, 0.01), (0.0, 1.0), 2e-4, hinge_damping),
    ]);
    all
}
