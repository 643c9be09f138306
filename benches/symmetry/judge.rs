//! What was found beside what is true.

use std::fmt;

use nalgebra::{Isometry3, Point3, Vector3};
use palpate::twin::{Symmetry, SymmetryPlane};

use super::shapes::Thing;
use super::{angle, distance_to_line};

/// Beyond this a plane is another one, degrees and m.
const SAME: (f64, f64) = (4.0, 0.006);

/// One thing, judged.
#[derive(Clone, Debug, Default)]
pub struct Judged {
    pub planes: usize,
    pub true_planes: usize,
    pub false_planes: usize,
    /// Worst of the true planes that were found: degrees, mm.
    pub plane_error: (f64, f64),
    /// Degrees, mm, fold found.
    pub axis_error: Option<(f64, f64, u32)>,
    pub axis_missing: bool,
    pub center_error: Option<f64>,
    /// Errors over standard deviations: offsets, then two components of every normal.
    pub offset_scores: Vec<f64>,
    pub normal_scores: Vec<f64>,
}

/// Compares in the frame of the thing: `pose` is found-from-thing.
pub fn judge(thing: &Thing, found: &Symmetry, pose: &Isometry3<f64>) -> Judged {
    let normals: Vec<Vector3<f64>> = thing.planes.iter().map(|n| pose * n).collect();
    let center = pose * thing.center;
    let mut out = Judged {
        true_planes: normals.len(),
        ..Judged::default()
    };
    let mut used = vec![false; normals.len()];
    for plane in &found.planes {
        match matching(thing, plane, &normals, &center, pose) {
            Some((k, truth)) => {
                used[k] = true;
                out.add(plane, &truth, &center);
            }
            None => out.false_planes += 1,
        }
    }
    out.planes = used.iter().filter(|u| **u).count();
    if let Some((direction, fold)) = thing.axis {
        let direction = pose * direction;
        let right = found
            .axes
            .iter()
            .find(|a| a.fold == fold && angle(&a.direction.into(), &direction) < SAME.0);
        out.axis_missing = right.is_none();
        let any = right.or(found.axes.first());
        out.axis_error = any.map(|a| {
            let d = Vector3::from(a.direction);
            (
                angle(&d, &direction),
                1e3 * distance_to_line(&center, &a.point.into(), &d),
                a.fold,
            )
        });
    }
    if thing.ball {
        out.axis_missing = found.center.is_none();
        out.center_error = found
            .center
            .as_ref()
            .map(|c| 1e3 * (Point3::from(c.point) - center).norm());
    }
    out
}

/// The true plane that a found one is, with its normal. Any plane through the axis of a lathe, any through the centre
/// of a ball is true; it then counts as the one of the same place in the list.
fn matching(
    thing: &Thing,
    plane: &SymmetryPlane,
    normals: &[Vector3<f64>],
    center: &Point3<f64>,
    pose: &Isometry3<f64>,
) -> Option<(usize, Vector3<f64>)> {
    let n = Vector3::from(plane.normal);
    if (n.dot(&center.coords) - plane.offset).abs() > SAME.1 {
        return None;
    }
    if thing.ball {
        let nearest = (0..normals.len()).min_by(|a, b| angle(&n, &normals[*a]).total_cmp(&angle(&n, &normals[*b])))?;
        return Some((nearest, n));
    }
    if let Some((axis, 0)) = thing.axis {
        let d = pose * axis;
        if n.dot(&d).abs() < SAME.0.to_radians().sin() {
            let flat = (n - d * n.dot(&d)).normalize();
            let nearest = (0..2).max_by(|a, b| n.dot(&normals[*a]).abs().total_cmp(&n.dot(&normals[*b]).abs()))?;
            return Some((nearest, flat));
        }
    }
    let k = normals.iter().position(|t| angle(&n, t) < SAME.0)?;
    Some((k, normals[k]))
}

