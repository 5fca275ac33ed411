//! Pose of the tracked object, whoever tracks it, and of each of several by its name.

use super::check::{self, Wrong};
use super::wire::{Field, plain, wire};
use crate::frames::{Base, Object, Pose};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// The object's geometric centre in the base frame. Topic `/object/pose`.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/ObjectPose/1")]
#[repr(C)]
pub struct ObjectPose {
    /// When the picture behind it, or where nobody knows that, the pose arrived here: monotonic clock [ns]. One latency of
    /// cell.toml's camera after the object was there.
    pub stamp_ns: u64,
    /// When the picture behind it was taken, by the camera's clock [ns].
    pub device_ns: u64,
    /// Counts the poses of one tracker.
    pub sequence: u64,
    /// Position in the base frame [m].
    pub position: [f64; 3],
    /// Orientation in the base frame, `w, x, y, z`.
    pub wxyz: [f64; 4],
    /// Row-major covariance of position [m²] and small rotation about the base axes [rad²]: x, y, z, rx, ry, rz. All 0: not known.
    pub covariance: [f64; 36],
}

impl Default for ObjectPose {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            device_ns: 0,
            sequence: 0,
            position: [0.0; 3],
            wxyz: [1.0, 0.0, 0.0, 0.0],
            covariance: [0.0; 36],
        }
    }
}

impl ObjectPose {
    /// The pose with its frames named; `None` when the numbers are no pose.
    pub fn pose(&self) -> Option<Pose<Base, Object>> {
        Pose::from_parts(self.position, self.wxyz)
    }

    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("device_ns", self.device_ns)?;
        check::running("sequence", self.sequence)?;
        check::numbers("position", &self.position)?;
        check::quaternion("wxyz", &self.wxyz)?;
        check::numbers("covariance", &self.covariance)
    }
}

plain!(ObjectPose);

/// Longest name of an object or of a part of one [bytes].
pub const NAME_LENGTH: usize = 64;

/// Whether a text can name an object: up to [`NAME_LENGTH`] letters, digits and `_`, so that it can stand in a topic.
pub fn is_object_name(text: &str) -> bool {
    (1..=NAME_LENGTH).contains(&text.len()) && text.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_')
}

/// Name of an object, or of a part of one that moves in itself (`NAME_LINK`); empty where cell.toml names none.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ObjectName([u8; NAME_LENGTH]);

impl Default for ObjectName {
    fn default() -> Self {
        Self([0; NAME_LENGTH])
    }
}

impl std::fmt::Debug for ObjectName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.text())
    }
}

impl ObjectName {
    /// The name; `None` for a text that is none.
    pub fn new(text: &str) -> Option<Self> {
        is_object_name(text).then(|| {
            let mut bytes = [0; NAME_LENGTH];
            bytes[..text.len()].copy_from_slice(text.as_bytes());
            Self(bytes)
        })
    }

    /// Its text; empty where there is none.
    pub fn text(&self) -> &str {
        let end = self.0.iter().position(|byte| *byte == 0).unwrap_or(NAME_LENGTH);
        std::str::from_utf8(&self.0[..end]).unwrap_or("")
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0[0] == 0
    }
}

impl Field for ObjectName {
    type Wire = [u8; NAME_LENGTH];

    fn to_wire(self) -> Self::Wire {
        self.0
    }

    fn from_wire(field: &'static str, wire: Self::Wire) -> Result<Self, Wrong> {
        let name = Self(wire);
        // What stands behind the end would make two of one name.
        let behind = wire.iter().skip(name.text().len()).all(|byte| *byte == 0);
        if behind && is_object_name(name.text()) { Ok(name) } else { Err(Wrong::Name { field }) }
    }
}

/// Where one of several objects is, by its name. Topic `/object/poses`; clips hold each on `/object/NAME/pose`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedPose {
    /// As [`ObjectPose::stamp_ns`].
    pub stamp_ns: u64,
    /// As [`ObjectPose::device_ns`].
    pub device_ns: u64,
    /// Counts the poses of this object.
    pub sequence: u64,
    /// Position in the base frame [m].
    pub position: [f64; 3],
    /// Orientation in the base frame, `w, x, y, z`.
    pub wxyz: [f64; 4],
    /// As [`ObjectPose::covariance`].
    pub covariance: [f64; 36],
    /// Whose pose it is.
    pub name: ObjectName,
}

impl NamedPose {
    /// The pose of the object of this name.
    pub fn new(name: ObjectName, pose: &ObjectPose) -> Self {
        let ObjectPose { stamp_ns, device_ns, sequence, position, wxyz, covariance } = *pose;
        Self { stamp_ns, device_ns, sequence, position, wxyz, covariance, name }
    }

    /// The same without the name.
    pub fn unnamed(&self) -> ObjectPose {
        let Self { stamp_ns, device_ns, sequence, position, wxyz, covariance, .. } = *self;
        ObjectPose { stamp_ns, device_ns, sequence, position, wxyz, covariance }
    }

    fn check(&self) -> Result<(), Wrong> {
        self.unnamed().check()
    }
}

wire!("twinalign/NamedPose/1" NamedPoseWire: NamedPose {
    stamp_ns: u64,
    device_ns: u64,
    sequence: u64,
    position: [f64; 3],
    wxyz: [f64; 4],
    covariance: [f64; 36],
    name: ObjectName,
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_word_that_can_stand_in_a_topic() {
        let longest = "a".repeat(NAME_LENGTH);
        for name in ["cup", "milk_box_2", longest.as_str()] {
            assert_eq!(ObjectName::new(name).expect("a name").text(), name);
        }
        for wrong in ["", "a b", "a/b", "größe", "a\0b", &"a".repeat(NAME_LENGTH + 1)] {
            assert_eq!(ObjectName::new(wrong), None, "{wrong:?}");
        }
        let mut behind = ObjectName::new("cup").expect("a name").to_wire();
        behind[10] = b'x';
        assert_eq!(ObjectName::from_wire("name", behind), Err(Wrong::Name { field: "name" }));
        assert_eq!(ObjectName::from_wire("name", [0; NAME_LENGTH]), Err(Wrong::Name { field: "name" }));
    }
}
