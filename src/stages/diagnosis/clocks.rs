//! Two clocks, as the beginnings of pushes tell them: where track and force are read at different times, the force seems to come
//! up over a way that is the longer the faster the push; on bristles that way is the same in every push.
//!
//! `way = w + lead · speed`, with one way `w` for each body and one lead for all. Each of the two is fitted alone and both
//! together; the fits are compared by their squares over what the two together leave.

use nalgebra::{DMatrix, DVector};

use super::contact_law::damps;
use super::onset::{FLOOR, Onset, UP};
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::math::weighted_linear;
use crate::twin::Finding;

/// Fewest pushes beyond what is fitted to them, to compare the two and to name a lead.
const FEWEST: (usize, usize) = (1, 3);
/// Largest speed over the least from which on a lead and a way are parted.
const PACES: f64 = 1.5;
/// Standard deviations, and least size, s and in readings of the force, from which on there is a lead.
const CLEAR: f64 = 6.0;
const LEAST: f64 = 6e-3;
const READINGS: f64 = 2.0;
/// Standard deviations of a way beside it, and the least that counts, m.
const BESIDE: (f64, f64) = (5.0, 2e-4);
/// Squares by which a time has to do better than ways that go with the square of speed: a blow throws a light body ahead, and the
/// tool feels it once it has caught up.
const FLIES: f64 = 9.0;
/// A rise that is not a step takes part of its time for a lead, s.
const FORM: f64 = 1e-3;
/// Leads that differ by so many standard deviations are two.
const UNLIKE: f64 = 3.5;
/// Least odds of a rival.
const WORTH: f64 = 0.05;
/// A lead that is known this well, s, says of another whether it is one.
const KNOWN: f64 = 2.5e-3;

/// What the beginnings of pushes say of one clock beside another.
#[derive(Clone, Debug, Default)]
pub struct Clocks {
    /// By how much the force seems late behind the track, s, with its standard deviation, whatever ways friction has.
    lead: Option<(f64, f64)>,
    /// Whether it is one beyond doubt, whatever the ways; or it would be without any.
    clear: bool,
    would: bool,
    /// Way of each body beside it, m, with its standard deviation.
    ways: Vec<(String, (f64, f64))>,
    /// Squares of what a lead alone leaves, less those of ways alone, in those of what is left by both.
    for_ways: f64,
    from: Vec<String>,
    /// Whether the finger damps, so that its force is up before the body slides, by one time.
    damped: bool,
    /// Root mean squares of the ways of pushes that were not fitted, m, without the lead and with it; which they are.
    left: [f64; 2],
    held_out: Vec<String>,
}

/// One fit of some columns: its squares in standard deviations.
fn squares(rows: &[&Row], columns: &[usize]) -> Option<(f64, DVector<f64>, DMatrix<f64>)> {
    let a = DMatrix::from_fn(rows.len(), columns.len(), |i, k| rows[i].columns[columns[k]]);
    let b = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.way));
    let weights = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.sd.powi(-2)));
    let fit = weighted_linear(&a, &b, &weights)?;
    let sum = fit.residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum();
    Some((sum, fit.x, fit.covariance))
}

/// The way of one push at which most of the force is up, m, beside its speed and, one for each body, 1 where it is its own.
struct Row {
    interaction: String,
    held_out: bool,
    way: f64,
    sd: f64,
    columns: Vec<f64>,
}

fn rows(begun: &[(String, Vec<Onset>)]) -> Vec<Row> {
    let bodies = begun.len();
    let of = |k: usize, o: &Onset| Row {
        interaction: o.interaction.clone(),
        held_out: o.held_out,
        way: UP * o.way.0,
        sd: (UP * o.way.1).hypot(FLOOR),
        columns: std::iter::once(o.speed)
            .chain((0..bodies).map(|j| if j == k { 1.0 } else { 0.0 }))
            .chain([o.speed.powi(2)])
            .collect(),
    };
    let all = begun.iter().enumerate();
    all.flat_map(|(k, (_, own))| own.iter().map(move |o| of(k, o)))
        .collect()
}

impl Clocks {
    /// From the beginnings of pushes, body by body.
    pub fn of(begun: &[(String, Vec<Onset>)]) -> Self {
        let told: Vec<_> = begun
            .iter()
            .filter(|(_, all)| all.iter().any(|o| !o.held_out))
            .cloned()
            .collect();
        Self {
            damped: begun.iter().any(|(_, all)| damps(all)),
            ..Self::together(&told).unwrap_or_default()
        }
    }

