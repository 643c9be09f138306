//! The velocity at which what rubs balances a tool: friction as weights, which is sure but slow, then by its tangents.
//!
//! Weights that are taken from the last velocity bring it nearer by a share (every pass lowers the work of friction); near the
//! end the tangents of friction bring it there at once. A pass by tangents that leaves more out of balance than there was before
//! is taken back.

use nalgebra::allocator::Allocator;
use nalgebra::{
    Const, DVector, DefaultAllocator, Dim, Dyn, Matrix2, Matrix3, OMatrix, OVector, U2, U3, Vector2, Vector3,
};

use super::quasistatic::{Contact, ContactSolution, Dissipator};
use super::{Between, SHORTFALL};

/// Speeds below this count as stuck, m/s or rad/s.
const STUCK: f64 = 1e-6;
const PASSES: usize = 40;
/// The same where a foot presses at points: one of them may be what all turns about.
const PASSES_POINTS: usize = 100;
/// Passes from where a path stood, after which it is begun anew.
const PASSES_ON: usize = 20;
/// Passes by weights alone before tangents are tried, where nothing is known beforehand.
const WEIGHTS_FIRST: usize = 3;
/// Velocities this near are one, and forces this near balance, shares.
const NEAR: f64 = 1e-6;
/// Share of the weights that is left in the tangents: along its way Coulomb friction has none.
const LEFT: f64 = 1e-3;
/// Tangents that leave so much of what was out of balance are no better than weights.
const SLOW: f64 = 0.5;
/// Rows of what a foot resists: two of sliding, one of turning.
const FOOT: usize = 3;

/// How a tool drives what it touches.
#[derive(Clone, Copy)]
pub(super) enum Mode {
    /// The material point moves with the tool.
    Stick,
    /// The force has this direction; only the normal speeds agree.
    Slide(Vector2<f64>),
}

impl Dissipator {
    fn least(&self) -> f64 {
        self.creep.max(STUCK)
    }

    /// What it resists per slip, and how that goes with the slip.
    fn resists(&self, slip: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
        if !self.points.is_empty() {
            return self.over_points(slip);
        }
        let speed = slip.norm().max(self.least());
        let per = self.force / speed + self.damping;
        if self.rows.nrows() == FOOT {
            let between = Between::at((slip[2] / speed).powi(2), SHORTFALL.0);
            let weight = Vector3::new(between.force, between.force, between.moment) * per;
            let weight = Matrix3::from_diagonal(&weight);
            return (weight, weight);
        }
        let weight = Matrix3::identity() * per;
        let tangent = if slip.norm() > self.least() {
            weight - slip * slip.transpose() * (self.force / speed.powi(3))
        } else {
            weight
        };
        (weight, tangent)
    }

    /// The generalised force that keeps it going at this generalised velocity, N and N·m.
    pub(super) fn felt(&self, velocity: &DVector<f64>) -> DVector<f64> {
        let mut slip = Vector3::zeros();
        slip.rows_mut(0, self.rows.nrows()).copy_from(&(&self.rows * velocity));
        let (weight, _) = self.resists(&slip);
        let force = weight * slip + Vector3::x() * self.pull;
        self.rows.transpose() * force.rows(0, self.rows.nrows())
    }

    /// What is resisted per slip, and how that goes with it, of a foot with points, of the velocity of their middle and spin.
    fn over_points(&self, slip: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
        let (mut sum, mut less) = (Matrix3::zeros(), Matrix3::zeros());
        let least = self.least();
        for (at, share) in &self.points {
            let velocity = Vector2::new(slip[0] - slip[2] * at.y, slip[1] + slip[2] * at.x);
            let speed = velocity.norm();
            let per = share * self.force / speed.max(least);
            let (x, y) = (per * at.x, per * at.y);
            sum[(0, 0)] += per;
            sum[(0, 2)] -= y;
            sum[(1, 2)] += x;
            sum[(2, 2)] += x * at.x + y * at.y;
            if speed > least {
                // Along its way a point resists no more the faster it goes.
                let way = velocity / speed;
                let lever = at.perp(&way);
                let row = Vector3::new(way.x, way.y, lever);
                less += row * row.transpose() * per;
            }
        }
        sum[(1, 1)] = sum[(0, 0)];
        sum[(2, 0)] = sum[(0, 2)];
        sum[(2, 1)] = sum[(1, 2)];
        (sum, sum - less)
    }
}

