//! What may be wrong with the plain model of a push: laws of friction, of the table and of the force sensor.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::family::Active;
use super::push_states::State;

/// Which law, and in which form.
pub mod form {
    pub const WEAKENING: usize = 0;
    pub const WEAKENING_SQUARE: usize = 1;
    pub const VISCOUS: usize = 2;
    pub const AGEING: usize = 3;
    pub const ANISOTROPY: usize = 4;
    pub const ANISOTROPY_OF_BODY: usize = 5;
    pub const PATCH: usize = 6;
    pub const PATCH_SHARP: usize = 7;
    pub const WEAR: usize = 8;
    pub const HEATING: usize = 9;
    pub const TILT: usize = 10;
    pub const BUMP: usize = 11;
    pub const MAGNET: usize = 12;
    pub const TETHER: usize = 13;
    pub const BOND: usize = 14;
    pub const BIAS_TOOL: usize = 15;
    pub const BIAS_ALONG: usize = 16;
    pub const BIAS_WORLD: usize = 17;
    pub const DRIFT_ALONG: usize = 18;
    pub const DRIFT_WORLD: usize = 19;
    pub const CROSSTALK: usize = 20;
    pub const SATURATION: usize = 21;
    pub const RATE_STATE: usize = 22;
    pub const HIDDEN_BODY: usize = 23;
    pub const LOOSE_MASS: usize = 24;
    pub const TETHER_SLACK: usize = 25;
    pub const TETHER_ROUND: usize = 37;
    pub const TETHER_CAUGHT: usize = 38;
    pub const HIDDEN_BODY_ANEW: usize = 26;
    pub const AGEING_RENEWED: usize = 27;
    pub const LOAD_POWER: usize = 28;
    pub const LOAD_ADHESION: usize = 29;
    pub const CROSSTALK_ONTO_X: usize = 30;
    pub const CROSSTALK_ONTO_Y: usize = 31;
    pub const BUMP_BOUNDED: usize = 32;
    pub const MAGNET_FAR: usize = 33;
    pub const BIAS_HELD: usize = 34;
    pub const VISCOUS_POWER: usize = 39;
    pub const TILT_BORNE: usize = 40;
    pub const ANISOTROPY_CREASED: usize = 41;
    pub const ANISOTROPY_OF_BODY_CREASED: usize = 42;
    pub const PATCH_OVAL: usize = 43;
    pub const BUMP_OVAL: usize = 44;
    pub const BUMP_STEP: usize = 45;
    pub const WEAKENING_SHAPED: usize = 46;
    pub const TETHER_OF_BODY: usize = 47;
    pub const WEAR_SETTLING: usize = 48;
    pub const HEATING_SETTLING: usize = 49;
    pub const TETHER_NEAR: usize = 50;
    pub const DRIFT_SETTLING: usize = 51;
}

/// Multiplies friction; `load` is the weight, N.
pub fn share(active: &Active, s: &State, length: f64, load: f64, share: &mut f64) {
    let v = active.values;
    let gaussian = |px: f64, py: f64, r: f64| (-(s.at - Vector2::new(px, py)).norm_squared() / (2.0 * r * r)).exp();
    *share += match active.law.form {
        form::WEAKENING => v[0] * (-s.speed / v[1].exp()).exp(),
        form::WEAKENING_SQUARE => v[0] * (-(s.speed / v[1].exp()).powi(2)).exp(),
        // With no tail exp(-u^n), else what falls as a power of the speed.
        form::WEAKENING_SHAPED => {
            let u = (s.speed / v[1].exp()).powf(v[2].exp());
            v[0] * (1.0 + v[3] * u).powf(-1.0 / v[3])
        }
        form::AGEING => v[0] * (1.0 + s.wait).log10() * (-s.slip / length).exp(),
        // The contact is renewed over the slip length, and its age counts by its logarithm (Dieterich 1979).
        form::AGEING_RENEWED => v[0] * (1.0 + s.wait * (-s.slip / v[1].exp()).exp()).log10(),
        form::ANISOTROPY | form::ANISOTROPY_OF_BODY => twice([v[0], v[1]], s, active.law.form),
        // With a share of four times a turn about the same axis: of |cos| it is -0.2.
        form::ANISOTROPY_CREASED | form::ANISOTROPY_OF_BODY_CREASED => {
            let (own, most) = (twice([v[0], v[1]], s, active.law.form), v[0].hypot(v[1]));
            own + v[2] * (2.0 * own * own / most.max(1e-12) - most)
        }
        form::PATCH => v[0] * gaussian(v[1], v[2], v[3].exp()),
        form::PATCH_SHARP => {
            let r = (s.at - Vector2::new(v[1], v[2])).norm() / (1.5 * v[3].exp());
            v[0] / (1.0 + r.powi(12))
        }
        form::PATCH_OVAL => {
            let away = s.at - Vector2::new(v[1], v[2]);
            v[0] * (-(0.5 * oval(away, v[3].exp(), [v[4], v[5]])).powf(v[6].exp())).exp()
        }
        form::LOAD_POWER => s.loaded.powf(-v[0]) - 1.0,
        form::LOAD_ADHESION => v[0] / (load * s.loaded),
        form::WEAR => v[0] * s.worn,
        form::HEATING => v[0] * s.time,
        form::WEAR_SETTLING => v[0] * settling(s.worn, v[1].exp()),
        form::HEATING_SETTLING => v[0] * settling(s.time, v[1].exp()),
        form::RATE_STATE => v[0] * (s.speed.max(1e-5) / 0.01).ln(),
        _ => 0.0,
    };
}