    /// Whether a delay may be none, but a finger that damps.
    pub fn feigned(&self, found: &Finding) -> bool {
        self.damped && found.parameters.get("tau").is_some_and(|tau| tau.value > 0.0)
    }

    fn together(begun: &[(String, Vec<Onset>)]) -> Option<Self> {
        let all = rows(begun);
        let (held, fitted): (Vec<&Row>, Vec<&Row>) = all.iter().partition(|r| r.held_out);
        let speeds = || fitted.iter().map(|r| r.columns[0]);
        let (low, high) = (speeds().reduce(f64::min)?, speeds().reduce(f64::max)?);
        let ways: Vec<usize> = (1..=begun.len()).collect();
        let both: Vec<usize> = (0..=begun.len()).collect();
        if fitted.len() < both.len() + FEWEST.0 || high < PACES * low {
            return None;
        }
        let (whole, x, covariance) = squares(&fitted, &both)?;
        let beyond = fitted.len() - both.len();
        let scale = (whole / beyond as f64).max(1.0);
        let number = |k: usize| (x[k], (covariance[(k, k)] * scale).sqrt());
        let (by_ways, by_lead) = (squares(&fitted, &ways)?.0, squares(&fitted, &[0])?);
        let by_flight = squares(&fitted, &[begun.len() + 1])?.0;
        let beside = |k: usize| {
            let (way, sd) = number(k);
            (way / UP, sd / UP)
        };
        let ways: Vec<(String, (f64, f64))> = begun
            .iter()
            .zip(1..)
            .map(|((n, _), k)| (n.clone(), beside(k)))
            .collect();
        let (slope, sd) = number(0);
        // With no way of its own, a lead is known the better.
        let alone = ways.iter().all(|(_, way)| !counts(*way));
        let lead = if alone {
            (by_lead.1[0], (by_lead.2[(0, 0)] * scale).sqrt())
        } else {
            (slope, sd)
        };
        let steps = begun.iter().flat_map(|(_, own)| own).map(|o| o.step);
        let least = steps.fold(LEAST, |least, step| least.max(READINGS * step));
        let flies = lead.0 > 0.0 && by_flight - by_lead.0 < FLIES * scale;
        let judged = if held.is_empty() { &fitted } else { &held };
        let rms = |by: f64| {
            let each = judged.iter().map(|r| (r.way - by * r.columns[0]).powi(2));
            (each.sum::<f64>() / judged.len() as f64).sqrt()
        };
        Some(Self {
            clear: slope.abs() > CLEAR * sd && lead.0.abs() > least && beyond >= FEWEST.1 && !flies,
            would: lead.0 > CLEAR * lead.1 && lead.0 > least && !flies,
            lead: Some((lead.0, lead.1.hypot(FORM))),
            ways,
            for_ways: (by_lead.0 - by_ways) / scale,
            from: fitted.iter().map(|r| r.interaction.clone()).collect(),
            damped: false,
            left: [rms(0.0), rms(lead.0)],
            held_out: held.iter().map(|r| r.interaction.clone()).collect(),
        })
    }

    /// The way of a body beside a lead, m, with its standard deviation; nothing where there is none beyond doubt.
    pub fn way_beside(&self, body: &str) -> Option<(f64, f64)> {
        let own = self.ways.iter().find(|(name, _)| name == body).filter(|_| self.clear);
        own.map(|(_, way)| *way)
    }

    /// Odds of ways against a lead, of which one has to be. Pushes of one speed tell neither.
    pub fn odds_of_a_way(&self) -> f64 {
        if self.clear {
            return 1.0;
        }
        let odds = 1.0 / (1.0 + (-0.5 * self.for_ways).exp());
        if odds > 1.0 - WORTH { 1.0 } else { odds }
    }

    /// Whether a delay that was found otherwise is that of the beginnings of pushes, as far as they tell one.
    pub fn agree(&self, found: &Finding) -> bool {
        let known = self.lead.filter(|(_, own)| *own < KNOWN);
        let pair = known.zip(found.parameters.get("tau"));
        pair.is_none_or(|((lead, own), tau)| (tau.value + lead).abs() < UNLIKE * tau.sd.unwrap_or(0.0).hypot(own))
    }

