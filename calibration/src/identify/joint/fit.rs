//! Friction and damping of all motions together, how sure they are, and what is not identifiable from the motions.

use super::model::{Motion, Motions, best_fit};
use super::noise::Noise;
use inference::estimate::interval::LEVEL;
use inference::estimate::{ClipFit, Fit, Intervals, Schedule, Unknown, score};
use inference::statistics::student;

/// A number is not identifiable if its interval, to either side, is more than this share of what slows the part in all (a choice): the
/// other may as well be what does.
const MAX_INTERVAL_SHARE: f64 = 0.5;

/// Friction and damping of a joint.
pub(super) struct Found {
    pub(super) fit: Fit,
    pub(super) unknowns: [Unknown; 2],
    pub(super) intervals: Intervals,
    /// Half the 95 % intervals.
    pub(super) half: [f64; 2],
    /// Mean speed of the motions [rad/s or m/s].
    speed: f64,
}

impl Found {
    /// Both numbers from all motions, seen through such noise.
    pub(super) fn of(motions: &[Motion], noise: &Noise) -> Option<Self> {
        let model = Motions(motions);
        let unknowns = model.unknowns();
        let fit = best_fit(motions)?;
        // Neither is negative, and one that is found to be 0 is as uncertain as any other.
        let intervals = Intervals::new(&fit, &[false; 2], LEVEL);
        // Rows that share their noise count as fewer, and what is left beyond noise counts as noise.
        let wider = (fit.misfit() * noise.lasts()).sqrt();
        let t = student(LEVEL, intervals.witnesses.saturating_sub(1));
        let rows: f64 = motions.iter().map(|motion| noise.independent(motion.times.len())).sum();
        // Each motion has a start of two numbers, and all have two in common.
        let free = rows as usize;
        let of_rows = student(LEVEL, free.saturating_sub(2 * motions.len() + 2).max(1));
        let half = std::array::from_fn(|k| {
            let of_noise = of_rows * intervals.model_sigma[k] * wider;
            if intervals.half_width[k].is_finite() {
                of_noise.max(t * intervals.witness_sigma[k])
            } else {
                f64::INFINITY
            }
        });
        let way: f64 = motions.iter().map(Motion::travel).sum();
        let time: f64 = motions.iter().map(Motion::duration).sum();
        Some(Self { fit, unknowns, intervals, half, speed: way / time.max(1e-9) })
    }

    /// What slows the part at its mean speed [N m or N], and half its 95 % interval.
    fn slows(&self) -> [f64; 2] {
        let [friction, damping] = self.numbers();
        let [a, b] = [self.half[0], self.half[1] * self.speed];
        let together = 2.0 * self.intervals.correlation[(0, 1)] * a * b;
        [friction + damping * self.speed, (a * a + b * b + together).max(0.0).sqrt()]
    }

    /// Whether the motions tell what slows the part in all, if not by which of the two.
    pub(super) fn tells_sum(&self) -> bool {
        let [slows, half] = self.slows();
        half <= MAX_INTERVAL_SHARE * slows
    }

    /// Why a number is not identifiable.
    pub(super) fn open(&self, k: usize) -> Option<&'static str> {
        if self.fit.shared[k] > 0.5 * self.unknowns[k].upper {
            return Some("the part stops from one pose to the next; record more poses a second, or push harder");
        }
        let [slows, _] = self.slows();
        let half = self.half[k] * if k == 0 { 1.0 } else { self.speed };
        if half <= MAX_INTERVAL_SHARE * slows {
            return None;
        }
        Some(if self.tells_sum() {
            "the motions tell what slows the part in all, not which of the two does; let it move farther, from pushes of different strength"
        } else {
            "the part hardly loses speed by either over these motions; let it move farther"
        })
    }

    /// 95 % interval of one of them.
    pub(super) fn interval(&self, k: usize) -> [f64; 2] {
        let (value, half) = (self.fit.shared[k], self.half[k]);
        if half.is_finite() { [(value - half).max(0.0), value + half] } else { [0.0, f64::INFINITY] }
    }

    pub(super) fn numbers(&self) -> [f64; 2] {
        [self.fit.shared[0], self.fit.shared[1]]
    }
}

/// Every motion with given numbers, its own start at its best.
pub(super) fn scored(motions: &[Motion], numbers: [f64; 2]) -> Option<Vec<ClipFit>> {
    score(&Motions(motions), &numbers, &Motions::own(), &Schedule::default()).ok()
}

/// Every motion with what the others say; nothing where there is only one.
pub(super) fn held_out(motions: &[Motion]) -> Option<Vec<ClipFit>> {
    let without = |k: usize| -> Vec<Motion> {
        motions.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, motion)| motion.clone()).collect()
    };
    if motions.len() < 2 {
        return None;
    }
    let one = |k: usize| {
        let fit = best_fit(&without(k))?;
        scored(&motions[k..=k], [fit.shared[0], fit.shared[1]])?.pop()
    };
    (0..motions.len()).map(one).collect()
}
