//! The two sockets of one FCI session: commands and their replies over TCP, states and set points over UDP. Owns the
//! handshake and every deadline; knows nothing of motions. Called by [`super::motion`] and [`super::Fr3`].
//!
//! The bytes are `franka-rs`'s (its wire structs and its command channel). Its `Robot` is not used, for three reasons: its
//! waits for a reply have no deadline, so a server that accepts the connection and says nothing would hang the bridge;
//! its motion handles cannot be handed to another thread; and it reports a reflex as a printed text rather than as data.
//! Nor is its channel for states, which listens to anybody: [`States`] listens to the robot.

use super::believed::Believed;
use super::mapping::{DOF, is_sound};
use super::states::{Heard, States};
use super::version::{FCI_VERSION, remedy};
use crate::arm::{ArmFault, ConnectError};
use franka::FrankaError;
use franka::network::TcpSession;
use franka::wire::robot::v10::{Command, ConnectRequest, ConnectResponse, RobotCommand, RobotState};
use franka::wire::{HeaderLayout, ROBOT_COMMAND_PORT, message_payload, parse_response};
use std::io;
use std::net::{SocketAddr, ToSocketAddrs};
use std::time::{Duration, Instant};
use zerocopy::IntoBytes;

/// How long a robot may take to accept the connection, and then to answer the handshake.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// How long the stream of states may pause before the robot counts as gone. libfranka waits as long.
const SILENCE: Duration = Duration::from_secs(1);
/// How often a pause in the stream looks whether the connection was closed meanwhile.
const SILENCE_CHECK: Duration = Duration::from_millis(50);
/// States that are looked at without waiting, at most: more than pile up in a system's buffer, and few enough to be looked
/// through within a period.
const PILED_UP: usize = 256;
/// How often a reply is looked for. Only while nothing moves or the motion is over already.
const REPLY_POLL: Duration = Duration::from_micros(200);

/// A connection to a robot that speaks our version and has begun to send states.
#[derive(Debug)]
pub(super) struct Session {
    tcp: TcpSession,
    states: States,
    /// The states so far; a command carries the newest one's counter back.
    believed: Believed<DOF>,
}

/// A request that is on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ticket(u32);

impl Session {
    /// Connects, agrees on the version and waits for the first state.
    pub(super) fn connect(host: &str) -> Result<Self, ConnectError> {
        let address =
            ipv4(host, ROBOT_COMMAND_PORT).ok_or_else(|| no_answer(host, "that name has no IPv4 address".into()))?;
        let tcp = TcpSession::connect(address, CONNECT_TIMEOUT, HeaderLayout::Robot)
            .map_err(|e| no_answer(host, reason(&e)))?;
        let states = States::of(address.ip(), SILENCE_CHECK)
            .map_err(|e| no_answer(host, format!("no port for its states can be had here: {e}")))?;
        let mut session = Self { tcp, states, believed: Believed::new() };
        session.agree_on_version(host)?;
        let mut first = RobotState::default();
        session.receive(&mut first).map_err(|fault| match fault {
            ArmFault::Silent { .. } => {
                let port = session.states.port();
                let from = session.states.stranger().map_or("a firewall here?".into(), |stranger| {
                    format!("datagrams arrive from {stranger}, connect to that address if it is the robot's")
                });
                no_answer(host, format!("it accepts us but its states do not arrive at UDP port {port}: {from}"))
            }
            _ => no_answer(host, "it closed the connection after the handshake".into()),
        })?;
        Ok(session)
    }

