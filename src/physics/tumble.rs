//! A body that is thrown: flight, impact, sliding and rolling on the support; one rigid link, or two that a hinge joins.
//!
//! Generalised velocity `v = (velocity of O, spin of the root, rate of the hinge)`, world axes; `O` is a point of the
//! hinge's axis, or any point of a body without one. `M(q) v' = Q` with the mass matrix from each link's Jacobian;
//! forces at contacts are impulses that obey Signorini's condition, Newton's restitution and Coulomb's cone, found by
//! projected Gauss-Seidel over the vertices that touch (Stewart and Trinkle 1996; Moreau 1988). All masses are shares of
//! the whole: a toss does not show the mass.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Unit, UnitQuaternion, Vector3};

/// Spin of the hinge in the generalised velocity.
pub(super) const HINGE: usize = 6;
/// Of the root, six, and of the hinge, one.
pub type Velocity = SVector<f64, 7>;
pub(super) type Mass = SMatrix<f64, 7, 7>;
pub(super) type Rows = SMatrix<f64, 3, 7>;

/// A link of what is thrown, its own axes.
#[derive(Clone, Debug)]
pub struct Part {
    /// Share of the whole mass.
    pub mass: f64,
    /// Centre of mass from `O`, m.
    pub centre: Vector3<f64>,
    /// Inertia about the centre over the whole mass, m².
    pub inertia: Matrix3<f64>,
    /// Corners of its convex hull from `O`, m.
    pub corners: Vec<Vector3<f64>>,
}

/// The hinge between the root and the second link.
#[derive(Clone, Copy, Debug)]
pub struct Hinge {
    /// Axis through `O`, root's axes.
    pub axis: Unit<Vector3<f64>>,
    /// Root-from-second-link at angle zero.
    pub zero: UnitQuaternion<f64>,
    /// Dry friction over the whole mass, N·m/kg.
    pub friction: f64,
    /// Viscous damping over the whole mass, N·m·s/(rad·kg).
    pub damping: f64,
}

/// What is thrown.
#[derive(Clone, Debug)]
pub struct Thrown {
    /// The link that the orientation is of.
    pub root: Part,
    /// The link that hangs on it.
    pub second: Option<(Part, Hinge)>,
    /// Radius by which edges and corners are rounded, m: faces stay where they are.
    pub rounding: f64,
}

/// Where it lands.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    /// m/s².
    pub gravity: Vector3<f64>,
    /// The support: `normal · x = height`.
    pub normal: Unit<Vector3<f64>>,
    /// m.
    pub height: f64,
    /// Newton's: speed of parting over speed of approach.
    pub restitution: f64,
    /// Coulomb's.
    pub friction: f64,
    /// Share by which friction at a standstill exceeds that at speed, and the speed over which that dies out, m/s.
    pub excess: (f64, f64),
    /// Share by which friction grows with speed, s/m.
    pub viscous: f64,
    /// Drag of the air over mass, 1/m.
    pub drag: f64,
}

impl Landing {
    /// Friction at a slip speed over the coefficient.
    pub(super) fn share(&self, speed: f64) -> f64 {
        let (excess, scale) = self.excess;
        (1.0 + excess * (-speed / scale).exp() + self.viscous * speed).max(0.0)
    }
}

/// Where it is and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// World position of `O`, m.
    pub place: Vector3<f64>,
    /// World-from-root.
    pub turn: UnitQuaternion<f64>,
    /// Angle of the hinge, rad.
    pub angle: f64,
    /// Of `O`, m/s; spin of the root, rad/s; rate of the hinge, rad/s.
    pub velocity: Velocity,
}

/// Speed below which dry friction of the hinge counts as holding it, rad/s.
const CREEP: f64 = 0.05;

fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// A link as it stands at one moment.
pub(super) struct Posed<'a> {
    pub part: &'a Part,
    pub turn: Rotation3<f64>,
    pub hinged: bool,
}