/// What grows as `x` at first and comes to no more than `most`.
pub(super) fn settling(x: f64, most: f64) -> f64 {
    most * (1.0 - (-x / most).exp())
}

/// What goes twice a turn with the heading, on the table or on the body.
fn twice([c, s]: [f64; 2], state: &State, form: usize) -> f64 {
    let of_body = matches!(form, form::ANISOTROPY_OF_BODY | form::ANISOTROPY_OF_BODY_CREASED);
    let turn = if of_body { state.turn } else { 0.0 };
    let double = 2.0 * (state.heading.y.atan2(state.heading.x) - turn);
    c * double.cos() + s * double.sin()
}

/// The square of how far a place is out, over the size of an ellipse of mean radius `r` that is `exp(stretch)` times as long as wide
/// and lies at an angle.
pub(super) fn oval(away: Vector2<f64>, r: f64, [stretch, angle]: [f64; 2]) -> f64 {
    let own = Rotation2::new(-angle) * away / r;
    own.x.powi(2) * (-stretch).exp() + own.y.powi(2) * stretch.exp()
}

/// Whether the second and the third number of a form are the place about which it acts, m.
pub fn is_about_a_place(form: usize) -> bool {
    matches!(
        form,
        form::PATCH
            | form::PATCH_SHARP
            | form::PATCH_OVAL
            | form::BUMP
            | form::BUMP_BOUNDED
            | form::BUMP_OVAL
            | form::BUMP_STEP
            | form::MAGNET
            | form::MAGNET_FAR
    )
}

/// Something that stands in the way and is pushed along, N along the motion: `reached` (m) is how far it was brought along
/// the direction of the law, and is taken on.
pub fn pushed_along(active: &Active, s: &State, reached: &mut f64, force: &mut f64) {
    if !matches!(active.law.form, form::HIDDEN_BODY | form::HIDDEN_BODY_ANEW) || !s.contact {
        return;
    }
    let (way, v) = (way_of(active), active.values);
    let (here, share) = (way.dot(&s.at), way.dot(&s.heading));
    // Rounded over a millimetre, so that a fit can find the place.
    *force += v[0] * share.max(0.0) / (1.0 + (-(here - *reached) / MEETS).exp());
    if active.law.form == form::HIDDEN_BODY {
        *reached = reached.max(here);
    }
}

/// Length over which a thing in the way is met, m.
const MEETS: f64 = 1.5e-3;

