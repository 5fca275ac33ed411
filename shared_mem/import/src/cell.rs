//! The cell.toml of an imported session: what the log tells, and for the rest what is usual, with a comment that says so.

use crate::log::Log;
use serde::Serialize;
use shared_mem::cell::ClipEntry;

/// Parts of joint names that say that an arm is built like the FR3.
const FAMILY: [&str; 4] = ["fr3", "fer", "panda", "franka"];

/// A `[controller]` block for an arm of which nobody said how it is controlled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UsualController {
    /// What it is taken from, and what to do about it: one sentence or two.
    pub remark: &'static str,
    /// The block as TOML.
    pub toml: &'static str,
}

const FRANKA_CONTROLLER: UsualController = UsualController {
    remark: "No log says how the arm is controlled. These are the usual gains of a Franka's joint impedance, with wide ranges to \
             look for the true ones in: write yours where you know them.",
    toml: "\
[controller]
kind = \"joint_impedance\"
stiffness = [600, 600, 600, 600, 250, 150, 50]
stiffness_range = [10.0, 20000.0]
damping = [50, 50, 50, 50, 30, 25, 15]
damping_range = [0.5, 1000.0]
rotor_inertia = [0.195, 0.195, 0.195, 0.195, 0.074, 0.074, 0.074]
torque_limit = [87, 87, 87, 87, 12, 12, 12]
",
};

const SERVO_CONTROLLER: UsualController = UsualController {
    remark: "No log says how the joints are controlled. Servos are taken, with wide ranges to look for their gains in: write \
             yours where you know them.",
    toml: "\
[controller]
kind = \"joint_pd\"
stiffness_range = [0.5, 2000.0]
damping_range = [0.0, 200.0]
",
};

/// What is usual for an arm with joints of these names: a Franka's joint impedance, or servos.
///
/// ```
/// use import::{is_franka, usual_controller};
///
/// let joints: Vec<String> = (1..=7).map(|number| format!("panda_joint{number}")).collect();
/// assert!(is_franka(&joints));
/// assert!(usual_controller(&joints).toml.contains("joint_impedance"));
/// assert!(usual_controller(&["shoulder".to_owned()]).toml.contains("joint_pd"));
/// ```
pub fn usual_controller(joints: &[String]) -> UsualController {
    if is_franka(joints) { FRANKA_CONTROLLER } else { SERVO_CONTROLLER }
}

/// File of a session that holds what the log says the robot is.
pub(crate) const URDF: &str = "robot.urdf";

/// The file's text without clips, for these joints; `base`: the link on which the arm stands, where the log's own URDF lies beside
/// the file.
pub(crate) fn proposed(log: &Log, joints: &[String], base: Option<&str>) -> String {
    let from = match &log.facts.robot {
        Some(robot) => format!("{}, robot `{robot}`", log.format),
        None => log.format.to_owned(),
    };
    let head = format!(
        "# Written by `calibration import` from a log ({from}). What it does not tell is taken as usual: look through it.\n"
    );
    let head = format!("{}\n", shared_mem::printable::one_line(head.trim_end()));
    if joints.is_empty() {
        return head;
    }
    if let Some(base) = base {
        let base = toml_value(base);
        let robot =
            format!("[robot]\nurdf = \"{URDF}\"            # the log's robot_description\nbase_frame = {base}\n");
        return format!("{head}{robot}\n{}", controller(joints));
    }
    if is_franka(joints) {
        let robot = "[robot]\nmodel = \"fr3\"                 # a Panda is built alike, of other masses: for one, give its urdf instead\n\
                     base_frame = \"fr3_link0\"\n";
        return format!("{head}{robot}\n{}", controller(joints));
    }
    let robot = format!(
        "[robot]\n# One second-order model a joint; with a URDF the arm's own: urdf = \"robot.urdf\" in place of joints.\njoints = {}\n",
        toml_value(joints)
    );
    format!("{head}{robot}\n{}", controller(joints))
}

/// Rotors that stand in for the inertia of joints that move none in an arm's description.
pub struct Rotors {
    pub without_inertia: Vec<String>,
    /// Of every joint [kg m²].
    pub rotor_inertia: Vec<f64>,
}

/// What is said of joints that move no inertia.
pub(crate) fn stand_in(rotors: &Rotors) -> String {
    format!(
        "{} moves no inertia in it: a servo's rotor stands in, `rotor_inertia` in [controller]",
        rotors.without_inertia.join(", ")
    )
}

/// The text with rotors, where its `[controller]`, the last block, has none.
pub(crate) fn with_rotors(text: String, rotors: Option<&Rotors>) -> String {
    match rotors.filter(|_| !text.contains("\nrotor_inertia")) {
        Some(rotors) => {
            let (why, numbers) = (stand_in(rotors), toml_value(&rotors.rotor_inertia));
            format!("{text}# {why}; write the motors' own.\nrotor_inertia = {numbers}\n")
        }
        None => text,
    }
}

/// The block with its remark above it.
fn controller(joints: &[String]) -> String {
    let UsualController { remark, toml } = usual_controller(joints);
    format!("# {remark}\n{toml}")
}

/// Whether these are the seven joints of a Franka, in their order.
pub fn is_franka(joints: &[String]) -> bool {
    let numbered = |(i, name): (usize, &String)| {
        let name = name.to_ascii_lowercase();
        name.ends_with(&format!("joint{}", i + 1)) && FAMILY.iter().any(|arm| name.contains(arm))
    };
    joints.len() == 7 && joints.iter().enumerate().all(numbered)
}

/// The `[[clip]]` blocks.
pub(crate) fn clips(entries: &[ClipEntry]) -> String {
    let block = |entry: &ClipEntry| {
        let (file, kind) = (toml_value(&entry.file), toml_value(entry.kind));
        format!("\n[[clip]]\nfile = {file}\nkind = {kind}\n")
    };
    entries.iter().map(block).collect()
}

fn toml_value(value: impl Serialize) -> String {
    let mut toml = String::new();
    // Strings, lists of them and names of variants have a form.
    if value.serialize(toml::ser::ValueSerializer::new(&mut toml)).is_err() {
        toml.clear();
    }
    toml
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::{Cell, ClipKind};
    use std::path::Path;

    #[test]
    fn what_is_proposed_is_a_cell_whatever_the_joints_are_called() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let fr3: Vec<String> = (1..=7).map(|i| format!("panda_joint{i}")).collect();
        for joints in [fr3, names(&["shoulder \"pan\"", "a\nb"]), names(&["joint1"]), vec![]] {
            let entries = [ClipEntry { file: "a b.mcap".into(), kind: ClipKind::Excitation }];
            let text = proposed(&Log { format: "text table", ..Log::default() }, &joints, None) + &clips(&entries);
            let cell = Cell::parse(&text, Path::new("cell.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(cell.clips, entries);
            assert_eq!(cell.robot.is_some(), !joints.is_empty());
            if joints.len() < 7 && !joints.is_empty() {
                assert_eq!(cell.robot.map(|robot| robot.joints), Some(joints));
            }
        }
    }
}
