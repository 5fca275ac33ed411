//! Which group of columns is the commanded positions: the joints go where it says. A name alone makes no command of the deltas of a
//! hand, or of another run.

use super::Notes;
use super::follow::{self, Following};
use super::judged::Judged;
use super::members::{self, Members};
use super::track::Track;
use crate::naming::{self, Quantity, Role};

/// A name of at least this score says by itself that it is a command: `q_d`, a topic of desired joints.
const PLAIN_NAME: u32 = 3;
/// Line of import.toml.
const LINE: &str = "desired.q";
/// What is said where commands are asked for.
const OR_NONE: &str =
    "One name a joint, of those at the end of this file; or take the block [desired] out, where there are none";

/// What was found of commands.
#[derive(Debug)]
pub(super) enum Found<'a> {
    These(Box<Command<'a>>),
    /// Columns are commands by their name, and by their numbers none: it was asked.
    Open,
    /// The log has none.
    None,
}

/// A group of commands, and how the joints follow it.
#[derive(Debug)]
pub(super) struct Command<'a> {
    pub(super) judged: Judged<'a>,
    /// Its columns in the order of the joints.
    pub(super) places: Vec<usize>,
    /// Whether names say that order.
    pub(super) in_order: bool,
    /// How the joints follow it; else the share of their motion that it explains; `None` where that cannot be known.
    pub(super) following: Option<Result<Following, f64>>,
}

impl<'a> Command<'a> {
    /// A group as commands of the joints; `None` where it is for another number of joints.
    fn of(judged: &Judged<'a>, measured: &Judged<'_>, members: &Members) -> Option<Self> {
        let named = measured.candidate.joints().zip(judged.candidate.joints()).and_then(|(did, told)| {
            let joints: Vec<String> = members.places.iter().filter_map(|i| did.get(*i)).cloned().collect();
            members::places(told, &joints)
        });
        let size = judged.candidate.size();
        let in_order = named.is_some();
        let places = match named {
            Some(places) => places,
            None if size == measured.candidate.size() => members.places.clone(),
            None if size == members.places.len() => (0..size).collect(),
            // Behind the joints may stand a gripper.
            None if judged.candidate.joints().is_none()
                && (size == members.places.len() + 1 || size == members.places.len() + 2) =>
            {
                (0..members.places.len()).collect()
            }
            None => return None,
        };
        let of = |track: &Track, places: &[usize]| Track {
            t: track.t.clone(),
            q: places.iter().filter_map(|i| track.q.get(*i)).cloned().collect(),
            ..Track::default()
        };
        let tracks = measured.track.as_ref().zip(judged.track.as_ref());
        let following =
            tracks.and_then(|(did, told)| follow::follows(&of(did, &members.places), &of(told, &places), in_order));
        Some(Self { judged: judged.clone(), places, in_order, following })
    }

    /// What speaks for it; `None` where its numbers speak against it.
    fn rank(&self) -> Option<(bool, bool, u32)> {
        let Role { score, .. } = self.judged.candidate.role;
        let is_followed = matches!(self.following, Some(Ok(_)));
        let refuted = matches!(self.following, Some(Err(_))) && score < PLAIN_NAME;
        (!refuted).then_some((is_followed, self.in_order, score))
    }

    fn why(&self) -> String {
        let name = self.judged.candidate.named();
        match self.following {
            Some(Ok(Following { share, .. })) => {
                format!("{name}: the joints go where it says (it explains {:.0} % of their motion)", 100.0 * share)
            }
            Some(Err(_)) => format!("{name}: commands by its name, though the joints do not go where it says"),
            None => format!("{name}: commands by its name"),
        }
    }
}

