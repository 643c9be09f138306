//! A score as a table for people.

use std::fmt;

use super::score::{Score, ScoreRow, Summary, Tally};

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.good, self.all)
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = vec![
            [
                "about", "quantity", "truth", "estimate", "error", "relative", "95 %", "status",
            ]
            .map(String::from),
        ];
        table.extend(self.rows.iter().map(cells));
        let widths: Vec<usize> = (0..8)
            .map(|k| table.iter().map(|r| r[k].chars().count()).max().unwrap_or(0))
            .collect();
        for row in &table {
            let line: Vec<String> = row
                .iter()
                .zip(&widths)
                .map(|(c, w)| format!("{c:<w$}", w = *w))
                .collect();
            writeln!(f, "{}", line.join("  ").trim_end())?;
        }
        writeln!(f, "\n{}", self.summary)?;
        let list = |names: &[String]| {
            if names.is_empty() {
                "none".into()
            } else {
                names.join(", ")
            }
        };
        let c = &self.causes;
        write!(
            f,
            "causes: found {}; missed {}; without reason {}",
            list(&c.found),
            list(&c.missed),
            list(&c.invented)
        )
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let worst: Vec<String> = self
            .worst_relative
            .iter()
            .map(|(quantity, value)| format!("{quantity} {:.1} %", 100.0 * value))
            .collect();
        if !worst.is_empty() {
            writeln!(f, "worst relative error: {}", worst.join(", "))?;
        }
        write!(
            f,
            "intervals that hold the truth: {}; joint types right: {}; relations right: {}; not estimated: {}; only assumed: {}",
            self.intervals, self.joints, self.relations, self.absent, self.assumed
        )
    }
}

fn cells(row: &ScoreRow) -> [String; 8] {
    let mark = |good: bool| if good { "holds" } else { "MISSES" }.to_string();
    let verdict = match (row.holds, row.right) {
        (Some(holds), _) => mark(holds),
        (None, Some(right)) => if right { "right" } else { "WRONG" }.to_string(),
        (None, None) => String::new(),
    };
    [
        row.about.clone(),
        row.quantity.clone(),
        plain(&row.truth),
        plain(&row.estimate),
        row.error
            .map(|e| format!("{} {}", short(e), row.unit))
            .unwrap_or_default(),
        row.relative.map(|r| format!("{:.1} %", 100.0 * r)).unwrap_or_default(),
        verdict,
        row.status.clone(),
    ]
}

fn plain(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Null => "-".into(),
        serde_json::Value::String(s) => s.clone(),
        serde_json::Value::Array(list) => list.iter().map(plain).collect::<Vec<_>>().join(" "),
        other => other.as_f64().map_or(other.to_string(), short),
    }
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    if value.abs() < 1e-5 {
        format!("{value:.3e}")
    } else {
        format!("{value:.digits$}")
    }
}
