//! Groups of columns that may be a quantity of an arm's joints; and those that may not, with the reason.

use super::shape;
use crate::log::{Log, Table};
use crate::mapping::instead;
use crate::naming::{self, Group, Quantity, Role};
use std::collections::BTreeSet;

/// Words of joints that are none of an arm's.
const APART: [&str; 6] = ["finger", "gripper", "wheel", "caster", "knuckle", "mimic"];
/// Fewer labels beside a pose are no arm, but a gripper.
const FEWEST_JOINTS: usize = 3;
/// Sines are looked for among so many groups behind one: cosines stand near them.
const NEIGHBOURS: usize = 64;

/// A group of columns that may be some quantity of joints.
#[derive(Debug, Clone)]
pub(super) struct Candidate<'a> {
    pub(super) table: &'a Table,
    pub(super) group: Group,
    pub(super) role: Role,
}

/// What a log has for an arm.
#[derive(Debug, Default)]
pub(super) struct Found<'a> {
    pub(super) candidates: Vec<Candidate<'a>>,
    /// Groups whose names say nothing, or a velocity: their numbers may say that they are commands.
    pub(super) unnamed: Vec<Candidate<'a>>,
    /// Quantities by their name that are none, with the reason.
    pub(super) refused: Vec<String>,
    /// Joints that are none of an arm's.
    pub(super) apart: Vec<String>,
}

impl Candidate<'_> {
    pub(super) fn size(&self) -> usize {
        self.group.names.len()
    }

    /// Labels that are joint names, and not numbers.
    pub(super) fn joints(&self) -> Option<&[String]> {
        let named = self.group.labels.iter().all(|label| label.parse::<u64>().is_err() && !label.is_empty());
        named.then_some(&self.group.labels[..])
    }

    pub(super) fn is(&self, quantity: Quantity, desired: bool) -> bool {
        self.role.quantity == quantity && self.role.desired == desired
    }

    pub(super) fn values(&self) -> Vec<&[f64]> {
        columns(self.table, &self.group)
    }

    /// The message, or the group of an archive, that it is a part of.
    pub(super) fn parent(&self) -> &str {
        self.group.base.rsplit_once(['.', '/']).map_or("", |(parent, _)| parent)
    }

    /// What it is called in a sentence.
    pub(super) fn named(&self) -> String {
        format!("`{}` of `{}`", self.group.base, self.table.name)
    }

    /// Whether it is the same columns.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        std::ptr::eq(self.table, other.table) && self.group.at == other.group.at
    }

    /// The names of its columns at `places`.
    pub(super) fn pick(&self, places: &[usize]) -> Vec<String> {
        places.iter().filter_map(|i| self.group.names.get(*i)).cloned().collect()
    }

    /// The line of import.toml that takes it, as `key`.
    pub(super) fn line(&self, key: &str) -> String {
        instead(&self.table.name, key, &self.group.names)
    }
}

fn columns<'a>(table: &'a Table, group: &Group) -> Vec<&'a [f64]> {
    group.at.iter().filter_map(|at| table.columns.get(*at)).map(|column| column.values.as_slice()).collect()
}

/// Every group that may be a quantity of joints, without fingers and wheels, unless they are `wanted`.
pub(super) fn find<'a>(log: &'a Log, wanted: &[String]) -> Found<'a> {
    let mut found = Found::default();
    let mut apart = BTreeSet::new();
    for table in log.tables.iter().filter(|table| table.rows() > 1) {
        let groups = naming::groups(table);
        let circles = sines(table, &groups);
        let all = groups.clone();
        for (number, group) in groups.into_iter().enumerate() {
            let Some(role) = naming::role(&table.name, &group) else {
                found.unnamed.extend(nameless(table, group));
                continue;
            };
            let group = without_pose(without_apart(group, wanted, &mut apart), wanted, &mut apart);
            if group.names.is_empty() {
                continue;
            }
            let candidate = Candidate { table, group, role };
            let is_point = is_point(&candidate, &all)
                .then_some("a point in space, since what says how it is turned stands beside it");
            match is_point.or_else(|| no_joints(&candidate, wanted, circles.contains(&number))) {
                Some(why) => found.refused.push(format!("{}: {why}", candidate.named())),
                None => {
                    if candidate.is(Quantity::Velocity, false) {
                        found.unnamed.push(candidate.clone());
                    }
                    found.candidates.push(candidate);
                }
            }
        }
    }
    if !found.candidates.iter().any(|candidate| candidate.is(Quantity::Position, false)) {
        // What a person may have taken for joints.
        found.refused.extend(log.tables.iter().filter_map(pose_of_columns));
    }
    found.apart = apart.into_iter().collect();
    found
}

