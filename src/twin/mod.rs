//! Belief: the digital twin as data, readable without the rig that measured it (`docs/twin-format.md`).

mod body;
mod budget;
mod cause;
mod diagnosis;
mod disagree;
mod effect;
mod file;
mod joint;
mod lump;
mod mesh_distance;
mod model;
mod obj;
mod place;
mod relation;
mod sanity;
mod score;
mod score_rows;
mod score_table;
mod state;
mod structure;
mod symmetry;
mod truth;

pub use body::{Body, Friction, FrictionForce, LedgerEntry, Link, Superquadric, SurfaceShares, Tossed, WORLD};
pub use budget::Budget;
pub use cause::{CAUSES, known_cause};
pub use diagnosis::{
    AskedTouch, BaseFit, CauseOdds, DIAGNOSIS_FORMAT, Diagnosis, Evidence, Experiment, Finding, Gain, Miss, Prior,
    PriorFamily, Profile, ProfileBin, ProfileSample, Verdict, in_order,
};
pub use disagree::{Compared, compared, effects_compared, efforts_compared, joints_compared};
pub use effect::{Coupling, Detent, Effect, JointEffects};
pub use file::{DIAGNOSIS_FILE, TWIN_FILE, read_truth, read_twin, texture_path, write_twin};
pub use joint::{EffortAt, Joint, JointAlternative, JointEffort, JointKind, Latch};
pub use lump::{Lump, Lumped, lumped};
pub use model::{FORMAT, Model, Provenance, SCENE_MESH, SupportPlane, TrackFromImages, Twin};
pub use place::placed_as;
pub use relation::{Relation, RelationKind, SUPPORT};
pub use score::{CauseScore, Score, ScoreRow, Summary, Tally, score};
pub use state::{ArcState, BodyState, LinkState};
pub use structure::structure_compared;
pub use symmetry::{Symmetry, SymmetryAxis, SymmetryCenter, SymmetryPlane};
pub use truth::{TrueBody, TrueJoint, TruePlane, TrueRelation, Truth};
