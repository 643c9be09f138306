//! What a twin's estimates leave open of one thing: a normal distribution over what touches can tell.

use nalgebra::{Isometry3, Point2, Point3, SMatrix, SVector, Vector2, Vector3};
use rand::Rng;
use rand_distr::StandardNormal;

use super::super::Config;
use super::super::pool::relative_sd;
use super::super::solid::solid_of;
use super::thing::Thing;
use crate::base::{Estimate, Status};
use crate::geometry::Mesh;
use crate::twin::Link;

/// Logarithm of mass, logarithm of kinetic friction, centre of mass (two axes of the plane, m), logarithms of the
/// torsional radius and of the friction with the tool.
pub(super) const UNKNOWNS: usize = 6;
pub(super) type State = SVector<f64, UNKNOWNS>;
pub(super) type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Friction between tool and thing before it is measured, and the standard deviation of its logarithm.
const TOOL: (f64, f64) = (0.4, 0.5);
/// Share of the extent by which the centre of mass may be off the centroid (1 sd).
const OFF: f64 = 0.12;

/// Mean and information of what is believed of one thing, plane frame.
#[derive(Clone, Debug)]
pub(super) struct Belief {
    pub mean: State,
    pub information: Information,
}

impl Belief {
    /// From the estimates of a link whose mesh stands at `pose` in the plane frame.
    pub fn of(
        (link, mesh, pose): (&Link, &Mesh, &Isometry3<f64>),
        thing: &Thing,
        gravity: f64,
        config: &Config,
    ) -> Self {
        let solid = solid_of(mesh);
        let centroid = solid.as_ref().map_or_else(|| thing.middle(), |s| pose * s.centroid);
        let extent = solid.as_ref().map_or_else(|| thing.high - thing.low, |s| s.extent);
        let volume = solid.as_ref().map_or(1e-4, |s| s.volume);
        let flat = Vector2::new(thing.high.x - thing.low.x, thing.high.y - thing.low.y);
        let friction = config.friction_prior;
        let mut belief = Self {
            mean: State::from([
                (volume * config.density.0).ln(),
                friction.0.ln(),
                centroid.x,
                centroid.y,
                (0.27 * flat.norm()).max(1e-3).ln(),
                TOOL.0.ln(),
            ]),
            information: Information::zeros(),
        };
        let off = OFF * extent.norm() / 3.0f64.sqrt();
        let doubts = [config.density.1, friction.1 / friction.0, off, off, 0.4, TOOL.1];
        for (k, sd) in doubts.into_iter().enumerate() {
            belief.information[(k, k)] = sd.powi(-2);
        }
        belief.measured(link, pose, gravity);
        belief
    }

    fn measured(&mut self, link: &Link, pose: &Isometry3<f64>, gravity: f64) {
        let told = |e: &Option<Estimate>| {
            let e = e.as_ref().filter(|e| fixed(e))?;
            Some((e.value.ln(), relative_sd(e).max(1e-3)))
        };
        let mass = told(&link.mass);
        let friction = told(&link.friction.kinetic);
        let product = told(&link.friction_force.kinetic);
        if let Some((ln, sd)) = mass {
            self.learn(&[(0, 1.0)], ln, sd);
        }
        match (product, friction) {
            // Friction that follows from the product is no second source.
            (Some(_), Some((ln, sd))) if mass.is_some() => self.learn(&[(1, 1.0)], ln, sd),
            (Some((ln, sd)), other) => {
                if let Some((ln, sd)) = other {
                    self.learn(&[(1, 1.0)], ln, sd);
                }
                self.learn(&[(0, 1.0), (1, 1.0)], ln - gravity.ln(), sd);
            }
            (None, Some((ln, sd))) => self.learn(&[(1, 1.0)], ln, sd),
            (None, None) => {}
        }
        if let Some(com) = link.com.as_ref().filter(|c| c.is_measured()) {
            let at = pose * Point3::from(com.value);
            let own = com.sd.map_or_else(Vector3::zeros, Vector3::from);
            let turn = pose.rotation.to_rotation_matrix();
            let spread =
                turn.matrix() * nalgebra::Matrix3::from_diagonal(&own.map(|s| s * s)) * turn.matrix().transpose();
            for (k, value) in [(2, at.x), (3, at.y)] {
                self.learn(&[(k, 1.0)], value, spread[(k - 2, k - 2)].sqrt().max(1e-4));
            }
        }
        for (k, e) in [(4, &link.friction.torsional_radius), (5, &link.friction.tool)] {
            if let Some((ln, sd)) = told(e) {
                self.learn(&[(k, 1.0)], ln, sd);
            }
        }
    }

    /// Takes up that a combination of the unknowns is `value ± sd`.
    fn learn(&mut self, row: &[(usize, f64)], value: f64, sd: f64) {
        let mut gradient = State::zeros();
        for (k, weight) in row {
            gradient[*k] = *weight;
        }
        let Some(covariance) = self.information.try_inverse() else {
            return;
        };
        let gain = covariance * gradient / (gradient.dot(&(covariance * gradient)) + sd * sd);
        self.mean += gain * (value - gradient.dot(&self.mean));
        self.information += gradient * gradient.transpose() * sd.powi(-2);
    }

    /// One draw.
    pub fn draw(&self, dice: &mut impl Rng) -> State {
        let normal = State::from_fn(|_, _| dice.sample(StandardNormal));
        match self.information.try_inverse().and_then(|c| c.cholesky()) {
            Some(root) => self.mean + root.l() * normal,
            None => self.mean,
        }
    }

    /// Standard deviations of the unknowns under `information`.
    pub fn doubts(information: &Information) -> State {
        information.try_inverse().map_or_else(
            || State::repeat(f64::INFINITY),
            |c| c.diagonal().map(|v| v.max(0.0).sqrt()),
        )
    }

    /// The centre of mass in the plane.
    pub fn centre(state: &State) -> Point2<f64> {
        Point2::new(state[2], state[3])
    }
}

fn fixed(e: &Estimate) -> bool {
    e.status != Status::Assumed && e.value > 0.0
}
