//! The whole way: logs, their mapping, clips, a session. Nothing is there before all of it is.

use crate::arm::{Arm, Arms, described, proposal};
use crate::cell::{self, URDF};
use crate::clip;
use crate::error::ImportError;
use crate::log::{LeftOut, Log};
use crate::mapping::{Mapping, Note, to_toml};
use crate::pieces;
use crate::propose::{Proposal, units_of};
use crate::sources::Found;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::output::{Destination, OutputFolder};
use shared_mem::recording::{Clip, read_clip, session_folder, write_clip};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Names in the session.
const CELL_TOML: &str = "cell.toml";
const IMPORT_TOML: &str = "import.toml";
/// So many logs are clips enough as they are: a diagnosis splits eight.
const ENOUGH_LOGS: usize = 9;
const PROGRAM: &str = concat!("twinalign ", env!("CARGO_PKG_VERSION"), ", import");

/// What is to be imported.
#[derive(Clone, Copy)]
pub struct Order<'a> {
    /// Logs, or folders of logs.
    pub files: &'a [PathBuf],
    /// The new session.
    pub out: &'a Path,
    /// An import.toml, which is final.
    pub mapping: Option<&'a Path>,
    /// What the laboratory knows about its cell.
    pub cell: Option<&'a Path>,
    /// Whether what is there already is replaced.
    pub force: bool,
    /// Where an import.toml with open lines goes.
    pub questions: &'a Path,
    /// Tells of the arm.
    pub arms: Arms<'a>,
    /// The command that imports with an import.toml, for its first lines: from the path of that file.
    pub command: &'a dyn Fn(&Path) -> String,
}

/// A clip that was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Imported {
    /// File in the session.
    pub file: PathBuf,
    /// The log that it was made of.
    pub source: PathBuf,
    /// That log's format.
    pub format: &'static str,
    /// Joint rows of what the arm did.
    pub measured: usize,
    /// Joint rows of what the arm was told.
    pub desired: usize,
    /// Poses of the object.
    pub poses: usize,
    /// What is there and was not imported.
    pub left_out: Vec<LeftOut>,
    /// What was odd in it.
    pub warnings: Vec<String>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    Done {
        clips: Vec<Imported>,
        /// Why the columns were taken as they were; empty where the mapping was given.
        notes: Vec<Note>,
    },
    /// An import.toml with lines that are to be filled in, and no session.
    Open {
        file: PathBuf,
        /// Its lines that are open, and why the others are as they are.
        notes: Vec<Note>,
    },
}

/// Imports logs. `told` hears of each clip as it is done, with the number of logs that are done and of all.
///
/// # Errors
/// [`ImportError`]; nothing is there then, and what was there before is unchanged.
pub fn import(order: Order<'_>, mut told: impl FnMut(&Imported, (u64, u64))) -> Result<Outcome, ImportError> {
    let mut found = Found::at(order.files)?;
    let given = order.cell.map(Cell::read).transpose()?;
    let (mapping, notes, mut first) = match order.mapping {
        Some(path) => given_mapping(path, &mut found)?,
        None => {
            let (number, logs) = found.largest()?;
            let log = longest(&logs, &found.paths()[number])?;
            let Proposal { mut mapping, mut notes } = proposal(log, given.as_ref(), order.arms)?;
            if mapping.clone().completed().open_line().is_some() {
                return open(order, log, &mapping, (notes, &found));
            }
            if found.len() + logs.len() < ENOUGH_LOGS {
                cut(log, &mut mapping, &mut notes);
            }
            (mapping, notes, Some((number, logs)))
        }
    };
    let folder = session_folder(order.out, order.force, &found.paths())?;
    let mut writing = Writing {
        folder: &folder,
        out: order.out,
        mapping: &mapping,
        given: given.as_ref(),
        arms: order.arms,
        taken: HashSet::new(),
        entries: vec![],
        about: None,
    };
    let (mut clips, all) = (Vec::new(), found.len() as u64);
    for number in 0..found.len() {
        let logs = match first.take() {
            Some((read, logs)) if read == number => Some(logs),
            other => {
                first = other;
                found.read(number)?
            }
        };
        let logs = logs.unwrap_or_default();
        for log in &logs {
            let imported = match writing.clips(log) {
                Ok(imported) => imported,
                // One episode of a data set takes none of the others along.
                Err(error) if logs.len() > 1 => {
                    found.refuse(error)?;
                    continue;
                }
                Err(error) => {
                    found.leave_out(number, error)?;
                    continue;
                }
            };
            for imported in imported {
                told(&imported, (number as u64 + 1, all));
                clips.push(imported);
            }
        }
    }
    if clips.is_empty() {
        return Err(found.refusal());
    }
    writing.finish(order, &notes)?;
    folder.finish(CELL_TOML)?;
    Ok(Outcome::Done { clips, notes: with_left_out(notes, &found) })
}

