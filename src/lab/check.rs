//! What a scene must be before it is made: names that exist, sizes and densities that can be, nothing sunk in the table.

use std::collections::BTreeSet;
use std::path::Path;

use super::hidden::most_of;
use super::lathe::wall;
use super::surface::{face, surface};
use super::{
    BodySpec, BondSpec, CameraSpec, FrictionSpec, JointSpec, JointSpecKind, NoiseSpec, PairSpec, RepeatSpec, Scene,
    ShapeSpec,
};
use crate::base::{Error, Result, nearest_name};

/// How deep a body may be sunk in the table, m.
const SUNK: f64 = 2e-5;

/// Refuses a scene that cannot be, with the first fault found.
pub(super) fn check(scene: &Scene, file: &Path) -> Result<()> {
    let names: BTreeSet<&str> = scene.body.iter().map(|b| b.name.as_str()).collect();
    let checker = Checker { file, names };
    checker.name("name", &scene.name)?;
    checker.direction("gravity", scene.gravity)?;
    for (k, tilt) in scene.support.tilt.iter().enumerate() {
        checker.within(&format!("support.tilt[{k}]"), *tilt, -0.5, 0.5)?;
    }
    checker.unique("body", scene.body.iter().map(|b| b.name.as_str()))?;
    for (i, body) in scene.body.iter().enumerate() {
        checker.body(&format!("body[{i}] ({})", body.name), body)?;
    }
    for (i, joint) in scene.joint.iter().enumerate() {
        checker.joint(&format!("joint[{i}]"), joint)?;
    }
    for (i, BondSpec { a, b, breakaway }) in scene.bond.iter().enumerate() {
        checker.two(&format!("bond[{i}]"), a, b)?;
        checker.positive(&format!("bond[{i}].breakaway"), breakaway.unwrap_or(1.0))?;
    }
    for (i, PairSpec { a, b, friction }) in scene.pair.iter().enumerate() {
        checker.two(&format!("pair[{i}]"), a, b)?;
        checker.friction(&format!("pair[{i}].friction"), *friction)?;
    }
    checker.camera("camera", &scene.camera)?;
    if let Some(film) = &scene.film {
        checker.within("film.rate", film.rate, 0.5, 240.0)?;
        checker.within("film.azimuth", film.azimuth, -360.0, 360.0)?;
        checker.camera("film", &film.lens())?;
    }
    checker.noise(&scene.noise)?;
    checker.repeat(&scene.repeat)?;
    checker.unique("action", scene.action.iter().map(super::ActionSpec::name))?;
    for (i, action) in scene.action.iter().enumerate() {
        checker.action(&format!("action[{i}] ({})", action.name()), action)?;
    }
    for (name, seconds) in &scene.pause {
        let place = format!("pause.{name}");
        if !scene.action.iter().any(|action| action.name() == name) {
            return checker.refuse(&place, "no such action", "the name of an action");
        }
        checker.not_negative(&place, *seconds)?;
    }
    for (i, hide) in scene.hide.iter().enumerate() {
        checker.within(&format!("hide[{i}].strength"), hide.strength, 0.0, most_of(&hide.cause))?;
        if scene.hide[..i].iter().any(|other| other.cause == hide.cause) {
            let place = format!("hide[{i}].cause");
            return checker.refuse(&place, format!("{:?} again", hide.cause), "each cause once");
        }
    }
    if scene.camera.views == 0 && scene.action.is_empty() {
        return checker.refuse("camera.views", "no view and no action", "at least one of them");
    }
    Ok(())
}

/// The file that errors name and the bodies that there are.
pub(super) struct Checker<'a> {
    file: &'a Path,
    names: BTreeSet<&'a str>,
}

