//! The page as a whole: order of the sections, style and script.

use super::markup::escape;
use super::{diagnosis, engines, estimates, graph, header, interactions, joints, notices, scene, snapshots};
use crate::base::{Error, Result};
use crate::capture::Capture;
use crate::pipeline::Run;

const STYLE: &str = include_str!("assets/page.css");
const VIEWER: &str = include_str!("assets/viewer.js");

/// The page of a finished run: one HTML file that needs no network and no other file.
///
/// The same run gives the same bytes. Nothing is computed anew: every number is one of the run, in units
/// that suit its size.
///
/// # Errors
/// [`Error::Failed`] where the scene cannot be written as JSON.
pub fn render(capture: &Capture, run: &Run) -> Result<String> {
    let title = escape(&run.model.twin.name);
    let data = scene::data(capture, run).map_err(|e| Error::Failed(format!("report: the scene: {e}")))?;
    let mut body = header::section(capture, run);
    body.push_str(&diagnosis::section(run));
    body.push_str(&scene::section(run));
    body.push_str(&estimates::section(run));
    body.push_str(&joints::section(run));
    body.push_str(&graph::section(run));
    body.push_str(&snapshots::section(run));
    body.push_str(&interactions::section(capture, run));
    body.push_str(&engines::place());
    body.push_str(&notices::section(run));
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} – palpate</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <a class=\"skip\" href=\"#estimates\">Skip the scene</a>\n<main>\n{body}</main>\n\
         <script type=\"application/json\" id=\"scene-data\">{data}</script>\n<script>{VIEWER}</script>\n</body>\n</html>\n"
    ))
}
