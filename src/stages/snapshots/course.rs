//! Searches that are put down after every evaluation and taken up again.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::search::Search;
use super::space::{DIMENSIONS, Prior, Space};
use crate::base::{Error, Result, Seed};

/// What a file of searches begins with.
const FORMAT: &str = "palpate-search/1";

/// The searches of a capture's things, as a file keeps them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Course {
    /// `palpate-search/1`.
    pub format: String,
    /// Digest of the capture.
    pub capture: String,
    /// The seed.
    pub seed: u64,
    /// By link.
    pub things: BTreeMap<String, Begun>,
}

/// One thing's search, and the priors on whose scale it moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Begun {
    /// Of the parameters, in their order.
    pub priors: [Prior; DIMENSIONS],
    /// What was evaluated.
    pub search: Search,
}

impl Course {
    /// From a file's text.
    pub fn from_json(text: &str) -> Result<Self> {
        let wrong = |e: String| Error::Usage(format!("the file of searches: {e}"));
        let read: Self = serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
        if read.format != FORMAT {
            return Err(wrong(format!("format {}, expected {FORMAT}", read.format)));
        }
        Ok(read)
    }

    /// As a file.
    pub fn to_json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Failed(format!("the file of searches: {e}")))
    }
}

/// What is done with the course after every evaluation.
type Keep = dyn Fn(&Course) -> Result<()> + Send + Sync;

/// Takes searches up where they were put down, and puts them down after every evaluation.
#[derive(Clone)]
pub struct Keeper {
    course: Arc<Mutex<Option<Course>>>,
    keep: Arc<Keep>,
}

impl fmt::Debug for Keeper {
    /// Neither what was begun nor how it is kept: the settings that are recorded beside a twin do not depend on either.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Keeper")
    }
}

impl Keeper {
    /// Goes on from `begun`, if anything was, and calls `keep` after every evaluation.
    pub fn new(begun: Option<Course>, keep: impl Fn(&Course) -> Result<()> + Send + Sync + 'static) -> Self {
        Self {
            course: Arc::new(Mutex::new(begun)),
            keep: Arc::new(keep),
        }
    }

    /// The search of a thing as it was put down, or `fresh`.
    ///
    /// # Errors
    /// Where what was begun is of another capture, seed or prior.
    pub(super) fn take_up(&self, of: &Of, fresh: Search) -> Result<Search> {
        let mut course = self.course.lock().unwrap_or_else(PoisonError::into_inner);
        let course = course.get_or_insert_with(|| Course {
            format: FORMAT.into(),
            capture: of.capture.into(),
            seed: of.seed.0,
            things: BTreeMap::new(),
        });
        let wrong = |what: &str| Error::Usage(format!("the file of searches: it was begun with another {what}"));
        if course.capture != of.capture {
            return Err(wrong("capture"));
        }
        if course.seed != of.seed.0 {
            return Err(wrong("seed"));
        }
        match course.things.get(of.thing) {
            Some(begun) if begun.priors != of.space.priors => Err(wrong(&format!("prior of `{}`", of.thing))),
            Some(begun) => Ok(begun.search.clone()),
            None => Ok(fresh),
        }
    }

    /// Puts a search down.
    pub(super) fn put_down(&self, of: &Of, search: &Search) -> Result<()> {
        let mut course = self.course.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(course) = course.as_mut() else { return Ok(()) };
        let begun = Begun {
            priors: of.space.priors,
            search: search.clone(),
        };
        course.things.insert(of.thing.into(), begun);
        (self.keep)(course)
    }
}

/// Whose search it is.
pub(super) struct Of<'a> {
    pub capture: &'a str,
    pub seed: Seed,
    pub thing: &'a str,
    pub space: &'a Space,
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::*;

    #[test]
    fn a_search_is_taken_up_by_its_own_capture_alone() {
        let space = Space::new(&Config::default(), None);
        let of = |capture, seed| Of {
            capture,
            seed: Seed(seed),
            thing: "mug",
            space: &space,
        };
        let kept = Arc::new(Mutex::new(String::new()));
        let into = Arc::clone(&kept);
        let keeper = Keeper::new(None, move |c| {
            *into.lock().expect("alone") = c.to_json()?;
            Ok(())
        });
        let mut search = keeper.take_up(&of("a", 1), Search::new(Seed(1), 4)).expect("fresh");
        let (at, by) = search.ask();
        search.tell(at, 0.5, by);
        keeper.put_down(&of("a", 1), &search).expect("kept");
        let text = kept.lock().expect("alone").clone();
        let again = || Keeper::new(Some(Course::from_json(&text).expect("reads")), |_| Ok(()));
        let fresh = || Search::new(Seed(1), 4);
        assert_eq!(again().take_up(&of("a", 1), fresh()).expect("the same"), search);
        for other in [of("b", 1), of("a", 2)] {
            assert!(again().take_up(&other, fresh()).is_err());
        }
    }
}
