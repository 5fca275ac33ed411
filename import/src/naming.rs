//! What the names of columns say: which of them belong together, and which quantity they may be.

use crate::log::Table;
use std::collections::{HashMap, HashSet};

/// Columns of one quantity: `q[0]` to `q[6]`, `joint1_pos` to `joint6_pos`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Group {
    /// What they have in common: `q`, `joint_pos`.
    pub(crate) base: String,
    /// What tells them apart, as a number or a joint's name; empty where there is one.
    pub(crate) labels: Vec<String>,
    /// Their names.
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

const VELOCITY: [&str; 10] = ["dq", "vel", "velocity", "velocities", "speed", "speeds", "qvel", "qdot", "qd", "vels"];
const TORQUE: [&str; 10] =
    ["tau", "effort", "efforts", "torque", "torques", "trq", "qfrc", "load", "moment", "moments"];
/// With what is short for a joint or an axis in the logs of industrial arms.
const POSITION: [&str; 24] = [
    "q",
    "pos",
    "position",
    "positions",
    "qpos",
    "jpos",
    "posn",
    "psn",
    "angle",
    "angles",
    "ang",
    "theta",
    "joint",
    "joints",
    "jnt",
    "jt",
    "j",
    "axis",
    "axes",
    "ax",
    "state",
    "action",
    "dof",
    "actions",
];
const DESIRED: [&str; 23] = [
    "d",
    "des",
    "desired",
    "cmd",
    "cmnd",
    "command",
    "commands",
    "commanded",
    "target",
    "targets",
    "tgt",
    "goal",
    "ref",
    "reference",
    "action",
    "actions",
    "control",
    "setpoint",
    "setpoints",
    "soll",
    "planned",
    "nominal",
    "leader",
];
/// What a measurement is called.
const MEASURED: [&str; 11] =
    ["measured", "meas", "msr", "actual", "actl", "act", "feedback", "fbk", "ist", "encoder", "enc"];
/// Words of angles before the gear.
const MOTOR: [&str; 2] = ["motor", "rotor"];
/// Words of where a hand is, or how it is turned; a joint has no such thing.
const POSE: [&str; 12] =
    ["pose", "quat", "quaternion", "orientation", "rotvec", "rpy", "euler", "xyz", "translation", "ee", "eef", "tcp"];
/// Columns of these words are something else: external torques, tool poses, errors, second derivatives, gains, sines of angles.
const OTHER: [&str; 60] = [
    "ext",
    "hat",
    "filtered",
    "error",
    "errors",
    "err",
    "ddq",
    "acc",
    "accel",
    "acceleration",
    "accelerations",
    "ee",
    "eef",
    "tcp",
    "cartesian",
    "wrench",
    "force",
    "forces",
    "temp",
    "temperature",
    "temperatures",
    "voltage",
    "current",
    "currents",
    "collision",
    "contact",
    "covariance",
    "dtau",
    "dtheta",
    "index",
    "success",
    "rate",
    "count",
    "mode",
    "min",
    "max",
    "mean",
    "std",
    "lower",
    "upper",
    "limit",
    "limits",
    "elbow",
    "dp",
    "sin",
    "cos",
    "sine",
    "cosine",
    "stiffness",
    "damping",
    "gain",
    "gains",
    "kp",
    "kd",
    "ki",
    "impedance",
    "inertia",
    "gravity",
    "coriolis",
    "friction",
];
/// Words at the end of a name that say what the joint before them did.
const ENDINGS: [&str; 14] = [
    "pos", "position", "angle", "q", "vel", "velocity", "dq", "effort", "torque", "tau", "cmd", "command", "target",
    "goal",
];
const TIME: [&str; 9] = ["t", "time", "timestamp", "timestamps", "stamp", "stamps", "seconds", "duration", "times"];

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

/// Name without what tells it from its neighbours, and that.
pub(crate) fn split(name: &str) -> (String, String) {
    if let Some((base, label)) = name.strip_suffix(']').and_then(|name| name.rsplit_once('[')) {
        return (base.to_owned(), label.to_owned());
    }
    if let Some((joint, ending)) = name.rsplit_once(['.', '_', '/', ' '])
        && ENDINGS.contains(&ending.to_ascii_lowercase().as_str())
        && !joint.is_empty()
        && !VELOCITY.contains(&joint)
        && !TORQUE.contains(&joint)
    {
        return (ending.to_ascii_lowercase(), joint.to_owned());
    }
    let last = name.rfind(|c: char| c.is_ascii_digit());
    if let Some(end) = last {
        let start = name[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + 1);
        let (head, tail) = (name[..start].trim_end_matches(['_', '.', '-', ' ']), &name[end + 1..]);
        return (format!("{head}{tail}"), name[start..=end].to_owned());
    }
    (name.to_owned(), String::new())
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
    let mut first: HashMap<String, usize> = HashMap::new();
    for (at, column) in table.columns.iter().enumerate() {
        let (base, label) = split(&column.name);
        // Without a label a column stands by itself.
        let known = first.get(&base).filter(|_| !label.is_empty());
        match known.and_then(|group| groups.get_mut(*group)) {
            Some(group) => {
                group.labels.push(label);
                group.names.push(column.name.clone());
                group.at.push(at);
            }
            None => {
                first.entry(base.clone()).or_insert(groups.len());
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
    let own = words(&group.base);
    let around = words(table);
    let has = |words: &[String], list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let quantity = if has(&own, &VELOCITY) {
        Quantity::Velocity
    } else if has(&own, &TORQUE) {
        Quantity::Torque
    } else if has(&own, &POSITION) || own == ["cmd"] || own == ["command"] || own == ["target"] || own == ["goal"] {
        Quantity::Position
    } else {
        return None;
    };
    let own_desired = has(&own, &DESIRED);
    let desired = own_desired || has(&around, &DESIRED);
    let mut score = 1;
    // The plain names of robotics, and what a publisher calls its own.
    score += 4 * u32::from(matches!(
        group.base.trim_start_matches("state."),
        "q" | "dq" | "tau_J" | "q_d" | "dq_d" | "tau_J_d"
    ));
    score += 2 * u32::from(has(&around, &["measured", "desired"]));
    score += u32::from(has(&own, &MEASURED));
    score += u32::from(own.iter().any(|word| word == "state") || has(&around, &["state", "states"]));
    score +=
        u32::from(matches!(group.base.as_str(), "position" | "velocity" | "effort" | "observation.state" | "action"));
    Some(Role { quantity, desired, score: score.saturating_sub(u32::from(has(&own, &MOTOR))) })
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
        all[0].iter().any(|before| all.iter().all(|there| there.contains(before)) && !(alone && !before.is_empty()))
    };
    together(["x", "y", "z"], false)
        || together(["rx", "ry", "rz"], false)
        || together(["roll", "pitch", "yaw"], true)
        || together(["qx", "qy", "qz"], false)
        || labels.iter().filter(|label| is_pose(label)).count() > 2
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
    fn time_is_known_by_its_name_and_unit() {
        assert!(is_time("time_ms") && is_time("timestamp") && is_time("header.stamp") && !is_time("q_time"));
        assert_eq!((time_unit("time_ms"), time_unit("t_ns"), time_unit("time")), (Some(1e-3), Some(1e-9), None));
    }
}
