//! The doctor of a recording: whether the data can mean what they say, before anything is explained by them.
//!
//! Alignment comes first: lag, order, sign and units of commands and measurements, velocities against slopes, torques against the
//! model, falls against gravity. What is found is taken as mended for the checks behind it, so that one fault is one remark.
//!
//! | module | owns |
//! |---|---|
//! | [`remark`] | what is said about a recording |
//! | `limits` | every threshold, with its unit and where it comes from |
//! | `columns`, `statistics`, `conversion` | a clip as typed columns, and what the detectors share |
//! | `reader` | what the reader of the file noticed |
//! | `stamps` | clocks in other units, uneven steps |
//! | `rates` | rows that repeat older ones, rates that beat |
//! | `publishers` | two publishers on one topic |
//! | `copied` | commands that are the measurements
//! | `constant` | placeholders that look like measurements |
//! | `velocity` | velocities against the slope of the positions |
//! | `units` | commands against measurements: another unit |
//! | [`lag`] | the same: lag, and whether it is a delay |
//! | `order` | the same: order and sign of the joints |
//! | `range` | positions against the joints' ranges |
//! | `torque` | torques against the model |
//! | `standing` | size and orientation of an object that stands on its table |
//! | `fall` | free fall |
//! | `elsewhere` | forward kinematics against poses |
//! | `origins` | where the clips come from |
//! | `look` | one clip looked at, by all of these in their turn |
//! | [`session`] | a whole session looked at: the answer |
//! | [`good_for`] | which verbs each clip is good for |
//! | [`gate`] | what `diagnose` and `identify` take from it |
//! | [`picture`] | what the page draws |

mod columns;
mod constant;
mod conversion;
mod copied;
mod elsewhere;
mod fall;
pub mod gate;
pub mod good_for;
pub mod lag;
mod limits;
mod look;
mod order;
mod origins;
pub mod picture;
mod publishers;
mod range;
mod rates;
mod reader;
pub mod remark;
pub mod session;
mod stamps;
mod standing;
mod statistics;
mod torque;
mod units;
mod velocity;

pub use remark::{Fault, Remark, Severity, Size};
pub use session::{Checked, check, check_clips};
pub use torque::motion;
