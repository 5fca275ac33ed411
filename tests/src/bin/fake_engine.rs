//! An engine for `--engine`, as docs/engine.md describes one: the twin's own cell behind the protocol, which may fail.
//!
//! `fake_engine [--effects none|NAME,..] [--parameters none|NAME,..] [--protocol N] [--carries KG] [--slippery SHARE] [--ends-after N]
//! [--silent-after N] [--short-after N] [--nan-after N] [--stretched-after N] [--counts FILE]`
//! It shares no code with the other side of the pipe.

use clap::Parser;
use serde_json::{Value, json};
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::JointSeries;
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use twin::arm::{ArmModel, JointState};
use twin::control::{CommandTrack, Plant, Reading};
use twin::effects::{Effects, Stage, registry};
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};

/// What the engine is, and when it fails.
#[derive(Parser)]
struct Arguments {
    /// The effects that it knows; all of them where nothing is said.
    #[arg(long)]
    effects: Option<String>,
    /// What of gains and object it can set; all of it where nothing is said.
    #[arg(long)]
    parameters: Option<String>,
    /// The version that it speaks: 1 knows no object.
    #[arg(long, default_value_t = 2)]
    protocol: u32,
    /// By so much the friction of its own table is below the one that is asked for.
    #[arg(long, default_value_t = 0.0)]
    slippery: f64,
    /// What the arm of its own model carries besides [kg].
    #[arg(long, default_value_t = 0.0)]
    carries: f64,
    /// It ends in the roll-out behind so many.
    #[arg(long)]
    ends_after: Option<usize>,
    /// It answers no more behind so many.
    #[arg(long)]
    silent_after: Option<usize>,
    /// It sends a number too few behind so many.
    #[arg(long)]
    short_after: Option<usize>,
    /// It sends what is no number behind so many.
    #[arg(long)]
    nan_after: Option<usize>,
    /// It sends orientations twice as long as they should be behind so many.
    #[arg(long)]
    stretched_after: Option<usize>,
    /// A file that grows by a byte with each answer: the answers of all its processes count together.
    #[arg(long)]
    counts: Option<PathBuf>,
}

