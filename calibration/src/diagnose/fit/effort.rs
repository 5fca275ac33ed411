//! How much work a fit gets.

use super::sweep::Precision;

/// How a fit is made.
#[derive(Debug, Clone, Copy, Hash)]
pub struct Effort {
    /// At most so many linearisations.
    pub iterations: usize,
    /// How they are taken.
    pub precision: Precision,
    /// Whether numbers that the arm alone tells stay where they are: an effect beyond the arm does not change what its joints
    /// say, and the arm need not be simulated again.
    pub holds_joints: bool,
    /// Whether what the effects hold while they are searched moves too.
    pub frees_held: bool,
}

impl Effort {
    /// So many linearisations, taken like this, of all numbers.
    pub const fn of(iterations: usize, precision: Precision) -> Self {
        Self { iterations, precision, holds_joints: false, frees_held: false }
    }
}

/// Every candidate's fit gets so many linearisations from its signature on; those that come near the best get more.
pub(in crate::diagnose) const SCREENING: Effort = Effort::of(3, Precision::Joints);
/// A look at an object's clips with what was fitted to the arm alone.
pub(in crate::diagnose) const PROBE: Effort = Effort::of(1, Precision::Joints);
/// A candidate that came near the best.
pub(in crate::diagnose) const REFINEMENT: Effort = Effort::of(6, Precision::Joints);
/// The baseline; and what is fitted without some clips, which begins where all of them together have it.
pub(in crate::diagnose) const THOROUGH: Effort = Effort::of(8, Precision::Joints);
/// The winner is fitted until it has converged, what is held of it with the others: its numbers are the answer. An arm alone
/// converges well before so many linearisations.
pub(in crate::diagnose) const LAST_PASS: Effort = Effort { frees_held: true, ..Effort::of(25, Precision::Exact) };
/// Near is within this of the best deviance, or within a share of what the best gains (a choice).
pub(in crate::diagnose) const NEAR_DEVIANCE: f64 = 40.0;
/// A clip whose cost is off by more than this went another way than was thought [deviance] (a choice): no slope says what it costs.
pub(in crate::diagnose) const ANOTHER_WAY_DEVIANCE: f64 = 100.0;
