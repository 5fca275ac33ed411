//! How well the loop kept time.
//!
//! | number | from | to |
//! |---|---|---|
//! | wake-up latency | the deadline (device-clocked: the earliest arrival the device's own clock allows) | the thread runs |
//! | execution time | the state is there | the command was handed over and the cycle pushed to the pump |
//! | period | one cycle's begin | the next one's |
//! | age | `stamp_ns` of a state | the state lies on shared memory, its readers were woken |

use crate::times::Times;

/// Counts and times of one run of the control thread.
#[derive(Debug, Clone, Default)]
pub struct LoopStats {
    /// States received and answered, or only received after a fault.
    pub cycles: u64,
    /// Deadlines that passed unused because the thread woke too late.
    pub missed_cycles: u64,
    /// Cycles whose work took longer than a period.
    pub overruns: u64,
    /// States that did not come, or that the device's clock shows to be missing.
    pub lost_packets: u64,
    /// Cycles that the pump was too slow to take.
    pub dropped: u64,
    /// Commands whose torque was held back by its limit or its rate.
    pub clamped: u64,
    /// Wake-up latency.
    pub wake: Times,
    /// Execution time.
    pub exec: Times,
    /// Period.
    pub period: Times,
}

/// How late the packets of a device-clocked arm arrive, against the earliest one seen: its clock and ours differ by an
/// unknown offset and drift, so the reference is the smallest offset of late, forgotten at 50 us a second.
#[derive(Debug, Clone, Copy, Default)]
pub struct ArrivalLine {
    offset_ns: Option<i64>,
    last_device_ns: u64,
}

/// Clocks of robot and machine drift apart by less than this [ns of offset per ns].
const DRIFT: f64 = 50e-6;

impl ArrivalLine {
    /// How long after the earliest possible moment this packet came [ns].
    pub fn late_ns(&mut self, arrived_ns: u64, device_ns: u64) -> u64 {
        let offset = arrived_ns.cast_signed() - device_ns.cast_signed();
        let elapsed = device_ns.saturating_sub(self.last_device_ns);
        self.last_device_ns = device_ns;
        let reference = match self.offset_ns {
            Some(old) => offset.min(old + (elapsed as f64 * DRIFT) as i64),
            None => offset,
        };
        self.offset_ns = Some(reference);
        u64::try_from(offset - reference).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateness_is_counted_from_the_earliest_arrival_whatever_the_offset_of_the_clocks() {
        let mut line = ArrivalLine::default();
        let ms = 1_000_000;
        assert_eq!(line.late_ns(900 * ms + 40_000, 5 * ms), 0);
        assert_eq!(line.late_ns(901 * ms, 6 * ms), 0);
        assert_eq!(line.late_ns(902 * ms + 250_000, 7 * ms) / 1000, 249);
    }
}
