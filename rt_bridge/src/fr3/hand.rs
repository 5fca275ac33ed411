//! The Franka Hand through its robot: version 3 of its protocol, port 1338. It sends its state some sixty times a second
//! and answers an order when the fingers have come to its end.
//!
//! The bytes are `franka-rs`'s; its `Gripper` is not used, because it waits for the end of each order and a robot that falls
//! silent would hang it. States are taken from the hand alone, as the arm's are.

use super::believed::Believed;
use super::session::{ipv4, reason};
use super::states::States;
use crate::device::{Device, DeviceFault};
use franka::network::TcpSession;
use franka::wire::gripper::{
    GRIPPER_COMMAND_PORT, GRIPPER_VERSION, GraspRequest, GripperCommand as Command, GripperCommandResponse,
    GripperConnectRequest, GripperConnectResponse, GripperMoveRequest, GripperState as WireState, GripperStatus,
};
use franka::wire::{HeaderLayout, parse_response};
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use shared_mem::time::now_ns;
use std::io;
use std::time::{Duration, Instant};
use zerocopy::IntoBytes as _;

/// How long a robot may take to accept the connection, and then to answer the handshake.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// How long one wait for a state lasts.
const STATE_WAIT: Duration = Duration::from_millis(50);
/// States that are looked at without waiting, at most.
const PILED_UP: usize = 256;
/// How long its states may pause before the hand counts as lost.
const SILENCE: Duration = Duration::from_secs(1);
/// How far the size of what is held may be from what was asked for [m].
const EPSILON: f64 = 0.005;
/// Speed of an order that names none [m/s]: 0.05 m/s a finger, from the data sheet.
const FASTEST: f64 = 0.1;
/// Force of an order that names none [N].
const GENTLEST: f64 = 10.0;

/// A connected hand.
pub struct Hand {
    device: String,
    tcp: TcpSession,
    states: States,
    believed: Believed<0>,
    /// When the last state came.
    heard: Instant,
    /// Orders that are not answered yet.
    under_way: Vec<u32>,
    width_d: Option<f64>,
    refused: bool,
}

impl Hand {
    /// Connects to the hand of the robot at `host` (optionally with `:port`; 1338 where none is given).
    ///
    /// # Errors
    /// [`DeviceFault::NotOpened`] when nobody answers there or another version does. At most some seconds pass.
    pub fn connect(host: &str) -> Result<Self, DeviceFault> {
        let device = format!("fci://{host}");
        let failed = |why: String| DeviceFault::NotOpened {
            device: device.clone(),
            why,
            remedy: "check the robot's address, that FCI is activated and that the hand is set up in its web page"
                .into(),
        };
        let address = ipv4(host, GRIPPER_COMMAND_PORT).ok_or_else(|| failed("that name has no IPv4 address".into()))?;
        let tcp =
            TcpSession::connect(address, CONNECT_TIMEOUT, HeaderLayout::Gripper).map_err(|e| failed(reason(&e)))?;
        let states = States::of(address.ip(), STATE_WAIT).map_err(|e| failed(e.to_string()))?;
        agree_on_version(&tcp, states.port()).map_err(failed)?;
        Ok(Self {
            device,
            tcp,
            states,
            believed: Believed::new(),
            heard: Instant::now(),
            under_way: Vec::new(),
            width_d: None,
            refused: false,
        })
    }

    /// Sends an order; one that is under way is stopped first.
    fn obey(&mut self, order: &GripperCommand) -> Result<(), DeviceFault> {
        self.refused = false;
        if !self.under_way.is_empty() || order.action == GripperAction::Stop {
            self.send(Command::Stop, &[])?;
        }
        let speed = if order.speed > 0.0 { order.speed } else { FASTEST };
        let force = if order.force > 0.0 { order.force } else { GENTLEST };
        if order.action != GripperAction::Stop {
            self.width_d = order.width.is_finite().then_some(order.width);
        }
        match order.action {
            GripperAction::Stop => Ok(()),
            GripperAction::Home => {
                self.width_d = None;
                self.send(Command::Homing, &[])
            }
            GripperAction::Move => self.send(Command::Move, GripperMoveRequest::new(order.width, speed).as_bytes()),
            GripperAction::Grasp => {
                let request = GraspRequest::new(order.width, EPSILON, EPSILON, speed, force);
                self.send(Command::Grasp, request.as_bytes())
            }
        }
    }

