//! One curve as a small drawing: measured as dots, predicted as a line in its band of noise, phases behind.

use super::markup::escape;
use super::numbers::{display, fixed};
use super::scale::Scale;
use crate::capture::{Phase, PhaseKind, Segmented};
use crate::stages::diagnosis::Curve;

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 178.0;
const LEFT: f64 = 46.0;
const RIGHT: f64 = 372.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 140.0;
const MOST_POINTS: usize = 300;

/// A row of a curve in the units shown.
struct Point {
    time: f64,
    measured: f64,
    predicted: f64,
}

/// The name of a phase and its class.
pub fn phase_name(kind: PhaseKind) -> &'static str {
    match kind {
        PhaseKind::Rest => "rest",
        PhaseKind::Approach => "approach",
        PhaseKind::Stick => "stick",
        PhaseKind::Slide => "slide",
        PhaseKind::Release => "release",
    }
}

/// First and last time of a curve.
pub fn span(curve: &Curve) -> Option<(f64, f64)> {
    let mut times = curve.time.iter().copied().filter(|t| t.is_finite());
    let first = times.next()?;
    Some(times.fold((first, first), |(l, h), t| (l.min(t), h.max(t))))
}

/// A curve with its title; `start` is what its axis of time counts from, s.
pub fn figure(curve: &Curve, segmented: Option<&Segmented>, start: f64) -> String {
    let finite = |values: &[f64]| {
        values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .map(f64::abs)
            .fold(0.0, f64::max)
    };
    let size = finite(&curve.measured).max(finite(&curve.predicted));
    let unit = curve.quantity.unit();
    let shown = display(unit, size);
    let (factor, unit) = (shown.map_or(1.0, |d| d.factor), shown.map_or(unit, |d| d.unit));
    let points = thinned(curve, factor);
    let noise = curve.noise.filter(|n| n.is_finite()).unwrap_or(0.0).abs() * factor;
    let title = format!(
        "<figcaption>{} <small>{unit}</small></figcaption>",
        escape(&curve.label)
    );
    let Some((x, y)) = scales(&points, noise) else {
        return format!("<figure class=\"plot\">{title}<p class=\"muted\">No reading.</p></figure>\n");
    };
    let mut svg = shades(segmented, &x);
    svg.push_str(&axes(&x, &y, start));
    if noise > 0.0 {
        svg.push_str(&band(&points, 2.0 * noise, &x, &y));
    }
    svg.push_str(&dots(&points, &x, &y));
    svg.push_str(&line(&points, &x, &y));
    format!(
        "<figure class=\"plot\">{title}<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
         aria-label=\"{}, measured and predicted, in {unit} over seconds\">{svg}</svg></figure>\n",
        escape(&curve.label)
    )
}

/// At most [`MOST_POINTS`] rows, evenly taken, the first and the last among them.
fn thinned(curve: &Curve, factor: f64) -> Vec<Point> {
    let n = curve.time.len().min(curve.measured.len());
    let kept = n.min(MOST_POINTS);
    (0..kept)
        .map(|k| if kept > 1 { k * (n - 1) / (kept - 1) } else { 0 })
        .map(|i| Point {
            time: curve.time[i],
            measured: curve.measured[i] * factor,
            predicted: curve.predicted.get(i).copied().unwrap_or(f64::NAN) * factor,
        })
        .filter(|p| p.time.is_finite())
        .collect()
}

fn scales(points: &[Point], noise: f64) -> Option<(Scale, Scale)> {
    let values = points
        .iter()
        .flat_map(|p| [p.measured, p.predicted])
        .filter(|v| v.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return None;
    }
    let (first, last) = (points.first()?.time, points.last()?.time);
    // A curve that shows nothing but noise is not blown up to the full height.
    let least = 10.0 * noise;
    let extra = 0.06 * (high - low) + 0.5 * (least - (high - low)).max(0.0);
    Some((
        Scale::new(first, last, LEFT, RIGHT),
        Scale::new(low - extra, high + extra, BOTTOM, TOP),
    ))
}

fn shades(segmented: Option<&Segmented>, x: &Scale) -> String {
    let phases = segmented.map_or(&[][..], |s| &s.phases[..]);
    phases.iter().map(|p| shade(p, x)).collect()
}

