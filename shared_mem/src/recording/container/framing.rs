//! The outer records of an MCAP file, front to back, from files that may be cut anywhere or have changed bits.
//!
//! A record is an opcode, a 64-bit length and a body. Where a length makes no sense the next chunk is searched for, so
//! that one bad byte costs one chunk and not the rest of the file. Needs no index: a file whose writer was killed reads.

use super::fields::Fields;
use std::io::{self, Read, Seek, SeekFrom};

/// First and last bytes of a file.
pub(super) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
/// Opcode and length in front of a body.
pub(super) const PREFIX: usize = 9;
/// Largest record that is believed [bytes], and the largest chunk once it is unpacked: writers make chunks of some megabytes,
/// and hardly ever one that holds a single large picture.
pub(super) const LARGEST: u64 = 1 << 29;
/// Bytes of a chunk before its records, without the name of its compression.
const CHUNK_HEADER: u64 = 40;

/// Opcodes of the records used here.
pub(super) mod op {
    pub(in super::super) const FOOTER: u8 = 0x02;
    pub(in super::super) const SCHEMA: u8 = 0x03;
    pub(in super::super) const CHANNEL: u8 = 0x04;
    pub(in super::super) const MESSAGE: u8 = 0x05;
    pub(in super::super) const CHUNK: u8 = 0x06;
    pub(in super::super) const MESSAGE_INDEX: u8 = 0x07;
    pub(in super::super) const ATTACHMENT: u8 = 0x09;
    pub(in super::super) const METADATA: u8 = 0x0C;
    pub(in super::super) const DATA_END: u8 = 0x0F;
}

/// What could not be read, in words and in bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in super::super) struct Damage {
    parts: Vec<String>,
    /// Bytes of the file that were skipped.
    pub(in super::super) lost_bytes: u64,
}

impl Damage {
    pub(super) fn add(&mut self, lost_bytes: u64, what: String) {
        self.lost_bytes += lost_bytes;
        self.parts.push(what);
    }

    /// One line that says that the file is damaged and how, `None` when it is whole. Long lists are cut.
    pub(in super::super) fn summary(&self) -> Option<String> {
        let (first, rest) = self.parts.split_at_checked(3).unwrap_or((&self.parts, &[]));
        let more = if rest.is_empty() { String::new() } else { format!("; and {} more places", rest.len()) };
        (!first.is_empty()).then(|| format!("the file is damaged: {}{more}", first.join("; ")))
    }
}

/// Walks over the records of the data section.
#[derive(Debug)]
pub(super) struct Framing<R> {
    source: R,
    pub(super) length: u64,
    /// Where the next record starts.
    at: u64,
    /// Checksum over everything so far; `None` once something was skipped.
    checksum: Option<crc32fast::Hasher>,
    /// Opcode, length and body of the current record.
    pub(super) record: Vec<u8>,
    pub(super) damage: Damage,
    ended: bool,
}

