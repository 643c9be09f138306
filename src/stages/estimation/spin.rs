//! Inertia: ten parameters of a body that matter can make, from its shape at uniform density, from what is known of its
//! mass and centre, from fast pushes that turned it and from lifts in which it was twisted.
//!
//! A fast push tells centre of mass, torsional radius and radius of gyration beside the mass ([`super::shoved`]); here they are
//! one body's, whatever was pushed how often. What nothing shows keeps the width of its prior.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Matrix5, SMatrix, Vector3, Vector5};

use super::coast::Shape;
use super::pool::relative_sd;
use super::push::Plane;
use super::resolve::Before;
use super::twist::Twist;
use crate::base::{Estimate, Status};
use crate::math::{Fit, Settings, levenberg_marquardt};
use crate::physics::PseudoInertia;
use crate::twin::Link;

/// What one fast push says of how the body turns, its mass taken as given: the offset of the centre of mass from the
/// centroid in the plane (m), and the logarithms of torsional radius and radius of gyration over those of the shape.
#[derive(Clone, Debug)]
pub(super) struct Spun {
    pub interaction: String,
    /// Support's normal in the link frame.
    normal: Vector3<f64>,
    /// Logarithm of the mass that the rest goes with.
    mass: f64,
    /// The four at that mass, and by how much they move with its logarithm.
    mean: nalgebra::Vector4<f64>,
    slope: nalgebra::Vector4<f64>,
    /// Their covariance, with how the radius of gyration strays from push to push.
    covariance: SMatrix<f64, 4, 4>,
}

/// By how much the moment of friction strays from push to push beside what the law says, as a share of friction force times
/// torsional radius: pressure is not even, and feet that chatter bear by turns. It moves both the middle of what rubs and the
/// torsional radius. What is expected, and the sd of its logarithm; how much it is of a thing is learnt from its pushes.
const STRAYS: (f64, f64) = (0.04, 0.7);
/// What is tried of it, in half doublings.
const TRIED: std::ops::RangeInclusive<i32> = -4..=4;
/// By how much the radius of gyration that a push tells strays (1 sd of the logarithm).
const TURNS: f64 = 0.04;

impl Spun {
    /// From the solution of a push (logarithm of the mass, then the four) with its covariance under priors of mean nought
    /// with these standard deviations, which are taken out; `wide` inflates what the data say. `axes` are those of the plane in
    /// the link frame, `normal` its normal.
    pub fn of(
        interaction: &str,
        solved: (&Vector5<f64>, &Matrix5<f64>),
        priors: [f64; 4],
        wide: f64,
        axes: (&Vector3<f64>, &Vector3<f64>),
        normal: Vector3<f64>,
    ) -> Option<Self> {
        let prior = |k: usize| if k == 0 { 0.0 } else { priors[k - 1].powi(-2) };
        let whole = solved.1.try_inverse()?;
        let data = (whole - Matrix5::from_diagonal(&Vector5::from_fn(|k, _| prior(k)))) / (wide * wide);
        let pull = whole * solved.0 / (wide * wide);
        let frame = Plane::of(normal);
        // The offset in axes that go with the link, however it lay.
        let turn = Matrix2::new(
            frame.x.dot(axes.0),
            frame.x.dot(axes.1),
            frame.y.dot(axes.0),
            frame.y.dot(axes.1),
        );
        let mut turned = Matrix5::identity();
        turned.fixed_view_mut::<2, 2>(1, 1).copy_from(&turn);
        let data = turned * data * turned.transpose();
        let pull = turned * pull;
        let information = data.fixed_view::<4, 4>(1, 1).into_owned();
        // Given the mass, the rest minimises the same quadratic form.
        let loose = (information + SMatrix::<f64, 4, 4>::identity() * (1e-9 * information.trace())).try_inverse()?;
        let mass = solved.0[0];
        let coupling = data.fixed_view::<4, 1>(1, 0).into_owned();
        let mean = loose * (pull.fixed_rows::<4>(1) - coupling * mass);
        // A push that hardly turned says something only far from where it was linearised: there it is doubted by the second
        // order.
        let bent = |k: usize| mean[k] * mean[k];
        let strays = nalgebra::Vector4::new(0.0, 0.0, bent(2).powi(2), bent(3).hypot(TURNS).powi(2));
        Some(Self {
            interaction: interaction.into(),
            normal,
            mass,
            mean,
            slope: -(loose * coupling),
            covariance: loose + SMatrix::from_diagonal(&strays),
        })
    }

