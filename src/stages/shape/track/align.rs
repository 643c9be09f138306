//! Aligns a surface to one depth image: robust point-to-plane registration with an honest covariance.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

use super::picture::{Picture, Pixel, Verdict};
use super::surfels::Surfels;

/// Distances in which a pixel is matched with the surface, m, one round after the other.
const BANDS: [f64; 3] = [0.014, 0.006, 0.003];
/// Most steps of one round.
const STEPS: usize = 8;
/// A direction in which the surface constrains less than this share of the weight is not seen: a cylinder's spin, a
/// plane's shift along itself. Smoothed normals of a fused surface stray by 2 to 3 degrees, which feigns up to 0.002.
const WEAK: f64 = 0.003;
/// Standard deviation that is given to such a direction, m (turns at the radius of the body).
const UNSEEN_SD: f64 = 0.05;
/// Pixels that an alignment needs.
const LEAST_PIXELS: usize = 40;
/// Neighbouring residuals err together: patches of this edge count as one, m.
const PATCH: f64 = 0.010;
/// Error of a fused surface that a whole face shares, m.
const SHAPE_SD: f64 = 1.5e-4;

/// A pose that was found, and how sure it is.
#[derive(Clone, Debug)]
pub struct Fit {
    /// World-from-body.
    pub pose: Isometry3<f64>,
    /// Of a small shift of the body's origin (m) and a small turn (rad), world axes.
    pub covariance: Matrix6<f64>,
    /// Directions of motion that the image did not constrain.
    pub unseen: usize,
    /// Share of the surface expected in view that is there.
    pub support: f64,
    /// Points of the surface that are there.
    pub matched: usize,
}

/// Sums of a weighted least squares problem in the six small motions about the middle of the body.
struct Normal {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    weight: f64,
    pixels: usize,
}

/// A pixel that is matched: derivative of its residual, residual, weight.
fn matched(
    pixel: &Pixel,
    model: &Surfels,
    pose: &Isometry3<f64>,
    band: f64,
) -> Option<(Vector6<f64>, f64, f64, Point3<f64>)> {
    let q = pose.inverse_transform_point(&pixel.point);
    let (i, r) = model.within(&q, band)?;
    let n = model.normals[i];
    if n.dot(&pose.rotation.inverse_transform_vector(&pixel.normal)) < 0.75 {
        return None;
    }
    // Geman and McClure's estimator.
    let scale = (3.0 * pixel.sd).max(0.25 * band);
    let robust = scale * scale / (scale * scale + r * r);
    let w = robust * robust / (pixel.sd * pixel.sd);
    let lever = (q - model.center).cross(&n) / model.radius;
    Some((Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z), r, w, q))
}

fn gather(pixels: &[Pixel], model: &Surfels, pose: &Isometry3<f64>, band: f64) -> Normal {
    let mut sums = Normal {
        information: Matrix6::zeros(),
        gradient: Vector6::zeros(),
        weight: 0.0,
        pixels: 0,
    };
    for (j, r, w, _) in pixels.iter().filter_map(|p| matched(p, model, pose, band)) {
        sums.information.ger(w, &j, &j, 1.0);
        sums.gradient.axpy(w * r, &j, 1.0);
        sums.weight += w;
        sums.pixels += 1;
    }
    sums
}

/// The inverse of the information without its weak directions, and those directions.
fn inverse(sums: &Normal) -> (Matrix6<f64>, Vec<Vector6<f64>>) {
    let eigen = sums.information.symmetric_eigen();
    let mut out = Matrix6::zeros();
    let mut weak = Vec::new();
    for k in 0..6 {
        let direction: Vector6<f64> = eigen.eigenvectors.column(k).into_owned();
        if eigen.eigenvalues[k] < WEAK * sums.weight {
            weak.push(direction);
        } else {
            out.ger(1.0 / eigen.eigenvalues[k], &direction, &direction, 1.0);
        }
    }
    (out, weak)
}

