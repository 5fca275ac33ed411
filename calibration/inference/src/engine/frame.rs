//! One message on a pipe: two little-endian u32 (bytes of text, count of numbers), the text (a JSON object), the numbers
//! (little-endian f64).

use serde::Serialize;
use std::io::{self, Read};

/// A text longer than this is no message of this protocol [bytes] (a choice).
const LONGEST_TEXT: u32 = 16 << 20;
/// More numbers than this are none (a choice): 1 GiB.
const MOST_NUMBERS: u32 = 1 << 27;

/// What came in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Frame {
    /// The JSON object.
    pub(super) text: Vec<u8>,
    /// The numbers behind it.
    pub(super) numbers: Vec<f64>,
}

/// Nothing that is a message came in.
#[derive(Debug)]
pub(super) enum FrameError {
    /// The pipe ended.
    Ended,
    /// It begins with these bytes, which are no lengths.
    NoMessage([u8; 8]),
    /// It has so many numbers, and no answer may have them; they are not read.
    TooMany(u32),
}

/// The bytes of a message.
pub(super) fn bytes(head: &impl Serialize, numbers: &[f64]) -> io::Result<Vec<u8>> {
    let text = serde_json::to_vec(head)?;
    let too_long = |_| io::Error::other("a message is longer than the protocol allows");
    let lengths = [u32::try_from(text.len()).map_err(too_long)?, u32::try_from(numbers.len()).map_err(too_long)?];
    let mut bytes = Vec::with_capacity(8 + text.len() + 8 * numbers.len());
    lengths.iter().for_each(|length| bytes.extend(length.to_le_bytes()));
    bytes.extend(text);
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    Ok(bytes)
}

/// The next message, of at most so many numbers.
pub(super) fn read(from: &mut impl Read, most: usize) -> Result<Frame, FrameError> {
    let mut lengths = [0; 8];
    from.read_exact(&mut lengths).map_err(|_| FrameError::Ended)?;
    let [text, numbers] = [0, 4].map(|at| u32::from_le_bytes(std::array::from_fn(|k| lengths[at + k])));
    // Letters of a program that prints to its output make lengths of this size; one that is only too long is a mistake in a message.
    if text > LONGEST_TEXT || numbers > MOST_NUMBERS {
        return Err(FrameError::NoMessage(lengths));
    }
    if numbers as usize > most {
        return Err(FrameError::TooMany(numbers));
    }
    // Grows with what arrives: a length alone takes no memory.
    let mut body = Vec::new();
    let length = u64::from(text) + 8 * u64::from(numbers);
    let arrived = from.take(length).read_to_end(&mut body).map_err(|_| FrameError::Ended)?;
    if (arrived as u64) < length {
        return Err(FrameError::Ended);
    }
    let behind = body.split_off(text as usize);
    let number = |bytes: &[u8]| f64::from_le_bytes(std::array::from_fn(|k| bytes[k]));
    Ok(Frame { text: body, numbers: behind.chunks_exact(8).map(number).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_comes_back_as_it_was_and_half_a_one_is_none() {
        let numbers = [1.5, -0.0, f64::NAN, f64::INFINITY];
        let sent = bytes(&serde_json::json!({"message": "hello"}), &numbers).expect("short enough");
        let frame = read(&mut &sent[..], numbers.len()).expect("a message");
        assert_eq!(frame.text, br#"{"message":"hello"}"#);
        let bits = |numbers: &[f64]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&frame.numbers), bits(&numbers));
        for cut in [0, 3, 8, sent.len() - 1] {
            assert!(matches!(read(&mut &sent[..cut], numbers.len()), Err(FrameError::Ended)), "{cut}");
        }
    }

    #[test]
    fn what_somebody_printed_is_no_message() {
        assert!(
            matches!(read(&mut &b"loading model ..."[..], 9), Err(FrameError::NoMessage(bytes)) if &bytes == b"loading ")
        );
    }
    #[test]
    fn more_numbers_than_an_answer_may_have_are_not_read() {
        let mut lengths: &[u8] = &[2, 0, 0, 0, 3, 0, 0, 0, b'{', b'}'];
        assert!(matches!(read(&mut lengths, 2), Err(FrameError::TooMany(3))));
        assert_eq!(lengths, b"{}", "nothing behind the lengths");
    }
}
