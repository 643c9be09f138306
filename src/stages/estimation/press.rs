//! Stiffness and damping of the spot that was pressed (Tanaka et al., "haptic vision", eq. 7 with damping).
//!
//! `F = k u + d u'` with the compression u. The tool's travel after touch is exact to microns but holds the
//! tool tip's own yielding; the tracked motion of the body's surface holds none of it but is noisy. Where the
//! body's frame gives way under the tool, it moves by a share r of the tool's travel, and the body's own
//! stiffness is that seen by the tool divided by r. Where it does not move, the compression is the tool's travel.

use nalgebra::{DMatrix, DVector, Vector3};

use super::evidence::{tare_of, tool_at};
use super::squeeze::{Course, Squeezed, squeeze};
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::math::{LinearFit, effective_samples, interpolate, median, robust_linear};

/// By how much force and position may be out of step, s.
const LAG: f64 = 4e-3;
/// Half of the time over which the tool's speed is taken, s, and in readings of its path, the fewest that tell it.
const SPEEDS: (f64, f64) = (0.015, 2.6);
/// How long before and after contact a press is compared, s.
const BEYOND: f64 = 0.1;

/// Stiffness and damping from one press.
#[derive(Clone, Debug)]
pub(super) struct Press {
    pub interaction: String,
    /// As the tool sees it, tip and body in series, N/m.
    pub seen: (f64, f64),
    /// N·s/m as the tool sees it.
    pub damping: Option<(f64, f64)>,
    /// Share of the variance of that which all presses share.
    pub lagging: f64,
    /// Dry friction makes a loop that is as wide at any speed.
    pub dry: bool,
    /// What it does beyond a linear spring with damping, in words.
    pub beyond: Option<String>,
    /// Share of the tool's travel by which the body's frame moved, where it moved.
    pub share: Option<(f64, f64)>,
}

/// Rows while the tool is in contact: time, normal force, tool travel and its speed.
struct Rows {
    time: Vec<f64>,
    force: Vec<f64>,
    travel: Vec<f64>,
    speed: Vec<f64>,
}

fn rows_of(interaction: &Interaction, segmented: &Segmented, direction: &Vector3<f64>, beyond: f64) -> Option<Rows> {
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let tare = tare_of(interaction, segmented);
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let along: Vec<f64> = tool.position.iter().map(|p| p.coords.dot(direction)).collect();
    let steps: Vec<f64> = tool.time.windows(2).map(|w| w[1] - w[0]).collect();
    let half = SPEEDS.0.max(SPEEDS.1 * median(&steps)?);
    let mut rows = Rows {
        time: Vec::new(),
        force: Vec::new(),
        travel: Vec::new(),
        speed: Vec::new(),
    };
    for i in 0..stream.time.len() {
        let t = stream.time[i];
        if t < stick.start - beyond || t > stick.end + beyond || !stream.force[i].x.is_finite() {
            continue;
        }
        let (Some(p), Some(fit)) = (
            tool_at(tool, t),
            crate::math::local_quadratic(&tool.time, &along, t, half),
        ) else {
            continue;
        };
        rows.time.push(t);
        rows.force.push((stream.force[i] - tare.force).dot(direction));
        rows.travel.push(p.coords.dot(direction));
        rows.speed.push(fit.velocity);
    }
    (rows.time.len() >= 20).then_some(rows)
}

/// Force against travel and speed over rows that carry a real load.
fn regress(rows: &Rows, with_damping: bool, least: f64) -> Option<(LinearFit, f64)> {
    let used: Vec<usize> = (0..rows.time.len()).filter(|&i| rows.force[i] > least).collect();
    let columns = if with_damping { 3 } else { 2 };
    let a = DMatrix::from_fn(used.len(), columns, |i, j| match j {
        0 => 1.0,
        1 => rows.travel[used[i]] - rows.travel[0],
        _ => rows.speed[used[i]],
    });
    let b = DVector::from_iterator(used.len(), used.iter().map(|&i| rows.force[i]));
    let fit = robust_linear(&a, &b)?;
    let memory = used.len() as f64 / effective_samples(fit.residuals.as_slice());
    Some((fit, memory.max(1.0).sqrt()))
}

