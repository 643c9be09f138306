//! Quasi-static motion of things that slide on a table while a tool drives one of them.
//!
//! The motion is the one whose friction balances the tool: `W(q') q' = J' f`, where `W` collects, for
//! every foot, the sum over the points where it presses (Goyal, Ruina and Papadopoulos 1991), or where these are not known the
//! ellipsoidal limit surface `(f/fmax)^2 + (tau/(c fmax))^2 = 1` (Howe and Cutkosky 1996) less what a patch falls short of it
//! between sliding and turning, and, for every joint, its Coulomb friction. Each is of degree zero in the
//! speed, so the weights are found by iteration; for one body that does not turn the first pass is already exact.

use nalgebra::{DMatrix, DVector, Matrix2xX, Vector2};

use super::equilibrium::{Mode, balanced};

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

/// Velocities that balanced a moment ago: friction changes little from one step of a path to the next.
#[derive(Clone, Debug, Default)]
pub struct Course {
    sticking: Option<DVector<f64>>,
    sliding: Option<DVector<f64>>,
}

/// The generalised velocity and the contact force; nothing where the tool moves away.
pub fn solve_contact(dissipators: &[Dissipator], contact: &Contact) -> Option<ContactSolution> {
    solve_contact_on(&mut Course::default(), dissipators, contact)
}

/// The same on a path, from what balanced in its last step.
pub fn solve_contact_on(course: &mut Course, dissipators: &[Dissipator], contact: &Contact) -> Option<ContactSolution> {
    let closing = contact.inward.dot(&contact.tool_velocity);
    if !contact.bilateral && closing <= 0.0 {
        return None;
    }
    let stuck = balanced(dissipators, contact, Mode::Stick, course.sticking.as_ref());
    course.sticking = Some(stuck.velocity.clone());
    let tangent = Vector2::new(-contact.inward.y, contact.inward.x);
    let normal_force = stuck.force.dot(&contact.inward);
    let tangent_force = stuck.force.dot(&tangent);
    if contact.bilateral || (normal_force >= 0.0 && tangent_force.abs() <= contact.friction * normal_force) {
        return Some(stuck);
    }
    let push = contact.inward + tangent * (contact.friction * tangent_force.signum());
    let near = course.sliding.as_ref().unwrap_or(&stuck.velocity);
    let slid = balanced(dissipators, contact, Mode::Slide(push), Some(near));
    course.sliding = Some(slid.velocity.clone());
    Some(slid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{Between, SHORTFALL};

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
