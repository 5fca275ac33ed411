//! The one way down a sum of squares: damped Gauss-Newton steps within bounds, tried with growing damping until one costs less.
//! What is fitted says what a place costs and how it is linearised ([`Problem`]); how it steps and when it stops is data
//! ([`Schedule`]).
//!
//! Slopes may take a simulation for every parameter, a step takes one. So a schedule may keep slopes from step to step, each time
//! corrected by what the step did (the secant update of Broyden 1965), for as long as steps bring most of what they promise.
//! Converged is only what slopes taken anew say is.

use super::bounded::bounded_step;
use super::problem::Impossible;
use nalgebra::{DMatrix, DVector};

/// Factor on the damping after a step that led down [1] (a tenth: Marquardt 1963).
const DAMPING_DOWN: f64 = 0.1;
/// Factor on it after one that did not [1]; a choice: few trials reach what is needed.
const DAMPING_UP: f64 = 20.0;
/// Range of the damping [1]: rounding below, no step at all above.
const MIN_DAMPING: f64 = 1e-9;
const MAX_DAMPING: f64 = 1e12;

/// How a fit steps, and when it stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Damping of the first trial, as a share of the information's diagonal [1].
    pub damping: f64,
    /// What it grows to at least after a trial that did not lead down [1].
    pub grown: f64,
    /// Most trials from one linearisation, with growing damping.
    pub trials: usize,
    /// Most steps.
    pub iterations: usize,
    /// A step that promises to lower the deviance by less is not taken, and the fit has converged; 1 is what noise alone moves.
    pub tolerance: f64,
    /// Slopes are kept after a step that brought at least this share of what it promised; `None`: all steps take them anew.
    pub secant: Option<f64>,
}

impl Default for Schedule {
    /// For clips whose residuals bend evenly, as those of an arm: damping below a thousandth changes no step that matters.
    fn default() -> Self {
        Self { damping: 1e-6, grown: 1e-3, trials: 12, iterations: 20, tolerance: 1e-3, secant: None }
    }
}

impl Schedule {
    /// The same with at most so many steps.
    pub fn of(iterations: usize) -> Self {
        Self { iterations, ..Self::default() }
    }

    /// The same where tools hit objects: trials cost roll-outs, and one that fails is seldom off by a little. Less damping than half of
    /// the diagonal moves what the clips show well as far as before, a thousand times as much moves nothing (choices).
    pub const fn over_hits(self) -> Self {
        Self { grown: 0.5, trials: 4, ..self }
    }
}

/// The deviance around a place: `cost + 2 g's + s'Hs` after a step `s`.
pub struct Quadratic {
    pub cost: f64,
    /// `H`, `P x P`.
    pub information: DMatrix<f64>,
    /// `g`, `P`.
    pub gradient: DVector<f64>,
    /// How far down (at most 0) and how far up each parameter may go.
    pub room: Vec<[f64; 2]>,
}

impl Quadratic {
    /// By how much a step lowers the cost where the clips are as linear as they look.
    fn promised(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(&self.information * step)))
    }
}

/// A step that is tried: the how many-th from this linearisation, from 0.
pub struct Trial<'a> {
    pub number: usize,
    pub step: &'a DVector<f64>,
    /// What costs as much is not taken, and need not be worked out to the end.
    pub below: f64,
}

/// What is fitted.
pub trait Problem {
    /// Values of the parameters, nuisance parameters with them.
    type Place;
    /// The clips linearised at a place.
    type Slopes;

    /// # Errors
    /// [`Impossible`] where the model has no answer.
    fn linearised(&mut self, place: &Self::Place) -> Result<Self::Slopes, Impossible>;

    /// Sees every point before a step from it; `false` ends the fit there.
    fn goes_on(&mut self, _at: &Self::Slopes, _damping: f64) -> bool {
        true
    }

    /// # Errors
    /// [`Impossible`] where the clips there cannot be squared.
    fn quadratic(&self, place: &Self::Place, at: &Self::Slopes) -> Result<Quadratic, Impossible>;

    /// By how much the squared residuals exceed their variances, at least 1: so much more does noise move of the deviance.
    fn excess(&self, _at: &Self::Slopes) -> f64 {
        1.0
    }

    /// By how much the nuisance parameters alone lower the deviance.
    fn promised_besides(&self, _at: &Self::Slopes) -> f64 {
        0.0
    }

    /// Where a step leads, nuisance parameters following, and what it costs there; `None` where there is no answer.
    fn stepped(&mut self, from: &Self::Place, at: &Self::Slopes, trial: Trial<'_>) -> Option<(Self::Place, f64)>;

    /// The slopes of one place moved to another by a secant update; `None` where they are to be taken anew.
    fn corrected(&self, _at: Self::Slopes, _from: &Self::Place, _to: &Self::Place) -> Option<Self::Slopes> {
        None
    }
}

/// A fit on its way.
pub struct Descent<P: Problem> {
    pub place: P::Place,
    /// The clips linearised there, where they are.
    pub slopes: Option<P::Slopes>,
    pub damping: f64,
}

/// Why a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No step from slopes taken at the place promises what the schedule asks for.
    Converged,
    /// None of the trials led down.
    Stuck,
    /// The schedule's iterations are spent, or the problem did not go on.
    Stopped,
}

