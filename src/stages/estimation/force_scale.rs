//! The scale of a force sensor from lifts of known weights, and its use.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Config;
use super::facts::subject;
use super::lift::weigh;
use crate::base::{Error, Notices, Result};
use crate::capture::{Capture, Kind, Segmented};
use crate::math::t_quantile;

/// How far the readings of a force sensor are to scale: reading = `gain` × force, after the tare.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceScale {
    /// Reading over force, 1.
    pub gain: f64,
    /// Its standard deviation.
    pub gain_sd: f64,
    /// Least and greatest weight it rests on, N.
    pub range: [f64; 2],
    /// How it was measured.
    pub how: String,
}

/// The file that holds one.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    force: ForceScale,
}

/// A gain outside of this is no sensor's: something else was lifted.
const BELIEVABLE: [f64; 2] = [0.5, 2.0];

impl ForceScale {
    /// From the text of a file; `path` names it in errors.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let bad = |found: String| {
            let expected = "gain, gain_sd, range and how, as `palpate calibrate force` writes them";
            Error::bad_input(path, "[force]", found, expected)
        };
        let File { force } = toml::from_str(text).map_err(|e| bad(e.message().to_owned()))?;
        let ordered = force.range[0] > 0.0 && force.range[0] <= force.range[1] && force.range[1].is_finite();
        let believable = (BELIEVABLE[0]..=BELIEVABLE[1]).contains(&force.gain);
        let doubt = force.gain_sd >= 0.0 && force.gain_sd < 0.5;
        match (believable, doubt, ordered) {
            (false, ..) => Err(bad(format!("a gain of {}", force.gain))),
            (_, false, _) => Err(bad(format!("a gain_sd of {}", force.gain_sd))),
            (.., false) => Err(bad(format!("a range of {:?}", force.range))),
            _ => Ok(force),
        }
    }

    /// As text of a file.
    pub fn to_toml(&self) -> Result<String> {
        let file = File { force: self.clone() };
        toml::to_string(&file).map_err(|e| Error::Failed(format!("the scale of the force sensor: {e}")))
    }

    /// The capture with its forces and torques in true newtons.
    pub fn applied(&self, capture: &Capture) -> Capture {
        let mut capture = capture.clone();
        for interaction in &mut capture.interactions {
            let Some(stream) = &mut interaction.force else {
                continue;
            };
            stream.force.iter_mut().for_each(|f| *f /= self.gain);
            stream.torque.iter_mut().flatten().for_each(|t| *t /= self.gain);
        }
        capture
    }
}

/// The scale of the sensor from the lifts of bodies whose mass the capture gives. The standard deviation is that of the
/// mean over lifts, by Student's law where they are few, with that of the weights themselves. Fails where no known weight
/// was lifted.
pub fn calibrate_force(
    capture: &Capture,
    segmented: &[Segmented],
    config: &Config,
    notices: &mut Notices,
) -> Result<ForceScale> {
    config.check()?;
    let g = capture.gravity.norm();
    // Reading over weight, with the standard deviation of the reading and of the weight as shares of it.
    let mut lifts: Vec<(f64, f64, f64)> = Vec::new();
    let mut weights = [f64::INFINITY, 0.0_f64];
    for interaction in capture.fitted().filter(|i| i.kind == Kind::Lift) {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name);
        let Some((cut, link)) = cut.and_then(|c| Some((c, subject(interaction, c)?))) else {
            continue;
        };
        let mass_of = |name: &str| {
            let prior = capture.prior(name)?;
            Some((prior.mass?, prior.mass_sd.unwrap_or(0.0)))
        };
        let Some(weighing) = weigh(interaction, cut, link, &capture.gravity, 0.0) else {
            notices.warn("calibrate", &interaction.name, "nothing was weighed in this lift");
            continue;
        };
        let lifted = std::iter::once(link).chain(weighing.along.iter().map(String::as_str));
        let Some(masses) = lifted.map(mass_of).collect::<Option<Vec<_>>>() else {
            notices.warn(
                "calibrate",
                &interaction.name,
                format!("the mass of `{link}` is not given"),
            );
            continue;
        };
        let mass: f64 = masses.iter().map(|m| m.0).sum();
        let sd = masses.iter().map(|m| m.1 * m.1).sum::<f64>().sqrt();
        lifts.push((weighing.mass / mass, weighing.sd / mass, sd / mass));
        weights = [weights[0].min(g * mass), weights[1].max(g * mass)];
    }
    if lifts.is_empty() {
        return Err(Error::Failed(format!(
            "{}: no lift of a body whose mass is given; the force sensor is calibrated from interactions of the kind `lift` of \
             bodies with a `mass` in `capture.json`",
            capture.name
        )));
    }
    let (gain, gain_sd) = mean_gain(&lifts);
    if !(BELIEVABLE[0]..=BELIEVABLE[1]).contains(&gain) {
        return Err(Error::Failed(format!(
            "{}: the sensor reads {gain:.3} of the weights that were given; expected a share between 0.5 and 2",
            capture.name
        )));
    }
    Ok(ForceScale {
        gain,
        gain_sd,
        range: weights,
        how: format!("{} lift(s) of known weights, capture {}", lifts.len(), capture.name),
    })
}

/// The weighted mean of the gains with its standard deviation: what the lifts scatter, and what the weights are in doubt
/// by, which more lifts of the same weight do not average out.
fn mean_gain(lifts: &[(f64, f64, f64)]) -> (f64, f64) {
    let weight = |(_, reading, known): &(f64, f64, f64)| 1.0 / (reading * reading + known * known).max(1e-12);
    let total: f64 = lifts.iter().map(weight).sum();
    let gain = lifts.iter().map(|l| weight(l) * l.0).sum::<f64>() / total;
    let known = lifts.iter().map(|l| l.2).fold(0.0, f64::max);
    let n = lifts.len() as f64;
    let scatter = lifts.iter().map(|l| weight(l) * (l.0 - gain).powi(2)).sum::<f64>() / ((n - 1.0).max(1.0) * total);
    let few = if n > 1.0 {
        t_quantile(0.975, n - 1.0) / 1.96
    } else {
        1.0
    };
    (gain, (scatter.sqrt() * few).hypot(total.recip().sqrt()).hypot(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lifts_that_agree_leave_the_doubt_of_the_weights() {
        let (gain, sd) = mean_gain(&[(1.02, 1e-4, 1e-3), (1.0202, 1e-4, 1e-3), (1.0198, 1e-4, 1e-3)]);
        assert!((gain - 1.02).abs() < 1e-6, "{gain}");
        assert!((1e-3..1.5e-3).contains(&sd), "{sd}");
    }

    #[test]
    fn a_file_comes_back_as_it_was() {
        let scale = ForceScale {
            gain: 1.013,
            gain_sd: 0.002,
            range: [1.0, 9.8],
            how: "3 lifts".into(),
        };
        let text = scale.to_toml().expect("text");
        assert_eq!(ForceScale::from_toml(&text, Path::new("f.toml")).expect("file"), scale);
        for (from, to) in [
            ("gain = 1.013", "gain = 9.0"),
            ("gain_sd", "gain_ds"),
            ("[1.0, 9.8]", "[9.8, 1.0]"),
        ] {
            let wrong = text.replace(from, to);
            let error = ForceScale::from_toml(&wrong, Path::new("f.toml"))
                .expect_err("refused")
                .to_string();
            assert!(error.contains("f.toml") && error.contains("expected"), "{error}");
        }
    }
}
