//! Reading a TOML file into a typed structure, with errors a person can act on: file, line, the key, the nearest known name.
//! And bringing one up to date that a person wrote: with comments and all that the update says nothing about.

use crate::input::{self, InputError};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use toml_edit::{ArrayOfTables, DocumentMut, Item, TableLike};

/// A TOML file could not be used.
#[derive(Debug, thiserror::Error)]
pub enum TomlFileError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The text is no TOML, or a key or value is not what is expected.
    #[error("{}{}: {what}", path.display(), line.map_or(String::new(), |l| format!(":{l}")))]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: Option<usize>,
        /// What is wrong and how to mend it.
        what: String,
    },
}

/// Reads `path` and interprets it as `T`. Unknown keys are refused when `T` denies them.
///
/// # Errors
/// [`TomlFileError`] when the file cannot be read or does not fit `T`.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, TomlFileError> {
    parse(&input::text(path, input::Kind::Configuration)?, path)
}

/// Interprets `text` as `T`; `path` only names it in errors.
///
/// # Errors
/// [`TomlFileError::Content`] when the text does not fit `T`.
pub fn parse<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T, TomlFileError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        TomlFileError::Content { path: path.to_owned(), line, what: with_nearest_name(error.message()) }
    })
}

/// Refuses a list of which a part was passed over: of one that has a length of its own, as a place in the plane, nothing is read
/// behind its end. `read` is what was made of `text`; zeros at the end are no loss.
///
/// # Errors
/// [`TomlFileError::Content`] with the key.
pub fn refuse_longer_lists<T: Serialize>(text: &str, read: &T, path: &Path) -> Result<(), TomlFileError> {
    let (Ok(given), Ok(kept)) = (text.parse::<toml::Table>(), toml::Table::try_from(read)) else { return Ok(()) };
    match longer(&toml::Value::Table(given), &toml::Value::Table(kept), String::new()) {
        Some(what) => Err(TomlFileError::Content { path: path.to_owned(), line: None, what }),
        None => Ok(()),
    }
}

fn longer(given: &toml::Value, kept: &toml::Value, key: String) -> Option<String> {
    use toml::Value::{Array, Float, Integer, Table};
    match (given, kept) {
        (Table(given), Table(kept)) => given.iter().find_map(|(name, value)| {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            longer(value, kept.get(name)?, key)
        }),
        (Array(given), Array(kept)) => {
            let is_zero = |value: &toml::Value| matches!(value, Integer(0)) || matches!(value, Float(v) if *v == 0.0);
            if given.iter().skip(kept.len()).any(|value| !is_zero(value)) {
                return Some(format!("`{key}` has {} values, and {} belong there", given.len(), kept.len()));
            }
            given.iter().zip(kept).find_map(|(given, kept)| longer(given, kept, key.clone()))
        }
        _ => None,
    }
}

/// The text `before` with the values of `update`; everything else of it stays, blocks of other names too, but for the arrays of
/// blocks in `whole`, which hold what `update` has of them and nothing else. `None` where one of the two is no TOML.
pub fn updated(before: &str, update: &str, whole: &[&str]) -> Option<String> {
    let mut document: DocumentMut = before.parse().ok()?;
    let update: DocumentMut = update.parse().ok()?;
    for name in whole {
        if !update.contains_key(name) {
            document.remove(name);
        }
    }
    update_table(document.as_table_mut(), update.as_table(), whole);
    Some(document.to_string())
}

fn update_table(before: &mut dyn TableLike, update: &dyn TableLike, whole: &[&str]) {
    for (key, new) in update.iter() {
        match (before.get_mut(key), new) {
            (Some(Item::Value(old)), Item::Value(new)) if !(old.is_inline_table() && new.is_inline_table()) => {
                // The comment behind a value belongs to its line.
                let decor = old.decor().clone();
                *old = new.clone();
                *old.decor_mut() = decor;
            }
            (Some(Item::ArrayOfTables(old)), Item::ArrayOfTables(new)) => {
                *old = update_blocks(old, new, !whole.contains(&key));
            }
            (Some(old), new) => match (old.as_table_like_mut(), new.as_table_like()) {
                (Some(old), Some(new)) => update_table(old, new, &[]),
                _ => *old = new.clone(),
            },
            (None, new) => drop(before.insert(key, new.clone())),
        }
    }
}

/// The blocks of `update`, each in the place of the one of the same name, and with `others` those of other names.
fn update_blocks(before: &ArrayOfTables, update: &ArrayOfTables, others: bool) -> ArrayOfTables {
    let name = |table: &toml_edit::Table| table.get("name").and_then(Item::as_str).map(str::to_owned);
    let one = |new: &toml_edit::Table| match before.iter().find(|old| name(old).is_some() && name(old) == name(new)) {
        Some(old) => {
            let mut block = old.clone();
            update_table(&mut block, new, &[]);
            block
        }
        None => new.clone(),
    };
    let is_other = |old: &&toml_edit::Table| name(old).is_some() && update.iter().all(|new| name(new) != name(old));
    let kept = before.iter().filter(|old| others && is_other(old)).cloned();
    kept.chain(update.iter().map(one)).collect()
}

/// Turns serde's words about types and lengths into those of a file.
fn plainly(message: &str) -> String {
    let message = message.replace('\n', " ");
    let split =
        |rest: &str| rest.split_once(", expected ").map(|(found, wanted)| (found.to_owned(), wanted.to_owned()));
    if let Some((found, wanted)) = message.strip_prefix("invalid length ").and_then(split) {
        let number = wanted.split(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty());
        return match number {
            Some(number) => format!("{found} values stand there; expected {number}"),
            None => format!("{found} values stand there; expected {wanted}"),
        };
    }
    let rest = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "));
    if let Some((found, wanted)) = rest.and_then(split) {
        return format!("{} stands there; expected {}", found_in_words(&found), wanted_in_words(&wanted));
    }
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("the key {key} is missing");
    }
    if let Some((found, wanted)) = message.strip_prefix("unknown variant ").and_then(split) {
        return format!("{found} is none of the known words; expected {}", wanted.trim_start_matches("one of "));
    }
    message
}

