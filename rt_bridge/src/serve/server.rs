//! The ports of the served robot and its millisecond. One thread does it all: requests, set points, physics and states
//! follow each other as on a robot, and nothing is shared. The hand has a thread of its own.
//!
//! Free-running, a state leaves each millisecond and a set point that comes later than the next one is lost; where this
//! machine wakes the thread late, the robot's clock waits rather than rob the client of its time to answer. In lock-step,
//! while a motion is commanded, the robot's clock stands still until the set point is there: for tests and debuggers, and
//! where real time does not matter either, as fast as the client can go.

use super::ServeError;
use super::hand::HandService;
use super::robot::{Robot, Tally};
use super::session::{Gone, Session};
use super::wire::{ROBOT_COMMAND_PORT, SetPoint};
use crate::rt::process;
use crate::times::{Percentiles, Times};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use shared_mem::time::now_ns;
use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The robot's period [ns].
const PERIOD_NS: u64 = 1_000_000;
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
    /// Milliseconds that this machine began so late that the robot's clock waited.
    pub slipped: u64,
    /// How late the robot's thread woke [us]; nothing counted in lock-step.
    pub late_us: Percentiles,
}

/// A robot that listens and waits to be run.
pub struct Server {
    robot: Robot,
    pace: Pace,
    listener: TcpListener,
    udp: UdpSocket,
    hand: Option<HandService>,
    queue: VecDeque<(TcpStream, SocketAddr)>,
    session: Option<Session>,
    clients: u64,
    slipped: u64,
    late: Times,
}

impl Server {
    /// A robot as `cell` describes it, with parameters and effects `theta` that no client is told, listening at `ports`.
    ///
    /// # Errors
    /// [`ServeError`] when the cell holds no FR3 that can be simulated, or a port cannot be had.
    pub fn open(cell: &Cell, theta: Option<&Theta>, ports: Ports, pace: Pace) -> Result<Self, ServeError> {
        let robot = Robot::new(cell, theta)?;
        let listener = listen(SocketAddr::new(ports.bind, ports.arm), "--port")?;
        let at = SocketAddr::new(ports.bind, 0);
        let open = || {
            listener.set_nonblocking(true)?;
            UdpSocket::bind(at)
        };
        let udp = open().map_err(|source| ServeError::Bind { address: at, source })?;
        let hand = ports.hand.map(|port| listen(SocketAddr::new(ports.bind, port), "--hand-port")).transpose()?;
        Ok(Self {
            robot,
            pace,
            listener,
            udp,
            hand: hand.map(HandService::start),
            queue: VecDeque::new(),
            session: None,
            clients: 0,
            slipped: 0,
            late: Times::new(),
        })
    }

    /// Where the arm listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Where the hand listens, where there is one.
    #[must_use]
    pub fn hand_address(&self) -> Option<SocketAddr> {
        self.hand.as_ref().map(HandService::address)
    }

    /// Serves until `stop` is set or `duration` is over.
    ///
    /// # Errors
    /// The system's, when a socket fails that is no client's.
    pub fn run(mut self, stop: &AtomicBool, duration: Option<Duration>) -> io::Result<Report> {
        if self.pace == Pace::RealTime {
            // It plays the robot, which is always in time; where that is not granted, its clock waits.
            let _not_granted = process::set_fifo(process::SIMULATION_PRIORITY);
        }
        let begin = Instant::now();
        let mut next_ns = now_ns() + PERIOD_NS;
        while !stop.load(Ordering::Relaxed) && duration.is_none_or(|duration| begin.elapsed() < duration) {
            self.welcome();
            let awaited = self.pace != Pace::RealTime && self.robot.is_commanded();
            if !(awaited && self.pace == Pace::Fast) {
                process::sleep_until(next_ns);
                next_ns = self.woke(next_ns);
            }
            self.take_requests();
            let set_point = if awaited { self.await_set_point(stop)? } else { self.take_set_point()? };
            self.robot.tick(set_point.as_ref());
            self.tell();
        }
        let late_us = self.late.percentiles();
        Ok(Report { robot: self.robot.tally(), clients: self.clients, slipped: self.slipped, late_us })
    }

    /// Takes note of having woken, and says when to wake next [ns].
    fn woke(&mut self, planned_ns: u64) -> u64 {
        let now = now_ns();
        let (regular, least) = (planned_ns + PERIOD_NS, now + LEAST_NS);
        if self.pace == Pace::RealTime {
            self.slipped += u64::from(least > regular);
            self.late.record(now.saturating_sub(planned_ns));
        }
        regular.max(least)
    }

    /// Takes new clients into the queue, and the first of it where nobody is served: a robot has one client at a time, and
    /// leaves the others without an answer until then.
    fn welcome(&mut self) {
        while let Ok((tcp, peer)) = self.listener.accept() {
            if self.session.is_some() {
                tracing::warn!("{peer} has to wait: this robot serves one client at a time");
            }
            self.queue.push_back((tcp, peer));
        }
        while self.session.is_none()
            && let Some((tcp, peer)) = self.queue.pop_front()
        {
            self.session = Session::new(tcp, peer).ok();
            self.clients += 1;
            tracing::info!("{peer} is connected");
        }
    }

    fn take_requests(&mut self) {
        let Some(session) = &mut self.session else { return };
        let served = session.serve(&mut self.robot);
        self.keep_or_part(served);
    }

    fn tell(&mut self) {
        match &mut self.session {
            Some(session) => {
                let told = session.tell(&mut self.robot, &self.udp);
                self.keep_or_part(told);
            }
            None => drop(self.robot.outbox()),
        }
    }

    fn keep_or_part(&mut self, served: Result<(), Gone>) {
        if let Err(gone) = served {
            self.session = None;
            self.robot.client_left();
            match gone {
                Gone::Left => tracing::info!("the client is gone: {gone}"),
                Gone::Nonsense(_) | Gone::Broken(_) => tracing::warn!("the client is gone: {gone}"),
            }
        }
    }

    fn take_set_point(&mut self) -> io::Result<Option<SetPoint>> {
        self.udp.set_nonblocking(true)?;
        Ok(self.session.as_ref().and_then(|session| session.waiting_set_point(&self.udp, &self.robot.answers())))
    }

    /// The set point of the newest state, for as long as one is owed.
    fn await_set_point(&mut self, stop: &AtomicBool) -> io::Result<Option<SetPoint>> {
        loop {
            if !self.robot.is_commanded() || stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            if let Some(set_point) = self.take_set_point()? {
                return Ok(Some(set_point));
            }
            self.udp.set_nonblocking(false)?;
            self.udp.set_read_timeout(Some(LOOK_EVERY))?;
            // Only to sleep until something is there: the next look takes it.
            let _something = self.udp.peek_from(&mut [0; 1]);
            self.take_requests();
        }
    }
}

/// Listens at `address`, which the argument `flag` chooses.
fn listen(address: SocketAddr, flag: &'static str) -> Result<TcpListener, ServeError> {
    TcpListener::bind(address).map_err(|source| match source.kind() {
        io::ErrorKind::AddrInUse => ServeError::PortTaken { address, flag },
        _ => ServeError::Bind { address, source },
    })
}
