//! Blocks of wrench and motion from pushes and pulls, and the force at which a body broke away.

use nalgebra::{Point3, Vector2, Vector3};

use super::Config;
use super::evidence::{MeanWrench, MotionState, bridge_snapshots, mean_wrench, motion_at, tare_of, tool_at};
use super::face::Face;
use super::facts::Ground;
use crate::capture::{Interaction, PhaseKind, PoseStream, Segmented, WrenchStream};

/// Wrench and motion of the pushed link averaged over a block of time, in the plane of the support.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Middle of the block, s.
    pub time: f64,
    /// Force on the body, N, in the plane's axes.
    pub force: Vector2<f64>,
    /// Force on the body along the support's normal, N.
    pub lift: f64,
    /// Moment about the link's origin along the normal, N·m; nothing where a hand held the body and its torque was not read.
    pub moment: Option<f64>,
    /// Velocity of the link's origin, m/s.
    pub velocity: Vector2<f64>,
    /// Spin about the normal, rad/s.
    pub spin: f64,
    /// Acceleration of the link's origin, m/s².
    pub acceleration: Vector2<f64>,
    /// Axes of the link in the plane: plane vector of a link vector is `axes * v`.
    pub axes: nalgebra::Matrix2x3<f64>,
    /// Standard deviation of the velocity, m/s.
    pub velocity_sd: f64,
    /// Height above the support at which a tool without torque acts, m; zero where the tool holds the body stiffly.
    pub height: f64,
}

/// One push of one link.
#[derive(Clone, Debug)]
pub(super) struct Push {
    pub interaction: String,
    pub blocks: Vec<Block>,
    /// Mean direction of the motion in the plane, world.
    pub direction: Vector3<f64>,
    /// The pose between was not seen, only before and after.
    pub bridged: bool,
    /// Standard deviation of the jerking relative to the force.
    pub chatter: f64,
    /// Standard deviation of the force that all of the push shares, N: of what the sensor reads without contact.
    pub tare_sd: f64,
    /// The largest force as it broke away, where it stuck first.
    pub breakaway: Option<Breakaway>,
}

/// The end of sticking.
#[derive(Clone, Copy, Debug)]
pub(super) struct Breakaway {
    /// Largest force and its standard deviation, N.
    pub peak: (f64, f64),
    /// How fast the force rose, N/s, infinite where it was up within a few readings, and the tool went, m/s.
    pub rise: f64,
    pub speed: f64,
}

impl Breakaway {
    /// By how much the force may swing over where the tool, through a contact of stiffness k, brings a body of `mass` (kg)
    /// to its speed: `v sqrt(k m)`, with `k v` the rise before, N. Damping takes most of it away, how much is not known.
    pub fn swing(&self, mass: f64) -> f64 {
        (self.rise * self.speed * mass).sqrt()
    }
}

/// Two axes that span the support, and its normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub x: Vector3<f64>,
    pub y: Vector3<f64>,
    pub normal: Vector3<f64>,
}

impl Plane {
    pub fn of(normal: Vector3<f64>) -> Self {
        let seed = if normal.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let x = (seed - normal * normal.dot(&seed)).normalize();
        Self {
            x,
            y: normal.cross(&x),
            normal,
        }
    }

    pub fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(v.dot(&self.x), v.dot(&self.y))
    }
}

/// The blocks of one push, a force without torque taken to act at the finger's centre; `None` where it has no force, no
/// track, or nothing slid.
pub(super) fn read_push(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    config: &Config,
) -> Option<Push> {
    read_push_on(None, interaction, segmented, link, ground, config)
}

/// The same, the force acting where the finger touches `face`.
pub(super) fn read_push_on(
    face: Option<&Face>,
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    config: &Config,
) -> Option<Push> {
    let plane = &ground.plane;
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    let track = interaction.tracks.get(link)?;
    let bridged = track.is_snapshot_pair();
    let whole;
    let (track, start, end) = if bridged {
        whole = bridge_snapshots(track, tool, slide.start, slide.end)?;
        (&whole, slide.start, slide.end)
    } else {
        (track, slide.start + config.settling, slide.end - 0.5 * config.settling)
    };
    let tare = tare_of(interaction, segmented);
    let noise = if bridged {
        0.0
    } else {
        segmented.position_noise.unwrap_or(3e-4)
    };
    let mut blocks = Vec::new();
    let mut t = start + 0.5 * config.block;
    while t + 0.5 * config.block <= end {
        let (from, to) = (t - 0.5 * config.block, t + 0.5 * config.block);
        let wrench = mean_wrench(stream, from, to, &tare);
        let motion = motion_at(track, t, config.smoothing);
        if let (Some(w), Some(m), Some(p)) = (wrench, motion, tool_at(tool, t)) {
            let mut block = block_of(interaction, ground, face, &w, &m, &p, noise);
            block.time = t;
            if bridged {
                block.acceleration = Vector2::zeros();
            } else {
                // Where the body jerks, the force dips while it sticks and is `mu N` while it slides: the median of
                // a block lies nearer to the friction force than its mean.
                let plateau = steadiness(interaction, segmented, plane, from, to).0;
                block.force *= plateau;
                block.moment = block.moment.map(|m| m * plateau);
            }
            blocks.push(block);
        }
        t += config.block;
    }
    let chatter = if bridged {
        0.0
    } else {
        steadiness(interaction, segmented, plane, start, end).1
    };
    if !bridged {
        blocks.truncate(one_way(&blocks));
    }
    let path: Vector2<f64> = blocks.iter().map(|b| b.velocity).sum();
    (blocks.len() >= 2 && path.norm() > 0.0).then(|| Push {
        interaction: interaction.name.clone(),
        direction: (plane.x * path.x + plane.y * path.y).normalize(),
        blocks,
        bridged,
        chatter,
        tare_sd: tare_sd(stream, segmented),
        breakaway: breakaway(interaction, segmented, plane, track),
    })
}