/// A phase as a faint field with a stronger edge on top.
fn shade(phase: &Phase, x: &Scale) -> String {
    let (from, to) = (x.clamped(phase.start), x.clamped(phase.end));
    let visible = to - from > 0.05 && phase.kind != PhaseKind::Rest;
    if !visible {
        return String::new();
    }
    let name = phase_name(phase.kind);
    let wide = to - from;
    format!(
        "<g class=\"phase {name}\"><title>{name}</title><rect x=\"{from:.1}\" y=\"{TOP}\" width=\"{wide:.1}\" height=\"{:.0}\"/>\
         <rect class=\"edge\" x=\"{from:.1}\" y=\"{:.0}\" width=\"{wide:.1}\" height=\"4\"/></g>",
        BOTTOM - TOP,
        TOP - 6.0
    )
}

fn axes(x: &Scale, y: &Scale, start: f64) -> String {
    let mut out = String::new();
    let (values, decimals) = y.ticks(4.0);
    for v in values {
        let at = y.at(v);
        out.push_str(&format!(
            "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text class=\"y\" x=\"{:.0}\" y=\"{:.1}\">{}</text>",
            LEFT - 6.0,
            at + 3.5,
            fixed(v, decimals)
        ));
    }
    let (first, last) = (x.value_at(LEFT) - start, x.value_at(RIGHT) - start);
    let own = Scale::new(first, last, LEFT, RIGHT);
    let (values, decimals) = own.ticks(5.0);
    for v in &values {
        let at = own.at(*v);
        let class = if at > RIGHT - 14.0 { "x end" } else { "x" };
        out.push_str(&format!(
            "<path class=\"tick\" d=\"M{at:.1} {BOTTOM}v4\"/><text class=\"{class}\" x=\"{:.1}\" y=\"{:.0}\">{}</text>",
            if class == "x" { at } else { RIGHT + 6.0 },
            BOTTOM + 17.0,
            fixed(*v, decimals)
        ));
    }
    out.push_str(&format!(
        "<text class=\"x\" x=\"{:.0}\" y=\"{:.0}\">time, s</text>",
        0.5 * (LEFT + RIGHT),
        BOTTOM + 33.0
    ));
    out.push_str(&format!("<path class=\"axis\" d=\"M{LEFT} {BOTTOM}H{RIGHT}\"/>"));
    out
}

/// Stretches over which there is a prediction.
fn stretches(points: &[Point]) -> Vec<&[Point]> {
    points
        .split(|p| !p.predicted.is_finite())
        .filter(|s| !s.is_empty())
        .collect()
}

fn band(points: &[Point], half: f64, x: &Scale, y: &Scale) -> String {
    let corner = |p: &Point, side: f64| format!("{:.1} {:.1}", x.at(p.time), y.clamped(p.predicted + side * half));
    let ring = |s: &[Point]| {
        let over = s.iter().map(|p| corner(p, 1.0));
        let under = s.iter().rev().map(|p| corner(p, -1.0));
        format!("M{}Z", over.chain(under).collect::<Vec<_>>().join("L"))
    };
    let path: String = stretches(points).into_iter().map(ring).collect();
    if path.is_empty() {
        return String::new();
    }
    format!("<path class=\"band\" d=\"{path}\"/>")
}

fn line(points: &[Point], x: &Scale, y: &Scale) -> String {
    let corner = |p: &Point| format!("{:.1} {:.1}", x.at(p.time), y.at(p.predicted));
    let path: String = stretches(points)
        .into_iter()
        .map(|s| format!("M{}", s.iter().map(corner).collect::<Vec<_>>().join("L")))
        .collect();
    if path.is_empty() {
        return String::new();
    }
    format!("<path class=\"predicted\" d=\"{path}\"/>")
}

fn dots(points: &[Point], x: &Scale, y: &Scale) -> String {
    let path: String = points
        .iter()
        .filter(|p| p.measured.is_finite())
        .map(|p| format!("M{:.1} {:.1}h0", x.at(p.time), y.at(p.measured)))
        .collect();
    format!("<path class=\"measured\" d=\"{path}\"/>")
}
