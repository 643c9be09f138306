//! The made-up world that tests the rest: it shares no physics with the estimators on purpose.

mod check;
mod check_action;
mod dynamics;
mod film;
mod hidden;
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
mod robot;
mod scene;
mod scenes;
mod script;
mod sensors;
mod solid;
mod surface;
mod synthesise;
mod truth;

pub use hidden::{hidden_causes, hide_at_random, hide_by_word};
pub use perform::{Performance, perform};
pub use read::{parse_scene, read_scene};
pub use robot::LabRig;
pub use scene::{
    ActionSpec, BodySpec, BondSpec, CameraSpec, FilmSpec, FoamSpec, FrictionSpec, HideSpec, JointSpec, JointSpecKind,
    NoiseSpec, PairSpec, RepeatSpec, Scene, ShapeSpec, SupportSpec, ToolSpec, WeightSpec,
};
pub use scenes::{scene_named, scenes};
pub use solid::{ConvexPart, PartShape, Solid, build_solids};
pub use synthesise::{Synthetic, steps, synthesise};
