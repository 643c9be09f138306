//! What lies on the support and is too low to be told from it point by point: a coin, a card. Its mean height over a few
//! millimetres tells that it is there; no body is made of it, and a notice says so.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::Point3;

use super::discover::Thing;
use super::range::Range;
use super::support::Ground;
use crate::base::Notices;
use crate::math::median;

/// Edge of a cell, m; readings that it needs.
const CELL: f64 = 3e-3;
const FEWEST: usize = 8;
/// Least height over the support, m, and in scatters of single readings.
const LEAST: f64 = 7e-4;
const SCATTERS: f64 = 2.0;
/// Least area, m².
const LEAST_AREA: f64 = 1e-4;
/// Cells around a thing in which its own edge blurs the support.
const BLURRED: i32 = 4;
/// Cells from the edge of what is flat in which the support around it is looked at, and how many it takes.
const AROUND: (i32, i32) = (2, 5);
const FEWEST_AROUND: usize = 12;
/// The support around it is level within this share of the height.
const LEVEL: f64 = 0.35;
/// Readings that are looked at.
const MOST: usize = 1_500_000;

type Cell = (i32, i32);

/// Tells of everything flat that stands clear of the things.
pub fn warn_of_flat(ranges: &[Range], things: &[Thing], floor: f64, ground: &Ground, notices: &mut Notices) {
    if ground.plane.is_none() {
        return;
    }
    let heights = heights(ranges, things, floor);
    let least = LEAST.max(SCATTERS * ground.roughness);
    let raised: BTreeSet<Cell> = heights.iter().filter(|(_, h)| **h > least).map(|(c, _)| *c).collect();
    for patch in patches(raised) {
        let area = patch.len() as f64 * CELL * CELL;
        let Some(height) = rise(&patch, &heights).filter(|h| *h > least && area >= LEAST_AREA) else {
            continue;
        };
        let count = patch.len() as f64;
        let sum = patch
            .iter()
            .fold((0.0, 0.0), |s, c| (s.0 + f64::from(c.0), s.1 + f64::from(c.1)));
        let middle = Point3::new((sum.0 / count + 0.5) * CELL, (sum.1 / count + 0.5) * CELL, 0.0);
        let at = ground.world_from_field * middle;
        let words = format!(
            "something flat lies on the support near [{:.3}, {:.3}, {:.3}] m: {:.1} cm², {:.1} mm high; what is lower than {:.1} mm is no thing of its own here",
            at.x,
            at.y,
            at.z,
            area * 1e4,
            height * 1e3,
            floor * 1e3
        );
        notices.warn("shape", "support", words);
    }
}

fn cell(p: &Point3<f64>) -> Cell {
    ((p.x / CELL).floor() as i32, (p.y / CELL).floor() as i32)
}

/// Mean height of the readings in every cell that holds the support or what is flat, clear of the things.
fn heights(ranges: &[Range], things: &[Thing], floor: f64) -> BTreeMap<Cell, f64> {
    let mut near: BTreeSet<Cell> = BTreeSet::new();
    let feet: BTreeSet<Cell> = things
        .iter()
        .flat_map(|t| t.surface.vertices.iter().map(cell))
        .collect();
    for (x, y) in feet {
        let around = (-BLURRED..=BLURRED).flat_map(|i| (-BLURRED..=BLURRED).map(move |j| (x + i, y + j)));
        near.extend(around);
    }
    let all: usize = ranges.iter().map(|r| r.points(8).count() * 64).sum();
    let step = ((all as f64 / MOST as f64).sqrt().ceil() as usize).max(1);
    let mut sums: BTreeMap<Cell, (f64, usize)> = BTreeMap::new();
    for p in ranges.iter().flat_map(|r| r.points(step)) {
        let c = cell(&p);
        if p.z.abs() < 2.0 * floor && !near.contains(&c) {
            let sum = sums.entry(c).or_insert((0.0, 0));
            *sum = (sum.0 + p.z, sum.1 + 1);
        }
    }
    let enough = sums.into_iter().filter(|(_, (_, n))| *n >= FEWEST);
    enough.map(|(c, (sum, n))| (c, sum / n as f64)).collect()
}

/// Cells that hang together.
fn patches(mut left: BTreeSet<Cell>) -> Vec<BTreeSet<Cell>> {
    let mut out = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut patch, mut queue) = (BTreeSet::from([first]), VecDeque::from([first]));
        while let Some((x, y)) = queue.pop_front() {
            for next in [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)] {
                if left.remove(&next) {
                    patch.insert(next);
                    queue.push_back(next);
                }
            }
        }
        out.push(patch);
    }
    out
}

/// How far a patch rises over the support around it; nothing where that was not seen or is not level.
fn rise(patch: &BTreeSet<Cell>, heights: &BTreeMap<Cell, f64>) -> Option<f64> {
    let reach = AROUND.1;
    let mut near: BTreeMap<Cell, i32> = BTreeMap::new();
    for (x, y) in patch {
        for i in -reach..=reach {
            for j in -reach..=reach {
                let far = i.abs().max(j.abs());
                let known = near.entry((x + i, y + j)).or_insert(far);
                *known = far.min(*known);
            }
        }
    }
    let around = near.iter().filter(|(_, far)| **far >= AROUND.0);
    let around: Vec<f64> = around.filter_map(|(c, _)| heights.get(c)).copied().collect();
    if around.len() < FEWEST_AROUND {
        return None;
    }
    let level = median(&around)?;
    let off: Vec<f64> = around.iter().map(|h| (h - level).abs()).collect();
    let own: Vec<f64> = patch.iter().filter_map(|c| heights.get(c)).copied().collect();
    let height = median(&own)? - level;
    (median(&off)? < LEVEL * height).then_some(height)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(height: impl Fn(f64, f64) -> f64) -> BTreeMap<Cell, f64> {
        let cells = (-20..20).flat_map(|x| (-20..20).map(move |y| (x, y)));
        let of = |c: Cell| (c, height(f64::from(c.0) * CELL, f64::from(c.1) * CELL));
        cells.map(of).collect()
    }

    fn rises(heights: &BTreeMap<Cell, f64>) -> Vec<f64> {
        let raised = heights.iter().filter(|(_, h)| **h > LEAST).map(|(c, _)| *c).collect();
        let of = |p: &BTreeSet<Cell>| rise(p, heights);
        patches(raised).iter().filter_map(of).collect()
    }

    #[test]
    fn a_coin_rises_over_the_table_and_a_bulge_does_not() {
        let coin = table(|x, y| if x.hypot(y) < 0.012 { 0.002 } else { 0.0 });
        let found = rises(&coin);
        assert!(found.len() == 1 && (found[0] - 0.002).abs() < 1e-9, "{found:?}");
        let bulge = table(|x, y| 0.0012 - 0.2 * (x * x + y * y));
        assert!(rises(&bulge).iter().all(|h| *h < LEAST), "{:?}", rises(&bulge));
    }
}
