//! Why a held-out touch ends elsewhere in an engine than it was measured to, as data and in words.

use std::fmt;

use serde::Serialize;

use super::outside::EngineName;
use crate::base::Status;

/// Shares of a miss below this are not told, nor more than so many.
const WORTH: f64 = 0.1;
const MOST: usize = 3;

/// What was found about a held-out touch that some engine misses.
#[derive(Clone, Debug, Serialize)]
pub struct Reason {
    /// The interaction.
    pub interaction: String,
    /// What the end depends on and is known only so well, the strongest first.
    pub sources: Vec<Source>,
    /// Standard deviation of the end by all of them together: of the place, m, and of the turn, rad.
    pub scatter: [f64; 2],
    /// Covariance of the place by all of them together, world: xx, xy, yy, m².
    pub spread: [f64; 3],
    /// For each engine that misses.
    pub judged: Vec<Judged>,
}

/// Something that the end of a touch depends on.
#[derive(Clone, Debug, Serialize)]
pub struct Source {
    /// In words.
    pub what: String,
    /// Whether it was measured; a tool's place and a default are assumed.
    pub status: Status,
    /// Its standard deviation, where it is one length or one ratio, in words.
    pub doubt: String,
    /// How far the end goes at one standard deviation, m, by replay in the embedded engine.
    pub position: f64,
    /// The same for its turn, rad.
    pub turn: f64,
}

/// An engine's miss beside what is doubtful.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Which engine.
    pub engine: EngineName,
    /// Where it ends less where it was measured to, m, world.
    pub missed_by: [f64; 3],
    /// The same for the turn, rad.
    pub turn: f64,
    /// The miss over what is doubtful, squared (Mahalanobis); within [`Judged::bound`] 95 of 100 would be.
    pub distance2: f64,
    /// Of the chi-squared distribution.
    pub bound: f64,
    /// The most likely doubtful numbers that meet the measured end: index into [`Reason::sources`], standard deviations,
    /// share of the miss that goes with it.
    pub likely: Vec<(usize, f64, f64)>,
    /// What is left of the miss when the touch is played again with them: m, rad.
    pub left: Option<[f64; 2]>,
    /// With them it is within the bars.
    pub mended: bool,
    /// What it comes to.
    pub cause: Cause,
    /// The same in words.
    pub words: String,
}

/// Where the reason of a miss lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// What is doubtful scatters the touch as far.
    Doubt,
    /// Another engine with the same numbers is within the bars, or within what is doubtful: this one's contacts differ.
    Engine,
    /// By the measured poses it turned about a place of its own that the twin does not know of.
    Pivot,
    /// palpate's own laws miss as far: the diagnosis says that something is left.
    Law,
    /// The engine misses touches as far that the numbers were fitted to: they do not hold all of them at once.
    Fitted,
    /// None of these.
    Unexplained,
}

impl Cause {
    /// A heading.
    pub fn name(self) -> &'static str {
        match self {
            Self::Doubt => "known no better",
            Self::Engine => "this engine's contacts",
            Self::Pivot => "turns about a place that the twin does not know of",
            Self::Law => "no law for it yet",
            Self::Fitted => "no farther than fitted touches",
            Self::Unexplained => "not explained",
        }
    }

    /// What it comes to for who reads it.
    pub fn means(self) -> &'static str {
        match self {
            Self::Doubt => {
                "What is doubtful about the touch and the twin moves its end as far as it was missed: this capture cannot tell \
                 whether a number is off or the engine. What would tell most is listed at each touch."
            }
            Self::Engine => {
                "Another engine with the same numbers comes near, or as near as is known: this one makes something else of the same contacts."
            }
            Self::Pivot => {
                "By the measured poses the thing turned about one place of itself, as it did in other pushes; the twin spreads its \
                 weight over the face and knows of no such place."
            }
            Self::Law => {
                "palpate's own laws of motion miss held-out touches as far: something is at work for which it has no law."
            }
            Self::Fitted => {
                "The engine misses touches as far that the numbers were fitted to: no one set of numbers holds them all."
            }
            Self::Unexplained => "None of these: farther off than all that is doubtful, and not understood.",
        }
    }
}

/// What is not explained in one engine while another one's miss of the same touch, with the same numbers, is within what is
/// doubtful: beyond doubt is only what the first makes of contacts otherwise.
pub(super) fn beside_each_other(judged: &mut [Judged]) {
    let within = judged.iter().filter(|j| j.cause == Cause::Doubt);
    let Some(other) = within.min_by(|a, b| a.distance2.total_cmp(&b.distance2)) else {
        return;
    };
    let other = format!(
        "{} with the same numbers misses it too, by no more than is doubtful about it ({:.1} sd)",
        other.engine.name(),
        other.distance2.sqrt()
    );
    for j in judged.iter_mut().filter(|j| j.cause == Cause::Unexplained) {
        j.cause = Cause::Engine;
        j.words = format!("{other}; {}", j.words);
    }
}

impl Judged {
    /// What most of it goes with, most first, in words; nothing where it is told by what was measured.
    pub fn shares(&self, sources: &[Source]) -> Vec<String> {
        if self.cause == Cause::Pivot {
            return Vec::new();
        }
        let named = self.likely.iter().filter(|(_, _, share)| *share >= WORTH).take(MOST);
        let said = named.filter_map(|(k, z, share)| {
            let source = sources.get(*k)?;
            Some(format!(
                "{}, {:.1} sd off ({}): {:.0} % of the miss",
                source.what,
                z.abs(),
                source.doubt,
                100.0 * share
            ))
        });
        said.collect()
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (place, turn) = (1e3 * self.scatter[0], self.scatter[1].to_degrees());
        let name = &self.interaction;
        writeln!(
            f,
            "why {name} is missed: what is doubtful scatters it by {place:.2} mm and {turn:.2} degrees (1 sd)"
        )?;
        for j in &self.judged {
            writeln!(f, "  {}: {}: {}", j.engine.name(), j.cause.name(), j.words)?;
            for said in j.shares(&self.sources) {
                writeln!(f, "    {said}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(engine: EngineName, distance2: f64, cause: Cause) -> Judged {
        Judged {
            engine,
            missed_by: [1e-3, 0.0, 0.0],
            turn: 0.0,
            distance2,
            bound: 9.49,
            likely: Vec::new(),
            left: None,
            mended: false,
            cause,
            words: "far".into(),
        }
    }

    #[test]
    fn what_another_engine_misses_within_doubt_is_this_ones_own_and_else_stays_unexplained() {
        let rapier = judged(EngineName::Rapier, 16.0, Cause::Unexplained);
        let mut both = [rapier.clone(), judged(EngineName::Mujoco, 2.6, Cause::Doubt)];
        beside_each_other(&mut both);
        assert_eq!(both[0].cause, Cause::Engine);
        assert!(both[0].words.starts_with("mujoco"), "{}", both[0].words);
        let mut both = [rapier, judged(EngineName::Mujoco, 12.0, Cause::Unexplained)];
        beside_each_other(&mut both);
        assert_eq!(both.map(|j| j.cause), [Cause::Unexplained; 2]);
    }
}
