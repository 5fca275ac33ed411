//! The file of a unit's result: what it answered, and a checksum by which it is seen that this is still what it answered.

use super::SweepError;
use super::inputs::hex;
use super::unit::Unit;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use shared_mem::input;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The result of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Stored {
    pub(super) hash: String,
    pub(super) command: Vec<String>,
    /// How long it took [s]; no part of what is merged.
    pub(super) seconds: f64,
    /// The JSON object that it printed.
    pub(super) answer: Value,
    /// Tables and lists that it wrote to its own folder, by name.
    pub(super) files: BTreeMap<String, String>,
}

/// Where the result of a unit is.
pub(super) fn result_of(sweep: &Path, unit: &Unit) -> PathBuf {
    sweep.join("results").join(format!("{}.json", unit.hash))
}

/// What stands before the checksum, and between it and that of which it is one. Numbers would not be read to the last bit as they were
/// written: the checksum is that of the text.
const AROUND: [&str; 2] = ["{\"sha256\":\"", "\","];

impl Stored {
    /// The file's text: a JSON object whose first key is the checksum of all that follows.
    pub(super) fn text(&self) -> String {
        let object = serde_json::to_string(self).unwrap_or_default();
        let rest = object.strip_prefix('{').unwrap_or_default();
        let [before, between] = AROUND;
        format!("{before}{}{between}{rest}", checksum(rest))
    }

    /// The result of a unit.
    ///
    /// # Errors
    /// [`SweepError`] for a file that is none, was changed after it was written, or belongs to another question.
    pub(super) fn read(sweep: &Path, unit: &Unit) -> Result<Self, SweepError> {
        let file = result_of(sweep, unit);
        let text = input::text(&file, input::Kind::List)?;
        let content = |what: &str| SweepError::Content { file: file.clone(), what: what.to_owned() };
        let [before, between] = AROUND;
        let parts = text.strip_prefix(before).and_then(|text| text.split_once(between));
        let Some((sum, rest)) = parts else {
            return Err(content("it is no result with a checksum; remove it and run its unit again"));
        };
        if sum != checksum(rest) {
            return Err(content("it was changed after it was written; remove it and run its unit again"));
        }
        let stored: Self = serde_json::from_str(&format!("{{{rest}"))
            .map_err(|_| content("it is no result; remove it and run its unit again"))?;
        if stored.hash != unit.hash || stored.command != unit.command {
            return Err(content("it is the result of another question; remove it and run its unit again"));
        }
        Ok(stored)
    }
}

fn checksum(text: &str) -> String {
    hex(&Sha256::digest(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_result_that_was_changed_anywhere_is_refused_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let command = vec!["evaluate".to_owned(), "--json".to_owned()];
        let unit = Unit { unit: 0, hash: "ab".repeat(32), seed: None, command: command.clone() };
        let stored = Stored {
            hash: unit.hash.clone(),
            command,
            seconds: 0.1 + 0.2,
            answer: json!({ "success": 0.123_456_789_012_345_67, "words": "it's \"so\"\n" }),
            files: BTreeMap::from([("trials.csv".to_owned(), "a,b\n1,2\n".to_owned())]),
        };
        let file = result_of(folder.path(), &unit);
        std::fs::create_dir(folder.path().join("results")).expect("room");
        let text = stored.text();
        assert!(serde_json::from_str::<Value>(&text).expect("JSON")["answer"]["success"].is_number());
        std::fs::write(&file, &text).expect("room");
        assert_eq!(Stored::read(folder.path(), &unit).expect("a result"), stored);
        for place in 0..text.len() {
            for bit in 0..8 {
                let mut bytes = text.clone().into_bytes();
                bytes[place] ^= 1 << bit;
                std::fs::write(&file, &bytes).expect("room");
                let said = Stored::read(folder.path(), &unit).expect_err("a changed result").to_string();
                assert!(said.contains(file.to_str().expect("UTF-8")) && said.lines().count() == 1, "{said}");
            }
        }
        std::fs::write(&file, &text).expect("room");
        let other = Unit { command: vec!["evaluate".to_owned()], ..unit };
        let said = Stored::read(folder.path(), &other).expect_err("another question").to_string();
        assert!(said.contains("another question"), "{said}");
    }
}
