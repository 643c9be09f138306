//! Friction between tool and body, and the torsional radius, from how a pushed body turns and drifts aside.
//!
//! A finger that slides along a face tells its friction by the direction of its force ([`super::slip`]); one that sticks
//! bounds it. The path then tells the torsional radius: a finger that slides lets the body turn away, one that sticks
//! drags the face along. All pushes of a body are replayed with the ellipsoidal limit surface (the forward model of the
//! physics room) against the measured motion.

use nalgebra::{DVector, UnitQuaternion};
use rayon::prelude::*;

use super::action::{action_of, first_rest, rest_pose};
use super::replay::{replay_push, travel_direction};
use super::slip::{Slip, finger_friction, slip_of};
use crate::base::{Estimate, Pose};
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::{Fit, Loss, Settings, interpolate, levenberg_marquardt};
use crate::physics::{Action, uniform_torsional_radius};
use crate::twin::{Link, Model};

/// Prior of the friction between finger and body: median and log-sd.
const PRIOR_TOOL: (f64, f64) = (0.4, 0.7);
/// Least doubt of the friction in the law that paths are replayed with, of its logarithm.
const LEAST_DOUBT: f64 = 0.05;
/// Log-sd of the torsional radius about what the forces or the footprint say.
const PRIOR_RADIUS: f64 = 0.25;
/// A torsional radius that the forces leave more open than this share says less than the footprint does.
const VAGUE: f64 = 0.2;
/// Where the search for the tool's friction begins.
const STARTS: [f64; 6] = [0.06, 0.12, 0.2, 0.3, 0.45, 0.8];
/// Residuals of a fit that are of what was known before; frictions over the best and torsional radii over it with which a finger
/// that sticks is tried, and by how much it has to do worse, nats: three fingers of MuJoCo worlds that stuck came to 6 and 7, eight
/// that slid, in the lab and in another world, to 14 and more.
const KNOWN: usize = 3;
const FIRMER: [f64; 3] = [2.0, 3.0, 8.0];
const RADII: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.2];
const UNLIKE: f64 = 12.0;
/// What the paths may miss in units of what the model may, and how near the next steepest push has to come: friction is a limit.
const FAIR: f64 = 2.0;
const ALIKE: f64 = 0.94;
/// How well the steepest force tells the friction of a finger that slides, as a share.
const STEEP: f64 = 0.1;
/// What the model may miss of a path, m and rad.
const MISS: (f64, f64) = (0.0007, 0.008);
/// Samples of a path that are compared.
const SAMPLES: usize = 10;

struct Trial<'a> {
    interaction: &'a Interaction,
    segmented: Option<&'a Segmented>,
    action: Action,
    gap: f64,
    /// Times, drift across the push (m) and heading (rad) as measured.
    path: Vec<(f64, f64, f64)>,
    /// What force and motion at the contact say.
    slip: Option<Slip>,
}

/// What is believed of the finger's friction and of the torsional radius before the paths are fitted: logarithms with
/// standard deviations, and the logarithm that the friction is not below.
struct Prior {
    mean: [f64; 2],
    sd: [f64; 2],
    least: f64,
}

/// Writes `friction.tool` and refines `friction.torsional_radius` of every rigid body that was pushed.
pub fn fit_fingers(capture: &Capture, segmented: &[Segmented], model: &mut Model) {
    let names: Vec<String> = model
        .twin
        .bodies
        .iter()
        .filter(|b| b.links.len() == 1)
        .map(|b| b.name.clone())
        .collect();
    for name in names {
        if let Some((tool, radius)) = fit_body(capture, segmented, model, &name)
            && let Some(link) = model.twin.link_mut(&name)
        {
            link.friction.tool = Some(tool);
            link.friction.torsional_radius = Some(radius);
        }
    }
}

