//! Quasi-static motion of things that slide on a table while a tool drives one of them.
//!
//! The motion is the one whose friction balances the tool: `W(q') q' = J' f`, where `W` collects, for
//! every foot, the ellipsoidal limit surface `(f/fmax)^2 + (tau/(c fmax))^2 = 1` (Howe and Cutkosky 1996) less what a patch
//! falls short of it between sliding and turning, or where it is known how the foot presses the sum over its points (Goyal,
//! Ruina and Papadopoulos 1991), and, for every joint, its Coulomb friction. Each is of degree zero in the
//! speed, so the weights are found by iteration; for one body that does not turn the first pass is already exact.

use nalgebra::{DMatrix, DVector, Matrix2xX, Matrix3, Vector2};

use super::{Between, SHORTFALL};

/// A dissipating element: `force * |rows q'|` with a metric on up to three rows.
#[derive(Clone, Debug)]
pub struct Dissipator {
    /// Maps the generalised velocity to the slip of the element, already scaled to m/s: of a foot along, across and turning.
    /// Of a foot with points the third row is that of the angular velocity, rad/s.
    pub rows: DMatrix<f64>,
    /// Where a foot presses, as points about where its rows are taken, plane frame, m, with their shares of its force; none where
    /// only its torsional radius is known.
    pub points: Vec<(Vector2<f64>, f64)>,
    /// Friction force, N (or N·m for a revolute joint with rows in rad/s).
    pub force: f64,
    /// Speed below which friction is viscous, m/s (rad/s): less than the full force lets it creep, it never holds.
    pub creep: f64,
    /// What resists in proportion to speed besides, N·s/m (N·m·s/rad).
    pub damping: f64,
    /// What pulls back along the first row whatever the speed, N (N·m): a spring.
    pub pull: f64,
}

/// The tool's contact: the velocity of the touched material point is `jacobian q'`.
#[derive(Clone, Debug)]
pub struct Contact {
    /// 2 × n: velocity of the material point in the plane.
    pub jacobian: Matrix2xX<f64>,
    /// Unit direction into the body.
    pub inward: Vector2<f64>,
    /// Velocity of the tool at the contact, m/s.
    pub tool_velocity: Vector2<f64>,
    /// Coefficient of friction between tool and body; infinite for a pin.
    pub friction: f64,
    /// A pin may pull.
    pub bilateral: bool,
}

/// What a contact does.
#[derive(Clone, Debug)]
pub struct ContactSolution {
    /// Generalised velocity.
    pub velocity: DVector<f64>,
    /// Force of the tool on the body in the plane, N.
    pub force: Vector2<f64>,
}

/// Speeds below this count as stuck, m/s or rad/s.
const STUCK: f64 = 1e-6;
const PASSES: usize = 40;
/// The same where a foot presses at points: one of them may be what all turns about.
const PASSES_POINTS: usize = 100;
/// Velocities this near are one, a share.
const NEAR: f64 = 1e-6;
/// Rows of what a foot resists: two of sliding, one of turning.
const FOOT: usize = 3;

/// The generalised velocity and the contact force; nothing where the tool moves away.
pub fn solve_contact(dissipators: &[Dissipator], contact: &Contact) -> Option<ContactSolution> {
    let closing = contact.inward.dot(&contact.tool_velocity);
    if !contact.bilateral && closing <= 0.0 {
        return None;
    }
    let stuck = solve(dissipators, contact, Mode::Stick);
    let tangent = Vector2::new(-contact.inward.y, contact.inward.x);
    let normal_force = stuck.force.dot(&contact.inward);
    let tangent_force = stuck.force.dot(&tangent);
    if contact.bilateral || (normal_force >= 0.0 && tangent_force.abs() <= contact.friction * normal_force) {
        return Some(stuck);
    }
    let push = contact.inward + tangent * (contact.friction * tangent_force.signum());
    Some(solve(dissipators, contact, Mode::Slide(push)))
}

#[derive(Clone, Copy)]
enum Mode {
    /// The material point moves with the tool.
    Stick,
    /// The force has this direction; only the normal speeds agree.
    Slide(Vector2<f64>),
}

