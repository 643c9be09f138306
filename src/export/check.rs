//! Loads every export of a twin's folder again and says what differs from `twin.json`.

use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

use super::layout::lay_out;
use super::loaded::{Axis, Loaded, Skin, Solid, expected};
use super::rest::{RestResult, STEPS, rest_for};
use super::scene::{Scene, Tree};
use super::{load_glb, load_mjcf, load_sdf, load_urdf};
use crate::base::{Result, read_bytes, read_text};
use crate::twin::{Model, read_twin};

/// Largest difference that passes, relative to the quantity, for lengths to a metre.
const TOLERANCE: f64 = 1e-6;
/// The same where the reader hands numbers over in single precision.
const SINGLE_TOLERANCE: f64 = 5e-6;

/// Something in a file that is not as the twin says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Problem {
    /// The exported file, relative to the twin's folder.
    pub file: String,
    /// The part, joint or mesh.
    pub about: String,
    /// What differs, in words.
    pub message: String,
}

/// What `check` found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CheckReport {
    /// The files that were loaded again.
    pub files: Vec<String>,
    /// How many values were compared.
    pub compared: usize,
    /// What differs; empty where all is well.
    pub problems: Vec<Problem>,
    /// What each part did in five seconds of rest in the embedded engine.
    pub rest: Vec<RestResult>,
}

impl CheckReport {
    /// Whether nothing differs and everything rests.
    pub fn passed(&self) -> bool {
        self.problems.is_empty()
    }

    fn say(&mut self, file: &str, about: &str, message: String) {
        self.problems.push(Problem {
            file: file.into(),
            about: about.into(),
            message,
        });
    }

    fn require(&mut self, holds: bool, file: &str, about: &str, message: impl FnOnce() -> String) {
        self.compared += 1;
        if !holds {
            self.say(file, about, message());
        }
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} files, {} values compared", self.files.len(), self.compared)?;
        for r in &self.rest {
            writeln!(f, "  {r}")?;
        }
        for p in &self.problems {
            writeln!(f, "  PROBLEM {}: {}: {}", p.file, p.about, p.message)?;
        }
        let verdict = if self.passed() {
            "every export says what the twin says"
        } else {
            "exports differ"
        };
        write!(f, "{verdict}")
    }
}

/// Loads every export in `folder` again, compares it with `twin.json`, and lets the scene rest for five seconds
/// in the embedded engine.
///
/// # Errors
/// Where the twin itself cannot be read. What is wrong with an export is in the report.
pub fn check(folder: &Path) -> Result<CheckReport> {
    let (model, _) = read_twin(folder)?;
    let scene = lay_out(&model)?;
    let mut report = CheckReport::default();
    let all = expected(&scene, &model);
    report.urdf_of_scene(folder, &scene, &all);
    for tree in &scene.trees {
        report.urdf_of_tree(folder, tree, &all);
    }
    report.mjcf(folder, &scene, &all);
    report.glb(folder, &scene, &all);
    report.sdf(folder, &all);
    report.rest(&scene, &model);
    Ok(report)
}

impl CheckReport {
    fn urdf_of_scene(&mut self, folder: &Path, scene: &Scene, all: &Loaded) {
        let alone = scene.trees.len() == 1;
        let root_pose = |_: &str| match scene.trees.first().and_then(|t| t.parts.first()) {
            Some(root) if alone => root.world_from_part,
            _ => Isometry3::identity(),
        };
        let file = "scene.urdf";
        let load = |text: &str| load_urdf::load(&folder.join(file), text, root_pose);
        if let Some(got) = self.open(file, read_text(&folder.join(file)).and_then(|t| load(&t))) {
            self.compare(file, all, &got, TOLERANCE);
            self.named_files(file, folder, &got);
        }
    }

