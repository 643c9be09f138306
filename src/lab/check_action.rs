//! What an action of a scene must be before it is performed.

use super::check::Checker;
use super::{ActionSpec, ToolSpec};
use crate::base::Result;

impl ActionSpec {
    /// The unique name of the action.
    pub fn name(&self) -> &str {
        match self {
            Self::Push { name, .. }
            | Self::Pull { name, .. }
            | Self::Press { name, .. }
            | Self::Lift { name, .. }
            | Self::Tilt { name, .. }
            | Self::Hold { name, .. } => name,
        }
    }

    /// The body that is meant; none for a hold.
    pub fn target(&self) -> Option<&str> {
        match self {
            Self::Push { target, .. }
            | Self::Pull { target, .. }
            | Self::Press { target, .. }
            | Self::Lift { target, .. }
            | Self::Tilt { target, .. } => Some(target),
            Self::Hold { .. } => None,
        }
    }

    /// Numbers that must be positive, with their keys.
    fn positive(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Push { travel, speed, .. } | Self::Pull { travel, speed, .. } => {
                vec![("travel", *travel), ("speed", *speed)]
            }
            Self::Press { depth, speed, .. } => vec![("depth", *depth), ("speed", *speed)],
            Self::Lift { height, speed, .. } => vec![("height", *height), ("speed", *speed)],
            Self::Tilt { rate, limit, slide, .. } => vec![("rate", *rate), ("limit", *limit), ("slide", *slide)],
            Self::Hold { seconds, .. } => vec![("seconds", *seconds)],
        }
    }

    /// The point that is touched or held.
    fn at(&self) -> Option<[f64; 3]> {
        match self {
            Self::Push { at, .. } | Self::Pull { at, .. } | Self::Press { at, .. } | Self::Lift { at, .. } => Some(*at),
            Self::Tilt { .. } | Self::Hold { .. } => None,
        }
    }
}

impl Checker<'_> {
    pub(super) fn action(&self, place: &str, action: &ActionSpec) -> Result<()> {
        if let Some(target) = action.target() {
            self.known(&format!("{place}.target"), target)?;
        }
        for (key, value) in action.positive() {
            self.positive(&format!("{place}.{key}"), value)?;
        }
        if let Some(at) = action.at() {
            self.finite(&format!("{place}.at"), at)?;
        }
        match action {
            ActionSpec::Push {
                direction,
                tool,
                tool_friction,
                ..
            } => {
                self.direction(&format!("{place}.direction"), *direction)?;
                self.not_negative(&format!("{place}.tool_friction"), *tool_friction)?;
                self.tool(&format!("{place}.tool"), tool)
            }
            ActionSpec::Pull { direction, down, .. } => {
                self.not_negative(&format!("{place}.down"), *down)?;
                self.direction(&format!("{place}.direction"), *direction)
            }
            ActionSpec::Press { tool, hold, .. } => {
                self.not_negative(&format!("{place}.hold"), *hold)?;
                self.tool(&format!("{place}.tool"), tool)
            }
            ActionSpec::Lift { hold, twist, .. } => {
                self.not_negative(&format!("{place}.twist"), *twist)?;
                self.not_negative(&format!("{place}.hold"), *hold)
            }
            ActionSpec::Tilt { axis, limit, .. } => {
                self.direction(&format!("{place}.axis"), *axis)?;
                if axis[2].abs() > 1e-9 || *limit > 1.4 {
                    let found = format!("axis {axis:?}, limit {limit}");
                    return self.refuse(place, found, "a horizontal axis and a limit up to 1.4 rad");
                }
                Ok(())
            }
            ActionSpec::Hold { .. } => Ok(()),
        }
    }

    fn tool(&self, place: &str, tool: &ToolSpec) -> Result<()> {
        match tool {
            ToolSpec::Sphere { radius } => self.positive(&format!("{place}.radius"), *radius),
            ToolSpec::Box { half } => half
                .iter()
                .try_for_each(|h| self.positive(&format!("{place}.half"), *h)),
            ToolSpec::Cylinder { radius, half_height } => {
                self.positive(&format!("{place}.radius"), *radius)?;
                self.positive(&format!("{place}.half_height"), *half_height)
            }
        }
    }
}
