//! The hand's port and clock: one client at a time, an action whose reply comes when it ends, states in between.

use super::wire::{self, Request, Status};
use crate::gripper::FRANKA_HAND;
use crate::gripper::fingers::Fingers;
use crate::serve::arrivals::{Arrival, Arrivals, Outcome};
use crate::serve::connection::{ConnectionEnd, read_into};
use crate::serve::framing::{Inbox, Message};
use crate::serve::notices::{About, Notices};
use std::io::Write as _;
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The hand's cycle: as often as it sends its state.
const CYCLE: Duration = Duration::from_millis(20);

/// The running service; it ends when dropped.
#[derive(Debug)]
pub(in crate::serve) struct HandService {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl HandService {
    /// Serves a hand to those who come as `arrivals`.
    pub(in crate::serve) fn start(arrivals: Arrivals) -> Self {
        let address = arrivals.address().unwrap_or_else(|_| SocketAddr::from(([0, 0, 0, 0], 0)));
        let stop = Arc::new(AtomicBool::new(false));
        let ends = stop.clone();
        let thread = thread::Builder::new().name("hand".into()).spawn(move || serve(arrivals, &ends)).ok();
        Self { address, stop, thread }
    }

    /// Where it listens.
    pub(in crate::serve) fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for HandService {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// A client of the hand.
struct Client {
    tcp: TcpStream,
    inbox: Inbox,
    udp: UdpSocket,
    /// Number and counter of the request whose action runs.
    running: Option<(u32, u32)>,
}

fn serve(mut arrivals: Arrivals, stop: &AtomicBool) {
    let (mut fingers, mut client, begin) = (Fingers::new(FRANKA_HAND), None::<Client>, Instant::now());
    let mut notices = Notices::new();
    while !stop.load(Ordering::Relaxed) {
        let ended = fingers.step(CYCLE.as_secs_f64()).map(wire::status);
        let stamp_ms = u32::try_from(begin.elapsed().as_millis()).unwrap_or(u32::MAX);
        if let Some(served) = &mut client
            && served.cycle(&mut fingers, ended, stamp_ms).is_none()
        {
            fingers.stop();
            client = None;
        }
        for outcome in arrivals.look(Instant::now()) {
            let (peer, opened) = match outcome {
                Outcome::Asks(arrival, message) => (arrival.peer, Client::open(arrival, &message, client.is_some())),
                Outcome::Closed(peer, gone) => (peer, Err(gone)),
            };
            match opened {
                Ok(opened) => client = Some(opened),
                Err(ConnectionEnd::Left) => {}
                Err(gone) => notices.warn(About::Refusal, format_args!("{peer}, of the hand: {gone}")),
            }
        }
        thread::sleep(CYCLE);
    }
    notices.finish();
}

impl Client {
    /// Answers the first `message` of a connection, which has to be a handshake; `taken` where somebody else is served.
    fn open(arrival: Arrival, message: &Message, taken: bool) -> Result<Self, ConnectionEnd> {
        let Arrival { mut tcp, peer, inbox, .. } = arrival;
        let Some(Request::Connect { version, udp_port }) = wire::request(message.number, &message.payload) else {
            return Err(ConnectionEnd::Nonsense("it asks for something before the handshake".into()));
        };
        let refused = if !wire::speaks(version) {
            Some((
                wire::version_reply(message.id),
                ConnectionEnd::Nonsense(format!("version {version} is none of this hand")),
            ))
        } else if taken {
            Some((wire::busy_reply(message.id), ConnectionEnd::Second))
        } else {
            None
        };
        if let Some((answer, gone)) = refused {
            tcp.write_all(&answer)?;
            return Err(gone);
        }
        let udp = UdpSocket::bind(SocketAddr::new(tcp.local_addr()?.ip(), 0))?;
        udp.connect(SocketAddr::new(peer.ip(), udp_port))?;
        udp.set_nonblocking(true)?;
        tcp.write_all(&wire::welcome(message.id))?;
        Ok(Self { tcp, inbox, udp, running: None })
    }

    /// One cycle; `None` when the client is gone.
    fn cycle(&mut self, fingers: &mut Fingers, ended: Option<Status>, stamp_ms: u32) -> Option<()> {
        if let (Some(status), Some((number, id))) = (ended, self.running) {
            self.running = None;
            self.send(&wire::reply(number, id, status))?;
        }
        read_into(&mut self.tcp, &mut self.inbox).ok()?;
        while let Some(message) = self.inbox.next().ok()? {
            self.take(&message, fingers)?;
        }
        let _sent = self.udp.send(&wire::state(fingers, stamp_ms));
        Some(())
    }

    fn take(&mut self, message: &Message, fingers: &mut Fingers) -> Option<()> {
        let (number, id) = (message.number, message.id);
        match wire::request(number, &message.payload) {
            Some(Request::Connect { .. }) => None,
            None => self.send(&wire::reply(number, id, Status::Fail)),
            Some(Request::Stop) => {
                self.cut_off(fingers)?;
                self.send(&wire::reply(number, id, Status::Success))
            }
            Some(Request::Act(action)) => {
                self.cut_off(fingers)?;
                match fingers.begin(action) {
                    Ok(()) => self.running = Some((number, id)),
                    Err(outcome) => self.send(&wire::reply(number, id, wire::status(outcome)))?,
                }
                Some(())
            }
        }
    }

    /// Ends the action that runs, and says so.
    fn cut_off(&mut self, fingers: &mut Fingers) -> Option<()> {
        fingers.stop();
        match self.running.take() {
            Some((number, id)) => self.send(&wire::reply(number, id, Status::Aborted)),
            None => Some(()),
        }
    }

    fn send(&mut self, message: &[u8]) -> Option<()> {
        self.tcp.write_all(message).ok()
    }
}