    fn agree_on_version(&self, host: &str) -> Result<(), ConnectError> {
        let request = ConnectRequest::new(FCI_VERSION, self.states.port());
        let reply = self.tcp.send_request(Command::Connect.to_u32(), request.as_bytes());
        let ticket = Ticket(reply.map_err(|e| no_answer(host, reason(&e)))?);
        let message = self.reply(ticket, CONNECT_TIMEOUT).map_err(|fault| match fault {
            ArmFault::Silent { .. } => no_answer(
                host,
                "it accepts the connection but does not speak: another program may be connected to it already".into(),
            ),
            _ => no_answer(host, "it closed the connection during the handshake: is it a robot?".into()),
        })?;
        let response: ConnectResponse =
            parse_response(HeaderLayout::Robot, &message).map_err(|e| no_answer(host, reason(&e)))?;
        let theirs = response.version.get();
        if theirs != FCI_VERSION {
            let host = host.to_owned();
            return Err(ConnectError::Version { host, theirs, ours: FCI_VERSION, remedy: remedy(theirs) });
        }
        if response.status != 0 {
            let what =
                format!("the connection (status {}): another program may be connected to it already", response.status);
            return Err(ConnectError::Refused { host: host.to_owned(), what });
        }
        Ok(())
    }

    /// Sends a request; its reply is fetched with [`Self::status`] or [`Self::try_status`].
    pub(super) fn send(&self, command: Command, payload: &[u8]) -> Result<Ticket, ArmFault> {
        self.tcp.send_request(command.to_u32(), payload).map(Ticket).map_err(|e| connection_fault(&e))
    }

    /// Waits for the reply to `ticket` and returns its status byte. A request may get several replies, one call each.
    pub(super) fn status(&self, ticket: Ticket, patience: Duration) -> Result<u8, ArmFault> {
        self.reply(ticket, patience).map(|message| status_byte(&message))
    }

    /// The status byte of the reply to `ticket`, if it has arrived.
    pub(super) fn try_status(&self, ticket: Ticket) -> Result<Option<u8>, ArmFault> {
        let reply = self.tcp.try_receive_response(ticket.0).map_err(|e| connection_fault(&e))?;
        Ok(reply.map(|message| status_byte(&message)))
    }

    /// Sends a request that is answered once, and wants status 0.
    pub(super) fn request(&self, command: Command, payload: &[u8], patience: Duration) -> Result<(), ArmFault> {
        let ticket = self.send(command, payload)?;
        match self.status(ticket, patience)? {
            0 => Ok(()),
            status => Err(ArmFault::Refused { status }),
        }
    }

    fn reply(&self, ticket: Ticket, patience: Duration) -> Result<Vec<u8>, ArmFault> {
        let begin = Instant::now();
        loop {
            match self.tcp.try_receive_response(ticket.0) {
                Ok(Some(message)) => return Ok(message),
                Ok(None) if begin.elapsed() > patience => return Err(ArmFault::Silent { ms: millis(begin.elapsed()) }),
                Ok(None) => std::thread::sleep(REPLY_POLL),
                Err(e) => return Err(connection_fault(&e)),
            }
        }
    }

    /// Sleeps until a state arrives that is newer than the last one, and takes the newest of those that wait: states that
    /// piled up while the caller was late are dropped, because a command can only answer the newest.
    ///
    /// Does not allocate while states arrive. A datagram that is not the robot's is passed over ([`super::believed`]).
    pub(super) fn receive(&mut self, state: &mut RobotState) -> Result<(), ArmFault> {
        if self.take_waiting(state)? {
            return Ok(());
        }
        let begin = Instant::now();
        loop {
            let believed = &mut self.believed;
            match self.states.wait(|newer| believes(believed, newer, state)).map_err(|e| socket_fault(&e))? {
                Heard::State => return Ok(()),
                Heard::Other => {}
                Heard::Nothing => {
                    self.tcp.throw_if_connection_closed().map_err(|_| ArmFault::Disconnected)?;
                }
            }
            if begin.elapsed() >= SILENCE {
                return Err(ArmFault::Silent { ms: millis(begin.elapsed()) });
            }
        }
    }

    fn take_waiting(&mut self, state: &mut RobotState) -> Result<bool, ArmFault> {
        let believed = &mut self.believed;
        self.states.look(PILED_UP, |newer| believes(believed, newer, state)).map_err(|e| socket_fault(&e))
    }

