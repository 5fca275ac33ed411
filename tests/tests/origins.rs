//! Where clips come from, as it is typed: clips of two cells do not go into one session unasked, and what a diagnosis advises records
//! with the arm that the clips are of.

use shared_mem::cell::{Cell as CellFile, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::msg::origin::ArmOrigin;
use shared_mem::origin::Origin;
use shared_mem::recording::{ClipInfo, ClipWriter, read_origins};
use std::path::Path;
use std::time::Duration;
use tests::Cell;
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::sim::SimCell;

const ROBOT: &str = "fci://172.16.0.2";

/// A session of two short clips in which the arm of a cell.toml moves; each says that it is of one of these arms.
fn record(cell_toml: &Path, folder: &Path, arms: [&str; 2]) {
    let mut cell = CellFile::read(cell_toml).expect("a cell");
    std::fs::create_dir_all(folder).expect("room");
    let model = ArmModel::from_cell(&cell).expect("an arm");
    let home = &model.ready()[..model.dof()];
    for (number, arm) in arms.into_iter().enumerate() {
        let (file, origin) = (format!("clip_{number:02}.mcap"), ArmOrigin::new(arm));
        let mut world = SimCell::new(&cell, None).expect("a cell");
        let mut writer = ClipWriter::create(&folder.join(&file), &ClipInfo::default()).expect("a new file");
        for k in 0..2000_u64 {
            let stamp_ns = 7_000_000_000 + k * 1_000_000;
            let mut state = ArmState { stamp_ns, cycle: k, origin, ..ArmState::default() };
            world.read(&mut state);
            let phase = std::f64::consts::TAU * k as f64 / 2000.0;
            let size = |joint: usize| 0.05 * (1.0 + number as f64 + joint as f64);
            let q: Vec<f64> = home.iter().enumerate().map(|(i, q)| q + size(i) * (1.0 - phase.cos())).collect();
            let dq: Vec<f64> = (0..home.len()).map(|i| size(i) * std::f64::consts::PI * phase.sin()).collect();
            (state.q_d, state.dq_d) = (joints_from(&q), joints_from(&dq));
            world.step(&Drive::JointImpedance { q_d: state.q_d, dq_d: state.dq_d });
            writer.arm_state(&state).expect("room");
        }
        writer.finish().expect("a whole clip");
        cell.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.join("cell.toml"), cell.at_home_anywhere().to_toml()).expect("room");
}

/// The words that a shell makes of a command, without the program.
fn typed(command: &str) -> Vec<String> {
    let script = format!("for word in {command}; do printf '%s\\n' \"$word\"; done");
    let output = std::process::Command::new("sh").args(["-c", &script]).output().expect("a shell");
    String::from_utf8(output.stdout).expect("UTF-8").lines().skip(1).map(str::to_owned).collect()
}

/// The first command between backticks that adds `flag`.
fn advised<'a>(text: &'a str, flag: &str) -> &'a str {
    text.split('`')
        .skip(1)
        .step_by(2)
        .find(|command| command.contains(flag))
        .unwrap_or_else(|| panic!("no {flag}: {text}"))
}

