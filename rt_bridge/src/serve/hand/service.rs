//! The hand's port and clock: one client at a time, an action whose reply comes when it ends, states in between.

use super::wire::{self, Request, Status};
use crate::gripper::FRANKA_HAND;
use crate::gripper::fingers::Fingers;
use crate::serve::framing::{Inbox, Message};
use crate::serve::session::read_into;
use std::io::Write as _;
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
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
    /// Serves a hand at `listener`.
    pub(in crate::serve) fn start(listener: TcpListener) -> Self {
        let address = listener.local_addr().unwrap_or_else(|_| SocketAddr::from(([0, 0, 0, 0], 0)));
        let stop = Arc::new(AtomicBool::new(false));
        let told = stop.clone();
        let body = move || {
            if let Err(error) = serve(&listener, &told) {
                tracing::warn!("the hand is out of service ({error}); the arm is not affected");
            }
        };
        let thread = thread::Builder::new().name("hand".into()).spawn(body).ok();
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
    states_to: Option<SocketAddr>,
    peer: SocketAddr,
    /// Number and counter of the request whose action runs.
    running: Option<(u32, u32)>,
}

fn serve(listener: &TcpListener, stop: &AtomicBool) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    let udp = UdpSocket::bind(SocketAddr::new(listener.local_addr()?.ip(), 0))?;
    let (mut fingers, mut client, begin) = (Fingers::new(FRANKA_HAND), None::<Client>, Instant::now());
    while !stop.load(Ordering::Relaxed) {
        if client.is_none()
            && let Ok((tcp, peer)) = listener.accept()
        {
            tcp.set_nonblocking(true)?;
            tcp.set_nodelay(true)?;
            client = Some(Client { tcp, inbox: Inbox::of_the_hand(), states_to: None, peer, running: None });
        }
        let ended = fingers.step(CYCLE.as_secs_f64()).map(wire::status);
        let stamp_ms = u32::try_from(begin.elapsed().as_millis()).unwrap_or(u32::MAX);
        if let Some(served) = &mut client
            && served.cycle(&mut fingers, ended, &udp, stamp_ms).is_none()
        {
            fingers.stop();
            client = None;
        }
        thread::sleep(CYCLE);
    }
    Ok(())
}

impl Client {
    /// One cycle; `None` when the client is gone.
    fn cycle(&mut self, fingers: &mut Fingers, ended: Option<Status>, udp: &UdpSocket, stamp_ms: u32) -> Option<()> {
        if let (Some(status), Some((number, id))) = (ended, self.running) {
            self.running = None;
            self.send(&wire::reply(number, id, status))?;
        }
        read_into(&mut self.tcp, &mut self.inbox).ok()?;
        while let Some(message) = self.inbox.next().ok()? {
            self.take(&message, fingers)?;
        }
        if let Some(to) = self.states_to {
            let _sent = udp.send_to(&wire::state(fingers, stamp_ms), to);
        }
        Some(())
    }

    fn take(&mut self, message: &Message, fingers: &mut Fingers) -> Option<()> {
        let (number, id) = (message.number, message.id);
        match (wire::request(number, &message.payload), self.states_to) {
            (Some(Request::Connect { version, udp_port }), _) => {
                let agreed = wire::speaks(version);
                self.states_to = agreed.then(|| SocketAddr::new(self.peer.ip(), udp_port));
                self.send(&wire::connect_reply(id, agreed))
            }
            (_, None) => None,
            (None, Some(_)) => self.send(&wire::reply(number, id, Status::Fail)),
            (Some(Request::Stop), Some(_)) => {
                self.cut_off(fingers)?;
                self.send(&wire::reply(number, id, Status::Success))
            }
            (Some(Request::Act(action)), Some(_)) => {
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
