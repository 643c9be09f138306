//! Which of the pairs that could be joined are: a tree that explains the motion with the fewest freedoms.
//!
//! Of any two links of a linkage the relative motion fits some kind of joint, if only one that is what the joints between
//! them make together: two hinges of crossing axes a ball, two of parallel axes gliding in a plane, two drawers a slide. The
//! relative motions along a spanning tree give all others, so that the tree whose motions are described by the least is
//! the linkage (Chow and Liu 1968, with freedoms for mutual information): of every loop of pairs the one with the most
//! freedoms is left out, then the one that moved in the most touches, then the one that moved furthest. Names do not matter.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use crate::base::Notices;
use crate::twin::{Joint, JointKind};

/// A pair that could be joined.
pub struct Arc {
    /// The joint that its motion shows.
    pub joint: Joint,
    /// Something shows that the two hold each other.
    pub proven: bool,
    /// Share of the touches in which it moved.
    pub share: f64,
    /// Middles of parent and child at the first view, m.
    pub centres: [Vector3<f64>; 2],
}

/// Probability of a kind below which it is in doubt.
const DOUBTFUL: f64 = 0.8;
/// Ways whose logarithms are nearer than this are of one length.
const ALIKE: f64 = 0.2;
/// A loop moves in a smaller share of the touches than its joints do together.
const LESS: f64 = 0.8;
/// Shares of touches nearer than this are equal.
const SAME: f64 = 1e-9;

/// Freedoms of a kind.
fn freedoms(kind: JointKind) -> u8 {
    let (rotational, translational) = kind.freedom();
    rotational + translational
}

impl Arc {
    fn ends(&self) -> [&str; 2] {
        [&self.joint.parent, &self.joint.child]
    }

    /// What is compared before any distance: freedoms and doubt of the kind; share of touches; want of proof and way.
    fn cost(&self) -> ((u8, bool), f64, (bool, i64)) {
        let way = self.joint.travelled.map_or(0.0, |[low, high]| high - low);
        let length = (way.max(1e-6).ln() / ALIKE).round() as i64;
        let doubtful = self.joint.probability < DOUBTFUL;
        (
            (freedoms(self.joint.kind), doubtful),
            self.share,
            (!self.proven, length),
        )
    }
}

/// The pairs that are held and make trees, the most probable first, in which every link hangs on one other at most. Those
/// that stood or went `together` all the while are one as far as trees go. `turned` describes
/// a joint anew with parent and child exchanged; `stir` tells how far a link moved in the world.
pub fn tree_of(
    arcs: Vec<Arc>,
    together: &[[String; 2]],
    notices: &mut Notices,
    stir: &dyn Fn(&str) -> f64,
    turned: &dyn Fn(&Joint) -> Option<Joint>,
) -> Vec<Joint> {
    let (mut kept, left) = spanning(arcs, together);
    // What is held by way of others is held by every one of them.
    for arc in left.iter().filter(|arc| arc.proven) {
        for k in way(&kept, &arc.joint.parent, &arc.joint.child) {
            kept[k].proven = true;
        }
    }
    tell(&kept, &left, notices);
    let joints = kept.into_iter().filter(|arc| arc.proven).map(|arc| arc.joint);
    let mut joints: Vec<Joint> = joints.collect();
    hang(&mut joints, stir, turned);
    let mut children = BTreeSet::new();
    joints.retain(|j| {
        let first = children.insert(j.child.clone());
        if !first {
            let message = "its child hangs on another link already: it is left out";
            notices.warn("articulation", &j.name, message);
        }
        first
    });
    joints.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.name.cmp(&b.name)));
    joints
}

/// Kruskal's tree of least cost, and what is left over.
fn spanning(mut arcs: Vec<Arc>, together: &[[String; 2]]) -> (Vec<Arc>, Vec<Arc>) {
    let remote = remoteness(&arcs);
    let far = |arc: &Arc| arc.ends().iter().map(|end| remote[*end]).sum::<f64>();
    let order = |a: &Arc, b: &Arc| -> Ordering {
        let ((kind, share, way), (other, than, length)) = (a.cost(), b.cost());
        let shares = if (share - than).abs() < SAME {
            Ordering::Equal
        } else {
            share.total_cmp(&than)
        };
        kind.cmp(&other)
            .then(shares)
            .then(way.cmp(&length))
            .then(far(a).total_cmp(&far(b)))
            .then(a.joint.name.cmp(&b.joint.name))
    };
    arcs.sort_by(order);
    let mut group: BTreeMap<String, String> = BTreeMap::new();
    for [a, b] in together {
        let (a, b) = (root(&group, a), root(&group, b));
        if a != b {
            group.insert(b, a);
        }
    }
    let (mut kept, mut left) = (Vec::new(), Vec::new());
    for arc in arcs {
        let (a, b) = (root(&group, &arc.joint.parent), root(&group, &arc.joint.child));
        if a == b {
            left.push(arc);
        } else {
            group.insert(b, a);
            kept.push(arc);
        }
    }
    (kept, left)
}

