//! Belief: the digital twin as data, readable without the rig that measured it (`docs/twin-format.md`).

mod body;
mod diagnosis;
mod joint;
mod model;
mod relation;
mod truth;

pub use body::{Body, Friction, FrictionForce, Link, Superquadric, SymmetryPlane};
pub use diagnosis::{BaseFit, CauseOdds, DIAGNOSIS_FORMAT, Diagnosis, Evidence, Experiment, Finding, Gain, Verdict};
pub use joint::{Joint, JointAlternative, JointKind};
pub use model::{FORMAT, Model, Provenance, SupportPlane, Twin};
pub use relation::{Relation, RelationKind, SUPPORT};
pub use truth::{TrueBody, TrueJoint, TruePlane, TrueRelation, Truth};
