//! From posed pictures to depth: multi-view stereo by PatchMatch, with slanted windows and views chosen pixel by pixel.
//!
//! | module | owns |
//! |---|---|
//! | `camera` | pictures with known cameras, and the depth of their pixels |
//! | `neighbours` | which views a view is compared with |
//! | `picture` | pictures of fewer pixels |
//! | `plane` | the plane that a pixel looks at, and where other views see it |
//! | `similarity` | how alike two views see it |
//! | `sweep` | a pass over a picture |
//! | `levels` | from few pixels to many |
//! | `agree` | what views agree on |
//! | `random` | random numbers by counters |
//!
//! Lengths are metres. Camera axes: x right, y down, z forwards.
//!
//! The crate `cumulus3d-dense` (0.11, Apache-2.0) was looked at in place of this: it holds what lies around such a search, and no search; the
//! one that its authors provide needs CUDA.

mod agree;
mod camera;
mod levels;
mod neighbours;
mod picture;
mod plane;
mod random;
mod similarity;
mod sweep;

pub use camera::{Camera, Depth, View};
pub use levels::estimate;
