//! Yaw inertia that is not that of the shape at uniform density, alone and beside a centre of mass that is not the shape's.

use nalgebra::{Matrix3, Vector3};

use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Kind};
use crate::geometry::mass_properties;
use crate::stages::estimation::support_normal;
use crate::twin::{CauseOdds, Finding, Link, Model};

/// Standard deviations from that of the shape from which on it counts, p below 6e-7; and where fast pushes told it, p below 5e-4: what
/// is common to all of them, which is most of the doubt, is in them already.
const CLEAR: f64 = 5.0;
const CLEAR_BY_PUSHES: f64 = 3.5;
/// How an inertia is called that fast pushes told, or a twist aloft, and one that the shape gave.
const SPUN: &str = "push-spin";
const TWISTED: &str = "lift-twist";
const GUESSED: &str = "shape-uniform-density";
/// What a mesh leaves open of the inertia of its shape, and the least share that counts.
const SHAPE: f64 = 0.02;
const TURNS: f64 = 0.2;
/// How far matter that is not even strays from the yaw inertia of even matter (1 sd of the logarithm); the doubt with which an
/// inertia starts is as wide.
const STRAYS: f64 = 0.5;
/// Doubt of the logarithm that many fast pushes leave: how the moment of friction strays is the same in all of them.
const WELL: f64 = 0.1;
/// The factor on the yaw inertia, as a parameter of a cause.
const KAPPA: &str = "kappa";
/// Odds below which the other cause is not worth telling.
const SLIGHT: f64 = 0.03;

/// Yaw inertia of a link over that of its shape at uniform density.
struct Yaw<'a> {
    of: &'a Estimate<[f64; 6]>,
    /// Its logarithm, and 1 sd of that.
    off: f64,
    sd: f64,
}