/// Share of the largest speed below which what moved before has stopped, or turned back.
const STOPPED: f64 = 0.03;

/// How many blocks from the first on go one way: a hand that holds may stop and come back within one slide.
fn one_way(blocks: &[Block]) -> usize {
    let fastest = blocks.iter().map(|b| b.velocity.norm()).fold(0.0, f64::max);
    let Some(first) = blocks.iter().position(|b| b.velocity.norm() > 0.5 * fastest) else {
        return blocks.len();
    };
    let way = blocks[first].velocity.normalize();
    let mut later = first..blocks.len();
    later
        .find(|i| blocks[*i].velocity.dot(&way) < STOPPED * fastest)
        .unwrap_or(blocks.len())
}

/// Doubt of the mean of what the sensor read before contact, N.
fn tare_sd(stream: &WrenchStream, segmented: &Segmented) -> f64 {
    let touched = segmented
        .phases
        .iter()
        .find(|p| !matches!(p.kind, PhaseKind::Rest | PhaseKind::Approach));
    let before = touched.map_or(0, |p| stream.time.partition_point(|t| *t < p.start));
    segmented.force_noise.unwrap_or(0.0) / (before.max(1) as f64).sqrt()
}

/// Wrench about the link's origin and motion, in the plane of the support.
fn block_of(
    interaction: &Interaction,
    ground: &Ground,
    face: Option<&Face>,
    wrench: &MeanWrench,
    motion: &MotionState,
    tool: &Point3<f64>,
    noise: f64,
) -> Block {
    let plane = &ground.plane;
    let stiff = interaction.tool.as_ref().is_some_and(|t| t.grip);
    let force = wrench.force;
    let arm = tool.coords - motion.pose.translation.vector;
    let moment = match wrench.torque {
        Some(torque) => Some(torque + arm.cross(&force)),
        // A hand twists what it holds.
        None if stiff => None,
        // The force of a finger acts where it and the face touch.
        None => {
            let touch = face.and_then(|f| f.touch(&motion.pose, tool)).unwrap_or_default();
            Some((arm + touch).cross(&force))
        }
    };
    let axes = motion.pose.rotation.to_rotation_matrix().into_inner();
    Block {
        time: 0.0,
        force: plane.flat(&force),
        lift: force.dot(&plane.normal),
        moment: moment.map(|m| m.dot(&plane.normal)),
        velocity: plane.flat(&motion.velocity),
        spin: motion.spin.dot(&plane.normal),
        acceleration: plane.flat(&motion.acceleration),
        axes: nalgebra::Matrix2x3::from_rows(&[plane.x.transpose() * axes, plane.y.transpose() * axes]),
        velocity_sd: noise * motion.velocity_gain,
        height: if stiff {
            0.0
        } else {
            (tool - ground.point).dot(&plane.normal).max(0.0)
        },
    }
}

/// Span over which force is averaged before jerking is looked for, s.
const JERK: f64 = 0.02;
/// What changes more slowly than this many of these spans is no jerking.
const SLOW: usize = 10;

/// Median over mean, and relative scatter beyond the sensor's noise, of the horizontal force between two times.
pub(super) fn steadiness(
    interaction: &Interaction,
    segmented: &Segmented,
    plane: &Plane,
    start: f64,
    end: f64,
) -> (f64, f64) {
    let Some(stream) = &interaction.force else {
        return (1.0, 0.0);
    };
    let tare = tare_of(interaction, segmented).force;
    let rows: Vec<f64> = (0..stream.time.len())
        .filter(|&i| stream.time[i] >= start && stream.time[i] <= end)
        .map(|i| plane.flat(&(stream.force[i] - tare)).norm())
        .filter(|f| f.is_finite())
        .collect();
    // Faster jerking than this is the contact's own ringing: its mean is right by the balance of momentum.
    let width = ((JERK * rows.len() as f64 / (end - start).max(1e-9)).round() as usize).max(1);
    if rows.len() < 2 * width || rows.len() < 20 {
        return (1.0, 0.0);
    }
    let smooth: Vec<f64> = rows
        .windows(width)
        .map(|w| w.iter().sum::<f64>() / width as f64)
        .collect();
    let mean = smooth.iter().sum::<f64>() / smooth.len() as f64;
    let variance = jerking(&smooth, SLOW * width);
    let noise = segmented.force_noise.unwrap_or(0.0);
    match crate::math::median(&smooth) {
        Some(median) if mean > 0.0 => {
            let excess = (variance - 1.2 * noise * noise / width as f64).max(0.0);
            (median / mean, excess.sqrt() / mean)
        }
        _ => (1.0, 0.0),
    }
}

