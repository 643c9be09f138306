//! What a link stands on: where its friction acts, how strong it is and how it resists turning.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix2, Point2, Vector2};

use super::Footprint;
use super::limit_surface::gathered;
use super::riders::riders;
use super::underside::{lowest, underside};
use crate::base::Pose;
use crate::geometry::Mesh;
use crate::twin::{Link, Model};

/// Where a link rubs on the table.
#[derive(Clone, Debug)]
pub struct Foot {
    /// Kinetic friction force, N.
    pub force: f64,
    /// Friction torque over friction force, m.
    pub radius: f64,
    /// Centre of friction, plane frame at the start.
    pub centre: Point2<f64>,
    /// Speed below which its friction is viscous, m/s.
    pub creep: f64,
    /// The same over the speed of the tool, beside it.
    pub creep_ratio: f64,
    /// Mass that it carries, kg, as far as it is known.
    pub mass: Option<f64>,
    /// What it stands on, along the normal, m.
    pub ground: f64,
    /// What it stands on.
    pub(super) under: Option<Arc<Under>>,
}

/// A footprint as points with their shares of its area (plane frame at the start), finely and in cells, its corners with theirs
/// of all that it turns there, and the mean distances of both from the centre of friction, m.
#[derive(Clone, Debug)]
pub(super) struct Under {
    points: Vec<(Point2<f64>, f64)>,
    cells: Vec<(Point2<f64>, f64)>,
    corners: Vec<(Point2<f64>, f64)>,
    uniform: f64,
    pub(super) outermost: f64,
}

impl Under {
    pub(super) fn of(print: &Footprint, centre: &Point2<f64>) -> Self {
        let corners = print.rim().turned();
        let points = print.quadrature();
        let area: f64 = points.iter().map(|p| p.1).sum();
        Self {
            cells: in_cells(&points, CELLS, area),
            points,
            uniform: print.mean_distance(centre),
            outermost: corners.iter().map(|(p, share)| share * (p - centre).norm()).sum(),
            corners: in_cells(&corners, CELLS_CORNERS, 1.0),
        }
    }

    /// Points and shares of a pressure that is so many times as far out as an even one: between an even one and one at the
    /// corners alone, on which a plate stands that is not quite flat.
    fn spread(&self, times: f64) -> Vec<(Point2<f64>, f64)> {
        let most = self.outermost / self.uniform.max(1e-6);
        let outer = ((times - 1.0) / (most - 1.0).max(1e-3)).clamp(0.0, 1.0);
        let even = self.cells.iter().map(|(p, share)| (*p, (1.0 - outer) * share));
        let corners = self.corners.iter().map(|(p, share)| (*p, outer * share));
        even.chain(corners).filter(|p| p.1 > 0.0).collect()
    }
}

/// Points gathered into the cells of a grid of so many a side, with their shares of `all`.
fn in_cells(points: &[(Point2<f64>, f64)], side: usize, all: f64) -> Vec<(Point2<f64>, f64)> {
    let bare: Vec<(Vector2<f64>, f64)> = points.iter().map(|(p, share)| (p.coords, share / all)).collect();
    let cells = gathered(&bare, side).into_iter();
    cells.map(|(p, share)| (Point2::from(p), share)).collect()
}

impl Foot {
    /// Centre and torsional radius where the load acts at `centre` (plane frame at the start): pressure that is
    /// linear over the footprint and nowhere negative. The radius keeps the ratio that this foot's has to that of
    /// uniform pressure.
    pub fn pressed_at(&self, centre: &Point2<f64>) -> (Point2<f64>, f64) {
        let Some(under) = &self.under else {
            return (*centre, self.radius);
        };
        let (reached, radius) = press(&under.points, centre);
        (reached, self.radius * radius / under.uniform.max(1e-6))
    }

    /// How it presses where its torsional radius says how far out; nothing where no shape is known.
    pub fn pressing(&self) -> Option<Pressing> {
        let under = self.under.as_ref()?;
        let times = self.radius / under.uniform.max(1e-6);
        let points = under.spread(times);
        let area: f64 = points.iter().map(|p| p.1).sum();
        let middle = Point2::from(points.iter().map(|(p, w)| p.coords * *w).sum::<Vector2<f64>>() / area);
        Some(Pressing {
            points,
            middle,
            drawn: times.min(1.0),
            last: None,
        })
    }
}

/// How a foot presses, wherever its load acts.
#[derive(Clone, Debug)]
pub struct Pressing {
    points: Vec<(Point2<f64>, f64)>,
    middle: Point2<f64>,
    drawn: f64,
    /// Where the load was wanted last, the slope that brought it there, and what pressed then.
    last: Option<(Point2<f64>, Vector2<f64>, Pressed)>,
}

