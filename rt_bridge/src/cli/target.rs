//! `rt_bridge target`. What a person typed is looked at before anything moves; what is sent then are joints.

mod fingers;
mod goal;
mod way;

use super::{newest_state, stop_flag};
use anyhow::{Result, bail, ensure};
use clap::{Args, Subcommand};
use goal::{Goal, Place};
use shared_mem::answer;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::event::{Event, EventLevel};
use shared_mem::msg::target::ArmTarget;
use shared_mem::quantity::{number, numbers};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// How long a bridge may take to show its arm or its gripper.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a way may take.
const LONGEST: Duration = Duration::from_secs(60);
/// A target is repeated this often.
const PERIOD: Duration = Duration::from_millis(20);
/// Targets in a row without motion after which the arm has come to the end of its way.
const REST: u32 = 15;
/// Less than this is standing still [rad/s, m].
const REST_SPEED: f64 = 1e-5;

/// Send the arm or the fingers of a running bridge somewhere, as a stream of targets
///
/// With the cell, the goal and the way there are looked at before anything moves: reach, ranges, table, speeds. Joints without a
/// cell are looked at by the bridge, which knows the goal and not the way. The bridge plans the way within the limits of the arm.
/// The target is repeated fifty times a second until the arm is there; Ctrl-C ends the stream, and the bridge brakes the arm
/// 0.2 s later, and `rt_bridge stop` brakes it at once. docs/teleop.md has the messages.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge target joints 0,-0.6,0,-2.2,0,1.6,0.785 --speed 0.5\n  \
    rt_bridge target shift 0,0,0.05 --cell fr3\n  \
    rt_bridge target pose 0.4,0.1,0.4,0,1,0,0 --cell fr3 --json\n  \
    rt_bridge target fingers 0.03\n\n\
    JSON: stream, q_d [rad] and seconds, or width [m]; off_m, how far the flange is from the pose. Exit code 1 when the goal\n\
    or the way there is none that the arm can go, when it was refused, or when the arm does not get there.")]
