//! Sealed simulated worlds: recordings whose truth is known, for the benchmark of the diagnosis and for tests.
//!
//! | module | owns |
//! |---|---|
//! | [`world`], [`draw`] | what is true in a world, from its number |
//! | [`session`] | the clips that it gives |
//! | [`changed`] | two worlds, of which something changed or nothing did |

pub mod changed;
pub mod draw;
pub mod session;
pub mod world;