impl Pressing {
    /// Where the load acts that is brought to `centre` as far as can be (plane frame at the start), and where the foot presses:
    /// points about that, m, with their shares.
    pub fn at(&mut self, centre: &Point2<f64>) -> Option<&Pressed> {
        if self.last.as_ref().is_none_or(|l| (l.0 - centre).norm() > 0.1 * NEAR) {
            // Near what was reached before a step or two lead on; what cannot be reached is sought anew.
            let near = self.last.take().filter(|l| (l.0 - l.2.centre).norm() < NEAR);
            let from = near.map_or_else(Vector2::zeros, |l| l.1);
            let (reached, slope) = slope_towards(&self.points, &self.middle, centre, from);
            let pressed = pressed_points(&self.points, &self.middle, &slope);
            let load: f64 = pressed.iter().map(|p| p.2).sum::<f64>().max(1e-12);
            let about = pressed
                .into_iter()
                .map(|(p, _, f)| ((p - reached) * self.drawn, f / load));
            let points = about.collect();
            self.last = Some((
                *centre,
                slope,
                Pressed {
                    centre: reached,
                    points,
                },
            ));
        }
        self.last.as_ref().map(|l| &l.2)
    }
}

/// Cells, per side, that the points of a foot are gathered into, and those at its corners.
const CELLS: usize = 6;
const CELLS_CORNERS: usize = 4;
/// A load this near to where it is wanted is there, m.
const NEAR: f64 = 1e-5;

/// The centre of pressure that a footprint can reach towards `wanted`, and the mean distance of the pressure from it.
fn press(points: &[(Point2<f64>, f64)], wanted: &Point2<f64>) -> (Point2<f64>, f64) {
    let area: f64 = points.iter().map(|p| p.1).sum();
    let middle = Point2::from(points.iter().map(|(p, w)| p.coords * *w).sum::<Vector2<f64>>() / area);
    let (reached, slope) = slope_towards(points, &middle, wanted, Vector2::zeros());
    let pressed = pressed_points(points, &middle, &slope);
    let load: f64 = pressed.iter().map(|p| p.2).sum::<f64>().max(1e-12);
    let radius = pressed.iter().map(|(p, _, f)| f * (p - reached).norm()).sum::<f64>() / load;
    (reached, radius)
}

/// The slope of a linear pressure about `middle` that brings its centre as near to `wanted` as can be, sought from one that is
/// near, and that centre.
fn slope_towards(
    points: &[(Point2<f64>, f64)],
    middle: &Point2<f64>,
    wanted: &Point2<f64>,
    from: Vector2<f64>,
) -> (Point2<f64>, Vector2<f64>) {
    let (mut slope, mut best) = (from, (*middle, Vector2::zeros()));
    // Newton on the slope: where pressure is clipped at zero only the pressed part answers to it.
    for _ in 0..20 {
        let pressed = pressed_points(points, middle, &slope);
        let load: f64 = pressed.iter().map(|p| p.2).sum::<f64>().max(1e-12);
        let reached = Point2::from(pressed.iter().map(|(p, _, f)| p.coords * *f).sum::<Vector2<f64>>() / load);
        best = (reached, slope);
        let missing = wanted - reached;
        if missing.norm() < NEAR {
            break;
        }
        let answer = pressed
            .iter()
            .map(|(p, w, _)| (p - reached) * (p - middle).transpose() * *w)
            .sum::<Matrix2<f64>>()
            / load;
        match answer.try_inverse() {
            Some(inverse) => slope += limited(inverse * missing, 0.5 * slope.norm() + 20.0),
            None => break,
        }
    }
    best
}

/// Where the pressure `1 + slope·(p − middle)` is positive: point, area, load.
fn pressed_points(
    points: &[(Point2<f64>, f64)],
    middle: &Point2<f64>,
    slope: &Vector2<f64>,
) -> Vec<(Point2<f64>, f64, f64)> {
    let load = |p: &Point2<f64>| 1.0 + slope.dot(&(p - middle));
    let with_load = points.iter().map(|(p, w)| (*p, *w, w * load(p)));
    with_load.filter(|p| p.2 > 0.0).collect()
}

fn limited(step: Vector2<f64>, most: f64) -> Vector2<f64> {
    step * (most / step.norm().max(most))
}

/// What a link stands on at the start of an action: all of its foot that does not change while numbers are tried.
#[derive(Clone, Debug)]
pub(super) struct Stand {
    /// Centre of mass as known, else of the underside, plane frame at the start.
    pub centre: Point2<f64>,
    ground: f64,
    under: Option<Arc<Under>>,
}

impl Stand {
    pub(super) fn of(link: &Link, mesh: Option<&Mesh>, pose: &Isometry3<f64>) -> Self {
        let print = mesh.and_then(|m| underside(m, pose));
        let known = link.com.as_ref().map(|c| (pose * nalgebra::Point3::from(c.value)).xy());
        let centre = known
            .or_else(|| print.as_ref().map(|u| u.area_centroid().1))
            .unwrap_or_else(|| Point2::from(pose.translation.vector.xy()));
        Self {
            centre,
            ground: mesh.map_or(pose.translation.vector.z, |m| lowest(m, pose)),
            under: print.map(|u| Arc::new(Under::of(&u, &centre))),
        }
    }

