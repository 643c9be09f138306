//! A family of linear models with exact answers, for tests.

use rand::Rng;

use super::Quantity;
use super::family::{Active, Channel, ChannelKind, Covariate, Family, Group, Law, Parameter, Scatter, Sheet};
use crate::base::{Seed, rng_for};

/// A level with scatter between interactions, along which waves of three kinds may be.
pub struct Toy {
    sheet: Sheet,
}

/// Samples of an interaction; standard deviation of one.
const SAMPLES: usize = 40;
const SIGMA: f64 = 0.1;
/// Causes of its laws. The first two are nearly opposite, the third is another, and the last a closer form of that.
const CAUSES: [&str; 4] = ["viscous-friction", "support-tilt", "wear-or-heating", "wear-or-heating"];
/// The form that has a crease more than the third, as a share of it.
const CREASED: usize = 3;

impl Toy {
    /// Interactions that are fitted; as many again are held out.
    pub const FITTED: usize = 8;

    /// Interactions with these laws at these amplitudes; that which has a crease is creased by half.
    pub fn new(hidden: &[(usize, f64)], seed: u64) -> Self {
        Self::parted([hidden, hidden], seed)
    }

    /// The same without those that are held out.
    pub fn all_fitted(mut self) -> Self {
        self.sheet.groups.truncate(Self::FITTED);
        self
    }

    /// The same, other ones in those that are held out.
    pub fn parted(hidden: [&[(usize, f64)]; 2], seed: u64) -> Self {
        let mut dice = rng_for(Seed(seed), "toy");
        let mut free = move || (0..12).map(|_| dice.random_range(-0.5..0.5)).sum::<f64>();
        let mut group = |g: usize| {
            let own = hidden[usize::from(g >= Self::FITTED)];
            let level = 1.0 + 0.02 * free();
            let effect = |i: usize| own.iter().map(|(l, a)| a * wave((*l, 0.5), g, i)).sum::<f64>();
            let measured: Vec<f64> = (0..SAMPLES).map(|i| level + effect(i) + SIGMA * free()).collect();
            Group {
                name: format!("push-{g:02}"),
                held_out: g >= Self::FITTED,
                channels: vec![Channel {
                    kind: 0,
                    measured,
                    starts: (0..SAMPLES).map(|i| i == 0).collect(),
                    change: vec![0.0; SAMPLES],
                    aside: vec![0.0; SAMPLES],
                }],
            }
        };
        let law = |form: usize| {
            let creased = form == CREASED;
            let crease = Parameter::amplitude("crease", "1", 0.4);
            Law {
                cause: CAUSES[form],
                place: "body".into(),
                form,
                parameters: [Parameter::amplitude("a", "N", 1.0)]
                    .into_iter()
                    .chain(creased.then_some(crease))
                    .collect(),
                amplitudes: 1,
                grid: vec![if creased { vec![0.2] } else { Vec::new() }],
                extends: if creased { &[CREASED - 1] } else { &[] },
                words: "a wave",
            }
        };
        let sheet = Sheet {
            groups: (0..2 * Self::FITTED).map(&mut group).collect(),
            kinds: vec![ChannelKind {
                quantity: Quantity::Force,
                sigma: SIGMA,
                jitter: 0.0,
            }],
            base: vec![Parameter::amplitude("level", "N", 3.0)],
            scatter: vec![Scatter {
                tau: 0.02,
                counts: 4.0,
                floor: 1e-3,
                nuisance: false,
                step: 1e-3,
            }],
            laws: (0..CAUSES.len()).map(law).collect(),
        };
        Self { sheet }
    }
}

/// What a law of amplitude 1 adds, where it has a crease with one of this share.
fn wave((law, crease): (usize, f64), group: usize, sample: usize) -> f64 {
    let x = 0.3 * sample as f64 + 1.7 * group as f64;
    match law {
        0 => x.sin(),
        1 => -x.sin() + 0.25 * (3.0 * x).sin(),
        CREASED => (1.7 * x).cos() + crease * (5.1 * x).cos(),
        _ => (1.7 * x).cos(),
    }
}

impl Family for Toy {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let of = |i: usize| {
            active
                .iter()
                .map(|a| a.values[0] * wave((a.law.form, a.values.get(1).copied().unwrap_or(0.0)), group, i))
                .sum::<f64>()
        };
        (0..SAMPLES).map(|i| base[0] + scatter[0] + of(i)).collect()
    }

    fn covariates(&self, group: usize) -> Vec<Covariate> {
        vec![("place", "m", (0..SAMPLES).map(|i| (i + group) as f64).collect())]
    }
}
