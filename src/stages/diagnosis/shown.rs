//! What a roboticist should see of a finding: the profile that gave it away, one interaction without and with it, and of what the
//! errors of the plain model are made.

use super::family::{Family, Scatter, interactions};
use super::fit::Fit;
use super::held_out::{left, left_of, refit};
use super::laid::Laid;
use super::marginal::weights;
use super::naming::Ladder;
use super::profile::profiled;
use super::trace::{Curve, Trace};
use crate::math::quantile;
use crate::twin::{Budget, Finding, Profile, ProfileBin, ProfileSample};

/// Stretches of a covariate, at most, and samples of an interaction.
const BINS: usize = 8;
const SAMPLES: usize = 200;

/// The profile of each finding of a ladder.
pub fn profiles(family: &dyn Family, ladder: &Ladder, findings: &[Finding]) -> Vec<Profile> {
    let mut laws: Vec<usize> = Vec::new();
    let mut out = Vec::new();
    for taken in &ladder.taken {
        let before = refit(family, ladder, &laws);
        laws.push(taken.law);
        let cause = family.laws()[taken.law].cause;
        if findings.iter().any(|f| f.cause == cause) {
            out.extend(profile(family, &before, ladder, taken.law));
        }
    }
    out
}

fn profile(family: &dyn Family, before: &Fit, ladder: &Ladder, law: usize) -> Option<Profile> {
    let kind = family.about(law);
    let profiled = profiled(family, before, &ladder.full, law)?;
    let quantity = family.kinds().get(kind)?.quantity;
    let fits = [before, &ladder.full];
    let all: Vec<usize> = (0..family.groups().len()).collect();
    let each: Vec<Vec<Row>> = all
        .iter()
        .map(|g| rows(family, fits, *g, kind, &profiled.laid[*g]))
        .collect();
    let change = |g: usize| {
        each[g]
            .iter()
            .map(|r| r.left[0].powi(2) - r.left[1].powi(2))
            .sum::<f64>()
    };
    let held: Vec<usize> = all.iter().copied().filter(|g| family.groups()[*g].held_out).collect();
    let of = if held.is_empty() { all } else { held };
    let most = of.into_iter().max_by(|a, b| change(*a).total_cmp(&change(*b)))?;
    Some(Profile {
        cause: family.laws()[law].cause.into(),
        place: family.laws()[law].place.clone(),
        quantity: quantity.name().into(),
        unit: quantity.unit().into(),
        covariate: profiled.name(),
        covariate_unit: profiled.unit.into(),
        bins: bins(&each),
        interaction: family.groups()[most].name.clone(),
        held_out: family.groups()[most].held_out,
        samples: samples(&each[most]),
    })
}

/// One reading: the covariate (not a number where it is not defined), when, what was read, and what is left by either model.
struct Row {
    at: f64,
    time: f64,
    measured: f64,
    left: [f64; 2],
    /// What either is multiplied by in a profile: the direction of the motion where it is taken along that.
    sign: f64,
}

fn rows(family: &dyn Family, fits: [&Fit; 2], group: usize, kind: usize, laid: &Laid) -> Vec<Row> {
    let [before, after] = fits.map(|f| left(family, f, group, true));
    let covariates = family.covariates(group);
    let clock = covariates.iter().find(|c| c.0.starts_with("time since the capture"));
    let channels = &family.groups()[group].channels;
    let kinds = channels
        .iter()
        .flat_map(|c| std::iter::repeat_n(c.kind, c.measured.len()));
    let measured: Vec<f64> = channels.iter().flat_map(|c| c.measured.iter().copied()).collect();
    let row = |(i, own): (usize, usize)| {
        let row = Row {
            at: laid.at[i],
            sign: laid.sign[i],
            time: clock.map_or(i as f64, |c| c.2[i]),
            measured: measured[i],
            left: [before[i], after[i]],
        };
        (own == kind && row.at.is_finite()).then_some(row)
    };
    kinds.enumerate().filter_map(row).collect()
}

/// Means over stretches with as many samples each.
fn bins(each: &[Vec<Row>]) -> Vec<ProfileBin> {
    let places: Vec<f64> = each.iter().flatten().map(|r| r.at).collect();
    let edge = |i: usize| quantile(&places, i as f64 / BINS as f64);
    let mut edges: Vec<f64> = (0..=BINS).filter_map(edge).collect();
    edges.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs().max(1e-9));
    let last = edges.len().saturating_sub(2);
    let bin = |(i, e): (usize, &[f64])| {
        let within = |r: &&Row| r.at >= e[0] && (r.at < e[1] || i == last);
        // An interaction's samples err alike: what counts is how interactions differ.
        let mut means = Vec::new();
        let (mut at, mut n) = (0.0, 0.0);
        for group in each {
            let own: Vec<&Row> = group.iter().filter(within).collect();
            if own.is_empty() {
                continue;
            }
            let count = own.len() as f64;
            let mean = |j: usize| own.iter().map(|r| r.sign * r.left[j]).sum::<f64>() / count;
            means.push([mean(0), mean(1)]);
            (at, n) = (at + own.iter().map(|r| r.at).sum::<f64>(), n + count);
        }
        let m = means.len() as f64;
        let mean = |j: usize| means.iter().map(|x| x[j]).sum::<f64>() / m;
        let (before, after) = (mean(0), mean(1));
        let spread = means.iter().map(|x| (x[1] - after).powi(2)).sum::<f64>() / (m - 1.0).max(1.0);
        (m > 0.0).then(|| ProfileBin {
            at: at / n,
            before,
            after,
            sd: (spread / m).sqrt(),
        })
    };
    edges.windows(2).enumerate().filter_map(bin).collect()
}

