//! A link at work: the only code that knows zenoh.
//!
//! | thread | does |
//! |---|---|
//! | one a topic that is sent (`send`) | shared memory to network; keeps states, and sends again what is asked for |
//! | one a topic that is taken (`take`) | network to shared memory, in order |
//! | `link clock` (`asking`, `hosts`) | round trips: offset of the clocks, and whether anybody is there |
//! | main | remarks, status lines, the end |
//!
//! Ports of shared memory belong to the thread that opened them; zenoh's own threads only fill queues.

mod asking;
mod hosts;
mod send;
mod session;
mod shared;
mod take;

use crate::crossing::{Crossing, Kind, Plan};
use crate::report::{Report, Sent, Taken, in_words};
use crate::{LinkError, Settings, Side};
use shared::{Arrivals, SentCount, Shared, TakenCount, lock};
use shared_mem::msg::event::Event;
use shared_mem::recording::{Encoded, EncodedVisitor, visit_encoded};
use shared_mem::topics::{self, ImageTopic, Topic};
use shared_mem::transport::{Node, Publisher, TransportError};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use zenoh::Session;

/// How often main looks.
const POLL_PERIOD: Duration = Duration::from_millis(50);
/// Between two attempts to reach the other host for the first time.
const RETRY: Duration = Duration::from_millis(250);
/// Between two status lines, and between two remarks that nobody is reached.
const STATUS: Duration = Duration::from_secs(10);
/// After so long without any message of a bridge there is something to say.
const SILENCE: Duration = Duration::from_secs(5);

type Thread = JoinHandle<Result<(), LinkError>>;

/// Links two hosts until `stop` is set or the duration is over.
///
/// # Errors
/// [`LinkError`] with what to do.
pub fn run(settings: &Settings, stop: &Arc<AtomicBool>) -> Result<Report, LinkError> {
    let begin = Instant::now();
    let node = Node::open("rt_bridge_link")?;
    try_ports(&node, &settings.plan)?;
    let is_over = || stop.load(Ordering::Relaxed) || settings.duration.is_some_and(|d| begin.elapsed() >= d);
    let Some(session) = reach(settings, stop, &is_over)? else {
        return Ok(report(begin, &[], &[], None));
    };
    let (remarks, said) = channel();
    // The threads end together, whether or not the caller asked.
    let ends = Arc::new(AtomicBool::new(false));
    let shared = Shared::new(session.clone(), RandomState::new().build_hasher().finish(), Arc::clone(&ends), remarks);
    let mut work = Work::default();
    let begun = work.begin(&shared, &settings.plan);
    let answering = asking::answer(&shared, &settings.plan);
    let done = begun.and(answering).and_then(|_answering| work.watch(&shared, &node, &said, &is_over));
    ends.store(true, Ordering::Relaxed);
    let ended = work.end();
    session::close(session);
    done.and(ended)?;
    let hosts = lock(&shared.hosts);
    if let (Side::Connect(endpoint), false, false) = (&settings.side, hosts.were_met(), stop.load(Ordering::Relaxed)) {
        let what = "what answers there is no link".to_owned();
        return Err(LinkError::NotReached { endpoint: endpoint.clone(), what });
    }
    Ok(report(begin, &work.sent, &work.taken, Some(&*hosts)))
}

/// Opens the session; where the other host is not there yet, again and again.
fn reach(settings: &Settings, stop: &AtomicBool, is_over: &impl Fn() -> bool) -> Result<Option<Session>, LinkError> {
    let mut said: Option<Instant> = None;
    loop {
        let what = match session::open(&settings.side, &settings.plan) {
            Ok(session) => {
                if let Side::Listen(endpoint) = &settings.side {
                    tracing::info!("listening at {endpoint}");
                }
                return Ok(Some(session));
            }
            Err(what) => what,
        };
        let endpoint = match &settings.side {
            Side::Listen(endpoint) => return Err(session::listening_failed(endpoint, &what)),
            Side::Connect(endpoint) => endpoint,
        };
        if said.is_none_or(|at| at.elapsed() >= STATUS) {
            said = Some(Instant::now());
            let what = session::why_not_reached(endpoint);
            tracing::warn!("{endpoint} is not reached: {what}; it is looked for until Ctrl-C");
        }
        let until = Instant::now() + RETRY;
        while Instant::now() < until && !is_over() {
            thread::sleep(POLL_PERIOD);
        }
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        if is_over() {
            let what = session::why_not_reached(endpoint);
            return Err(LinkError::NotReached { endpoint: endpoint.clone(), what });
        }
    }
}

