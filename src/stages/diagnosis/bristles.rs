//! What the force does where a hand that holds a body turns back: friction that turns round over a way slides on bristles; one that does
//! so later by a time was read by another clock, or through a pole.
//!
//! Bristles bend by `dz/ds = (sgn s' - z)/d` (Dahl, "A Solid Friction Model", 1968), or in proportion until they slide. The force about each
//! turn is `L z + c + (m + e) s''`; level, tare and the inertia that nobody weighed are its own, the rule is that of all. A hand that
//! gives feigns a way: what is tracked has to follow it.

use super::Config;
use super::reversal_rules::{RULES, Rule, STEP, TIMES, Turn, WAYS, cause};
use super::reversals::{Drag, apart, drags};
use super::sensor_lag::SensorLag;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::{effective_samples, median};
use crate::twin::{Finding, Gain, Model};

/// Fewest turns, and the share of them that has to say the same.
pub(super) const FEWEST: usize = 4;
const COMMON: f64 = 0.7;
/// Log-likelihood, nats, over a plain turn, and over what else would turn it round slowly.
const CLEAR: f64 = 20.0;
const BETTER: f64 = 10.0;
/// Parts of a step in which the best size is sought.
const FINER: i32 = 10;
/// Readings of one turn that are as good as independent, at most.
const FREE: f64 = 15.0;
/// How well it is known when a hand sets out, s.
const SETS_OUT: f64 = 3e-3;
/// The least time of a pole, s.
const POLE: f64 = 12e-3;
/// Share of a way that a hand may give, with two standard deviations.
const GIVES: f64 = 0.3;

fn square(left: &[f64]) -> f64 {
    left.iter().map(|x| x * x).sum()
}

/// What every turn leaves by a rule.
fn all_left(turns: &[Turn], rule: Rule, size: f64) -> Option<Vec<Vec<f64>>> {
    let mut of: Option<(*const Drag, Vec<f64>)> = None;
    let each = turns.iter().map(|turn| {
        let drag: *const Drag = turn.drag;
        if of.as_ref().is_none_or(|o| o.0 != drag) {
            of = Some((drag, rule.share(turn.drag, size)));
        }
        of.as_ref().and_then(|o| turn.left(&o.1))
    });
    each.collect()
}

/// Independent readings of each turn, and what it leaves at least, N² each.
struct Worth(Vec<(f64, f64)>);

impl Worth {
    /// By what a fit leaves.
    fn of(turns: &[Turn], left: &[Vec<f64>]) -> Self {
        let each = turns.iter().zip(left);
        Self(
            each.map(|(turn, left)| (effective_samples(left).min(FREE), turn.open().powi(2)))
                .collect(),
        )
    }

    /// Log-likelihood of each turn, nats, but for a constant.
    fn nats(&self, left: &[Vec<f64>]) -> Vec<f64> {
        let each = self.0.iter().zip(left);
        each.map(|((n, open), left)| -0.5 * n * (square(left) / left.len() as f64 + open).ln())
            .collect()
    }
}

/// The best size of a rule: with what it leaves.
fn best(turns: &[Turn], rule: Rule) -> Option<(f64, Vec<Vec<f64>>)> {
    let cost = |size: f64| {
        let left = all_left(turns, rule, size)?;
        let each = turns.iter().zip(&left);
        let sum: f64 = each
            .map(|(t, l)| (square(l) / l.len() as f64 + t.open().powi(2)).ln())
            .sum();
        Some((sum, size, left))
    };
    let least = |sizes: Vec<f64>| sizes.into_iter().filter_map(cost).min_by(|a, b| a.0.total_cmp(&b.0));
    let near = least(rule.sizes())?.1;
    let (_, size, left) = least(
        (-FINER..=FINER)
            .map(|k| near * STEP.powf(f64::from(k) / f64::from(FINER)))
            .collect(),
    )?;
    Some((size, left))
}

/// How the force turns round with the hands that were not held out.
#[derive(Clone, Debug)]
pub(super) struct Bristles {
    rule: Rule,
    size: (f64, f64),
    body: String,
    from: Vec<String>,
    nats: f64,
    gain: Gain,
}