/// The pose moved by a small motion about the body's middle, turns in units of its radius.
fn moved(pose: &Isometry3<f64>, model: &Surfels, step: &Vector6<f64>) -> Isometry3<f64> {
    let shift = Vector3::new(step[0], step[1], step[2]);
    let turn = Vector3::new(step[3], step[4], step[5]) / model.radius;
    let center = Translation3::from(model.center.coords);
    let small = Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
    let mut moved = pose * (center * small * center.inverse());
    moved.rotation.renormalize();
    moved
}

/// Aligns the surface to the pixels from a start; nothing where too few pixels match.
pub fn align(pixels: &[Pixel], model: &Surfels, start: &Isometry3<f64>) -> Option<Fit> {
    let mut pose = *start;
    for band in BANDS {
        for _ in 0..STEPS {
            let sums = gather(pixels, model, &pose, band);
            if sums.pixels < LEAST_PIXELS {
                break;
            }
            let step = inverse(&sums).0 * sums.gradient;
            pose = moved(&pose, model, &step);
            if step.norm() < 2e-5 {
                break;
            }
        }
    }
    let sums = gather(pixels, model, &pose, BANDS[2]);
    if sums.pixels < LEAST_PIXELS {
        return None;
    }
    let (spread, weak) = inverse(&sums);
    Some(Fit {
        covariance: in_world(&covariance(pixels, model, &pose, &sums, &spread, &weak), model, &pose),
        pose,
        unseen: weak.len(),
        support: 0.0,
        matched: 0,
    })
}

/// Liang and Zeger's sandwich (1986) over patches of the surface, with the shape's own error and the unseen directions.
fn covariance(
    pixels: &[Pixel],
    model: &Surfels,
    pose: &Isometry3<f64>,
    sums: &Normal,
    spread: &Matrix6<f64>,
    weak: &[Vector6<f64>],
) -> Matrix6<f64> {
    let mut patches: BTreeMap<[i32; 3], Vector6<f64>> = BTreeMap::new();
    for (j, r, w, q) in pixels.iter().filter_map(|p| matched(p, model, pose, BANDS[2])) {
        let key = [q.x, q.y, q.z].map(|x| (x / PATCH).floor() as i32);
        *patches.entry(key).or_insert_with(Vector6::zeros) += j * (w * r);
    }
    let mut meat = sums.information;
    for g in patches.values() {
        meat.ger(1.0, g, g, 1.0);
    }
    let shape = SHAPE_SD * SHAPE_SD * sums.weight;
    let mut out = spread * meat * spread + spread * shape;
    for direction in weak {
        out.ger(UNSEEN_SD * UNSEEN_SD, direction, direction, 1.0);
    }
    out
}

/// From small motions about the middle, body axes, to those of the origin, world axes.
fn in_world(covariance: &Matrix6<f64>, model: &Surfels, pose: &Isometry3<f64>) -> Matrix6<f64> {
    let r = pose.rotation.to_rotation_matrix().into_inner();
    let lever: Matrix3<f64> = model.center.coords.cross_matrix();
    let mut a = Matrix6::zeros();
    a.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    a.fixed_view_mut::<3, 3>(0, 3).copy_from(&(r * lever / model.radius));
    a.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r / model.radius));
    a * covariance * a.transpose()
}

/// How the image judges every `stride`-th point of the surface that faces the camera.
pub fn verdicts(picture: &Picture, model: &Surfels, pose: &Isometry3<f64>, stride: usize) -> [usize; 4] {
    let mut counts = [0; 4];
    for i in (0..model.points.len()).step_by(stride.max(1)) {
        let (p, n) = (pose * model.points[i], pose.rotation * model.normals[i]);
        let ray = (p - picture.eye()).normalize();
        if -ray.dot(&n) < 0.25 {
            continue;
        }
        counts[match picture.judge(&p, &n, 0.002) {
            Verdict::There => 0,
            Verdict::Through => 1,
            Verdict::Hidden => 2,
            Verdict::Unknown => 3,
        }] += 1;
    }
    counts
}
