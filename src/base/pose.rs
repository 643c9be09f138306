//! Rigid poses. Every transform is named `target_from_source`; coordinates are `x_in_frame`.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A rigid transform that maps child coordinates into the parent, `p_parent = R p_child + t`.
///
/// Written as seven numbers `x y z qx qy qz qw` (scalar last).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose(pub Isometry3<f64>);

impl Pose {
    /// The pose that changes nothing.
    pub fn identity() -> Self {
        Self(Isometry3::identity())
    }

    /// From `x y z qx qy qz qw`; the quaternion is normalised (check it before if it must be unit).
    pub fn from_seven(p: [f64; 7]) -> Self {
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(p[6], p[3], p[4], p[5]));
        Self(Isometry3::from_parts(Translation3::new(p[0], p[1], p[2]), rotation))
    }

    /// As `x y z qx qy qz qw` with `qw >= 0`.
    pub fn to_seven(self) -> [f64; 7] {
        let t = self.0.translation.vector;
        let q = self.0.rotation;
        let s = if q.w < 0.0 { -1.0 } else { 1.0 };
        [t.x, t.y, t.z, s * q.i, s * q.j, s * q.k, s * q.w]
    }

    /// The inverse transform.
    pub fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }
}

impl std::ops::Deref for Pose {
    type Target = Isometry3<f64>;
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl From<Isometry3<f64>> for Pose {
    fn from(isometry: Isometry3<f64>) -> Self {
        Self(isometry)
    }
}

impl Serialize for Pose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_seven().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Pose {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self::from_seven(<[f64; 7]>::deserialize(deserializer)?))
    }
}

impl JsonSchema for Pose {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Pose".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "x y z qx qy qz qw: maps child coordinates into the parent, scalar last",
            "type": "array", "items": {"type": "number"}, "minItems": 7, "maxItems": 7
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seven_numbers_come_back() {
        let p = [0.1, -0.2, 0.3, 0.5, -0.5, 0.5, 0.5];
        let back = Pose::from_seven(p).to_seven();
        for (a, b) in p.iter().zip(back) {
            assert!((a - b).abs() < 1e-15);
        }
    }
}
