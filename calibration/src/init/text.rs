//! The text of a cell.toml: every key with its meaning above it, out of the schema of the types that read it. What is known
//! stands as a value; all else is a comment that becomes a value where its `#` is taken away.

use super::known::Known;
use serde::Serialize;
use serde_json::Value;
use shared_mem::cell::Cell;
use std::fmt::Write as _;

/// Blocks and their keys in the order of the file, each key with an example.
pub(super) const BLOCKS: [(&str, &[(&str, &str)]); 13] = [
    (
        "robot",
        &[
            ("model", "\"fr3\""),
            ("urdf", "\"arm.urdf\""),
            ("joints", "[\"shoulder\", \"elbow\"]"),
            ("base_frame", "\"fr3_link0\""),
        ],
    ),
    (
        "controller",
        &[
            ("kind", "\"joint_impedance\""),
            ("stiffness", "[600, 600, 600, 600, 250, 150, 50]"),
            ("damping", "[50, 50, 50, 50, 30, 25, 15]"),
            ("stiffness_range", "[10.0, 20000.0]"),
            ("damping_range", "[0.5, 1000.0]"),
            ("rotor_inertia", "[0.195, 0.195, 0.195, 0.195, 0.074, 0.074, 0.074]"),
            ("torque_limit", "[87, 87, 87, 87, 12, 12, 12]"),
            ("integral_rate", "[3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0]"),
            ("voltage_limit", "[60, 60, 60, 60, 9, 9, 9]"),
            ("torque_constant", "[12.1, 12.1, 12.1, 12.1, 4.2, 4.2, 4.2]"),
            ("torque_sensing", "\"motor\""),
            ("between_commands", "\"held\""),
        ],
    ),
    ("tool", &[("mass", "0.25"), ("length", "0.16"), ("radius", "0.012")]),
    ("table", &[("height", "0.0")]),
    ("topics", &[("measured", "\"/joint_states\""), ("desired", "\"/commands\""), ("object_pose", "\"/box\"")]),
    (
        "object",
        &[
            ("name", "\"milk_box\""),
            ("topic", "\"/vicon/milk_box\""),
            ("shape", "\"box\""),
            ("mesh", "\"mug.obj\""),
            ("urdf", "\"laptop.urdf\""),
            ("hold", "\"fixed\""),
            ("joints", "{ hinge = -0.3 }"),
            ("splats", "\"mug/splats.ply\""),
            ("size", "[0.08, 0.06, 0.10]"),
            ("start", "[0.5, 0.2]"),
            ("start_yaw", "0.3"),
            ("support", "\"uniform\""),
            ("mass", "0.31"),
            ("mass_range", "[0.1, 1.0]"),
            ("friction_range", "[0.1, 0.8]"),
            ("centre_of_mass_range", "[[-0.02, 0.02], [-0.02, 0.02], [-0.02, 0.02]]"),
            ("tip_friction_range", "[0.0, 0.5]"),
            ("restitution_range", "[0.0, 0.2]"),
            ("friction_scatter", "0.02"),
            ("pose_noise", "{ position = 0.0007, rotation = 0.005 }"),
        ],
    ),
    ("background", &[("splats", "\"scene.ply\"")]),
    (
        "camera",
        &[
            ("width", "1280"),
            ("height", "720"),
            ("rate", "60.0"),
            ("intrinsics", "{ fx = 608.6, fy = 608.6, cx = 319.5, cy = 239.5 }"),
            ("distortion", "[0.1, -0.2, 0.0, 0.0, 0.0]"),
            ("pose", "{ position = [1.35, 0.0, 0.75], orientation = [0.290851, -0.644520, -0.644520, 0.290851] }"),
            ("latency", "0.009"),
        ],
    ),
    ("gripper", &[("model", "\"franka_hand\""), ("stroke", "0.08"), ("counts", "[3, 228]")]),
    (
        "wrench",
        &[
            ("can_id", "0x30"),
            ("rate", "1000.0"),
            ("force_range", "200.0"),
            ("torque_range", "10.0"),
            ("noise", "{ force = 0.1, torque = 0.005 }"),
        ],
    ),
    ("tolerance", &[("joint", "0.0005"), ("torque", "0.2"), ("position", "0.002")]),
    (
        "simulation",
        &[
            ("q", "[0.0, -0.3, 0.0, -2.2, 0.0, 1.9, 0.79]"),
            ("object_position", "[0.55, 0.0]"),
            ("object_yaw", "0.3"),
            ("q_noise", "2e-6"),
            ("dq_noise", "1e-4"),
            ("q_step", "1e-5"),
            ("dq_step", "1e-3"),
            ("seed", "1"),
        ],
    ),
    (CLIP, &[("file", "\"clip_00.mcap\""), ("kind", "\"excitation\"")]),
];
/// The block that stands once a clip.
const CLIP: &str = "clip";
/// Columns of the file.
const WIDTH: usize = 118;

const HEAD: &str = "\
# What the laboratory knows about this cell, written by `calibration init`. Units are SI, quaternions w, x, y, z, relative paths
# start in the folder of this file. A line that begins with # and a key stands for something that is not known: take the #
# away (that of its [block], too) and write yours. docs/cell.md describes every key, `calibration check` says what a session
# lacks.
";

