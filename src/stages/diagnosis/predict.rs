//! Predicts one interaction and lays the prediction beside what was measured.

use nalgebra::{Point3, Vector3};

use super::lifted::lift;
use super::slide::slide_curves;
use super::trace::Predicted;
use super::{Curve, Quantity, Trace};
use crate::capture::{Capture, Interaction, Kind, PoseStream, Segmented};
use crate::math::{interpolate, median};
use crate::physics::{Action, Press, predict_press, predict_tilt};
use crate::stages::estimation::{action_of, first_rest, rest_pose, support_normal};
use crate::twin::Model;

/// Everything that a prediction of one interaction needs.
pub struct Scene<'a> {
    pub capture: &'a Capture,
    pub interaction: &'a Interaction,
    pub segmented: Option<&'a Segmented>,
    pub model: &'a Model,
}

/// The curves of one interaction, or why there are none.
pub fn trace_of(capture: &Capture, interaction: &Interaction, segmented: Option<&Segmented>, model: &Model) -> Trace {
    let scene = Scene {
        capture,
        interaction,
        segmented,
        model,
    };
    let action = action_of(capture, interaction, segmented, model);
    let outcome = match (interaction.kind, action) {
        (Kind::Hold, _) => hold(&scene),
        (Kind::Tilt, _) => tilt(&scene),
        (Kind::Toss, _) => Err("what is thrown has no shape, or no flight was tracked with its orientation".into()),
        (_, None) => Err("the tool or its path is missing".into()),
        (Kind::Push | Kind::Pull, Some(action)) => slide_curves(&scene, &action),
        (Kind::Lift, Some(action)) => lift(&scene, &action),
        (Kind::Press, Some(action)) => press(&scene, &action),
    };
    let predicted = outcome.unwrap_or_else(|why| Predicted {
        remark: Some(why),
        ..Predicted::default()
    });
    Trace {
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        remark: predicted.remark,
        curves: predicted.curves,
        doubt: predicted.doubt,
        paths: predicted.paths,
    }
}

/// What is predicted, or why nothing is.
pub type Outcome = Result<Predicted, String>;

/// Curves alone, with what was fitted anew.
fn curves_alone(curves: Vec<Curve>, remark: Option<&str>) -> Outcome {
    Ok(Predicted {
        curves,
        remark: remark.map(str::to_owned),
        ..Predicted::default()
    })
}

/// Times, forces and the noise of one bin.
type BinnedForce = (Vec<f64>, Vec<Vector3<f64>>, Option<f64>);

impl Scene<'_> {
    /// The force without its tare, averaged over bins of `bin` seconds, with the noise of a bin.
    pub fn binned_force(&self, bin: f64) -> Option<BinnedForce> {
        let tare = self.segmented.and_then(|s| s.force_tare).unwrap_or_else(Vector3::zeros);
        let (time, force, noise) = self.raw_force(bin)?;
        Some((time, force.into_iter().map(|f| f - tare).collect(), noise))
    }

    /// The force as it was read, averaged over bins of `bin` seconds, with the noise of a bin.
    pub fn raw_force(&self, bin: f64) -> Option<BinnedForce> {
        let stream = self.interaction.force.as_ref()?;
        let (first, last) = (*stream.time.first()?, *stream.time.last()?);
        let bins = ((last - first) / bin).floor() as usize + 1;
        let (mut time, mut force) = (Vec::with_capacity(bins), Vec::with_capacity(bins));
        let mut largest = 1;
        for k in 0..bins {
            let from = stream.time.partition_point(|t| *t < first + k as f64 * bin);
            let to = stream.time.partition_point(|t| *t < first + (k + 1) as f64 * bin);
            let rows: Vec<&Vector3<f64>> = stream.force[from..to]
                .iter()
                .filter(|f| f.iter().all(|x| x.is_finite()))
                .collect();
            largest = largest.max(rows.len());
            if !rows.is_empty() {
                time.push(stream.time[from..to].iter().sum::<f64>() / (to - from) as f64);
                force.push(rows.iter().copied().sum::<Vector3<f64>>() / rows.len() as f64);
            }
        }
        let noise = self.interaction_noise().map(|n| n / (largest as f64).sqrt());
        Some((time, force, noise))
    }

    fn interaction_noise(&self) -> Option<f64> {
        self.capture
            .noise
            .force
            .or_else(|| self.segmented.and_then(|s| s.force_noise))
    }

    /// Noise of tracked positions, m.
    pub fn position_noise(&self) -> Option<f64> {
        self.capture
            .noise
            .position
            .or_else(|| self.segmented.and_then(|s| s.position_noise))
    }

    /// Noise of tracked rotations, rad.
    pub fn rotation_noise(&self) -> Option<f64> {
        self.capture
            .noise
            .rotation
            .or_else(|| self.segmented.and_then(|s| s.rotation_noise))
    }
}

