//! One client of the robot: its two sockets, the handshake, and what it is sent in which order.

use super::framing::{Inbox, Message};
use super::robot::{Outbox, Reply, Robot};
use super::wire::{
    ConnectStatus, NotARequest, ROBOT_VERSION, Request, SetPoint, connect_reply, reply, request, set_point,
};
use std::io::{self, Read as _, Write as _};
use std::net::{IpAddr, SocketAddr, TcpStream, UdpSocket};
use std::ops::RangeInclusive;
use zerocopy::IntoBytes as _;

/// Number of the request that opens a session.
const CONNECT: u32 = 0;
/// Longest datagram that is looked at: longer than a set point, so that a longer one is told from one.
const DATAGRAM: usize = 512;
/// Pieces of a stream, and datagrams, that are taken in a millisecond.
const READS: usize = 64;

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum Gone {
    /// In the ordinary way.
    #[error("it closed the connection")]
    Left,
    /// It sent what no client sends.
    #[error("{0}; the connection is closed")]
    Nonsense(String),
    /// The network failed.
    #[error("the connection broke ({0})")]
    Broken(io::ErrorKind),
}

/// A connected client.
#[derive(Debug)]
pub(super) struct Session {
    tcp: TcpStream,
    inbox: Inbox,
    /// Where states go and set points come from; none before the handshake.
    states_to: Option<SocketAddr>,
    peer: IpAddr,
}

impl Session {
    /// Takes over a connection.
    pub(super) fn new(tcp: TcpStream, peer: SocketAddr) -> io::Result<Self> {
        tcp.set_nonblocking(true)?;
        tcp.set_nodelay(true)?;
        Ok(Self { tcp, inbox: Inbox::of_the_arm(), states_to: None, peer: peer.ip() })
    }

    /// Hands the requests that have arrived to the robot and sends what it answers at once.
    pub(super) fn serve(&mut self, robot: &mut Robot) -> Result<(), Gone> {
        read_into(&mut self.tcp, &mut self.inbox)?;
        while let Some(message) = self.inbox.next().map_err(|garbage| Gone::Nonsense(garbage.to_string()))? {
            self.take(&message, robot)?;
        }
        // At once: a client in lock-step may want its answer before it lets the robot's clock go on.
        let Outbox { before_state, after_state } = robot.outbox();
        before_state.iter().chain(&after_state).try_for_each(|reply| self.send(reply))
    }

    fn take(&mut self, message: &Message, robot: &mut Robot) -> Result<(), Gone> {
        let Message { number, id, payload } = message;
        match (request(*number, payload), self.states_to) {
            (Ok(Request::Connect { version, udp_port }), _) => self.shake_hands(*id, version, udp_port),
            (_, None) => Err(Gone::Nonsense("it asks for something before the handshake".into())),
            (Ok(request), Some(_)) => {
                robot.request(*number, *id, &request);
                Ok(())
            }
            (Err(error), Some(_)) => {
                tracing::warn!("{error}; refused");
                let status = refusal(*number, error);
                self.send(&Reply { number: *number, id: *id, payload: vec![status] })
            }
        }
    }

    fn shake_hands(&mut self, id: u32, version: u16, udp_port: u16) -> Result<(), Gone> {
        let agreed = version == ROBOT_VERSION;
        if agreed {
            self.states_to = Some(SocketAddr::new(self.peer, udp_port));
        } else {
            tracing::warn!(
                "a client of FCI version {version} was refused: this robot speaks version {ROBOT_VERSION}, which is libfranka 0.18 to 0.21"
            );
        }
        let status = if agreed { ConnectStatus::Success } else { ConnectStatus::IncompatibleLibraryVersion };
        self.send(&Reply { number: CONNECT, id, payload: connect_reply(status).to_vec() })
    }

    /// Sends replies that go out before a state, the state, and those that go out after it.
    pub(super) fn tell(&mut self, robot: &mut Robot, udp: &UdpSocket) -> Result<(), Gone> {
        let outbox = robot.outbox();
        for reply in &outbox.before_state {
            self.send(reply)?;
        }
        if let Some(to) = self.states_to {
            // A client that does not listen yet or any more is noticed by its other socket.
            let _sent = udp.send_to(robot.state().as_bytes(), to);
        }
        outbox.after_state.iter().try_for_each(|reply| self.send(reply))
    }

    fn send(&mut self, answer: &Reply) -> Result<(), Gone> {
        // Replies are a few bytes, the longest some kilobytes: a client that leaves no room for one reads none.
        let message = reply(answer.number, answer.id, &answer.payload);
        self.tcp.write_all(&message).map_err(|error| Gone::Broken(error.kind()))
    }

    /// The newest set point that answers one of the states `answers`, if one waits at the socket; everything else there is
    /// thrown away.
    pub(super) fn waiting_set_point(&self, udp: &UdpSocket, answers: &RangeInclusive<u64>) -> Option<SetPoint> {
        let (mut found, mut datagram) = (None, [0; DATAGRAM]);
        for _ in 0..READS {
            let Ok((length, from)) = udp.recv_from(&mut datagram) else { break };
            let point = set_point(&datagram[..length]).filter(|_| Some(from) == self.states_to);
            found = point.filter(|point| answers.contains(&point.answers)).or(found);
        }
        found
    }
}

/// Takes all bytes that have arrived.
pub(super) fn read_into(tcp: &mut TcpStream, inbox: &mut Inbox) -> Result<(), Gone> {
    let mut bytes = [0; 2048];
    // Not without end: somebody who never stops sending must not stop the robot's clock.
    for _ in 0..READS {
        match tcp.read(&mut bytes) {
            Ok(0) => return Err(Gone::Left),
            Ok(length) => inbox.put(&bytes[..length]),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Gone::Broken(error.kind())),
        }
    }
    Ok(())
}

/// Status of the reply to what is no request: a Move's invalid argument, a setter's, or else "not possible".
fn refusal(number: u32, error: NotARequest) -> u8 {
    match (number, error) {
        (_, NotARequest::Unknown(_)) => 1,
        (1, NotARequest::Payload(_)) => 7,
        (3..=9, NotARequest::Payload(_)) => 2,
        (_, NotARequest::Payload(_)) => 1,
    }
}
