//! How many depth pictures a `.bag` holds, by its own index: what a conversion has to come up to. librealsense counts none.
//!
//! Source: the ROS bag format 2.0 (wiki.ros.org/Bags/Format/2.0): records of a header (fields `name=value`) and data; a bag
//! header that says where the index begins; there, connections (topics) and, per chunk, messages per connection.

use shared_mem::input::{self, InputError};
use std::collections::BTreeMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

const VERSION: &[u8] = b"#ROSBAG V2.0\n";
/// Longest header or data of a record of the index that is believed [bytes].
const LONGEST: u32 = 1 << 24;
/// Kinds of records.
const CHUNK_INFO: u8 = 6;
const CONNECTION: u8 = 7;

/// Why a recording cannot be counted.
#[derive(Debug, thiserror::Error)]
pub(super) enum IndexError {
    /// It is missing, or no file.
    #[error(transparent)]
    Input(#[from] InputError),
    #[error("{0}")]
    Io(#[from] io::Error),
    #[error("it is no recording by librealsense (a ROS bag, version 2.0)")]
    NoBag,
    /// The recorder was killed, or the copy is not whole.
    #[error("it has no index: its recorder was killed, or the file is cut; `rosbag reindex` makes a new one")]
    NoIndex,
}

/// Depth pictures in a recording; of the depth stream that has most.
pub(super) fn depth_pictures(bag: &Path) -> Result<usize, IndexError> {
    count(BufReader::new(input::open(bag)?))
}

fn count(mut file: impl Read + Seek) -> Result<usize, IndexError> {
    let mut version = [0; VERSION.len()];
    file.read_exact(&mut version).map_err(|_short| IndexError::NoBag)?;
    if version != *VERSION {
        return Err(IndexError::NoBag);
    }
    let size = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(VERSION.len() as u64))?;
    let begin = record(&mut file)?.ok_or(IndexError::NoBag)?.long("index_pos").ok_or(IndexError::NoBag)?;
    if begin <= VERSION.len() as u64 || begin >= size {
        return Err(IndexError::NoIndex);
    }
    file.seek(SeekFrom::Start(begin))?;
    let (mut of_depth, mut pictures) = (Vec::new(), BTreeMap::new());
    while let Some(record) = record(&mut file)? {
        match record.kind() {
            Some(CONNECTION) if record.names_depth() => of_depth.extend(record.short("conn")),
            Some(CHUNK_INFO) => {
                for entry in record.data.chunks_exact(8) {
                    let (Some(connection), Some(count)) = (short(&entry[..4]), short(&entry[4..])) else { continue };
                    *pictures.entry(connection).or_insert(0_usize) += count as usize;
                }
            }
            _ => {}
        }
    }
    Ok(of_depth.iter().filter_map(|connection| pictures.get(connection)).copied().max().unwrap_or(0))
}

/// A record of the bag.
struct Record {
    fields: BTreeMap<Vec<u8>, Vec<u8>>,
    data: Vec<u8>,
}

impl Record {
    fn kind(&self) -> Option<u8> {
        self.fields.get(b"op".as_slice())?.first().copied()
    }

    fn short(&self, name: &str) -> Option<u32> {
        short(self.fields.get(name.as_bytes())?)
    }

    fn long(&self, name: &str) -> Option<u64> {
        Some(u64::from_le_bytes(self.fields.get(name.as_bytes())?.as_slice().try_into().ok()?))
    }

    /// `/device_0/sensor_0/Depth_0/image/data` and the like.
    fn names_depth(&self) -> bool {
        let topic = self.fields.get(b"topic".as_slice()).map(|topic| String::from_utf8_lossy(topic));
        topic.is_some_and(|topic| topic.contains("/Depth_") && topic.ends_with("/image/data"))
    }
}

fn short(bytes: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}

/// The next record; `None` at the end of the file.
fn record(file: &mut impl Read) -> Result<Option<Record>, IndexError> {
    let Some(header) = block(file)? else { return Ok(None) };
    let data = block(file)?.ok_or(IndexError::NoIndex)?;
    let (mut fields, mut rest) = (BTreeMap::new(), header.as_slice());
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let (field, after) = after.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or(IndexError::NoIndex)?;
        if let Some(split) = field.iter().position(|byte| *byte == b'=') {
            fields.insert(field[..split].to_vec(), field[split + 1..].to_vec());
        }
        rest = after;
    }
    Ok(Some(Record { fields, data }))
}

/// A length and as many bytes; `None` at the end of the file.
fn block(file: &mut impl Read) -> Result<Option<Vec<u8>>, IndexError> {
    let mut length = [0; 4];
    match file.read_exact(&mut length) {
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        other => other?,
    }
    let length = u32::from_le_bytes(length);
    if length > LONGEST {
        return Err(IndexError::NoIndex);
    }
    let mut bytes = vec![0; length as usize];
    file.read_exact(&mut bytes).map_err(|_cut| IndexError::NoIndex)?;
    Ok(Some(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn written(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
        let mut header = Vec::new();
        for (name, value) in fields {
            header.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
            header.extend([name.as_bytes(), b"=", value].concat());
        }
        [&(header.len() as u32).to_le_bytes()[..], &header, &(data.len() as u32).to_le_bytes(), data].concat()
    }

    fn bag() -> Vec<u8> {
        let head =
            |begin: u64| [VERSION, &written(&[("op", &[3]), ("index_pos", &begin.to_le_bytes())], b"pad")].concat();
        let begin = head(0).len() as u64;
        let depth = ("topic", b"/device_0/sensor_0/Depth_0/image/data".as_slice());
        let color = ("topic", b"/device_0/sensor_1/Color_0/image/data".as_slice());
        let connection = |number: u32, topic| written(&[("op", &[7]), ("conn", &number.to_le_bytes()), topic], b"");
        let chunk = |counts: &[[u32; 2]]| {
            let data: Vec<u8> = counts.iter().flatten().flat_map(|count| count.to_le_bytes()).collect();
            written(&[("op", &[6]), ("ver", &1_u32.to_le_bytes())], &data)
        };
        [head(begin), connection(4, depth), connection(5, color), chunk(&[[4, 2], [5, 7]]), chunk(&[[4, 3]])].concat()
    }

    #[test]
    fn depth_pictures_are_counted_over_all_chunks() {
        assert_eq!(count(Cursor::new(bag())).expect("a bag"), 5);
    }

    #[test]
    fn a_bag_cut_anywhere_is_told_and_never_panics() {
        let whole = bag();
        for length in 0..whole.len() {
            match count(Cursor::new(&whole[..length])) {
                Ok(pictures) => assert!(pictures <= 5, "{pictures} at {length}"),
                Err(e) => assert!(!e.to_string().is_empty()),
            }
        }
        let unfinished = [VERSION, &written(&[("op", &[3]), ("index_pos", &0_u64.to_le_bytes())], b"")].concat();
        assert!(matches!(count(Cursor::new(unfinished)), Err(IndexError::NoIndex)));
    }
}