impl Dissipator {
    fn least(&self) -> f64 {
        self.creep.max(STUCK)
    }

    /// What it resists per generalised speed, at this slip.
    fn weight(&self, slip: &DVector<f64>) -> DMatrix<f64> {
        if !self.points.is_empty() {
            return self.rows.transpose() * self.over_points(slip) * &self.rows;
        }
        let speed = slip.norm().max(self.least());
        let mut weighed = self.rows.clone();
        if weighed.nrows() == FOOT {
            let between = Between::at((slip[2] / speed).powi(2), SHORTFALL.0);
            weighed.rows_mut(0, 2).scale_mut(between.force);
            weighed.row_mut(2).scale_mut(between.moment);
        }
        self.rows.transpose() * weighed * (self.force / speed + self.damping)
    }

    /// The same of a foot with points, per velocity of their middle and spin.
    fn over_points(&self, slip: &DVector<f64>) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        for (at, share) in &self.points {
            let velocity = Vector2::new(slip[0] - slip[2] * at.y, slip[1] + slip[2] * at.x);
            let per = share * self.force / velocity.norm().max(self.least());
            sum += Matrix3::new(
                per,
                0.0,
                -per * at.y,
                0.0,
                per,
                per * at.x,
                -per * at.y,
                per * at.x,
                per * at.norm_squared(),
            );
        }
        sum
    }
}

fn solve(dissipators: &[Dissipator], contact: &Contact, mode: Mode) -> ContactSolution {
    let n = contact.jacobian.ncols();
    let mut velocity = DVector::from_element(n, 0.0);
    // At first all slide as fast as the tool, none turns.
    let mut slips: Vec<DVector<f64>> = dissipators
        .iter()
        .map(|e| {
            let mut slip = DVector::zeros(e.rows.nrows());
            slip[0] = contact.tool_velocity.norm().max(e.least());
            slip
        })
        .collect();
    let mut force = Vector2::zeros();
    let pull = dissipators.iter().filter(|e| e.pull != 0.0);
    let pull = pull.fold(DVector::zeros(n), |sum: DVector<f64>, e| {
        sum + e.rows.row(0).transpose() * e.pull
    });
    let points = dissipators.iter().any(|e| !e.points.is_empty());
    for _ in 0..if points { PASSES_POINTS } else { PASSES } {
        let mut weight = DMatrix::from_diagonal_element(n, n, 1e-9);
        for (element, slip) in dissipators.iter().zip(&slips) {
            weight += element.weight(slip);
        }
        let Some(inverse) = weight.try_inverse() else { break };
        let before = velocity.clone();
        (velocity, force) = balance(&inverse, &pull, contact, mode);
        for (element, slip) in dissipators.iter().zip(&mut slips) {
            *slip = &element.rows * &velocity;
        }
        if (&velocity - before).norm() <= NEAR * velocity.norm() {
            break;
        }
    }
    ContactSolution { velocity, force }
}

