//! A force that swings at one frequency whatever is touched, and where: of a table that shakes, or a sensor that hums.
//!
//! No law of a touch is periodic in time, so that nothing of the catalogue explains it. Spectra of single touches have tops of many
//! kinds; what counts is one frequency that stands out of its neighbourhood in nearly all of them.

use nalgebra::Vector3;

use super::sensor::taken_out;
use crate::capture::{Capture, Hum, Interaction, Segmented, SensorFaults};
use crate::math::{CommonLine, Grid, Spectrum, median, quantile};
use crate::twin::{BaseFit, Evidence, Finding};

/// Frequencies that are tried, Hz, and by how much they differ.
const LOWEST: f64 = 2.0;
const HIGHEST: f64 = 40.0;
const STEP: f64 = 0.1;
/// Seconds of one sample at least.
const SAMPLE: f64 = 0.01;
/// Share of the usual force from which on something is touched, the time over which that is smoothed, s, and what of a touch its
/// beginning and its end are.
const TOUCHES: f64 = 0.35;
const SMOOTH: f64 = 0.05;
const ENDS: [f64; 2] = [0.2, 0.1];
/// Shortest stretch, s, and fewest samples of it.
const SHORTEST: f64 = 0.5;
const SAMPLES: usize = 40;
/// Fewest touches, and by how much it stands out in those that count.
const FEWEST: usize = 5;
const STANDS_OUT: f64 = 4.0;
/// Power over that of the neighbourhood, of the middle touch, from which on it is one frequency, with the share of touches in which it
/// stands out: of 900 captures of five engines and of real scenes none in which nothing shakes came to it, but one that sticks and
/// slips.
const CLEAR: [(f64, f64); 2] = [(60.0, 0.75), (100.0, 0.6)];
/// A thing that is shoved along hides what shakes, one that sticks shows it: stretches of so long, s, which begin at every half of
/// it, the lowest frequency that they tell, Hz, and as above. Below it what sticks and slips, or wobbles, has tops as clear: of 330
/// captures of the lab, of MuJoCo, of another engine and of real scenes none came to a third of this above it where nothing shakes.
const STRETCH: f64 = 0.6;
const QUICK: f64 = 12.0;
const STRETCH_STANDS_OUT: f64 = 25.0;
const STRETCH_CLEAR: (f64, f64) = (100.0, 0.6);
/// Friction that falls as it slides faster sticks and slips on a finger that gives, at one frequency.
const STICKS_AND_SLIPS: [&str; 2] = ["velocity-weakening-friction", "rate-state-friction"];
/// What is left of the odds of a name beside it: a law that swings with it, by chance, is soon found.
const PART: f64 = 0.5;

const IN_TIME: Grid = Grid {
    lowest: LOWEST,
    highest: HIGHEST,
    step: STEP,
};
const IN_STRETCHES: Grid = Grid {
    lowest: 5.0,
    highest: HIGHEST,
    step: 0.25,
};

/// One frequency in nearly all touches.
#[derive(Clone, Debug)]
struct Shaking {
    hertz: f64,
    /// Half of how far it swings, N.
    force: f64,
    /// Power over that of its neighbourhood.
    ratio: f64,
    /// In so many touches of so many.
    touches: [usize; 2],
}

impl Shaking {
    /// As `diagnosis.json` says it.
    fn evidence(&self) -> Evidence {
        let [shaken, all] = self.touches;
        Evidence {
            residual: "force over time".into(),
            test: "power at one frequency over that of its neighbourhood, in the middle touch".into(),
            statistic: self.ratio,
            p_value: (-(shaken as f64) * self.ratio.ln()).exp(),
            words: format!(
                "the force of {shaken} of {all} touches swings by {:.3} N at {:.1} Hz, whatever is touched: something shakes, or \
                 the sensor hums, of which the catalogue knows nothing",
                self.force, self.hertz
            ),
        }
    }
}

/// Of a hum in nearly all readings.
fn hums(hum: &Hum) -> Evidence {
    let [humming, all] = hum.streams;
    Evidence {
        residual: "force over time".into(),
        test: "power at one frequency over that of its neighbourhood, in the middle recording".into(),
        statistic: hum.ratio,
        p_value: (-(humming as f64) * hum.ratio.ln()).exp(),
        words: format!(
            "the readings of force of {humming} of {all} touches swing by {:.3} N at {:.1} Hz from their beginning on: the sensor \
             hums, or something shakes it, of which the catalogue knows nothing",
            hum.amplitude, hum.frequency
        ),
    }
}

