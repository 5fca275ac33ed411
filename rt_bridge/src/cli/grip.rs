//! `rt_bridge grip`.

use anyhow::{Result, bail};
use clap::{Args, Subcommand};
use shared_mem::answer;
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Subscriber};
use std::thread;
use std::time::{Duration, Instant};

/// How long a bridge may take to show its gripper.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long the fingers may take; finding their range takes several seconds.
const LONGEST: Duration = Duration::from_secs(30);
/// States in a row without motion after which the fingers have come to the end of what they were told. A gripper reports
/// fifty times a second, and takes an order before its next report.
const REST: u32 = 35;
/// Less than this is standing still [m].
const STILL: f64 = 2e-4;
/// Pause between two looks.
const LOOK: Duration = Duration::from_millis(10);

/// Tell the gripper of a running bridge what to do, and wait until its fingers rest
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge grip home\n  rt_bridge grip move 0.03 --speed 0.05\n  \
    rt_bridge grip grasp 0.04 --force 40 --json\n\n\
    JSON: width, width_d [m], force [N], grasped, fault.")]
pub(super) struct GripArguments {
    #[command(subcommand)]
    order: Order,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Order {
    /// Open or close to a width
    Move {
        /// Between the fingers [m]
        width: f64,
        /// How fast [m/s]. Default: as fast as it goes
        #[arg(long, default_value_t = 0.0, hide_default_value = true)]
        speed: f64,
    },
    /// Close until something of about this width is held
    Grasp {
        /// Of the object [m]
        width: f64,
        /// How hard [N]. Default: as gently as it can
        #[arg(long, default_value_t = 0.0, hide_default_value = true)]
        force: f64,
    },
    /// Stay where the fingers are
    Stop,
    /// Find out how far the fingers go; they open and close once
    Home,
}

impl GripArguments {
    pub(super) fn execute(self) -> Result<()> {
        let node = Node::open("rt_bridge_grip")?;
        let states = node.subscriber(topics::GRIPPER)?;
        let orders = node.publisher(topics::GRIPPER_COMMAND)?;
        let first = next(&states, PATIENCE)?;
        for ignored in node.newly_ignored() {
            tracing::warn!("{ignored}");
        }
        if first.is_none() {
            bail!("no bridge shows a gripper; start one with `rt_bridge run --gripper ...`");
        }
        let order = self.order.command();
        orders.send(&order)?;
        let state = rest(&states, order.stamp_ns)?;
        let grasped = state.grasped != 0;
        if self.json {
            let GripperState { width, width_d, force, fault, .. } = state;
            let json = serde_json::json!({
                "width": width, "width_d": width_d, "force": force, "grasped": grasped, "fault": fault,
            });
            answer::json(&json)?;
        } else {
            let held = if grasped { ", and hold something" } else { "" };
            answer::words(format!("the fingers are {:.1} mm apart{held}", 1e3 * state.width))?;
        }
        Ok(())
    }
}

impl Order {
    fn command(&self) -> GripperCommand {
        let command = GripperCommand { stamp_ns: now_ns(), ..GripperCommand::default() };
        match *self {
            Self::Move { width, speed } => GripperCommand { width, speed, ..command },
            Self::Grasp { width, force } => GripperCommand { action: GripperAction::Grasp, width, force, ..command },
            Self::Stop => GripperCommand { action: GripperAction::Stop, ..command },
            Self::Home => GripperCommand { action: GripperAction::Home, ..command },
        }
    }
}

/// The next state, waiting for one if need be.
fn next(states: &Subscriber<GripperState>, patience: Duration) -> Result<Option<GripperState>> {
    let begin = Instant::now();
    while begin.elapsed() < patience {
        if let Some(state) = states.receive()? {
            return Ok(Some(state));
        }
        thread::sleep(LOOK);
    }
    Ok(None)
}

/// Waits until the fingers stand still after an order of this moment.
fn rest(states: &Subscriber<GripperState>, ordered_ns: u64) -> Result<GripperState> {
    let begin = Instant::now();
    let (mut stands, mut still) = (f64::NAN, 0);
    while begin.elapsed() < LONGEST {
        let Some(state) = next(states, PATIENCE)? else {
            bail!("the gripper fell silent; the bridge says why");
        };
        if state.stamp_ns < ordered_ns || (state.width - stands).abs() >= STILL || stands.is_nan() {
            (stands, still) = (state.width, 0);
            continue;
        }
        still += 1;
        if still >= REST {
            return Ok(state);
        }
    }
    bail!("the fingers still move after {} s; stop them with `rt_bridge grip stop`", LONGEST.as_secs())
}
