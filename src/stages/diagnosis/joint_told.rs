//! Friction, damping and spring of a joint as its loads have them, beside those of a model.
//!
//! `load = (f + u_t) sign(v) + b v + c + k q`: `u_t` is how far the friction of touch `t` strays, `c` the sensor's bias, `k` a
//! spring that the model lacks. The pair `(f, b)` of the model is tried as one, for motions of one speed leave only a sum:
//! the one number is accused without which the other would do.

use nalgebra::{DMatrix, DVector};

use crate::math::{LinearFit, bayesian_linear, effective_samples, mad_sd, median};
use crate::twin::{Compared, Joint, JointKind};

/// Share of the load by which friction strays from touch to touch, and by which the law itself may be off.
const STRAYS: f64 = 0.02;
const FORM: f64 = 0.01;
/// Share of the load that a sensor's bias may be; with a spring that need not be slack.
const BIAS: f64 = 0.02;
const SLACK: f64 = 0.5;
/// Share by which the drag of a child on the table may be another than the model's.
const DRAG: f64 = 0.15;
/// Standard deviations from which on a spring is believed.
const CLEAR: f64 = 5.0;
/// 95 % of chi-squared with two degrees of freedom, and of a normal number.
const PAIR: f64 = 5.991;
const ONE: f64 = 1.96;

/// One block: touch, load less what the model knows of it, motion, and the drag that was taken off.
pub(super) struct Row {
    pub touch: usize,
    pub load: f64,
    pub speed: f64,
    pub position: f64,
    pub drag: f64,
}

/// Friction and damping as the loads have them.
pub(super) struct Told {
    value: [f64; 2],
    covariance: [[f64; 2]; 2],
    /// The speed of most of them, rad/s or m/s.
    speed: f64,
    /// What a spring pulls beyond the model's, with its standard deviation.
    spring: Option<[f64; 2]>,
}

impl Told {
    pub fn of(rows: &[Row]) -> Result<Self, String> {
        let none = || "its loads tell nothing".to_owned();
        let size = median(&rows.iter().map(|r| (r.load + r.drag).abs()).collect::<Vec<f64>>());
        let speed = median(&rows.iter().map(|r| r.speed.abs()).collect::<Vec<f64>>());
        let (size, speed) = (size.ok_or_else(none)?.max(1e-9), speed.ok_or_else(none)?);
        let ends = |f: fn(f64, f64) -> f64| rows.iter().map(|r| r.position).reduce(f);
        let range = ends(f64::max).zip(ends(f64::min)).map_or(0.0, |(high, low)| high - low);
        let plain = fit(rows, size, speed, None).ok_or_else(none)?;
        let sprung = fit(rows, size, speed, Some(range.max(1e-6))).ok_or_else(none)?;
        // A spring that nobody mentioned would be taken for damping or friction.
        let last = sprung.x.len() - 1;
        let pulls = sprung.x[last].abs() > CLEAR * sprung.sd(last).hypot(FORM * size / range.max(1e-6));
        let found = if pulls { &sprung } else { &plain };
        let mut covariance = [[0.0; 2]; 2];
        for (i, row) in covariance.iter_mut().enumerate() {
            for (k, c) in row.iter_mut().enumerate() {
                *c = found.covariance[(i, k)];
            }
        }
        // The law's own error is one of the whole load: it may lie in either.
        covariance[0][0] += (FORM * size).powi(2);
        covariance[1][1] += (FORM * size / speed).powi(2);
        Ok(Self {
            value: [found.x[0], found.x[1]],
            covariance,
            speed,
            spring: pulls.then(|| [sprung.x[last], sprung.sd(last)]),
        })
    }

    /// A spring beside that of the model.
    pub fn spring(&self, joint: &Joint) -> Option<Compared> {
        let [more, sd] = self.spring?;
        let own = joint.stiffness.as_ref().map_or(0.0, |k| k.value);
        Some(Compared {
            about: joint.name.clone(),
            quantity: "stiffness".into(),
            model: own,
            measured: own + more,
            ci95: [own + more - ONE * sd, own + more + ONE * sd],
            outside: true,
            unit: if joint.kind == JointKind::Prismatic {
                "N/m"
            } else {
                "N·m/rad"
            }
            .into(),
            note: None,
        })
    }

