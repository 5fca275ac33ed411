//! What help, documents and messages tell people to type: every verb, flag and path exists, every example is accepted, and
//! those that need no robot do what they say. Answers come on standard output, all else on standard error.

use shared_mem::cell::{Cell as CellToml, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{ClipInfo, ClipWriter};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tests::program_path;
use tests::texts::{PROGRAMS, Verb, code_in, documents, flags_in, literals, root, verbs};
use twin::control::Drive;
use twin::sim::SimCell;

/// Flags that programs give each other, or that belong to programs of others.
const OF_OTHERS: [&str; 11] = [
    "parent",
    "configuration",
    "shm-size",
    "features",
    "release",
    // Of ros2 topic echo.
    "csv",
    // Of Slurm.
    "job-name",
    "array",
    "cpus-per-task",
    "requeue",
    "open-mode",
];
/// A folder of the sources, and the verbs of which one must have the flags that its messages name.
const SPOKEN_BY: [(&str, &[&str]); 13] = [
    ("calibration/src/init/", &["calibration init"]),
    ("shared_mem/import/src/", &["calibration import"]),
    ("calibration/vision/src/viewpoint/", &["calibration viewpoint"]),
    ("calibration/vision/src/hand_eye/", &["calibration hand-eye"]),
    (
        "calibration/capture/src/",
        &["calibration capture excitation", "calibration capture control-hit-slide", "calibration capture scan"],
    ),
    ("calibration/src/demo/", &["calibration demo"]),
    ("rt_bridge/src/run/", &["rt_bridge run"]),
    ("rt_bridge/src/serve/", &["rt_bridge serve"]),
    ("rt_bridge/link/src/", &["rt_bridge link"]),
    ("twin/src/viewer/", &["twin shadow"]),
    ("twin/src/teleop/", &["twin teleop"]),
    ("twin/src/reconstruct/", &["twin label-splats"]),
    ("twin/reconstruct/src/", &["twin reconstruct object", "twin reconstruct articulated", "twin reconstruct scene"]),
];
/// Folders whose files are named in texts by their path.
const FOLDERS: [&str; 7] = ["shared_mem/", "twin/", "rt_bridge/", "calibration/", "tests/", "config/", "docs/"];

fn named(verb: &Verb) -> String {
    verb.path.join(" ")
}

/// The first verb or flag of a command that does not exist.
fn lacking(command: &str, verbs: &[Verb]) -> Option<String> {
    let command = command.split(" #").next().unwrap_or("");
    let mut words = command.split_whitespace().peekable();
    let mut path = vec![words.next()?.rsplit('/').next()?.to_owned()];
    let find = |path: &[String]| verbs.iter().find(|verb| verb.path == path);
    let mut verb = find(&path)?;
    while let Some(word) = words.peek() {
        path.push((*word).trim_end_matches([',', ';', '.', ')']).to_owned());
        let Some(deeper) = find(&path) else { break };
        (verb, _) = (deeper, words.next());
    }
    let has_verbs = verbs.iter().any(|other| other.path.len() > verb.path.len() && other.path.starts_with(&verb.path));
    let next = words.peek().filter(|word| word.starts_with(|c: char| c.is_ascii_lowercase()));
    if let (true, Some(word)) = (has_verbs, next) {
        return Some(format!("{} has no verb {word}", named(verb)));
    }
    let rest: Vec<&str> = words.take_while(|word| !["|", ">", "&&", "&"].contains(word)).collect();
    let below = |flag: &String| verbs.iter().any(|v| v.path.starts_with(&verb.path) && v.flags.contains(flag));
    let unknown =
        flags_in(&rest.join(" ")).into_iter().find(|flag| !OF_OTHERS.contains(&flag.as_str()) && !below(flag));
    unknown.map(|flag| format!("{} has no --{flag}", named(verb)))
}

fn is_own(code: &str) -> bool {
    let first = code.split_whitespace().next().unwrap_or("");
    PROGRAMS.contains(&first.trim_start_matches("./target/release/"))
}

#[test]
fn every_verb_and_flag_that_help_documents_and_messages_name_exists() {
    let verbs = verbs();
    let known: BTreeSet<&String> = verbs.iter().flat_map(|verb| &verb.flags).collect();
    let (mut wrong, mut commands) = (Vec::new(), 0);
    let mut look = |place: &str, command: &str| {
        commands += 1;
        wrong.extend(lacking(command, &verbs).map(|what| format!("{place}: {what} (in `{command}`)")));
    };
    for verb in &verbs {
        verb.examples().iter().for_each(|example| look(&named(verb), example));
        code_in(&verb.help).iter().filter(|code| is_own(code)).for_each(|code| look(&named(verb), code));
    }
    for (name, text) in documents() {
        code_in(&text).iter().filter(|code| is_own(code)).for_each(|code| look(&name, code));
    }
    let mut flags = Vec::new();
    for (file, text) in literals() {
        let code = code_in(&text);
        code.iter().filter(|code| is_own(code)).for_each(|code| look(&file, code));
        if is_own(&text) && text.contains(" --") {
            look(&file, &text.replace(':', ""));
        }
        // What stands in a command was looked at above, or is another program's.
        let own = code.iter().filter(|code| code.contains(' ')).fold(text.clone(), |t, c| t.replace(c, ""));
        if text.contains(' ') && !is_own(&text) {
            flags.extend(flags_in(&own).into_iter().map(|flag| (file.clone(), flag, text.clone())));
        }
    }
    for (file, flag, text) in &flags {
        let spoken = SPOKEN_BY.iter().find(|(folder, _)| file.starts_with(folder)).map(|(_, verbs)| *verbs);
        let has = match spoken {
            Some(by) => verbs.iter().any(|verb| by.contains(&named(verb).as_str()) && verb.flags.contains(flag)),
            None => known.contains(flag),
        };
        if !has && !OF_OTHERS.contains(&flag.as_str()) {
            wrong.push(format!("{file}: --{flag} does not exist (in {text:?})"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(commands > 150 && flags.len() > 30, "{commands} commands and {} flags found", flags.len());
}

#[test]
fn a_command_that_does_not_exist_is_found() {
    let verbs = verbs();
    for wrong in [
        "twin play session",
        "twin replay session --parameter x",
        "calibration identify mass x",
        "rt_bridge run --cel c",
    ] {
        assert!(lacking(wrong, &verbs).is_some(), "{wrong}");
    }
    for right in
        ["twin replay session --parameters=x # then", "rt_bridge doctor", "calibration identify arm s --out f > g"]
    {
        assert_eq!(lacking(right, &verbs), None, "{right}");
    }
}

#[test]
fn whatever_takes_a_session_takes_the_cell_that_a_clip_may_lack() {
    let lacks = |verb: &&Verb| {
        let usage = verb.help.lines().find(|line| line.starts_with("Usage:")).unwrap_or("");
        (usage.contains("<SESSION") || usage.contains("<TARGETS")) && !verb.flags.contains("cell")
    };
    let lacking: Vec<String> = verbs().iter().filter(lacks).map(named).collect();
    assert!(lacking.is_empty(), "no --cell: {lacking:?}");
}

#[test]
fn every_path_that_texts_name_exists() {
    let (mut wrong, mut broken) = (Vec::new(), Vec::new());
    let mut look = |place: &str, text: &str| {
        for word in text.split(|c: char| c.is_whitespace() || "`(),;\"<>|=".contains(c)) {
            let word = word.split('#').next().unwrap_or("").trim_end_matches(['.', ':']);
            let is_file = [".rs", ".md", ".toml", ".sh", ".py"].iter().any(|end| word.ends_with(end));
            let is_named = FOLDERS.iter().any(|folder| word.starts_with(folder)) && !word.contains(['{', '*', '$']);
            if is_named && (is_file || word.ends_with('/')) && !root().join(word).exists() {
                wrong.push(format!("{place}: {word}"));
            }
        }
    };
    for (name, text) in documents() {
        look(&name, &text);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or("");
            let from = root().join(&name);
            let beside = from.parent().map(|folder| folder.join(file));
            if !link.starts_with("http") && !file.is_empty() && !beside.is_some_and(|path| path.exists()) {
                broken.push(format!("{name}: {link}"));
            }
        }
    }
    verbs().iter().for_each(|verb| look(&named(verb), &verb.help));
    literals().iter().for_each(|(file, text)| look(file, text));
    wrong.extend(broken);
    assert!(wrong.is_empty(), "paths that do not exist:\n{}", wrong.join("\n"));
}

/// Starts a command in a folder.
fn start(folder: &Path, words: &[&str]) -> std::process::Child {
    Command::new(program_path(words[0]))
        .args(&words[1..])
        .current_dir(folder)
        .env("TWINALIGN_DOMAIN", format!("commands-{}", std::process::id()))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// The words of an example: what is said behind it, two spaces on, left out.
fn words(example: &str) -> Vec<&str> {
    let command = example.split(" #").next().unwrap_or("");
    let command = command.split("   ").next().unwrap_or("").split(" > ").next().unwrap_or("");
    command.split_whitespace().collect()
}

#[test]
fn every_example_is_accepted() {
    // Nothing of what the examples name lies here: what is accepted fails for that, with 1, or begins; what is not ends with 2.
    let folder = tempfile::tempdir().expect("a folder");
    let verbs = verbs();
    let examples: BTreeSet<String> = verbs.iter().flat_map(Verb::examples).collect();
    assert!(examples.len() > 60, "{} examples", examples.len());
    let mut open: Vec<(&String, std::process::Child)> =
        examples.iter().map(|example| (example, start(folder.path(), &words(example)))).collect();
    let (begin, mut wrong) = (Instant::now(), Vec::new());
    while !open.is_empty() && begin.elapsed() < Duration::from_secs(3) {
        open.retain_mut(|(example, child)| match child.try_wait() {
            Ok(Some(status)) => {
                if status.code() == Some(2) {
                    wrong.push((*example).clone());
                }
                false
            }
            _ => true,
        });
        std::thread::sleep(Duration::from_millis(20));
    }
    for (_, mut child) in open {
        // Those that wait for a robot, or work.
        let _ended = child.kill().and_then(|()| child.wait());
    }
    assert!(wrong.is_empty(), "not accepted:\n{}", wrong.join("\n"));
}

/// Four short clips in which the shipped arm moves, in a session.
fn record(folder: &Path) {
    let mut cell = CellToml::read(&root().join("config/fr3_cell.toml")).expect("the shipped cell");
    std::fs::create_dir_all(folder).expect("room");
    let home = cell.simulation.q.clone();
    for number in 0..4 {
        let file = format!("clip_{number:02}.mcap");
        let mut world = SimCell::new(&cell, None).expect("a cell");
        let mut writer = ClipWriter::create(&folder.join(&file), &ClipInfo::default()).expect("a new file");
        for k in 0..1500_u64 {
            let mut state = ArmState { stamp_ns: 7_000_000_000 + k * 1_000_000, cycle: k, ..ArmState::default() };
            world.read(&mut state);
            let phase = std::f64::consts::TAU * k as f64 / 1500.0;
            let size = 0.1 * (1.0 + f64::from(number));
            let moved: Vec<f64> = home.iter().map(|q| q + 0.5 * size * (1.0 - phase.cos())).collect();
            (state.q_d, state.dq_d) = (
                joints_from(&moved),
                joints_from(&vec![0.5 * size * std::f64::consts::TAU / 1.5 * phase.sin(); home.len()]),
            );
            writer.arm_state(&state).expect("room");
            world.step(&Drive::JointImpedance { q_d: state.q_d, dq_d: state.dq_d });
        }
        writer.finish().expect("a whole clip");
        cell.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.join("cell.toml"), cell.to_toml()).expect("room");
}

fn done(folder: &Path, command: &str) -> Output {
    let output = start(folder, &words(command)).wait_with_output().expect("it ends");
    assert!(output.status.success(), "{command}:\n{}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn examples_that_need_no_robot_do_what_they_say_and_answer_on_standard_output() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("session"));
    record(&lab.path().join("monday"));
    let verbs = verbs();
    let examples: Vec<String> = verbs.iter().flat_map(Verb::examples).collect();
    let cases = [
        "calibration identify arm session --out theta.toml --report page.html",
        "calibration identify arm monday --optimizer pso --json",
        "twin replay session",
        "twin replay session/clip_00.mcap --out simulated.mcap",
        "twin replay session --parameters theta.toml --json",
        "calibration export session --to ros2 --out bags",
        "calibration export session --to twinaligner --out folders",
        "calibration export bags --to own --out back --json",
        "calibration import bags --out imported --json",
    ];
    for case in cases {
        assert!(examples.iter().any(|example| words(example) == words(case)), "no example `{case}`");
        let command = case.replace("--optimizer pso", "--optimizer pso --budget 40");
        let output = done(lab.path(), &command);
        let answer = String::from_utf8(output.stdout).expect("UTF-8");
        if case.ends_with("--json") {
            let json: serde_json::Value =
                serde_json::from_str(&answer).unwrap_or_else(|e| panic!("{case}: {e}\n{answer}"));
            assert!(json.is_object(), "{case}");
        } else {
            assert!(!answer.trim().is_empty(), "{case} answers nothing on standard output");
        }
        for out in ["theta.toml", "page.html", "simulated.mcap", "bags", "folders", "back", "imported"] {
            assert!(!words(case).contains(&out) || lab.path().join(out).exists(), "{case} wrote no {out}");
        }
    }
}

#[test]
fn a_command_on_a_page_does_what_it_says_where_names_hold_spaces_and_the_cell_lies_elsewhere() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("on monday"));
    std::fs::rename(lab.path().join("on monday/cell.toml"), lab.path().join("the cell.toml")).expect("room");
    let words = ["calibration", "identify", "arm", "on monday", "--cell", "the cell.toml"];
    let outputs = ["--out", "what was found.toml", "--report", "page.html"];
    let output = start(lab.path(), &[&words[..], &outputs[..]].concat()).wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(lab.path().join("page.html")).expect("a page");
    let command = page.split("<pre><code>").nth(1).and_then(|rest| rest.split("</code>").next()).expect("a command");
    let programs = program_path("twin").parent().expect("a folder").to_owned();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let typed = Command::new("sh").args(["-c", command]).current_dir(lab.path()).env("PATH", path).output();
    let typed = typed.expect("a shell");
    assert!(typed.status.success(), "{command}\n{}", String::from_utf8_lossy(&typed.stderr));
    assert!(!typed.stdout.is_empty(), "{command} answers nothing");
}

#[test]
fn the_page_of_an_advised_command_has_a_free_name_however_often_it_is_asked() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("monday"));
    let file = lab.path().join("monday/cell.toml");
    let mut cell = CellToml::read(&file).expect("a cell");
    // Too few to be told anything: the answer is what to record.
    cell.clips.truncate(1);
    std::fs::write(file, cell.to_toml()).expect("room");
    let mut command = "calibration diagnose monday --report report.html".to_owned();
    for page in ["report.html", "report_2.html", "report_3.html"] {
        assert!(!lab.path().join(page).exists(), "{page}");
        let output = done(lab.path(), &format!("{command} --json"));
        assert!(lab.path().join(page).is_file(), "{command}");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let next = answer["next_commands"].as_array().and_then(|commands| commands.last()?.as_str());
        next.expect("a command").clone_into(&mut command);
    }
}

#[test]
fn json_is_answered_whether_it_is_asked_for_before_or_behind_the_order() {
    let folder = tempfile::tempdir().expect("a folder");
    for place in ["grip --json stop", "grip stop --json"] {
        let list: Vec<&str> = std::iter::once("rt_bridge").chain(place.split(' ')).collect();
        let output = start(folder.path(), &list).wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(1), "accepted, but no bridge: {place}");
    }
}
