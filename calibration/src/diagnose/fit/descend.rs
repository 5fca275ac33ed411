//! Bounded Gauss-Newton steps over the sweeps of [`super::sweep`].
//!
//! Slopes cost a simulation of all clips for every number, a step costs one. So slopes are kept from step to step, each time
//! corrected by what the step did (the secant update of Broyden 1965), for as long as steps bring most of what they promise;
//! then they are taken anew. Converged is only what slopes taken anew say is. Where clips show an object every step takes all of
//! them: clips then have slopes by numbers of their own, which a step of the shared ones says nothing about, and a hit goes elsewhere
//! with the least change of the gains.

use super::bench::{Bench, Clips};
use super::effort::Effort;
use super::floor;
use super::sweep::{Reduced, Swept};
use inference::estimate::Descent;
use inference::likelihood::Likelihood;
use nalgebra::{DMatrix, DVector};

/// A fit has converged when a step promises less than this of the deviance: a fiftieth of a nat decides nothing. Where more is
/// left than the weights take for noise, chance moves more, and so much more decides nothing.
const TOLERANCE: f64 = 0.05;
/// Most trials with growing damping before a point counts as the best there is.
const TRIALS: usize = 6;
/// Slopes are kept after a step that brought at least this share of what they promised.
const BROUGHT: f64 = 0.5;

/// Where a step led.
struct Step {
    full: Vec<f64>,
    clips: Clips,
    /// By how much the cost was to fall, and fell.
    promised: f64,
    gained: f64,
    /// Whether numbers were turned round besides: a vector's length is never negative.
    turned_round: bool,
}

