//! Bonds that gave way: the force that the tool bore before the two came apart, against what it bore afterwards.

use super::placing::Placed;
use crate::base::Estimate;
use crate::capture::{Interaction, Kind};
use crate::math::{interpolate, median, quantile};

/// A bond that gave way, or may have.
#[derive(Clone, Debug)]
pub struct Gave {
    /// Natural log of the odds that it gives to a bond against mere rest.
    pub log_odds: f64,
    /// What the bond bore, N, with its standard deviation.
    pub force: (f64, f64),
}

/// The most that one broken bond says.
const MOST: f64 = 5.5;
/// Static friction is at most this many times the kinetic one.
const STATIC: f64 = 2.5;
/// Seconds after its peak by which the load of a bond is gone, where nothing is left of it.
const GONE: f64 = 0.1;
/// Density of what may have been struck, kg/m³, and the standard deviation of the logarithm of what a blow then tells
/// of it: of density, of rebound.
const DENSITY: f64 = 700.0;
const STRUCK: f64 = 0.9;
/// The same where a bond bore the load: nobody knows how strong it was.
const BORNE: (f64, f64) = (2.5, 2.5);
/// Impulse of a blow over momentum at the finger's speed, for a rebound of 0.3.
const REBOUND: f64 = 1.3;

/// Share by which the load of a bond may differ from the finger's, for the bodies ring.
const RINGING: f64 = 0.04;

struct Peak {
    at: usize,
    force: f64,
    /// Rise in the last step before it, N: a stiff bond is loaded and gone between two readings.
    step: f64,
}

/// Time and size of the force, where it was read.
fn sizes(run: &Interaction) -> Option<(Vec<f64>, Vec<f64>)> {
    let stream = run.force.as_ref()?;
    let rows = stream.time.iter().zip(&stream.force).filter(|(_, f)| f.x.is_finite());
    Some(rows.map(|(t, f)| (*t, f.norm())).unzip())
}

fn peak(time: &[f64], force: &[f64], from: f64, to: f64) -> Option<Peak> {
    let near = time.partition_point(|t| *t < from)..time.partition_point(|t| *t <= to);
    let at = near.clone().max_by(|a, b| force[*a].total_cmp(&force[*b]))?;
    let before = at.checked_sub(1).filter(|i| near.contains(i));
    Some(Peak {
        at,
        force: force[at],
        step: before.map_or(0.0, |i| (force[at] - force[i]).max(0.0)),
    })
}

/// The pull at which a bond gave way: a lift of the upper one whose force shows a peak at the parting far
/// above what it carries afterwards. The bond bore the difference.
pub fn lifted_off(run: &Interaction, parted: f64, upper: Option<&Placed>) -> Option<(f64, f64)> {
    let lifted_upper = upper.is_none_or(|u| run.target.as_deref() == Some(&u.name));
    if run.kind != Kind::Lift || !lifted_upper {
        return None;
    }
    let (time, force) = sizes(run)?;
    let top = peak(&time, &force, parted - 0.6, parted + 0.15)?;
    let after = &force[time.partition_point(|t| *t < parted + 0.3)..];
    let carried = quantile(after, 0.5)?;
    let spread = quantile(after, 0.84)? - carried;
    (top.force > 2.0 * carried && top.force - carried > 1.0 + 6.0 * spread).then(|| {
        // It bore at least the peak, and at most one more step of it.
        let sd = spread.max(0.02 * top.force).hypot(top.step / 12f64.sqrt());
        (top.force - carried + 0.5 * top.step, sd)
    })
}

/// The push at which a bond gave way: of the upper one, that bore more before it moved than friction does afterwards.
///
/// A blow on what merely rests does so too, but its impulse is the momentum that the thing gets: impulse over volume and
/// speed is then a density such as things have. A bond bears as long as it is asked to. The odds are those of the
/// logarithm of that density under either.
pub fn pushed_off(run: &Interaction, parted: f64, upper: &Placed) -> Option<Gave> {
    if !matches!(run.kind, Kind::Push | Kind::Pull) || run.target.as_deref() != Some(&upper.name) {
        return None;
    }
    let (time, force) = sizes(run)?;
    let quiet = &force[..time.partition_point(|t| *t < time[0] + 0.2)];
    let noise = quantile(quiet, 0.9)?;
    let touch = force.windows(3).position(|w| w.iter().all(|f| *f > 3.0 * noise))?;
    let top = peak(&time, &force, time[touch], parted + 0.15)?;
    let fell = (top.at..force.len()).find(|i| force[*i] < 0.5 * top.force)?;
    let end = time.partition_point(|t| *t <= time[fell] + 1.0);
    let after = median(&force[fell..end])?;
    // What stays up after the peak and falls to nothing in the end is friction under a tool that then goes away.
    if time[fell] - time[top.at] > GONE && after < 6.0 * noise {
        return None;
    }
    if top.force < STATIC * after + 6.0 * noise {
        return None;
    }
    let excess = |i: usize| (force[i] - STATIC * after).max(0.0);
    let impulse: f64 = (touch..fell).map(|i| excess(i) * (time[i + 1] - time[i])).sum();
    let path = run.tool_path.as_ref()?;
    let along =
        |k: usize, t: f64| interpolate(&path.time, &path.position.iter().map(|p| p[k]).collect::<Vec<f64>>(), t);
    // Over the way to the touch, where the finger is free.
    let (t1, t0) = (time[touch], time[touch] - 0.1);
    let square: Option<f64> = (0..3).map(|k| Some((along(k, t1)? - along(k, t0)?).powi(2))).sum();
    let speed = square?.sqrt() / (t1 - t0);
    let volume = upper.mesh.as_ref()?.volume();
    let struck = REBOUND * volume * speed * DENSITY;
    if struck <= 0.0 {
        return None;
    }
    let x = (impulse / struck).ln().clamp(0.0, 20.0);
    let normal = |mean: f64, sd: f64| -0.5 * ((x - mean) / sd).powi(2) - sd.ln();
    // Friction beneath bears a share of the load, from none to all that it can, until the bond is gone.
    let borne = top.force - 0.5 * after + 0.5 * top.step;
    let sd = (RINGING * top.force)
        .hypot(noise)
        .hypot(top.step / 12f64.sqrt())
        .hypot(after / 12f64.sqrt());
    Some(Gave {
        log_odds: (normal(BORNE.0, BORNE.1) - normal(0.0, STRUCK)).min(MOST),
        force: (borne, sd),
    })
}

impl Gave {
    /// The force as an estimate: measured where the odds say that there was a bond, else only an upper end.
    pub fn estimate(&self, interaction: &str, sure: bool) -> Estimate {
        let (force, sd) = self.force;
        let from = vec![interaction.to_owned()];
        let told = Estimate::measured(force, sd, "N", from, "force-peak");
        if sure {
            return told;
        }
        let open = told.with_interval([0.0, force + 1.96 * sd]);
        Estimate {
            status: crate::base::Status::Assumed,
            ..open
        }
    }
}
