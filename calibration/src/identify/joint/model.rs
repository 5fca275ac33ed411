//! What friction and damping make of motions of a part, as residuals.
//!
//! Each motion has its own start, position and velocity, which its rows alone say: eliminated with priors so wide that they say nothing.

use super::noise::Noise;
use inference::estimate::{ClipModel, Fit, Impossible, Place, Random, Schedule, Unknown, fit_from};
use inference::statistics::extent;
use twin::world::LoneJoint;

/// Prior scatter of a motion's start, one sigma in those of its noise [1]: so wide that it says nothing (a choice).
const START_SIGMA: f64 = 1e4;
/// Difference steps (choices): of the start in sigmas of noise, of friction and damping as a share of what stops the part within the
/// motion.
const START_STEP: f64 = 0.1;
const FRICTION_STEP: f64 = 1e-3;

/// Witnesses of the intervals in a motion: what residuals of neighbouring rows share, by noise that lasts or a law that is not quite
/// theirs, counts once (a choice).
const WITNESSES: usize = 5;

/// The line through some positions: its slope, and the standard deviation of that for positions of one; none through one moment.
pub(super) struct Line {
    /// Mean of the times, and of the positions.
    middle: [f64; 2],
    pub(super) slope: f64,
    pub(super) deviation: f64,
}

impl Line {
    pub(super) fn through(times: &[f64], positions: &[f64]) -> Self {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (t, q) = (mean(times), mean(positions));
        let along: f64 = times.iter().map(|time| (time - t).powi(2)).sum();
        let with: f64 = times.iter().zip(positions).map(|(time, position)| (time - t) * (position - q)).sum();
        let (slope, deviation) = if along > 0.0 { (with / along, along.sqrt().recip()) } else { (0.0, f64::INFINITY) };
        Self { middle: [t, q], slope, deviation }
    }

    /// Whether the slope is more than noise of `sigma` makes it so many standard deviations long.
    pub(super) fn is_steeper(&self, sigma: f64) -> bool {
        self.slope.abs() > sigma * self.deviation
    }
}

/// From the lowest of some values to the highest.
pub(super) fn travel(values: &[f64]) -> f64 {
    let [low, high] = extent(values.iter().copied());
    high - low
}

/// A part that moves by itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    /// Since the first row [s].
    pub(super) times: Vec<f64>,
    /// [rad or m]
    pub(super) positions: Vec<f64>,
    /// Standard deviation of a position [rad or m].
    pub(super) sigma: f64,
    /// The part; its friction and damping are of no account.
    pub(super) joint: LoneJoint,
}

/// Stretches whose mean residual must be that of noise, and by how many standard deviations it may be off, as the mean square may
/// (choices).
const STRETCHES: usize = 6;
const SIGMAS_OF_DISAGREEMENT: f64 = 3.5;
/// Fewest rows from which a start is read (a choice).
const ROWS_OF_A_START: usize = 3;

impl Motion {
    pub(super) fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// From the lowest position to the highest [rad or m].
    pub(super) fn travel(&self) -> f64 {
        travel(&self.positions)
    }

    /// Mean time between rows [s].
    fn tick(&self) -> f64 {
        self.duration() / (self.times.len().max(2) - 1) as f64
    }

    /// Where a fit of its start begins: a line through its first rows.
    fn start(&self) -> [f64; 2] {
        // Over so short a part friction hardly bends the way.
        let rows = (self.times.len() / 8).max(ROWS_OF_A_START).min(self.times.len());
        let Line { middle: [t, q], slope, .. } = Line::through(&self.times[..rows], &self.positions[..rows]);
        [q - slope * t, slope]
    }

    /// Positions with this friction and damping, and a start that lies so far from [`Self::start`], in sigmas.
    pub(super) fn predicted(&self, [friction, damping]: [f64; 2], own: &[f64]) -> Vec<f64> {
        let [position, velocity] = self.start();
        let duration = self.duration().max(1e-9);
        let mut state = (position + own[0] * self.sigma, velocity + own[1] * self.sigma / duration);
        let mut joint = self.joint;
        (joint.friction, joint.damping) = (friction, damping);
        let mut now = 0.0;
        let row = |time: &f64| {
            if *time > now {
                state = joint.after(state, time - now);
                now = *time;
            }
            state.0
        };
        self.times.iter().map(row).collect()
    }

