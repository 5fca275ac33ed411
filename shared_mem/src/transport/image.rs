//! Pictures without a copy: the sender renders or unpacks straight into shared memory, readers look at it in place.

use super::error::{MOST_NODES, publisher_error, service_error, subscriber_error};
use super::ignored::Tally;
use super::publish::ring;
use super::room::with_room;
use super::{Node, Service, TransportError, service_name};
use crate::msg::image::{ImageHeader, ImageHeaderWire};
use crate::msg::{Message as _, Wrong};
use crate::topics::{ImageTopic, Limits};
use iceoryx2::port::{
    notifier::Notifier, publisher::Publisher as PublisherPort, subscriber::Subscriber as SubscriberPort,
};
use iceoryx2::prelude::*;
use iceoryx2::sample::Sample;
use std::rc::Rc;

type Factory = iceoryx2::service::port_factory::publish_subscribe::PortFactory<Service, [u8], ImageHeaderWire>;

/// Sends pictures of one topic.
#[derive(Debug)]
pub struct ImagePublisher {
    topic: &'static str,
    port: PublisherPort<Service, [u8], ImageHeaderWire>,
    bell: Notifier<Service>,
}

/// Receives pictures of one topic, oldest first. Those that fail their check are ignored and counted: see
/// [`Node::newly_ignored`].
#[derive(Debug)]
pub struct ImageSubscriber {
    topic: &'static str,
    port: SubscriberPort<Service, [u8], ImageHeaderWire>,
    /// How many pictures wait at most.
    buffer: usize,
    ignored: Rc<Tally>,
}

/// A picture in shared memory; its place is taken until this is dropped.
#[derive(Debug)]
pub struct ImageSample {
    header: ImageHeader,
    sample: Sample<Service, [u8], ImageHeaderWire>,
}

impl Node {
    /// Opens the sending side for pictures of at most `max_bytes`.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another process already sends, [`TransportError::NoRoom`] when shared memory is full,
    /// other variants when it fails.
    pub fn image_publisher(&self, topic: ImageTopic, max_bytes: usize) -> Result<ImagePublisher, TransportError> {
        with_room(|| {
            let port = self
                .image_service(topic)?
                .publisher_builder()
                .initial_max_slice_len(max_bytes)
                .allocation_strategy(AllocationStrategy::Static)
                .max_loaned_samples(1)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|e| publisher_error(topic.name, topic.limits, e))?;
            Ok(ImagePublisher { topic: topic.name, port, bell: self.bell(topic.name)? })
        })
    }

    /// Opens the receiving side. The sender need not exist yet.
    ///
    /// # Errors
    /// [`TransportError::Full`] when all places are taken, [`TransportError::NoRoom`] when shared memory is full, other
    /// variants when it fails.
    pub fn image_subscriber(&self, topic: ImageTopic) -> Result<ImageSubscriber, TransportError> {
        let port = with_room(|| {
            let service = self.image_service(topic)?;
            let builder = service.subscriber_builder().buffer_size(topic.limits.buffer);
            builder.create().map_err(|e| subscriber_error(topic.name, topic.limits, e))
        })?;
        let (buffer, ignored) = (topic.limits.buffer, self.tallies.open(topic.name));
        Ok(ImageSubscriber { topic: topic.name, port, buffer, ignored })
    }

    fn image_service(&self, topic: ImageTopic) -> Result<Factory, TransportError> {
        self.place.refuse_foreign_files()?;
        let Limits { buffer, history, borrowed, subscribers, publishers } = topic.limits;
        self.inner
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<[u8]>()
            .user_header::<ImageHeaderWire>()
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
}

impl ImagePublisher {
    /// Sends a picture of `bytes` bytes that `fill` writes in place, and wakes the readers. `fill` returns the header.
    ///
    /// # Errors
    /// [`TransportError::Port`] when the picture is larger than the topic allows or shared memory fails.
    pub fn send_with(&self, bytes: usize, fill: impl FnOnce(&mut [u8]) -> ImageHeader) -> Result<(), TransportError> {
        self.send_numbers_with(bytes, |pixels| fill(pixels).to_wire())
    }

    /// The same with a header that need be none: to try what a receiver does with it.
    ///
    /// # Errors
    /// [`TransportError::Port`] when the picture is larger than the topic allows or shared memory fails.
    pub fn send_numbers_with(
        &self,
        bytes: usize,
        fill: impl FnOnce(&mut [u8]) -> ImageHeaderWire,
    ) -> Result<(), TransportError> {
        let mut sample = self.port.loan_slice(bytes).map_err(|e| TransportError::port(self.topic, e))?;
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = header;
        sample.send().map_err(|e| TransportError::port(self.topic, e))?;
        ring(&self.bell, self.topic)
    }
}

impl ImageSubscriber {
    /// The oldest picture not yet received, if any.
    ///
    /// # Errors
    /// [`TransportError::Port`] when shared memory fails.
    pub fn receive(&self) -> Result<Option<ImageSample>, TransportError> {
        for _ in 0..self.buffer {
            let Some(sample) = self.port.receive().map_err(|e| TransportError::port(self.topic, e))? else { break };
            match header_of(&sample) {
                Ok(header) => return Ok(Some(ImageSample { header, sample })),
                Err(why) => self.ignored.add(why),
            }
        }
        Ok(None)
    }

    /// Pictures so far that failed their check.
    pub fn ignored(&self) -> u64 {
        self.ignored.count()
    }
}

/// A copy of the header, checked, and checked to fit the bytes beside it.
fn header_of(sample: &Sample<Service, [u8], ImageHeaderWire>) -> Result<ImageHeader, Wrong> {
    let numbers = *sample.user_header();
    let header = ImageHeader::from_wire(&numbers)?;
    header.check_size(sample.payload().len())?;
    Ok(header)
}

impl ImageSample {
    /// What the bytes mean.
    pub fn header(&self) -> &ImageHeader {
        &self.header
    }

    /// The bytes, row by row: height times stride of the header.
    pub fn bytes(&self) -> &[u8] {
        self.sample.payload()
    }
}
