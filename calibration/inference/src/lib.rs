//! What recorded clips say about numbers: the twin's answer to each clip as residuals, numbers fitted to all of them, and how sure
//! that is. Work that lasts for long can be interrupted and goes on from what is kept.
//!
//! | module | owns |
//! |---|---|
//! | [`admit`] | which recorded clips can be used, and what each is for |
//! | [`controller`] | what clips say of the controller before a model is fitted to them |
//! | [`engine`] | another program that simulates the arm |
//! | [`estimate`] | fits over clips: what all clips share, what varies from clip to clip |
//! | [`likelihood`] | what the twin makes of recorded clips: residuals, and what varies from clip to clip |
//! | [`object_fit`] | an object's parameters fitted to clips of rough hits |
//! | [`witness`] | what a stage of a clip says of an effect by itself, without a roll-out |
//! | [`interrupt`] | cancellation, pause and time budget |
//! | [`kept`] | checkpoints of a computation |
//! | [`seed`] | what is drawn is drawn from it |
//! | [`statistics`] | medians, and quantiles of distributions |
//!
//! # Words
//!
//! | word | meaning here |
//! |---|---|
//! | clip | one recorded motion, the unit of evidence: rows within one are not independent, clips are |
//! | residual | measured less simulated, in sigmas of the sensor |
//! | baseline | the twin with the paper's own parameters identified, and no effect |
//! | effect | something a real cell has and the nominal twin lacks; all of them stand in `twin::effects` |
//! | candidate | an effect that may show in the clips at hand |
//! | hypothesis | the baseline's numbers and those of some effects, fitted together |
//! | shared parameters | numbers that are the same in all clips |
//! | nuisance parameters | those of one clip alone: random effects with a known scatter, eliminated clip by clip |
//! | discrepancy | what any twin leaves for reasons of its own, beyond the sensors' noise |
//! | overdispersion | how many times larger the discrepancy is than was taken for noise |
//! | deviance | `-2 ln` of the likelihood; a nat is half a unit of it |
//! | screening | a score test of each candidate by its linearised signature: which are worth a fit |
//! | restart | a fit once more from elsewhere, where one is stuck in a local minimum |
//! | held-out clips | clips that a fit has not seen; those kept for confirming are opened once, at the end |
//! | identifiable | shown by the clips beyond what other parameters imitate |
//! | class | candidates that these clips cannot tell apart |
//! | shrink | `1 - after / before` of the mean squared residual on held-out clips |

pub mod admit;
pub mod controller;
pub mod engine;
pub mod estimate;

pub mod kept;
pub mod likelihood;
pub mod object_fit;
pub mod seed;
pub mod statistics;
pub mod witness;

pub use shared_mem::interrupt;
