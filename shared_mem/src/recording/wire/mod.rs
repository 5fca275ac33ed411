//! Messages of own clips: protobuf, Foxglove's schemas where one exists, `proto/twinalign` otherwise.
//!
//! Own messages carry stamps of the monotonic clock; Foxglove's `timestamp` fields, and the times of MCAP itself, are
//! Unix time: the stamp plus one offset per file ([`UnixClock`]). What Foxglove's schemas have no room for (camera
//! stamps, covariance) rides in a field of our own inside the same message, which other readers skip.

mod arm;
mod devices;
mod targets;

pub(super) use devices::{IMAGE_SCHEMA, image_from_wire, image_to_wire};

use prost::Message as _;
use prost_types::{FileDescriptorSet, Timestamp};

/// Rust types made from `proto/` by the build script.
pub(super) mod proto {
    #![allow(missing_docs, unreachable_pub, clippy::all)] // generated
    pub(in super::super) mod foxglove {
        include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
    }
    pub(in super::super) mod twinalign {
        include!(concat!(env!("OUT_DIR"), "/twinalign.rs"));
    }
}

/// Descriptors of everything in `proto/`.
const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

/// A payload that has a protobuf form.
pub(super) trait Wire: Sized {
    /// Its topic.
    const TOPIC: &'static str;
    /// Full name of its schema.
    const SCHEMA: &'static str;
    /// Its protobuf form.
    type Message: prost::Message + Default;
    /// Monotonic clock [ns].
    fn stamp_ns(&self) -> u64;
    /// To its protobuf form.
    fn to_wire(&self, clock: UnixClock) -> Self::Message;
    /// From its protobuf form; what is missing there is 0.
    fn from_wire(message: Self::Message) -> Self;
}

/// From the monotonic clock to Unix time, by one offset for the whole file [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnixClock(pub(super) i64);

impl UnixClock {
    pub(super) fn unix_ns(self, stamp_ns: u64) -> u64 {
        stamp_ns.saturating_add_signed(self.0)
    }

    pub(super) fn timestamp(self, stamp_ns: u64) -> Option<Timestamp> {
        let unix_ns = self.unix_ns(stamp_ns);
        let seconds = i64::try_from(unix_ns / 1_000_000_000).ok()?;
        Some(Timestamp { seconds, nanos: i32::try_from(unix_ns % 1_000_000_000).ok()? })
    }
}

/// The descriptor of `schema` and of everything it uses, as MCAP readers expect it: an encoded `FileDescriptorSet`.
pub(super) fn descriptor(schema: &str) -> Vec<u8> {
    let all = FileDescriptorSet::decode(DESCRIPTORS).unwrap_or_default();
    let (package, name) = schema.split_once('.').unwrap_or(("", schema));
    let home = all
        .file
        .iter()
        .find(|file| file.package() == package && file.message_type.iter().any(|message| message.name() == name));
    let mut wanted: Vec<String> = home.iter().map(|file| file.name().to_owned()).collect();
    let mut next = 0;
    while let Some(name) = wanted.get(next).cloned() {
        let uses = all.file.iter().filter(|file| file.name() == name).flat_map(|file| &file.dependency);
        let new: Vec<String> = uses.filter(|name| !wanted.contains(name)).cloned().collect();
        wanted.extend(new);
        next += 1;
    }
    // Readers want a file behind those it uses; the compiler's order has that property.
    let file = all.file.into_iter().filter(|file| wanted.iter().any(|name| name == file.name())).collect();
    FileDescriptorSet { file }.encode_to_vec()
}

/// The first `N` numbers, 0 where some are missing.
fn array<const N: usize>(values: &[f64]) -> [f64; N] {
    let mut out = [0.0; N];
    for (o, v) in out.iter_mut().zip(values) {
        *o = *v;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_carries_all_it_uses_each_behind_its_own() {
        let set = FileDescriptorSet::decode(descriptor("foxglove.PoseInFrame").as_slice()).expect("a descriptor set");
        let names: Vec<&str> = set.file.iter().map(|file| file.name()).collect();
        assert_eq!(names.last(), Some(&"foxglove/PoseInFrame.proto"));
        assert_eq!(names.len(), 4, "{names:?}");
        for (i, file) in set.file.iter().enumerate() {
            let before = names.get(..i).unwrap_or(&[]);
            assert!(file.dependency.iter().all(|d| before.contains(&d.as_str())), "{names:?}");
        }
    }

    #[test]
    fn unix_time_is_the_stamp_plus_the_offset() {
        let clock = UnixClock(1_700_000_000_000_000_000);
        assert_eq!(clock.unix_ns(5), 1_700_000_000_000_000_005);
        assert_eq!(clock.timestamp(1_500_000_000), Some(Timestamp { seconds: 1_700_000_001, nanos: 500_000_000 }));
    }
}
