//! Why shared memory cannot be used, and how iceoryx2's errors become reasons that a person can act upon.

use super::DOMAIN_VARIABLE;
use super::place::PlaceError;
use super::room::NoRoom;
use crate::topics::Limits;
use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::service::builder::event::{EventOpenError, EventOpenOrCreateError};
use iceoryx2::service::builder::publish_subscribe::{PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError};
use std::fmt::Debug;

/// Processes that may have one topic open at once.
pub(super) const MOST_NODES: usize = 32;
/// Senders that may wake the readers of one topic, and readers that may sleep on it.
pub(super) const MOST_EVENT_PORTS: usize = 16;

/// Shared memory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// The node could not be set up.
    #[error("cannot use shared memory: {what}; run `rt_bridge doctor` to see what is in the way")]
    Node {
        /// iceoryx2's reason.
        what: String,
    },
    /// The place on disk is not this user's alone.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// There is no room for what would be opened.
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
    /// All places of one side of a topic are taken.
    #[error(
        "topic {topic} already has its {limit} {side}: another {owner} is running; stop it, or set {DOMAIN_VARIABLE} to another number to run a second cell"
    )]
    Full {
        /// The topic.
        topic: &'static str,
        /// How many there may be.
        limit: usize,
        /// What there are so many of: `"publisher(s)"`, `"subscriber(s)"` and so on.
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

impl TransportError {
    pub(super) fn node(reason: impl Debug) -> Self {
        Self::Node { what: in_words(&reason) }
    }

    pub(super) fn port(topic: &'static str, reason: impl Debug) -> Self {
        Self::Port { topic, what: in_words(&reason) }
    }

    pub(super) fn open(topic: &'static str, reason: impl Debug) -> Self {
        Self::Open { topic, what: in_words(&reason) }
    }

    fn incompatible(topic: &'static str, reason: impl Debug) -> Self {
        Self::Incompatible { topic, what: in_words(&reason) }
    }

    fn full(topic: &'static str, limit: usize, side: &'static str) -> Self {
        Self::Full { topic, limit, side, owner: owner_of(topic) }
    }
}

pub(super) fn service_error(topic: &'static str, error: PublishSubscribeOpenOrCreateError) -> TransportError {
    use PublishSubscribeOpenError as Open;
    let PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(reason) = error else {
        return TransportError::open(topic, error);
    };
    match reason {
        Open::IncompatibleTypes
        | Open::IncompatibleMessagingPattern
        | Open::IncompatibleAttributes
        | Open::IncompatibleOverflowBehavior
        | Open::DoesNotSupportRequestedMinBufferSize
        | Open::DoesNotSupportRequestedMinHistorySize
        | Open::DoesNotSupportRequestedMinSubscriberBorrowedSamples
        | Open::DoesNotSupportRequestedAmountOfPublishers
        | Open::DoesNotSupportRequestedAmountOfSubscribers
        | Open::DoesNotSupportRequestedAmountOfNodes
        | Open::VersionMismatch => TransportError::incompatible(topic, reason),
        Open::ExceedsMaxNumberOfNodes => TransportError::full(topic, MOST_NODES, "processes"),
        _ => TransportError::open(topic, reason),
    }
}

pub(super) fn event_error(topic: &'static str, error: EventOpenOrCreateError) -> TransportError {
    use EventOpenError as Open;
    let EventOpenOrCreateError::EventOpenError(reason) = error else {
        return TransportError::open(topic, error);
    };
    match reason {
        Open::IncompatibleMessagingPattern
        | Open::IncompatibleAttributes
        | Open::IncompatibleDeadline
        | Open::IncompatibleNotifierCreatedEvent
        | Open::IncompatibleNotifierDroppedEvent
        | Open::IncompatibleNotifierDeadEvent
        | Open::DoesNotSupportRequestedAmountOfNotifiers
        | Open::DoesNotSupportRequestedAmountOfListeners
        | Open::DoesNotSupportRequestedMaxEventId
        | Open::DoesNotSupportRequestedAmountOfNodes
        | Open::VersionMismatch => TransportError::incompatible(topic, reason),
        Open::ExceedsMaxNumberOfNodes => TransportError::full(topic, MOST_NODES, "processes"),
        _ => TransportError::open(topic, reason),
    }
}

pub(super) fn publisher_error(topic: &'static str, limits: Limits, error: PublisherCreateError) -> TransportError {
    match error {
        PublisherCreateError::ExceedsMaxSupportedPublishers => {
            TransportError::full(topic, limits.publishers, "publisher(s)")
        }
        _ => TransportError::open(topic, error),
    }
}

pub(super) fn subscriber_error(topic: &'static str, limits: Limits, error: SubscriberCreateError) -> TransportError {
    match error {
        SubscriberCreateError::ExceedsMaxSupportedSubscribers => {
            TransportError::full(topic, limits.subscribers, "subscriber(s)")
        }
        SubscriberCreateError::BufferSizeExceedsMaxSupportedBufferSizeOfService => {
            TransportError::incompatible(topic, error)
        }
        _ => TransportError::open(topic, error),
    }
}

pub(super) fn notifier_error(topic: &'static str, error: NotifierCreateError) -> TransportError {
    match error {
        NotifierCreateError::ExceedsMaxSupportedNotifiers => TransportError::full(topic, MOST_EVENT_PORTS, "senders"),
        _ => TransportError::open(topic, error),
    }
}

pub(super) fn listener_error(topic: &'static str, error: ListenerCreateError) -> TransportError {
    match error {
        ListenerCreateError::ExceedsMaxSupportedListeners => {
            TransportError::full(topic, MOST_EVENT_PORTS, "sleeping readers")
        }
        _ => TransportError::open(topic, error),
    }
}

/// What a person can act upon, by words in the name of iceoryx2's reason.
fn in_words(reason: &dyn Debug) -> String {
    let name = format!("{reason:?}");
    let known = [
        ("HangsInCreation", "another process was ended while it opened it, or is still at it"),
        ("IsBeingCreatedByAnotherInstance", "another process is opening it at this moment"),
        ("IsMarkedForDestruction", "another process is closing it at this moment"),
        ("InsufficientPermissions", "it belongs to another user"),
        ("CorruptedState", "a process that was ended left it half done"),
        ("ServiceInCorruptedState", "a process that was ended left it half done"),
        ("InternalFailure", "the system refuses a file or a piece of memory"),
        ("OutOfMemory", "there is no memory left"),
        ("LoanError", "all places for messages are taken"),
        ("Incompatible", "its messages or its limits are others"),
        ("DoesNotSupport", "its limits are others"),
        ("VersionMismatch", "its files are of another version"),
        ("BufferSize", "its queues are shorter"),
        ("Interrupt", "a signal came in between"),
    ];
    known.iter().find(|(word, _)| name.contains(word)).map_or_else(|| words_of(&name), |(_, words)| (*words).to_owned())
}

/// The innermost name of a reason, `Opening(UnableToCreateSegment)`, as words: `unable to create segment`.
fn words_of(name: &str) -> String {
    let innermost = name.trim_end_matches(')').rsplit('(').next().unwrap_or(name);
    let mut words = String::new();
    for c in innermost.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

/// The program that usually sits on a side of a topic, for error messages.
fn owner_of(topic: &str) -> &'static str {
    match topic {
        "/twin/state" | "/twin/gap" | "/twin/objects" => "twin shadow",
        "/arm/motion" => "capture",
        "/arm/target" | "/gripper/target" => "sender of targets",
        _ => "rt_bridge",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::ARM_STATE;

    #[test]
    fn iceoryx2s_reasons_become_ours_by_their_variant() {
        use PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError as Opening;
        let limits = ARM_STATE.limits;
        let service = |reason| service_error("/arm/state", Opening(reason));
        let event = |reason| event_error("/arm/state", EventOpenOrCreateError::EventOpenError(reason));
        let buffer = SubscriberCreateError::BufferSizeExceedsMaxSupportedBufferSizeOfService;
        for incompatible in [
            service(PublishSubscribeOpenError::IncompatibleTypes),
            service(PublishSubscribeOpenError::DoesNotSupportRequestedAmountOfPublishers),
            event(EventOpenError::VersionMismatch),
            subscriber_error("/arm/state", limits, buffer),
        ] {
            assert!(matches!(incompatible, TransportError::Incompatible { .. }), "{incompatible}");
        }
        for full in [
            service(PublishSubscribeOpenError::ExceedsMaxNumberOfNodes),
            event(EventOpenError::ExceedsMaxNumberOfNodes),
            publisher_error("/arm/state", limits, PublisherCreateError::ExceedsMaxSupportedPublishers),
            subscriber_error("/arm/state", limits, SubscriberCreateError::ExceedsMaxSupportedSubscribers),
            notifier_error("/arm/state", NotifierCreateError::ExceedsMaxSupportedNotifiers),
            listener_error("/arm/state", ListenerCreateError::ExceedsMaxSupportedListeners),
        ] {
            assert!(matches!(full, TransportError::Full { .. }), "{full}");
        }
        for other in [
            service(PublishSubscribeOpenError::HangsInCreation),
            service_error("/arm/state", PublishSubscribeOpenOrCreateError::SystemInFlux),
            publisher_error("/arm/state", limits, PublisherCreateError::UnableToCreateDataSegment),
        ] {
            assert!(matches!(other, TransportError::Open { .. }), "{other}");
        }
    }
}
