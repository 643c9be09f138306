//! A noisy path as pieces of straight lines and parabolas, as many as the noise asks for.
//!
//! Optimal partitioning (Jackson et al. 2005): the pieces minimise squared misfit in units of the noise plus a price for
//! each, over all ways to cut. Motions that set out and stop at once keep their corners, which a window would round.

use super::robust::mad_sd;

/// Price of a piece, and of its curvature, in variances and per logarithm of the number of samples.
const PIECE: f64 = 3.0;
const BENT: f64 = 1.0;
/// Cells into which a long path is gathered first, at most.
const CELLS: usize = 300;
/// Samples over which what the pieces miss is taken back into the path.
const KEPT: usize = 64;
/// Share of the largest value below which a difference is one of the last digits.
const DIGITS: f64 = 1e-12;
/// Fewer samples are left as they are.
const FEWEST: usize = 12;

/// A path freed of noise.
#[derive(Clone, Debug)]
pub struct Freed {
    /// The path, in its unit.
    pub values: Vec<f64>,
    /// Standard deviation of a sample of the path as it was given.
    pub noise: f64,
    /// Standard deviation that is left, in the mean.
    pub left: f64,
}

/// The path freed of noise that is independent from sample to sample, samples that are missing left so; nothing where there is no
/// noise, or too few samples.
pub fn freed(time: &[f64], values: &[f64]) -> Option<Freed> {
    let seen: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
    if seen.len() == values.len() {
        return freed_of(time, values);
    }
    let of = |all: &[f64]| -> Vec<f64> { seen.iter().map(|i| all[*i]).collect() };
    let own = freed_of(&of(time), &of(values))?;
    let mut out = vec![f64::NAN; values.len()];
    seen.iter().zip(&own.values).for_each(|(i, v)| out[*i] = *v);
    Some(Freed { values: out, ..own })
}

fn freed_of(time: &[f64], values: &[f64]) -> Option<Freed> {
    let n = values.len();
    let finite = time.iter().chain(values).all(|v| v.is_finite());
    if n < FEWEST || !finite || time.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let noise = noise_of(values)?;
    let size = n.div_ceil(CELLS);
    let (start, span) = (time[0], time[n - 1] - time[0]);
    let at = |i: usize| (time[i] - start) / span;
    let cells: Vec<(usize, usize)> = (0..n).step_by(size).map(|i| (i, (i + size).min(n))).collect();
    let sums = Sums::of(n, &at, values, noise);
    let cuts = cut(&sums, &cells);
    let mut out = Vec::with_capacity(n);
    let mut unknowns = 0.0;
    for (from, to) in cuts {
        let piece = sums.piece(from, to);
        unknowns += if piece.bend == 0.0 { 2.0 } else { 3.0 };
        out.extend((from..to).map(|i| noise * piece.at(at(i))));
    }
    // What the pieces miss of a way that bends slowly is less than would pay for another piece, but the same for long.
    let missed: Vec<f64> = values.iter().zip(&out).map(|(v, o)| v - o).collect();
    let kept = running_mean(&missed, KEPT);
    out.iter_mut().zip(kept).for_each(|(o, k)| *o += k);
    let share = unknowns / n as f64 + 1.0 / KEPT as f64;
    Some(Freed {
        values: out,
        noise,
        left: noise * share.sqrt().min(1.0),
    })
}

/// Means over so many samples about each.
fn running_mean(values: &[f64], width: usize) -> Vec<f64> {
    let n = values.len();
    let mut sums = vec![0.0];
    for v in values {
        sums.push(sums[sums.len() - 1] + v);
    }
    let mean = |i: usize| {
        // As many to either side, or what is left of a line beside it would be moved.
        let half = (width / 2).min(i).min(n - 1 - i);
        (sums[i + half + 1] - sums[i - half]) / (2 * half + 1) as f64
    };
    (0..n).map(mean).collect()
}

/// Standard deviation of independent noise on a smooth path, by its third differences.
pub fn noise_of(values: &[f64]) -> Option<f64> {
    let third = values.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]);
    let third: Vec<f64> = third.collect();
    let noise = mad_sd(&third)? / 20.0_f64.sqrt();
    let size = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    // What arithmetic leaves of nought is no noise.
    if noise > DIGITS * size {
        return Some(noise);
    }
    // Of what hops between the neighbours of a coarse grid most differences are nought, before a step and after it; not so on a way.
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let taken = |d: &f64| d.abs() > DIGITS * size;
    let (least, most) = steps
        .iter()
        .filter(|d| taken(d))
        .fold((f64::INFINITY, 0.0_f64), |(a, b), d| (a.min(d.abs()), b.max(d.abs())));
    let on = steps.windows(2).filter(|w| taken(&w[0]) && w[0] * w[1] > 0.0).count();
    let alone = 2 * on < steps.iter().filter(|d| taken(d)).count();
    let squares = third.iter().map(|d| d * d).sum::<f64>() / third.len() as f64;
    (alone && most < 2.5 * least).then(|| (squares / 20.0).sqrt())
}

