//! Names that every simulator takes: letters, digits and underscores, each once.

use std::collections::BTreeSet;

/// Names that mean something else to a simulator or to the exports themselves.
const RESERVED: [&str; 3] = ["world", "support", "floor"];

/// Hands out names, each once.
#[derive(Default)]
pub(super) struct Names(BTreeSet<String>);

impl Names {
    /// `name` with every other character replaced, and a number behind it where it is taken.
    pub(super) fn take(&mut self, name: &str) -> String {
        let clean = sanitised(name);
        let mut candidate = clean.clone();
        let mut count = 1;
        while RESERVED.contains(&candidate.as_str()) || !self.0.insert(candidate.clone()) {
            count += 1;
            candidate = format!("{clean}_{count}");
        }
        candidate
    }
}

/// Letters, digits and underscores alone; never empty, never starting with a digit.
pub(super) fn sanitised(name: &str) -> String {
    let mut clean: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' })
        .collect();
    if clean.chars().next().is_none_or(|c| c.is_ascii_digit()) {
        clean.insert(0, '_');
    }
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_clean_and_unique() {
        let mut names = Names::default();
        assert_eq!(names.take("mug 1/lid"), "mug_1_lid");
        assert_eq!(names.take("mug-1/lid"), "mug_1_lid_2");
        assert_eq!(names.take("world"), "world_2");
        assert_eq!(names.take("3m"), "_3m");
    }
}