impl<E: Likelihood> Bench<'_, E> {
    /// At most so many damped steps of some numbers and of the clips' own; the last linearisation too, where no step from it was
    /// worth it. `None` when the twin has no answer at the start.
    pub(super) fn descended(
        &self,
        (mut full, mut clips): (Vec<f64>, Clips),
        moving: &[usize],
        weights: &[f64],
        effort: Effort,
    ) -> Option<(Vec<f64>, Clips, Option<Swept>)> {
        let (mut damping, mut kept, mut steps) = (1e-4, None, 0);
        while steps < effort.iterations && !self.interrupt.asked() {
            let anew = kept.is_none();
            let at = match kept.take() {
                Some(at) => at,
                None => self.linearise(&full, moving, &clips, effort.precision)?,
            };
            let forms = at.reduced(self.evidence, weights).ok()?;
            let mut damped = damping;
            let trials = if anew { TRIALS } else { 1 };
            match self.improved((&full, moving), (&at, &forms), weights, (&mut damped, trials)) {
                Some(step) => {
                    steps += 1;
                    kept = self.corrected(at, (&full, moving), &step);
                    (full, clips, damping) = (step.full, step.clips, damped);
                }
                None if anew => return Some((full, clips, Some(at))),
                None => {}
            }
        }
        Some((full, clips, None))
    }

    /// A point with a lower cost, along damped steps; `None` when there is none that is worth it.
    fn improved(
        &self,
        (full, free): (&[f64], &[usize]),
        (at, forms): (&Swept, &[Reduced]),
        weights: &[f64],
        (damping, trials): (&mut f64, usize),
    ) -> Option<Step> {
        let size = 1 + free.len();
        let sum = forms.iter().fold(DMatrix::zeros(size, size), |sum, reduced| sum + &reduced.form);
        let here: Clips = at.clips.iter().map(|clip| (clip.clip, clip.own.clone())).collect();
        let now = self.cost(full, &here, weights)?;
        let (information, gradient) = (sum.view((1, 1), (free.len(), free.len())), sum.view((1, 0), (free.len(), 1)));
        let (information, gradient) = (information.into_owned(), gradient.column(0).into_owned());
        let room: Vec<[f64; 2]> = free.iter().map(|k| self.library.unknowns[*k].reach(full[*k])).collect();
        let enough = TOLERANCE * self.excess(at, weights);
        let descent = Descent { information: &information, gradient: &gradient, room: &room, enough, trials };
        descent.step(damping, |_, step| {
            let mut to = full.to_vec();
            free.iter().zip(step.iter()).for_each(|(k, step)| to[*k] += step);
            let straight = to.clone();
            self.library.turn_round(&mut to);
            let own = |clip: &super::sweep::SweptClip| {
                Some((clip.clip, at.own_after(clip, self.evidence, weights, step).ok()?))
            };
            let to_own = self.own_fitted(&to, at.clips.iter().map(own).collect::<Option<_>>()?, weights)?;
            let clips = self.restarted(&to, to_own, weights);
            let cost = self.cost(&to, &clips, weights).filter(|cost| *cost < now)?;
            let (promised, gained, turned_round) = (descent.promised(step), now - cost, to != straight);
            Some(Step { full: to, clips, promised, gained, turned_round })
        })
    }

    /// How many times what the clips of an arm leave exceeds what the weights take for noise, at least 1: so many times more does
    /// chance move of the deviance. Clips with numbers of their own take that up.
    fn excess(&self, at: &Swept, weights: &[f64]) -> f64 {
        if self.evidence.has_object() {
            return 1.0;
        }
        let left: Vec<(usize, Vec<f64>)> =
            at.clips.iter().map(|clip| (clip.clip, clip.matrix.column(0).iter().copied().collect())).collect();
        let found = floor::weights(self.evidence, &left);
        let counts = weights.iter().zip(&found).filter(|(taken, found)| **taken > 0.0 && **found > 0.0);
        let ratios: Vec<f64> = counts.map(|(taken, found)| (taken / found).powi(2)).collect();
        (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).max(1.0)
    }

    /// A linearisation moved to where a step led, its slopes corrected by what the step did: by the least that makes them right
    /// along it, numbers in their steps. `None` where they are to be taken anew.
    fn corrected(&self, mut at: Swept, (from, free): (&[f64], &[usize]), step: &Step) -> Option<Swept> {
        if self.evidence.has_object() || step.turned_round || step.gained < BROUGHT * step.promised {
            return None;
        }
        let way = DVector::from_iterator(free.len(), free.iter().map(|k| step.full[*k] - from[*k]));
        let units: Vec<f64> = free.iter().map(|k| self.library.unknowns[*k].step).collect();
        let square: f64 = way.iter().zip(&units).map(|(way, unit)| (way / unit).powi(2)).sum();
        for clip in &mut at.clips {
            let mut there = Vec::new();
            self.evidence.residuals(clip.clip, &step.full, &clip.own, &mut there).ok()?;
            let there = DVector::from_vec(there);
            let missed = &there - clip.matrix.column(0) - clip.matrix.columns(1, free.len()) * &way;
            for (k, (way, unit)) in way.iter().zip(&units).enumerate() {
                clip.matrix.column_mut(1 + k).axpy(way / (square * unit * unit), &missed, 1.0);
            }
            clip.matrix.set_column(0, &there);
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::fit::sweep::Precision;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{bench, shipped};
    use inference::estimate::{ClipModel, Impossible};
    use inference::interrupt::Interrupt;
    use inference::likelihood::random_effects::{RandomEffects, WithOwn};
    use inference::likelihood::setting;
    use inference::likelihood::{Channel, Group, Row, StageName};
    use shared_mem::msg::MAX_JOINTS;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const SOUGHT: f64 = 0.2;

    /// Residuals that bend with the baseline's numbers, one for each, and how often they were asked for.
    struct Bent<'a> {
        library: &'a Library,
        channel: [Channel; 1],
        rows: Vec<Row>,
        asked: AtomicUsize,
    }

    impl Bent<'_> {
        /// Each number between where it starts and its upper end.
        fn shares(&self, full: &[f64]) -> Vec<f64> {
            let share = |k: usize| {
                let unknown = &self.library.unknowns[k];
                (full[k] - unknown.start) / (unknown.upper - unknown.start)
            };
            self.library.baseline.clone().map(share).collect()
        }
    }

    impl ClipModel for Bent<'_> {
        fn clips(&self) -> usize {
            1
        }

        fn residuals(&self, _: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            self.asked.fetch_add(1, Ordering::Relaxed);
            let shares = self.shares(shared);
            let of = |(k, share): (usize, &f64)| {
                let other = shares[(k + 1) % shares.len()];
                40.0 * ((2.0 * share).exp() - (2.0 * SOUGHT).exp()) + 10.0 * (share - SOUGHT) * (other - SOUGHT)
            };
            *out = shares.iter().enumerate().map(of).collect();
            Ok(())
        }
    }

    impl Likelihood for Bent<'_> {
        type Own = WithOwn;

        fn channels(&self) -> &[Channel] {
            &self.channel
        }

        fn rows(&self, _: usize) -> &[Row] {
            &self.rows
        }

        fn scatter(&self) -> RandomEffects {
            RandomEffects::default()
        }
    }

    #[test]
    fn a_fit_comes_to_the_minimum_with_the_slopes_of_its_beginning_and_of_its_end() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let numbers = library.baseline.len();
        let channel = [Channel { quantity: "q", place: "joint1".into(), joint: Some(0), group: Group::Arm }];
        let row = Row { channel: 0, stage: StageName::Control, regime: "free", time: 0.0 };
        let bent = Bent { library: &library, channel, rows: vec![row; numbers], asked: AtomicUsize::new(0) };
        let interrupt = Interrupt::default();
        let bench = bench(&bent, &library, &interrupt);
        let effort = Effort::of(25, Precision::Exact);
        let fit = bench.fit((&[], library.start()), &[0], &[1.0], None, effort).expect("a fit");
        for share in bent.shares(&fit.full) {
            assert!((share - SOUGHT).abs() < 1e-3, "{share}");
        }
        // Slopes taken anew at every step would take five times as many simulations as there are numbers, and more.
        let asked = bent.asked.load(Ordering::Relaxed);
        assert!(asked < 2 * (1 + numbers) + 40, "{asked} simulations for {numbers} numbers");
    }
}
