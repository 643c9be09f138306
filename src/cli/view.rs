//! `palpate view`: the report on loopback.

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Component, Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use super::arguments::Common;
use super::output;
use crate::base::{Error, Result, read_bytes};

/// Serves the twin's folder on 127.0.0.1 until it is interrupted.
pub fn view(common: &Common, twin: &Path, port: u16, open: bool) -> Result<ExitCode> {
    let page = twin.join("report.html");
    if !page.is_file() {
        return Err(Error::Usage(format!(
            "{}: there is no report.html in it",
            twin.display()
        )));
    }
    let listener =
        TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|e| Error::Failed(format!("127.0.0.1:{port}: {e}")))?;
    let address = listener.local_addr().map_err(|e| Error::Failed(e.to_string()))?;
    let url = format!("http://{address}/report.html");
    output::result(
        common,
        &format!("{url}  (Ctrl-C ends)"),
        &serde_json::json!({ "url": url }),
    )?;
    if open {
        open_browser(&url);
    }
    for stream in listener.incoming().flatten() {
        // A visitor that goes away in the middle is no reason to stop serving.
        let _ = answer(stream, twin);
    }
    Ok(ExitCode::SUCCESS)
}

fn open_browser(url: &str) {
    for program in ["xdg-open", "open"] {
        if Command::new(program)
            .arg(url)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .is_ok()
        {
            return;
        }
    }
}

fn answer(mut stream: TcpStream, root: &Path) -> std::io::Result<()> {
    let mut request = String::new();
    BufReader::new(&stream).read_line(&mut request)?;
    let target = request.split_whitespace().nth(1).unwrap_or("/");
    let found = local_path(root, target).and_then(|p| read_bytes(&p).ok().map(|bytes| (media_type(&p), bytes)));
    let (status, kind, body) = match found {
        Some((kind, body)) => ("200 OK", kind, body),
        None => ("404 Not Found", "text/plain", b"not found\n".to_vec()),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(&body)
}

/// The file below `root` that is asked for; nothing for a path that leaves it.
fn local_path(root: &Path, target: &str) -> Option<PathBuf> {
    let asked = target.split(['?', '#']).next()?.trim_start_matches('/');
    let asked = Path::new(if asked.is_empty() { "report.html" } else { asked });
    asked
        .components()
        .all(|c| matches!(c, Component::Normal(_)))
        .then(|| root.join(asked))
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("json") => "application/json",
        Some("glb") => "model/gltf-binary",
        Some("png") => "image/png",
        Some("urdf" | "xml") => "application/xml",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_leaves_the_folder_is_not_served() {
        let root = Path::new("/twin");
        assert_eq!(local_path(root, "/"), Some(root.join("report.html")));
        assert_eq!(local_path(root, "/meshes/a.obj?x=1"), Some(root.join("meshes/a.obj")));
        assert_eq!(local_path(root, "/../secret"), None);
        assert_eq!(local_path(root, "//etc/passwd"), Some(root.join("etc/passwd")));
    }
}