fn found_in_words(found: &str) -> String {
    let kinds = ["string ", "integer ", "floating point ", "boolean "];
    let value = kinds.iter().find_map(|kind| found.strip_prefix(kind));
    value.map_or_else(
        || match found {
            "map" => "a table".to_owned(),
            "sequence" => "a list".to_owned(),
            other => other.to_owned(),
        },
        |value| value.trim_matches('`').to_owned(),
    )
}

fn wanted_in_words(wanted: &str) -> &str {
    match wanted {
        "f64" | "f32" => "a number",
        "a string" => "text in quotes",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        _ if wanted.starts_with(['u', 'i']) && wanted[1..].parse::<u8>().is_ok() || wanted == "usize" => {
            "a whole number"
        }
        _ if wanted.starts_with("an array of length ") => wanted.trim_start_matches("an array of length "),
        _ => wanted,
    }
}

/// Turns serde's "unknown field `x`, expected one of `a`, `b`" into advice.
fn with_nearest_name(message: &str) -> String {
    let Some(rest) = message.strip_prefix("unknown field ") else {
        return plainly(message);
    };
    let mut names = rest.split('`').skip(1).step_by(2);
    let unknown = names.next().unwrap_or("");
    let known: Vec<&str> = names.collect();
    let nearest =
        known.iter().max_by(|a, b| strsim::jaro_winkler(unknown, a).total_cmp(&strsim::jaro_winkler(unknown, b)));
    match nearest {
        Some(name) if strsim::jaro_winkler(unknown, name) > 0.7 => {
            format!("unknown key `{unknown}`; did you mean `{name}`?")
        }
        _ => format!("unknown key `{unknown}`; known here: {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Cell;
    use crate::theta::Theta;
    use proptest::prelude::*;

    const CELL: &str = include_str!("../../config/fr3_cell.toml");
    const THETA: &str = "[arm]\nstiffness = [600.0, 50.0]\ndamping = [50.0, 5.0]\n[object]\nfriction = 0.3\n\
        [[effect]]\nname = \"payload\"\nmass = 0.5\n";

    proptest! {
        #[test]
        fn a_changed_file_is_refused_or_reads_back_from_what_is_written_of_it(
            changes in proptest::collection::vec(
                (any::<prop::sample::Index>(), 0_usize..30, "[=\\[\\]{}\"'.,a-z0-9_\n\\\\ -]{0,6}"), 1..4
            ),
        ) {
            let changed = |text: &str| {
                let mut bytes = text.as_bytes().to_vec();
                for (at, length, new) in &changes {
                    let at = at.index(bytes.len());
                    let end = (at + length).min(bytes.len());
                    bytes.splice(at..end, new.bytes());
                    if bytes.is_empty() {
                        break;
                    }
                }
                String::from_utf8_lossy(&bytes).into_owned()
            };
            let path = Path::new("a.toml");
            match Cell::parse(&changed(CELL), path) {
                Ok(cell) => prop_assert_eq!(Cell::parse(&cell.to_toml(), path).expect("own text").to_toml(), cell.to_toml()),
                Err(error) => prop_assert!(error.to_string().starts_with("a.toml"), "{}", error),
            }
            match parse::<Theta>(&changed(THETA), path) {
                Ok(theta) => {
                    prop_assert_eq!(parse::<Theta>(&theta.to_toml(), path).expect("own text").to_toml(), theta.to_toml());
                }
                Err(error) => prop_assert!(error.to_string().starts_with("a.toml"), "{}", error),
            }
        }
    }

    #[test]
    fn no_word_of_a_library_is_left_in_what_is_wrong_with_a_value() {
        for (text, said) in [
            (
                "[simulation]\nobject_position = [0.1, 0.2, 0.3]\n",
                "`simulation.object_position` has 3 values, and 2 belong there",
            ),
            ("[table]\nheight = \"low\"\n", "\"low\" stands there; expected a number"),
            ("[tool]\nmass = 0.2\nlength = 0.1\n", "the key `radius` is missing"),
            ("[controller]\nkind = \"pd\"\n", "`pd` is none of the known words; expected `joint_impedance`"),
            ("[camera]\nwidth = 1.5\n", "1.5 stands there; expected a whole number"),
            ("[topics]\nmeasured = 5\n", "5 stands there; expected text in quotes"),
        ] {
            let error = Cell::parse(text, Path::new("cell.toml")).expect_err(said).to_string();
            assert!(error.contains(said), "{error}");
            assert!(
                ["invalid", "variant", "field", "f64", "u32", "usize", "sequence"].iter().all(|w| !error.contains(w)),
                "{error}"
            );
        }
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        #[allow(dead_code)]
        stiffness: f64,
    }

    #[test]
    fn a_misspelt_key_names_the_nearest_known_one_and_its_line() {
        let error = parse::<Sample>("\nstifness = 1.0\n", Path::new("cell.toml")).unwrap_err().to_string();
        assert_eq!(error, "cell.toml:2: unknown key `stifness`; did you mean `stiffness`?");
    }

    #[test]
    fn a_missing_key_is_named() {
        let error = parse::<Sample>("", Path::new("cell.toml")).unwrap_err().to_string();
        assert!(error.contains("the key `stiffness` is missing"), "{error}");
    }
}