fn receive(from: &mut impl Read) -> Option<(Value, Vec<f64>)> {
    let mut word = || {
        let mut bytes = [0; 4];
        from.read_exact(&mut bytes).ok().map(|()| u32::from_le_bytes(bytes) as usize)
    };
    let (text, numbers) = (word()?, word()?);
    let mut body = vec![0; text + 8 * numbers];
    from.read_exact(&mut body).ok()?;
    let numbers = body[text..].chunks(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight bytes")));
    Some((serde_json::from_slice(&body[..text]).expect("JSON"), numbers.collect()))
}

fn send(to: &mut impl Write, head: &Value, numbers: &[f64]) {
    let text = head.to_string();
    let mut bytes = Vec::new();
    for length in [text.len(), numbers.len()] {
        bytes.extend(u32::try_from(length).expect("short").to_le_bytes());
    }
    bytes.extend(text.as_bytes());
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    to.write_all(&bytes).and_then(|()| to.flush()).expect("a reader");
}

fn hello(arguments: &Arguments) -> Value {
    let among = |names: &Option<String>, name: &str| match names {
        None => true,
        Some(names) => names.split(',').any(|known| known == name),
    };
    let object = arguments.protocol > 1;
    let simulated = |stage| stage == Stage::Control || (object && stage != Stage::Camera);
    let arm = registry().iter().filter(|effect| simulated(effect.stage) && among(&arguments.effects, effect.name));
    let effects: serde_json::Map<String, Value> = arm
        .map(|effect| (effect.name.to_owned(), effect.parameters.iter().map(|p| p.name).collect::<Vec<_>>().into()))
        .collect();
    let all = ["stiffness", "damping", "friction", "mass", "centre_of_mass", "tip_friction"];
    let all = if object { &all[..] } else { &all[..2] };
    let parameters: Vec<_> = all.iter().filter(|name| among(&arguments.parameters, name)).collect();
    let mut hello = json!({"message": "hello", "protocol": arguments.protocol, "name": "fake engine", "parameters": parameters,
           "effects": effects, "readings": ["q", "dq", "tau_J", "tau_J_d"]});
    if object {
        hello["object"] = json!(true);
    }
    hello
}

/// Parameters as theta.toml has them.
fn theta(head: &Value, Arguments { carries, slippery, .. }: &Arguments) -> Theta {
    let mut effects = head["effects"].as_array().expect("a list").clone();
    for value in effects.iter_mut().flat_map(|effect| effect.as_object_mut().expect("an object").values_mut()) {
        if let Value::Array(numbers) = value {
            // What has no bound, in the words of TOML's reader: far away.
            numbers.iter_mut().filter(|number| number.is_null()).for_each(|number| *number = json!(1e300));
        }
    }
    if *carries > 0.0 && !effects.iter().any(|effect| effect["name"] == "payload") {
        effects.push(json!({"name": "payload", "mass": carries, "centre": [0.0, 0.0, 0.05]}));
    }
    let mut theta = json!({"effect": effects});
    if !head["parameters"].as_object().expect("a table").is_empty() {
        theta["arm"] = head["parameters"].clone();
    }
    if let Some(object) = head["object"].as_object() {
        let of = |name: &str| object[name].clone();
        let friction = (1.0 - slippery) * of("friction").as_f64().expect("a number");
        theta["object"] = json!({"friction": friction, "mass": of("mass"), "centre_of_mass": of("centre_of_mass"),
                                 "tip_friction": of("tip_friction")});
    }
    serde_json::from_value(theta).expect("parameters")
}

fn roll_out(head: &Value, numbers: &[f64], cell: &Cell, arguments: &Arguments) -> Vec<f64> {
    let size = |key: &str| usize::try_from(head[key].as_u64().expect("a count")).expect("small");
    let (dof, before, ticks, rows) = (size("dof"), size("before"), size("ticks"), size("rows"));
    let mut rest = numbers;
    let mut take = |count: usize| {
        let (taken, behind) = rest.split_at(count);
        rest = behind;
        taken
    };
    let mut start = JointState::default();
    start.q[..dof].copy_from_slice(take(dof));
    start.dq[..dof].copy_from_slice(take(dof));
    let mut desired = JointSeries { dof, ..JointSeries::default() };
    for (tick, row) in take((before + ticks) * 2 * dof).chunks(2 * dof).enumerate() {
        desired.stamps_ns.push(tick as u64 * TICK_NS);
        desired.q.extend(&row[..dof]);
        desired.dq.extend(&row[dof..]);
    }
    let start_ns = before as u64 * TICK_NS;
    let mut stamps =
        |count| -> Vec<u64> { take(count).iter().map(|time| start_ns + (time * 1e9).round() as u64).collect() };
    let at_ns = stamps(rows);
    let theta = theta(head, arguments);
    let commands = CommandTrack::new(&desired).expect("commands");
    let (mut readings, mut poses) = (vec![Reading::default(); rows], Vec::new());
    if let Some(object) = head["object"].as_object() {
        let poses_ns = stamps(usize::try_from(object["poses"].as_u64().expect("a count")).expect("small"));
        let mut rollout = CellRollout::new(cell, Some(&theta)).expect("a cell");
        rollout.start(start_ns, Some(&start), Some(&ObjectState::at_rest(standing(object))), Some(&commands));
        let mut trace = CellTrace::default();
        rollout.run(&Course { commands: Some(&commands), joints_ns: &at_ns, poses_ns: &poses_ns }, &mut trace);
        (readings, poses) = (trace.joints, trace.poses);
    } else {
        let nominal = ArmModel::from_cell(cell).expect("an arm");
        let effects = Effects::from_theta(&theta.effects, dof).expect("effects");
        let plant = Plant::new(cell, nominal, Some(&theta), &effects.arm).expect("gains");
        plant.rollout().readings(&start, start_ns, &commands, &at_ns, &mut readings);
    }
    let mut out = Vec::new();
    for reading in &readings {
        for name in head["readings"].as_array().expect("a list") {
            out.extend_from_slice(match name.as_str() {
                Some("q") => &reading.state.q[..dof],
                Some("dq") => &reading.state.dq[..dof],
                Some("tau_J") => &reading.tau_J[..dof],
                _ => &reading.tau_J_d[..dof],
            });
        }
    }
    for pose in poses {
        out.extend(pose.position());
        out.extend(pose.wxyz());
    }
    out
}

/// Where the object stands at the start.
fn standing(object: &serde_json::Map<String, Value>) -> Pose<Base, Object> {
    let position = serde_json::from_value(object["position"].clone()).expect("three numbers");
    let orientation = serde_json::from_value(object["orientation"].clone()).expect("four numbers");
    Pose::from_parts(position, orientation).expect("a pose")
}

fn main() {
    let arguments = Arguments::parse();
    let (mut from, mut to) = (std::io::stdin().lock(), std::io::stdout().lock());
    let (mut cell, mut answered) = (None, 0);
    while let Some((head, numbers)) = receive(&mut from) {
        if head["message"] == "hello" {
            let text = toml_of(&head["cell"]);
            cell = Some(Cell::parse(&text, Path::new("cell.toml")).expect("a cell.toml"));
            send(&mut to, &hello(&arguments), &[]);
            continue;
        }
        if let Some(file) = &arguments.counts {
            answered = std::fs::metadata(file).map_or(0, |file| usize::try_from(file.len()).expect("few"));
        }
        let behind = |limit: Option<usize>| limit.is_some_and(|limit| answered >= limit);
        if behind(arguments.ends_after) {
            std::process::exit(9);
        }
        if behind(arguments.silent_after) {
            std::thread::sleep(Duration::from_secs(3600));
        }
        let mut states = roll_out(&head, &numbers, cell.as_ref().expect("a greeting first"), &arguments);
        if behind(arguments.short_after) {
            states.pop();
        }
        if behind(arguments.nan_after) {
            states[0] = f64::NAN;
        }
        if behind(arguments.stretched_after) {
            states.iter_mut().rev().take(4).for_each(|part| *part *= 2.0);
        }
        send(&mut to, &json!({"message": "states"}), &states);
        answered += 1;
        if let Some(file) = &arguments.counts {
            let file = OpenOptions::new().create(true).append(true).open(file);
            file.and_then(|mut file| file.write_all(b".")).expect("room");
        }
    }
}

/// JSON is no TOML, but each of its values can be written as one: tables inline.
fn toml_of(value: &Value) -> String {
    fn inline(value: &Value) -> String {
        match value {
            Value::Object(table) => {
                let pairs: Vec<String> =
                    table.iter().map(|(key, value)| format!("{key} = {}", inline(value))).collect();
                format!("{{ {} }}", pairs.join(", "))
            }
            Value::Array(values) => format!("[{}]", values.iter().map(inline).collect::<Vec<_>>().join(", ")),
            other => other.to_string(),
        }
    }
    let table = value.as_object().expect("a table");
    table.iter().map(|(key, value)| format!("{key} = {}\n", inline(value))).collect()
}