impl Thrown {
    pub(super) fn posed(&self, s: &State) -> impl Iterator<Item = Posed<'_>> {
        let turn = s.turn;
        let root = Posed {
            part: &self.root,
            turn: turn.to_rotation_matrix(),
            hinged: false,
        };
        let second = self.second.as_ref().map(|(part, hinge)| Posed {
            part,
            turn: (turn * UnitQuaternion::from_axis_angle(&hinge.axis, s.angle) * hinge.zero).to_rotation_matrix(),
            hinged: true,
        });
        std::iter::once(root).chain(second)
    }

    pub(super) fn axis(&self, s: &State) -> Vector3<f64> {
        self.second
            .as_ref()
            .map_or_else(Vector3::zeros, |(_, h)| (s.turn * h.axis).into_inner())
    }

    /// Jacobian of a point `r` from `O` that moves with a link.
    pub(super) fn rows(r: &Vector3<f64>, hinged: bool, axis: &Vector3<f64>) -> Rows {
        let mut rows = Rows::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&-cross(r));
        if hinged {
            rows.fixed_view_mut::<3, 1>(0, HINGE).copy_from(&axis.cross(r));
        }
        rows
    }

    /// Inverse of the mass matrix, and the smooth forces.
    pub(super) fn dynamics(&self, s: &State, land: &Landing) -> (Mass, Velocity) {
        let axis = self.axis(s);
        let spin: Vector3<f64> = s.velocity.fixed_rows::<3>(3).into();
        let rate = s.velocity[HINGE];
        let (mut mass, mut force) = (Mass::zeros(), Velocity::zeros());
        for p in self.posed(s) {
            let r = p.turn * p.part.centre;
            let inertia = p.turn * p.part.inertia * p.turn.transpose();
            let rows = Self::rows(&r, p.hinged, &axis);
            let mut turning = Rows::zeros();
            turning.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
            let (mut own, mut bias) = (spin, Vector3::zeros());
            if p.hinged {
                turning.fixed_view_mut::<3, 1>(0, HINGE).copy_from(&axis);
                own += axis * rate;
                bias = spin.cross(&axis) * rate;
            }
            let shift = bias.cross(&r) + own.cross(&own.cross(&r));
            let speed: Vector3<f64> = rows * s.velocity;
            let pull = land.gravity - speed * (land.drag * speed.norm());
            mass += rows.transpose() * rows * p.part.mass + turning.transpose() * inertia * turning;
            force += rows.transpose() * (pull - shift) * p.part.mass
                - turning.transpose() * (inertia * bias + own.cross(&(inertia * own)));
        }
        match &self.second {
            Some((_, hinge)) => force[HINGE] -= hinge.damping * rate,
            None => mass[(HINGE, HINGE)] = 1.0,
        }
        let inverse = nalgebra::Cholesky::new(mass).map_or_else(Mass::zeros, |c| c.inverse());
        (inverse, force)
    }

    /// Energy of motion, and spin momentum about the origin, both over the whole mass.
    pub fn momentum(&self, s: &State) -> (f64, Vector3<f64>, Vector3<f64>) {
        let axis = self.axis(s);
        let spin: Vector3<f64> = s.velocity.fixed_rows::<3>(3).into();
        let mut out = (0.0, Vector3::zeros(), Vector3::zeros());
        for p in self.posed(s) {
            let r = p.turn * p.part.centre;
            let own = spin
                + if p.hinged {
                    axis * s.velocity[HINGE]
                } else {
                    Vector3::zeros()
                };
            let speed: Vector3<f64> = Self::rows(&r, p.hinged, &axis) * s.velocity;
            let turning = p.turn * p.part.inertia * p.turn.transpose() * own;
            out.0 += 0.5 * (p.part.mass * speed.norm_squared() + own.dot(&turning));
            out.1 += speed * p.part.mass;
            out.2 += (s.place + r).cross(&speed) * p.part.mass + turning;
        }
        out
    }

    /// How the generalised velocity changes where nothing touches.
    pub fn free_acceleration(&self, s: &State, land: &Landing) -> Velocity {
        let (inverse, mut force) = self.dynamics(s, land);
        if let Some((_, hinge)) = &self.second {
            force[HINGE] -= hinge.friction * (s.velocity[HINGE] / CREEP).tanh();
        }
        inverse * force
    }
}
