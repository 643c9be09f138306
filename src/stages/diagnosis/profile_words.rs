//! Numbers of a profile as people say them.

use std::f64::consts::PI;

use super::Quantity;
use super::contrast::Banded;

/// A value of a covariate as people say it.
pub fn spoken(value: f64, unit: &str) -> String {
    let (factor, unit) = match unit {
        "m" => (1e3, "mm"),
        "m/s" => (1e3, "mm/s"),
        "rad" => (180.0 / PI, "degrees"),
        "rad/s" => (180.0 / PI, "degrees/s"),
        unit => (1.0, unit),
    };
    let shown = factor * value;
    let decimals = (1.0 - shown.abs().max(1e-9).log10().floor()).clamp(0.0, 3.0) as usize;
    let number = format!("{shown:.decimals$}");
    let number = if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        &number
    };
    format!("{} {unit}", if number == "-0" { "0" } else { number })
}

/// How far off a prediction is, with its band.
pub fn off(mean: &Banded, quantity: Quantity) -> String {
    let (factor, unit) = match quantity {
        Quantity::Force => (1.0, "N"),
        Quantity::Torque => (1e3, "N·mm"),
        Quantity::Position | Quantity::Flight | Quantity::Bounced => (1e3, "mm"),
        Quantity::Rotation => (180.0 / PI, "degrees"),
    };
    let half = factor * 0.5 * (mean.high - mean.low);
    let decimals = (0.3 - half.max(1e-9).log10()).ceil().clamp(0.0, 5.0) as usize;
    let of = |x: f64| format!("{:.decimals$}", factor * x.abs());
    if !mean.differs() {
        return format!("right within {} {unit}", of(mean.low.abs().max(mean.high)));
    }
    let side = if mean.value > 0.0 { "too low" } else { "too high" };
    let (least, most) = (mean.low.abs().min(mean.high.abs()), mean.low.abs().max(mean.high.abs()));
    format!("{} {unit} {side} ({} to {})", of(mean.value), of(least), of(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_is_said_with_its_band() {
        let of = |value: f64, low: f64, high: f64| off(&Banded { value, low, high }, Quantity::Force);
        assert_eq!(of(0.21, 0.15, 0.27), "0.21 N too low (0.15 to 0.27)");
        assert_eq!(of(-0.21, -0.27, -0.15), "0.21 N too high (0.15 to 0.27)");
        assert_eq!(of(0.01, -0.02, 0.04), "right within 0.04 N");
        assert_eq!(spoken(0.06, "m/s"), "60 mm/s");
        assert_eq!(spoken(-0.0004, "m"), "-0.4 mm");
    }
}
