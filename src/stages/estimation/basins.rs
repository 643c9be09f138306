//! Where the starts of a fit of mass and friction ended: the basins, and what of them is said.

use crate::math::Fit;

/// Iterations after which the best of several starts is chosen, and those of the best after that.
pub(super) const FIRST: usize = 8;
const LAST: usize = 40;
/// Logarithm by which mass or friction of two fits may differ and be one.
const APART: f64 = 0.05;

/// Where starts of a fit ended that lie together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Basin {
    /// kg.
    pub mass: f64,
    /// N.
    pub friction: f64,
    pub starts: usize,
    /// Misfit over that of the best basin.
    pub misfit: f64,
}

/// Whether mass or friction of two fits, whose logarithms come first, differ.
fn apart(a: &Fit, b: &Fit) -> bool {
    (0..2).any(|k| (a.x[k] - b.x[k]).abs() > APART)
}

/// The best of what several starts came to, fitted to the end, and the basins that they are in.
pub(super) fn polished(mut fits: Vec<Fit>, again: impl Fn(&Fit, usize) -> Option<Fit>) -> Option<(Fit, Vec<Basin>)> {
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = again(fits.first()?, LAST)?;
    if !best.x.iter().all(|v| v.is_finite()) {
        return None;
    }
    // A start that is elsewhere still may only be slow.
    let others = fits.iter().skip(1).map(|other| match apart(&best, other) {
        true => again(other, FIRST).unwrap_or_else(|| other.clone()),
        false => best.clone(),
    });
    let all: Vec<Fit> = std::iter::once(best.clone()).chain(others).collect();
    Some((best, basins_of(&all)))
}

/// The basins that the fits ended in, the best (the first fit's) first.
fn basins_of(fits: &[Fit]) -> Vec<Basin> {
    let mut found: Vec<(&Fit, usize)> = Vec::new();
    for fit in fits {
        match found.iter_mut().find(|(f, _)| !apart(f, fit)) {
            Some((_, starts)) => *starts += 1,
            None => found.push((fit, 1)),
        }
    }
    let least = fits.first().map_or(1.0, |f| f.cost.max(1e-12));
    let basin = |(fit, starts): (&Fit, usize)| Basin {
        mass: fit.x[0].exp(),
        friction: fit.x[1].exp(),
        starts,
        misfit: fit.cost / least,
    };
    found.into_iter().map(basin).collect()
}

/// What became of the starts of the fits of fast pushes, in words; nothing where there were none.
pub(super) fn told_of_basins(pushes: &[(String, Vec<Basin>)]) -> Option<String> {
    let of = pushes
        .iter()
        .map(|(_, b)| b.iter().map(|b| b.starts).sum::<usize>())
        .max()?;
    let several: Vec<String> = pushes
        .iter()
        .filter(|(_, basins)| basins.len() > 1)
        .map(|(name, basins)| {
            let each = basins.iter().map(|b| {
                let (s, m, f) = (b.starts, b.mass, b.friction);
                format!("{m:.3} kg and {f:.2} N from {s}, misfit {:.3} of the least", b.misfit)
            });
            format!("`{name}`: {}", each.collect::<Vec<_>>().join("; "))
        })
        .collect();
    let n = pushes.len();
    Some(if several.is_empty() {
        format!("fast pushes were fitted from {of} starts each: one basin in each of {n}")
    } else {
        let words = several.join(". ");
        format!(
            "fast pushes were fitted from {of} starts each: more than one basin in {} of {n}, the first is taken. {words}",
            several.len()
        )
    })
}
