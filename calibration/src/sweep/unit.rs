//! A unit: a command line of this program, its place in the sweep, and the slices that units are parted into.

use super::SweepError;
use serde::{Deserialize, Serialize};
use shared_mem::input::{self, InputError};
use std::io::ErrorKind;
use std::path::Path;
use std::str::FromStr;

/// A word of a command that stands for a folder of the unit's own.
pub(super) const OUT: &str = "{out}";
pub(super) const UNITS: &str = "units.jsonl";

/// One line of `units.jsonl`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unit {
    /// Its place in the sweep, from 0.
    pub unit: usize,
    /// Of its command, of all files that the command names, and of the program's version.
    pub hash: String,
    /// What stands in place of `{seed}`, where the command has one.
    pub seed: Option<String>,
    /// The words behind `calibration`.
    pub command: Vec<String>,
}

/// Every n-th unit from the k-th on, both from 1: `3/8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slice {
    k: usize,
    n: usize,
}

impl Slice {
    pub const WHOLE: Self = Self { k: 1, n: 1 };

    /// Whether a unit belongs to it.
    pub fn holds(self, unit: &Unit) -> bool {
        unit.unit % self.n == self.k - 1
    }
}

impl FromStr for Slice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let both = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match both {
            Some((k, n)) if (1..=n).contains(&k) => Ok(Self { k, n }),
            _ => Err("give K/N with K from 1 to N, as 3/8".to_owned()),
        }
    }
}

/// The units of a sweep, in their order.
///
/// # Errors
/// [`SweepError`] when there is no plan, or it is damaged.
pub fn read(sweep: &Path) -> Result<Vec<Unit>, SweepError> {
    let file = sweep.join(UNITS);
    let text = input::text(&file, input::Kind::List).map_err(|error| match error {
        InputError::Io { source, .. } if source.kind() == ErrorKind::NotFound => SweepError::Content {
            file: sweep.to_owned(),
            what: "no sweep is planned there; plan one with `calibration sweep plan COMMANDS --out FOLDER`".to_owned(),
        },
        other => other.into(),
    })?;
    let content = |what: String| SweepError::Content { file: file.clone(), what };
    let mut units: Vec<Unit> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let unit: Unit = serde_json::from_str(line)
            .map_err(|error| content(format!("line {} is no unit ({error}); plan the sweep again", i + 1)))?;
        let is_hash = unit.hash.len() == 64 && unit.hash.bytes().all(|c| c.is_ascii_hexdigit());
        if unit.unit != i || !is_hash {
            return Err(content(format!("line {} is unit {} or has no hash; plan the sweep again", i + 1, unit.unit)));
        }
        units.push(unit);
    }
    if units.is_empty() { Err(content("it holds no units; plan the sweep again".to_owned())) } else { Ok(units) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_take_every_unit_once() {
        let unit = |unit: usize| Unit { unit, hash: String::new(), seed: None, command: Vec::new() };
        for n in [1, 2, 7] {
            for number in 0..20 {
                let slices = (1..=n).map(|k| format!("{k}/{n}").parse::<Slice>().expect("a slice"));
                assert_eq!(slices.filter(|slice| slice.holds(&unit(number))).count(), 1, "{number} of {n}");
            }
        }
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0", ""] {
            assert!(wrong.parse::<Slice>().is_err(), "{wrong}");
        }
    }
}
