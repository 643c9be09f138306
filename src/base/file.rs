//! Reading and writing whole files, and folders that appear whole or not at all.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::{Error, Result};

/// The bytes of an input file, or an error that names it.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).map_err(|source| unreadable(path, "a file", source))
}

/// The text of an input file, or an error that names it.
pub fn read_text(path: &Path) -> Result<String> {
    fs::read_to_string(path).map_err(|source| unreadable(path, "a file of UTF-8 text", source))
}

/// An input that is not there, or is no such file, is the caller's mistake; a disk that fails is not.
fn unreadable(path: &Path, expected: &str, source: std::io::Error) -> Error {
    let found = match source.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => "nothing",
        ErrorKind::IsADirectory => "a folder",
        ErrorKind::InvalidData => "bytes that are no UTF-8",
        _ => return Error::io(path, source),
    };
    Error::bad_input(path, "the file", found, expected)
}

/// Writes a file beside its place and renames it, so that no reader ever sees half of it.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let parent = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(|source| Error::io(parent, source))?;
    let name = path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let beside = parent.join(format!(".{name}.{}.part", std::process::id()));
    fs::write(&beside, bytes).map_err(|source| Error::io(&beside, source))?;
    fs::rename(&beside, path).map_err(|source| Error::io(path, source))
}

/// A folder that is built beside its place and takes it only when it is finished.
///
/// Dropped before [`StagedFolder::commit`], it leaves nothing behind and an older result untouched.
pub struct StagedFolder {
    target: PathBuf,
    staging: PathBuf,
    committed: bool,
}

impl StagedFolder {
    /// Starts a new, empty folder beside `target`.
    ///
    /// A folder that is already there is replaced only where it is empty or holds the file `marker`,
    /// the sign of an older result: nothing of the user's is ever swept away by a mistyped path.
    pub fn create(target: &Path, marker: &str) -> Result<Self> {
        let parent = target
            .parent()
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let name = target
            .file_name()
            .ok_or_else(|| Error::Usage(format!("{}: not a folder that can be written", target.display())))?
            .to_string_lossy()
            .into_owned();
        if target.exists() && !target.is_dir() {
            return Err(Error::Usage(format!(
                "{}: there is a file of that name; an output folder was expected",
                target.display()
            )));
        }
        refuse_foreign(target, marker)?;
        fs::create_dir_all(parent).map_err(|source| Error::io(parent, source))?;
        let staging = parent.join(format!(".{name}.{}.part", std::process::id()));
        if staging.exists() {
            fs::remove_dir_all(&staging).map_err(|source| Error::io(&staging, source))?;
        }
        fs::create_dir(&staging).map_err(|source| Error::io(&staging, source))?;
        Ok(Self {
            target: target.to_path_buf(),
            staging,
            committed: false,
        })
    }

    /// Where to write until the folder is committed.
    pub fn path(&self) -> &Path {
        &self.staging
    }

    /// Writes one file of the folder, making the folders above it.
    pub fn write(&self, relative: &str, bytes: &[u8]) -> Result<()> {
        let path = self.staging.join(relative);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(|source| Error::io(parent, source))?;
        }
        fs::write(&path, bytes).map_err(|source| Error::io(&path, source))
    }

    /// Puts the folder in its place; an older one of that name is replaced as a whole.
    pub fn commit(mut self) -> Result<()> {
        let old = self.staging.with_extension("old");
        let replaced = self.target.exists();
        if replaced {
            fs::rename(&self.target, &old).map_err(|source| Error::io(&self.target, source))?;
        }
        if let Err(source) = fs::rename(&self.staging, &self.target) {
            if replaced {
                let _ = fs::rename(&old, &self.target);
            }
            return Err(Error::io(&self.target, source));
        }
        self.committed = true;
        if replaced {
            let _ = fs::remove_dir_all(&old);
        }
        Ok(())
    }
}

fn refuse_foreign(target: &Path, marker: &str) -> Result<()> {
    let Ok(mut entries) = fs::read_dir(target) else {
        return Ok(());
    };
    if entries.next().is_none() || target.join(marker).is_file() {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}: the folder holds something else (no {marker} in it) and will not be replaced; name a new folder",
        target.display()
    )))
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        if !self.committed {
            let _ = fs::remove_dir_all(&self.staging);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_dropped_before_commit_leaves_the_old_one_whole() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let target = dir.path().join("out");
        let first = StagedFolder::create(&target, "a/b.txt").expect("staged");
        first.write("a/b.txt", b"one").expect("written");
        first.commit().expect("committed");
        let second = StagedFolder::create(&target, "a/b.txt").expect("staged");
        second.write("a/b.txt", b"two").expect("written");
        drop(second);
        assert_eq!(fs::read(target.join("a/b.txt")).expect("kept"), b"one");
        assert_eq!(fs::read_dir(dir.path()).expect("listed").count(), 1);
    }
}
