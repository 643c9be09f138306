//! What engines made of a capture's touches, as data and as a table.

use std::fmt;

use serde::Serialize;

use super::outside::EngineName;
use super::reason::Reason;

/// Bars: error of the final position over the travel, of the final turn, rad; drift, m, and turn, rad, at rest.
pub const SHARE: f64 = 0.10;
/// rad.
pub const TURN: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// What is nearer than this, m, is as measured however short the way.
const NEAR: f64 = 2e-4;
const DRIFT: f64 = 1e-3;
const SPIN: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// What all engines made of a capture.
#[derive(Clone, Debug, Serialize)]
pub struct EnginesReport {
    /// The capture's name.
    pub capture: String,
    /// Seconds of rest, of which the first half second is for settling.
    pub rest_seconds: f64,
    /// In the order in which they were asked for.
    pub engines: Vec<EngineReport>,
    /// Why held-out touches were missed, as far as replays tell.
    pub reasons: Vec<Reason>,
    /// Interactions that were not played, and why.
    pub skipped: Vec<Skipped>,
}

/// What one engine made of it.
#[derive(Clone, Debug, Serialize)]
pub struct EngineReport {
    /// Which.
    pub engine: EngineName,
    /// Its version; empty where it is not there.
    pub version: String,
    /// Why it gave no answer, where it gave none.
    pub silent: Option<String>,
    /// What the parts did while nothing touched them.
    pub rest: Vec<RestRow>,
    /// What it made of each touch.
    pub touches: Vec<TouchRow>,
}

/// A part at rest.
#[derive(Clone, Debug, Serialize)]
pub struct RestRow {
    /// As the exports name it.
    pub part: String,
    /// Way of the centre of mass in the first half second, m.
    pub settling: f64,
    /// Way after that, m.
    pub drift: f64,
    /// Turn after that, rad.
    pub turn: f64,
}

/// A touch in an engine beside what was measured.
#[derive(Clone, Debug, Serialize)]
pub struct TouchRow {
    /// The interaction.
    pub interaction: String,
    /// The link that is judged.
    pub link: String,
    /// Never used to fit.
    pub held_out: bool,
    /// How far its centre of mass was measured to go, m.
    pub travel: f64,
    /// How far it was measured to turn, rad; absent where no orientation was tracked.
    pub turned: Option<f64>,
    /// No friction against the tool was measured; a default stands for it.
    pub tool_friction_assumed: bool,
    /// By how much the tool's way was shifted along its heading, m, so that it touches when the measured force begins; absent
    /// where that was within a millimetre.
    pub tool_shifted: Option<f64>,
    /// It is a press, and this engine's contacts do not yield.
    pub rigid: bool,
    /// What the engine made of it, or why it could not be played.
    pub outcome: Outcome,
}

/// What an engine made of a touch.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// It was played.
    Played {
        /// The final centre of mass less where it was measured, m, world.
        missed_by: [f64; 3],
        /// Its length, m.
        position_error: f64,
        /// The same over the travel.
        relative_error: f64,
        /// Angle between the final orientation and the measured one, rad.
        turn_error: Option<f64>,
        /// From the measured final orientation to that in the engine, as a rotation vector, rad, world.
        turned_by: Option<[f64; 3]>,
        /// Root mean square difference of the tool's force over blocks of a quarter second in which the tool moves, N; absent
        /// where no force was measured, and where the tool holds the thing: a rigid grip fights a joint.
        force_rms: Option<f64>,
        /// Root mean square of the measured force over the same blocks, N.
        force_measured: Option<f64>,
    },
    /// A press was played: it is judged by its force.
    Pressed {
        /// Root mean square difference of the tool's force along the press, N, while it is pressed.
        force_rms: f64,
        /// Largest measured force, N.
        force_peak: f64,
        /// Force over depth while it is loaded, N/m: in the engine, and as measured.
        stiffness: Option<[f64; 2]>,
    },
    /// It was not; says why.
    NotPlayed(String),
}

/// An interaction that was not played.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// Its name.
    pub interaction: String,
    /// In words.
    pub why: String,
}

impl TouchRow {
    /// Whether the final pose is within a tenth of the travel and five degrees of what was measured; of a press, whether the
    /// force is within a tenth of the largest.
    pub fn within(&self) -> bool {
        match &self.outcome {
            Outcome::Played {
                position_error,
                relative_error,
                turn_error,
                ..
            } => (*relative_error <= SHARE || *position_error <= NEAR) && turn_error.is_none_or(|t| t <= TURN),
            Outcome::Pressed {
                force_rms, force_peak, ..
            } => *force_rms <= SHARE * force_peak,
            Outcome::NotPlayed(_) => false,
        }
    }
}

impl RestRow {
    /// Whether it stays within a millimetre and half a degree.
    pub fn is_calm(&self) -> bool {
        self.drift < DRIFT && self.turn < SPIN
    }
}