/// Opens every port once: what is in the way is said before anybody is connected.
fn try_ports(node: &Node, plan: &Plan) -> Result<(), TransportError> {
    struct Ports<'a>(&'a Node, &'a Plan, Result<(), TransportError>);
    impl Ports<'_> {
        fn is_taken(&self, topic: &str) -> bool {
            self.2.is_ok() && self.1.take.iter().any(|crossing| crossing.topic == topic)
        }
    }
    impl EncodedVisitor for Ports<'_> {
        fn messages<M: Encoded>(&mut self, topic: Topic<M>) {
            if self.is_taken(topic.name) {
                self.2 = self.0.publisher(topic).map(drop);
            }
        }
        fn pictures(&mut self, topic: ImageTopic) {
            if self.is_taken(topic.name) {
                self.2 = self.0.image_publisher(topic, 1).map(drop);
            }
        }
    }
    let mut ports = Ports(node, plan, Ok(()));
    visit_encoded(&mut ports);
    ports.2
}

/// The threads and what they count.
#[derive(Default)]
struct Work {
    threads: Vec<Thread>,
    sent: Vec<SentCount>,
    taken: Vec<TakenCount>,
}

/// Starts a thread for each topic of a plan.
struct Starter<'a> {
    work: &'a mut Work,
    shared: &'a Shared,
    plan: &'a Plan,
    failed: Option<LinkError>,
}

impl Starter<'_> {
    fn kind(of: &[Crossing], topic: &str) -> Option<Kind> {
        of.iter().find(|crossing| crossing.topic == topic).map(|crossing| crossing.kind)
    }

    fn start(&mut self, name: String, work: impl FnOnce(&Shared) -> Result<(), LinkError> + Send + 'static) {
        let shared = self.shared.clone();
        match thread::Builder::new().name(name).spawn(move || work(&shared)) {
            Ok(thread) => self.work.threads.push(thread),
            Err(error) => self.failed = Some(LinkError::Thread(error.to_string())),
        }
    }

    fn sent(&mut self, topic: &'static str) -> SentCount {
        let count = Arc::new(Mutex::new(Sent { topic, ..Sent::default() }));
        self.work.sent.push(Arc::clone(&count));
        count
    }

    fn taken(&mut self, topic: &'static str) -> TakenCount {
        let taken = Taken { topic, ..Taken::default() };
        let count = Arc::new(Mutex::new(Arrivals { taken, ..Arrivals::default() }));
        self.work.taken.push(Arc::clone(&count));
        count
    }
}

impl EncodedVisitor for Starter<'_> {
    fn messages<M: Encoded>(&mut self, topic: Topic<M>) {
        if let Some(kind) = Self::kind(&self.plan.send, topic.name) {
            let count = self.sent(topic.name);
            self.start(topic.name.into(), move |shared| send::send(shared, topic, kind, &count));
        }
        if let Some(kind) = Self::kind(&self.plan.take, topic.name) {
            let count = self.taken(topic.name);
            self.start(topic.name.into(), move |shared| take::take(shared, topic, kind, &count));
        }
    }

    fn pictures(&mut self, topic: ImageTopic) {
        if Self::kind(&self.plan.send, topic.name).is_some() {
            let count = self.sent(topic.name);
            self.start(topic.name.into(), move |shared| send::send_pictures(shared, topic, &count));
        }
        if Self::kind(&self.plan.take, topic.name).is_some() {
            let count = self.taken(topic.name);
            self.start(topic.name.into(), move |shared| take::take_pictures(shared, topic, &count));
        }
    }
}

