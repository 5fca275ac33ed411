//! The clock of all stamps: `CLOCK_MONOTONIC`, shared by every process of the machine, in nanoseconds since boot.
//!
//! It never jumps, so differences between stamps of different processes are ages. A recording stores the offset to
//! Unix time once, in its metadata, so that files of different days sort.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Period of the control loop [ns]: the Franka Control Interface runs at 1 kHz, and whatever plays its part with it.
pub const TICK_NS: u64 = 1_000_000;
/// The same [s].
pub const TICK: f64 = 1e-3;

/// Nanoseconds of the machine's monotonic clock.
///
/// `std::time::Instant` reads the same clock but hides its value, which two processes need to compare.
pub fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    u64::try_from(now.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(now.tv_nsec).unwrap_or(0)
}

/// What has to be added to a monotonic stamp to get Unix time, as of now.
pub fn unix_offset_ns() -> i64 {
    let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    i64::try_from(unix.as_nanos()).unwrap_or(i64::MAX) - i64::try_from(now_ns()).unwrap_or(i64::MAX)
}

/// Seconds between two stamps, negative when `later` lies before `earlier`.
///
/// ```
/// use shared_mem::time::{TICK_NS, now_ns, seconds_between};
///
/// assert_eq!(seconds_between(2 * TICK_NS, 5 * TICK_NS), 3e-3);
/// let start = now_ns();
/// assert!(seconds_between(start, now_ns()) >= 0.0, "the clock of all stamps never jumps");
/// ```
pub fn seconds_between(earlier_ns: u64, later_ns: u64) -> f64 {
    if later_ns >= earlier_ns {
        (later_ns - earlier_ns) as f64 * 1e-9
    } else {
        -((earlier_ns - later_ns) as f64 * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_advances_and_differences_keep_their_sign() {
        let a = now_ns();
        let b = now_ns();
        assert!(b >= a);
        assert!((seconds_between(5_000_000_000, 2_000_000_000) + 3.0).abs() < 1e-12);
        assert!((seconds_between(2_000_000_000, 5_000_000_000) - 3.0).abs() < 1e-12);
    }
}
