//! An object that slides on by itself. Nearly all the time of a stroke's simulation goes into the arm, and once its tool
//! has let go and is led away the object feels nothing of it: the arm is taken out, and watched only where commands would
//! have it. Should they lead the tool back to the object, the run goes on from the parting with the arm.

use super::cell::CLEAR;
use super::{CellRollout, CommandTrack};

/// A tool that commands lead may be so much later than they are: looks over that time [ns], this far apart [ns].
const LATE_NS: u64 = 100_000_000;
const LOOK_NS: u64 = 25_000_000;

/// An arm that was taken out of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parted {
    /// How far from where it is commanded the tool may be [m].
    slack: f64,
}

impl CellRollout {
    /// Takes the arm out where its tool is clear of the object, both where it is and where commands have it, by more than
    /// its tracking error bridges. `None` where it is not; the arm stays then.
    pub fn part(&mut self, commands: &CommandTrack) -> Option<Parted> {
        let gap = self.cell().gap_at(&self.cell().q());
        let commanded = self.least_commanded_gap(commands);
        // A cell without a tool has no gap that ever closes.
        let slack = if gap.is_finite() { 2.0 * (commanded - gap).abs() } else { 0.0 };
        if gap.min(commanded) <= CLEAR + slack {
            return None;
        }
        self.part_arm();
        Some(Parted { slack })
    }

    /// Whether commands still lead the tool of an arm that was taken out clear of the object. Look every few periods;
    /// where they do not, go on from [`CellRollout::rejoin`].
    #[must_use]
    pub fn keeps_apart(&self, parted: Parted, commands: &CommandTrack) -> bool {
        self.least_commanded_gap(commands) > CLEAR + parted.slack
    }

    /// Smallest gap between the object now and the tool where it was commanded to be a moment ago or is now [m].
    fn least_commanded_gap(&self, commands: &CommandTrack) -> f64 {
        let now_ns = self.now_ns();
        let looks = (0..=LATE_NS / LOOK_NS).map(|k| now_ns.saturating_sub(k * LOOK_NS));
        looks.map(|ns| self.cell().gap_at(commands.q_d(commands.at(ns)))).fold(f64::INFINITY, f64::min)
    }
}
