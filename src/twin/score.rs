//! How far a twin is from the right answers, quantity by quantity.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::score_rows::{body_rows, joint_rows};
use super::{Diagnosis, Joint, Model, Relation, RelationKind, TrueRelation, Truth};
use crate::base::{Result, Status};
use crate::geometry::Mesh;

/// One right answer beside the estimate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreRow {
    /// Body, link, joint (`a|b`) or arc (`a|b`).
    pub about: String,
    /// `mass`, `com`, `axis`, …
    pub quantity: String,
    /// Unit of truth, estimate and absolute error.
    pub unit: String,
    /// The right answer: a number, a list or a word.
    pub truth: serde_json::Value,
    /// The estimate, or nothing where there is none.
    pub estimate: serde_json::Value,
    /// Distance from the truth, in `unit`.
    pub error: Option<f64>,
    /// `error` over the size of the truth; absent where that is nought or has no meaning.
    pub relative: Option<f64>,
    /// Whether the 95 % interval holds the truth, in every component; absent without an interval.
    pub holds: Option<bool>,
    /// Right or wrong, for words.
    pub right: Option<bool>,
    /// `measured`, `assumed`, `known`, `derived` (from the shape) or `absent`.
    pub status: String,
}

/// The rows, and what they come to.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// One for each right answer.
    pub rows: Vec<ScoreRow>,
    /// Causes: found, missed and named without reason.
    pub causes: CauseScore,
    /// What the rows come to.
    pub summary: Summary,
}

/// The diagnosis against the right answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CauseScore {
    /// The truth names causes, if only an empty list, and some were looked for.
    pub found: Vec<String>,
    /// In the truth, not in the diagnosis.
    pub missed: Vec<String>,
    /// In the diagnosis, not in the truth.
    pub invented: Vec<String>,
}

/// How many of how many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// As they should be.
    pub good: usize,
    /// All that were looked at.
    pub all: usize,
}

/// The score in a few numbers. Only measured quantities count here; assumed ones are listed in the rows.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Summary {
    /// Largest relative error by quantity.
    pub worst_relative: BTreeMap<String, f64>,
    /// Largest absolute error by quantity, with its unit.
    pub worst_absolute: BTreeMap<String, (f64, String)>,
    /// Intervals of measured quantities that hold the truth.
    pub intervals: Tally,
    /// Relations that are right.
    pub relations: Tally,
    /// Joints whose type is right.
    pub joints: Tally,
    /// Right answers that have no estimate.
    pub absent: usize,
    /// Right answers whose estimate is only assumed.
    pub assumed: usize,
}

impl Tally {
    fn count(&mut self, good: bool) {
        self.all += 1;
        self.good += usize::from(good);
    }
}

/// Compares a twin and its diagnosis with the right answers. `meshes` are the truth's, by the paths in it; a body
/// whose mesh is not among them is not scored for shape.
///
/// # Errors
/// Where a mesh cannot be measured against.
pub fn score(
    model: &Model,
    diagnosis: &Diagnosis,
    truth: &Truth,
    meshes: Option<&BTreeMap<String, Mesh>>,
) -> Result<Score> {
    let mut rows = Vec::new();
    for (name, body) in &truth.bodies {
        rows.extend(body_rows(model, name, body, meshes)?);
    }
    for joint in &truth.joints {
        rows.extend(joint_rows(model, joint));
    }
    rows.extend(
        truth
            .relations
            .iter()
            .map(|(arc, right)| relation_row(model, arc, right)),
    );
    let causes = causes(diagnosis, truth);
    let summary = summarise(&rows);
    Ok(Score { rows, causes, summary })
}

