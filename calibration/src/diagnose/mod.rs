//! Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.

pub mod answer;

pub use answer::{Candidate, Change, Clips, Diagnosis, Gap, Kind, Place, Share, Size, Status, Verdict};
