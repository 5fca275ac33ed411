//! Estimation over clips: what a set of numbers makes of every clip, which numbers fit best, and how sure that is.
//!
//! The clip is the unit of evidence. Samples within a clip share its friction, its start, its clock, so they are no
//! independent witnesses; whatever varies from clip to clip is a number *of its own* for every clip with a prior of zero
//! mean (a random effect), eliminated clip by clip. What is asked for is *shared* by all clips.
//!
//! | module | owns |
//! |---|---|
//! | [`problem`] | the two kinds of unknowns, and the question a model answers: residuals of one clip |
//! | [`eliminate`] | the likelihood of one clip with its nuisance parameters integrated out |
//! | [`linear`] | one clip linearised by differences |
//! | [`bounded`] | one damped step within bounds |
//! | [`solve`] | the one loop of such steps, and its schedule |
//! | [`least_squares`] | all clips on that way |
//! | [`profile`] | nuisance parameters at their best for shared ones that are given |
//! | [`quadratic`] | quadratic forms in parameters: minima over chosen ones, elimination of others |
//! | [`interval`] | how sure the shared parameters are |
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
pub mod eliminate;
pub mod evolution;
pub mod interval;
pub mod least_squares;
pub mod leverage;
pub mod linear;
pub mod plane;
pub mod problem;
pub mod profile;
pub mod quadratic;
pub mod sandwich;
pub mod search;
pub mod solve;
pub mod swarm;
mod views;

pub use bounded::bounded_step;
pub use eliminate::Eliminated;
pub use evolution::Evolution;
pub use interval::{Intervals, at_bounds, moved_by};
pub use least_squares::{Fit, Place, Underway, begin, fit, fit_from, go_on};
pub use leverage::without_leaning;
pub use linear::ClipFit;
pub use problem::{ClipModel, Impossible, Random, Unknown};
pub use profile::score;
pub use search::{Found, Search, minimise};
pub use solve::Schedule;
pub use swarm::Swarm;
pub use views::{Shifted, Subset};
