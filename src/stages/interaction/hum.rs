//! A sensor that hums: one frequency in nearly all readings, whatever is touched.
//!
//! Mains and motors are faster than what shakes under a touch. Where a period is of few readings, its tops are far from the readings about
//! them, and looked like strays.

use nalgebra::Vector3;

use crate::capture::{Capture, Hum, Interaction};
use crate::math::{CommonLine, Grid, Spectrum, mad_sd, median};

/// Frequencies that are tried, Hz.
const IN_TIME: Grid = Grid {
    lowest: 40.0,
    highest: 250.0,
    step: 0.5,
};
/// Seconds from where a stream begins, which tell it as well as all of them, and fewest readings of them.
const LASTS: f64 = 1.0;
const READINGS: usize = 60;
/// Fewest streams; power over that of the neighbourhood of the middle one of them, and of each in which the frequency counts, with the
/// share of these. Of n readings that is an amplitude of the root of 16/n of it times the other noise: about once that.
const FEWEST: usize = 4;
const CLEAR: f64 = 60.0;
const STANDS_OUT: f64 = 8.0;
const SHARE: f64 = 0.75;
/// Standard deviations from which on a step from one reading to the next is a blow.
const BLOW: f64 = 4.0;

/// Times, s, and what was read at them, N.
type Stream = (Vec<f64>, Vec<Vector3<f64>>);

/// The frequency at which the force sensor hums, if it does.
pub fn hum_of(capture: &Capture) -> Option<Hum> {
    let streams: Vec<Stream> = capture.interactions.iter().filter_map(beginning).collect();
    heard(&streams)
}

fn heard(streams: &[Stream]) -> Option<Hum> {
    if streams.len() < FEWEST {
        return None;
    }
    let spectra: Vec<Vec<Spectrum>> = streams
        .iter()
        .filter_map(|stream| {
            let (times, steps) = steps(stream)?;
            Some(vec![Spectrum::of(times, &steps, IN_TIME)?])
        })
        .collect();
    let all = spectra.len();
    let clear = |l: &CommonLine| l.ratio > CLEAR && l.series as f64 >= SHARE * all as f64;
    let usual = median(&streams.iter().filter_map(|s| step_of(&s.0)).collect::<Vec<f64>>())?;
    // Of a sine of frequency f, steps of dt have 2 sin(pi f dt) times the size.
    let own = |l: &CommonLine| l.amplitude / (2.0 * (std::f64::consts::PI * l.frequency * usual).sin());
    let lines = CommonLine::each(&spectra, STANDS_OUT).into_iter().filter(clear);
    let line = lines.max_by(|a, b| own(a).total_cmp(&own(b)))?;
    Some(Hum {
        frequency: line.frequency,
        amplitude: own(&line),
        ratio: line.ratio,
        streams: [line.series, all],
    })
}

fn beginning(interaction: &Interaction) -> Option<Stream> {
    let stream = interaction.force.as_ref()?;
    let first = *stream.time.first()?;
    let (times, forces): (Vec<f64>, Vec<Vector3<f64>>) = stream
        .time
        .iter()
        .zip(&stream.force)
        .take_while(|(t, _)| **t <= first + LASTS)
        .filter(|(_, f)| f.iter().all(|x| x.is_finite()))
        .unzip();
    (times.len() >= READINGS).then_some((times, forces))
}

/// Usual time from one reading to the next, s.
fn step_of(times: &[f64]) -> Option<f64> {
    median(&times.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>())
}

/// From each reading to the next, no more than `BLOW` of the usual: what touches is a blow in one reading, and in all of a spectrum.
fn steps((times, forces): &Stream) -> Option<(&[f64], Vec<Vector3<f64>>)> {
    let mut steps: Vec<Vector3<f64>> = forces.windows(2).map(|w| w[1] - w[0]).collect();
    for k in 0..3 {
        let most = BLOW * mad_sd(&steps.iter().map(|s| s[k]).collect::<Vec<f64>>())?;
        steps.iter_mut().for_each(|s| s[k] = s[k].clamp(-most, most));
    }
    Some((times.get(1..)?, steps))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pushes of a second at 500 Hz with white noise of 0.02 N and a sine of so many newtons at 50 Hz.
    fn pushed(amplitude: f64) -> Vec<Stream> {
        let dice = |i: i32| {
            let x = (f64::from(i) * 12.9898).sin() * 43758.5453;
            (x - x.floor() - 0.5) * 0.02 * 12.0_f64.sqrt()
        };
        let push = |n: i32| {
            let at = |i: i32| {
                let t = 0.002 * f64::from(i);
                let hum = amplitude * (std::f64::consts::TAU * 50.0 * (t + 0.0037 * f64::from(n))).sin();
                let touched = if t > 0.4 { 1.5 } else { 0.0 };
                Vector3::new(
                    touched + hum + dice(4 * i + 7919 * n),
                    dice(4 * i + 1 + 104_729 * n),
                    0.3 * hum,
                )
            };
            let times = (0..500).map(|i| 0.002 * f64::from(i)).collect();
            (times, (0..500).map(at).collect())
        };
        (0..6).map(push).collect()
    }

    #[test]
    fn a_hum_is_told_with_its_frequency_and_size() {
        let hum = heard(&pushed(0.06)).expect("it hums");
        assert!((hum.frequency - 50.0).abs() < 0.6, "{hum:?}");
        assert!((hum.amplitude / (0.06 * 1.09_f64.sqrt()) - 1.0).abs() < 0.1, "{hum:?}");
        assert_eq!(hum.streams, [6, 6]);
    }

    #[test]
    fn noise_and_touches_do_not_hum() {
        assert!(heard(&pushed(0.0)).is_none());
    }
}
