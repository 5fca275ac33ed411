//! Connections that have not said yet what they want. A client is one only after its first request has arrived whole, so
//! that somebody who connects and stays silent, or sends half a header, keeps nobody from the robot; such a connection is
//! closed after two seconds. Used for the arm's port and the hand's.

use super::connection::{ConnectionEnd, read_into};
use super::framing::{Inbox, Message};
use socket2::{SockRef, TcpKeepalive};
use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// How long a connection may take to send its first request. libfranka sends it at once.
const PATIENCE: Duration = Duration::from_secs(2);
/// Connections that may be silent at a time. One more, and the oldest is closed.
const MAX_SILENT: usize = 64;
/// Connections that are taken in one look, so that a flood of them cannot stop the robot's clock.
const AT_ONCE: usize = 32;

/// When the system begins to ask whether the other machine is still there, how often it asks, and how many unanswered
/// questions end the connection.
const QUIET: Duration = Duration::from_secs(5);
const ASK_EVERY: Duration = Duration::from_secs(2);
const UNANSWERED: u32 = 3;

#[derive(Debug)]
pub(super) struct Arrival {
    pub(super) tcp: TcpStream,
    pub(super) peer: SocketAddr,
    pub(super) inbox: Inbox,
    since: Instant,
}

/// What became of a connection.
#[derive(Debug)]
pub(super) enum Outcome {
    /// Its first request is there.
    Asks(Arrival, Message),
    /// It is closed.
    Closed(SocketAddr, ConnectionEnd),
}

/// The connections that are still silent.
#[derive(Debug)]
pub(super) struct Arrivals {
    listener: TcpListener,
    inbox: fn() -> Inbox,
    silent: VecDeque<Arrival>,
}

impl Arrivals {
    /// Connections to `listener`, which read their first request by means of an `inbox`.
    pub(super) fn at(listener: TcpListener, inbox: fn() -> Inbox) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { listener, inbox, silent: VecDeque::new() })
    }

    /// Where the connections come in.
    pub(super) fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Takes new connections and sees what has become of those that were silent. Does not wait.
    pub(super) fn look(&mut self, now: Instant) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        for _ in 0..AT_ONCE {
            let Ok((tcp, peer)) = self.listener.accept() else { break };
            if prepare(&tcp).is_ok() {
                self.silent.push_back(Arrival { tcp, peer, inbox: (self.inbox)(), since: now });
            }
        }
        for mut arrival in std::mem::take(&mut self.silent) {
            match arrival.first_request(now) {
                Ok(Some(message)) => outcomes.push(Outcome::Asks(arrival, message)),
                Ok(None) => self.silent.push_back(arrival),
                Err(gone) => outcomes.push(Outcome::Closed(arrival.peer, gone)),
            }
        }
        while self.silent.len() > MAX_SILENT {
            outcomes
                .extend(self.silent.pop_front().map(|arrival| Outcome::Closed(arrival.peer, ConnectionEnd::Crowded)));
        }
        outcomes
    }
}

impl Arrival {
    fn first_request(&mut self, now: Instant) -> Result<Option<Message>, ConnectionEnd> {
        let read = read_into(&mut self.tcp, &mut self.inbox);
        // Also where it has left already: what it was is counted.
        let message = self.inbox.next().map_err(|garbage| ConnectionEnd::Nonsense(garbage.to_string()))?;
        read?;
        match message {
            None if now.duration_since(self.since) > PATIENCE => Err(ConnectionEnd::Silent),
            message => Ok(message),
        }
    }
}

/// Has the system notice a machine that vanished without closing its connection: while nothing is said, and where what is
/// said is never acknowledged.
fn prepare(tcp: &TcpStream) -> io::Result<()> {
    tcp.set_nonblocking(true)?;
    tcp.set_nodelay(true)?;
    let socket = SockRef::from(tcp);
    let asks = TcpKeepalive::new().with_time(QUIET).with_interval(ASK_EVERY).with_retries(UNANSWERED);
    socket.set_tcp_keepalive(&asks)?;
    socket.set_tcp_user_timeout(Some(QUIET + ASK_EVERY * UNANSWERED))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    /// Looks until as many outcomes are there, with the clock at `now`.
    fn outcomes(arrivals: &mut Arrivals, now: Instant, count: usize) -> Vec<Outcome> {
        let mut found = Vec::new();
        while found.len() < count {
            found.extend(arrivals.look(now));
            std::thread::sleep(Duration::from_millis(1));
        }
        found
    }

    #[test]
    fn a_silent_connection_and_half_a_header_keep_nobody_out_and_are_closed_in_the_end() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let mut arrivals = Arrivals::at(listener, Inbox::of_the_arm).expect("a listener");
        let connect = || TcpStream::connect(arrivals.address().expect("it is bound")).expect("it listens");
        let (silent, mut half, mut whole) = (connect(), connect(), connect());
        half.write_all(&[0; 5]).expect("a socket");
        whole.write_all(&crate::serve::wire::reply(0, 7, &[10, 0, 1, 0])).expect("a socket");
        let begin = Instant::now();
        let [Outcome::Asks(arrival, message)] = &outcomes(&mut arrivals, begin, 1)[..] else { panic!("no request") };
        assert_eq!((message.number, message.id), (0, 7));
        assert!(SockRef::from(&arrival.tcp).keepalive().expect("a socket"));
        assert!(arrivals.look(begin + PATIENCE).is_empty());
        let late = outcomes(&mut arrivals, begin + 2 * PATIENCE, 2);
        assert!(late.iter().all(|outcome| matches!(outcome, Outcome::Closed(_, ConnectionEnd::Silent))), "{late:?}");
        drop((silent, half));
    }

    #[test]
    fn of_many_silent_connections_the_oldest_are_closed() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("it is bound");
        let mut arrivals = Arrivals::at(listener, Inbox::of_the_arm).expect("a listener");
        let mut clients = Vec::new();
        let mut closed = Vec::new();
        for _ in 0..MAX_SILENT + 10 {
            clients.push(TcpStream::connect(address).expect("it listens"));
            closed.extend(arrivals.look(Instant::now()));
        }
        while closed.len() < 10 {
            closed.extend(arrivals.look(Instant::now()));
        }
        let first = clients[..10].iter().map(|client| client.local_addr().expect("connected"));
        for (client, outcome) in first.zip(&closed) {
            assert!(matches!(outcome, Outcome::Closed(peer, ConnectionEnd::Crowded) if *peer == client), "{outcome:?}");
        }
        assert_eq!((arrivals.silent.len(), closed.len()), (MAX_SILENT, 10));
    }
}
