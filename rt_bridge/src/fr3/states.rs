//! The socket on which a robot's states arrive and its set points leave. Only the robot is listened to: datagrams from
//! another address are passed over until the first state that is believed, and from then on the system itself keeps
//! everybody else's out, so that they neither cost time nor take the room of a state.
//!
//! `franka-rs`'s own channel takes datagrams from anybody, and sends its commands to whoever sent the last one.
//!
//! Nothing here allocates.

use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;
use zerocopy::FromBytes;

/// Longer than any state, so that a longer datagram is recognised.
const DATAGRAM: usize = 1500;

/// What a look at the socket has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// A state that is believed.
    State,
    Other,
    /// Nothing within the patience of the socket.
    Nothing,
}

#[derive(Debug)]
pub(super) struct States {
    socket: UdpSocket,
    port: u16,
    host: IpAddr,
    /// Who sent the first state that was believed: nobody else is listened to.
    robot: Option<SocketAddr>,
    stranger: Option<IpAddr>,
}

impl States {
    /// A socket for the states of the robot at `host`; a look that may wait does so for `patience`.
    pub(super) fn of(host: IpAddr, patience: Duration) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        socket.set_read_timeout(Some(patience))?;
        let port = socket.local_addr()?.port();
        Ok(Self { socket, port, host, robot: None, stranger: None })
    }

    /// The port that the robot has to be given.
    pub(super) fn port(&self) -> u16 {
        self.port
    }

    /// Another address than the robot's from which a datagram came.
    pub(super) fn stranger(&self) -> Option<IpAddr> {
        self.stranger
    }

    /// Waits for a datagram, as long as the socket's patience, and asks `believe` about it if it may be a state.
    pub(super) fn wait<T: FromBytes>(&mut self, believe: impl FnOnce(&T) -> bool) -> io::Result<Heard> {
        let mut datagram = [0; DATAGRAM];
        let (length, from) = match self.socket.recv_from(&mut datagram) {
            Ok(received) => received,
            // The last one: a set point found the robot's port closed, which its other connection shows as well.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::ConnectionRefused
                ) =>
            {
                return Ok(Heard::Nothing);
            }
            Err(error) => return Err(error),
        };
        if from.ip() != self.host {
            self.stranger = Some(from.ip());
            return Ok(Heard::Other);
        }
        // What came in before the others were kept out may still be waiting.
        if self.robot.is_some_and(|robot| robot != from) {
            return Ok(Heard::Other);
        }
        match T::read_from_bytes(&datagram[..length]) {
            Ok(state) if believe(&state) => {
                if self.robot.is_none() {
                    self.socket.connect(from)?;
                    self.robot = Some(from);
                }
                Ok(Heard::State)
            }
            _ => Ok(Heard::Other),
        }
    }

    /// Asks `believe` about the states that have arrived already, `most` at most. `true` where one is believed.
    pub(super) fn look<T: FromBytes>(&mut self, most: usize, mut believe: impl FnMut(&T) -> bool) -> io::Result<bool> {
        self.socket.set_nonblocking(true)?;
        let mut found = Ok(false);
        for _ in 0..most {
            match self.wait(&mut believe) {
                Ok(Heard::State) => found = Ok(true),
                Ok(Heard::Other) => {}
                Ok(Heard::Nothing) => break,
                Err(error) => {
                    found = Err(error);
                    break;
                }
            }
        }
        self.socket.set_nonblocking(false)?;
        found
    }

    /// Sends `bytes` to the robot. Does not wait.
    pub(super) fn answer(&self, bytes: &[u8]) -> io::Result<()> {
        match self.socket.send(bytes) {
            // An answer to an earlier one, which the robot's other connection tells as well.
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => Ok(()),
            sent => sent.map(|_| ()),
        }
    }
}