impl Work {
    fn begin(&mut self, shared: &Shared, plan: &Plan) -> Result<(), LinkError> {
        let mut starter = Starter { work: self, shared, plan, failed: None };
        visit_encoded(&mut starter);
        let asked = plan.clone();
        starter.start("link clock".into(), move |shared| asking::ask(shared, &asked));
        starter.failed.map_or(Ok(()), Err)
    }

    /// Main's part: says what there is to say, until the end or until a thread gives up.
    fn watch(
        &self,
        shared: &Shared,
        node: &Node,
        said: &Receiver<Event>,
        is_over: &impl Fn() -> bool,
    ) -> Result<(), LinkError> {
        let events: Publisher<Event> = node.publisher(topics::EVENTS)?;
        let (begin, mut line) = (Instant::now(), Instant::now());
        while !is_over() && !self.threads.iter().any(Thread::is_finished) {
            thread::sleep(POLL_PERIOD);
            for event in said.try_iter() {
                events.send(&event)?;
            }
            if line.elapsed() >= STATUS {
                line = Instant::now();
                tracing::info!("{}", self.status(shared));
            }
            if begin.elapsed() >= SILENCE && self.is_silent() {
                shared.warn_once(
                    "no program on this host publishes what is sent; start `rt_bridge run --cell cell.toml --arm sim` (for a robot `rt_bridge run --cell cell.toml --arm fci://HOST`) in the same TWINALIGN_DOMAIN",
                );
            }
        }
        Ok(())
    }

    /// Whether something is to be sent and no program here publishes any of it; what the link itself says does not count.
    fn is_silent(&self) -> bool {
        let mut silent = self.sent.iter().filter(|count| lock(count).topic != topics::EVENTS.name).peekable();
        silent.peek().is_some() && silent.all(|count| lock(count).messages == 0)
    }

    /// One line about the last ten seconds.
    fn status(&self, shared: &Shared) -> String {
        let mut parts = Vec::new();
        for count in &self.sent {
            let Sent { topic, messages, dropped, .. } = &*lock(count);
            let dropped = if *dropped > 0 { format!(", {dropped} dropped") } else { String::new() };
            if *messages > 0 {
                parts.push(format!("sent {topic} {messages}{dropped}"));
            }
        }
        for count in &self.taken {
            let mut count = lock(count);
            let age = count.recent.percentiles().map_or_else(String::new, |age| format!(", age {}", in_words(&age)));
            count.recent.clear();
            let Taken { topic, messages, lost, .. } = &count.taken;
            let lost = if *lost > 0 { format!(", {lost} lost") } else { String::new() };
            if *messages > 0 {
                parts.push(format!("taken {topic} {messages}{lost}{age}"));
            }
        }
        parts.extend(lock(&shared.hosts).clock().map(|clock| clock.in_words()));
        if parts.is_empty() { "nothing crosses yet".into() } else { parts.join("; ") }
    }

    /// Waits for the threads and returns the first error of one.
    fn end(&mut self) -> Result<(), LinkError> {
        let mut first = Ok(());
        for thread in self.threads.drain(..) {
            let name = thread.thread().name().unwrap_or("without a name").to_owned();
            let ended = thread.join().unwrap_or_else(|_| Err(LinkError::Thread(format!("`{name}` crashed"))));
            first = first.and(ended);
        }
        first
    }
}

fn report(begin: Instant, sent: &[SentCount], taken: &[TakenCount], hosts: Option<&hosts::Hosts>) -> Report {
    let taken = taken.iter().map(|count| {
        let Arrivals { taken, ages, .. } = &*lock(count);
        Taken { age_us: ages.percentiles(), ..taken.clone() }
    });
    Report {
        seconds: begin.elapsed().as_secs_f64(),
        sent: sent.iter().map(|count| lock(count).clone()).collect(),
        taken: taken.collect(),
        clock: hosts.and_then(hosts::Hosts::clock),
        outages: hosts.map_or(0, |hosts| hosts.outages),
        longest_outage: hosts.map_or(0.0, |hosts| hosts.longest_ns as f64 * 1e-9),
    }
}
