//! What shows that a thing runs on a rail, where it was but led and shoved along it: that it keeps to one line, whatever is done
//! to it sideways.

use nalgebra::{DMatrix, DVector, Vector3};

use super::coupling::Placement;
use super::pair::Pair;
use super::shoved::never_turns;
use crate::capture::{Interaction, Kind};
use crate::math::{interpolate, mad_sd, median, weighted_linear};

/// Every interaction that shows a rail, with what it shows.
pub(super) fn on_a_rail<'a>(pair: &Pair<'a>, placement: &Placement) -> Vec<(&'a Interaction, &'static str)> {
    let line = "it kept to one line whether it was led along it or only shoved";
    let side = "it kept to one line although it was drawn to the side of it";
    let turn = "it was shoved on both sides of its middle and never turned";
    let again = "it kept to one line whenever it was led, one way and the other";
    let shown = [
        (again_and_again(pair), again),
        (on_one_line(pair), line),
        (held_sideways(pair, &placement.up), side),
        (never_turns(pair, placement), turn),
    ];
    shown
        .into_iter()
        .filter_map(|(run, words)| Some((run?, words)))
        .collect()
}

/// Fewest pulls that led it along its line, and the least way of a shove, m.
pub(super) const LINES: (usize, f64) = (2, 0.02);

/// The shove that shows a rail: pulls led the child along one line, and a tool that does not hold it sent it along the same one
/// without a turn. What is free turns away from a single point that shoves it, the more the further it goes (Mason 1986).
fn on_one_line<'a>(pair: &Pair<'a>) -> Option<&'a Interaction> {
    let moved = |kind: Kind| {
        let of = move |k: &usize| pair.runs[*k].kind == kind && pair.excursion(*k).0 > LINES.1;
        (0..pair.runs.len()).filter(of)
    };
    let child = |k: &usize| pair.runs[*k].target.as_deref() == Some(&pair.child);
    let free = |k: &usize| {
        let tool = pair.runs[*k].tool.as_ref();
        tool.is_some_and(|t| !t.grip && !t.pin)
    };
    let led = moved(Kind::Pull).filter(child).count();
    let shoved = moved(Kind::Push).filter(child).find(free);
    let lifted = moved(Kind::Lift).next().is_some();
    (led >= LINES.0 && !lifted)
        .then_some(shoved)
        .flatten()
        .map(|k| pair.runs[k])
}

/// Fewest pulls that led it, and fewest of them each way, that leave a rail as the only likely reason for one line.
const AGAIN: [usize; 2] = [6, 2];

/// The first of many pulls that led the child along one line, some one way and some the other: a hand that draws what is free has no
/// reason to come back to the same line over and over, and to leave it there.
fn again_and_again<'a>(pair: &Pair<'a>) -> Option<&'a Interaction> {
    let lifted = (0..pair.runs.len()).any(|k| pair.runs[k].kind == Kind::Lift && pair.moved(k));
    let led = |k: &usize| {
        let run = pair.runs[*k];
        run.kind == Kind::Pull && run.target.as_deref() == Some(&pair.child) && pair.excursion(*k).0 > LINES.1
    };
    let pulls: Vec<usize> = (0..pair.runs.len()).filter(led).collect();
    let ways: Vec<Vector3<f64>> = pulls.iter().filter_map(|k| pair.farthest(*k)).collect();
    let first = ways.first().filter(|_| !lifted && ways.len() >= AGAIN[0])?;
    let forth = ways.iter().filter(|w| w.dot(first) > 0.0).count();
    let fewer = forth.min(ways.len() - forth);
    (fewer >= AGAIN[1]).then(|| pair.runs[pulls[0]])
}

/// Seconds over which forces are averaged, share of the fastest block's way from which on it moves in one, fewest such blocks that tell
/// what varies, and fewest of all.
const BLOCK: f64 = 0.25;
const MOVES: f64 = 0.3;
const BLOCKS: usize = 6;
const FEW: usize = 2;
/// Fewest pulls, and of these fewest in which something bears what pulls sideways.
const PULLS: [usize; 2] = [3, 2];
/// What pulls sideways, over what friction along the line does, and over its own noise, from which on something bears it.
const BORNE: [f64; 2] = [0.07, 5.0];
/// What pulls sideways on the whole, in some pulls more than in others: fewest pulls, and over what friction along the line does.
const UNLIKE: (usize, f64) = (4, 0.2);

