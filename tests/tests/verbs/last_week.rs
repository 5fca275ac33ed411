//! From last week's bag to a verdict, as docs/import.md goes: a simulated arm is recorded, handed out as a ROS 2 bag, imported,
//! checked, identified and taken home, and nobody writes a line.

use serde_json::Value;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{ClipInfo, ClipWriter};
use std::path::Path;
use std::process::Command;
use tests::program_path;
use tests::texts::root;
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::sim::SimCell;

/// Rows of a clip: 3 s.
const ROWS: u64 = 3000;

/// Two clips in which the shipped arm sways about its ready pose, each joint at its own pace.
fn record(folder: &Path) {
    let mut cell = Cell::read(&root().join("config/fr3_cell.toml")).expect("the shipped cell");
    cell.clips.clear();
    // The bag knows nothing of a tool.
    (cell.camera, cell.tool) = (None, None);
    cell.objects.clear();
    std::fs::create_dir_all(folder).expect("room");
    let home = *ArmModel::from_cell(&cell).expect("an arm").ready();
    for number in 0..2 {
        let file = format!("run_{number}.mcap");
        let mut world = SimCell::new(&cell, None).expect("a cell");
        let mut writer = ClipWriter::create(&folder.join(&file), &ClipInfo::default()).expect("a new file");
        for k in 0..ROWS {
            let mut state = ArmState { stamp_ns: 7_000_000_000 + k * 1_000_000, cycle: k, ..ArmState::default() };
            world.read(&mut state);
            let t = k as f64 * 1e-3;
            let pace = |joint: usize| std::f64::consts::TAU * (0.7 + 0.15 * joint as f64 + 0.4 * f64::from(number));
            let swing = |joint: usize| 0.12 * (1.0 - (pace(joint) * t).cos());
            let speed = |joint: usize| 0.12 * pace(joint) * (pace(joint) * t).sin();
            let (q, dq): (Vec<f64>, Vec<f64>) = (0..7).map(|joint| (home[joint] + swing(joint), speed(joint))).unzip();
            (state.q_d, state.dq_d) = (joints_from(&q), joints_from(&dq));
            world.step(&Drive::JointImpedance { q_d: state.q_d, dq_d: state.dq_d });
            writer.arm_state(&state).expect("room");
        }
        writer.finish().expect("a whole clip");
        cell.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.join("cell.toml"), cell.to_toml()).expect("room");
}

fn answer(folder: &Path, line: &str) -> Value {
    let words: Vec<&str> = line.split(' ').chain(["--json"]).collect();
    let output = Command::new(program_path("calibration")).args(words).current_dir(folder).output().expect("it runs");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn a_bag_becomes_gains_and_a_model_without_a_line_written() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("lab"));
    answer(lab.path(), "export lab --to rosbag2 --out last_week");
    // Only the bags: what the laboratory knows stays there.
    std::fs::remove_file(lab.path().join("last_week/cell.toml")).expect("it is there");

    let imported = answer(lab.path(), "import last_week --out session");
    let clips = imported["clips"].as_array().expect("clips");
    assert_eq!(clips.len(), 2);
    assert!(clips.iter().all(|clip| clip["measured"] == ROWS && clip["desired"] == ROWS), "{imported}");
    assert!(!imported["notes"].to_string().contains("\"open\":true"), "{imported}");

    let check = answer(lab.path(), "check session");
    let remarks = check["remarks"].as_array().expect("remarks");
    assert!(remarks.iter().all(|remark| remark["severity"] == "note"), "{check}");

    let found = answer(lab.path(), "identify arm session --out theta.toml");
    let stiffness = found["parameters"]["stiffness"]["value"].as_array().expect("stiffness");
    let nominal = [600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0];
    for (found, nominal) in stiffness.iter().map(|gain| gain.as_f64().expect("a number")).zip(nominal) {
        assert!((found / nominal - 1.0).abs() < 0.03, "{found} for {nominal}");
    }
    let model = answer(lab.path(), "export-model session --parameters theta.toml --to mjcf --out cell.xml");
    assert!(model["lines"].to_string().contains("theta.toml"), "{model}");

    // The bag itself says which robot it is, too.
    let cell = answer(lab.path(), "init --bag last_week/run_0 --out cell.toml");
    assert!(cell["taken"].to_string().contains("robot.model"), "{cell}");
    let arm = std::fs::read_to_string(lab.path().join("last_week/run_0/metadata.yaml")).expect("a file");
    assert!(arm.contains("/robot_description") && arm.contains("/tf_static"), "{arm}");
}

#[test]
fn an_arm_of_its_own_is_told_by_the_description_in_its_bag() {
    let lab = tempfile::tempdir().expect("a folder");
    let urdf = "<robot name='arm'><link name='base'/>\
        <link name='upper'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>\
        <joint name='shoulder' type='revolute'><parent link='base'/><child link='upper'/><axis xyz='0 1 0'/>\
        <limit lower='-2' upper='2' effort='10' velocity='2'/></joint></robot>";
    let folder = lab.path().join("lab");
    std::fs::create_dir_all(&folder).expect("room");
    std::fs::write(folder.join("arm.urdf"), urdf).expect("room");
    let cell = "[robot]\nurdf = \"arm.urdf\"\n[[clip]]\nfile = \"run.mcap\"\nkind = \"excitation\"\n";
    std::fs::write(folder.join("cell.toml"), cell).expect("room");
    let mut writer = ClipWriter::create(&folder.join("run.mcap"), &ClipInfo::default()).expect("a new file");
    for k in 0..200_u64 {
        let stamp_ns = 7_000_000_000 + k * 5_000_000;
        let q = joints_from(&[0.5 * (k as f64 * 0.02).sin()]);
        writer
            .arm_state(&ArmState { stamp_ns, device_ns: stamp_ns, cycle: k, dof: 1, q, q_d: q, ..ArmState::default() })
            .expect("room");
    }
    writer.finish().expect("a whole clip");
    answer(lab.path(), "export lab --to rosbag2 --out bags");
    let told = answer(lab.path(), "init --bag bags/run --out mine.toml");
    assert_eq!(told["urdf"], "mine.urdf", "{told}");
    assert_eq!(std::fs::read_to_string(lab.path().join("mine.urdf")).expect("the file"), urdf);
    // An import takes it by itself.
    let imported = answer(lab.path(), "import bags --out session");
    assert!(imported["notes"].to_string().contains("the log's robot_description"), "{imported}");
    assert_eq!(std::fs::read_to_string(lab.path().join("session/robot.urdf")).expect("the file"), urdf);
    for cell in ["mine.toml", "session/cell.toml"] {
        let cell = Cell::read(&lab.path().join(cell)).expect("a cell");
        assert_eq!(ArmModel::from_cell(&cell).expect("an arm").joint_names(), ["shoulder"]);
    }
}
