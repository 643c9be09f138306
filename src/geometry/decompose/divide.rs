//! Cutting, from the whole to many nearly convex pieces.

use nalgebra::Rotation3;
use rayon::prelude::*;

use super::piece::Piece;
use super::planes::candidates;
use crate::geometry::Plane;

/// Most pieces.
const MOST: usize = 72;
/// A piece whose hull exceeds it by less than this share of the whole shape is left alone.
const NEGLIGIBLE: f64 = 4e-4;
/// What a cut is worth that sets nearly convex matter free, as a share of that matter.
const FREED: f64 = 0.03;
/// Hulls within this share of their matter are nearly convex.
const CONVEX: f64 = 0.02;
/// A cut that takes away less than this share of the excess is chosen with a look at the next one.
const POOR: f64 = 0.08;
/// Candidates from which a look ahead is worth its time.
const AHEAD: usize = 6;

/// Cuts the piece whose hull exceeds it most, again and again, by the plane after which the least excess is left.
/// Crumbs below `crumb`, m³, are dropped.
pub(super) fn divide(whole: Piece, axes: &Rotation3<f64>, tolerance: f64) -> Vec<Piece> {
    let volume = whole.volume;
    let crumb = 1e-5 * volume;
    let mut open = vec![whole];
    let mut done = Vec::new();
    while !open.is_empty() && open.len() + done.len() < MOST {
        let worst = (0..open.len()).max_by(|a, b| open[*a].excess().total_cmp(&open[*b].excess()));
        let Some(piece) = worst.map(|i| open.swap_remove(i)) else {
            break;
        };
        if piece.excess() < NEGLIGIBLE * volume {
            done.push(piece);
            break;
        }
        match best_cut(&piece, axes, tolerance) {
            Some(pieces) => open.extend(pieces.into_iter().filter(|p| p.volume > crumb)),
            None => done.push(piece),
        }
    }
    done.extend(open);
    done
}

struct Trial {
    pieces: Vec<Piece>,
    cost: f64,
}

fn best_cut(piece: &Piece, axes: &Rotation3<f64>, tolerance: f64) -> Option<Vec<Piece>> {
    let planes = candidates(&piece.surface, axes, tolerance);
    let mut trials: Vec<Trial> = planes.par_iter().filter_map(|plane| trial(piece, plane)).collect();
    trials.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = trials.first()?;
    if best.cost > (1.0 - POOR) * piece.excess() {
        trials.truncate(AHEAD);
        let costs: Vec<f64> = trials.par_iter().map(|t| ahead(t, axes, tolerance)).collect();
        let best = (0..trials.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
        trials.swap(0, best);
    }
    trials.into_iter().next().map(|t| t.pieces)
}

fn trial(piece: &Piece, plane: &Plane) -> Option<Trial> {
    let pieces = piece.cut(plane);
    (pieces.len() > 1).then(|| Trial {
        cost: cost(&pieces),
        pieces,
    })
}

/// The excess that is left, less a bounty for matter that is done with.
fn cost(pieces: &[Piece]) -> f64 {
    let freed = pieces
        .iter()
        .filter(|p| p.excess() < CONVEX * p.volume)
        .map(|p| p.volume);
    pieces.iter().map(Piece::excess).sum::<f64>() - FREED * freed.sum::<f64>()
}

/// The cost after the worst piece of a trial was cut once more.
fn ahead(trial: &Trial, axes: &Rotation3<f64>, tolerance: f64) -> f64 {
    let worst = trial.pieces.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()));
    let Some(worst) = worst else { return trial.cost };
    let planes = candidates(&worst.surface, axes, tolerance);
    let next = planes.iter().step_by(2).filter_map(|p| self::trial(worst, p));
    let least = next.map(|t| t.cost).fold(f64::INFINITY, f64::min);
    trial.cost + (least - cost(std::slice::from_ref(worst))).min(0.0)
}
