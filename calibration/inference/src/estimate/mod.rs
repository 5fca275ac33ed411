//! Estimation over clips: what a set of numbers makes of every clip, which numbers fit best, and how sure that is.
//!
//! The clip is the unit of evidence. Samples within a clip share its friction, its start, its clock, so they are no
//! independent witnesses; whatever varies from clip to clip is a number *of its own* for every clip with a prior of zero
//! mean (a random effect), eliminated clip by clip. What is asked for is *shared* by all clips.
//!
//! | module | owns |
//! |---|---|
//! | [`problem`] | the two kinds of unknowns, and the question a model answers: residuals of one clip |
//! | [`eliminate`] | the likelihood of one clip with its own numbers integrated out |
//! | [`linear`] | one clip linearised by differences |
//! | [`bounded`] | one damped step within bounds |
//! | [`descent`] | such steps tried with growing damping until one costs less |
//! | [`least_squares`] | bounded Levenberg-Marquardt on all clips |
//! | [`interval`] | how sure the shared numbers are |
//! | [`leverage`] | what a clip says of a fit that does not lean on it |
//! | [`search`] | search without slopes, and its loop |
//! | [`swarm`], [`evolution`] | two of them |
//! | `views` | a model with its calls counted, with numbers given, with some of its clips |
//! | [`sandwich`] | how far an answer scatters, by witnesses that are each wrong in their own way |
//! | [`plane`] | slopes through the origin, with their standard errors |
//!
//! Residuals are in units of their standard deviation. Everything is deterministic: clips are worked on by many threads,
//! but always summed in their order.

pub mod bounded;
pub mod descent;
pub mod eliminate;
pub mod evolution;
pub mod interval;
pub mod least_squares;
pub mod leverage;
pub mod linear;
pub mod plane;
pub mod problem;
pub mod sandwich;
pub mod search;
pub mod swarm;
mod views;

pub use bounded::bounded_step;
pub use descent::Descent;
pub use eliminate::Eliminated;
pub use evolution::Evolution;
pub use interval::{Intervals, at_bounds, moved_by};
pub use least_squares::{Fit, Options, Underway, begin, fit, fit_from, go_on, score};
pub use leverage::without_leaning;
pub use linear::ClipFit;
pub use problem::{ClipModel, Impossible, Random, Unknown};
pub use search::{Found, Search, minimise};
pub use swarm::Swarm;
pub use views::{Shifted, Subset};
