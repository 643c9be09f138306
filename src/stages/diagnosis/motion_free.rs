//! What tools that did not yet move a joint read: fingers that hold nothing, and hands that hold still.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::capture::{Capture, PhaseKind, Segmented};

/// Share of the friction of a joint up to which what a free finger reads is none.
const NOTHING: f64 = 0.05;
/// Angle by which a tool that keeps its orientation may turn, rad.
const KEEPS: f64 = 0.3;

/// What fingers that held nothing read before they touched.
#[derive(Clone, Copy, Debug, Default)]
pub struct Free {
    /// Mean and the largest size of what was read, N; nothing where none of them did so.
    tare: Option<(Vector3<f64>, f64)>,
    /// Friction of the joint at the tool, N.
    friction: f64,
    /// What all hands read along a direction in which none of them strains, N, where no finger was free.
    held: Option<Vector3<f64>>,
    /// The most that any of them read before it set out, fingers or hands, with its noise, N; nothing of a few.
    quiet: Option<f64>,
    /// Tools are turned, within motions or from one to the next.
    pub tool_turns: bool,
}

/// Fewest hands that tell what they read without strain, how many times their noise it may scatter, and how many times that the strain
/// of any other direction does at least.
const HANDS: usize = 5;
const STILL: f64 = 4.0;
const STRAINS: f64 = 8.0;
/// Standard deviations from nought from which on it counts.
const CLEAR: f64 = 8.0;
/// How many times the most that any hand read a bias has to be, to be spoken against.
const READ: f64 = 3.0;

/// What hands that hold on read before they set out has in common along the direction in which it scatters least: they strain at what
/// sticks as chance will have it, where nothing moves they do not.
fn unstrained(read: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    let n = read.len() as f64;
    if read.len() < HANDS {
        return None;
    }
    let mean = read.iter().map(|r| r.0).sum::<Vector3<f64>>() / n;
    let off = |r: &(Vector3<f64>, f64)| (r.0 - mean) * (r.0 - mean).transpose();
    let spread = SymmetricEigen::new(read.iter().map(off).sum::<Matrix3<f64>>() / (n - 1.0));
    let least = spread.eigenvalues.imin();
    let scatter = spread.eigenvalues[least].max(0.0).sqrt();
    let others = (0..3)
        .filter(|k| *k != least)
        .map(|k| spread.eigenvalues[k].max(0.0).sqrt());
    let noise = crate::math::median(&read.iter().map(|r| r.1).collect::<Vec<f64>>())?;
    let common = spread.eigenvectors.column(least) * mean.dot(&spread.eigenvectors.column(least));
    let strained = others.fold(f64::INFINITY, f64::min) > STRAINS * scatter;
    let told = scatter < STILL * noise && strained && common.norm() > CLEAR * scatter.max(noise);
    told.then_some(common)
}

impl Free {
    /// Beside a joint that `friction` holds, N at the tool.
    pub fn of(capture: &Capture, segmented: &[Segmented], friction: f64) -> Self {
        let free = capture
            .fitted()
            .filter(|i| i.tool.as_ref().is_some_and(|t| !t.grip && !t.pin));
        let tares: Vec<Vector3<f64>> = free
            .filter_map(|i| segmented.iter().find(|s| s.interaction == i.name)?.force_tare)
            .collect();
        let tools = capture.interactions.iter().filter_map(|i| i.tool_path.as_ref());
        let mut turned = tools.flat_map(|p| p.rotation.iter().flatten());
        let first = turned.next().copied();
        let tool_turns = first.is_some_and(|f| turned.any(|r| f.angle_to(r) > KEEPS));
        let mean = tares.iter().sum::<Vector3<f64>>() / tares.len().max(1) as f64;
        let largest = tares.iter().map(|t| t.norm()).fold(0.0, f64::max);
        let hands = held_reads(capture, segmented);
        let most = hands.iter().map(|(read, noise)| read.norm() + 2.0 * noise);
        Self {
            tare: (!tares.is_empty()).then_some((mean, largest)),
            held: unstrained(&hands).filter(|_| tares.is_empty()),
            quiet: (tares.is_empty() && hands.len() >= HANDS).then(|| most.fold(0.0, f64::max)),
            friction,
            tool_turns,
        }
    }