impl Checker<'_> {
    pub(super) fn refuse(&self, place: &str, found: impl ToString, expected: &str) -> Result<()> {
        Err(Error::bad_input(self.file, place, found.to_string(), expected))
    }

    pub(super) fn positive(&self, place: &str, value: f64) -> Result<()> {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        self.refuse(place, value, "a positive number")
    }

    pub(super) fn not_negative(&self, place: &str, value: f64) -> Result<()> {
        if value.is_finite() && value >= 0.0 {
            return Ok(());
        }
        self.refuse(place, value, "zero or a positive number")
    }

    fn within(&self, place: &str, value: f64, low: f64, high: f64) -> Result<()> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        self.refuse(place, value, &format!("a number from {low} to {high}"))
    }

    pub(super) fn finite(&self, place: &str, values: [f64; 3]) -> Result<()> {
        if values.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        self.refuse(place, format!("{values:?}"), "three finite numbers")
    }

    pub(super) fn direction(&self, place: &str, values: [f64; 3]) -> Result<()> {
        self.finite(place, values)?;
        if values.iter().any(|v| v.abs() > 1e-9) {
            return Ok(());
        }
        self.refuse(place, format!("{values:?}"), "a vector that is not zero")
    }

    /// A name becomes part of file names: it may hold letters, digits, `-`, `_`, `.`.
    fn name(&self, place: &str, name: &str) -> Result<()> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if !name.is_empty() && !name.starts_with('.') && name.chars().all(plain) {
            return Ok(());
        }
        self.refuse(place, format!("{name:?}"), "letters, digits, - _ or .")
    }

    fn unique<'b>(&self, list: &str, names: impl Iterator<Item = &'b str>) -> Result<()> {
        let mut seen = BTreeSet::new();
        for (i, name) in names.enumerate() {
            let place = format!("{list}[{i}].name");
            self.name(&place, name)?;
            if !seen.insert(name) {
                return self.refuse(&place, format!("{name:?} a second time"), "a name of its own");
            }
        }
        Ok(())
    }

    pub(super) fn known(&self, place: &str, name: &str) -> Result<()> {
        if self.names.contains(name) {
            return Ok(());
        }
        let hint = nearest_name(name, self.names.iter().copied())
            .map_or_else(String::new, |near| format!(" (did you mean {near}?)"));
        self.refuse(place, format!("{name:?}"), &format!("the name of a body{hint}"))
    }

    fn two(&self, place: &str, a: &str, b: &str) -> Result<()> {
        self.known(&format!("{place}.a"), a)?;
        self.known(&format!("{place}.b"), b)?;
        if a == b {
            return self.refuse(&format!("{place}.b"), format!("{b:?}"), "another body than a");
        }
        Ok(())
    }

    fn friction(&self, place: &str, friction: FrictionSpec) -> Result<()> {
        let FrictionSpec { static_, kinetic } = friction;
        if static_.is_finite() && kinetic >= 0.0 && static_ >= kinetic {
            return Ok(());
        }
        self.refuse(
            place,
            format!("static {static_}, kinetic {kinetic}"),
            "static >= kinetic >= 0",
        )
    }

    fn body(&self, place: &str, body: &BodySpec) -> Result<()> {
        self.shape(&format!("{place}.shape"), &body.shape)?;
        self.positive(&format!("{place}.density"), body.density)?;
        self.finite(&format!("{place}.position"), body.position)?;
        self.within(&format!("{place}.yaw"), body.yaw, -7.0, 7.0)?;
        self.friction(&format!("{place}.friction"), body.friction)?;
        for (k, weight) in body.weight.iter().enumerate() {
            self.positive(&format!("{place}.weight[{k}].mass"), weight.mass)?;
            self.finite(&format!("{place}.weight[{k}].position"), weight.position)?;
            self.not_negative(&format!("{place}.weight[{k}].radius"), weight.radius)?;
        }
        if let Some(foam) = body.foam {
            self.positive(&format!("{place}.foam.stiffness"), foam.stiffness)?;
            self.not_negative(&format!("{place}.foam.damping"), foam.damping)?;
        }
        self.not_sunk(place, body)
    }

    fn not_sunk(&self, place: &str, body: &BodySpec) -> Result<()> {
        let lowest = surface(&body.shape).bounds().map_or(0.0, |(low, _)| low.z) + body.position[2];
        if lowest >= -SUNK {
            return Ok(());
        }
        let found = format!("{:.2} mm sunk in the table", -1e3 * lowest);
        self.refuse(
            &format!("{place}.position"),
            found,
            "a body that stands on the table or above it",
        )
    }

    fn shape(&self, place: &str, shape: &ShapeSpec) -> Result<()> {
        match shape {
            ShapeSpec::Box { size } => size
                .iter()
                .try_for_each(|s| self.positive(&format!("{place}.size"), *s)),
            ShapeSpec::Cylinder { radius, height } => {
                self.positive(&format!("{place}.radius"), *radius)?;
                self.positive(&format!("{place}.height"), *height)
            }
            ShapeSpec::Sphere { radius } => self.positive(&format!("{place}.radius"), *radius),
            ShapeSpec::Lathe { profile, handle } => {
                self.profile(place, profile)?;
                handle.map_or(Ok(()), |handle| self.handle(place, profile, handle))
            }
            ShapeSpec::Tray { size, wall, open } => {
                for s in size {
                    self.within(&format!("{place}.size"), *s, 2.1 * wall, f64::MAX)?;
                }
                self.positive(&format!("{place}.wall"), *wall)?;
                if face(open).is_none() {
                    return self.refuse(
                        &format!("{place}.open"),
                        format!("{open:?}"),
                        "+x, -x, +y, -y, +z or -z",
                    );
                }
                Ok(())
            }
            ShapeSpec::Mesh { file } => {
                let outside = file.is_empty() || file.starts_with('/') || file.split('/').any(|part| part == "..");
                if outside {
                    let expected = "a path inside the folder of the scene file";
                    return self.refuse(&format!("{place}.file"), format!("{file:?}"), expected);
                }
                Ok(())
            }
        }
    }

    fn profile(&self, place: &str, profile: &[[f64; 2]]) -> Result<()> {
        for (k, [r, z]) in profile.iter().enumerate() {
            if !(*r >= 0.0 && r.is_finite() && z.is_finite()) {
                let expected = "a radius that is not negative and a height";
                return self.refuse(&format!("{place}.profile[{k}]"), format!("[{r}, {z}]"), expected);
            }
        }
        let on_axis = |point: Option<&[f64; 2]>| point.is_some_and(|p| p[0] == 0.0);
        if profile.len() < 3 || !on_axis(profile.first()) || !on_axis(profile.last()) {
            let found = format!(
                "{} points from {:?} to {:?}",
                profile.len(),
                profile.first(),
                profile.last()
            );
            return self.refuse(
                &format!("{place}.profile"),
                found,
                "3 or more points, the first and last on the axis",
            );
        }
        Ok(())
    }

    fn handle(&self, place: &str, profile: &[[f64; 2]], handle: [f64; 3]) -> Result<()> {
        let [ring, tube, height] = handle;
        let reach = ring + tube;
        let rooted = [
            height - reach,
            height - ring + tube,
            height + ring - tube,
            height + reach,
        ]
        .iter()
        .all(|z| wall(profile, *z).0 > tube);
        if ring > tube && tube > 0.0 && rooted {
            return Ok(());
        }
        self.refuse(
            &format!("{place}.handle"),
            format!("{handle:?}"),
            "ring radius > tube radius > 0 and both roots on the wall",
        )
    }

    fn joint(&self, place: &str, joint: &JointSpec) -> Result<()> {
        self.two(place, &joint.a, &joint.b)?;
        self.direction(&format!("{place}.axis"), joint.axis)?;
        self.finite(&format!("{place}.origin"), joint.origin)?;
        self.not_negative(&format!("{place}.friction"), joint.friction)?;
        self.not_negative(&format!("{place}.damping"), joint.damping)?;
        self.not_negative(&format!("{place}.stiffness"), joint.stiffness)?;
        self.finite(&format!("{place}.rest"), [joint.rest; 3])?;
        if (joint.kind == JointSpecKind::Screw) != (joint.pitch != 0.0) || !joint.pitch.is_finite() {
            let expected = "a pitch that is not zero for a screw, and none for other kinds";
            return self.refuse(&format!("{place}.pitch"), joint.pitch.to_string(), expected);
        }
        match joint.limits {
            Some([low, high]) if !(low <= 0.0 && high >= 0.0 && low < high) => self.refuse(
                &format!("{place}.limits"),
                format!("[{low}, {high}]"),
                "low <= 0 <= high, not equal",
            ),
            _ => Ok(()),
        }
    }

    fn camera(&self, key: &str, camera: &CameraSpec) -> Result<()> {
        if camera.views == 0 {
            return Ok(());
        }
        for (side, size) in [("width", camera.width), ("height", camera.height)] {
            self.within(&format!("{key}.{side}"), f64::from(size), 8.0, 4096.0)?;
        }
        self.positive(&format!("{key}.focal"), camera.focal)?;
        self.within(&format!("{key}.distance"), camera.distance, 0.2, 3.0)?;
        self.finite(&format!("{key}.target"), camera.target)?;
        self.not_negative(&format!("{key}.depth_sd"), camera.depth_sd)?;
        self.within(&format!("{key}.flying"), camera.flying, 0.0, 1.0)?;
        if camera.elevations.is_empty() {
            return self.refuse(&format!("{key}.elevations"), "none", "at least one ring");
        }
        for (k, elevation) in camera.elevations.iter().enumerate() {
            self.within(&format!("{key}.elevations[{k}]"), *elevation, 1.0, 89.0)?;
        }
        Ok(())
    }

    fn repeat(&self, repeat: &RepeatSpec) -> Result<()> {
        self.within("repeat.friction", repeat.friction, 0.0, 0.5)?;
        self.within("repeat.stiffness", repeat.stiffness, 0.0, 0.5)
    }

    fn noise(&self, noise: &NoiseSpec) -> Result<()> {
        let spreads = [noise.force, noise.torque, noise.position, noise.rotation];
        for (key, value) in ["force", "torque", "position", "rotation"].iter().zip(spreads) {
            self.not_negative(&format!("noise.{key}"), value)?;
        }
        self.within("noise.force_rate", noise.force_rate, 1.0, 1e4)?;
        self.within("noise.track_rate", noise.track_rate, 1.0, 1e4)
    }
}
