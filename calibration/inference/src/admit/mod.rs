//! Which recorded clips can be used, how much of them counts, and what each is for: one admission for identification, for diagnosis
//! and for the check of recordings. Base frame, SI.
//!
//! | module | owns |
//! |---|---|
//! | `session` | a session's clips, read and looked at; whether they can be diagnosed |
//! | [`look`] | whether a clip can be used for what it is wanted for |
//! | [`object_poses`] | the same of an object's poses alone |
//! | `mended`, `oddities` | a tracker's mistakes that can be mended; what is odd and can be used |
//! | [`torques`] | torques along the measured motion, where no control law is known |
//! | `command` | which clips follow the same command |
//! | `split` | which clips are for what |
//! | [`length`] | how much of long clips counts |
//! | `parts` | parts of clips in place of clips, where there are few commands |
//! | [`remarks`] | reasons and remarks for people, what many clips share said once |

mod command;
pub mod length;
pub mod look;
mod mended;
pub mod object_poses;
mod oddities;
mod parts;
pub mod remarks;
mod session;
mod split;
#[cfg(test)]
mod test_cell;
#[cfg(test)]
pub(crate) mod test_clip;
#[cfg(test)]
mod test_object;
pub mod torques;

pub use command::by_command;
pub use remarks::LeftOut;
pub use session::{Admitted, Looked, Refused, Usable, admit};
pub use split::{COMMANDS_TO_CHOOSE_BY, Split};