    /// Both numbers, where the loads part them or one of them cannot be; else their sum.
    pub fn beside(&self, joint: &Joint, own: [f64; 2]) -> Vec<Compared> {
        let units = match joint.kind {
            JointKind::Prismatic => ["N", "N·s/m", "m/s"],
            _ => ["N·m", "N·m·s/rad", "rad/s"],
        };
        let row = |quantity: String, model: f64, measured: f64, sd: f64, outside: bool, unit: &str, note| Compared {
            about: joint.name.clone(),
            quantity,
            model,
            measured,
            ci95: [measured - ONE * sd, measured + ONE * sd],
            outside,
            unit: unit.into(),
            note,
        };
        let [[ff, fb], [_, bb]] = self.covariance;
        let away = [self.value[0] - own[0], self.value[1] - own[1]];
        let squared =
            (away[0].powi(2) * bb - 2.0 * away[0] * away[1] * fb + away[1].powi(2) * ff) / (ff * bb - fb * fb);
        let speed = self.speed;
        let total = |[f, b]: [f64; 2]| f + b * speed;
        let total_sd = (ff + 2.0 * speed * fb + speed * speed * bb).sqrt();
        let words = format!("friction + {} {} of damping", short(speed), units[2]);
        let sum = |outside, note: &str| {
            let note = Some(note.to_owned());
            row(
                words.clone(),
                total(own),
                total(self.value),
                total_sd,
                outside,
                units[0],
                note,
            )
        };
        if squared <= PAIR {
            return vec![sum(false, "its friction and damping fit together")];
        }
        // What one of them would have to be, were the other right.
        let alone = [
            (
                self.value[0] - fb / bb * away[1],
                (ff - fb * fb / bb).sqrt(),
                away[1].abs() <= ONE * bb.sqrt(),
            ),
            (
                self.value[1] - fb / ff * away[0],
                (bb - fb * fb / ff).sqrt(),
                away[0].abs() <= ONE * ff.sqrt(),
            ),
        ];
        let can = alone.map(|(value, sd, fits)| fits && value > -ONE * sd);
        let names = ["friction", "damping"];
        let one = |k: usize| {
            let (value, sd, _) = alone[k];
            let note = format!("with the {} of the model, which fits", names[1 - k]);
            row(names[k].into(), own[k], value, sd, true, units[k], Some(note))
        };
        match can {
            [true, false] => vec![one(0)],
            [false, true] => vec![one(1)],
            [true, true] => vec![sum(
                true,
                "one of the two: moved at half and at twice the speed it would tell which",
            )],
            [false, false] => {
                let both = [ff.sqrt(), bb.sqrt()];
                let of = |k: usize| row(names[k].into(), own[k], self.value[k], both[k], true, units[k], None);
                vec![of(0), of(1)]
            }
        }
    }
}

/// Friction, damping, bias, drag, how far each touch strays and, over a range, a spring.
fn fit(rows: &[Row], size: f64, speed: f64, range: Option<f64>) -> Option<LinearFit> {
    let mut touches: Vec<usize> = rows.iter().map(|r| r.touch).collect();
    touches.dedup();
    let strays = 4 + touches.len();
    let all = strays + usize::from(range.is_some());
    let a = DMatrix::from_fn(rows.len(), all, |i, k| match k {
        0 => rows[i].speed.signum(),
        1 => rows[i].speed,
        2 => 1.0,
        3 => rows[i].drag,
        _ if k == strays => rows[i].position,
        _ if touches[k - 4] == rows[i].touch => rows[i].speed.signum(),
        _ => 0.0,
    });
    let b = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.load));
    let open = 10.0 * size;
    // A spring need not be slack at the first view.
    let bias = if range.is_some() { SLACK } else { BIAS };
    let sd = DVector::from_fn(all, |k, _| match k {
        0 => open,
        1 => open / speed,
        2 => bias * size,
        3 => DRAG,
        _ if k == strays => open / range.unwrap_or(1.0),
        _ => STRAYS * size,
    });
    calmed(&a, &b, &sd, size)
}

/// The fit by least squares, its noise and memory from its own residuals.
fn calmed(a: &DMatrix<f64>, b: &DVector<f64>, sd: &DVector<f64>, size: f64) -> Option<LinearFit> {
    let mean = DVector::zeros(sd.len());
    let (mut noise, mut memory) = (0.1 * size, 1.0);
    let mut trust = DVector::from_element(b.len(), 1.0);
    let mut fit = None;
    for _ in 0..12 {
        let weights = trust.map(|w| w / (memory * noise * noise));
        let found = bayesian_linear(a, b, &weights, &mean, sd)?;
        noise = mad_sd(found.residuals.as_slice())?.max(1e-3 * size);
        trust = found.residuals.map(|r| (1.345 * noise / r.abs().max(1e-300)).min(1.0));
        let trusted: Vec<f64> = found
            .residuals
            .iter()
            .zip(trust.iter())
            .map(|(r, w)| r * w.sqrt())
            .collect();
        memory = (b.len() as f64 / effective_samples(&trusted)).max(1.0);
        fit = Some(found);
    }
    fit
}

/// Three digits.
fn short(value: f64) -> String {
    format!("{value:.3}")
}
