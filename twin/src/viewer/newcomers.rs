//! Who has just come to a channel: what was sent there before, a viewer never sees.

use foxglove::websocket::{ChannelView, Client, ServerListener};
use std::sync::atomic::{AtomicBool, Ordering};

/// Notes new viewers of one topic.
pub(super) struct Newcomers {
    topic: &'static str,
    any: AtomicBool,
}

impl Newcomers {
    pub(super) fn to(topic: &'static str) -> Self {
        Self { topic, any: AtomicBool::new(false) }
    }

    /// Whether somebody has come since it was asked last.
    pub(super) fn any(&self) -> bool {
        self.any.swap(false, Ordering::Relaxed)
    }
}

impl ServerListener for Newcomers {
    fn on_subscribe(&self, _client: Client, channel: ChannelView<'_>) {
        if channel.topic() == self.topic {
            self.any.store(true, Ordering::Relaxed);
        }
    }
}
