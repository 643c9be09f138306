//! The folder of a capture: paths that cannot leave it, and a record of every byte that was read.

use std::path::{Component, Path, PathBuf};

use crate::base::{Digest, Error, Result, digest_of, read_bytes};

/// A capture folder that is there and holds a `capture.json`.
pub(super) struct Folder {
    root: PathBuf,
    canonical: PathBuf,
    /// The path of `capture.json`.
    pub json: PathBuf,
}

/// A path as some file names it, with the place where it stands, for messages.
#[derive(Clone)]
pub(super) struct Reference<'a> {
    /// The file that names the path.
    pub file: &'a Path,
    /// The key or row where it stands.
    pub place: String,
    /// The path, relative to the capture folder.
    pub relative: &'a str,
}

impl Reference<'_> {
    fn fault(&self, found: impl Into<String>, expected: &str) -> Error {
        Error::bad_input(self.file, self.place.clone(), found, expected)
    }
}

/// What was read, in the order of the file: name and digest of each piece.
#[derive(Default)]
pub(super) struct Seen(Vec<(String, String)>);

impl Seen {
    /// Records a piece.
    pub fn add(&mut self, name: &str, bytes: &[u8]) {
        self.0.push((name.to_owned(), digest_of(bytes)));
    }

    /// Appends what another reader saw.
    pub fn append(&mut self, other: Seen) {
        self.0.extend(other.0);
    }

    /// One digest over all pieces and their names.
    pub fn hex(&self) -> String {
        let mut digest = Digest::default();
        for (name, piece) in &self.0 {
            digest.add(name, piece.as_bytes());
        }
        digest.hex()
    }
}

impl Folder {
    /// Finds the folder and its `capture.json`.
    pub fn open(root: &Path) -> Result<Self> {
        let expected = "a folder that holds a capture.json";
        if !root.is_dir() {
            let found = if root.exists() { "a file" } else { "no such folder" };
            return Err(Error::bad_input(root, "the capture", found, expected));
        }
        let json = root.join("capture.json");
        if !json.is_file() {
            return Err(Error::bad_input(&json, "the file", "no such file", expected));
        }
        let canonical = root.canonicalize().map_err(|source| Error::io(root, source))?;
        Ok(Self {
            root: root.to_path_buf(),
            canonical,
            json,
        })
    }

    /// The folder as the caller named it.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A reference that stands in `capture.json` under `key`.
    pub fn key<'a>(&'a self, key: impl Into<String>, relative: &'a str) -> Reference<'a> {
        Reference {
            file: &self.json,
            place: key.into(),
            relative,
        }
    }

    /// The path that `reference` names, whether or not something is there. It may not leave the folder.
    pub fn path(&self, reference: &Reference) -> Result<PathBuf> {
        let expected = "a path inside the capture folder";
        let relative = Path::new(reference.relative);
        let named = || format!("`{}`", reference.relative.escape_debug());
        let inside = |c: Component| matches!(c, Component::Normal(_) | Component::CurDir);
        if relative.as_os_str().is_empty() || reference.relative.contains('\0') {
            return Err(reference.fault(named(), expected));
        }
        if !relative.components().all(inside) {
            return Err(reference.fault(format!("{}, which leaves the folder", named()), expected));
        }
        let path = self.root.join(relative);
        match path.canonicalize() {
            Ok(real) if !real.starts_with(&self.canonical) => {
                Err(reference.fault(format!("{}, a link out of the folder", named()), expected))
            }
            _ => Ok(path),
        }
    }

    /// The path of the file that `reference` names; the file must be there.
    pub fn file(&self, reference: &Reference) -> Result<PathBuf> {
        let path = self.path(reference)?;
        if path.is_file() {
            return Ok(path);
        }
        let what = if path.is_dir() {
            "which is a folder"
        } else {
            "but there is no such file"
        };
        Err(reference.fault(
            format!("`{}`, {what}", reference.relative.escape_debug()),
            "the name of a file that is there",
        ))
    }

    /// The bytes of the file that `reference` names.
    pub fn bytes(&self, reference: &Reference, seen: &mut Seen) -> Result<(PathBuf, Vec<u8>)> {
        let path = self.file(reference)?;
        let bytes = read_bytes(&path)
            .map_err(|error| reference.fault(format!("a file that cannot be read ({error})"), "a readable file"))?;
        seen.add(reference.relative, &bytes);
        Ok((path, bytes))
    }
}