/// Way and time within which what was let go before has come to rest, m and s, and the way in units of the noise.
const RESTS: (f64, f64) = (4e-3, 0.2);
const JITTERS: f64 = 10.0;

/// The first row from which on it does not go far for a while.
fn comes_to_rest(track: &PoseStream, noise: f64) -> Option<usize> {
    let known = |i: &usize| track.position[*i].coords.iter().all(|x| x.is_finite());
    let stays = |i: usize| {
        let soon = (i..track.len()).take_while(|k| track.time[*k] <= track.time[i] + RESTS.1);
        let away = soon
            .filter(known)
            .map(|k| (track.position[k] - track.position[i]).norm());
        known(&i) && away.fold(0.0, f64::max) < RESTS.0.max(JITTERS * noise)
    };
    (0..track.len()).find(|i| stays(*i))
}

/// Nothing is done: everything stays where it is, from where it comes to rest on if it does.
fn hold(scene: &Scene) -> Outcome {
    let rest = first_rest(scene.interaction, scene.segmented);
    let mut curves = Vec::new();
    for (name, track) in &scene.interaction.tracks {
        let Some(mut start) = rest_pose(track, rest) else {
            continue;
        };
        let rests = comes_to_rest(track, scene.position_noise().unwrap_or(0.0)).unwrap_or(0);
        // What still moves as it begins is judged from where it comes to rest.
        if rests > 0 {
            let soon = (rests..track.len()).take_while(|k| track.time[*k] <= track.time[rests] + RESTS.1);
            let x: Vec<f64> = soon.map(|k| track.position[k].x).filter(|x| x.is_finite()).collect();
            start.0.translation.vector.x = median(&x).unwrap_or(start.0.translation.vector.x);
        }
        let away = |p: &Point3<f64>| p.x - start.translation.vector.x;
        let stays = |i: usize| if i < rests { f64::NAN } else { 0.0 };
        curves.push(Curve {
            label: format!("{name}: x"),
            quantity: Quantity::Position,
            time: track.time.clone(),
            measured: track.position.iter().map(away).collect(),
            predicted: (0..track.len()).map(stays).collect(),
            noise: scene.position_noise(),
        });
    }
    if curves.is_empty() {
        Err("nothing is tracked".into())
    } else {
        curves_alone(curves, None)
    }
}

fn press(scene: &Scene, action: &Action) -> Outcome {
    let link = scene
        .model
        .twin
        .link(&action.target)
        .ok_or("what is pressed is not in the twin")?;
    let spring = link.stiffness.as_ref().ok_or("no stiffness is known")?;
    let damper = link.damping.as_ref();
    let (stiffness, damping) = (spring.value, damper.map_or(0.0, |d| d.value));
    let up = support_normal(scene.capture, scene.model);
    let (time, force, noise) = scene.binned_force(0.01).ok_or("there is no force")?;
    let measured: Vec<f64> = force.iter().map(|f| -f.dot(&up)).collect();
    let down: Vec<f64> = action.tool.position.iter().map(|p| -p.coords.dot(&up)).collect();
    let tool: Vec<f64> = time
        .iter()
        .map(|t| interpolate(&action.tool.time, &down, *t).unwrap_or(f64::NAN))
        .collect();
    let tool = average(&tool, 2);
    let peak = measured.iter().copied().fold(0.0, f64::max);
    let foretold = |travel: &[f64], [stiffness, damping]: [f64; 2]| {
        // Where the surface begins is new in every press: the median over the loaded samples.
        let contacts: Vec<f64> = (0..time.len())
            .filter(|i| measured[*i] > 0.3 * peak)
            .map(|i| travel[i] - measured[i] / stiffness)
            .collect();
        let spot = Press {
            stiffness,
            damping,
            contact: median(&contacts)?,
        };
        Some(predict_press(&spot, &time, travel))
    };
    let best = [Some(tool), body_travel(scene, action, &time)].into_iter().flatten();
    let best = best.filter_map(|travel| {
        let predicted = foretold(&travel, [stiffness, damping])?;
        let error: f64 = predicted
            .iter()
            .zip(&measured)
            .map(|(p, m)| (p - m).powi(2))
            .filter(|e| e.is_finite())
            .sum();
        Some((error, predicted, travel))
    });
    let (_, predicted, travel) = best
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .ok_or("the tool never pressed")?;
    let others = [
        [stiffness + spring.sd.unwrap_or(0.0), damping],
        [stiffness, damping + damper.and_then(|d| d.sd).unwrap_or(0.0)],
    ];
    let others = others.map(|numbers| foretold(&travel, numbers));
    let by = |other: &Option<Vec<f64>>, i: usize| other.as_ref().map_or(0.0, |o| o[i] - predicted[i]);
    let doubt: Vec<f64> = (0..predicted.len())
        .map(|i| others.iter().map(|o| by(o, i).powi(2)).sum::<f64>().sqrt())
        .collect();
    let label = "force into the support".into();
    let curve = Curve {
        label,
        quantity: Quantity::Force,
        time,
        measured,
        predicted,
        noise,
    };
    Ok(Predicted {
        doubt: vec![doubt],
        ..curves_alone(
            vec![curve],
            Some("the height of first contact is fitted anew for each press"),
        )?
    })
}

