//! Tosses: restitution, friction, the spread of mass, the hinge, gravity and air, from flights and from short windows about
//! the moments of contact.

mod conditions;
mod fit;
mod local;
mod read;
mod shape;
mod sought;
mod windows;
mod write;

pub use conditions::Conditions;
pub use fit::{Row, Study};
pub use local::Toss;
pub use read::{Subject, subjects};
pub use sought::{Sought, flying, rigid};
pub use windows::{Scene, Simulated, flight_of};
pub(super) use write::identify_tosses;
pub use write::{METHOD, conditions_of};