    /// All of them read this force, N.
    #[cfg(test)]
    pub fn reading(tare: Vector3<f64>, friction: f64) -> Self {
        Self {
            tare: Some((tare, tare.norm())),
            held: None,
            quiet: None,
            friction,
            tool_turns: false,
        }
    }

    /// Hands that read no more than this.
    #[cfg(test)]
    pub fn quiet(most: f64) -> Self {
        Self {
            quiet: Some(most),
            ..Self::default()
        }
    }

    /// It was fingers that told it, not hands.
    pub fn of_fingers(&self) -> bool {
        self.tare.is_some()
    }

    /// They were there and read nothing.
    pub fn reads_nothing(&self) -> bool {
        self.tare.is_some_and(|(_, largest)| largest < NOTHING * self.friction)
    }

    /// Whether a force of so much, N, that the sensor reads always is unlikely: none of many hands read a part of it before it set out.
    /// Hands that regulate what they read to nought would hide it.
    pub fn speaks_against(&self, bias: f64) -> bool {
        self.quiet.is_some_and(|most| bias.abs() > READ * most)
    }

    /// The force that all of them read, N; of hands, that along which none strains.
    pub fn bias(&self) -> Option<Vector3<f64>> {
        let mean = self.tare.map(|t| t.0).or(self.held)?;
        (mean.norm() > NOTHING * self.friction).then_some(mean)
    }
}

/// What each hand read before it set out, with the noise of that mean, N.
fn held_reads(capture: &Capture, segmented: &[Segmented]) -> Vec<(Vector3<f64>, f64)> {
    let hands = capture
        .fitted()
        .filter(|i| i.tool.as_ref().is_some_and(|t| t.grip || t.pin));
    let read = |i: &crate::capture::Interaction| {
        let own = segmented.iter().find(|s| s.interaction == i.name)?;
        let sets_out = own.of(PhaseKind::Slide).map(|p| p.start).reduce(f64::min)?;
        let stream = i.force.as_ref()?;
        let begin = *stream.time.first()?;
        let rests = stream
            .time
            .partition_point(|t| *t < begin + BEFORE * (sets_out - begin));
        let rows: Vec<&Vector3<f64>> = stream.force[..rests]
            .iter()
            .filter(|f| f.iter().all(|x| x.is_finite()))
            .collect();
        if rows.len() < FEW_ROWS {
            return None;
        }
        let n = rows.len() as f64;
        let mean = rows.iter().copied().sum::<Vector3<f64>>() / n;
        Some((mean, own.force_noise? / n.sqrt().min(FEW_ROWS as f64)))
    };
    hands.filter_map(read).collect()
}

/// Share of the time before it sets out that is surely before it, and the fewest readings of it; noise that goes on from reading to
/// reading does not average out as more than the square of these do.
const BEFORE: f64 = 0.6;
const FEW_ROWS: usize = 7;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_that_strain_along_two_ways_tell_what_is_read_along_the_third() {
        let one = |k: u32, z: f64| {
            let strain = Vector3::new(f64::from(k * k % 7) - 2.0, f64::from(k * 5 % 3) - 1.5, 0.0);
            (strain + Vector3::z() * (z + 0.002 * f64::from(k % 2)), 0.003)
        };
        let read = |z: f64| (0..8).map(|k| one(k, z)).collect::<Vec<_>>();
        let told = unstrained(&read(0.4)).expect("read by all");
        assert!((told.z - 0.4).abs() < 0.01 && told.xy().norm() < 0.01, "{told}");
        assert!(unstrained(&read(0.0)).is_none());
        // Hands that do not strain at all may have been told to pull so.
        let still: Vec<_> = (0..8).map(|_| (Vector3::z() * 0.4, 0.003)).collect();
        assert!(unstrained(&still).is_none());
    }
}
