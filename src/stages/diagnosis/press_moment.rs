//! One moment of a press, taken whole or in parts.

use super::presses::{BIN, PARTS};

/// One moment of a press.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Seconds since the capture began.
    pub time: f64,
    /// Seconds since the sample before.
    pub step: f64,
    /// How far the tool is below where it first met the surface, m; negative above.
    pub depth: f64,
    /// How fast that grows, m/s.
    pub rate: f64,
    /// Depth in its parts, m, where it is taken in parts.
    pub parts: Option<[f64; PARTS]>,
}

impl Moment {
    /// Those of them that are taken by themselves, after what was taken at `before` (s), if anything was.
    pub(super) fn each(&self, before: Option<f64>) -> impl Iterator<Item = Self> {
        let whole = *self;
        let part = move |k: usize, parts: [f64; PARTS]| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(PARTS - 1));
            Self {
                time: whole.time + BIN * ((k as f64 + 0.5) / PARTS as f64 - 0.5),
                step: whole.step / PARTS as f64,
                depth: parts[k],
                rate: (parts[b] - parts[a]) * PARTS as f64 / (BIN * (b - a) as f64),
                parts: None,
            }
        };
        let one = self.parts.is_none().then_some(whole);
        let several = self
            .parts
            .into_iter()
            .flat_map(move |p| (0..PARTS).map(move |k| part(k, p)));
        let after = move |(k, m): (usize, Self)| Self {
            step: before.filter(|_| k == 0).map_or(m.step, |t| m.time - t),
            ..m
        };
        one.into_iter().chain(several).enumerate().map(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_part_to_whole_as_much_time_goes_by_as_does() {
        let moment = |k: u32| Moment {
            time: BIN * f64::from(k),
            step: BIN,
            depth: 1e-3,
            rate: 0.0,
            parts: (2..5).contains(&k).then_some([1e-3; PARTS]),
        };
        let (mut before, mut gone) = (None, 0.0);
        for m in (0..8).map(moment) {
            for part in m.each(before) {
                gone += part.step;
                assert!((gone - BIN - part.time).abs() < 1e-12, "{} {}", gone, part.time);
                before = Some(part.time);
            }
        }
    }
}