    /// Their covariance where the moment of friction strays by the share `strays`, of a shape with this torsional radius (m).
    /// `form` is what the law of pushing leaves open of its radius of gyration.
    fn about(&self, strays: f64, torsional_radius: f64, form: f64) -> SMatrix<f64, 4, 4> {
        let [middle, radius, form] = [strays * torsional_radius, strays, form].map(|s| s * s);
        self.covariance + SMatrix::from_diagonal(&nalgebra::Vector4::new(middle, middle, radius, form))
    }

    /// What `at` misses by, in standard deviations.
    fn misses(
        &self,
        log_mass: f64,
        at: &nalgebra::Vector4<f64>,
        covariance: SMatrix<f64, 4, 4>,
    ) -> nalgebra::Vector4<f64> {
        let off = at - self.mean - self.slope * (log_mass - self.mass);
        let eigen = covariance.symmetric_eigen();
        let roots = eigen.eigenvalues.map(|v| v.max(1e-18).sqrt().recip());
        (eigen.eigenvectors.transpose() * off).component_mul(&roots)
    }
}

/// Logarithmic doubt of the extents of matter about uniform density: of all together (hollow or with a heavy core) and of
/// each; and of its shears, as a share of them.
const DENSITY: [f64; 3] = [0.15, 0.1, 0.1];
/// By how much that is looser where pushes tell of it: a shell has a radius of gyration that is larger by a quarter, a heavy core
/// one that is smaller by a third.
const LOOSE: f64 = 1.5;
/// Of the torsional radius about that of an even pressure, which may lie at the rim or about the middle.
const TORSION: f64 = 0.3;
/// Residuals that are of no touch.
const OWN: usize = 11;
/// Share of the radius of gyration that the law of pushing (limit surface, rigid contact) leaves open.
const FORM: f64 = 0.04;
/// Doubt of the centre of mass beyond what the pushes leave, as a share of what the shape leaves open: the pressure is not
/// quite even, and how high the centre lies is guessed.
const CENTRE: f64 = 0.02;
/// Standard deviations from what was known of the centre, a quarter of what the shape leaves open among it, beyond which it is none.
const ASTRAY: f64 = 4.0;
/// Share of the prior's doubt of the yaw inertia below which it counts as measured.
const TOLD: f64 = 0.5;

/// The body sought, and what is held against it.
struct Sought<'a> {
    prior: PseudoInertia,
    mass_sd: f64,
    centre: (Vector3<f64>, Vector3<f64>),
    /// Centroid and radius of gyration of the shape.
    centroid: Vector3<f64>,
    gyration: f64,
    spins: &'a [Spun],
    twists: &'a [Twist],
    /// Share by which the moment of friction strays (1 sd), and the shape's torsional radius, m.
    strays: f64,
    torsional_radius: f64,
    /// Factor on what the pushes are trusted to.
    doubt: f64,
}

impl Sought<'_> {
    /// Ten parameters of the body, then the torsional radius.
    fn residuals(&self, x: &DVector<f64>) -> DVector<f64> {
        let body = PseudoInertia(std::array::from_fn(|k| x[k]));
        let mut out = vec![2.0 * (x[0] - self.prior.0[0]) / self.mass_sd];
        let off = [1, 2, 3].map(|k| x[k] - self.prior.0[k]);
        let middle = off.iter().sum::<f64>() / 3.0;
        let [all, each, _] = DENSITY.map(|d| {
            if self.spins.is_empty() && self.twists.is_empty() {
                d
            } else {
                LOOSE * d
            }
        });
        let common = all.hypot(each / 3.0_f64.sqrt());
        out.push(middle / common);
        out.extend([
            (off[0] - off[1]) / (2.0_f64.sqrt() * each),
            (off[0] + off[1] - 2.0 * off[2]) / (6.0_f64.sqrt() * each),
        ]);
        for (k, (i, j)) in [(4, (1, 2)), (5, (2, 3)), (6, (1, 3))] {
            let size = (0.5 * (self.prior.0[i] + self.prior.0[j])).exp();
            out.push((x[k] - self.prior.0[k]) / (DENSITY[2] * size));
        }
        out.extend((0..3).map(|k| (x[7 + k] - self.centre.0[k]) / self.centre.1[k]));
        out.push(x[10] / TORSION);
        out.extend(self.twists.iter().map(|t| t.misses(&body)));
        for spun in self.spins {
            let plane = Plane::of(spun.normal);
            let off = plane.flat(&(body.com() - self.centroid));
            let rho = (body.gyration_radius(&spun.normal) / self.gyration).ln();
            let at = nalgebra::Vector4::new(off.x, off.y, x[10], rho);
            let covariance = self.about(spun);
            let misses = spun.misses(2.0 * x[0], &at, covariance) / self.doubt;
            out.extend(misses.iter());
        }
        DVector::from_vec(out)
    }

    /// Where a lift told how it turns, what the law of pushing leaves open is weighed against it.
    fn about(&self, spun: &Spun) -> SMatrix<f64, 4, 4> {
        let form = if self.twists.is_empty() { 0.0 } else { FORM };
        spun.about(self.strays, self.torsional_radius, form)
    }

    fn fit(&self) -> Option<Fit> {
        let start = DVector::from_fn(11, |k, _| if k < 10 { self.prior.0[k] } else { 0.0 });
        let steps = DVector::from_fn(11, |k, _| if (4..10).contains(&k) { 1e-6 } else { 1e-5 });
        let found = levenberg_marquardt(&start, &steps, Settings::default(), |x| self.residuals(x))?;
        found.x.iter().all(|v| v.is_finite()).then_some(found)
    }

    /// The fit with the most probable share by which the moment of friction strays, all else integrated out by Laplace's
    /// method.
    fn settle(&mut self) -> Option<Fit> {
        let size = |determinant: f64| 0.5 * determinant.max(1e-300).ln();
        let mut best: Option<(f64, f64, Fit)> = None;
        for half_doublings in TRIED.filter(|k| *k == 0 || !self.spins.is_empty()) {
            let log = 0.5 * f64::from(half_doublings) * std::f64::consts::LN_2;
            self.strays = STRAYS.0 * log.exp();
            let Some(fit) = self.fit() else { continue };
            let about = |s: &Spun| size(self.about(s).determinant());
            let wide: f64 = self.spins.iter().map(about).sum();
            let before = 0.5 * (log / STRAYS.1).powi(2);
            let lost = fit.cost + wide + before - size(fit.covariance.determinant());
            if best.as_ref().is_none_or(|b| lost < b.0) {
                best = Some((lost, self.strays, fit));
            }
        }
        let (_, strays, fit) = best?;
        self.strays = strays;
        Some(fit)
    }
}

