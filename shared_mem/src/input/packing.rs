//! What is packed as a whole, file or message: known by its first bytes, unpacked where that is possible here, and named with a
//! way out where it is not.

use std::io::{self, Read};

/// How something is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    /// `.gz`
    Gzip,
    /// `.zst`, `.zstd`: what ROS 2 packs files and messages with.
    Zstd,
    /// `.bz2`
    Bzip2,
    /// `.lz4`
    Lz4,
    /// `.xz`
    Xz,
    /// `.7z`
    SevenZip,
    /// `.zip`, `.xlsx`, `.npz`
    Zip,
}

impl Packing {
    /// So many first bytes tell.
    pub const TOLD_BY: usize = 10;

    /// How something is packed that begins with these bytes; `None` where it is not.
    pub fn of(start: &[u8]) -> Option<Self> {
        match start {
            [0x1f, 0x8b, 8, ..] => Some(Self::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::Zstd),
            // A text may begin with the first three of them.
            [b'B', b'Z', b'h', b'1'..=b'9', 0x31, 0x41, 0x59, 0x26, 0x53, 0x59, ..] => Some(Self::Bzip2),
            [0x04, 0x22, 0x4d, 0x18, ..] => Some(Self::Lz4),
            [0xfd, b'7', b'z', b'X', b'Z', 0, ..] => Some(Self::Xz),
            [b'7', b'z', 0xbc, 0xaf, 0x27, 0x1c, ..] => Some(Self::SevenZip),
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            _ => None,
        }
    }

    /// What it is called.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
            Self::Bzip2 => "bzip2",
            Self::Lz4 => "lz4",
            Self::Xz => "xz",
            Self::SevenZip => "7-Zip",
            Self::Zip => "zip",
        }
    }

    /// What unpacks a file of it.
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::Gzip => "unpack it with `gunzip`",
            Self::Zstd => "unpack it with `zstd -d`",
            Self::Bzip2 => "unpack it with `bunzip2`",
            Self::Lz4 => "unpack it with `lz4 -d`",
            Self::Xz => "unpack it with `unxz`",
            Self::SevenZip => "unpack it with `7z x`",
            Self::Zip => "unpack it with `unzip`, or save a spreadsheet as CSV",
        }
    }

    /// Reads what is in `packed`; `None` where that is not unpacked here.
    ///
    /// # Errors
    /// When there is no room for it.
    pub fn reader<'a>(self, packed: impl Read + 'a) -> io::Result<Option<Box<dyn Read + 'a>>> {
        Ok(Some(match self {
            Self::Gzip => Box::new(flate2::read::MultiGzDecoder::new(packed)),
            Self::Zstd => Box::new(zstd::stream::read::Decoder::new(packed)?),
            Self::Bzip2 => Box::new(bzip2::read::MultiBzDecoder::new(packed)),
            Self::Lz4 => Box::new(lz4_flex::frame::FrameDecoder::new(packed)),
            Self::Xz | Self::SevenZip | Self::Zip => return Ok(None),
        }))
    }

    /// What is in `packed`, of `most` bytes at most.
    ///
    /// # Errors
    /// When it is cut, has changed, becomes more than that, or is packed so that it is not unpacked here.
    pub fn unpack(self, packed: &[u8], most: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let reader = self.reader(packed)?.ok_or(io::ErrorKind::Unsupported)?;
        reader.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > most { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
    }
}

#[cfg(test)]
impl Packing {
    /// Packs with zstd, for tests.
    pub(crate) fn with_zstd(bytes: &[u8]) -> Vec<u8> {
        zstd::encode_all(bytes, 3).expect("room")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    /// The same text, packed in each way that is unpacked.
    fn packed(text: &[u8]) -> [(Packing, Vec<u8>); 4] {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(text).expect("room");
        let mut bzip2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
        bzip2.write_all(text).expect("room");
        let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
        lz4.write_all(text).expect("room");
        [
            (Packing::Gzip, gzip.finish().expect("room")),
            (Packing::Zstd, Packing::with_zstd(text)),
            (Packing::Bzip2, bzip2.finish().expect("room")),
            (Packing::Lz4, lz4.finish().expect("room")),
        ]
    }

    #[test]
    fn what_was_packed_is_known_by_its_first_bytes_and_comes_out_again() {
        let text = b"t,q1\n0,1\n".repeat(100);
        for (packing, bytes) in packed(&text) {
            assert_eq!(Packing::of(&bytes[..Packing::TOLD_BY]), Some(packing));
            assert_eq!(packing.unpack(&bytes, text.len() as u64).expect("whole"), text, "{packing:?}");
            // Two files behind each other are one, where the format has it so.
            if packing != Packing::Lz4 {
                let twice = [bytes.clone(), bytes.clone()].concat();
                assert_eq!(packing.unpack(&twice, 1 << 20).expect("whole").len(), 2 * text.len(), "{packing:?}");
            }
            assert!(packing.unpack(&bytes[..bytes.len() / 2], 1 << 20).is_err(), "{packing:?} is cut");
            assert!(packing.unpack(&bytes, text.len() as u64 - 1).is_err(), "{packing:?} becomes too much");
        }
    }

    #[test]
    fn what_is_not_unpacked_is_named_and_a_text_is_packed_in_no_way() {
        for (bytes, packing) in [
            (&b"\xfd7zXZ\0\0\0\0\0"[..], Packing::Xz),
            (b"7z\xbc\xaf\x27\x1c\0\0\0\0", Packing::SevenZip),
            (b"PK\x03\x04......", Packing::Zip),
        ] {
            assert_eq!(Packing::of(bytes), Some(packing));
            assert!(packing.unpack(bytes, 1000).is_err() && packing.remedy().contains('`'));
        }
        for text in [&b"BZh9 is a name\n"[..], b"t,q1\n", b"", b"\0\x01\0\0"] {
            assert_eq!(Packing::of(text), None);
        }
    }
}
