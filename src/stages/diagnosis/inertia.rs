//! What fast pushes followed as a whole find: what has to be sped up is not what is weighed; force and track have two clocks.

use super::loads::Loads;
use super::sloshing::sloshing_findings;
use super::told::{Told, gain};
use super::uneven::{uneven, yaw_findings};
use crate::base::{Estimate, Status};
use crate::capture::{Capture, Segmented};
use crate::math::random_effects;
use crate::stages::estimation::{Inertial, Shaken, shaken};
use crate::twin::{Finding, Link, Model};

/// Standard deviations from the plain value from which on it counts, p below 6e-7; and the share from which on.
const CLEAR: (f64, f64) = (5.0, 0.15);
/// Share of the error on pushes that were not fitted that it has to take away.
const TAKEN: f64 = 0.3;
/// Share by which the law of fast pushes may miss the mass in all of them alike.
const FORM: f64 = 0.04;
/// Scatter from push to push that is expected before any is seen.
const SCATTER: f64 = 0.03;
/// Effect size from which on forces hint at a part that swings, too weakly to name it; and its odds then.
const HINTED: f64 = 2.5;
const LOOSE: (f64, f64) = (0.4, 0.6);
/// Scatter of the mass from push to push, and a share of it, that speak for such a part.
const UNLIKE: f64 = 0.2;
const FAR: f64 = 1.0;
/// Doubt of a delay from one push that still tells, s; scatter that is expected, s; standard deviations and least size, s, from
/// which on there is one.
const LATE: (f64, f64, f64, f64) = (0.01, 1e-3, 5.0, 6e-3);
/// Scatter of a delay from push to push, as a share of it, that one constant delay may have.
const ALIKE: f64 = 0.3;
/// Speed at which a delay is told as a way, m/s.
const PACE: f64 = 0.1;
/// Pushes that must tell.
const FEWEST: usize = 2;
/// Pushes that must tell a delay, with those that were not fitted.
const JUDGED: usize = 3;
/// A push tells where its own doubt is below this.
const WORTH: f64 = 0.3;

/// A logarithm that was read from several pushes, over its plain value.
struct Ratio {
    mean: f64,
    sd: f64,
    /// Standard deviation from push to push.
    between: f64,
    from: Vec<String>,
    /// Root mean squares over the pushes that were not fitted (all where there is none), without and with the mean.
    left: [f64; 2],
    held_out: Vec<String>,
}

impl Ratio {
    fn of(rows: &[(&Inertial, (f64, f64))]) -> Option<Self> {
        let telling = || reliable(rows, |(i, _)| i).filter(|(_, (_, sd))| *sd < WORTH);
        let fitted: Vec<_> = telling().filter(|(i, _)| !i.held_out).collect();
        if fitted.len() < FEWEST {
            return None;
        }
        let (values, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|(_, v)| *v).unzip();
        let pooled = random_effects(&values, &sds, SCATTER)?;
        let held: Vec<_> = telling().filter(|(i, _)| i.held_out).collect();
        let judged = if held.is_empty() { &fitted } else { &held };
        let rms = |at: f64| {
            let squares = judged.iter().map(|(_, (v, _))| (v.exp() - at.exp()).powi(2));
            (squares.sum::<f64>() / judged.len() as f64).sqrt()
        };
        Some(Self {
            mean: pooled.mean,
            sd: pooled.sd.hypot(FORM),
            between: pooled.between,
            from: fitted.iter().map(|(i, _)| i.interaction.clone()).collect(),
            left: [rms(0.0), rms(pooled.mean)],
            held_out: held.iter().map(|(i, _)| i.interaction.clone()).collect(),
        })
    }
}

/// Inertia that is not that of the weight, or of the shape.
pub fn findings_of_inertia(
    (capture, segmented, model): (&Capture, &[Segmented], &Model),
    pushed: bool,
    loads: &Loads,
    findings: &mut Vec<Finding>,
) {
    let acted_on = |f: &Finding| pushed && acts_on_a_body(f, model);
    if !findings.iter().any(acted_on) {
        let swinging = sloshing_findings(capture, segmented, model);
        if !swinging.is_empty() {
            findings.extend(swinging);
            return;
        }
        let swings = loads.effect_sizes.get("loose-mass").copied().unwrap_or(0.0);
        findings.extend(inertia_findings(&loads.fast, model, swings));
        if !findings.iter().any(acted_on) {
            findings.extend(shaken_findings(&shaken(capture, segmented, model), model));
        }
        if !findings.iter().any(acted_on) {
            findings.extend(yaw_findings(capture, model));
        }
    } else if findings.iter().filter(|f| acted_on(f)).all(|f| f.cause == "com-offset") {
        uneven(capture, model, findings);
    }
}

/// What else acts on a pushed body acts on it while it coasts, and what swings takes part in the speeding up.
fn acts_on_a_body(finding: &Finding, model: &Model) -> bool {
    finding.place != "sensor" && model.twin.joints().all(|j| j.name != finding.place)
}

