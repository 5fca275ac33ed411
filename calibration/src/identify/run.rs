//! One search over clips: by least squares or without slopes, with a bar, and so that Ctrl-C loses nothing: every step is kept,
//! and the same command goes on from there to the same answer.

use super::error::IdentifyError;
use super::options::{Optimizer, Options};
use super::work::{Work, stopped};
use inference::estimate::search;
use inference::estimate::{
    ClipModel, Evolution, Fit, Found, Impossible, Place, Random, Schedule, Search, Swarm, Underway, Unknown, begin,
    fit_from, go_on, minimise,
};
use inference::interrupt::Interrupt;
use inference::kept::Fingerprint;
use shared_mem::progress::Progress;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most steps with some of the clips, before all are fitted (a choice).
const STEPS_OF_THE_ROUGH_FIT: usize = 3;
/// Linearisations that a fit usually takes (a choice): for the bar alone.
const USUAL_LINEARISATIONS: usize = 4;

/// What a search is given.
pub(super) struct Run<'a> {
    pub(super) unknowns: &'a [Unknown],
    pub(super) random: &'a [Random],
    pub(super) options: &'a Options,
    pub(super) work: Work<'a>,
}

/// The end of a search.
pub(super) struct Outcome {
    pub(super) fit: Fit,
    pub(super) simulated: usize,
    /// Clips simulated so far, and the loss then: mean squared residual in sigmas.
    pub(super) convergence: Vec<[f64; 2]>,
    pub(super) arrived: bool,
}