#[test]
fn a_session_begins_with_the_simulation_and_goes_on_with_the_arm_that_is_named() {
    let cell = Cell::shipped();
    let session = cell.text("session");
    let capture =
        ["capture", "excitation", "--cell", "{cell}", "--clips", "1", "--duration", "2", "--realtime", "ignore"];
    let capture = [&capture[..], &["--json", "--out", &session]].concat();
    let first = cell.start("calibration", &capture).wait(Duration::from_secs(120)).succeeded();
    assert!(first.stderr.contains("the simulation, because the session is new"), "{}", first.stderr);
    assert_eq!(first.json()["origin"]["kind"], "simulation", "{}", first.json());
    let origins = read_origins(&cell.path("session/clip_00.mcap")).expect("a clip");
    assert_eq!(origins, Origin::Simulation.into(), "the recorder writes down what the arm says");

    // No arm, the arm of the clips, and another arm.
    let none = cell.start("calibration", &capture).wait(Duration::from_secs(60));
    assert_eq!(none.status.code(), Some(1), "{}", none.stderr);
    assert!(none.complaint().contains("has clips of the simulation"), "{}", none.stderr);
    let again = typed(advised(&none.stderr, "--arm sim"));
    let again: Vec<&str> = again.iter().map(String::as_str).collect();
    let second = cell.start("calibration", &again).wait(Duration::from_secs(120)).succeeded().json();
    assert_eq!((&second["clips"][0]["file"], &second["clips"][0]["kept"]), (&"clip_01.mcap".into(), &true.into()));
    let robot = [&capture[..], &["--arm", ROBOT]].concat();
    let other = cell.start("calibration", &robot).wait(Duration::from_secs(60));
    assert_eq!(other.status.code(), Some(1), "{}", other.stderr);
    assert!(other.complaint().contains("do not go into") && other.complaint().contains(ROBOT), "{}", other.stderr);
    assert!(advised(&other.stderr, "--mix").ends_with("--mix"));

    // A bridge that runs says itself what it drives.
    record(&cell.path("cell.toml"), &cell.path("real"), [ROBOT, ROBOT]);
    let bridge = cell.start_bridge(&[]);
    let (real, new) = (cell.text("real"), cell.text("new"));
    let into_real = [&capture[..capture.len() - 1], &[real.as_str()]].concat();
    let refused = cell.start("calibration", &into_real).wait(Duration::from_secs(60));
    assert!(refused.complaint().contains("clips of the simulation do not go into"), "{}", refused.stderr);
    let other_arm = [&capture[..capture.len() - 1], &[new.as_str(), "--arm", ROBOT]].concat();
    let refused = cell.start("calibration", &other_arm).wait(Duration::from_secs(60));
    assert!(refused.complaint().contains("drives the simulation, not the robot"), "{}", refused.stderr);
    assert!(!cell.path("real/clip_02.mcap").exists() && !cell.path("new").exists());
    let _ended = bridge.interrupt().succeeded();
}

#[test]
fn clips_of_a_robot_and_of_the_simulation_are_shown_and_not_explained_together() {
    let cell = Cell::shipped();
    for (name, arms) in
        [("mixed", [ROBOT, "sim"]), ("real", [ROBOT, ROBOT]), ("old", ["", ""]), ("sim", ["sim", "sim"])]
    {
        record(&cell.path("cell.toml"), &cell.path(name), arms);
    }
    let run = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        cell.start("calibration", &words).wait(Duration::from_secs(120))
    };
    let checked = run("check {dir}/mixed --json").succeeded().json();
    assert_eq!(checked["remarks"][0]["fault"], "mixed_origins", "{checked}");
    assert_eq!(checked["remarks"][0]["severity"], "wrong", "{checked}");
    assert_eq!(checked["clips"][0]["origins"][0]["host"], "172.16.0.2", "{checked}");
    assert_eq!(checked["clips"][1]["origins"][0]["kind"], "simulation", "{checked}");
    let words = run("check {dir}/mixed").succeeded().stdout;
    assert!(words.contains("cannot be, mixed_origins") && words.contains(ROBOT), "{words}");
    assert!(run("check {dir}/real").succeeded().stdout.contains(&format!("origin: the robot at {ROBOT}")));
    let old = run("check {dir}/old --json").succeeded().json();
    assert_eq!((&old["origin"], &old["remarks"]), (&"unknown".into(), &serde_json::json!([])), "{old}");

    for verb in ["identify arm {dir}/mixed", "diagnose {dir}/mixed", "diagnose {dir}/real --against {dir}/sim"] {
        let refused = run(verb);
        assert_eq!(refused.status.code(), Some(1), "{verb}: {}", refused.stderr);
        assert!(refused.complaint().contains("not explained together unasked"), "{verb}: {}", refused.stderr);
        assert!(advised(&refused.stderr, "--mix").ends_with("--mix"), "{verb}");
    }
    let together = run("identify arm {dir}/mixed --mix --json").succeeded();
    assert!(together.stderr.contains("come from several cells"), "{}", together.stderr);
    let warnings = together.json()["warnings"].to_string();
    assert!(warnings.contains("come from several cells") && warnings.contains(ROBOT), "{warnings}");

    let old = run("identify arm {dir}/old").succeeded();
    let said = "2 of 2 clips do not say where they come from";
    assert_eq!(old.stderr.matches(said).count(), 1, "{}", old.stderr);
    assert!(old.stdout.contains("origin: unknown"), "{}", old.stdout);
    let real = run("identify arm {dir}/real --json").succeeded().json();
    assert_eq!(real["origin"], format!("the robot at {ROBOT}"), "{real}");

    let replay =
        cell.start("twin", &["replay", "{dir}/mixed", "--json"]).wait(Duration::from_secs(60)).succeeded().json();
    assert_eq!(replay["clips"][0]["origins"][0]["kind"], "robot", "{replay}");
    let replay = cell.start("twin", &["replay", "{dir}/mixed"]).wait(Duration::from_secs(60)).succeeded().stdout;
    assert!(replay.contains("clip_01.mcap: the simulation"), "{replay}");
}

