//! One search over clips: by least squares or without slopes, with a bar, and so that Ctrl-C loses nothing: what was
//! found so far lies in a file beside the answer, and the same command goes on from there.

use crate::estimate::search;
use crate::estimate::{
    ClipModel, Evolution, Fit, Found, Impossible, Options, Random, Search, Swarm, Unknown, fit_from, minimise,
};
use crate::interrupt::Interrupt;
use serde::{Deserialize, Serialize};
use shared_mem::input;
use shared_mem::output::{self, OutputError};
use shared_mem::progress::Progress;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Ways of searching.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Optimizer {
    /// Bounded least squares on rollouts.
    #[default]
    LeastSquares,
    /// A particle swarm.
    Swarm,
    /// Covariance matrix adaptation.
    Evolution,
}

impl Optimizer {
    /// Name on command lines and in answers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "least-squares",
            Self::Swarm => "pso",
            Self::Evolution => "cma",
        }
    }
}

/// Linearisations that a fit usually takes: for the bar alone.
const USUAL_LINEARISATIONS: usize = 4;

/// What a search is given.
pub(super) struct Run<'a> {
    pub(super) unknowns: &'a [Unknown],
    pub(super) random: &'a [Random],
    pub(super) optimizer: Optimizer,
    pub(super) seed: u64,
    /// Points whose cost a search without slopes may ask for.
    pub(super) budget: usize,
    /// What is searched where: a file of another search is not gone on from.
    pub(super) fingerprint: String,
    pub(super) state: Option<&'a Path>,
    pub(super) interrupt: &'a Interrupt,
}

/// The end of a search.
pub(super) struct Outcome {
    pub(super) fit: Fit,
    /// Clips simulated.
    pub(super) simulated: usize,
    /// Clips simulated so far, and the loss then: mean squared residual in sigmas.
    pub(super) convergence: Vec<[f64; 2]>,
    pub(super) arrived: bool,
}

/// A search ended without an answer.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The model.
    #[error("the twin cannot be simulated: {0}; check the values of cell.toml and --parameters")]
    Impossible(#[from] Impossible),
    /// Ctrl-C.
    #[error("interrupted{}", .0.as_ref().map_or_else(
        || "; with --out FILE it would have been kept".to_owned(),
        |state| format!("; the same command goes on from {}", state.display())
    ))]
    Interrupted(Option<PathBuf>),
    /// Ctrl-C behind the search.
    #[error("interrupted before the answer was written; start again")]
    Ended,
    /// The state cannot be kept.
    #[error(transparent)]
    State(#[from] OutputError),
}

/// What is kept of an unfinished search.
#[derive(Debug, Default, Serialize, Deserialize)]
struct State {
    fingerprint: String,
    shared: Option<Vec<f64>>,
    told: Vec<Vec<f64>>,
}

