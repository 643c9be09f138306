//! What became of every part when a hand was at work.

use std::fmt;

use nalgebra::{Isometry3, Point3, Vector3};
use serde::Serialize;

use super::scene::Part;

/// A part stays where its centre of mass moves by less than this, m, and it turns by less than this, rad.
const STAYS: f64 = 2e-3;
const STAYS_TURN: f64 = 0.02;
/// A part comes along where it goes at least this share of the hand's way.
const ALONG: f64 = 0.5;

/// What a part did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The hand was on it.
    Handled,
    /// It went most of the hand's way.
    Along,
    /// It was moved, but not as the hand went.
    Moved,
    /// It stayed.
    Stayed,
}

/// What became of a part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartOutcome {
    /// The twin's name of the link.
    pub link: String,
    /// In a word.
    pub verdict: Verdict,
    /// How its centre of mass moved, m, world.
    pub moved: [f64; 3],
    /// By how much it turned, rad.
    pub turned: f64,
}

/// How far a joint was opened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Opened {
    /// The twin's name of the joint.
    pub joint: String,
    /// Furthest from the pose of the first view.
    pub furthest: f64,
    /// Where it was half a second after the hand had let go.
    pub left: f64,
    /// m or rad.
    pub unit: &'static str,
}

/// What became of the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Every part that has a shape.
    pub parts: Vec<PartOutcome>,
    /// The bonds that gave way.
    pub broken: Vec<[String; 2]>,
    /// Parts without a shape, which took no part.
    pub left_out: Vec<String>,
    /// Mean force of the finger or hand from its first touch on, N.
    pub mean_effort: Option<f64>,
    /// For `open:` alone.
    pub opened: Option<Opened>,
}

impl Outcome {
    /// The links that came along with the hand, those under it left out.
    pub fn along(&self) -> Vec<&str> {
        let along = self.parts.iter().filter(|p| p.verdict == Verdict::Along);
        along.map(|p| p.link.as_str()).collect()
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for part in &self.parts {
            let word = match part.verdict {
                Verdict::Handled => "in hand",
                Verdict::Along => "comes along",
                Verdict::Moved => "is moved",
                Verdict::Stayed => "stays",
            };
            let way = 1e3 * Vector3::from(part.moved).norm();
            writeln!(
                f,
                "{}: {word} ({way:.1} mm, {:.1} degrees)",
                part.link,
                part.turned.to_degrees()
            )?;
        }
        for [a, b] in &self.broken {
            writeln!(f, "{a} and {b}: their bond gives way")?;
        }
        for link in &self.left_out {
            writeln!(f, "{link}: left out, no shape of it was seen")?;
        }
        if let Some(o) = &self.opened {
            writeln!(
                f,
                "{}: opened to {:.4} {}, left at {:.4} {}",
                o.joint, o.furthest, o.unit, o.left, o.unit
            )?;
        }
        match self.along().as_slice() {
            [] => write!(f, "nothing comes along")?,
            names => write!(f, "comes along: {}", names.join(", "))?,
        }
        match self.mean_effort {
            Some(n) => write!(f, "; mean force of the hand {n:.2} N"),
            None => Ok(()),
        }
    }
}

/// Of a part between two poses; `way` is the hand's.
pub(super) fn part_outcome(
    part: &Part,
    [start, end]: [&Isometry3<f64>; 2],
    way: &Vector3<f64>,
    handled: bool,
) -> PartOutcome {
    let com = Point3::from(part.com);
    let moved = end * com - start * com;
    let turned = start.rotation.angle_to(&end.rotation);
    let far = moved.dot(way) >= ALONG * way.norm_squared();
    let verdict = if handled {
        Verdict::Handled
    } else if moved.norm() < STAYS && turned < STAYS_TURN {
        Verdict::Stayed
    } else if far && way.norm() > STAYS {
        Verdict::Along
    } else {
        Verdict::Moved
    };
    PartOutcome {
        link: part.link.clone(),
        verdict,
        moved: moved.into(),
        turned,
    }
}