/// The pull that shows a rail: a hand drew the child along one line, and to the side of it as well, now more and now less, and it did
/// not give, or in one pull much more than in another, which no sensor does. Dry friction is against the motion alone: what is free
/// follows whatever else acts on it (Goyal, Ruina, Papadopoulos 1991).
fn held_sideways<'a>(pair: &Pair<'a>, up: &Vector3<f64>) -> Option<&'a Interaction> {
    let lifted = (0..pair.runs.len()).any(|k| pair.runs[k].kind == Kind::Lift && pair.moved(k));
    let led = |k: &usize| {
        let run = pair.runs[*k];
        let own = run.kind == Kind::Pull && run.target.as_deref() == Some(&pair.child);
        own && run.tool.as_ref().is_some_and(|t| t.grip) && pair.excursion(*k).0 > LINES.1
    };
    let pulls: Vec<usize> = (0..pair.runs.len()).filter(led).collect();
    let all: Vec<(usize, Drawn)> = pulls
        .iter()
        .filter_map(|k| Some((*k, drawn(pair.runs[*k], &pair.child, up)?)))
        .collect();
    if lifted || pulls.len() < PULLS[0] {
        return None;
    }
    let mut shown = all.iter().filter(|(_, d)| d.borne());
    let first = shown.next().filter(|_| shown.count() + 1 >= PULLS[1]);
    let most = || all.iter().max_by(|a, b| a.1.whole.abs().total_cmp(&b.1.whole.abs()));
    first
        .or_else(|| {
            unlike(&all.iter().map(|d| &d.1).collect::<Vec<_>>())
                .then(most)
                .flatten()
        })
        .map(|(k, _)| pair.runs[*k])
}

/// What pulls while it moves, over blocks of a pull, N.
struct Drawn {
    /// Root mean square of what pulls sideways of the line beside a constant and a share of what pulls along it.
    varies: f64,
    /// Median of what pulls along the line, and the noise of the mean of a block.
    along: f64,
    noise: f64,
    /// Mean of what pulls to the side, with the side to which it does.
    whole: f64,
    side: Vector3<f64>,
}

impl Drawn {
    /// Something bears what pulls sideways now more and now less.
    fn borne(&self) -> bool {
        self.varies > BORNE[0] * self.along && self.varies > BORNE[1] * self.noise
    }
}

/// Whether what pulls sideways on the whole is another from pull to pull than a sensor that is off, or friction askew, would have it.
fn unlike(all: &[&Drawn]) -> bool {
    let Some(first) = all.first().filter(|_| all.len() >= UNLIKE.0) else {
        return false;
    };
    let each: Vec<f64> = all.iter().map(|d| d.whole * d.side.dot(&first.side).signum()).collect();
    let along = median(&all.iter().map(|d| d.along).collect::<Vec<f64>>()).unwrap_or(f64::INFINITY);
    mad_sd(&each).is_some_and(|spread| spread > UNLIKE.1 * along)
}