/// Logarithms of torsional radius and radius of gyration over those of the shape beyond which no density makes them: something
/// else turned what such a push turned.
const BEYOND: f64 = 0.9;

impl Spun {
    /// Whether matter can make what it says.
    fn credible(&self) -> bool {
        self.mean[2].abs() < BEYOND && self.mean[3].abs() < BEYOND
    }
}

const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Writes the inertia of a link whose mass and centre are written, and its centre where pushes that turned it know that better.
pub(super) fn write_inertia(
    link: &mut Link,
    before: &Before,
    (spins, twists): (&[Spun], &[Twist]),
    shape: &Shape,
) -> Option<()> {
    let spins: Vec<Spun> = spins.iter().filter(|s| s.credible()).cloned().collect();
    let spins = spins.as_slice();
    let (mass, com, solid) = (link.mass.clone()?, link.com.clone()?, before.solid.as_ref()?);
    let mut normals = twists.iter().map(|t| t.normal).chain(spins.iter().map(|s| s.normal));
    let normal = normals.next().unwrap_or(Vector3::z());
    let (centroid, spread) = before.centre();
    let uniform = solid.inertia * (mass.value / solid.volume);
    let centre = Vector3::from(com.value);
    let mut sought = Sought {
        prior: PseudoInertia::of(mass.value, &centre, &uniform)?,
        mass_sd: relative_sd(&mass).max(1e-6),
        centre: (centre, com.sd.map_or(spread, Vector3::from).map(|s| s.max(1e-5))),
        centroid: centroid.coords,
        gyration: shape.gyration_radius,
        spins,
        twists,
        strays: STRAYS.0,
        torsional_radius: shape.torsional_radius,
        doubt: 1.0,
    };
    let mut fit = sought.settle()?;
    // Pushes that disagree beyond their own noise are trusted the less, all of them.
    let apart: f64 = fit.residuals.iter().skip(OWN + twists.len()).map(|r| r * r).sum();
    let excess = apart / (4.0 * spins.len() as f64 - 2.0).max(1.0);
    if excess > 1.0 {
        sought.doubt = excess.sqrt();
        fit = sought.fit()?;
    }
    let weighed = mass.status != Status::Assumed;
    if weighed && !spins.is_empty() {
        write_centre(link, &com, &fit, (&spread, &normal), spins);
    }
    link.inertia = Some(inertia(&fit, &mass, &sought, &normal, weighed));
    Some(())
}

