//! Shared memory between the processes of one machine: the only code that knows iceoryx2.
//!
//! A process opens one [`Node`] a thread and takes publishers and subscribers from it. Ports belong to the thread that
//! made them. Nothing here may be called from the control thread: a `send` maps memory when a reader has just joined.
//!
//! A full `/dev/shm` is an error of whoever opens something; who has opened it keeps the room. Where a reader joins and there
//! is no room for what it shares with a sender, the reader is refused, and the sender goes on.
//!
//! A process that dies without a word leaves its ports behind; they are cleared away whenever any process opens a node.
//!
//! What is received was written by whatever process opened the topic: it is checked before it is handed on. Processes of
//! other users are kept out; where they sit in the way, that is an error that names them.

mod doctor;
mod error;
mod ignored;
mod image;
mod place;
mod publish;
mod room;
mod service;
mod storage;
mod subscribe;

pub use doctor::{NodeReport, SharedMemoryReport, book_keeping, foreign_files, survey};
pub use error::TransportError;
pub use ignored::Ignored;
pub use image::{ImagePublisher, ImageSample, ImageSubscriber};
pub use place::{ForeignFile, PlaceError};
pub use publish::Publisher;
pub use room::NoRoom;
pub use subscribe::{Subscriber, Wake};

use iceoryx2::prelude::*;
use ignored::Tallies;
use place::Place;
use room::with_room;
use service::Service;

/// Environment variable that separates cells on one machine: processes see each other when it agrees. Default `0`.
pub const DOMAIN_VARIABLE: &str = "TWINALIGN_DOMAIN";

/// A process' (or thread's) seat on shared memory.
///
/// A publisher and a subscriber of one topic; both sides may be in one process, and no daemon is needed:
///
/// ```
/// use shared_mem::msg::arm::ArmState;
/// use shared_mem::topics::ARM_STATE;
/// use shared_mem::transport::Node;
///
/// let domain = format!("doc{}", std::process::id());
/// let node = Node::open_in(&domain, "example")?;
/// let subscriber = node.subscriber(ARM_STATE)?;
/// let publisher = node.publisher(ARM_STATE)?;
///
/// let mut state = ArmState { stamp_ns: 1_000_000, dof: 7, ..ArmState::default() };
/// state.q[3] = -1.5; // rad
/// publisher.send(&state)?;
///
/// let received = subscriber.receive()?.expect("what was sent");
/// assert_eq!(received.q[3], -1.5);
/// assert!(subscriber.receive()?.is_none(), "each message is received once");
/// # Ok::<(), shared_mem::transport::TransportError>(())
/// ```
#[derive(Debug)]
pub struct Node {
    inner: iceoryx2::node::Node<Service>,
    place: Place,
    tallies: Tallies,
}

impl Node {
    /// Takes a seat under `name`, in the domain of [`DOMAIN_VARIABLE`], and clears away what dead processes left.
    ///
    /// # Errors
    /// [`TransportError::Place`] when another user is in the way, [`TransportError::NoRoom`] when shared memory is full,
    /// [`TransportError::Node`] when it is not usable.
    pub fn open(name: &str) -> Result<Self, TransportError> {
        Self::open_in(&domain(), name)
    }

    /// The same in a domain given here: for tests and for programs that talk to several cells.
    ///
    /// # Errors
    /// [`TransportError::Place`] when another user is in the way, [`TransportError::NoRoom`] when shared memory is full,
    /// [`TransportError::Node`] when it is not usable or `domain` is no short name.
    pub fn open_in(domain: &str, name: &str) -> Result<Self, TransportError> {
        set_log_level(LogLevel::Fatal); // every failure comes back as an error; iceoryx2's own log would say it twice
        let place = Place::open(domain)?;
        let name = NodeName::new(name).map_err(TransportError::node)?;
        let config = place.configuration()?;
        let builder = NodeBuilder::new().name(&name).config(&config);
        let builder = builder.signal_handling_mode(SignalHandlingMode::Disabled);
        let inner = with_room(|| builder.create::<Service>().map_err(TransportError::node))?;
        Ok(Self { inner, place, tallies: Tallies::default() })
    }

    /// Clears away what processes that died since left behind. Cheap; called about once a second by long-lived processes.
    pub fn clear_dead_nodes(&self) {
        self.inner.try_cleanup_dead_nodes();
    }

    /// Messages that this node's subscribers received and did not hand on, because they failed their check: worth a remark
    /// at the first of a topic, and again whenever there are ten times as many. Empty in between.
    pub fn newly_ignored(&self) -> Vec<Ignored> {
        self.tallies.news()
    }
}

/// The domain this process belongs to.
fn domain() -> String {
    std::env::var(DOMAIN_VARIABLE).unwrap_or_else(|_| "0".into())
}

fn service_name(topic: &'static str) -> Result<ServiceName, TransportError> {
    topic.try_into().map_err(|e| TransportError::open(topic, e))
}
