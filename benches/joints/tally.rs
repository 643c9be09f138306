//! Errors, intervals and odds, counted up.

use palpate::base::Estimate;

/// Errors of one quantity and how often its interval holds the truth.
#[derive(Default)]
pub struct Tally {
    errors: Vec<f64>,
    inside: Vec<bool>,
    scaled: Vec<f64>,
    assumed: usize,
    absent: usize,
}

impl Tally {
    pub fn error(&mut self, error: f64) {
        self.errors.push(error);
    }

    /// An error in standard deviations.
    pub fn scaled(&mut self, z: f64) {
        self.held(z <= 1.96);
        self.scaled.push(z);
    }

    pub fn held(&mut self, inside: bool) {
        self.inside.push(inside);
    }

    /// A number against its truth, relative.
    pub fn number(&mut self, estimate: Option<&Estimate>, truth: f64) {
        let Some(e) = estimate else {
            self.absent += 1;
            return;
        };
        if let Some([low, high]) = e.ci95 {
            self.held(low <= truth && truth <= high);
            if let Some(sd) = e.sd.filter(|_| e.is_measured()) {
                self.scaled.push((e.value - truth).abs() / sd);
            }
        }
        if e.is_measured() {
            self.error(((e.value - truth) / truth).abs());
        } else {
            self.assumed += 1;
        }
    }

    pub fn print(&mut self, name: &str) {
        self.errors.sort_by(f64::total_cmp);
        let n = self.errors.len();
        let at = |q: f64| {
            if n == 0 {
                f64::NAN
            } else {
                self.errors[((n - 1) as f64 * q).round() as usize]
            }
        };
        let held = self.inside.iter().filter(|x| **x).count();
        println!(
            "{name:<34} n {n:>4}  median {:.5}  90th {:.5}  95th {:.5}  interval holds {:.3} of {}  assumed {}  absent {}",
            at(0.5),
            at(0.9),
            at(0.95),
            held as f64 / self.inside.len().max(1) as f64,
            self.inside.len(),
            self.assumed,
            self.absent
        );
        if !self.scaled.is_empty() {
            let square = self.scaled.iter().map(|z| z * z).sum::<f64>() / self.scaled.len() as f64;
            println!(
                "{:<34} root mean square of errors over their standard deviations {:.3}",
                "",
                square.sqrt()
            );
        }
    }
}

/// Stated probabilities against how often they were right.
#[derive(Default)]
pub struct Odds {
    said: Vec<(f64, bool)>,
}

const EDGES: [f64; 7] = [0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0001];

impl Odds {
    pub fn add(&mut self, probability: f64, right: bool) {
        self.said.push((probability, right));
    }

    /// The expected calibration error, and its bins.
    pub fn print(&self, name: &str) {
        let (mut error, n) = (0.0, self.said.len().max(1) as f64);
        let mut bins = String::new();
        for pair in EDGES.windows(2) {
            let of_bin: Vec<&(f64, bool)> = self.said.iter().filter(|s| s.0 >= pair[0] && s.0 < pair[1]).collect();
            if of_bin.is_empty() {
                continue;
            }
            let m = of_bin.len() as f64;
            let stated = of_bin.iter().map(|s| s.0).sum::<f64>() / m;
            let right = of_bin.iter().filter(|s| s.1).count() as f64 / m;
            error += m / n * (stated - right).abs();
            bins += &format!("  {stated:.3}: {right:.3} of {}", of_bin.len());
        }
        println!(
            "{name:<34} expected calibration error {error:.4} over {}; stated: right{bins}",
            self.said.len()
        );
    }
}
