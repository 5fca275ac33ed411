//! Hypotheses on the way down ([`inference::estimate::solve`]) over the sweeps of [`super::sweep`].
//!
//! Slopes cost a simulation of all clips for every parameter, so they are kept from step to step. Where clips show an object every
//! step takes all of them: clips then have slopes by nuisance parameters, which a step of the shared ones says nothing about, and a hit
//! goes elsewhere with the least change of the gains.

use super::bench::{Bench, Clips, Reached};
use super::effort::Effort;
use super::floor;
use super::sweep::{Precision, Swept, SweptClip};
use inference::estimate::Impossible;
use inference::estimate::solve::{Descent, Problem, Quadratic, Schedule, Trial, descend};
use inference::likelihood::random_effects::OwnNumbers;
use nalgebra::DVector;
use rayon::prelude::*;

/// A fit has converged when a step promises less than 0.05 of the deviance: a fiftieth of a nat decides nothing. Where more is left
/// than the weights take for noise, chance moves more, and so much more decides nothing.
const SCHEDULE: Schedule =
    Schedule { damping: 1e-4, grown: 1e-3, trials: 6, iterations: 0, tolerance: 0.05, secant: Some(0.5) };

/// A hypothesis of which some numbers move.
struct Moving<'a, O: OwnNumbers> {
    bench: &'a Bench<'a, O>,
    moving: &'a [usize],
    weights: &'a [f64],
    precision: Precision,
}

impl<O: OwnNumbers> Bench<'_, O> {
    /// At most so many damped steps of some numbers and of the clips' nuisance parameters; the last linearisation too, where no step
    /// from it was worth it. `None` when the twin has no answer at the start.
    pub(super) fn descended(
        &self,
        full: Vec<f64>,
        clips: Clips,
        moving: &[usize],
        weights: &[f64],
        effort: Effort,
    ) -> Option<(Reached, Option<Swept>)> {
        let schedule = if self.evidence.has_object() { SCHEDULE.over_hits() } else { SCHEDULE };
        let schedule = Schedule { iterations: effort.iterations, ..schedule };
        let mut hypothesis = Moving { bench: self, moving, weights, precision: effort.precision };
        let place = Reached { full, clips, turned_round: false };
        let mut way = Descent { place, slopes: None, damping: schedule.damping };
        descend(&mut hypothesis, &mut way, &schedule).ok()?;
        Some((way.place, way.slopes))
    }

    /// How many times what the clips of an arm leave exceeds what the weights take for noise, at least 1: so many times more does
    /// chance move of the deviance. Clips with nuisance parameters take that up.
    fn excess(&self, at: &Swept, weights: &[f64]) -> f64 {
        if self.evidence.has_object() {
            return 1.0;
        }
        let left: Vec<(usize, Vec<f64>)> =
            at.clips.iter().map(|clip| (clip.clip, clip.matrix.column(0).iter().copied().collect())).collect();
        floor::overdispersion(weights, &floor::weights(self.evidence, &left))
    }
}

fn no_answer() -> Impossible {
    Impossible("the twin has no answer at these parameters".into())
}

impl<O: OwnNumbers> Problem for Moving<'_, O> {
    type Place = Reached;
    type Slopes = Swept;

    fn linearised(&mut self, place: &Reached) -> Result<Swept, Impossible> {
        self.bench.linearise(&place.full, self.moving, &place.clips, self.precision).ok_or_else(no_answer)
    }

    fn goes_on(&mut self, _: &Swept, _: f64) -> bool {
        !self.bench.interrupt.asked()
    }

    fn quadratic(&self, place: &Reached, at: &Swept) -> Result<Quadratic, Impossible> {
        let free = self.moving.len();
        let sum = at.total(self.bench.evidence, self.weights)?;
        let room = self.moving.iter().map(|k| self.bench.library.unknowns[*k].reach(place.full[*k]));
        Ok(Quadratic {
            cost: self.bench.cost(&place.full, &place.clips, self.weights).ok_or_else(no_answer)?,
            information: sum.view((1, 1), (free, free)).into_owned(),
            gradient: sum.view((1, 0), (free, 1)).column(0).into_owned(),
            room: room.collect(),
        })
    }

    fn excess(&self, at: &Swept) -> f64 {
        self.bench.excess(at, self.weights)
    }

    fn stepped(&mut self, from: &Reached, at: &Swept, trial: Trial<'_>) -> Option<(Reached, f64)> {
        let (bench, weights) = (self.bench, self.weights);
        let mut full = from.full.clone();
        self.moving.iter().zip(trial.step.iter()).for_each(|(k, step)| full[*k] += step);
        let straight = full.clone();
        bench.library.turn_round(&mut full);
        let own = |clip: &SweptClip| {
            let ahead = at.own_after(clip, bench.evidence, weights, trial.step).ok()?;
            Some((clip.clip, at.own_there(clip, ahead, bench.evidence, (&full, weights)).ok()?))
        };
        let clips = at.clips.par_iter().map(own).collect::<Option<_>>()?;
        let clips = bench.restarted_below(&full, clips, weights, trial.below);
        let cost = bench.cost(&full, &clips, weights)?;
        let turned_round = full != straight;
        Some((Reached { full, clips, turned_round }, cost))
    }

    /// By the least that makes the slopes right along the step, numbers in their steps.
    fn corrected(&self, mut at: Swept, from: &Reached, to: &Reached) -> Option<Swept> {
        let Self { bench, moving, .. } = self;
        if bench.evidence.has_object() || to.turned_round {
            return None;
        }
        let way = DVector::from_iterator(moving.len(), moving.iter().map(|k| to.full[*k] - from.full[*k]));
        let units: Vec<f64> = moving.iter().map(|k| bench.library.unknowns[*k].step).collect();
        let square: f64 = way.iter().zip(&units).map(|(way, unit)| (way / unit).powi(2)).sum();
        for clip in &mut at.clips {
            let mut there = Vec::new();
            bench.evidence.residuals(clip.clip, &to.full, &clip.own, &mut there).ok()?;
            let there = DVector::from_vec(there);
            let missed = &there - clip.matrix.column(0) - clip.matrix.columns(1, moving.len()) * &way;
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

    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{bench, shipped};
    use inference::estimate::ClipModel;
    use inference::interrupt::Interrupt;
    use inference::likelihood::random_effects::{RandomEffects, WithOwn};
    use inference::likelihood::{Channel, Group, Likelihood, Row, StageName, setting};
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
        let fit = bench.fit(&[], library.start(), &[0], &[1.0], None, effort).expect("a fit");
        for share in bent.shares(&fit.full) {
            assert!((share - SOUGHT).abs() < 1e-3, "{share}");
        }
        // Slopes taken anew at every step would take five times as many simulations as there are numbers, and more.
        let asked = bent.asked.load(Ordering::Relaxed);
        assert!(asked < 2 * (1 + numbers) + 40, "{asked} simulations for {numbers} numbers");
    }
}
