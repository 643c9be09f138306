//! The made-up world that tests the rest: it shares no physics with the estimators on purpose.

mod dynamics;
mod perform;
mod scene;
mod solid;

pub use perform::{Performance, perform};
pub use scene::{
    ActionSpec, BodySpec, BondSpec, CameraSpec, FoamSpec, FrictionSpec, JointSpec, JointSpecKind, NoiseSpec, PairSpec,
    Scene, ShapeSpec, SupportSpec, ToolSpec, WeightSpec,
};
pub use solid::{ConvexPart, PartShape, Solid};
