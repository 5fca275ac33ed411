//! Modbus RTU as far as a gripper needs it: reading and writing several 16-bit registers. Total over bytes, no I/O.
//!
//! A frame is `station, function, ..., crc low, crc high`; numbers inside are big-endian. Sources: Modbus Application
//! Protocol V1.1b3 (functions 3 and 16, exceptions), Modbus over Serial Line V1.02 (framing, CRC-16).

/// Function: read holding registers.
const READ: u8 = 0x03;
/// Function: write several registers.
const WRITE: u8 = 0x10;
/// Added to the function in a refusal.
const REFUSAL: u8 = 0x80;
/// Most registers that one request may carry.
pub const MAX_REGISTERS: usize = 123;

/// A question to a station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Registers from `address` on.
    Read {
        address: u16,
        /// How many, 1 to [`MAX_REGISTERS`].
        count: u16,
    },
    /// These values into the registers from `address` on.
    Write {
        address: u16,
        /// Their values, 1 to [`MAX_REGISTERS`] of them.
        values: Vec<u16>,
    },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// What the registers hold.
    Registers(Vec<u16>),
    /// They were written.
    Written,
    /// The station will not; its exception code.
    Refused(u8),
}

/// Bytes that are no answer to the question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidReply {
    /// The check sum does not fit: a bit was lost on the way.
    #[error("a check sum is wrong")]
    Crc,
    /// Another station speaks.
    #[error("station {0} answers for another")]
    Station(u8),
    /// An answer to another question.
    #[error("function {0} was not asked for")]
    Function(u8),
    /// An answer of another size, or about other registers.
    #[error("an answer has the wrong size")]
    Size,
}

/// CRC-16 of Modbus: polynomial 0x8005 reflected, start 0xFFFF.
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    })
}

/// Appends the check sum.
fn sealed(mut frame: Vec<u8>) -> Vec<u8> {
    frame.extend(crc(&frame).to_le_bytes());
    frame
}

impl Request {
    /// The request's bytes for a station.
    pub fn encode(&self, station: u8) -> Vec<u8> {
        match self {
            Self::Read { address, count } => {
                sealed([&[station, READ], &address.to_be_bytes()[..], &count.to_be_bytes()].concat())
            }
            Self::Write { address, values } => {
                let count = values.len().min(MAX_REGISTERS) as u16;
                let mut frame = [&[station, WRITE], &address.to_be_bytes()[..], &count.to_be_bytes()].concat();
                frame.push(2 * count as u8);
                frame.extend(values.iter().take(MAX_REGISTERS).flat_map(|value| value.to_be_bytes()));
                sealed(frame)
            }
        }
    }