fn root(group: &BTreeMap<String, String>, name: &str) -> String {
    let mut at = name;
    while let Some(next) = group.get(at) {
        at = next;
    }
    at.to_owned()
}

/// How far each link lies from all others: of links that stand still together the middle one carries what hangs on them.
fn remoteness(arcs: &[Arc]) -> BTreeMap<String, f64> {
    let mut centres: BTreeMap<String, Vector3<f64>> = BTreeMap::new();
    for arc in arcs {
        for (end, centre) in arc.ends().into_iter().zip(arc.centres) {
            centres.entry(end.to_owned()).or_insert(centre);
        }
    }
    let from = |c: &Vector3<f64>| centres.values().map(|d| (c - d).norm()).sum::<f64>();
    centres.iter().map(|(name, c)| (name.clone(), from(c))).collect()
}

/// Says what was left out, and warns where it is more than what the joints between make together.
fn tell(kept: &[Arc], left: &[Arc], notices: &mut Notices) {
    let mut made: Vec<String> = Vec::new();
    for arc in left.iter().filter(|arc| arc.proven) {
        let between = way(kept, &arc.joint.parent, &arc.joint.child);
        let all: u8 = between.iter().map(|k| freedoms(kept[*k].joint.kind)).sum();
        let shares: f64 = between.iter().map(|k| kept[*k].share).sum();
        if freedoms(arc.joint.kind) < all && arc.share < LESS * shares {
            let message = "it would close a loop of joints and is left out";
            notices.warn("articulation", &arc.joint.name, message);
        } else {
            made.push(format!("{} and {}", arc.joint.parent, arc.joint.child));
        }
    }
    if let Some(first) = left.first().filter(|_| !made.is_empty()) {
        let message = format!("what the joints between them make together: {}", made.join(", "));
        notices.note("articulation", &first.joint.parent, message);
    }
}

/// The arcs of a tree between two of its links.
fn way(kept: &[Arc], from: &str, to: &str) -> Vec<usize> {
    let mut paths: Vec<(&str, Vec<usize>)> = vec![(from, Vec::new())];
    let mut at = 0;
    while at < paths.len() {
        let (here, path) = paths[at].clone();
        if here == to {
            return path;
        }
        for (k, arc) in kept.iter().enumerate().filter(|(k, _)| !path.contains(k)) {
            let [a, b] = arc.ends();
            let next = match (a == here, b == here) {
                (true, _) => b,
                (_, true) => a,
                _ => continue,
            };
            let mut longer = path.clone();
            longer.push(k);
            paths.push((next, longer));
        }
        at += 1;
    }
    Vec::new()
}

/// Makes every link hang on one other at most: where one would hang on two, its tree is hung up anew on the link that
/// moved least.
fn hang(joints: &mut [Joint], stir: &dyn Fn(&str) -> f64, turned: &dyn Fn(&Joint) -> Option<Joint>) {
    let twice = |joints: &[Joint]| {
        let mut children = BTreeSet::new();
        joints
            .iter()
            .find(|j| !children.insert(j.child.clone()))
            .map(|j| j.child.clone())
    };
    let mut done: BTreeSet<String> = BTreeSet::new();
    while let Some(member) = twice(joints).filter(|m| !done.contains(m)) {
        let links = reached(joints, &member);
        done.extend(links.iter().cloned());
        let Some(top) = links.iter().min_by(|a, b| stir(a).total_cmp(&stir(b))) else {
            return;
        };
        let (mut above, mut at) = (vec![top.clone()], 0);
        while at < above.len() {
            for joint in joints.iter_mut() {
                let hangs_wrongly = joint.child == above[at] && !above.contains(&joint.parent);
                if let Some(other) = hangs_wrongly.then(|| turned(joint)).flatten() {
                    *joint = other;
                }
                if joint.parent == above[at] && !above.contains(&joint.child) {
                    above.push(joint.child.clone());
                }
            }
            at += 1;
        }
    }
}

/// The links of the tree that one belongs to.
fn reached(joints: &[Joint], member: &str) -> Vec<String> {
    let (mut found, mut at) = (vec![member.to_owned()], 0);
    while at < found.len() {
        for joint in joints {
            for (one, other) in [(&joint.parent, &joint.child), (&joint.child, &joint.parent)] {
                if *one == found[at] && !found.contains(other) {
                    found.push(other.clone());
                }
            }
        }
        at += 1;
    }
    found
}
