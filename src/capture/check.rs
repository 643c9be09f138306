//! What `capture.json` must mean, beyond its keys and types: names, references, magnitudes, combinations.

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;
use serde_json::Value;

use super::document::{hold_against, join, without_nulls};
use super::json::{
    BodyJson, CameraJson, CaptureJson, InteractionJson, ShapeJson, SupportJson, ToolJson, capture_schema,
};
use super::streams::{pose_of, unit_vector};
use super::{FORMAT, Kind};
use crate::base::{Error, Result, nearest_name};

/// Magnitudes of gravity that some place has on which a robot may stand, m/s².
const GRAVITY_RANGE: std::ops::RangeInclusive<f64> = 0.1..=50.0;

/// The document as types, checked as far as can be without opening another file.
pub(super) fn check_document(file: &Path, value: Value) -> Result<CaptureJson> {
    if let Some(format) = value
        .get("format")
        .and_then(Value::as_str)
        .filter(|format| *format != FORMAT)
    {
        let found = format!("`{}`", format.escape_debug());
        return Err(Error::bad_input(file, "format", found, format!("`{FORMAT}`")));
    }
    hold_against(file, &capture_schema(), &value)?;
    let document: CaptureJson = serde_json::from_value(without_nulls(value))
        .map_err(|error| Error::bad_input(file, "the document", error.to_string(), "a capture"))?;
    Check { file }.document(&document)?;
    Ok(document)
}

struct Check<'a> {
    file: &'a Path,
}

