//! Things without a name that touch, or stand so near that they were taken for one: told apart where both stand on the
//! support and differ in colour across a gap or an inward fold. Less than that is as well one thing of several colours (a mug
//! with a painted handle, a car on its wheels): it stays one, and a notice says so.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::discover::Thing;
use super::seams::{LEAST_AREA, described, large_patches, of_vertices};
use super::split::Cells;
use crate::base::Notices;
use crate::geometry::{Mesh, UnionFind, number_sets, submesh};

/// Tints farther apart than this are different colours, in units of 8 bits of chromaticity.
pub const UNLIKE: f64 = 25.0;
/// Opening of the surface, the difference of the normals along the way, beyond which it folds inwards.
const INWARDS: f64 = -0.25;
/// Share of a border that folds inwards, where two things meet, and where they may.
const LEAST_FOLDED: f64 = 0.3;
const PERHAPS_FOLDED: f64 = 0.1;
/// Band on either side of a border over which its fold is taken, voxels.
const BAND: f64 = 5.0;
/// A thing stands where it reaches this near to the height at which the support begins, voxels: nobody sees a ball's foot.
const STANDS: f64 = 6.0;
/// Vertices that reach so far down at least.
const FOOT: usize = 8;

/// Every thing that at most one name belongs to, cut where that is clear.
pub fn part_by_colour(things: Vec<Thing>, (voxel, floor): (f64, f64), notices: &mut Notices) -> Vec<Thing> {
    let mut out = Vec::new();
    for thing in things {
        let plain = thing.surface.colors.is_empty() || thing.named.len() > 1 || !floor.is_finite();
        if plain {
            out.push(thing);
            continue;
        }
        // Where the scene is large its surface is coarser than the voxels of the things.
        let coarse = (thing.surface.area() / thing.surface.vertices.len().max(1) as f64).sqrt();
        let (group, count, doubtful) = groups(&thing.surface, voxel.max(coarse), floor);
        let parts = cut(&thing.surface, &group, count);
        let small = parts.iter().any(|p| p.area() < LEAST_AREA);
        let homes: Vec<usize> = (0..parts.len()).filter(|k| is_home(&parts[*k], &thing.named)).collect();
        let homeless = !thing.named.is_empty() && homes.len() != 1;
        if parts.len() < 2 || small || homeless {
            if doubtful || parts.len() > 1 {
                let about = thing.named.first().map_or("views", |(n, _)| n.as_str());
                let words =
                    "several colours stand in one body, with folds between them: it may be several things that touch";
                notices.note("shape", about, words);
            }
            out.push(thing);
            continue;
        }
        let words = format!(
            "{} things that stand side by side are told apart by colour",
            parts.len()
        );
        notices.note("shape", "views", words);
        if doubtful {
            let words =
                "beside what was told apart, several colours stand in one body: it may be several things that touch";
            notices.note("shape", "views", words);
        }
        let mut named = Some(thing.named);
        for (k, surface) in parts.into_iter().enumerate() {
            let own = if homes.first() == Some(&k) { named.take() } else { None };
            out.push(Thing {
                surface,
                named: own.unwrap_or_default(),
            });
        }
    }
    out
}

fn cut(surface: &Mesh, group: &[u32], count: usize) -> Vec<Mesh> {
    let of = |g: u32| submesh(surface, |t| group[surface.triangles[t][0] as usize] == g).0;
    (0..count as u32).map(of).collect()
}

/// True where the frame of the name lies in the box around a part, down to the support.
fn is_home(part: &Mesh, named: &[(String, Point3<f64>)]) -> bool {
    let Some((low, high)) = part.bounds() else { return false };
    let within = |p: &Point3<f64>| (0..3).all(|k| p[k] <= high[k] && (k == 2 || p[k] >= low[k]));
    named.iter().any(|(_, p)| within(p))
}

/// The group of every vertex, their number, and whether any holds colours across an inward fold.
fn groups(surface: &Mesh, voxel: f64, floor: f64) -> (Vec<u32>, usize, bool) {
    let cells = Cells::new(surface, 2.0 * voxel);
    let borders = cells.borders(surface);
    let (patch, count) = large_patches(surface, &cells, &borders);
    let all = described(surface, &of_vertices(&cells, &patch), count, floor + STANDS * voxel);
    let folds = folds(&cells, &borders, &patch, BAND * voxel);
    let mut sets = UnionFind::new(count);
    let mut doubtful = false;
    // What is of one colour anywhere in the lump, or meets without a fold, is one.
    for a in 0..count {
        for b in a + 1..count {
            let fold = folds.get(&(a, b));
            let alike = (all[a].tint - all[b].tint).norm() < UNLIKE;
            if alike || fold.is_some_and(|f| *f < LEAST_FOLDED) {
                sets.union(a as u32, b as u32);
                doubtful |= !alike && fold.is_some_and(|f| *f > PERHAPS_FOLDED);
            }
        }
    }
    let (clear, parts) = number_sets(&mut sets, count);
    let foot = |g: u32| -> usize { (0..count).filter(|k| clear[*k] == g).map(|k| all[k].foot).sum() };
    let hanging: BTreeSet<u32> = (0..parts as u32).filter(|g| foot(*g) < FOOT).collect();
    for (a, b) in folds.keys() {
        if clear[*a] != clear[*b] && (hanging.contains(&clear[*a]) || hanging.contains(&clear[*b])) {
            sets.union(*a as u32, *b as u32);
            doubtful = true;
        }
    }
    // What hangs and touches nothing belongs to what is nearest.
    for k in (0..count).filter(|k| hanging.contains(&clear[*k])) {
        let touches = folds.keys().any(|(a, b)| *a == k || *b == k);
        let far = |j: &usize| (all[*j].middle - all[k].middle).norm();
        let others = (0..count).filter(|j| clear[*j] != clear[k] && !touches);
        if let Some(host) = others.min_by(|a, b| far(a).total_cmp(&far(b))) {
            sets.union(k as u32, host as u32);
        }
    }
    let (group, number) = number_sets(&mut sets, count);
    let of_vertex = cells.of_vertex.iter().map(|c| group[patch[*c as usize]]);
    (of_vertex.collect(), number, doubtful)
}

