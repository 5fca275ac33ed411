//! What stands between viewers and the Foxglove server, which takes anybody and any number: the socket that viewers connect
//! to. It reads the request that opens a WebSocket, refuses those that come from a web page that is no viewer, counts the
//! others, and then passes bytes to and fro without looking at them.
//!
//! | bound | why |
//! |---|---|
//! | [`MAX_VIEWERS`] viewers | each costs memory for what it has not read yet |
//! | [`PATIENCE`] without reading | a stuck tab gives its place back |
//! | `Host` and `Origin` | any web page that a browser on this machine shows may open a socket here: it would see the laboratory |
//!
//! The server behind it listens at an address of the loopback that is drawn at each start, so that no web page finds it
//! past this check. Programs on this machine can; they could read shared memory as well.

use super::request::{MAX_VIEWERS, Refusal, check};
use std::collections::BTreeMap;
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How long a viewer may leave what it was sent unread.
pub(super) const PATIENCE: Duration = Duration::from_secs(10);
/// How long a request may take to arrive, and how long it may be [bytes]: a browser's has some hundred.
const REQUEST: Duration = Duration::from_secs(2);
const LONGEST: usize = 8192;
/// Connections at a time whose request is still read, beside the viewers. One more is closed at once.
const CALLERS: usize = 16;
/// How often new connections are looked for.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Of refused viewers, one in this time is named in the log.
const QUIET: Duration = Duration::from_secs(10);

/// The socket that viewers connect to; it closes when dropped.
pub(super) struct Front {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    server: SocketAddr,
    patience: Duration,
    stop: AtomicBool,
    callers: AtomicUsize,
    viewers: Mutex<BTreeMap<SocketAddr, TcpStream>>,
    named: Mutex<Option<Instant>>,
}

/// An address of the loopback for the server behind, out of sixteen million.
pub(super) fn hidden_address() -> Ipv4Addr {
    let [a, b, c, ..] = RandomState::new().hash_one(()).to_le_bytes();
    Ipv4Addr::new(127, a, b, c.clamp(1, 254))
}

impl Front {
    /// Listens at `listen` for viewers of `server`, which are closed when they read nothing for `patience`.
    pub(super) fn open(listen: SocketAddr, server: SocketAddr, patience: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind(listen)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            server,
            patience,
            stop: AtomicBool::new(false),
            callers: AtomicUsize::new(0),
            viewers: Mutex::new(BTreeMap::new()),
            named: Mutex::new(None),
        });
        let ours = Arc::clone(&shared);
        let thread = thread::Builder::new().name("viewer_front".into()).spawn(move || listen_for(&listener, &ours))?;
        Ok(Self { address, shared, thread: Some(thread) })
    }

    /// Where viewers connect to.
    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    #[cfg(test)]
    pub(super) fn viewers(&self) -> usize {
        self.shared.viewers().len()
    }
}

impl Drop for Front {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
        // Also ends what the server behind still wants to send to a viewer that does not read.
        self.shared.viewers().values().for_each(hang_up);
    }
}

fn listen_for(listener: &TcpListener, shared: &Arc<Shared>) {
    while !shared.stop.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((caller, from)) if shared.callers.fetch_add(1, Ordering::Relaxed) < CALLERS => {
                let theirs = Arc::clone(shared);
                let begun =
                    thread::Builder::new().name("viewer_relay".into()).spawn(move || theirs.receive(caller, from));
                if begun.is_err() {
                    shared.callers.fetch_sub(1, Ordering::Relaxed);
                }
            }
            Ok(_) => {
                shared.callers.fetch_sub(1, Ordering::Relaxed);
            }
            Err(_) => thread::sleep(POLL_PERIOD),
        }
    }
}

impl Shared {
    fn viewers(&self) -> MutexGuard<'_, BTreeMap<SocketAddr, TcpStream>> {
        self.viewers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Everything that happens to one connection.
    fn receive(&self, mut caller: TcpStream, from: SocketAddr) {
        let request = read_request(&mut caller);
        let placed = request.and_then(|request| {
            check(&request)?;
            self.take_place(&caller, from)?;
            Ok(request)
        });
        self.callers.fetch_sub(1, Ordering::Relaxed);
        match placed {
            Ok(request) => {
                let _ended = self.relay(&caller, &request);
                self.viewers().remove(&from);
            }
            Err(refusal) => {
                self.name(&refusal);
                let _gone = caller.write_all(refusal.reply().as_bytes());
            }
        }
        hang_up(&caller);
    }

    fn take_place(&self, caller: &TcpStream, from: SocketAddr) -> Result<(), Refusal> {
        let mut viewers = self.viewers();
        if self.stop.load(Ordering::Relaxed) {
            return Err(Refusal::Broken);
        }
        if viewers.len() >= MAX_VIEWERS {
            return Err(Refusal::Full);
        }
        viewers.insert(from, caller.try_clone()?);
        Ok(())
    }

    /// Passes bytes on until one side ends.
    fn relay(&self, viewer: &TcpStream, request: &[u8]) -> io::Result<()> {
        let mut server = TcpStream::connect(self.server)?;
        server.set_nodelay(true)?;
        server.write_all(request)?;
        viewer.set_nodelay(true)?;
        viewer.set_read_timeout(None)?;
        viewer.set_write_timeout(Some(self.patience))?;
        thread::scope(|scope| {
            scope.spawn(|| pass_on(&server, viewer));
            pass_on(viewer, &server);
        });
        Ok(())
    }

    fn name(&self, refusal: &Refusal) {
        let mut named = self.named.lock().unwrap_or_else(PoisonError::into_inner);
        if named.is_none_or(|at| at.elapsed() >= QUIET) && !matches!(refusal, Refusal::Broken) {
            *named = Some(Instant::now());
            tracing::warn!("a viewer was refused: {refusal}");
        }
    }
}

/// Passes on what `from` sends until it ends or `to` takes nothing any more; ends both then.
fn pass_on(mut from: &TcpStream, mut to: &TcpStream) {
    let mut bytes = vec![0; 65_536];
    loop {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(length) if to.write_all(&bytes[..length]).is_ok() => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Ok(_) | Err(_) => break,
        }
    }
    hang_up(from);
    hang_up(to);
}

fn hang_up(socket: &TcpStream) {
    let _closed_already = socket.shutdown(Shutdown::Both);
}

/// The request that opens a connection, up to its empty line and what came along with that.
fn read_request(caller: &mut TcpStream) -> Result<Vec<u8>, Refusal> {
    let (begin, mut request, mut bytes) = (Instant::now(), Vec::new(), [0; 2048]);
    caller.set_nonblocking(false)?;
    loop {
        let left = REQUEST.checked_sub(begin.elapsed()).filter(|left| !left.is_zero()).ok_or(Refusal::Broken)?;
        caller.set_read_timeout(Some(left))?;
        match caller.read(&mut bytes)? {
            0 => return Err(Refusal::Broken),
            length => request.extend_from_slice(&bytes[..length]),
        }
        if request.windows(4).any(|four| four == b"\r\n\r\n") {
            return Ok(request);
        }
        if request.len() > LONGEST {
            return Err(Refusal::NotAViewer);
        }
    }
}
