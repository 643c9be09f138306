//! Things that touch are told apart by the instance ids of the views, where there are any.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::discover::Thing;
use super::lens::project;
use super::range::{Range, Reading};
use crate::base::Notices;
use crate::capture::{Capture, View};
use crate::geometry::{Mesh, submesh, unique_edges};

/// Fewest vertices of an instance: fewer are the border of another.
const FEWEST: usize = 30;
/// A place is seen where the surface that a view has there is as near, m.
const NEAR: f64 = 5e-3;

/// Every thing cut into the instances that the views show in it; one id is one instance in all views. Spots without an id,
/// and ids of a few stray pixels, go to the instance next to them.
pub fn part_by_instances(things: Vec<Thing>, capture: &Capture, ranges: &[Range], notices: &mut Notices) -> Vec<Thing> {
    if capture.views.iter().all(|v| v.labels.is_none()) {
        return things;
    }
    let views = || capture.views.iter().zip(ranges);
    let mut out = Vec::new();
    for thing in things {
        let surface = &thing.surface;
        let ids: Vec<Option<u16>> = surface
            .vertices
            .iter()
            .map(|p| most(views().filter_map(|(view, range)| id_at(capture, view, range, p))))
            .collect();
        let ids = spread(surface, kept(ids));
        let mut each: Vec<u16> = ids.iter().flatten().copied().collect();
        each.sort_unstable();
        each.dedup();
        if each.len() < 2 {
            out.push(thing);
            continue;
        }
        let words = format!("{} things that touch are told apart by their instance ids", each.len());
        notices.note("shape", "views", words);
        for id in each {
            let own = |t: usize| ids[surface.triangles[t][0] as usize] == Some(id);
            out.push(Thing {
                surface: submesh(surface, own).0,
                named: Vec::new(),
            });
        }
    }
    out
}

/// The id that a view has where it sees this spot of the field.
fn id_at(capture: &Capture, view: &View, range: &Range, p: &Point3<f64>) -> Option<u16> {
    let labels = view.labels.as_ref()?;
    let Reading::Surface(off) = range.read(p) else {
        return None;
    };
    let seen = range.camera_from_field() * p;
    if off.abs() > NEAR || seen.z <= 0.0 {
        return None;
    }
    let (u, v) = project(capture.cameras.get(view.camera)?, seen.x / seen.z, seen.y / seen.z);
    let (u, v) = (u.round(), v.round());
    let inside = u >= 0.0 && v >= 0.0 && u < f64::from(labels.width) && v < f64::from(labels.height);
    let id = inside.then(|| labels.ids.get(v as usize * labels.width as usize + u as usize).copied());
    id.flatten().filter(|id| *id != 0)
}

fn most(ids: impl Iterator<Item = u16>) -> Option<u16> {
    let mut votes: BTreeMap<u16, usize> = BTreeMap::new();
    for id in ids {
        *votes.entry(id).or_insert(0) += 1;
    }
    votes
        .into_iter()
        .max_by_key(|(id, n)| (*n, std::cmp::Reverse(*id)))
        .map(|v| v.0)
}

/// Without the ids of too few vertices.
fn kept(ids: Vec<Option<u16>>) -> Vec<Option<u16>> {
    let mut sizes: BTreeMap<u16, usize> = BTreeMap::new();
    for id in ids.iter().flatten() {
        *sizes.entry(*id).or_insert(0) += 1;
    }
    let large = |id: &u16| sizes.get(id).is_some_and(|n| *n >= FEWEST);
    ids.into_iter().map(|id| id.filter(large)).collect()
}

/// Gives vertices without an id that of the nearest one along the surface.
fn spread(surface: &Mesh, mut ids: Vec<Option<u16>>) -> Vec<Option<u16>> {
    let edges = unique_edges(surface);
    loop {
        let mut next = ids.clone();
        for (a, b) in &edges {
            let (a, b) = (*a as usize, *b as usize);
            for (to, from) in [(a, b), (b, a)] {
                if ids[to].is_none() {
                    next[to] = next[to].or(ids[from]);
                }
            }
        }
        if next == ids {
            return ids;
        }
        ids = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::cuboid;

    #[test]
    fn strays_and_gaps_go_to_what_is_next_to_them() {
        let cube = crate::geometry::solids::subdivided(&crate::geometry::solids::subdivided(&cuboid([0.1; 3])));
        let ids: Vec<Option<u16>> = cube
            .vertices
            .iter()
            .enumerate()
            .map(|(i, p)| match i % 17 {
                0 => None,
                1 => Some(90 + i as u16),
                _ => Some(if p.x < 0.001 { 3 } else { 8 }),
            })
            .collect();
        let found = spread(&cube, kept(ids));
        let right = |(id, p): (&Option<u16>, &Point3<f64>)| *id == Some(if p.x < 0.001 { 3 } else { 8 });
        let wrong = found.iter().zip(&cube.vertices).filter(|x| !right(*x)).count();
        assert!(found.iter().all(Option::is_some));
        assert!(wrong <= found.len() / 17 + 1, "{wrong} of {}", found.len());
    }
}
