//! Where the nodes of the constraint graph stand: one column per cluster, what stands on what above it.

use std::collections::BTreeMap;

use crate::twin::{Relation, RelationKind, SUPPORT, Twin};

/// A node of the graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its name.
    pub name: String,
    /// Centre, from the left, px.
    pub x: f64,
    /// Steps above the support, 1 for what stands on it.
    pub level: usize,
}

/// Nodes with the size of the drawing.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// All but the support.
    pub nodes: Vec<Node>,
    /// Whole width, px.
    pub width: f64,
    /// Highest level.
    pub levels: usize,
}

/// Width of a node's box, px.
pub const BOX: f64 = 106.0;
const BETWEEN_CLUSTERS: f64 = 16.0;
const WITHIN_CLUSTER: f64 = 84.0;
const MARGIN: f64 = 12.0;

/// The node that a relation's `body`, `body/link` or link name means.
pub fn resolve<'a>(twin: &'a Twin, name: &'a str) -> &'a str {
    if name == SUPPORT || twin.link(name).is_some() {
        return name;
    }
    if let Some(body) = twin.bodies.iter().find(|b| b.name == name) {
        return body.links.first().map_or(name, |l| l.name.as_str());
    }
    let last = name.rsplit('/').next().unwrap_or(name);
    if twin.link(last).is_some() { last } else { name }
}

/// True where an arc is drawn.
pub fn drawn(relation: &Relation) -> bool {
    relation.kind != RelationKind::Separate
}

/// A layout that depends on nothing but the twin.
pub fn layout(twin: &Twin) -> Layout {
    let mut names: Vec<String> = twin.links().map(|(_, l)| l.name.clone()).collect();
    let arcs: Vec<(String, String)> = twin
        .relations
        .iter()
        .filter(|r| drawn(r))
        .map(|r| (resolve(twin, &r.a).to_owned(), resolve(twin, &r.b).to_owned()))
        .collect();
    for name in arcs.iter().flat_map(|(a, b)| [a, b]) {
        if name != SUPPORT && !names.contains(name) {
            names.push(name.clone());
        }
    }
    let levels = levels(&names, &arcs);
    let mut out = Layout {
        width: MARGIN,
        levels: levels.values().copied().max().unwrap_or(1),
        ..Layout::default()
    };
    for cluster in clusters(&names, &arcs) {
        place(&cluster, &levels, &mut out);
    }
    out.width += MARGIN - BETWEEN_CLUSTERS;
    out.width = out.width.max(240.0);
    out
}

/// Steps from the support; what is not held to it stands on level 1.
fn levels(names: &[String], arcs: &[(String, String)]) -> BTreeMap<String, usize> {
    let mut found = BTreeMap::from([(SUPPORT.to_owned(), 0)]);
    let mut changed = true;
    while changed {
        changed = false;
        for (a, b) in arcs {
            for (from, to) in [(a, b), (b, a)] {
                let Some(level) = found.get(from).map(|l| l + 1) else {
                    continue;
                };
                if found.get(to).is_none_or(|old| level < *old) {
                    found.insert(to.clone(), level);
                    changed = true;
                }
            }
        }
    }
    names
        .iter()
        .map(|n| (n.clone(), found.get(n).copied().unwrap_or(1).max(1)))
        .collect()
}

/// Nodes that hold together without the support, in the order of the twin.
fn clusters(names: &[String], arcs: &[(String, String)]) -> Vec<Vec<String>> {
    let mut of: BTreeMap<&str, usize> = names.iter().enumerate().map(|(i, n)| (n.as_str(), i)).collect();
    for (a, b) in arcs.iter().filter(|(a, b)| a != SUPPORT && b != SUPPORT) {
        let (Some(&i), Some(&j)) = (of.get(a.as_str()), of.get(b.as_str())) else {
            continue;
        };
        of.values_mut().filter(|c| **c == i.max(j)).for_each(|c| *c = i.min(j));
    }
    let mut out: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    for name in names {
        if let Some(cluster) = of.get(name.as_str()) {
            out.entry(*cluster).or_default().push(name.clone());
        }
    }
    out.into_values().collect()
}

/// Adds a cluster at the right end.
fn place(cluster: &[String], levels: &BTreeMap<String, usize>, out: &mut Layout) {
    let level_of = |name: &String| levels.get(name).copied().unwrap_or(1);
    let mut rows: BTreeMap<usize, Vec<&String>> = BTreeMap::new();
    for name in cluster {
        rows.entry(level_of(name)).or_default().push(name);
    }
    let span = |n: usize| n as f64 * BOX + n.saturating_sub(1) as f64 * WITHIN_CLUSTER;
    let width = rows.values().map(|r| span(r.len())).fold(BOX, f64::max);
    for (level, row) in rows {
        let start = out.width + 0.5 * (width - span(row.len())) + 0.5 * BOX;
        for (i, name) in row.into_iter().enumerate() {
            out.nodes.push(Node {
                name: name.clone(),
                x: start + i as f64 * (BOX + WITHIN_CLUSTER),
                level,
            });
        }
    }
    out.width += width + BETWEEN_CLUSTERS;
}