/// Goes down from a place until no step is worth it.
///
/// # Errors
/// [`Impossible`] where a place to which a step led cannot be linearised.
pub fn descend<P: Problem>(problem: &mut P, now: &mut Descent<P>, schedule: &Schedule) -> Result<End, Impossible> {
    let (mut steps, mut kept) = (0, false);
    while steps < schedule.iterations {
        let slopes = match now.slopes.take() {
            Some(slopes) => slopes,
            None => problem.linearised(&now.place)?,
        };
        if !problem.goes_on(&slopes, now.damping) {
            now.slopes = Some(slopes).filter(|_| !kept);
            return Ok(End::Stopped);
        }
        let around = problem.quadratic(&now.place, &slopes)?;
        let enough = schedule.tolerance * problem.excess(&slopes) - problem.promised_besides(&slopes);
        let mut damping = now.damping;
        let tries = if kept { Schedule { trials: 1, ..*schedule } } else { *schedule };
        match step(problem, (&now.place, &slopes), &around, (&mut damping, enough), &tries) {
            Tried::Down { place, brought } => {
                steps += 1;
                let before = std::mem::replace(&mut now.place, place);
                let keeps = schedule.secant.is_some_and(|least| brought >= least);
                now.slopes = if keeps { problem.corrected(slopes, &before, &now.place) } else { None };
                (now.damping, kept) = (damping, now.slopes.is_some());
            }
            // With slopes that were kept: once more, with those of the place.
            _ if kept => kept = false,
            tried => {
                now.slopes = Some(slopes);
                return Ok(if matches!(tried, Tried::TooLittle) { End::Converged } else { End::Stuck });
            }
        }
    }
    now.slopes = now.slopes.take().filter(|_| !kept);
    Ok(End::Stopped)
}

enum Tried<T> {
    Down {
        place: T,
        /// Share of what it promised that it brought.
        brought: f64,
    },
    TooLittle,
    NoneDown,
}

/// The first step that leads down.
fn step<P: Problem>(
    problem: &mut P,
    (place, slopes): (&P::Place, &P::Slopes),
    around: &Quadratic,
    (damping, enough): (&mut f64, f64),
    schedule: &Schedule,
) -> Tried<P::Place> {
    let mut number = 0;
    while number < schedule.trials && *damping < MAX_DAMPING {
        let step = bounded_step(&around.information, &around.gradient, &around.room, *damping);
        let promised = around.promised(&step);
        // A step that leads up where many parameters come to their bounds at once is damped, not tried.
        if promised >= 0.0 {
            if promised < enough {
                return if number == 0 { Tried::TooLittle } else { Tried::NoneDown };
            }
            let there = problem.stepped(place, slopes, Trial { number, step: &step, below: around.cost });
            if let Some((place, cost)) = there.filter(|(_, cost)| *cost < around.cost) {
                *damping = (*damping * DAMPING_DOWN).max(MIN_DAMPING);
                return Tried::Down { place, brought: (around.cost - cost) / promised };
            }
            number += 1;
        }
        *damping = (*damping * DAMPING_UP).max(schedule.grown);
    }
    Tried::NoneDown
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(x^2 - 1)^2 + 1`: `r = x^2 - 1` has the slope `2 x`. Notes what is tried.
    struct Valley(Vec<f64>);

    impl Problem for Valley {
        type Place = f64;
        type Slopes = f64;

        fn linearised(&mut self, place: &f64) -> Result<f64, Impossible> {
            Ok(2.0 * place)
        }

        fn quadratic(&self, x: &f64, slope: &f64) -> Result<Quadratic, Impossible> {
            let r = x * x - 1.0;
            Ok(Quadratic {
                cost: r * r,
                information: DMatrix::from_element(1, 1, slope * slope),
                gradient: DVector::from_element(1, slope * r),
                room: vec![[-9.0, 9.0]],
            })
        }

        fn stepped(&mut self, from: &f64, _: &f64, trial: Trial<'_>) -> Option<(f64, f64)> {
            let x = from + trial.step[0];
            self.0.push(x);
            Some((x, (x * x - 1.0).powi(2)))
        }
    }

    fn from(place: f64, schedule: &Schedule) -> (Valley, Descent<Valley>, End) {
        let (mut valley, mut now) = (Valley(Vec::new()), Descent { place, slopes: None, damping: schedule.damping });
        let end = descend(&mut valley, &mut now, schedule).expect("an answer");
        (valley, now, end)
    }

    #[test]
    fn a_step_that_overshoots_is_damped_until_it_leads_down() {
        let (Valley(tried), now, _) = from(0.1, &Schedule::of(1));
        assert!(tried.len() > 1 && tried.windows(2).all(|pair| pair[1] < pair[0]), "{tried:?}");
        assert!((now.place * now.place - 1.0).abs() < 0.99 && now.damping > MIN_DAMPING, "{}", now.place);
    }

    #[test]
    fn after_a_trial_that_failed_the_damping_is_as_large_as_the_schedule_says() {
        let tried = |grown| from(0.1, &Schedule { grown, ..Schedule::of(1) }).0.0;
        let (little, much) = (tried(1e-3), tried(0.5));
        assert!(little[0] == much[0] && much[1] < 0.8 * much[0] && little[1] > 0.99 * little[0], "{little:?} {much:?}");
        assert!(much.len() < little.len(), "{little:?} {much:?}");
    }

    #[test]
    fn what_promises_too_little_is_not_tried() {
        let (Valley(tried), now, end) = from(1.000_1, &Schedule::default());
        assert_eq!((tried.len(), now.place, end), (0, 1.000_1, End::Converged));
    }

    #[test]
    fn a_fit_comes_to_the_minimum() {
        let (_, now, end) = from(0.1, &Schedule { tolerance: 1e-12, ..Schedule::default() });
        assert!((now.place - 1.0).abs() < 1e-6 && end == End::Converged, "{} {end:?}", now.place);
    }
}
