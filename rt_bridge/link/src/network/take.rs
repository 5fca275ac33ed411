//! One thread for each topic that is taken: off the network, onto this host's shared memory.

use super::session::{messages, missing};
use super::shared::{Shared, TakenCount, lock, network};
use crate::LinkError;
use crate::crossing::Kind;
use crate::envelope::{Envelope, NoEnvelope, VERSION};
use crate::order::{Order, Verdict};
use crate::pace::Pace;
use crate::queue::Queue;
use shared_mem::recording::{Encoded, picture_from_bytes, picture_schema, schema_checksum};
use shared_mem::time::now_ns;
use shared_mem::topics::{ImageTopic, Topic};
use shared_mem::transport::{ImagePublisher, Node};
use std::sync::Arc;
use std::time::Duration;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;

/// Longest wait between two looks at the end, and at readers that have joined.
const POLL_PERIOD: Duration = Duration::from_millis(200);
/// Messages that wait for the thread.
const WAITING: usize = 16_384;
/// Pictures and commands that wait for the thread.
const WAITING_NEWEST: usize = 2;

/// A message as it came.
struct Arrived {
    envelope: Result<Envelope, NoEnvelope>,
    message: ZBytes,
    came_ns: u64,
}

/// Takes messages of one topic off the network.
struct Line {
    topic: &'static str,
    schema: u32,
    queue: Arc<Queue<Arrived>>,
    order: Order,
    asks: Publisher<'static>,
    pace: Pace,
    /// How often the other host had come back when this topic was last asked for.
    returns: u64,
    _subscriber: Subscriber<()>,
}

impl Line {
    fn open(shared: &Shared, topic: &'static str, schema: &str, kind: Kind) -> Result<Self, LinkError> {
        let waiting = if kind == Kind::State { WAITING } else { WAITING_NEWEST };
        let queue = Arc::new(Queue::new(waiting));
        let filling = Arc::clone(&queue);
        let hear = move |sample: Sample| {
            let envelope =
                sample.attachment().map_or(Err(NoEnvelope::Length(0)), |a| Envelope::from_bytes(&a.to_bytes()));
            filling.push(Arrived { envelope, message: sample.payload().clone(), came_ns: now_ns() });
        };
        let asks = shared.session.declare_publisher(missing(topic)).congestion_control(CongestionControl::Block);
        let asks = asks.priority(Priority::InteractiveHigh).express(true).wait().map_err(network)?;
        let subscriber = shared.session.declare_subscriber(messages(topic)).callback(hear).wait().map_err(network)?;
        Ok(Self {
            topic,
            schema: schema_checksum(schema),
            queue,
            order: Order::new(kind == Kind::State),
            asks,
            pace: Pace::new(now_ns()),
            returns: 0,
            _subscriber: subscriber,
        })
    }

    /// The next message that is to be published; `None` when there is none yet.
    fn next(&mut self, shared: &Shared, count: &TakenCount) -> Result<Option<(Envelope, ZBytes)>, LinkError> {
        self.ask_after_a_return(shared)?;
        let Some(arrived) = self.queue.pop(POLL_PERIOD) else { return Ok(None) };
        if let Some(sleep) = self.pace.take(now_ns()) {
            std::thread::sleep(sleep);
        }
        let envelope = match arrived.envelope {
            Ok(envelope) if envelope.schema == self.schema => envelope,
            wrong => {
                lock(count).taken.refused += 1;
                self.refuse(shared, wrong.err());
                return Ok(None);
            }
        };
        match self.order.judge(&envelope, arrived.came_ns) {
            Verdict::Deliver { lost } => {
                lock(count).taken.lost += lost;
                return Ok(Some((envelope, arrived.message)));
            }
            Verdict::Ask { from } => self.ask(from)?,
            Verdict::Stranger => {
                lock(count).taken.refused += 1;
                shared.warn_once(&format!("two hosts send {}; the first counts: stop one of them", self.topic));
            }
            Verdict::Wait | Verdict::Repeated => {}
        }
        Ok(None)
    }

    fn ask(&self, from: u64) -> Result<(), LinkError> {
        self.asks.put(from.to_le_bytes().to_vec()).wait().map_err(network)
    }