impl Run<'_> {
    /// Searches; `model` has the clips to be fitted, `first` those of them that a rough fit may begin with.
    pub(super) fn search<M: ClipModel>(&self, model: &M, first: &impl ClipModel) -> Result<Outcome, RunError> {
        let state = self.read_state();
        let per_point = model.clips();
        let expected = match self.optimizer {
            Optimizer::LeastSquares => USUAL_LINEARISATIONS * (1 + self.unknowns.len()) * per_point,
            _ => self.budget * per_point,
        };
        let watch = Watch::new(expected, self.interrupt);
        let outcome = match self.optimizer {
            Optimizer::LeastSquares => self.least_squares(&watch, model, first, state),
            Optimizer::Swarm => {
                let swarm = Swarm::new(&search::start(self.unknowns), self.seed);
                self.without_slopes(&watch, model, swarm, state)
            }
            Optimizer::Evolution => {
                let evolution = Evolution::new(&search::start(self.unknowns), self.seed);
                self.without_slopes(&watch, model, evolution, state)
            }
        };
        if self.interrupt.asked() {
            return Err(RunError::Interrupted(self.state.map(Path::to_owned)));
        }
        if let (Some(path), Ok(_)) = (self.state, &outcome) {
            // A state that is not there need not be removed.
            let _ = std::fs::remove_file(path);
        }
        outcome
    }

    fn least_squares<M: ClipModel>(
        &self,
        watch: &Watch<'_>,
        model: &M,
        first: &impl ClipModel,
        state: State,
    ) -> Result<Outcome, RunError> {
        let start: Vec<f64> = self.unknowns.iter().map(|unknown| unknown.start).collect();
        let own = |model: &dyn Fn() -> usize| vec![vec![0.0; self.random.len()]; model()];
        let shared = match state.shared {
            Some(shared) => shared,
            None if first.clips() < model.clips() => {
                let few = Watched { model: first, watch };
                let options = Options { iterations: 3, ..Options::default() };
                let from = (start, own(&|| first.clips()));
                fit_from(&few, self.unknowns, self.random, from, &options, |_, _| !self.interrupt.asked())?.shared
            }
            None => start,
        };
        let (convergence, failed) = (Mutex::new(Vec::new()), Mutex::new(None));
        let all = Watched { model, watch };
        let rows = AtomicUsize::new(1);
        let from = (shared, own(&|| model.clips()));
        let fit = fit_from(&all, self.unknowns, self.random, from, &Options::default(), |deviance, shared| {
            let point = [watch.simulated() as f64, deviance];
            convergence.lock().expect("no holder panics").push(point);
            let kept = State { shared: Some(shared.to_vec()), told: Vec::new(), fingerprint: self.fingerprint.clone() };
            if let Err(error) = self.keep(&kept) {
                *failed.lock().expect("no holder panics") = Some(error);
                return false;
            }
            !self.interrupt.asked()
        })?;
        if let Some(error) = failed.into_inner().expect("no holder panics") {
            return Err(error);
        }
        rows.store(fit.clips.iter().map(|clip| clip.rows).sum::<usize>().max(1), Ordering::Relaxed);
        let rows = rows.into_inner() as f64;
        let mut convergence = convergence.into_inner().expect("no holder panics");
        convergence.iter_mut().for_each(|point| point[1] /= rows);
        let arrived = fit.converged;
        Ok(Outcome { fit, simulated: watch.simulated(), convergence, arrived })
    }

    fn without_slopes<M: ClipModel>(
        &self,
        watch: &Watch<'_>,
        model: &M,
        mut search: impl Search,
        mut state: State,
    ) -> Result<Outcome, RunError> {
        let all = Watched { model, watch };
        let told = std::mem::take(&mut state.told);
        state = State { fingerprint: self.fingerprint.clone(), shared: None, told: told.clone() };
        let mut failed = None;
        let mut convergence = Vec::new();
        let found: Found = minimise(
            &mut search,
            self.unknowns,
            self.budget,
            &told,
            |x| self.cost(&all, x),
            |costs, best| {
                if self.interrupt.asked() {
                    return false;
                }
                state.told.push(costs.to_vec());
                convergence.push([watch.simulated() as f64, best.cost]);
                failed = self.keep(&state).err();
                failed.is_none()
            },
        );
        if let Some(error) = failed {
            return Err(error);
        }
        let own = vec![vec![0.0; self.random.len()]; model.clips()];
        let once = Options { iterations: 0, ..Options::default() };
        let fit = fit_from(&all, self.unknowns, self.random, (found.numbers, own), &once, |_, _| true)?;
        Ok(Outcome { fit, simulated: watch.simulated(), convergence, arrived: found.arrived })
    }

    /// Mean squared residual of all clips; the clips' own numbers at zero.
    fn cost(&self, model: &impl ClipModel, shared: &[f64]) -> f64 {
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

    /// The numbers that an interrupted search of another kind kept.
    pub(super) fn kept_numbers(&self) -> Option<Vec<f64>> {
        self.read_state().shared.filter(|shared| shared.len() == self.unknowns.len())
    }

    /// Keeps numbers for [`Run::kept_numbers`].
    pub(super) fn keep_numbers(&self, shared: &[f64]) -> Result<(), RunError> {
        let shared = Some(shared.to_vec());
        self.keep(&State { shared, told: Vec::new(), fingerprint: self.fingerprint.clone() })
    }

    /// The end of a search of another kind: its state is not needed any more, unless it was interrupted.
    pub(super) fn finished(&self) -> Result<(), RunError> {
        if self.interrupt.asked() {
            return Err(RunError::Interrupted(self.state.map(Path::to_owned)));
        }
        if let Some(path) = self.state {
            // A state that is not there need not be removed.
            let _ = std::fs::remove_file(path);
        }
        Ok(())
    }

    fn read_state(&self) -> State {
        let read = |path: &Path| serde_json::from_slice::<State>(&input::bytes(path, input::Kind::List).ok()?).ok();
        self.state.and_then(read).filter(|state| state.fingerprint == self.fingerprint).unwrap_or_default()
    }

    fn keep(&self, state: &State) -> Result<(), RunError> {
        let Some(path) = self.state else { return Ok(()) };
        Ok(output::write(path, serde_json::to_vec(state).expect("numbers have a JSON form"))?)
    }
}

/// The bar and the interruption of a search.
struct Watch<'a> {
    done: AtomicUsize,
    expected: usize,
    began: Instant,
    bar: Progress,
    interrupt: &'a Interrupt,
}

impl<'a> Watch<'a> {
    fn new(expected: usize, interrupt: &'a Interrupt) -> Self {
        let bar = Progress::new("identify", expected as u64);
        Self { done: AtomicUsize::new(0), expected, began: Instant::now(), bar, interrupt }
    }

    fn simulated(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    fn one_more(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let seconds = self.began.elapsed().as_secs_f64();
        let left = seconds / done as f64 * self.expected.saturating_sub(done) as f64;
        self.bar.show(done.min(self.expected) as u64, &format!("{done} clips simulated, about {left:.0} s left"));
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
        if self.watch.interrupt.asked() {
            return Err(Impossible("interrupted".into()));
        }
        let answer = self.model.residuals(clip, shared, own, out);
        self.watch.one_more();
        answer
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(clip)
    }
}