impl<'a> Yaw<'a> {
    fn of(link: &'a Link, model: &Model, up: &Vector3<f64>) -> Option<Self> {
        let (own, mass) = (link.inertia.as_ref()?, link.mass.as_ref()?);
        let solid = mass_properties(model.meshes.get(link.mesh.as_ref()?)?)?;
        let normal = link.pose.rotation.inverse() * up;
        let about = |m: &Matrix3<f64>| normal.dot(&(m * normal));
        let [xx, yy, zz, xy, xz, yz] = own.value;
        let found = about(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        let plain = about(&(solid.inertia_per_density * (mass.value / solid.volume)));
        let [x, y, z, ..] = own.sd?;
        let spread = normal
            .component_mul(&normal)
            .component_mul(&Vector3::new(x, y, z))
            .norm();
        Some(Self {
            of: own,
            off: (found / plain).ln(),
            sd: (spread / found).hypot(SHAPE),
        })
    }

    /// Factor on the inertia of the shape.
    fn factor(&self) -> Estimate {
        let (value, sd) = (self.off.exp(), self.off.exp() * self.sd);
        if self.of.is_measured() {
            Estimate::measured(value, sd, "1", self.of.from.clone(), &self.of.method)
        } else {
            Estimate::assumed(value, sd, "1", &self.of.method)
        }
    }

    /// Probability that it is the shape's, as likely as not before anything was measured: how much denser the posterior is there
    /// than the prior was (Dickey's ratio of densities for a nested model).
    fn even(&self) -> f64 {
        let ratio = STRAYS / self.sd * (-0.5 * (self.off / self.sd).powi(2)).exp();
        ratio / (1.0 + ratio)
    }
}

/// Whether it was measured: by a lift in which it was twisted, or by more than one fast push or slide.
fn touched(inertia: &Estimate<[f64; 6]>, capture: &Capture) -> bool {
    let shoved = capture
        .interactions
        .iter()
        .filter(|i| matches!(i.kind, Kind::Push | Kind::Toss));
    let pushes = shoved.filter(|i| inertia.from.contains(&i.name)).count();
    let spun = inertia.method.starts_with(SPUN) && pushes > 1;
    inertia.is_measured() && (spun || inertia.method.starts_with(TWISTED))
}

/// Whether touches told the yaw inertia of a thing.
pub fn tells_yaw(capture: &Capture, model: &Model) -> bool {
    let up = support_normal(capture, model).into_inner();
    let told = |link: &Link| Yaw::of(link, model, &up).is_some_and(|y| touched(y.of, capture));
    model.twin.links().any(|(_, l)| told(l))
}

/// Bodies that resist being spun about the support's normal more, or less, than their shape at uniform density does.
pub fn yaw_findings(capture: &Capture, model: &Model) -> Vec<Finding> {
    let up = support_normal(capture, model).into_inner();
    let one = |link: &Link| {
        let yaw = Yaw::of(link, model, &up)?;
        let Yaw { of, off, sd } = yaw;
        let clear = if of.method.starts_with(SPUN) {
            CLEAR_BY_PUSHES
        } else {
            CLEAR
        };
        let clear = off.abs() >= (clear * sd).max(TURNS);
        if !(clear && touched(of, capture)) {
            return None;
        }
        let told = Told {
            cause: "yaw-inertia",
            place: &link.name,
            probability: 0.9,
            rivals: &[],
            parameter: (KAPPA, yaw.factor()),
            residual: "turning",
            statistic: off.abs() / sd,
            words: format!(
                "{} resists being spun {:.2} times as much as its shape at uniform density",
                link.name,
                off.exp()
            ),
            gain: gain("rotation", "rad", [0.0; 2], Vec::new()),
        };
        Some(told.finding())
    };
    model.twin.links().filter_map(|(_, link)| one(link)).collect()
}

/// Whether fast pushes told the yaw inertia of a thing about as well as they ever do: what rubs below it strays.
pub fn spun(capture: &Capture, model: &Model, name: &str) -> bool {
    let up = support_normal(capture, model).into_inner();
    let yaw = model.twin.link(name).and_then(|link| Yaw::of(link, model, &up));
    yaw.is_some_and(|y| touched(y.of, capture) && y.sd < WELL)
}

/// Whether a lift in which it was twisted told the yaw inertia of a thing.
pub fn twisted(model: &Model, name: &str) -> bool {
    let inertia = model.twin.link(name).and_then(|link| link.inertia.as_ref());
    inertia.is_some_and(|i| i.method.starts_with(TWISTED))
}

/// A centre of mass that is not the shape's and a yaw inertia that is not either are one thing: a density that is not even.
///
/// Of a body whose centre is off, what fast pushes say of its yaw inertia weighs the one against the other.
pub fn uneven(capture: &Capture, model: &Model, findings: &mut [Finding]) {
    let up = support_normal(capture, model).into_inner();
    let yaws = yaw_findings(capture, model);
    for offset in findings.iter_mut().filter(|f| f.cause == "com-offset") {
        let Some(link) = model.twin.link(&offset.place) else {
            continue;
        };
        let Some(yaw) =
            Yaw::of(link, model, &up).filter(|y| [SPUN, TWISTED, GUESSED].iter().any(|m| y.of.method.contains(m)))
        else {
            continue;
        };
        let told = yaws.iter().find(|y| y.place == offset.place);
        let all = offset.probability;
        let even = if told.is_some() { 0.0 } else { yaw.even() };
        let other = if even < 0.5 {
            offset.cause = "nonuniform-density".into();
            offset.parameters.insert(KAPPA.into(), yaw.factor());
            ("com-offset", even)
        } else {
            ("nonuniform-density", 1.0 - even)
        };
        offset.evidence.extend(told.iter().flat_map(|t| t.evidence.clone()));
        if other.1 > SLIGHT {
            offset.probability = all * (1.0 - other.1);
            offset.alternatives.push(CauseOdds {
                cause: other.0.into(),
                probability: all * other.1,
            });
        }
    }
}
