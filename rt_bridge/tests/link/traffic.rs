//! What a bridge would publish, and what is seen of it on either host.

use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{ImageSubscriber, Node, Subscriber, Wake};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

const SESSION: u64 = 7;

/// States at 1 kHz and depth pictures of 640 x 480 at 30 Hz, until it is stopped.
pub(crate) struct Traffic {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<u64>>,
}

impl Traffic {
    pub(crate) fn start(domain: &str, has_pictures: bool) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let mut threads = vec![publish(domain, &stop, states)];
        if has_pictures {
            threads.push(publish(domain, &stop, pictures));
        }
        Self { stop, threads }
    }

    /// How many of each were sent.
    pub(crate) fn stop(self) -> Vec<u64> {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.into_iter().map(|thread| thread.join().expect("a sender")).collect()
    }
}

fn publish(domain: &str, stop: &Arc<AtomicBool>, work: fn(&Node, &AtomicBool) -> u64) -> JoinHandle<u64> {
    let (domain, stop) = (domain.to_owned(), Arc::clone(stop));
    thread::spawn(move || work(&Node::open_in(&domain, "traffic").expect("shared memory"), &stop))
}

/// Calls `send` every `period` with a running number, until the end.
fn each(period: Duration, stop: &AtomicBool, mut send: impl FnMut(u64)) -> u64 {
    let (begin, mut number) = (Instant::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        send(number);
        number += 1;
        let due = period * u32::try_from(number).expect("an hour at most");
        thread::sleep(due.saturating_sub(begin.elapsed()));
    }
    number
}

fn state(cycle: u64) -> ArmState {
    let stamp_ns = now_ns();
    ArmState { stamp_ns, cycle, session: SESSION, dof: 7, q: [0.5; 8], tau_J: [1.5; 8], ..ArmState::default() }
}

fn states(node: &Node, stop: &AtomicBool) -> u64 {
    let publisher = node.publisher(topics::ARM_STATE).expect("a publisher");
    each(Duration::from_millis(1), stop, |cycle| {
        publisher.send(&state(cycle)).expect("a state sent");
    })
}

fn pictures(node: &Node, stop: &AtomicBool) -> u64 {
    let publisher = node.image_publisher(topics::CAMERA_DEPTH, 640 * 480 * 2).expect("a publisher");
    let header = ImageHeader {
        width: 640,
        height: 480,
        stride: 1280,
        encoding: PixelEncoding::Depth16,
        depth_scale: 1e-3,
        ..ImageHeader::default()
    };
    each(Duration::from_micros(33_333), stop, |sequence| {
        let fill = |pixels: &mut [u8]| {
            pixels.fill(sequence as u8);
            ImageHeader { stamp_ns: now_ns(), sequence, ..header }
        };
        publisher.send_with(640 * 480 * 2, fill).expect("a picture sent");
    })
}

/// What a reader saw.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    pub(crate) states: u64,
    /// States that are missing between the first and the last.
    pub(crate) gaps: u64,
    /// States that came twice or out of order.
    pub(crate) repeats: u64,
    /// States that nobody here sent.
    pub(crate) strangers: u64,
    pub(crate) pictures: u64,
    /// From stamp to reading [us].
    pub(crate) ages_us: Vec<f64>,
}

/// The share of values that lie below.
pub(crate) fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(((sorted.len() as f64 - 1.0) * share) as usize).copied().unwrap_or(f64::NAN)
}

/// A reader of a domain, on a thread of its own from the beginning.
pub(crate) struct Reader {
    newest_ns: Arc<AtomicU64>,
    limit_ns: Arc<AtomicU64>,
    thread: JoinHandle<Seen>,
}

impl Reader {
    pub(crate) fn open(domain: &str) -> Self {
        let (newest_ns, limit_ns) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(u64::MAX)));
        let (newest, limit, domain) = (Arc::clone(&newest_ns), Arc::clone(&limit_ns), domain.to_owned());
        let thread = thread::spawn(move || {
            let node = Node::open_in(&domain, "reader").expect("shared memory");
            let states = node.subscriber(topics::ARM_STATE).expect("a reader");
            let depth = node.image_subscriber(topics::CAMERA_DEPTH).expect("a reader");
            let wake = node.wake_on(topics::ARM_STATE.name).expect("a bell");
            read(&states, &depth, &wake, [&newest, &limit])
        });
        Self { newest_ns, limit_ns, thread }
    }

    /// Waits until something comes.
    pub(crate) fn wait_for_first(&mut self, patience: Duration) {
        let begin = Instant::now();
        while self.newest_ns() == 0 {
            assert!(begin.elapsed() < patience, "nothing came");
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Reads on for so long.
    pub(crate) fn read_for(self, time: Duration) -> Self {
        let limit = now_ns() + u64::try_from(time.as_nanos()).expect("an hour at most");
        self.limit_ns.store(limit, Ordering::Relaxed);
        self
    }

    /// Stamp of the newest state [ns].
    pub(crate) fn newest_ns(&self) -> u64 {
        self.newest_ns.load(Ordering::Relaxed)
    }

    pub(crate) fn join(self) -> thread::Result<Seen> {
        self.thread.join()
    }
}

fn read(states: &Subscriber<ArmState>, depth: &ImageSubscriber, wake: &Wake, [newest, limit]: [&AtomicU64; 2]) -> Seen {
    let (mut seen, mut last) = (Seen::default(), None);
    while now_ns() < limit.load(Ordering::Relaxed) {
        wake.wait(Duration::from_millis(20)).expect("a bell");
        while let Some(state) = states.receive().expect("a state") {
            if state.session != SESSION {
                seen.strangers += 1;
                continue;
            }
            seen.states += 1;
            seen.ages_us.push(now_ns().saturating_sub(state.stamp_ns) as f64 * 1e-3);
            match last {
                Some(last) if state.cycle <= last => seen.repeats += 1,
                Some(last) => seen.gaps += state.cycle - last - 1,
                None => {}
            }
            last = Some(state.cycle);
            newest.fetch_max(state.stamp_ns, Ordering::Relaxed);
        }
        while depth.receive().expect("a picture").is_some() {
            seen.pictures += 1;
        }
    }
    seen
}
