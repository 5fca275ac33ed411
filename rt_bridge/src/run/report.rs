//! The JSON answer of `rt_bridge run`.

use crate::recorder::Recorded;
use crate::rt::stats::LoopStats;
use crate::times::{Percentiles, Times};
use serde::Serialize;

/// What a run was like. Times in microseconds; what each is counted from stands in [`crate::rt::stats`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    pub cycles: u64,
    /// Deadlines that passed unused because the control thread woke too late.
    pub missed_cycles: u64,
    /// Cycles whose work took longer than their period.
    pub overruns: u64,
    /// States that did not come.
    pub lost_packets: u64,
    /// Cycles that never reached shared memory because the pump was too slow.
    pub dropped: u64,
    /// Commands that a torque limit held back.
    pub clamped: u64,
    pub wake_us: Percentiles,
    /// Execution time of a cycle.
    pub exec_us: Percentiles,
    /// From one cycle to the next.
    pub period_us: Percentiles,
    /// From a state's arrival to its lying on shared memory.
    pub age_us: Percentiles,
    /// What was recorded.
    pub recorded: Option<Recorded>,
    /// What went wrong with the arm or the recording, with the way out.
    pub faults: Vec<String>,
}

impl RunReport {
    pub(super) fn new(stats: &LoopStats, age: &Times, recorded: Option<Recorded>, faults: Vec<String>) -> Self {
        Self {
            cycles: stats.cycles,
            missed_cycles: stats.missed_cycles,
            overruns: stats.overruns,
            lost_packets: stats.lost_packets,
            dropped: stats.dropped,
            clamped: stats.clamped,
            wake_us: stats.wake.percentiles(),
            exec_us: stats.exec.percentiles(),
            period_us: stats.period.percentiles(),
            age_us: age.percentiles(),
            recorded,
            faults,
        }
    }
}