    fn send(&mut self, command: Command, payload: &[u8]) -> Result<(), DeviceFault> {
        let sent = self.tcp.send_request(command.to_u16().into(), payload);
        self.under_way.push(sent.map_err(|e| self.gone(reason(&e)))?);
        Ok(())
    }

    /// Takes note of orders that came to their end.
    fn hear_answers(&mut self) -> Result<(), DeviceFault> {
        for ticket in std::mem::take(&mut self.under_way) {
            let answer = self.tcp.try_receive_response(ticket).map_err(|e| self.gone(reason(&e)))?;
            let Some(message) = answer else {
                self.under_way.push(ticket);
                continue;
            };
            let status = parse_response::<GripperCommandResponse>(HeaderLayout::Gripper, &message)
                .ok()
                .and_then(|response| GripperStatus::from_u16(response.status.get()));
            self.refused |= matches!(status, None | Some(GripperStatus::Fail));
        }
        Ok(())
    }

    fn gone(&self, why: String) -> DeviceFault {
        DeviceFault::Gone { device: self.device.clone(), why }
    }

    /// The newest state that waits, or the next one; `None` when there is none within a while.
    fn newest(&mut self) -> io::Result<Option<WireState>> {
        let Self { states, believed, .. } = self;
        let mut newest = None;
        let mut believe = |state: &WireState| {
            let sound = state.width.get().is_finite() && state.max_width.get().is_finite() && state.is_grasped <= 1;
            let is_new = sound && believed.take(state.message_id.get().into(), [], Instant::now());
            if is_new {
                newest = Some(*state);
            }
            is_new
        };
        states.wait(&mut believe)?;
        states.look(PILED_UP, believe)?;
        Ok(newest)
    }
}

impl Device for Hand {
    type Sample = GripperState;
    type Order = GripperCommand;

    fn round(&mut self, order: Option<&GripperCommand>) -> Result<Option<GripperState>, DeviceFault> {
        if let Some(order) = order {
            self.obey(order)?;
        }
        self.hear_answers()?;
        let newest = self.newest().map_err(|error| self.gone(error.to_string()))?;
        let Some(state) = newest else {
            self.tcp.throw_if_connection_closed().map_err(|_| self.gone("it closed the connection".into()))?;
            if self.heard.elapsed() > SILENCE {
                return Err(DeviceFault::Silent {
                    device: self.device.clone(),
                    check: "the robot's power and network",
                });
            }
            return Ok(None);
        };
        self.heard = Instant::now();
        let width = state.width.get();
        Ok(Some(GripperState {
            stamp_ns: now_ns(),
            width,
            width_d: self.width_d.unwrap_or(width),
            // The hand does not tell how hard it holds.
            force: f64::NAN,
            grasped: u32::from(state.is_grasped != 0),
            fault: 0,
        }))
    }

    fn complaint(&self) -> Option<String> {
        self.refused.then(|| "refused an order; home it, and ask for a width within its reach".into())
    }
}

/// The handshake; why it failed.
fn agree_on_version(tcp: &TcpSession, port: u16) -> Result<(), String> {
    let request = GripperConnectRequest::new(GRIPPER_VERSION, port);
    let sent = tcp.send_request(Command::Connect.to_u16().into(), request.as_bytes());
    let ticket = sent.map_err(|e| reason(&e))?;
    let begin = Instant::now();
    let message = loop {
        match tcp.try_receive_response(ticket).map_err(|e| reason(&e))? {
            Some(message) => break message,
            None if begin.elapsed() > CONNECT_TIMEOUT => {
                return Err("it accepts the connection but does not speak: another program may be connected".into());
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    let response: GripperConnectResponse = parse_response(HeaderLayout::Gripper, &message).map_err(|e| reason(&e))?;
    match (response.status.get(), response.version.get()) {
        (0, _) => Ok(()),
        (_, GRIPPER_VERSION) => Err("another program may be connected to it already".into()),
        (_, theirs) => Err(format!("it speaks version {theirs}, this bridge speaks {GRIPPER_VERSION}")),
    }
}
