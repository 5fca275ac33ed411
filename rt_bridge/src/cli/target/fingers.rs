//! `rt_bridge target fingers`.

use super::{LONGEST, PATIENCE, PERIOD, REST, REST_SPEED};
use anyhow::{Result, bail, ensure};
use shared_mem::answer;
use shared_mem::cell::Cell;
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::target::GripperTarget;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Subscriber};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

/// Sends the fingers to a width until they rest; nothing moves where the cell's gripper does not open so far.
pub(super) fn go(node: &Node, (width, cell): (f64, Option<&Path>), json: bool, stop: &AtomicBool) -> Result<()> {
    if let Some(cell) = cell {
        check(width, cell)?;
    }
    let states: Subscriber<GripperState> = node.subscriber(topics::GRIPPER)?;
    let targets = node.publisher(topics::GRIPPER_TARGET)?;
    let (stream, begin) = (now_ns(), Instant::now());
    let (mut stands, mut still) = (f64::NAN, 0);
    let mut heard = begin;
    while begin.elapsed() < LONGEST {
        ensure!(!stop.load(Ordering::Relaxed), "interrupted; the fingers stay where they were sent");
        targets.send(&GripperTarget { stamp_ns: now_ns(), stream, width, ..GripperTarget::default() })?;
        thread::sleep(PERIOD);
        let Some(state) = states.newest()? else {
            let silent = heard.elapsed() > PATIENCE;
            ensure!(
                !silent,
                "no bridge shows a gripper; start one with `rt_bridge run --cell cell.toml --arm sim --gripper sim`"
            );
            continue;
        };
        heard = Instant::now();
        still = if (state.width - stands).abs() < REST_SPEED { still + 1 } else { 0 };
        stands = state.width;
        if still >= 2 * REST {
            if json {
                answer::json(&serde_json::json!({ "stream": stream, "width": state.width }))?;
            } else {
                answer::words(format!("the fingers are {:.1} mm apart", 1e3 * state.width))?;
            }
            let off = (state.width - width).abs();
            ensure!(
                off < 2e-3,
                "the fingers rest {:.1} mm from that: something is in the way, or another sender moves them",
                1e3 * off
            );
            return Ok(());
        }
    }
    bail!("the fingers still move after {} s; stop them with `rt_bridge grip stop`", LONGEST.as_secs())
}

fn check(width: f64, cell: &Path) -> Result<()> {
    let Some(gripper) = Cell::read(cell)?.gripper else {
        bail!("{} has no [gripper]; give the bridge's own cell, or leave --cell out", cell.display());
    };
    let widest = gripper.widest();
    ensure!(
        width <= widest,
        "nothing moved: this gripper opens to {widest} m and was asked for {width} m; ask for less"
    );
    Ok(())
}
