//! The noise of a range camera from views of a still plane.
//!
//! `var z = floor² + (depth_sd z²)² + (stray dz/du)²`, with a part that does not depend on the range (time of flight,
//! rounding), one that grows with its square (triangulation; Khoshelham and Elberink 2012), and rays that stray sideways,
//! which tell the more the more steeply the plane is seen (Nguyen, Izadi and Lovell 2012). The variances are those of small
//! tiles about planes of their own, so that what bends the whole image is not taken for noise; they are fitted with
//! weights for their degrees of freedom, and doubted by leaving out one view at a time.

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

use super::fusion::raw_depth;
use super::lens::unproject;
use crate::base::{Error, Notices, Result, Seed, rng_for};
use crate::capture::{Camera, Capture, View};
use crate::geometry::Plane;
use crate::math::{mad_sd, median, t_quantile, weighted_linear};

/// Edge of a tile, pixels, and the share of its pixels that must be seen.
const TILE: usize = 12;
const SEEN: f64 = 0.8;
/// Points among which the plane is looked for, and how far from it they may be, as a share of the range.
const POINTS: usize = 4000;
const OFF: f64 = 0.012;
/// Share of the points that the plane must hold.
const HOLDS: f64 = 0.3;
/// Fewest tiles that tell a noise, and fewest views that tell its doubt.
const FEWEST: usize = 40;
const VIEWS: usize = 3;
/// Ratio of the farthest to the nearest range (5 to 95 %) from which the floor is told from what grows.
const SPREAD: f64 = 1.3;
/// Readings further off than this many standard deviations fly.
const FLIES: f64 = 4.5;

/// A number with its standard deviation and 95 % interval.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Term {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// 95 %.
    pub ci95: [f64; 2],
}

/// What is known of the noise of one range camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraNoise {
    /// Name of the camera.
    pub name: String,
    /// Noise at 1 m that grows with the square of the range, m: the `depth_sd` of a capture's camera.
    pub depth_sd: Term,
    /// Noise at any range beyond rounding, m; absent where the ranges are too alike to tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<Term>,
    /// How far rays stray sideways, pixels; absent where the plane was not seen at a slant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stray: Option<Term>,
    /// Ranges it rests on, m (5 and 95 %).
    pub range: [f64; 2],
    /// Angles between ray and normal it rests on, degrees (5 and 95 %).
    pub incidence: [f64; 2],
    /// Views it rests on.
    pub views: usize,
}

#[derive(Serialize)]
struct File<'a> {
    camera: &'a [CameraNoise],
}

/// As text of a file.
pub fn camera_noise_to_toml(found: &[CameraNoise]) -> Result<String> {
    toml::to_string(&File { camera: found }).map_err(|e| Error::Failed(format!("the noise of the camera: {e}")))
}

/// One tile of one view: variance about its own plane less that of rounding, m², and what it is held against.
struct Tile {
    view: usize,
    variance: f64,
    freedom: f64,
    range: f64,
    /// `(dz/du)² + (dz/dv)²`, m² per pixel².
    slant: f64,
    incidence: f64,
}

/// The noise of every camera of `capture` that saw a plane. Fails where none did.
pub fn camera_noise(capture: &Capture, notices: &mut Notices) -> Result<Vec<CameraNoise>> {
    let mut out = Vec::new();
    for (index, camera) in capture.cameras.iter().enumerate() {
        let views: Vec<&View> = capture.views.iter().filter(|v| v.camera == index).collect();
        let tiles: Vec<Tile> = views
            .iter()
            .enumerate()
            .flat_map(|(k, view)| tiles_of(camera, view, k))
            .collect();
        match noise_of(camera, &tiles, views.len()) {
            Some(found) => {
                if found.floor.is_none() {
                    notices.note(
                        "calibration",
                        &camera.name,
                        "seen from one distance only: what grows with the range is not told from what does not",
                    );
                }
                out.push(found);
            }
            None => notices.warn(
                "calibration",
                &camera.name,
                format!(
                    "no noise could be read: {} tiles of a plane in {} views",
                    tiles.len(),
                    views.len()
                ),
            ),
        }
    }
    if out.is_empty() {
        return Err(Error::Failed(format!(
            "{}: no camera saw a plane in {VIEWS} views or more; record views of a bare, still table from several \
             distances and angles",
            capture.name
        )));
    }
    Ok(out)
}

