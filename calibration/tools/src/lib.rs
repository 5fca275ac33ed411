//! What measures calibration from outside: how often printed intervals hold the truth, how often faults of a recording are found. For
//! tests and examples; no program uses it.
//!
//! | module | owns |
//! |---|---|
//! | [`coverage`] | whether printed intervals hold the truth |
//! | [`injected`] | faults put into clean sessions: how often they are found |

pub mod coverage;
pub mod injected;
