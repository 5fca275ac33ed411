//! A mapping, proposed from a log: from the names of its columns, from what its format says, and from its numbers. Every
//! choice comes with its reason; what cannot be known stays open.
//!
//! | file | owns |
//! |---|---|
//! | `columns` | which columns are which quantity, by their names |
//! | `object` | which columns are the object's pose |
//! | `clock` | stamps and their unit |
//! | `track` | numbers over time, for what follows |
//! | `units` | degrees or radians, and what unit velocities have |
//! | `order` | which desired joint goes with which measured one, and its sign |
//! | `lag` | how far the arm lags behind its commands |
//! | `torque` | whether torques hold gravity |

mod clock;
mod columns;
mod lag;
mod object;
mod order;
mod torque;
mod track;
mod units;

use crate::clip::Gravity;
use crate::log::{HEADER, Log, Table};
use crate::mapping::{JointColumns, Mapping, Note, RateUnit, TorquesAct};
use columns::Chosen;
use shared_mem::cell::{Cell, ClipKind};
use track::Track;

/// A mapping with the reasons.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) mapping: Mapping,
    pub(crate) notes: Vec<Note>,
}

/// Collects reasons.
#[derive(Default)]
struct Notes(Vec<Note>);

impl Notes {
    fn why(&mut self, line: &str, why: impl Into<String>) {
        self.0.push(Note { line: line.to_owned(), why: why.into(), open: false });
    }

    fn open(&mut self, line: &str, question: impl Into<String>) {
        self.0.push(Note { line: line.to_owned(), why: question.into(), open: true });
    }
}

/// Proposes what the columns of `log` are. `cell`: what the laboratory knows, where it was given; `wanted`: the arm's joints from base
/// to flange, where they are known; `gravity`: the nominal model's, of the joints that were found.
pub(crate) fn propose(
    log: &Log,
    (cell, wanted): (Option<&Cell>, &[String]),
    gravity: &dyn Fn(&[String]) -> Option<Gravity>,
) -> Proposal {
    let mut notes = Notes::default();
    let chosen = columns::choose(log, wanted, &mut notes);
    let object = object::choose(log, &mut notes);
    let mut mapping =
        Mapping { kind: ClipKind::Excitation, joints: chosen.joints.clone(), measured: None, desired: None, object };
    if chosen.measured.is_none() && chosen.desired.is_none() && mapping.object.is_some() {
        mapping.kind = ClipKind::FreeMotion;
        notes.why("kind", "the log holds poses of an object and no joints");
        return Proposal { mapping, notes: notes.0 };
    }
    kind(&mut mapping, cell, &mut notes);
    joints(log, &chosen, (&mut mapping, gravity), &mut notes);
    Proposal { mapping, notes: notes.0 }
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
fn joints(log: &Log, chosen: &Chosen, (mapping, gravity): (&mut Mapping, Model<'_>), notes: &mut Notes) {
    let mut measured = block(log, "measured", chosen.measured.as_ref(), notes);
    let mut desired = block(log, "desired", chosen.desired.as_ref(), notes);
    for columns in [&mut measured, &mut desired] {
        columns.torques_act =
            if log.facts.torques_end_at_rows { TorquesAct::UntilStamp } else { TorquesAct::FromStamp };
    }
    let track = |columns: &JointColumns| -> Option<Track> { Track::of(log.table(&columns.table)?, columns) };
    if let Some(rows) = track(&measured) {
        let told = track(&desired);
        units::angles(&rows, told.as_ref(), (&mut measured, &mut desired), notes);
        if chosen.order_is_open
            && let (Some(did), Some(told)) = (track(&measured), track(&desired))
        {
            order::match_up(&did, &told, &mut desired, notes);
        }
        if let (Some(did), Some(told)) = (track(&measured), track(&desired)) {
            lag::look(&did, &told, &mut desired, notes);
        }
        leave_out_placeholders(log, (&mut measured, &mut desired), notes);
        if !measured.tau.is_empty()
            && let Some(did) = track(&measured)
        {
            torque::which(log, &did, (&mut measured, gravity(&mapping.joints)), notes);
        }
    }
    if !desired.tau.is_empty() {
        torque::desired(log, &mut desired, notes);
    }
    for (name, columns) in [("measured", &mut measured), ("desired", &mut desired)] {
        velocities(log, name, columns, notes);
    }
    mapping.measured = Some(measured);
    mapping.desired = Some(desired);
}

/// Torques that nobody measured are none, whatever gravity shows in them.
fn leave_out_placeholders(log: &Log, (measured, desired): (&mut JointColumns, &mut JointColumns), notes: &mut Notes) {
    for (line, columns) in [("measured", measured), ("desired", desired)] {
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

/// A block as the names and the format tell it.
fn block(log: &Log, name: &str, chosen: Option<&columns::Block>, notes: &mut Notes) -> JointColumns {
    let Some(chosen) = chosen else {
        let table = log.tables.first().map_or_else(String::new, |table| table.name.clone());
        let what = if name == "measured" { "measured positions" } else { "commanded positions" };
        notes.open(
            &format!("{name}.q"),
            format!("which columns are the {what}? One name a joint, of those at the end of this file"),
        );
        let mut columns = JointColumns { table, ..JointColumns::default() };
        if let Some(table) = log.table(&columns.table) {
            set_clock(log, table, name, &mut columns, notes);
        }
        return columns;
    };
    let mut columns = JointColumns {
        table: chosen.table.clone(),
        q: chosen.q.clone(),
        dq: chosen.dq.clone(),
        tau: chosen.tau.clone(),
        ..JointColumns::default()
    };
    if let Some(table) = log.table(&chosen.table) {
        set_clock(log, table, name, &mut columns, notes);
    }
    columns
}

fn set_clock(log: &Log, table: &Table, name: &str, columns: &mut JointColumns, notes: &mut Notes) {
    // Asked once: the measured block of the same table answers for both.
    if name == "desired" && clock::is_missing(table) && log.tables.len() == 1 {
        return;
    }
    let clock = clock::choose(log, table, name, notes);
    (columns.stamps, columns.stamp_unit, columns.rate) = (clock.stamps, clock.unit, clock.rate);
    if columns.stamps.as_deref() == Some(HEADER) {
        columns.rate = None;
    }
}
