//! Other work on the machine: threads of this process that keep disk, memory, timers, network or processors busy.

use std::io::Write as _;
use std::net::UdpSocket;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// A file that is written, synchronised and removed again and again [bytes].
const FILE: usize = 64 << 20;
/// Written at a time [bytes].
const BLOCK: usize = 1 << 20;
/// Memory that is taken, touched and given back [bytes].
const MEMORY: usize = 256 << 20;
/// Of these every one is touched [bytes].
const PAGE: usize = 4096;
/// Threads that wake all the time, and how long each sleeps.
const TIMERS: usize = 8;
const TIMER: Duration = Duration::from_micros(100);
/// A datagram as large as an Ethernet frame takes [bytes].
const DATAGRAM: usize = 1472;
/// Datagrams between two pauses.
const BURST: usize = 64;

/// A kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Load {
    /// Writes and synchronises files on the disk of the recordings.
    Disk,
    /// Takes, touches and gives back memory.
    Memory,
    /// Threads that wake 10,000 times a second.
    Timer,
    /// Datagrams over the loopback.
    Network,
    /// One thread a processor that never sleeps.
    Cpu,
    /// Nothing.
    None,
}

impl std::fmt::Display for Load {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Disk => "disk",
            Self::Memory => "memory",
            Self::Timer => "timer",
            Self::Network => "network",
            Self::Cpu => "cpu",
            Self::None => "none",
        })
    }
}

/// Work under way; it ends when this goes.
pub(crate) struct Loaded {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Loaded {
    /// Starts all of these; files lie in `folder`, which is made.
    pub(crate) fn start(loads: &[Load], folder: &Path) -> Self {
        let mut loaded = Self { over: Arc::new(AtomicBool::new(false)), threads: Vec::new() };
        for load in loads {
            match load {
                Load::Disk => {
                    std::fs::create_dir_all(folder).expect("a folder for the load");
                    let file = folder.join("written");
                    loaded.repeat(move || write_file(&file));
                }
                Load::Memory => loaded.repeat(touch_memory),
                Load::Timer => (0..TIMERS).for_each(|_| loaded.repeat(|| std::thread::sleep(TIMER))),
                Load::Network => {
                    let [near, far] = [0, 1].map(|_| UdpSocket::bind("127.0.0.1:0").expect("a free port"));
                    near.connect(far.local_addr().expect("an address")).expect("the loopback");
                    far.set_read_timeout(Some(Duration::from_millis(100))).expect("a limit");
                    loaded.repeat(move || send_burst(&near));
                    loaded.repeat(move || {
                        // A datagram that does not come within the limit is none.
                        let _none = far.recv(&mut [0; DATAGRAM]);
                    });
                }
                Load::Cpu => {
                    let processors = std::thread::available_parallelism().map_or(1, usize::from);
                    (0..processors).for_each(|_| {
                        loaded.repeat(|| {
                            (0..1_000_000).for_each(|k| {
                                std::hint::black_box(k);
                            })
                        })
                    });
                }
                Load::None => {}
            }
        }
        loaded
    }

    /// A thread that does `work` until the load ends.
    fn repeat(&mut self, mut work: impl FnMut() + Send + 'static) {
        let over = self.over.clone();
        self.threads.push(std::thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                work();
            }
        }));
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _failed = thread.join();
        }
    }
}

fn write_file(file: &Path) {
    let block = vec![0x5a; BLOCK];
    let mut out = std::fs::File::create(file).expect("a file of the load");
    for _ in 0..FILE / BLOCK {
        out.write_all(&block).expect("room for the load");
    }
    out.sync_all().expect("a disk that works");
    drop(out);
    std::fs::remove_file(file).expect("the file of the load");
}

fn touch_memory() {
    let mut taken = vec![0_u8; MEMORY];
    taken.iter_mut().step_by(PAGE).for_each(|byte| *byte = 1);
    std::hint::black_box(&taken);
}

fn send_burst(socket: &UdpSocket) {
    for _ in 0..BURST {
        // A full buffer is what a load is there to cause.
        let _full = socket.send(&[0x5a; DATAGRAM]);
    }
    std::thread::sleep(TIMER);
}
