//! The laws of a push that belong to places: of the table, and of what stands or pulls in the room.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::family::{Law, Parameter};
use super::push_catalogue::law;
use super::push_laws::form;
use super::pushes::Pushes;

/// Where bodies were moved: the middle, the standard deviation of a place's prior, and every place.
pub(super) fn workspace(pushes: &Pushes) -> (Vector2<f64>, f64, Vec<Vector2<f64>>) {
    let at: Vec<Vector2<f64>> = pushes.moving().map(|s| s.at).collect();
    let n = at.len().max(1) as f64;
    let middle = at.iter().sum::<Vector2<f64>>() / n;
    let square = at.iter().map(|p| (p - middle).norm_squared()).sum::<f64>() / n;
    (middle, (1.2 * square.sqrt().max(0.01)).max(0.025), at)
}

fn places(middle: Vector2<f64>, sd: f64) -> Vec<Parameter> {
    let (x, y) = (
        Parameter::place("px", middle.x, sd),
        Parameter::place("py", middle.y, sd),
    );
    vec![x, y]
}

/// By how much friction is less at one place at most, as a share of it.
const WEAKEST: f64 = -0.9;

/// Where a round place is and how large.
pub(super) fn round(middle: Vector2<f64>, sd: f64) -> Vec<Parameter> {
    let mut p = places(middle, sd);
    p.push(Parameter::scale("R", "m", 0.016, 0.4));
    p
}

/// By how much friction differs there: friction of less than nothing would push the body along.
pub(super) fn differs() -> Parameter {
    Parameter {
        low: WEAKEST,
        ..Parameter::amplitude("a", "1", 0.3)
    }
}

/// How steep a hill is.
pub(super) fn steepness() -> Parameter {
    Parameter::amplitude("slope", "1", 0.15)
}

/// Laws of a place on the table start from a grid over where the body was moved.
pub(super) fn local_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let (middle, sd, at) = workspace(pushes);
    let round = || round(middle, sd);
    // Every place is one where the body was: farther away nothing is felt.
    let step = (at.len() / 24).max(1);
    let visited = at.iter().step_by(step);
    let grid: Vec<Vec<f64>> = visited
        .flat_map(|p| [0.010_f64, 0.022].map(|r| vec![p.x, p.y, r.ln()]))
        .collect();
    vec![
        law(
            "friction-patch",
            "support",
            form::PATCH,
            vec![differs()],
            round(),
            grid.clone(),
            "friction differs at one place of the table",
        ),
        law(
            "friction-patch",
            "support",
            form::PATCH_SHARP,
            vec![differs()],
            round(),
            grid.clone(),
            "friction differs at one place of the table",
        ),
        law(
            "bump",
            "support",
            form::BUMP,
            vec![steepness()],
            round(),
            grid.clone(),
            "the table rises at one place: up costs what down gives back",
        ),
        law(
            "magnet",
            "support",
            form::MAGNET,
            vec![Parameter::positive("A", "N", 0.8f64.max(0.3 * scale))],
            round(),
            grid.clone(),
            "something pulls the body towards one place",
        ),
        law(
            "bump",
            "support",
            form::BUMP_BOUNDED,
            vec![steepness()],
            with_tail(round(), BOUNDED),
            tailed(&grid, BOUNDED),
            "the table rises at one place: up costs what down gives back",
        ),
        law(
            "bump",
            "support",
            form::BUMP_STEP,
            vec![steepness()],
            [places(middle, sd), vec![narrow(), uphill()]].concat(),
            steps(&at),
            "the table rises along a line: up costs what down gives back",
        ),
        law(
            "magnet",
            "support",
            form::MAGNET_FAR,
            vec![Parameter::positive("A", "N", 0.8f64.max(0.3 * scale))],
            with_tail(round(), FAR),
            tailed(&grid, FAR),
            "something pulls the body towards one place",
        ),
    ]
}

/// The width of a step: a wide one is a slope.
fn narrow() -> Parameter {
    Parameter {
        high: 0.02_f64.ln(),
        ..Parameter::scale("R", "m", 0.008, 0.4)
    }
}

/// The angle of the way up a step.
fn uphill() -> Parameter {
    Parameter {
        unit: "rad",
        ..Parameter::place("angle", 0.5 * PI, 2.0)
    }
}

/// Starts of a step: in some directions, by where bodies were along them. What is up one way is down the other.
fn steps(at: &[Vector2<f64>]) -> Vec<Vec<f64>> {
    let along = |turn: f64| {
        let way = Vector2::new(turn.cos(), turn.sin());
        let mut by: Vec<&Vector2<f64>> = at.iter().collect();
        by.sort_by(|a, b| way.dot(a).total_cmp(&way.dot(b)));
        let each = [0.1, 0.3, 0.5, 0.7, 0.9].map(|q| by.get((q * by.len() as f64) as usize).copied());
        let starts = each.into_iter().flatten();
        starts
            .map(move |p| vec![p.x, p.y, 0.008_f64.ln(), turn])
            .collect::<Vec<_>>()
    };
    [0.0, 0.25, 0.5, 0.75].map(|turn| along(turn * PI)).concat()
}

/// How the slope of a hill with an edge falls, and the pull of poles that reaches far: middle and standard deviation of the
/// exponent `tail`. A raised cosine is near 0.4, a pair of poles −0.67.
const BOUNDED: [f64; 2] = [0.4, 0.12];
const FAR: [f64; 2] = [-0.6, 0.15];

