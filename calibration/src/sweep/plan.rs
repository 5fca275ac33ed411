//! Units out of commands with placeholders: one for each combination of their values.

use super::SweepError;
use super::inputs::Inputs;
use super::unit::{OUT, UNITS, Unit};
use inference::interrupt::Interrupt;
use shared_mem::output::OutputFolder;
use std::collections::BTreeSet;
use std::path::Path;
use std::str::FromStr;

/// Most units of a sweep.
const MOST: usize = 1_000_000;

/// A placeholder and its values: `seed=0..200`, `noise=0,0.003,0.01`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Each {
    name: String,
    values: Vec<String>,
}

impl Each {
    /// As it stands in a command.
    fn mark(&self) -> String {
        format!("{{{}}}", self.name)
    }
}

impl FromStr for Each {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "give NAME=A,B,C or NAME=FROM..BEFORE, as seed=0..200".to_owned();
        let (name, values) = text.split_once('=').ok_or_else(wrong)?;
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(is_name) || name == "out" {
            return Err(wrong());
        }
        let values: Vec<String> = match values.split_once("..") {
            Some((from, before)) => {
                let [from, before] = [from, before].map(str::parse::<u64>);
                let (from, before) = (from.map_err(|_| wrong())?, before.map_err(|_| wrong())?);
                if before.saturating_sub(from) > MOST as u64 {
                    return Err(format!("{text} are more than {MOST} values"));
                }
                (from..before).map(|value| value.to_string()).collect()
            }
            None => values.split(',').map(str::to_owned).collect(),
        };
        if values.is_empty() || values.iter().any(String::is_empty) {
            Err(wrong())
        } else {
            Ok(Self { name: name.to_owned(), values })
        }
    }
}

/// The commands of a text, one a line without the program's name, as words: parted by blanks, but for those between `'`. Empty lines and
/// what stands behind a `#` at a line's beginning do not count.
///
/// # Errors
/// [`SweepError::Asked`] with the line that has a `'` without another, and for a text without commands.
pub fn commands(text: &str) -> Result<Vec<Vec<String>>, SweepError> {
    let mut commands = Vec::new();
    for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with('#')) {
        if line.matches('\'').count() % 2 == 1 {
            return Err(SweepError::Asked(format!("line {} of the commands has a ' that nothing closes", i + 1)));
        }
        let (mut words, mut open) = (Vec::new(), None::<String>);
        for (part, text) in line.split('\'').enumerate() {
            if part % 2 == 1 {
                open.get_or_insert_default().push_str(text);
                continue;
            }
            for c in text.chars() {
                if c.is_whitespace() {
                    words.extend(open.take());
                } else {
                    open.get_or_insert_default().push(c);
                }
            }
        }
        words.extend(open);
        if !words.is_empty() {
            commands.push(words);
        }
    }
    if commands.is_empty() {
        let what = "there are no commands; give one a line, as `evaluate --policies expert --seed {seed} --out {out}`";
        return Err(SweepError::Asked(what.to_owned()));
    }
    Ok(commands)
}

/// A unit for each command and each combination of the values of its placeholders, the last one's fastest.
///
/// # Errors
/// [`SweepError::Asked`] for a placeholder that has no values, or values without a placeholder; for what a command names and cannot be
/// read; [`SweepError::Interrupted`].
pub fn plan(commands: &[Vec<String>], each: &[Each], interrupt: &Interrupt) -> Result<Vec<Unit>, SweepError> {
    let asked = |what: String| Err(SweepError::Asked(what));
    let uses = |command: &[String], each: &Each| command.iter().any(|word| word.contains(&each.mark()));
    if let Some(unused) = each.iter().find(|each| !commands.iter().any(|command| uses(command, each))) {
        return asked(format!("no command has {}; put it where its values go", unused.mark()));
    }
    let mut inputs = Inputs::default();
    let (mut units, mut hashes) = (Vec::new(), BTreeSet::new());
    for command in commands {
        if let Some(first) = command.first().filter(|verb| ["sweep", "capture", "demo"].contains(&verb.as_str())) {
            let what = "is no unit; give a command that ends with one JSON object, as evaluate or identify";
            return asked(format!("`{first}` {what}"));
        }
        let own: Vec<&Each> = each.iter().filter(|each| uses(command, each)).collect();
        let count = own.iter().try_fold(1_usize, |count, each| count.checked_mul(each.values.len()));
        let Some(count) = count.filter(|count| units.len().saturating_add(*count) <= MOST) else {
            return asked(format!("these are more than {MOST} units"));
        };
        for number in 0..count {
            let (words, seed) = filled(command, &own, number);
            if let Some(word) = words.iter().find(|word| word.replace(OUT, "").contains('{')) {
                return asked(format!("`{word}` has a placeholder without values; give --each NAME=VALUES"));
            }
            let hash = inputs.hash(&words, interrupt)?;
            if !hashes.insert(hash.clone()) {
                return asked(format!("two units are the same: {}; give each value once", words.join(" ")));
            }
            units.push(Unit { unit: units.len(), hash, seed, command: words });
        }
    }
    Ok(units)
}

