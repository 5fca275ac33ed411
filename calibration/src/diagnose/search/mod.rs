//! From the identified baseline to the effects that act together.
//!
//! | module | |
//! |---|---|
//! | `baseline` | the paper's parameters identified |
//! | `combine` | which effects act together |
//! | `around_engine` | the same where another program simulates strokes |
//! | `nearer` | what a step extends, fitted anew from where its best trial ended |
//! | `refit`, `reidentify` | what was chosen fitted to the end, and its nearest rivals with it |

pub mod around_engine;
pub mod baseline;
pub mod combine;
mod nearer;
pub mod refit;
pub mod reidentify;
