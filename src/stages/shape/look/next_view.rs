//! `NextView`: where to look next, why, and when it is enough.

use nalgebra::{Point3, UnitVector3};
use rayon::prelude::*;

use super::belief::Belief;
use super::expect::{Gain, Prospect};
use crate::base::{Error, Pose, Result};
use crate::capture::{Camera, Reach, Support, View};
use crate::geometry::Plane;

/// Sine of the elevation of the first view.
const OVERVIEW: f64 = 0.85;

/// Settings of the choice of views; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct NextViewConfig {
    /// Edge of a voxel of the belief, m.
    pub voxel: f64,
    /// Candidate poses spread over what the rig reaches.
    pub candidates: usize,
    /// Views before it may stop.
    pub least_views: usize,
    /// It stops where the best view is expected to add less than this share of the surface seen so far.
    pub least_gain: f64,
    /// How near a reading must be to a spot of a surface that it shows it, m.
    pub tolerance: f64,
}

impl Default for NextViewConfig {
    fn default() -> Self {
        Self {
            voxel: 0.004,
            candidates: 96,
            least_views: 4,
            least_gain: 0.0025,
            tolerance: 0.004,
        }
    }
}

impl NextViewConfig {
    /// Refuses settings that cannot work.
    ///
    /// # Errors
    /// [`Error::Usage`] that says which.
    pub fn check(&self) -> Result<()> {
        if self.voxel > 0.0 && self.candidates > 0 && self.tolerance > 0.0 && self.least_gain >= 0.0 {
            return Ok(());
        }
        Err(Error::Usage(
            "next view: the voxel, the tolerance and the number of candidates must be positive, the gain not negative"
                .into(),
        ))
    }
}

/// A chosen view with its reason.
#[derive(Clone, Debug)]
pub struct ViewChoice {
    /// World-from-camera.
    pub world_from_camera: Pose,
    /// What the ray casting found.
    pub gain: Gain,
    /// Surface that it is expected to add, m²: the gain, corrected by how earlier ones came true.
    pub expected: f64,
    /// Expected over what was seen so far.
    pub share: f64,
    /// The reason in words.
    pub why: String,
}

/// What comes next.
#[derive(Clone, Debug)]
pub enum Decision {
    /// Look from there.
    Look(Box<ViewChoice>),
    /// It is enough; why.
    Stop(String),
}

/// Chooses views one after the other from what the ones before have shown.
pub struct NextView {
    config: NextViewConfig,
    camera: Camera,
    belief: Belief,
    candidates: Vec<Pose>,
    taken: usize,
    /// What the last choice promised, and the surface that was seen before it, m².
    pending: Option<(f64, f64)>,
    /// Sums of what choices promised and of what came, m².
    record: (f64, f64),
}

impl NextView {
    /// A planner for `camera`, which can go where `reach` says, over the box `workspace` (world).
    ///
    /// # Errors
    /// Settings that cannot work, and a reach without any pose.
    pub fn new(
        config: NextViewConfig,
        camera: &Camera,
        reach: &Reach,
        workspace: [Point3<f64>; 2],
        support: Option<&Support>,
    ) -> Result<Self> {
        config.check()?;
        let candidates = reach.poses(config.candidates);
        if candidates.is_empty() {
            return Err(Error::Failed(
                "the rig can reach no pose from which it would look down".into(),
            ));
        }
        let plane = support.map(|s| Plane::through(&s.point, UnitVector3::new_normalize(s.normal.into_inner())));
        Ok(Self {
            belief: Belief::new(workspace, &config, plane),
            camera: camera.clone(),
            config,
            candidates,
            taken: 0,
            pending: None,
            record: (0.0, 0.0),
        })
    }

    /// Takes in a view of `camera`, whether it was chosen here or not.
    pub fn add(&mut self, camera: &Camera, view: &View) {
        self.belief.add(camera, view);
        let missed = Prospect::new(&self.belief).missed(camera, &view.world_from_camera);
        for (at, shown) in missed {
            self.belief.miss(at, shown);
        }
        self.taken += 1;
        if let Some((promised, before)) = self.pending.take() {
            self.record.0 += promised;
            self.record.1 += (self.belief.seen_area() - before).max(0.0);
        }
    }