/// The notes of a mapping, and what is left out of what was found.
fn with_left_out(mut notes: Vec<Note>, found: &Found) -> Vec<Note> {
    notes.extend(found.left_out().iter().map(|why| Note {
        line: "left out".into(),
        why: why.clone(),
        ..Note::default()
    }));
    notes
}

/// The number of a place and its logs, where they were read before their turn.
type Read = Option<(usize, Vec<Log>)>;

/// A mapping that was given, with the units that no line of it names and the reasons for them; and the logs that were read for those.
fn given_mapping(path: &Path, found: &mut Found) -> Result<(Mapping, Vec<Note>, Read), ImportError> {
    let mut mapping = Mapping::read(path)?.completed();
    let (mut notes, mut read) = (Vec::new(), None);
    // What is asked before the units is still open.
    if mapping.open_line().is_some_and(|line| line.ends_with("_unit")) {
        let (number, logs) = found.largest()?;
        notes = units_of(longest(&logs, &found.paths()[number])?, &mut mapping);
        read = Some((number, logs));
    }
    match mapping.open_line() {
        Some(line) => {
            Err(ImportError::log(path, format!("`{line}` is still to be filled in; its question stands above it")))
        }
        None => Ok((mapping, notes, read)),
    }
}

pub(crate) fn longest<'a>(logs: &'a [Log], path: &Path) -> Result<&'a Log, ImportError> {
    let rows = |log: &&Log| log.tables.iter().map(crate::log::Table::rows).max();
    let log = logs.iter().filter(|log| !log.is_empty()).max_by_key(rows);
    log.ok_or_else(|| {
        let out = logs.first().map_or(&[][..], |log| &log.left_out);
        let there: Vec<String> = out.iter().take(8).map(|out| format!("`{}` ({})", out.what, out.why)).collect();
        let there = if there.is_empty() { "nothing".to_owned() } else { there.join(", ") };
        ImportError::log(path, format!("holds no numbers of a robot, but {there}; record joint states with it"))
    })
}

/// Proposes how the log is cut into clips.
fn cut(log: &Log, mapping: &mut Mapping, notes: &mut Vec<Note>) {
    let long = clip::clip(log, mapping, None).ok().as_ref().and_then(pieces::propose);
    if let Some((pieces, why)) = long {
        mapping.pieces = pieces;
        notes.push(Note { line: "pieces".into(), why, open: false, instead: vec!["pieces = \"whole\"".into()] });
    }
}

/// Writes the mapping with its open lines to where the command is typed.
fn open(
    order: Order<'_>,
    log: &Log,
    mapping: &Mapping,
    (notes, found): (Vec<Note>, &Found),
) -> Result<Outcome, ImportError> {
    let file = order.questions.to_owned();
    let command = (order.command)(&file);
    if file.is_file() && !order.force {
        return Err(ImportError::Asked { file, command });
    }
    let place = Destination::new(&file, order.force)?;
    place.write(to_toml(mapping, &notes, log, &command))?;
    let mut notes = with_left_out(notes, found);
    let odd = log.warnings.iter().map(|why| Note { line: log.name.clone(), why: why.clone(), ..Note::default() });
    notes.extend(odd);
    Ok(Outcome::Open { file, notes })
}

/// A session as it grows.
struct Writing<'a> {
    folder: &'a OutputFolder,
    /// Where the folder will be.
    out: &'a Path,
    mapping: &'a Mapping,
    given: Option<&'a Cell>,
    arms: Arms<'a>,
    taken: HashSet<String>,
    entries: Vec<ClipEntry>,
    about: Option<About>,
}

/// What the first log tells of the cell.
struct About {
    /// The text of cell.toml, without clips.
    text: String,
    cell: Cell,
    arm: Option<Arm>,
    /// The URDF that goes beside it.
    urdf: Option<String>,
    /// The log without its numbers.
    log: Log,
}

impl About {
    /// Whether the mapping's joints are as many as the arm's; a sentence where they are not.
    fn fits(&self, mapping: &Mapping) -> Result<(), String> {
        let named = self.cell.robot.as_ref().map_or(&[][..], |robot| &robot.joints);
        let joints = self.arm.as_ref().map_or(named, |arm| &arm.joints);
        if mapping.measured.is_none() || joints.is_empty() || joints.len() == mapping.joints.len() {
            return Ok(());
        }
        Err(format!(
            "gives {} joints ({}), the arm of the cell has {} ({}): give the cell of the arm that was logged, or list that arm's joints in import.toml",
            mapping.joints.len(),
            mapping.joints.join(", "),
            joints.len(),
            joints.join(", ")
        ))
    }
}

