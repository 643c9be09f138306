//! The one error type: what went wrong, where, what was found and what was expected.

use std::path::{Path, PathBuf};

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can go wrong, sorted by what the caller must do about it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input file says something that cannot be accepted (exit code 2).
    #[error("{}: {place}: found {found}, expected {expected}", file.display())]
    BadInput {
        /// The file that is at fault.
        file: PathBuf,
        /// The key, row or pixel inside the file.
        place: String,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },
    /// The call itself is wrong (exit code 2).
    #[error("{0}")]
    Usage(String),
    /// A file could not be read or written (exit code 1).
    #[error("{}: {source}", file.display())]
    Io {
        /// The file that was touched.
        file: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The input is sound, but the work could not be done (exit code 1).
    #[error("{0}")]
    Failed(String),
}

impl Error {
    /// An input file is at fault: names the file, the place, what was found and what was expected.
    pub fn bad_input(
        file: impl AsRef<Path>,
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::BadInput {
            file: file.as_ref().to_path_buf(),
            place: place.into(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Wraps an operating-system error with the file that it is about.
    pub fn io(file: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io {
            file: file.as_ref().to_path_buf(),
            source,
        }
    }

    /// The process exit code: 1 it could not be done, 2 bad usage or bad input.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::BadInput { .. } | Self::Usage(_) => 2,
            Self::Io { .. } | Self::Failed(_) => 1,
        }
    }
}

/// The known name nearest to `unknown` by edit distance, for "did you mean" in messages.
pub fn nearest_name<'a>(unknown: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (edit_distance(unknown, name), name))
        .min()
        .map(|(_, name)| name)
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_known_name_is_offered() {
        assert_eq!(nearest_name("gravty", ["gravity", "support"]), Some("gravity"));
        assert_eq!(nearest_name("x", []), None);
    }

    #[test]
    fn bad_input_exits_with_two_and_names_everything() {
        let error = Error::bad_input("a/capture.json", "cameras[0].fx", "-3", "a positive number");
        assert_eq!(error.exit_code(), 2);
        assert_eq!(
            error.to_string(),
            "a/capture.json: cameras[0].fx: found -3, expected a positive number"
        );
    }
}