/// Force along the motion, N, by which a part of the mass that hangs on a spring and a damper (share of the mass, rate, damping
/// ratio) lags behind: it answers every change of the body's speed and rings. `load` is the weight, N.
///
/// To a unit step of speed: `m2 w exp(-z w t) (2 z cos(wd t) + (1 - 2 z²)/sqrt(1 - z²) sin(wd t))`, `wd = w sqrt(1 - z²)`,
/// the force of the spring and the damper of `y'' + 2 z w y' + w² y = 0` with `y'(0) = -1`.
pub fn loose(active: &Active, states: &[State], i: usize, load: f64) -> f64 {
    let s = &states[i];
    if active.law.form != form::LOOSE_MASS || !s.contact {
        return 0.0;
    }
    let (share, rate, ratio) = (
        active.values[0],
        active.values[1].exp(),
        active.values[2].exp().min(0.9),
    );
    let damped = (1.0 - ratio * ratio).sqrt();
    let answer = |t: f64| {
        let (sin, cos) = (rate * damped * t).sin_cos();
        rate * (-ratio * rate * t).exp() * (2.0 * ratio * cos + (1.0 - 2.0 * ratio * ratio) / damped * sin)
    };
    let at = |t: f64| {
        let (mut before, mut force) = (0.0, 0.0);
        let mut last: Option<&State> = None;
        for past in states[..=i].iter().filter(|p| p.contact) {
            let when = last.map_or(0.0, |l| 0.5 * (l.since + past.since));
            if when < t {
                force += (past.speed - before) * answer(t - when);
            }
            (before, last) = (past.speed, Some(past));
        }
        force
    };
    // The mean over the stretch.
    let mean = (0..STRETCH).map(|k| at(s.since + s.span * ((k as f64 + 0.5) / STRETCH as f64 - 0.5)));
    share * load / GRAVITY * mean.sum::<f64>() / STRETCH as f64
}

/// Moments of a stretch over which its force is averaged.
const STRETCH: usize = 5;
/// Weight per mass, m/s².
const GRAVITY: f64 = 9.81;

/// Unit direction of a law that has an angle for its first shape parameter.
pub fn way_of(active: &Active) -> Vector2<f64> {
    Vector2::new(active.values[1].cos(), active.values[1].sin())
}

/// Length over which a slack tether comes taut, m.
const TAUT: f64 = 1e-3;

/// Speed at which a power of it is told as a linear damper, m/s.
const VISCOUS_AT: f64 = 0.1;

/// Adds to friction along the motion, N.
pub fn viscous(active: &Active, s: &State, force: &mut f64) {
    let v = active.values;
    *force += match active.law.form {
        form::VISCOUS => v[0] * s.speed,
        form::VISCOUS_POWER => v[0] * VISCOUS_AT * (s.speed / VISCOUS_AT).powf(v[1]),
        form::BOND if s.first => v[0] * (-s.slip / v[1].exp()).exp(),
        _ => 0.0,
    };
}