/// Blocks of which nothing is known.
pub(super) fn not_known(cell: &Cell) -> Vec<&'static str> {
    let table = values(cell);
    BLOCKS.iter().map(|(block, _)| *block).filter(|block| !table.contains_key(*block)).collect()
}

pub(super) fn of(known: &Known) -> String {
    let (schema, values) = (Cell::schema(), values(&known.cell));
    let mut text = HEAD.to_owned();
    for (block, keys) in BLOCKS {
        let about = Block { schema: &schema, name: block, keys };
        if block != CLIP {
            let remarks: Vec<&str> =
                known.remarks.iter().filter(|(of, _)| *of == block).map(|(_, text)| text.as_str()).collect();
            about.write(&mut text, values.get(block).and_then(toml::Value::as_table), &remarks);
            continue;
        }
        let clips = values.get(block).and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
        if clips.is_empty() {
            about.write(&mut text, None, &[]);
        }
        for (number, (clip, recorded)) in clips.iter().zip(&known.recorded).enumerate() {
            if number == 0 {
                about.write(&mut text, clip.as_table(), &[recorded]);
            } else {
                about.again(&mut text, clip.as_table(), recorded);
            }
        }
    }
    text
}

/// The cell as TOML has it; what is at its default is left out where the reader would take it so.
fn values(cell: &Cell) -> toml::Table {
    // Numbers, strings, arrays and tables have a form.
    toml::Table::try_from(cell).unwrap_or_default()
}

/// A block of the file, and what the schema says about it.
struct Block<'a> {
    schema: &'a Value,
    name: &'static str,
    keys: &'static [(&'static str, &'static str)],
}

impl Block<'_> {
    fn write(&self, text: &mut String, known: Option<&toml::Table>, remarks: &[&str]) {
        let property = &self.schema["properties"][self.name];
        let block = definition(self.schema, property);
        text.push('\n');
        comment(text, property["description"].as_str().or(block["description"].as_str()).unwrap_or(""));
        remarks.iter().for_each(|remark| comment(text, remark));
        let mark = if known.is_some() { "" } else { "#" };
        let _written = writeln!(text, "{mark}{}", self.header());
        for (key, example) in self.keys {
            let property = &block["properties"][key];
            let is_needed =
                block["required"].as_array().is_some_and(|needed| needed.iter().any(|needed| needed == key));
            comment(text, &self.meaning(property, is_needed));
            let value = known.and_then(|known| known.get(*key));
            let _written = match value {
                Some(value) => writeln!(text, "{key} = {}", inline(value)),
                None => writeln!(text, "#{key} = {example}"),
            };
        }
    }

    /// One more block of the same name, without what was said already.
    fn again(&self, text: &mut String, known: Option<&toml::Table>, remark: &str) {
        text.push('\n');
        comment(text, remark);
        let _written = writeln!(text, "{}", self.header());
        for (key, value) in self.keys.iter().filter_map(|(key, _)| Some((key, known?.get(*key)?))) {
            let _written = writeln!(text, "{key} = {}", inline(value));
        }
    }

    fn header(&self) -> String {
        if self.name == CLIP { format!("[[{}]]", self.name) } else { format!("[{}]", self.name) }
    }

    /// What a key means, what it may be, and what holds without it.
    fn meaning(&self, property: &Value, is_needed: bool) -> String {
        let mut text = property["description"].as_str().unwrap_or("").replace('\n', " ");
        let variants = definition(self.schema, property)["oneOf"].as_array().cloned().unwrap_or_default();
        let named = |variant: &Value| {
            let meaning = variant["description"].as_str().unwrap_or("").replace('\n', " ");
            Some(format!("{}: {}", variant["const"].as_str()?, meaning.trim_end_matches('.')))
        };
        let variants: Vec<String> = variants.iter().filter_map(named).collect();
        if !variants.is_empty() {
            text += &format!(" {}.", variants.join("; "));
        }
        match &property["default"] {
            _ if is_needed => text += " Needed.",
            Value::Null => {}
            Value::Array(list) if list.is_empty() => {}
            Value::Object(_) => {}
            default => text += &format!(" Default: {default}."),
        }
        text
    }
}

/// The definition that a property refers to, by itself, or as one of several, or as the items of a list, and on to what that one
/// refers to in the same way; the property where it refers to none.
pub(super) fn definition<'a>(schema: &'a Value, property: &'a Value) -> &'a Value {
    fn reference(value: &Value) -> Option<&str> {
        let of_any = || value["anyOf"].as_array()?.iter().find_map(reference);
        value["$ref"].as_str().or_else(of_any).or_else(|| value["items"]["$ref"].as_str())
    }
    let name = reference(property).and_then(|path| path.strip_prefix("#/$defs/"));
    name.map_or(property, |name| definition(schema, &schema["$defs"][name]))
}

/// Text as comments, in lines that a terminal holds.
fn comment(text: &mut String, words: &str) {
    let mut line = String::from("#");
    for word in words.split_whitespace() {
        if line.len() + 1 + word.len() > WIDTH {
            let _written = writeln!(text, "{line}");
            "#".clone_into(&mut line);
        }
        line = line + " " + word;
    }
    if line.len() > 1 {
        let _written = writeln!(text, "{line}");
    }
}

/// A value in one line.
fn inline(value: &toml::Value) -> String {
    let mut text = String::new();
    match value.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text,
        // Every value has a form.
        Err(_) => value.to_string(),
    }
}