pub struct TargetArguments {
    #[command(subcommand)]
    to: To,
    /// Share of each joint's highest speed, 0.02 to 1
    #[arg(long, value_name = "SHARE", global = true, default_value_t = 0.25, value_parser = share)]
    speed: f64,
    /// Answer with one JSON object
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum To {
    /// Positions of all joints
    #[command(after_help = "Examples:\n  rt_bridge target joints 0,-0.6,0,-2.2,0,1.6,0.785 --cell fr3")]
    Joints {
        /// One for each joint, with commas between them [rad]
        #[arg(value_name = "Q1,Q2,..", allow_hyphen_values = true, value_parser = positions)]
        q: Positions,
        /// The cell of the bridge, to look at the way before anything moves
        #[arg(long, value_name = "cell.toml")]
        cell: Option<PathBuf>,
    },
    /// A pose of the flange
    #[command(after_help = "Examples:\n  rt_bridge target pose 0.4,0.1,0.4,0,1,0,0 --cell fr3")]
    Pose {
        /// Position [m] and quaternion w, x, y, z in the base frame
        #[arg(value_name = "X,Y,Z,QW,QX,QY,QZ", allow_hyphen_values = true, value_parser = seven)]
        pose: [f64; 7],
        /// The cell of the bridge
        #[arg(long, value_name = "cell.toml")]
        cell: PathBuf,
    },
    /// So far from where the flange is commanded to be, along the base frame's axes
    #[command(after_help = "Examples:\n  rt_bridge target shift 0,0,0.05 --cell fr3")]
    Shift {
        /// Way along x, y, z [m]
        #[arg(value_name = "DX,DY,DZ", allow_hyphen_values = true, value_parser = three)]
        by: [f64; 3],
        /// The cell of the bridge
        #[arg(long, value_name = "cell.toml")]
        cell: PathBuf,
    },
    /// An opening of the gripper
    #[command(after_help = "Examples:\n  rt_bridge target fingers 0.03")]
    Fingers {
        /// Between the fingers [m], 0 to 0.5
        #[arg(value_name = "WIDTH", value_parser = width)]
        width: f64,
        /// The cell of the bridge, to look how far its gripper opens before anything moves
        #[arg(long, value_name = "cell.toml")]
        cell: Option<PathBuf>,
    },
}

fn share(text: &str) -> Result<f64, String> {
    number(text, 0.02..=1.0, "")
}

/// Of all joints [rad].
#[derive(Debug, Clone)]
struct Positions(Vec<f64>);

fn positions(text: &str) -> Result<Positions, String> {
    text.split(',').map(|part| number(part, -10.0..=10.0, "rad")).collect::<Result<_, _>>().map(Positions)
}

fn width(text: &str) -> Result<f64, String> {
    number(text, 0.0..=0.5, "m")
}

fn three(text: &str) -> Result<[f64; 3], String> {
    numbers(text, -2.0..=2.0, "m")
}

fn seven(text: &str) -> Result<[f64; 7], String> {
    let pose: [f64; 7] = numbers(text, -2.0..=2.0, "")?;
    let length = pose[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
    if (length - 1.0).abs() < 1e-2 { Ok(pose) } else { Err("give a quaternion of length 1 after the position".into()) }
}

impl TargetArguments {
    pub(super) fn execute(self) -> Result<()> {
        let stop = stop_flag(None)?;
        let node = Node::open("rt_bridge_target")?;
        if let To::Fingers { width, cell } = &self.to {
            return fingers::go(&node, (*width, cell.as_deref()), self.json, &stop);
        }
        let arm = ArmLine {
            states: node.subscriber(topics::ARM_STATE)?,
            events: node.subscriber(topics::EVENTS)?,
            targets: node.publisher(topics::ARM_TARGET)?,
        };
        let Some(first) = newest_state(&arm.states, PATIENCE)? else {
            bail!(
                "no bridge showed an arm within {} s; start one with `rt_bridge run --cell cell.toml --arm sim`",
                PATIENCE.as_secs()
            );
        };
        let goal = self.goal(&first)?;
        // An id that no other sender has: nanoseconds since this machine came up.
        let target =
            ArmTarget { stream: now_ns(), dof: first.dof, speed: self.speed, q: goal.q, ..ArmTarget::default() };
        let begin = Instant::now();
        let last = arm.go(&target, &stop)?;
        let seconds = begin.elapsed().as_secs_f64();
        let off = goal.off(&last.q_d);
        let q = &last.q_d[..(last.dof as usize).min(MAX_JOINTS)];
        if self.json {
            answer::json(&serde_json::json!({ "stream": target.stream, "q_d": q, "seconds": seconds, "off_m": off }))?;
        } else {
            let q: Vec<String> = q.iter().map(|q| format!("{q:.4}")).collect();
            answer::words(format!("at {} rad after {seconds:.1} s", q.join(", ")))?;
        }
        Ok(())
    }

    /// Where the joints are to go, looked at as far as is known. Nothing has moved where it is an error.
    fn goal(&self, first: &ArmState) -> Result<Goal> {
        match &self.to {
            To::Joints { q: Positions(q), cell: None } => Goal::unseen(q, first),
            To::Joints { q: Positions(q), cell: Some(cell) } => Place::of(cell, first)?.joints(q, self.speed),
            To::Pose { pose, cell } => Place::of(cell, first)?.pose(pose, self.speed),
            To::Shift { by, cell } => Place::of(cell, first)?.shifted(by, self.speed),
            To::Fingers { .. } => bail!("fingers are no arm"),
        }
    }
}

/// The way to a bridge's arm and what it says.
struct ArmLine {
    states: Subscriber<ArmState>,
    events: Subscriber<Event>,
    targets: Publisher<ArmTarget>,
}

impl ArmLine {
    /// Sends the target until the arm rests there, or was stopped.
    fn go(&self, target: &ArmTarget, stop: &AtomicBool) -> Result<ArmState> {
        let (begin, mut still) = (Instant::now(), 0);
        let name = format!("motion {} ", target.stream);
        while begin.elapsed() < LONGEST {
            ensure!(!stop.load(Ordering::Relaxed), "interrupted; the bridge brakes the arm");
            self.targets.send(&ArmTarget { stamp_ns: now_ns(), ..*target })?;
            thread::sleep(PERIOD);
            while let Some(event) = self.events.receive()? {
                let text = event.text().replace(&name, "this stream ").replace(name.trim_end(), "this stream");
                ensure!(event.level == EventLevel::Info || event.text() == text, "the bridge says: {text}");
            }
            let Some(state) = newest_state(&self.states, PATIENCE)? else {
                bail!("the bridge fell silent; start it again")
            };
            let ours = state.motion_id == target.stream;
            ensure!(
                !(ours && state.motion == MotionStatus::Braked),
                "the arm was braked; the bridge says why on /events"
            );
            let rests = ours && state.motion_played > REST && state.dq_d.iter().all(|dq| dq.abs() < REST_SPEED);
            still = if rests { still + 1 } else { 0 };
            if still >= REST {
                return self.leave(target.stream);
            }
        }
        bail!("the arm still moves after {} s; give it more --speed", LONGEST.as_secs())
    }

    /// Waits until the bridge has seen that the stream has ended, so that whoever comes next is not refused.
    fn leave(&self, stream: u64) -> Result<ArmState> {
        loop {
            let Some(state) = newest_state(&self.states, PATIENCE)? else {
                bail!("the bridge fell silent; start it again")
            };
            if state.motion_id != stream || state.motion != MotionStatus::Playing {
                return Ok(state);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_no_arm_has_are_refused() {
        assert!(seven("0.4,0,0.4,0,1,0,0").is_ok());
        assert!(seven("0.4,0,0.4,0,1,1,0").is_err_and(|why| why.contains("length 1")));
        assert!(three("0,0,nan").is_err() && share("2").is_err() && positions("0,inf").is_err() && width("3").is_err());
    }
}