/// One linear balance with fixed weights: `q' = W^-1 (J' f - pull)` with the contact's speeds met.
fn balance(inverse: &DMatrix<f64>, pull: &DVector<f64>, contact: &Contact, mode: Mode) -> (DVector<f64>, Vector2<f64>) {
    let jacobian = &contact.jacobian;
    let mobility = jacobian * inverse * jacobian.transpose();
    // How the contact would move if the tool were not there.
    let slack = inverse * pull;
    let back = jacobian * &slack;
    let wanted = contact.tool_velocity + Vector2::new(back[0], back[1]);
    let force = match mode {
        // A direction in which the body cannot go takes no part: what the tool meets there is not friction.
        Mode::Stick => {
            let square = nalgebra::Matrix2::new(mobility[(0, 0)], mobility[(0, 1)], mobility[(1, 0)], mobility[(1, 1)]);
            let smallest = 1e-6 * square.trace();
            let inverse = square.pseudo_inverse(smallest.max(f64::MIN_POSITIVE));
            inverse.map_or_else(|_| Vector2::zeros(), |inverse| inverse * wanted)
        }
        Mode::Slide(push) => {
            let along = contact
                .inward
                .dot(&Vector2::from_column_slice((mobility * push).as_slice()));
            push * (contact.inward.dot(&wanted) / along.max(1e-12))
        }
    };
    (inverse * jacobian.transpose() * force - slack, force)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body at the origin with torsional radius `c`, touched at `(x, y)`.
    fn body(fmax: f64, c: f64, at: Vector2<f64>, inward: Vector2<f64>, friction: f64) -> (Vec<Dissipator>, Contact) {
        let rows = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, c]);
        let jacobian = Matrix2xX::from_row_slice(&[1.0, 0.0, -at.y, 0.0, 1.0, at.x]);
        let contact = Contact {
            jacobian,
            inward,
            tool_velocity: inward * 0.02,
            friction,
            bilateral: false,
        };
        (
            vec![Dissipator {
                rows,
                points: Vec::new(),
                force: fmax,
                creep: 0.0,
                damping: 0.0,
                pull: 0.0,
            }],
            contact,
        )
    }

    #[test]
    fn a_central_push_needs_just_the_friction() {
        let (feet, contact) = body(2.5, 0.03, Vector2::new(-0.05, 0.0), Vector2::x(), 0.4);
        let solved = solve_contact(&feet, &contact).expect("contact");
        assert!((solved.force - Vector2::new(2.5, 0.0)).norm() < 1e-6);
        assert!((solved.velocity - DVector::from_vec(vec![0.02, 0.0, 0.0])).norm() < 1e-8);
    }

    #[test]
    fn an_eccentric_push_balances_what_the_patch_resists() {
        // A sticking finger: the touched point goes with it, and its force and moment are those of the patch as it slides.
        let (c, r) = (0.03, Vector2::new(-0.05, 0.02));
        let (feet, contact) = body(2.5, c, r, Vector2::x(), 10.0);
        let solved = solve_contact(&feet, &contact).expect("contact");
        let (v, spin) = (solved.velocity.fixed_rows::<2>(0).into_owned(), solved.velocity[2]);
        let point = v + spin * Vector2::new(-r.y, r.x);
        assert!((point.x - 0.02).hypot(point.y) < 1e-7, "{point}");
        let speed = v.norm().hypot(c * spin);
        let between = Between::at((c * spin / speed).powi(2), SHORTFALL.0);
        let (force, moment) = (
            2.5 * between.force / speed * v,
            2.5 * between.moment * c * c * spin / speed,
        );
        assert!((solved.force - force).norm() < 1e-5, "{} against {force}", solved.force);
        assert!((r.perp(&solved.force) - moment).abs() < 1e-6);
    }

    #[test]
    fn a_foot_of_four_corners_turns_about_where_its_points_say() {
        // A central push beside the middle: force and moment are those of the corners as they slide.
        let (mut feet, contact) = body(2.5, 0.03, Vector2::new(-0.05, 0.02), Vector2::x(), 10.0);
        let corners = [(0.05, 0.03), (0.05, -0.03), (-0.05, 0.03), (-0.05, -0.03)];
        feet[0].points = corners.map(|(x, y)| (Vector2::new(x, y), 0.25)).to_vec();
        feet[0].rows[(2, 2)] = 1.0;
        let solved = solve_contact(&feet, &contact).expect("contact");
        let v = &solved.velocity;
        let (mut force, mut moment) = (Vector2::zeros(), 0.0);
        for (x, y) in corners {
            let slip = Vector2::new(v[0] - v[2] * y, v[1] + v[2] * x).normalize() * (0.25 * 2.5);
            force += slip;
            moment += Vector2::new(x, y).perp(&slip);
        }
        assert!((solved.force - force).norm() < 1e-4, "{} against {force}", solved.force);
        assert!((Vector2::new(-0.05, 0.02).perp(&solved.force) - moment).abs() < 1e-5);
    }

    #[test]
    fn a_tool_that_leaves_pushes_nothing() {
        let (feet, mut contact) = body(2.5, 0.03, Vector2::new(-0.05, 0.0), Vector2::x(), 0.4);
        contact.tool_velocity = -Vector2::x();
        assert!(solve_contact(&feet, &contact).is_none());
    }
}