    /// How far what this friction and damping leave is beyond what noise leaves, as a share of what is allowed: at most 1 where they
    /// agree.
    pub(super) fn disagreement(&self, numbers: [f64; 2], own: &[f64], noise: &Noise) -> f64 {
        let predicted = self.predicted(numbers, own);
        let off: Vec<f64> =
            self.positions.iter().zip(&predicted).map(|(measured, p)| (measured - p) / self.sigma).collect();
        let rows = off.len();
        let square = off.iter().map(|x| x * x).sum::<f64>() / rows as f64;
        // A mean square of n independent residuals scatters by the root of 2 / n.
        let in_all = square / (1.0 + SIGMAS_OF_DISAGREEMENT * (2.0 / noise.independent(rows)).sqrt());
        let stretches = STRETCHES.min(rows / 3).max(1);
        off.chunks(rows.div_ceil(stretches)).fold(in_all, |most, stretch| {
            let mean = stretch.iter().sum::<f64>() / stretch.len() as f64;
            most.max(mean.abs() * noise.independent(stretch.len()).sqrt() / SIGMAS_OF_DISAGREEMENT)
        })
    }

    /// Friction that stops the part within so many seconds, with no other resistance, and the damping whose time constant they are.
    fn stopping(&self, seconds: f64) -> [f64; 2] {
        let speed = self.travel() / self.duration().max(1e-9);
        [self.joint.inertia * speed / seconds, self.joint.inertia / seconds]
    }
}

/// Motions of one joint.
pub(super) struct Motions<'a>(pub(super) &'a [Motion]);

impl Motions<'_> {
    /// Friction and damping, from nothing to what stops the part from one row to the next.
    pub(super) fn unknowns(&self) -> [Unknown; 2] {
        let largest = |of: fn(&Motion) -> [f64; 2]| {
            self.0.iter().map(of).fold([0.0_f64; 2], |[a, b], [c, d]| [a.max(c), b.max(d)])
        };
        let whole = largest(|motion| motion.stopping(motion.duration().max(1e-9)));
        let upper = largest(|motion| motion.stopping(motion.tick().max(1e-9)));
        let held = self.0.iter().flat_map(|motion| motion.positions.iter().map(|q| motion.joint.load(*q).abs()));
        let held = held.fold(0.0, f64::max);
        let unknown = |name: &str, k: usize, more: f64| Unknown {
            name: name.into(),
            start: 0.3 * whole[k],
            lower: 0.0,
            upper: upper[k] + more,
            step: FRICTION_STEP * whole[k],
        };
        [unknown("dry_friction", 0, 2.0 * held), unknown("viscous_friction", 1, 0.0)]
    }

    /// The nuisance parameters of each motion: its start.
    pub(super) fn own() -> [Random; 2] {
        ["position at the start", "velocity at the start"].map(|name| Random {
            name: name.into(),
            sigma: START_SIGMA,
            step: START_STEP,
        })
    }
}

impl ClipModel for Motions<'_> {
    fn clips(&self) -> usize {
        self.0.len()
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        let rows = self.0[clip].times.len();
        (1..=WITNESSES).map(|k| rows * k / WITNESSES).collect()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let motion = &self.0[clip];
        let predicted = motion.predicted([shared[0], shared[1]], own);
        out.clear();
        out.extend(
            motion.positions.iter().zip(&predicted).map(|(measured, predicted)| (measured - predicted) / motion.sigma),
        );
        if out.iter().all(|residual| residual.is_finite()) {
            Ok(())
        } else {
            Err(Impossible("the part flies away".into()))
        }
    }
}

/// The best fit of both numbers to motions, from a start at which the one prevails and one at which the other does: they imitate each
/// other.
pub(super) fn best_fit(motions: &[Motion]) -> Option<Fit> {
    let (model, own) = (Motions(motions), Motions::own());
    let unknowns = model.unknowns();
    let fits = [[1.0, 0.1], [0.1, 1.0]].iter().filter_map(|shares| {
        let start = unknowns.iter().zip(shares).map(|(unknown, share)| unknown.start * share).collect();
        let start = Place::at_rest(start, &own, motions.len());
        fit_from(&model, &unknowns, &own, start, &Schedule::default(), |_, _| true).ok()
    });
    fits.min_by(|a, b| a.deviance().total_cmp(&b.deviance()))
}