/// The share of the border of every two patches that meet along which the surface folds inwards, from the cells of either
/// within a `band` of it: the fused surface rounds a crease off.
fn folds(cells: &Cells, borders: &[(f64, u32, u32)], patch: &[usize], band: f64) -> BTreeMap<(usize, usize), f64> {
    let side = |at: &Point3<f64>, own: usize| {
        let near = (0..patch.len()).filter(|c| patch[*c] == own && (cells.middle[*c] - at).norm() < band);
        let (sum, place, n) = near.fold((Vector3::zeros(), Vector3::zeros(), 0.0), |s, c| {
            (s.0 + cells.normal[c], s.1 + cells.middle[c].coords, s.2 + 1.0)
        });
        (sum / f64::max(n, 1.0), place / f64::max(n, 1.0))
    };
    let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
    for (_, a, b) in borders {
        let (x, y) = (patch[*a as usize], patch[*b as usize]);
        if x != y {
            let at = nalgebra::center(&cells.middle[*a as usize], &cells.middle[*b as usize]);
            let ((n, p), (m, q)) = (side(&at, x), side(&at, y));
            let opening = (m - n).dot(&(q - p)) / (q - p).norm().max(1e-9);
            let sum = sums.entry((x.min(y), x.max(y))).or_insert((0.0, 0.0));
            *sum = (sum.0 + f64::from(u8::from(opening < INWARDS)), sum.1 + 1.0);
        }
    }
    sums.into_iter().map(|(pair, (sum, n))| (pair, sum / n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::{cuboid, subdivided};

    const VOXEL: f64 = 0.002;
    const RED: [u8; 3] = [200, 60, 50];
    const BLUE: [u8; 3] = [60, 90, 200];

    /// The open surface of boxes in the frame of the support, each of a colour.
    fn lump(boxes: &[([f64; 3], [f64; 3], [u8; 3])]) -> Thing {
        let mut surface = Mesh::default();
        for (size, at, color) in boxes {
            let mut mesh = cuboid(*size);
            for _ in 0..5 {
                mesh = subdivided(&mesh);
            }
            mesh.vertices.iter_mut().for_each(|p| *p += Vector3::from(*at));
            mesh.colors = vec![*color; mesh.vertices.len()];
            let above = |t: usize| mesh.corners(t).iter().all(|p| p.z > 0.003);
            surface.append(&submesh(&mesh, above).0);
        }
        Thing {
            surface,
            named: Vec::new(),
        }
    }

    fn parts(thing: Thing) -> (usize, Notices) {
        let mut notices = Notices::default();
        let parts = part_by_colour(vec![thing], (VOXEL, 0.003), &mut notices);
        (parts.len(), notices)
    }

    #[test]
    fn what_stands_side_by_side_in_two_colours_is_two_things() {
        let size = [0.04, 0.04, 0.04];
        let one = ([0.0, 0.0, 0.02], RED);
        let pair = |color| lump(&[(size, one.0, one.1), (size, [0.044, 0.005, 0.02], color)]);
        assert_eq!(parts(pair(BLUE)).0, 2);
        assert_eq!(parts(pair(RED)).0, 1);
    }

    #[test]
    fn what_lies_on_another_stays_with_it() {
        let low = ([0.08, 0.08, 0.04], [0.0, 0.0, 0.02], RED);
        let top = ([0.04, 0.04, 0.03], [0.0, 0.0, 0.055], BLUE);
        assert_eq!(parts(lump(&[low, top])).0, 1);
    }

    #[test]
    fn a_name_goes_to_the_part_that_its_frame_lies_in() {
        let size = [0.04, 0.04, 0.04];
        let mut both = lump(&[(size, [0.0, 0.0, 0.02], RED), (size, [0.044, 0.005, 0.02], BLUE)]);
        both.named = vec![("cup".into(), Point3::new(0.05, 0.0, 0.0))];
        let found = part_by_colour(vec![both], (VOXEL, 0.003), &mut Notices::default());
        assert_eq!(found.len(), 2);
        let named: Vec<f64> = found
            .iter()
            .filter(|t| !t.named.is_empty())
            .map(|t| t.bounds().0.x)
            .collect();
        assert!(named.len() == 1 && named[0] > 0.02, "{named:?}");
    }
}
