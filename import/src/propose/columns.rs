//! Which columns are q, dq and tau of what the arm did and of what it was told, by their names and their tables'.

use super::Notes;
use crate::log::Log;
use crate::naming::{self, Group, Quantity, Role};
use shared_mem::msg::MAX_JOINTS;
use std::collections::HashSet;

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
}

/// A group of columns that may be some quantity of joints.
#[derive(Debug, Clone)]
struct Candidate<'a> {
    table: &'a str,
    rows: usize,
    group: Group,
    role: Role,
}

impl Candidate<'_> {
    fn size(&self) -> usize {
        self.group.names.len()
    }

    /// Labels that are joint names, and not numbers.
    fn joints(&self) -> Option<&[String]> {
        let named = self.group.labels.iter().all(|label| label.parse::<u64>().is_err() && !label.is_empty());
        named.then_some(&self.group.labels[..])
    }

    fn is(&self, quantity: Quantity, desired: bool) -> bool {
        self.role.quantity == quantity && self.role.desired == desired
    }
}

pub(super) fn choose(log: &Log, wanted: &[String], notes: &mut Notes) -> Chosen {
    let mut fingers = Vec::new();
    let candidates = candidates(log, wanted, &mut fingers);
    let best = |desired: bool, size: Option<usize>| {
        let fitting = candidates.iter().filter(|c| c.is(Quantity::Position, desired));
        fitting.max_by_key(|c| {
            (
                c.role.score + if size == Some(c.size()) { 3 } else { 0 },
                c.size().min(7),
                c.rows,
                std::cmp::Reverse(c.table),
            )
        })
    };
    let Some(measured) = best(false, None) else { return Chosen::default() };
    let desired = best(true, Some(measured.size())).filter(|d| d.size() == measured.size());
    if !fingers.is_empty() {
        notes.why(
            "joints",
            format!("left out, as no joints of an arm: {}; add them to every list to keep them", fingers.join(", ")),
        );
    }
    let joints = joint_names(log, measured, wanted, notes);
    if measured.size() > MAX_JOINTS {
        let what = format!(
            "the log has {} joints, a clip at most {MAX_JOINTS}: which columns are those of one arm?",
            measured.size()
        );
        notes.open("measured.q", what);
        return Chosen::default();
    }
    let order = order(measured, wanted);
    let others =
        candidates.iter().filter(|c| c.is(Quantity::Position, false) && c.table != measured.table && c.size() > 1);
    let others: Vec<String> = others.map(|c| format!("`{}`", c.table)).collect();
    let also = if others.is_empty() { String::new() } else { format!("; also there: {}", others.join(", ")) };
    notes.why(
        "measured.table",
        format!("`{}` of `{}` are positions by their name{also}", measured.group.base, measured.table),
    );
    if let Some(desired) = desired {
        let why = format!("`{}` of `{}` are commanded positions by their name", desired.group.base, desired.table);
        notes.why("desired.table", why);
    }
    let told = desired.map(|desired| aligned(desired, measured, &order));
    Chosen {
        joints: pick(&joints, &order),
        measured: Some(block(&candidates, measured, &order)),
        order_is_open: told.as_ref().is_some_and(Option::is_none),
        desired: desired.map(|desired| block(&candidates, desired, &told.flatten().unwrap_or_else(|| order.clone()))),
    }
}

/// Every group that may be a quantity of joints, without fingers.
fn candidates<'a>(log: &'a Log, wanted: &[String], fingers: &mut Vec<String>) -> Vec<Candidate<'a>> {
    let (mut found, mut told) = (Vec::new(), HashSet::new());
    for table in &log.tables {
        for mut group in naming::groups(table) {
            let Some(role) = naming::role(&table.name, &group) else { continue };
            if is_place(&group.labels) || table.rows() < 2 {
                continue;
            }
            let is_finger = |label: &String| {
                let label = label.to_ascii_lowercase();
                (label.contains("finger") || label.contains("gripper"))
                    && !wanted.iter().any(|w| w.to_ascii_lowercase() == label)
            };
            let all = std::mem::take(&mut group.labels).into_iter().zip(std::mem::take(&mut group.names));
            let (out, arm): (Vec<_>, Vec<_>) = all.partition(|(label, _)| is_finger(label));
            (group.labels, group.names) = arm.into_iter().unzip();
            for (label, _) in out.into_iter().rev() {
                if told.insert(label.clone()) {
                    fingers.push(label);
                }
            }
            if !group.names.is_empty() {
                found.push(Candidate { table: &table.name, rows: table.rows(), group, role });
            }
        }
    }
    found
}

/// Whether labels are those of a place in space.
fn is_place(labels: &[String]) -> bool {
    labels.iter().all(|label| matches!(label.as_str(), "x" | "y" | "z" | "w" | "qx" | "qy" | "qz" | "qw"))
        && labels.iter().any(|label| label == "x" || label == "qx")
}

fn joint_names(log: &Log, measured: &Candidate<'_>, wanted: &[String], notes: &mut Notes) -> Vec<String> {
    if let Some(names) = measured.joints() {
        let known = !wanted.is_empty() && wanted.iter().all(|name| names.contains(name));
        notes.why("joints", if known { "the log's own names, from the arm's base on" } else { "the log's own names" });
        return names.to_vec();
    }
    let count = measured.size();
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

/// Columns in the order of the arm's joints, where these are the log's.
fn order(measured: &Candidate<'_>, wanted: &[String]) -> Vec<usize> {
    let plain = || (0..measured.size()).collect();
    let Some(names) = measured.joints() else { return plain() };
    let found: Option<Vec<usize>> = wanted.iter().map(|name| names.iter().position(|own| own == name)).collect();
    found.filter(|order| !order.is_empty()).unwrap_or_else(plain)
}

/// The desired columns in the order of the measured ones by the joints' names; `None` where names do not tell.
fn aligned(desired: &Candidate<'_>, measured: &Candidate<'_>, order: &[usize]) -> Option<Vec<usize>> {
    if desired.group.labels == measured.group.labels && measured.joints().is_some() {
        return Some(order.to_vec());
    }
    let (told, did) = (desired.joints()?, measured.joints()?);
    order.iter().map(|i| told.iter().position(|name| Some(name) == did.get(*i))).collect()
}

fn pick(list: &[String], order: &[usize]) -> Vec<String> {
    order.iter().filter_map(|i| list.get(*i)).cloned().collect()
}

/// The positions with the velocities and torques that go with them: of the same table, as many, named alike.
fn block(candidates: &[Candidate<'_>], q: &Candidate<'_>, order: &[usize]) -> Block {
    let beside = |quantity: Quantity| {
        let fitting = candidates
            .iter()
            .filter(|c| c.table == q.table && c.is(quantity, q.role.desired) && c.group.labels == q.group.labels);
        let prefix = |c: &Candidate<'_>| c.group.base.split('.').next() == q.group.base.split('.').next();
        fitting.max_by_key(|c| (prefix(c), c.role.score)).map_or_else(Vec::new, |c| pick(&c.group.names, order))
    };
    Block {
        table: q.table.to_owned(),
        q: pick(&q.group.names, order),
        dq: beside(Quantity::Velocity),
        tau: beside(Quantity::Torque),
    }
}