    /// The pose that the rig refused is not offered again.
    pub fn refuse(&mut self, pose: &Pose) {
        self.candidates.retain(|candidate| candidate != pose);
        self.pending = None;
    }

    /// Surface seen so far, m².
    pub fn seen_area(&self) -> f64 {
        self.belief.seen_area()
    }

    /// The best candidate, or that none is worth its while.
    pub fn decide(&mut self) -> Decision {
        if self.candidates.is_empty() {
            return Decision::Stop("the rig refused every pose that was left".into());
        }
        if self.taken == 0 {
            return self.first();
        }
        let prospect = Prospect::new(&self.belief);
        let gains: Vec<Gain> = self
            .candidates
            .par_iter()
            .map(|pose| prospect.gain(&self.camera, pose))
            .collect();
        let mut best = 0;
        for (i, gain) in gains.iter().enumerate() {
            if gain.total() > gains[best].total() {
                best = i;
            }
        }
        self.judge(best, gains[best])
    }

    /// Nothing is known yet: an overview, steep enough to look over what stands in front, from as far as the rig can go.
    fn first(&mut self) -> Decision {
        let middle = self.middle();
        let score = |pose: &Pose| {
            let way = pose.translation.vector - middle.coords;
            let up = way.z / way.norm().max(1e-9);
            (up - OVERVIEW).abs() - 0.2 * way.norm()
        };
        let pose = self
            .candidates
            .iter()
            .min_by(|a, b| score(a).total_cmp(&score(b)))
            .copied()
            .unwrap_or_else(Pose::identity);
        Decision::Look(Box::new(ViewChoice {
            world_from_camera: pose,
            gain: Gain::default(),
            expected: f64::NAN,
            share: f64::NAN,
            why: "nothing is known yet: an overview".into(),
        }))
    }

    fn middle(&self) -> Point3<f64> {
        self.belief.centre(self.belief.size.map(|n| n / 2))
    }

    fn judge(&mut self, best: usize, gain: Gain) -> Decision {
        let seen = self.belief.seen_area();
        // The chances are rough; how the earlier promises came true corrects them, from one cautious made-up view on.
        let prior = 0.3 * gain.total();
        let ratio = (self.record.1 + prior) / (self.record.0 + gain.total()).max(1e-12);
        let ratio = if self.record.0 > 0.0 { ratio.min(1.0) } else { 1.0 };
        let expected = gain.total() * ratio;
        let share = expected / seen.max(1e-6);
        if self.taken >= self.config.least_views && share < self.config.least_gain {
            return Decision::Stop(format!(
                "the best of {} poses is expected to add {:.1} cm², {:.2} % of the {:.0} cm² that were seen: below {:.2} %",
                self.candidates.len(),
                expected * 1e4,
                share * 100.0,
                seen * 1e4,
                self.config.least_gain * 100.0,
            ));
        }
        self.pending = Some((gain.total(), seen));
        let pose = self.candidates[best];
        Decision::Look(Box::new(ViewChoice {
            world_from_camera: pose,
            gain,
            expected,
            share,
            why: self.reason(&pose, &gain, expected, share),
        }))
    }

    fn reason(&self, pose: &Pose, gain: &Gain, expected: f64, share: f64) -> String {
        let way = pose.translation.vector - self.middle().coords;
        let azimuth = way.y.atan2(way.x).to_degrees().rem_euclid(360.0);
        let elevation = (way.z / way.norm().max(1e-9)).asin().to_degrees();
        format!(
            "best of {} poses: expected to add {:.1} cm² ({:.1} % of what was seen; {:.1} cm² unseen and {:.1} cm² of what \
             is known but was seen in part), from azimuth {azimuth:.0}°, \
             elevation {elevation:.0}°, {:.2} m away",
            self.candidates.len(),
            expected * 1e4,
            share * 100.0,
            gain.unseen * 1e4,
            gain.better * 1e4,
            way.norm(),
        )
    }
}
