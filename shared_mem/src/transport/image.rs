//! Pictures without a copy: the sender renders or unpacks straight into shared memory, readers look at it in place.

use super::publish::{publisher_error, ring};
use super::subscribe::subscriber_error;
use super::{Node, Service, TransportError, open_error, service_name};
use crate::msg::image::ImageHeader;
use crate::topics::{ImageTopic, Limits};
use iceoryx2::port::{
    notifier::Notifier, publisher::Publisher as PublisherPort, subscriber::Subscriber as SubscriberPort,
};
use iceoryx2::prelude::*;
use iceoryx2::sample::Sample;

type Factory = iceoryx2::service::port_factory::publish_subscribe::PortFactory<Service, [u8], ImageHeader>;

/// Sends pictures of one topic.
#[derive(Debug)]
pub struct ImagePublisher {
    topic: &'static str,
    port: PublisherPort<Service, [u8], ImageHeader>,
    bell: Notifier<Service>,
}

/// Receives pictures of one topic, oldest first.
#[derive(Debug)]
pub struct ImageSubscriber {
    topic: &'static str,
    port: SubscriberPort<Service, [u8], ImageHeader>,
}

/// A picture in shared memory; its place is taken until this is dropped.
#[derive(Debug)]
pub struct ImageSample {
    sample: Sample<Service, [u8], ImageHeader>,
}

impl Node {
    /// Opens the sending side for pictures of at most `max_bytes`.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another process already sends, other variants when shared memory fails.
    pub fn image_publisher(&self, topic: ImageTopic, max_bytes: usize) -> Result<ImagePublisher, TransportError> {
        let port = self
            .image_service(topic)?
            .publisher_builder()
            .initial_max_slice_len(max_bytes)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|e| publisher_error(topic.name, topic.limits, &format!("{e:?}")))?;
        Ok(ImagePublisher { topic: topic.name, port, bell: self.bell(topic.name)? })
    }

    /// Opens the receiving side. The sender need not exist yet.
    ///
    /// # Errors
    /// [`TransportError::Full`] when all places are taken, other variants when shared memory fails.
    pub fn image_subscriber(&self, topic: ImageTopic) -> Result<ImageSubscriber, TransportError> {
        let port = self
            .image_service(topic)?
            .subscriber_builder()
            .buffer_size(topic.limits.buffer)
            .create()
            .map_err(|e| subscriber_error(topic.name, topic.limits, &format!("{e:?}")))?;
        Ok(ImageSubscriber { topic: topic.name, port })
    }

    fn image_service(&self, topic: ImageTopic) -> Result<Factory, TransportError> {
        let Limits { buffer, history, borrowed, subscribers, publishers } = topic.limits;
        self.inner
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<[u8]>()
            .user_header::<ImageHeader>()
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
}

impl ImagePublisher {
    /// Sends a picture of `bytes` bytes that `fill` writes in place, and wakes the readers. `fill` returns the header.
    ///
    /// # Errors
    /// [`TransportError::Port`] when the picture is larger than the topic allows or shared memory fails.
    pub fn send_with(&self, bytes: usize, fill: impl FnOnce(&mut [u8]) -> ImageHeader) -> Result<(), TransportError> {
        let failed = |what: String| TransportError::Port { topic: self.topic, what };
        let mut sample = self.port.loan_slice(bytes).map_err(|e| failed(format!("{e:?}")))?;
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = header;
        sample.send().map_err(|e| failed(format!("{e:?}")))?;
        ring(&self.bell, self.topic)
    }
}

impl ImageSubscriber {
    /// The oldest picture not yet received, if any.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn receive(&self) -> Result<Option<ImageSample>, TransportError> {
        match self.port.receive() {
            Ok(sample) => Ok(sample.map(|sample| ImageSample { sample })),
            Err(e) => Err(TransportError::Port { topic: self.topic, what: format!("{e:?}") }),
        }
    }
}

impl ImageSample {
    /// What the bytes mean.
    #[must_use]
    pub fn header(&self) -> &ImageHeader {
        self.sample.user_header()
    }

    /// The bytes, row by row.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.sample.payload()
    }
}
