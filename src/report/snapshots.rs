//! Where things were before and after: measured and simulated effects, and the course of the search.

use super::markup::{count, escape, section as framed, table};
use super::scale::Scale;
use crate::pipeline::Run;
use crate::stages::snapshots::{Effect, Gaussian, GroupResult, NAMES, SearchStep, ThingResult, UNITS};

const SIZE: f64 = 232.0;
const EDGE: f64 = 34.0;
const MOST_DOTS: usize = 160;

/// One block per thing that was studied by snapshots; nothing where none was.
pub fn section(run: &Run) -> String {
    let Some(found) = run.snapshots.as_ref().filter(|s| !s.things.is_empty()) else {
        return String::new();
    };
    let blocks: String = found.things.iter().map(thing).collect();
    let lead = "Each cross is where one measured trial took the thing, relative to where it stood; each dot is a simulated trial, drawn from \
        what the fitted trials leave possible. <b>Held-out</b> tools and actions were never used to fit: they are the test.";
    framed("snapshots", "Before and after", lead, &blocks)
}

fn thing(t: &ThingResult) -> String {
    let extent = extent(&t.groups);
    let figures: String = t.groups.iter().map(|g| figure(g, extent)).collect();
    format!(
        "<h3>{}</h3>\n{LEGEND}<div class=\"plots\">\n{figures}</div>\n{}{}",
        escape(&t.name),
        course(t),
        parameters(t)
    )
}

const LEGEND: &str = "<ul class=\"legend\" aria-label=\"Legend of the effects\">\
    <li><svg width=\"16\" height=\"12\" aria-hidden=\"true\"><path class=\"effect\" d=\"M4 2l8 8M12 2l-8 8\"/></svg>measured</li>\
    <li><svg width=\"16\" height=\"12\" aria-hidden=\"true\"><circle class=\"drawn\" cx=\"8\" cy=\"6\" r=\"3\"/></svg>simulated, after</li>\
    <li><svg width=\"16\" height=\"12\" aria-hidden=\"true\"><circle class=\"before\" cx=\"8\" cy=\"6\" r=\"3\"/></svg>simulated, before anything was learnt</li></ul>\n";

/// Half the side of the square about the origin that holds what was measured, m.
fn extent(groups: &[GroupResult]) -> f64 {
    let measured = groups.iter().flat_map(|g| &g.measured);
    let most = measured
        .map(|e| e.x.abs().max(e.y.abs()))
        .filter(|x| x.is_finite())
        .fold(0.01, f64::max);
    1.4 * most
}

fn figure(group: &GroupResult, extent: f64) -> String {
    let (x, y) = (
        Scale::new(-extent, extent, EDGE, SIZE - 6.0),
        Scale::new(-extent, extent, SIZE - 22.0, 6.0),
    );
    let held = if group.group.held_out {
        " <span class=\"tag held\">held out</span>"
    } else {
        ""
    };
    let mut svg = axes(&x, &y);
    svg.push_str(&dots(&group.at_prior, "before", &x, &y));
    svg.push_str(&dots(&group.at_posterior, "drawn", &x, &y));
    for e in &group.measured {
        let (u, v) = (x.clamped(e.x), y.clamped(e.y));
        svg.push_str(&format!(
            "<path class=\"effect\" d=\"M{:.1} {:.1}l6 6m0 -6l-6 6\"/>",
            u - 3.0,
            v - 3.0
        ));
    }
    let name = format!("{}, {}", escape(&group.group.tool), escape(&group.group.action));
    format!(
        "<figure class=\"plot\"><figcaption>{name}{held} <small>mm</small></figcaption><svg viewBox=\"0 0 {SIZE} {SIZE}\" role=\"img\" \
         aria-label=\"{name}: measured and simulated displacements on the support\">{svg}</svg>\
         <p class=\"muted\">divergence {} → {} nats, chance alone leaves about {}; energy distance {} → {} mm</p></figure>\n",
        number(group.divergence[0]),
        number(group.divergence[1]),
        number(Gaussian::chance(group.measured.len())),
        number(1e3 * group.energy[0]),
        number(1e3 * group.energy[1]),
    )
}

