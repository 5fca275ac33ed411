//! A mapping, proposed from a log: from the names of its columns, from what its format says, and from its numbers. Every
//! choice comes with its reason; what cannot be known stays open.
//!
//! | file | owns |
//! |---|---|
//! | `columns` | which columns are which quantity |
//! | `candidates` | groups of columns that may be a quantity of joints |
//! | `shape` | what columns of numbers are by themselves: one number over and over, sines, a quaternion |
//! | `follow` | what two groups say about each other: slopes, and joints that go where commands say |
//! | `judged` | groups of positions with what speaks for them |
//! | `measured`, `commands` | which of them is what the arm did, and what it was told |
//! | `members` | which columns of a group are the arm's joints, and in which order |
//! | `object` | which columns are the object's pose |
//! | `clock` | stamps and their unit |
//! | `track` | numbers over time, for what follows |
//! | `units` | degrees or radians, and what unit velocities have |
//! | `order` | which desired joint goes with which measured one, and its sign |
//! | `lag` | how far the arm lags behind its commands |
//! | `torque` | whether torques hold gravity |

mod candidates;
mod clock;
mod columns;
mod commands;
mod follow;
mod judged;
mod lag;
mod measured;
mod members;
mod object;
mod order;
mod shape;
mod torque;
mod track;
mod units;

use crate::clip::Gravity;
use crate::log::{HEADER, Log, Table};
use crate::mapping::{AngleUnit, JointColumns, Mapping, Note, Pieces, RateUnit, TorquesAct};
use columns::Chosen;
use shared_mem::cell::{Cell, ClipKind};
use track::Track;

/// A mapping with the reasons.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) mapping: Mapping,
    pub(crate) notes: Vec<Note>,
}

#[derive(Default)]
struct Notes(Vec<Note>);

impl Notes {
    fn why(&mut self, line: &str, why: impl Into<String>) {
        self.chosen(line, why, Vec::new());
    }

    fn open(&mut self, line: &str, question: impl Into<String>) {
        self.ask(line, question, Vec::new());
    }

    /// A reason, with the lines that would say otherwise.
    fn chosen(&mut self, line: &str, why: impl Into<String>, instead: Vec<String>) {
        self.0.push(Note { line: line.to_owned(), why: why.into(), open: false, instead });
    }

    /// A question, with the lines that may answer it.
    fn ask(&mut self, line: &str, question: impl Into<String>, instead: Vec<String>) {
        self.0.push(Note { line: line.to_owned(), why: question.into(), open: true, instead });
    }
}

/// What is known before a log is looked at.
#[derive(Clone, Copy, Default)]
pub(crate) struct Known<'a> {
    /// What the laboratory knows, where it was given.
    pub(crate) cell: Option<&'a Cell>,
    /// The arm's joints from base to flange; empty where they are not known.
    pub(crate) joints: &'a [String],
    /// The speeds that its description allows them [rad/s]; empty where it does not say.
    pub(crate) fastest: &'a [f64],
}

/// Proposes what the columns of `log` are. `gravity`: the nominal model's, of the joints that were found.
///
/// # Errors
/// A sentence where the log is one of another arm.
pub(crate) fn propose(
    log: &Log,
    known: Known<'_>,
    gravity: &dyn Fn(&[String]) -> Option<Gravity>,
) -> Result<Proposal, String> {
    let mut notes = Notes::default();
    if let Some(runs) = &log.facts.runs {
        notes.why("log", runs.clone());
    }
    let (mut of_joints, mut of_object) = (Notes::default(), Notes::default());
    let chosen = columns::choose(log, known.joints, &mut of_joints)?;
    let mut mapping = Mapping {
        kind: ClipKind::Excitation,
        pieces: Pieces::Whole,
        joints: chosen.joints.clone(),
        measured: None,
        desired: None,
        object: object::choose(log, &mut of_object),
    };
    if chosen.measured.is_none() && chosen.asked.is_none() && mapping.object.is_some() {
        mapping.kind = ClipKind::FreeMotion;
        notes.0.extend(of_object.0);
        notes.why("kind", "the log holds poses of an object and no joints");
        return Ok(Proposal { mapping, notes: notes.0 });
    }
    notes.0.extend(of_joints.0.into_iter().chain(of_object.0));
    kind(&mut mapping, known.cell, &mut notes);
    joints(log, (&chosen, known), (&mut mapping, gravity), &mut notes);
    Ok(Proposal { mapping, notes: notes.0 })
}

fn kind(mapping: &mut Mapping, cell: Option<&Cell>, notes: &mut Notes) {
    let described = cell.is_some_and(|cell| cell.object().is_some());
    match (&mapping.object, described) {
        (Some(_), true) => {
            mapping.kind = ClipKind::ControlHitSlide;
            notes.why("kind", "the log holds poses of an object, which cell.toml describes");
        }
        (Some(_), false) => notes.why(
            "kind",
            "the log holds poses of an object: control_hit_slide, once `[object]` of a cell.toml (--cell) describes it",
        ),
        (None, _) => notes.why("kind", "the log holds joints and no object"),
    }
}

/// The gravity of a model with joints of these names, where there is one.
type Model<'a> = &'a dyn Fn(&[String]) -> Option<Gravity>;

