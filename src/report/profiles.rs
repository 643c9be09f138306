//! Findings in pictures: what is left against what gave a finding away, one interaction without and with it, and of what the
//! errors of the plain model are made.

use super::markup::escape;
use super::numbers::{display, fixed, quantity};
use super::scale::Scale;
use crate::twin::{Budget, Profile};

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 178.0;
const LEFT: f64 = 50.0;
const RIGHT: f64 = 372.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 140.0;
/// Half the width of a digit at an axis.
const HALF_DIGIT: f64 = 3.4;

/// Both pictures of a finding.
pub fn pictures(profile: &Profile) -> String {
    format!(
        "<div class=\"plots pictures\">\n{}{}</div>\n<p class=\"legend\"><span class=\"key-without\">without the finding</span> \
         <span class=\"key-with\">with all findings</span> <span class=\"key-read\">read</span></p>\n",
        residual(profile),
        interaction(profile)
    )
}

/// Mean residuals over the covariate: a line without the finding, one with it in the band of two standard deviations.
fn residual(p: &Profile) -> String {
    let title = format!("measured less foretold, against {}", p.covariate);
    let values = p
        .bins
        .iter()
        .flat_map(|b| [b.before, b.after - 2.0 * b.sd, b.after + 2.0 * b.sd, 0.0]);
    let rows = |of: &dyn Fn(&crate::twin::ProfileBin) -> f64| p.bins.iter().map(|b| (b.at, of(b))).collect::<Vec<_>>();
    let picture = Picture::new(&p.unit, values, p.bins.iter().map(|b| b.at));
    picture.map_or_else(String::new, |picture| {
        let band = picture.ring(&rows(&|b| b.after + 2.0 * b.sd), &rows(&|b| b.after - 2.0 * b.sd));
        let marks = format!(
            "{band}{}{}{}",
            picture.zero(),
            picture.line("without", &rows(&|b| b.before)),
            picture.line("predicted", &rows(&|b| b.after))
        );
        picture.figure(&title, &format!("{}, {}", p.covariate, p.covariate_unit), &marks)
    })
}

/// One interaction: what was read as dots, what either model foretells as lines.
fn interaction(p: &Profile) -> String {
    let held = if p.held_out { ", held out" } else { ", fitted" };
    let title = format!("{} of {}{held}", p.quantity, p.interaction);
    let values = p.samples.iter().flat_map(|s| [s.measured, s.before, s.after]);
    let rows =
        |of: &dyn Fn(&crate::twin::ProfileSample) -> f64| p.samples.iter().map(|s| (s.time, of(s))).collect::<Vec<_>>();
    let picture = Picture::new(&p.unit, values, p.samples.iter().map(|s| s.time));
    picture.map_or_else(String::new, |picture| {
        let marks = format!(
            "{}{}{}",
            picture.dots(&rows(&|s| s.measured)),
            picture.line("without", &rows(&|s| s.before)),
            picture.line("predicted", &rows(&|s| s.after))
        );
        picture.figure(&title, "time, s", &marks)
    })
}

/// A small drawing with its axes.
struct Picture {
    x: Scale,
    y: Scale,
    factor: f64,
    unit: String,
}

impl Picture {
    /// Nothing where there is nothing to draw.
    fn new(unit: &str, values: impl Iterator<Item = f64>, places: impl Iterator<Item = f64>) -> Option<Self> {
        let range = |each: &mut dyn Iterator<Item = f64>| {
            let ends = each
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            (ends.0 <= ends.1).then_some(ends)
        };
        let values: Vec<f64> = values.collect();
        let (low, high) = range(&mut values.iter().copied())?;
        let (first, last) = range(&mut { places })?;
        let shown = display(unit, low.abs().max(high.abs()));
        let (factor, unit) = shown.map_or((1.0, unit), |d| (d.factor, d.unit));
        let extra = 0.06 * (high - low);
        Some(Self {
            x: Scale::new(first, last, LEFT, RIGHT),
            y: Scale::new(factor * (low - extra), factor * (high + extra), BOTTOM, TOP),
            factor,
            unit: unit.to_owned(),
        })
    }

    fn corners(&self, rows: &[(f64, f64)]) -> Vec<String> {
        let seen = rows.iter().filter(|r| r.0.is_finite() && r.1.is_finite());
        seen.map(|(x, y)| format!("{:.1} {:.1}", self.x.at(*x), self.y.at(self.factor * y)))
            .collect()
    }

    fn line(&self, class: &str, rows: &[(f64, f64)]) -> String {
        format!("<path class=\"{class}\" d=\"M{}\"/>", self.corners(rows).join("L"))
    }

