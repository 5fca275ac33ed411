//! From the identified baseline to the effects that act together.
//!
//! | module | |
//! |---|---|
//! | `baseline` | the paper's parameters identified |
//! | `effects` | which effects act together: the forward selection of them |
//! | `refit` | what was chosen fitted to the end, and what it makes superfluous dropped |
//! | `again` | fits made once more from where others ended |

mod again;
pub mod baseline;
pub mod effects;
pub mod refit;