/// `nameless`: groups whose names say nothing of positions.
pub(super) fn choose<'a>(
    (all, nameless): (&[Judged<'a>], &[Judged<'a>]),
    (measured, members): (&Judged<'a>, &Members),
    notes: &mut Notes,
) -> Found<'a> {
    let named: Vec<&Judged<'a>> = all.iter().filter(|judged| judged.candidate.is(Quantity::Position, true)).collect();
    let mut commands: Vec<Command<'a>> =
        named.iter().filter_map(|judged| Command::of(judged, measured, members)).collect();
    commands.sort_by_key(|command| std::cmp::Reverse((command.rank(), command.judged.candidate.table.rows())));
    let Some((best, rank)) = commands.first().and_then(|best| Some((best, best.rank()?))) else {
        return unnamed((all, nameless), &named, (measured, members), notes);
    };
    let rivals: Vec<&Command<'a>> = commands
        .iter()
        .skip(1)
        .filter(|other| other.rank() == Some(rank) && other.judged.differs(&best.judged))
        .collect();
    let lines = |list: &[&Command<'a>]| list.iter().map(|other| other.judged.candidate.line("q")).collect();
    if !rivals.is_empty() {
        let all: Vec<&Command<'a>> = std::iter::once(best).chain(rivals).collect();
        let names: Vec<String> = all.iter().map(|command| command.judged.candidate.named()).collect();
        notes.ask(
            LINE,
            format!("as much speaks for {}: which did the controller follow? {OR_NONE}", names.join(" as for ")),
            lines(&all),
        );
        return Found::Open;
    }
    let others: Vec<&Command<'a>> = commands.iter().skip(1).collect();
    let mut why = best.why();
    if !others.is_empty() {
        let there: Vec<String> = others.iter().map(|other| other.judged.candidate.named()).collect();
        why += &format!("; also there: {}", there.join(", "));
    }
    notes.chosen(LINE, why, lines(&others));
    Found::These(Box::new(commands.swap_remove(0)))
}

/// Commands that no name gives away: a group that the joints follow, later. Where there is none either, and names say that there
/// are commands, it is asked.
fn unnamed<'a>(
    (all, nameless): (&[Judged<'a>], &[Judged<'a>]),
    named: &[&Judged<'a>],
    (measured, members): (&Judged<'a>, &Members),
    notes: &mut Notes,
) -> Found<'a> {
    let is_none = |judged: &&Judged<'a>| {
        judged.candidate.is_same(&measured.candidate)
            || judged.candidate.role.desired
            || naming::is_derived(&judged.candidate.group.base)
    };
    let leading: Vec<Command<'a>> = all
        .iter()
        .chain(nameless)
        .filter(|judged| !is_none(judged) && judged.leads(measured))
        .filter_map(|judged| Command::of(&judged.clone().without_those_of(measured), measured, members))
        .collect();
    let others: Vec<&Command<'a>> =
        leading.iter().skip(1).filter(|other| other.judged.differs(&leading[0].judged)).collect();
    if !others.is_empty() {
        let names: Vec<String> = leading.iter().map(|command| command.judged.candidate.named()).collect();
        let lines = leading.iter().map(|command| command.judged.candidate.line("q")).collect();
        let what = format!(
            "the joints go the same way as {}, later: which did the controller follow? {OR_NONE}",
            names.join(" and ")
        );
        notes.ask(LINE, what, lines);
        return Found::Open;
    }
    if let Some(command) = leading.into_iter().next() {
        notes.why(LINE, format!("{}: the joints go the same way, later", command.judged.candidate.named()));
        return Found::These(Box::new(command));
    }
    let moving: Vec<String> = named.iter().filter(|j| !j.is_constant).map(|j| j.candidate.named()).collect();
    if moving.is_empty() {
        return Found::None;
    }
    let lines = named.iter().map(|judged| judged.candidate.line("q")).collect();
    let what = format!(
        "which columns are the commanded positions? {} is a command by its name, and the joints do not go where it says. {OR_NONE}",
        moving.join(", ")
    );
    notes.ask(LINE, what, lines);
    Found::Open
}