    fn urdf_of_tree(&mut self, folder: &Path, tree: &Tree, all: &Loaded) {
        let Some(root) = tree.parts.first() else { return };
        let file = format!("urdf/{}.urdf", tree.name);
        let path = folder.join(&file);
        let load = |text: &str| load_urdf::load(&path, text, |_| root.world_from_part);
        let Some(got) = self.open(&file, read_text(&path).and_then(|t| load(&t))) else {
            return;
        };
        let names: BTreeSet<&String> = tree.parts.iter().map(|p| &p.name).collect();
        let motions = tree.parts.iter().filter_map(|p| p.hold()).flat_map(|h| &h.motions);
        let joints: BTreeSet<&String> = motions.map(|m| &m.name).collect();
        let mut mine = all.clone();
        mine.parts.retain(|name, _| names.contains(name));
        mine.axes.retain(|name, _| joints.contains(name));
        mine.skins.retain(|name, _| names.contains(name));
        self.compare(&file, &mine, &got, TOLERANCE);
        self.named_files(&file, &folder.join("urdf"), &got);
    }

    fn mjcf(&mut self, folder: &Path, scene: &Scene, all: &Loaded) {
        let file = "scene.xml";
        let path = folder.join(file);
        let loaded = read_text(&path).and_then(|t| load_mjcf::load(&path, &t));
        let Some(got) = self.open(file, loaded) else { return };
        let mut mine = all.clone();
        let balls = scene
            .parts()
            .filter_map(|(_, p)| p.hold())
            .filter(|h| h.motions.len() == 3 && h.motions.iter().all(|m| m.turns));
        for hold in balls {
            mine.axes.retain(|name, _| hold.motions.iter().all(|m| &m.name != name));
        }
        self.compare(file, &mine, &got, TOLERANCE);
        self.named_files(file, folder, &got);
    }

    fn glb(&mut self, folder: &Path, scene: &Scene, all: &Loaded) {
        let file = "scene.glb";
        let path = folder.join(file);
        let loaded = read_bytes(&path).and_then(|b| load_glb::load(&path, &b));
        let Some(got) = self.open(file, loaded) else { return };
        let mut mine = all.clone();
        for tree in scene.trees.iter().filter(|t| t.anchored) {
            mine.parts
                .retain(|name, _| tree.parts.first().is_none_or(|p| &p.name != name));
        }
        let single = scene
            .parts()
            .filter_map(|(_, p)| p.hold())
            .filter(|h| h.motions.len() == 1);
        let names: BTreeSet<&String> = single.map(|h| &h.name).collect();
        mine.axes.retain(|name, _| names.contains(name));
        self.compare(file, &mine, &got, SINGLE_TOLERANCE);
    }

    /// SDFormat is written on demand, so it need not be there.
    fn sdf(&mut self, folder: &Path, all: &Loaded) {
        let file = "scene.sdf";
        let path = folder.join(file);
        if !path.is_file() {
            return;
        }
        let loaded = read_text(&path).and_then(|t| load_sdf::load(&path, &t));
        if let Some(got) = self.open(file, loaded) {
            self.compare(file, all, &got, TOLERANCE);
            self.named_files(file, folder, &got);
        }
    }

    fn open(&mut self, file: &str, loaded: Result<Loaded>) -> Option<Loaded> {
        match loaded {
            Ok(loaded) => {
                self.files.push(file.into());
                Some(loaded)
            }
            Err(error) => {
                self.say(file, "file", error.to_string());
                None
            }
        }
    }

    fn named_files(&mut self, file: &str, from: &Path, got: &Loaded) {
        for name in &got.files {
            self.require(from.join(name).is_file(), file, name, || "the file is not there".into());
        }
    }

    fn compare(&mut self, file: &str, want: &Loaded, got: &Loaded, tolerance: f64) {
        for (name, part) in &want.parts {
            match got.parts.get(name) {
                Some(other) => self.solid(file, name, part, other, tolerance),
                None => self.say(file, name, "the part is missing".into()),
            }
        }
        for (name, skin) in &want.skins {
            match got.skins.get(name) {
                Some(other) => self.skin(file, name, skin, other, tolerance),
                None => self.say(file, name, "it says nothing of how it touches".into()),
            }
        }
        for (name, axis) in &want.axes {
            match got.axes.get(name) {
                Some(other) => self.axis(file, name, axis, other, tolerance),
                None => self.say(file, name, "the joint is missing, or of another type".into()),
            }
        }
    }