    /// What the link's friction is known to be; nothing where it does not rub on the table.
    pub(super) fn foot(&self, link: &Link) -> Option<Foot> {
        let force = link.friction_force.kinetic.as_ref()?.value;
        let known = link.friction.torsional_radius.as_ref().map(|c| c.value);
        let radius = known.or_else(|| self.under.as_ref().map(|u| u.uniform)).unwrap_or(0.02);
        Some(Foot {
            force,
            radius,
            centre: self.centre,
            creep: link.friction.creep_speed.as_ref().map_or(0.0, |v| v.value),
            creep_ratio: link.friction.creep_ratio.as_ref().map_or(0.0, |v| v.value),
            mass: link.mass.as_ref().map(|m| m.value),
            ground: self.ground,
            under: self.under.clone(),
        })
    }
}

/// What rides on a link presses it down: its friction is that of both.
pub fn loaded(foot: Foot, model: &Model, link: &Link, start: &BTreeMap<String, Pose>) -> Foot {
    let extra: f64 = riders(model, &link.name, start)
        .iter()
        .filter_map(|name| rider_friction(model, link, name))
        .sum();
    Foot {
        mass: foot.mass.map(|m| m * (1.0 + extra / foot.force)),
        force: foot.force + extra,
        ..foot
    }
}

/// What a rider adds to the friction force of its carrier, N: the carrier's coefficient times its weight.
fn rider_friction(model: &Model, carrier: &Link, rider: &str) -> Option<f64> {
    let rider = model.twin.link(rider)?;
    // Where only the sum of both was measured, the rider's share of it is written with the rider.
    let shared = rider.friction_force.kinetic.as_ref().filter(|f| f.confounded.is_some());
    if let Some(share) = shared {
        return Some(share.value);
    }
    let own = carrier.friction_force.kinetic.as_ref()?.value;
    let ratio = rider.mass.as_ref()?.value / carrier.mass.as_ref()?.value;
    (ratio.is_finite() && ratio > 0.0).then_some(own * ratio)
}

/// A pressure under a footprint.
#[derive(Clone, Debug)]
pub struct Pressed {
    /// Where the load acts.
    pub centre: Point2<f64>,
    /// Points about that centre, m, with their shares of the load.
    pub points: Vec<(Vector2<f64>, f64)>,
}

/// The underside of a mesh at `pose` (z up) under a pressure that is linear over it and brings the load to `centre`, as far
/// as that can be.
pub fn pressed_underside(mesh: &Mesh, pose: &Isometry3<f64>, centre: &Point2<f64>) -> Option<Pressed> {
    let points = underside(mesh, pose)?.quadrature();
    let area: f64 = points.iter().map(|p| p.1).sum();
    let middle = Point2::from(points.iter().map(|(p, w)| p.coords * *w).sum::<Vector2<f64>>() / area);
    let (reached, slope) = slope_towards(&points, &middle, centre, Vector2::zeros());
    let pressed = pressed_points(&points, &middle, &slope);
    let load: f64 = pressed.iter().map(|p| p.2).sum::<f64>().max(1e-12);
    let about = pressed.into_iter().map(|(p, _, f)| (p - reached, f / load));
    Some(Pressed {
        centre: reached,
        points: about.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Footprint {
        let s = 0.05;
        let points = [(-s, -s), (s, -s), (s, s), (-s, s)];
        Footprint::hull(points.iter().map(|(x, y)| Point2::new(*x, *y)).collect()).expect("a square")
    }

    #[test]
    fn the_load_is_brought_where_it_is_wanted_and_narrows_there() {
        let under = square();
        let uniform = under.mean_distance(&Point2::origin());
        let foot = Foot {
            force: 1.0,
            radius: 1.1 * uniform,
            centre: Point2::origin(),
            creep: 0.0,
            creep_ratio: 0.0,
            mass: None,
            ground: 0.0,
            under: Some(Arc::new(Under::of(&under, &Point2::origin()))),
        };
        let (still, radius) = foot.pressed_at(&Point2::origin());
        assert!(
            still.coords.norm() < 1e-4 && (radius / foot.radius - 1.0).abs() < 0.02,
            "{radius}"
        );
        for x in [0.01, 0.025, 0.035] {
            let (reached, narrowed) = foot.pressed_at(&Point2::new(x, 0.0));
            assert!(
                (reached.x - x).abs() < 2e-3 && reached.y.abs() < 2e-4,
                "{reached} for {x}"
            );
            assert!(narrowed < radius, "{narrowed}");
        }
    }
}
