//! An estimate as a row of a table: value, interval, status, method, source, and what it is confounded with.

use super::markup::{badge, escape, names};
use super::numbers::{decimals, decimals_of, display, fixed, with_unit};
use crate::base::{Confounded, Estimate, Status};

/// The columns of [`scalar`] and [`list`].
pub const COLUMNS: [&str; 6] = ["Quantity", "Value", "95 % interval", "Status", "Method", "From"];

/// One component, in SI.
struct Component {
    value: f64,
    sd: Option<f64>,
    interval: Option<[f64; 2]>,
}

/// Decimals for two digits of the doubt, or for one where the other components are so much larger that two are idle.
fn sensible(sd: f64, most: usize) -> usize {
    decimals(sd).min(most.max(decimals(10.0 * sd)))
}

/// A component as two pieces of text in the unit shown.
fn written(c: &Component, factor: f64, unit: &str, most: usize) -> (String, String) {
    let sd = c.sd.map(|s| s * factor).filter(|s| s.is_finite() && *s > 0.0);
    let value = c.value * factor;
    let places = sd.map_or_else(|| decimals_of(value, 4.0).min(most), |sd| sensible(sd, most));
    let tail = |text: String| with_unit(&text, unit);
    let shown = match sd {
        Some(sd) if unit.is_empty() || unit == "°" => {
            format!("{} ± {}{unit}", fixed(value, places), fixed(sd, places))
        }
        Some(sd) => format!("{} ± {} {unit}", fixed(value, places), fixed(sd, places)),
        None => tail(fixed(value, places)),
    };
    let interval = c.interval.map_or_else(
        || "exact".to_owned(),
        |[low, high]| {
            format!(
                "{} … {}",
                fixed(low * factor, places),
                tail(fixed(high * factor, places))
            )
        },
    );
    (shown, interval)
}

/// A row for a single number.
pub fn scalar(name: &str, e: &Estimate) -> String {
    let component = Component {
        value: e.value,
        sd: e.sd,
        interval: e.ci95,
    };
    row(name, &[("", component)], &e.unit, &tail(e), e.confounded.as_ref())
}

/// A row for a list of numbers, a line per component.
pub fn list<const N: usize>(name: &str, labels: [&str; N], e: &Estimate<[f64; N]>) -> String
where
    [f64; N]: crate::base::Value<Interval = [[f64; 2]; N]>,
{
    let component = |i: usize| Component {
        value: e.value[i],
        sd: e.sd.map(|s| s[i]),
        interval: e.ci95.map(|c| c[i]),
    };
    let components: Vec<(&str, Component)> = (0..N).map(|i| (labels[i], component(i))).collect();
    row(name, &components, &e.unit, &tail(e), e.confounded.as_ref())
}

/// Status, method and source.
fn tail<T: crate::base::Value>(e: &Estimate<T>) -> String {
    format!(
        "<td>{}</td><td>{}</td><td class=\"from\">{}</td>",
        badge(e.status),
        escape(&e.method),
        names(&e.from)
    )
}

fn row(
    name: &str,
    components: &[(&str, Component)],
    unit: &str,
    tail: &str,
    confounded: Option<&Confounded>,
) -> String {
    let size = components.iter().map(|(_, c)| c.value.abs()).fold(0.0, f64::max);
    let shown = display(unit, size);
    let (factor, unit) = (shown.map_or(1.0, |d| d.factor), shown.map_or(unit, |d| d.unit));
    let unit = escape(unit);
    // Beside a component of this size, further digits of a small one say nothing.
    let most = if components.len() > 1 {
        decimals_of(size * factor, 3.0)
    } else {
        6
    };
    let mut values = String::new();
    let mut intervals = String::new();
    for (label, component) in components {
        let (value, interval) = written(component, factor, &unit, most);
        let label = if label.is_empty() {
            String::new()
        } else {
            format!("<i>{label}</i> ")
        };
        values.push_str(&format!("<span class=\"line\">{label}{value}</span>"));
        intervals.push_str(&format!("<span class=\"line\">{interval}</span>"));
    }
    let why = confounded.map(words).unwrap_or_default();
    let class = if why.is_empty() { "" } else { " class=\"explained\"" };
    format!(
        "<tr{class}><th scope=\"row\">{name}</th><td class=\"num\">{values}</td><td class=\"num\">{intervals}</td>{tail}</tr>\n{why}"
    )
}

/// What a confounded estimate means, in words, as a row of its own.
fn words(c: &Confounded) -> String {
    let with: Vec<String> = c.with.iter().map(|w| format!("<code>{}</code>", escape(w))).collect();
    format!(
        "<tr class=\"why\"><td colspan=\"6\"><span>These data fix <code>{}</code>, but not this number apart from {}. \
         To part them: {}.</span></td></tr>\n",
        escape(&c.known),
        with.join(" and "),
        escape(c.experiment.trim_end_matches('.'))
    )
}

/// A number in a cell: value and doubt, marked where it is not measured; a dash where there is none.
pub fn cell(e: Option<&Estimate>) -> String {
    let Some(e) = e else {
        return "<td class=\"num muted\">–</td>".to_owned();
    };
    let shown = display(&e.unit, e.value.abs());
    let unit = escape(shown.map_or(e.unit.as_str(), |d| d.unit));
    let unit = if unit == "1" { String::new() } else { unit };
    let component = Component {
        value: e.value,
        sd: e.sd,
        interval: None,
    };
    let (value, _) = written(&component, shown.map_or(1.0, |d| d.factor), &unit, 6);
    let (class, word) = match e.status {
        Status::Measured => ("is-measured", "measured"),
        Status::Assumed => ("is-assumed", "assumed"),
        Status::Known => ("is-known", "known"),
    };
    format!("<td class=\"num {class}\" title=\"{word}\">{value}<span class=\"unseen\">, {word}</span></td>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_stands_with_its_doubt_and_what_it_is_mixed_with() {
        let e = Estimate::measured(0.2134, 0.000_53, "kg", vec!["lift".into()], "lift");
        let text = scalar("Mass", &e);
        assert!(text.contains("213.40 ± 0.53 g"), "{text}");
        assert!(text.contains("212.36 … 214.44 g"), "{text}");
        let confounded = Confounded {
            with: vec!["friction.kinetic".into()],
            known: "friction_force.kinetic".into(),
            experiment: "lift it".into(),
        };
        let text = scalar("Mass", &e.with_confounded(confounded));
        assert!(text.contains("To part them: lift it."), "{text}");
    }

    #[test]
    fn an_exact_number_says_so() {
        let text = scalar("Position", &Estimate::known(0.0, None, "rad"));
        assert!(text.contains("0°") && text.contains("exact"), "{text}");
    }
}
