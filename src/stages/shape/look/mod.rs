//! Where to look next: a belief of the workspace, what may be expected in it, and the pose that should show most of that.

mod belief;
mod expect;
mod foresee;
mod next_view;
mod slope;

pub use expect::Gain;
pub use next_view::{Decision, NextView, NextViewConfig, ViewChoice};