/// The two blocks of joints, with everything that their numbers tell.
fn joints(
    log: &Log,
    (chosen, known): (&Chosen, Known<'_>),
    (mapping, gravity): (&mut Mapping, Model<'_>),
    notes: &mut Notes,
) {
    let mut measured = block(log, "measured", (chosen.measured.as_ref(), chosen.asked.as_deref()), notes);
    let mut desired = (chosen.desired.is_some() || chosen.commands_are_open).then(|| {
        if chosen.measured.is_none() {
            notes.open(
                "desired.q",
                "which columns are the commanded positions? Take the block out where there are none",
            );
        }
        block(log, "desired", (chosen.desired.as_ref(), Some(&measured.table)), notes)
    });
    if let Some(rate) = log.table(&measured.table).and_then(|table| clock::by_slope(table, &measured, notes)) {
        measured.rate = Some(rate);
        if let Some(desired) = desired.as_mut().filter(|desired| desired.table == measured.table) {
            desired.rate = Some(rate);
        }
    }
    for columns in std::iter::once(&mut measured).chain(&mut desired) {
        columns.torques_act =
            if log.facts.torques_end_at_rows { TorquesAct::UntilStamp } else { TorquesAct::FromStamp };
    }
    let track = |columns: &JointColumns| -> Option<Track> { Track::of(log.table(&columns.table)?, columns) };
    if let Some(rows) = track(&measured) {
        units::measured(&rows, known.fastest, &mut measured, notes);
        if let Some(desired) = &mut desired {
            if let Some(told) = track(desired) {
                units::desired((&rows, &told), chosen.commands_factor, (&mut measured, desired), notes);
            }
            if chosen.order_is_open
                && let (Some(did), Some(told)) = (track(&measured), track(desired))
            {
                order::match_up(&did, &told, desired, notes);
            }
            if let (Some(did), Some(told)) = (track(&measured), track(desired)) {
                lag::look(&did, &told, desired, notes);
            }
        }
        leave_out_placeholders(log, (&mut measured, desired.as_mut()), notes);
        if !measured.tau.is_empty()
            && let Some(did) = track(&measured)
        {
            torque::which(log, &did, (&mut measured, gravity(&mapping.joints)), notes);
        }
    }
    velocities(log, "measured", &mut measured, notes);
    match &mut desired {
        Some(desired) => {
            if !desired.tau.is_empty() {
                torque::desired(log, desired, notes);
            }
            velocities(log, "desired", desired, notes);
        }
        None => notes.why(
            "desired",
            "no column is a command by its name or its numbers: the clips hold none, and `calibration diagnose --torques` is what \
             explains them, where torques were logged",
        ),
    }
    mapping.measured = Some(measured);
    mapping.desired = desired;
}

/// Proposes the units of blocks that a person filled in and that name none, with the reasons.
pub(crate) fn units_of(log: &Log, mapping: &mut Mapping) -> Vec<Note> {
    let mut notes = Notes::default();
    let track = |columns: &JointColumns| -> Option<Track> { Track::of(log.table(&columns.table)?, columns) };
    if let Some(measured) = &mut mapping.measured
        && let Some(did) = track(measured)
    {
        let told = mapping.desired.as_ref().and_then(track);
        let is_open = |columns: &JointColumns| columns.q_unit == AngleUnit::NotKnown;
        let (own, other) = (is_open(measured), mapping.desired.as_ref().is_some_and(is_open));
        units::unnamed((&did, told.as_ref()), (measured, mapping.desired.as_mut()), &mut notes);
        if own {
            velocities(log, "measured", measured, &mut notes);
        }
        if let Some(desired) = mapping.desired.as_mut().filter(|_| other) {
            velocities(log, "desired", desired, &mut notes);
        }
    }
    notes.0
}

/// Torques that nobody measured are none, whatever gravity shows in them.
fn leave_out_placeholders(
    log: &Log,
    (measured, desired): (&mut JointColumns, Option<&mut JointColumns>),
    notes: &mut Notes,
) {
    let both = std::iter::once(("measured", measured)).chain(desired.map(|desired| ("desired", desired)));
    for (line, columns) in both {
        if let Some(table) = log.table(&columns.table).filter(|_| !columns.tau.is_empty()) {
            torque::measured_at_all(table, columns, line, notes);
        }
    }
}

fn velocities(log: &Log, name: &str, columns: &mut JointColumns, notes: &mut Notes) {
    if columns.dq.is_empty() {
        columns.dq_unit = RateUnit::default();
        return;
    }
    if let Some(rows) = log.table(&columns.table).and_then(|table| Track::of(table, columns)) {
        units::velocities(&rows, name, columns, notes);
    }
}

/// A block as the names and the format tell it; where its columns are asked for, of the table that this is about.
fn block(
    log: &Log,
    name: &str,
    (chosen, asked): (Option<&columns::Block>, Option<&str>),
    notes: &mut Notes,
) -> JointColumns {
    let mut columns = match chosen {
        Some(columns::Block { table, q, dq, tau }) => JointColumns {
            table: table.clone(),
            q: q.clone(),
            dq: dq.clone(),
            tau: tau.clone(),
            ..JointColumns::default()
        },
        None => {
            let first = || log.tables.first().map_or("", |table| table.name.as_str());
            JointColumns { table: asked.unwrap_or_else(first).to_owned(), ..JointColumns::default() }
        }
    };
    if let Some(table) = log.table(&columns.table) {
        set_clock(log, table, name, &mut columns, notes);
    }
    columns
}

fn set_clock(log: &Log, table: &Table, name: &str, columns: &mut JointColumns, notes: &mut Notes) {
    // Asked once: the measured block of the same table answers for both.
    if name == "desired" && clock::is_missing(log, table) && log.tables.len() == 1 {
        return;
    }
    let clock = clock::choose(log, table, name, notes);
    (columns.stamps, columns.stamp_unit, columns.rate) = (clock.stamps, clock.unit, clock.rate);
    if columns.stamps.as_deref() == Some(HEADER) {
        columns.rate = None;
    }
}
