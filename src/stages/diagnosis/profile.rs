//! Where a model is wrong: what it leaves of what was read against what that might depend on, in words.

use std::f64::consts::PI;

use super::Quantity;
use super::contrast::Contrast;
use super::family::Family;
use super::fit::Fit;
use super::laid::{Found, Laid, Residuals};
use super::named::values;
use super::profile_words::{off, spoken};
use super::shows_in::{Cut, View, shows_in, usual};
use crate::twin::Evidence;

/// Chance above which nothing is said of a profile.
const SIGNIFICANT: f64 = 0.01;

/// A covariate against which residuals are laid out, with what they show there.
pub struct Profiled {
    pub view: View,
    pub unit: &'static str,
    /// By interaction, all of the family's.
    pub laid: Vec<Laid>,
    pub found: Option<Found>,
}

/// What a law's finding is shown against: what its cause shows in, else what stands out beyond doubt; where nothing does, the
/// first of these says nothing in words.
pub fn profiled(family: &dyn Family, before: &Fit, full: &Fit, law: usize) -> Option<Profiled> {
    let own: Vec<f64> = values(family, full, law).iter().map(|v| v.0).collect();
    let form = &family.laws()[law];
    let residuals = Residuals::of(family, before, family.about(law), form.place != "sensor");
    let all = |views: &[View]| -> Vec<Profiled> {
        let each = views.iter().filter_map(|v| residuals.profiled(*v, Some((law, &own))));
        let mut each: Vec<Profiled> = each.collect();
        let tries = each.len() as f64;
        for f in each.iter_mut().filter_map(|e| e.found.as_mut()) {
            f.p_value = (f.p_value * tries).min(1.0);
        }
        each
    };
    let mut preferred = all(&shows_in(form.cause));
    if let Some(k) = surest(&preferred) {
        return Some(preferred.swap_remove(k));
    }
    let names = family.covariates(*before.groups.first()?);
    let others: Vec<View> = names.iter().map(|c| usual(c.0)).collect();
    let mut others = all(&others);
    match surest(&others) {
        Some(k) => Some(others.swap_remove(k)),
        None => {
            let any = preferred.into_iter().chain(others).next()?;
            Some(Profiled { found: None, ..any })
        }
    }
}

/// What is left by less than this share of the noise is not worth a word.
const FAINT: f64 = 0.05;

/// What a model leaves of its first kind of reading depends on, where that is beyond doubt.
pub fn left_against(family: &dyn Family, fit: &Fit) -> Option<Evidence> {
    let residuals = Residuals::of(family, fit, 0, true);
    let names = family.covariates(*fit.groups.first()?);
    let views = names.iter().map(|c| usual(c.0));
    let mut all: Vec<Profiled> = views.filter_map(|v| residuals.profiled(v, None)).collect();
    let tries = all.len() as f64;
    for f in all.iter_mut().filter_map(|e| e.found.as_mut()) {
        f.p_value = (f.p_value * tries).min(1.0);
    }
    let k = surest(&all)?;
    let shows = |p: &Profiled| {
        let found = p.found.as_ref().map(|f| &f.contrast);
        found.is_some_and(|c| c.inside.value.abs().max(c.outside.value.abs()) > FAINT * family.kinds()[0].sigma)
    };
    let one = all.swap_remove(k);
    shows(&one).then(|| one.evidence(residuals.quantity)).flatten()
}

/// The surest of those that are beyond doubt.
fn surest(all: &[Profiled]) -> Option<usize> {
    let sure = all
        .iter()
        .enumerate()
        .filter_map(|(k, p)| Some((k, p.found.as_ref()?.p_value)));
    let sure = sure.filter(|(_, p)| *p < SIGNIFICANT);
    sure.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

impl Profiled {
    /// What is laid out against what, in words.
    pub fn name(&self) -> String {
        let along = if self.view.along { ", along the motion" } else { "" };
        format!("{}{along}", self.view.covariate)
    }

    /// What stands out, where anything does.
    pub fn evidence(&self, quantity: Quantity) -> Option<Evidence> {
        let found = self.found.as_ref()?;
        let Contrast { inside, outside, t, .. } = &found.contrast;
        let along = if self.view.along {
            ", taken along the motion,"
        } else {
            ""
        };
        Some(Evidence {
            residual: format!("{} against {}", quantity.name(), self.name()),
            test: "contrast with the rest, and trend, jackknife over interactions".into(),
            statistic: *t,
            p_value: found.p_value,
            words: format!(
                "where the {} is {}, the predicted {}{along} is {}; elsewhere {}",
                self.view.covariate,
                self.part(found.part),
                quantity.name(),
                off(inside, quantity),
                off(outside, quantity)
            ),
        })
    }

    fn part(&self, [from, to]: [f64; 2]) -> String {
        let of = |x: f64| spoken(x, self.unit);
        match self.view.cut {
            Cut::Sector(period) => {
                let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
                let opposite = if period < 1.5 * PI { ", or opposite" } else { "" };
                format!("within {} of {}{opposite}", of(half), of(middle))
            }
            _ if from.is_infinite() => format!("below {}", of(to)),
            _ if to.is_infinite() => format!("above {}", of(from)),
            _ => format!("from {} to {}", of(from), of(to)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::super::naming::climb;
    use super::super::toy::Toy;
    use super::*;

    /// What neither the preferred covariate nor another one shows is not said.
    #[test]
    fn a_profile_that_is_not_significant_is_not_told() {
        let toy = Toy::new(&[(2, 0.4)], 11);
        let ladder = climb(&toy, &Config::default()).expect("interactions");
        let told = profiled(&toy, &ladder.plain, &ladder.full, 2).expect("a covariate");
        let said = told.evidence(Quantity::Force);
        assert!(said.is_none_or(|e| e.p_value < SIGNIFICANT));
    }
}
