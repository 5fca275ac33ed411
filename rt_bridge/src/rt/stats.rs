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
    pub wake: Times,
    pub exec: Times,
    pub period: Times,
}

/// How late the packets of a device-clocked arm arrive. The clocks of device and machine have an unknown offset, and may
/// drift (a simulated robot that falls behind does so by per cents), so the reference is the earliest arrival among the
/// last 50 to 100 packets.
#[derive(Debug, Clone, Copy, Default)]
pub struct ArrivalLine {
    /// Smallest `arrival - device clock` of the half window before [ns].
    before_ns: Option<i64>,
    /// The same of the half window under way [ns].
    now_ns: Option<i64>,
    /// Packets in the half window under way.
    count: u32,
}

/// Packets in half a window.
const HALF_WINDOW: u32 = 50;

impl ArrivalLine {
    /// How long after the earliest possible moment this packet came [ns].
    pub fn late_ns(&mut self, arrived_ns: u64, device_ns: u64) -> u64 {
        let offset = arrived_ns.cast_signed() - device_ns.cast_signed();
        if self.count == HALF_WINDOW {
            *self = Self { before_ns: self.now_ns, now_ns: None, count: 0 };
        }
        self.count += 1;
        let smallest = self.now_ns.map_or(offset, |smallest| smallest.min(offset));
        self.now_ns = Some(smallest);
        let reference = self.before_ns.map_or(smallest, |before| before.min(smallest));
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
        assert_eq!(line.late_ns(902 * ms + 250_000, 7 * ms), 250_000);
    }

    #[test]
    fn a_device_whose_clock_falls_behind_is_not_ever_later() {
        let mut line = ArrivalLine::default();
        // One per mille slow: each packet a microsecond later than its counter says.
        let worst = (0..10_000).map(|k| line.late_ns(1_001_000 * k, 1_000_000 * k)).max();
        assert!(worst < Some(101_000), "{worst:?}");
    }
}