/// A command with the values of a combination, and what stands for its seed.
fn filled(command: &[String], each: &[&Each], number: usize) -> (Vec<String>, Option<String>) {
    let (mut left, mut seed, mut words) = (number, None, command.to_vec());
    for each in each.iter().rev() {
        let value = &each.values[left % each.values.len()];
        left /= each.values.len();
        words.iter_mut().for_each(|word| *word = word.replace(&each.mark(), value));
        if each.name == "seed" {
            seed = Some(value.clone());
        }
    }
    if !words.iter().any(|word| word == "--json") {
        words.push("--json".to_owned());
    }
    (words, seed)
}

/// Writes the folder of a sweep.
///
/// # Errors
/// [`SweepError::Output`]; nothing is there then.
pub fn write(units: &[Unit], folder: OutputFolder) -> Result<(), SweepError> {
    let mut text = String::new();
    for unit in units {
        text += &serde_json::to_string(unit).unwrap_or_default();
        text.push('\n');
    }
    folder.write(Path::new(UNITS), text.as_bytes())?;
    // The folder of results is there from the beginning: many processes write into it.
    folder
        .write(Path::new("results/README"), b"One file a unit, by its hash; `calibration sweep merge` reads them.\n")?;
    Ok(folder.finish(UNITS)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn each(text: &str) -> Each {
        text.parse().expect("values")
    }

    fn planned(text: &str, values: &[&str]) -> Result<Vec<Unit>, SweepError> {
        plan(&commands(text)?, &values.iter().map(|text| each(text)).collect::<Vec<_>>(), &Interrupt::default())
    }

    #[test]
    fn each_combination_is_a_unit_with_a_hash_of_its_own() {
        let text = "# two worlds\nevaluate --policies expert:noise={noise} --seed {seed} --out {out}\n\nidentify arm 'my session'/a --seed {seed}\n";
        let units = planned(text, &["noise=0,0.01", "seed=3..6"]).expect("units");
        assert_eq!(units.len(), 9);
        let words: Vec<&str> = "evaluate --policies expert:noise=0 --seed 4 --out {out} --json".split(' ').collect();
        assert_eq!(units[1].command, words);
        assert_eq!((units[3].unit, units[3].seed.as_deref()), (3, Some("3")));
        assert!(units[3].command.contains(&"expert:noise=0.01".to_owned()));
        assert_eq!(units[8].command[2..5], ["my session/a", "--seed", "5"]);
    }

    #[test]
    fn what_makes_no_units_is_refused_with_the_way_out() {
        for (text, values, words) in [
            ("evaluate --seed 1", vec!["seed=0..3"], "has {seed}"),
            ("evaluate --seed {seed}", vec![], "--each NAME=VALUES"),
            ("evaluate --seed {seed}", vec!["seed=1,1"], "the same"),
            ("sweep plan", vec![], "is no unit"),
            ("# nothing\n\n", vec![], "no commands"),
            ("evaluate 'a b", vec![], "line 1"),
        ] {
            let error = planned(text, &values).expect_err(text).to_string();
            assert!(error.contains(words), "{error}");
        }
        for wrong in ["seed", "seed=", "=1", "seed=3..3", "out=1", "seed=1,,2", "seed=a..b"] {
            assert!(wrong.parse::<Each>().is_err(), "{wrong}");
        }
    }
}
