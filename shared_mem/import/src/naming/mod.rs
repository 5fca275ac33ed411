//! What the names of columns say: which of them belong together, and which quantity they may be.

//!
//! | file | owns |
//! |---|---|
//! | `words` | words of names, by what they say |
//! | `label` | what of a name tells a column from its neighbours, and its unit |

mod label;
mod words;

pub(crate) use label::{Unit, of_file, split, unit};

use crate::log::Table;
use std::collections::{HashMap, HashSet};
use words::{DERIVED, DESIRED, MEASURED, MOTOR, OTHER, POSE, POSITION, TIME, TORQUE, TURNED, VELOCITY};

/// Columns of one quantity: `q[0]` to `q[6]`, `joint1_pos` to `joint6_pos`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Group {
    /// What they have in common: `q`, `joint_pos`.
    pub(crate) base: String,
    /// What tells them apart, as a number or a joint's name; empty where there is one.
    pub(crate) labels: Vec<String>,
    pub(crate) names: Vec<String>,
    /// Their places in the table.
    pub(crate) at: Vec<usize>,
}

/// A quantity of a joint or of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    Position,
    Velocity,
    Torque,
}

/// What a group is, as far as its name and that of its table tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Role {
    pub(crate) quantity: Quantity,
    /// What the arm was told, and not what it did.
    pub(crate) desired: bool,
    /// How much the name speaks for it.
    pub(crate) score: u32,
}

