//! What verbs answer, as plain types in SI units: made by `identify` and `diagnose`, only read by pages, terminals and files.
//!
//! | module | owns |
//! |---|---|
//! | [`identification`] | parameters that clips tell, and what they cannot tell |
//! | [`diagnosis`] | where a gap lies, what causes it, what to do about it |
//! | `size` | a parameter of an effect with its interval |
//! | `trace` | what is left between robot and twin over a clip |
//! | `witness` | what a stage says by itself, in words |

pub mod diagnosis;
pub mod identification;
mod size;
mod trace;
mod witness;

pub use size::{Size, effect_in_words};
pub(crate) use size::{numbers, one_or_list};
pub use trace::Trace;
pub use witness::{witness_in_words, witnessed_number};
