//! Angular momentum that what hangs on the tool carries within itself: something spins in it.
//!
//! About the tool's origin, in its axes, a rigid load asks `τ = c × (a − g) + I α + ω × I ω` of the hand (rigid-body identification of a
//! load: Atkeson, An and Hollerbach 1986, `c` the first moment of the mass); a rotor of constant angular momentum `L` in it adds
//! `ω × L`. A torque that is read late, a drag and a tare stand beside them.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use super::facts::subject;
use super::lift::aloft;
use crate::capture::{Interaction, Kind, PoseStream, Segmented};
use crate::math::{bayesian_linear, local_quadratic};

/// Half the time over which motion and torque are smoothed, and the way from one reading to the next, s.
const HALF: f64 = 0.1;
const STEP: f64 = 0.06;
/// Readings that overlap by so much say so many times what as many of their own would.
const OVERLAP: f64 = 2.5;
/// Fewest readings, and the least rate of turning that tells anything, rad/s.
const FEWEST: usize = 10;
const TURNS: f64 = 0.2;
/// What is thought of a load beforehand: arm of its centre and radius of gyration, m; a tare, N·m; a lateness, s; a drag, N·m·s.
const ARM: f64 = 0.3;
const RADIUS: f64 = 0.2;
const TARE: f64 = 0.05;
const LATE: f64 = 0.05;
const DRAG: f64 = 0.05;
/// Unknowns without a rotor, and with it.
const RIGID: usize = 16;
const ALL: usize = 19;

/// What spins in something that a hand turned aloft.
#[derive(Clone, Debug)]
pub struct Gyroscopic {
    /// The lift that tells it.
    pub interaction: String,
    /// Angular momentum in the axes of the tool, N·m·s; what lies along an axis about which all turns go is not known.
    pub momentum: Vector3<f64>,
    /// Log-likelihood over that of a rigid load, nats.
    pub gain: f64,
    /// Root mean square of the torque that a rigid load and one with a rotor leave, N·m.
    pub left: [f64; 2],
}

/// Motion and torque at one time, in the axes of the tool.
struct Row {
    /// rad/s and rad/s².
    spin: Vector3<f64>,
    spin_rate: Vector3<f64>,
    /// Acceleration of the tool's origin less gravity, m/s².
    pull: Vector3<f64>,
    /// N·m.
    torque: Vector3<f64>,
}

/// What spins in what this lift turned aloft; nothing where torque or turns are missing.
pub fn gyroscopic(interaction: &Interaction, cut: &Segmented, gravity: &Vector3<f64>) -> Option<Gyroscopic> {
    let rows = rows(interaction, cut, gravity)?;
    let turning = |r: &&Row| r.spin.norm() > TURNS;
    if rows.iter().filter(turning).count() < FEWEST {
        return None;
    }
    let stream = interaction.force.as_ref()?;
    let mass = stream.force.iter().map(Vector3::norm).fold(0.0, f64::max) / gravity.norm().max(1e-9);
    let [plain, full] = [fitted(&rows, mass, RIGID)?, fitted(&rows, mass, ALL)?];
    let count = 3.0 * rows.len() as f64 / OVERLAP;
    let momentum = full.0.fixed_rows::<3>(RIGID).into_owned();
    Some(Gyroscopic {
        interaction: interaction.name.clone(),
        momentum,
        gain: (count - ALL as f64).max(0.0) * (plain.1 / full.1).ln(),
        left: [plain.1, full.1],
    })
}

fn rows(interaction: &Interaction, cut: &Segmented, gravity: &Vector3<f64>) -> Option<Vec<Row>> {
    let up = -gravity.try_normalize(1e-9)?;
    let held = interaction.kind == Kind::Lift && interaction.tool.as_ref().is_some_and(|t| t.grip);
    let stream = interaction.force.as_ref().filter(|_| held)?;
    let torques = stream.torque.as_ref()?;
    let path = interaction.tool_path.as_ref()?;
    let stretch = aloft(interaction, cut, &up, subject(interaction, cut)?)?;
    let torque = [0, 1, 2].map(|k| torques.iter().map(|t| t[k]).collect::<Vec<f64>>());
    let place = [0, 1, 2].map(|k| path.position.iter().map(|p| p[k]).collect::<Vec<f64>>());
    let count = ((stretch.end - stretch.start) / STEP) as usize;
    let row = |k: usize| {
        let t = stretch.start + k as f64 * STEP;
        let turn = turning_at(path, t)?;
        let each = |time: &[f64], of: &[Vec<f64>; 3]| {
            let [x, y, z] = [0, 1, 2].map(|k: usize| local_quadratic(time, &of[k], t, HALF));
            Some([x?, y?, z?])
        };
        let felt = each(&stream.time, &torque)?.map(|f| f.value);
        let speeding = each(&path.time, &place)?.map(|f| f.acceleration);
        let back = turn.0.inverse();
        Some(Row {
            spin: turn.1,
            spin_rate: turn.2,
            pull: back * (Vector3::from(speeding) - gravity),
            torque: back * Vector3::from(felt),
        })
    };
    Some((0..count).filter_map(row).collect())
}

