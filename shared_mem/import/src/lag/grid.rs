//! Velocities of two motions on one even grid of time, as lags are told from. Single rows that jump away and back are no motion.

use super::Motion;
use shared_mem::statistics::median;

/// Most samples of a motion: longer ones are sampled more coarsely. Finest time between samples [s].
const SAMPLES: f64 = 4000.0;
const FINEST: f64 = 5e-3;
/// A row jumps where it is this many times farther from the line between its neighbours than 9 of 10 rows are...
const JUMPS: f64 = 10.0;
/// ...and its neighbours are as near to each other as this share of the jump [1].
const BACK: f64 = 0.3;
/// Lags are searched this far both ways [s], but no further than this share of the shorter motion [1].
const FARTHEST: f64 = 3.0;
const SHARE: f64 = 0.4;

/// Velocities of joints on an even grid; NaN where there are none.
pub(super) struct Velocities {
    pub(super) dof: usize,
    values: Vec<f64>,
}

impl Velocities {
    pub(super) fn row(&self, at: usize) -> Option<&[f64]> {
        self.values.get(at * self.dof..(at + 1) * self.dof).filter(|row| row[0].is_finite())
    }

    pub(super) fn len(&self) -> usize {
        self.values.len() / self.dof
    }

    pub(super) fn joint(&self, joint: usize) -> Self {
        Self { dof: 1, values: self.values.iter().skip(joint).step_by(self.dof).copied().collect() }
    }

    pub(super) fn speeds(&self) -> Self {
        let speed = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut values: Vec<f64> = self.values.chunks_exact(self.dof).map(speed).collect();
        let known = || values.iter().copied().filter(|v| v.is_finite());
        let mean = known().sum::<f64>() / known().count().max(1) as f64;
        values.iter_mut().for_each(|v| *v -= mean);
        Self { dof: 1, values }
    }

    /// Squared speeds of all samples.
    pub(super) fn energy(&self) -> f64 {
        self.values.iter().filter(|v| v.is_finite()).map(|v| v * v).sum()
    }
}

/// Both motions on one grid.
pub(super) struct Grid {
    pub(super) step: f64,
    /// Lags that are searched, each way [samples].
    pub(super) most: isize,
    pub(super) told: Velocities,
    pub(super) done: Velocities,
}

impl Grid {
    /// Velocities are taken over so many steps before and behind each sample.
    pub(super) fn of(told: Motion<'_>, done: Motion<'_>, window: f64) -> Option<Self> {
        if told.t.len() < 8 || done.t.len() < 8 || told.q.len() != done.q.len() || told.q.is_empty() {
            return None;
        }
        let ends = [told, done].map(|motion| [motion.t[0], motion.t[motion.t.len() - 1]]);
        let (from, to) = (ends[0][0].min(ends[1][0]), ends[0][1].max(ends[1][1]));
        let shorter = ends.iter().map(|[from, to]| to - from).fold(f64::INFINITY, f64::min);
        let steps = [told, done].map(|motion| usual_step(motion.t));
        let step = FINEST.max(0.5 * steps[0]).max(0.5 * steps[1]).max((to - from) / SAMPLES);
        let most = (FARTHEST.min(SHARE * shorter) / step) as isize;
        if !(step.is_finite() && shorter > 0.0 && most > 1) {
            return None;
        }
        let [told_q, done_q] = [told, done].map(|motion| motion.q.iter().map(|q| without_jumps(q)).collect::<Vec<_>>());
        let (told, done) = (Motion { q: &told_q, ..told }, Motion { q: &done_q, ..done });
        let [told, done] = [(told, steps[0]), (done, steps[1])].map(|(motion, own)| {
            // Over the time of a few rows, so that noise and the steps of an encoder do not hide the motion.
            velocities(motion, (from, to, step), window * step.max(own))
        });
        Some(Self { step, most, told, done })
    }
}

/// The usual time between rows [s]; 0 of fewer than two.
pub fn usual_step(t: &[f64]) -> f64 {
    median(t.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0)).unwrap_or(0.0)
}

/// Positions whose single rows that jump away and back are put between their neighbours.
fn without_jumps(q: &[f64]) -> Vec<f64> {
    let between = |i: usize| 0.5 * (q[i - 1] + q[i + 1]);
    let mut bends: Vec<f64> = (1..q.len().saturating_sub(1)).map(|i| (q[i] - between(i)).abs()).collect();
    bends.sort_by(f64::total_cmp);
    let most = JUMPS * bends.get(bends.len() * 9 / 10).copied().unwrap_or(0.0);
    let mut smooth = q.to_vec();
    for i in 1..q.len().saturating_sub(1) {
        let bend = (q[i] - between(i)).abs();
        if bend > most && (q[i + 1] - q[i - 1]).abs() < BACK * bend {
            smooth[i] = between(i);
        }
    }
    smooth
}

fn velocities(motion: Motion<'_>, (from, to, step): (f64, f64, f64), half: f64) -> Velocities {
    let (first, last) = (motion.t[0], motion.t[motion.t.len() - 1]);
    let count = ((to - from) / step) as usize + 1;
    let at = |i: usize| {
        let t = from + i as f64 * step;
        let (a, b) = (t - half, t + half);
        // Over less time at the ends velocities would not be those of the same motion elsewhere.
        let inside = a >= first && b <= last;
        let velocity = move |q: &Vec<f64>| {
            if inside { (between_rows(motion.t, q, b) - between_rows(motion.t, q, a)) / (b - a) } else { f64::NAN }
        };
        motion.q.iter().map(velocity)
    };
    let mut values: Vec<f64> = (0..count).flat_map(at).collect();
    // A row in which one joint is unknown tells nothing.
    for row in values.chunks_exact_mut(motion.q.len()) {
        if !row.iter().all(|v| v.is_finite()) {
            row.fill(f64::NAN);
        }
    }
    Velocities { dof: motion.q.len(), values }
}

/// A joint's position at a time within the rows, on the straight line between two of them.
fn between_rows(t: &[f64], values: &[f64], at: f64) -> f64 {
    let next = t.partition_point(|t| *t < at).min(t.len() - 1);
    let Some(before) = next.checked_sub(1).filter(|before| t[next] > t[*before]) else { return values[next] };
    values[before] + (at - t[before]) / (t[next] - t[before]) * (values[next] - values[before])
}
