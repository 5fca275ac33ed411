//! A unit: a command line of this program, and what its result depends on as one number.

use super::SweepError;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use shared_mem::command_line;
use shared_mem::input;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
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
    /// All units.
    pub const WHOLE: Self = Self { k: 1, n: 1 };

    /// Whether a unit belongs to it.
    #[must_use]
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
    let text = input::text(&file, input::Kind::List)?;
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

/// Hashes of the files and folders that commands name; each is read once.
#[derive(Debug, Default)]
pub(super) struct Inputs(BTreeMap<String, Option<String>>);

impl Inputs {
    /// The hash of a command.
    pub(super) fn hash(&mut self, command: &[String]) -> Result<String, SweepError> {
        let mut hasher = Sha256::new();
        hasher.update(command_line::fingerprint());
        for word in command {
            hasher.update((word.len() as u64).to_le_bytes());
            hasher.update(word);
            // Worlds of an evaluation stand in one word.
            for part in word.split([',', '=']) {
                if let Some(content) = self.content(part)? {
                    hasher.update(content);
                }
            }
        }
        Ok(hex(&hasher.finalize()))
    }

    /// The hash of a file or folder; `None` where a word names none.
    fn content(&mut self, word: &str) -> Result<Option<String>, SweepError> {
        if let Some(known) = self.0.get(word) {
            return Ok(known.clone());
        }
        let path = Path::new(word);
        let found = if word.is_empty() || !path.exists() { None } else { Some(tree(path)?) };
        self.0.insert(word.to_owned(), found.clone());
        Ok(found)
    }
}

/// The hash of a file, or of all files of a folder with their names.
fn tree(path: &Path) -> Result<String, SweepError> {
    let mut hasher = Sha256::new();
    if path.is_dir() {
        let unreadable = |error: std::io::Error| SweepError::Content {
            file: path.to_owned(),
            what: format!("the folder cannot be read ({error}); see that it may be"),
        };
        let entries = std::fs::read_dir(path).map_err(unreadable)?;
        let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        inside.sort();
        for entry in inside {
            hasher.update(entry.file_name().unwrap_or_default().as_encoded_bytes());
            hasher.update(tree(&entry)?);
        }
    } else if path.is_file() {
        hasher.update(input::bytes(path, input::Kind::Splats)?);
    }
    Ok(hex(&hasher.finalize()))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
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

    #[test]
    fn a_hash_is_that_of_the_command_and_of_what_it_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("task.toml");
        std::fs::write(&file, "one").expect("room");
        let command = |word: &str| vec!["evaluate".to_owned(), word.to_owned()];
        let of = |word: &str| Inputs::default().hash(&command(word)).expect("a hash");
        let (named, listed) = (file.display().to_string(), format!("twin,{}", file.display()));
        let (before, in_list, of_folder) = (of(&named), of(&listed), of(&folder.path().display().to_string()));
        assert_eq!(before, of(&named));
        std::fs::write(&file, "two").expect("room");
        assert!(
            before != of(&named) && in_list != of(&listed) && of_folder != of(&folder.path().display().to_string())
        );
        assert_ne!(of("ab"), Inputs::default().hash(&["evaluatea".to_owned(), "b".to_owned()]).expect("a hash"));
    }
}
