//! A data set that is written here is read back by the import.

use crate::lab;
use import::{DataSetPlan, DataSetWriter, Feature, FeatureKind, Frames, Order, Outcome, import};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::output::OutputFolder;
use shared_mem::recording::Session;
use std::path::Path;

const MAPPING: &str = r#"kind = "free_motion"
[object]
table = "frames"
stamps = "header"
position = ["observation.environment_state[box.x]", "observation.environment_state[box.y]", "observation.environment_state[box.z]"]
orientation = ["observation.environment_state[box.qw]", "observation.environment_state[box.qx]", "observation.environment_state[box.qy]", "observation.environment_state[box.qz]"]
"#;

fn x(episode: usize, row: usize) -> f32 {
    0.4 + 0.1 * episode as f32 + 0.001 * row as f32
}

fn write(folder: &Path) {
    let names = ["x", "y", "z", "qw", "qx", "qy", "qz"].map(|axis| format!("box.{axis}"));
    let plan = DataSetPlan {
        rate: 20,
        robot: "twinalign".into(),
        task: "push the box".into(),
        features: vec![
            Feature { name: "action".into(), kind: FeatureKind::Numbers(vec!["gripper.width".into()]) },
            Feature { name: "observation.environment_state".into(), kind: FeatureKind::Numbers(names.into()) },
            Feature {
                name: "observation.images.front".into(),
                kind: FeatureKind::Pictures(PixelEncoding::Rgb8, [4, 2]),
            },
        ],
    };
    let mut writer = DataSetWriter::new(OutputFolder::create(folder).expect("a folder"), plan);
    for episode in 0..2 {
        let rows = 30 + 10 * episode;
        let poses = (0..rows).flat_map(|row| [x(episode, row), -0.1, 0.05, 1.0, 0.0, 0.0, 0.0]);
        let pictures = (0..rows).map(|row| vec![row as u8; 4 * 2 * 3]);
        let widths = (0..rows).map(|row| 0.08 - 0.001 * row as f32);
        let frames =
            [Frames::Numbers(widths.collect()), Frames::Numbers(poses.collect()), Frames::Pictures(pictures.collect())];
        writer.episode(&frames).expect("room");
        let wrong = writer.episode(&[frames[1].clone(), frames[0].clone(), frames[2].clone()]).expect_err("exchanged");
        assert!(wrong.to_string().starts_with("`observation.environment_state`: "), "{wrong}");
    }
    writer.finish().expect("room");
}

#[test]
fn poses_of_a_data_set_come_back_as_the_clips_of_a_session() {
    let place = tempfile::tempdir().expect("a folder");
    let [data, out, mapping, cell] =
        ["data", "session", "import.toml", "cell.toml"].map(|name| place.path().join(name));
    write(&data);
    std::fs::write(&mapping, MAPPING).expect("room");
    std::fs::write(&cell, "[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n").expect("room");
    let files = [data.clone()];
    let order = Order { mapping: Some(&mapping), cell: Some(&cell), ..lab::order(&files, &out, &mapping) };
    let Outcome::Done { clips, .. } = import(order, |_, _| ()).expect("a data set") else { panic!("open") };
    assert_eq!(clips[0].left_out[0].what, "observation.images.front");
    let session = Session::open(&out).expect("a session");
    assert_eq!(session.clips.len(), 2);
    for (episode, entry) in session.clips.iter().enumerate() {
        let clip = session.read(entry).expect("a clip");
        assert_eq!(clip.object.len(), 30 + 10 * episode);
        for (row, pose) in clip.object.poses.iter().enumerate() {
            assert_eq!(pose.position(), [f64::from(x(episode, row)), f64::from(-0.1_f32), f64::from(0.05_f32)]);
            assert_eq!(clip.object.stamps_ns[row] - clip.object.stamps_ns[0], row as u64 * 50_000_000);
        }
    }
    let text = std::fs::read_to_string(data.join("meta/info.json")).expect("info.json");
    let info: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&info["codebase_version"], &info["total_frames"]), (&"v3.0".into(), &70.into()));
    assert_eq!(info["features"]["action"]["shape"], serde_json::json!([1]));
}
