//! One client of the robot, from its handshake on: its two sockets, and what it is sent in which order.
//!
//! Its datagram socket is connected: the system passes on what comes from the client's address and port, and nobody else's
//! set points.

use super::arrivals::Arrival;
use super::connection::{ConnectionEnd, READS, read_into};
use super::framing::{Inbox, Message};
use super::notices::{About, Notices};
use super::robot::{Outbox, Reply, Robot};
use super::wire::{
    ConnectStatus, NotARequest, ROBOT_VERSION, Request, SetPoint, busy_reply, connect_reply, reply, request, set_point,
};
use std::io::{self, Write as _};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::ops::RangeInclusive;
use std::time::Duration;
use zerocopy::IntoBytes as _;

/// Number of the request that opens a session.
const CONNECT: u32 = 0;
/// Longest datagram that is looked at: longer than a set point, so that a longer one is recognised.
const DATAGRAM: usize = 512;
/// A connected client.
#[derive(Debug)]
pub(super) struct Session {
    tcp: TcpStream,
    inbox: Inbox,
    /// Where states go and set points come from.
    udp: UdpSocket,
    client: SocketAddr,
}

impl Session {
    /// Answers the first `message` of a connection, which has to be a handshake; `taken` where somebody else is served.
    pub(super) fn open(arrival: Arrival, message: &Message, taken: bool) -> Result<Self, ConnectionEnd> {
        let Arrival { mut tcp, peer, inbox, .. } = arrival;
        let Ok(Request::Connect { version, udp_port }) = request(message.number, &message.payload) else {
            return Err(ConnectionEnd::Nonsense("it asks for something before the handshake".into()));
        };
        let (answer, refused) = if version != ROBOT_VERSION {
            (connect_reply(ConnectStatus::IncompatibleLibraryVersion), Some(ConnectionEnd::Version(version)))
        } else if taken {
            (busy_reply(), Some(ConnectionEnd::Second))
        } else {
            (connect_reply(ConnectStatus::Success), None)
        };
        if let Some(gone) = refused {
            send(&mut tcp, CONNECT, message.id, &answer)?;
            return Err(gone);
        }
        let client = SocketAddr::new(peer.ip(), udp_port);
        // The address that the client knows the robot by, where this machine has several.
        let udp = UdpSocket::bind(SocketAddr::new(tcp.local_addr()?.ip(), 0))?;
        udp.connect(client)?;
        udp.set_nonblocking(true)?;
        send(&mut tcp, CONNECT, message.id, &answer)?;
        Ok(Self { tcp, inbox, udp, client })
    }

    /// Hands the requests that have arrived to the robot and sends what it answers at once.
    pub(super) fn serve(&mut self, robot: &mut Robot, notices: &mut Notices) -> Result<(), ConnectionEnd> {
        read_into(&mut self.tcp, &mut self.inbox)?;
        while let Some(message) = self.inbox.next().map_err(|garbage| ConnectionEnd::Nonsense(garbage.to_string()))? {
            self.take(&message, robot, notices)?;
        }
        // At once: a client in lock-step may want its answer before it lets the robot's clock go on.
        let Outbox { before_state, after_state } = robot.outbox();
        before_state.iter().chain(&after_state).try_for_each(|reply| self.send(reply))
    }

    fn take(&mut self, message: &Message, robot: &mut Robot, notices: &mut Notices) -> Result<(), ConnectionEnd> {
        let Message { number, id, payload } = message;
        match request(*number, payload) {
            Ok(Request::Connect { .. }) => Err(ConnectionEnd::Nonsense("it sends a second handshake".into())),
            Ok(request) => {
                robot.request(*number, *id, &request);
                Ok(())
            }
            Err(error) => {
                notices.warn(About::Refusal, format_args!("{error}; refused"));
                let status = refusal(*number, error);
                self.send(&Reply { number: *number, id: *id, payload: vec![status] })
            }
        }
    }

    /// Sends replies that go out before a state, the state, and those that go out after it.
    pub(super) fn report(&mut self, robot: &mut Robot) -> Result<(), ConnectionEnd> {
        let outbox = robot.outbox();
        outbox.before_state.iter().try_for_each(|reply| self.send(reply))?;
        // A client that does not listen yet or any more is noticed by its other socket.
        let _sent = self.udp.send(robot.state().as_bytes());
        outbox.after_state.iter().try_for_each(|reply| self.send(reply))
    }

    fn send(&mut self, answer: &Reply) -> Result<(), ConnectionEnd> {
        send(&mut self.tcp, answer.number, answer.id, &answer.payload)
    }

    /// The newest set point that answers one of the states `answers`, if one waits at the socket; everything else there is
    /// thrown away.
    pub(super) fn waiting_set_point(&self, answers: &RangeInclusive<u64>) -> Option<SetPoint> {
        let (mut found, mut datagram) = (None, [0; DATAGRAM]);
        for _ in 0..READS {
            let (length, from) = match self.udp.recv_from(&mut datagram) {
                Ok(received) => received,
                // The client did not listen when the last state came: its next set point may be there all the same.
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => continue,
                Err(_) => break,
            };
            // What came in before the socket was connected may be from anybody.
            let point = set_point(&datagram[..length]).filter(|_| from == self.client);
            found = point.filter(|point| answers.contains(&point.answers)).or(found);
        }
        found
    }

    /// Sleeps until a datagram is there, `patience` at most.
    pub(super) fn wait(&self, patience: Duration) -> Result<(), ConnectionEnd> {
        self.udp.set_nonblocking(false)?;
        self.udp.set_read_timeout(Some(patience))?;
        let _something = self.udp.peek(&mut [0; 1]);
        Ok(self.udp.set_nonblocking(true)?)
    }
}

fn send(tcp: &mut TcpStream, number: u32, id: u32, payload: &[u8]) -> Result<(), ConnectionEnd> {
    // Replies are a few bytes, the longest some kilobytes: a client that leaves no room for one reads none.
    Ok(tcp.write_all(&reply(number, id, payload))?)
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
