//! Shared memory between the processes of one machine: the only code that knows iceoryx2.
//!
//! A process opens one [`Node`] a thread and takes publishers and subscribers from it. Ports belong to the thread that
//! made them. Nothing here may be called from the control thread: a `send` maps memory when a reader has just joined.
//!
//! A process that dies without a word leaves its ports behind; they are cleared away whenever any process opens a node.

mod doctor;
mod image;
mod publish;
mod subscribe;

pub use doctor::{NodeReport, SharedMemoryReport, survey};
pub use image::{ImagePublisher, ImageSample, ImageSubscriber};
pub use publish::Publisher;
pub use subscribe::{Subscriber, Wake};

use iceoryx2::prelude::*;

/// The flavour of iceoryx2 in use: single-threaded ports, no locks.
type Service = ipc::Service;

/// Environment variable that separates cells on one machine: processes see each other when it agrees. Default `0`.
pub const DOMAIN_VARIABLE: &str = "TWINALIGN_DOMAIN";

/// Shared memory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// The node could not be set up.
    #[error("cannot use shared memory: {what}; run `rt_bridge doctor` to see what is in the way")]
    Node {
        /// iceoryx2's reason.
        what: String,
    },
    /// All places of one side of a topic are taken.
    #[error(
        "topic {topic} already has its {limit} {side}: another {owner} is running; stop it, or set {DOMAIN_VARIABLE} to another number to run a second cell"
    )]
    Full {
        /// The topic.
        topic: &'static str,
        /// How many there may be.
        limit: usize,
        /// `"publisher(s)"` or `"subscriber(s)"`.
        side: &'static str,
        /// Which program usually sits there.
        owner: &'static str,
    },
    /// The topic exists with other limits or another layout.
    #[error(
        "topic {topic} was opened by another version of twinalign ({what}); stop the old processes and start again"
    )]
    Incompatible {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        what: String,
    },
    /// The topic could not be opened for another reason.
    #[error("cannot open topic {topic}: {what}; run `rt_bridge doctor`")]
    Open {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        what: String,
    },
    /// A message could not be sent or received.
    #[error("topic {topic} failed: {what}; run `rt_bridge doctor`")]
    Port {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        what: String,
    },
}

/// A process' (or thread's) seat on shared memory.
#[derive(Debug)]
pub struct Node {
    inner: iceoryx2::node::Node<Service>,
}

impl Node {
    /// Takes a seat under `name`, in the domain of [`DOMAIN_VARIABLE`], and clears away what dead processes left.
    ///
    /// # Errors
    /// [`TransportError::Node`] when shared memory is not usable.
    pub fn open(name: &str) -> Result<Self, TransportError> {
        Self::open_in(&domain(), name)
    }

    /// The same in a domain given here: for tests and for programs that talk to several cells.
    ///
    /// # Errors
    /// [`TransportError::Node`] when shared memory is not usable or `domain` is no short name.
    pub fn open_in(domain: &str, name: &str) -> Result<Self, TransportError> {
        let failed = |what: String| TransportError::Node { what };
        set_log_level(LogLevel::Fatal); // every failure comes back as an error; iceoryx2's own log would say it twice
        let name = NodeName::new(name).map_err(|e| failed(format!("{e:?}")))?;
        let inner = NodeBuilder::new()
            .name(&name)
            .config(&configuration(domain)?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|e| failed(format!("{e:?}")))?;
        Ok(Self { inner })
    }

    /// Clears away what processes that died since left behind. Cheap; called about once a second by long-lived processes.
    pub fn clear_dead_nodes(&self) {
        self.inner.try_cleanup_dead_nodes();
    }
}

/// The domain this process belongs to.
fn domain() -> String {
    std::env::var(DOMAIN_VARIABLE).unwrap_or_else(|_| "0".into())
}

/// iceoryx2's settings with our prefix, so that neither other programs nor other domains meet us.
fn configuration(domain: &str) -> Result<Config, TransportError> {
    let bad = || TransportError::Node {
        what: format!(
            "the domain {domain:?} (set by {DOMAIN_VARIABLE}) is no name of 1 to 24 letters, digits and dashes"
        ),
    };
    let short_name = !domain.is_empty() && domain.len() <= 24;
    if !short_name || !domain.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-') {
        return Err(bad());
    }
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("twinalign_{domain}_").as_bytes()).map_err(|_| bad())?;
    Ok(config)
}

fn service_name(topic: &'static str) -> Result<ServiceName, TransportError> {
    topic.try_into().map_err(|e| TransportError::Open { topic, what: format!("{e:?}") })
}

/// Sorts iceoryx2's reasons for not opening a service into ours.
fn open_error(topic: &'static str, what: &str) -> TransportError {
    let other_layout = ["Incompatible", "DoesNotSupport", "VersionMismatch"];
    if other_layout.iter().any(|word| what.contains(word)) {
        TransportError::Incompatible { topic, what: what.to_owned() }
    } else {
        TransportError::Open { topic, what: what.to_owned() }
    }
}

/// The program that usually sits on a side of a topic, for error messages.
fn owner_of(topic: &str) -> &'static str {
    match topic {
        "/twin/state" | "/twin/gap" => "twin shadow",
        "/arm/motion" => "capture",
        _ => "rt_bridge",
    }
}