/// How the force turns round with the hands of a capture; nothing where it does so at once, or no rule is clear.
pub(super) fn turning_back(
    (capture, segmented, model): (&Capture, &[Segmented], &Model),
    config: &Config,
) -> Option<Bristles> {
    bristles(&drags(capture, segmented, model)).filter(|b| cause(b.rule).is_some_and(|c| config.allows(c)))
}

/// Way after a turn on which friction is not that of what slides, m.
pub(super) fn way_of(turned: &Option<Bristles>) -> f64 {
    turned.as_ref().and_then(Bristles::way).unwrap_or(0.0)
}

/// What all turns of one body say.
fn bristles(drags: &[Drag]) -> Option<Bristles> {
    let mut bodies: Vec<&String> = drags.iter().map(|d| &d.body).collect();
    bodies.sort();
    bodies.dedup();
    let of = |body: &String| of_body(&drags.iter().filter(|d| d.body == *body).collect::<Vec<_>>());
    bodies.into_iter().find_map(of)
}

fn turns<'a>(drags: &[&'a Drag], held_out: bool) -> Vec<Turn<'a>> {
    let own = drags.iter().filter(|d| d.held_out == held_out);
    own.flat_map(|drag| drag.turns().map(|stretch| Turn { drag, stretch }))
        .collect()
}

fn of_body(drags: &[&Drag]) -> Option<Bristles> {
    let fitted = turns(drags, false);
    if fitted.len() < FEWEST {
        return None;
    }
    let plain = all_left(&fitted, Rule::Late, 0.0)?;
    let found: Vec<(Rule, f64, Vec<Vec<f64>>)> = RULES
        .into_iter()
        .filter_map(|rule| best(&fitted, rule).map(|(size, left)| (rule, size, left)))
        .collect();
    // By the readings that are independent beside the best of all.
    let squares = |left: &[Vec<f64>]| left.iter().map(|l| square(l)).sum::<f64>();
    let least = found.iter().min_by(|a, b| squares(&a.2).total_cmp(&squares(&b.2)))?;
    let worth = Worth::of(&fitted, &least.2);
    let total = |left: &[Vec<f64>]| worth.nats(left).iter().sum::<f64>();
    let (rule, size, left) = found.iter().max_by(|a, b| total(&a.2).total_cmp(&total(&b.2)))?;
    let each: Vec<f64> = worth
        .nats(left)
        .iter()
        .zip(worth.nats(&plain))
        .map(|(a, b)| a - b)
        .collect();
    let nats: f64 = each.iter().sum();
    let same = each.iter().filter(|n| **n > 0.0).count() as f64 >= COMMON * each.len() as f64;
    let alike = |other: Rule| cause(other) == cause(*rule);
    let clear = found
        .iter()
        .filter(|f| !alike(f.0))
        .all(|f| total(left) - total(&f.2) > BETTER);
    if nats < CLEAR || !same || !clear || cause(*rule).is_none() {
        return None;
    }
    let sd = spread(&fitted, *rule, *size, total(left), &worth)?;
    let sd = if *rule == Rule::Late { sd.hypot(SETS_OUT) } else { sd };
    let held = turns(drags, true);
    let judged = if held.is_empty() { &fitted } else { &held };
    let rms = |rule: Rule, size: f64| {
        let left = all_left(judged, rule, size)?.concat();
        Some((square(&left) / left.len().max(1) as f64).sqrt())
    };
    let errors = [rms(Rule::Late, 0.0)?, rms(*rule, *size)?];
    let names = |of: &[Turn]| {
        let mut names: Vec<String> = of.iter().map(|t| t.drag.interaction.clone()).collect();
        names.dedup();
        names
    };
    let out = Bristles {
        rule: *rule,
        size: (*size, sd),
        body: fitted[0].drag.body.clone(),
        from: names(&fitted),
        nats,
        gain: gain("force", "N", errors, names(&held)),
    };
    let on_bristles = || resolved(&fitted, *rule, *size) && follows(&fitted, *rule, *size);
    (errors[1] < errors[0] && out.within() && (!out.over_a_way() || on_bristles())).then_some(out)
}

