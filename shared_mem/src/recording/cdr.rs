//! Common Data Representation, the encoding of ROS 2 messages: bytes to numbers and text and back, no I/O.
//!
//! A message starts with four bytes that name the byte order; every primitive is aligned to its own size counted from
//! behind these four bytes (OMG DDS-RTPS 10.5; CDR 9.3). Lengths are compared with the bytes that are left before
//! anything is set aside, so no input makes this code panic or allocate more than the input's own size.

/// A message cannot be decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum CdrError {
    /// The bytes end inside a field.
    #[error("the message ends inside a field (byte {0})")]
    Short(usize),
    /// The first bytes name no plain CDR encoding.
    #[error("the encoding {0:#06x} is not plain CDR")]
    Encoding(u16),
    /// A text is not UTF-8.
    #[error("a text is not UTF-8 (byte {0})")]
    Text(usize),
}

/// Reads one message from front to back.
#[derive(Debug, Clone)]
pub(super) struct CdrReader<'a> {
    payload: &'a [u8],
    at: usize,
    big_endian: bool,
    /// 8, or 4 in the second version of the encoding.
    largest_alignment: usize,
}

impl<'a> CdrReader<'a> {
    /// Starts behind the four bytes that name the encoding.
    pub(super) fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        let (&[first, second, ..], payload) = message.split_first_chunk::<4>().ok_or(CdrError::Short(message.len()))?;
        let encoding = u16::from_be_bytes([first, second]);
        let (big_endian, largest_alignment) = match encoding {
            0x0000 => (true, 8),
            0x0001 => (false, 8),
            0x0006 => (true, 4),
            0x0007 => (false, 4),
            other => return Err(CdrError::Encoding(other)),
        };
        Ok(Self { payload, at: 0, big_endian, largest_alignment })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        let end = self.at.checked_add(count).ok_or(CdrError::Short(self.at))?;
        let bytes = self.payload.get(self.at..end).ok_or(CdrError::Short(self.at))?;
        self.at = end;
        Ok(bytes)
    }

    fn primitive<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        let alignment = N.min(self.largest_alignment).max(1);
        self.take((alignment - self.at % alignment) % alignment)?;
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        if self.big_endian {
            out.reverse();
        }
        Ok(out)
    }

    pub(super) fn u8(&mut self) -> Result<u8, CdrError> {
        Ok(u8::from_le_bytes(self.primitive()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32, CdrError> {
        Ok(u32::from_le_bytes(self.primitive()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32, CdrError> {
        Ok(i32::from_le_bytes(self.primitive()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64, CdrError> {
        Ok(f64::from_le_bytes(self.primitive()?))
    }

    pub(super) fn f64_array<const N: usize>(&mut self) -> Result<[f64; N], CdrError> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = self.f64()?;
        }
        Ok(out)
    }

    /// Number of elements that follow, refused when they cannot fit into what is left.
    fn count(&mut self, smallest_element: usize) -> Result<usize, CdrError> {
        let count = self.u32()? as usize;
        let left = self.payload.len().saturating_sub(self.at);
        if count > left / smallest_element {
            return Err(CdrError::Short(self.at));
        }
        Ok(count)
    }

    pub(super) fn f64_sequence(&mut self) -> Result<Vec<f64>, CdrError> {
        let count = self.count(8)?;
        (0..count).map(|_| self.f64()).collect()
    }

    pub(super) fn byte_sequence(&mut self) -> Result<&'a [u8], CdrError> {
        let count = self.count(1)?;
        self.take(count)
    }

    /// A text; its length on the wire counts the closing zero byte.
    pub(super) fn text(&mut self) -> Result<&'a str, CdrError> {
        let at = self.at;
        let bytes = self.byte_sequence()?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|_| CdrError::Text(at))
    }

    pub(super) fn text_sequence(&mut self) -> Result<Vec<&'a str>, CdrError> {
        let count = self.count(4)?;
        (0..count).map(|_| self.text()).collect()
    }
}

/// Writes one message from front to back, little-endian.
#[derive(Debug, Clone, Default)]
pub(super) struct CdrWriter {
    payload: Vec<u8>,
}

impl CdrWriter {
    fn primitive<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.payload.resize(self.payload.len().next_multiple_of(N), 0);
        self.payload.extend(bytes);
        self
    }

    pub(super) fn u8(self, value: u8) -> Self {
        self.primitive([value])
    }

    pub(super) fn u32(self, value: u32) -> Self {
        self.primitive(value.to_le_bytes())
    }

    pub(super) fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |writer, value| writer.primitive(value.to_le_bytes()))
    }

    pub(super) fn f64_sequence(self, values: &[f64]) -> Self {
        self.count(values.len()).f64s(values)
    }

    pub(super) fn byte_sequence(self, bytes: &[u8]) -> Self {
        let mut writer = self.count(bytes.len());
        writer.payload.extend_from_slice(bytes);
        writer
    }

    pub(super) fn text(self, text: &str) -> Self {
        let mut writer = self.count(text.len() + 1);
        writer.payload.extend_from_slice(text.as_bytes());
        writer.payload.push(0);
        writer
    }

    pub(super) fn text_sequence<'a>(self, texts: impl ExactSizeIterator<Item = &'a str>) -> Self {
        let writer = self.count(texts.len());
        texts.fold(writer, |writer, text| writer.text(text))
    }

    fn count(self, count: usize) -> Self {
        self.u32(u32::try_from(count).unwrap_or(u32::MAX))
    }

    /// The message, behind the four bytes that name the encoding.
    pub(super) fn message(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.payload].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_to_their_size_behind_the_header() {
        let mut message = vec![0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0];
        message.extend(2.5f64.to_le_bytes());
        let mut reader = CdrReader::new(&message).expect("little-endian header");
        assert_eq!((reader.u8(), reader.u32(), reader.f64()), (Ok(7), Ok(1), Ok(2.5)));
        assert_eq!(reader.u8(), Err(CdrError::Short(16)));
    }

    #[test]
    fn the_second_version_aligns_to_four_bytes_at_most() {
        let mut message = vec![0, 7, 0, 0, 9, 0, 0, 0];
        message.extend(2.5f64.to_le_bytes());
        let mut reader = CdrReader::new(&message).expect("version 2 header");
        assert_eq!((reader.u32(), reader.f64()), (Ok(9), Ok(2.5)));
    }

    #[test]
    fn big_endian_messages_are_read_too() {
        let message = [0, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0];
        assert_eq!(CdrReader::new(&message).and_then(|mut r| r.text()), Ok("ab"));
    }

    #[test]
    fn a_length_beyond_the_message_is_refused_before_memory_is_set_aside() {
        let message = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
        let reader = CdrReader::new(&message).expect("little-endian header");
        assert_eq!(reader.clone().f64_sequence(), Err(CdrError::Short(4)));
        assert_eq!(reader.clone().text_sequence(), Err(CdrError::Short(4)));
        assert_eq!(reader.clone().text(), Err(CdrError::Short(4)));
    }
}
