//! Closer forms beside the ones that they extend.

use nalgebra::{UnitQuaternion, Vector2};

use super::family::{Active, Law};
use super::press_laws::{self, Memory};
use super::press_moment::Moment;
use super::push_laws::{form, oval, share, table};
use super::push_states::State;
use super::push_windows::veer;

pub(super) fn at(x: f64, y: f64, loaded: f64) -> State {
    State {
        time: 0.0,
        wait: 0.0,
        contact: true,
        first: false,
        since: 0.0,
        span: 0.04,
        slip: 0.0,
        worn: 0.0,
        speed: 0.02,
        turned: 0.0,
        heading: Vector2::new(0.6, 0.8),
        at: Vector2::new(x, y),
        turn: 0.0,
        loaded,
        force: Vector2::new(0.6, 0.8),
        inertia: 0.0,
        hurried: 0.0,
        ringing: 0.0,
        phases: [0.0; 2],
        tool: UnitQuaternion::identity(),
        twist: 0.0,
        veer: 0.0,
        led: false,
    }
}

fn law(form: usize) -> Law {
    Law {
        cause: "bump",
        place: "support".into(),
        form,
        parameters: Vec::new(),
        amplitudes: 1,
        grid: Vec::new(),
        extends: &[],
        words: "",
    }
}

fn shared(form: usize, values: &[f64], s: &State) -> f64 {
    let mut out = 0.0;
    share(
        &Active {
            law: &law(form),
            values,
        },
        s,
        1e-3,
        5.0,
        &mut out,
    );
    out
}

fn held_by_table(form: usize, values: &[f64], s: &State) -> Vector2<f64> {
    let mut out = Vector2::zeros();
    table(
        &Active {
            law: &law(form),
            values,
        },
        s,
        5.0,
        &mut out,
    );
    out
}

#[test]
fn closer_forms_are_what_they_extend_where_they_have_nothing_more() {
    let s = at(0.012, -0.004, 1.0);
    let round = [0.3, 0.02, 0.01, 0.016f64.ln()];
    let oval = [round.to_vec(), vec![0.0, 0.7]].concat();
    let patch = [oval.clone(), vec![0.0]].concat();
    assert!((shared(form::PATCH, &round, &s) - shared(form::PATCH_OVAL, &patch, &s)).abs() < 1e-12);
    let (hill, long) = (
        held_by_table(form::BUMP, &round, &s),
        held_by_table(form::BUMP_OVAL, &oval, &s),
    );
    assert!((hill - long).norm() < 1e-12, "{hill} {long}");
    let [even, creased] = [[0.1, 0.05, 0.0], [0.1, 0.05, -0.2]].map(|v| shared(form::ANISOTROPY_CREASED, &v, &s));
    assert!((even - shared(form::ANISOTROPY, &[0.1, 0.05], &s)).abs() < 1e-12 && (even - creased).abs() > 1e-3);
}

#[test]
fn a_hill_pushes_back_by_its_slope() {
    let values = [0.2, 0.02, 0.01, 0.016f64.ln(), 0.9, 0.5];
    let height = |x: f64, y: f64| {
        let out = oval(Vector2::new(x - 0.02, y - 0.01), 0.016, [0.9, 0.5]);
        0.2 * 0.016 * (-0.5 * out).exp()
    };
    let h = 1e-6;
    let slope = Vector2::new(
        height(0.012 + h, -0.004) - height(0.012 - h, -0.004),
        height(0.012, -0.004 + h) - height(0.012, -0.004 - h),
    ) / (2.0 * h);
    let force = held_by_table(form::BUMP_OVAL, &values, &at(0.012, -0.004, 1.0));
    assert!((force - slope * 5.0).norm() < 1e-6, "{force} {slope}");
}

#[test]
fn a_tether_pulls_where_it_is_fastened() {
    let s = at(0.05, 0.02, 1.0);
    let centred = held_by_table(form::TETHER_ROUND, &[20.0, 0.0, 0.0, 0.03], &s);
    let nowhere = held_by_table(form::TETHER_OF_BODY, &[20.0, 0.0, 0.0, 0.03, 0.0, 0.0], &s);
    assert!((centred - nowhere).norm() < 1e-12);
    // Turned by a quarter, what is fastened ahead of it is beside it.
    let turned = State {
        turn: std::f64::consts::FRAC_PI_2,
        ..s.clone()
    };
    let pulled = held_by_table(form::TETHER_OF_BODY, &[20.0, 0.0, 0.0, 0.03, 0.02, 0.0], &turned);
    let other = held_by_table(form::TETHER_ROUND, &[20.0, 0.0, 0.0, 0.03], &at(0.05, 0.04, 1.0));
    assert!((pulled - other).norm() < 1e-9, "{pulled} {other}");
}