impl Judged {
    fn add(&mut self, plane: &SymmetryPlane, truth: &Vector3<f64>, center: &Point3<f64>) {
        let n = Vector3::from(plane.normal);
        let off = n.dot(&center.coords) - plane.offset;
        self.plane_error.0 = self.plane_error.0.max(angle(&n, truth));
        self.plane_error.1 = self.plane_error.1.max(1e3 * off.abs());
        let truth = truth * n.dot(truth).signum();
        if let (Some(sd), Some(normal_sd)) = (plane.offset_sd, plane.normal_sd) {
            // The offset at the frame's origin, where the interval is stated.
            let right = truth.dot(&center.coords);
            self.offset_scores.push((plane.offset - right) / sd.max(1e-12));
            for k in 0..3 {
                if k != n.iamax() && normal_sd[k] > 0.0 {
                    self.normal_scores.push((n[k] - truth[k]) / normal_sd[k]);
                }
            }
        }
    }
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{} false {}", self.planes, self.true_planes, self.false_planes)?;
        if self.planes > 0 {
            write!(f, "  plane {:.3}° {:.3} mm", self.plane_error.0, self.plane_error.1)?;
        }
        if let Some((degrees, mm, fold)) = self.axis_error {
            write!(f, "  axis {fold}: {degrees:.3}° {mm:.3} mm")?;
        }
        if let Some(mm) = self.center_error {
            write!(f, "  centre {mm:.3} mm")?;
        }
        if self.axis_missing {
            write!(f, "  AXIS OR CENTRE MISSING")?;
        }
        Ok(())
    }
}

/// Over all things.
#[derive(Default)]
pub struct Tally {
    rows: Vec<(String, Judged)>,
}

impl Tally {
    pub fn add(&mut self, name: &str, judged: Judged) {
        self.rows.push((name.into(), judged));
    }

    /// Shares within 1.96 standard deviations, and error over deviation (root mean square): of offsets, of normals.
    pub fn coverage(&self) -> [(f64, f64, usize); 2] {
        let share = |pick: fn(&Judged) -> &Vec<f64>| {
            let all: Vec<f64> = self.rows.iter().flat_map(|r| pick(&r.1).iter().copied()).collect();
            let held = all.iter().filter(|z| z.abs() < 1.96).count();
            let rms = (all.iter().map(|z| z * z).sum::<f64>() / all.len().max(1) as f64).sqrt();
            (held as f64 / all.len().max(1) as f64, rms, all.len())
        };
        [share(|j| &j.offset_scores), share(|j| &j.normal_scores)]
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = || self.rows.iter().map(|r| &r.1);
        let (found, truth) = (
            all().map(|j| j.planes).sum::<usize>(),
            all().map(|j| j.true_planes).sum::<usize>(),
        );
        let bare = || all().filter(|j| j.true_planes == 0);
        let worst = |pick: fn(&Judged) -> f64| all().map(pick).fold(0.0, f64::max);
        let axes = || all().filter(|j| !j.axis_missing).filter_map(|j| j.axis_error);
        writeln!(
            f,
            "planes found: {found} of {truth}; false on things that have some: {}",
            all()
                .filter(|j| j.true_planes > 0)
                .map(|j| j.false_planes)
                .sum::<usize>()
        )?;
        writeln!(
            f,
            "things without a plane: {}, of which one was claimed on {}",
            bare().count(),
            bare().filter(|j| j.false_planes > 0).count()
        )?;
        writeln!(
            f,
            "worst plane {:.3} degrees, {:.3} mm",
            worst(|j| j.plane_error.0),
            worst(|j| j.plane_error.1)
        )?;
        writeln!(
            f,
            "axes {} (missing {}), worst {:.3} degrees, {:.3} mm",
            axes().count(),
            all().filter(|j| j.axis_missing).count(),
            axes().map(|a| a.0).fold(0.0, f64::max),
            axes().map(|a| a.1).fold(0.0, f64::max)
        )?;
        let [offsets, normals] = self.coverage();
        write!(
            f,
            "95 % intervals hold: {:.1} % of {} offsets (error {:.2} sd rms), {:.1} % of {} components of normals ({:.2} sd rms)",
            100.0 * offsets.0,
            offsets.2,
            offsets.1,
            100.0 * normals.0,
            normals.2,
            normals.1
        )
    }
}