fn relation_row(model: &Model, arc: &str, truth: &TrueRelation) -> ScoreRow {
    let (a, b) = arc.split_once('|').unwrap_or((arc, ""));
    let joins = |r: &&Relation| (same(&r.a, a) && same(&r.b, b)) || (same(&r.a, b) && same(&r.b, a));
    let found = model.twin.relations.iter().find(joins);
    let hinged = |j: &&Joint| (same(&j.parent, a) && same(&j.child, b)) || (same(&j.parent, b) && same(&j.child, a));
    let joint = model.twin.joints().find(hinged);
    // A joint is an arc too; no arc at all says that two things have nothing to do with each other.
    let (word, freedom) = match (found, joint) {
        (Some(r), _) => (serde_json::to_value(r.kind), [r.rotation_dof, r.translation_dof]),
        (None, Some(j)) => (serde_json::to_value(j.kind), [j.kind.freedom().0, j.kind.freedom().1]),
        (None, None) => (serde_json::to_value(RelationKind::Separate), [3, 3]),
    };
    let word = word.unwrap_or_default();
    let known = found.is_some() || joint.is_some();
    let (truth, estimate, right) = match truth {
        TrueRelation::Freedom(dof) => (serde_json::json!(dof), serde_json::json!(freedom), *dof == freedom),
        TrueRelation::Word(w) => (serde_json::json!(w), word.clone(), word == *w.as_str()),
    };
    ScoreRow {
        about: arc.into(),
        quantity: "relation".into(),
        unit: String::new(),
        truth,
        estimate,
        error: None,
        relative: None,
        holds: None,
        right: Some(right),
        status: if known { "measured" } else { "absent" }.into(),
    }
}

/// `body/link` and `link` name the same thing.
pub(super) fn same(name: &str, other: &str) -> bool {
    let link = |n: &str| n.rsplit_once('/').map_or(n.to_string(), |(_, l)| l.to_string());
    name == other || link(name) == link(other)
}

fn causes(diagnosis: &Diagnosis, truth: &Truth) -> CauseScore {
    let right: BTreeSet<&str> = truth.causes.iter().map(String::as_str).collect();
    let named: BTreeSet<&str> = diagnosis.findings.iter().map(|f| f.cause.as_str()).collect();
    let list = |names: Vec<&&str>| names.into_iter().map(|n| n.to_string()).collect();
    CauseScore {
        found: list(right.intersection(&named).collect()),
        missed: list(right.difference(&named).collect()),
        invented: list(named.difference(&right).collect()),
    }
}

fn summarise(rows: &[ScoreRow]) -> Summary {
    let mut out = Summary::default();
    for row in rows {
        match (row.quantity.as_str(), row.right) {
            ("relation", Some(right)) => out.relations.count(right),
            ("type", Some(right)) => out.joints.count(right),
            _ => {}
        }
        match row.status.as_str() {
            "absent" if row.quantity != "relation" => out.absent += 1,
            "assumed" => out.assumed += 1,
            _ => {}
        }
        if row.status != "measured" && row.status != "derived" {
            continue;
        }
        if let Some(holds) = row.holds {
            out.intervals.count(holds);
        }
        if let Some(relative) = row.relative {
            let worst = out.worst_relative.entry(row.quantity.clone()).or_default();
            *worst = worst.max(relative);
        }
        if let Some(error) = row.error {
            let worst = out
                .worst_absolute
                .entry(row.quantity.clone())
                .or_insert((0.0, row.unit.clone()));
            worst.0 = worst.0.max(error);
        }
    }
    out
}