#[test]
fn what_a_diagnosis_advises_names_the_arm_of_the_clips_and_can_be_typed() {
    let cell = Cell::shipped();
    let diagnosed = |name: &str, arms| {
        record(&cell.path("cell.toml"), &cell.path(name), arms);
        let session = cell.text(name);
        let found = cell.start("calibration", &["diagnose", &session, "--json"]).wait(Duration::from_secs(120));
        let found = found.succeeded().json();
        found["next_commands"][0].as_str().unwrap_or_else(|| panic!("no command: {found}")).to_owned()
    };
    assert!(diagnosed("real", [ROBOT, ROBOT]).contains(&format!(" --arm {ROBOT} ")));
    assert!(diagnosed("old", ["", ""]).contains(" --arm fci://ROBOT "));
    let command = diagnosed("sim", ["sim", "sim"]);
    assert!(command.contains(" --arm sim "), "{command}");
    // As it stands; ended once a clip of it is in the session.
    let words = typed(&command);
    let capture = cell.start("calibration", &words.iter().map(String::as_str).collect::<Vec<_>>());
    let listed = || std::fs::read_to_string(cell.path("sim/cell.toml")).is_ok_and(|text| text.contains("clip_02.mcap"));
    Cell::until("a clip more", Duration::from_secs(120), listed);
    let _ended = capture.interrupt().succeeded();
    assert_eq!(read_origins(&cell.path("sim/clip_02.mcap")).expect("a clip"), Origin::Simulation.into());
}

const URDF: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><mass value="2"/><origin xyz="0 0 0.2"/><inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.01"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><origin xyz="0 0 0.2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 0.5"/><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" effort="60" velocity="2"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0 0 0.4"/><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" effort="40" velocity="2"/></joint>
</robot>"#;
const URDF_CELL: &str = "[robot]\nurdf = \"two.urdf\"\n[controller]\nkind = \"joint_impedance\"\nstiffness = [400, 200]\n\
                         damping = [40, 20]\nrotor_inertia = [0.1, 0.05]\n";

#[test]
fn of_an_arm_that_no_bridge_drives_the_motion_is_written_beside_the_report() {
    let cell = Cell::with(URDF_CELL);
    std::fs::write(cell.path("two.urdf"), URDF).expect("room");
    record(&cell.path("cell.toml"), &cell.path("logs"), ["", ""]);
    let (logs, report) = (cell.text("logs"), cell.text("report.html"));
    let diagnose = ["diagnose", &logs, "--report", &report, "--json"];
    let found = cell.start("calibration", &diagnose).wait(Duration::from_secs(120)).succeeded().json();
    assert_eq!(found["next_commands"], serde_json::json!([]), "{found}");
    let sentence = found["next_experiment"].as_str().expect("a sentence");
    assert!(sentence.contains("No bridge drives this arm"), "{sentence}");
    let motions = found["next_motions"].as_array().expect("motions");
    let file = motions[0]["file"].as_str().unwrap_or_else(|| panic!("no file: {motions:?}"));
    assert_eq!((file, motions[0]["rate_hz"].as_f64()), (cell.text("report_motion_1.csv").as_str(), Some(1000.0)));
    let text = std::fs::read_to_string(file).expect("a file");
    assert!(text.starts_with("time [s],q_d shoulder [rad],q_d elbow [rad]\n0.000,"), "{}", &text[..80]);
    let positions =
        text.lines().skip(1).flat_map(|line| line.split(',').skip(1)).map(|n| n.parse::<f64>().expect("a number"));
    assert!(positions.clone().all(|q| q.abs() <= 1.5) && positions.fold(0.0, |a: f64, q| a.max(q.abs())) > 0.05);
    let page = std::fs::read_to_string(&report).expect("a page");
    assert!(page.contains("report_motion_1.csv") && page.contains("1000 rows a second"), "the page names the file");
}