/// By how much the body's frame moves per metre of tool travel, with its standard deviation.
fn share_of_frame(
    interaction: &Interaction,
    target: &str,
    direction: &Vector3<f64>,
    rows: &Rows,
    contact: f64,
) -> Option<(f64, f64)> {
    let track = interaction.tracks.get(target).filter(|t| t.len() > 8)?;
    let (start, end) = (rows.time[0], rows.time[rows.time.len() - 1]);
    let depth: Vec<f64> = track.position.iter().map(|p| p.coords.dot(direction)).collect();
    let rest: Vec<f64> = (0..track.len())
        .filter(|&i| track.time[i] < start)
        .map(|i| depth[i])
        .collect();
    let home = median(&rest);
    let used: Vec<usize> = (0..track.len())
        .filter(|&i| track.time[i] >= start && track.time[i] <= end && depth[i].is_finite())
        .collect();
    // Force shows only some way after contact: the travel counts from where the line of the force begins.
    let travel = |i: usize| interpolate(&rows.time, &rows.travel, track.time[i]).map_or(f64::NAN, |x| x - contact);
    // The rows at rest pin the start of the line, since contact began at zero travel.
    let mut points: Vec<(f64, f64)> = used
        .iter()
        .map(|&i| (travel(i), depth[i]))
        .filter(|p| p.0.is_finite())
        .collect();
    points.extend(rest.iter().filter(|d| d.is_finite()).map(|d| (0.0, *d)));
    home?;
    let a = DMatrix::from_fn(points.len(), 2, |i, j| if j == 0 { 1.0 } else { points[i].0 });
    let b = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let fit = robust_linear(&a, &b)?;
    Some((fit.x[1], fit.sd(1)))
}

/// Hardening and relaxation in words; nothing where there is none.
fn described(found: Squeezed) -> Option<String> {
    let hardening = found.hardening.map(|(a, sd)| {
        let way = if a > 0.0 { "hardens" } else { "softens" };
        format!("it {way}: F = k u (1 + a u) with a = {a:.1} ± {sd:.1} 1/m")
    });
    let relaxing = found.relaxing.map(|[(share, [l, h]), (tau, [low, high])]| {
        format!(
            "a share of {share:.3} [{l:.3}, {h:.3}] of its stiffness relaxes with tau = {tau:.3} [{low:.3}, {high:.3}] s"
        )
    });
    let dry = found.dry.map(|(a, sd)| {
        format!(
            "its loop is as wide at any speed, {a:.2} ± {sd:.2} N more on the way in and less on the way out: dry friction \
             within it, no damping"
        )
    });
    let words: Vec<String> = [hardening, relaxing, dry].into_iter().flatten().collect();
    (!words.is_empty()).then(|| words.join("; "))
}

/// Stiffness and damping from one press; `None` where nothing was squeezed.
pub(super) fn press_of(
    interaction: &Interaction,
    segmented: &Segmented,
    target: &str,
    down: &Vector3<f64>,
) -> Option<Press> {
    let direction = pressing_direction(interaction, segmented).unwrap_or(*down);
    let rows = rows_of(interaction, segmented, &direction, 0.0)?;
    let largest = crate::math::quantile(&rows.force, 0.95)?;
    let noise = segmented.force_noise.unwrap_or(0.0);
    if largest < 10.0 * noise {
        return None;
    }
    let least = (0.1 * largest).max(4.0 * noise);
    let (fit, memory) = regress(&rows, true, least)?;
    // A lag between force and position of a few milliseconds looks like damping of `k` times that lag.
    let damping_sd = (fit.sd(2) * memory).hypot(LAG * fit.x[1]);
    let clear = fit.x[2] > 3.0 * damping_sd;
    let (fit, memory) = if clear {
        (fit, memory)
    } else {
        regress(&rows, false, least)?
    };
    let seen = (fit.x[1], fit.sd(1) * memory);
    if seen.0.is_nan() || seen.0 <= 3.0 * seen.1 {
        return None;
    }
    let course = rows_of(interaction, segmented, &direction, BEYOND).map(|r| Course {
        time: r.time,
        force: r.force,
        travel: r.travel,
        speed: r.speed,
        noise: noise.max(1e-3),
    });
    let contact = rows.travel[0] - fit.x[0] / seen.0;
    let simulated = course.and_then(|c| squeeze(&c, seen.0, contact));
    // The straight line is the check: a simulated law far from it has gone astray.
    let simulated = simulated.filter(|s| (s.stiffness.0 / seen.0).ln().abs() < 0.4);
    let moved =
        share_of_frame(interaction, target, &direction, &rows, contact).filter(|(r, sd)| *r > 0.3 && *r > 4.0 * sd);
    Some(Press {
        interaction: interaction.name.clone(),
        // Where the curve bends, tip or body may be what bends it: the slope under load is what both have in series, and
        // what the share of the frame refers to.
        seen: simulated
            .filter(|s| s.hardening.is_none())
            .map_or((seen.0, seen.1.hypot(0.003 * seen.0)), |s| s.stiffness),
        damping: match simulated {
            Some(s) => Some(s.damping),
            None => clear.then(|| (fit.x[2], damping_sd)),
        },
        lagging: simulated.map_or(1.0, |s| s.lagging),
        dry: simulated.is_some_and(|s| s.dry.is_some()),
        beyond: simulated.and_then(described),
        share: moved,
    })
}