fn fit_body(capture: &Capture, segmented: &[Segmented], model: &Model, name: &str) -> Option<(Estimate, Estimate)> {
    let link = model.twin.link(name)?;
    link.friction_force.kinetic.as_ref().filter(|f| f.is_measured())?;
    let small = alone(model, link)?;
    let find = |i: &Interaction| segmented.iter().find(|s| s.interaction == i.name);
    let pushes: Vec<&Interaction> = capture
        .fitted()
        .filter(|i| i.kind == Kind::Push && i.target.as_deref() == Some(name))
        .collect();
    let trials: Vec<Trial> = pushes
        .into_par_iter()
        .filter_map(|i| trial(capture, i, find(i), &small, name))
        .collect();
    if trials.is_empty() {
        return None;
    }
    let before = radius_before(&small, link);
    let slips: Vec<Slip> = trials.iter().filter_map(|t| t.slip.clone()).collect();
    let direct = finger_friction(&slips, PRIOR_TOOL);
    let slid = direct.as_ref().filter(|e| e.is_measured());
    let (tool, tool_sd) = slid.map_or(PRIOR_TOOL, |e| {
        (
            e.value,
            (e.sd.unwrap_or(0.0) / e.value).clamp(LEAST_DOUBT, PRIOR_TOOL.1),
        )
    });
    let prior = Prior {
        mean: [tool.ln(), before.ln()],
        sd: [tool_sd, PRIOR_RADIUS],
        least: slips.iter().map(|s| s.least).fold(1e-3, f64::max).min(tool).ln(),
    };
    let settle = |prior: &Prior| settled(&|x| misfit(&small, name, &trials, x, prior), prior);
    let (mut fit, mut direct) = (settle(&prior)?, direct);
    if let Some(slid) = slid_by_the_path(&slips, direct.as_ref(), &fit, &|x| {
        misfit(&small, name, &trials, x, &prior)
    }) {
        let sd = (slid.sd.unwrap_or(0.0) / slid.value).max(LEAST_DOUBT);
        let told = Prior {
            mean: [slid.value.ln(), prior.mean[1]],
            sd: [sd, prior.sd[1]],
            least: slid.value.ln() - 2.0 * sd,
        };
        (fit, direct) = (settle(&told)?, Some(slid));
    }
    // Where only an absurd radius would do, something else bends the path: nothing is learnt of the finger.
    if (fit.x[1] - prior.mean[1]).abs() > 2.5 * PRIOR_RADIUS {
        return None;
    }
    let scale = (2.0 * fit.cost / fit.residuals.len().max(1) as f64).sqrt().max(1.0);
    let from: Vec<String> = trials.iter().map(|t| t.interaction.name.clone()).collect();
    let estimate = |k: usize, prior: f64, typical: f64, unit: &str| {
        let (value, log_sd) = (fit.x[k].exp(), (fit.sd(k) * scale).min(prior));
        let interval = [value * (-1.96 * log_sd).exp(), value * (1.96 * log_sd).exp()];
        // The prior says as much as the data: a finger that never slid bounds its friction from below only.
        let made = if log_sd < 0.5 * prior || value * log_sd < 0.1 * typical {
            Estimate::measured(value, value * log_sd, unit, from.clone(), "push-path")
        } else {
            Estimate {
                from: from.clone(),
                ..Estimate::assumed(value, value * log_sd, unit, "push-path, prior")
            }
        };
        made.with_interval(interval)
    };
    // Path and force agree where both tell; the path alone would call a bound a number.
    let tool = direct.unwrap_or_else(|| estimate(0, PRIOR_TOOL.1, PRIOR_TOOL.0, "1"));
    Some((tool, estimate(1, PRIOR_RADIUS, before, "m")))
}

