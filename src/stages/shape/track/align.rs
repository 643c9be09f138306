//! Aligns a surface to one depth image: robust point-to-plane registration with an honest covariance.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

use super::contour::{Rim, rims};
use super::picture::{Picture, Pixel, Verdict};
use super::surfels::Surfels;

/// Distances in which a pixel is matched with the surface, m, one round after the other.
const BANDS: [f64; 3] = [0.014, 0.006, 0.003];
/// How far from where it should be the outline is looked for in each round, pixels; it is drawn anew where that is given.
const REACHES: [Option<f64>; 3] = [Some(8.0), Some(3.0), None];
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
const SHAPE_SD: f64 = 2.0e-4;
/// Error that a side of the outline shares, over that of one place of it: pixels cut a straight edge all alike.
const EDGE_SHARED: f64 = 0.8;
/// Directions that are told apart as faces, per unit of the normal.
const FACES: f64 = 1.5;

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

impl Fit {
    /// Points that are there less those that the camera saw through: a surface that slides along itself, with a face
    /// that moves, matches its neighbours' readings but reaches into free space.
    pub fn score(&self) -> f64 {
        let through = self.matched as f64 * (1.0 / self.support.max(1e-3) - 1.0);
        self.matched as f64 - through
    }
}

/// Sums of a weighted least squares problem in the six small motions about the middle of the body.
struct Normal {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    weight: f64,
    pixels: usize,
}

/// Something in the image that is matched with the surface.
struct Match {
    /// Derivative of the residual by the six small motions.
    slope: Vector6<f64>,
    /// m.
    residual: f64,
    weight: f64,
    /// Standard deviation of what it errs by together with its face or side, m.
    shared: f64,
    /// Whether it is of the outline.
    rim: bool,
    /// Body frame.
    place: Point3<f64>,
}

impl Match {
    /// With the weight of Geman and McClure's estimator.
    fn new(model: &Surfels, (q, n): (&Point3<f64>, &Vector3<f64>), residual: f64, sd: f64, band: f64) -> Self {
        let scale = (3.0 * sd).max(0.25 * band);
        let robust = scale * scale / (scale * scale + residual * residual);
        let lever = (q - model.center).cross(n) / model.radius;
        Self {
            slope: Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z),
            residual,
            weight: robust * robust / (sd * sd),
            shared: SHAPE_SD,
            rim: false,
            place: *q,
        }
    }
}

/// A pixel against the plane of the nearest surfel.
fn matched(pixel: &Pixel, model: &Surfels, pose: &Isometry3<f64>, band: f64) -> Option<Match> {
    let q = pose.inverse_transform_point(&pixel.point);
    let (i, r) = model.within(&q, band)?;
    let n = model.normals[i];
    if n.dot(&pose.rotation.inverse_transform_vector(&pixel.normal)) < 0.75 {
        return None;
    }
    Some(Match::new(model, (&q, &n), r, pixel.sd, band))
}

/// A place of the outline, as a pixel is.
fn outlined(rim: &Rim, model: &Surfels, pose: &Isometry3<f64>, band: f64) -> Option<Match> {
    let r = rim.normal.dot(&(rim.target - pose * rim.on_body));
    let n = pose.rotation.inverse_transform_vector(&rim.normal);
    (r.abs() < band).then(|| Match {
        shared: EDGE_SHARED * rim.sd,
        rim: true,
        ..Match::new(model, (&rim.on_body, &n), r, rim.sd, band)
    })
}

/// Everything in an image that a surface is compared with.
#[derive(Clone, Copy)]
struct Evidence<'a> {
    pixels: &'a [Pixel],
    rims: &'a [Rim],
}

impl Evidence<'_> {
    fn matches(&self, model: &Surfels, pose: &Isometry3<f64>, band: f64) -> impl Iterator<Item = Match> {
        let pixels = self.pixels.iter().filter_map(move |p| matched(p, model, pose, band));
        let rims = self.rims.iter().filter_map(move |r| outlined(r, model, pose, band));
        pixels.chain(rims)
    }
}

fn gather(evidence: Evidence, model: &Surfels, pose: &Isometry3<f64>, band: f64) -> Normal {
    let mut sums = Normal {
        information: Matrix6::zeros(),
        gradient: Vector6::zeros(),
        weight: 0.0,
        pixels: 0,
    };
    for m in evidence.matches(model, pose, band) {
        sums.information.ger(m.weight, &m.slope, &m.slope, 1.0);
        sums.gradient.axpy(m.weight * m.residual, &m.slope, 1.0);
        sums.weight += m.weight;
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

/// Aligns the surface to an image from a start: to the `pixels` that may be its own, and to its outline where the
/// readings inside are `mine`. Nothing where too little matches.
pub fn align(
    picture: &Picture,
    pixels: &[Pixel],
    mine: &impl Fn(&Point3<f64>) -> bool,
    model: &Surfels,
    start: &Isometry3<f64>,
) -> Option<Fit> {
    let mut pose = *start;
    let mut outline = Vec::new();
    for (band, reach) in BANDS.into_iter().zip(REACHES) {
        if let Some(reach) = reach {
            outline = rims(picture, model, &pose, reach, mine);
        }
        let evidence = Evidence { pixels, rims: &outline };
        for _ in 0..STEPS {
            let sums = gather(evidence, model, &pose, band);
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
    let evidence = Evidence { pixels, rims: &outline };
    let sums = gather(evidence, model, &pose, BANDS[2]);
    if sums.pixels < LEAST_PIXELS {
        return None;
    }
    let (spread, weak) = inverse(&sums);
    Some(Fit {
        covariance: in_world(&covariance(evidence, model, &pose, &sums, &spread, &weak), model, &pose),
        pose,
        unseen: weak.len(),
        support: 0.0,
        matched: 0,
    })
}

/// Liang and Zeger's sandwich (1986) over patches of the surface, with the shape's own error and the unseen directions.
fn covariance(
    evidence: Evidence,
    model: &Surfels,
    pose: &Isometry3<f64>,
    sums: &Normal,
    spread: &Matrix6<f64>,
    weak: &[Vector6<f64>],
) -> Matrix6<f64> {
    let mut patches: BTreeMap<[i32; 3], Vector6<f64>> = BTreeMap::new();
    let mut faces: BTreeMap<(bool, [i32; 3]), [Vector6<f64>; 2]> = BTreeMap::new();
    for m in evidence.matches(model, pose, BANDS[2]) {
        let key = [m.place.x, m.place.y, m.place.z].map(|x| (x / PATCH).floor() as i32);
        *patches.entry(key).or_insert_with(Vector6::zeros) += m.slope * (m.weight * m.residual);
        let face = [m.slope[0], m.slope[1], m.slope[2]].map(|x| (x * FACES).round() as i32);
        let [known, left] = faces.entry((m.rim, face)).or_insert_with(|| [Vector6::zeros(); 2]);
        *known += m.slope * (m.weight * m.shared);
        *left += m.slope * (m.weight * m.residual);
    }
    let mut meat = sums.information;
    for g in patches.values().chain(faces.values().flatten()) {
        meat.ger(1.0, g, g, 1.0);
    }
    let mut out = spread * meat * spread;
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
