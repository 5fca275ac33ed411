//! Sending messages of fixed size, and waking those who wait for them.

use super::{Node, Service, TransportError, open_error, owner_of, service_name};
use crate::topics::{Limits, Topic};
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::port::{notifier::Notifier, publisher::Publisher as Port};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::event::PortFactory as EventFactory;
use std::fmt::Debug;

/// Sends messages of one topic.
#[derive(Debug)]
pub struct Publisher<Payload: Debug + ZeroCopySend + 'static> {
    topic: &'static str,
    port: Port<Service, Payload, ()>,
    bell: Notifier<Service>,
}

impl Node {
    /// Opens the sending side of a topic.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another process already sends on it, other variants when shared memory fails.
    pub fn publisher<Payload: Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic<Payload>,
    ) -> Result<Publisher<Payload>, TransportError> {
        let limits = topic.limits;
        let port = self
            .service(topic)?
            .publisher_builder()
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|e| publisher_error(topic.name, limits, &format!("{e:?}")))?;
        Ok(Publisher { topic: topic.name, port, bell: self.bell(topic.name)? })
    }

    /// The service behind a topic; both sides open it with the same limits.
    pub(super) fn service<Payload: Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic<Payload>,
    ) -> Result<iceoryx2::service::port_factory::publish_subscribe::PortFactory<Service, Payload, ()>, TransportError>
    {
        let Limits { buffer, history, borrowed, subscribers, publishers } = topic.limits;
        self.inner
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<Payload>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(buffer)
            .history_size(history)
            .subscriber_max_borrowed_samples(borrowed)
            .max_subscribers(subscribers)
            .max_publishers(publishers)
            .max_nodes(32)
            .open_or_create()
            .map_err(|e| open_error(topic.name, &format!("{e:?}")))
    }

    /// The event service that rings when something was sent.
    pub(super) fn bell_service(&self, topic: &'static str) -> Result<EventFactory<Service>, TransportError> {
        self.inner
            .service_builder(&service_name(topic)?)
            .event()
            .max_listeners(16)
            .max_notifiers(16)
            .max_nodes(32)
            .event_id_max_value(4)
            .open_or_create()
            .map_err(|e| open_error(topic, &format!("{e:?}")))
    }

    pub(super) fn bell(&self, topic: &'static str) -> Result<Notifier<Service>, TransportError> {
        self.bell_service(topic)?.notifier_builder().create().map_err(|e| open_error(topic, &format!("{e:?}")))
    }
}

pub(super) fn publisher_error(topic: &'static str, limits: Limits, what: &str) -> TransportError {
    if what.contains("ExceedsMaxSupported") {
        TransportError::Full { topic, limit: limits.publishers, side: "publisher(s)", owner: owner_of(topic) }
    } else {
        open_error(topic, what)
    }
}

impl<Payload: Debug + ZeroCopySend + Copy + 'static> Publisher<Payload> {
    /// Sends a message and wakes the readers that wait.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn send(&self, message: &Payload) -> Result<(), TransportError> {
        self.send_quietly(message)?;
        self.wake()
    }

    /// Sends a message without waking anybody: for topics whose readers look by themselves.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn send_quietly(&self, message: &Payload) -> Result<(), TransportError> {
        let failed = |what: String| TransportError::Port { topic: self.topic, what };
        let sample = self.port.loan_uninit().map_err(|e| failed(format!("{e:?}")))?;
        sample.write_payload(*message).send().map_err(|e| failed(format!("{e:?}")))?;
        Ok(())
    }

    /// Lets readers that joined since the last message in: they get the topic's history. Called a few times a second by senders that may be silent for long.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn greet_new_readers(&self) -> Result<(), TransportError> {
        self.port.update_connections().map_err(|e| TransportError::Port { topic: self.topic, what: format!("{e:?}") })
    }

    fn wake(&self) -> Result<(), TransportError> {
        ring(&self.bell, self.topic)
    }
}

/// Rings a bell. A listener that died a moment ago is no failure of ours.
pub(super) fn ring(bell: &Notifier<Service>, topic: &'static str) -> Result<(), TransportError> {
    match bell.notify() {
        Ok(_) => Ok(()),
        Err(e) => {
            let what = format!("{e:?}");
            if what.contains("Listener") || what.contains("Disconnected") || what.contains("Full") {
                return Ok(());
            }
            Err(TransportError::Port { topic, what })
        }
    }
}
