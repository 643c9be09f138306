//! The scenes that come with the lab.

use std::path::Path;

use super::{Scene, parse_scene};
use crate::base::{Error, Result, nearest_name};

/// A scene's name and its TOML text.
macro_rules! scene {
    ($name:literal) => {
        ($name, include_str!(concat!("scenes/", $name, ".toml")))
    };
}

const SCENES: &[(&str, &str)] = &[
    scene!("demo"),
    scene!("drawer"),
    scene!("filmed-drawer"),
    scene!("filmed-hinge"),
    scene!("filmed-lid"),
    scene!("foam"),
    scene!("glued-stack"),
    scene!("hinge"),
    scene!("mug"),
    scene!("probe-drags"),
    scene!("probe-hinge"),
    scene!("probe-loads"),
    scene!("probe-pair"),
    scene!("probe-presses"),
    scene!("probe-pushes"),
    scene!("probe-rolls"),
    scene!("resting-stack"),
    scene!("tilted-table"),
    scene!("tiny"),
    scene!("weighted-box"),
];

/// The scenes that come with the lab: name and TOML text, by name.
pub fn scenes() -> &'static [(&'static str, &'static str)] {
    SCENES
}

/// The scene of that name that comes with the lab.
///
/// # Errors
/// A name that none of them has; the message names the nearest one.
pub fn scene_named(name: &str) -> Result<Scene> {
    let Some((_, text)) = SCENES.iter().find(|(known, _)| *known == name) else {
        let near = nearest_name(name, SCENES.iter().map(|(known, _)| *known)).unwrap_or_default();
        return Err(Error::Usage(format!(
            "there is no scene {name} in the lab; did you mean {near}?"
        )));
    };
    parse_scene(text, Path::new(&format!("{name}.toml")))
}
