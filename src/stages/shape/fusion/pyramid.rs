//! Nearest and farthest reading over squares of pixels, so that whole blocks are decided at once.

use super::depths::InverseDepths;

/// Pixels along the smallest squares.
const SQUARE: usize = 8;
/// Pixels along the next larger squares.
pub const COARSE: usize = 2 * SQUARE;
/// Levels, each of squares twice as large.
const LEVELS: usize = 4;

/// What a rectangle of the image shows.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// Smallest and largest inverse depth, 1/m; empty (least > most) where there is no reading.
    pub least: f32,
    pub most: f32,
    /// Whether every pixel has a reading.
    pub whole: bool,
}

impl Span {
    const EMPTY: Self = Self {
        least: f32::MAX,
        most: 0.0,
        whole: true,
    };

    fn join(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            whole: self.whole && other.whole,
        }
    }
}

struct Level {
    columns: usize,
    spans: Vec<Span>,
}

/// Squares of 8, 16, 32 and 64 pixels.
pub struct Pyramid {
    levels: Vec<Level>,
}

impl Pyramid {
    pub fn new(depths: &InverseDepths) -> Self {
        let (columns, rows) = (depths.width.div_ceil(SQUARE), depths.height.div_ceil(SQUARE));
        let mut spans = vec![Span::EMPTY; columns * rows];
        let width = depths.width;
        for (row, into) in spans.chunks_mut(columns).enumerate() {
            // Along columns first, which goes for many at once.
            let (mut least, mut most, mut low) = (vec![f32::MAX; width], vec![0.0_f32; width], vec![f32::MAX; width]);
            for y in row * SQUARE..((row + 1) * SQUARE).min(depths.height) {
                let pixels = &depths.values[depths.at(0, y)..][..width];
                for (((q, least), most), low) in pixels.iter().zip(&mut least).zip(&mut most).zip(&mut low) {
                    let seen = if *q > 0.0 { *q } else { f32::MAX };
                    *least = if seen < *least { seen } else { *least };
                    *most = if *q > *most { *q } else { *most };
                    *low = if *q < *low { *q } else { *low };
                }
            }
            let squares = least.chunks(SQUARE).zip(most.chunks(SQUARE)).zip(low.chunks(SQUARE));
            for (span, ((least, most), low)) in into.iter_mut().zip(squares) {
                *span = Span {
                    least: least.iter().fold(f32::MAX, |a, b| a.min(*b)),
                    most: most.iter().fold(0.0, |a, b| b.max(a)),
                    whole: low.iter().all(|q| *q > 0.0),
                };
            }
        }
        let mut levels = vec![Level { columns, spans }];
        for _ in 1..LEVELS {
            if let Some(last) = levels.last() {
                let next = last.halved();
                levels.push(next);
            }
        }
        Self { levels }
    }

    /// First pixel and least inverse depth of the squares of [`COARSE`] pixels that show something, row by row.
    pub fn coarse(&self) -> impl Iterator<Item = ([usize; 2], f32)> + '_ {
        let Level { columns, spans } = &self.levels[1];
        let seen = spans.iter().enumerate().filter(|(_, span)| span.most > 0.0);
        seen.map(move |(n, span)| ([n % columns * COARSE, n / columns * COARSE], span.least))
    }

    /// What the pixels of a rectangle show, and maybe some around it.
    pub fn span(&self, low: [usize; 2], high: [usize; 2]) -> Span {
        let extent = (high[0] - low[0]).max(high[1] - low[1]) / SQUARE;
        let level = (0..LEVELS - 1).find(|l| extent >> l < 3).unwrap_or(LEVELS - 1);
        let side = SQUARE << level;
        let Level { columns, spans } = &self.levels[level];
        let mut all = Span::EMPTY;
        for y in low[1] / side..=high[1] / side {
            for x in low[0] / side..=high[0] / side {
                if let Some(span) = spans.get(x + y * columns) {
                    all = all.join(*span);
                }
            }
        }
        all
    }
}

impl Level {
    fn halved(&self) -> Self {
        let rows = self.spans.len() / self.columns.max(1);
        let (columns, half) = (self.columns.div_ceil(2), rows.div_ceil(2));
        let mut spans = vec![Span::EMPTY; columns * half];
        for y in 0..rows {
            for x in 0..self.columns {
                let into = &mut spans[x / 2 + y / 2 * columns];
                *into = into.join(self.spans[x + y * self.columns]);
            }
        }
        Self { columns, spans }
    }
}
