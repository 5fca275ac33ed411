//! A control loop without an arm: how late it wakes.

use super::Finding;
use crate::rt::deadline::Grid;
use crate::rt::idle::ShallowIdle;
use crate::rt::process;
use crate::times::{Percentiles, Times, in_words};
use shared_mem::time::now_ns;

/// Cycles of the test: two seconds.
const CYCLES: u32 = 2000;
/// Wake-up latency that leaves a millisecond's work its time [us].
const GOOD_US: f64 = 150.0;

pub(super) fn examine() -> (Finding, Percentiles) {
    let times = std::thread::spawn(measure).join().unwrap_or_default();
    let wake = times.percentiles();
    let found = format!("wakes {} late (p99.9 of {CYCLES}), at worst {}", in_words(wake.p999), in_words(wake.max));
    let finding = if wake.p999.is_some_and(|us| us <= GOOD_US) {
        Finding::ok("wake-up", found)
    } else {
        let remedy = "close other programs; a real-time kernel, the performance governor and an isolated core help, in this order";
        Finding::warning("wake-up", found, remedy).delaying()
    };
    (finding, wake)
}

fn measure() -> Times {
    let mut times = Times::new();
    // Where any of it is not granted, the test shows what the bridge would get.
    let _shallow_idle = ShallowIdle::hold();
    process::set_exact_timers();
    let _granted = process::set_fifo(process::CONTROL_PRIORITY);
    let _bound = process::last_core().map(process::pin_to);
    let mut grid = Grid::new(now_ns(), 1_000_000);
    for _ in 0..CYCLES {
        process::sleep_until(grid.next_ns());
        times.record(grid.woke(now_ns()).late_ns);
    }
    times
}
