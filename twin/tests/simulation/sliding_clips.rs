//! Replays strokes that another engine made, with that engine's own parameters: `TWINALIGN_DATA=<folder> cargo test
//! --release -p twin --test simulation sliding_clips -- --ignored`.

use shared_mem::recording::Session;
use shared_mem::theta::{ArmTheta, EffectTheta, ObjectTheta, Theta};
use std::path::{Path, PathBuf};
use twin::replay::{Options, replay};

/// The parameters that made a session, without what was hidden in it.
fn truth(session: &Path) -> Theta {
    let text = std::fs::read_to_string(session.join("truth.json")).expect("truth.json");
    let truth: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let list = |key: &str| -> Vec<f64> { serde_json::from_value(truth["theta"][key].clone()).expect("numbers") };
    let number = |key: &str| truth["theta"][key].as_f64();
    Theta {
        arm: Some(ArmTheta { stiffness: list("k"), damping: list("d") }),
        object: Some(ObjectTheta {
            name: None,
            friction: number("mu"),
            mass: number("mass"),
            centre_of_mass: Some(list("com").try_into().expect("three numbers")),
            tip_friction: number("tip_mu"),
        }),
        ..Theta::default()
    }
}

fn effect(block: &str) -> Vec<EffectTheta> {
    let theta: Theta = shared_mem::toml_file::parse(block, Path::new("theta.toml")).expect("a theta.toml");
    theta.effects
}

/// Mean and median ADD over the clips [m], and the largest joint error [rad RMS].
fn gap(name: &str, effects: Vec<EffectTheta>) -> [f64; 3] {
    let folder =
        PathBuf::from(std::env::var_os("TWINALIGN_DATA").expect("TWINALIGN_DATA=<folder of recorded sessions>"));
    let folder = folder.join("gap_dev").join(name);
    let theta = Theta { effects, ..truth(&folder) };
    let session = Session::open(&folder).expect("a session");
    let gap = replay(&session, &Options { theta: Some(theta), ..Options::default() }).expect("a cell");
    let mut add: Vec<f64> = gap.clips.iter().filter_map(|clip| clip.gap.object_add_m).collect();
    assert_eq!(add.len(), 16);
    add.sort_by(f64::total_cmp);
    let joints = gap.clips.iter().flat_map(|clip| clip.gap.joint_rms_rad.iter().flatten());
    [add.iter().sum::<f64>() / 16.0, 0.5 * (add[7] + add[8]), joints.copied().fold(0.0, f64::max)]
}

#[test]
#[ignore = "needs recorded sessions: TWINALIGN_DATA=FOLDER cargo test --release -p twin --test simulation sliding_clips -- --ignored --nocapture"]
fn strokes_of_another_engine_are_reproduced_to_a_few_millimetres() {
    let sessions = [
        ("none_slide", ""),
        ("table_tilt", "[[effect]]\nname = \"table_tilt\"\ntilt = [0.0, 0.05]"),
        ("cam_delay", "[[effect]]\nname = \"camera_latency\"\nlatency = 0.04"),
    ];
    for (name, block) in sessions {
        let [mean, median, joints] = gap(name, effect(block));
        assert!(mean <= 4e-3 && median <= 2.5e-3, "{name}: mean {mean} m, median {median} m");
        assert!(joints <= 2e-4, "{name}: {joints} rad");
    }
}
