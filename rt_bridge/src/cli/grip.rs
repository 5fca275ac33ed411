//! `rt_bridge grip`.

use anyhow::{Result, bail};
use clap::{Args, Subcommand};
use shared_mem::answer;
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use shared_mem::quantity::number;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Subscriber};
use std::thread;
use std::time::{Duration, Instant};

/// How long a bridge may take to show its gripper.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long the fingers may take; finding their range takes several seconds.
const LONGEST: Duration = Duration::from_secs(30);
/// States in a row without motion after which the fingers have come to the end of what they were commanded. A gripper reports
/// fifty times a second, and takes an order before its next report.
const REST: u32 = 35;
/// Less than this is standing still [m].
const REST_MOTION: f64 = 2e-4;
/// How far the fingers may rest from where they were to go [m]: grippers count in steps of up to 0.6 mm.
const REACHED: f64 = 2e-3;
/// Pause between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(10);

/// Tell the gripper of a running bridge what to do, and wait until its fingers rest
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge grip home\n  rt_bridge grip move 0.03 --speed 0.05\n  \
    rt_bridge grip grasp 0.04 --grip-force 40 --json\n\n\
    JSON: width, width_d [m], force [N] (null where the gripper does not tell), grasped, fault. Exit code 1 when the gripper\n\
    cannot open as wide, or holds nothing after `grasp`.")]
pub struct GripArguments {
    #[command(subcommand)]
    order: Order,
    /// Answer with one JSON object
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Order {
    /// Open or close to a width
    #[command(after_help = "Examples:\n  rt_bridge grip move 0.03 --speed 0.05")]
    Move {
        /// Between the fingers [m], 0 to 0.5: 0.03 is 30 mm
        #[arg(value_name = "WIDTH", value_parser = width)]
        width: f64,
        /// How fast [m/s], 0.001 to 1. Default: as fast as it goes
        #[arg(long, value_name = "SPEED", value_parser = speed)]
        speed: Option<f64>,
    },
    /// Close until something of about this width is held
    #[command(after_help = "Examples:\n  rt_bridge grip grasp 0.04 --grip-force 40 --json")]
    Grasp {
        /// Of the object [m], 0 to 0.5: 0.03 is 30 mm
        #[arg(value_name = "WIDTH", value_parser = width)]
        width: f64,
        /// How hard [N], 0.1 to 500. Default: as gently as it can
        #[arg(long = "grip-force", alias = "force", value_name = "FORCE", value_parser = force)]
        force: Option<f64>,
    },
    /// Stay where the fingers are
    #[command(after_help = "Examples:\n  rt_bridge grip stop")]
    Stop,
    /// Find out how far the fingers go; they open and close once
    #[command(after_help = "Examples:\n  rt_bridge grip home")]
    Home,
}

/// An opening [m]: the widest that a cell.toml can describe is half a metre.
fn width(text: &str) -> Result<f64, String> {
    number(text, 0.0..=0.5, "m")
}

/// A finger's speed [m/s]: the fastest gripper that is known goes at a quarter of the highest.
fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.001..=1.0, "m/s")
}

/// A gripping force [N]: the strongest gripper that is known has half the largest.
fn force(text: &str) -> Result<f64, String> {
    number(text, 0.1..=500.0, "N")
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
            bail!(
                "no bridge showed a gripper within {} s; start one with `rt_bridge run --cell cell.toml --arm sim --gripper sim` (a real one: --gripper serial:///dev/ttyUSB0 or fci://HOST)",
                PATIENCE.as_secs()
            );
        }
        let order = self.order.command();
        orders.send(&order)?;
        let state = rest(&states, order.stamp_ns)?;
        let grasped = state.grasped != 0;
        if self.json {
            let GripperState { width, width_d, force, fault, .. } = state;
            let json = serde_json::json!({
                "width": width, "width_d": width_d, "force": force.is_finite().then_some(force), "grasped": grasped, "fault": fault,
            });
            answer::json(&json)?;
        } else {
            let held = if grasped { ", and hold something" } else { "" };
            answer::words(format!("the fingers are {:.1} mm apart{held}", 1e3 * state.width))?;
        }
        self.order.unmet(&state).map_or(Ok(()), |why| bail!(why))
    }
}