fn samples(rows: &[Row]) -> Vec<ProfileSample> {
    let first = rows.first().map_or(0.0, |r| r.time);
    let one = |r: &Row| ProfileSample {
        time: r.time - first,
        measured: r.measured,
        before: r.measured - r.left[0],
        after: r.measured - r.left[1],
    };
    thinned(&rows.iter().map(one).collect::<Vec<_>>())
}

/// The profiles of what stands, and what the twin foretold without and with all of it for findings that no ladder told.
pub fn pictured(mut profiles: Vec<Profile>, findings: &[Finding], traces: [&[Trace]; 2]) -> Vec<Profile> {
    profiles.retain(|p| findings.iter().any(|f| f.cause == p.cause && f.place == p.place));
    let bare = |f: &&Finding| profiles.iter().all(|p| p.cause != f.cause || p.place != f.place);
    let others: Vec<Profile> = findings
        .iter()
        .filter(bare)
        .filter_map(|f| foretold(f, traces))
        .collect();
    [profiles, others].concat()
}

/// The curve of what a finding's gain is of that changes most, of a held-out interaction where there is one.
///
/// It lies along nothing but time, so there is no profile of what is left.
fn foretold(f: &Finding, [before, after]: [&[Trace]; 2]) -> Option<Profile> {
    let all = before.iter().flat_map(|t| {
        let with = after.iter().find(|a| a.interaction == t.interaction);
        let pairs = with.into_iter().flat_map(move |a| t.curves.iter().zip(&a.curves));
        pairs.map(move |(b, a)| (t, b, a))
    });
    let own = all.filter(|(_, b, a)| b.label == a.label && b.quantity.name() == f.gain.quantity);
    let each: Vec<(&Trace, &Curve, Vec<ProfileSample>)> =
        own.map(|(t, b, a)| (t, b, thinned(&samples_of(b, a)))).collect();
    let gained = |s: &[ProfileSample]| {
        let left = |s: &ProfileSample| (s.measured - s.before).powi(2) - (s.measured - s.after).powi(2);
        s.iter().map(left).sum::<f64>()
    };
    let best = each.into_iter().filter(|(.., s)| gained(s) > 0.0).max_by(|x, y| {
        let by_gain = gained(&x.2).total_cmp(&gained(&y.2));
        x.0.held_out.cmp(&y.0.held_out).then(by_gain)
    });
    best.map(|(trace, curve, samples)| Profile {
        cause: f.cause.clone(),
        place: f.place.clone(),
        quantity: curve.label.clone(),
        unit: curve.quantity.unit().into(),
        covariate: "time".into(),
        covariate_unit: "s".into(),
        bins: Vec::new(),
        interaction: trace.interaction.clone(),
        held_out: trace.held_out,
        samples,
    })
}

/// Readings of which both say something. What was read is that of the first: the second may be of a frame that was put right.
fn samples_of(before: &Curve, after: &Curve) -> Vec<ProfileSample> {
    let first = before.time.first().copied().unwrap_or(0.0);
    let both = before.time.iter().zip(&before.measured).zip(&before.predicted);
    let each = both.zip(after.measured.iter().zip(&after.predicted));
    each.map(|(((time, measured), plain), (read, full))| ProfileSample {
        time: time - first,
        measured: *measured,
        before: *plain,
        after: measured - (read - full),
    })
    .filter(|s| (s.measured + s.before + s.after).is_finite())
    .collect()
}

fn thinned(all: &[ProfileSample]) -> Vec<ProfileSample> {
    let step = all.len().div_ceil(SAMPLES).max(1);
    all.iter().step_by(step).copied().collect()
}