/// The standard deviation of a size, by how far on either side half a nat is lost; what the rule leaves open beside it.
fn spread(turns: &[Turn], rule: Rule, size: f64, most: f64, worth: &Worth) -> Option<f64> {
    let lost = |share: f64| {
        let left = all_left(turns, rule, size * (1.0 + share))?;
        Some(most - worth.nats(&left).iter().sum::<f64>())
    };
    let shares = [0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.4];
    let told = shares.into_iter().find(|s| {
        let both = [lost(*s), lost(-s)].into_iter().flatten();
        both.fold(f64::INFINITY, f64::min) > 0.5
    });
    told.map(|share| (share * size).abs())
}

/// Whether most turns show more of the way over which the force turns round than smoothing the hand's path makes of a sudden turn.
fn resolved(turns: &[Turn], rule: Rule, size: f64) -> bool {
    let blurs: Vec<f64> = turns.iter().map(|t| t.drag.blur(t.stretch)).collect();
    median(&blurs).is_some_and(|blur| rule.whole(size) > blur)
}

/// Whether the body follows the hand on the way over which the force turns round.
fn follows(turns: &[Turn], rule: Rule, size: f64) -> bool {
    let (mut xx, mut xy, mut left, mut count) = (0.0, 0.0, 0.0, 0.0);
    let mut pairs = Vec::new();
    for turn in turns {
        let share = rule.share(turn.drag, size);
        let about = turn.drag.about(turn.stretch);
        let moments = &turn.drag.moments[about.clone()];
        let (Some(first), Some(last)) = (moments.first(), moments.last()) else {
            continue;
        };
        let within = |t: f64| (first.time..=last.time).contains(&t);
        let at = |t: f64| {
            let i = turn.drag.moments.partition_point(|m| m.time < t).min(share.len() - 1);
            share[i]
        };
        let own: Vec<[f64; 2]> = apart(turn.drag)
            .into_iter()
            .filter(|a| within(a[0]))
            .map(|[t, x]| [at(t), x])
            .collect();
        let n = own.len().max(1) as f64;
        let mean = own.iter().fold([0.0; 2], |[a, b], p| [a + p[0] / n, b + p[1] / n]);
        pairs.extend(own.iter().map(|p| [p[0] - mean[0], p[1] - mean[1]]));
    }
    for [z, x] in &pairs {
        xx += z * z;
        xy += z * x;
    }
    let gives = xy / f64::max(xx, 1e-12);
    for [z, x] in &pairs {
        left += (x - gives * z).powi(2);
        count += 1.0;
    }
    let sd = (left / f64::max(count, 1.0) / f64::max(xx, 1e-12)).sqrt();
    count >= 2.0 * FEWEST as f64 && gives.abs() + 2.0 * sd < GIVES * rule.whole(size)
}

impl Bristles {
    fn over_a_way(&self) -> bool {
        cause(self.rule) == Some("presliding")
    }

    fn within(&self) -> bool {
        let size = self.size.0.abs();
        let [low, high] = match self.rule {
            Rule::Bending | Rule::Springing => WAYS,
            Rule::Lagging => [POLE, TIMES[1]],
            _ => TIMES,
        };
        (low..=high).contains(&size)
    }

    fn way(&self) -> Option<f64> {
        let reach = if self.rule == Rule::Bending { 5.0 } else { 2.0 };
        self.over_a_way().then_some(reach * self.size.0)
    }

    /// That of the sensor.
    pub fn lag(&self) -> Option<SensorLag> {
        (self.rule == Rule::Lagging).then(|| SensorLag {
            seconds: self.size,
            poles: 1,
            late: 0.0,
            from: self.from.clone(),
            gain: self.gain.clone(),
        })
    }

    /// Friction that comes up over a way.
    pub fn presliding(&self) -> Option<Finding> {
        let way = self.rule.whole(self.size.0);
        let said = format!(
            "where it is turned back, friction of {} turns round over {:.2} mm of its way",
            self.body,
            2e3 * way
        );
        self.over_a_way()
            .then(|| self.finding("presliding", &self.body, ("way", way, "m"), said))
    }