fn with_tail(mut round: Vec<Parameter>, [middle, sd]: [f64; 2]) -> Vec<Parameter> {
    let ends = [middle - 2.2 * sd, middle + 2.2 * sd];
    round.push(Parameter {
        unit: "1",
        low: ends[0],
        high: ends[1],
        ..Parameter::place("tail", middle, sd)
    });
    round
}

fn tailed(grid: &[Vec<f64>], [middle, _]: [f64; 2]) -> Vec<Vec<f64>> {
    let one = |start: &Vec<f64>| start.iter().copied().chain([middle]).collect();
    grid.iter().map(one).collect()
}

/// Forces that act everywhere on the table.
pub(super) fn far_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let a = Parameter::amplitude;
    let (middle, sd, _) = workspace(pushes);
    vec![
        law(
            "tether",
            "support",
            form::TETHER,
            vec![Parameter::positive("k", "N/m", 20.0)],
            places(middle, sd),
            vec![vec![middle.x, middle.y]],
            "something pulls the body back the farther it goes",
        ),
        law(
            "support-tilt",
            "support",
            form::TILT,
            vec![a("tx", "rad", 0.05), a("ty", "rad", 0.05)],
            Vec::new(),
            vec![Vec::new()],
            "pushing one way needs more force than pushing the other",
        ),
        // With one object that lies on one table, under no hand, the two are the same data.
        law(
            "gravity-error",
            "support",
            form::TILT,
            vec![a("tx", "rad", 0.05), a("ty", "rad", 0.05)],
            Vec::new(),
            vec![Vec::new()],
            "gravity does not point where the capture says",
        ),
        slack(pushes, middle, sd),
        loose(middle, sd, form::TETHER_ROUND),
        loose(middle, sd, form::TETHER_CAUGHT),
    ]
    .into_iter()
    .chain(leaning(pushes))
    .chain(in_the_way(pushes, middle, sd, scale))
    .collect()
}

/// A slope of the table bears what a hand presses down as well, where one does.
fn leaning(pushes: &Pushes) -> Option<Law> {
    let slope = |name| Parameter::amplitude(name, "rad", 0.05);
    pushes.loads_vary().then(|| {
        law(
            "support-tilt",
            "support",
            form::TILT_BORNE,
            ["tx", "ty"].map(slope).to_vec(),
            Vec::new(),
            vec![Vec::new()],
            "pushing one way needs more force than pushing the other, the more the more the table bears",
        )
    })
}

/// A tether that is slack within a circle about where it is tied.
pub(super) fn loose(middle: Vector2<f64>, sd: f64, form: usize) -> Law {
    let length = Parameter {
        low: 0.0,
        high: 0.3,
        ..Parameter::place("L", 0.03, 0.02)
    };
    law(
        "tether",
        "support",
        form,
        vec![Parameter::positive("k", "N/m", 20.0)],
        places(middle, sd).into_iter().chain([length]).collect(),
        [0.015, 0.03, 0.05].map(|l| vec![middle.x, middle.y, l]).to_vec(),
        "beyond some way from one place something pulls the body back",
    )
}

/// A tether that is slack at first: beyond a line it pulls back, as one whose far end is far away does.
fn slack(pushes: &Pushes, middle: Vector2<f64>, sd: f64) -> Law {
    let places: Vec<Vector2<f64>> = pushes.ways().flat_map(|(_, at)| at).collect();
    let angles = (0..8).map(|k| f64::from(k) * PI / 4.0 - PI);
    let starts = angles.flat_map(|angle| {
        let way = Vector2::new(angle.cos(), angle.sin());
        let along = || places.iter().map(|p| way.dot(p));
        let (low, high) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        [0.15, 0.4, 0.65].map(|share| vec![angle, low + share * (high - low)])
    });
    let angle = Parameter {
        unit: "rad",
        ..Parameter::place("direction", 0.0, 2.0)
    };
    law(
        "tether",
        "support",
        form::TETHER_SLACK,
        vec![Parameter::positive("k", "N/m", 20.0)],
        vec![angle, Parameter::place("slack", 0.0, middle.norm() + sd)],
        starts.collect(),
        "beyond some place something pulls the body back the farther it goes",
    )
}

/// A thing that nobody saw, somewhere in the way of the pushes: it stays where it was pushed to, or it is put back as the body is.
fn in_the_way(pushes: &Pushes, middle: Vector2<f64>, sd: f64, scale: f64) -> [Law; 2] {
    let mut grid: Vec<Vec<f64>> = Vec::new();
    for (along, at) in pushes.ways() {
        let angle = along.y.atan2(along.x);
        for k in 1..=10 {
            let Some(place) = at.get(k * at.len() / 11) else {
                continue;
            };
            let start = vec![angle, along.dot(place)];
            let near = |g: &Vec<f64>| (g[0] - start[0]).abs() < 0.3 && (g[1] - start[1]).abs() < 3e-3;
            if !grid.iter().any(near) {
                grid.push(start);
            }
        }
    }
    let angle = Parameter {
        unit: "rad",
        ..Parameter::place("direction", 0.0, 2.0)
    };
    let one = |form: usize, words: &'static str| {
        law(
            "hidden-body",
            "support",
            form,
            vec![Parameter::positive("force", "N", 0.5 * scale)],
            vec![angle.clone(), Parameter::place("s3", 0.0, middle.norm() + sd)],
            grid.clone(),
            words,
        )
    };
    [
        one(
            form::HIDDEN_BODY,
            "from a place on more has to be pushed than the body alone, and the place moves with it",
        ),
        one(
            form::HIDDEN_BODY_ANEW,
            "from a place on more has to be pushed than the body alone, at the same place in every push",
        ),
    ]
}
