//! Forward models: from a twin and an action to what every sensor would see. No capture: a simulator
//! cannot peek at what it must predict.

mod action;
mod between;
mod driven;
mod elastic;
mod equilibrium;
mod foot;
mod footprint;
mod grip;
mod lift;
mod limit_surface;
mod linkage;
mod pockets;
mod press;
mod pseudo_inertia;
mod push;
mod quasistatic;
mod riders;
mod rubbing;
mod shove;
mod shoved;
mod simulator;
mod slide;
mod stance;
pub mod tabletop;
#[cfg(test)]
mod tests_of_plates;
mod tilt;
mod tool_path;
mod tumble;
mod tumble_contact;
mod underside;

pub use action::{Action, Hold, Prediction, ToolMotion};
pub use between::{Between, SHORTFALL};
pub use driven::Driven;
pub use elastic::ElasticLaw;
pub use foot::{Foot, Pressed, Pressing, pressed_underside};
pub use footprint::Footprint;
pub use lift::predict_lift;
pub use limit_surface::{LimitSurface, Sliding};
pub use linkage::Linkage;
pub use press::{Press, predict_press};
pub use pseudo_inertia::PseudoInertia;
pub use push::{Play, PushPrediction, predict_push};
pub use quasistatic::{Contact, ContactSolution, Course, Dissipator, solve_contact, solve_contact_on};
pub use riders::{above, riders};
pub use rubbing::Rubbing;
pub use shove::Shove;
pub use shoved::Shoved;
pub use simulator::Simulator;
pub use slide::{PlaneMotion, Slider};
pub use stance::Stance;
pub use tilt::{Slope, TiltOutcome, Tilted, predict_tilt};
pub use tumble::{Hinge, Landing, Part, State, Thrown, Velocity};
pub use underside::{outermost_torsional_radius, uniform_torsional_radius};
