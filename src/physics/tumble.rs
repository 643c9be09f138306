//! A body that is thrown: flight, impact, sliding and rolling on the support; one rigid link, or two that a hinge joins.
//!
//! Generalised velocity `v = (velocity of O, spin of the root, rate of the hinge)`, world axes; `O` is a point of the
//! hinge's axis, or any point of a body without one. `M(q) v' = Q` with the mass matrix from each link's Jacobian;
//! forces at contacts are impulses that obey Signorini's condition, Newton's restitution and Coulomb's cone, found by
//! projected Gauss-Seidel over the vertices that touch (Stewart and Trinkle 1996; Moreau 1988). All masses are shares of
//! the whole: a toss does not show the mass.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Unit, UnitQuaternion, Vector3};

/// Spin of the hinge in the generalised velocity.
const HINGE: usize = 6;
/// Of the root, six, and of the hinge, one.
pub type Velocity = SVector<f64, 7>;
type Mass = SMatrix<f64, 7, 7>;
type Rows = SMatrix<f64, 3, 7>;

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
    fn share(&self, speed: f64) -> f64 {
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

/// Below this speed of approach nothing rebounds, m/s.
const REBOUND: f64 = 0.02;
/// Distance at which a corner touches, m.
const TOUCH: f64 = 2e-5;
/// Speed below which dry friction of the hinge counts as holding it, rad/s.
const CREEP: f64 = 0.05;
/// Rounds of projected Gauss-Seidel.
const ROUNDS: usize = 30;
/// Impacts within one step.
const IMPACTS: usize = 6;

fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

struct Touching {
    rows: Rows,
    /// Mass⁻¹ rowsᵀ.
    back: SMatrix<f64, 7, 3>,
    /// Inverse inertia seen along the normal and across.
    along: f64,
    across: f64,
    gap: f64,
    impulse: Vector3<f64>,
    target: f64,
}

/// A link as it stands at one moment.
struct Posed<'a> {
    part: &'a Part,
    turn: Rotation3<f64>,
    hinged: bool,
}

impl Thrown {
    fn posed(&self, s: &State) -> impl Iterator<Item = Posed<'_>> {
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

    fn axis(&self, s: &State) -> Vector3<f64> {
        self.second
            .as_ref()
            .map_or_else(Vector3::zeros, |(_, h)| (s.turn * h.axis).into_inner())
    }

