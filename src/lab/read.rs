//! Reading a scene file.

use std::path::Path;

use super::Scene;
use super::check::check;
use crate::base::{Error, Result, read_text};

/// Reads and checks the scene in the TOML file at `path`.
///
/// # Errors
/// A file that cannot be read, and everything that [`parse_scene`] refuses.
pub fn read_scene(path: &Path) -> Result<Scene> {
    parse_scene(&read_text(path)?, path)
}

/// Reads and checks a scene from TOML text; `file` is what errors call it.
///
/// # Errors
/// Text that is no scene, and scenes that cannot be: each error names the file, the key, what was found and what
/// was expected.
pub fn parse_scene(text: &str, file: &Path) -> Result<Scene> {
    let scene: Scene = toml::from_str(text).map_err(|e| {
        let place = e
            .span()
            .map_or_else(|| "the file".to_owned(), |s| line_and_column(text, s.start));
        let message = e.message().lines().collect::<Vec<_>>().join("; ");
        Error::bad_input(file, place, message, "a scene of the lab")
    })?;
    check(&scene, file)?;
    Ok(scene)
}

fn line_and_column(text: &str, offset: usize) -> String {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
    format!("line {line}, column {column}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
        name = "two"
        [[body]]
        name = "lower"
        shape = { kind = "box", size = [0.1, 0.1, 0.04] }
        position = [0.0, 0.0, 0.02]
        [[body]]
        name = "upper"
        shape = { kind = "lathe", profile = [[0, 0], [0.03, 0], [0.03, 0.05], [0, 0.05]] }
        position = [0.0, 0.0, 0.04]
        [[joint]]
        a = "lower"
        b = "upper"
        kind = "revolute"
        axis = [0.0, 0.0, 1.0]
        [[action]]
        kind = "push"
        name = "push-1"
        target = "lower"
        at = [-0.05, 0.0, 0.02]
        direction = [1.0, 0.0, 0.0]
        travel = 0.03
        speed = 0.03
    "#;

    #[test]
    fn a_good_scene_is_read() {
        let scene = parse_scene(GOOD, Path::new("good.toml")).expect("a scene");
        assert_eq!(scene.body.len(), 2);
        assert!(!scene.body[0].known_mesh);
    }

    #[test]
    fn a_bad_scene_is_refused_with_file_and_key() {
        // What is replaced, by what, and what the message must name.
        let table = [
            ("name = \"two\"", "name = \"\"", "name"),
            ("name = \"two\"", "nam = \"two\"", "line 2"),
            ("name = \"upper\"", "name = \"lower\"", "body[1].name"),
            (
                "size = [0.1, 0.1, 0.04]",
                "size = [0.1, -0.1, 0.04]",
                "body[0] (lower).shape.size",
            ),
            (
                "position = [0.0, 0.0, 0.02]",
                "position = [0.0, 0.0, 0.01]",
                "body[0] (lower).position",
            ),
            (
                "position = [0.0, 0.0, 0.02]",
                "density = 0\nposition = [0.0, 0.0, 0.02]",
                "body[0] (lower).density",
            ),
            (
                "position = [0.0, 0.0, 0.02]",
                "position = [0, 0, 0.02]\nfriction = { static = 0.2, kinetic = 0.3 }",
                "body[0] (lower).friction",
            ),
            (
                "[0.03, 0], [0.03, 0.05]",
                "[0.03, 0], [-0.03, 0.05]",
                "body[1] (upper).shape.profile[2]",
            ),
            ("[0, 0.05]]", "[0.01, 0.05]]", "body[1] (upper).shape.profile"),
            ("b = \"upper\"", "b = \"uper\"", "joint[0].b"),
            ("b = \"upper\"", "b = \"lower\"", "joint[0].b"),
            ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 0.0]", "joint[0].axis"),
            (
                "axis = [0.0, 0.0, 1.0]",
                "axis = [0, 0, 1]\nlimits = [1.0, -1.0]",
                "joint[0].limits",
            ),
            ("target = \"lower\"", "target = \"table\"", "action[0] (push-1).target"),
            (
                "direction = [1.0, 0.0, 0.0]",
                "direction = [0, 0, 0]",
                "action[0] (push-1).direction",
            ),
            ("speed = 0.03", "speed = nan", "action[0] (push-1).speed"),
            (
                "speed = 0.03",
                "speed = 0.03\ntool = { shape = \"sphere\", radius = 0 }",
                "action[0] (push-1).tool",
            ),
        ];
        for (from, to, place) in table {
            let text = GOOD.replacen(from, to, 1);
            assert_ne!(text, GOOD, "{from} is not there");
            let error = parse_scene(&text, Path::new("bad.toml")).expect_err(to);
            assert_eq!(error.exit_code(), 2);
            let message = error.to_string();
            assert!(message.starts_with(&format!("bad.toml: {place}")), "{to}: {message}");
        }
    }

    #[test]
    fn an_unknown_name_is_told_the_nearest_one() {
        let text = GOOD.replacen("b = \"upper\"", "b = \"uper\"", 1);
        let error = parse_scene(&text, Path::new("bad.toml")).expect_err("refused");
        assert!(error.to_string().contains("did you mean upper?"), "{error}");
    }
}