/// Whether a body was weighed, and sped up with nothing else at work.
pub fn tells_inertia(
    (capture, segmented, model): (&Capture, &[Segmented], &Model),
    fast: &[Inertial],
    findings: &[Finding],
) -> bool {
    let weighed = |name: &str| model.twin.link(name).and_then(weight_of).is_some();
    let pushes = |name: &str| reliable(fast, |i| i).filter(|i| i.link == name && !i.held_out).count() >= FEWEST;
    let aloft = shaken(capture, segmented, model);
    let told = |name: &str| pushes(name) || aloft.iter().any(|s| s.link == name && !s.held_out);
    let mut links = model.twin.links();
    findings.iter().all(|f| !acts_on_a_body(f, model)) && links.any(|(_, l)| weighed(&l.name) && told(&l.name))
}

/// Every link that was weighed and pushed fast, and takes more or less than its weight says to be sped up. `swings` is the effect
/// size of a loose mass in the forces of the same pushes.
fn inertia_findings(all: &[Inertial], model: &Model, swings: f64) -> Vec<Finding> {
    let late = common_delay(all);
    let one = |link: &Link| {
        let weighed = weight_of(link)?;
        let at = |delay: (f64, f64)| {
            let own = all.iter().filter(|i| i.link == link.name);
            let over = |i: &Inertial| {
                let (mass, sd) = i.log_mass_at(delay);
                (mass - weighed.value.ln(), sd)
            };
            Ratio::of(&own.map(|i| (i, over(i))).collect::<Vec<_>>())
        };
        let sure = |r: &Ratio| r.mean.abs() > CLEAR.0 * r.sd && r.mean.abs() > CLEAR.1;
        let ratio = at(late)?;
        // A mass and a delay stand in for each other: it has to be off without any delay, too.
        let alone = at((0.0, LATE.1)).is_some_and(|r| sure(&r) && r.mean * ratio.mean > 0.0);
        let told = ratio.left[1] < (1.0 - TAKEN) * ratio.left[0];
        let clear = told && alone && sure(&ratio);
        // Without inertia a force would be off by this share of what stops it, which is friction.
        let scale = link.friction_force.kinetic.as_ref().map_or(1.0, |f| f.value);
        clear.then(|| finding(&ratio, &link.name, scale, swings))
    };
    model.twin.links().filter_map(|(_, link)| one(link)).collect()
}

/// Every link that was weighed and moved to and fro in the air, and takes more or less than its weight says to be sped up.
fn shaken_findings(all: &[Shaken], model: &Model) -> Vec<Finding> {
    let one = |link: &Link| {
        let weighed = weight_of(link)?;
        let own = || all.iter().filter(|s| s.link == link.name);
        let fitted: Vec<&Shaken> = own().filter(|s| !s.held_out).collect();
        let masses = fitted
            .iter()
            .map(|s| (s.mass.0 / weighed.value, s.mass.1 / weighed.value));
        let (values, sds): (Vec<f64>, Vec<f64>) = masses.unzip();
        let pooled = random_effects(&values, &sds, SCATTER)?;
        let (more, sd) = (pooled.mean - 1.0, pooled.sd.hypot(FORM));
        let held: Vec<&Shaken> = own().filter(|s| s.held_out).collect();
        let judged = if held.is_empty() { &fitted } else { &held };
        let error = |mass: f64| {
            let squares = judged.iter().map(|s| (s.acceleration * (s.mass.0 - mass)).powi(2));
            (squares.sum::<f64>() / judged.len() as f64).sqrt()
        };
        let errors = [weighed.value, weighed.value * pooled.mean].map(error);
        if more.abs() < (CLEAR.0 * sd).max(CLEAR.1) || errors[1] > errors[0] {
            return None;
        }
        let from = fitted.iter().map(|s| s.interaction.clone()).collect();
        let told = Told {
            cause: "added-inertia",
            place: &link.name,
            probability: 0.95,
            rivals: &[],
            parameter: (
                "e",
                Estimate::measured(more, sd, "1", from, "moved to and fro in the air, over the weight"),
            ),
            residual: "force in the air",
            statistic: more.abs() / sd,
            words: format!("what has to be sped up is {:.2} times what is weighed", pooled.mean),
            gain: gain(
                "force",
                "N",
                errors,
                held.iter().map(|s| s.interaction.clone()).collect(),
            ),
        };
        Some(told.finding())
    };
    model.twin.links().filter_map(|(_, link)| one(link)).collect()
}

/// The mass of a link that was weighed, here or before.
fn weight_of(link: &Link) -> Option<&Estimate> {
    let mass = link.mass.as_ref()?;
    let lifted = mass.is_measured() && mass.method.starts_with("lift");
    (lifted || mass.status == Status::Known).then_some(mass)
}

/// The pushes that were followed from rest on, where enough of them were: of the others the motion at the start is unknown, and now
/// and then passes for mass.
fn reliable<'a, T>(all: &'a [T], of: impl Fn(&T) -> &Inertial + Copy + 'a) -> impl Iterator<Item = &'a T> {
    let enough = all.iter().filter(|i| of(i).from_rest && !of(i).held_out).count() >= FEWEST;
    all.iter().filter(move |i| of(i).from_rest || !enough)
}