/// The word for a status, as it is written in `twin.json`.
pub(super) fn word(status: Status) -> &'static str {
    match status {
        Status::Measured => "measured",
        Status::Assumed => "assumed",
        Status::Known => "known",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Estimate, Pose};
    use crate::twin::{
        BaseFit, Body, CauseOdds, DIAGNOSIS_FORMAT, FORMAT, Finding, Gain, JointKind, Link, Provenance, Twin, Verdict,
    };

    fn cube(edge: f64) -> Mesh {
        let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 0.5 * edge } else { -0.5 * edge };
        let corner = |i| nalgebra::Point3::new(side(0, i), side(1, i), side(2, i));
        let quads: [[u32; 4]; 6] = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        Mesh {
            vertices: (0..8).map(corner).collect(),
            triangles: quads
                .iter()
                .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
                .collect(),
            ..Mesh::default()
        }
    }

    fn model() -> Model {
        let mut base = Link::new("base", Pose::identity());
        base.mass = Some(Estimate::measured(0.51, 0.01, "kg", Vec::new(), "lift"));
        base.friction.kinetic = Some(Estimate::assumed(0.5, 0.2, "1", "prior"));
        base.mesh = Some("meshes/base.obj".into());
        let axis = Estimate::measured([0.0, 0.0, -1.0], [0.01; 3], "1", Vec::new(), "svd");
        let limits = Estimate::measured([-1.0, 0.5], [0.01; 2], "rad", Vec::new(), "ends");
        let joint = Joint {
            name: "hinge".into(),
            kind: JointKind::Revolute,
            parent: "base".into(),
            child: "arm".into(),
            probability: 0.9,
            alternatives: Vec::new(),
            axis,
            origin: Estimate::measured([0.066, 0.0, 0.5], [0.001; 3], "m", Vec::new(), "svd"),
            pitch: None,
            limits: Some(limits),
            travelled: None,
            position: None,
            friction: None,
            damping: None,
            stiffness: None,
            rest: None,
            effort: None,
            effects: crate::twin::JointEffects::default(),
            lateral: None,
        };
        let body = Body {
            name: "base".into(),
            links: vec![base, Link::new("arm", Pose::identity())],
            joints: vec![joint],
        };
        let twin = Twin {
            format: FORMAT.into(),
            name: "t".into(),
            gravity: [0.0, 0.0, -9.80665],
            support: None,
            bodies: vec![body],
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        };
        let meshes = BTreeMap::from([("meshes/base.obj".to_string(), cube(0.102))]);
        Model {
            twin,
            meshes,
            textures: BTreeMap::new(),
        }
    }

    fn diagnosis(cause: &str) -> Diagnosis {
        let finding = Finding {
            leader: None,
            priors: BTreeMap::new(),
            cause: cause.into(),
            place: "support".into(),
            probability: 0.9,
            alternatives: vec![CauseOdds {
                cause: "drag".into(),
                probability: 0.1,
            }],
            parameters: BTreeMap::new(),
            evidence: Vec::new(),
            gain: Gain {
                quantity: "force".into(),
                rmse_before: 1.0,
                rmse_after: 0.1,
                unit: "N".into(),
                held_out: Vec::new(),
                reduction: 0.9,
                ..Gain::default()
            },
        };
        Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            base: BaseFit::default(),
            verdict: Verdict::Explained,
            findings: vec![finding],
            experiments: Vec::new(),
            profiles: Vec::new(),
            budgets: Vec::new(),
            missed: Vec::new(),
            left: Vec::new(),
        }
    }

    #[test]
    fn every_right_answer_gets_a_row() {
        let truth: Truth = serde_json::from_str(
            r#"{ "bodies": { "base": { "mass": 0.5, "friction_kinetic": 0.4, "stiffness": 9.0, "mesh": "m.obj" } },
                 "joints": [ { "a": "base", "b": "arm", "type": "revolute", "axis": [0, 0, 1], "origin": [0.065, 0, 0.02],
                               "limits": [-0.5, 1.0] } ],
                 "relations": { "arm|base": [1, 0], "base|support": "separate" },
                 "causes": ["support-tilt", "drag"] }"#,
        )
        .expect("a truth");
        let meshes = BTreeMap::from([("m.obj".to_string(), cube(0.1))]);
        let score = score(&model(), &diagnosis("support-tilt"), &truth, Some(&meshes)).expect("scored");
        let row = |quantity: &str| score.rows.iter().find(|r| r.quantity == quantity).expect("a row");
        assert!((row("mass").relative.expect("a number") - 0.02).abs() < 1e-12);
        assert_eq!(row("mass").holds, Some(true));
        assert_eq!(row("friction_kinetic").status, "assumed");
        assert_eq!(row("stiffness").status, "absent");
        let mesh = row("mesh").error.expect("a distance");
        assert!(
            (mesh - 1.0).abs() < 0.05,
            "{mesh} mm between cubes whose faces are 1 mm apart"
        );
        assert!(
            row("axis").error.expect("an angle") < 1e-9,
            "the sign of an axis is free"
        );
        assert!(
            (row("origin").error.expect("a distance") - 1.0).abs() < 1e-9,
            "to the line, not to the point"
        );
        assert!(
            row("limits").error.expect("a number") < 1e-12,
            "limits turn with the axis"
        );
        assert_eq!(score.summary.relations, Tally { good: 2, all: 2 });
        assert_eq!(score.causes.found, ["support-tilt"]);
        assert_eq!(score.causes.missed, ["drag"]);
        assert!(!score.summary.worst_relative.contains_key("friction_kinetic"));
        let text = score.to_string();
        assert!(text.contains("mass 2.0 %"), "{text}");
    }
}
