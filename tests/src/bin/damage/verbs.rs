//! Which verb reads which file.

/// A verb and what it is run on.
pub(crate) struct Verb {
    /// Folder of [`crate::files`].
    pub(crate) scenario: &'static str,
    /// Files of it that may be damaged.
    pub(crate) damaged: &'static [&'static str],
    pub(crate) program: &'static str,
    /// `{dir}` becomes the folder of the case.
    pub(crate) arguments: Vec<&'static str>,
}

const FOLDER: &[&str] = &[
    "traj_00000/control.json",
    "traj_00000/frame.json",
    "traj_00000/pose.npy",
    "traj_00000/cam_K.txt",
    "traj_00000/rgb/00000.png",
    "traj_00000/depth/00000.npz",
    "cell.toml",
];
const OWN: &[&str] = &["clip_00.mcap", "clip_00.mcap", "clip_00.mcap", "cell.toml", "theta.toml"];
const BAG: &[&str] = &["clip_00.mcap", "clip_00.mcap", "clip_00.mcap", "cell.toml"];
const BRIDGE: &str =
    "run --cell {dir}/cell.toml --arm sim --effects {dir}/effects.toml --duration 0.2 --realtime ignore --json";
const VIEWPOINT: &str =
    "viewpoint {dir}/picture.png --cell {dir}/cell.toml --joints {dir}/joints.json --mask {dir}/mask.png --json";
const PHOTO: &str =
    "viewpoint {dir}/photo.jpg --cell {dir}/cell.toml --joints {dir}/photo.json --background {dir}/photo.jpg --json";

/// Every verb of these programs.
pub(crate) fn all(programs: &[String]) -> Vec<Verb> {
    let mut all = Vec::new();
    let mut add = |scenario, damaged, program, line: &'static str| {
        if programs.iter().any(|wanted| wanted == program) {
            all.push(Verb { scenario, damaged, program, arguments: line.split(' ').collect() });
        }
    };
    for (scenario, damaged) in [("own", OWN), ("plain", OWN), ("bag", BAG), ("folder", FOLDER)] {
        add(scenario, damaged, "twin", "replay {dir} --json");
        add(scenario, damaged, "calibration", "identify object {dir} --json");
        add(scenario, damaged, "calibration", "identify arm {dir} --json");
        add(scenario, damaged, "calibration", "diagnose {dir} --json");
        add(scenario, damaged, "calibration", "export {dir} --to twinaligner --out {dir}/out --json");
        add(scenario, damaged, "calibration", "export {dir} --to ros2 --out {dir}/out --json");
        add(scenario, damaged, "calibration", "export {dir} --to own --out {dir}/out --json");
        add(scenario, damaged, "twin", "render {dir} --out {dir}/frames --json");
        add(scenario, damaged, "calibration", "viewpoint {dir} --depth --json");
    }
    add("own", OWN, "twin", "replay {dir} --parameters {dir}/theta.toml --json");
    add("own", OWN, "twin", "replay {dir}/clip_00.mcap --out {dir}/simulated.mcap --json");
    add("robot", &["robot.urdf", "robot.urdf", "robot.urdf", "cell.toml"], "twin", "replay {dir} --json");
    for (scenario, damaged) in [
        ("obj", &["body.obj", "body.obj", "cell.toml"][..]),
        ("stl", &["body.stl", "clip_00.mcap"]),
        ("text_stl", &["body.stl"]),
        ("ply", &["body.ply", "clip_00.mcap"]),
        ("text_ply", &["body.ply"]),
    ] {
        add(scenario, damaged, "twin", "replay {dir} --json");
        add(scenario, damaged, "calibration", "identify object {dir} --json");
    }
    let label = "label-splats {dir}/scan.ply --cell {dir}/cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --out {dir}/links --json";
    add("splats", &["scan.ply", "scan.ply", "cell.toml"], "twin", label);
    add("splats", &["links/link0.ply"], "twin", "render {dir} --splats {dir}/links --out {dir}/frames --json");
    add("pictures", &["picture.png", "mask.png", "joints.json", "cell.toml"], "calibration", VIEWPOINT);
    add("pictures", &["photo.jpg", "photo.json"], "calibration", PHOTO);
    for (log, damaged, line) in [
        ("rosbag2_mcap", &["rosbag2_mcap/rosbag2_mcap.mcap"][..], "import {dir}/rosbag2_mcap --out {dir}/out --json"),
        (
            "rosbag2_sqlite3",
            &["rosbag2_sqlite3/rosbag2_sqlite3.db3"],
            "import {dir}/rosbag2_sqlite3 --out {dir}/out --json",
        ),
        ("franka_state.bag", &["franka_state.bag"], "import {dir}/franka_state.bag --out {dir}/out --json"),
        ("joint_states_bz2.bag", &["joint_states_bz2.bag"], "import {dir}/joint_states_bz2.bag --out {dir}/out --json"),
        ("joint_states_lz4.bag", &["joint_states_lz4.bag"], "import {dir}/joint_states_lz4.bag --out {dir}/out --json"),
        (
            "lerobot_v21",
            &["lerobot_v21/data/chunk-000/episode_000000.parquet", "lerobot_v21/meta/info.json"],
            "import {dir}/lerobot_v21 --out {dir}/out --json",
        ),
        (
            "lerobot_v3",
            &["lerobot_v3/data/chunk-000/file-000.parquet", "lerobot_v3/meta/info.json"],
            "import {dir}/lerobot_v3 --out {dir}/out --json",
        ),
        ("plain.csv", &["plain.csv", "plain.csv"], "import {dir}/plain.csv --out {dir}/out --json"),
        ("wide", &["wide.csv", "wide.csv"], "import {dir}/wide.csv --out {dir}/out --json"),
        ("log.npz", &["log.npz", "log.npz"], "import {dir}/log.npz --out {dir}/out --json"),
        (
            "sage_motion",
            &["sage_motion/control.csv", "sage_motion/state_motor.csv", "sage_motion/event.csv"],
            "import {dir}/sage_motion --out {dir}/out --json",
        ),
    ] {
        add(log, damaged, "calibration", line);
    }
    add(
        "scan",
        &["transforms.json", "transforms.json", "masks/03.png"],
        "twin",
        "reconstruct object {dir} --out {dir}/out",
    );
    add("own", &["effects.toml", "effects.toml", "cell.toml"], "rt_bridge", BRIDGE);
    all
}
