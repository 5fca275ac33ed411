//! The control thread: asks the machine for real time, then turns the cycle until it is asked to stop.

use super::Realtime;
use super::cycle::{Cycle, Turn};
use super::deadline::Grid;
use super::process;
use super::stats::LoopStats;
use crate::arm::Clock;
use crate::remark::Claim;
use crate::remark::Remark;
use shared_mem::time::now_ns;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Longest time an orderly stop may take [ns]: braking takes at most half a second.
const STOP_PATIENCE_NS: u64 = 2_000_000_000;

/// Real time was demanded and not granted.
#[derive(Debug, thiserror::Error)]
#[error(
    "the machine does not grant real time: {0}; raise the limits `rtprio` and `memlock` for this user (`rt_bridge doctor` tells how), or accept a lesser clock with `--realtime ignore`"
)]
pub struct NotRealtime(Claim);

/// Starts the thread, which returns what it measured. It runs until `stop` is set, the arm is lost or its recording ends.
///
/// # Errors
/// The operating system's, when no thread can be made.
pub fn spawn(
    mut cycle: Cycle,
    realtime: Realtime,
    stop: Arc<AtomicBool>,
) -> std::io::Result<JoinHandle<Result<LoopStats, NotRealtime>>> {
    std::thread::Builder::new().name("control".into()).spawn(move || {
        let claim = Claim::make();
        if realtime == Realtime::Enforce && !claim.is_complete() {
            return Err(NotRealtime(claim));
        }
        if !claim.is_complete() {
            cycle.tell(Remark::LesserClock(claim));
        }
        process::prefault_stack();
        Ok(run(cycle, &stop))
    })
}

fn run(mut cycle: Cycle, stop: &AtomicBool) -> LoopStats {
    let mut turn = cycle.take_command();
    let mut grid = match cycle.clock() {
        Clock::Timer { period_ns } => Some(Grid::new(now_ns(), period_ns)),
        Clock::Device => None,
    };
    let mut stop_by = None;
    while turn == Turn::Continue {
        if stop.load(Ordering::Relaxed) {
            let deadline = *stop_by.get_or_insert_with(|| {
                cycle.begin_stop();
                now_ns() + STOP_PATIENCE_NS
            });
            if cycle.is_at_rest() || now_ns() > deadline {
                break;
            }
        }
        let wake = grid.as_mut().map(|grid| {
            process::sleep_until(grid.next_ns());
            grid.woke(now_ns())
        });
        turn = cycle.turn(wake);
    }
    cycle.finish()
}