/// Sums up to each sample of powers of time, alone and with the value.
struct Sums {
    powers: Vec<[f64; 5]>,
    moments: Vec<[f64; 3]>,
    squares: Vec<f64>,
    middle: f64,
}

/// One piece: a parabola about its middle, in units of the noise.
struct Piece {
    middle: f64,
    value: f64,
    slope: f64,
    bend: f64,
    /// How far its mean square time is from its middle.
    spread: f64,
    price: f64,
}

impl Piece {
    fn at(&self, t: f64) -> f64 {
        let x = t - self.middle;
        self.value + self.slope * x + self.bend * (x * x - self.spread)
    }
}

impl Sums {
    fn of(n: usize, at: &dyn Fn(usize) -> f64, values: &[f64], noise: f64) -> Self {
        let middle = values.iter().sum::<f64>() / n as f64;
        let mut out = Self {
            powers: vec![[0.0; 5]],
            moments: vec![[0.0; 3]],
            squares: vec![0.0],
            middle: middle / noise,
        };
        for (i, value) in values.iter().enumerate() {
            let (t, v) = (at(i), (value - middle) / noise);
            let (p, m) = (out.powers[i], out.moments[i]);
            out.powers.push(std::array::from_fn(|k| p[k] + t.powi(k as i32)));
            out.moments.push(std::array::from_fn(|k| m[k] + v * t.powi(k as i32)));
            out.squares.push(out.squares[i] + v * v);
        }
        out
    }

    /// Logarithm of the number of samples.
    fn logs(&self) -> f64 {
        (self.squares.len() as f64).ln()
    }

    /// The better of a line and a parabola through these samples, with what it costs.
    fn piece(&self, from: usize, to: usize) -> Piece {
        let n = (to - from) as f64;
        let p: [f64; 5] = std::array::from_fn(|k| (self.powers[to][k] - self.powers[from][k]) / n);
        let m: [f64; 3] = std::array::from_fn(|k| (self.moments[to][k] - self.moments[from][k]) / n);
        let square = (self.squares[to] - self.squares[from]) / n;
        // Moments about the middle.
        let c = p[1];
        let second = p[2] - c * c;
        let third = p[3] - 3.0 * c * p[2] + 2.0 * c.powi(3);
        let fourth = p[4] - 4.0 * c * p[3] + 6.0 * c * c * p[2] - 3.0 * c.powi(4);
        let first_v = m[1] - c * m[0];
        let second_v = m[2] - 2.0 * c * m[1] + c * c * m[0] - second * m[0];
        let logs = self.logs();
        let slope = if second > 0.0 { first_v / second } else { 0.0 };
        let line = square - m[0] * m[0] - slope * first_v;
        let mut best = Piece {
            middle: c,
            value: m[0] + self.middle,
            slope,
            bend: 0.0,
            spread: second,
            price: n * line.max(0.0) + PIECE * logs,
        };
        // What is left of the square of time once its line is taken out.
        let own = fourth - second * second - if second > 0.0 { third * third / second } else { 0.0 };
        if n >= 4.0 && own > 1e-12 * second * second {
            let bend = (second_v - third * slope) / own;
            let gain = n * bend * bend * own;
            if gain > BENT * logs {
                best.bend = bend;
                best.slope = slope - bend * third / second;
                best.price += BENT * logs - gain;
            }
        }
        best
    }
}