impl Order {
    fn command(&self) -> GripperCommand {
        let command = GripperCommand { stamp_ns: now_ns(), ..GripperCommand::default() };
        match *self {
            Self::Move { width, speed } => GripperCommand { width, speed: speed.unwrap_or(0.0), ..command },
            Self::Grasp { width, force } => {
                GripperCommand { action: GripperAction::Grasp, width, force: force.unwrap_or(0.0), ..command }
            }
            Self::Stop => GripperCommand { action: GripperAction::Stop, ..command },
            Self::Home => GripperCommand { action: GripperAction::Home, ..command },
        }
    }
}

impl Order {
    /// What of the order the gripper did not do, now that its fingers rest.
    fn unmet(&self, state: &GripperState) -> Option<String> {
        match *self {
            Self::Move { width, .. } if (state.width_d - width).abs() > REACHED => Some(format!(
                "this gripper opens no further than {:.3} m and was asked for {width} m; ask for less, for example `rt_bridge grip move {:.3}`",
                state.width_d,
                0.5 * state.width_d
            )),
            Self::Grasp { width, .. } if state.grasped == 0 => Some(format!(
                "nothing is held: nothing of about {width} m was between the fingers, which are {:.3} m apart; put it there, or give its width in metres",
                state.width
            )),
            Self::Move { width, .. } if (state.width - width).abs() > REACHED => Some(format!(
                "the fingers rest {:.3} m apart and not {width} m: something is in the way, or the gripper opens no further; try `rt_bridge grip home`",
                state.width
            )),
            _ => None,
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
        thread::sleep(POLL_PERIOD);
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
        if state.stamp_ns < ordered_ns || (state.width - stands).abs() >= REST_MOTION || stands.is_nan() {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grasp_of_nothing_and_an_opening_beyond_the_gripper_are_no_success() {
        let state = |width: f64, width_d: f64, grasped: u32| GripperState {
            width,
            width_d,
            grasped,
            ..GripperState::default()
        };
        let open = |width: f64| Order::Move { width, speed: None };
        let grasp = Order::Grasp { width: 0.04, force: None };
        assert_eq!(open(0.03).unmet(&state(0.0301, 0.03, 0)), None);
        let beyond = open(0.3).unmet(&state(0.08, 0.08, 0)).expect("a gripper opens 80 mm");
        assert!(beyond.contains("no further than 0.080 m") && beyond.contains("asked for 0.3 m"), "{beyond}");
        let blocked = open(0.01).unmet(&state(0.04, 0.01, 0)).expect("something is in the way");
        assert!(blocked.contains("rest 0.040 m apart"), "{blocked}");
        assert_eq!(grasp.unmet(&state(0.0405, 0.04, 1)), None);
        let nothing = grasp.unmet(&state(0.0, 0.04, 0)).expect("nothing is held");
        assert!(nothing.starts_with("nothing is held") && nothing.contains("0.04 m"), "{nothing}");
        assert_eq!(Order::Home.unmet(&state(0.08, 0.08, 0)), None);
    }

    #[test]
    fn numbers_that_no_gripper_has_are_refused_with_range_and_unit() {
        for wrong in ["30", "-0.01", "nan", "inf"] {
            assert_eq!(width(wrong), Err("give a number from 0 to 0.5 [m]".into()), "{wrong}");
        }
        assert_eq!(force("1e9"), Err("give a number from 0.1 to 500 [N]".into()));
        assert_eq!(speed("0"), Err("give a number from 0.001 to 1 [m/s]".into()));
        assert_eq!((width("0.03"), force("40"), speed("0.05")), (Ok(0.03), Ok(40.0), Ok(0.05)));
    }
}