    fn dots(&self, rows: &[(f64, f64)]) -> String {
        let each: String = self.corners(rows).iter().map(|c| format!("M{c}h0")).collect();
        format!("<path class=\"measured\" d=\"{each}\"/>")
    }

    fn ring(&self, over: &[(f64, f64)], under: &[(f64, f64)]) -> String {
        let mut back = self.corners(under);
        back.reverse();
        let ring = [self.corners(over), back].concat();
        format!("<path class=\"band\" d=\"M{}Z\"/>", ring.join("L"))
    }

    fn zero(&self) -> String {
        format!(
            "<path class=\"axis\" d=\"M{LEFT} {:.1}H{RIGHT}\"/>",
            self.y.clamped(0.0)
        )
    }

    fn figure(&self, title: &str, below: &str, marks: &str) -> String {
        let mut axes = String::new();
        let (values, decimals) = self.y.ticks(4.0);
        for v in values {
            let at = self.y.at(v);
            axes += &format!(
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text class=\"y\" x=\"{:.0}\" y=\"{:.1}\">{}</text>",
                LEFT - 6.0,
                at + 3.5,
                fixed(v, decimals)
            );
        }
        let (values, decimals) = self.x.ticks(5.0);
        for v in values {
            let (at, text) = (self.x.at(v), fixed(v, decimals));
            // The last number ends where the drawing does.
            let middle = at.min(WIDTH - HALF_DIGIT * text.chars().count() as f64);
            axes += &format!(
                "<path class=\"tick\" d=\"M{at:.1} {BOTTOM}v4\"/><text class=\"x\" x=\"{middle:.1}\" y=\"{:.0}\">{text}</text>",
                BOTTOM + 17.0,
            );
        }
        let (title, below) = (escape(title), escape(below));
        format!(
            "<figure class=\"plot\"><figcaption>{title} <small>{unit}</small></figcaption><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             role=\"img\" aria-label=\"{title}, in {unit}\">{axes}{marks}<text class=\"x\" x=\"{:.0}\" y=\"{:.0}\">{below}</text>\
             </svg></figure>\n",
            0.5 * (LEFT + RIGHT),
            BOTTOM + 33.0,
            unit = escape(&self.unit)
        )
    }
}

/// Of what the error of the plain model is made: one bar, and its parts in words.
pub fn budgets(budgets: &[Budget]) -> String {
    if budgets.is_empty() {
        return String::new();
    }
    let each: String = budgets.iter().map(budget).collect();
    format!("<h3>What the error of the plain model is made of</h3>\n<div class=\"budgets\">\n{each}</div>\n")
}

/// Share of the error below which what the contact of each touch leaves of it is told.
const BESIDE: f64 = 0.9;

fn budget(b: &Budget) -> String {
    let parts = [
        ("named", "named causes", b.named),
        ("doubtful", "a name less likely than not", b.doubtful),
        ("friction-law", "scatter from touch to touch", b.friction_law),
        ("geometry", "contact of each touch", b.geometry),
        ("timing", "timing and ringing", b.timing),
        ("noise", "noise of the sensors", b.noise),
        ("unexplained", "unexplained", b.unexplained),
    ];
    let bar: String = parts
        .iter()
        .filter(|p| p.2 > 0.0)
        .map(|(class, name, share)| {
            format!(
                "<i class=\"{class}\" style=\"width:{:.2}%\" title=\"{name} {:.1} %\"></i>",
                100.0 * share,
                100.0 * share
            )
        })
        .collect();
    // Only some have a name that is in doubt.
    let words: String = parts
        .iter()
        .filter(|p| p.0 != "doubtful" || p.2 > 0.0)
        .map(|(class, name, share)| format!("<li><i class=\"{class}\"></i>{name} <b>{:.1} %</b></li>", 100.0 * share))
        .collect();
    let told_from = if (0.0..BESIDE * b.rmse).contains(&b.beside_contact) && b.beside_contact > 0.0 {
        let left = escape(&quantity(b.beside_contact, &b.unit, 2.0));
        format!("; {left} beside the contact of each touch, from which causes are told")
    } else {
        String::new()
    };
    format!(
        "<div class=\"budget\"><p>{} {} rms over {}{}{told_from}</p><div class=\"stack\">{bar}</div><ul>{words}</ul></div>\n",
        escape(&b.quantity),
        escape(&quantity(b.rmse, &b.unit, 2.0)),
        super::markup::count(b.interactions.len(), "interaction", "interactions"),
        super::causes::aside(&b.of, None)
    )
}