/// The friction and the radius that foretell the paths best.
fn settled(residuals: &(dyn Fn(&DVector<f64>) -> DVector<f64> + Sync), prior: &Prior) -> Option<Fit> {
    let settings = Settings {
        loss: Loss::Huber(2.0),
        iterations: 8,
        tolerance: 1e-3,
    };
    // A sticking finger has no slope towards a sliding one: start where the misfit is least.
    let starts = STARTS.into_iter().map(f64::ln).chain([prior.mean[0]]);
    let start = starts
        .map(|mu| DVector::from_vec(vec![mu, prior.mean[1]]))
        .map(|at| (residuals(&at).norm(), at))
        .min_by(|a, b| a.0.total_cmp(&b.0))?
        .1;
    levenberg_marquardt(&start, &DVector::from_element(2, 0.06), settings, residuals)
}

/// Where only the paths tell that the finger slid, too slowly to be seen: its friction is how steep its force was at most.
///
/// It slid where no finger that holds better, with any torsional radius, foretells the paths about as well.
fn slid_by_the_path(
    slips: &[Slip],
    bound: Option<&Estimate>,
    best: &Fit,
    residuals: &(dyn Fn(&DVector<f64>) -> DVector<f64> + Sync),
) -> Option<Estimate> {
    bound.filter(|b| !b.is_measured())?;
    let steepest = slips.iter().max_by(|a, b| a.most.total_cmp(&b.most))?;
    let reached = slips.iter().filter(|s| s.most > ALIKE * steepest.most).count();
    let scale = (2.0 * best.cost / best.residuals.len().max(1) as f64).sqrt().max(1.0);
    if reached < 2 || scale > FAIR {
        return None;
    }
    let cost = |x: &DVector<f64>| {
        let own = residuals(x);
        let each = own.iter().skip(KNOWN).map(|r| (r / scale).abs());
        each.map(|r| if r < 2.0 { 0.5 * r * r } else { 2.0 * r - 2.0 })
            .sum::<f64>()
    };
    let mut firmer = FIRMER
        .iter()
        .flat_map(|f| RADII.map(|r| DVector::from_vec(vec![(f * steepest.most).ln(), best.x[1] + f64::ln(r)])));
    let least = cost(&best.x);
    (best.x[0].exp() < FIRMER[0] * steepest.most && firmer.all(|x| cost(&x) > least + UNLIKE)).then(|| {
        let sd = STEEP * steepest.most;
        let from = vec![steepest.interaction.clone()];
        Estimate::measured(steepest.most, sd, "1", from, "push-slip, as the paths tell")
    })
}

/// What the forces said, as far as a footprint can have it: pressure at the centre gives nothing, all of it
/// at the rim about half more than uniform pressure.
fn radius_before(model: &Model, link: &Link) -> f64 {
    let mesh = link.mesh.as_ref().and_then(|m| model.meshes.get(m));
    let uniform = mesh
        .and_then(|m| uniform_torsional_radius(m, &link.pose.0))
        .unwrap_or(0.03);
    let clear = |r: &&Estimate| r.sd.is_some_and(|sd| sd < VAGUE * r.value);
    let said = link.friction.torsional_radius.as_ref().filter(clear).map(|r| r.value);
    said.filter(|r| (0.5 * uniform..1.6 * uniform).contains(r))
        .unwrap_or(uniform)
}

/// A model of this one link.
fn alone(model: &Model, link: &Link) -> Option<Model> {
    let mut small = Model {
        twin: model.twin.clone(),
        meshes: Default::default(),
        textures: Default::default(),
    };
    small.twin.bodies.retain(|b| b.name == link.name);
    let path = link.mesh.as_ref()?;
    small.meshes.insert(path.clone(), model.meshes.get(path)?.clone());
    Some(small)
}