/// A generalised velocity and the force of the tool.
type Found<D> = (OVector<f64, D>, Vector2<f64>);

/// What is to balance, of `D` generalised velocities.
struct Scales<'a, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D> + Allocator<U3, D> + Allocator<U2, D> + Allocator<D, U2>,
{
    size: D,
    elements: Vec<(&'a Dissipator, OMatrix<f64, U3, D>)>,
    pull: OVector<f64, D>,
    jacobian: OMatrix<f64, U2, D>,
    contact: &'a Contact,
    mode: Mode,
}

/// The generalised velocity and the force of the tool, from a velocity that is near, where one is known.
pub(super) fn balanced(
    dissipators: &[Dissipator],
    contact: &Contact,
    mode: Mode,
    from: Option<&DVector<f64>>,
) -> ContactSolution {
    match contact.jacobian.ncols() {
        0..=4 => Scales::new(Const::<4>, dissipators, contact, mode).found(from),
        5..=6 => Scales::new(Const::<6>, dissipators, contact, mode).found(from),
        n => Scales::new(Dyn(n), dissipators, contact, mode).found(from),
    }
}

impl<'a, D: Dim> Scales<'a, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D> + Allocator<U3, D> + Allocator<U2, D> + Allocator<D, U2>,
{
    fn new(size: D, dissipators: &'a [Dissipator], contact: &'a Contact, mode: Mode) -> Self {
        let one = Const::<1>;
        let mut pull = OVector::<f64, D>::zeros_generic(size, one);
        let mut elements = Vec::with_capacity(dissipators.len());
        for element in dissipators {
            let mut rows = OMatrix::<f64, U3, D>::zeros_generic(Const::<3>, size);
            for column in 0..element.rows.ncols() {
                for row in 0..element.rows.nrows() {
                    rows[(row, column)] = element.rows[(row, column)];
                }
                pull[column] += element.rows[(0, column)] * element.pull;
            }
            elements.push((element, rows));
        }
        let mut jacobian = OMatrix::<f64, U2, D>::zeros_generic(Const::<2>, size);
        for column in 0..contact.jacobian.ncols() {
            jacobian[(0, column)] = contact.jacobian[(0, column)];
            jacobian[(1, column)] = contact.jacobian[(1, column)];
        }
        Self {
            size,
            elements,
            pull,
            jacobian,
            contact,
            mode,
        }
    }

    fn found(&self, from: Option<&DVector<f64>>) -> ContactSolution {
        let points = self.elements.iter().any(|e| !e.0.points.is_empty());
        let passes = if points { PASSES_POINTS } else { PASSES };
        let near = from.and_then(|from| {
            let mut start = OVector::<f64, D>::zeros_generic(self.size, Const::<1>);
            (0..from.len()).for_each(|k| start[k] = from[k]);
            let (found, balances) = self.passes(Some(start), PASSES_ON);
            balances.then_some(found)
        });
        let (velocity, force) = near.unwrap_or_else(|| self.passes(None, passes).0);
        ContactSolution {
            velocity: DVector::from_fn(self.contact.jacobian.ncols(), |k, _| velocity[k]),
            force,
        }
    }

