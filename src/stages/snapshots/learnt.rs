//! A prior from things already seen: what those of the same shape and material told, for the next of their kind.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::space::{DIMENSIONS, Prior, Space};
use crate::base::{Error, Result};
use crate::math::random_effects;
use crate::physics::tabletop::Solid;

/// Scatter between things that is believed where few were seen (logarithm).
const SCATTER: f64 = 0.3;
/// A learnt prior is never narrower than this (logarithm): the next thing is not the last one.
const NARROWEST: f64 = 0.12;

/// How a thing moves over a table: it rolls every way, about one axis, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeClass {
    /// A ball.
    Ball,
    /// Turned on a lathe: a can, a cup.
    Round,
    /// Anything else.
    Angular,
}

impl ShapeClass {
    /// By the principal moments of inertia.
    pub fn of(solid: &Solid) -> Self {
        if solid.is_ball() {
            return Self::Ball;
        }
        let i = Vector3::from(solid.moments());
        let close = |a: f64, b: f64| (a - b).abs() < 0.03 * a.max(b);
        let pairs = close(i.x, i.y) || close(i.y, i.z) || close(i.x, i.z);
        if pairs && solid.corners() > 16 {
            Self::Round
        } else {
            Self::Angular
        }
    }
}

/// What one thing told: logarithms of its parameters with their standard deviations, where its snapshots fixed them.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Its shape.
    pub shape: ShapeClass,
    /// Its material, where the capture named it.
    pub material: Option<String>,
    /// In the order of the parameters.
    pub told: [Option<(f64, f64)>; DIMENSIONS],
    /// Values of the parameters where its divergence was least.
    pub least: [f64; DIMENSIONS],
}

/// What things of a kind have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    /// Of this shape; of any where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeClass>,
    /// Of this material; of any where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// How many were seen.
    pub things: usize,
    /// Median and standard deviation of the logarithm for a further one, as far as they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<[f64; 2]>,
    /// Rolling resistance, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling: Option<[f64; 2]>,
    /// Friction against the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_friction: Option<[f64; 2]>,
    /// Restitution at the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution: Option<[f64; 2]>,
    /// Where the divergence was least: the medians of all four.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least: Option<[f64; DIMENSIONS]>,
}

/// Priors by kind, the most particular first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearntPrior {
    /// The kinds.
    pub kind: Vec<Kind>,
}

impl LearntPrior {
    /// From things already seen: a random-effects mean over each kind, and its scatter between things.
    pub fn from_seen(seen: &[Seen]) -> Self {
        let mut keys: Vec<(Option<ShapeClass>, Option<String>)> = Vec::new();
        for s in seen {
            for key in [
                (Some(s.shape), s.material.clone()),
                (None, s.material.clone()),
                (Some(s.shape), None),
                (None, None),
            ] {
                if !keys.contains(&key) {
                    keys.push(key);
                }
            }
        }
        keys.sort_by_key(|(shape, material)| (material.is_none(), shape.is_none(), *shape, material.clone()));
        let kind = |(shape, material): (Option<ShapeClass>, Option<String>)| {
            let mine = |s: &&Seen| shape.is_none_or(|k| k == s.shape) && (material.is_none() || material == s.material);
            let of_kind: Vec<&Seen> = seen.iter().filter(mine).collect();
            let k = |i: usize| further(&of_kind.iter().filter_map(|s| s.told[i]).collect::<Vec<_>>());
            Kind {
                things: of_kind.len(),
                friction: k(0),
                rolling: k(1),
                tool_friction: k(2),
                restitution: k(3),
                least: least(&of_kind),
                shape,
                material,
            }
        };
        Self {
            kind: keys.into_iter().map(kind).collect(),
        }
    }

    /// The space with what was learnt of things of this shape and material in the place of the settings' priors.
    pub fn apply(&self, space: Space, shape: ShapeClass, material: Option<&str>) -> Space {
        let fits = |k: &&Kind| {
            k.shape.is_none_or(|s| s == shape) && (k.material.is_none() || k.material.as_deref() == material)
        };
        let mut out = space;
        let fields = |k: &Kind| [k.friction, k.rolling, k.tool_friction, k.restitution];
        for (number, prior) in out.priors.iter_mut().enumerate() {
            if let Some([median, sd]) = self.kind.iter().filter(fits).find_map(|k| fields(k)[number]) {
                *prior = Prior::LogNormal(median, sd);
            }
        }
        out
    }

