//! A linear scale with ticks at round numbers.

/// Maps a range of values onto pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    /// From `[low, high]` onto `[from, to]`; a range without width is widened.
    pub fn new(low: f64, high: f64, from: f64, to: f64) -> Self {
        let wide = if high - low > 1e-12 * low.abs().max(high.abs()).max(1e-9) {
            (low, high)
        } else {
            (low - 0.5, low + 0.5)
        };
        Self {
            low: wide.0,
            high: wide.1,
            from,
            to,
        }
    }

    /// The pixel of a value.
    pub fn at(&self, value: f64) -> f64 {
        self.from + (value - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// The value at a pixel.
    pub fn value_at(&self, pixel: f64) -> f64 {
        self.low + (pixel - self.from) / (self.to - self.from) * (self.high - self.low)
    }

    /// The pixel of a value, kept inside.
    pub fn clamped(&self, value: f64) -> f64 {
        self.at(value.max(self.low).min(self.high))
    }

    /// Round numbers inside the range, about `count` of them, and the decimals that they need.
    pub fn ticks(&self, count: f64) -> (Vec<f64>, usize) {
        let raw = (self.high - self.low) / count;
        let power = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .map(|m| m * power)
            .find(|s| *s >= raw * 0.999)
            .unwrap_or(10.0 * power);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        (
            (first..=last.min(first + 20)).map(|i| i as f64 * step).collect(),
            decimals,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let (ticks, decimals) = Scale::new(-0.3, 2.2, 0.0, 100.0).ticks(4.0);
        assert_eq!(ticks, [0.0, 1.0, 2.0]);
        assert_eq!(decimals, 0);
        let (ticks, decimals) = Scale::new(0.0, 0.13, 0.0, 1.0).ticks(3.0);
        assert_eq!(ticks.len(), 3);
        assert_eq!(decimals, 2);
    }
}
