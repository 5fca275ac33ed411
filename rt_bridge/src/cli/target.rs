//! `rt_bridge target`.

use super::stop_flag;
use anyhow::{Result, bail, ensure};
use clap::{Args, Subcommand};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use shared_mem::answer;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::event::{Event, EventLevel};
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::target::{ArmTarget, GripperTarget, TargetKind};
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::quantity::{number, numbers};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use twin::arm::ArmModel;

/// How long a bridge may take to show its arm or its gripper.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a way may take.
const LONGEST: Duration = Duration::from_secs(60);
/// A target is repeated this often.
const PERIOD: Duration = Duration::from_millis(20);
/// Targets in a row without motion after which the arm has come to the end of its way.
const REST: u32 = 15;
/// Less than this is standing still [rad/s, m].
const STILL: f64 = 1e-5;
/// How far the arm may rest from where it was to go [m].
const REACHED: f64 = 1e-3;

/// Send the arm or the fingers of a running bridge somewhere, as a stream of targets
///
/// The bridge plans the way within the limits of the arm. The target is repeated fifty times a second until the arm is there;
/// Ctrl-C ends the stream, and the bridge brakes the arm 0.2 s later. docs/teleop.md has the messages.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge target joints 0,-0.6,0,-2.2,0,1.6,0.785 --speed 0.5\n  \
    rt_bridge target shift 0,0,0.05 --cell config/fr3_cell.toml\n  \
    rt_bridge target pose 0.4,0.1,0.4,0,1,0,0 --cell config/fr3_cell.toml --json\n  \
    rt_bridge target fingers 0.03\n\n\
    JSON: stream, q_d [rad] and seconds, or width [m]; off_m, how far the flange is from the pose. Exit code 1 when the target\n\
    was refused or passed over, or the arm does not get there.")]
pub(super) struct TargetArguments {
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
    #[command(after_help = "Examples:\n  rt_bridge target joints 0,-0.6,0,-2.2,0,1.6,0.785")]
    Joints {
        /// One for each joint, with commas between them [rad]
        #[arg(value_name = "Q1,Q2,..", allow_hyphen_values = true, value_parser = positions)]
        q: Positions,
    },
    /// A pose of the flange
    #[command(after_help = "Examples:\n  rt_bridge target pose 0.4,0.1,0.4,0,1,0,0 --cell config/fr3_cell.toml")]
    Pose {
        /// Position [m] and quaternion w, x, y, z in the base frame
        #[arg(value_name = "X,Y,Z,QW,QX,QY,QZ", allow_hyphen_values = true, value_parser = seven)]
        pose: [f64; 7],
        /// The cell of the bridge
        #[arg(long, value_name = "cell.toml")]
        cell: PathBuf,
    },
    /// So far from where the flange is commanded to be, along the base frame's axes
    #[command(after_help = "Examples:\n  rt_bridge target shift 0,0,0.05 --cell config/fr3_cell.toml")]
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
        if let To::Fingers { width } = self.to {
            return fingers(&node, width, self.json, &stop);
        }
        let arm = ArmLine {
            states: node.subscriber(topics::ARM_STATE)?,
            events: node.subscriber(topics::EVENTS)?,
            targets: node.publisher(topics::ARM_TARGET)?,
        };
        let Some(first) = newest(&arm.states, PATIENCE)? else {
            bail!(
                "no bridge showed an arm within {} s; start one with `rt_bridge run --cell cell.toml --arm sim`",
                PATIENCE.as_secs()
            );
        };
        let (target, pose) = self.target(&first)?;
        let begin = Instant::now();
        let last = arm.go(&target, &stop)?;
        let seconds = begin.elapsed().as_secs_f64();
        let off = pose.map(|(model, pose)| {
            let flange = model.flange(&last.q_d).isometry();
            (flange.translation.vector - pose.translation.vector).norm()
        });
        let q = &last.q_d[..(last.dof as usize).min(MAX_JOINTS)];
        if self.json {
            answer::json(&serde_json::json!({ "stream": target.stream, "q_d": q, "seconds": seconds, "off_m": off }))?;
        } else {
            let q: Vec<String> = q.iter().map(|q| format!("{q:.4}")).collect();
            answer::words(format!("at {} rad after {seconds:.1} s", q.join(", ")))?;
        }
        match off {
            Some(off) if off > REACHED => bail!(
                "the flange rests {:.1} mm from that pose: it is out of reach, or a joint is at its end; ask for another",
                1e3 * off
            ),
            _ => Ok(()),
        }
    }

    /// What is sent, and the flange's pose to be reached, where there is one.
    fn target(&self, first: &ArmState) -> Result<(ArmTarget, Option<Goal>)> {
        // An id that no other sender has: nanoseconds since this machine came up.
        let target = ArmTarget { stream: now_ns(), dof: first.dof, speed: self.speed, ..ArmTarget::default() };
        match &self.to {
            To::Joints { q: Positions(q) } => {
                let has = first.dof as usize;
                ensure!(
                    q.len() == has,
                    "the arm has {has} joints and {} positions were given; give one for each",
                    q.len()
                );
                let mut joints: Joints = [0.0; MAX_JOINTS];
                joints[..has].copy_from_slice(q);
                Ok((ArmTarget { q: joints, ..target }, None))
            }
            To::Pose { pose: [x, y, z, w, i, j, k], cell } => {
                let turn = UnitQuaternion::from_quaternion(Quaternion::new(*w, *i, *j, *k));
                let pose = Isometry3::from_parts(Translation3::new(*x, *y, *z), turn);
                Ok(at(&target, &pose, model_of(cell, first)?))
            }
            To::Shift { by, cell } => {
                let model = model_of(cell, first)?;
                let pose = Translation3::from(*by) * model.flange(&first.q_d).isometry();
                Ok(at(&target, &pose, model))
            }
            To::Fingers { .. } => bail!("fingers are no arm"),
        }
    }
}

