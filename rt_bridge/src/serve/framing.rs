//! From a stream of TCP bytes to messages: half a message waits for its other half, several come out one by one, and a
//! length that no message has ends the conversation, because nothing after it can be parsed. Pure.

use franka::wire::HeaderLayout;

/// Longest message a client of either service sends, with room [bytes]: the longest request has 428.
const LONGEST: usize = 4096;

/// One message: its number, the client's counter and what follows the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) number: u32,
    pub(super) id: u32,
    pub(super) payload: Vec<u8>,
}

/// A header that announces a length no message has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a message of {0} bytes is none of this protocol")]
pub(super) struct InvalidLength(u32);

/// Bytes that have arrived and are not a whole message yet.
#[derive(Debug)]
pub(super) struct Inbox {
    layout: HeaderLayout,
    bytes: Vec<u8>,
}

impl Inbox {
    /// For messages of the arm (port 1337).
    pub(super) fn of_the_arm() -> Self {
        Self { layout: HeaderLayout::Robot, bytes: Vec::new() }
    }

    /// For messages of the hand (port 1338).
    pub(super) fn of_the_hand() -> Self {
        Self { layout: HeaderLayout::Gripper, bytes: Vec::new() }
    }

    /// Takes what has arrived.
    pub(super) fn put(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole message, if there is one.
    pub(super) fn next(&mut self) -> Result<Option<Message>, InvalidLength> {
        let Some((number, id, size)) = self.layout.decode_header(&self.bytes) else { return Ok(None) };
        let (header, length) = (self.layout.header_len(), size as usize);
        if !(header..=LONGEST).contains(&length) {
            return Err(InvalidLength(size));
        }
        if self.bytes.len() < length {
            return Ok(None);
        }
        let payload = self.bytes[header..length].to_vec();
        self.bytes.drain(..length);
        Ok(Some(Message { number, id, payload }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serve::wire;
    use proptest::prelude::*;

    /// All messages of a stream that arrives in pieces of these lengths.
    fn messages(stream: &[u8], pieces: &[usize]) -> Result<Vec<Message>, InvalidLength> {
        let (mut inbox, mut found, mut rest) = (Inbox::of_the_arm(), Vec::new(), stream);
        let mut lengths = pieces.iter().cycle();
        while !rest.is_empty() {
            let (piece, after) = rest.split_at(lengths.next().map_or(1, |n| *n).clamp(1, rest.len()));
            inbox.put(piece);
            while let Some(message) = inbox.next()? {
                found.push(message);
            }
            rest = after;
        }
        Ok(found)
    }

    proptest! {
        #[test]
        fn messages_come_out_whole_however_the_stream_is_cut(
            sent in proptest::collection::vec((any::<u32>(), any::<u32>(), proptest::collection::vec(any::<u8>(), 0..450)), 1..6),
            pieces in proptest::collection::vec(1_usize..700, 1..8),
        ) {
            let stream: Vec<u8> = sent.iter().flat_map(|(n, id, payload)| wire::reply(*n, *id, payload)).collect();
            let found = messages(&stream, &pieces).expect("well-formed messages");
            let expected: Vec<_> = sent.into_iter().map(|(number, id, payload)| Message { number, id, payload }).collect();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn garbage_is_refused_or_waited_on_but_never_panics(
            bytes in proptest::collection::vec(any::<u8>(), 0..2000),
            pieces in proptest::collection::vec(1_usize..64, 1..8),
        ) {
            if let Ok(found) = messages(&bytes, &pieces) {
                for message in found {
                    let _refused = wire::request(message.number, &message.payload);
                }
            }
        }

        #[test]
        fn every_request_number_reads_any_payload(number in 0_u32..13, payload in proptest::collection::vec(any::<u8>(), 0..430)) {
            let _refused = wire::request(number, &payload);
            let _none = wire::set_point(&payload);
        }

        #[test]
        fn a_datagram_is_a_set_point_by_its_length_alone(datagram in proptest::collection::vec(any::<u8>(), 360..380)) {
            prop_assert_eq!(wire::set_point(&datagram).is_some(), datagram.len() == 371);
        }
    }
}