    /// Jacobian of a point `r` from `O` that moves with a link.
    fn rows(r: &Vector3<f64>, hinged: bool, axis: &Vector3<f64>) -> Rows {
        let mut rows = Rows::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&-cross(r));
        if hinged {
            rows.fixed_view_mut::<3, 1>(0, HINGE).copy_from(&axis.cross(r));
        }
        rows
    }

    /// Inverse of the mass matrix, and the smooth forces.
    fn dynamics(&self, s: &State, land: &Landing) -> (Mass, Velocity) {
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

    /// Distances of the corners to the support, with their places from `O` (the foot of the rounded corner).
    fn corners<'a>(&'a self, s: &'a State, land: &'a Landing) -> impl Iterator<Item = (f64, Vector3<f64>, bool)> + 'a {
        let base = land.normal.dot(&s.place) - land.height;
        self.posed(s).flat_map(move |p| {
            let hinged = p.hinged;
            p.part.corners.iter().map(move |c| {
                let r = p.turn * c;
                (base + land.normal.dot(&r) - self.rounding, r - land.normal.into_inner() * self.rounding, hinged)
            })
        })
    }

    /// The lowest corner above the support, m.
    pub fn clearance(&self, s: &State, land: &Landing) -> f64 {
        self.corners(s, land).map(|c| c.0).fold(f64::INFINITY, f64::min)
    }

    /// Mean height over the support of the corners within `within` of the lowest, m: of those that bear it.
    pub fn seat(&self, s: &State, land: &Landing, within: f64) -> f64 {
        let lowest = self.clearance(s, land);
        let near = self.corners(s, land).filter(|c| c.0 < lowest + within);
        let (sum, count) = near.fold((0.0, 0.0f64), |(sum, n), c| (sum + c.0, n + 1.0));
        sum / count.max(1.0)
    }

    fn touching(&self, s: &State, land: &Landing, inverse: &Mass, within: f64) -> Vec<Touching> {
        let axis = self.axis(s);
        let near = self.corners(s, land).filter(|c| c.0 < within);
        near.map(|(gap, r, hinged)| {
            let rows = Self::rows(&r, hinged, &axis);
            let back = inverse * rows.transpose();
            let seen: Matrix3<f64> = rows * back;
            let along = land.normal.dot(&(seen * land.normal.into_inner()));
            Touching {
                rows,
                back,
                along,
                across: 0.5 * (seen.trace() - along),
                gap,
                impulse: Vector3::zeros(),
                target: 0.0,
            }
        })
        .collect()
    }

    /// Projected Gauss-Seidel over what touches, dry friction of the hinge with it; `grip` is the most that friction of
    /// the hinge can give.
    fn solve(&self, v: &mut Velocity, inverse: &Mass, land: &Landing, all: &mut [Touching], grip: f64) {
        let n = land.normal.into_inner();
        let mut held = 0.0;
        for round in 0..ROUNDS {
            let mut moved = 0.0f64;
            if grip > 0.0 {
                let wanted: f64 = held - v[HINGE] / inverse[(HINGE, HINGE)];
                let next = wanted.clamp(-grip, grip);
                *v += inverse.column(HINGE) * (next - held);
                moved = moved.max((next - held).abs() * inverse[(HINGE, HINGE)] * 0.05);
                held = next;
            }
            for c in all.iter_mut() {
                let u: Vector3<f64> = c.rows * *v;
                let normal = c.impulse.dot(&n);
                let next = (normal + (c.target - n.dot(&u)) / c.along).max(0.0);
                let slip = u - n * n.dot(&u);
                let speed = slip.norm();
                let mu = land.friction * land.share(speed);
                let mut side = c.impulse - n * normal - slip / c.across;
                let most = mu * next;
                if side.norm() > most {
                    side *= most / side.norm();
                }
                let change = n * next + side - c.impulse;
                c.impulse += change;
                *v += c.back * change;
                moved = moved.max(change.norm() * c.along);
            }
            if moved < 1e-7 && round > 0 {
                break;
            }
        }
    }

    fn moved(&self, s: &State, v: &Velocity, h: f64) -> State {
        let spin: Vector3<f64> = v.fixed_rows::<3>(3).into();
        State {
            place: s.place + v.fixed_rows::<3>(0) * h,
            turn: UnitQuaternion::from_scaled_axis(spin * h) * s.turn,
            angle: s.angle + v[HINGE] * h,
            velocity: *v,
        }
    }

    /// One step without looking for new impacts.
    fn glide(&self, s: &State, land: &Landing, h: f64) -> State {
        let (inverse, force) = self.dynamics(s, land);
        let grip = self.second.as_ref().map_or(0.0, |(_, hinge)| hinge.friction * h);
        let lands = land.height > f64::NEG_INFINITY;
        let mut on = if lands { self.touching(s, land, &inverse, TOUCH) } else { Vec::new() };
        if !on.is_empty() {
            let mut v = s.velocity + inverse * force * h;
            for c in &mut on {
                c.target = -c.gap.max(0.0) / h;
            }
            self.solve(&mut v, &inverse, land, &mut on, grip);
            return self.moved(s, &v, h);
        }
        // Free: the midpoint rule, second order.
        let half = self.moved(s, &(s.velocity + inverse * force * (0.25 * h)), 0.5 * h);
        let half = State {
            velocity: s.velocity + inverse * force * (0.5 * h),
            ..half
        };
        let (inverse, force) = self.dynamics(&half, land);
        let mut v = s.velocity + inverse * force * h;
        let mut middle = half.velocity;
        if grip > 0.0 {
            self.solve(&mut v, &inverse, land, &mut [], grip);
            middle = (s.velocity + v) * 0.5;
        }
        State {
            velocity: v,
            ..self.moved(s, &middle, h)
        }
    }

    /// Rebound of all that touches and comes nearer.
    fn strike(&self, s: &mut State, land: &Landing) {
        if self.clearance(s, land) >= TOUCH {
            return;
        }
        let (inverse, _) = self.dynamics(s, land);
        let mut on = self.touching(s, land, &inverse, TOUCH);
        let mut hit = false;
        for c in &mut on {
            let approach = -land.normal.dot(&(c.rows * s.velocity));
            if approach > REBOUND {
                c.target = land.restitution * approach;
                hit = true;
            }
        }
        if hit {
            let mut v = s.velocity;
            self.solve(&mut v, &inverse, land, &mut on, 0.0);
            s.velocity = v;
        }
    }

    /// Energy of motion, and spin momentum about the origin, both over the whole mass.
    pub fn momentum(&self, s: &State) -> (f64, Vector3<f64>, Vector3<f64>) {
        let axis = self.axis(s);
        let spin: Vector3<f64> = s.velocity.fixed_rows::<3>(3).into();
        let mut out = (0.0, Vector3::zeros(), Vector3::zeros());
        for p in self.posed(s) {
            let r = p.turn * p.part.centre;
            let own = spin + if p.hinged { axis * s.velocity[HINGE] } else { Vector3::zeros() };
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

    /// The state after `h` seconds.
    pub fn step(&self, start: &State, land: &Landing, h: f64) -> State {
        if land.height == f64::NEG_INFINITY {
            return self.glide(start, land, h);
        }
        let mut s = *start;
        let mut left = h;
        for _ in 0..IMPACTS {
            self.strike(&mut s, land);
            let next = self.glide(&s, land, left);
            let mut first = 1.0f64;
            for ((before, _, _), (after, _, _)) in self.corners(&s, land).zip(self.corners(&next, land)) {
                if before > TOUCH && after < 0.0 {
                    first = first.min((before - 0.25 * TOUCH) / (before - after));
                }
            }
            if first >= 1.0 {
                return next;
            }
            let part = (first * left).max(1e-6);
            s = self.glide(&s, land, part);
            left -= part;
            if left < 1e-7 {
                return s;
            }
        }
        self.glide(&s, land, left)
    }

    /// States at `times` (s, rising; the first is that of `start`), at steps of at most `h`.
    pub fn fly(&self, start: &State, land: &Landing, times: &[f64], h: f64) -> Vec<State> {
        let mut s = *start;
        let mut out = Vec::with_capacity(times.len());
        out.extend(times.first().map(|_| s));
        for pair in times.windows(2) {
            let span = pair[1] - pair[0];
            let steps = (span / h).ceil().max(1.0);
            for _ in 0..steps as usize {
                s = self.step(&s, land, span / steps);
            }
            out.push(s);
        }
        out
    }
}