fn number(value: f64) -> String {
    match value {
        v if !v.is_finite() => "–".into(),
        v if v.abs() >= 100.0 => format!("{v:.0}"),
        v if v.abs() >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// A parameter to three digits.
fn plain(value: f64) -> String {
    match value {
        v if v.abs() >= 0.01 => format!("{v:.3}"),
        v => format!("{v:.1e}"),
    }
}

/// At most [`MOST_DOTS`], evenly taken, those that lie inside.
fn dots(effects: &[Effect], class: &str, x: &Scale, y: &Scale) -> String {
    let step = effects.len().div_ceil(MOST_DOTS).max(1);
    let inside = |e: &&Effect| (EDGE..SIZE).contains(&x.at(e.x)) && (0.0..SIZE - 20.0).contains(&y.at(e.y));
    let each = effects.iter().step_by(step).filter(inside);
    each.map(|e| {
        format!(
            "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"2\"/>",
            x.at(e.x),
            y.at(e.y)
        )
    })
    .collect()
}

fn axes(x: &Scale, y: &Scale) -> String {
    let (ticks, _) = x.ticks(4.0);
    let mut out = String::new();
    for v in ticks {
        let (u, w) = (x.at(v), y.at(v));
        out.push_str(&format!(
            "<path class=\"grid\" d=\"M{u:.1} 6V{:.0}M{EDGE:.0} {w:.1}H{:.0}\"/>",
            SIZE - 22.0,
            SIZE - 6.0
        ));
        out.push_str(&format!(
            "<text class=\"tick\" x=\"{u:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{:.0}</text>",
            SIZE - 8.0,
            1e3 * v
        ));
        out.push_str(&format!(
            "<text class=\"tick\" x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{:.0}</text>",
            EDGE - 4.0,
            w + 3.0,
            1e3 * v
        ));
    }
    out
}

/// The divergence of every evaluation, and on what was held out wherever it improved.
fn course(t: &ThingResult) -> String {
    const WIDTH: f64 = 520.0;
    const HEIGHT: f64 = 190.0;
    let tests: Vec<(usize, f64)> = t
        .search
        .iter()
        .enumerate()
        .filter_map(|(i, s)| Some((i, s.test?)))
        .collect();
    let log = |v: f64| v.max(1e-3).log10();
    let values = t
        .search
        .iter()
        .map(|s| s.train)
        .chain(tests.iter().map(|s| s.1))
        .map(log)
        .filter(|v| v.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return String::new();
    }
    let x = Scale::new(0.0, t.search.len() as f64, 44.0, WIDTH - 8.0);
    let y = Scale::new(low - 0.1, high + 0.1, HEIGHT - 30.0, 8.0);
    let mut svg = String::new();
    for power in (low.floor() as i32)..=(high.ceil() as i32) {
        for digit in [1.0, 3.0] {
            let v: f64 = digit * 10f64.powi(power);
            if (low - 0.1..=high + 0.1).contains(&v.log10()) {
                let at = y.at(v.log10());
                svg.push_str(&format!("<path class=\"grid\" d=\"M44 {at:.1}H{:.0}\"/><text class=\"tick\" x=\"40\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", WIDTH - 8.0, at + 3.0, number(v)));
            }
        }
    }
    let improved: Vec<(usize, f64)> = t
        .search
        .iter()
        .enumerate()
        .filter(|(_, s)| s.fell)
        .map(|(i, s)| (i, s.train))
        .collect();
    let followed: Vec<(usize, f64)> = tests.iter().copied().filter(|(i, _)| t.search[*i].fell).collect();
    svg.push_str(&way(&improved, "measured", &x, &y));
    svg.push_str(&way(&followed, "predicted", &x, &y));
    svg.push_str(
        &t.search
            .iter()
            .enumerate()
            .map(|(i, s)| dot(i, s, &x, &y))
            .collect::<String>(),
    );
    for (i, v) in &tests {
        let (u, w) = (x.at(*i as f64 + 1.0), y.at(log(*v)));
        svg.push_str(&format!("<path class=\"test\" d=\"M{u:.1} {:.1}l5 8h-10z\"/>", w - 5.0));
    }
    svg.push_str(&format!(
        "<text class=\"tick\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">evaluation</text>",
        WIDTH / 2.0,
        HEIGHT - 8.0
    ));
    format!(
        "<figure class=\"plot wide\"><figcaption>Course of the search <small>divergence, nats</small></figcaption>\
         <svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Divergence of each evaluation on fitted and on held-out trials\">{svg}</svg>\
         <p class=\"muted\">Dots: fitted tools and actions. Triangles: held-out ones, evaluated wherever the fit improved. \
         Lines join the steps by which the fit improved beyond the scatter of the trials. {} simulated in all.</p></figure>\n",
        count(t.simulated, "trial was", "trials were")
    )
}

fn dot(i: usize, s: &SearchStep, x: &Scale, y: &Scale) -> String {
    let class = if s.improved { "drawn" } else { "before" };
    format!(
        "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\"/>",
        x.at(i as f64 + 1.0),
        y.clamped(s.train.max(1e-3).log10())
    )
}

fn way(points: &[(usize, f64)], class: &str, x: &Scale, y: &Scale) -> String {
    let each: Vec<String> = points
        .iter()
        .map(|(i, v)| format!("{:.1} {:.1}", x.at(*i as f64 + 1.0), y.clamped(v.max(1e-3).log10())))
        .collect();
    if each.len() < 2 {
        return String::new();
    }
    format!("<path class=\"course {class}\" d=\"M{}\"/>", each.join("L"))
}

fn parameters(t: &ThingResult) -> String {
    let row = |k: usize| {
        let m = &t.marginals[k];
        let said = match (t.fixed[k], k == 0 && t.tips) {
            (true, _) => "the snapshots fix it",
            (_, true) => "assumed: it fell over in some trials",
            _ => "left wide: not fixed",
        };
        format!(
            "<tr><th scope=\"row\">{}</th><td class=\"num\">{}</td><td class=\"num\">{} to {}</td><td class=\"num\">{}</td><td>{}</td><td>{said}</td></tr>\n",
            NAMES[k],
            plain(m.median),
            plain(m.ci95[0]),
            plain(m.ci95[1]),
            plain(t.best[k]),
            UNITS[k]
        )
    };
    let rows: String = (0..NAMES.len()).map(row).collect();
    let head = [
        "Parameter",
        "Median",
        "95 % interval",
        "Least divergence at",
        "Unit",
        "What is known",
    ];
    format!(
        "{}<p class=\"muted\">The simulation itself is off by some {:.0} % of the travel; that doubt is in the intervals. The optimum alone would \
         not say which parameters the data leave free.</p>\n",
        table(&format!("Parameters of {}", t.name), "estimates", &head, &rows),
        100.0 * t.share
    )
}