/// The delay of force behind track that all pushes share, as one capture has one pair of clocks, s, with its standard deviation.
fn common_delay(all: &[Inertial]) -> (f64, f64) {
    let fitted: Vec<&Inertial> = all.iter().filter(|i| !i.held_out).collect();
    let (values, sds): (Vec<f64>, Vec<f64>) = reliable(&fitted, |i| i).map(|i| i.delay).unzip();
    random_effects(&values, &sds, LATE.1).map_or((0.0, f64::INFINITY), |p| (p.mean, p.sd.hypot(p.between)))
}

/// That force and track are read at different times, as fast pushes start and stop.
pub fn delay_finding(all: &[Inertial], model: &Model) -> Option<Finding> {
    delay_of(all, |i| i.delay)?;
    // A blow that was cut off passes for a delay with a mass that is too large: what was weighed parts the two.
    let weighed = |i: &Inertial| {
        let mass = model.twin.link(&i.link).and_then(weight_of)?;
        Some(i.delay_at((mass.value.ln(), FORM.hypot(SCATTER))))
    };
    // One that does not foretell pushes that were not fitted is none.
    delay_of(all, |i| weighed(i).unwrap_or(i.delay)).filter(|f| f.gain.rmse_after <= f.gain.rmse_before)
}

fn delay_of(all: &[Inertial], read: impl Fn(&Inertial) -> (f64, f64)) -> Option<Finding> {
    let told: Vec<&Inertial> = all.iter().filter(|i| i.delay.1 < LATE.0).collect();
    let fitted: Vec<&&Inertial> = told.iter().filter(|i| !i.held_out).collect();
    let (values, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|i| read(i)).unzip();
    let pooled = random_effects(&values, &sds, LATE.1).filter(|_| fitted.len() >= FEWEST)?;
    let statistic = pooled.mean.abs() / pooled.sd;
    // One that is not alike in all pushes is another fault: clocks that run apart, say.
    let alike = pooled.between < ALIKE * pooled.mean.abs();
    if !alike || statistic < LATE.2 || pooled.mean.abs() < LATE.3 {
        return None;
    }
    let held: Vec<&&Inertial> = told.iter().filter(|i| i.held_out).collect();
    if told.len() < JUDGED {
        return None;
    }
    let rms = |at: f64| {
        let squares = held.iter().map(|i| (read(i).0 - at).powi(2)).sum::<f64>();
        PACE * (squares / held.len().max(1) as f64).sqrt()
    };
    let from: Vec<String> = fitted.iter().map(|i| i.interaction.clone()).collect();
    let (before, after) = (rms(0.0), rms(pooled.mean));
    // The track is late where the force is early.
    let tau = Estimate::measured(-pooled.mean, pooled.sd, "s", from, "fast pushes followed as a whole");
    // A force that is filtered comes late, too.
    let (probability, rivals): (f64, &[(&str, f64)]) = if pooled.mean > 0.0 {
        (0.55, &[("sensor-lag", 0.4)])
    } else {
        (0.95, &[])
    };
    let told = Told {
        cause: "time-delay",
        place: "sensor",
        probability,
        rivals,
        parameter: ("tau", tau),
        residual: "way",
        statistic,
        words: format!(
            "the track is read {:.1} ms {} than the force",
            1e3 * pooled.mean.abs(),
            if pooled.mean < 0.0 { "later" } else { "earlier" }
        ),
        gain: gain(
            "position",
            "m",
            [before, after],
            held.iter().map(|i| i.interaction.clone()).collect(),
        ),
    };
    Some(told.finding())
}

fn finding(ratio: &Ratio, place: &str, scale: f64, swings: f64) -> Finding {
    let factor = ratio.mean.exp();
    // A part that swings is sped up late: pushes then differ, and the whole seems too heavy by far.
    let odd = ratio.between > UNLIKE || factor - 1.0 > FAR;
    let loose = if odd {
        LOOSE.1
    } else if swings > HINTED {
        LOOSE.0
    } else {
        0.0
    };
    let method = "fast pushes followed as a whole, over the weight";
    let share = Estimate::measured(factor - 1.0, factor * ratio.sd, "1", ratio.from.clone(), method);
    let statistic = ratio.mean.abs() / ratio.sd;
    let [before, after] = ratio.left.map(|r| r * scale);
    let mut odds = [("added-inertia", 0.95 - loose), ("loose-mass", loose)];
    odds.sort_by(|a, b| b.1.total_cmp(&a.1));
    let told = Told {
        cause: odds[0].0,
        place,
        probability: odds[0].1,
        rivals: &odds[1..],
        parameter: ("e", share),
        residual: "way",
        statistic,
        words: format!("what has to be sped up is {factor:.2} times what is weighed"),
        gain: gain("force", "N", [before, after], ratio.held_out.clone()),
    };
    told.finding()
}