/// The pieces, as ranges of samples, that cost least: cut between cells, then where it is best between the samples there.
fn cut(sums: &Sums, cells: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let mut best: Vec<(f64, usize)> = vec![(0.0, 0)];
    // Where the last piece may begin, with what it costs without its price: what is dearer without it than the best with it
    // stays so (Killick et al. 2012).
    let mut open: Vec<usize> = Vec::new();
    let price = (PIECE + BENT) * sums.logs();
    for (to, (_, end)) in cells.iter().enumerate() {
        open.push(to);
        let costs: Vec<f64> = open
            .iter()
            .map(|&from| best[from].0 + sums.piece(cells[from].0, *end).price)
            .collect();
        let least = costs.iter().zip(&open).min_by(|a, b| a.0.total_cmp(b.0));
        let (cost, from) = least.map_or((0.0, to), |(c, f)| (*c, *f));
        best.push((cost, from));
        let mut kept = costs.iter().map(|c| c - price <= cost);
        open.retain(|_| kept.next() == Some(true));
    }
    let mut ends = Vec::new();
    let mut to = cells.len();
    while to > 0 {
        ends.push(cells[to - 1].1);
        to = best[to].1;
    }
    ends.push(0);
    ends.reverse();
    let size = cells[0].1 - cells[0].0;
    for k in 1..ends.len() - 1 {
        let (before, after) = (ends[k - 1], ends[k + 1]);
        let near = (ends[k].saturating_sub(size).max(before + 1))..(ends[k] + size).min(after);
        let cost = |at: &usize| sums.piece(before, *at).price + sums.piece(*at, after).price;
        ends[k] = near.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(ends[k]);
    }
    ends.windows(2).map(|w| (w[0], w[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};
    use rand::Rng;

    #[test]
    fn a_ramp_with_corners_is_freed_of_noise_and_keeps_its_corners() {
        let time: Vec<f64> = (0..1500).map(|i| 0.005 * f64::from(i)).collect();
        let truth = |t: f64| 5e-3 * (t - 2.0).clamp(0.0, 1.0) - 2e-3 * (t - 5.0).clamp(0.0, 1.5);
        let mut dice = rng_for(Seed(3), "pieces");
        let mut free = || (0..12).map(|_| dice.random_range(-0.5..0.5)).sum::<f64>();
        let seen: Vec<f64> = time.iter().map(|t| truth(*t) + 1e-4 * free()).collect();
        let freed = freed(&time, &seen).expect("noise");
        assert!((freed.noise / 1e-4 - 1.0).abs() < 0.1, "{}", freed.noise);
        let off: Vec<f64> = time.iter().zip(&freed.values).map(|(t, v)| v - truth(*t)).collect();
        let rms = (off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64).sqrt();
        assert!(rms < 2e-5 && freed.left < 2e-5, "{rms} {}", freed.left);
        let corner = off[395..405].iter().fold(0.0_f64, |m, o| m.max(o.abs()));
        assert!(corner < 5e-5, "{corner}");
    }

    #[test]
    fn what_is_smooth_and_without_noise_stays_as_it_is() {
        let time: Vec<f64> = (0..400).map(|i| 0.01 * f64::from(i)).collect();
        let seen: Vec<f64> = time.iter().map(|t| 0.02 * (2.0 * t).sin()).collect();
        if let Some(freed) = freed(&time, &seen) {
            let most = seen
                .iter()
                .zip(&freed.values)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(most < 1e-6, "{most}");
        }
        assert!(super::freed(&time, &vec![0.1; 400]).is_none());
        // At rest most of the time, and of no noise but that of the last digits.
        let way = |t: f64| 0.1 + 0.3 + 0.01 * (t - 1.9).clamp(0.0, 0.3) + 0.02 * (t - 3.1).clamp(0.0, 0.1);
        let seen: Vec<f64> = time.iter().map(|t| way(*t)).collect();
        assert!(super::freed(&time, &seen).is_none());
    }

    #[test]
    fn what_was_written_with_few_digits_is_freed_of_what_rounding_made() {
        let time: Vec<f64> = (0..2000).map(|i| 0.002 * f64::from(i)).collect();
        let truth = |t: f64| 5e-3 * (t - 1.0).clamp(0.0, 1.0) - 5e-3 * (t - 2.5).clamp(0.0, 1.0);
        let mut dice = rng_for(Seed(4), "few digits");
        let mut free = || (0..12).map(|_| dice.random_range(-0.5..0.5)).sum::<f64>();
        let mut seen: Vec<f64> = time
            .iter()
            .map(|t| ((truth(*t) + 2e-5 * free()) * 1e4).round() * 1e-4)
            .collect();
        let rms = |values: &[f64]| {
            let off = time.iter().zip(values).filter(|(_, v)| v.is_finite());
            (off.map(|(t, v)| (v - truth(*t)).powi(2)).sum::<f64>() / 2000.0).sqrt()
        };
        let even = freed(&time, &seen).expect("noise");
        assert!(
            rms(&even.values) < 1.2e-5 && rms(&seen) > 2.5e-5,
            "{}",
            rms(&even.values)
        );
        // What is missing stays missing, and harms nothing else.
        (0..2000).step_by(7).for_each(|i| seen[i] = f64::NAN);
        let even = freed(&time, &seen).expect("noise");
        assert!(rms(&even.values) < 1.3e-5, "{}", rms(&even.values));
        assert!((0..2000).all(|i| even.values[i].is_nan() == (i % 7 == 0)));
    }
}
