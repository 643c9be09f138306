//! Profile likelihood: an interval where the least cost, one unknown held, has risen by so much on either side.

/// Factor either way of where a parabola would end within which an end is sought.
const REACH: f64 = 6.0;
/// How near to the wanted rise is near enough, of its root.
const NEAR: f64 = 0.01;
const ROUNDS: usize = 12;

/// Where the least cost with one unknown held at a value, `cost`, exceeds `least`, its value at `best`, by `rise` on either
/// side; `half` is where a parabola would. A side on which it never does ends at the reach of the search. The root of the rise
/// is nearly straight, so that a few values tell; `None` where one of them could not be had.
pub fn profile_ends(
    best: f64,
    half: f64,
    least: f64,
    rise: f64,
    mut cost: impl FnMut(f64) -> Option<f64>,
) -> Option<[f64; 2]> {
    let mut end = |side: f64| {
        let mut root = |off: f64| Some(((cost(best + side * off)? - least).max(0.0) / rise).sqrt());
        // Brackets of the end: nothing has risen at the best, and nobody knows beyond the reach.
        let ([mut low, mut high], mut off) = ([(0.0, 0.0), (REACH * half, f64::NAN)], half);
        for _ in 0..ROUNDS {
            let risen = root(off)?;
            if (risen - 1.0).abs() < NEAR {
                return Some(off);
            }
            if risen < 1.0 {
                low = (off, risen)
            } else {
                high = (off, risen)
            }
            if low.0 >= 0.999 * REACH * half {
                break;
            }
            off = if high.1.is_finite() {
                let share = (1.0 - low.1) / (high.1 - low.1);
                low.0 + (high.0 - low.0) * share.clamp(0.05, 0.95)
            } else {
                (off * (1.0 / risen.max(0.3)).clamp(1.05, 3.0)).min(high.0)
            };
        }
        Some(off)
    };
    Some([best - end(-1.0)?, best + end(1.0)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_ends_where_its_curvature_says_and_a_logarithm_where_it_does() {
        let parabola = |x: f64| Some(0.5 * ((x - 2.0) / 0.3).powi(2));
        let [low, high] = profile_ends(2.0, 0.588, 0.0, 0.5 * 1.96 * 1.96, parabola).expect("ends");
        assert!(
            (low - 1.412).abs() < 0.01 && (high - 2.588).abs() < 0.01,
            "{low} {high}"
        );
        // Even in the logarithm: 2 exp(-1.96 * 0.5), 2 exp(1.96 * 0.5).
        let crooked = |x: f64| {
            Some(if x > 0.0 {
                0.5 * ((x / 2.0).ln() / 0.5).powi(2)
            } else {
                1e9
            })
        };
        let [low, high] = profile_ends(2.0, 1.96, 0.0, 0.5 * 1.96 * 1.96, crooked).expect("ends");
        assert!(
            (low - 0.7506).abs() < 0.02 && (high - 5.329).abs() < 0.06,
            "{low} {high}"
        );
    }

    #[test]
    fn a_side_that_never_rises_ends_at_the_reach() {
        let bound = |x: f64| Some(if x < 0.0 { 0.5 * x * x } else { 0.0 });
        let [low, high] = profile_ends(0.0, 1.96, 0.0, 0.5 * 1.96 * 1.96, bound).expect("ends");
        assert!(
            (low + 1.96).abs() < 0.03 && (high - REACH * 1.96).abs() < 1e-6,
            "{low} {high}"
        );
    }
}
