//! What all connections have in common: bytes that arrive are taken, and it ends for a stated reason.

use super::framing::Inbox;
use super::wire::ROBOT_VERSION;
use std::io::{self, Read as _};
use std::net::TcpStream;

/// Pieces of a stream, and datagrams, that are taken in a millisecond.
pub(super) const READS: usize = 64;

/// Why a connection is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum ConnectionEnd {
    /// In the ordinary way.
    #[error("it closed the connection")]
    Left,
    /// It did not say what it wants.
    #[error("it sent no handshake within two seconds; the connection is closed")]
    Silent,
    /// Too many others do not say either.
    #[error("too many connections wait for their handshake; the oldest is closed")]
    Crowded,
    /// Somebody else is served.
    #[error("it is refused: this robot serves one client at a time, end the other one first")]
    Second,
    /// Its interface is another.
    #[error(
        "its FCI version {0} is refused: this robot speaks version {ROBOT_VERSION}, which is libfranka 0.18 to 0.21"
    )]
    Version(u16),
    /// It sent what no client sends.
    #[error("{0}; the connection is closed")]
    Nonsense(String),
    /// The network failed.
    #[error("the connection broke ({0})")]
    Broken(io::ErrorKind),
}

impl From<io::Error> for ConnectionEnd {
    fn from(error: io::Error) -> Self {
        Self::Broken(error.kind())
    }
}

/// Takes all bytes that have arrived.
pub(super) fn read_into(tcp: &mut TcpStream, inbox: &mut Inbox) -> Result<(), ConnectionEnd> {
    let mut bytes = [0; 2048];
    // Not without end: somebody who never stops sending must not stop the robot's clock.
    for _ in 0..READS {
        match tcp.read(&mut bytes) {
            Ok(0) => return Err(ConnectionEnd::Left),
            Ok(length) => inbox.put(&bytes[..length]),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(ConnectionEnd::Broken(error.kind())),
        }
    }
    Ok(())
}
