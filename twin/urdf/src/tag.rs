//! The attributes of one tag: names and numbers, with errors that quote what stood there.

use crate::{Pose, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};
use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;

/// Bytes of a name. Files name links in tens of bytes; an error line that quotes one stays a line.
const LONGEST_NAME: usize = 255;

/// A tag that matters, with its attributes.
pub(crate) struct Tag<'a> {
    name: &'a str,
    attributes: Vec<(&'a str, String)>,
}

impl<'a> Tag<'a> {
    pub(crate) fn new(start: &'a BytesStart<'_>, name: &'a str) -> Result<Self, String> {
        let mut attributes = Vec::new();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|error| format!("<{name}>: {}", one_line(&error)))?;
            let key = attribute.key.0;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|error| format!("`{}` of <{name}>: {}", quoted(key), one_line(&error)))?;
            attributes.push((key, value.into_owned()));
        }
        Ok(Self { name, attributes })
    }

    /// Of its element.
    pub(crate) fn name(&self) -> &str {
        self.name
    }

    pub(crate) fn find(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(k, _)| *k == key).map(|(_, value)| value.as_str())
    }

    pub(crate) fn needed(&self, key: &str) -> Result<&str, String> {
        self.find(key).ok_or_else(|| format!("<{}> has no `{key}`", self.name))
    }

    /// A name of a link or a joint: printed in messages, so it is one short line.
    pub(crate) fn label(&self, key: &str) -> Result<String, String> {
        let value = self.needed(key)?;
        if value.len() > LONGEST_NAME || value.chars().any(char::is_control) {
            return Err(format!(
                "`{key}` of <{}> is longer than {LONGEST_NAME} bytes or holds control characters: {}",
                self.name,
                quoted(value)
            ));
        }
        Ok(value.to_owned())
    }

    /// One number; infinite where the file says so.
    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>, String> {
        let Some(value) = self.find(key) else { return Ok(None) };
        match value.trim().parse::<f64>() {
            Ok(number) if !number.is_nan() => Ok(Some(number)),
            _ => Err(format!("`{key}` of <{}> is no number: `{}`", self.name, quoted(value))),
        }
    }

    pub(crate) fn needed_number(&self, key: &str) -> Result<f64, String> {
        self.needed(key)?;
        match self.number(key)? {
            Some(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{key}` of <{}> is infinite", self.name)),
        }
    }

    /// Finite numbers between spaces.
    fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, String> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let mut numbers = [0.0; N];
        let mut words = value.split_whitespace();
        let all = numbers.iter_mut().all(|number| match words.next().map(str::parse::<f64>) {
            Some(Ok(read)) if read.is_finite() => {
                *number = read;
                true
            }
            _ => false,
        });
        if all && words.next().is_none() {
            Ok(Some(numbers))
        } else {
            Err(format!("`{key}` of <{}> must be {N} numbers: `{}`", self.name, quoted(value)))
        }
    }

    pub(crate) fn needed_vector(&self, key: &str) -> Result<Vec3, String> {
        self.needed(key)?;
        Ok(self.numbers(key)?.map(Vec3).unwrap_or_default())
    }

    /// An <origin>. `quat_xyzw` counts from version 1.1 on, as in urdfdom, and not beside `rpy`.
    pub(crate) fn pose(&self, quaternions: bool) -> Result<Pose, String> {
        let xyz = self.numbers("xyz")?.map(Vec3).unwrap_or_default();
        let rpy = self.numbers("rpy")?;
        let quaternion = if quaternions { self.numbers::<4>("quat_xyzw")? } else { None };
        let rpy = match (rpy, quaternion) {
            (Some(_), Some(_)) => return Err(format!("<{}> has both `rpy` and `quat_xyzw`; give one", self.name)),
            (rpy, None) => rpy.unwrap_or_default(),
            (None, Some([x, y, z, w])) => {
                let unit = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9)
                    .ok_or_else(|| format!("`quat_xyzw` of <{}> has length 0", self.name))?;
                let (roll, pitch, yaw) = unit.euler_angles();
                [roll, pitch, yaw]
            }
        };
        Ok(Pose { xyz, rpy: Vec3(rpy) })
    }
}

/// The beginning of a value from the file, on one line.
pub(crate) fn quoted(value: &str) -> String {
    value.chars().take(40).flat_map(char::escape_debug).collect()
}

/// What the XML reader says, on one line: it quotes the file as it stands, and as much of it as there is.
pub(crate) fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().chars().take(200).flat_map(|c| if c == '\n' { ' ' } else { c }.escape_debug()).collect()
}
