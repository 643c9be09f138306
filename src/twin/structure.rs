//! What a model holds together, or lets move, otherwise than a capture showed.

use super::{JointKind, Lumped, RelationKind, Twin};

/// Probability from which on a joint that was measured stands against the model's.
const SURE: f64 = 0.9;

/// In words, where `seen` (a fit without the model) has another joint or none between what the model has parted or held.
pub fn structure_compared(model: &Lumped, seen: &Twin) -> Vec<String> {
    let mut words = Vec::new();
    let names: Vec<&str> = seen.links().map(|(_, l)| l.name.as_str()).collect();
    for (k, a) in names.iter().enumerate() {
        for b in &names[k + 1..] {
            let (Some(here), Some(there)) = (model.of(a), model.of(b)) else {
                continue;
            };
            let own = match here.name == there.name {
                true => Some(JointKind::Fixed),
                false => between(&model.model.twin, &here.name, &there.name),
            };
            words.extend(pair(a, b, own, seen));
        }
    }
    words
}

fn between(twin: &Twin, a: &str, b: &str) -> Option<JointKind> {
    let ends = |x: &str, y: &str| (x == a && y == b) || (x == b && y == a);
    let mut joints = twin.joints();
    joints.find(|j| ends(&j.parent, &j.child)).map(|j| j.kind)
}

fn pair(a: &str, b: &str, own: Option<JointKind>, seen: &Twin) -> Option<String> {
    let ends = |x: &str, y: &str| (x == a && y == b) || (x == b && y == a);
    let joint = seen
        .joints()
        .find(|j| ends(&j.parent, &j.child) && j.probability > SURE);
    let relation = seen.relations.iter().find(|r| ends(&r.a, &r.b) && r.probability > SURE);
    let found = match (joint, relation.map(|r| r.kind)) {
        (Some(j), _) => Some(j.kind),
        (None, Some(RelationKind::Resting | RelationKind::Separate)) => None,
        // Nothing that was done told these two apart, or together.
        _ => return None,
    };
    let said = |kind: Option<JointKind>| match kind {
        Some(JointKind::Fixed) => "held fast".to_owned(),
        Some(kind) => format!("a {} joint", kind.name()),
        None => "no joint".to_owned(),
    };
    (own != found).then(|| {
        let (own, found) = (said(own), said(found));
        format!("between {a} and {b} the model has: {own}; these touches showed: {found}")
    })
}