impl Writing<'_> {
    /// The clips of a log.
    fn clips(&mut self, log: &Log) -> Result<Vec<Imported>, ImportError> {
        let failed = |what: String| ImportError::log(&log.file, what);
        if self.about.is_none() {
            let about = self.about(log)?;
            if self.mapping.kind != ClipKind::Excitation && about.cell.object().is_none() {
                let what = "holds poses of an object that no cell.toml describes; give one with an `[object]` block: --cell cell.toml";
                return Err(failed(what.into()));
            }
            about.fits(self.mapping).map_err(failed)?;
            self.about = Some(about);
        }
        let gravity = self.about.as_ref().and_then(|about| about.arm.as_ref()?.gravity.as_ref());
        let clip = clip::clip(log, self.mapping, gravity).map_err(failed)?;
        let pieces = pieces::cut(clip, self.mapping.pieces);
        let count = pieces.len();
        let mut imported = Vec::new();
        for (number, piece) in pieces.into_iter().enumerate() {
            let name = if count > 1 { format!("{}_{:02}", log.name, number + 1) } else { log.name.clone() };
            imported.push(self.clip(piece, &name, log)?);
        }
        // Said once of a log.
        for later in imported.iter_mut().skip(1) {
            later.left_out.clear();
        }
        Ok(imported)
    }

    fn clip(&mut self, clip: Clip, name: &str, log: &Log) -> Result<Imported, ImportError> {
        let failed = |what: String| ImportError::log(&log.file, what);
        let file = PathBuf::from(format!("{}.mcap", self.name(name)));
        let Some(About { cell, arm, .. }) = &self.about else { return Err(failed("holds nothing".into())) };
        let output = self.folder.file(&file)?;
        let place = output.unfinished_path().to_owned();
        let robot = arm.as_ref().and_then(|arm| arm.shown.as_ref());
        write_clip(&clip, (cell, robot), PROGRAM, output)?;
        // What every command here will find in it.
        let read = read_clip(&place, self.mapping.kind, cell).map_err(|error| {
            let name = place.display().to_string();
            failed(error.to_string().replace(&format!("{name}: "), ""))
        })?;
        let mut warnings = clip.warnings;
        warnings.extend(read.warnings);
        self.entries.push(ClipEntry { file: file.clone(), kind: self.mapping.kind });
        Ok(Imported {
            file,
            source: log.file.clone(),
            format: log.format,
            measured: read.measured.len(),
            desired: read.desired.len(),
            poses: read.object.len(),
            left_out: log.left_out.clone(),
            warnings,
        })
    }

    fn about(&self, log: &Log) -> Result<About, ImportError> {
        let failed = |what: String| ImportError::log(&log.file, what);
        let log_alone = log.without_numbers();
        let Some(given) = self.given else {
            // What keeps a description from being used was said where the mapping was proposed.
            let described = described(log, &self.mapping.joints, self.arms).unwrap_or_default();
            let described = described.filter(|(_, arm)| arm.joints == self.mapping.joints);
            let shown = described.as_ref().map(|(_, arm)| arm.shown.as_ref());
            let base = shown.map(|shown| shown.map_or("base", |shown| shown.root.as_str()));
            let rotors = described.as_ref().and_then(|(_, arm)| arm.rotors.as_ref());
            let text = cell::with_rotors(cell::proposed(log, &self.mapping.joints, base), rotors);
            let cell = Cell::parse(&text, Path::new(CELL_TOML))?;
            let (urdf, arm) = match described {
                Some((urdf, arm)) => (Some(urdf), Some(arm)),
                None => (None, (self.arms)(&cell, None).map_err(failed)?),
            };
            return Ok(About { text, cell, arm, urdf, log: log_alone });
        };
        let mut cell = given.at_home_anywhere();
        cell.clips.clear();
        let text = cell.to_toml();
        // As the next command reads it, from where it will lie: a session whose robot is not found from there is none.
        let cell = Cell::parse(&text, &self.out.join(CELL_TOML))?;
        let arm = (self.arms)(&cell, None).map_err(failed)?;
        Ok(About { text, cell, arm, urdf: None, log: log_alone })
    }

    /// A name that no other clip has, of characters that every program takes.
    fn name(&mut self, name: &str) -> String {
        let plain: String =
            name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
        let plain = plain.trim_start_matches('.');
        let plain = if plain.is_empty() { "clip" } else { plain };
        let mut unique = plain.to_owned();
        let mut number = 1;
        while !self.taken.insert(unique.clone()) {
            number += 1;
            unique = format!("{plain}_{number}");
        }
        unique
    }

    fn finish(self, order: Order<'_>, notes: &[Note]) -> Result<(), ImportError> {
        let Some(About { text, urdf, log, .. }) = self.about else {
            let path = order.files.first().map_or(Path::new("."), PathBuf::as_path);
            return Err(ImportError::log(path, "holds no log"));
        };
        let text = text + &cell::clips(&self.entries);
        self.folder.write(Path::new(CELL_TOML), text.as_bytes())?;
        if let Some(urdf) = urdf {
            self.folder.write(Path::new(URDF), urdf.as_bytes())?;
        }
        let command = (order.command)(&order.out.join(IMPORT_TOML));
        let mapping = to_toml(self.mapping, notes, &log, &command);
        Ok(self.folder.write(Path::new(IMPORT_TOML), mapping.as_bytes())?)
    }
}