    /// Where things of this shape, of any material, were fitted best; where none of the shape were seen, any.
    pub fn least(&self, shape: ShapeClass) -> Option<[f64; DIMENSIONS]> {
        let of = |of: Option<ShapeClass>| self.kind.iter().find(|k| k.material.is_none() && k.shape == of)?.least;
        of(Some(shape)).or_else(|| of(None))
    }

    /// As a file.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string(self).map_err(|e| Error::Failed(format!("the learnt prior: {e}")))
    }

    /// From a file's text.
    pub fn from_toml(text: &str) -> Result<Self> {
        let read: Self = toml::from_str(text).map_err(|e| Error::Usage(format!("the learnt prior: {e}")))?;
        let pairs = |k: &Kind| [k.friction, k.rolling, k.tool_friction, k.restitution];
        let sound = |p: &[f64; 2]| p.iter().all(|x| x.is_finite() && *x > 0.0);
        let points = read.kind.iter().flat_map(|k| k.least).flatten();
        if read.kind.iter().flat_map(pairs).flatten().all(|p| sound(&p)) && points.into_iter().all(|x| x > 0.0) {
            return Ok(read);
        }
        Err(Error::Usage(
            "the learnt prior: medians and standard deviations must be above 0".into(),
        ))
    }
}

/// The medians of the points where things of a kind were fitted best.
fn least(of_kind: &[&Seen]) -> Option<[f64; DIMENSIONS]> {
    if of_kind.len() < 2 {
        return None;
    }
    let mut out = [0.0; DIMENSIONS];
    for (k, value) in out.iter_mut().enumerate() {
        let logs: Vec<f64> = of_kind.iter().map(|s| s.least[k].max(f64::MIN_POSITIVE).ln()).collect();
        *value = crate::math::median(&logs)?.exp();
    }
    Some(out)
}

/// Median and standard deviation of the logarithm for one thing more.
fn further(told: &[(f64, f64)]) -> Option<[f64; 2]> {
    if told.len() < 2 {
        return None;
    }
    let (values, sds): (Vec<f64>, Vec<f64>) = told.iter().copied().unzip();
    let pooled = random_effects(&values, &sds, SCATTER)?;
    Some([pooled.mean.exp(), pooled.between.hypot(pooled.sd).max(NARROWEST)])
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::*;

    fn seen(friction: f64, material: &str) -> Seen {
        Seen {
            shape: ShapeClass::Angular,
            material: Some(material.into()),
            told: [Some((friction.ln(), 0.05)), None, None, None],
            least: [friction, 1e-4, 0.2, 0.1],
        }
    }

    #[test]
    fn a_thing_of_a_known_kind_starts_where_its_kind_is() {
        let all = [
            seen(0.20, "felt"),
            seen(0.22, "felt"),
            seen(0.19, "felt"),
            seen(0.60, "rubber"),
            seen(0.66, "rubber"),
        ];
        let learnt = LearntPrior::from_toml(&LearntPrior::from_seen(&all).to_toml().expect("writes")).expect("reads");
        let space = Space::new(&Config::default(), None);
        let friction = |material: Option<&str>| learnt.apply(space, ShapeClass::Angular, material).priors[0].value(0.0);
        assert!((friction(Some("felt")) - 0.203).abs() < 0.01);
        assert!((friction(Some("rubber")) - 0.63).abs() < 0.02);
        // Of an unknown material: between them, and wide.
        assert!((0.25..0.45).contains(&friction(None)));
        let least = learnt.least(ShapeClass::Angular).expect("five were seen");
        assert!((least[3] - 0.1).abs() < 1e-9, "{least:?}");
        // What nobody told stays as it was.
        assert_eq!(
            learnt.apply(space, ShapeClass::Angular, None).priors[1],
            space.priors[1]
        );
    }
}