/// A pose of the flange to be reached, and the arm by which it is measured.
type Goal = (ArmModel, Isometry3<f64>);

/// The arm that a cell describes, which has to be the one that the bridge drives.
fn model_of(cell: &Path, first: &ArmState) -> Result<ArmModel> {
    let model = ArmModel::from_cell(&Cell::read(cell)?)?;
    ensure!(
        model.has_geometry() && model.dof() == first.dof as usize,
        "{} describes another arm than the bridge drives; give the bridge's own --cell",
        cell.display()
    );
    Ok(model)
}

/// A target at a pose of the flange, and what its end is measured by.
fn at(target: &ArmTarget, pose: &Isometry3<f64>, model: ArmModel) -> (ArmTarget, Option<Goal>) {
    let mut target = *target;
    let turn = pose.rotation.quaternion();
    target.kind = TargetKind::Pose;
    target.wxyz = [turn.w, turn.i, turn.j, turn.k];
    target.position = pose.translation.vector.into();
    (target, Some((model, *pose)))
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
            let Some(state) = newest(&self.states, PATIENCE)? else { bail!("the bridge fell silent; start it again") };
            let ours = state.motion_id == target.stream;
            ensure!(
                !(ours && state.motion == MotionStatus::Braked),
                "the arm was braked; the bridge says why on /events"
            );
            let rests = ours && state.motion_played > REST && state.dq_d.iter().all(|dq| dq.abs() < STILL);
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
            let Some(state) = newest(&self.states, PATIENCE)? else { bail!("the bridge fell silent; start it again") };
            if state.motion_id != stream || state.motion != MotionStatus::Playing {
                return Ok(state);
            }
        }
    }
}

/// The newest state, waiting for one if need be.
fn newest(states: &Subscriber<ArmState>, patience: Duration) -> Result<Option<ArmState>> {
    let begin = Instant::now();
    while begin.elapsed() < patience {
        if let Some(state) = states.newest()? {
            return Ok(Some(state));
        }
        thread::sleep(Duration::from_millis(2));
    }
    Ok(None)
}

/// Sends the fingers to a width until they rest.
fn fingers(node: &Node, width: f64, json: bool, stop: &AtomicBool) -> Result<()> {
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
        still = if (state.width - stands).abs() < STILL { still + 1 } else { 0 };
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
