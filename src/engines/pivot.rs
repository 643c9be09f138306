//! Whether things turned about a place of their own that the measured poses and forces tell, whatever engine plays them.
//!
//! Where the pressure on a face is spread out, each line of force has a centre of rotation of its own (the limit surface is
//! strictly convex: Goyal, Ruina, Papadopoulos 1991, Wear 143); a place that bears a share of its own stays the centre for
//! many lines. So pushes that turned about one place though their lines of force differed tell of it, without any number of
//! the twin. That such a place is why a held-out push ends where it does is tried: turned about the place of the fitted pushes
//! until it no longer meets the tool, it must end at most half as far off as in the engine.

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

use super::recorded::Recorded;
use super::table::{Outcome, SHARE, TURN, TouchRow};
use crate::base::Pose;
use crate::export::{Hold, gap};
use crate::twin::Model;

/// A turn below this, rad, tells no centre.
const TURNS: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// A turn about anything but the table's normal of more than this, rad, is a fall.
const FALLS: f64 = 0.03;
/// Shares of the thing's reach from its centre of mass: centres that are nearer to each other are the same place, and a place
/// that is nearer to the centre of mass is that centre to a thing that is pushed far out.
const SAME: f64 = 0.1;
const OFF_CENTRE: f64 = 0.25;
/// Fitted pushes that must have turned about the place.
const FEWEST: usize = 4;
/// Lines of force must differ by this, rad, more than twice what the bearings of the centres do.
const DIFFER: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// Share of the largest force above which the tool pushes.
const PUSHES: f64 = 0.5;
/// The largest share of the engine's miss that may be left.
const LEFT: f64 = 0.5;
/// Step of the search for where the thing no longer meets the tool, rad, and steps by which it is halved.
const STEP: f64 = 0.25 * std::f64::consts::PI / 180.0;
const HALVINGS: usize = 12;

/// A push that turned the thing clearly.
struct Turned<'a> {
    touch: &'a Recorded,
    /// Where it turned about, in the link frame, at the height of the centre of mass, relative to it, m.
    centre: Vector3<f64>,
    /// Which way the tool pushed, link frame, unit, were the turn the other way round where it is negative.
    force: Option<Vector3<f64>>,
    /// About the table's normal, rad.
    turn: f64,
}

/// A place about which fitted pushes turned, and what a held-out one does there.
pub(super) struct Pivot {
    /// Fitted pushes that turned about it, and how far from it at most, m.
    pub(super) fitted: usize,
    pub(super) within: f64,
    /// How far their lines of force differ, rad.
    pub(super) differ: f64,
    /// Where it is in the link frame, m.
    pub(super) place: Point3<f64>,
    /// How far the held-out push's own centre is from it, m.
    pub(super) own: f64,
    /// What is left of the miss were it turned about the place: m, rad.
    pub(super) left: [f64; 2],
    /// The engine's centre of rotation is this far from it, m; absent where it hardly turns there.
    pub(super) engine: Option<f64>,
}

impl std::fmt::Display for Pivot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (place, mm) = (1e3 * self.place.coords, |m: f64| 1e3 * m);
        write!(
            f,
            "the measured poses say that it turned about one place of itself, ({:.0}, {:.0}, {:.0}) mm in its frame, which stood still: \
             to {:.0} mm here, to {:.0} mm in {} fitted pushes, though those pushed along lines up to {:.0} degrees apart. In this engine it ",
            place.x,
            place.y,
            place.z,
            mm(self.own),
            mm(self.within),
            self.fitted,
            self.differ.to_degrees(),
        )?;
        match self.engine {
            Some(away) => write!(f, "turns about a place {:.0} mm from there", mm(away))?,
            None => write!(f, "hardly turns")?,
        }
        write!(
            f,
            ". Turned about that place until it clears the tool it would end {:.2} mm and {:.2} degrees off. The twin knows of no \
             such place, and what holds the thing there was not measured",
            mm(self.left[0]),
            self.left[1].to_degrees()
        )
    }
}

