//! What the numbers of a message may be. Every message passes these checks when it is received, so that the code
//! that gets it indexes, adds and multiplies without asking again. Nothing here allocates.

use super::{Joints, MAX_JOINTS};

/// Largest magnitude of a number with a unit: beyond every quantity of a cell, and its square and the sums of many of
/// them are still finite.
pub const LARGEST: f64 = 1e9;
/// Largest stamp [ns] and count: 146 years. Sums and differences of two of them fit into 64 bits with a sign.
pub const LATEST: u64 = 1 << 62;
/// Longest side of a picture [pixel].
pub const LONGEST_SIDE: u32 = 8192;
/// How far the length of a quaternion may be from 1.
const QUATERNION_TOLERANCE: f64 = 1e-2;

/// Why a message is none.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Wrong {
    /// A number that should name one of few things names none.
    #[error("{field} is {code}, which stands for nothing")]
    Code {
        /// Field of the message.
        field: &'static str,
        /// What it holds.
        code: u32,
    },
    /// A count, a length or a stamp is out of its range.
    #[error("{field} is {value}, not {least} to {most}")]
    Count {
        /// Field of the message.
        field: &'static str,
        /// What it holds.
        value: u64,
        /// Smallest possible.
        least: u64,
        /// Largest possible.
        most: u64,
    },
    /// A quantity is not finite or absurdly large.
    #[error("{field} holds {value:e}, not a number of at most {LARGEST:e}")]
    Number {
        /// Field of the message.
        field: &'static str,
        /// What it holds.
        value: f64,
    },
    /// A joint that the arm does not have is given something.
    #[error("{field} holds {value:e} for a joint beyond dof")]
    Unused {
        /// Field of the message.
        field: &'static str,
        /// What it holds.
        value: f64,
    },
    /// An orientation is no unit quaternion.
    #[error("{field} is no unit quaternion: its length is {length:.4}")]
    Quaternion {
        /// Field of the message.
        field: &'static str,
        /// Its Euclidean length.
        length: f64,
    },
    /// A text is not UTF-8.
    #[error("{field} is no UTF-8")]
    Text {
        /// Field of the message.
        field: &'static str,
    },
    /// A text is no line of UTF-8 with nothing behind its end.
    #[error("{field} is no line of UTF-8")]
    Line {
        /// Field of the message.
        field: &'static str,
    },
    /// A text is no name of an object.
    #[error("{field} is no name of letters, digits and _")]
    Name {
        /// Field of the message.
        field: &'static str,
    },
    /// A picture's bytes do not fit its header.
    #[error("the picture has {bytes} bytes, its header describes {described}")]
    PictureSize {
        /// Bytes that came.
        bytes: u64,
        /// Rows times stride.
        described: u64,
    },
}

pub(super) fn count(field: &'static str, value: impl Into<u64>, least: u64, most: u64) -> Result<(), Wrong> {
    let value = value.into();
    if (least..=most).contains(&value) { Ok(()) } else { Err(Wrong::Count { field, value, least, most }) }
}

/// A stamp [ns] or a running number.
pub(super) fn running(field: &'static str, value: u64) -> Result<(), Wrong> {
    count(field, value, 0, LATEST)
}

/// 0 or 1.
pub(super) fn flag(field: &'static str, value: u32) -> Result<(), Wrong> {
    count(field, value, 0, 1)
}

pub(super) fn dof(value: u32) -> Result<(), Wrong> {
    count("dof", value, 0, MAX_JOINTS as u64)
}

pub(super) fn side(field: &'static str, value: u32) -> Result<(), Wrong> {
    count(field, value, 1, LONGEST_SIDE.into())
}

pub(super) fn numbers(field: &'static str, values: &[f64]) -> Result<(), Wrong> {
    match values.iter().find(|value| value.is_nan() || value.abs() > LARGEST) {
        None => Ok(()),
        Some(value) => Err(Wrong::Number { field, value: *value }),
    }
}

pub(super) fn number(field: &'static str, value: f64) -> Result<(), Wrong> {
    numbers(field, &[value])
}

/// A number, or NaN where there is nothing to measure.
pub(super) fn number_or_none(field: &'static str, value: f64) -> Result<(), Wrong> {
    if value.is_nan() { Ok(()) } else { number(field, value) }
}

pub(super) fn joints(fields: &[(&'static str, &Joints)]) -> Result<(), Wrong> {
    fields.iter().try_for_each(|(field, values)| numbers(field, *values))
}

/// 0 for the joints beyond `dof`.
pub(super) fn unused(field: &'static str, values: &Joints, dof: u32) -> Result<(), Wrong> {
    match values.iter().skip(dof as usize).find(|value| **value != 0.0) {
        None => Ok(()),
        Some(value) => Err(Wrong::Unused { field, value: *value }),
    }
}

pub(super) fn quaternion(field: &'static str, wxyz: &[f64; 4]) -> Result<(), Wrong> {
    numbers(field, wxyz)?;
    let length = wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= QUATERNION_TOLERANCE { Ok(()) } else { Err(Wrong::Quaternion { field, length }) }
}
