//! The logs of an import: which of them is read first, and which are left out. One that lies in a folder beside others takes none of
//! them along when it cannot be read, and neither does what is no log at all; both are named.

use super::find::{self, Source};
use super::{stem, table};
use crate::error::ImportError;
use crate::log::Log;
use crate::naming;
use crate::runs;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Names in a sentence; of the others their number is said.
const MOST_NAMED: usize = 8;

/// A log, or a data set of some, that was found.
#[derive(Debug)]
struct Place {
    source: Source,
    /// It was not named, but lay in a folder that was.
    beside: bool,
    /// It is left out.
    is_out: bool,
}

/// All logs at some paths.
#[derive(Debug)]
pub(crate) struct Found {
    places: Vec<Place>,
    /// What is left out and why, a sentence each.
    left_out: Vec<String>,
    first_error: Option<ImportError>,
}

impl Found {
    /// Looks at files, folders that are one log, and folders of logs.
    pub(crate) fn at(paths: &[PathBuf]) -> Result<Self, ImportError> {
        let mut found = Self { places: Vec::new(), left_out: Vec::new(), first_error: None };
        for path in paths {
            let about = std::fs::metadata(path).map_err(|e| {
                let what = format!("cannot be read ({e}); give the path of an existing log, or of a folder of logs");
                ImportError::log(path, what)
            })?;
            if about.is_dir() {
                found.folder(path)?;
            } else {
                found.places.push(Place { source: find::file(path)?, beside: false, is_out: false });
            }
        }
        found.join_runs()?;
        Ok(found)
    }

    fn folder(&mut self, path: &Path) -> Result<(), ImportError> {
        let find::Folder { sources, others, refused } = find::folder(path)?;
        let is_one = matches!(sources.as_slice(), [only] if only.path() == path);
        for error in refused {
            self.refuse(error)?;
        }
        if sources.is_empty() && self.first_error.is_none() {
            let looked = if others.is_empty() { String::new() } else { format!(" (there are {})", list(&others)) };
            let what = format!(
                "holds no log that is known{looked}: .mcap, .db3, .bag, .csv, .tsv, .npz, a LeRobot data set or SAGE folders; \
                 what is there as HDF5 or .mat becomes .npz with numpy.savez"
            );
            return Err(ImportError::log(path, what));
        }
        if !others.is_empty() {
            self.left_out.push(format!("{}: these are no logs: {}", path.display(), list(&others)));
        }
        self.places.extend(sources.into_iter().map(|source| Place { source, beside: !is_one, is_out: false }));
        Ok(())
    }

    /// Puts tables together that may be topics of one run.
    fn join_runs(&mut self) -> Result<(), ImportError> {
        let mut runs: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
        for (number, place) in self.places.iter().enumerate() {
            if let Source::Table(path) = &place.source
                && table::may_be_echoed(&super::packed::start(path)?)
            {
                runs.entry(path.parent().unwrap_or(Path::new("")).to_owned()).or_default().push(number);
            }
        }
        for (folder, numbers) in self.states_and_commands() {
            runs.entry(folder).or_insert(numbers);
        }
        for (folder, numbers) in runs.into_iter().filter(|(_, numbers)| numbers.len() > 1) {
            let files = numbers.iter().map(|number| self.places[*number].source.path().to_owned()).collect();
            let (first, others) = numbers.split_first().map_or((0, &[][..]), |(first, others)| (*first, others));
            self.places[first].beside = numbers.iter().all(|number| self.places[*number].beside);
            self.places[first].source = Source::Run(folder, files);
            others.iter().for_each(|number| self.places[*number].is_out = true);
        }
        self.places.retain(|place| !place.is_out);
        Ok(())
    }

    /// Tables that are the states and the commands of one run by their names: `state.csv`, `command.csv`.
    fn states_and_commands(&self) -> Vec<(PathBuf, Vec<usize>)> {
        let mut runs: BTreeMap<(PathBuf, String), (Vec<usize>, Vec<usize>)> = BTreeMap::new();
        for (number, place) in self.places.iter().enumerate() {
            let Source::Table(path) = &place.source else { continue };
            let Some((is_desired, rest)) = naming::of_file(&stem(path)) else { continue };
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            let (states, commands) = runs.entry((folder, rest)).or_default();
            if is_desired { commands } else { states }.push(number);
        }
        let whole = runs.into_iter().filter(|(_, (states, commands))| states.len() == 1 && commands.len() == 1);
        whole.map(|((folder, _), (states, commands))| (folder, [states, commands].concat())).collect()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Where they are.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.places.iter().map(|place| place.source.path().to_owned()).collect()
    }

    /// Reads one of them; `None` where it is left out.
    pub(crate) fn read(&mut self, number: usize) -> Result<Option<Vec<Log>>, ImportError> {
        let Some(place) = self.places.get(number).filter(|place| !place.is_out) else { return Ok(None) };
        let read = place.source.read().map(runs::apart).and_then(|logs| {
            let is_empty = place.beside && logs.iter().all(Log::is_empty);
            if is_empty { Err(ImportError::log(place.source.path(), "holds no numbers of a robot")) } else { Ok(logs) }
        });
        match read {
            Ok(logs) => Ok(Some(logs)),
            Err(error) => {
                self.leave_out(number, error)?;
                Ok(None)
            }
        }
    }

    /// The one whose numbers tell most, and its logs: that with most bytes, texts after the others.
    pub(crate) fn largest(&mut self) -> Result<(usize, Vec<Log>), ImportError> {
        let mut order = Vec::new();
        for (number, place) in self.places.iter().enumerate() {
            order.push((place.source.is_text(), std::cmp::Reverse(place.source.bytes()?), number));
        }
        order.sort();
        for (_, _, number) in order {
            if let Some(logs) = self.read(number)? {
                return Ok((number, logs));
            }
        }
        Err(self.refusal())
    }

    /// Leaves one out; where it was named itself, the error is that of the import.
    pub(crate) fn leave_out(&mut self, number: usize, error: ImportError) -> Result<(), ImportError> {
        match self.places.get_mut(number).filter(|place| place.beside) {
            Some(place) => place.is_out = true,
            None => return Err(error),
        }
        self.refuse(error)
    }

    /// Keeps an error as what is left out.
    pub(crate) fn refuse(&mut self, error: ImportError) -> Result<(), ImportError> {
        let error = error.about_a_log()?;
        self.left_out.push(error.to_string());
        self.first_error.get_or_insert(error);
        Ok(())
    }

    /// What is left out and why, a sentence each.
    pub(crate) fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// Why nothing is imported at all.
    pub(crate) fn refusal(&mut self) -> ImportError {
        let error = self.first_error.take();
        error.unwrap_or_else(|| ImportError::log(Path::new("."), "holds no log"))
    }
}

/// Names of files; of many of one kind, and of many kinds, their number.
fn list(paths: &[PathBuf]) -> String {
    let mut kinds: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in paths {
        let kind = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        kinds.entry(kind).or_default().push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
    }
    let words = |(kind, names): (String, Vec<String>)| match names.as_slice() {
        [_, _, _, ..] if !kind.is_empty() => vec![format!("{} files .{kind}", names.len())],
        _ => names,
    };
    let words: Vec<String> = kinds.into_iter().flat_map(words).collect();
    let more = words.len().saturating_sub(MOST_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    words.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ") + &more
}
