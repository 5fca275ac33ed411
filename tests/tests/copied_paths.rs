//! Paths of a cell.toml that go into another file lead to the same place there, however the cell.toml was spelt.

use shared_mem::cell::Cell as CellFile;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};
use tests::{Cell, program_path};

/// An arm of three joints with masses.
fn urdf() -> String {
    let mut text = String::from("<robot name='three'><link name='link_0'/>");
    for k in 1..=3 {
        let axis = if k == 1 { "0 0 1" } else { "0 1 0" };
        let _written = write!(
            text,
            "<link name='link_{k}'><inertial><origin xyz='0 0 .1'/><mass value='1.2'/><inertia ixx='.004' iyy='.004' izz='.002' ixy='0' ixz='0' \
             iyz='0'/></inertial></link><joint name='joint_{k}' type='revolute'><origin xyz='0 0 .2'/><parent link='link_{}'/><child \
             link='link_{k}'/><axis xyz='{axis}'/><limit lower='-2.8' upper='2.8' effort='40' velocity='2'/></joint>",
            k - 1
        );
    }
    text + "</robot>"
}

/// Three seconds in which its joints sway, 20 ms behind their commands.
fn log() -> String {
    let mut text = String::from("time,q0,q1,q2,q_d0,q_d1,q_d2\n");
    for row in 0..300 {
        let time = 0.01 * f64::from(row);
        let at = |joint: f64, time: f64| 0.3 * (3.0 * time + joint).sin();
        let q = [0.0, 1.0, 2.0].map(|joint| at(joint, time - 0.02)).map(|q| format!("{q:.6}")).join(",");
        let desired = [0.0, 1.0, 2.0].map(|joint| at(joint, time)).map(|q| format!("{q:.6}")).join(",");
        let _written = writeln!(text, "{time:.6},{q},{desired}");
    }
    text
}

fn run(cell: &Cell, program: &str, line: &str) -> Output {
    let mut command = Command::new(program_path(program));
    command.args(line.split(' ')).current_dir(cell.path("")).env("TWINALIGN_DOMAIN", cell.domain());
    command.output().expect("it runs")
}

fn done(cell: &Cell, program: &str, line: &str) {
    let output = run(cell, program, line);
    assert!(output.status.success(), "{program} {line}: {}", String::from_utf8_lossy(&output.stderr));
}

/// The paths that a cell.toml of a session has.
fn robot_of(file: &Path) -> Option<std::path::PathBuf> {
    CellFile::read(file).expect("a cell").robot.and_then(|robot| robot.urdf)
}

#[test]
fn a_session_is_the_same_by_the_bare_name_a_dot_and_the_whole_path() {
    let cell = Cell::with(
        "[robot]\nurdf = \"arm.urdf\"\n[controller]\nkind = \"joint_pd\"\nstiffness = [60, 60, 40]\ndamping = [4, 4, 2]\n",
    );
    std::fs::write(cell.path("arm.urdf"), urdf()).expect("room");
    std::fs::write(cell.path("log.csv"), log()).expect("room");
    std::fs::create_dir(cell.path("far")).expect("room");
    let spelt =
        ["cell.toml".to_owned(), "./cell.toml".to_owned(), cell.text("cell.toml"), "far/../cell.toml".to_owned()];
    let mut texts = Vec::new();
    for (number, spelt) in spelt.iter().enumerate() {
        let session = format!("far/session_{number}");
        done(&cell, "calibration", &format!("import log.csv --out {session} --cell {spelt}"));
        done(&cell, "twin", &format!("replay {session}"));
        texts.push(std::fs::read_to_string(cell.path(&format!("{session}/cell.toml"))).expect("a file"));
    }
    assert!(texts.iter().all(|text| *text == texts[0]), "{texts:?}");

    // A clip carries its cell wherever it goes.
    done(&cell, "twin", "replay far/session_0/log.mcap --cell cell.toml --out far/replayed.mcap");
    done(&cell, "twin", "replay far/replayed.mcap");

    // A session that grows is the same cell by each of its names.
    for (number, spelt) in spelt.iter().take(3).enumerate() {
        let begun = if number == 0 { "" } else { " --arm sim" };
        let line =
            format!("capture excitation --cell {spelt} --clips 1 --duration 2 --realtime ignore --out far/new{begun}");
        done(&cell, "calibration", &line);
    }
    let urdf = robot_of(&cell.path("far/new/cell.toml")).expect("a URDF");
    assert!(urdf.is_absolute() && urdf.is_file(), "{}", urdf.display());
    done(&cell, "twin", "replay far/new");
}
