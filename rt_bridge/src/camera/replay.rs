//! Pictures of a recording, at the pace of its arm.

use crate::replay::ReplayClock;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::recording::{ClipMessages, Payload, Picture};
use shared_mem::time::now_ns;
use shared_mem::topics::{self, ImageTopic};
use shared_mem::transport::{ImagePublisher, Node, Publisher, TransportError};
use std::sync::atomic::AtomicBool;

/// Shows all pictures of a clip once, each when its arm has come to that moment.
pub(super) fn show(
    node: &Node,
    messages: ClipMessages,
    clock: &ReplayClock,
    stop: &AtomicBool,
) -> Result<(), TransportError> {
    let info: Publisher<CameraInfo> = node.publisher(topics::CAMERA_INFO)?;
    let (mut color, mut depth) = (Screen::new(topics::CAMERA_COLOR), Screen::new(topics::CAMERA_DEPTH));
    for message in messages {
        let message = match message {
            Ok(message) => message,
            Err(e) => {
                tracing::warn!("no more pictures: {e}");
                return Ok(());
            }
        };
        match message.payload {
            Payload::CameraInfo(message) => {
                if !clock.wait_for(message.stamp_ns, stop) {
                    return Ok(());
                }
                info.send(&CameraInfo { stamp_ns: now_ns(), ..*message })?;
            }
            Payload::Picture(Picture::Pixels { header, pixels }) => {
                if !clock.wait_for(header.stamp_ns, stop) {
                    return Ok(());
                }
                let screen = if message.topic == topics::CAMERA_DEPTH.name { &mut depth } else { &mut color };
                screen.show(node, &header, &pixels)?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// One picture topic, opened at its first picture, whose size it keeps.
struct Screen {
    topic: ImageTopic,
    publisher: Option<ImagePublisher>,
}

impl Screen {
    fn new(topic: ImageTopic) -> Self {
        Self { topic, publisher: None }
    }

    fn show(&mut self, node: &Node, header: &ImageHeader, pixels: &[u8]) -> Result<(), TransportError> {
        if self.publisher.is_none() {
            self.publisher = Some(node.image_publisher(self.topic, pixels.len())?);
        }
        let Some(publisher) = &self.publisher else { return Ok(()) };
        publisher.send_with(pixels.len(), |bytes| {
            bytes.copy_from_slice(pixels);
            ImageHeader { stamp_ns: now_ns(), ..*header }
        })
    }
}