impl Check<'_> {
    fn fault(&self, place: impl Into<String>, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::bad_input(self.file, place, found, expected)
    }

    fn document(&self, document: &CaptureJson) -> Result<()> {
        self.plain_name("name", &document.name)?;
        self.gravity(document.gravity)?;
        if let Some(support) = &document.support {
            self.support(support, document.gravity)?;
        }
        self.unique("cameras", document.cameras.iter().map(|c| c.name.as_str()))?;
        for (i, camera) in document.cameras.iter().enumerate() {
            self.camera(&format!("cameras[{i}]"), camera)?;
        }
        for (i, view) in document.views.iter().enumerate() {
            self.camera_named(&format!("views[{i}].camera"), &view.camera, &document.cameras)?;
            pose_of(self.file, &format!("views[{i}].pose"), view.pose)?;
        }
        self.unique("bodies", document.bodies.iter().map(|b| b.name.as_str()))?;
        for (i, body) in document.bodies.iter().enumerate() {
            self.body(&format!("bodies[{i}]"), body)?;
        }
        self.unique("interactions", document.interactions.iter().map(|x| x.name.as_str()))?;
        for (i, interaction) in document.interactions.iter().enumerate() {
            self.interaction(&format!("interactions[{i}]"), interaction, &document.cameras)?;
        }
        if document.views.is_empty() && document.interactions.is_empty() {
            return Err(self.fault("views, interactions", "neither", "at least one view or one interaction"));
        }
        Ok(())
    }

    fn gravity(&self, gravity: [f64; 3]) -> Result<()> {
        let size = Vector3::from(gravity).norm();
        if GRAVITY_RANGE.contains(&size) {
            return Ok(());
        }
        let (low, high) = (GRAVITY_RANGE.start(), GRAVITY_RANGE.end());
        Err(self.fault(
            "gravity",
            format!("a vector of length {size}"),
            format!("an acceleration in m/s² between {low} and {high}"),
        ))
    }

    fn support(&self, support: &SupportJson, gravity: [f64; 3]) -> Result<()> {
        let normal = unit_vector(support.normal).map_err(|norm| {
            let found = format!("a vector of length {norm:.6}");
            self.fault("support.normal", found, "a unit vector, to within 0.001")
        })?;
        if normal.dot(&Vector3::from(gravity)) > 0.0 {
            let found = "a normal that points along gravity, into the table";
            return Err(self.fault("support.normal", found, "the normal that points away from the table"));
        }
        Ok(())
    }

    fn camera(&self, place: &str, camera: &CameraJson) -> Result<()> {
        let low = camera.depth_min.unwrap_or(0.0);
        match camera.depth_max.filter(|high| *high <= low) {
            Some(high) => Err(self.fault(
                format!("{place}.depth_max"),
                high.to_string(),
                format!("more than depth_min, {low}"),
            )),
            None => Ok(()),
        }
    }

    fn camera_named(&self, place: &str, name: &str, cameras: &[CameraJson]) -> Result<()> {
        if cameras.iter().any(|c| c.name == name) {
            return Ok(());
        }
        let found = format!("an unknown camera `{}`", name.escape_debug());
        let known: Vec<&str> = cameras.iter().map(|c| c.name.as_str()).collect();
        let expected = match nearest_name(name, known.iter().copied()) {
            Some(near) => format!("one of {} (did you mean `{near}`?)", known.join(", ")),
            None => "a name that stands in cameras, which is empty".into(),
        };
        Err(self.fault(place, found, expected))
    }

    fn body(&self, place: &str, body: &BodyJson) -> Result<()> {
        self.body_name(&format!("{place}.name"), &body.name)?;
        if body.mass_sd.is_some() && body.mass.is_none() {
            return Err(self.fault(format!("{place}.mass_sd"), "a spread without a mass", "mass as well"));
        }
        if let Some(pose) = body.pose {
            pose_of(self.file, &format!("{place}.pose"), pose)?;
        }
        self.mesh_suffix(&format!("{place}.mesh"), body.mesh.as_deref())
    }

    fn interaction(&self, place: &str, interaction: &InteractionJson, cameras: &[CameraJson]) -> Result<()> {
        self.plain_name(&format!("{place}.name"), &interaction.name)?;
        for name in interaction.tracks.keys() {
            self.body_name(&join(&format!("{place}.tracks"), name), name)?;
        }
        if let Some(target) = &interaction.target {
            self.body_name(&format!("{place}.target"), target)?;
        }
        if let Some(tool) = &interaction.tool {
            self.tool(&format!("{place}.tool"), tool)?;
        }
        if let Some(frames) = &interaction.frames {
            self.camera_named(&format!("{place}.frames.camera"), &frames.camera, cameras)?;
            if let Some(pose) = frames.pose {
                pose_of(self.file, &format!("{place}.frames.pose"), pose)?;
            }
        }
        self.something_recorded(place, interaction)
    }

    fn something_recorded(&self, place: &str, interaction: &InteractionJson) -> Result<()> {
        let touched = interaction.force.is_some() || interaction.tool_path.is_some() || !interaction.tracks.is_empty();
        let recorded = touched || interaction.support_path.is_some() || interaction.frames.is_some();
        let by_tool = matches!(interaction.kind, Kind::Push | Kind::Pull | Kind::Press | Kind::Lift);
        if by_tool && !touched {
            let found = format!("a {} without force, tool_path or tracks", interaction.kind.name());
            return Err(self.fault(place, found, "at least one of force, tool_path, tracks"));
        }
        if !recorded {
            let expected = "at least one of force, tool_path, support_path, tracks, frames";
            return Err(self.fault(place, "an interaction of which nothing was recorded", expected));
        }
        Ok(())
    }

    fn tool(&self, place: &str, tool: &ToolJson) -> Result<()> {
        if tool.grip && tool.pin {
            return Err(self.fault(
                place,
                "both grip and pin",
                "one of them: held rigidly, or by a free pivot",
            ));
        }
        let size_place = format!("{place}.size");
        let (count, what) = match tool.shape {
            ShapeJson::Sphere => (1, "[radius]"),
            ShapeJson::Box => (3, "[half x, half y, half z]"),
            ShapeJson::Cylinder => (2, "[radius, half height]"),
            ShapeJson::Mesh => return self.mesh_tool(place, tool),
        };
        if tool.mesh.is_some() {
            return Err(self.fault(
                format!("{place}.mesh"),
                "a mesh for another shape",
                "shape `mesh`, or size alone",
            ));
        }
        let Some(size) = &tool.size else {
            return Err(self.fault(size_place, "nothing", format!("{what} in metres")));
        };
        if size.len() != count {
            return Err(self.fault(
                size_place,
                format!("a list of {}", size.len()),
                format!("{what} in metres"),
            ));
        }
        match size.iter().position(|x| *x <= 0.0) {
            Some(i) => Err(self.fault(format!("{size_place}[{i}]"), size[i].to_string(), "a number above 0")),
            None => Ok(()),
        }
    }

    fn mesh_tool(&self, place: &str, tool: &ToolJson) -> Result<()> {
        if tool.size.is_some() {
            return Err(self.fault(
                format!("{place}.size"),
                "a size beside a mesh",
                "the mesh alone, in metres",
            ));
        }
        if tool.mesh.is_none() {
            return Err(self.fault(format!("{place}.mesh"), "nothing", "the name of a mesh file"));
        }
        self.mesh_suffix(&format!("{place}.mesh"), tool.mesh.as_deref())
    }

    fn mesh_suffix(&self, place: &str, mesh: Option<&str>) -> Result<()> {
        let Some(mesh) = mesh else {
            return Ok(());
        };
        let suffix = Path::new(mesh)
            .extension()
            .map(|s| s.to_string_lossy().to_ascii_lowercase());
        match suffix.as_deref() {
            Some("obj" | "stl" | "ply" | "glb") => Ok(()),
            _ => Err(self.fault(
                place,
                format!("`{}`", mesh.escape_debug()),
                "a file ending in .obj, .stl, .ply or .glb",
            )),
        }
    }

    /// Names become file names of outputs: no separators, no control characters, not empty.
    fn plain_name(&self, place: &str, name: &str) -> Result<()> {
        let bad = |c: char| c.is_control() || "/\\".contains(c);
        if !name.trim().is_empty() && name != "." && name != ".." && !name.contains(bad) {
            return Ok(());
        }
        let expected = "a name that is not empty and holds no slash, backslash or control character";
        Err(self.fault(place, format!("`{}`", name.escape_debug()), expected))
    }

    fn body_name(&self, place: &str, name: &str) -> Result<()> {
        let parts: Vec<&str> = name.split('/').collect();
        if parts.len() <= 2 && parts.iter().all(|part| self.plain_name(place, part).is_ok()) {
            return Ok(());
        }
        let expected = "a name `body` or `body/link` without empty parts, backslashes or control characters";
        Err(self.fault(place, format!("`{}`", name.escape_debug()), expected))
    }

    fn unique<'n>(&self, list: &str, names: impl Iterator<Item = &'n str>) -> Result<()> {
        let mut met = BTreeSet::new();
        for (i, name) in names.enumerate() {
            if !met.insert(name) {
                let found = format!("`{}` a second time", name.escape_debug());
                return Err(self.fault(format!("{list}[{i}].name"), found, "a name of its own"));
            }
        }
        Ok(())
    }
}
