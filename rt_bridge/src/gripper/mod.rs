//! Grippers: a Robotiq 2F on a serial line, the Franka Hand through its robot, or simulated fingers. All speak
//! [`GripperState`] and [`GripperCommand`] on `/gripper` and `/gripper/command`, fifty times a second; `/gripper/target` steers them.
//!
//! | file | owns |
//! |---|---|
//! | `robotiq` | Modbus RTU, the Robotiq's registers, the serial port |
//! | `fingers` | how simulated fingers move; `rt_bridge serve` moves its hand with them, too |
//! | `sim` | the simulated gripper |
//! | `stream` | streams of targets |
//! | [`crate::fr3`] | the Franka Hand |

pub(crate) mod fingers;
pub mod robotiq;
mod sim;
mod stream;

use crate::device::{Device, DeviceFault, Lines, Service, ServiceError};
use crate::fr3;
use crate::pump::Notice;
use fingers::Reach;
use shared_mem::cell::{Cell, Gripper, GripperModel};
use shared_mem::msg::event::EventLevel;
use shared_mem::msg::gripper::{GripperCommand, GripperState};
use shared_mem::msg::target::GripperTarget;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::mpsc::Sender;
use std::time::Duration;

/// How often a gripper is read and commanded.
pub(crate) const PERIOD: Duration = Duration::from_millis(20);

/// The Franka Hand's fingers: 0.05 m/s each, from its data sheet.
pub(crate) const FRANKA_HAND: Reach = Reach { widest: 0.08, fastest: 0.1 };

/// A gripper that was reached.
pub type AnyGripper = Box<dyn Device<Sample = GripperState, Order = GripperCommand>>;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GripperChoice {
    Sim,
    /// A Robotiq 2F at this serial port.
    Serial(PathBuf),
    /// The Franka Hand of the robot at this address.
    Fci(String),
    /// What a recording holds of one.
    Replay,
    Off,
}

impl FromStr for GripperChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once("://") {
            None if text == "sim" => Ok(Self::Sim),
            None if text == "replay" => Ok(Self::Replay),
            None if text == "off" => Ok(Self::Off),
            Some(("serial", path)) if Path::new(path).is_absolute() => Ok(Self::Serial(path.into())),
            Some(("fci", host)) if !host.is_empty() => Ok(Self::Fci(host.to_owned())),
            _ => {
                Err("use sim, serial:///dev/ttyUSB0 (a Robotiq 2F), fci://HOST (the Franka Hand), replay or off".into())
            }
        }
    }
}

impl fmt::Display for GripperChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::Serial(port) => write!(f, "serial://{}", port.display()),
            Self::Fci(host) => write!(f, "fci://{host}"),
            Self::Replay => f.write_str("replay"),
            Self::Off => f.write_str("off"),
        }
    }
}

impl GripperChoice {
    /// Opens it; `None` for none, and for a recording's. What cell.toml does not say is what the maker ships: a 2F-85 on a serial port.
    ///
    /// # Errors
    /// [`DeviceFault`] when it cannot be reached.
    pub fn open(&self, cell: &Cell) -> Result<Option<AnyGripper>, DeviceFault> {
        let described = cell.gripper;
        Ok(match self {
            Self::Sim => Some(Box::new(sim::SimGripper::new(
                &described.unwrap_or_else(|| Gripper::new(GripperModel::FrankaHand)),
            ))),
            Self::Serial(path) => {
                let gripper = described.unwrap_or_else(|| Gripper::new(GripperModel::Robotiq2F85));
                Some(Box::new(robotiq::Robotiq::open(path, &gripper)?))
            }
            Self::Fci(host) => Some(Box::new(fr3::Hand::connect(host)?)),
            Self::Replay | Self::Off => None,
        })
    }

    /// Puts it to work; `None` for none, and for a recording's.
    ///
    /// # Errors
    /// [`ServiceError`] when it cannot be reached or shared memory fails.
    pub fn serve(&self, cell: &Cell, notices: Sender<Notice>) -> Result<Option<Service>, ServiceError> {
        if matches!(self, Self::Replay | Self::Off) {
            return Ok(None);
        }
        let (choice, cell, said) = (self.clone(), cell.clone(), notices.clone());
        let open = move || {
            let opened = choice.open(&cell)?;
            Ok(opened.expect("somebody was chosen"))
        };
        Service::start(
            "rt_bridge_gripper",
            format!("the gripper {self}"),
            open,
            move |node| GripperLines::open(node, said),
            notices,
        )
        .map(Some)
    }
}

impl Device for AnyGripper {
    type Sample = GripperState;
    type Order = GripperCommand;

    fn round(&mut self, order: Option<&GripperCommand>) -> Result<Option<GripperState>, DeviceFault> {
        self.as_mut().round(order)
    }

    fn complaint(&self) -> Option<String> {
        self.as_ref().complaint()
    }
}

/// The topics of a gripper.
struct GripperLines {
    state: Publisher<GripperState>,
    command: Subscriber<GripperCommand>,
    target: Subscriber<GripperTarget>,
    stream: stream::Fingers,
    notices: Sender<Notice>,
}

impl GripperLines {
    fn open(node: &Node, notices: Sender<Notice>) -> Result<Self, TransportError> {
        Ok(Self {
            state: node.publisher(topics::GRIPPER)?,
            command: node.subscriber(topics::GRIPPER_COMMAND)?,
            target: node.subscriber(topics::GRIPPER_TARGET)?,
            stream: stream::Fingers::default(),
            notices,
        })
    }
}

impl Lines<AnyGripper> for GripperLines {
    fn order(&mut self) -> Result<Option<GripperCommand>, TransportError> {
        let mut order = None;
        for _ in 0..topics::GRIPPER_TARGET.limits.buffer * topics::GRIPPER_TARGET.limits.publishers {
            let Some(target) = self.target.receive()? else { break };
            match self.stream.take(&target, now_ns()) {
                Ok(wanted) => order = wanted.or(order),
                Err(text) => {
                    let _pump_gone = self.notices.send(Notice { level: EventLevel::Warning, text });
                }
            }
        }
        let command = self.command.newest()?;
        if let Some(command) = &command {
            self.stream.give_way(command, now_ns());
        }
        Ok(command.or(order))
    }

    fn publish(&mut self, sample: &GripperState) -> Result<(), TransportError> {
        self.state.greet_new_readers()?;
        self.state.send(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gripper_is_named_by_its_kind_and_its_place() {
        for text in ["sim", "replay", "off", "serial:///dev/ttyUSB0", "fci://172.16.0.2"] {
            assert_eq!(text.parse::<GripperChoice>().expect("a gripper").to_string(), text);
        }
        for wrong in ["", "serial://", "serial://ttyUSB0", "fci://", "robotiq", "can://can0"] {
            assert!(wrong.parse::<GripperChoice>().is_err(), "{wrong}");
        }
    }
}