/// Tiles of the plane that fills most of the view.
fn tiles_of(camera: &Camera, view: &View, k: usize) -> Vec<Tile> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let point = |x: usize, y: usize| {
        let z = raw_depth(camera, &view.depth, x, y).filter(|z| (camera.depth_min..camera.depth_max).contains(z))?;
        let (u, v) = unproject(camera, x as f64, y as f64);
        Some(nalgebra::Point3::new(u * z, v * z, z))
    };
    let stride = ((width * height) as f64 / POINTS as f64).sqrt().ceil() as usize;
    let points: Vec<_> = (0..height)
        .step_by(stride)
        .flat_map(|y| (0..width).step_by(stride).map(move |x| (x, y)))
        .filter_map(|(x, y)| point(x, y))
        .collect();
    let Some(middle) = median(&points.iter().map(|p| p.z).collect::<Vec<_>>()) else {
        return Vec::new();
    };
    let mut dice = rng_for(Seed(0), "camera noise");
    let Some((plane, share)) = Plane::ransac(&points, OFF * middle, 400, &mut dice, |_| true) else {
        return Vec::new();
    };
    if share < HOLDS {
        return Vec::new();
    }
    let mut out = Vec::new();
    for top in (0..height.saturating_sub(TILE)).step_by(TILE) {
        for left in (0..width.saturating_sub(TILE)).step_by(TILE) {
            let inside = (0..TILE * TILE).filter_map(|i| {
                let (x, y) = (left + i % TILE, top + i / TILE);
                let p = point(x, y).filter(|p| plane.height(p).abs() < OFF * p.z)?;
                Some((x as f64 - left as f64, y as f64 - top as f64, p.z))
            });
            let seen: Vec<(f64, f64, f64)> = inside.collect();
            let (x, y) = ((left + TILE / 2) as f64, (top + TILE / 2) as f64);
            out.extend(tile(camera, &seen, &plane.normal, unproject(camera, x, y), k));
        }
    }
    out
}

/// Variance of readings `(column, row, z)` about a plane of their own, which is linear in inverse depth.
fn tile(
    camera: &Camera,
    seen: &[(f64, f64, f64)],
    normal: &Vector3<f64>,
    ray: (f64, f64),
    view: usize,
) -> Option<Tile> {
    if (seen.len() as f64) < SEEN * (TILE * TILE) as f64 {
        return None;
    }
    let design = |rows: &[(f64, f64, f64)]| DMatrix::from_fn(rows.len(), 3, |i, j| [1.0, rows[i].0, rows[i].1][j]);
    let solve = |rows: &[(f64, f64, f64)]| {
        let inverse = DVector::from_iterator(rows.len(), rows.iter().map(|r| 1.0 / r.2));
        weighted_linear(&design(rows), &inverse, &DVector::from_element(rows.len(), 1.0))
    };
    let range = median(&seen.iter().map(|r| r.2).collect::<Vec<_>>())?;
    let first = solve(seen)?;
    let usual = mad_sd(first.residuals.as_slice())?.max(1e-9);
    let kept: Vec<(f64, f64, f64)> = seen
        .iter()
        .zip(first.residuals.iter())
        .filter(|(_, r)| r.abs() < FLIES * usual)
        .map(|(row, _)| *row)
        .collect();
    let fit = solve(&kept)?;
    let freedom = kept.len() as f64 - 3.0;
    let rounding = camera.depth_unit.powi(2) / 12.0;
    let variance = fit.residuals.norm_squared() / freedom * range.powi(4) - rounding;
    let ray = Vector3::new(ray.0, ray.1, 1.0);
    let steep = range * range;
    Some(Tile {
        view,
        variance,
        freedom,
        range,
        slant: (fit.x[1] * steep).powi(2) + (fit.x[2] * steep).powi(2),
        incidence: (normal.dot(&ray).abs() / ray.norm()).min(1.0).acos().to_degrees(),
    })
}

