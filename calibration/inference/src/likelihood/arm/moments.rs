//! A clip that was prepared and admitted before, looked at at moments: single rows of all that was logged, each with the control period
//! to which its torques belong.

use super::clip::{ArmClip, Run, desired_rows};
use super::{is_tracking, stamps};
use crate::likelihood::object;
use shared_mem::cell::Cell;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::Clip;
use shared_mem::time::TICK_NS;
use twin::control::CommandTrack;

/// At most so many moments of a clip count [1]; more would cost time and, in smooth motion, tell little.
const MOMENTS: usize = 250;
/// Within this time the simulated arm settles on a measured motion: fifteen time constants of the law that keeps it there [ns].
const SETTLED_NS: u64 = 50_000_000;
/// From this time on it does not matter how fast the arm was when its clip begins [ns]. No log has that better than its velocities
/// are measured, and a controller's damping makes of 1 mrad/s eighty times what the torque asked for is computed to; within 80 ms
/// less than one sigma is left of it (an FR3 with and without gears that yield).
const BEGUN_NS: u64 = 80_000_000;
/// The twin is asked for what it reads at a moment, and a control period later: some logs have the torque that acts from a row on.
pub(super) const ASKED: usize = 2;

impl ArmClip {
    /// `None` without commands. `asked_for`: whether the torques that were asked for count: then rows without one do not.
    pub(super) fn at_moments(recorded: Clip, cell: &Cell, asked_for: bool) -> Option<Self> {
        let commands = CommandTrack::of_cell(&recorded.desired, cell)?;
        let alone_until_ns = object::alone_until(cell, &recorded);
        let stamps = &recorded.measured.stamps_ns;
        // The last command holds for as long as that before it did.
        let [.., before, last] = recorded.desired.stamps_ns[..] else { return None };
        let used = stamps.partition_point(|stamp| *stamp < alone_until_ns.min(last + (last - before).max(1)));
        let stride = used.div_ceil(MOMENTS).max(1);
        // What acted in the period before the first state is not known: neither are its torques.
        let unknown = if is_tracking(cell) { SETTLED_NS } else { BEGUN_NS };
        let first = *stamps.first()?;
        let begun = stamps.partition_point(|stamp| *stamp < first + unknown);
        let known = begun.max(usize::from(recorded.torques_end_at_rows));
        let desired = if asked_for { desired_rows(&recorded) } else { Vec::new() };
        let complete = |row: &usize| !asked_for || desired[*row].is_some();
        let rows: Vec<usize> = (known..used).step_by(stride).filter(complete).collect();
        let asked_ns: Vec<u64> = rows.iter().flat_map(|row| [stamps[*row], stamps[*row] + TICK_NS]).collect();
        Some(Self {
            bins: (0..rows.len()).map(|row| row..row + 1).collect(),
            runs: vec![Run { from: 0, asked: 0..asked_ns.len() }],
            desired_rows: rows.iter().filter_map(|row| desired.get(*row).copied().flatten()).collect(),
            rows,
            asked_ns,
            alone_until_ns,
            dead: [false; MAX_JOINTS],
            given: None,
            warnings: Vec::new(),
            jitter: stamps::jitter(&recorded.measured),
            stretch: 0,
            pieces: Vec::new(),
            seconds: 0.0,
            recorded,
            commands,
        })
    }
}
