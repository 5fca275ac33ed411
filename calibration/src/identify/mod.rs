//! What a session says about the parameters of its cell.

pub mod answer;

pub use answer::{AtBound, ClipError, Clips, Correlation, Errors, Gap, Identification, NotIdentifiable};
