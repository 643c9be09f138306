//! What a toss depends on: the shape at uniform density, and everything that may differ from it.

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use crate::physics::{Hinge, Landing, Part, Thrown};

/// A link's shape about `O`, its own axes.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    /// Centre of mass at uniform density, from `O`, m.
    pub centre: Vector3<f64>,
    /// Inertia about that centre over the link's mass, m².
    pub inertia: Matrix3<f64>,
    /// Corners of the convex hull, from `O`, m.
    pub corners: Vec<Vector3<f64>>,
    /// By how much each corner moves in for each metre that edges are rounded.
    pub inward: Vec<Vector3<f64>>,
}

/// What is thrown, as far as its shape tells.
#[derive(Clone, Debug)]
pub struct Body {
    /// The root.
    pub root: Solid,
    /// The link that hangs on it, with the axis of the hinge (root's axes) and its pose at angle zero.
    pub second: Option<(Solid, Unit<Vector3<f64>>, UnitQuaternion<f64>)>,
    /// The capture's support and gravity.
    pub normal: Unit<Vector3<f64>>,
    /// `normal · x` on the support, m.
    pub height: f64,
    /// m/s².
    pub gravity: Vector3<f64>,
}

/// All that the motion of a body that is thrown may depend on beyond its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Of an impact, 0 to 1.
    pub restitution: f64,
    /// Kinetic, against the support.
    pub friction: f64,
    /// Logarithm of the inertia over that at uniform density.
    pub log_inertia: f64,
    /// Radius of edges and corners, m.
    pub rounding: f64,
    /// The support over where the capture has it, m.
    pub rise: f64,
    /// A body that lies still over where shape and support have it, m.
    pub lying: f64,
    /// Drag of the air over mass, 1/m.
    pub drag: f64,
    /// Gravity over the capture's, less one.
    pub gravity: f64,
    /// Centre of mass from where uniform density has it, root's axes, m.
    pub centre: Vector3<f64>,
    /// Centre of mass of the second link from where uniform density has it, its own axes, m.
    pub second_centre: Vector3<f64>,
    /// By how much mass is spread otherwise than at uniform density, of the root and the second link: the logarithm
    /// (xx, yy, zz, xy, xz, yz) of its second moments in units of those, so that any value is physical.
    pub spread: [[f64; 6]; 2],
    /// Gravity turned about the two level axes, rad.
    pub gravity_tilt: [f64; 2],
    /// The support turned about the two level axes, rad.
    pub support_tilt: [f64; 2],
    /// The body over its mesh, less one.
    pub size: f64,
    /// Tracked lengths over true ones, less one.
    pub scale: f64,
    /// Share by which friction at a standstill exceeds that at speed, and the speed over which it dies out, m/s.
    pub excess: (f64, f64),
    /// Share by which friction grows with speed, s/m.
    pub viscous: f64,
    /// Dry friction of the hinge over the whole mass, N·m/kg.
    pub hinge_friction: f64,
    /// Damping of the hinge over the whole mass, N·m·s/(rad·kg).
    pub hinge_damping: f64,
}

impl Conditions {
    /// A body of its shape on a level table, air and sensors left out.
    pub fn plain(restitution: f64, friction: f64) -> Self {
        Self {
            restitution,
            friction,
            log_inertia: 0.0,
            rounding: 0.0,
            rise: 0.0,
            lying: 0.0,
            drag: 0.0,
            gravity: 0.0,
            centre: Vector3::zeros(),
            second_centre: Vector3::zeros(),
            spread: [[0.0; 6]; 2],
            gravity_tilt: [0.0; 2],
            support_tilt: [0.0; 2],
            size: 0.0,
            scale: 0.0,
            excess: (0.0, 0.1),
            viscous: 0.0,
            hinge_friction: 0.0,
            hinge_damping: 0.0,
        }
    }
}

/// A vector turned by small angles about the two level axes.
fn turned(v: &Vector3<f64>, by: [f64; 2]) -> Vector3<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], 0.0)) * v
}

/// An inertia whose second moments are changed by a logarithm in units of themselves, `S' = sqrt(S) exp(L) sqrt(S)`:
/// second moments stay positive, so the inertia obeys the triangle inequalities (Wensing, Kim and Slotine 2018).
fn spread_out(inertia: &Matrix3<f64>, by: &[f64; 6]) -> Matrix3<f64> {
    if by.iter().all(|x| *x == 0.0) {
        return *inertia;
    }
    let second = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
    let of = |m: &Matrix3<f64>, f: fn(f64) -> f64| {
        let e = m.symmetric_eigen();
        e.eigenvectors * Matrix3::from_diagonal(&e.eigenvalues.map(f)) * e.eigenvectors.transpose()
    };
    let root = of(&second, |x| x.max(0.0).sqrt());
    let [xx, yy, zz, xy, xz, yz] = *by;
    let log = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let second = root * of(&log, f64::exp) * root;
    Matrix3::identity() * second.trace() - second
}

impl Body {
    /// The simulator's view of it. A track whose lengths are `1 + scale` times the true ones shows a body and a
    /// gravity that are larger by as much.
    pub fn thrown(&self, c: &Conditions) -> (Thrown, Landing) {
        let lengths = 1.0 + c.scale;
        let stretch = lengths * (1.0 + c.size);
        let share = if self.second.is_some() { 0.5 } else { 1.0 };
        let part = |solid: &Solid, centre: Vector3<f64>, spread: &[f64; 6]| Part {
            mass: share,
            centre: (solid.centre + centre) * stretch,
            inertia: spread_out(&solid.inertia, spread) * (share * c.log_inertia.exp() * stretch * stretch),
            corners: solid
                .corners
                .iter()
                .zip(&solid.inward)
                .map(|(p, inward)| p * stretch + inward * c.rounding)
                .collect(),
        };
        let second = self.second.as_ref().map(|(solid, axis, zero)| {
            let hinge = Hinge {
                axis: *axis,
                zero: *zero,
                friction: c.hinge_friction,
                damping: c.hinge_damping,
            };
            (part(solid, c.second_centre, &c.spread[1]), hinge)
        });
        let thrown = Thrown {
            root: part(&self.root, c.centre, &c.spread[0]),
            second,
            rounding: c.rounding,
        };
        let landing = Landing {
            gravity: turned(&self.gravity, c.gravity_tilt) * ((1.0 + c.gravity) * lengths),
            normal: Unit::new_normalize(turned(&self.normal, c.support_tilt)),
            height: self.height + c.rise,
            restitution: c.restitution,
            friction: c.friction,
            excess: c.excess,
            viscous: c.viscous,
            drag: c.drag,
        };
        (thrown, landing)
    }

    /// Typical distance of its surface from `O`, m: what turns a rotation into a length.
    pub fn reach(&self) -> f64 {
        let all = self.root.corners.iter();
        let (sum, count) = all.fold((0.0, 0.0), |(s, n), c| (s + c.norm_squared(), n + 1.0));
        if count > 0.0 {
            (sum / count / 1.5f64).sqrt()
        } else {
            0.05
        }
    }
}