/// The place about which a missed push turned, where fitted ones turned about the same and the engine does not.
pub(super) fn pivot(model: &Model, touches: &[Recorded], touch: &Recorded, row: &TouchRow) -> Option<Pivot> {
    let com = com(model, touch)?;
    let reach = reach(model, touch, &com)?;
    let mine = turned(model, touch)?;
    let same = SAME * reach;
    let alike = |t: &Turned| t.touch.trial.target == touch.trial.target && up(t.touch).dot(&up(touch)) > 1.0 - SAME;
    let near = touches.iter().filter(|t| !t.held_out).filter_map(|t| turned(model, t));
    let near: Vec<Turned> = near
        .filter(|t| alike(t) && (t.centre - mine.centre).norm() <= same)
        .collect();
    let place = near.iter().map(|t| t.centre).sum::<Vector3<f64>>() / near.len().max(1) as f64;
    let away = place.norm();
    if near.len() < FEWEST || away < OFF_CENTRE * reach || away > reach {
        return None;
    }
    let lines: Vec<Vector3<f64>> = near.iter().filter_map(|t| t.force).collect();
    let bearings: Vec<Vector3<f64>> = near.iter().map(|t| t.centre.normalize()).collect();
    let (differ, bearing) = (widest(&lines), widest(&bearings));
    if lines.len() < FEWEST || differ < DIFFER + 2.0 * bearing {
        return None;
    }
    let engine = engine_centre(touch, row, &com, mine.turn)?;
    if engine.is_some_and(|c| (c - place).norm() <= same) {
        return None;
    }
    let left = about(model, touch, &com, &(com + place), mine.turn)?;
    let Outcome::Played {
        position_error,
        turn_error,
        ..
    } = &row.outcome
    else {
        return None;
    };
    let size = |place: f64, turn: f64| (place / (SHARE * row.travel).max(1e-6)).hypot(turn / TURN);
    let mended = size(left[0], left[1]) <= LEFT * size(*position_error, turn_error.unwrap_or(0.0));
    mended.then(|| Pivot {
        fitted: near.len(),
        within: near.iter().map(|t| (t.centre - place).norm()).fold(0.0, f64::max),
        differ,
        place: com + place,
        own: (mine.centre - place).norm(),
        left,
        engine: engine.map(|c| (c - place).norm()),
    })
}

fn com(model: &Model, touch: &Recorded) -> Option<Point3<f64>> {
    let com = model.twin.link(&touch.trial.target)?.com.as_ref();
    Some(Point3::from(com.map_or([0.0; 3], |c| c.value)))
}

/// The table's normal in the link frame before the touch.
fn up(touch: &Recorded) -> Vector3<f64> {
    touch.before.rotation.inverse() * touch.up.into_inner()
}

/// How far the thing reaches over the table from its centre of mass, m.
fn reach(model: &Model, touch: &Recorded, com: &Point3<f64>) -> Option<f64> {
    let mesh = model.meshes.get(model.twin.link(&touch.trial.target)?.mesh.as_ref()?)?;
    let up = up(touch);
    let away = mesh.vertices.iter().map(|v| level(&(v - com), &up).norm());
    Some(away.fold(0.0, f64::max)).filter(|r| *r > 0.0)
}

fn level(v: &Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
    v - up * v.dot(up)
}

/// What turned about which place; nothing where a touch did not turn its thing over the table, or its track does not tell where.
fn turned<'a>(model: &Model, touch: &'a Recorded) -> Option<Turned<'a>> {
    if touch.press || !touch.oriented || touch.trial.hold != Hold::Touch {
        return None;
    }
    let com = com(model, touch)?;
    let reach = reach(model, touch, &com)?;
    let went = touch.after.0 * com - touch.before.0 * com;
    let spin = (touch.after.rotation * touch.before.rotation.inverse()).scaled_axis();
    let turn = spin.dot(&touch.up);
    let falls = level(&spin, &touch.up).norm() > FALLS;
    let centre = centre(&went, turn, &touch.up)?;
    let doubt = touch.noise[0] / turn.abs() + centre.norm() * touch.noise[1] / turn.abs();
    if falls || turn.abs() < TURNS || doubt > SAME * reach {
        return None;
    }
    let back = touch.before.rotation.inverse();
    Some(Turned {
        touch,
        centre: back * centre,
        force: line(touch).map(|f| back * (f * turn.signum())),
        turn,
    })
}

/// From where a thing was to the place about which it turned as it went.
fn centre(went: &Vector3<f64>, turn: f64, up: &Vector3<f64>) -> Option<Vector3<f64>> {
    let went = level(went, up);
    let centre = went / 2.0 + up.cross(&went) / (2.0 * (turn / 2.0).tan());
    centre.iter().all(|v| v.is_finite()).then_some(centre)
}