/// Of what the mean squared error of the plain model is made on held-out interactions, or on all where none was held out.
///
/// What fitting the contact of each touch anew takes away; then what the findings do: there it stands between the errors that
/// the gain of the first one states. Then what fitting the level of each touch anew takes away; of the rest what the jitter of
/// clocks and the ringing leave open, and what the sensor reads at rest. A sensor's fault is not told from a tare that is
/// fitted anew, so the findings come first there.
pub fn budget(family: &dyn Family, ladder: &Ladder) -> Option<Budget> {
    let first = ladder.taken.first();
    let kind = first.map_or(0, |t| family.about(t.law));
    let anew = first.is_none_or(|t| family.laws()[t.law].place != "sensor");
    let held: Vec<usize> = (0..family.groups().len())
        .filter(|g| family.groups()[*g].held_out)
        .collect();
    let groups = if held.is_empty() {
        ladder.plain.groups.clone()
    } else {
        held
    };
    // Samples count as they do in the gain.
    let square = |fit: &Fit, anew: &dyn Fn(&Scatter) -> bool| {
        let (mut sum, mut total) = (0.0, 0.0);
        for g in &groups {
            let channels = family.groups()[*g].channels.iter();
            let own = channels.flat_map(|c| std::iter::repeat_n(c.kind == kind, c.measured.len()));
            let rows = left_of(family, fit, *g, anew).into_iter().zip(weights(family, *g));
            for ((e, w), _) in rows.zip(own).filter(|(_, own)| *own) {
                (sum, total) = (sum + (w * e).powi(2), total + w * w);
            }
        }
        sum / f64::max(total, 1e-30)
    };
    let whole = square(&ladder.plain, &|_| false);
    if !(whole.is_finite() && whole > 0.0) {
        return None;
    }
    let about = &family.kinds()[kind];
    let mut open = whole;
    let mut take = |left: f64| {
        let part = (open - left).max(0.0);
        open -= part;
        part / whole
    };
    let nothing = |_: &Scatter| false;
    let contact = |s: &Scatter| s.nuisance;
    let (before, named) = if anew {
        (
            take(square(&ladder.plain, &contact)),
            take(square(&ladder.full, &contact)),
        )
    } else {
        (0.0, take(square(&ladder.full, &nothing)))
    };
    let geometry = before
        + if anew {
            0.0
        } else {
            take(square(&ladder.full, &contact))
        };
    let friction_law = take(square(&ladder.full, &|_| true));
    let noise = take((open_after(whole, [named, friction_law, geometry]) - about.sigma.powi(2)).max(0.0));
    let timing =
        take((open_after(whole, [named + noise, friction_law, geometry]) - clocks(family, &groups, kind)).max(0.0));
    let mut causes: Vec<String> = Vec::new();
    for taken in &ladder.taken {
        let cause = family.laws()[taken.law].cause;
        if causes.iter().all(|c| c != cause) {
            causes.push(cause.into());
        }
    }
    Some(Budget {
        quantity: about.quantity.name().into(),
        unit: about.quantity.unit().into(),
        rmse: whole.sqrt(),
        beside_contact: (whole * (1.0 - before)).sqrt(),
        of: family.samples_are().into(),
        interactions: interactions(family, &groups),
        causes,
        named,
        doubtful: 0.0,
        friction_law,
        geometry,
        timing,
        noise,
        unexplained: (1.0 - named - friction_law - geometry - timing - noise).max(0.0),
    })
}

fn open_after(whole: f64, taken: [f64; 3]) -> f64 {
    whole * (1.0 - taken.iter().sum::<f64>())
}

/// Mean square of what the jitter of clocks makes of a signal that changes, and of what is left out on purpose.
fn clocks(family: &dyn Family, groups: &[usize], kind: usize) -> f64 {
    let jitter = family.kinds()[kind].jitter;
    let (mut sum, mut total) = (0.0, 0.0);
    for g in groups {
        let all = weights(family, *g);
        let mut at = 0;
        for c in &family.groups()[*g].channels {
            let own = c.change.iter().zip(&c.aside).zip(&all[at..]);
            at += c.measured.len();
            for ((d, a), w) in own.filter(|_| c.kind == kind) {
                sum += w * w * ((jitter * d).powi(2) + a * a);
                total += w * w;
            }
        }
    }
    sum / f64::max(total, 1e-30)
}

#[cfg(test)]
mod tests {
    use super::super::Quantity;
    use super::super::told::one_named;
    use super::*;
    use crate::twin::Gain;

    fn trace(name: &str, held_out: bool, predicted: f64) -> Trace {
        let time: Vec<f64> = (0..20).map(|i| 0.1 * f64::from(i)).collect();
        Trace {
            interaction: name.into(),
            held_out,
            curves: vec![Curve {
                label: "force along the push".into(),
                quantity: Quantity::Force,
                measured: vec![1.0; time.len()],
                predicted: vec![predicted; time.len()],
                time,
                noise: None,
            }],
            ..Trace::default()
        }
    }

    #[test]
    fn what_no_ladder_told_is_pictured_on_what_was_held_out() {
        let gain = Gain {
            quantity: "force".into(),
            ..Gain::default()
        };
        let findings = [one_named("com-offset", gain)];
        let before = [trace("push-00", false, 0.0), trace("push-01", true, 0.7)];
        let after = [trace("push-00", false, 1.0), trace("push-01", true, 0.9)];
        let all = pictured(Vec::new(), &findings, [&before, &after]);
        // The fitted one gains more, and shows nothing that was foretold.
        assert_eq!(
            (all.len(), all[0].interaction.as_str(), all[0].samples.len()),
            (1, "push-01", 20)
        );
        // What a ladder pictured is not pictured again, what is no finding any more not at all, and what gains nothing has no picture.
        assert_eq!(pictured(all.clone(), &findings, [&before, &after]).len(), 1);
        assert!(pictured(all, &[], [&before, &after]).is_empty());
        assert!(pictured(Vec::new(), &findings, [&before, &before]).is_empty());
    }
}