fn trial<'a>(
    capture: &Capture,
    interaction: &'a Interaction,
    segmented: Option<&'a Segmented>,
    small: &Model,
    name: &str,
) -> Option<Trial<'a>> {
    let action = action_of(capture, interaction, segmented, small)?;
    let track = interaction.tracks.get(name).filter(|t| t.len() > 20)?;
    let start = rest_pose(track, first_rest(interaction, segmented))?;
    let direction = travel_direction(&action)?;
    let (gap, found) = replay_push(small, interaction, segmented, &action, 0.0, 3)?;
    let (first, last) = (found.contact.first()?.0, found.contact.last()?.1);
    let across = action.normal.cross(&direction);
    let drift: Vec<f64> = track
        .position
        .iter()
        .map(|p| (p.coords - start.translation.vector).dot(&across))
        .collect();
    let turn = |q: &Option<UnitQuaternion<f64>>| {
        q.map_or(f64::NAN, |q| {
            (q * start.rotation.inverse()).scaled_axis().dot(&action.normal)
        })
    };
    let heading: Vec<f64> = track.rotation.iter().map(turn).collect();
    let at = |k: usize| {
        let t = first + (last - first) * (k + 1) as f64 / SAMPLES as f64;
        Some((t, near(&track.time, &drift, t)?, near(&track.time, &heading, t)?))
    };
    let path = (0..SAMPLES).filter_map(at).collect();
    let slip = segmented.and_then(|cut| slip_of(small, name, interaction, cut, &action));
    Some(Trial {
        interaction,
        segmented,
        action,
        gap,
        path,
        slip,
    })
}

/// Mean of the samples within 50 ms.
fn near(time: &[f64], values: &[f64], t: f64) -> Option<f64> {
    let rows = (0..time.len()).filter(|i| (time[*i] - t).abs() < 0.05 && values[*i].is_finite());
    let (sum, count) = rows.fold((0.0, 0.0), |(s, n), i| (s + values[i], n + 1.0));
    (count > 0.0).then(|| sum / count)
}

fn misfit(small: &Model, name: &str, trials: &[Trial], x: &DVector<f64>, prior: &Prior) -> DVector<f64> {
    let mut model = small.clone();
    if let Some(link) = model.twin.link_mut(name) {
        link.friction.tool = Some(Estimate::assumed(x[0].exp(), 0.0, "1", "trial"));
        link.friction.torsional_radius = Some(Estimate::assumed(x[1].exp(), 0.0, "m", "trial"));
    }
    let mut out: Vec<f64> = (0..2).map(|k| (x[k] - prior.mean[k]) / prior.sd[k]).collect();
    out.push((prior.least - x[0]).max(0.0) / LEAST_DOUBT);
    let paths: Vec<Vec<f64>> = trials
        .par_iter()
        .map(|trial| path_misfit(&model, name, trial))
        .collect();
    out.extend(paths.into_iter().flatten());
    DVector::from_vec(out)
}

/// Drift and heading, predicted less measured, in units of what the model may miss.
fn path_misfit(model: &Model, name: &str, trial: &Trial) -> Vec<f64> {
    let replayed = replay_push(model, trial.interaction, trial.segmented, &trial.action, trial.gap, 1);
    let poses = replayed
        .as_ref()
        .and_then(|(_, p)| Some((&p.prediction.time, p.prediction.poses.get(name)?)));
    let (Some((time, poses)), Some(direction)) = (poses, travel_direction(&trial.action)) else {
        return vec![0.0; 2 * trial.path.len()];
    };
    let across = trial.action.normal.cross(&direction);
    let start = poses[0];
    let drift: Vec<f64> = poses
        .iter()
        .map(|p| (p.translation.vector - start.translation.vector).dot(&across))
        .collect();
    let turn = |p: &Pose| {
        (p.rotation * start.rotation.inverse())
            .scaled_axis()
            .dot(&trial.action.normal)
    };
    let heading: Vec<f64> = poses.iter().map(turn).collect();
    // Samples of one push go wrong together: one push counts as a few, not as many, observations.
    let shared = (trial.path.len() as f64 / 3.0).max(1.0).sqrt();
    let compare = |(t, d, h): &(f64, f64, f64)| {
        let p = interpolate(time, &drift, *t).unwrap_or(*d) - d;
        let r = interpolate(time, &heading, *t).unwrap_or(*h) - h;
        [p / (MISS.0 * shared), r / (MISS.1 * shared)]
    };
    trial.path.iter().flat_map(compare).collect()
}