    fn solid(&mut self, file: &str, name: &str, want: &Solid, got: &Solid, tolerance: f64) {
        let mass = (want.mass - got.mass).abs() / want.mass;
        self.require(mass <= tolerance, file, name, || {
            format!("mass {} kg, not {} kg", got.mass, want.mass)
        });
        let com = (want.com - got.com).norm();
        self.require(com <= tolerance, file, name, || format!("centre of mass {com} m away"));
        let inertia = (want.inertia - got.inertia).norm() / want.inertia.norm();
        self.require(inertia <= tolerance, file, name, || format!("inertia off by {inertia}"));
        let angle = want.rotation.angle_to(&got.rotation);
        self.require(angle <= tolerance, file, name, || format!("turned by {angle} rad"));
    }

    fn skin(&mut self, file: &str, name: &str, want: &Skin, got: &Skin, tolerance: f64) {
        for (key, a, b) in [
            ("static friction", want.static_friction, got.static_friction),
            ("kinetic friction", want.kinetic_friction, got.kinetic_friction),
            ("restitution", want.restitution, got.restitution),
            ("rolling friction", want.rolling, got.rolling),
        ] {
            if let (Some(a), Some(b)) = (a, b) {
                let same = (a - b).abs() <= tolerance * a.abs();
                self.require(same, file, name, || format!("{key} {b}, not {a}"));
            }
        }
    }

    fn axis(&mut self, file: &str, name: &str, want: &Axis, got: &Axis, tolerance: f64) {
        self.require(want.turns == got.turns, file, name, || "a joint of another type".into());
        let away = (want.direction - got.direction).norm();
        self.require(away <= tolerance, file, name, || format!("axis off by {away}"));
        let beside = line_distance(&want.origin, &want.direction, &got.origin);
        let sound = beside <= tolerance || !want.turns;
        self.require(sound, file, name, || format!("origin {beside} m beside the axis"));
        if let (Some(a), Some(b)) = (want.range, got.range) {
            let off = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            self.require(off <= tolerance, file, name, || format!("range {b:?}, not {a:?}"));
        } else {
            let invented = want.range.is_none() && (got.range.is_none() || !got.turns);
            self.require(invented, file, name, || {
                format!("range {:?}, not {:?}", got.range, want.range)
            });
        }
        if let (true, Some((leader, ratio))) = (says_who_follows(file), &want.follows) {
            let same = |(l, r): &(String, f64)| l == leader && (r - ratio).abs() <= tolerance * ratio.abs();
            self.require(got.follows.as_ref().is_some_and(same), file, name, || {
                format!("follows {:?}, not {leader} by {ratio}", got.follows)
            });
        }
        let pairs = [
            ("damping", want.damping, got.damping),
            ("friction", want.friction, got.friction),
            ("stiffness", want.stiffness, got.stiffness),
        ];
        for (key, a, b) in pairs {
            if let (Some(a), Some(b)) = (a, b) {
                let same = (a - b).abs() <= tolerance * a.abs();
                self.require(same, file, name, || format!("{key} {b}, not {a}"));
            }
        }
    }

    fn rest(&mut self, scene: &Scene, model: &Model) {
        self.rest = rest_for(scene, model, STEPS);
        for result in self.rest.clone() {
            self.require(result.is_calm(), "embedded engine", &result.part, || {
                format!("does not rest: {result}")
            });
        }
    }
}

/// Whether a joint that follows another is one in the format of the file.
fn says_who_follows(file: &str) -> bool {
    [".urdf", ".xml", ".sdf"].iter().any(|ending| file.ends_with(ending))
}

fn line_distance(point: &Vector3<f64>, direction: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    (other - point).cross(direction).norm() / direction.norm()
}