    /// Sends one set point as the answer to the newest state. Neither blocks nor allocates.
    pub(super) fn answer(&self, command: &mut RobotCommand) -> Result<(), ArmFault> {
        command.message_id = self.believed.counter().into();
        self.states.answer(command.as_bytes()).map_err(|e| socket_fault(&e))
    }
}

/// Whether `newer` is believed; it becomes the `state` then.
fn believes(believed: &mut Believed<DOF>, newer: &RobotState, state: &mut RobotState) -> bool {
    let is_new = is_sound(newer) && believed.take(newer.message_id.get(), newer.q.map(|q| q.get()), Instant::now());
    if is_new {
        *state = *newer;
    }
    is_new
}

fn socket_fault(error: &io::Error) -> ArmFault {
    ArmFault::Socket { errno: error.raw_os_error().unwrap_or(0) }
}

fn status_byte(message: &[u8]) -> u8 {
    // An empty reply cannot mean success; 255 is no status of the protocol.
    message_payload(HeaderLayout::Robot, message).first().copied().unwrap_or(u8::MAX)
}

/// Where `host` is, at `port` unless it names one. The protocol's state socket is IPv4 only, while `localhost` often means IPv6 first.
pub(super) fn ipv4(host: &str, port: u16) -> Option<SocketAddr> {
    let found = host.to_socket_addrs().or_else(|_| (host, port).to_socket_addrs());
    found.ok()?.find(SocketAddr::is_ipv4)
}

fn no_answer(host: &str, what: String) -> ConnectError {
    ConnectError::NoAnswer { host: host.to_owned(), what }
}

/// What the network says, without the prefix of another library.
pub(super) fn reason(error: &FrankaError) -> String {
    let text = error.to_string();
    if text.contains("refused") {
        return "connection refused".into();
    }
    if text.contains("timeout") {
        return format!("nobody there within {} s", CONNECT_TIMEOUT.as_secs());
    }
    text.trim_start_matches("libfranka: ").trim_start_matches("Connection error: ").to_owned()
}

fn connection_fault(error: &FrankaError) -> ArmFault {
    match errno_in(error) {
        // Orderly ends carry no number; a reset or a broken pipe is the other side's doing as well.
        0 | libc::ECONNRESET | libc::EPIPE => ArmFault::Disconnected,
        errno => ArmFault::Socket { errno },
    }
}

/// The operating system's number in `franka-rs`'s text, which ends in what `std::io::Error` prints; 0 where there is none.
fn errno_in(error: &FrankaError) -> i32 {
    let text = error.to_string();
    let number = text.rsplit_once("(os error ").and_then(|(_, end)| end.trim_end_matches(')').parse().ok());
    number.unwrap_or(0)
}

fn millis(duration: Duration) -> u32 {
    u32::try_from(duration.as_millis()).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_a_name_or_an_address_with_the_protocols_port_unless_another_is_given() {
        assert_eq!(ipv4("127.0.0.1", 1337), Some(SocketAddr::from(([127, 0, 0, 1], 1337))));
        assert_eq!(ipv4("127.0.0.1:1400", 1337), Some(SocketAddr::from(([127, 0, 0, 1], 1400))));
        assert_eq!(ipv4("localhost", 1337), Some(SocketAddr::from(([127, 0, 0, 1], 1337))));
        assert_eq!(ipv4("::1", 1337), None);
    }

    #[test]
    fn the_operating_systems_number_survives_the_librarys_text() {
        let text = std::io::Error::from_raw_os_error(libc::ENETUNREACH).to_string();
        let error = FrankaError::Network(format!("libfranka: UDP send: {text}"));
        assert_eq!(errno_in(&error), libc::ENETUNREACH);
        assert_eq!(errno_in(&FrankaError::Network("libfranka: server closed connection".into())), 0);
    }
}
