//! Where the cut through a mesh goes far inside of its hull: the notch of an L, the side of a handle.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use nalgebra::{Point2, Vector2};

/// Depth below the hull from which on a pocket is one, m: what is less may be the noise of a reconstructed surface.
const POCKET: f64 = 4e-3;
/// How far the outline of a pocket may be simplified, m.
const PLAIN: f64 = 5e-4;
/// Ends of cut triangles nearer than this are one, m.
const ONE: f64 = 1e-6;
/// Cuts of a body put together of plain parts at most: where there are more a surface was reconstructed, and is closed.
const PARTS: usize = 200;

type Key = (i64, i64);

fn key(p: &Point2<f64>) -> Key {
    ((p.x / ONE).round() as i64, (p.y / ONE).round() as i64)
}

/// The hull with its pockets cut out, counter-clockwise; the hull as it is where the cuts close no outline.
pub fn with_pockets(hull: Vec<Point2<f64>>, cuts: &[(Point2<f64>, Point2<f64>)]) -> Vec<Point2<f64>> {
    let Some(outline) = outline_from(&hull[0], cuts).or_else(|| around(&hull[0], cuts)) else {
        return hull;
    };
    let places: BTreeMap<Key, usize> = outline.iter().enumerate().map(|(i, p)| (key(p), i)).collect();
    let Some(at) = hull
        .iter()
        .map(|p| places.get(&key(p)).copied())
        .collect::<Option<Vec<usize>>>()
    else {
        return hull;
    };
    let n = outline.len();
    // Both begin at the same corner and go the same way round.
    if at.windows(2).any(|w| w[1] <= w[0]) {
        return hull;
    }
    let mut out = Vec::new();
    for (k, from) in at.iter().enumerate() {
        let to = at.get(k + 1).copied().unwrap_or(n);
        let stretch: Vec<Point2<f64>> = (*from..=to).map(|i| outline[i % n]).collect();
        out.push(stretch[0]);
        if farthest(&stretch).is_some_and(|f| f.1 > POCKET) {
            simplify(&stretch, &mut out);
        }
    }
    out
}

/// The closed outline through `start`, counter-clockwise from there.
fn outline_from(start: &Point2<f64>, cuts: &[(Point2<f64>, Point2<f64>)]) -> Option<Vec<Point2<f64>>> {
    let mut beside: BTreeMap<Key, Vec<Point2<f64>>> = BTreeMap::new();
    for (a, b) in cuts.iter().filter(|(a, b)| key(a) != key(b)) {
        beside.entry(key(a)).or_default().push(*b);
        beside.entry(key(b)).or_default().push(*a);
    }
    let first = key(start);
    let mut out = vec![*start];
    let (mut before, mut here) = (None, *start);
    while out.len() <= cuts.len() {
        let next = beside.get(&key(&here)).filter(|ways| ways.len() == 2)?;
        let next = *next.iter().find(|p| Some(key(p)) != before)?;
        if key(&next) == first {
            let area: f64 = (0..out.len())
                .map(|i| out[i].coords.perp(&out[(i + 1) % out.len()].coords))
                .sum();
            if area < 0.0 {
                out[1..].reverse();
            }
            return Some(out);
        }
        (before, here) = (Some(key(&here)), next);
        out.push(next);
    }
    None
}

/// The outline round everything that hangs together with `start`, the leftmost corner, counter-clockwise from there: of parts that touch
/// or overlap, as bodies are put together of boxes, what lies between them is no outline.
fn around(start: &Point2<f64>, cuts: &[(Point2<f64>, Point2<f64>)]) -> Option<Vec<Point2<f64>>> {
    if cuts.len() > PARTS {
        return None;
    }
    let ways = ways_of(cuts);
    let place = |k: &Key| ways.get(k).map(|w| w.0);
    let first = key(start);
    let (mut out, mut here, mut back) = (vec![place(&first)?], first, -Vector2::x());
    for _ in 0..2 * ways.len() {
        let at = place(&here)?;
        // As far to the right as can be: outside is to the right of who goes round counter-clockwise.
        let turn = |next: &Key| {
            let way = place(next).map_or(Vector2::x(), |p| p - at);
            let angle = back.perp(&way).atan2(back.dot(&way));
            if angle > 1e-9 { angle } else { angle + TAU }
        };
        let next = *ways.get(&here)?.1.iter().min_by(|a, b| turn(a).total_cmp(&turn(b)))?;
        if next == first {
            return (out.len() > 2).then_some(out);
        }
        let to = place(&next)?;
        (back, here) = (at - to, next);
        out.push(to);
    }
    None
}

