//! Fields of MCAP records: little-endian integers, length-prefixed text. Refuses every length that exceeds the record.

use std::collections::BTreeMap;

/// Reads the fields of one record from front to back; `None` once the record is too short.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(count)?;
        self.0 = tail;
        Some(head)
    }

    fn integer<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.integer().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.integer().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.integer().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.integer().map(u64::from_le_bytes)
    }

    /// Bytes behind a 32-bit length.
    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let count = usize::try_from(self.u32()?).ok()?;
        self.take(count)
    }

    /// Bytes behind a 64-bit length.
    pub(super) fn long_bytes(&mut self) -> Option<&'a [u8]> {
        let count = usize::try_from(self.u64()?).ok()?;
        self.take(count)
    }

    /// UTF-8 behind a 32-bit length.
    pub(super) fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }

    /// Pairs of text behind their length in bytes.
    pub(super) fn text_map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut pairs = Fields(self.bytes()?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.text()?.to_owned(), pairs.text()?.to_owned());
        }
        Some(map)
    }
}

/// Header of a chunk and its compressed records.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub(super) uncompressed_size: u64,
    /// 0: none was computed.
    pub(super) uncompressed_crc: u32,
    /// `""`, `"lz4"` or `"zstd"`.
    pub(super) compression: &'a str,
    pub(super) records: &'a [u8],
}

impl<'a> Chunk<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut f = Fields(body);
        f.take(16)?; // first and last log time: the messages say it themselves
        let chunk = Self {
            uncompressed_size: f.u64()?,
            uncompressed_crc: f.u32()?,
            compression: f.text()?,
            records: f.long_bytes()?,
        };
        f.0.is_empty().then_some(chunk)
    }
}