    /// The answer that `bytes` begin with; `None` while more of it has to come.
    ///
    /// # Errors
    /// [`InvalidReply`] when no further bytes can make them an answer to this question.
    pub fn answer(&self, station: u8, bytes: &[u8]) -> Result<Option<Reply>, InvalidReply> {
        let &[from, function, ..] = bytes else { return Ok(None) };
        if from != station {
            return Err(InvalidReply::Station(from));
        }
        let asked = match self {
            Self::Read { .. } => READ,
            Self::Write { .. } => WRITE,
        };
        let length = match (function, self) {
            (f, _) if f == asked | REFUSAL => 5,
            (READ, Self::Read { count, .. }) => 5 + 2 * usize::from(*count),
            (WRITE, Self::Write { .. }) => 8,
            _ => return Err(InvalidReply::Function(function)),
        };
        let Some(frame) = bytes.get(..length) else { return Ok(None) };
        let (body, sum) = frame.split_at(length - 2);
        if crc(body).to_le_bytes() != sum {
            return Err(InvalidReply::Crc);
        }
        let says = &body[2..];
        match self {
            _ if function == asked | REFUSAL => Ok(Some(Reply::Refused(says[0]))),
            Self::Read { count, .. } if usize::from(says[0]) == 2 * usize::from(*count) => {
                let values = says[1..].chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]]));
                Ok(Some(Reply::Registers(values.collect())))
            }
            Self::Write { address, values } => {
                let count = values.len().min(MAX_REGISTERS) as u16;
                let fits = says == [address.to_be_bytes(), count.to_be_bytes()].concat();
                if fits { Ok(Some(Reply::Written)) } else { Err(InvalidReply::Size) }
            }
            Self::Read { .. } => Err(InvalidReply::Size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn frames_are_those_of_the_grippers_manual() {
        // Robotiq 2F-85 & 2F-140 Instruction Manual, Modbus RTU example: activation, its answer, and a status request.
        let activate = Request::Write { address: 0x03E8, values: vec![0x0100, 0, 0] };
        let bytes = [0x09, 0x10, 0x03, 0xE8, 0x00, 0x03, 0x06, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x72, 0xE1];
        assert_eq!(activate.encode(9), bytes);
        let answer = [0x09, 0x10, 0x03, 0xE8, 0x00, 0x03, 0x01, 0x30];
        assert_eq!(activate.answer(9, &answer), Ok(Some(Reply::Written)));
        let status = Request::Read { address: 0x07D0, count: 1 };
        assert_eq!(status.encode(9), [0x09, 0x03, 0x07, 0xD0, 0x00, 0x01, 0x85, 0xCF]);
        let answer = [0x09, 0x03, 0x02, 0x31, 0x00, 0x4C, 0x15];
        assert_eq!(status.answer(9, &answer), Ok(Some(Reply::Registers(vec![0x3100]))));
    }

    #[test]
    fn a_refusal_tells_its_code() {
        let frame = sealed(vec![9, 0x83, 2]);
        assert_eq!(Request::Read { address: 0, count: 4 }.answer(9, &frame), Ok(Some(Reply::Refused(2))));
    }

    fn request() -> impl Strategy<Value = Request> {
        prop_oneof![
            (any::<u16>(), 1..=MAX_REGISTERS as u16).prop_map(|(address, count)| Request::Read { address, count }),
            (any::<u16>(), proptest::collection::vec(any::<u16>(), 1..=MAX_REGISTERS))
                .prop_map(|(address, values)| Request::Write { address, values }),
        ]
    }

    /// What an obedient station of these registers answers.
    fn obey(request: &Request, station: u8, held: &[u16]) -> Vec<u8> {
        match request {
            Request::Read { count, .. } => {
                let values = held.iter().cycle().take(usize::from(*count)).flat_map(|value| value.to_be_bytes());
                sealed([vec![station, READ, 2 * *count as u8], values.collect()].concat())
            }
            Request::Write { .. } => sealed(request.encode(station)[..6].to_vec()),
        }
    }

    proptest! {
        #[test]
        fn an_answer_is_whole_exactly_at_its_last_byte(
            request in request(), station: u8, held in proptest::collection::vec(any::<u16>(), 1..9), more: [u8; 3],
        ) {
            let answer = obey(&request, station, &held);
            for cut in 0..answer.len() {
                prop_assert_eq!(request.answer(station, &answer[..cut]), Ok(None));
            }
            let whole = request.answer(station, &answer).expect("well-formed");
            prop_assert!(matches!(whole, Some(Reply::Registers(_) | Reply::Written)));
            prop_assert_eq!(request.answer(station, &[&answer[..], &more].concat()), Ok(whole));
        }

        #[test]
        fn no_damaged_bit_passes_for_an_answer(request in request(), station: u8, bit in 0_usize..4096) {
            let mut answer = obey(&request, station, &[7]);
            let bit = bit % (8 * answer.len());
            answer[bit / 8] ^= 1 << (bit % 8);
            let read = request.answer(station, &answer);
            // A damaged function number can look like the beginning of a shorter or longer frame, never like a good one.
            prop_assert!(!matches!(read, Ok(Some(_))), "{:?}", read);
        }

        #[test]
        fn any_bytes_are_an_answer_the_beginning_of_one_or_garbage(
            request in request(), station: u8, bytes in proptest::collection::vec(any::<u8>(), 0..300),
        ) {
            let _any = request.answer(station, &bytes);
        }
    }
}
