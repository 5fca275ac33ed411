//! The ports of the served robot and its millisecond. One thread does it all: requests, set points, physics and states
//! follow each other as on a robot, and nothing is shared. The hand has a thread of its own.
//!
//! Free-running, a state leaves each millisecond and a set point that comes later than the next one is lost; where this
//! machine wakes the thread late, the robot's clock waits rather than rob the client of its time to answer. In lock-step,
//! while a motion is commanded, the robot's clock stands still until the set point is there: for tests and debuggers, and
//! where real time does not matter either, as fast as the client can go.

use super::ServeError;
use super::arrivals::{Arrivals, Outcome};
use super::connection::ConnectionEnd;
use super::framing::Inbox;
use super::hand::HandService;
use super::notices::{About, Notices};
use super::robot::{Robot, Tally};
use super::session::Session;
use super::wire::{ROBOT_COMMAND_PORT, SetPoint};
use crate::rt::process;
use crate::times::{Percentiles, Times};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use shared_mem::time::now_ns;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What a client is left of it at least, however late the thread woke [ns].
const LEAST_NS: u64 = 800_000;
/// How long a set point is waited for between two looks at the client's other socket, in lock-step.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// How the robot's clock goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// A state each millisecond.
    RealTime,
    /// As the client's set points come, while it commands, but no faster than real time: other programs take part.
    LockStep,
    /// As the client's set points come, while it commands.
    Fast,
}

/// Where to listen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ports {
    /// Address of this machine.
    pub bind: IpAddr,
    /// The arm's port; 0: any that is free.
    pub arm: u16,
    /// The hand's port; 0: any that is free, none: no hand.
    pub hand: Option<u16>,
}

impl Default for Ports {
    fn default() -> Self {
        let bind = IpAddr::V4(Ipv4Addr::LOCALHOST);
        Self { bind, arm: ROBOT_COMMAND_PORT, hand: Some(super::hand::PORT) }
    }
}

/// What serving was like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Milliseconds, motions, reflexes and lost commands of the robot.
    #[serde(flatten)]
    pub robot: Tally,
    /// Clients that were served.
    pub clients: u64,
    /// Connections that were refused: a second client, another version, no handshake, or none of this protocol.
    pub refused: u64,
    /// Milliseconds that this machine began so late that the robot's clock waited.
    pub slipped: u64,
    /// How late the robot's thread woke [us]; nothing counted in lock-step.
    pub late_us: Percentiles,
}

/// A robot that listens and waits to be run.
pub struct Server {
    robot: Robot,
    pace: Pace,
    arrivals: Arrivals,
    hand: Option<HandService>,
    session: Option<Session>,
    notices: Notices,
    clients: u64,
    refused: u64,
    slipped: u64,
    late: Times,
}

/// When to stop serving.
struct Until<'a> {
    stop: &'a AtomicBool,
    end: Option<Instant>,
}

