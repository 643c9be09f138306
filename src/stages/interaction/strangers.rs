//! Names in a recording that are those of nothing in the model: a slip of the pen makes every touch worthless, in silence.

use std::collections::BTreeMap;

use crate::base::Notices;
use crate::capture::Capture;
use crate::twin::Model;

/// Warns once of every target, and of every track, that is the name of no link or body.
pub fn warn_of_strangers(capture: &Capture, model: &Model, notices: &mut Notices) {
    let mut known: Vec<&str> = model.twin.links().map(|(_, l)| l.name.as_str()).collect();
    known.extend(model.twin.bodies.iter().map(|b| b.name.as_str()));
    let mut strange: BTreeMap<&str, (&str, usize)> = BTreeMap::new();
    for run in &capture.interactions {
        let target = run.target.as_deref().map(|t| (t, "what is touched"));
        let tracks = run.tracks.keys().map(|t| (t.as_str(), "a track"));
        for (name, what) in tracks.chain(target) {
            if !known.contains(&name) && !known.iter().any(|k| name.starts_with(&format!("{k}/"))) {
                strange.entry(name).or_insert((what, 0)).1 += 1;
            }
        }
    }
    for (name, (what, count)) in strange {
        let near = match nearest(name, &known) {
            Some(near) => format!("; the nearest name is {near}"),
            None => String::new(),
        };
        let message = format!("the name of {what} in {count} interactions, and of nothing in the model{near}");
        notices.warn("interaction", name, message);
    }
}

/// The name that differs least: by what stands before or behind a `/`, else by letters, half of which at most may differ.
fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let last = |n: &str| n.rsplit('/').next().unwrap_or_default().to_owned();
    if let Some(same) = known.iter().find(|k| last(k) == last(name)) {
        return Some(same);
    }
    let far = |k: &&&str| distance(k, name);
    let best = known.iter().min_by_key(far)?;
    (2 * distance(best, name) <= name.chars().count()).then_some(best)
}

/// Letters to put in, take out or change (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let change = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = change.min(corner + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_told_with_what_was_meant() {
        let known = ["slab", "case/box", "door"];
        assert_eq!(nearest("slabb", &known), Some("slab"));
        assert_eq!(nearest("box", &known), Some("case/box"));
        assert_eq!(nearest("cab/door", &known), Some("door"));
        assert_eq!(nearest("kettle", &known), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