    /// Track and force are read at different times.
    pub fn finding(&self) -> Option<Finding> {
        let of_ways = if self.clear { 0.0 } else { self.odds_of_a_way() };
        let (lead, sd) = self.lead.filter(|_| self.clear || (self.would && of_ways < 0.5))?;
        let method = "way at which the force of pushes is up, against their speed";
        // The track is late where the force is early.
        let tau = Estimate::measured(-lead, sd, "s", self.from.clone(), method);
        let told = Told {
            cause: "time-delay",
            place: "sensor",
            probability: 0.95 * (1.0 - of_ways),
            rivals: &[("presliding", worth_a_word(of_ways))],
            parameter: ("tau", tau),
            residual: "beginning",
            statistic: lead.abs() / sd,
            words: format!(
                "the force of every push is up {:.1} ms {} the body slides, however fast",
                1e3 * lead.abs(),
                if lead > 0.0 { "after" } else { "before" }
            ),
            gain: gain("position", "m", self.left, self.held_out.clone()),
        };
        Some(told.finding())
    }
}

/// Odds of a rival.
pub fn worth_a_word(odds: f64) -> f64 {
    if odds < WORTH { 0.0 } else { 0.95 * odds }
}

fn counts((way, sd): (f64, f64)) -> bool {
    way > BESIDE.0 * sd && way > BESIDE.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beginnings of pushes whose force is up `lead` seconds late on a way of `way` m.
    fn begun(speeds: &[f64], lead: f64, way: f64) -> Vec<(String, Vec<Onset>)> {
        let one = |(i, v): (usize, &f64)| {
            let off = 4e-5 * if i % 2 == 0 { 1.0 } else { -1.0 };
            Onset::told(&format!("push-{i}"), i == 5, *v, (way + lead * v / UP + off, 6e-5))
        };
        vec![("tin".to_owned(), speeds.iter().enumerate().map(one).collect())]
    }

    const SPEEDS: [f64; 8] = [0.012, 0.03, 0.07, 0.03, 0.045, 0.03, 0.012, 0.03];

    #[test]
    fn a_clock_that_is_off_is_no_way_of_friction() {
        for lead in [0.012, -0.018] {
            let clocks = Clocks::of(&begun(&SPEEDS, lead, 0.0));
            let found = clocks.finding().expect("a delay");
            let tau = &found.parameters["tau"];
            assert!(
                (tau.value + lead).abs() < 2e-3 && found.gain.reduction > 0.5,
                "{found:?}"
            );
            assert!(clocks.way_beside("tin").is_some_and(|way| !counts(way)));
            assert!(clocks.agree(&found));
        }
    }

    #[test]
    fn bristles_are_no_clock() {
        let clocks = Clocks::of(&begun(&SPEEDS, 0.0, 4e-4));
        assert!(
            clocks.finding().is_none() && clocks.odds_of_a_way() == 1.0,
            "{clocks:?}"
        );
        let plain = Clocks::of(&begun(&SPEEDS, 0.0, 0.0));
        assert!(plain.finding().is_none(), "{plain:?}");
    }

    #[test]
    fn what_is_thrown_ahead_is_no_clock() {
        let mut thrown = begun(&SPEEDS, 0.0, 0.0);
        thrown[0]
            .1
            .iter_mut()
            .for_each(|o| o.way.0 += 0.4 * o.speed.powi(2) / UP);
        let clocks = Clocks::of(&thrown);
        assert!(clocks.finding().is_none(), "{clocks:?}");
    }

    #[test]
    fn both_are_told_where_both_are() {
        let clocks = Clocks::of(&begun(&SPEEDS, 0.015, 6e-4));
        assert!(clocks.finding().is_some());
        let (way, sd) = clocks.way_beside("tin").expect("a way");
        assert!((way - 6e-4).abs() < 3.0 * sd, "{way} give or take {sd}");
    }

    #[test]
    fn pushes_of_one_speed_do_not_part_them() {
        let clocks = Clocks::of(&begun(&[0.03; 6], 0.012, 0.0));
        assert!(
            clocks.finding().is_none() && clocks.odds_of_a_way() == 0.5,
            "{clocks:?}"
        );
    }
}
