//! Sending messages of fixed size, and waking those who wait for them.

use super::error::{MOST_EVENT_PORTS, MOST_NODES, event_error, notifier_error, publisher_error, service_error};
use super::room::with_room;
use super::{Node, Service, TransportError, service_name};
use crate::msg::Message;
use crate::topics::{Limits, Topic};
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::port::{notifier::Notifier, publisher::Publisher as Port};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::event::PortFactory as EventFactory;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

/// Sends messages of one topic.
#[derive(Debug)]
pub struct Publisher<M: Message> {
    topic: &'static str,
    port: Port<Service, M::Wire, ()>,
    bell: Notifier<Service>,
}

impl Node {
    /// Opens the sending side of a topic.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another process already sends on it, [`TransportError::NoRoom`] when shared memory is
    /// full, other variants when it fails.
    pub fn publisher<M: Message>(&self, topic: Topic<M>) -> Result<Publisher<M>, TransportError> {
        let limits = topic.limits;
        with_room(|| {
            let port = self
                .service(topic)?
                .publisher_builder()
                .max_loaned_samples(1)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|e| publisher_error(topic.name, limits, e))?;
            Ok(Publisher { topic: topic.name, port, bell: self.bell(topic.name)? })
        })
    }

    /// The service behind a topic; both sides open it with the same limits.
    pub(super) fn service<M: Message>(
        &self,
        topic: Topic<M>,
    ) -> Result<PortFactory<Service, M::Wire, ()>, TransportError> {
        self.place.refuse_foreign_files()?;
        let Limits { buffer, history, borrowed, subscribers, publishers } = topic.limits;
        self.inner
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<M::Wire>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(buffer)
            .history_size(history)
            .subscriber_max_borrowed_samples(borrowed)
            .max_subscribers(subscribers)
            .max_publishers(publishers)
            .max_nodes(MOST_NODES)
            .open_or_create()
            .map_err(|e| service_error(topic.name, e))
    }

    /// The event service that rings when something was sent.
    pub(super) fn bell_service(&self, topic: &'static str) -> Result<EventFactory<Service>, TransportError> {
        self.inner
            .service_builder(&service_name(topic)?)
            .event()
            .max_listeners(MOST_EVENT_PORTS)
            .max_notifiers(MOST_EVENT_PORTS)
            .max_nodes(MOST_NODES)
            .event_id_max_value(4)
            .open_or_create()
            .map_err(|e| event_error(topic, e))
    }

    pub(super) fn bell(&self, topic: &'static str) -> Result<Notifier<Service>, TransportError> {
        self.bell_service(topic)?.notifier_builder().create().map_err(|e| notifier_error(topic, e))
    }
}

impl<M: Message> Publisher<M> {
    /// Sends a message and wakes the readers that wait.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn send(&self, message: &M) -> Result<(), TransportError> {
        self.send_quietly(message)?;
        ring(&self.bell, self.topic)
    }

    /// Sends a message without waking anybody: for topics whose readers look by themselves.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn send_quietly(&self, message: &M) -> Result<(), TransportError> {
        self.send_numbers(&message.to_wire())
    }

    /// Sends numbers as they are, which need be no message: to try what a receiver does with them. Wakes nobody.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn send_numbers(&self, numbers: &M::Wire) -> Result<(), TransportError> {
        let sample = self.port.loan_uninit().map_err(|e| TransportError::port(self.topic, e))?;
        sample.write_payload(*numbers).send().map_err(|e| TransportError::port(self.topic, e))?;
        Ok(())
    }

    /// Lets readers that joined since the last message in: they get the topic's history. Called a few times a second by senders that may be silent for long.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn greet_new_readers(&self) -> Result<(), TransportError> {
        self.port.update_connections().map_err(|e| TransportError::port(self.topic, e))
    }
}

/// Rings a bell. A listener that has died or is full is passed over by iceoryx2 itself.
pub(super) fn ring(bell: &Notifier<Service>, topic: &'static str) -> Result<(), TransportError> {
    bell.notify().map(|_| ()).map_err(|e| TransportError::port(topic, e))
}