/// How far the pressed body itself went down: for things whose tracked top is what gives way.
fn body_travel(scene: &Scene, action: &Action, time: &[f64]) -> Option<Vec<f64>> {
    let track = scene.interaction.tracks.get(&action.target)?;
    let up = support_normal(scene.capture, scene.model);
    let down: Vec<f64> = track.position.iter().map(|p| -p.coords.dot(&up)).collect();
    let at = |t: &f64| interpolate(&track.time, &down, *t).unwrap_or(f64::NAN);
    Some(average(&time.iter().map(at).collect::<Vec<_>>(), 4))
}

/// Moving average over `half` samples on either side.
fn average(x: &[f64], half: usize) -> Vec<f64> {
    let window = |i: usize| &x[i.saturating_sub(half)..(i + half + 1).min(x.len())];
    (0..x.len())
        .map(|i| window(i).iter().sum::<f64>() / window(i).len() as f64)
        .collect()
}

fn tilt(scene: &Scene) -> Outcome {
    let target = scene
        .interaction
        .target
        .as_ref()
        .or_else(|| scene.interaction.tracks.keys().next());
    let target = target.ok_or("nothing is tracked")?;
    let link = scene.model.twin.link(target).ok_or("what slides is not in the twin")?;
    let (Some(holds), Some(slides)) = (&link.friction.static_, &link.friction.kinetic) else {
        return Err("friction is not known".into());
    };
    let track = scene
        .interaction
        .tracks
        .get(target)
        .ok_or("the target is not tracked")?;
    let turned = super::slope::slope(scene, track).ok_or("the support's path is missing")?;
    let gravity = scene.capture.gravity.norm();
    let foretold = |kinetic: f64| {
        let onset_free = (-20..=20).map(|k| holds.value + 0.005 * f64::from(k));
        let best = onset_free.map(|mu| {
            let out = predict_tilt(&track.time, &turned.angle, mu, kinetic, gravity);
            let error: f64 = out
                .slid
                .iter()
                .zip(&turned.slid)
                .map(|(p, m)| (p - m).powi(2))
                .filter(|e| e.is_finite())
                .sum();
            (error, out.slid)
        });
        Some(best.min_by(|a, b| a.0.total_cmp(&b.0))?.1)
    };
    let predicted = foretold(slides.value).ok_or("nothing slid")?;
    let other = foretold(slides.value + slides.sd.unwrap_or(0.0)).ok_or("nothing slid")?;
    let doubt = predicted.iter().zip(&other).map(|(p, o)| (p - o).abs()).collect();
    let curve = Curve {
        label: format!("{target}: down the slope"),
        quantity: Quantity::Position,
        time: track.time.clone(),
        measured: turned.slid,
        predicted,
        noise: scene.position_noise(),
    };
    Ok(Predicted {
        doubt: vec![doubt],
        ..curves_alone(
            vec![curve],
            Some("the moment at which it lets go is fitted anew for each tilt"),
        )?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A track of 50 rows a second that goes at so many m/s up to a time, and stays.
    fn track(speed: f64, until: f64) -> PoseStream {
        let time: Vec<f64> = (0..50).map(|i| 0.02 * f64::from(i)).collect();
        PoseStream {
            position: time
                .iter()
                .map(|t| Point3::new(speed * t.min(until), 0.0, 0.0))
                .collect(),
            rotation: vec![None; time.len()],
            time,
        }
    }

    #[test]
    fn what_was_let_go_comes_to_rest_where_it_stops() {
        assert_eq!(comes_to_rest(&track(0.0, 0.0), 1e-4), Some(0));
        let row = comes_to_rest(&track(0.3, 0.4), 1e-4).expect("it stops");
        assert!((19..=20).contains(&row), "{row}");
        // What creeps stays near enough for a while, to be judged from where it was.
        assert_eq!(comes_to_rest(&track(0.01, 9.0), 1e-4), Some(0));
    }
}
