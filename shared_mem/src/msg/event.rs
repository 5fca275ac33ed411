//! Things worth telling a person: faults, refusals, restarts. Rare, short, kept in every recording.

use super::check::{self, Wrong};
use super::wire::{codes, wire};
use iceoryx2::prelude::ZeroCopySend;

/// Longest text of an event [bytes of UTF-8].
pub const TEXT_LENGTH: usize = 232;

/// One remark. Topic `/events`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// When it happened: monotonic clock [ns].
    pub stamp_ns: u64,
    /// How serious it is.
    pub level: EventLevel,
    /// Who says it.
    pub source: EventSource,
    /// Bytes of `text` that count.
    pub length: u32,
    /// Keeps the layout free of gaps; always 0.
    pub reserved: u32,
    /// UTF-8, cut at a character border.
    pub text: [u8; TEXT_LENGTH],
}

impl Event {
    /// An event of now. Text beyond [`TEXT_LENGTH`] bytes is cut.
    pub fn new(level: EventLevel, source: EventSource, text: &str) -> Self {
        let mut end = text.len().min(TEXT_LENGTH);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut bytes = [0; TEXT_LENGTH];
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Self {
            stamp_ns: crate::time::now_ns(),
            level,
            source,
            length: u32::try_from(end).unwrap_or(0),
            reserved: 0,
            text: bytes,
        }
    }

    /// The text.
    pub fn text(&self) -> &str {
        let end = (self.length as usize).min(TEXT_LENGTH);
        std::str::from_utf8(&self.text[..end]).unwrap_or("")
    }
}

impl Event {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::count("length", self.length, 0, TEXT_LENGTH as u64)?;
        let text = self.text.get(..self.length as usize).unwrap_or(&[]);
        std::str::from_utf8(text).map(|_| ()).map_err(|_| Wrong::Text { field: "text" })
    }
}

wire!("twinalign/Event/2" EventWire: Event {
    stamp_ns: u64,
    level: EventLevel,
    source: EventSource,
    length: u32,
    reserved: u32,
    text: [u8; TEXT_LENGTH],
});

/// How serious an event is. Values are Foxglove's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventLevel {
    /// Worth knowing.
    Info = 2,
    /// Something was not as it should be; work goes on.
    Warning = 3,
    /// Something stopped.
    Error = 4,
}

codes!(EventLevel: Info, Warning, Error);

/// Which program speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventSource {
    /// `rt_bridge run`.
    Bridge = 0,
    /// The recorder.
    Recorder = 1,
    /// `twin shadow`.
    Twin = 2,
    /// `calibration capture`.
    Capture = 3,
}

codes!(EventSource: Bridge, Recorder, Twin, Capture);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_between_characters() {
        let event = Event::new(EventLevel::Info, EventSource::Bridge, &"ä".repeat(200));
        assert_eq!(event.text(), "ä".repeat(TEXT_LENGTH / 2));
    }
}
