//! What the report plots: each quantity measured, predicted, and the residual between the two.

use std::collections::BTreeMap;

use re_sdk_types::archetypes::{Scalars, SeriesLines};

use super::clock::{Moment, Span};
use super::scene::{MEASURED, ORANGE, PREDICTED};
use super::stream::Stream;
use crate::base::Result;
use crate::capture::Capture;
use crate::pipeline::Run;
use crate::stages::diagnosis::Curve;

/// Measured minus predicted.
const RESIDUAL: &str = "residual";
const LINES: [(&str, [u8; 3]); 3] = [
    (MEASURED, [90, 100, 110]),
    (PREDICTED, ORANGE),
    (RESIDUAL, [200, 40, 90]),
];

/// One plot per label: touches follow each other on it, with a gap between.
pub(super) fn log(stream: &mut Stream, capture: &Capture, run: &Run, spans: &[Option<Span>]) -> Result<()> {
    let mut labels: BTreeMap<&str, &str> = BTreeMap::new();
    for curve in run.traces.iter().flat_map(|t| &t.curves) {
        labels.insert(&curve.label, curve.quantity.unit());
    }
    for (label, unit) in labels {
        for (name, color) in LINES {
            let line = SeriesLines::new()
                .with_names([format!("{name}, {unit}")])
                .with_colors([color]);
            stream.still(&["curves", label, name], &line)?;
        }
    }
    for (interaction, span) in capture.interactions.iter().zip(spans) {
        let Some(span) = span else { continue };
        for trace in run.traces.iter().filter(|t| t.interaction == interaction.name) {
            for each in &trace.curves {
                curve(stream, span, each)?;
            }
        }
    }
    Ok(())
}

fn curve(stream: &mut Stream, span: &Span, curve: &Curve) -> Result<()> {
    let value = |all: &[f64], i: usize| all.get(i).copied().unwrap_or(f64::NAN);
    let of = |name: &str, i: usize| match name {
        MEASURED => value(&curve.measured, i),
        PREDICTED => value(&curve.predicted, i),
        _ => value(&curve.measured, i) - value(&curve.predicted, i),
    };
    for (name, _) in LINES {
        let rows = curve.time.iter().enumerate().map(|(i, t)| (*t, of(name, i)));
        let read: Vec<(f64, f64)> = rows.filter(|(t, v)| v.is_finite() && span.holds(*t)).collect();
        let Some((last, _)) = read.last().copied() else {
            continue;
        };
        let mut moments: Vec<Moment> = read.iter().map(|(t, _)| span.at(*t)).collect();
        let mut values: Vec<f64> = read.iter().map(|(_, v)| *v).collect();
        // The line ends with the touch: it is not drawn on to the next one.
        moments.push(span.at(last));
        values.push(f64::NAN);
        stream.rows(
            &["curves", &curve.label, name],
            &moments,
            Scalars::new(values).columns_of_unit_batches(),
        )?;
    }
    Ok(())
}