impl Until<'_> {
    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Server {
    /// A robot as `cell` describes it, with parameters and effects `theta` that are hidden from clients, listening at `ports`.
    ///
    /// # Errors
    /// [`ServeError`] when the cell holds no FR3 that can be simulated, or a port cannot be had.
    pub fn open(cell: &Cell, theta: Option<&Theta>, ports: Ports, pace: Pace) -> Result<Self, ServeError> {
        let robot = Robot::new(cell, theta)?;
        let open = |port, flag, inbox| {
            let address = SocketAddr::new(ports.bind, port);
            Arrivals::at(listen(address, flag)?, inbox).map_err(|source| ServeError::Bind { address, source })
        };
        let arrivals = open(ports.arm, "--port", Inbox::of_the_arm)?;
        let hand = ports.hand.map(|port| open(port, "--hand-port", Inbox::of_the_hand)).transpose()?;
        Ok(Self {
            robot,
            pace,
            arrivals,
            hand: hand.map(HandService::start),
            session: None,
            notices: Notices::new(),
            clients: 0,
            refused: 0,
            slipped: 0,
            late: Times::new(),
        })
    }

    /// Where the arm listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.arrivals.address()
    }

    /// Where the hand listens, where there is one.
    pub fn hand_address(&self) -> Option<SocketAddr> {
        self.hand.as_ref().map(HandService::address)
    }

    /// Serves until `stop` is set or `duration` is over, also while a client in lock-step lets the robot wait.
    pub fn run(mut self, stop: &AtomicBool, duration: Option<Duration>) -> Report {
        if self.pace == Pace::RealTime {
            // It plays the robot, which is always in time; where that is not granted, its clock waits.
            let _not_granted = process::set_fifo(process::SIMULATION_PRIORITY);
        }
        let until = Until { stop, end: duration.and_then(|duration| Instant::now().checked_add(duration)) };
        let mut next_ns = now_ns() + TICK_NS;
        while !until.is_over() {
            let awaited = self.pace != Pace::RealTime && self.robot.is_commanded();
            if !(awaited && self.pace == Pace::Fast) {
                process::sleep_until(next_ns);
                next_ns = self.woke(next_ns);
            }
            self.attend();
            let set_point = if awaited { self.await_set_point(&until) } else { self.take_set_point() };
            self.robot.tick(set_point.as_ref());
            self.report();
        }
        self.notices.finish();
        self.robot.notices.finish();
        Report {
            robot: self.robot.tally(),
            clients: self.clients,
            refused: self.refused,
            slipped: self.slipped,
            late_us: self.late.percentiles(),
        }
    }

    /// Takes note of having woken, and says when to wake next [ns].
    fn woke(&mut self, planned_ns: u64) -> u64 {
        let now = now_ns();
        let (regular, least) = (planned_ns + TICK_NS, now + LEAST_NS);
        if self.pace == Pace::RealTime {
            self.slipped += u64::from(least > regular);
            self.late.record(now.saturating_sub(planned_ns));
        }
        regular.max(least)
    }

    /// Takes what the client asks, then new clients: in this order, so that one that has just left is no reason to refuse
    /// the next.
    fn attend(&mut self) {
        self.serve();
        for outcome in self.arrivals.look(Instant::now()) {
            if matches!(outcome, Outcome::Asks(..)) {
                // The one before may have left since it was looked at.
                self.serve();
            }
            let (peer, opened) = match outcome {
                Outcome::Asks(arrival, message) => {
                    (arrival.peer, Session::open(arrival, &message, self.session.is_some()))
                }
                Outcome::Closed(peer, gone) => (peer, Err(gone)),
            };
            match opened {
                Ok(session) => {
                    self.session = Some(session);
                    self.clients += 1;
                    self.notices.info(About::Client, format_args!("{peer} is connected"));
                }
                // Somebody who only looked whether a robot listens here.
                Err(ConnectionEnd::Left) => {}
                Err(gone) => {
                    self.refused += 1;
                    self.notices.warn(About::Refusal, format_args!("{peer}: {gone}"));
                }
            }
        }
    }

    /// Takes what the connected client asks, or that it has left.
    fn serve(&mut self) {
        if let Some(session) = &mut self.session {
            let served = session.serve(&mut self.robot, &mut self.notices);
            self.keep_or_part(served);
        }
    }

    fn report(&mut self) {
        match &mut self.session {
            Some(session) => {
                let reported = session.report(&mut self.robot);
                self.keep_or_part(reported);
            }
            None => drop(self.robot.outbox()),
        }
    }

    fn keep_or_part(&mut self, served: Result<(), ConnectionEnd>) {
        if let Err(gone) = served {
            self.session = None;
            self.robot.client_left();
            let line = format_args!("the client is gone: {gone}");
            match gone {
                ConnectionEnd::Left => self.notices.info(About::Client, line),
                _ => self.notices.warn(About::Client, line),
            }
        }
    }

    fn take_set_point(&mut self) -> Option<SetPoint> {
        self.session.as_ref().and_then(|session| session.waiting_set_point(&self.robot.answers()))
    }

    /// The set point of the newest state, for as long as one is owed.
    fn await_set_point(&mut self, until: &Until) -> Option<SetPoint> {
        while self.robot.is_commanded() && !until.is_over() {
            let set_point = self.take_set_point();
            if set_point.is_some() {
                return set_point;
            }
            // Only to sleep until something is there: the next look takes it.
            let waited = self.session.as_ref().map_or(Err(ConnectionEnd::Left), |session| session.wait(LOOK_EVERY));
            self.keep_or_part(waited);
            self.attend();
        }
        None
    }
}

/// Listens at `address`, which the argument `flag` chooses.
fn listen(address: SocketAddr, flag: &'static str) -> Result<TcpListener, ServeError> {
    TcpListener::bind(address).map_err(|source| match source.kind() {
        io::ErrorKind::AddrInUse => ServeError::PortTaken { address, flag },
        _ => ServeError::Bind { address, source },
    })
}
