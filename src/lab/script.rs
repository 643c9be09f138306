//! The script of a scene: what is done to it. SI units, world coordinates at the first view.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The tool of an action.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "lowercase", deny_unknown_fields)]
pub enum ToolSpec {
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box, half extents.
    Box {
        /// m.
        half: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// m.
        radius: f64,
        /// m.
        half_height: f64,
    },
}

impl Default for ToolSpec {
    fn default() -> Self {
        Self::Sphere { radius: 0.008 }
    }
}

/// One thing that is done. Points and directions are world coordinates at the first view.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ActionSpec {
    /// The tool starts clear of the body, moves along `direction` through `at`, and stops.
    Push {
        /// Unique name.
        name: String,
        /// Part that is meant.
        target: String,
        /// A point on the path: where contact is aimed.
        at: [f64; 3],
        /// Direction of motion.
        direction: [f64; 3],
        /// Travel after the aimed contact, m.
        travel: f64,
        /// m/s.
        speed: f64,
        /// Tool.
        #[serde(default)]
        tool: ToolSpec,
        /// Coefficient of friction between tool and body.
        #[serde(default = "tool_friction")]
        tool_friction: f64,
        /// By how much the tool is turned about the vertical, rad: its own axes, in which its sensor may be wrong, turn with it.
        #[serde(default)]
        turned: f64,
        /// Move away at the end and wait, so that coasting shows.
        #[serde(default)]
        retreat: bool,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool holds the body (pivot if `pin`) at `at` and moves along `direction`, or, with `arc`, along a
    /// circle about the joint that the target hangs on.
    Pull {
        /// Unique name.
        name: String,
        /// Part that is held.
        target: String,
        /// Where it is held.
        at: [f64; 3],
        /// Direction of motion (at first).
        direction: [f64; 3],
        /// Travel, m (along the arc).
        travel: f64,
        /// m/s.
        speed: f64,
        /// Free pivot rather than a rigid grip.
        #[serde(default)]
        pin: bool,
        /// Force with which the hand presses down all the while, N.
        #[serde(default)]
        down: f64,
        /// Follow the joint of the target.
        #[serde(default)]
        arc: bool,
        /// Go back again afterwards.
        #[serde(default)]
        back: bool,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool comes from above at `at`, presses `depth` deep, holds, and goes.
    Press {
        /// Unique name.
        name: String,
        /// Part that is pressed.
        target: String,
        /// Point of contact on top.
        at: [f64; 3],
        /// m below the contact.
        depth: f64,
        /// m/s.
        speed: f64,
        /// Seconds of holding.
        #[serde(default = "one_second")]
        hold: f64,
        /// Tool.
        #[serde(default)]
        tool: ToolSpec,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool grips the body at `at`, raises it by `height`, waits, twists it, lowers it.
    Lift {
        /// Unique name.
        name: String,
        /// Part that is held.
        target: String,
        /// Where it is held.
        at: [f64; 3],
        /// m.
        height: f64,
        /// m/s.
        #[serde(default = "slow")]
        speed: f64,
        /// Seconds of waiting at the top.
        #[serde(default = "one_second")]
        hold: f64,
        /// Angle by which it is then twisted about the vertical, twice to and fro, rad.
        #[serde(default)]
        twist: f64,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The support turns about `axis` at `rate` until the body has slid `slide`, or `limit` is reached.
    Tilt {
        /// Unique name.
        name: String,
        /// Part that is watched; it alone stands on the support then.
        target: String,
        /// Horizontal axis.
        axis: [f64; 3],
        /// rad/s.
        rate: f64,
        /// rad.
        limit: f64,
        /// m.
        #[serde(default = "slide")]
        slide: f64,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// Nothing is done.
    Hold {
        /// Unique name.
        name: String,
        /// Seconds.
        seconds: f64,
    },
}

fn tool_friction() -> f64 {
    0.4
}
fn one_second() -> f64 {
    1.0
}
fn slow() -> f64 {
    0.05
}
fn slide() -> f64 {
    0.05
}
