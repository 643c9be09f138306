//! The made-up world that tests the rest: it shares no physics with the estimators on purpose.

mod check;
mod check_action;
mod instruments;
mod lathe;
mod matter;
mod obj;
mod parts;
mod perform;
mod range_camera;
mod ray;
mod read;
mod rig;
mod scene;
mod script;
mod sensors;
mod solid;
mod surface;
mod synthesise;
mod truth;

pub use instruments::{CameraSpec, NoiseSpec};
pub use perform::{Performance, perform};
pub use read::{parse_scene, read_scene};
pub use scene::{
    BodySpec, BondSpec, FoamSpec, FrictionSpec, JointSpec, JointSpecKind, PairSpec, Scene, ShapeSpec, SupportSpec,
    WeightSpec,
};
pub use script::{ActionSpec, ToolSpec};
pub use solid::{ConvexPart, PartShape, Solid, build_solids};
pub use synthesise::{Synthetic, steps, synthesise};
