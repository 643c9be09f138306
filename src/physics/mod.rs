//! Forward models: from a twin and an action to what every sensor would see. No capture: a simulator
//! cannot peek at what it must predict.

mod action;
mod driven;
mod elastic;
mod foot;
mod footprint;
mod lift;
mod linkage;
mod press;
mod push;
mod quasistatic;
mod shoved;
mod slide;
pub mod tabletop;
mod tilt;
mod tumble;
mod tumble_contact;

pub use action::{Action, Hold, Prediction, ToolMotion};
pub use driven::{Driven, predict_driven, predict_driven_with_step};
pub use elastic::ElasticLaw;
pub use foot::{Foot, Pressed, pressed_underside, uniform_torsional_radius};
pub use footprint::Footprint;
pub use lift::predict_lift;
pub use linkage::Linkage;
pub use press::{Press, predict_press};
pub use push::{PushPrediction, predict_push};
pub use quasistatic::{Contact, ContactSolution, Dissipator, solve_contact};
pub use shoved::{Shove, Shoved, predict_shoved, predict_shoved_with_step};
pub use slide::{PlaneMotion, Slider, predict_slide, predict_slide_with_step};
pub use tilt::{TiltOutcome, predict_tilt};
pub use tumble::{Hinge, Landing, Part, State, Thrown, Velocity};