/// A group that names do not explain, as it may be positions by its numbers.
fn nameless(table: &Table, group: Group) -> Option<Candidate<'_>> {
    let is_other = !naming::may_serve(&group.base) || naming::is_time(&group.base) || naming::is_pose(&group.base);
    let role = Role { quantity: Quantity::Position, desired: false, score: 0 };
    (!is_other && group.names.len() > 1 && !naming::are_pose(&group.labels)).then_some(Candidate { table, group, role })
}

/// Whether three positions are a point in space: beside them stands how something is turned.
fn is_point(candidate: &Candidate<'_>, all: &[Group]) -> bool {
    let is_turn = |group: &Group| {
        let alike = group.base.rsplit_once(['.', '/']).map_or("", |(parent, _)| parent) == candidate.parent();
        naming::is_turn(&group.base) && (3..=4).contains(&group.names.len()) && alike
    };
    candidate.size() == 3
        && candidate.joints().is_none()
        && candidate.role.quantity == Quantity::Position
        && all.iter().any(is_turn)
}

/// A sentence about columns of one number each that are a pose together: `x`, `y`, `z`, `rx`, `ry`, `rz`.
fn pose_of_columns(table: &Table) -> Option<String> {
    let groups = naming::groups(table);
    let alone: Vec<String> = groups.iter().filter(|group| group.names.len() == 1).map(|g| g.names[0].clone()).collect();
    let ends: Vec<&str> = alone.iter().map(String::as_str).filter(|name| naming::is_of_pose(name)).collect();
    naming::are_pose(&alone)
        .then(|| format!("`{}` of `{}`: a pose in space by their names, and no joints", ends.join("`, `"), table.name))
}

/// The group without joints that are none of an arm's.
fn without_apart(group: Group, wanted: &[String], apart: &mut BTreeSet<String>) -> Group {
    let is_wanted = |label: &str| wanted.iter().any(|wanted| wanted.eq_ignore_ascii_case(label));
    let is_apart = |text: &str| {
        let text = text.to_ascii_lowercase();
        APART.iter().any(|word| text.contains(word))
    };
    let of_hand = is_apart(&group.base);
    let (mut out, mut kept) = (Vec::new(), Vec::new());
    for (place, label) in group.labels.iter().enumerate() {
        let leaves = !is_wanted(label) && (of_hand || is_apart(label));
        if leaves { &mut out } else { &mut kept }.push(place);
    }
    for place in out {
        let label = group.labels.get(place).filter(|label| !of_hand && !label.is_empty());
        apart.insert(label.unwrap_or(&group.base).clone());
    }
    let pick = |list: &[String]| kept.iter().filter_map(|place| list.get(*place)).cloned().collect();
    Group {
        labels: pick(&group.labels),
        names: pick(&group.names),
        at: kept.iter().filter_map(|place| group.at.get(*place)).copied().collect(),
        base: group.base,
    }
}

/// The group without a pose that stands among its joints.
fn without_pose(group: Group, wanted: &[String], apart: &mut BTreeSet<String>) -> Group {
    let mut out = naming::pose_among(&group.labels);
    out.retain(|place| !wanted.contains(&group.labels[*place]));
    let kept: Vec<usize> = (0..group.labels.len()).filter(|place| !out.contains(place)).collect();
    if out.is_empty() || kept.len() < FEWEST_JOINTS {
        return group;
    }
    apart.extend(out.iter().map(|place| group.labels[*place].clone()));
    let pick = |list: &[String]| kept.iter().filter_map(|place| list.get(*place)).cloned().collect();
    Group {
        labels: pick(&group.labels),
        names: pick(&group.names),
        at: kept.iter().filter_map(|place| group.at.get(*place)).copied().collect(),
        base: group.base,
    }
}

/// Why a group is no quantity of joints, by its labels and by its numbers.
fn no_joints(candidate: &Candidate<'_>, wanted: &[String], on_circle: bool) -> Option<&'static str> {
    let labels = &candidate.group.labels;
    let values = candidate.values();
    if !labels.iter().all(|label| wanted.contains(label)) && naming::are_pose(labels) {
        Some("the pose of a hand by its names, and no joints")
    } else if shape::is_empty(&values) {
        Some("it holds no number")
    } else if candidate.role.quantity != Quantity::Position {
        None
    } else if on_circle {
        Some("sines and cosines of angles: their squares add up to 1 in every row")
    } else if shape::is_turned(&values) {
        Some("it holds a quaternion: four numbers in a row whose squares add up to 1 in every row")
    } else {
        None
    }
}

/// Groups whose squares and those of another group add up to 1, by their numbers.
fn sines(table: &Table, groups: &[Group]) -> Vec<usize> {
    let mut found = Vec::new();
    for (number, group) in groups.iter().enumerate() {
        let own = columns(table, group);
        if shape::are_sines(&own) {
            found.push(number);
        }
        for (other, near) in groups.iter().enumerate().skip(number + 1).take(NEIGHBOURS) {
            if near.names.len() == group.names.len() && shape::on_circle(&own, &columns(table, near)) {
                found.extend([number, other]);
            }
        }
    }
    found
}