impl<R: Read + Seek> Framing<R> {
    /// `None` when the source does not start like an MCAP file.
    pub(super) fn open(mut source: R) -> io::Result<Option<Self>> {
        let length = source.seek(SeekFrom::End(0))?;
        source.seek(SeekFrom::Start(0))?;
        let mut magic = Vec::with_capacity(MAGIC.len());
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic)?;
        // A changed bit in the magic must not cost the file.
        let equal = magic.iter().zip(&MAGIC).filter(|(a, b)| a == b).count();
        if equal + 1 < MAGIC.len() {
            return Ok(None);
        }
        let mut damage = Damage::default();
        if equal < MAGIC.len() {
            damage.add(0, "the first bytes have changed".into());
        }
        let mut checksum = crc32fast::Hasher::new();
        checksum.update(&magic);
        let at = MAGIC.len() as u64;
        Ok(Some(Self { source, length, at, checksum: Some(checksum), record: Vec::new(), damage, ended: false }))
    }

    /// Loads the next record into `self.record`; its opcode, or `None` behind the last.
    pub(super) fn advance(&mut self) -> io::Result<Option<u8>> {
        while !self.ended {
            let left = self.length.saturating_sub(self.at);
            if left < PREFIX as u64 {
                self.end(left, format!("the file is cut at byte {}", self.length));
                break;
            }
            let (opcode, length) = self.read_prefix()?;
            if !believable(opcode, length, left - PREFIX as u64) {
                self.resynchronise()?;
                continue;
            }
            self.read_body(length)?;
            if !is_whole(opcode, &self.record, left) {
                self.resynchronise()?;
                continue;
            }
            if opcode == op::DATA_END {
                self.finish()?;
                break;
            }
            if let Some(checksum) = &mut self.checksum {
                checksum.update(&self.record);
            }
            self.at += self.record.len() as u64;
            return Ok(Some(opcode));
        }
        Ok(None)
    }

    /// Body of the current record.
    pub(super) fn body(&self) -> &[u8] {
        self.record.get(PREFIX..).unwrap_or(&[])
    }

    /// Schema and channel records that a complete file repeats behind its data; empty when they are not there or changed.
    pub(super) fn summary(&mut self) -> io::Result<Vec<u8>> {
        const TAIL: u64 = (PREFIX + 20 + MAGIC.len()) as u64;
        let Some(footer_at) = self.length.checked_sub(TAIL) else { return Ok(Vec::new()) };
        let footer = self.read_at(footer_at, TAIL)?;
        let mut fields = Fields(&footer);
        let is_footer = fields.u8() == Some(op::FOOTER) && fields.u64() == Some(20);
        let (Some(start), Some(_), Some(crc)) = (fields.u64(), fields.u64(), fields.u32()) else {
            return Ok(Vec::new());
        };
        if !is_footer || start == 0 || start >= footer_at || footer_at - start > LARGEST {
            return Ok(Vec::new());
        }
        // The checksum spans the summary and the footer up to itself.
        let mut summary = self.read_at(start, footer_at - start + PREFIX as u64 + 16)?;
        let unchanged = crc == 0 || crc32fast::hash(&summary) == crc;
        summary.truncate(usize::try_from(footer_at - start).unwrap_or(0));
        Ok(if unchanged { summary } else { Vec::new() })
    }

    /// Reads `count` bytes elsewhere and returns to the current record's end.
    fn read_at(&mut self, start: u64, count: u64) -> io::Result<Vec<u8>> {
        self.source.seek(SeekFrom::Start(start))?;
        let mut bytes = Vec::new();
        self.source.by_ref().take(count).read_to_end(&mut bytes)?;
        self.source.seek(SeekFrom::Start(self.at))?;
        Ok(bytes)
    }

    fn read_prefix(&mut self) -> io::Result<(u8, u64)> {
        let mut prefix = [0; PREFIX];
        self.source.read_exact(&mut prefix)?;
        self.record.clear();
        self.record.extend(prefix);
        let mut fields = Fields(&prefix);
        Ok((fields.u8().unwrap_or(0), fields.u64().unwrap_or(0)))
    }

    fn read_body(&mut self, length: u64) -> io::Result<()> {
        let read = self.source.by_ref().take(length).read_to_end(&mut self.record)?;
        if read as u64 == length { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// The data are complete: compares the checksum over all of them, where there is one, and looks for the file's end.
    fn finish(&mut self) -> io::Result<()> {
        let saved = Fields(self.body()).u32().unwrap_or(0);
        let calculated = self.checksum.take().map(crc32fast::Hasher::finalize);
        let whole = self.damage == Damage::default();
        self.ended = true;
        if let Some(calculated) = calculated
            && whole
            && saved != 0
            && saved != calculated
        {
            self.damage
                .add(0, "bytes outside the chunks have changed (the checksum over all data does not match)".into());
        }
        let end = self.read_at(self.length.saturating_sub(MAGIC.len() as u64), MAGIC.len() as u64)?;
        if end != MAGIC {
            self.damage.add(0, "the index at the end is cut; all messages are there".into());
        }
        Ok(())
    }

    fn end(&mut self, lost: u64, what: String) {
        self.damage.add(lost, what);
        self.ended = true;
    }

    fn skip_to(&mut self, next: u64) {
        let lost = next.saturating_sub(self.at);
        self.damage.add(lost, format!("bytes {} to {next} have changed and are skipped", self.at));
        self.at = next;
        self.checksum = None;
    }

    /// The record at `self.at` makes no sense: goes on at the next chunk, or ends.
    fn resynchronise(&mut self) -> io::Result<()> {
        match self.find_chunk(self.at + 1)? {
            Some(next) => self.skip_to(next),
            None => {
                let lost = self.length - self.at;
                self.end(lost, format!("the file is cut or unreadable from byte {} on ({lost} bytes)", self.at));
            }
        }
        self.source.seek(SeekFrom::Start(self.at))?;
        Ok(())
    }

    /// Where the next chunk starts, at or after `from`. A chunk's lengths must fit each other, so chance finds none.
    fn find_chunk(&mut self, from: u64) -> io::Result<Option<u64>> {
        const BLOCK: usize = 1 << 20;
        const HEADER: usize = PREFIX + CHUNK_HEADER as usize + 4;
        let mut block = Vec::with_capacity(BLOCK);
        let mut start = from;
        while start + (HEADER as u64) <= self.length {
            self.source.seek(SeekFrom::Start(start))?;
            block.clear();
            self.source.by_ref().take(BLOCK as u64).read_to_end(&mut block)?;
            let candidates = block.windows(HEADER).enumerate();
            for (i, window) in candidates.filter(|(_, window)| window.first() == Some(&op::CHUNK)) {
                let at = start + i as u64;
                if is_chunk_header(window, self.length - at) {
                    return Ok(Some(at));
                }
            }
            // The next block overlaps this one by a header, so that none is missed on the border.
            let Some(step) = block.len().checked_sub(HEADER - 1) else { break };
            start += step as u64;
        }
        Ok(None)
    }
}

/// True when a record of this opcode and length can stand here, `left` bytes before the end of the file.
fn believable(opcode: u8, length: u64, left: u64) -> bool {
    let known = matches!(opcode, 0x01..=0x0F | 0x80..);
    let fits = length <= left && length <= LARGEST;
    known && fits && (opcode != op::DATA_END || length == 4) && opcode != op::FOOTER
}

/// True when the lengths inside a record fit its own: a changed length must not lead the walk astray.
fn is_whole(opcode: u8, record: &[u8], left: u64) -> bool {
    let mut f = Fields(record.get(PREFIX..).unwrap_or(&[]));
    let read = match opcode {
        op::CHUNK => return is_chunk_header(record, left),
        op::SCHEMA => f.u16().and(f.text()).and(f.text()).and(f.bytes()).is_some(),
        op::CHANNEL => f.u32().and(f.text()).and(f.text()).and(f.bytes()).is_some(),
        op::MESSAGE_INDEX => f.u16().is_some() && f.bytes().is_some_and(|entries| entries.len() % 16 == 0),
        op::ATTACHMENT => f.take(16).and(f.text()).and(f.text()).and(f.long_bytes()).and(f.u32()).is_some(),
        op::METADATA => f.text().is_some() && f.text_map().is_some(),
        _ => return true,
    };
    read && f.0.is_empty()
}

fn is_chunk_header(prefix: &[u8], left: u64) -> bool {
    let mut fields = Fields(prefix);
    let (Some(op::CHUNK), Some(length)) = (fields.u8(), fields.u64()) else { return false };
    let skipped = fields.take(28).is_some(); // log times, uncompressed size, checksum
    let Some(compression) = fields.text().filter(|_| skipped) else { return false };
    let Some(size) = fields.u64() else { return false };
    matches!(compression, "" | "lz4" | "zstd")
        && length.checked_sub(CHUNK_HEADER + compression.len() as u64) == Some(size)
        && length <= left.saturating_sub(PREFIX as u64)
}
