//! From the identified baseline to the effects that act together.
//!
//! | module | |
//! |---|---|
//! | `baseline` | the paper's parameters identified |
//! | `combine` | which effects act together |
//! | `by_engine` | what was found, fitted to the roll-outs of another program |
//! | `nearer` | what a step extends, fitted anew from where its best trial ended |
//! | `refit`, `reidentify` | what was chosen fitted to the end, and its nearest rivals with it |

pub mod baseline;
mod by_engine;
pub mod combine;
mod nearer;
pub mod refit;
pub mod reidentify;