/// Which way a tool pushed over the table on the whole.
fn line(touch: &Recorded) -> Option<Vector3<f64>> {
    let largest = touch.force.iter().map(|(_, f)| f.norm()).fold(0.0, f64::max);
    let pushes = touch.force.iter().filter(|(_, f)| f.norm() > PUSHES * largest);
    let sum: Vector3<f64> = pushes.map(|(_, f)| f).sum();
    level(&sum, &touch.up).try_normalize(1e-9)
}

/// The largest angle between two of these.
fn widest(directions: &[Vector3<f64>]) -> f64 {
    let pairs = directions.iter().enumerate();
    let angles = pairs.flat_map(|(i, a)| directions[..i].iter().map(move |b| a.angle(b)));
    angles.fold(0.0, f64::max)
}

/// The place about which the engine turned it, link frame, from the centre of mass; nothing within where it hardly did.
fn engine_centre(touch: &Recorded, row: &TouchRow, com: &Point3<f64>, measured: f64) -> Option<Option<Vector3<f64>>> {
    let Outcome::Played {
        missed_by, turned_by, ..
    } = &row.outcome
    else {
        return None;
    };
    let went = touch.after.0 * com - touch.before.0 * com + Vector3::from(*missed_by);
    let turn = measured + Vector3::from((*turned_by)?).dot(&touch.up);
    if turn.abs() < TURNS / 2.0 {
        return Some(None);
    }
    Some(centre(&went, turn, &touch.up).map(|c| touch.before.rotation.inverse() * c))
}

