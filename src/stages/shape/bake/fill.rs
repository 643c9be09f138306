//! Colours for the spots of which no view is sure, from those of which some is.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::verb::{Shown, Spot};

/// Sure spots over which a filled one is averaged.
const AROUND: usize = 12;
/// How far a sure spot may be from one beside an edge that it speaks for, texels.
const BESIDE: f64 = 6.0;
/// Least cosine between their normals.
const ALIKE: f64 = 0.7;

/// The colour of every texel that has a spot; nothing where no view shows any of them. `pitch`: the edge of a texel, m.
pub fn fill(painted: &[Option<(Spot, Shown)>], pitch: f64) -> Option<Vec<Option<[u8; 3]>>> {
    let of = |wanted: fn(&Shown) -> Option<[f64; 3]>| -> Vec<(&Spot, [f64; 3])> {
        let each = painted.iter().flatten();
        each.filter_map(|(spot, shown)| Some((spot, wanted(shown)?))).collect()
    };
    let mut sure = of(|shown| match shown {
        Shown::Clear(color) => Some(*color),
        _ => None,
    });
    if sure.is_empty() {
        sure = of(|shown| match shown {
            Shown::Edge(color) => Some(*color),
            _ => None,
        });
    }
    let points: Vec<[f64; 3]> = sure.iter().map(|(spot, _)| spot.at.coords.into()).collect();
    let tree = ImmutableKdTree::new_from_slice(&points)
        .ok()
        .filter(|_| !points.is_empty())?;
    let around = |spot: &Spot| -> Vec<(f64, &(&Spot, [f64; 3]))> {
        let count = NonZero::new(AROUND.min(points.len())).unwrap_or(NonZero::<usize>::MIN);
        let at: [f64; 3] = spot.at.coords.into();
        let found = tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        let mut near: Vec<(f64, usize)> = found.iter().map(|n| (n.distance, n.item as usize)).collect();
        // Equally near ones come in the order of the image, whatever the tree's.
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(d, i)| (d, &sure[i])).collect()
    };
    let color = |spot: &Spot, shown: &Shown| match shown {
        Shown::Clear(color) => *color,
        Shown::Edge(color) => {
            let alike = around(spot)
                .into_iter()
                .filter(|(d, (other, _))| *d < (BESIDE * pitch).powi(2) && other.normal.dot(&spot.normal) > ALIKE);
            mean(alike, pitch).unwrap_or(*color)
        }
        Shown::Unseen => mean(around(spot).into_iter(), pitch).unwrap_or([128.0; 3]),
    };
    let image = painted.par_iter().map(|texel| {
        let (spot, shown) = texel.as_ref()?;
        Some(color(spot, shown).map(|c| c.round().clamp(0.0, 255.0) as u8))
    });
    Some(image.collect())
}

/// The mean colour, nearer ones counting more; nothing of nothing.
fn mean<'a>(near: impl Iterator<Item = (f64, &'a (&'a Spot, [f64; 3]))>, pitch: f64) -> Option<[f64; 3]> {
    let (mut sum, mut all) = ([0.0; 3], 0.0);
    for (squared, (_, color)) in near {
        let weight = 1.0 / (squared + pitch * pitch);
        all += weight;
        for k in 0..3 {
            sum[k] += weight * color[k];
        }
    }
    (all > 0.0).then(|| sum.map(|s| s / all))
}
