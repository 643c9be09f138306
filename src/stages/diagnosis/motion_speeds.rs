//! What a joint resists with as it moves faster or slower.

use super::family::{Law, Parameter};
use super::motion_laws::{Maker, form, logs, units};
use super::motions::Scale;

/// Laws of how fast a joint moves.
pub fn speed_laws(make: &Maker, s: &Scale) -> Vec<Law> {
    let [_, per_speed, per_square, _] = units(s.turns);
    let (v, unit) = (s.speed, if s.turns { "rad/s" } else { "m/s" });
    let close = (s.range[1] - s.range[0]).max(1e-6);
    let quadratic = make.plain(
        "joint-quadratic-damping",
        form::QUADRATIC,
        Parameter::positive("d", per_square, 0.5 * s.load / (v * v)),
        "the joint resists with the square of its speed",
    );
    vec![
        make.law(
            "joint-stiction",
            form::STICTION,
            (
                vec![Parameter::positive("fs_over_fc", "1", 0.8)],
                vec![Parameter::scale("vs", unit, 0.04 * v, 0.6)],
            ),
            logs(&[0.02 * v, 0.06 * v]),
            "more force is needed to set the joint going than to keep it going",
        ),
        make.law(
            "joint-stiction",
            form::BREAKAWAY,
            (
                vec![Parameter::positive("fs_over_fc", "1", 0.8)],
                vec![Parameter::scale(
                    "slip_length",
                    if s.turns { "rad" } else { "m" },
                    0.02 * close,
                    0.6,
                )],
            ),
            logs(&[0.01 * close, 0.04 * close]),
            "more force is needed to set the joint going than to keep it going",
        ),
        make.law(
            "velocity-weakening-friction",
            form::STRIBECK,
            (
                vec![Parameter::positive("a", "1", 0.3)],
                vec![Parameter::scale("vs", unit, 0.3 * v, 0.6)],
            ),
            logs(&[0.15 * v, 0.4 * v]),
            "dry friction falls as the joint moves faster",
        ),
        make.plain(
            "joint-damping",
            form::DAMPING,
            Parameter::positive("b", per_speed, 0.5 * s.load / v),
            "the joint resists in proportion to its speed",
        ),
        make.law(
            "joint-damping",
            if s.turns {
                form::DAMPING_TURNING
            } else {
                form::DAMPING_SLIDING
            },
            (
                vec![Parameter::positive("b", per_speed, 0.5 * s.load / v)],
                vec![Parameter::less_than_linear()],
            ),
            vec![vec![0.7]],
            "the joint resists the more the faster it moves",
        ),
        thinning(make, s),
        about_square(quadratic.clone(), s.turns),
        quadratic,
    ]
}

/// Grease that shears thins: a damper at first, and beyond some speed a friction that hardly grows any more (Carreau 1972).
fn thinning(make: &Maker, s: &Scale) -> Law {
    let [_, per_speed, _, _] = units(s.turns);
    let (v, unit) = (s.speed, if s.turns { "rad/s" } else { "m/s" });
    let less = Parameter {
        unit: "1",
        low: 0.3,
        high: 1.0,
        ..Parameter::place("less", 0.8, 0.3)
    };
    make.law(
        "joint-damping",
        form::DAMPING_THINNING,
        (
            vec![Parameter::positive("b", per_speed, s.load / v)],
            vec![
                // One that is thin at once is friction.
                Parameter {
                    low: (0.06 * v).ln(),
                    ..Parameter::scale("vs", unit, 0.5 * v, 0.8)
                },
                less,
            ],
        ),
        [0.15, 0.5, 1.2].map(|share| vec![(share * v).ln(), 0.8]).to_vec(),
        "the joint resists the more the faster it moves, and hardly more beyond some speed",
    )
}

/// The closer form of it with a larger power than the square: what flows or turns about does not quite keep to that. A smaller one is
/// what a linear damper beside it looks like.
fn about_square(quadratic: Law, turns: bool) -> Law {
    let power = Parameter {
        low: 2.0,
        high: 3.2,
        ..Parameter::place("power", 2.2, 0.4)
    };
    Law {
        form: if turns {
            form::QUADRATIC_TURNING
        } else {
            form::QUADRATIC_SLIDING
        },
        extends: &[form::QUADRATIC],
        grid: vec![vec![2.2], vec![2.7]],
        parameters: [quadratic.parameters, vec![power]].concat(),
        ..quadratic
    }
}

#[cfg(test)]
mod tests {
    use super::super::family::Active;
    use super::super::motion_laws::{Moved, effort};
    use super::*;

    #[test]
    fn grease_that_thins_is_a_damper_at_first() {
        let maker = Maker { joint: "door" };
        let law = maker.plain(
            "joint-damping",
            form::DAMPING_THINNING,
            Parameter::positive("b", "1", 1.0),
            "",
        );
        let of = |speed: f64| {
            let values = [2.0, 0.2f64.ln(), 1.0];
            let m = Moved {
                speed,
                ..Moved::default()
            };
            effort(
                &m,
                &[Active {
                    law: &law,
                    values: &values,
                }],
            )
        };
        assert!((of(0.002) - 0.004).abs() < 1e-6 && (of(-0.002) + of(0.002)).abs() < 1e-12);
        assert!((of(4.0) - 0.4).abs() < 1e-3);
    }

    #[test]
    fn the_closer_form_of_a_quadratic_damper_is_one_at_its_power() {
        let maker = Maker { joint: "door" };
        let laws = |turns: bool| {
            let plain = Parameter::positive("d", "1", 1.0);
            let plain = maker.plain("joint-quadratic-damping", form::QUADRATIC, plain, "");
            [about_square(plain.clone(), turns), plain]
        };
        for (turns, speed) in [(true, -2.5), (false, 0.3)] {
            let [closer, plain] = laws(turns);
            let m = Moved {
                speed,
                ..Moved::default()
            };
            let of = |law: &Law, values: &[f64]| effort(&m, &[Active { law, values }]);
            assert!((of(&closer, &[0.4, 2.0]) - of(&plain, &[0.4])).abs() < 1e-9);
            assert!(of(&closer, &[0.4, 2.3]).abs() > of(&plain, &[0.4]).abs());
        }
    }
}
