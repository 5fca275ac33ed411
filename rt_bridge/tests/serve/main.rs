//! The served robot over real sockets: byte by byte against the protocol's offsets, and driven by the bridge's own driver.
//! Its inner life (limits, reflexes, losses) is tested beside its code, without sockets.

mod client;
mod driver;
mod hand;
mod hostile;
mod protocol;

use rt_bridge::serve::{Pace, Ports, Report, Server};
use shared_mem::cell::Cell;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// The cell that ships with the project.
pub(crate) fn cell() -> Cell {
    Cell::parse(include_str!("../../../config/fr3_cell.toml"), Path::new("fr3_cell.toml")).expect("the shipped cell")
}

/// Ports of this machine that are free.
pub(crate) fn free_ports() -> Ports {
    Ports { arm: 0, hand: Some(0), ..Ports::default() }
}

/// A running server; it ends when dropped.
pub(crate) struct Served {
    pub(crate) address: SocketAddr,
    pub(crate) hand: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Report>>,
}

impl Served {
    pub(crate) fn start(pace: Pace) -> Self {
        let server = Server::open(&cell(), None, free_ports(), pace).expect("an FR3 and free ports");
        let (address, hand) = (server.address().expect("it listens"), server.hand_address().expect("it has a hand"));
        let stop = Arc::new(AtomicBool::new(false));
        let told = stop.clone();
        let thread = Some(thread::spawn(move || server.run(&told, None)));
        Self { address, hand, stop, thread }
    }

    /// Ends it.
    pub(crate) fn finish(mut self) -> Report {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().expect("it runs").join().expect("it does not panic")
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let report = thread.join();
            assert!(report.is_ok() || thread::panicking(), "the server panicked");
        }
    }
}
