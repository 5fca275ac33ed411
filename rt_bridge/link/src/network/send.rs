//! One thread for each topic that is sent: out of shared memory, onto the network.

use super::session::{messages, missing};
use super::shared::{SentCount, Shared, lock, network};
use crate::LinkError;
use crate::crossing::Kind;
use crate::envelope::Envelope;
use crate::history::{Due, History, MOST_BYTES, MOST_MESSAGES};
use shared_mem::recording::{Encoded, append_picture, picture_schema, schema_checksum};
use shared_mem::time::now_ns;
use shared_mem::topics::{self, ImageTopic, Topic};
use shared_mem::transport::{Node, Subscriber, Wake};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Longest sleep between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Messages that are sent again at a stretch, before new ones are taken out of shared memory.
const STRETCH: usize = 64;
/// Nothing was asked for.
const NOTHING: u64 = u64::MAX;

/// Puts messages of one topic onto the network.
struct Line {
    publisher: Publisher<'static>,
    id: u64,
    schema: u32,
}

impl Line {
    fn open(shared: &Shared, topic: &str, schema: &str, priority: Priority) -> Result<Self, LinkError> {
        let publisher = shared
            .session
            .declare_publisher(messages(topic))
            .congestion_control(CongestionControl::Block)
            .priority(priority)
            .express(true)
            .wait()
            .map_err(network)?;
        Ok(Self { publisher, id: shared.id, schema: schema_checksum(schema) })
    }

    fn put(&self, due: Due<ZBytes>) -> Result<usize, LinkError> {
        let Due { number, oldest, taken_ns, message } = due;
        let envelope = Envelope { session: self.id, number, oldest, taken_ns, schema: self.schema };
        let length = message.len();
        self.publisher.put(message).attachment(envelope.to_bytes()).wait().map_err(network)?;
        Ok(length)
    }
}

/// What rings when a topic has something: the bridge rings for command and state together.
fn bell(topic: &'static str) -> &'static str {
    if topic == topics::ARM_COMMAND.name { topics::ARM_STATE.name } else { topic }
}

fn open<M: Encoded>(topic: Topic<M>) -> Result<(Node, Subscriber<M>, Wake), LinkError> {
    let node = Node::open("rt_bridge_link")?;
    let source = node.subscriber(topic)?;
    let wake = node.wake_on(bell(topic.name))?;
    Ok((node, source, wake))
}

/// Sends a topic's messages until the end.
pub(super) fn send<M: Encoded>(
    shared: &Shared,
    topic: Topic<M>,
    kind: Kind,
    count: &SentCount,
) -> Result<(), LinkError> {
    if kind == Kind::Command { send_newest(shared, topic, count) } else { send_all(shared, topic, count) }
}

/// Sends every message, and again what the other host missed.
fn send_all<M: Encoded>(shared: &Shared, topic: Topic<M>, count: &SentCount) -> Result<(), LinkError> {
    let (_node, source, wake) = open(topic)?;
    let line = Line::open(shared, topic.name, M::schema(), Priority::InteractiveHigh)?;
    let asked = Arc::new(AtomicU64::new(NOTHING));
    let _asking = listen(&shared.session, topic.name, Arc::clone(&asked))?;
    let mut history = History::new(MOST_MESSAGES, MOST_BYTES);
    let (mut newest, mut is_behind) = (0, false);
    while !shared.is_over() {
        if !is_behind {
            wake.wait(POLL_PERIOD)?;
        }
        while let Some(message) = source.receive()? {
            let taken_ns = now_ns();
            let mut bytes = Vec::with_capacity(1024);
            message.append_to(&mut bytes);
            lock(count).messages += 1;
            history.push(taken_ns, bytes.len(), ZBytes::from(bytes));
        }
        match asked.swap(NOTHING, Ordering::Relaxed) {
            NOTHING => {}
            from => history.again_from(from),
        }
        is_behind = true;
        for _ in 0..STRETCH {
            let Some(due) = history.due() else {
                is_behind = false;
                break;
            };
            let is_again = due.number < newest;
            newest = newest.max(due.number + 1);
            let bytes = line.put(due)? as u64;
            let mut count = lock(count);
            count.bytes += bytes;
            count.repeated += u64::from(is_again);
        }
    }
    Ok(())
}

/// The questions for what is missing: the lowest number since the last look.
fn listen(session: &Session, topic: &str, asked: Arc<AtomicU64>) -> Result<zenoh::pubsub::Subscriber<()>, LinkError> {
    let hear = move |sample: Sample| {
        if let Ok(number) = <[u8; 8]>::try_from(sample.payload().to_bytes().as_ref()) {
            asked.fetch_min(u64::from_le_bytes(number), Ordering::Relaxed);
        }
    };
    session.declare_subscriber(missing(topic)).callback(hear).wait().map_err(network)
}

/// Sends the newest message and nothing again: an old command is none.
fn send_newest<M: Encoded>(shared: &Shared, topic: Topic<M>, count: &SentCount) -> Result<(), LinkError> {
    let (_node, source, wake) = open(topic)?;
    let line = Line::open(shared, topic.name, M::schema(), Priority::InteractiveHigh)?;
    let mut number = 0;
    while !shared.is_over() {
        wake.wait(POLL_PERIOD)?;
        let mut newest = None;
        while let Some(message) = source.receive()? {
            let mut count = lock(count);
            count.messages += 1;
            count.dropped += u64::from(newest.is_some());
            newest = Some(message);
        }
        let Some(message) = newest else { continue };
        let mut bytes = Vec::new();
        message.append_to(&mut bytes);
        let due = Due { number, oldest: number, taken_ns: now_ns(), message: ZBytes::from(bytes) };
        lock(count).bytes += line.put(due)? as u64;
        number += 1;
    }
    Ok(())
}

/// Sends a topic's pictures until the end. A line that is busy makes the thread wait; what comes meanwhile is dropped, the
/// oldest first.
pub(super) fn send_pictures(shared: &Shared, topic: ImageTopic, count: &SentCount) -> Result<(), LinkError> {
    let node = Node::open("rt_bridge_link")?;
    let source = node.image_subscriber(topic)?;
    let wake = node.wake_on(topic.name)?;
    let line = Line::open(shared, topic.name, picture_schema(), Priority::DataLow)?;
    let (mut number, mut last) = (0, None);
    while !shared.is_over() {
        wake.wait(POLL_PERIOD)?;
        let mut newest = None;
        while let Some(picture) = source.receive()? {
            newest = Some(picture);
            lock(count).messages += 1;
        }
        let Some(picture) = newest else { continue };
        let header = picture.header();
        // Those that the camera numbered in between were overwritten here or in shared memory.
        let left_out = last.map_or(0, |last: u64| header.sequence.saturating_sub(last + 1));
        last = Some(header.sequence);
        let taken_ns = now_ns();
        let mut bytes = Vec::with_capacity(picture.bytes().len() + 256);
        append_picture(header, picture.bytes(), &mut bytes);
        drop(picture);
        lock(count).dropped += left_out;
        let due = Due { number, oldest: number, taken_ns, message: ZBytes::from(bytes) };
        lock(count).bytes += line.put(due)? as u64;
        number += 1;
    }
    Ok(())
}