#[test]
fn a_step_costs_by_its_slope_and_only_across_it() {
    let values = [0.2, 0.02, 0.01, 0.008f64.ln(), 0.6];
    let way = Vector2::new(0.6f64.cos(), 0.6f64.sin());
    let s = at(0.022, 0.004, 1.0);
    let out = way.dot(&(s.at - Vector2::new(0.02, 0.01))) / 0.008;
    let force = held_by_table(form::BUMP_STEP, &values, &s);
    assert!((force - way * (0.2 * 5.0 * (-0.5 * out * out).exp())).norm() < 1e-9);
    // Along the line nothing changes.
    let along = at(0.022 - 0.1 * way.y, 0.004 + 0.1 * way.x, 1.0);
    assert!((held_by_table(form::BUMP_STEP, &values, &along) - force).norm() < 1e-9);
}

#[test]
fn friction_that_falls_has_the_two_forms_that_its_closer_one_extends() {
    let state = |speed: f64| State {
        speed,
        ..at(0.0, 0.0, 1.0)
    };
    let of = |form: usize, values: &[f64], speed: f64| shared(form, values, &state(speed));
    for speed in [0.005, 0.02, 0.06] {
        let (vs, nearly) = (0.02f64.ln(), 1e-6);
        let even = of(form::WEAKENING_SHAPED, &[0.3, vs, 0.0, nearly], speed);
        assert!((even - of(form::WEAKENING, &[0.3, vs], speed)).abs() < 1e-5);
        let square = of(form::WEAKENING_SHAPED, &[0.3, vs, 2f64.ln(), nearly], speed);
        assert!((square - of(form::WEAKENING_SQUARE, &[0.3, vs], speed)).abs() < 1e-5);
    }
}

#[test]
fn a_slope_bears_what_a_hand_presses_and_a_leaning_gravity_does_not() {
    let pressed = at(0.0, 0.0, 2.0);
    assert!((held_by_table(form::TILT, &[0.04, 0.0], &pressed).x - 0.2).abs() < 1e-12);
    assert!((held_by_table(form::TILT_BORNE, &[0.04, 0.0], &pressed).x - 0.4).abs() < 1e-12);
}

#[test]
fn closer_forms_of_presses_are_what_they_extend_where_they_have_nothing_more() {
    let forces = |form: usize, values: &[f64]| {
        let law = law(form);
        let active = [Active { law: &law, values }];
        let mut memory = Memory::new(1e3, 2e-3, [0.0; 2]);
        let at = |i: i32| 1e-3 * (0.3 * f64::from(i)).sin();
        let mut one = |i: i32| {
            let moment = Moment {
                time: 0.0,
                step: 0.04,
                depth: 1e-3 + at(i),
                rate: 0.0,
                parts: None,
            };
            memory.force(&moment, 0.0, &active)
        };
        (0..40).map(&mut one).collect::<Vec<_>>()
    };
    let alike = |one: &[f64], other: &[f64]| one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-6);
    let stops = forces(press_laws::form::STOPS, &[0.5, 5e-4f64.ln()]);
    assert!(alike(
        &stops,
        &forces(press_laws::form::STOPS_UNLIKE, &[0.5, 5e-4f64.ln(), 0.0, 0.0])
    ));
    let relaxing = forces(press_laws::form::RELAXATION, &[0.3, 0.5f64.ln()]);
    assert!(alike(
        &relaxing,
        &forces(press_laws::form::RELAXATION_OF_TWO, &[0.3, 0.5f64.ln(), -30.0, 2.0])
    ));
    assert!(!alike(
        &relaxing,
        &forces(press_laws::form::RELAXATION_OF_TWO, &[0.3, 0.5f64.ln(), 0.0, 2.0])
    ));
}

#[test]
fn wear_that_settles_begins_as_the_plain_one_does_and_ends() {
    let worn = |form: usize, worn: f64| {
        let mut out = 0.0;
        let law = law(form);
        let values = [0.4, 0.6_f64.ln()];
        let state = State {
            worn,
            ..at(0.0, 0.0, 1.0)
        };
        let active = Active {
            law: &law,
            values: &values,
        };
        share(&active, &state, 1e-3, 1.0, &mut out);
        out
    };
    assert!((worn(form::WEAR_SETTLING, 1e-4) / worn(form::WEAR, 1e-4) - 1.0).abs() < 1e-3);
    assert!((worn(form::WEAR_SETTLING, 50.0) - 0.4 * 0.6).abs() < 1e-9);
}

#[test]
fn a_path_that_wavers_leaves_the_direction_of_friction_open_and_one_that_turns_back_does_not() {
    let going = |angle: f64| State {
        heading: Vector2::new(angle.cos(), angle.sin()),
        ..at(0.0, 0.0, 1.0)
    };
    let wavers: Vec<State> = (0..20).map(|i| going(if i % 2 == 0 { 0.1 } else { -0.1 })).collect();
    assert!((veer(&wavers) - 0.1 * 2.0_f64.sqrt()).abs() < 1e-9);
    let back = [
        going(0.0),
        going(0.0),
        going(std::f64::consts::PI),
        going(std::f64::consts::PI),
    ];
    assert!(veer(&back) < 1e-9);
}
