//! Whether what is left looks like noise.

use super::compare::pairs;
use super::{Quantity, Trace};
use crate::math::ljung_box;
use crate::twin::Evidence;

const LAGS: usize = 20;

/// One Ljung-Box test per curve that is long enough, with what it says in words.
pub fn whiteness(traces: &[Trace]) -> Vec<Evidence> {
    let mut found = Vec::new();
    for trace in traces {
        // After a bounce what is left is chaos, not colour.
        for curve in trace.curves.iter().filter(|c| c.quantity != Quantity::Bounced) {
            let residual: Vec<f64> = pairs(curve).map(|(m, p)| m - p).collect();
            if residual.len() < 3 * LAGS {
                continue;
            }
            let mean = residual.iter().sum::<f64>() / residual.len() as f64;
            let centred: Vec<f64> = residual.iter().map(|r| r - mean).collect();
            let (statistic, p_value) = ljung_box(&centred, LAGS, 0);
            let what = format!("{} of {}", curve.label, trace.interaction);
            let colour = if p_value < 0.01 {
                "is not white: something slow is left in it"
            } else {
                "looks like noise"
            };
            let side = if mean > 0.0 { "above" } else { "below" };
            let words = format!(
                "{what}: measured {} {side} the prediction on average; what is left {colour}",
                curve.quantity.spoken(mean.abs()),
            );
            found.push(Evidence {
                residual: what,
                test: "Ljung-Box, 20 lags".into(),
                statistic,
                p_value,
                words,
            });
        }
    }
    found
}
