//! Friction by pair of materials, known before anything is touched (`calibration/materials.toml`).

use std::path::Path;

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

/// The pairs of a table of one's own, `text` of the file `path`: entries as `palpate calibrate friction` writes them.
pub fn materials_from_toml(text: &str, path: &Path) -> Result<Vec<MaterialFriction>> {
    let at = |found: String| {
        let expected = "entries as `palpate calibrate friction` writes them";
        Error::bad_input(path, "[[friction]]", found, expected)
    };
    let table = toml::from_str::<Table>(text).map_err(|e| at(e.message().to_owned()))?;
    for m in &table.friction {
        let coefficients = [m.static_, m.kinetic];
        let doubts = [m.static_sd, m.kinetic_sd];
        let usual = |v: &f64| v.is_finite() && *v > 0.0;
        if !coefficients.iter().chain(&doubts).all(usual) {
            return Err(at(format!("a number that is not positive for {:?}", m.pair)));
        }
    }
    Ok(table.friction)
}

/// Friction of the pair `a`, `b` in either order: from the tables of one's own, the last entry first, else the built-in one.
pub fn material_friction(own: &[MaterialFriction], a: &str, b: &str) -> Result<Option<MaterialFriction>> {
    let same = |m: &MaterialFriction| m.pair == [a, b] || m.pair == [b, a];
    match own.iter().rev().find(|m| same(m)) {
        Some(found) => Ok(Some(found.clone())),
        None => Ok(material_table()?.into_iter().find(same)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_parses_and_is_found_in_either_order() {
        assert!(material_table().expect("parses").len() > 10);
        let found = material_friction(&[], "wood", "ceramic")
            .expect("parses")
            .expect("there");
        assert_eq!(found.static_, 0.217);
        assert_eq!(material_friction(&[], "ceramic", "cheese").expect("parses"), None);
    }

    #[test]
    fn a_table_of_ones_own_comes_before_the_built_in_one_and_its_last_entry_first() {
        let entry = |static_: f64| {
            format!(
                "[[friction]]\npair = [\"ceramic\", \"wood\"]\nstatic = {static_}\nstatic_sd = 0.02\nkinetic = 0.3\nkinetic_sd = 0.02\nhow = \"a tilt\"\n"
            )
        };
        let text = [entry(0.4), entry(0.5)].concat();
        let own = materials_from_toml(&text, Path::new("own.toml")).expect("parses");
        let found = material_friction(&own, "wood", "ceramic")
            .expect("parses")
            .expect("there");
        assert_eq!(found.static_, 0.5);
        let refused = materials_from_toml(&entry(-0.4), Path::new("own.toml")).expect_err("negative");
        assert!(refused.to_string().contains("own.toml"), "{refused}");
    }
}
