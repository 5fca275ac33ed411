//! Which candidates are tried, on what, and where their fits begin.
//!
//! | module | |
//! |---|---|
//! | `signatures` | the score test of all candidates around a hypothesis |
//! | `screening` | which of them are worth a fit |
//! | `starts`, `ripple`, `along_motion` | where fits begin |
//! | `arm_alone` | clips with an object as if only the arm had been recorded |

pub mod along_motion;
pub mod arm_alone;
pub mod ripple;
pub mod screening;
pub mod signatures;
pub mod starts;

use crate::diagnose::criteria::JOINTS_EXCESS;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{Effort, REFINEMENT};
use crate::diagnose::fit::multi_start::{MultiStart, Tried};
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::library::Candidate;
use inference::admit::Split;
use inference::likelihood::Group;
use inference::likelihood::random_effects::{OwnNumbers, WithOwn};
use inference::witness::Witness;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::progress::Progress;

/// What every step of a search for effects is given.
pub(in crate::diagnose) struct Search<'a> {
    pub(in crate::diagnose) bench: &'a Bench<'a>,
    pub(in crate::diagnose) split: &'a Split,
    /// Numbers whose object is found anew under the effects in them; `None` where there is no object.
    pub(in crate::diagnose) refined: &'a dyn Fn(&[f64]) -> Option<Vec<f64>>,
    /// What single stages show beyond the effects in these numbers.
    pub(in crate::diagnose) witnessed: &'a dyn Fn(&[f64]) -> Vec<Witness>,
    pub(in crate::diagnose) bar: &'a Progress,
}

impl<'a> Search<'a> {
    /// Fits of effects to the clips for fitting, each clip's nuisance parameters from where `near` has them.
    pub(in crate::diagnose) fn fits(
        &'a self,
        effects: &'a [usize],
        weights: &'a [f64],
        near: &'a Hypothesis,
    ) -> MultiStart<'a> {
        MultiStart { bench: self.bench, effects, clips: &self.split.train, weights, near: Some(near) }
    }

    /// A fit gone on with.
    pub(in crate::diagnose) fn onwards(&self, fit: &Hypothesis, weights: &[f64], effort: Effort) -> Option<Hypothesis> {
        self.bench.fit(&fit.effects, fit.full.clone(), &self.split.train, weights, Some(fit), effort)
    }

    /// The effort of what is extended and what is found. Where a search leaves clips out, that is fitted to all of them once more, and
    /// exactly ([`Bench::last_pass`]).
    pub(in crate::diagnose) fn last_pass(&self) -> Effort {
        let exactly = self.bench.last_pass();
        if self.split.is_of_few() { exactly } else { Effort { frees_held: exactly.frees_held, ..REFINEMENT } }
    }

    /// This search on another bench of the same clips.
    pub(in crate::diagnose) fn on(&self, bench: &'a Bench<'a>) -> Search<'a> {
        Search { bench, split: self.split, refined: self.refined, witnessed: self.witnessed, bar: self.bar }
    }
}

/// A hypothesis around which starts are looked for, on the clips that it was fitted to.
pub(in crate::diagnose) struct Around<'a, O: OwnNumbers = WithOwn> {
    pub(in crate::diagnose) bench: &'a Bench<'a, O>,
    pub(in crate::diagnose) from: &'a Hypothesis<O>,
    pub(in crate::diagnose) weights: &'a [f64],
}

impl<O: OwnNumbers> Around<'_, O> {
    fn candidate(&self, scored: &Scored) -> &Candidate {
        &self.bench.library.candidates[scored.candidate]
    }

    /// The numbers with a candidate as strong as it is said.
    fn begun(&self, scored: &Scored) -> Vec<f64> {
        self.bench.begun(self.from.full.clone(), scored)
    }

    /// Numbers with one of them so many units of its probe from rest; `number`, and its value at one unit.
    fn moved(&self, full: &[f64], (number, at_one): (usize, f64), units: f64) -> Vec<f64> {
        let unknown = &self.bench.library.unknowns[number];
        let mut moved = full.to_vec();
        moved[number] = (unknown.start + units * (at_one - unknown.start)).clamp(unknown.lower, unknown.upper);
        moved
    }

    /// What the clips cost at other numbers.
    fn cost(&self, full: &[f64]) -> f64 {
        self.bench.plain_cost(&self.from.clips(), full, self.weights).unwrap_or(f64::INFINITY)
    }

    /// Joints in whose own channels the hypothesis leaves more than sessions with nothing wrong do.
    fn joints_with_a_gap(&self) -> Vec<usize> {
        let evidence = self.bench.evidence;
        let (mut squares, mut rows) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for (clip, own) in self.from.clips_with_own() {
            let mut residuals = Vec::new();
            if evidence.residuals(clip, &self.from.full, &own, &mut residuals).is_err() {
                return (0..MAX_JOINTS).collect();
            }
            for (row, residual) in evidence.rows(clip).iter().zip(&residuals) {
                let channel = &evidence.channels()[row.channel];
                let joint = channel.joint.filter(|_| channel.group == Group::Arm);
                joint.into_iter().for_each(|joint| {
                    squares[joint] += residual * residual;
                    rows[joint] += 1.0;
                });
            }
        }
        let has_a_gap = |joint: &usize| squares[*joint] > (1.0 + JOINTS_EXCESS.value) * rows[*joint];
        (0..MAX_JOINTS).filter(has_a_gap).collect()
    }

    /// Which numbers make the clips cost least, and how much, where that is less than `bound`. Of numbers that cost more
    /// before all clips were asked the others are not.
    fn cheapest(&self, numbers: impl IntoIterator<Item = Vec<f64>>, bound: f64) -> Option<Tried> {
        let (clips, mut best) = (self.from.clips(), None::<Tried>);
        for numbers in numbers {
            if self.bench.interrupt.asked() {
                break;
            }
            let bound = best.as_ref().map_or(bound, |best| best.cost);
            if let Some(cost) = self.bench.plain_cost_below(&clips, &numbers, self.weights, bound) {
                best = Some(Tried { cost, numbers });
            }
        }
        best
    }

    /// The same of several, the cheapest first.
    fn several_cheapest(&self, numbers: impl IntoIterator<Item = Vec<f64>>, count: usize) -> Vec<Tried> {
        let mut best: Vec<Tried> = Vec::new();
        for numbers in numbers {
            let bound = if best.len() < count { f64::INFINITY } else { best[count - 1].cost };
            best.extend(self.cheapest([numbers], bound));
            best.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            best.truncate(count);
        }
        best
    }
}

#[cfg(test)]
fn around<'a, O: OwnNumbers>(bench: &'a Bench<'a, O>, from: &'a Hypothesis<O>, weights: &'a [f64]) -> Around<'a, O> {
    Around { bench, from, weights }
}
