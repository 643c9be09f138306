//! Captures that the lab films, with the motion that it knows kept aside.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Vector6};
use palpate::base::{Notices, Progress, Seed};
use palpate::capture::{Capture, PoseStream};
use palpate::geometry::SurfaceDistance;
use palpate::lab::{Scene, build_solids, synthesise};
use palpate::stages::shape::{Config, Shapes, VisualTrack, reconstruct};

/// A filmed capture without tracks, where its bodies stood when the views were taken, and the true tracks at the times
/// of its images by interaction and body.
pub struct Filmed {
    pub capture: Capture,
    pub home: BTreeMap<String, Isometry3<f64>>,
    pub truth: BTreeMap<(String, String), PoseStream>,
}

/// Films `scene`; every body's true motion is told beside the capture, never in it.
pub fn filmed(mut scene: Scene, seed: u64) -> Filmed {
    let film = scene.film.clone().expect("a film");
    scene.body.iter_mut().for_each(|b| b.tracked = true);
    (scene.noise.position, scene.noise.rotation) = (0.0, 0.0);
    scene.noise.track_rate = film.rate;
    let mut capture = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent())
        .expect("a capture")
        .capture;
    let solids = build_solids(&scene, Path::new(".")).expect("solids");
    let home = solids.values().map(|s| (s.name.clone(), s.world_from_body.0)).collect();
    let mut truth = BTreeMap::new();
    for interaction in &mut capture.interactions {
        for (name, track) in std::mem::take(&mut interaction.tracks) {
            truth.insert((interaction.name.clone(), name), track);
        }
    }
    Filmed { capture, home, truth }
}

pub fn shapes(capture: &Capture) -> Shapes {
    reconstruct(capture, &Config::default(), &mut Notices::default()).expect("shapes")
}

/// How a track errs against the true motion of `body` since the first view.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// m.
    pub position: Vec<f64>,
    /// rad.
    pub rotation: Vec<f64>,
    /// Squares of the errors in units of the stated covariance; 6 on average where that is honest.
    pub normalised: Vec<f64>,
    /// Rows that are missing.
    pub lost: usize,
}

impl Errors {
    /// `first` is where the body truly stood at the views, `home` where its link was put.
    pub fn of(track: &VisualTrack, truth: &PoseStream, first: &Isometry3<f64>, home: &Isometry3<f64>) -> Self {
        let mut out = Self::default();
        for i in 0..track.track.len() {
            let (Some(found), Some(covariance)) = (track.track.pose(i), track.covariance[i]) else {
                out.lost += 1;
                continue;
            };
            let right = truth.pose(i.min(truth.len() - 1)).expect("a pose").0 * first.inverse() * home;
            let shift = found.0.translation.vector - right.translation.vector;
            let turn = (found.0.rotation * right.rotation.inverse()).scaled_axis();
            out.position.push(shift.norm());
            out.rotation.push(turn.norm());
            let error = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let inverse = covariance.try_inverse().expect("a covariance");
            out.normalised.push((error.transpose() * inverse * error)[0]);
        }
        out
    }

    pub fn rms(&self) -> (f64, f64) {
        let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len().max(1) as f64).sqrt();
        (1e3 * rms(&self.position), rms(&self.rotation).to_degrees())
    }

    pub fn median_normalised(&self) -> f64 {
        let mut all = self.normalised.clone();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
    }
}

/// Share of the seen surface of the parts that lies on the right one of the true bodies, under the better of the two
/// ways to pair them; what lies on neither (the cut) is left out.
pub fn share_right(scene: &Scene, shapes: &Shapes) -> f64 {
    let solids = build_solids(scene, Path::new(".")).expect("solids");
    let true_surfaces: Vec<SurfaceDistance> = solids
        .values()
        .map(|s| SurfaceDistance::new(&s.mesh.transformed(&s.world_from_body.0)).expect("a surface"))
        .collect();
    let mut areas = [[0.0; 2]; 2];
    for (k, object) in shapes.objects.iter().take(2).enumerate() {
        let mesh = object.mesh.transformed(&object.world_from_link.0);
        for t in 0..mesh.triangles.len() {
            if !mesh.triangles[t].iter().all(|v| mesh.seen[*v as usize]) {
                continue;
            }
            let [a, b, c] = mesh.corners(t);
            let middle = nalgebra::Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let distances: Vec<f64> = true_surfaces.iter().map(|s| s.distance(&middle)).collect();
            let nearest = usize::from(distances[1] < distances[0]);
            if distances[nearest] < 0.003 {
                areas[k][nearest] += 0.5 * mesh.scaled_normal(t).norm();
            }
        }
    }
    let all: f64 = areas.iter().flatten().sum();
    (areas[0][0] + areas[1][1]).max(areas[0][1] + areas[1][0]) / all
}
