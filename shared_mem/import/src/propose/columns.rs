//! Which columns are q, dq and tau of what the arm did and of what it was told, and what its joints are called.

use super::Notes;
use super::candidates::{self, Candidate, Found};
use super::commands;
use super::judged::Judged;
use super::measured::{self, Untaken};
use super::members::{self, Members};
use crate::log::Log;

/// Columns of one table.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Block {
    pub(super) table: String,
    pub(super) q: Vec<String>,
    pub(super) dq: Vec<String>,
    pub(super) tau: Vec<String>,
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Chosen {
    pub(super) joints: Vec<String>,
    pub(super) measured: Option<Block>,
    pub(super) desired: Option<Block>,
    /// Whether no names say which desired column goes with which measured one.
    pub(super) order_is_open: bool,
    /// Positions are so many times the commands, as both are logged; `None` where their numbers do not tell.
    pub(super) commands_factor: Option<f64>,
    /// Whether it was asked which columns are the commands.
    pub(super) commands_are_open: bool,
    /// Table that a question about measured positions is about.
    pub(super) asked: Option<String>,
}

/// # Errors
/// A sentence where the log is one of another arm than the one whose joints are `wanted`.
pub(super) fn choose(log: &Log, wanted: &[String], notes: &mut Notes) -> Result<Chosen, String> {
    let Found { candidates, unnamed, refused, apart } = candidates::find(log, wanted);
    let all = Judged::all(log, &candidates);
    let asked =
        || all.iter().filter(|judged| !judged.candidate.role.desired).map(|j| j.candidate.table.name.clone()).next();
    let measured = match measured::choose(&all, wanted, refused, notes) {
        Ok(measured) => measured,
        Err(Untaken::OtherArm(what)) => return Err(what),
        Err(Untaken::Asked) => {
            return Ok(Chosen { asked: asked(), commands_are_open: true, ..Chosen::default() });
        }
    };
    let commanded: Vec<&[String]> = all
        .iter()
        .filter(|judged| judged.candidate.role.desired)
        .filter_map(|judged| judged.candidate.joints())
        .collect();
    let members = match members::of(&measured.candidate, wanted, &commanded) {
        Ok(members) => members,
        Err(question) => {
            notes.open("measured.q", question);
            let asked = Some(measured.candidate.table.name.clone());
            return Ok(Chosen { asked, commands_are_open: true, ..Chosen::default() });
        }
    };
    left_out(&measured.candidate, &members, apart, notes);
    let mut chosen = Chosen {
        joints: joint_names(log, &measured.candidate, (&members, wanted), notes),
        measured: Some(block("measured", &measured, &members.places, notes)),
        ..Chosen::default()
    };
    let nameless = Judged::unnamed(log, &unnamed, measured.candidate.size());
    match commands::choose((&all, &nameless), (&measured, &members), notes) {
        commands::Found::These(command) => {
            chosen.desired = Some(block("desired", &command.judged, &command.places, notes));
            chosen.order_is_open = !command.in_order;
            chosen.commands_factor = command.following.and_then(Result::ok).map(|following| following.factor);
        }
        commands::Found::Open => chosen.commands_are_open = true,
        commands::Found::None => {}
    }
    Ok(chosen)
}

/// Says which joints of the log are none of the arm's.
fn left_out(measured: &Candidate<'_>, members: &Members, mut apart: Vec<String>, notes: &mut Notes) {
    let labels = measured.group.labels.iter().enumerate();
    apart.extend(labels.filter(|(place, _)| !members.places.contains(place)).map(|(_, label)| label.clone()));
    if !apart.is_empty() {
        let what =
            format!("left out, as no joints of an arm: {}; add them to every list to keep them", apart.join(", "));
        notes.why("joints", what);
    }
}

fn joint_names(
    log: &Log,
    measured: &Candidate<'_>,
    (members, wanted): (&Members, &[String]),
    notes: &mut Notes,
) -> Vec<String> {
    let count = members.places.len();
    if let Some(names) = measured.joints() {
        let own: Vec<String> = members.places.iter().filter_map(|i| names.get(*i)).cloned().collect();
        let other = wanted.len() == count && wanted != own;
        let called = if other { format!("; the log calls them {}", own.join(", ")) } else { String::new() };
        notes.why("joints", format!("{}{called}", members.why));
        return if other { wanted.to_vec() } else { own };
    }
    if wanted.len() == count {
        notes.why("joints", "the log numbers its joints; they are taken in the order of the arm's");
        return wanted.to_vec();
    }
    if log.facts.franka && count == 7 {
        notes.why(
            "joints",
            "a Franka robot's state, which numbers its joints; an FR3 is taken, give --cell for another",
        );
        return (1..=count).map(|i| format!("fr3_joint{i}")).collect();
    }
    notes.why("joints", "the log only numbers its joints");
    (1..=count).map(|i| format!("joint{i}")).collect()
}

/// The positions with the velocities and torques that go with them.
fn block(name: &str, judged: &Judged<'_>, places: &[usize], notes: &mut Notes) -> Block {
    let mut beside = |key: &str, found: &[Candidate<'_>], why: &str| {
        let line = format!("{name}.{key}");
        let Some((best, others)) = found.split_first() else {
            if name == "measured" {
                notes.why(&line, "no column stands beside the positions as such");
            }
            return Vec::new();
        };
        let there: Vec<String> = others.iter().map(Candidate::named).collect();
        let also = if there.is_empty() { String::new() } else { format!("; also there: {}", there.join(", ")) };
        let lines = others.iter().map(|other| other.line(key)).collect();
        notes.chosen(&line, format!("{}: {why}{also}", best.named()), lines);
        best.pick(places)
    };
    let slope = if judged.has_slope { "the slope of the positions" } else { "beside the positions, by its name" };
    Block {
        table: judged.candidate.table.name.clone(),
        q: judged.candidate.pick(places),
        dq: beside("dq", &judged.velocities, slope),
        tau: beside("tau", &judged.torques, "beside the positions, by its name"),
    }
}
