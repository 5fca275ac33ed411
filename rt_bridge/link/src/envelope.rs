//! What stands beside a message's bytes on the way.

/// Version of the messages between two hosts: of the envelope, the keys and the questions.
pub const VERSION: u8 = 1;
/// Bytes of an envelope: version, four numbers of 64 bits, one of 32.
const LENGTH: usize = 1 + 4 * 8 + 4;

/// Beside each message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Envelope {
    /// Drawn by the sender when it starts.
    pub session: u64,
    /// Number of the message on its topic, from 0 without gaps.
    pub number: u64,
    /// Lowest number that the sender still has and would send again.
    pub oldest: u64,
    /// When it was taken out of the sender's shared memory: monotonic clock of that host [ns].
    pub taken_ns: u64,
    /// Checksum of the definition of its schema.
    pub schema: u32,
}

/// Why bytes are no envelope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoEnvelope {
    /// Another version of the link wrote it.
    Version(u8),
    /// None of any version.
    Length(usize),
}

impl Envelope {
    /// As bytes, numbers in little endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(LENGTH);
        bytes.push(VERSION);
        for number in [self.session, self.number, self.oldest, self.taken_ns] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.schema.to_le_bytes());
        bytes
    }

    /// From bytes that anybody may have written.
    ///
    /// # Errors
    /// [`NoEnvelope`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NoEnvelope> {
        match bytes.first() {
            Some(version) if *version != VERSION => return Err(NoEnvelope::Version(*version)),
            Some(_) if bytes.len() == LENGTH => {}
            _ => return Err(NoEnvelope::Length(bytes.len())),
        }
        let number = |at: usize| {
            let mut eight = [0; 8];
            eight.copy_from_slice(&bytes[1 + 8 * at..9 + 8 * at]);
            u64::from_le_bytes(eight)
        };
        let mut four = [0; 4];
        four.copy_from_slice(&bytes[LENGTH - 4..]);
        Ok(Self {
            session: number(0),
            number: number(1),
            oldest: number(2),
            taken_ns: number(3),
            schema: u32::from_le_bytes(four),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_comes_out_as_it_went_in_and_another_version_is_named() {
        let envelope = Envelope { session: 1, number: u64::MAX, oldest: 3, taken_ns: 4, schema: 0xdead_beef };
        let mut bytes = envelope.to_bytes();
        assert_eq!(Envelope::from_bytes(&bytes), Ok(envelope));
        assert_eq!(Envelope::from_bytes(&bytes[..20]), Err(NoEnvelope::Length(20)));
        assert_eq!(Envelope::from_bytes(&[]), Err(NoEnvelope::Length(0)));
        bytes[0] = VERSION + 1;
        assert_eq!(Envelope::from_bytes(&bytes), Err(NoEnvelope::Version(VERSION + 1)));
    }
}
