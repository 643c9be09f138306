//! When the tool touched: force against its own noise at rest.

use nalgebra::Vector3;

use super::Config;
use crate::capture::WrenchStream;
use crate::math::{mad_sd, median, quantile};

/// The stretch of contact and what the sensor reads without it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contact {
    /// First touch, s; `None` where the force never left its noise.
    pub onset: Option<f64>,
    /// Last touch, s.
    pub release: Option<f64>,
    /// Reading without contact, N; `None` where it was never without.
    pub tare: Option<Vector3<f64>>,
    /// Noise per axis, N.
    pub noise: f64,
}

/// Median of each axis over the rows.
fn axis_median(force: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let axis = |k: usize| median(&force.iter().map(|f| f[k]).collect::<Vec<_>>());
    Some(Vector3::new(axis(0)?, axis(1)?, axis(2)?))
}

/// White noise per axis from first differences, which slow changes do not enter.
fn difference_noise(force: &[Vector3<f64>]) -> f64 {
    let differences: Vec<f64> = (0..3)
        .flat_map(|k| force.windows(2).map(move |w| w[1][k] - w[0][k]))
        .filter(|d| *d != 0.0)
        .collect();
    mad_sd(&differences).map_or(0.0, |sd| sd / std::f64::consts::SQRT_2)
}

/// Magnitude of the moving average of `force - tare` over `width` rows, missing rows left out.
fn smoothed_excess(force: &[Vector3<f64>], tare: &Vector3<f64>, width: usize) -> Vec<f64> {
    let half = width / 2;
    (0..force.len())
        .map(|i| {
            let rows = &force[i.saturating_sub(half)..(i + half + 1).min(force.len())];
            let finite: Vec<_> = rows.iter().filter(|f| f.iter().all(|x| x.is_finite())).collect();
            let sum: Vector3<f64> = finite.iter().map(|f| **f - tare).sum();
            sum.norm() / finite.len().max(1) as f64
        })
        .collect()
}

/// Two neighbouring readings that come to this many thresholds together are a blow, however soon it is over.
const BLOW: f64 = 8.0;

/// The first and last row of contact by threshold with backtracking to where the force left its noise.
fn contact_rows(excess: &[f64], threshold: f64, low: f64, run: usize) -> Option<(usize, usize)> {
    let over_all = |rows: &[f64]| rows.iter().all(|e| *e > threshold);
    let sustained = |i: usize| i + run <= excess.len() && over_all(&excess[i..i + run]);
    let blow = |i: usize| {
        let pair = excess.get(i..i + 2);
        pair.is_some_and(|p| over_all(p) && p[0] + p[1] > BLOW * threshold)
    };
    let over = (0..excess.len()).find(|&i| sustained(i) || blow(i))?;
    let first = (0..over).rev().find(|&i| excess[i] < low).map_or(0, |i| i + 1);
    let last = (over..excess.len()).rev().find(|&i| excess[i] > threshold)?;
    Some((first, last))
}

/// A force beyond this many times the usual one is a blow, or something that was locked: no measure of what contact is.
const SPIKE: f64 = 20.0;

/// The largest force of the stream, spikes left out; `felt` is what stands out of the noise.
fn largest(excess: &[f64], felt: f64) -> f64 {
    let peak = quantile(excess, 0.98).unwrap_or(0.0);
    let usual: Vec<f64> = excess.iter().copied().filter(|e| *e > felt).collect();
    median(&usual).map_or(peak, |m| peak.min(SPIKE * m))
}

/// Share of the largest force up to which a reading at the end may be that of a tool that let go.
const LET_GO: f64 = 0.3;

/// The stretch of contact of a tool that touched already when its recording began, or sooner than a tare is read, and is free at the
/// end: what it reads there is the tare. Nothing of one that was free at first.
fn touching_at_first(stream: &WrenchStream, (lead, width): (usize, usize), config: &Config) -> Option<Contact> {
    let n = stream.time.len();
    let mut tare = axis_median(&stream.force[n - lead..])?;
    let mut noise = difference_noise(&stream.force);
    // Of two ends the one that reads less is the free one.
    let begins = axis_median(&stream.force[..lead])?;
    if begins.norm() < tare.norm() + config.contact_sigmas * noise / (lead as f64).sqrt() {
        return None;
    }
    let mut rows = None;
    for _ in 0..2 {
        let excess = smoothed_excess(&stream.force, &tare, width);
        let peak = largest(&excess, config.contact_sigmas * noise / (width as f64).sqrt());
        let floor = noise.max(1e-4 * peak) / (width as f64).sqrt();
        let threshold = (config.contact_sigmas * floor).max(config.contact_share * peak);
        let (first, last) = contact_rows(&excess, threshold, (3.0 * floor).max(0.2 * threshold), width.max(3))?;
        if first >= lead || last + 2 * lead > n || tare.norm() > LET_GO * peak {
            return None;
        }
        // What a tip feels while it leaves is none.
        let free = &stream.force[last + lead..];
        tare = mean(free)?;
        if free.len() >= 40 {
            noise = difference_noise(free);
        }
        rows = Some((first, last));
    }
    let (first, last) = rows?;
    Some(Contact {
        onset: Some(stream.time[first]),
        release: Some(stream.time[last]),
        tare: Some(tare),
        noise,
    })
}

