//! What may be wrong with where a finger touches and how a pushed body turns.

use nalgebra::Vector2;

use super::family::{Active, Law, Parameter, Scatter};
use super::push_catalogue::law;
use crate::stages::estimation::Turned;

pub(super) mod form {
    pub const OFFSET_ROOM: usize = 0;
    pub const OFFSET_TOOL: usize = 1;
    pub const MIDDLE: usize = 2;
    pub const FRAME: usize = 3;
    pub const SCALE: usize = 4;
}

/// The laws, of a tool that was turned from push to push or not.
pub fn turn_laws(tool_turns: bool) -> Vec<Law> {
    let none = || vec![Vec::new()];
    let offset = |form, words| {
        let own = ["dx", "dy"].map(|name| Parameter::amplitude(name, "m", 2e-3));
        law(
            "contact-point-offset",
            "sensor",
            form,
            own.to_vec(),
            Vec::new(),
            none(),
            words,
        )
    };
    let mut laws = vec![offset(
        form::OFFSET_ROOM,
        "the finger touches beside where its path says, by the same step in the room",
    )];
    if tool_turns {
        laws.push(offset(
            form::OFFSET_TOOL,
            "the finger touches beside where its path says, by the same step in its own frame",
        ));
    }
    let scale = || Parameter::amplitude("s", "1", 0.03);
    let turn = Parameter::amplitude("a", "rad", 0.035);
    laws.extend([
        law(
            "tracking-error",
            "sensor",
            form::FRAME,
            vec![scale(), turn],
            Vec::new(),
            none(),
            "what is tracked lies turned and scaled about the origin of the room to where the finger meets it",
        ),
        law(
            "length-scale",
            "sensor",
            form::SCALE,
            vec![scale()],
            Vec::new(),
            none(),
            "what is tracked lies too far out for where the finger meets it",
        ),
        law(
            "uneven-support-pressure",
            "body",
            form::MIDDLE,
            vec![Parameter {
                high: 0.95,
                ..Parameter::positive("e", "1", 0.3)
            }],
            Vec::new(),
            none(),
            "the body resists turning less than its footprint would: it stands on its middle",
        ),
    ]);
    laws
}

/// What a track `(1 + s) R(a) x` of the place x makes of the arm of the force about the tracked origin, and of how far the finger is
/// inside of the face, m; `at` is the place, from that origin, about which friction resists.
pub fn framed(active: &Active, t: &Turned, at: &Vector2<f64>) -> [f64; 2] {
    let [s, a] = match active.law.form {
        form::FRAME => [active.values[0], active.values[1]],
        form::SCALE => [active.values[0], 0.0],
        _ => return [0.0; 2],
    };
    let way = t.force / t.force.norm().max(1e-9);
    let moved = |p: &Vector2<f64>| t.origin * s + Vector2::new(-p.y, p.x) * a;
    [
        a * at.dot(&way) - moved(&t.origin).perp(&way),
        moved(&t.contact).dot(&t.outward),
    ]
}

/// What is new in every push: where exactly the finger touches, along and across, and how much the ground resists turning.
pub fn scatter() -> Vec<Scatter> {
    let one = |(tau, counts, floor): (f64, f64, f64)| Scatter {
        tau,
        counts,
        floor,
        nuisance: true,
        step: 1e-5,
    };
    [(2e-4, 6.0, 5e-5), (2e-4, 6.0, 5e-5), (0.05, 6.0, 0.02)]
        .into_iter()
        .map(one)
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2x3, Rotation2};

    use super::*;

    /// A body at `x` is touched at `p`, whose face looks along `outward`; its track says `(1 + s) R(a) x`, turned by `a`.
    #[test]
    fn a_frame_moves_arms_and_faces_as_geometry_has_it() {
        let (s, a) = (1e-3, 1.5e-3);
        let (x, p) = (Vector2::new(0.12, -0.05), Vector2::new(0.09, -0.03));
        let (outward, force) = (Vector2::new(-0.6, 0.8), Vector2::new(0.8, -0.3));
        let (turn, way) = (Rotation2::new(a), force.normalize());
        // What friction resists with acts at `at` of the true body.
        let at = (p - x) + 0.7 * force;
        let tracked = turn * x * (1.0 + s);
        let seen = Turned {
            time: 0.0,
            force,
            moment: (p - tracked).perp(&force),
            lift: 0.0,
            height: 0.01,
            velocity: Vector2::zeros(),
            velocity_sd: 1e-4,
            acceleration: Vector2::zeros(),
            spin: 0.0,
            spin_rate: (0.0, 0.0),
            axes: Matrix2x3::zeros(),
            inside: (turn * (p - x) - (p - tracked)).dot(&(turn * outward)),
            outward: turn * outward,
            tool: 0.0,
            origin: tracked,
            contact: p,
        };
        let law = turn_laws(false)
            .into_iter()
            .find(|l| l.form == form::FRAME)
            .expect("a law");
        let active = Active {
            law: &law,
            values: &[s, a],
        };
        let [arm, face] = framed(&active, &seen, &(turn * at));
        let plain = (turn * at).perp(&way);
        assert!((plain + arm - seen.moment / force.norm()).abs() < 1e-6);
        assert!((face - seen.inside).abs() < 1e-6);
    }
}
