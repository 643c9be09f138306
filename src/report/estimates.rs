//! What is held of the matter and the shape of every link.

use super::markup::{count, escape, section as framed, table};
use super::numbers::{fixed, quantity};
use super::rows::{COLUMNS, cell, list, scalar};
use crate::pipeline::Run;
use crate::twin::{Body, Link, Twin};

/// More links than this, and the cards start folded below the overview.
const MOST_OPEN: usize = 4;

/// An overview, then a card per body with a table per link.
pub fn section(run: &Run) -> String {
    let twin = &run.model.twin;
    let open = twin.links().count() <= MOST_OPEN;
    let cards: String = twin.bodies.iter().enumerate().map(|(i, b)| body(i, b, open)).collect();
    let lead = "Each number with one standard deviation and the interval that holds it at 95 %. \
        <span class=\"badge measured\">measured</span> these data fix it; \
        <span class=\"badge assumed\">assumed</span> a prior or a default, the data say little or nothing about it; \
        <span class=\"badge known\">known</span> given in the capture.";
    framed(
        "estimates",
        "Estimates",
        lead,
        &format!("{}<div class=\"cards\">\n{cards}</div>\n", overview(twin)),
    )
}

/// What matters most of every link, a row each.
fn overview(twin: &Twin) -> String {
    let row = |number: usize, l: &Link| {
        format!(
            "<tr><th scope=\"row\"><a href=\"#body-{number}\">{}</a></th>{}{}{}{}{}</tr>\n",
            escape(&l.name),
            cell(l.mass.as_ref()),
            cell(l.friction_force.kinetic.as_ref()),
            cell(l.friction.static_.as_ref()),
            cell(l.friction.kinetic.as_ref()),
            cell(l.stiffness.as_ref()),
        )
    };
    let each = twin.bodies.iter().enumerate();
    let rows: String = each.flat_map(|(i, b)| b.links.iter().map(move |l| row(i, l))).collect();
    let head = [
        "Part",
        "Mass",
        "Force of friction",
        "Static coefficient",
        "Kinetic coefficient",
        "Stiffness",
    ];
    format!(
        "<div class=\"card\">{}</div>\n",
        table("Overview of estimates", "overview", &head, &rows)
    )
}

fn body(number: usize, body: &Body, open: bool) -> String {
    let links: String = body.links.iter().map(|l| link(l, body.links.len() > 1)).collect();
    let parts = if body.links.len() > 1 {
        format!(" <small>{}</small>", count(body.links.len(), "part", "parts"))
    } else {
        String::new()
    };
    format!(
        "<details class=\"card fold\"{}>\n<summary><h3>{}{parts}</h3></summary>\n<div id=\"body-{number}\">{links}</div>\n</details>\n",
        if open { " open" } else { "" },
        escape(&body.name)
    )
}

fn link(link: &Link, named: bool) -> String {
    let name = if named {
        format!("<h4>{}</h4>\n", escape(&link.name))
    } else {
        String::new()
    };
    let rows = rows(link);
    let matter = if rows.is_empty() {
        "<p class=\"muted\">No interaction told of its matter: nothing is claimed of its mass or friction.</p>\n"
            .to_owned()
    } else {
        table(&format!("Estimates of {}", link.name), "estimates", &COLUMNS, &rows)
    };
    format!("{name}<p class=\"shape\">{}</p>\n{matter}", shape(link))
}

/// The shape in words.
fn shape(link: &Link) -> String {
    if link.mesh.is_none() {
        return "Nobody saw its shape.".to_owned();
    }
    let mut said = Vec::new();
    if let Some(seen) = link.seen {
        let rest = match &link.surface {
            Some(s) if s.mirrored > 0.0 => format!(
                "{} % is mirrored, {} % closed",
                fixed(100.0 * s.mirrored, 0),
                fixed(100.0 * s.closed, 0)
            ),
            Some(_) => "the rest is closed".to_owned(),
            None => "the rest is closed or mirrored".to_owned(),
        };
        said.push(format!("{} % of its surface was seen, {rest}", fixed(100.0 * seen, 0)));
    }
    if let Some(s) = &link.superquadric {
        let size: Vec<String> = s.size.iter().map(|h| fixed(2e3 * h, 0)).collect();
        let [e1, e2] = s.exponents;
        let near = if e1 < 0.5 && e2 < 0.5 {
            "much like a box"
        } else if e1 < 0.5 {
            "much like a cylinder"
        } else {
            "rounded"
        };
        let within = s.residual.map_or_else(String::new, |r| {
            format!(
                " (superquadric, exponents {} and {}, {} mm rms)",
                fixed(e1, 2),
                fixed(e2, 2),
                fixed(1e3 * r, 1)
            )
        });
        said.push(format!("{} mm, {near}{within}", size.join(" × ")));
    }
    if let Some(best) = link.symmetry.first() {
        let planes = count(link.symmetry.len(), "plane of symmetry", "planes of symmetry");
        said.push(format!("{planes} (best {} %)", fixed(100.0 * best.score, 1)));
    }
    if link.symmetry_center.is_some() {
        said.push("a ball".into());
    } else if let Some(axis) = link.axes.first() {
        said.push(match axis.fold {
            0 => "turned about an axis".into(),
            n => format!("{n}-fold axis"),
        });
    }
    if !link.collision.is_empty() {
        said.push(count(link.collision.len(), "convex part", "convex parts"));
    }
    escape(&said.join(" · "))
}

fn rows(link: &Link) -> String {
    let mut out = String::new();
    let mut add = |name: &str, e: &Option<crate::base::Estimate>| {
        if let Some(e) = e {
            out.push_str(&scalar(name, e));
        }
    };
    add("Mass", &link.mass);
    add("Force of friction, static", &link.friction_force.static_);
    add("Force of friction, kinetic", &link.friction_force.kinetic);
    add("Coefficient of friction, static", &link.friction.static_);
    add("Coefficient of friction, kinetic", &link.friction.kinetic);
    add("Coefficient of friction, tool", &link.friction.tool);
    add("Torsional radius of friction", &link.friction.torsional_radius);
    add("Creep below", &link.friction.creep_speed);
    add("Creep below, over the tool's speed", &link.friction.creep_ratio);
    add("Rolling resistance", &link.friction.rolling);
    add("Restitution", &link.restitution);
    add("Stiffness where pressed", &link.stiffness);
    add("Damping where pressed", &link.damping);
    if let Some(com) = &link.com {
        out.push_str(&list("Centre of mass", ["x", "y", "z"], com));
    }
    if let Some(inertia) = &link.inertia {
        out.push_str(&list("Inertia about it", ["xx", "yy", "zz", "xy", "xz", "yz"], inertia));
    }
    out
}

/// A range in the unit that suits it.
pub fn range(range: [f64; 2], unit: &str) -> String {
    format!("{} … {}", quantity(range[0], unit, 3.0), quantity(range[1], unit, 3.0))
}
