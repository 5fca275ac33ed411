//! What the twin makes of recorded clips: residuals of every clip for any parameters of the cell.
//!
//! | module | owns |
//! |---|---|
//! | [`object`] | clips with an object: poses |

pub mod object;