    /// What so many passes come to, and whether that balances.
    fn passes(&self, from: Option<OVector<f64, D>>, most: usize) -> (Found<D>, bool) {
        let first = if from.is_some() { 0 } else { WEIGHTS_FIRST };
        let mut velocity = from;
        let mut force = Vector2::zeros();
        // What was out of balance before the last pass by tangents, and the velocity there.
        let mut before: Option<(f64, OVector<f64, D>)> = None;
        for pass in 0..most {
            let (mut weight, mut tangent) = self.resisted(velocity.as_ref());
            let mut by_tangents = pass >= first;
            if let Some(now) = &velocity {
                let resisted = &weight * now + &self.pull;
                let driven = self.jacobian.tr_mul(&force);
                let open = (&resisted - &driven).norm();
                if pass > 0 && open <= NEAR * resisted.norm() {
                    return ((now.clone(), force), true);
                }
                match before.take() {
                    // Farther off than before it: taken back.
                    Some((was, there)) if open > was => {
                        (weight, tangent) = self.resisted(Some(&there));
                        velocity = Some(there);
                        by_tangents = false;
                    }
                    Some((was, _)) if open > SLOW * was => by_tangents = false,
                    _ if pass > 0 && by_tangents => before = velocity.clone().map(|v| (open, v)),
                    _ => (),
                }
            }
            let solved = by_tangents
                .then(|| self.by_tangents(&weight, &tangent, velocity.as_ref()?))
                .flatten();
            by_tangents = solved.is_some();
            let Some((next, pushed)) = solved.or_else(|| self.balance(&weight, &self.pull, NEAR)) else {
                break;
            };
            let moved = velocity.as_ref().map_or(f64::INFINITY, |v| (&next - v).norm());
            let done = !by_tangents && moved <= NEAR * next.norm();
            (velocity, force) = (Some(next), pushed);
            if done {
                return ((velocity.unwrap_or_else(|| self.still()), force), true);
            }
        }
        ((velocity.unwrap_or_else(|| self.still()), force), false)
    }

    fn still(&self) -> OVector<f64, D> {
        OVector::<f64, D>::zeros_generic(self.size, Const::<1>)
    }

    /// Weights and tangents of all that rubs; at first all slide as fast as the tool, none turns.
    fn resisted(&self, velocity: Option<&OVector<f64, D>>) -> (OMatrix<f64, D, D>, OMatrix<f64, D, D>) {
        let mut weight = OMatrix::<f64, D, D>::identity_generic(self.size, self.size) * 1e-9;
        let mut tangent = weight.clone();
        for (element, rows) in &self.elements {
            let slip = velocity.map_or_else(
                || Vector3::new(self.contact.tool_velocity.norm().max(element.least()), 0.0, 0.0),
                |v| rows * v,
            );
            let (at, along) = element.resists(&slip);
            weight += rows.tr_mul(&(at * rows));
            tangent += rows.tr_mul(&(along * rows));
        }
        (weight, tangent)
    }

    /// One pass by tangents: what friction lacks of them acts as a pull.
    fn by_tangents(
        &self,
        weight: &OMatrix<f64, D, D>,
        tangent: &OMatrix<f64, D, D>,
        velocity: &OVector<f64, D>,
    ) -> Option<Found<D>> {
        let tangent = tangent * (1.0 - LEFT) + weight * LEFT;
        let pull = &self.pull + (weight - &tangent) * velocity;
        let found = self.balance(&tangent, &pull, NEAR * LEFT)?;
        found.0.iter().all(|v| v.is_finite()).then_some(found)
    }

    /// One linear balance with fixed weights: `q' = W^-1 (J' f - pull)` with the contact's speeds met. A direction in which the
    /// touched point goes less than `still` of the whole does not move.
    fn balance(&self, weight: &OMatrix<f64, D, D>, pull: &OVector<f64, D>, still: f64) -> Option<Found<D>> {
        let factor = weight.clone().cholesky()?;
        let answer = factor.solve(&self.jacobian.transpose());
        let mobility: Matrix2<f64> = &self.jacobian * &answer;
        // How the contact would move if the tool were not there.
        let slack = factor.solve(pull);
        let wanted = self.contact.tool_velocity + &self.jacobian * &slack;
        let force = match self.mode {
            // A direction in which the body cannot go takes no part: what the tool meets there is not friction.
            Mode::Stick => {
                let smallest = still * mobility.trace();
                let inverse = mobility.pseudo_inverse(smallest.max(f64::MIN_POSITIVE));
                inverse.map_or_else(|_| Vector2::zeros(), |inverse| inverse * wanted)
            }
            Mode::Slide(push) => {
                let along = self.contact.inward.dot(&(mobility * push));
                push * (self.contact.inward.dot(&wanted) / along.max(1e-12))
            }
        };
        Some((answer * force - slack, force))
    }
}