impl Run<'_> {
    /// Searches; `model` has the clips to be fitted, `first` those of them that a rough fit may begin with.
    pub(super) fn search<M: ClipModel>(&self, model: &M, first: &impl ClipModel) -> Result<Outcome, IdentifyError> {
        let Options { optimizer, budget, seed, .. } = *self.options;
        let points = match optimizer {
            Optimizer::LeastSquares => USUAL_LINEARISATIONS * (1 + self.unknowns.len()),
            _ => budget,
        };
        let watch = Watch::new(points * model.clips(), self.work.interrupt);
        let start = search::start(self.unknowns);
        let outcome = match optimizer {
            Optimizer::LeastSquares => self.least_squares(&watch, model, first),
            Optimizer::Swarm => self.without_slopes(&watch, model, Swarm::new(&start, seed)),
            Optimizer::Evolution => self.without_slopes(&watch, model, Evolution::new(&start, seed)),
        };
        stopped(self.work)?;
        outcome
    }

    fn least_squares<M: ClipModel>(
        &self,
        watch: &Watch<'_>,
        model: &M,
        first: &impl ClipModel,
    ) -> Result<Outcome, IdentifyError> {
        let Self { unknowns, random, work: Work { kept, interrupt }, .. } = *self;
        let all = Watched { model, watch };
        type Way = (Underway, Vec<[f64; 2]>);
        let (now, way): Way = match kept.known(&Fingerprint::of("way")) {
            Some(known) => known,
            None => {
                let mut start: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
                if first.clips() < model.clips() {
                    let few = Watched { model: first, watch };
                    let (from, schedule) =
                        (Place::at_rest(start, random, first.clips()), Schedule::of(STEPS_OF_THE_ROUGH_FIT));
                    start = fit_from(&few, unknowns, random, from, &schedule, |_, _| !interrupt.asked())?.shared;
                }
                let start = Place::at_rest(start, random, model.clips());
                (begin(&all, (unknowns, random), &start, &Schedule::default())?, Vec::new())
            }
        };
        watch.already(way.last().map_or(0, |[simulated, _]| *simulated as usize));
        let way = Mutex::new(way);
        let fit = go_on(&all, (unknowns, random), now, &Schedule::default(), |now| {
            let mut way = way.lock().expect("no holder panics");
            // Once: what is gone on from stands there already.
            if way.len() < now.fit.history.len() {
                way.push([watch.simulated() as f64, now.fit.deviance()]);
            }
            kept.keep(&Fingerprint::of("way"), &(now, &*way));
            !interrupt.asked()
        })?;
        let rows = fit.clips.iter().map(|clip| clip.rows).sum::<usize>().max(1) as f64;
        let mut convergence = way.into_inner().expect("no holder panics");
        convergence.iter_mut().for_each(|point| point[1] /= rows);
        let arrived = fit.converged;
        Ok(Outcome { fit, simulated: watch.simulated(), convergence, arrived })
    }

    fn without_slopes<M: ClipModel>(
        &self,
        watch: &Watch<'_>,
        model: &M,
        mut search: impl Search,
    ) -> Result<Outcome, IdentifyError> {
        let all = Watched { model, watch };
        let Work { kept, interrupt } = self.work;
        let answers: Vec<Vec<f64>> = kept.known(&Fingerprint::of("answers")).unwrap_or_default();
        watch.already(answers.iter().map(Vec::len).sum::<usize>() * model.clips());
        let mut so_far = answers.clone();
        let found: Found = minimise(
            &mut search,
            self.unknowns,
            self.options.budget,
            &answers,
            |x| self.cost(&all, x),
            |costs, _| {
                if interrupt.asked() {
                    return false;
                }
                so_far.push(costs.to_vec());
                kept.keep(&Fingerprint::of("answers"), &so_far);
                true
            },
        );
        let best = Place::at_rest(found.numbers, self.random, model.clips());
        let mut simulated = 0;
        let point = |(costs, best): (&Vec<f64>, &f64)| {
            simulated += costs.len() * model.clips();
            [simulated as f64, *best]
        };
        let convergence = so_far.iter().zip(&found.history).map(point).collect();
        // No step: the clips linearised where the search ended, for the intervals.
        let fit = fit_from(&all, self.unknowns, self.random, best, &Schedule::of(0), |_, _| true)?;
        Ok(Outcome { fit, simulated: watch.simulated(), convergence, arrived: found.arrived })
    }

    /// Mean squared residual of all clips; the clips' nuisance parameters at zero.
    fn cost(&self, model: &impl ClipModel, shared: &[f64]) -> f64 {
        // To eliminate them takes slopes, which this search does without.
        let own = vec![0.0; self.random.len()];
        let (mut sum, mut rows, mut out) = (0.0, 0, Vec::new());
        for clip in 0..model.clips() {
            if model.residuals(clip, shared, &own, &mut out).is_err() {
                return f64::INFINITY;
            }
            sum += out.iter().map(|r| r * r).sum::<f64>();
            rows += out.len();
        }
        sum / rows.max(1) as f64
    }
}

/// The bar and the interruption of a search.
struct Watch<'a> {
    done: AtomicUsize,
    bar: Progress,
    interrupt: &'a Interrupt,
}

impl<'a> Watch<'a> {
    fn new(expected: usize, interrupt: &'a Interrupt) -> Self {
        let bar = Progress::new("identify", expected as u64);
        Self { done: AtomicUsize::new(0), bar, interrupt }
    }

    /// So many were simulated before the search was interrupted.
    fn already(&self, simulated: usize) {
        self.done.fetch_add(simulated, Ordering::Relaxed);
    }

    fn simulated(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Counts a clip that is to be simulated; once the user asked for the end none is.
    fn one_more(&self) -> Result<(), Impossible> {
        if self.interrupt.asked() {
            return Err(Impossible("interrupted".into()));
        }
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.show(done as u64, &format!("{done} clips simulated"));
        Ok(())
    }
}

/// A model whose evaluations move the bar and end with the interruption.
struct Watched<'a, M> {
    model: &'a M,
    watch: &'a Watch<'a>,
}

impl<M: ClipModel> ClipModel for Watched<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.watch.one_more()?;
        self.model.residuals(clip, shared, own, out)
    }

    fn stepped(
        &self,
        clip: usize,
        to: (&[f64], &[f64]),
        from: ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.watch.one_more()?;
        self.model.stepped(clip, to, from, out)
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(clip)
    }
}
