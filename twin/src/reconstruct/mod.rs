//! From a scan to parts of the twin.
//!
//! | module | owns |
//! |---|---|
//! | `nearest` | points by distance |
//! | `surface` | the robot's surface as points |
//! | `align` | where a scan lies and how large it is: ICP with scale |
//! | `label` | which splat of a scan belongs to which link |

mod align;
mod label;
mod nearest;
mod surface;

pub use align::{AlignError, Alignment, STARTS, align};
pub use label::{Labelled, label};
pub use surface::SurfacePoints;
