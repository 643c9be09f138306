//! The made-up world that tests the rest: it shares no physics with the estimators on purpose.

mod scene;

pub use scene::{
    ActionSpec, BodySpec, BondSpec, CameraSpec, FoamSpec, FrictionSpec, JointSpec, JointSpecKind, NoiseSpec, PairSpec,
    Scene, ShapeSpec, SupportSpec, ToolSpec, WeightSpec,
};
