//! Which columns are the pose of an object on the table.

use super::{Notes, clock};
use crate::log::{HEADER, Log, Table};
use crate::mapping::{LengthUnit, PoseColumns};
use crate::naming;
use std::collections::HashSet;

/// Words of things that lie on a table, and of what does not.
const THINGS: [&str; 11] =
    ["object", "obj", "cube", "box", "block", "item", "target_object", "toy", "can", "bottle", "slider"];
const NOT: [&str; 12] =
    ["ee", "eef", "tcp", "flange", "camera", "link", "hand", "gripper", "tool", "base", "world", "map"];
/// An object farther from the base than this is given in another unit [m].
const FARTHEST: f64 = 5.0;

/// Names of the seven columns, by whatever stands before x, y, z and w.
const SPELLINGS: [([&str; 3], [&str; 4]); 5] = [
    (["position.x", "position.y", "position.z"], ["orientation.w", "orientation.x", "orientation.y", "orientation.z"]),
    (["translation.x", "translation.y", "translation.z"], ["rotation.w", "rotation.x", "rotation.y", "rotation.z"]),
    (["x", "y", "z"], ["qw", "qx", "qy", "qz"]),
    (["px", "py", "pz"], ["qw", "qx", "qy", "qz"]),
    (
        ["position[0]", "position[1]", "position[2]"],
        ["quaternion_wxyz[0]", "quaternion_wxyz[1]", "quaternion_wxyz[2]", "quaternion_wxyz[3]"],
    ),
];

pub(super) fn choose(log: &Log, notes: &mut Notes) -> Option<PoseColumns> {
    let mut found: Vec<(u32, &Table, [String; 3], [String; 4])> = Vec::new();
    for table in &log.tables {
        let there: HashSet<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        for column in &table.columns {
            for (position, orientation) in SPELLINGS {
                let Some(prefix) = column.name.strip_suffix(position[0]) else { continue };
                let whole = |name: &str| format!("{prefix}{name}");
                let (position, orientation) = (position.map(whole), orientation.map(whole));
                let all = position.iter().chain(&orientation).all(|name| there.contains(name.as_str()));
                let ends = prefix.is_empty() || !prefix.ends_with(|c: char| c.is_alphanumeric());
                let words = naming::words(&format!("{} {prefix}", table.name));
                let says = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
                if all && ends && says(&THINGS) && !says(&NOT) {
                    found.push((table.rows() as u32, table, position, orientation));
                }
            }
        }
    }
    found.sort_by_key(|(rows, ..)| std::cmp::Reverse(*rows));
    let names: Vec<String> =
        found.iter().map(|(_, table, position, _)| format!("{} of `{}`", position[0], table.name)).collect();
    let (_, table, position, orientation) = found.into_iter().next()?;
    let also = if names.len() > 1 { format!("; also there: {}", names[1..].join(", ")) } else { String::new() };
    notes.why(
        "object.table",
        format!("poses of an object by their name{also}; a clip has one, given in the base frame"),
    );
    let largest = position
        .iter()
        .filter_map(|name| table.column(name))
        .flat_map(|c| &c.values)
        .fold(0.0, |m: f64, v| m.max(v.abs()));
    let (unit, why) = if largest > FARTHEST {
        (LengthUnit::Millimetre, format!("they reach {largest:.0}: an object on a table is no {largest:.0} m away"))
    } else {
        (LengthUnit::Metre, format!("they reach {largest:.2}, as an object on a table does in metres"))
    };
    notes.why("object.position_unit", why);
    let clock = clock::choose(log, table, "object", notes);
    let rate = if clock.stamps.as_deref() == Some(HEADER) { None } else { clock.rate };
    Some(PoseColumns {
        table: table.name.clone(),
        stamps: clock.stamps,
        stamp_unit: clock.unit,
        rate,
        shift: 0.0,
        position,
        position_unit: unit,
        orientation,
    })
}