    /// Force and way by two clocks.
    pub fn delay(&self) -> Option<Finding> {
        // The force that comes later is a way that comes earlier.
        let (tau, late) = (-self.size.0, 1e3 * self.size.0.abs());
        let side = if tau < 0.0 { "after" } else { "before" };
        let said = format!("where hands turn back the force does so {late:.0} ms {side} what moves");
        (self.rule == Rule::Late).then(|| self.finding("time-delay", "sensor", ("tau", tau, "s"), said))
    }

    fn finding(&self, cause: &str, place: &str, (name, value, unit): (&str, f64, &str), words: String) -> Finding {
        let sd = self.size.1 * (value / self.size.0).abs();
        let how = "how the force turns round with the hand";
        let told = Told {
            cause,
            place,
            probability: 0.95,
            rivals: &[],
            parameter: (name, Estimate::measured(value, sd, unit, self.from.clone(), how)),
            residual: "turning back",
            statistic: (2.0 * self.nats).sqrt(),
            words,
            gain: self.gain.clone(),
        };
        told.finding()
    }
}

#[cfg(test)]
mod tests {
    use super::super::reversals::tests::{drag, follow};
    use super::*;

    /// Six pulls to and fro at several speeds, each by this law of the force.
    fn pulls(force: &dyn Fn(&Drag) -> Vec<f64>, gives: f64) -> Vec<Drag> {
        let of = |k: u32| {
            let mut out = drag(k, 0.01 + 0.007 * f64::from(k), 0.12 + 0.09 * f64::from(k));
            let force = force(&out);
            for (i, m) in out.moments.iter_mut().enumerate() {
                let wobble = 0.01 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
                m.force = 2.4 * force[i] + 0.1 + wobble + out.mass * m.acceleration;
            }
            follow(&mut out, &|i: usize| gives * force[i]);
            out
        };
        (0..6).map(of).collect()
    }

    /// The force over its level at each moment by small steps of `rate`, which has the speed and what it was.
    fn by_steps(drag: &Drag, rate: &dyn Fn(f64, f64) -> f64) -> Vec<f64> {
        let (mut z, mut out) = (0.0, Vec::new());
        for m in &drag.moments {
            out.push(z);
            (0..100).for_each(|_| z += 0.01 * drag.step * rate(m.speed, z));
        }
        out
    }

    #[test]
    fn friction_that_turns_round_over_a_way_is_told_from_clocks_and_hands_that_give() {
        let bends = |drag: &Drag| by_steps(drag, &|v: f64, z: f64| (v - v.abs() * z) / 4e-4);
        let found = bristles(&pulls(&bends, 0.0))
            .expect("bristles")
            .presliding()
            .expect("named");
        let way = &found.parameters["way"];
        assert!(
            (way.value / (5.0_f64.ln() / 0.8 * 4e-4) - 1.0).abs() < 0.1
                && way.sd.is_some_and(|sd| sd < 0.1 * way.value),
            "{way:?}"
        );
        // What a hand that gives does is not what the body does.
        assert!(bristles(&pulls(&bends, 3e-4)).is_none());
        let late = |drag: &Drag| {
            let before = |i: usize| drag.moments[i.saturating_sub((0.03 / drag.step).round() as usize)].speed;
            (0..drag.moments.len()).map(|i| before(i).signum()).collect()
        };
        let found = bristles(&pulls(&late, 0.0)).expect("a delay").delay().expect("named");
        assert!((found.parameters["tau"].value + 0.03).abs() < 4e-3, "{found:?}");
        let lags = |drag: &Drag| by_steps(drag, &|v: f64, z: f64| (v.signum() - z) / 0.04);
        let found = bristles(&pulls(&lags, 0.0)).expect("a lag").lag().expect("named");
        assert!((found.seconds.0 - 0.04).abs() < 4e-3, "{found:?}");
    }

    #[test]
    fn what_turns_round_at_once_or_with_the_speed_is_none() {
        assert!(
            bristles(&pulls(
                &|drag: &Drag| drag.moments.iter().map(|m| m.speed.signum()).collect(),
                0.0
            ))
            .is_none()
        );
        assert!(
            bristles(&pulls(
                &|drag: &Drag| drag.moments.iter().map(|m| (m.speed / 2e-3).tanh()).collect(),
                0.0
            ))
            .is_none()
        );
    }
}