/// Every place at which cuts end or cross, with those that one goes to from there along a cut.
fn ways_of(cuts: &[(Point2<f64>, Point2<f64>)]) -> BTreeMap<Key, (Point2<f64>, BTreeSet<Key>)> {
    // Ends that are one place are one point: roundings do not part them.
    let mut places: Vec<Point2<f64>> = Vec::new();
    let mut one = |p: &Point2<f64>| {
        let near = places.iter().find(|o| (*o - p).norm() < ONE).copied();
        near.unwrap_or_else(|| {
            places.push(*p);
            *p
        })
    };
    let cuts: Vec<(Point2<f64>, Point2<f64>)> = cuts.iter().map(|(a, b)| (one(a), one(b))).collect();
    let mut ways: BTreeMap<Key, (Point2<f64>, BTreeSet<Key>)> = BTreeMap::new();
    for (a, b) in cuts.iter().filter(|(a, b)| key(a) != key(b)) {
        let (way, length) = (b - a, (b - a).norm());
        let on = |p: &Point2<f64>| way.perp(&(p - a)).abs() < ONE * length && way.dot(&(p - a)) >= 0.0;
        let mut stops = vec![*a, *b];
        for (c, d) in &cuts {
            stops.extend([c, d].into_iter().filter(|p| on(p) && (*p - a).norm() <= length));
            let other = d - c;
            let across = way.perp(&other);
            let (s, t) = ((c - a).perp(&other) / across, (c - a).perp(&way) / across);
            if across.abs() > 1e-12 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                stops.push(one(&(a + way * s)));
            }
        }
        stops.sort_by(|p, q| (p - a).norm().total_cmp(&(q - a).norm()));
        for pair in stops.windows(2).filter(|w| key(&w[0]) != key(&w[1])) {
            for (p, q) in [(pair[0], pair[1]), (pair[1], pair[0])] {
                ways.entry(key(&p)).or_insert((p, BTreeSet::new())).1.insert(key(&q));
            }
        }
    }
    ways
}

/// Which point is farthest from the line between the ends, and by how much, m.
fn farthest(stretch: &[Point2<f64>]) -> Option<(usize, f64)> {
    let (first, last) = (stretch.first()?, stretch.last()?);
    let way = (last - first).try_normalize(1e-12)?;
    let away = |i: &usize| way.perp(&(stretch[*i] - first)).abs();
    let far = (1..stretch.len() - 1).max_by(|a, b| away(a).total_cmp(&away(b)))?;
    Some((far, away(&far)))
}

/// The points between the ends without those that a straight line does as well (Douglas and Peucker 1973).
fn simplify(stretch: &[Point2<f64>], out: &mut Vec<Point2<f64>>) {
    if let Some((far, _)) = farthest(stretch).filter(|f| f.1 > PLAIN) {
        simplify(&stretch[..=far], out);
        out.push(stretch[far]);
        simplify(&stretch[far..], out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn closed(corners: &[(f64, f64)]) -> Vec<(Point2<f64>, Point2<f64>)> {
        let at = |i: usize| Point2::new(corners[i % corners.len()].0, corners[i % corners.len()].1);
        // Every edge in two halves, in no order.
        let halves = (0..corners.len()).flat_map(|i| {
            let (a, b) = (at(i), at(i + 1));
            let middle = Point2::from((a.coords + b.coords) / 2.0);
            [(middle, b), (middle, a)]
        });
        halves.collect()
    }

    #[test]
    fn a_notch_is_kept_and_a_dent_is_not() {
        let corners = [
            (0.0, 0.0),
            (0.08, 0.0),
            (0.08, 0.02),
            (0.02, 0.02),
            (0.02, 0.06),
            (0.0, 0.06),
        ];
        let of = |k: usize| Point2::new(corners[k].0, corners[k].1);
        let hull = vec![of(0), of(1), of(2), of(4), of(5)];
        let out = with_pockets(hull.clone(), &closed(&corners));
        assert_eq!(out, [of(0), of(1), of(2), of(3), of(4), of(5)]);
        let mut dented = corners;
        dented[3] = (0.049, 0.039);
        assert_eq!(with_pockets(hull.clone(), &closed(&dented)), hull);
        assert_eq!(with_pockets(hull.clone(), &closed(&corners)[1..]), hull);
    }

    #[test]
    fn what_is_put_together_of_boxes_has_the_outline_of_all_of_them() {
        let rectangle = |[x0, x1, y0, y1]: [f64; 4]| closed(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]);
        let of = |x: f64, y: f64| Point2::new(x, y);
        let hull = vec![
            of(0.0, 0.0),
            of(0.08, 0.0),
            of(0.08, 0.02),
            of(0.02, 0.06),
            of(0.0, 0.06),
        ];
        let l = [hull[0], hull[1], hull[2], of(0.02, 0.02), hull[3], hull[4]];
        let beam = rectangle([0.0, 0.08, 0.0, 0.02]);
        // Beside each other, one into the other, and one all the way through.
        for from in [0.02, 0.01, 0.0] {
            let cuts = [beam.clone(), rectangle([0.0, 0.02, from, 0.06])].concat();
            assert_eq!(with_pockets(hull.clone(), &cuts), l, "from {from}");
        }
        // Two that stand apart have no outline but that about both.
        let cuts = [beam, rectangle([0.0, 0.02, 0.04, 0.06])].concat();
        assert_eq!(with_pockets(hull.clone(), &cuts), hull);
    }
}