/// What a tool has to bring up, N, plane of the support, against forces of the table and of what is fixed in the room.
pub fn table(active: &Active, s: &State, load: f64, out: &mut Vector2<f64>) {
    let v = active.values;
    // Slope of a Gaussian hill of unit slope scale: (r − p)/R exp(−|r − p|²/2R²).
    let hill = |px: f64, py: f64, r: f64| {
        let d = s.at - Vector2::new(px, py);
        d * ((-d.norm_squared() / (2.0 * r * r)).exp() / r)
    };
    // The same of a hill that ends (`tail` above nought) or reaches far (below it), (1 − tail d²/2R²)^(1/tail − 1): with nought the Gaussian.
    let tailed = |px: f64, py: f64, r: f64, tail: f64| {
        let d = s.at - Vector2::new(px, py);
        let left = 1.0 - tail * d.norm_squared() / (2.0 * r * r);
        d * (left.max(0.0).powf(1.0 / tail - 1.0) / r)
    };
    *out += match active.law.form {
        form::TILT => Vector2::new(v[0], v[1]) * load,
        form::TILT_BORNE => Vector2::new(v[0], v[1]) * (load * s.loaded),
        form::BUMP_OVAL => {
            let (away, r) = (s.at - Vector2::new(v[1], v[2]), v[3].exp());
            let own = Rotation2::new(-v[5]) * away;
            let slope = Vector2::new(own.x * (-v[4]).exp(), own.y * v[4].exp()) / r;
            Rotation2::new(v[5]) * slope * (-v[0] * load * (-0.5 * oval(away, r, [v[4], v[5]])).exp())
        }
        // A step along a line, up along its direction: its height is an integral of a Gaussian.
        form::BUMP_STEP => {
            let way = Vector2::new(v[4].cos(), v[4].sin());
            let out = way.dot(&(s.at - Vector2::new(v[1], v[2]))) / v[3].exp();
            way * (v[0] * load * (-0.5 * out * out).exp())
        }
        form::BUMP_BOUNDED => tailed(v[1], v[2], v[3].exp(), v[4]) * (-v[0] * load),
        form::MAGNET_FAR => tailed(v[1], v[2], v[3].exp(), v[4]) * v[0],
        form::BUMP => hill(v[1], v[2], v[3].exp()) * (-v[0] * load),
        form::MAGNET => hill(v[1], v[2], v[3].exp()) * v[0],
        form::TETHER_SLACK => {
            let (way, start) = (way_of(active), v[2]);
            // Rounded over a millimetre, so that a fit can find the place.
            let beyond = (way.dot(&s.at) - start) / TAUT;
            way * (v[0] * TAUT * if beyond > 30.0 { beyond } else { beyond.exp().ln_1p() })
        }
        form::TETHER => (s.at - Vector2::new(v[1], v[2])) * v[0],
        // Slack within a circle: taut from there on, or caught there with all that it was stretched.
        form::TETHER_ROUND | form::TETHER_CAUGHT | form::TETHER_OF_BODY | form::TETHER_NEAR => {
            // It may be fastened elsewhere than at the body's centre.
            let fastened = match v.get(4..6) {
                Some(on) => Rotation2::new(s.turn) * Vector2::new(on[0], on[1]),
                None => Vector2::zeros(),
            };
            let away = s.at + fastened - Vector2::new(v[1], v[2]);
            let far = away.norm().max(1e-9);
            let beyond = ((far - v[3]) / TAUT).clamp(-30.0, 30.0);
            if active.law.form != form::TETHER_CAUGHT {
                let stretched = if beyond < 30.0 {
                    TAUT * beyond.exp().ln_1p()
                } else {
                    far - v[3]
                };
                away * (v[0] * stretched / far)
            } else {
                away * (v[0] / (1.0 + (-beyond).exp()))
            }
        }
        _ => Vector2::zeros(),
    };
}

/// What the sensor reads beside the force of the tool, N.
pub fn offset(active: &Active, s: &State, along: &Vector2<f64>, plane: &[Vector3<f64>; 2], out: &mut Vector2<f64>) {
    let v = active.values;
    let flat = |w: &Vector3<f64>| Vector2::new(w.dot(&plane[0]), w.dot(&plane[1]));
    *out += match active.law.form {
        form::BIAS_TOOL => flat(&(s.tool * Vector3::new(v[0], v[1], v[2]))),
        form::BIAS_ALONG => along * v[0],
        form::BIAS_WORLD => Vector2::new(v[0], v[1]),
        // In the room as the tool was held, and turning with it.
        form::BIAS_HELD => Rotation2::new(s.twist) * Vector2::new(v[0], v[1]),
        form::DRIFT_ALONG => along * (v[0] * (s.time + v[1])),
        form::DRIFT_WORLD => Vector2::new(v[0], v[1]) * (s.time + v[2]),
        form::DRIFT_SETTLING => flat(&(s.tool * Vector3::new(v[0], v[1], v[2]))) * settling(s.time + v[3], v[4].exp()),
        _ => Vector2::zeros(),
    };
}

/// What the sensor makes of a force.
pub fn read(active: &Active, force: Vector2<f64>, along: &Vector2<f64>) -> Vector2<f64> {
    let v = active.values;
    match active.law.form {
        form::CROSSTALK => force + Vector2::new(-along.y, along.x) * (v[0] * force.dot(along)),
        form::CROSSTALK_ONTO_X => force + Vector2::x() * (v[0] * force.y),
        form::CROSSTALK_ONTO_Y => force + Vector2::y() * (v[0] * force.x),
        form::SATURATION => {
            let (limit, size) = (v[0].exp(), force.norm());
            if size > limit { force * (limit / size) } else { force }
        }
        _ => force,
    }
}

/// The force of a tool that pushes along the direction of `friction` where the table adds `table`: what is across is
/// not the tool's to hold, the body gives way sideways until its friction holds it.
pub fn held(friction: &Vector2<f64>, table: &Vector2<f64>) -> Vector2<f64> {
    let size = friction.norm().max(1e-12);
    let along = friction / size;
    let across = along.perp(table).abs().min(0.9 * size);
    along * ((size * size - across * across).sqrt() + along.dot(table))
}