/// Stiffness of a tool tip that nobody stated, N/m, as the decimal logarithm with its standard deviation: from soft
/// pads to bare metal (about 5e4, give or take a factor of three).
const TIP: (f64, f64) = (4.7, 0.5);

/// By how much the body is stiffer than what the tool feels, tip and body in series: value and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stiffer {
    pub value: f64,
    pub ci95: [f64; 2],
}

/// From all presses of one spot: the body has a share `r = 1 - k_seen / k_tip` of the travel, and is stiffer by `1 / r`.
/// Median and quantiles of the posterior over the stiffness of the tip, which is lopsided: a tip may be much softer than
/// thought, none is stiffer than rigid. With no frame that moved, the compression is the tool's travel and the tip's part
/// stays in it.
pub(super) fn stiffer_than_felt(presses: &[Press]) -> Stiffer {
    let seen = crate::math::median(&presses.iter().map(|p| p.seen.0).collect::<Vec<_>>()).unwrap_or(0.0);
    let measured: Vec<(f64, f64)> = presses.iter().filter_map(|p| p.share).collect();
    if measured.is_empty() {
        return Stiffer {
            value: 1.0,
            ci95: [1.0; 2],
        };
    }
    let mut grid: Vec<(f64, f64)> = Vec::new();
    for i in 0..=600 {
        // From the stiffest tip down: the factor grows.
        let log = TIP.0 + TIP.1 * (3.0 - i as f64 / 100.0);
        let r = 1.0 - seen / 10.0_f64.powf(log);
        if r < 0.1 {
            break;
        }
        let misfit: f64 = measured.iter().map(|(m, sd)| ((r - m) / sd.max(2e-3)).powi(2)).sum();
        grid.push((1.0 / r, (-0.5 * (misfit + ((log - TIP.0) / TIP.1).powi(2))).exp()));
    }
    let total: f64 = grid.iter().map(|g| g.1).sum();
    let at = |share: f64| {
        let mut sum = 0.0;
        let found = grid.iter().find(|g| {
            sum += g.1;
            sum >= share * total
        });
        found.map_or(1.0, |g| g.0)
    };
    if total <= 1e-12 || at(0.5) > 5.0 {
        let direct = crate::math::random_effects(
            &measured.iter().map(|m| m.0).collect::<Vec<_>>(),
            &measured.iter().map(|m| m.1).collect::<Vec<_>>(),
            0.02,
        );
        let (r, sd) = direct.map_or((1.0, 0.05), |d| (d.mean.min(1.0), d.sd));
        return Stiffer {
            value: 1.0 / r,
            ci95: [1.0 / (r + 1.96 * sd), 1.0 / (r - 1.96 * sd).max(0.1)],
        };
    }
    Stiffer {
        value: at(0.5),
        ci95: [at(0.025), at(0.975)],
    }
}

/// The direction of the mean force under load.
fn pressing_direction(interaction: &Interaction, segmented: &Segmented) -> Option<Vector3<f64>> {
    let stream = interaction.force.as_ref()?;
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let tare = tare_of(interaction, segmented);
    let mean = super::evidence::mean_wrench(stream, stick.start, stick.end, &tare)?;
    mean.force.try_normalize(1e-6)
}
