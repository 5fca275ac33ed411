//! Receiving messages of fixed size: by looking, or by sleeping until something was sent.

use super::error::{listener_error, subscriber_error};
use super::ignored::Tally;
use super::room::with_room;
use super::{Node, Service, TransportError};
use crate::msg::Message;
use crate::topics::Topic;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber as Port;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Worst wake-up delay after a notification that iceoryx2 0.10 lost. A listener that empties its socket between the sender's
/// notification and the mark the sender makes of it waits on a mark that keeps all later ones from being sent; it reads the mark when
/// it waits anew.
const MAX_WAKE_DELAY: Duration = Duration::from_millis(5);
/// Shortest timeout of a socket: it counts in microseconds, and 0 of them means for ever.
const MIN_TIMEOUT: Duration = Duration::from_micros(100);

/// Receives messages of one topic, oldest first. Those that fail their check are ignored and counted: see
/// [`Node::newly_ignored`].
#[derive(Debug)]
pub struct Subscriber<M: Message> {
    topic: &'static str,
    port: Port<Service, M::Wire, ()>,
    /// How many messages wait at most.
    buffer: usize,
    ignored: Rc<Tally>,
}

/// Sleeps until something is sent on one topic.
///
/// ```
/// use shared_mem::msg::arm::ArmState;
/// use shared_mem::topics::ARM_STATE;
/// use shared_mem::transport::Node;
/// use std::time::Duration;
///
/// let node = Node::open_in(&format!("wake{}", std::process::id()), "example")?;
/// let (subscriber, wake) = (node.subscriber(ARM_STATE)?, node.wake_on(ARM_STATE.name)?);
/// assert!(!wake.wait(Duration::from_millis(1))?, "nothing was sent yet");
///
/// let publisher = node.publisher(ARM_STATE)?;
/// publisher.send(&ArmState { stamp_ns: 1, dof: 7, ..ArmState::default() })?;
/// assert!(wake.wait(Duration::from_secs(1))?);
/// assert!(subscriber.newest()?.is_some());
/// # Ok::<(), shared_mem::transport::TransportError>(())
/// ```
#[derive(Debug)]
pub struct Wake {
    topic: &'static str,
    listener: Listener<Service>,
}

impl Node {
    /// Opens the receiving side of a topic. The sender need not exist yet.
    ///
    /// # Errors
    /// [`TransportError::Full`] when all places are taken, [`TransportError::NoRoom`] when shared memory is full, other
    /// variants when it fails.
    pub fn subscriber<M: Message>(&self, topic: Topic<M>) -> Result<Subscriber<M>, TransportError> {
        let port = with_room(|| {
            let service = self.service(topic)?;
            let builder = service.subscriber_builder().buffer_size(topic.limits.buffer);
            builder.create().map_err(|e| subscriber_error(topic.name, topic.limits, e))
        })?;
        let (buffer, ignored) = (topic.limits.buffer, self.tallies.open(topic.name));
        Ok(Subscriber { topic: topic.name, port, buffer, ignored })
    }

    /// Opens something to sleep on until a topic's next message.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory fails.
    pub fn wake_on(&self, topic: &'static str) -> Result<Wake, TransportError> {
        let listener =
            with_room(|| self.bell_service(topic)?.listener_builder().create().map_err(|e| listener_error(topic, e)))?;
        Ok(Wake { topic, listener })
    }
}

impl<M: Message> Subscriber<M> {
    /// The oldest message not yet received, if any.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn receive(&self) -> Result<Option<M>, TransportError> {
        // A sender of nonsense may be as fast as this loop: who looks must come back nevertheless.
        for _ in 0..self.buffer {
            let Some(sample) = self.port.receive().map_err(|e| TransportError::port(self.topic, e))? else { break };
            // Copied before it is checked: its sender could still change it where it lies.
            let numbers = *sample.payload();
            match M::from_wire(&numbers) {
                Ok(message) => return Ok(Some(message)),
                Err(why) => self.ignored.add(why),
            }
        }
        Ok(None)
    }

    /// Messages so far that failed their check.
    pub fn ignored(&self) -> u64 {
        self.ignored.count()
    }

    /// The newest message, if any arrived; older ones are dropped.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn newest(&self) -> Result<Option<M>, TransportError> {
        let mut last = None;
        for _ in 0..self.buffer {
            let Some(message) = self.receive()? else { break };
            last = Some(message);
        }
        Ok(last)
    }
}

impl Wake {
    /// Sleeps until something was sent or `timeout` passed; `true` when something was sent. A signal, which is no failure, ends the sleep early.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn wait(&self, timeout: Duration) -> Result<bool, TransportError> {
        let end = Instant::now() + timeout;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let heard = if left < MIN_TIMEOUT {
                self.listener.try_wait(|_| ())
            } else {
                self.listener.timed_wait(|_| (), left.min(MAX_WAKE_DELAY))
            };
            match heard {
                // A ring that arrives just as the one before it is answered is answered with it, and wakes once more for nothing.
                Ok(0) if left >= MIN_TIMEOUT => {}
                Ok(count) => return Ok(count > 0),
                Err(ListenerWaitError::InterruptSignal) => return Ok(false),
                Err(e) => return Err(TransportError::port(self.topic, e)),
            }
        }
    }
}
