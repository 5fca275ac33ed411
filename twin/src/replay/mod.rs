//! Recorded clips, simulated: the recorded commands go into the twin, and what it does is held against what was
//! measured. Called by `twin replay`; identification and diagnosis start from the same [`Replayer`].
//!
//! Stamps are those of the recording (integer nanoseconds), everything else SI in the base frame.
//!
//! | file | owns |
//! |---|---|
//! | `predict` | [`Replayer`]: one clip in the twin |
//! | `first_motion` | how an object moved that was let go or slid already |
//! | `object_start` | where the object was and how it moved when the clip began |
//! | `on_table` | whether the table could carry it there |
//! | `report` | the gaps of a session, as JSON and as a table |
//! | `session` | all clips of a session, on all cores |
//! | `write` | a simulated clip on disk |

mod first_motion;
pub mod object_start;
mod on_table;
mod predict;
mod report;
mod session;
mod write;

pub use on_table::Buried;
pub use predict::{Prediction, ReplayError, Replayer, in_model_order};
pub use report::{ClipGap, Gap, SessionGap};
pub use session::{Options, replay};
pub use write::write_clip;