fn noise_of(camera: &Camera, tiles: &[Tile], views: usize) -> Option<CameraNoise> {
    let mut seen: Vec<usize> = tiles.iter().map(|t| t.view).collect();
    seen.dedup();
    if tiles.len() < FEWEST || seen.len() < VIEWS {
        return None;
    }
    let between = |of: fn(&Tile) -> f64| {
        let values: Vec<f64> = tiles.iter().map(of).collect();
        Some([
            crate::math::quantile(&values, 0.05)?,
            crate::math::quantile(&values, 0.95)?,
        ])
    };
    let (range, incidence) = (between(|t| t.range)?, between(|t| t.incidence)?);
    let slant = between(|t| t.slant / t.range.powi(2))?;
    // Without spread the columns are alike, and the data say nothing of their shares.
    let told = [range[1] > SPREAD * range[0], true, slant[1] > 4.0 * slant[0].max(1e-9)];
    let all: Vec<&Tile> = tiles.iter().collect();
    let whole = terms(&all, told)?;
    let n = seen.len() as f64;
    let mut squares = [0.0; 3];
    for out in &seen {
        let rest: Vec<&Tile> = tiles.iter().filter(|t| t.view != *out).collect();
        let without = terms(&rest, told)?;
        for (k, sum) in squares.iter_mut().enumerate() {
            *sum += (without[k] - whole[k]).powi(2);
        }
    }
    let wide = t_quantile(0.975, n - 1.0);
    let term = |k: usize| {
        let sd = ((n - 1.0) / n * squares[k]).sqrt().max(2e-3 * whole[k]);
        Term {
            value: whole[k],
            sd,
            ci95: [(whole[k] - wide * sd).max(0.0), whole[k] + wide * sd],
        }
    };
    Some(CameraNoise {
        name: camera.name.clone(),
        depth_sd: term(1),
        floor: told[0].then(|| term(0)),
        stray: told[2].then(|| term(2)),
        range,
        incidence,
        views,
    })
}

/// Floor (m), depth noise at 1 m (m) and stray (pixels) by least squares of the variances, none negative, weighted by
/// what each tile's variance may scatter: twice its square over its degrees of freedom.
fn terms(tiles: &[&Tile], told: [bool; 3]) -> Option<[f64; 3]> {
    let column = |t: &Tile, k: usize| [1.0, t.range.powi(4), t.slant][k];
    let middle = median(&tiles.iter().map(|t| t.variance).collect::<Vec<_>>())?.max(1e-12);
    let mut used: Vec<usize> = (0..3).filter(|k| told[*k]).collect();
    let mut expected = vec![middle; tiles.len()];
    let mut found = [0.0; 3];
    for _ in 0..8 {
        // Columns differ by orders of magnitude: each is scaled to its mean.
        let mean = |k: usize| tiles.iter().map(|t| column(t, k)).sum::<f64>() / tiles.len() as f64;
        let scales = [0, 1, 2].map(|k| mean(k).max(1e-300));
        let weights = DVector::from_fn(tiles.len(), |i, _| {
            tiles[i].freedom / (2.0 * (expected[i] / middle).powi(2))
        });
        let right = DVector::from_fn(tiles.len(), |i, _| tiles[i].variance / middle);
        loop {
            let a = DMatrix::from_fn(tiles.len(), used.len(), |i, j| {
                column(tiles[i], used[j]) / scales[used[j]]
            });
            let fit = weighted_linear(&a, &right, &weights)?;
            let worst = (0..used.len()).min_by(|i, j| fit.x[*i].total_cmp(&fit.x[*j]))?;
            if fit.x[worst] >= 0.0 || used.len() == 1 {
                found = [0.0; 3];
                for (j, k) in used.iter().enumerate() {
                    found[*k] = (fit.x[j] * middle / scales[*k]).max(0.0);
                }
                break;
            }
            used.remove(worst);
        }
        for (e, t) in expected.iter_mut().zip(tiles) {
            *e = (0..3).map(|k| found[k] * column(t, k)).sum::<f64>().max(0.05 * middle);
        }
    }
    Some(found.map(f64::sqrt))
}