/// Of a tracker that held its last pose for a while, in so many of all poses.
fn frozen((count, of): (usize, usize)) -> Evidence {
    Evidence {
        residual: "tracks".into(),
        test: "a pose like the one before to the last digit, for three rows and more".into(),
        statistic: count as f64,
        p_value: 0.0,
        words: format!(
            "{:.1} % of the tracked poses only repeat the one before, for several rows at a time: the tracker stood still, of which the \
             catalogue knows nothing; they were left out",
            100.0 * count as f64 / of as f64
        ),
    }
}

/// What shakes, hums or stands still, if something does: it is told beside what the plain model leaves, and makes what was named less sure.
pub fn shaken(
    (capture, segmented): (&Capture, &[Segmented]),
    faults: &SensorFaults,
    (findings, base): (&mut [Finding], &mut BaseFit),
) -> Option<Evidence> {
    let slips = findings.iter().any(|f| STICKS_AND_SLIPS.contains(&f.cause.as_str()));
    let found = shaking(capture, segmented).filter(|_| !slips).map(|s| s.evidence());
    let found = found.or_else(|| faults.hum.as_ref().map(hums));
    let found = found.or_else(|| faults.frozen.map(frozen));
    tell_beside(found, (findings, base))
}

/// Tells of what swings beside what was named, which it makes less sure.
pub(super) fn tell_beside(
    swings: Option<Evidence>,
    (findings, base): (&mut [Finding], &mut BaseFit),
) -> Option<Evidence> {
    let told = findings.iter_mut().filter(|f| swings.is_some() && !taken_out(f));
    told.for_each(|f| f.less_likely(PART));
    base.tests.extend(swings.iter().cloned());
    swings
}

/// Means over `SAMPLE` s of the longest stretch in which something is touched, without these shares of it at its ends.
pub(super) fn stretch(interaction: &Interaction, ends: [f64; 2]) -> Option<(Vec<f64>, Vec<Vector3<f64>>)> {
    let stream = interaction.force.as_ref()?;
    let (mut times, mut forces) = (Vec::new(), Vec::<Vector3<f64>>::new());
    let (mut sum, mut count, mut begin) = (Vector3::zeros(), 0.0, *stream.time.first()?);
    let mut clock = 0.0;
    for (t, f) in stream.time.iter().zip(&stream.force) {
        if !f.iter().all(|x| x.is_finite()) {
            continue;
        }
        if t - begin >= SAMPLE && count > 0.0 {
            times.push(clock / count);
            forces.push(sum / count);
            (sum, count, clock, begin) = (Vector3::zeros(), 0.0, 0.0, *t);
        }
        (sum, count, clock) = (sum + f, count + 1.0, clock + t);
    }
    let lasts = times.last()? - times.first()?;
    if times.len() < SAMPLES || lasts <= 0.0 {
        return None;
    }
    let half = (0.5 * SMOOTH * times.len() as f64 / lasts).round() as usize;
    let smooth = |i: usize| {
        let near = &forces[i.saturating_sub(half)..(i + half + 1).min(forces.len())];
        near.iter().map(|f| f.norm()).sum::<f64>() / near.len() as f64
    };
    let sizes: Vec<f64> = (0..forces.len()).map(smooth).collect();
    let touches = TOUCHES * quantile(&sizes, 0.9)?;
    let (mut longest, mut from) = (0..0, 0);
    for i in 0..=sizes.len() {
        if i == sizes.len() || sizes[i] <= touches {
            if i - from > longest.len() {
                longest = from..i;
            }
            from = i + 1;
        }
    }
    let (first, last) = (*times.get(longest.start)?, *times.get(longest.end.checked_sub(1)?)?);
    let inside = |t: f64| t >= first + ends[0] * (last - first) && t <= last - ends[1] * (last - first);
    let (times, forces): (Vec<f64>, Vec<Vector3<f64>>) =
        times.into_iter().zip(forces).filter(|(t, _)| inside(*t)).unzip();
    let lasts = times.last()? - times.first()?;
    (times.len() >= SAMPLES && lasts >= SHORTEST).then_some((times, forces))
}

/// Whether the force swings at one frequency in nearly all touches, by more than the noise.
fn shaking(capture: &Capture, segmented: &[Segmented]) -> Option<Shaking> {
    let each = capture.interactions.iter();
    let touches: Vec<(Vec<f64>, Vec<Vector3<f64>>)> = each.filter_map(|i| stretch(i, ENDS)).collect();
    let noises: Vec<f64> = segmented.iter().filter_map(|s| s.force_noise).collect();
    let noise = capture.noise.force.or_else(|| median(&noises)).unwrap_or(0.0);
    let whole = touches
        .iter()
        .filter_map(|(t, f)| Some(vec![Spectrum::of(t, f, IN_TIME)?]));
    let whole = told(&whole.collect::<Vec<_>>(), LOWEST, STANDS_OUT, &CLEAR);
    let felt = |s: &Shaking| s.force > noise;
    whole.filter(felt).or_else(|| {
        let parts: Vec<Vec<Spectrum>> = touches.iter().map(in_stretches).filter(|s| !s.is_empty()).collect();
        told(&parts, QUICK, STRETCH_STANDS_OUT, &[STRETCH_CLEAR]).filter(felt)
    })
}

