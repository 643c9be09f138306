//! Presses made by Euler's rule.

use super::*;
use crate::base::{Seed, rng_for};
use rand_distr::{Distribution, StandardNormal};

/// Down at `speed`, hold, up; contact at 2 mm of travel; the truth in steps of 0.1 ms by Euler's rule.
fn course(law: &ElasticLaw, speed: f64, seed: u64) -> Course {
    let mut dice = rng_for(Seed(seed), "press");
    let turn = 0.008 / speed;
    let way = |t: f64| speed * t.min(turn) - speed * (t - turn - 0.8).clamp(0.0, turn);
    let mut out = Course {
        time: Vec::new(),
        force: Vec::new(),
        travel: Vec::new(),
        speed: Vec::new(),
        noise: 0.03,
    };
    let (h, mut q) = (1e-4, 0.0);
    for i in 0..((2.0 * turn + 0.8) / h) as usize {
        let t = i as f64 * h;
        let (u, v) = (way(t) - 0.002, (way(t + 1e-6) - way(t - 1e-6)) / 2e-6);
        let drive = if u > 0.0 { law.relaxing * law.stiffness * v } else { 0.0 };
        q += h * (drive - q / law.relaxation_time);
        let f = law.stiffness * u * (1.0 + law.hardening * u) + law.damping * v + q;
        if i % 20 == 0 {
            let noise: f64 = StandardNormal.sample(&mut dice);
            out.time.push(t);
            out.force.push(if u > 0.0 { f.max(0.0) } else { 0.0 } + 0.03 * noise);
            out.travel.push(u + 0.002);
            out.speed.push(v);
        }
    }
    out
}

#[test]
fn stiffness_damping_and_relaxation_are_recovered() {
    let law = ElasticLaw {
        damping: 8.0,
        relaxing: 0.3,
        relaxation_time: 0.25,
        ..ElasticLaw::spring(2500.0)
    };
    let found = squeeze(&course(&law, 0.02, 1), 2200.0, 0.0019).expect("fits");
    let near = |(v, sd): (f64, f64), truth: f64, share: f64| {
        assert!(
            (v / truth - 1.0).abs() < share && (v - truth).abs() < 4.0 * sd,
            "{v} {sd} {truth}"
        );
    };
    near(found.stiffness, 2500.0, 0.01);
    near(found.damping, 8.0, 0.1);
    assert!(found.dry.is_none(), "{found:?}");
    for ((value, [low, high]), truth) in found.relaxing.expect("relaxes").into_iter().zip([0.3, 0.25]) {
        near((value, 0.5 * (high - low)), truth, 0.1);
    }
}

#[test]
fn a_plain_spring_gets_no_extension() {
    let found = squeeze(&course(&ElasticLaw::spring(3000.0), 0.02, 2), 2800.0, 0.0019).expect("fits");
    assert!(found.hardening.is_none() && found.relaxing.is_none() && found.dry.is_none());
    assert!((found.stiffness.0 / 3000.0 - 1.0).abs() < 0.005);
    assert!(found.damping.0.abs() < 3.0 * found.damping.1);
}

#[test]
fn a_loop_that_does_not_widen_with_speed_is_dry_friction_and_no_damping() {
    for (k, speed) in [0.002, 0.005, 0.02].into_iter().enumerate() {
        let mut course = course(&ElasticLaw::spring(3000.0), speed, 4 + k as u64);
        let (mut z, mut before) = (0.0, 0.002);
        for i in 0..course.time.len() {
            let u = course.travel[i];
            z = if u > 0.002 {
                f64::clamp(z + (u - before) / 2e-5, -1.0, 1.0)
            } else {
                0.0
            };
            before = u.max(0.002);
            course.force[i] = if u > 0.002 {
                (course.force[i] + 1.5 * z).max(0.0)
            } else {
                course.force[i]
            };
        }
        let found = squeeze(&course, 3100.0, 0.0019).expect("fits");
        let dry = found.dry.expect("dry friction");
        assert!((dry.0 / 1.5 - 1.0).abs() < 0.1, "{dry:?}");
        assert!((found.stiffness.0 / 3000.0 - 1.0).abs() < 0.02, "{:?}", found.stiffness);
        assert!(
            found.damping.0 < 3.0 * found.damping.1 || found.damping.0 < 3.0,
            "{:?}",
            found.damping
        );
    }
}

#[test]
fn hardening_is_told_from_a_stiffer_spring() {
    let law = ElasticLaw {
        hardening: 60.0,
        ..ElasticLaw::spring(1500.0)
    };
    let found = squeeze(&course(&law, 0.02, 3), 1700.0, 0.0019).expect("fits");
    assert!((found.hardening.expect("hardens").0 / 60.0 - 1.0).abs() < 0.1);
}

/// Random springs that relax, by another integrator than the fit's: how often the intervals of share and time constant hold.
#[test]
fn intervals_of_a_relaxation_hold_at_their_rate() {
    use rand::Rng;
    let mut dice = rng_for(Seed(19), "relaxing presses");
    let (mut told, mut held, mut off) = (0, [0; 2], [Vec::new(), Vec::new()]);
    // Other springs than those on which the profile was chosen.
    for seed in 1000..1200 {
        let law = ElasticLaw {
            damping: dice.random_range(0.0..10.0),
            relaxing: dice.random_range(0.1..0.5),
            relaxation_time: dice.random_range(f64::ln(0.05)..f64::ln(0.4)).exp(),
            ..ElasticLaw::spring(dice.random_range(800.0..5000.0))
        };
        let course = course(&law, dice.random_range(0.01..0.03), 100 + seed);
        let Some(found) = squeeze(&course, 1.1 * law.stiffness, 0.0019) else {
            continue;
        };
        let Some(relaxing) = found.relaxing else { continue };
        told += 1;
        let truths = [law.relaxing, law.relaxation_time];
        for (k, ((value, [low, high]), truth)) in relaxing.into_iter().zip(truths).enumerate() {
            held[k] += usize::from(low <= truth && truth <= high);
            off[k].push((value / truth - 1.0).abs());
        }
    }
    let at = |k: usize, share: f64| crate::math::quantile(&off[k], share).unwrap_or(1.0);
    assert!(
        told >= 180 && held.iter().all(|h| (0.92..=0.99).contains(&(*h as f64 / told as f64))),
        "{held:?} of {told}"
    );
    assert!(
        at(0, 0.95) < 0.1 && at(1, 0.95) < 0.1,
        "{} {}",
        at(0, 0.95),
        at(1, 0.95)
    );
}