/// The centre of mass in the plane, where the fit pins it better than what was known.
fn write_centre(
    link: &mut Link,
    known: &Estimate<[f64; 3]>,
    fit: &Fit,
    (spread, normal): (&Vector3<f64>, &Vector3<f64>),
    spins: &[Spun],
) {
    let before = known.sd.unwrap_or((*spread).into());
    let flat = |k: usize| normal[k].abs() < 0.5;
    let sd = [0, 1, 2].map(|k| {
        if flat(k) {
            fit.sd(7 + k).hypot(CENTRE * spread[k])
        } else {
            before[k]
        }
    });
    let better = (0..3).filter(|k| flat(*k)).any(|k| sd[k] < before[k]);
    let pinned = (0..3).filter(|k| flat(*k)).all(|k| sd[k] < 0.5 * spread[k]);
    // Pushes that draw it far from what was known of it were disturbed by something else, and what they say is none of it.
    let astray = |k: usize| (fit.x[7 + k] - known.value[k]).abs() > ASTRAY * before[k].hypot(0.25 * spread[k]);
    if !(better && pinned) || (0..3).filter(|k| flat(*k)).any(astray) {
        return;
    }
    // What was known before is not given up where it was better.
    let value = [0, 1, 2].map(|k| {
        if sd[k] < before[k] {
            fit.x[7 + k]
        } else {
            known.value[k]
        }
    });
    let sd = [0, 1, 2].map(|k| sd[k].min(before[k]));
    let (mut from, mut method) = (
        joined(&known.from, spins),
        "push-spin; the direction along gravity from the shape",
    );
    if known.is_measured() {
        method = "push-limit-surface, push-spin; the direction along gravity from the shape";
    } else {
        from = joined(&[], spins);
    }
    link.com = Some(Estimate::measured(value, sd, "m", from, method));
}

fn joined(from: &[String], spins: &[Spun]) -> Vec<String> {
    let mut out = from.to_vec();
    out.extend(
        spins
            .iter()
            .map(|s| s.interaction.clone())
            .filter(|n| !from.contains(n)),
    );
    out
}

/// The inertia of a fit; measured where pushes or lifts tell that about the support's normal.
fn inertia(fit: &Fit, mass: &Estimate, sought: &Sought, normal: &Vector3<f64>, weighed: bool) -> Estimate<[f64; 6]> {
    let Sought { spins, twists, .. } = sought;
    let body = |x: &DVector<f64>| PseudoInertia(std::array::from_fn(|k| x[k]));
    let flat = |m: &Matrix3<f64>| ENTRIES.map(|at| m[at]);
    let value = flat(&body(&fit.x).inertia());
    let mut slopes = DMatrix::zeros(7, 11);
    for k in 0..10 {
        let step = if k < 4 { 1e-5 } else { 1e-7 };
        let [up, down] = [step, -step].map(|h| {
            let mut x = fit.x.clone();
            x[k] += h;
            let b = body(&x);
            (flat(&b.inertia()), b.gyration_radius(normal).ln())
        });
        for i in 0..6 {
            slopes[(i, k)] = (up.0[i] - down.0[i]) / (2.0 * step);
        }
        slopes[(6, k)] = (up.1 - down.1) / (2.0 * step);
    }
    let spread = &slopes * &fit.covariance * slopes.transpose();
    // Where a lift told it, that doubt is in the fit.
    let law = if spins.is_empty() || !twists.is_empty() {
        0.0
    } else {
        FORM
    };
    let form = |k: usize| 2.0 * law * value[k];
    let sd: [f64; 6] = std::array::from_fn(|k| spread[(k, k)].max(0.0).sqrt().hypot(form(k)));
    let open = DENSITY[0].hypot(DENSITY[1] / 2.0_f64.sqrt());
    // Matter has no moment of inertia below nought: those intervals are of logarithms, as their unknowns are.
    let ends: [[f64; 2]; 6] = std::array::from_fn(|k| {
        if k < 3 {
            let factor = (1.96 * sd[k] / value[k]).exp();
            [value[k] / factor, value[k] * factor]
        } else {
            [value[k] - 1.96 * sd[k], value[k] + 1.96 * sd[k]]
        }
    });
    let told = weighed && !(spins.is_empty() && twists.is_empty());
    if told && spread[(6, 6)].max(0.0).sqrt().hypot(law) < TOLD * open {
        let twisting = twists.iter().map(|t| &t.interaction);
        let mut from = joined(&mass.from, spins);
        from.extend(twisting.filter(|n| !mass.from.contains(n)).cloned());
        let method = if twists.is_empty() {
            "push-spin about the support's normal; the other axes from the shape"
        } else {
            "lift-twist about the vertical; the other axes from the shape"
        };
        return Estimate::measured(value, sd, "kg·m²", from, method).with_interval(ends);
    }
    Estimate {
        from: mass.from.clone(),
        ..Estimate::assumed(value, sd, "kg·m²", "shape-uniform-density")
    }
    .with_interval(ends)
}
