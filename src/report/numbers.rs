//! Numbers as people read them: in units that suit their size, with as many digits as their doubt allows.

/// A unit to show numbers in, and what SI values are multiplied by to get there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Shown value per SI value.
    pub factor: f64,
    /// The unit's symbol; empty for a pure number.
    pub unit: &'static str,
}

/// The unit in which a quantity of SI unit `unit` and this largest size is best shown; `None` for a unit
/// that has no better one.
pub fn display(unit: &str, size: f64) -> Option<Display> {
    let of = |factor, unit| Some(Display { factor, unit });
    match unit {
        "1" => of(1.0, ""),
        "m" if size < 1.0 => of(1e3, "mm"),
        "kg" if size < 1.0 => of(1e3, "g"),
        "rad" => of(180.0 / std::f64::consts::PI, "°"),
        "N" if size < 0.02 => of(1e3, "mN"),
        "N·m" if size < 1.0 => of(1e3, "mN·m"),
        "N/m" if size >= 1e3 => of(1e-3, "N/mm"),
        "kg·m²" if size < 0.1 => of(1e4, "kg·cm²"),
        "N·m·s/rad" if size < 1.0 => of(1e3, "mN·m·s/rad"),
        "N·m/rad" if size < 1.0 => of(1e3, "mN·m/rad"),
        "m/rad" if size < 1.0 => of(1e3, "mm/rad"),
        _ => None,
    }
}

/// A unit after a number, with the space that it wants.
pub fn with_unit(number: &str, unit: &str) -> String {
    match unit {
        "" => number.to_owned(),
        "°" => format!("{number}°"),
        unit => format!("{number} {unit}"),
    }
}

/// Decimals at which a number of this doubt keeps two digits of the doubt.
pub fn decimals(doubt: f64) -> usize {
    if !(doubt.is_finite() && doubt > 0.0) {
        return 3;
    }
    (1.0 - doubt.log10().floor()).clamp(0.0, 6.0) as usize
}

/// Decimals for a number whose doubt is not known: `digits` significant ones.
pub fn decimals_of(value: f64, digits: f64) -> usize {
    if !(value.is_finite() && value != 0.0) {
        return 0;
    }
    (digits - 1.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize
}

/// A number with that many decimals, a true minus sign, and no negative zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{:.decimals$}", value.abs());
    let nothing = text.bytes().all(|b| b == b'0' || b == b'.');
    if value < 0.0 && !nothing {
        format!("−{text}")
    } else {
        text
    }
}

/// A number of SI unit `unit` with `digits` significant ones, in the unit that suits it.
pub fn quantity(value: f64, unit: &str, digits: f64) -> String {
    let shown = display(unit, value.abs());
    let scaled = value * shown.map_or(1.0, |d| d.factor);
    with_unit(
        &fixed(scaled, decimals_of(scaled, digits)),
        shown.map_or(unit, |d| d.unit),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_show_what_their_doubt_allows() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-1.25, 2), "−1.25");
        assert_eq!(decimals(0.53), 2);
        assert_eq!(decimals(24.6), 0);
        assert_eq!(quantity(0.000_380_8, "m", 2.0), "0.38 mm");
        assert_eq!(quantity(0.009_085, "rad", 2.0), "0.52°");
        assert_eq!(quantity(f64::NAN, "m", 2.0), "– m");
    }
}
