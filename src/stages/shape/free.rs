//! Space that the views saw to be empty.

use nalgebra::Point3;
use rayon::prelude::*;

use super::Config;
use super::fields::ranges;
use super::range::{Range, Reading};
use crate::capture::Capture;

/// How far before a reading space is empty for sure, voxels.
const MARGIN: f64 = 2.0;
/// Views that must agree, where there are several: single readings fly.
const AGREE: usize = 2;

/// The views of a capture, ready to be asked whether a place was seen to be empty.
pub struct FreeSpace<'a> {
    ranges: Vec<Range<'a>>,
    margin: f64,
}

impl<'a> FreeSpace<'a> {
    /// From the views; without any, nothing is known to be empty.
    pub fn new(capture: &'a Capture, config: &Config) -> Self {
        Self {
            // Views that do not fit their camera say nothing.
            ranges: ranges(capture).unwrap_or_default(),
            margin: MARGIN * config.voxel,
        }
    }

    /// Whether there is anything to ask.
    pub fn is_known(&self) -> bool {
        !self.ranges.is_empty()
    }

    /// Whether views looked through a place, world frame, and more of them did than saw something there.
    pub fn is_free(&self, p: &Point3<f64>) -> bool {
        let votes = self.ranges.iter().map(|range| self.vote(range, p));
        let (free, near) = votes.fold((0, 0), |(f, n), v| (f + usize::from(v == 1), n + usize::from(v == -1)));
        free >= AGREE.min(self.ranges.len()).max(1) && free > 2 * near
    }

    /// 1 where a view looked through, -1 where it saw something near, 0 where it says nothing.
    fn vote(&self, range: &Range, p: &Point3<f64>) -> i8 {
        match range.read(p) {
            Reading::Surface(distance) if distance > self.margin => 1,
            Reading::Surface(distance) if distance.abs() <= self.margin => -1,
            Reading::Edge(gap) if gap > self.margin => 1,
            _ => 0,
        }
    }

    /// The answers for many places at once.
    pub fn are_free(&self, points: &[Point3<f64>]) -> Vec<bool> {
        points.par_iter().map(|p| self.is_free(p)).collect()
    }
}
