//! What to measure next: experiments that part causes which these data cannot tell apart, and such that would show
//! causes of which they say nothing. Where the causes that are left have forward models the touches are worked out by what is
//! expected of them; else they are the ones that are known to part such causes.

mod experiments;
mod imagined;
mod outlook;
mod spins;
mod unseen;
mod words;

pub use experiments::{Done, experiments};
pub use imagined::{Imagined, asked};
pub use spins::{spins, twist};
pub use unseen::{Has, showing};
