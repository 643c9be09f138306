//! A number that never travels without its doubt and its source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the data say about a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// These data fix it.
    Measured,
    /// A prior or a default: the data say little or nothing about it.
    Assumed,
    /// Given in the capture.
    Known,
}

/// A scalar or a fixed-size list of scalars that an [`Estimate`] can hold.
pub trait Value: Clone {
    /// `[low, high]` per component, shaped as it is written in `twin.json`.
    type Interval: Clone + Serialize;
    /// The symmetric interval `value ± z sd`.
    fn normal_interval(&self, sd: &Self, z: f64) -> Self::Interval;
}

impl Value for f64 {
    type Interval = [f64; 2];
    fn normal_interval(&self, sd: &Self, z: f64) -> [f64; 2] {
        [self - z * sd, self + z * sd]
    }
}

impl<const N: usize> Value for [f64; N]
where
    [[f64; 2]; N]: Serialize,
{
    type Interval = [[f64; 2]; N];
    fn normal_interval(&self, sd: &Self, z: f64) -> Self::Interval {
        std::array::from_fn(|i| self[i].normal_interval(&sd[i], z))
    }
}

/// Which product is known where its factors are not, and what would part them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Confounded {
    /// The quantities that only appear together, e.g. `["mass", "friction.kinetic"]`.
    pub with: Vec<String>,
    /// The combination that the data do fix, e.g. `friction_force.kinetic`.
    pub known: String,
    /// The experiment that would part them, in words.
    pub experiment: String,
}

/// A measured, assumed or known quantity with its uncertainty (contract: `twin.json`, "estimate").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(bound(
    serialize = "T: Serialize, T::Interval: Serialize",
    deserialize = "T: Deserialize<'de>, T::Interval: Deserialize<'de>"
))]
#[schemars(bound = "T: JsonSchema, T::Interval: JsonSchema")]
pub struct Estimate<T: Value = f64> {
    /// The number or list, in `unit`.
    pub value: T,
    /// One standard deviation, same shape; absent (`null`) where the value is exact by definition.
    pub sd: Option<T>,
    /// `[low, high]` per component, 95 %; need not be symmetric.
    pub ci95: Option<T::Interval>,
    /// SI unit, `1` for a pure number.
    pub unit: String,
    /// Whether these data fix it.
    pub status: Status,
    /// Names of the interactions and views that it rests on.
    pub from: Vec<String>,
    /// Which estimator gave it, e.g. `push-static`.
    pub method: String,
    /// Set where only a product of this with something else is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confounded: Option<Confounded>,
}

/// The two-sided 95 % quantile of the standard normal distribution.
const Z95: f64 = 1.959_963_984_540_054;

impl<T: Value> Estimate<T> {
    /// A measured value with a symmetric interval from its standard deviation.
    pub fn measured(value: T, sd: T, unit: &str, from: Vec<String>, method: &str) -> Self {
        let ci95 = Some(value.normal_interval(&sd, Z95));
        Self {
            value,
            sd: Some(sd),
            ci95,
            unit: unit.into(),
            status: Status::Measured,
            from,
            method: method.into(),
            confounded: None,
        }
    }

    /// A prior or a default with the standard deviation of that prior.
    pub fn assumed(value: T, sd: T, unit: &str, method: &str) -> Self {
        Self {
            status: Status::Assumed,
            ..Self::measured(value, sd, unit, Vec::new(), method)
        }
    }

    /// A value given in the capture; `sd` is absent where it is exact by definition.
    pub fn known(value: T, sd: Option<T>, unit: &str) -> Self {
        let ci95 = sd.as_ref().map(|sd| value.normal_interval(sd, Z95));
        Self {
            value,
            sd,
            ci95,
            unit: unit.into(),
            status: Status::Known,
            from: Vec::new(),
            method: "given".into(),
            confounded: None,
        }
    }

    /// The same estimate with an interval that need not be symmetric.
    pub fn with_interval(mut self, ci95: T::Interval) -> Self {
        self.ci95 = Some(ci95);
        self
    }

    /// The same estimate, marked as a factor of a product that alone is known.
    pub fn with_confounded(mut self, confounded: Confounded) -> Self {
        self.confounded = Some(confounded);
        self
    }

    /// True where these data fix the value, or the capture states it.
    pub fn is_told(&self) -> bool {
        self.status != Status::Assumed
    }

    /// True where these data fix the value.
    pub fn is_measured(&self) -> bool {
        self.status == Status::Measured
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_estimate_survives_json() {
        let com = Estimate::measured([0.0, 0.1, 0.2], [0.001; 3], "m", vec!["lift-00".into()], "lift");
        let text = serde_json::to_string(&com).expect("serialises");
        let back: Estimate<[f64; 3]> = serde_json::from_str(&text).expect("parses");
        assert_eq!(back, com);
        assert!(text.contains("\"status\":\"measured\""));
    }
}