fn drawn(run: &Interaction, child: &str, up: &Vector3<f64>) -> Option<Drawn> {
    let (track, force) = (run.tracks.get(child)?, run.force.as_ref()?);
    let seen = || (0..track.len()).filter(|i| track.position[*i].x.is_finite());
    let first = track.position[seen().next()?];
    let ways = seen().map(|i| track.position[i] - first);
    let line = ways.max_by(|a, b| a.norm().total_cmp(&b.norm()))?.try_normalize(1e-9)?;
    let sideways = up.cross(&line).try_normalize(1e-9)?;
    let times: Vec<f64> = seen().map(|i| track.time[i]).collect();
    let places: Vec<f64> = seen().map(|i| (track.position[i] - first).dot(&line)).collect();
    let start = *force.time.first()?;
    let count = ((force.time.last()? - start) / BLOCK) as usize;
    let block = |k: usize| {
        let [from, to] = [k, k + 1].map(|k| start + k as f64 * BLOCK);
        let rows = force.time.partition_point(|t| *t < from)..force.time.partition_point(|t| *t < to);
        let own: Vec<&Vector3<f64>> = force.force[rows].iter().filter(|f| f.x.is_finite()).collect();
        let n = own.len() as f64;
        let mean = |axis: &Vector3<f64>| own.iter().map(|f| f.dot(axis)).sum::<f64>() / n;
        let (across, along) = (mean(&sideways), mean(&line));
        let spread = own.iter().map(|f| (f.dot(&sideways) - across).powi(2)).sum::<f64>();
        let way = interpolate(&times, &places, to)? - interpolate(&times, &places, from)?;
        (own.len() > 2).then(|| [way.abs(), across, along, spread.sqrt() / n])
    };
    let all: Vec<[f64; 4]> = (0..count).filter_map(block).collect();
    let farthest = all.iter().map(|b| b[0]).fold(0.0, f64::max);
    let moving: Vec<&[f64; 4]> = all.iter().filter(|b| b[0] > MOVES * farthest).collect();
    if moving.len() < FEW {
        return None;
    }
    let a = DMatrix::from_fn(moving.len(), 2, |i, k| if k == 0 { 1.0 } else { moving[i][2] });
    let b = DVector::from_iterator(moving.len(), moving.iter().map(|m| m[1]));
    let fit = weighted_linear(&a, &b, &DVector::from_element(moving.len(), 1.0)).filter(|_| moving.len() >= BLOCKS);
    let along = median(&moving.iter().map(|m| m[2].abs()).collect::<Vec<f64>>())?;
    let noise = median(&moving.iter().map(|m| m[3]).collect::<Vec<f64>>())?;
    Some(Drawn {
        varies: fit.map_or(0.0, |f| f.residuals.norm() / (moving.len() as f64).sqrt()),
        along,
        noise,
        whole: moving.iter().map(|m| m[1]).sum::<f64>() / moving.len() as f64,
        side: sideways,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::super::tests::interaction;
    use super::*;
    use crate::capture::{PoseStream, WrenchStream};

    /// A pull of 0.2 m to and fro in 8 s against 2 N, which is drawn to its side by up to `aside` N.
    fn pull(aside: f64) -> Interaction {
        let time: Vec<f64> = (0..800).map(|i| 0.01 * f64::from(i)).collect();
        let way = |t: f64| 0.1 * (1.0 - (std::f64::consts::TAU * t / 8.0).cos());
        let force = |t: &f64| {
            let wobble = 0.02 * (t * 301.0).sin();
            let along = 2.0 * (4.0 - t).signum();
            Vector3::new(along + wobble, 0.3 * along + aside * (0.9 * t).sin() - wobble, 0.0)
        };
        let track = PoseStream {
            position: time.iter().map(|t| Point3::new(way(*t), 0.0, 0.1)).collect(),
            rotation: vec![Some(UnitQuaternion::identity()); time.len()],
            time: time.clone(),
        };
        let mut run = interaction("pull-00", "drawer", Vector3::x(), vec![("drawer", track)]);
        run.force = Some(WrenchStream {
            force: time.iter().map(force).collect(),
            time,
            torque: None,
        });
        run
    }

    #[test]
    fn what_a_rail_bears_is_told_from_friction_that_is_askew() {
        let of = |aside: f64| drawn(&pull(aside), "drawer", &Vector3::z()).expect("it moves");
        // A share of the force along the line is a sensor's, or friction's that is not even.
        assert!(!of(0.0).borne() && of(0.6).borne());
    }

    #[test]
    fn a_rail_bears_in_one_pull_what_it_does_not_in_another() {
        let pulls = |all: [f64; 5]| {
            let each = all.map(|whole| {
                let mut run = pull(0.0);
                let force = run.force.iter_mut().flat_map(|f| &mut f.force);
                force.for_each(|f| f.y += whole);
                drawn(&run, "drawer", &Vector3::z()).expect("it moves")
            });
            unlike(&each.iter().collect::<Vec<_>>())
        };
        assert!(pulls([1.5, -2.0, 0.2, 3.0, -1.0]));
        // A sensor that is off is so in all of them.
        assert!(!pulls([1.5, 1.5, 1.6, 1.4, 1.5]));
    }
}
