//! Which touch next: the one from which most is expected to be learnt of mass, friction and centre of mass.

mod arc;
mod belief;
mod candidates;
mod expected;
mod lines;
mod thing;
mod verb;
mod words;

pub use arc::{ArcTouch, arc_touches};
pub use lines::{PushLine, push_lines};
pub use verb::{NextTouch, NextTouchConfig, TouchChoice, TouchDecision, Wanted};