/// Mean square by which the values leave their own means over `span` of them: a force that changes slowly, as the body
/// turns, does not jerk.
fn jerking(values: &[f64], span: usize) -> f64 {
    let mut sums = vec![0.0];
    for v in values {
        sums.push(sums[sums.len() - 1] + v);
    }
    let n = values.len();
    let about = |i: usize| {
        // As far to one side as to the other, so that a slope leaves nothing.
        let reach = (span / 2).min(i).min(n - 1 - i);
        (sums[i + reach + 1] - sums[i - reach]) / (2 * reach + 1) as f64
    };
    (0..n).map(|i| (values[i] - about(i)).powi(2)).sum::<f64>() / n as f64
}

/// Span over which the tool's speed at the peak is taken, s.
const RISE: f64 = 0.02;
/// Shares of the peak between which the force is taken to rise evenly, and the spans of averaging that this must last at
/// least: what is up sooner may have risen as fast as it likes.
const RISING: [f64; 2] = [0.2, 0.8];
const RESOLVED: f64 = 1.5;
/// Readings of force over which its peak is averaged.
const PEAK: f64 = 3.0;

/// Largest horizontal force in the first moments of sliding, where the body stuck long enough before for the
/// touch not to be a blow.
fn breakaway(interaction: &Interaction, segmented: &Segmented, plane: &Plane, track: &PoseStream) -> Option<Breakaway> {
    let stick = segmented.of(PhaseKind::Stick).next()?;
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let stream = interaction.force.as_ref()?;
    if stick.end - stick.start < 0.03 || track.len() < 2 {
        return None;
    }
    let tare = tare_of(interaction, segmented);
    // The peak lasts as long as a bristle takes to let go: a few readings, no more.
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let span = (PEAK / rate).max(0.004);
    // What is called sticking lasts until the motion shows in the track: the peak may lie well before its end.
    let mut best: Option<(f64, f64, f64)> = None;
    let mut course: Vec<(f64, f64)> = Vec::new();
    let mut t = stick.start;
    while t < (slide.start + 0.15).min(slide.end) {
        if let Some(w) = mean_wrench(stream, t - 0.5 * span, t + 0.5 * span, &tare) {
            let force = plane.flat(&w.force).norm();
            let sd = segmented.force_noise.unwrap_or(0.0) / (w.rows as f64).sqrt();
            course.push((t, force));
            if best.is_none_or(|(b, ..)| force > b) {
                best = Some((force, sd, t));
            }
        }
        t += 0.25 * span;
    }
    let (peak, noise, at) = best?;
    let tool = interaction.tool_path.as_ref()?;
    let step = tool_at(tool, at)? - tool_at(tool, at - RISE)?;
    Some(Breakaway {
        // The largest of several noisy means lies about one standard deviation too high.
        peak: (peak - noise, noise),
        rise: rise_to(&course, (at, peak), span),
        speed: step.norm() / RISE,
    })
}

/// How fast the force (time, N) rose to its peak, N/s, from means over `span`: infinite where that does not show.
fn rise_to(course: &[(f64, f64)], (at, peak): (f64, f64), span: f64) -> f64 {
    let before = &course[..course.partition_point(|c| c.0 < at)];
    let [low, high] = RISING.map(|share| share * peak);
    let Some(begins) = before.iter().rposition(|c| c.1 < low) else {
        return f64::INFINITY;
    };
    let up = before[begins..].iter().find(|c| c.1 > high).map_or(at, |c| c.0);
    let lasts = up - before[begins].0;
    if lasts > RESOLVED * span {
        (high - low) / lasts
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_within_a_few_readings_is_not_known() {
        let ramp = |lasts: f64| -> Vec<(f64, f64)> {
            let at = |k: i32| 0.0015 * f64::from(k);
            (0..40)
                .map(|k| (at(k), (2.0 * (at(k) - 0.01) / lasts).clamp(0.0, 2.0)))
                .collect()
        };
        let slow = rise_to(&ramp(0.04), (0.0525, 2.0), 0.006);
        assert!((slow / 50.0 - 1.0).abs() < 0.2, "{slow}");
        assert!(rise_to(&ramp(0.004), (0.016, 2.0), 0.006).is_infinite());
    }
}