/// Spectra of the stretches of a touch.
fn in_stretches((times, forces): &(Vec<f64>, Vec<Vector3<f64>>)) -> Vec<Spectrum> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Vec::new();
    };
    let stretches = (2.0 * (last - first) / STRETCH) as usize;
    let one = |k: usize| {
        let begin = first + 0.5 * STRETCH * k as f64;
        let (from, to) = (
            times.partition_point(|t| *t < begin),
            times.partition_point(|t| *t < begin + STRETCH),
        );
        (to - from >= SAMPLES).then(|| Spectrum::of(&times[from..to], &forces[from..to], IN_STRETCHES))?
    };
    (0..stretches.saturating_sub(1)).filter_map(one).collect()
}

/// The clearest frequency from the lowest on, where it is clear by one of these pairs of a ratio and a share of all touches.
fn told(touches: &[Vec<Spectrum>], lowest: f64, stands_out: f64, clear: &[(f64, f64)]) -> Option<Shaking> {
    if touches.len() < FEWEST {
        return None;
    }
    let lines = CommonLine::each(touches, stands_out).into_iter();
    let lines = lines.filter(|l| l.frequency >= lowest);
    let line = lines.max_by(|a, b| a.ratio.total_cmp(&b.ratio))?;
    let share = line.series as f64 / touches.len() as f64;
    let clear = clear.iter().any(|(clear, most)| line.ratio > *clear && share >= *most);
    clear.then_some(Shaking {
        hertz: line.frequency,
        force: line.amplitude,
        ratio: line.ratio,
        touches: [line.series, touches.len()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Touches of two seconds that rise, fall and wobble, each in its own way, shaken by so many newtons at so many hertz until then.
    fn touches(force: f64, hertz: f64, until: f64) -> Vec<(Vec<f64>, Vec<Vector3<f64>>)> {
        let one = |touch: u32| {
            let times: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
            let own = f64::from(touch);
            let at = |t: &f64| {
                let wobble = 0.02 * (40.0 * (1.0 + 0.37 * own) * t + own).sin()
                    + 0.02 * ((211.0 + 23.0 * own) * t * (1.0 + t)).sin();
                let force = if *t < until { force } else { 0.0 };
                let shaken = force * (std::f64::consts::TAU * hertz * (t + 0.31 * own)).sin();
                Vector3::new(1.0 + 0.2 * own * t + wobble + shaken, wobble, 0.5 * wobble)
            };
            let forces: Vec<Vector3<f64>> = times.iter().map(at).collect();
            (times, forces)
        };
        (0..8).map(one).collect()
    }

    fn as_a_whole(touches: &[(Vec<f64>, Vec<Vector3<f64>>)]) -> Option<Shaking> {
        let one = |(t, f): &(Vec<f64>, Vec<Vector3<f64>>)| vec![Spectrum::of(t, f, IN_TIME).expect("a spectrum")];
        let spectra: Vec<Vec<Spectrum>> = touches.iter().map(one).collect();
        told(&spectra, LOWEST, STANDS_OUT, &CLEAR)
    }

    fn in_parts(touches: &[(Vec<f64>, Vec<Vector3<f64>>)]) -> Option<Shaking> {
        let parts: Vec<Vec<Spectrum>> = touches.iter().map(in_stretches).collect();
        told(&parts, QUICK, STRETCH_STANDS_OUT, &[STRETCH_CLEAR])
    }

    #[test]
    fn one_frequency_in_all_touches_is_told_with_its_size() {
        let found = as_a_whole(&touches(0.2, 7.0, 2.0)).expect("it shakes");
        assert!(
            (found.hertz - 7.0).abs() < 0.15 && (found.force - 0.2).abs() < 0.02,
            "{found:?}"
        );
        assert_eq!(found.touches, [8, 8]);
    }

    #[test]
    fn touches_that_wobble_each_in_its_own_way_are_not_shaken() {
        assert!(as_a_whole(&touches(0.0, 7.0, 2.0)).is_none() && in_parts(&touches(0.0, 7.0, 2.0)).is_none());
    }

    #[test]
    fn what_shakes_only_while_a_thing_sticks_is_told_by_stretches() {
        let found = in_parts(&touches(0.3, 21.0, 0.7)).expect("it shakes");
        assert!(
            (found.hertz - 21.0).abs() < 0.5 && (found.force - 0.3).abs() < 0.03,
            "{found:?}"
        );
    }
}