impl EngineReport {
    /// How many of the touches for which `which` holds are within the bars, and how many there are; presses in an engine
    /// whose contacts do not yield are none.
    pub fn count(&self, which: impl Fn(&TouchRow) -> bool) -> (usize, usize) {
        let mine: Vec<&TouchRow> = self.touches.iter().filter(|t| which(t) && !t.rigid).collect();
        (mine.iter().filter(|t| t.within()).count(), mine.len())
    }
}

impl TouchRow {
    /// How far it is missed, over the bars: place and turn taken together.
    fn far(&self) -> Option<f64> {
        let Outcome::Played {
            relative_error,
            turn_error,
            ..
        } = &self.outcome
        else {
            return None;
        };
        Some((relative_error / SHARE).hypot(turn_error.unwrap_or(0.0) / TURN))
    }
}

impl EngineReport {
    /// How many touches that the numbers were fitted to are missed as far as this one, and how many there are.
    pub fn fitted_as_far(&self, row: &TouchRow) -> [usize; 2] {
        let own = row.far().unwrap_or(f64::INFINITY);
        let fitted = self.touches.iter().filter(|t| !t.held_out && !t.rigid);
        let far: Vec<f64> = fitted.filter_map(TouchRow::far).collect();
        [far.iter().filter(|f| **f >= own).count(), far.len()]
    }
}

impl EnginesReport {
    /// Whether every engine that is there keeps all that is held out within the bars, and all at rest.
    pub fn passed(&self) -> bool {
        let there = self.engines.iter().filter(|e| e.silent.is_none());
        there.into_iter().all(|e| {
            let (within, all) = e.count(|t| t.held_out);
            within == all && e.rest.iter().all(RestRow::is_calm)
        })
    }
}

impl fmt::Display for EngineReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.engine.name();
        if let Some(why) = &self.silent {
            return writeln!(f, "{name}: {why}");
        }
        let version = if self.version.is_empty() {
            String::new()
        } else {
            format!(" {}", self.version)
        };
        writeln!(f, "{name}{version}")?;
        for t in &self.touches {
            writeln!(f, "  {t}")?;
        }
        let (within, held_out) = self.count(|t| t.held_out);
        let (all_within, all) = self.count(|_| true);
        writeln!(
            f,
            "  within 10 % and 5 degrees: {within} of {held_out} held out, {all_within} of {all} in all"
        )?;
        for r in &self.rest {
            let mark = if r.is_calm() { "" } else { "   RESTLESS" };
            let (settling, drift, turn) = (1e3 * r.settling, 1e3 * r.drift, r.turn.to_degrees());
            let part = &r.part;
            writeln!(
                f,
                "  at rest {part}: settles by {settling:.3} mm, drifts {drift:.3} mm and {turn:.3} degrees{mark}"
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for TouchRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = if self.held_out { "*" } else { " " };
        write!(
            f,
            "{mark} {} {}: goes {:.1} mm",
            self.interaction,
            self.link,
            1e3 * self.travel
        )?;
        if let Some(turned) = self.turned {
            write!(f, ", turns {:.1} degrees", turned.to_degrees())?;
        }
        if let Some(shift) = self.tool_shifted {
            write!(
                f,
                " (tool shifted by {:.1} mm to touch when the force begins)",
                1e3 * shift
            )?;
        }
        if self.tool_friction_assumed {
            write!(f, " (friction of the tool assumed)")?;
        }
        match &self.outcome {
            Outcome::NotPlayed(why) => write!(f, "; not played: {why}"),
            Outcome::Pressed {
                force_rms,
                force_peak,
                stiffness,
            } => {
                let share = 100.0 * force_rms / force_peak;
                write!(
                    f,
                    "; pressed with {force_peak:.2} N, force off by {force_rms:.2} N ({share:.1} %)"
                )?;
                if let Some([engine, measured]) = stiffness {
                    write!(f, ", {engine:.0} N/m for {measured:.0} N/m")?;
                }
                if self.within() { Ok(()) } else { write!(f, "   FAR") }
            }
            Outcome::Played {
                position_error,
                relative_error,
                turn_error,
                force_rms,
                force_measured,
                ..
            } => {
                write!(
                    f,
                    "; off by {:.2} mm ({:.1} %)",
                    1e3 * position_error,
                    100.0 * relative_error
                )?;
                if let Some(turn) = turn_error {
                    write!(f, ", {:.2} degrees", turn.to_degrees())?;
                }
                if let (Some(rms), Some(of)) = (force_rms, force_measured) {
                    write!(f, ", force {rms:.2} N of {of:.2} N")?;
                }
                if self.within() { Ok(()) } else { write!(f, "   FAR") }
            }
        }
    }
}

impl fmt::Display for EnginesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "touches of {} played in engines (* held out)", self.capture)?;
        for engine in &self.engines {
            write!(f, "{engine}")?;
        }
        for reason in &self.reasons {
            write!(f, "{reason}")?;
        }
        for s in &self.skipped {
            writeln!(f, "not played: {}: {}", s.interaction, s.why)?;
        }
        Ok(())
    }
}
