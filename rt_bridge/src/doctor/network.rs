//! The way to the robot.

use super::Finding;
use crate::arm::{Arm, ArmFault, Read};
use crate::fr3;
use crate::rt::Realtime;
use crate::rt::stats::ArrivalLine;
use crate::times::{Times, in_words};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmMode, ArmState};

/// States that are watched: one second.
const STATES: u32 = 1000;
/// Lateness that leaves the control loop its share of the millisecond [us].
const GOOD_US: f64 = 400.0;

/// Connects as `run` does and watches the robot's states for a second, without commanding it.
pub(super) fn robot(host: &str) -> Finding {
    let watched = fr3::connect(host, Realtime::Ignore, &Cell::default())
        .map_err(|e| e.to_string())
        .and_then(|mut arm| watch(arm.as_mut()).map_err(|e| e.to_string()));
    match watched {
        Ok(line) => line.finding(host),
        Err(text) => {
            let (found, remedy) = text.split_once("; ").unwrap_or((&text, "look at the robot's web page"));
            Finding::problem("robot", found, remedy)
        }
    }
}

/// What the states of a second say about the line.
struct Line {
    mode: ArmMode,
    lost: u64,
    late: Times,
}

fn watch(arm: &mut dyn Arm) -> Result<Line, ArmFault> {
    let (mut state, mut arrival, mut last_ns) = (ArmState::default(), ArrivalLine::default(), 0);
    let mut line = Line { mode: ArmMode::Other, lost: 0, late: Times::new() };
    for _ in 0..STATES {
        if arm.read(&mut state)? != Read::Fresh {
            continue;
        }
        if last_ns != 0 {
            line.lost += (state.device_ns.saturating_sub(last_ns) / 1_000_000).saturating_sub(1);
        }
        last_ns = state.device_ns;
        line.mode = state.mode;
        line.late.record(arrival.late_ns(state.stamp_ns, state.device_ns));
    }
    Ok(line)
}

impl Line {
    fn finding(&self, host: &str) -> Finding {
        let late = self.late.percentiles();
        let found = format!(
            "{host} speaks FCI version 10, is in mode {:?}; {} states, {} lost, {} late (p99), at worst {}",
            self.mode,
            self.late.count(),
            self.lost,
            in_words(late.p99),
            in_words(late.max)
        );
        if !matches!(self.mode, ArmMode::Idle | ArmMode::Move) {
            let remedy = "release the user stop, unlock the joints and activate FCI in the robot's web page";
            return Finding::problem("robot", found, remedy);
        }
        if self.lost > 0 || late.p99.is_none_or(|us| us > GOOD_US) {
            let remedy =
                "connect it directly, without switch or Wi-Fi: state, computing and command share one millisecond";
            return Finding::warning("robot", found, remedy).delaying();
        }
        Finding::ok("robot", found)
    }
}
