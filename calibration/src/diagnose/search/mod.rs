//! From the identified baseline to the effects that act together.
//!
//! | module | |
//! |---|---|
//! | `baseline` | the paper's parameters identified |
//! | `effects` | which effects act together: the forward selection of them |
//! | `refit` | what was chosen fitted to the end, and what it makes superfluous dropped |
//! | `again` | fits made once more from where others ended |
//! | `in_stages` | which candidates single stages show by themselves |

mod again;
pub mod baseline;
pub mod effects;
mod in_stages;
pub mod refit;