/// The words of a name, in small letters: `tau_J_d` has three.
pub(crate) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let mut before_small = false;
    for c in name.chars() {
        let starts = c.is_ascii_uppercase() && before_small;
        if !c.is_alphanumeric() || starts {
            words.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
        before_small = c.is_ascii_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Whether a column may be of any use; what certainly is something else takes no memory.
pub(crate) fn may_serve(name: &str) -> bool {
    let (base, _) = split(name);
    let words = words(&base);
    !words.iter().any(|word| OTHER.contains(&word.as_str()))
        && !words.first().is_some_and(|w| w.len() == 1 && "ofkim".contains(w.as_str()))
}

/// Columns of a table by quantity, in the order they stand.
pub(crate) fn groups(table: &Table) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut first: HashMap<(String, Option<String>), usize> = HashMap::new();
    for (at, column) in table.columns.iter().enumerate() {
        let (base, label) = split(&column.name);
        // Without a label a column stands by itself; one in another unit is another quantity.
        let key = (base.clone(), unit(&column.name).map(|unit| format!("{unit:?}")));
        let known = first.get(&key).filter(|_| !label.is_empty());
        match known.and_then(|group| groups.get_mut(*group)) {
            Some(group) => {
                group.labels.push(label);
                group.names.push(column.name.clone());
                group.at.push(at);
            }
            None => {
                first.entry(key).or_insert(groups.len());
                groups.push(Group { base, labels: vec![label], names: vec![column.name.clone()], at: vec![at] });
            }
        }
    }
    groups
}

/// What a group may be; `None` for what is something else.
pub(crate) fn role(table: &str, group: &Group) -> Option<Role> {
    if !may_serve(&group.base) || is_time(&group.base) {
        return None;
    }
    if is_pose(&group.base) || is_coordinate(&group.base) {
        return None;
    }
    let own = own_words(&group.base);
    // `set` in a file's name is seldom a command.
    let around: Vec<String> = words(table).into_iter().filter(|word| word != "set").collect();
    let has = |words: &[String], list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let desired = has(&own, &DESIRED) || has(&around, &DESIRED);
    let measured = has(&own, &MEASURED);
    let only = |list: &[&str]| own.len() == 1 && has(&own, list);
    // A message of numbers alone is called by its topic: `/forward_position_controller/commands`.
    let by_topic = own == ["data"] && desired;
    let quantity = if has(&own, &VELOCITY) || (by_topic && has(&around, &VELOCITY)) {
        Quantity::Velocity
    } else if has(&own, &TORQUE) || (by_topic && has(&around, &TORQUE)) {
        Quantity::Torque
    } else if has(&own, &POSITION) || only(&["cmd", "command", "target", "goal"]) || by_topic {
        Quantity::Position
    } else {
        match group.names.first().and_then(|name| unit(name)) {
            Some(Unit::Radian | Unit::Degree | Unit::Turn) if measured || desired => Quantity::Position,
            Some(Unit::Rate) if measured || desired => Quantity::Velocity,
            Some(Unit::NewtonMetre) => Quantity::Torque,
            _ => return None,
        }
    };
    let mut score = 1;
    // The plain names of robotics, and what a publisher calls its own.
    score += 4 * u32::from(matches!(
        group.base.trim_start_matches("state."),
        "q" | "dq" | "tau_J" | "q_d" | "dq_d" | "tau_J_d"
    ));
    score += 2 * u32::from(has(&around, &["measured", "desired"]));
    // What says that it was measured is that, even beside a plain `q`.
    score += if quantity == Quantity::Position { 5 } else { 1 } * u32::from(measured && !desired);
    score += u32::from(own.iter().any(|word| word == "state") || has(&around, &["state", "states"]));
    score +=
        u32::from(matches!(group.base.as_str(), "position" | "velocity" | "effort" | "observation.state" | "action"));
    let less = u32::from(has(&own, &MOTOR)) + u32::from(has(&own, &DERIVED));
    Some(Role { quantity, desired, score: score.saturating_sub(less) })
}

/// Whether a name says that its numbers come out of others, later or out of a model.
pub(crate) fn is_derived(base: &str) -> bool {
    words(base).iter().any(|word| DERIVED.contains(&word.as_str()))
}

/// Whether a name says how something is turned.
pub(crate) fn is_turn(base: &str) -> bool {
    words(base).iter().any(|word| TURNED.contains(&word.as_str()))
}

/// The words of a base, with what stands behind the `q` of one as a word of its own: `qdes`.
fn own_words(base: &str) -> Vec<String> {
    let mut own = words(base);
    let behind: Vec<String> = own
        .iter()
        .filter_map(|word| word.strip_prefix('q').filter(|rest| rest.len() > 1))
        .filter(|rest| DESIRED.contains(rest) || MEASURED.contains(rest))
        .map(str::to_owned)
        .collect();
    if !behind.is_empty() {
        own.push("q".into());
    }
    own.extend(behind);
    own
}

/// Whether a name ends like one coordinate in space, which is no joint's.
fn is_coordinate(name: &str) -> bool {
    const SPACE: [&str; 8] = ["x", "y", "z", "w", "qx", "qy", "qz", "qw"];
    words(name).last().is_some_and(|word| SPACE.contains(&word.as_str()))
}

/// Whether a name is that of one number of a pose.
pub(crate) fn is_of_pose(name: &str) -> bool {
    const TURN: [&str; 6] = ["rx", "ry", "rz", "roll", "pitch", "yaw"];
    is_coordinate(name) || words(name).last().is_some_and(|word| TURN.contains(&word.as_str()))
}

/// Whether a name says where a hand is, or how it is turned.
pub(crate) fn is_pose(base: &str) -> bool {
    words(base).iter().any(|word| POSE.contains(&word.as_str()))
}

/// Whether the labels of a group are those of a pose: `x, y, z, roll, pitch, yaw`, alone or behind one name, and not joints that
/// are called `wrist_roll` or `shoulder_pitch`.
pub(crate) fn are_pose(labels: &[String]) -> bool {
    let parts: Vec<(String, String)> = labels
        .iter()
        .filter_map(|label| words(label).split_last().map(|(last, before)| (before.join(" "), last.clone())))
        .collect();
    let together = |words: [&str; 3], alone: bool| {
        let of = |word: &str| -> HashSet<&String> {
            parts.iter().filter(|(_, last)| last == word).map(|(before, _)| before).collect()
        };
        let all = words.map(of);
        let stands = |before: &&String| all.iter().all(|there| there.contains(before)) && (before.is_empty() || !alone);
        all[0].iter().any(stands)
    };
    together(["x", "y", "z"], false)
        || together(["rx", "ry", "rz"], false)
        || together(["roll", "pitch", "yaw"], true)
        || together(["qx", "qy", "qz"], false)
        || labels.iter().filter(|label| is_pose(label)).count() > 2
}

/// Which labels of a group are those of a pose that stands among joints: they share what stands before an `x`, `y` and `z`.
pub(crate) fn pose_among(labels: &[String]) -> Vec<usize> {
    let part = |label: &String| words(label).split_last().map(|(last, before)| (before.join(" "), last.clone()));
    let parts: Vec<Option<(String, String)>> = labels.iter().map(part).collect();
    let has = |before: &String, word: &str| parts.iter().flatten().any(|(own, last)| own == before && last == word);
    let is_of_pose = |at: usize| {
        let part = parts.get(at).and_then(Option::as_ref);
        part.is_some_and(|(before, _)| ["x", "y", "z"].iter().all(|word| has(before, word)) && is_of_pose(&labels[at]))
    };
    (0..labels.len()).filter(|at| is_of_pose(*at)).collect()
}

/// Whether a column of this name counts time.
pub(crate) fn is_time(name: &str) -> bool {
    let words = words(name);
    words.iter().any(|word| TIME.contains(&word.as_str())) && !words.iter().any(|word| word == "q" || word == "joint")
}

/// The unit that the name of a column of stamps ends with [s].
pub(crate) fn time_unit(name: &str) -> Option<f64> {
    let words = words(name);
    let unit = |word: &String| match word.as_str() {
        "ns" | "nsec" | "nanoseconds" => Some(1e-9),
        "us" | "usec" | "microseconds" => Some(1e-6),
        "ms" | "msec" | "milliseconds" => Some(1e-3),
        "s" | "sec" | "seconds" | "secs" => Some(1.0),
        _ => None,
    };
    words.iter().find_map(unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Column;

    fn role_of(table: &str, name: &str) -> Option<(Quantity, bool)> {
        let (base, label) = split(name);
        let group = Group { base, labels: vec![label], names: vec![name.to_owned()], at: vec![0] };
        role(table, &group).map(|role| (role.quantity, role.desired))
    }

    #[test]
    fn names_of_many_programs_are_understood() {
        use Quantity::{Position, Torque, Velocity};
        let bag = "/franka_robot_state_broadcaster/desired_joint_states";
        for (table, name, expected) in [
            ("rows", "q[3]", Some((Position, false))),
            ("rows", "q_d[3]", Some((Position, true))),
            ("rows", "dq_4", Some((Velocity, false))),
            ("rows", "tau_J[0]", Some((Torque, false))),
            ("rows", "tau_J_d[0]", Some((Torque, true))),
            ("rows", "cmd.q_d[0]", Some((Position, true))),
            ("rows", "q1", Some((Position, false))),
            ("rows", "joint3_pos", Some((Position, false))),
            ("rows", "shoulder_pan.pos", Some((Position, false))),
            ("rows", "elbow_velocity", Some((Velocity, false))),
            ("rows", "q_des2", Some((Position, true))),
            ("frames", "observation.state[elbow.pos]", Some((Position, false))),
            ("frames", "action[elbow.pos]", Some((Position, true))),
            (bag, "position[fr3_joint1]", Some((Position, true))),
            ("control.csv", "positions[Jaw]", Some((Position, true))),
            ("state_motor.csv", "torques[Jaw]", Some((Torque, false))),
            ("rows", "tau_ext_hat_filtered[2]", None),
            ("rows", "ddq_d[2]", None),
            ("rows", "O_T_EE[2]", None),
            ("/object/pose", "pose.position.z", None),
            ("rows", "object_pos_x", None),
            ("rows", "actual_qd_3", Some((Velocity, false))),
            ("rows", "target_moment_3", Some((Torque, true))),
            ("rows", "Jnt3PosActl", Some((Position, false))),
            ("rows", "field.position3", Some((Position, false))),
            ("rows", "obs.robot0_joint_pos_sin[3]", None),
            ("rows", "obs.robot0_eef_quat[3]", None),
            ("rows", "joint_stiffness[3]", None),
            ("rows", "temperature1", None),
            ("rows", "time", None),
        ] {
            assert_eq!(role_of(table, name), expected, "{table}: {name}");
        }
    }

    #[test]
    fn columns_of_one_quantity_are_found_together() {
        let column = |name: &str| Column { name: name.into(), values: vec![] };
        let names = ["t", "j1_pos", "j1_vel", "j2_pos", "j2_vel"];
        let table = Table { columns: names.map(column).to_vec(), ..Table::default() };
        let found = groups(&table);
        assert_eq!(found.iter().map(|group| group.base.as_str()).collect::<Vec<_>>(), ["t", "pos", "vel"]);
        assert_eq!(
            (found[1].labels.clone(), found[1].names.clone()),
            (vec!["j1".into(), "j2".into()], vec!["j1_pos".into(), "j2_pos".into()])
        );
    }

    #[test]
    fn the_pose_of_a_hand_is_no_joints() {
        let labels = |list: &str| list.split(' ').map(str::to_owned).collect::<Vec<_>>();
        for (list, expected) in [
            ("x y z roll pitch yaw gripper", true),
            ("x y z rx ry rz", true),
            ("eef_x eef_y eef_z eef_roll eef_pitch eef_yaw", true),
            ("hand.position.x hand.position.y hand.position.z", true),
            ("roll pitch yaw", true),
            ("x y z axis_angle1 axis_angle2 axis_angle3", true),
            ("shoulder_pan shoulder_lift elbow_flex wrist_flex wrist_roll", false),
            ("shoulder_pitch shoulder_roll shoulder_yaw elbow_pitch wrist_yaw", false),
            ("0 1 2", false),
        ] {
            assert_eq!(are_pose(&labels(list)), expected, "{list}");
        }
    }

    #[test]
    fn a_pose_among_joints_is_told_from_them() {
        let labels = ["tool_x", "tool_y", "tool_z", "tool_rx", "base", "wrist_roll"].map(str::to_owned);
        assert_eq!(pose_among(&labels), [0, 1, 2, 3]);
        assert!(pose_among(&labels[3..]).is_empty());
    }

    #[test]
    fn time_is_known_by_its_name_and_unit() {
        assert!(is_time("time_ms") && is_time("timestamp") && is_time("header.stamp") && !is_time("q_time"));
        assert_eq!((time_unit("time_ms"), time_unit("t_ns"), time_unit("time")), (Some(1e-3), Some(1e-9), None));
    }
}