/// Finds the stretch of contact in a force stream, of a tool that holds nothing where `free`: one may be read without contact at its end.
pub(super) fn find_contact(stream: &WrenchStream, free: bool, config: &Config) -> Option<Contact> {
    let n = stream.time.len();
    if n < 8 {
        return None;
    }
    let rate = (n - 1) as f64 / (stream.time[n - 1] - stream.time[0]).max(1e-9);
    let width = ((config.force_window * rate).round() as usize).clamp(1, 25);
    let lead = ((0.1 * rate) as usize).clamp(5, n / 2);
    let touching = free.then(|| touching_at_first(stream, (lead.min(n / 3), width), config));
    if let Some(found) = touching.flatten() {
        return Some(found);
    }
    let first_reading = axis_median(&stream.force[..lead])?;
    let mut noise = difference_noise(&stream.force);
    let white = noise / (width as f64).sqrt();
    let peak = |tare: &Vector3<f64>| {
        largest(
            &smoothed_excess(&stream.force, tare, width),
            config.contact_sigmas * white,
        )
    };
    let mut tare = first_reading;
    let mut rows = None;
    // Twice: the second pass knows the tare from everything before contact.
    for _ in 0..2 {
        let excess = smoothed_excess(&stream.force, &tare, width);
        let floor = noise.max(1e-4 * peak(&tare)) / (width as f64).sqrt();
        let threshold = (config.contact_sigmas * floor).max(config.contact_share * peak(&tare));
        rows = contact_rows(&excess, threshold, (3.0 * floor).max(0.2 * threshold), width.max(3));
        match rows {
            Some((first, _)) if first >= lead => {
                tare = mean(&stream.force[..first])?;
                // The chatter of sliding is not the sensor's: with enough rest the noise is read there.
                if first >= 40 {
                    noise = difference_noise(&stream.force[..first]);
                }
            }
            _ => break,
        }
    }
    Some(match rows {
        Some((first, last)) => Contact {
            onset: Some(stream.time[first]),
            release: Some(stream.time[last]),
            tare: (first >= 5).then_some(tare),
            noise,
        },
        // A force that is steady and far from zero is contact throughout, without a tare.
        None if first_reading.norm() > 20.0 * noise.max(1e-6) => Contact {
            onset: Some(stream.time[0]),
            release: Some(stream.time[n - 1]),
            tare: None,
            noise,
        },
        None => Contact {
            onset: None,
            release: None,
            tare: Some(tare),
            noise,
        },
    })
}

/// Mean of the rows that are there.
fn mean(force: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let finite: Vec<_> = force.iter().filter(|f| f.iter().all(|x| x.is_finite())).collect();
    let sum: Vector3<f64> = finite.iter().copied().sum();
    (!finite.is_empty()).then(|| sum / finite.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(at: f64, off: f64) -> WrenchStream {
        let time: Vec<f64> = (0..1000).map(|i| 0.002 * i as f64).collect();
        let force = time
            .iter()
            .enumerate()
            .map(|(i, t)| {
                let wobble = 0.03 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
                let load = if *t >= at && *t < off { 0.5 } else { 0.0 };
                if i % 97 == 3 {
                    Vector3::repeat(f64::NAN)
                } else {
                    Vector3::new(0.1 + load + wobble, wobble, -wobble)
                }
            })
            .collect();
        WrenchStream {
            time,
            force,
            torque: None,
        }
    }

    #[test]
    fn contact_is_found_within_a_few_samples_and_the_tare_with_it() {
        let contact = find_contact(&step(0.6, 1.4), true, &Config::default()).expect("long enough");
        assert!((contact.onset.expect("touched") - 0.6).abs() < 0.012);
        assert!((contact.release.expect("let go") - 1.4).abs() < 0.012);
        assert!((contact.tare.expect("rest").x - 0.1).abs() < 0.01);
    }

    #[test]
    fn a_blow_of_two_readings_is_contact() {
        let mut stream = step(1.2, 1.6);
        for k in [300, 301] {
            stream.force[k] = Vector3::new(12.0, 0.0, 0.0);
        }
        // As coarse as the blow is short.
        stream.time.iter_mut().for_each(|t| *t *= 5.0);
        let contact = find_contact(&stream, true, &Config::default()).expect("long enough");
        assert!((contact.onset.expect("touched") - 3.0).abs() < 0.02, "{contact:?}");
        assert!((contact.tare.expect("rest").x - 0.1).abs() < 0.01);
    }

    #[test]
    fn a_tool_that_touches_at_first_is_read_when_it_let_go() {
        for begun in [0.0, 0.02] {
            let contact = find_contact(&step(begun, 1.4), true, &Config::default()).expect("long enough");
            assert!(contact.onset.expect("touched") < begun + 0.012, "{contact:?}");
            assert!((contact.release.expect("let go") - 1.4).abs() < 0.012);
            assert!((contact.tare.expect("rest").x - 0.1).abs() < 0.01);
        }
        // One that goes on touching, a little or as before, has no tare at its end.
        let mut lightly = step(0.6, 1.4);
        lightly.force[700..].iter_mut().for_each(|f| f.x += 0.1);
        let contact = find_contact(&lightly, true, &Config::default()).expect("long enough");
        assert!((contact.onset.expect("touched") - 0.6).abs() < 0.012, "{contact:?}");
        let contact = find_contact(&step(0.6, 9.0), true, &Config::default()).expect("long enough");
        assert!(
            (contact.onset.expect("touched") - 0.6).abs() < 0.012 && (contact.tare.expect("rest").x - 0.1).abs() < 0.01
        );
    }

    #[test]
    fn noise_alone_is_no_contact() {
        let contact = find_contact(&step(9.0, 9.0), true, &Config::default()).expect("long enough");
        assert_eq!(contact.onset, None);
    }
}