/// Orientation, rate of turning and how fast that grows, the latter two in the turned axes.
fn turning_at(path: &PoseStream, t: f64) -> Option<(UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>)> {
    let home = path.sample(t)?.1?;
    let near = path.time.partition_point(|x| *x < t - HALF)..path.time.partition_point(|x| *x <= t + HALF);
    let time = &path.time[near.clone()];
    let turned: Vec<Vector3<f64>> = path.rotation[near]
        .iter()
        .map(|q| q.map_or(Vector3::repeat(f64::NAN), |q| (home.inverse() * q).scaled_axis()))
        .collect();
    let [x, y, z] = [0, 1, 2].map(|k: usize| {
        let own: Vec<f64> = turned.iter().map(|v| v[k]).collect();
        local_quadratic(time, &own, t, HALF)
    });
    let [x, y, z] = [x?, y?, z?];
    let small = UnitQuaternion::from_scaled_axis(Vector3::new(x.value, y.value, z.value));
    Some((
        home * small,
        Vector3::new(x.velocity, y.velocity, z.velocity),
        Vector3::new(x.acceleration, y.acceleration, z.acceleration),
    ))
}

/// `I v` as what multiplies `(xx, yy, zz, xy, xz, yz)` of `I`.
fn of_inertia(v: &Vector3<f64>) -> [Vector3<f64>; 6] {
    [
        Vector3::new(v.x, 0.0, 0.0),
        Vector3::new(0.0, v.y, 0.0),
        Vector3::new(0.0, 0.0, v.z),
        Vector3::new(v.y, v.x, 0.0),
        Vector3::new(v.z, 0.0, v.x),
        Vector3::new(0.0, v.z, v.y),
    ]
}

/// What multiplies the unknowns: first moment (3), inertia (6), tare (3), lateness of the torque of the weight (3), drag; then the rotor.
fn columns(row: &Row) -> [Vector3<f64>; ALL] {
    let (spin, pull) = (&row.spin, &row.pull);
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let [of_rate, of_spin] = [of_inertia(&row.spin_rate), of_inertia(spin)];
    // Seen from the tool what is fixed in the room turns back.
    let changes = -spin.cross(pull);
    let mut all = [Vector3::zeros(); ALL];
    for k in 0..3 {
        all[k] = axes[k].cross(pull);
        all[9 + k] = axes[k];
        all[12 + k] = -(axes[k].cross(&changes) + spin.cross(&axes[k].cross(pull)));
        all[RIGID + k] = spin.cross(&axes[k]);
    }
    for k in 0..6 {
        all[3 + k] = of_rate[k] + spin.cross(&of_spin[k]);
    }
    all[15] = *spin;
    all
}

/// The unknowns, and the root mean square of what is left.
fn fitted(rows: &[Row], mass: f64, count: usize) -> Option<(DVector<f64>, f64)> {
    let columns: Vec<[Vector3<f64>; ALL]> = rows.iter().map(columns).collect();
    let a = DMatrix::from_fn(3 * rows.len(), count, |i, j| columns[i / 3][j][i % 3]);
    let b = DVector::from_fn(3 * rows.len(), |i, _| rows[i / 3].torque[i % 3]);
    let spread = |k: usize| match k {
        0..3 => mass * ARM,
        3..9 => mass * RADIUS * RADIUS,
        9..12 => TARE,
        12..15 => LATE * mass * ARM,
        15 => DRAG,
        _ => 1.0,
    };
    let beforehand = DVector::from_fn(count, |k, _| spread(k));
    let none = DVector::zeros(count);
    // The noise of a torque is what is left of it.
    let mut noise: f64 = 1e-2;
    let mut fit = None;
    for _ in 0..4 {
        let weights = DVector::from_element(b.len(), noise.powi(-2) / OVERLAP);
        let own = bayesian_linear(&a, &b, &weights, &none, &beforehand)?;
        noise = (own.residuals.norm_squared() / b.len() as f64).sqrt().max(1e-6);
        fit = Some(own);
    }
    Some((fit?.x, noise))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// Rows of a load that is turned about two axes in turn, with a rotor of this angular momentum.
    fn turned(momentum: &Vector3<f64>) -> Vec<Row> {
        let mass = 0.8;
        let arm = Vector3::new(0.01, -0.02, -0.06);
        let inertia = Matrix3::new(3e-3, 2e-4, 0.0, 2e-4, 4e-3, 1e-4, 0.0, 1e-4, 2e-3) * mass;
        let mut turn = UnitQuaternion::identity();
        let one = |k: u32| {
            let t = STEP * f64::from(k);
            let spin = Vector3::new(0.8 * (2.0 * t).sin(), 0.6 * (1.3 * t).cos(), 0.3 * t.sin());
            let spin_rate = Vector3::new(1.6 * (2.0 * t).cos(), -0.78 * (1.3 * t).sin(), 0.3 * t.cos());
            turn *= UnitQuaternion::from_scaled_axis(spin * STEP);
            let pull = turn.inverse() * Vector3::z() * 9.81;
            let body = inertia * spin_rate + spin.cross(&(inertia * spin));
            let grain = 1e-3 * Vector3::new((91.0 * t).sin(), (77.0 * t).cos(), (113.0 * t).sin());
            Row {
                spin,
                spin_rate,
                pull,
                torque: mass * arm.cross(&pull) + body + spin.cross(momentum) + grain,
            }
        };
        (0..80).map(one).collect()
    }

    #[test]
    fn a_rotor_is_told_from_a_rigid_load() {
        let hidden = Vector3::new(0.005, 0.02, -0.01);
        let rows = turned(&hidden);
        let [plain, full] = [RIGID, ALL].map(|count| fitted(&rows, 0.8, count).expect("a fit"));
        let momentum = full.0.fixed_rows::<3>(RIGID).into_owned();
        assert!((momentum - hidden).norm() < 1e-3, "{momentum}");
        assert!(plain.1 > 3.0 * full.1, "{} {}", plain.1, full.1);
        let rows = turned(&Vector3::zeros());
        let [plain, full] = [RIGID, ALL].map(|count| fitted(&rows, 0.8, count).expect("a fit"));
        assert!(plain.1 < 1.1 * full.1);
    }
}
