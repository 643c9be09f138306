//! Doubts that came up, and how the result was made.

use super::markup::{count, escape, section as framed, table};
use crate::base::{Notice, Severity};
use crate::export::{ExportNote, unsaid};
use crate::pipeline::Run;

/// Doubts, warnings first.
pub fn section(run: &Run) -> String {
    let notices = &run.model.twin.notices;
    let of = |severity: Severity| notices.iter().filter(move |n| n.severity == severity);
    let mut content = if notices.is_empty() {
        "<p class=\"muted\">No doubt came up.</p>\n".to_owned()
    } else {
        let items: String = of(Severity::Warning).chain(of(Severity::Note)).map(item).collect();
        format!("<ul class=\"notices\">\n{items}</ul>\n")
    };
    content.push_str(&unsaid_by_formats(run));
    content.push_str(&provenance(run));
    let lead = format!(
        "{} of something left out or assumed, {} good to know.",
        count(of(Severity::Warning).count(), "warning", "warnings"),
        count(of(Severity::Note).count(), "note", "notes")
    );
    framed("notices", "Notices", &lead, &content)
}

fn item(notice: &Notice) -> String {
    let (class, word) = match notice.severity {
        Severity::Warning => ("warning", "warning"),
        Severity::Note => ("note", "note"),
    };
    format!(
        "<li class=\"{class}\"><span class=\"tag\">{word}</span><span class=\"stage\">{}</span><span><strong>{}</strong> {}</span></li>\n",
        escape(&notice.stage),
        escape(&notice.about),
        escape(&notice.message)
    )
}

/// What the exported files cannot say, or take for granted, as it stands in each of them.
fn unsaid_by_formats(run: &Run) -> String {
    let notes = match unsaid(&run.model) {
        Ok(notes) => notes,
        Err(error) => {
            return format!(
                "<p class=\"muted\">No simulator takes it: {}</p>\n",
                escape(&error.to_string())
            );
        }
    };
    let format = |n: &ExportNote| {
        if n.format == "all" {
            "every format".to_owned()
        } else {
            n.format.to_uppercase()
        }
    };
    let row = |n: &ExportNote| {
        let (about, message) = (escape(&n.about), escape(&n.message));
        format!(
            "<tr><th scope=\"row\">{}</th><td>{about}</td><td>{message}</td></tr>\n",
            format(n)
        )
    };
    let rows: String = notes.iter().map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let table = table(
        "What the exports cannot say",
        "unsaid",
        &["Format", "Of", "What is lost or assumed"],
        &rows,
    );
    let summary = count(
        notes.len(),
        "thing that the exports lose or assume",
        "things that the exports lose or assume",
    );
    format!("<details class=\"unsaid\"><summary>{summary}</summary>\n{table}</details>\n")
}

fn provenance(run: &Run) -> String {
    let p = &run.model.twin.provenance;
    let options: String = p
        .options
        .iter()
        .map(|(name, value)| {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            format!("<dt>{}</dt><dd><code>{}</code></dd>\n", escape(name), escape(&text))
        })
        .collect();
    let followed = match p.tracks_from_images.len() {
        0 => String::new(),
        n => format!("<dt>tracks</dt><dd>{n} made from images, the others measured</dd>\n"),
    };
    format!(
        "<h3 id=\"provenance\">How this was made</h3>\n<dl class=\"provenance\">\n<dt>palpate</dt><dd>version {}</dd>\n\
         <dt>capture</dt><dd><code>SHA-256 {}</code></dd>\n<dt>seed</dt><dd>{}</dd>\n{followed}</dl>\n\
         <details class=\"options\"><summary>Effective options</summary>\n<dl class=\"provenance\">\n{options}</dl>\n</details>\n",
        escape(&p.version),
        escape(&p.capture_digest),
        p.seed
    )
}
