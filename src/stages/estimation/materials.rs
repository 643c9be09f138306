//! Friction by pair of materials, known before anything is touched (`calibration/materials.toml`).

use serde::Deserialize;

use crate::base::{Error, Result};

const TABLE: &str = include_str!("../../../calibration/materials.toml");

/// Friction of one pair of materials.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialFriction {
    /// The two materials; the order does not matter.
    pub pair: [String; 2],
    /// Static coefficient.
    #[serde(rename = "static")]
    pub static_: f64,
    /// Its standard deviation between samples.
    pub static_sd: f64,
    /// Kinetic coefficient.
    pub kinetic: f64,
    /// Its standard deviation between samples.
    pub kinetic_sd: f64,
    /// How it was measured.
    pub how: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    friction: Vec<MaterialFriction>,
}

/// Every pair of the built-in table.
pub fn material_table() -> Result<Vec<MaterialFriction>> {
    toml::from_str::<Table>(TABLE)
        .map(|t| t.friction)
        .map_err(|e| Error::Failed(format!("calibration/materials.toml: {e}")))
}

/// Friction of the pair `a`, `b` from the built-in table, in either order.
pub fn material_friction(a: &str, b: &str) -> Result<Option<MaterialFriction>> {
    let same = |m: &MaterialFriction| m.pair == [a, b] || m.pair == [b, a];
    Ok(material_table()?.into_iter().find(same))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_parses_and_is_found_in_either_order() {
        assert!(material_table().expect("parses").len() > 10);
        let found = material_friction("wood", "ceramic").expect("parses").expect("there");
        assert_eq!(found.static_, 0.217);
        assert_eq!(material_friction("ceramic", "cheese").expect("parses"), None);
    }
}