/// How far the thing ends from where it was measured, m and rad, were it turned about a place of its own, the way it was measured
/// to turn, until the tool at the end of its way no longer reaches into it.
fn about(model: &Model, touch: &Recorded, com: &Point3<f64>, place: &Point3<f64>, turn: f64) -> Option<[f64; 2]> {
    let still = touch.before.0 * place;
    let at = |by: f64| {
        let spin = UnitQuaternion::from_axis_angle(&touch.up, by * turn.signum());
        let spun = Translation3::from(still.coords) * spin * Translation3::from(-still.coords);
        Pose(spun * touch.before.0)
    };
    let end = *touch.trial.time.last()?;
    let meets = |by: f64| {
        let mut trial = touch.trial.clone();
        trial.start.insert(trial.target.clone(), at(by));
        let gap = gap(model, &trial, end).ok().flatten();
        gap.is_some_and(|g| g.distance <= 0.0)
    };
    let steps = (2.0 * turn.abs() / STEP) as usize + 20;
    let last = (0..=steps).rev().find(|k| meets(*k as f64 * STEP))?;
    let (mut inside, mut clear) = (last as f64 * STEP, (last + 1) as f64 * STEP);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + clear);
        if meets(middle) {
            inside = middle;
        } else {
            clear = middle;
        }
    }
    let ends = at(clear);
    let off = ends.0 * com - touch.after.0 * com;
    Some([
        level(&off, &touch.up).norm(),
        (ends.rotation * touch.after.rotation.inverse()).angle(),
    ])
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;
    use crate::export::{Trial, TrialShape};
    use crate::geometry::convex_hull;
    use crate::twin::{Body, FORMAT, Link, Provenance, Twin};

    const HALF: [f64; 3] = [0.10, 0.05, 0.01];
    const TIP: f64 = 5e-3;

    fn model() -> Model {
        let side = |bit: usize, k: usize| if k >> bit & 1 == 1 { HALF[bit] } else { -HALF[bit] };
        let corners: Vec<Point3<f64>> = (0..8)
            .map(|k| Point3::new(side(0, k), side(1, k), side(2, k)))
            .collect();
        let mut link = Link::new("box", Pose::identity());
        link.mesh = Some("box.obj".into());
        link.collision = vec!["box.obj".into()];
        let body = Body {
            name: "box".into(),
            links: vec![link],
            joints: Vec::new(),
        };
        let twin = Twin {
            format: FORMAT.into(),
            name: "t".into(),
            gravity: [0.0, 0.0, -9.80665],
            support: None,
            bodies: vec![body],
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        };
        Model {
            twin,
            meshes: BTreeMap::from_iter(convex_hull(&corners).map(|m| ("box.obj".to_owned(), m))),
            textures: BTreeMap::new(),
        }
    }

    /// A push at a place of the box along a direction, which turns it clockwise by 5 degrees about a place of its own.
    fn push(at: [f64; 2], along: [f64; 2], about: [f64; 2]) -> Recorded {
        let still = Vector3::new(about[0], about[1], 0.0);
        let spin = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -5_f64.to_radians());
        let after = Pose(Translation3::from(still) * spin * Translation3::from(-still));
        let way = Vector3::new(along[0], along[1], 0.0);
        let first = Vector3::new(at[0], at[1], 0.0) - way * TIP;
        let last = after.0 * Point3::new(at[0], at[1], 0.0) - spin * way * TIP;
        let place = |v: Vector3<f64>| Pose(Translation3::from(v).into());
        let times = [0.0, 1.0, 2.0];
        Recorded {
            trial: Trial {
                name: "push".into(),
                target: "box".into(),
                shape: TrialShape::Sphere { radius: TIP },
                hold: Hold::Touch,
                friction: 0.4,
                time: times.to_vec(),
                path: vec![place(first), place(0.5 * (first + last.coords)), place(last.coords)],
                start: BTreeMap::new(),
                present: BTreeSet::from(["box".to_owned()]),
            },
            press: false,
            held_out: false,
            friction_assumed: true,
            before: Pose::identity(),
            after,
            shifted: None,
            oriented: true,
            up: Vector3::z_axis(),
            noise: [1e-4, 1e-3],
            force: times.map(|t| (t, way)).to_vec(),
        }
    }

    /// An engine that turned the box about another place of it, by as much.
    fn row(touch: &Recorded, about: [f64; 2]) -> TouchRow {
        let other = push([-0.08, -0.05], UP, about);
        let missed = other.after.0.translation.vector - touch.after.0.translation.vector;
        TouchRow {
            interaction: touch.trial.name.clone(),
            link: "box".into(),
            held_out: true,
            travel: touch.after.0.translation.vector.norm(),
            turned: Some(5_f64.to_radians()),
            tool_friction_assumed: true,
            tool_shifted: None,
            rigid: false,
            outcome: Outcome::Played {
                missed_by: missed.into(),
                position_error: missed.norm(),
                relative_error: 1.0,
                turn_error: Some(0.0),
                turned_by: Some([0.0; 3]),
                force_rms: None,
                force_measured: None,
            },
        }
    }

    const FOOT: [f64; 2] = [0.06, -0.03];
    const UP: [f64; 2] = [0.0, 1.0];
    const RIGHT: [f64; 2] = [1.0, 0.0];

    fn found(fitted: &[Recorded], engine: [f64; 2]) -> Option<Pivot> {
        let held_out = push([-0.06, -0.05], UP, FOOT);
        pivot(&model(), fitted, &held_out, &row(&held_out, engine))
    }

    #[test]
    fn a_place_that_stood_still_under_different_pushes_is_found_and_tells_the_end() {
        let at = |x: f64| push([x, -0.05], UP, FOOT);
        let beside = |y: f64| push([-0.10, y], RIGHT, FOOT);
        let fitted = [at(-0.09), at(-0.03), beside(0.03), beside(0.01)];
        let pivot = found(&fitted, [0.10, -0.05]).expect("found");
        assert_eq!(pivot.fitted, 4);
        assert!((pivot.place - Point3::new(FOOT[0], FOOT[1], 0.0)).norm() < 1e-6);
        assert!(
            pivot.left[0] < 1e-3 && pivot.left[1] < 1_f64.to_radians(),
            "{:?}",
            pivot.left
        );
        // An engine that turns it there too misses for another reason.
        assert!(found(&fitted, FOOT).is_none());
    }

    #[test]
    fn where_each_line_of_force_has_its_own_place_or_all_lines_are_alike_nothing_is_said() {
        let at = |x: f64, foot: f64| push([x, -0.05], UP, [foot, -0.03]);
        let alike = [-0.09, -0.07, -0.05, -0.03].map(|x| at(x, 0.06));
        assert!(found(&alike, [0.10, -0.05]).is_none());
        let spread = [(-0.09, 0.02), (-0.07, 0.04), (-0.05, 0.08), (-0.03, 0.10)].map(|(x, foot)| at(x, foot));
        assert!(found(&spread, [0.10, -0.05]).is_none());
    }
}