    /// A topic that seldom says anything would not show what a cut cable swallowed until it speaks again.
    fn ask_after_a_return(&mut self, shared: &Shared) -> Result<(), LinkError> {
        let returns = lock(&shared.hosts).returns;
        if std::mem::replace(&mut self.returns, returns) == returns {
            return Ok(());
        }
        self.order.next().map_or(Ok(()), |from| self.ask(from))
    }

    fn refuse(&self, shared: &Shared, why: Option<NoEnvelope>) {
        let what = match why {
            None => "has another definition of its messages there than here".to_owned(),
            Some(NoEnvelope::Version(version)) => format!("comes by version {version} of the link, not {VERSION}"),
            Some(NoEnvelope::Length(_)) => "comes from a program that is no link".to_owned(),
        };
        shared.warn_once(&format!(
            "{} {what}: nothing of it is published; install the same twinalign on both",
            self.topic
        ));
    }

    fn refuse_message(&self, shared: &Shared, count: &TakenCount, what: &str) {
        lock(count).taken.refused += 1;
        shared.warn_once(&format!(
            "a message on {} was not published: {what}; stop the program that sends it",
            self.topic
        ));
    }

    fn published(shared: &Shared, count: &TakenCount, envelope: &Envelope, bytes: usize) {
        let now_ns = now_ns();
        let offset = lock(&shared.hosts).offset(envelope.session, now_ns);
        let mut count = lock(count);
        count.taken.messages += 1;
        count.taken.bytes += bytes as u64;
        if let Some(offset) = offset {
            let age_ns = now_ns.saturating_sub(offset.here(envelope.taken_ns));
            count.ages.record(age_ns);
            count.recent.record(age_ns);
        }
    }
}

/// Publishes a topic's messages here until the end.
pub(super) fn take<M: Encoded>(
    shared: &Shared,
    topic: Topic<M>,
    kind: Kind,
    count: &TakenCount,
) -> Result<(), LinkError> {
    let node = Node::open("rt_bridge_link")?;
    let publisher = node.publisher(topic)?;
    let mut line = Line::open(shared, topic.name, M::schema(), kind)?;
    while !shared.is_over() {
        let Some((envelope, bytes)) = line.next(shared, count)? else {
            publisher.greet_new_readers()?;
            continue;
        };
        let message = match M::from_bytes(&bytes.to_bytes()) {
            Ok(message) if kind == Kind::Command => {
                // The robot's host judges how old a command is, by its own clock.
                let Some(offset) = lock(&shared.hosts).offset(envelope.session, now_ns()) else {
                    line.refuse_message(shared, count, "the clock of its host is not known yet");
                    continue;
                };
                message.with_stamp_ns(offset.here(message.stamp_ns()))
            }
            Ok(message) => message,
            Err(what) => {
                line.refuse_message(shared, count, &what);
                continue;
            }
        };
        publisher.send(&message)?;
        Line::published(shared, count, &envelope, bytes.len());
    }
    Ok(())
}

/// Publishes a topic's pictures here until the end.
pub(super) fn take_pictures(shared: &Shared, topic: ImageTopic, count: &TakenCount) -> Result<(), LinkError> {
    let node = Node::open("rt_bridge_link")?;
    let mut line = Line::open(shared, topic.name, picture_schema(), Kind::Picture)?;
    let mut publisher: Option<(ImagePublisher, usize)> = None;
    while !shared.is_over() {
        let Some((envelope, bytes)) = line.next(shared, count)? else { continue };
        let (header, pixels) = match picture_from_bytes(&bytes.to_bytes()) {
            Ok(picture) => picture,
            Err(what) => {
                line.refuse_message(shared, count, &what);
                continue;
            }
        };
        // A publisher has one size for good, and the one place of a smaller one is free when it is dropped.
        publisher = publisher.filter(|(_, most)| *most >= pixels.len());
        let (sender, _) = match &publisher {
            Some(open) => open,
            None => publisher.insert((node.image_publisher(topic, pixels.len())?, pixels.len())),
        };
        sender.send_with(pixels.len(), |place| {
            place.copy_from_slice(&pixels);
            header
        })?;
        Line::published(shared, count, &envelope, bytes.len());
    }
    Ok(())
}
